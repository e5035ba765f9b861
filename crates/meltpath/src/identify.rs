//! `meltpath identify`: the motor of a galvanometer from a bench record, tested on what the fit has not seen.

mod lines;
pub mod ramps;

use std::path::{Path, PathBuf};

use meltpath_base::{Check, Limit, Measure, Reporter, Status, Verdict};
use meltpath_perception::{Mapping, Record, RecordError, read};
use meltpath_scan_head::identification::error::IdentificationError;
use meltpath_scan_head::identification::friction::friction_of_ramps;
use meltpath_scan_head::identification::joint::{FAR, Joint, joint};
use meltpath_scan_head::identification::modes::{ModeSearch, identify_modes};
use meltpath_scan_head::identification::prediction::{Foreseen, Prediction};
use meltpath_scan_head::identification::ramps::steady_ramps;
use meltpath_scan_head::identification::record::{BenchRecord, Excitation, Method};

use ramps::Ramps;

/// Share of the record that is fitted; the rest is predicted.
const FITTED: f64 = 2.0 / 3.0;

/// What a motor leaves of the unseen part stands at most this far above the noise of the fitted one, where the motor of the one is that
/// of the other. The limit is ours. Simulated records of one motor with viscous and Coulomb friction and a mode leave 0.98 to 1.02; one
/// whose torque constant falls by a fifth and whose friction doubles leaves 13 of the current and 480 of the angle.
const UNSEEN: f64 = 1.2;

/// Relative deviation beyond which a friction is said to be undetermined.
const UNSURE: f64 = 0.5;

/// Why a record gave no motor.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The record or its mapping.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The identification.
    #[error("`{}`: {source}", path.display())]
    Identification {
        /// Which record.
        path: PathBuf,
        /// Why.
        source: IdentificationError,
    },
}

/// A motor, and how it predicts the last third of its record.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The motor with its deviations.
    pub found: Joint,
    /// The prediction of the unseen part, from the beginning of the record on.
    pub prediction: Prediction,
    /// What the motor leaves of current (A) and angle (rad) in pieces of the unseen part, root mean squares.
    pub unseen: [f64; 2],
    /// Whether the record begins in motion.
    pub moving: bool,
    /// Samples of the record and of its fitted part.
    pub samples: [usize; 2],
    /// Friction, where ramps were recorded too.
    pub friction: Option<Ramps>,
}

/// Friction from a record of ramps up and down at several speeds, put to a motor that was identified. Channels: `current`
/// (A) and `angle` (rad).
///
/// # Errors
/// [`IdentifyError`].
pub fn add_friction(
    found: &mut Identification,
    record_file: &Path,
    mapping_file: &Path,
    reporter: &Reporter,
) -> Result<(), IdentifyError> {
    let mapping = Mapping::load(mapping_file)?;
    let record = read(record_file, &mapping, reporter)?;
    let wrong = |source| IdentifyError::Identification {
        path: record_file.to_path_buf(),
        source,
    };
    let (angle, current) = (record.channel("angle")?, record.channel("current")?);
    let mut ramps = steady_ramps(angle, current, record.period).map_err(wrong)?;
    if found.found.reads_beside() {
        // the same ammeter reads the same where no current flows
        for ramp in &mut ramps {
            ramp.current -= found.found.zero[0];
        }
    }
    let motor = &found.found.motor;
    let friction = friction_of_ramps(&ramps, motor.torque_constant).map_err(wrong)?;
    if friction.coulomb[0] < 0.0 {
        return Err(wrong(IdentificationError::Reversed {
            what: "the current of the ramps",
            share: 1.0,
        }));
    }
    for (what, [value, sigma]) in [
        ("viscous friction", friction.viscous),
        ("Coulomb friction", friction.coulomb),
    ] {
        if sigma > UNSURE * value.abs() {
            reporter.warn(
                "friction-unsure",
                format!(
                    "the {what} of the ramps is {value:.2e} ± {sigma:.2e}: they do not determine it"
                ),
                "ramps at more speeds, from a few to a thousand degrees a second, both ways",
            );
        }
    }
    found.friction = Some(Ramps::new(friction, ramps.len(), &found.found));
    Ok(())
}

/// What a record says of a motor, from its channels `voltage` (V), `current` (A) and `angle` (rad).
///
/// # Errors
/// A channel that is not there.
pub(crate) fn bench(record: &Record) -> Result<BenchRecord<'_>, RecordError> {
    Ok(BenchRecord {
        period: record.period,
        voltage: record.channel("voltage")?,
        current: record.channel("current")?,
        angle: record.channel("angle")?,
    })
}

/// Reads a record and finds its motor. Channels: `voltage` (V), `current` (A), `angle` (rad), and `set-point` (rad) where the
/// loop was closed.
///
/// # Errors
/// [`IdentifyError`].
pub fn identify(
    record_file: &Path,
    mapping_file: &Path,
    reporter: &Reporter,
) -> Result<Identification, IdentifyError> {
    let mapping = Mapping::load(mapping_file)?;
    let record = read(record_file, &mapping, reporter)?;
    let whole = bench(&record)?;
    let fitted = (FITTED * record.len() as f64) as usize;
    let first = BenchRecord {
        voltage: &whole.voltage[..fitted],
        current: &whole.current[..fitted],
        angle: &whole.angle[..fitted],
        ..whole
    };
    let excitation = match record.channel("set-point") {
        Ok(set_point) => Excitation::SetPoint(&set_point[..fitted]),
        Err(_) => Excitation::Voltage,
    };
    let wrong = |source| IdentifyError::Identification {
        path: record_file.to_path_buf(),
        source,
    };
    let method = Method::at(record.period);
    let found = identify_modes(&first, excitation, &method, &ModeSearch::default())
        .and_then(|start| joint(&first, &start))
        .map_err(wrong)?;
    for peak in &found.refused {
        reporter.warn(
            "peak-refused",
            format!(
                "a peak at {:.0} Hz, {:.1} times the rigid motor's response, is not taken for a mode: {}",
                peak.frequency, peak.ratio, peak.why
            ),
            "",
        );
    }
    for (what, over) in ["current", "angle"].into_iter().zip(found.over_noise()) {
        if let Some(over) = over.filter(|over| *over > FAR) {
            reporter.warn(
                "motor-misfit",
                format!(
                    "what is left of the {what} is {over:.2} times its noise: a further mode, friction of another law, or noise that is not white (hum, drift, an encoder's errors) is not in this model"
                ),
                "record without hum and drift, sample faster for modes up there, excite more against friction",
            );
        }
    }
    let Foreseen {
        prediction,
        left: unseen,
        moving,
    } = found.foresee(&whole, fitted).map_err(wrong)?;
    Ok(Identification {
        found,
        prediction,
        unseen,
        moving,
        samples: [record.len(), fitted],
        friction: None,
    })
}

impl Identification {
    /// Whether the motor explains its record but for noise, the part that it was fitted to and the part that it has not seen: only then do
    /// its figures promise anything. Above [`FAR`] nothing can be said. Where there are ramps, whether their friction explains them, and
    /// is that of the record.
    pub fn verdict(&self) -> Verdict {
        let over = self.found.over_noise();
        let channels = || ["current", "angle"].into_iter();
        let fitted = channels().zip(over).map(|(what, over)| {
            let title = format!("What the motor leaves of the {what}, over its noise");
            misfit(&format!("{what}-misfit"), &title, over.unwrap_or(f64::NAN))
        });
        let unseen = channels().zip(self.unseen_over_noise());
        let unseen = unseen.map(|(what, over)| self.of_the_unseen(what, over));
        let ramps = self.friction.iter();
        let ramps = ramps.flat_map(|ramps| ramps.checks(self.found.holds()));
        Verdict {
            checks: fitted.chain(unseen).chain(ramps).collect(),
            ..Verdict::default()
        }
    }

    /// What is left of current and angle in the unseen part over the noise of the fitted one; nothing where that is not told.
    pub fn unseen_over_noise(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.found.noise[c].map(|noise| self.unseen[c] / noise))
    }

    /// Judges what the motor leaves of the part that it has not seen.
    fn of_the_unseen(&self, what: &str, over: Option<f64>) -> Check {
        let id = format!("{what}-unseen");
        let title = format!("What the motor leaves of the unseen {what}, over the noise");
        let Some(over) = over else {
            return Check::not_checked(&id, &title, "the record is too short to tell its noise");
        };
        let check = Check::judge(&id, &title, Measure::exact(over, ""), Limit::AtMost(UNSEEN));
        let check = match check.status {
            Status::Fail if self.found.holds() => check.because(
                "the motor explains what it was fitted to and not what comes after: another motor turns there, or its friction, its heat or the bench changed",
            ),
            Status::Fail => Check {
                status: Status::CannotSay,
                ..check
            }
            .because("the motor does not explain what it was fitted to"),
            _ => check,
        };
        check.remedy("look at the record where it changes, and identify from one (`rows` in the mapping) during which the motor stays the same")
    }
}

/// The same of the motor of an axis, as its file or its head's tells it.
pub(crate) fn of_motor(axis: char, over: f64) -> Check {
    let title = format!(
        "{}: what its motor left of the record it was identified from, over the record's noise",
        axis.to_ascii_uppercase()
    );
    misfit(&format!("{axis}-motor"), &title, over)
}

/// Judges what a motor leaves of its record over the record's noise: too much says nothing against the motor, and nothing for it.
pub(crate) fn misfit(id: &str, title: &str, over: f64) -> Check {
    let check = Check::judge(id, title, Measure::exact(over, ""), Limit::AtMost(FAR));
    let check = if check.status == Status::Fail {
        let reason =
            "the motor lacks something of its record: how far its figures are off cannot be said";
        let status = Status::CannotSay;
        Check { status, ..check }.because(reason)
    } else {
        check
    };
    check.remedy("identify it from a record that it explains: without hum and drift, sampled faster where modes are beyond its band")
}
