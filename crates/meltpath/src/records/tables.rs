//! The files that jobs and process maps take.

use std::fmt::Write;
use std::path::Path;

use meltpath_base::Check;
use toml::{Table, Value};

use super::file::Records;
use super::found::{PER_MINUTE, Recorded, Response, Written};
use super::judge::{OF_DISTANCE, failing};
use super::line::ends;

/// From so many records on their own range tells how far energies scatter.
const RANGE: usize = 3;

fn word(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

/// A number of a data file: value and uncertainty, unit, source, note.
fn datum([value, sigma]: [f64; 2], unit: &str, source: &str, note: &str) -> String {
    let uncertainty = if sigma > 0.0 {
        format!(", uncertainty = {sigma:.5}")
    } else {
        String::new()
    };
    let note = if note.is_empty() {
        String::new()
    } else {
        format!(", note = {}", word(note))
    };
    format!(
        "{{ value = {value:.5}, unit = \"{unit}\"{uncertainty}, source = {}, page = \"records\"{note} }}",
        word(source)
    )
}

/// The tables `[feed_response]` and `[electric]`.
pub(super) fn source(
    name: &str,
    records: &Records,
    response: Option<&Response>,
    checks: &[Check],
) -> Written {
    let no = |why: &str| {
        Err(format!(
            "how the feed follows the contact tube distance is not written: {why}"
        ))
    };
    if records.file.columns.feed.is_none() {
        return no("the records hold no wire feed (columns.feed)");
    }
    let Some(response) = response else {
        return no(
            "it takes records of one feed that was set at two distances or more, four of their uncertainties apart (distance, distance_uncertainty)",
        );
    };
    let Some(band) = *records.file.stabiliser else {
        return no(
            "stabiliser is not told: write the setting of the source's penetration stabiliser, 0 m/min for a source without",
        );
    };
    if let Some(ids) = failing(checks, |_| true) {
        return no(&format!("checks fail ({ids})"));
    }
    let [slope, sigma] = response.feed.slope.map(|s| PER_MINUTE * s);
    let sloped = response.feed.is_sloped();
    if sloped && band.0 == 0.0 {
        return no(&format!(
            "the feed changes by {slope:.3} m/min per mm, and stabiliser = \"0 m/min\" says that it is held: write the setting of the stabiliser"
        ));
    }
    let held = band.0 == 0.0;
    let (slope, told) = if held {
        (0.0, "the feed is held: no change was told from none")
    } else {
        (
            slope.max(0.0),
            "a line of least squares through the mean feed of each record",
        )
    };
    let of = |value: [f64; 2], unit, note| datum(value, unit, name, note);
    let number = |value: f64, unit| of([value, 0.0], unit, "");
    let [near, far] = response.measured;
    let known = records.file.distance_uncertainty.0;
    let factor = 100.0 * response.feed.value[0] / response.programmed;
    // writing into a string does not fail
    let mut text = format!(
        "# Written by `meltpath measure` from {} records: tables of a process map.\n# The source fed {factor:.1} % of what was set at {:.2} mm. In a job of this installation: [waam.source] feed_factor = \"{factor:.1} %\"\n\n[feed_response]\n",
        response.of.len(),
        response.reference
    );
    let _ = writeln!(text, "slope = {}", of([slope, sigma], "m/min/mm", told));
    let _ = writeln!(
        text,
        "reference = {}",
        of([response.reference, known], "mm", "")
    );
    let _ = writeln!(
        text,
        "stabiliser = {}",
        of(
            [band.0, 0.0],
            "m/min",
            "setting of the penetration stabiliser"
        )
    );
    let ends = format!(
        "least = {}\ngreatest = {}\n",
        number(near, "mm"),
        number(far, "mm")
    );
    text += &ends;
    let _ = write!(
        text,
        "\n[electric]\nprogrammed = {}\nreference = {}\nfeed = {}\nfeed_slope = {}\nvoltage = {}\nvoltage_slope = {}\ncurrent = {}\ncurrent_slope = {}\npower = {}\npower_slope = {}\n{ends}",
        number(PER_MINUTE * response.programmed, "m/min"),
        of([response.reference, known], "mm", ""),
        of(response.feed.value.map(|v| PER_MINUTE * v), "m/min", ""),
        of(response.feed.slope.map(|v| PER_MINUTE * v), "m/min/mm", ""),
        of(response.voltage.value, "V", ""),
        of(response.voltage.slope, "V/mm", ""),
        of(response.current.value, "A", ""),
        of(response.current.slope, "A/mm", ""),
        of(
            response.power.value,
            "W",
            "mean of the products of voltage and current"
        ),
        of(response.power.slope, "W/mm", ""),
    );
    Ok(text)
}

/// The process map of the file with the tables.
pub(super) fn map(records: &Records, source: &Written) -> Written {
    let Some((_, text)) = &records.map else {
        return Err("the file names no process map (map)".to_owned());
    };
    let tables = source.as_ref().map_err(Clone::clone)?;
    // both were read before
    let read = |text: &str| text.parse::<Table>().map_err(|e| e.to_string());
    let mut map = read(text)?;
    map.extend(read(tables)?);
    let text = toml::to_string(&map).map_err(|e| e.to_string())?;
    Ok(format!(
        "# Written by `meltpath measure`: the process map of the records with how its source answers to the contact tube distance.\n# Name it in a job: [waam] map = \"map.toml\".\n{text}"
    ))
}

/// The table of energies.
pub(super) fn energy(
    name: &str,
    records: &Records,
    beads: &[Recorded],
    checks: &[Check],
) -> Written {
    let no = |why: &str| Err(format!("no table of energies is written: {why}"));
    let (Some(gas), Some(mode)) = (&records.gas, &*records.file.mode) else {
        return no("the file does not tell gas and mode");
    };
    if records.file.columns.feed.is_none() {
        return no(
            "the records hold no wire feed (columns.feed), and by the feed that is set energies come out 3.5 to 26 % too high",
        );
    }
    if let Some(ids) = failing(checks, |id| !OF_DISTANCE.contains(&id)) {
        return no(&format!("checks fail ({ids})"));
    }
    let energies: Vec<f64> = beads.iter().map(|b| b.energy().value).collect();
    let mean = energies.iter().sum::<f64>() / energies.len() as f64;
    // a table takes a quarter of the range as the standard uncertainty of a bead: of few beads their own scatter tells more
    let wide = |b: &Recorded| {
        if beads.len() < RANGE {
            2.0 * b.energy().scatter
        } else {
            0.0
        }
    };
    let [least, greatest] = ends(beads.iter().flat_map(|b| {
        let value = b.energy().value;
        [value - wide(b), value + wide(b)]
    }));
    let file = Path::new(name)
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy();
    Ok(format!(
        "# Written by `meltpath measure` from {} records: energies per volume by the feed that was measured. Name it in a job: [waam] energy = \"energy.toml\".\nschema = 1\nid = {}\nsource = {}\npage = \"records\"\nunit = \"J/mm3\"\n# wire, mode, gas, mean, least, greatest\nrows = [\n  [{}, {}, {}, {mean:.3}, {least:.3}, {greatest:.3}],\n]\n",
        beads.len(),
        word(&format!("{file}-measured")),
        word(name),
        word(&records.wire.id),
        word(mode),
        word(gas),
    ))
}
