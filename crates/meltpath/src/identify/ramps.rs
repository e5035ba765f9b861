//! Friction by ramps beside a record: whether their law holds, and whether both tell the same.

use meltpath_base::{Check, Limit, Measure, Status};
use meltpath_scan_head::identification::friction::{RampFriction, SPEEDS};
use meltpath_scan_head::identification::joint::Joint;

/// What friction leaves of the ramps stands at most this far over the noise within them where it is theirs. The limit is ours: by chance
/// 1 in 150 sets of six ramps stands higher, and 1 in a million of fourteen.
const UNEXPLAINED: f64 = 2.0;

/// Deviations that ramps and record may lie apart. By chance one in sixteen thousand does.
const APART: f64 = 4.0;

/// Friction of a motor by its ramps.
#[derive(Debug, Clone, PartialEq)]
pub struct Ramps {
    /// What they tell; the deviations hold those of the torque constant and of the ammeter's zero, too.
    pub friction: RampFriction,
    /// How many they are.
    pub count: usize,
    /// The same by the record, where it tells it.
    pub beside: Vec<Beside>,
}

/// A figure that both tell, each with its deviation, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Its name in a motor's file.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// By the ramps.
    pub ramps: [f64; 2],
    /// By the record.
    pub record: [f64; 2],
}

impl Beside {
    /// How far both lie apart, in deviations.
    pub fn apart(&self) -> f64 {
        let ([a, sa], [b, sb]) = (self.ramps, self.record);
        (a - b).abs() / sa.hypot(sb)
    }
}

impl Ramps {
    /// The friction of some ramps beside that of a record.
    pub(super) fn new(mut friction: RampFriction, count: usize, found: &Joint) -> Self {
        let relative = found.sigma[2];
        for [value, sigma] in [
            &mut friction.viscous,
            &mut friction.bias,
            &mut friction.coulomb,
        ] {
            *sigma = sigma.hypot(relative * *value);
        }
        let zero = found.motor.torque_constant * found.zero[1];
        friction.bias[1] = friction.bias[1].hypot(zero);
        let of = |name, unit, ramps, record| Beside {
            name,
            unit,
            ramps,
            record,
        };
        let mut beside = vec![of("bias", "N·m", friction.bias, found.bias)];
        // a record that does not tell dry friction takes it for viscous
        if let Some(coulomb) = found.coulomb {
            let viscous = found.motor.viscous;
            let viscous = [viscous, found.sigma[4] * viscous];
            beside.push(of("coulomb", "N·m", friction.coulomb, coulomb));
            beside.push(of("viscous", "N·m·s/rad", friction.viscous, viscous));
        }
        Ramps {
            friction,
            count,
            beside,
        }
    }

    /// The figure on which ramps and record lie farthest apart.
    pub fn farthest(&self) -> Option<&Beside> {
        let by = |a: &&Beside, b: &&Beside| a.apart().total_cmp(&b.apart());
        self.beside.iter().max_by(by)
    }

    /// Whether the deviations promise anything.
    pub fn hold(&self) -> bool {
        self.speeds_do()
            && self
                .friction
                .over_noise
                .is_some_and(|over| over <= UNEXPLAINED)
            && self.farthest().is_none_or(|b| b.apart() <= APART)
    }

    fn speeds_do(&self) -> bool {
        self.friction.speeds.iter().all(|n| *n >= SPEEDS)
    }

    /// Whether their law holds, and whether they tell what a record tells that its motor explains.
    pub(super) fn checks(&self, explained: bool) -> Vec<Check> {
        let mut checks = vec![self.law()];
        if explained && self.speeds_do() {
            checks.extend(self.farthest().map(record));
        }
        checks
    }

    fn law(&self) -> Check {
        let over = self.friction.over_noise.unwrap_or(f64::NAN);
        let check = Check::judge(
            "ramps-misfit",
            "What friction leaves of the ramps, over the noise within them",
            Measure::exact(over, ""),
            Limit::AtMost(UNEXPLAINED),
        );
        let [forward, backward] = self.friction.speeds;
        if !self.speeds_do() {
            let reason = format!(
                "{forward} speeds forward and {backward} backward: with fewer than {SPEEDS} a bend of the law or a drift is not seen, and how far the friction is off cannot be said"
            );
            return unsaid(check, &reason).remedy("record ramps at five speeds or more, both ways");
        }
        if check.status == Status::Pass {
            return check;
        }
        unsaid(
            check,
            "friction bends with the speed or the angle, or something drifts from ramp to ramp: how far it is off cannot be said",
        )
        .remedy("let the ammeter and the motor grow warm first, record ramps over the same angles, and leave out speeds at which the law is another")
    }
}

/// Judges how far ramps and record lie apart.
fn record(beside: &Beside) -> Check {
    let check = Check::judge(
        "ramps-record",
        "What ramps and record tell of friction, apart, in their deviations",
        Measure::exact(beside.apart(), ""),
        Limit::AtMost(APART),
    );
    if check.status == Status::Pass {
        return check;
    }
    unsaid(check, &both_told(beside)).remedy(
        "look at the zero of the ammeter in both records, and record both at one temperature; where friction bends with the speed neither is that of all speeds",
    )
}

/// What both tell of a figure.
pub(super) fn both_told(beside: &Beside) -> String {
    let told = |[value, sigma]: [f64; 2]| {
        if sigma.is_nan() {
            format!("{value:.3e} {}", beside.unit)
        } else {
            format!("{value:.3e} ± {sigma:.1e} {}", beside.unit)
        }
    };
    let (ramps, record) = (told(beside.ramps), told(beside.record));
    format!(
        "{}: the ramps tell {ramps}, the record {record}",
        beside.name
    )
}

fn unsaid(check: Check, reason: &str) -> Check {
    let status = Status::CannotSay;
    Check { status, ..check }.because(reason)
}
