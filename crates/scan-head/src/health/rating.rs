//! A health test rated against the first one that was accepted: what drifted, what it may mean, what to do.
//!
//! Source: Rasoanarivo 2020, § 2.4; the limits are ours (docs/theory/sources.md).

use crate::health::analysis::Km0Stage2;
use crate::health::bench::Km0Stage1;
use crate::health::records::StepRecord;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How an axis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rating {
    /// Good.
    Good,
    /// To be watched.
    Watch,
    /// Intervention needed.
    Intervene,
}

impl Rating {
    /// Of a change.
    fn of(size: f64, limits: (f64, f64)) -> Self {
        if size < limits.0 {
            Rating::Good
        } else if size < limits.1 {
            Rating::Watch
        } else {
            Rating::Intervene
        }
    }

    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Rating::Good => "good",
            Rating::Watch => "to be watched",
            Rating::Intervene => "intervention needed",
        }
    }
}

/// What a test of an axis found, both stages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Km0Record {
    /// Machine, head and axis, as the owner names them.
    pub axis: String,
    /// When, as ISO 8601 with zone: written by the caller.
    pub time: String,
    /// Ambient or drive temperature, °C, where known.
    pub temperature: Option<f64>,
    /// Resistance, Ω.
    pub resistance: f64,
    /// Inductance, H.
    pub inductance: f64,
    /// Torque constant, N·m/A.
    pub torque_constant: f64,
    /// Inertia, kg·m².
    pub inertia: f64,
    /// Frequencies of the modes, Hz.
    pub modes: Vec<f64>,
    /// How far noise lets resistance, inductance, torque constant and inertia scatter, relative, one standard deviation; nothing in tests
    /// that were recorded before it was told.
    #[serde(default)]
    pub scatter: Option<[f64; 4]>,
    /// Frequencies of the modes that the motor was fitted with, Hz, where it was an identification: without one of its modes a motor takes
    /// their motion for a greater inertia.
    #[serde(default)]
    pub fitted_modes: Option<Vec<f64>>,
    /// Root mean square of the first stage's fit residuals (complex logarithm), where it was an identification.
    #[serde(default)]
    pub fit_residual: Option<f64>,
    /// The second stage.
    pub stage2: Km0Stage2,
}

impl Km0Stage1 {
    /// The record of a test with this first stage; axis and time are the caller's to name.
    pub fn record(&self, stage2: Km0Stage2) -> Km0Record {
        let motor = &self.motor;
        Km0Record {
            axis: String::new(),
            time: String::new(),
            temperature: None,
            resistance: motor.resistance,
            inductance: motor.inductance,
            torque_constant: motor.torque_constant,
            inertia: motor.inertia,
            modes: self.modes.iter().map(|m| m.frequency).collect(),
            scatter: Some(self.scatter),
            fitted_modes: Some(motor.modes.iter().map(|m| m.omega / TAU).collect()),
            fit_residual: Some(self.residual),
            stage2,
        }
    }
}

/// A quantity that drifted, and what it may mean.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drift {
    /// Which quantity.
    pub quantity: String,
    /// In the reference test.
    pub reference: f64,
    /// Now.
    pub now: f64,
    /// Relative change.
    pub change: f64,
    /// The part of it that counts: its size, or its growth alone where shrinking is no fault.
    pub size: f64,
    /// From which size on it is to be watched, and from which on to intervene.
    pub limits: (f64, f64),
    /// Its rating.
    pub rating: Rating,
    /// How far the change may be off, where that is told: two standard deviations by the noise of both tests, and what friction that
    /// changed may make of it.
    pub room: Option<f64>,
    /// Why nothing can be said of it, where nothing can: it is not told whether it is good or a fault.
    pub doubt: Option<String>,
    /// The likely fault.
    pub fault: &'static str,
    /// What to do.
    pub action: &'static str,
}

/// In which direction a change counts.
#[derive(Clone, Copy)]
enum Grows {
    /// Both.
    Either,
    /// Only growth.
    Worse,
}

/// How a quantity is rated, and what its drift may mean.
struct Watched {
    /// Relative changes from which on to watch, and to intervene.
    limits: (f64, f64),
    /// Changes are shares of the reference, and where that is smaller, of this.
    floor: f64,
    grows: Grows,
    fault: &'static str,
    /// The likely fault where the quantity grew, if that is another.
    grown: Option<&'static str>,
    action: &'static str,
}

/// Whose changes count both ways.
const fn either(limits: (f64, f64), fault: &'static str, action: &'static str) -> Watched {
    Watched {
        limits,
        floor: 0.0,
        grows: Grows::Either,
        fault,
        grown: None,
        action,
    }
}

/// Of which only growth counts.
const fn growing(limits: (f64, f64), fault: &'static str, action: &'static str) -> Watched {
    Watched {
        grows: Grows::Worse,
        ..either(limits, fault, action)
    }
}

const DRIVER: &str = "check the coil, its connections and the driver board";
const RESISTANCE: Watched = either(
    (0.10, 0.25),
    "overheating, for instance by an oscillation on a changed mode, or a bad contact",
    DRIVER,
);
const INDUCTANCE: Watched = either((0.10, 0.25), "short-circuited turns", DRIVER);
const TORQUE_CONSTANT: Watched = Watched {
    // rotors lose magnetism and do not gain any
    grown: Some(
        "another motor or ammeter, or an encoder of another scale: a rotor gains no magnetism",
    ),
    ..either(
        (0.10, 0.25),
        "a demagnetised rotor",
        "check for overheating, and the scales of current and angle in the mapping; replace the galvanometer",
    )
};
const INERTIA_NAME: &str = "inertia";
const INERTIA: Watched = either(
    (0.03, 0.08),
    "a mirror that is loose, dirty or replaced by another",
    "check the mirror and its mount",
);
const MODE: Watched = either(
    (0.03, 0.08),
    "a loose or cracked mirror mount, or a worn bearing",
    "check the mount; the pre-filter and the notch no longer fit the mode",
);
const BEARING: Watched = growing(
    (0.25, 0.60),
    "degraded lubrication of the bearings",
    "exercise the axis over its travel; replace the bearings if it stays",
);
const LAG: Watched = growing(
    (0.25, 0.60),
    "changed gains or pre-filter, or a tired driver",
    "compare the controller's settings with the reference",
);
const OVERSHOOT: Watched = Watched {
    // of an axis that hardly overshoots, points of the step: a share of next to nothing says nothing
    floor: 10.0,
    ..growing(
        (0.20, 0.50),
        "less damping: inertia, mode or gains changed",
        "identify the axis again and tune it",
    )
};
const RESPONSE: Watched = growing(
    (0.20, 0.50),
    "more friction or weaker drive",
    "see the friction and the resistance",
);

impl Watched {
    /// The drift of a quantity from the reference test to now.
    fn rate(&self, quantity: String, [reference, now]: [f64; 2]) -> Drift {
        let base = reference.abs().max(self.floor);
        let change = if base == 0.0 {
            0.0
        } else {
            (now - reference) / base
        };
        let size = match self.grows {
            Grows::Either => change.abs(),
            Grows::Worse => change.max(0.0),
        };
        Drift {
            quantity,
            reference,
            now,
            change,
            size,
            limits: self.limits,
            rating: Rating::of(size, self.limits),
            room: None,
            doubt: None,
            fault: self.grown.filter(|_| change > 0.0).unwrap_or(self.fault),
            action: self.action,
        }
    }
}

/// What a change of dry friction, as a share of it, makes at most of resistance, inductance, torque constant and inertia, as a share of
/// them: the first stage fits a motor without it. Simulated records of a rotor on which friction acts, quiet and with noise: up to 0.1 of
/// the torque constant and 0.2 of the inertia.
const BY_FRICTION: [f64; 4] = [0.0, 0.0, 0.1, 0.2];

impl Drift {
    /// The change is known but for `room`: a fault only where all that it may be is one, and unsaid where it may be good or a fault.
    fn within(mut self, room: f64) -> Self {
        let room = if room.is_finite() {
            room
        } else {
            f64::INFINITY
        };
        let least = Rating::of((self.size - room).max(0.0), self.limits);
        let most = Rating::of(self.size + room, self.limits);
        self.room = Some(room);
        if least == Rating::Good && most == Rating::Intervene {
            let told = format!(
                "the change is known within {:.1} % only, by the noise of both tests and by what friction that changed makes of it",
                100.0 * room
            );
            return self.unsaid(told);
        }
        if least == Rating::Watch {
            self.rating = self.rating.min(Rating::Watch);
        }
        self
    }

    fn unsaid(mut self, doubt: String) -> Self {
        self.rating = self.rating.min(Rating::Watch);
        self.doubt = Some(doubt);
        self
    }
}

impl Km0Record {
    /// Modes that its motor was fitted with, Hz.
    fn fitted(&self) -> &[f64] {
        self.fitted_modes.as_deref().unwrap_or(&self.modes)
    }

    fn largest_lag(&self) -> f64 {
        let lags = self.stage2.ramps.iter().map(|ramp| ramp.lag_deg.abs());
        lags.fold(0.0, f64::max)
    }

    fn mean_of_steps(&self, of: fn(&StepRecord) -> f64) -> f64 {
        let steps = &self.stage2.steps;
        steps.iter().map(of).sum::<f64>() / steps.len().max(1) as f64
    }
}

/// A mode is not taken for one that lies farther off than this share of its frequency.
const SAME_MODE: f64 = 0.3;

/// For each of some modes (Hz) that of others (Hz) which it is: the nearest within 30 %, each taken once, the nearest pair
/// first.
pub fn matched(modes: &[f64], others: &[f64]) -> Vec<Option<f64>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, a) in modes.iter().enumerate() {
        for (j, b) in others.iter().enumerate() {
            let apart = (b / a - 1.0).abs();
            if apart <= SAME_MODE {
                pairs.push((apart, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = vec![None; modes.len()];
    let mut taken = vec![false; others.len()];
    for (_, i, j) in pairs {
        if found[i].is_none() && !taken[j] {
            found[i] = Some(others[j]);
            taken[j] = true;
        }
    }
    found
}

/// A mode (Hz) that one of two tests' motors was not fitted with, of those of the axis' file and of both.
fn not_fitted(of_file: &[f64], reference: &Km0Record, now: &Km0Record) -> Option<f64> {
    let both = [reference.fitted(), now.fitted()];
    let known = of_file.iter().chain(both[0]).chain(both[1]);
    let without = |f: &f64| {
        both.iter()
            .any(|fitted| !fitted.iter().any(|g| (g / f - 1.0).abs() <= SAME_MODE))
    };
    known.copied().find(without)
}

/// What the first stage tells of the coil and the rotor.
fn of_first_stage(reference: &Km0Record, now: &Km0Record, of_file: &[f64]) -> Vec<Drift> {
    type Quantity = (&'static str, Watched, fn(&Km0Record) -> f64);
    let quantities: [Quantity; 4] = [
        ("resistance", RESISTANCE, |r| r.resistance),
        ("inductance", INDUCTANCE, |r| r.inductance),
        ("torque constant", TORQUE_CONSTANT, |r| r.torque_constant),
        (INERTIA_NAME, INERTIA, |r| r.inertia),
    ];
    // a test that does not tell its scatter has that of the other
    let [then, scatter] = [(reference, now), (now, reference)]
        .map(|(own, other)| own.scatter.or(other.scatter).unwrap_or_default());
    let coulomb = |r: &Km0Record| r.stage2.friction.coulomb;
    let dry = BEARING.rate(String::new(), [coulomb(reference), coulomb(now)]);
    let by_friction = BY_FRICTION.map(|by| by * dry.change.abs());
    let drifts = quantities.into_iter().enumerate();
    let drifts = drifts.map(|(k, (name, watched, of))| {
        let drift = watched.rate(name.to_owned(), [of(reference), of(now)]);
        let drift = drift.within(2.0 * then[k].hypot(scatter[k]) + by_friction[k]);
        match not_fitted(of_file, reference, now) {
            Some(mode) if name == INERTIA_NAME => drift.unsaid(format!(
                "the mode at {mode:.0} Hz is not found in the accepted test or in this one: without it the motor takes its motion for inertia"
            )),
            _ => drift,
        }
    });
    drifts.collect()
}

/// Rates a test against the first accepted one: every quantity with its change, the worst first; modes that were not
/// found again are left out. `of_file` are the modes that the axis' file tells and the test looks for, Hz. The axis' rating is that of
/// the first entry.
pub fn rate(reference: &Km0Record, now: &Km0Record, of_file: &[f64]) -> Vec<Drift> {
    let both = |of: fn(&Km0Record) -> f64| [of(reference), of(now)];
    let mut drifts = of_first_stage(reference, now, of_file);
    let found = matched(&reference.modes, &now.modes);
    let modes = reference.modes.iter().zip(&found).enumerate();
    drifts.extend(modes.filter_map(|(k, (a, b))| {
        let b = (*b)?;
        Some(MODE.rate(format!("mode {}", k + 1), [*a, b]))
    }));
    drifts.extend(
        [
            (
                "Coulomb torque",
                BEARING,
                both(|r| r.stage2.friction.coulomb),
            ),
            (
                "viscous coefficient",
                BEARING,
                both(|r| r.stage2.friction.viscous),
            ),
            ("largest lag", LAG, both(Km0Record::largest_lag)),
            (
                "overshoot",
                OVERSHOOT,
                both(|r| r.mean_of_steps(|s| s.overshoot)),
            ),
            (
                "response time",
                RESPONSE,
                both(|r| r.mean_of_steps(|s| s.response_time)),
            ),
        ]
        .map(|(name, watched, values)| watched.rate(name.to_owned(), values)),
    );
    drifts.sort_by(|a, b| {
        b.rating
            .cmp(&a.rating)
            .then(b.change.abs().total_cmp(&a.change.abs()))
    });
    drifts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes are known again by where they lie, not by their place in a row.
    #[test]
    fn modes_are_known_by_their_frequency() {
        for (modes, others, found) in [
            (
                &[2200.0, 4000.0][..],
                &[4010.0][..],
                &[None, Some(4010.0)][..],
            ),
            (&[4000.0], &[2200.0, 3240.0], &[Some(3240.0)]),
            (&[4000.0], &[2200.0], &[None]),
            (&[4000.0], &[], &[None]),
            // the nearest pair first, each once
            (&[3000.0, 3400.0], &[3300.0], &[None, Some(3300.0)]),
            (&[3000.0, 3400.0], &[3300.0, 4000.0], &[None, Some(3300.0)]),
        ] {
            assert_eq!(matched(modes, others), found, "{modes:?} {others:?}");
        }
    }

    /// Overshoot, in percent of the step: of an axis with much of it a share of it, of one with next to none points. Less is no fault.
    #[test]
    fn overshoot_is_rated_by_itself_and_in_points_where_there_is_next_to_none() {
        for (reference, now, change, rating) in [
            (0.0, 11.0, 1.1, Rating::Intervene),
            (0.0, 1.5, 0.15, Rating::Good),
            (2.0, 5.0, 0.3, Rating::Watch),
            (40.0, 45.0, 0.125, Rating::Good),
            (40.0, 50.0, 0.25, Rating::Watch),
            (40.0, 65.0, 0.625, Rating::Intervene),
            (40.0, 10.0, -0.75, Rating::Good),
        ] {
            let drift = OVERSHOOT.rate("overshoot".to_owned(), [reference, now]);
            assert!((drift.change - change).abs() < 1e-12, "{drift:?}");
            assert_eq!(drift.rating, rating, "{drift:?}");
        }
    }
}
