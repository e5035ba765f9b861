//! A motor in the form of a scan head's file.

use std::path::Path;

use super::Identification;
use super::ramps::{Ramps, both_told};

/// In place of a deviation that promises nothing.
const UNSAID: &str = "± cannot say";

/// A deviation of the share of friction that modes feel beyond which nothing is told of it: it lies between 0 and 1.
const FELT_UNTOLD: f64 = 0.5;

/// Says a figure in the form of a file, with its source.
fn figure(name: &str, value: &str, source: &str) -> String {
    let source = toml::Value::from(format!("identified from {source}"));
    format!("{name} = {{ value = \"{value}\", source = {source} }}")
}

/// The source of a figure by ramps: a deviation, or that it cannot be said where their law does not hold or the record tells another.
fn by_ramps(ramps: &Ramps, sigma: &str) -> String {
    let count = ramps.count;
    if ramps.hold() {
        format!("{count} ramps, ± {sigma}")
    } else {
        format!("{count} ramps, {UNSAID}")
    }
}

impl Identification {
    /// What was found, for people; the parameters in the form of a scan head's file.
    pub fn lines(&self, record: &Path) -> Vec<String> {
        let name = record.file_name().map(|n| n.to_string_lossy().into_owned());
        let file = name.unwrap_or_default();
        let [all, fitted] = self.samples;
        let unseen = all - fitted;
        let mut lines = vec![format!(
            "# {fitted} of {all} samples fitted, {unseen} unseen"
        )];
        lines.extend(self.misfit(&file));
        lines.extend(self.rigid(&file));
        lines.extend(self.dry(&file));
        lines.extend(self.felt(&file));
        lines.extend(self.modes(&file));
        lines.extend(self.quality());
        lines
    }

    /// A deviation, or that it cannot be said: where the motor does not explain its record it promises nothing.
    fn stated(&self, sigma: &str) -> String {
        if self.found.holds() {
            format!("± {sigma}")
        } else {
            UNSAID.to_owned()
        }
    }

    /// What is left of the record over its noise.
    fn misfit(&self, file: &str) -> Option<String> {
        let [current, angle] = self.found.over_noise();
        let value = format!("{:.3} 1", current?.max(angle?));
        Some(figure("misfit", &value, file))
    }

    /// Resistance to viscous friction.
    fn rigid(&self, file: &str) -> Vec<String> {
        let motor = &self.found.motor;
        let [r, l, k, j, b] = self.found.sigma;
        let percent = |sigma: f64| self.stated(&format!("{:.2} %", 100.0 * sigma));
        let found = [
            ("resistance", motor.resistance, "Ω", r),
            ("inductance", motor.inductance * 1e6, "µH", l),
            ("torque_constant", motor.torque_constant, "N·m/A", k),
            ("back_emf", motor.back_emf, "V·s/rad", k),
            ("inertia", motor.inertia, "kg·m²", j),
            ("viscous", motor.viscous, "N·m·s/rad", b),
        ];
        let mut lines: Vec<String> = found
            .into_iter()
            .map(|(name, value, unit, sigma)| {
                let stated = percent(sigma);
                figure(
                    name,
                    &format!("{value:.5e} {unit}"),
                    &format!("{file}, {stated}"),
                )
            })
            .collect();
        // ramps tell viscous friction apart from dry friction, which the response does not
        if let Some(ramps) = &self.friction
            && ramps.friction.viscous[0] > 0.0
        {
            let [value, sigma] = ramps.friction.viscous;
            let source = by_ramps(ramps, &format!("{:.2} %", 100.0 * sigma / value));
            lines.pop();
            lines.push(figure(
                "viscous",
                &format!("{value:.5e} N·m·s/rad"),
                &source,
            ));
        }
        lines
    }

    /// Dry friction as the ramps tell it, or as the record does.
    fn dry(&self, file: &str) -> Vec<String> {
        let line = |name: &str, value: f64, source: String| {
            figure(name, &format!("{value:.5e} N·m"), &source)
        };
        if let Some(ramps) = &self.friction {
            let friction = &ramps.friction;
            let of = |[_, sigma]: [f64; 2]| by_ramps(ramps, &format!("{sigma:.1e} N·m"));
            let over = friction
                .over_noise
                .map(|over| format!(" ({over:.2} times their noise)"));
            let mut lines = vec![
                line("coulomb", friction.coulomb[0], of(friction.coulomb)),
                line("bias", friction.bias[0], of(friction.bias)),
                format!(
                    "# torque of the ramps: {:.2e} N·m rms beside this friction{}, {:.2e} beside viscous friction alone",
                    friction.rms,
                    over.unwrap_or_default(),
                    friction.rms_viscous_only
                ),
            ];
            lines.extend(ramps.beside.iter().map(|b| format!("# {}", both_told(b))));
            return lines;
        }
        let of =
            |[_, sigma]: [f64; 2]| format!("{file}, {}", self.stated(&format!("{sigma:.1e} N·m")));
        let bias = self.found.bias;
        match self.found.coulomb {
            Some(coulomb) => vec![
                line("coulomb", coulomb[0], of(coulomb)),
                line("bias", bias[0], of(bias)),
            ],
            None => vec![format!(
                "# no dry friction is told from none by this record; a torque of {:.1e} ± {:.1e} N·m is the same both ways",
                bias[0], bias[1]
            )],
        }
    }

    /// The share of friction that the modes feel; a share that the record does not tell is none.
    fn felt(&self, file: &str) -> Option<String> {
        let [felt, sigma] = self.found.felt?;
        if sigma.is_nan() || sigma > FELT_UNTOLD {
            return Some(
                "# friction_felt is undetermined: the record does not tell where friction acts"
                    .to_owned(),
            );
        }
        let stated = self.stated(&format!("{sigma:.3}"));
        let source = if (0.0..=1.0).contains(&felt) {
            format!("{file}, {stated}")
        } else {
            format!("{file}, {stated}, fitted {felt:.3}")
        };
        let value = format!("{:.3} 1", felt.clamp(0.0, 1.0));
        Some(figure("friction_felt", &value, &source))
    }

    fn modes(&self, file: &str) -> Vec<String> {
        let motor = &self.found.motor;
        let per_inertia = motor.torque_constant / motor.inertia;
        let mut lines = Vec::new();
        for (mode, sigma) in motor.modes.iter().zip(&self.found.mode_sigma) {
            let hertz = mode.omega / std::f64::consts::TAU;
            lines.push("[[mode]]".to_owned());
            for (name, value, unit, sigma) in [
                ("frequency", hertz, "Hz", sigma[0]),
                ("damping", mode.damping, "1", sigma[1]),
                ("gain_ratio", mode.gain / per_inertia, "1", sigma[2]),
            ] {
                let stated = self.stated(&format!("{:.2} %", 100.0 * sigma));
                let source = format!("{file}, {stated}");
                lines.push(figure(name, &format!("{value:.5e} {unit}"), &source));
            }
        }
        lines
    }

    /// Comments: delays, how the search ended, what is left of the fitted part and of the unseen one.
    fn quality(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (what, [delay, sigma]) in ["current", "angle"].iter().zip(self.found.delays) {
            let stated = self.stated(&format!("{:.2} µs", 1e6 * sigma));
            lines.push(format!(
                "# the {what} is read {:.2} µs ({stated}) after the voltage's samples",
                1e6 * delay
            ));
        }
        let [zero, sigma] = self.found.zero.map(|zero| 1e3 * zero);
        if self.found.reads_beside() {
            let stated = self.stated(&format!("{sigma:.3} mA"));
            lines.push(format!(
                "# the current reads {zero:.3} mA ({stated}) where none flows: it is taken off"
            ));
        }
        if self.moving {
            lines.push("# the record begins in motion, and so does the prediction".to_owned());
        }
        if !self.found.settled {
            lines.push("# the search did not settle, as under friction that does not turn at once or with hardly any noise: the deviations are taken over longer steps".to_owned());
        }
        let [current, angle] = self.found.rms.map(|left| 1e3 * left);
        let [one, two] = self.found.over_noise().map(|over| match over {
            Some(over) => format!("{over:.2} times its noise"),
            None => "the record is too short to tell its noise".to_owned(),
        });
        lines.push(format!(
            "# fitted part: {current:.4} mA ({one}) and {angle:.5} mrad ({two}) rms are left"
        ));
        let [current, angle] = self.unseen.map(|left| 1e3 * left);
        if let [Some(one), Some(two)] = self.unseen_over_noise() {
            lines.push(format!(
                "# unseen part, in pieces: {current:.4} mA ({one:.2} times the noise) and {angle:.5} mrad ({two:.2} times the noise) rms are left"
            ));
        }
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
}
