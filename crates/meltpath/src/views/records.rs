//! What records of a deposit look like.

use meltpath_base::Provenance;
use meltpath_base::number::with_uncertainty;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_perception::arc::steady::{Mean, Piece};
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::{Mark, Plot};
use meltpath_report::table::{Cell, Table};

use crate::records::line::Fitted;
use crate::records::{Found, Recorded, Response};

/// Records whose course is drawn.
const DRAWN: usize = 8;
/// Points of a line over the distance.
const POINTS: u32 = 40;
/// m/min of a mm/s.
const PER_MINUTE: f64 = 0.06;

fn number(value: Option<f64>, decimals: usize) -> Cell {
    Cell::Fixed(value.unwrap_or(f64::NAN), decimals)
}

fn means(found: &Found) -> Table {
    Table::of(
        "Means where the arc burns steadily",
        found.beads.iter().map(|b| {
            let s = &b.steady;
            [
                ("record", Cell::text(&b.setting.file)),
                ("distance (mm)", number(b.setting.distance, 2)),
                ("used (s)", Cell::Fixed(s.used[1] - s.used[0], 1)),
                ("voltage (V)", Cell::Fixed(s.voltage.value, 2)),
                ("±", Cell::Fixed(s.voltage.scatter, 2)),
                ("current (A)", Cell::Fixed(s.current.value, 1)),
                ("±", Cell::Fixed(s.current.scatter, 1)),
                ("power (W)", Cell::Fixed(s.power.value, 0)),
                ("wire feed (m/min)", number(s.feed.map(|f| PER_MINUTE * f.value), 2)),
                ("±", number(s.feed.map(|f| PER_MINUTE * f.scatter), 2)),
                ("of the feed set (%)", number(b.factor().map(|f| 100.0 * f.value), 1)),
                ("feed over travel", Cell::Fixed(b.ratio(), 2)),
            ]
        }),
    )
    .noted("± is how far the means of the tenths of a bead are from its mean. Power is the mean of the products of voltage and current. Feed over travel is the ratio λ that decides how a bead looks: by the feed that was measured, where one was.")
}

fn energies(found: &Found) -> Table {
    Table::of(
        "Energies",
        found.beads.iter().map(|b| {
            let told = b.told;
            let circuit = b.circuit.as_ref();
            [
                ("record", Cell::text(&b.setting.file)),
                ("energy per volume (J/mm³)", Cell::Fixed(b.energy().value, 2)),
                ("±", Cell::Fixed(b.energy().scatter, 2)),
                ("of mean voltage and current", Cell::Fixed(b.energy_of_means(), 2)),
                ("by the feed set", Cell::Fixed(b.energy_by_set_feed(), 2)),
                ("per length (J/mm)", Cell::Fixed(b.energy_per_length(), 1)),
                ("distance told (mm)", number(b.setting.distance, 2)),
                ("distance by the voltage (mm)", number(told.map(|t| t.distance), 2)),
                ("±", number(told.map(|t| t.sigma), 2)),
                ("distance by the circuit (mm)", number(circuit.and_then(|c| c.distance), 2)),
                ("current by the circuit (A)", number(circuit.map(|c| c.current), 1)),
                ("stick-out by the circuit (mm)", number(circuit.map(|c| c.stick_out), 2)),
            ]
        }),
    )
    .noted("The distance by the voltage comes from the line of the process map, or from that of the other records: never from the record itself. The circuit is the model of source, stick-out and arc with its constants; outside the feeds and distances at which they were fitted it is a guess.")
}

/// A stretch of time that is left out, over the height of a plot.
fn left_out(plot: Plot, name: &str, [from, to]: [f64; 2], [low, high]: [f64; 2]) -> Plot {
    let outline = [[from, low], [to, low], [to, high], [from, high]];
    plot.with(Mark::Area {
        name: name.to_owned(),
        outline: outline.map(DVec2::from_array).to_vec(),
    })
}

/// One quantity of a record over time, what is left out of it shaded.
fn course(
    bead: &Recorded,
    [label, unit]: [&str; 2],
    mean: Mean,
    of: impl Fn(&Piece) -> [f64; 3],
) -> Plot {
    let values: Vec<(f64, [f64; 3])> = bead.pieces.iter().map(|p| (p.time, of(p))).collect();
    let points = |n: usize| -> Vec<DVec2> {
        let all = values.iter();
        all.map(|(t, v)| DVec2::new(*t, v[n])).collect()
    };
    let finite = values.iter().filter(|(_, v)| v[0].is_finite());
    let low = finite.clone().map(|(_, v)| v[1]).fold(0.0, f64::min);
    let high = finite.map(|(_, v)| v[2]).fold(0.0, f64::max);
    let title = format!("{}: {label}", bead.setting.file);
    let mut plot = Plot::new(&title, ["time", "s"], [label, unit]);
    let ([lit, dark], [from, to]) = (bead.steady.burns, bead.steady.used);
    let height = [low, high];
    plot = left_out(plot, "left out after the ignition", [lit, from], height);
    plot = left_out(plot, "left out before the end", [to, dark], height);
    for out in &bead.steady.out {
        plot = left_out(plot, "no arc", *out, height);
    }
    plot = plot.band("least to greatest", points(1), points(2));
    plot = plot.line("mean of a piece", points(0));
    let used = [from, to].map(|t| DVec2::new(t, mean.value)).to_vec();
    plot.line("mean where it is steady", used)
}

fn courses(found: &Found) -> Vec<Plot> {
    let mut plots = Vec::new();
    for bead in found.beads.iter().take(DRAWN) {
        let s = &bead.steady;
        plots.push(course(bead, ["voltage", "V"], s.voltage, |p| p.voltage));
        let mut current = course(bead, ["current", "A"], s.current, |p| p.current);
        if let Some(circuit) = &bead.circuit {
            let points = circuit.course.iter().copied().map(DVec2::from_array);
            current = current.line("by the circuit, of feed and voltage", points.collect());
        }
        plots.push(current);
        if let Some(feed) = s.feed {
            let feed = Mean {
                value: PER_MINUTE * feed.value,
                scatter: 0.0,
            };
            let of = |p: &Piece| p.feed.map(|v| PER_MINUTE * v);
            plots.push(course(bead, ["wire feed", "m/min"], feed, of));
        }
    }
    plots
}

/// A quantity over the contact tube distance, with its line.
fn over_distance(
    found: &Found,
    response: &Response,
    (line, scale): (Fitted, f64),
    label: [&str; 2],
    of: impl Fn(&Recorded) -> f64,
) -> Plot {
    let [near, far] = response.measured;
    let at = |k: u32| near + (far - near) * f64::from(k) / f64::from(POINTS);
    let edge = |sign: f64| -> Vec<DVec2> {
        let point = |k: u32| {
            let [value, sigma] = line.at(at(k));
            DVec2::new(at(k), scale * (value + sign * sigma))
        };
        (0..=POINTS).map(point).collect()
    };
    let dots = response.of.iter().filter_map(|k| {
        let bead = found.beads.get(*k)?;
        Some(DVec2::new(bead.setting.distance?, scale * of(bead)))
    });
    let dots = dots.collect();
    Plot::new(
        &format!("{} over the contact tube distance", label[0]),
        ["contact tube distance", "mm"],
        label,
    )
    .band("one standard uncertainty", edge(-1.0), edge(1.0))
    .line("line of least squares", edge(0.0))
    .dots("records", dots)
}

fn lines_over_distance(found: &Found, response: &Response) -> Section {
    let r = response;
    let plot = |line, label, of: fn(&Recorded) -> f64| over_distance(found, r, line, label, of);
    let plots = vec![
        plot((r.feed, PER_MINUTE), ["wire feed", "m/min"], Recorded::feed),
        plot((r.voltage, 1.0), ["voltage", "V"], |b| {
            b.steady.voltage.value
        }),
        plot((r.current, 1.0), ["current", "A"], |b| {
            b.steady.current.value
        }),
    ];
    let intro = format!(
        "{} records at {:.2} m/min set. The lines hold between {:.1} and {:.1} mm.",
        r.of.len(),
        PER_MINUTE * r.programmed,
        r.measured[0],
        r.measured[1]
    );
    Section::new(
        "How the source answers to the distance",
        intro,
        plots,
        Vec::new(),
    )
}

/// The report.
pub fn report(file: &str, found: &Found, provenance: &Provenance) -> Report {
    let mut sections = vec![Section::new(
        "Means and energies",
        "",
        Vec::new(),
        vec![means(found), energies(found)],
    )];
    sections.extend(
        found
            .response
            .as_ref()
            .map(|r| lines_over_distance(found, r)),
    );
    let left = found.beads.len().saturating_sub(DRAWN);
    let note = if left > 0 {
        format!("The first {DRAWN} records are drawn; the other {left} are in series.csv.")
    } else {
        String::new()
    };
    sections.push(Section::new(
        "Records over time",
        note,
        courses(found),
        Vec::new(),
    ));
    Report {
        title: "Records of a deposit".to_owned(),
        subtitle: format!(
            "{file} · {} records · {}",
            found.beads.len(),
            *found.records.wire.name
        ),
        verdict: found.verdict.clone(),
        scene: None,
        sections,
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// What a terminal shows.
pub fn lines(found: &Found) -> Vec<String> {
    let mut lines: Vec<String> = found.beads.iter().map(line).collect();
    for (name, written, told) in [
        (
            "map.toml",
            &found.map,
            "the process map with how its source answers to the distance; name it in a job: [waam] map",
        ),
        (
            "source.toml",
            &found.source,
            "[feed_response] and [electric], for a process map",
        ),
        (
            "energy.toml",
            &found.energy,
            "energies per volume; name it in a job: [waam] energy",
        ),
    ] {
        if written.is_ok() {
            lines.push(format!("{name}: {told}"));
        }
    }
    lines
}

fn line(bead: &Recorded) -> String {
    let told = |m: Mean, scale: f64| with_uncertainty(scale * m.value, scale * m.scatter);
    let s = &bead.steady;
    let feed = match (s.feed, bead.factor()) {
        (Some(feed), Some(factor)) => format!(
            "{} m/min ({:.0} % of what was set)",
            told(feed, PER_MINUTE),
            100.0 * factor.value
        ),
        _ => format!("{:.2} m/min set", PER_MINUTE * bead.setting.wire_feed),
    };
    let by = bead.told.map_or_else(String::new, |t| {
        format!(
            ", by the voltage {} mm",
            with_uncertainty(t.distance, t.sigma)
        )
    });
    let distance = bead.setting.distance;
    let distance = distance.map_or_else(String::new, |d| format!("; at {d:.1} mm{by}"));
    format!(
        "{}: {} V, {} A, {feed}, feed over travel {:.2}, {} J/mm³{distance}",
        bead.setting.file,
        told(s.voltage, 1.0),
        told(s.current, 1.0),
        bead.ratio(),
        told(bead.energy(), 1.0),
    )
}

/// Writes the numbers, the records in pieces, and the files that jobs and maps take.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    folder.write("records.csv", |w| {
        writeln!(
            w,
            "record,layer,distance_mm,wire_feed_set_mm_s,travel_speed_mm_s,used_from_s,used_to_s,arc_out_s,missing_s,samples,voltage_V,voltage_scatter_V,current_A,current_scatter_A,wire_feed_mm_s,wire_feed_scatter_mm_s,power_W,power_scatter_W,feed_over_travel,energy_J_mm3,energy_scatter_J_mm3,energy_of_means_J_mm3,energy_by_set_feed_J_mm3,energy_per_length_J_mm,distance_by_voltage_mm,distance_by_voltage_sigma_mm,distance_by_circuit_mm,current_by_circuit_A"
        )?;
        for b in &found.beads {
            let (s, set) = (&b.steady, &b.setting);
            let nan = Mean { value: f64::NAN, scatter: f64::NAN };
            let (feed, energy, circuit) = (s.feed.unwrap_or(nan), b.energy(), b.circuit.as_ref());
            let numbers = [
                set.layer.map_or(f64::NAN, f64::from),
                set.distance.unwrap_or(f64::NAN),
                set.wire_feed,
                set.travel_speed,
                s.used[0],
                s.used[1],
                s.out.iter().map(|[a, b]| b - a).sum(),
                s.missing,
                s.samples as f64,
                s.voltage.value,
                s.voltage.scatter,
                s.current.value,
                s.current.scatter,
                feed.value,
                feed.scatter,
                s.power.value,
                s.power.scatter,
                b.ratio(),
                energy.value,
                energy.scatter,
                b.energy_of_means(),
                b.energy_by_set_feed(),
                b.energy_per_length(),
                b.told.map_or(f64::NAN, |t| t.distance),
                b.told.map_or(f64::NAN, |t| t.sigma),
                circuit.and_then(|c| c.distance).unwrap_or(f64::NAN),
                circuit.map_or(f64::NAN, |c| c.current),
            ];
            write!(w, "\"{}\"", set.file.replace('"', "\"\""))?;
            for number in numbers {
                write!(w, ",{number}")?;
            }
            writeln!(w)?;
        }
        Ok(())
    })?;
    folder.write("series.csv", |w| {
        writeln!(w, "record,time_s,voltage_V,voltage_least_V,voltage_greatest_V,current_A,current_least_A,current_greatest_A,wire_feed_mm_s,wire_feed_least_mm_s,wire_feed_greatest_mm_s")?;
        for (k, bead) in found.beads.iter().enumerate() {
            for p in &bead.pieces {
                write!(w, "{},{}", k + 1, p.time)?;
                for number in p.voltage.iter().chain(&p.current).chain(&p.feed) {
                    write!(w, ",{number}")?;
                }
                writeln!(w)?;
            }
        }
        Ok(())
    })?;
    for (name, written) in [
        ("source.toml", &found.source),
        ("map.toml", &found.map),
        ("energy.toml", &found.energy),
    ] {
        if let Ok(text) = written {
            folder.write(name, |w| w.write_all(text.as_bytes()))?;
        }
    }
    Ok(())
}
