//! The checks of a fit: whether it explains what was measured, whether its beam can be, whether anything was learnt.

use meltpath_base::{Check, Limit, Measure, Status};
use meltpath_thermal::calibration::fit::{Fitted, Prior};

use super::finer::Finer;
use super::measurements::Measurements;

/// Standard deviations of a normal distribution that 95 % of its values stay below.
const OF_95: f64 = 1.645;
/// Greatest share of what was uncertain before that still is where something was learnt, %.
const LEARNT: f64 = 98.0;

/// All checks of a fit.
pub(super) fn checks(
    fitted: &Fitted,
    priors: &[Prior],
    measured: &Measurements,
    finer: &Finer,
) -> Vec<Check> {
    vec![
        explained(fitted, priors, measured.all.len()),
        can_be(fitted, priors),
        taught(fitted, measured),
        converged(fitted, priors, finer),
    ]
}

/// Whether finer charts and as many layers as show a body's size leave the beam where it is.
fn converged(fitted: &Fitted, priors: &[Prior], finer: &Finer) -> Check {
    let title =
        "how far finer charts and more layers would move a fitted number, of its uncertainty";
    let of = |n: usize| 100.0 * finer.moved[n].abs() / fitted.sigmas[n];
    let worst = (0..priors.len()).max_by(|a, b| of(*a).total_cmp(&of(*b)));
    let value = worst.map_or(f64::NAN, of);
    let limit = Limit::AtMost(100.0);
    let mut check = Check::judge("converged", title, Measure::exact(value, "%"), limit);
    if check.status == Status::Fail {
        check.status = Status::CannotSay;
    }
    let told = worst.map_or_else(String::new, |n| {
        format!(
            "at the fitted beam the bodies were drawn again with charts {:.1} µm apart and {} layers: by them the {} would be {:+.1} % of {:.1} %, which its uncertainty holds",
            1e3 * finer.spacing,
            finer.layers,
            priors[n].name,
            100.0 * finer.moved[n],
            100.0 * fitted.values[n],
        )
    });
    check.because(&told).remedy(
        "write a finer spacing (left out it is 25 µm) and no layers (5): what is printed is of charts too coarse, or of too few layers, for its uncertainty",
    )
}

/// Misses of measurements and priors against as many as chance makes. Each prior is one more measurement, each parameter takes one
/// degree of freedom: as many are left as there are measurements.
fn explained(fitted: &Fitted, priors: &[Prior], freedom: usize) -> Check {
    let pulls = priors.iter().zip(&fitted.values);
    let pulls = pulls.map(|(p, value)| ((value - p.value) / p.sigma).powi(2));
    let squares = fitted.misfit + pulls.sum::<f64>();
    let title = "misses of measurements and of what was believed, each in its uncertainty, squared and added";
    let limit = Limit::AtMost(chance(freedom));
    let value = Measure::exact(squares, "");
    Check::judge("explained", title, value, limit)
        .because(&format!(
            "{freedom} degrees of freedom; chance alone stays below the limit in 95 of 100 fits"
        ))
        .remedy("look at the measurements that miss most, their units and their uncertainties, the beam of each body, and what the model leaves out: sintered powder, beam dynamics, grains that stick")
}

/// The sum of so many squares that 95 of 100 stay below (Wilson and Hilferty 1931: 2.5 % low of one square, less of more).
fn chance(freedom: usize) -> f64 {
    let n = freedom.max(1) as f64;
    let spread = 2.0 / (9.0 * n);
    n * (1.0 - spread + OF_95 * spread.sqrt()).powi(3)
}

/// Whether the fitted beam lies inside the limits of what is physical.
fn can_be(fitted: &Fitted, priors: &[Prior]) -> Check {
    let pairs = priors.iter().zip(&fitted.values);
    let at_bound: Vec<String> = pairs
        .filter(|(p, value)| p.bounds.contains(value))
        .map(|(p, value)| format!("the fitted {} is {:.0} %", p.name, 100.0 * value))
        .collect();
    let title = "fitted numbers that stand at the limit of what is physical";
    let value = Measure::exact(at_bound.len() as f64, "");
    let check = Check::judge("inside-limits", title, value, Limit::AtMost(0.0));
    let check = match &*at_bound {
        [] => check,
        some => check.because(&some.join(", ")),
    };
    check.remedy(
        "do not use this beam: look at the measured sizes, their units, and the beam of each body",
    )
}

/// What of the uncertainty before is left; a fit that says no more than what was believed before says so.
fn taught(fitted: &Fitted, measured: &Measurements) -> Check {
    let left = fitted.sigmas.iter().zip(&fitted.believed);
    let left = left.map(|(sigma, before)| 100.0 * sigma / before);
    let left = left.fold(f64::INFINITY, f64::min);
    let title =
        "what measurements leave of the uncertainty before, of the number they tell most of";
    let check = Check::judge(
        "taught",
        title,
        Measure::exact(left, "%"),
        Limit::AtMost(LEARNT),
    );
    if !fitted.is_blind() {
        return check.remedy(REMEDY);
    }
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let spacing = 1e3 * measured.spacing;
    check
        .because(&format!(
            "what is printed is what was believed before: on charts {spacing:.0} µm apart no measured size changes with efficiency or diameter by more than its steps"
        ))
        .remedy(REMEDY)
}

/// What lets a fit learn more.
const REMEDY: &str = "finer charts (spacing, 25 µm by default), more layers, or bodies that answer to the beam: struts and walls of several powers";

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(values: [f64; 2], misfit: f64) -> Fitted {
        Fitted {
            values: values.to_vec(),
            sigmas: vec![0.05, 0.1],
            believed: vec![0.1, 0.1],
            before: Vec::new(),
            predicted: Vec::new(),
            covariance: Vec::new(),
            roughness: Vec::new(),
            slopes: Vec::new(),
            weighed: Vec::new(),
            misfit,
            evaluations: 1,
        }
    }

    fn priors() -> [Prior; 2] {
        [[0.3, 1.0], [0.4, 2.0]].map(|bounds| Prior {
            name: "efficiency".to_owned(),
            value: 0.9,
            sigma: 0.1,
            bounds,
        })
    }

    /// The table of chi squared: 3.84, 5.99, 18.3 at 1, 2, 10 degrees of freedom.
    #[test]
    fn chance_is_that_of_the_tables() {
        for (freedom, told) in [(1, 3.841), (2, 5.991), (10, 18.307)] {
            let found = chance(freedom);
            assert!((found / told - 1.0).abs() < 0.03, "{freedom}: {found}");
        }
    }

    /// Charts that move a number by more than its uncertainty leave nothing to say of it.
    #[test]
    fn what_finer_charts_move_cannot_be_told() {
        let judged = |moved: [f64; 2]| {
            let finer = Finer {
                spacing: 0.025,
                layers: 5,
                off: Vec::new(),
                moved: moved.to_vec(),
            };
            converged(&fitted([0.9, 0.9], 0.0), &priors(), &finer).status
        };
        assert_eq!(judged([0.04, 0.05]), Status::Pass);
        assert_eq!(judged([-0.06, 0.05]), Status::CannotSay);
        assert_eq!(judged([f64::NAN, 0.05]), Status::CannotSay);
    }

    #[test]
    fn what_is_not_explained_and_what_cannot_be_fail() {
        let status = |check: Check| check.status;
        let explained = |misfit| status(explained(&fitted([0.9, 0.9], misfit), &priors(), 2));
        assert_eq!(explained(5.0), Status::Pass);
        assert_eq!(explained(7.0), Status::Fail);
        // what is believed is as good as a measurement: a fit that leaves it by three of its uncertainties explains nothing
        let pulled = super::explained(&fitted([0.6, 0.9], 0.0), &priors(), 2);
        assert_eq!(pulled.status, Status::Fail);
        assert_eq!(
            status(can_be(&fitted([0.9, 0.9], 0.0), &priors())),
            Status::Pass
        );
        let beyond = can_be(&fitted([1.0, 0.9], 0.0), &priors());
        assert_eq!(beyond.status, Status::Fail);
        assert!(
            beyond.reason.contains("efficiency is 100 %"),
            "{}",
            beyond.reason
        );
    }
}
