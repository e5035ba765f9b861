//! `meltpath measure` of records: energies per volume, how the source answers to the contact tube distance, what the voltage tells of it.

mod copies;
mod file;
pub mod found;
mod judge;
pub mod line;
mod tables;

use std::path::{Path, PathBuf};

use meltpath_base::output::OutputFolder;
use meltpath_base::settings::{Node, Place, Reader, Value, peek};
use meltpath_base::{Observer, Provenance, Reporter, Verdict};
use meltpath_deposition::electric::circuit::{Circuit, Given};
use meltpath_deposition::electric::file::CircuitFile;
use meltpath_perception::arc::ArcError;
use meltpath_perception::arc::samples::Samples;
use meltpath_perception::arc::steady::{Cut, Mean, Piece, pieces, steady};

use crate::cancel::{Stop, stops};
use crate::outcome::RunFolder;
use crate::views;
use file::Setting;
use found::ByCircuit;
use line::{Fitted, ends, span};

pub use file::{Records, RecordsFile, read as read_file};
pub use found::{Found, Recorded, Response, Told};

/// Pieces of a record in plots and tables.
const PIECES: usize = 600;
/// Feeds that are set within this share of one another are one.
const SAME: f64 = 0.02;
/// Distances show how a source answers where they span so many of their uncertainties.
const SPAN: f64 = 4.0;

meltpath_base::passes_on! {
    /// Why nothing was found in records.
    pub enum RecordsError {
        /// What stops any command.
        Stop(Stop);

        /// Records that cannot be used, each with its reason.
        #[error("{}", told.join("\n"))]
        Refused {
            /// The reasons.
            told: Vec<String>,
        },
    }
}

stops!(RecordsError);

/// Whether a file tells of records, and not of a scan.
///
/// A file that does not read is none: what reads scans tells what is wrong.
pub fn is_of_records(path: &Path) -> bool {
    let text = crate::job::text_of(path).unwrap_or_default();
    let has = |key: &str| has_key(&text, key);
    has("record") || (has("columns") && !has("scan"))
}

/// Whether a file has a key at its top.
pub(crate) fn has_key(text: &str, key: &str) -> bool {
    peek::<Anything>(text, &[key]).is_ok_and(|found| found.is_some())
}

/// A key that is there, whatever it holds.
struct Anything;

impl Value for Anything {
    const KIND: meltpath_base::settings::Kind = meltpath_base::settings::Kind::Text;

    fn read(_: &Node<'_>, _: &Place<'_>, _: &mut Reader) -> Option<Self> {
        Some(Anything)
    }

    fn json(&self) -> meltpath_base::settings::Json {
        meltpath_base::settings::Json::Null
    }
}

/// Reads the records of a file and writes a folder.
///
/// # Errors
/// [`RecordsError`]; nothing is written then.
pub fn records(
    path: &Path,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Found, RecordsError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let records = file::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let beside = |name: &str| folder.join(name);
    observer.stage("read records", records.settings.len() as u64);
    let mut beads = Vec::new();
    let mut told = Vec::new();
    for setting in &records.settings {
        observer.check()?;
        match recorded(&records, setting, &beside(&setting.file)) {
            Ok(bead) => beads.push(bead),
            Err(error) => told.push(error.to_string()),
        }
        observer.advance(1);
    }
    told.extend(copies::copied(&beads));
    if !told.is_empty() {
        return Err(RecordsError::Refused { told });
    }
    let inputs: Vec<PathBuf> = records.settings.iter().map(|s| beside(&s.file)).collect();
    let inputs = inputs.iter().chain(&records.own).map(PathBuf::as_path);
    let inputs: Vec<&Path> = std::iter::once(path).chain(inputs).collect();
    crate::outcome::record_inputs(&mut provenance, &inputs)?;
    observer.stage("fit lines", 0);
    let response = response(&records, &beads);
    by_voltage(&records, &mut beads, response.as_ref());
    judge::warn(&records, &beads, &reporter);
    judge::warn_of_map(&records, &beads, response.as_ref(), &reporter);
    let checks = judge::checks(&records, &beads, response.as_ref());
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let source = tables::source(&name, &records, response.as_ref(), &checks);
    let energy = tables::energy(&name, &records, &beads, &checks);
    let map = tables::map(&records, &source);
    for (code, written) in [("no-response", &source), ("no-energy", &energy)] {
        if let Err(why) = written {
            reporter.warn(code, why.clone(), "mend what it tells");
        }
    }
    models(&mut provenance, &records);
    let mut found = Found {
        verdict: Verdict {
            checks,
            facts: judge::facts(&records, &beads, response.as_ref()),
            warnings: reporter.warnings(),
        },
        records,
        beads,
        response,
        energy,
        source,
        map,
        folder: PathBuf::new(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let report = views::records::report(&path.display().to_string(), &found, &provenance);
    let files = |folder: &OutputFolder| views::records::write_files(folder, &found);
    found.folder = crate::outcome::leave(home, &report, files)?;
    Ok(found)
}

fn models(provenance: &mut Provenance, records: &Records) {
    provenance.model(
        "energy per volume",
        "mean of the products of voltage and current over wire section and measured feed (Rouchon 2022, equation 2.16)",
    );
    provenance.model(
        "feed, voltage and current over the distance",
        "straight lines of least squares: the control law of the source is not known (ours, after the two rows of Rouchon 2022, table 4.4)",
    );
    if let Some(circuit) = &records.circuit {
        let told = format!("{}: Rouchon 2022, equations 4.1 to 4.7", *circuit.id);
        provenance.model("circuit of source, stick-out and arc", &told);
    }
}

/// Reads one record.
fn recorded(records: &Records, setting: &Setting, path: &Path) -> Result<Recorded, ArcError> {
    let file = &records.file;
    let sample_time = file.sample_time.map(|t| t.0);
    let samples = Samples::read(path, &file.columns, sample_time, setting.within)?;
    let cut = Cut {
        ignition: file.ignition.seconds(setting.travel_speed),
        end: file.end.seconds(setting.travel_speed),
        arc_current: file.arc_current.0,
    };
    let steady = steady(&path.display().to_string(), &samples, cut)?;
    let mut bead = Recorded {
        setting: setting.clone(),
        pieces: pieces(&samples, PIECES),
        steady,
        wire_section: records.wire.section(),
        told: None,
        circuit: None,
    };
    if let (Some(file), Some(distance)) = (&records.circuit, setting.distance) {
        let circuit = file.circuit(&records.wire);
        bead.circuit = by_circuit(file, &circuit, &bead, distance);
    }
    Ok(bead)
}

/// What the circuit tells of a record; nothing where no arc burns steadily in it.
fn by_circuit(
    file: &CircuitFile,
    circuit: &Circuit,
    bead: &Recorded,
    distance: f64,
) -> Option<ByCircuit> {
    let (voltage, current) = (bead.steady.voltage.value, bead.steady.current.value);
    let feed = bead.steady.feed?.value;
    let given = Given {
        feed,
        voltage,
        distance,
    };
    let rest = circuit.at_rest(given).ok()?;
    let [from, to] = bead.steady.used;
    let used = bead.pieces.iter().filter(|p| (from..to).contains(&p.time));
    let used: Vec<&Piece> = used.filter(|p| p.feed[0].is_finite()).collect();
    let (mut arc, mut before) = (rest, from);
    let mut course = Vec::with_capacity(used.len());
    for piece in used {
        let given = Given {
            feed: piece.feed[0],
            voltage: piece.voltage[0],
            distance,
        };
        arc = circuit.after(arc, given, piece.time - before);
        before = piece.time;
        course.push([piece.time, arc.current]);
    }
    Some(ByCircuit {
        current: rest.current,
        stick_out: rest.stick_out,
        distance: circuit.distance(feed, voltage, current),
        covered: file.covers(feed, distance),
        course,
    })
}

/// The records of one feed that was set whose distances span most, in the order of the file.
fn group(beads: &[Recorded]) -> Vec<usize> {
    let distance = |k: &usize| beads[*k].setting.distance.unwrap_or(0.0);
    let of = |set: f64| -> Vec<usize> {
        let same = |b: &Recorded| (b.setting.wire_feed / set - 1.0).abs() <= SAME;
        let all = beads.iter().enumerate();
        let told = all.filter(|(_, b)| b.setting.distance.is_some() && same(b));
        told.map(|(k, _)| k).collect()
    };
    let groups = beads.iter().map(|b| of(b.setting.wire_feed));
    groups
        .rev()
        .max_by(|a, b| span(a.iter().map(distance)).total_cmp(&span(b.iter().map(distance))))
        .unwrap_or_default()
}

/// A line through what `of` tells of the records `which`.
fn line(
    records: &Records,
    beads: &[Recorded],
    which: &[usize],
    reference: f64,
    of: impl Fn(&Recorded) -> Option<Mean>,
) -> Option<Fitted> {
    let point = |k: &usize| Some((beads[*k].setting.distance?, of(&beads[*k])?));
    let points: Option<Vec<(f64, Mean)>> = which.iter().map(point).collect();
    let points = points?;
    let sigma = records.file.distance_uncertainty.0;
    let spans = span(points.iter().map(|(d, _)| *d)) >= SPAN * sigma;
    Fitted::of(&points, reference, sigma).filter(|_| spans)
}

/// How the source answers to the distance; `None` where one distance was recorded, or no feed.
fn response(records: &Records, beads: &[Recorded]) -> Option<Response> {
    let of = group(beads);
    let first = beads[*of.first()?].setting.distance?;
    let measured = ends(of.iter().filter_map(|k| beads[*k].setting.distance));
    let mapped = records.map.as_ref();
    let mapped = mapped.and_then(|(map, _)| Some(map.feed_response.as_ref()?.reference.0));
    let reference = mapped
        .or(records.file.first_distance.map(|d| d.0))
        .filter(|d| (measured[0]..=measured[1]).contains(d))
        .unwrap_or(first);
    let line =
        |of_bead: fn(&Recorded) -> Option<Mean>| line(records, beads, &of, reference, of_bead);
    Some(Response {
        programmed: beads[of[0]].setting.wire_feed,
        reference,
        measured,
        feed: line(|b| b.steady.feed)?,
        voltage: line(|b| Some(b.steady.voltage))?,
        current: line(|b| Some(b.steady.current))?,
        power: line(|b| Some(b.steady.power))?,
        of: of.clone(),
    })
}

/// The distance that each voltage tells: by the line of the process map, else by that of the other records.
fn by_voltage(records: &Records, beads: &mut [Recorded], response: Option<&Response>) {
    let sigma_of_map = |mean: Mean, slope: f64, sigma: Option<f64>| {
        sigma.unwrap_or(0.0).hypot(mean.scatter) / slope.abs()
    };
    let mapped = records.map.as_ref();
    let mapped = mapped.and_then(|(map, _)| map.electric.as_ref());
    for k in 0..beads.len() {
        let (set, voltage) = (beads[k].setting.wire_feed, beads[k].steady.voltage);
        if let Some(known) = mapped.filter(|m| m.lines().of_feed(set)) {
            let lines = known.lines();
            let sigma = sigma_of_map(voltage, lines.voltage.slope, known.voltage.uncertainty);
            let told = lines.distance(voltage.value);
            beads[k].told = told.map(|distance| Told { distance, sigma });
            continue;
        }
        let Some(response) = response.filter(|r| r.of.contains(&k)) else {
            continue;
        };
        let others: Vec<usize> = response.of.iter().copied().filter(|n| *n != k).collect();
        let line = line(records, beads, &others, response.reference, |b| {
            Some(b.steady.voltage)
        });
        let told = line.and_then(|line| line.distance(voltage));
        beads[k].told = told.map(|[distance, sigma]| Told { distance, sigma });
    }
}
