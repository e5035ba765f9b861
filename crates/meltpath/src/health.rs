//! `meltpath health`: the periodic test KM0 of an axis, its dated history, what drifted and what that may mean.
//!
//! Source: Rasoanarivo 2020, § 2.4. The history is a file of lines, one JSON record a test, to which tests are only ever added.

mod checks;
pub mod error;
pub mod history;

use std::path::{Path, PathBuf};

use crate::data::DataText;
use crate::identify::bench;
use crate::views;
use meltpath_base::output::OutputFolder;
use meltpath_base::{Provenance, Reporter, Verdict};
use meltpath_data::scan_heads;
use meltpath_perception::{Mapping, Record, RecordError, read};
use meltpath_scan_head::axis::chain::{Axis, AxisRecord};
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::files;
use meltpath_scan_head::health::bench::{
    Harmless, Km0Stage1, first_stage, harmless, looked_for, simulate_first_stage,
    simulate_second_stage,
};
use meltpath_scan_head::health::rating::{Drift, Km0Record, Rating, rate};
use meltpath_scan_head::health::signal::{Km0Samples, Km0Signal};
use meltpath_scan_head::identification::record::Excitation;

pub use error::HealthError;
pub use history::{Entry, History, HistoryError};

/// Amplitude of the binary sequence of a written signal, V.
const AMPLITUDE: f64 = 0.5;

/// The axis that is tested.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    /// The machine, as its owner names it.
    pub machine: String,
    /// The head: a name in `data/scan-heads`, or a file.
    pub head: String,
    /// `x`, `y` or `z`.
    pub axis: String,
    /// Its data.
    data: Axis,
    /// Sample period, s.
    period: f64,
}

impl Subject {
    /// Reads the head and finds the axis.
    ///
    /// # Errors
    /// [`HealthError::Head`], [`HealthError::Axis`].
    pub fn find(machine: &str, head: &str, axis: &str) -> Result<Self, HealthError> {
        let wrong = |message: String| HealthError::Head {
            name: head.to_owned(),
            message,
        };
        let scan_head = DataText::load("scan head", head, scan_heads::ALL, Path::new(""))
            .and_then(|text| text.read(files::parse_head))
            .map_err(|e| wrong(e.to_string()))?
            .head;
        let [x, y] = &scan_head.mirrors;
        let z = scan_head.focus.as_ref().map(|(z, _)| z);
        let axes = [("x", Some(x)), ("y", Some(y)), ("z", z)];
        let found = axes
            .iter()
            .find(|(name, _)| name.eq_ignore_ascii_case(axis))
            .and_then(|(_, a)| *a);
        let found = found.ok_or_else(|| HealthError::Axis {
            head: head.to_owned(),
            axis: axis.to_owned(),
            known: axes
                .iter()
                .filter(|(_, a)| a.is_some())
                .map(|(n, _)| *n)
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        let data = found
            .motor()
            .map_err(|e| wrong(format!("its {axis} axis: {e}")))?
            .clone();
        Ok(Subject {
            machine: machine.to_owned(),
            head: head.to_owned(),
            axis: axis.to_lowercase(),
            data,
            period: scan_head.period,
        })
    }

    /// Machine, head and axis in one.
    pub fn name(&self) -> String {
        let head = Path::new(&self.head)
            .file_stem()
            .map_or_else(|| self.head.clone(), |s| s.to_string_lossy().into_owned());
        format!("{}/{head}/{}", self.machine, self.axis)
    }

    /// Modes of its file that the first stage looks for, Hz.
    fn modes(&self) -> Vec<f64> {
        let modes = self.data.motor.modes.iter();
        modes
            .map(|mode| mode.omega / std::f64::consts::TAU)
            .filter(|f| looked_for(*f, self.period))
            .collect()
    }

    fn signal(&self) -> Result<Km0Samples, HealthError> {
        Ok(Km0Signal::for_axis(&self.data).samples(self.period)?)
    }

    /// Writes both stages' signals, the first as large as the head's own motor bears within its travel, to be played by the bench or the machine: `stage1.csv` (motor voltage, open loop) and
    /// `stage2.csv` (set-points of the closed loop).
    ///
    /// # Errors
    /// [`HealthError`].
    pub fn write_signal(&self, folder: &Path) -> Result<PathBuf, HealthError> {
        let out = OutputFolder::create(folder)?;
        let column = |name: &str, head: &str, values: &[f64]| {
            out.write(name, |w| {
                writeln!(w, "time_s,{head}")?;
                for (k, v) in values.iter().enumerate() {
                    writeln!(w, "{:.9},{v}", k as f64 * self.period)?;
                }
                Ok(())
            })
        };
        let voltage = match harmless(&self.data, self.period, AMPLITUDE)? {
            Harmless::Sequence(voltage) => voltage,
            Harmless::Never(reached) => {
                return Err(HealthError::Stops {
                    axis: self.axis.to_uppercase(),
                    reached: reached.to_degrees(),
                    travel: self.data.travel.to_degrees(),
                });
            }
        };
        column("stage1.csv", "voltage_V", &voltage)?;
        let degrees: Vec<f64> = self
            .signal()?
            .set_points
            .iter()
            .map(|v| v.to_degrees())
            .collect();
        column("stage2.csv", "set_point_deg", &degrees)?;
        Ok(out.commit()?)
    }
}

/// Where the two records of a test come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Bench {
    /// Files, with the mapping that says which column is what.
    Records {
        /// First stage: `voltage`, `current`, `angle`; `set-point` where the loop was closed.
        first: PathBuf,
        /// Second stage: `current`, `angle`; `set-point` to find where the signal begins.
        second: PathBuf,
        /// The mapping of both.
        mapping: PathBuf,
    },
    /// The head's own data, changed: factors on its parameters, `NAME=FACTOR`.
    Simulated(Vec<String>),
}

/// Circumstances of a test.
#[derive(Debug, Clone, PartialEq)]
pub struct Circumstances {
    /// When, ISO 8601 with zone.
    pub time: String,
    /// Temperature, °C, where known.
    pub temperature: Option<f64>,
    /// Whether this test becomes the one to compare with (after an intervention); the first always does.
    pub accept: bool,
}

impl Circumstances {
    fn check(&self) -> Result<(), HealthError> {
        let wrong = |what, told: &str, remedy| HealthError::Circumstance {
            what,
            told: told.to_owned(),
            remedy,
        };
        let zone = "a date by ISO 8601, or a time with its zone: 2026-03-05T08:30:00+01:00";
        self.time
            .parse::<toml::value::Datetime>()
            .ok()
            .filter(|told| told.date.is_some() && told.time.is_some() == told.offset.is_some())
            .ok_or_else(|| wrong("the time", &self.time, zone))?;
        match self.temperature {
            Some(t) if !(t >= -273.15 && t.is_finite()) => {
                Err(wrong("the temperature", &t.to_string(), "degrees Celsius"))
            }
            _ => Ok(()),
        }
    }
}

/// A test, compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The rating of the axis.
    pub rating: Rating,
    /// What drifted, the worst first; empty for the first test.
    pub drifts: Vec<Drift>,
    /// As checks.
    pub verdict: Verdict,
    /// The folder of the report.
    pub folder: PathBuf,
    /// Number of tests in the history, this one included.
    pub tests: usize,
}

/// Runs a test and adds it to the history in `folder`.
///
/// # Errors
/// [`HealthError`]; the history is not touched then.
pub fn test(
    subject: &Subject,
    bench: &Bench,
    folder: &Path,
    circumstances: &Circumstances,
    reporter: &Reporter,
) -> Result<Outcome, HealthError> {
    circumstances.check()?;
    let mut history = History::open(folder, &subject.name())?;
    let signal = subject.signal()?;
    let (first, response) = match bench {
        Bench::Records {
            first,
            second,
            mapping,
        } => recorded(subject, &signal, [first, second], mapping, reporter)?,
        Bench::Simulated(changes) => {
            let axis = changed(&subject.data, changes)?;
            let bench = simulate_first_stage(&axis, subject.period)?;
            (
                first_stage(&bench.record(), Excitation::Voltage)?,
                simulate_second_stage(&axis, &signal, subject.period)?,
            )
        }
    };
    let stage2 = signal.analyse(&response, first.motor.torque_constant);
    let stage2 = stage2.map_err(HealthError::Second)?;
    let record = Km0Record {
        axis: subject.name(),
        time: circumstances.time.clone(),
        temperature: circumstances.temperature,
        ..first.record(stage2)
    };
    let drifts = history
        .reference()
        .map(|reference| rate(reference, &record, &subject.modes()))
        .unwrap_or_default();
    let accepted = history.reference().map_or(&[][..], |r| &r.modes);
    let missing = checks::missing_modes(&subject.modes(), accepted, &record.modes, reporter);
    let rating = drifts.first().map_or(Rating::Good, |d| d.rating);
    let verdict = Verdict {
        checks: checks::of(&drifts).into_iter().chain(missing).collect(),
        facts: Vec::new(),
        warnings: reporter.digest(3),
    };
    let entry = Entry::new(record, circumstances.accept, rating, &drifts);
    let report = OutputFolder::create_numbered(&folder.join("reports"))?;
    let told = views::health::Told {
        name: &subject.name(),
        provenance: &provenance(subject),
        first: &first,
        history: &history,
        entry: &entry,
        drifts: &drifts,
        verdict: &verdict,
    };
    views::health::write(&report, &told)?;
    history.add(entry)?;
    Ok(Outcome {
        rating,
        drifts,
        verdict,
        folder: report.commit()?,
        tests: history.entries().len(),
    })
}

/// Share of the travel from which on a motor may stand at its stop.
const STOP: f64 = 0.98;

/// Tells a record whose motor left its travel: what is found from it is the stop's.
fn at_a_stop(subject: &Subject, (stage, angle): (&str, &[f64]), reporter: &Reporter) {
    let travel = subject.data.travel;
    let beyond = angle.iter().filter(|a| a.abs() >= STOP * travel).count();
    if beyond > 0 {
        let farthest = angle.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        reporter.warn(
            "at-a-stop",
            format!(
                "the {stage} stage's angle stands at or beyond the end of the travel (±{:.2} deg) for {:.1} % of the record, up to {:.2} deg: what is found there is the stop's, not the motor's",
                travel.to_degrees(),
                100.0 * beyond as f64 / angle.len() as f64,
                farthest.to_degrees()
            ),
            "write the signal anew with `meltpath health --signal`, play it from the middle of the travel, and look at the zero of the angle in the mapping",
        );
    }
}

/// The record of the first stage, which has no set-points where its voltage was played in open loop.
fn first_record(
    path: &Path,
    mapping: &Mapping,
    reporter: &Reporter,
) -> Result<Record, RecordError> {
    let set_point = mapping.channels.get(SET_POINT);
    let without = set_point.map(|source| source.column.to_string());
    match read(path, mapping, reporter) {
        Err(RecordError::Column { column, .. }) if Some(&column) == without.as_ref() => {
            let mut open = mapping.clone();
            open.channels.remove(SET_POINT);
            read(path, &open, reporter)
        }
        other => other,
    }
}

/// The channel of set-points.
const SET_POINT: &str = "set-point";

/// Both stages from files.
fn recorded(
    subject: &Subject,
    signal: &Km0Samples,
    [first, second]: [&Path; 2],
    mapping: &Path,
    reporter: &Reporter,
) -> Result<(Km0Stage1, AxisRecord), HealthError> {
    let mapping = Mapping::load(mapping)?;
    let one = first_record(first, &mapping, reporter)?;
    let bench = bench(&one)?;
    let excitation = match one.channel(SET_POINT) {
        Ok(s) if s.iter().any(|v| *v != s[0]) => Excitation::SetPoint(s),
        _ => Excitation::Voltage,
    };
    at_a_stop(subject, ("first", bench.angle), reporter);
    let found = first_stage(&bench, excitation)?;
    let two = read(second, &mapping, reporter)?;
    if (two.period / subject.period - 1.0).abs() > 1e-3 {
        return Err(HealthError::Period {
            path: second.to_path_buf(),
            head: subject.head.clone(),
            found: two.period,
            wanted: subject.period,
        });
    }
    at_a_stop(subject, ("second", two.channel("angle")?), reporter);
    let begin = if let Ok(set_points) = two.channel(SET_POINT) {
        signal.align(set_points)?
    } else {
        reporter.warn(
            "no-set-point",
            "the second stage has no channel \"set-point\": it is taken to begin with its signal",
            "record the set-points too",
        );
        0
    };
    let response = AxisRecord {
        reference: signal.set_points.clone(),
        angle: two.channel("angle")?[begin..].to_vec(),
        current: two.channel("current")?[begin..].to_vec(),
        voltage: Vec::new(),
    };
    Ok((found, response))
}

/// Scales what an axis has; whether it has it.
type Scale = fn(&mut Axis, f64) -> bool;

/// What a simulated axis can be changed by.
const CHANGES: [(&str, Scale); 7] = [
    ("resistance", |a, f| scaled(&mut a.motor.resistance, f)),
    ("inductance", |a, f| scaled(&mut a.motor.inductance, f)),
    ("torque-constant", |a, f| {
        a.motor.back_emf *= f;
        for mode in &mut a.motor.modes {
            mode.gain *= f;
        }
        scaled(&mut a.motor.torque_constant, f)
    }),
    ("inertia", |a, f| {
        for mode in &mut a.motor.modes {
            mode.gain /= f;
        }
        scaled(&mut a.motor.inertia, f)
    }),
    ("viscous", |a, f| scaled(&mut a.motor.viscous, f)),
    ("coulomb", |a, f| match &mut a.motor.friction {
        Friction::None => false,
        Friction::Coulomb { coulomb, .. } => scaled(coulomb, f),
        // what holds the rotor at rest grows with what holds it sliding
        Friction::Karnopp {
            coulomb, stiction, ..
        }
        | Friction::LuGre {
            coulomb, stiction, ..
        } => {
            *stiction *= f;
            scaled(coulomb, f)
        }
    }),
    ("mode", |a, f| {
        let first = a.motor.modes.first_mut();
        first.is_some_and(|mode| scaled(&mut mode.omega, f))
    }),
];

fn scaled(value: &mut f64, factor: f64) -> bool {
    *value *= factor;
    *value != 0.0
}

fn changed(axis: &Axis, changes: &[String]) -> Result<Axis, HealthError> {
    let mut axis = axis.clone();
    for text in changes {
        let wrong = || HealthError::Change {
            text: text.clone(),
            known: CHANGES.map(|c| c.0).join(", "),
        };
        let (name, factor) = text.split_once('=').ok_or_else(wrong)?;
        let factor: f64 = factor.trim().parse().map_err(|_| wrong())?;
        let (name, scale) = CHANGES
            .iter()
            .find(|(n, _)| *n == name.trim())
            .ok_or_else(wrong)?;
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(wrong());
        }
        if !scale(&mut axis, factor) {
            return Err(HealthError::Nothing { name });
        }
    }
    Ok(axis)
}

/// An instant as ISO 8601 in UTC.
///
/// ```
/// use std::time::{Duration, UNIX_EPOCH};
/// assert_eq!(meltpath::health::iso(UNIX_EPOCH + Duration::from_secs(951_782_400)), "2000-02-29T00:00:00Z");
/// ```
pub fn iso(at: std::time::SystemTime) -> String {
    let seconds = at
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |d| d.as_secs());
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // days from 0000-03-01, in eras of 400 years (Hinnant, civil_from_days)
    let z = days + 719_468;
    let (era, day) = (z / 146_097, z % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let date = day - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year + era * 400 + u64::from(month <= 2);
    format!(
        "{year:04}-{month:02}-{date:02}T{:02}:{:02}:{:02}Z",
        rest / 3600,
        rest % 3600 / 60,
        rest % 60
    )
}

/// What a report says of its inputs.
fn provenance(subject: &Subject) -> Provenance {
    let mut provenance = Provenance::new();
    provenance.model(
        "health test KM0",
        "Rasoanarivo 2020, § 2.4; limits of the rating: 10 and 25 % (R, L, Kc), 3 and 8 % (inertia, modes), 25 and 60 % (friction, lag), 20 and 50 % (overshoot, response time)",
    );
    provenance.parameter(
        "health.axis",
        &meltpath_base::Resolved::new(subject.name(), meltpath_base::Origin::Job),
    );
    provenance
}
