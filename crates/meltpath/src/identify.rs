//! `meltpath identify`: the motor of a galvanometer from a bench record, tested on what the fit has not seen.

use std::path::{Path, PathBuf};

use meltpath_base::Reporter;
use meltpath_perception::{Mapping, Record, RecordError, read};
use meltpath_scan_head::identification::error::IdentificationError;
use meltpath_scan_head::identification::friction::{RampFriction, friction_of_ramps};
use meltpath_scan_head::identification::joint::{Joint, joint};
use meltpath_scan_head::identification::modes::{ModeSearch, identify_modes};
use meltpath_scan_head::identification::prediction::{Prediction, predict};
use meltpath_scan_head::identification::ramps::steady_ramps;
use meltpath_scan_head::identification::record::{BenchRecord, Excitation, Method};

/// Share of the record that is fitted; the rest is predicted.
const FITTED: f64 = 2.0 / 3.0;

/// Share of coloured lags beyond which a prediction is said to leave something unexplained.
const COLOURED: f64 = 0.1;

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
    /// The prediction of the unseen part.
    pub prediction: Prediction,
    /// Samples of the record and of its fitted part.
    pub samples: [usize; 2],
    /// Friction, where ramps were recorded too, and how many ramps were found.
    pub friction: Option<(RampFriction, usize)>,
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
    let ramps = steady_ramps(angle, current, record.period).map_err(wrong)?;
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
    found.friction = Some((friction, ramps.len()));
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
    let delays = found.delays.map(|d| d[0]);
    let prediction = predict(&found.motor, delays, &whole, fitted).map_err(wrong)?;
    for (what, quality) in [
        ("current", &prediction.current),
        ("angle", &prediction.angle),
    ] {
        if quality.coloured > COLOURED {
            reporter.warn(
                "prediction-coloured",
                format!(
                    "the error of the predicted {what} is more than white noise at {:.0} % of the lags: friction of another law, a drift or further modes are not in this model",
                    100.0 * quality.coloured
                ),
                "",
            );
        }
    }
    Ok(Identification {
        found,
        prediction,
        samples: [record.len(), fitted],
        friction: None,
    })
}

impl Identification {
    /// What was found, for people; the parameters in the form of a scan head's file.
    pub fn lines(&self, record: &Path) -> Vec<String> {
        let motor = &self.found.motor;
        let file = record
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        let [r, l, k, j, b] = self.found.sigma;
        let mut lines = vec![format!(
            "# {} of {} samples fitted, {} unseen",
            self.samples[1],
            self.samples[0],
            self.samples[0] - self.samples[1]
        )];
        // ramps tell viscous friction apart from dry friction, which the response does not
        let (viscous, b) = match &self.friction {
            Some((friction, _)) if friction.viscous[0] > 0.0 => (
                friction.viscous[0],
                friction.viscous[1] / friction.viscous[0].abs(),
            ),
            _ => (motor.viscous, b),
        };
        for (name, value, unit, sigma) in [
            ("resistance", motor.resistance, "Ω", r),
            ("inductance", motor.inductance * 1e6, "µH", l),
            ("torque_constant", motor.torque_constant, "N·m/A", k),
            ("back_emf", motor.back_emf, "V·s/rad", k),
            ("inertia", motor.inertia, "kg·m²", j),
            ("viscous", viscous, "N·m·s/rad", b),
        ] {
            lines.push(format!(
                "{name} = {{ value = \"{value:.5e} {unit}\", source = \"identified from {file}, ± {:.2} %\" }}",
                100.0 * sigma
            ));
        }
        if self.friction.is_none() {
            lines.extend(self.dry(&file));
        }
        if let Some((friction, ramps)) = &self.friction {
            for (name, [value, sigma]) in [("coulomb", friction.coulomb), ("bias", friction.bias)] {
                lines.push(format!(
                    "{name} = {{ value = \"{value:.5e} N·m\", source = \"identified from {ramps} ramps, ± {sigma:.1e} N·m\" }}"
                ));
            }
            lines.push(format!(
                "# torque of the ramps: {:.2e} N·m rms beside this friction, {:.2e} beside viscous friction alone",
                friction.rms, friction.rms_viscous_only
            ));
        }
        lines.extend(self.found.felt.map(|[felt, sigma]| {
            format!(
                "friction_felt = {{ value = \"{felt:.3} 1\", source = \"identified from {file}, ± {sigma:.3}\" }}"
            )
        }));
        let per_inertia = motor.torque_constant / motor.inertia;
        for (mode, sigma) in motor.modes.iter().zip(&self.found.mode_sigma) {
            lines.push("[[mode]]".to_owned());
            for (name, value, unit, sigma) in [
                (
                    "frequency",
                    mode.omega / std::f64::consts::TAU,
                    "Hz",
                    sigma[0],
                ),
                ("damping", mode.damping, "1", sigma[1]),
                ("gain_ratio", mode.gain / per_inertia, "1", sigma[2]),
            ] {
                lines.push(format!(
                    "{name} = {{ value = \"{value:.5e} {unit}\", source = \"identified from {file}, ± {:.2} %\" }}",
                    100.0 * sigma
                ));
            }
        }
        for (what, [delay, sigma]) in ["current", "angle"].iter().zip(self.found.delays) {
            lines.push(format!(
                "# the {what} is read {:.2} ± {:.2} µs after the voltage's samples",
                1e6 * delay,
                1e6 * sigma
            ));
        }
        if !self.found.settled {
            lines.push("# the search did not settle, as under friction that does not turn at once or with hardly any noise: the deviations may be too small".to_owned());
        }
        let [current, angle] = self.found.rms.map(|left| 1e3 * left);
        lines.push(format!(
            "# fitted part: {current:.4} mA and {angle:.5} mrad rms are left"
        ));
        for (what, unit, scale, q) in [
            ("current", "mA", 1e3, &self.prediction.current),
            ("angle", "mrad", 1e3, &self.prediction.angle),
        ] {
            let [half, most, nearly_all] = q.percentiles.map(|p| p * scale);
            lines.push(format!(
                "# unseen {what}: {:.1} % explained, error {:.4} {unit} rms; 50, 90, 99 % of the samples within {half:.4}, {most:.4}, {nearly_all:.4} {unit}",
                100.0 * q.fit,
                scale * q.rms,
            ));
        }
        lines
    }

    /// Dry friction as the record tells it.
    fn dry(&self, file: &str) -> Vec<String> {
        let line = |name: &str, [value, sigma]: [f64; 2]| {
            format!(
                "{name} = {{ value = \"{value:.5e} N·m\", source = \"identified from {file}, ± {sigma:.1e} N·m\" }}"
            )
        };
        let bias = self.found.bias;
        match self.found.coulomb {
            Some(coulomb) => vec![line("coulomb", coulomb), line("bias", bias)],
            None => vec![format!(
                "# no dry friction is told from none by this record; a torque of {:.1e} ± {:.1e} N·m is the same both ways",
                bias[0], bias[1]
            )],
        }
    }
}
