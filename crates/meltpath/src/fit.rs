//! `meltpath fit`: efficiency and beam diameter from bodies that were built and measured.

pub mod error;
mod finer;
pub mod found;
mod judge;
pub mod measurements;

use std::path::{Path, PathBuf};
use std::time::Instant;

use meltpath_base::output::OutputFolder;
use meltpath_base::{Fact, Measure, Observer, Provenance, Reporter, Verdict};
use meltpath_thermal::calibration::coupon::{BeamGuess, Bench, Charts, Coupon, CouponError, sizes};
use meltpath_thermal::calibration::fit::solve_radius;
use meltpath_thermal::calibration::fit::{
    self as least_squares, Fitted, Measured, Prior, which_to_build,
};
use meltpath_thermal::material::file::Readings;

use crate::material::load;
use crate::outcome::RunFolder;
use crate::views;

pub use error::FitCommandError;
use finer::Finer;
pub use found::{Candidate, Found, Prediction};
use measurements::BOUNDS;
pub use measurements::Measurements;

/// Rounds of refinement at most.
const ROUNDS: u32 = 4;
/// Accuracy of a predicted radius, mm.
const RADIUS: f64 = 2e-3;
fn guess(values: &[f64]) -> BeamGuess {
    BeamGuess {
        efficiency: values[0],
        width: values[1],
    }
}

/// Fits and writes a folder.
///
/// # Errors
/// [`FitCommandError`]; nothing is written then.
pub fn fit(
    file: &Path,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Found, FitCommandError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let measured = measurements::read(file)?;
    crate::outcome::record_inputs(&mut provenance, &[file])?;
    let beside = file.parent().unwrap_or(Path::new(""));
    let found = search(&measured, beside, &mut provenance, observer);
    let found = found.map_err(FitCommandError::of_measurements)?;
    let Answer {
        mut fitted,
        finer,
        prediction,
    } = found;
    let checks = judge::checks(&fitted, &priors_of(&measured), &measured, &finer);
    if finer.moved.iter().all(|m| m.is_finite()) {
        fitted.widen(&finer.moved);
    }
    for (n, m) in measured.all.iter().enumerate() {
        let miss = (m.value - fitted.predicted[n]) / m.sigma.hypot(fitted.roughness[n]);
        if miss.abs() > 2.0 {
            reporter.warn(
                "not-explained",
                format!(
                    "{} differs from the corrected model by {:.1} of its uncertainties: no efficiency and diameter explain it",
                    m.name,
                    miss.abs()
                ),
                "look at the measurement and at what the model leaves out: sintered powder, beam dynamics, grains that stick",
            );
        }
    }
    let [efficiency, width] = [0, 1].map(|n| {
        let unit = "%";
        Measure::new(100.0 * fitted.values[n], 100.0 * fitted.sigmas[n], unit)
    });
    let mut facts = vec![
        Fact::new(
            "efficiency",
            "share of the power that becomes heat",
            efficiency,
            "",
        ),
        Fact::new("width", "beam diameter, of the calibrated one", width, ""),
    ];
    facts.extend(prediction.as_ref().and_then(views::fit::to_build));
    let verdict = Verdict {
        checks,
        facts,
        warnings: reporter.warnings(),
    };
    let mut found = Found {
        measurements: measured,
        fitted,
        prediction,
        verdict,
        folder: PathBuf::new(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let report = views::fit::report(&file.display().to_string(), &found, &provenance);
    let files = |folder: &OutputFolder| views::fit::write_files(folder, &found);
    found.folder = crate::outcome::leave(home, &report, files)?;
    Ok(found)
}

/// What is believed before: efficiency, and the beam's width.
fn priors_of(measured: &Measurements) -> [Prior; 2] {
    let prior = |name: &str, [value, sigma]: [f64; 2], bounds| Prior {
        name: name.to_owned(),
        value,
        sigma,
        bounds,
    };
    [
        prior("efficiency", measured.efficiency, BOUNDS[0]),
        prior("width", measured.width, BOUNDS[1]),
    ]
}

/// What a search finds.
struct Answer {
    fitted: Fitted,
    finer: Finer,
    prediction: Option<Prediction>,
}

fn search(
    measured: &Measurements,
    folder: &Path,
    provenance: &mut Provenance,
    observer: &dyn Observer,
) -> Result<Answer, FitCommandError> {
    let loaded = load(&measured.material, Readings::default(), folder)?;
    loaded.tell(provenance);
    let material = loaded.material;
    provenance.model("focus calibration", &measured.calibrated);
    provenance.model(
        "bodies",
        "chart simulation of every layer; struts by least-squares cylinder, walls by their mean thickness, pores by what stays powder",
    );
    provenance.model(
        "fit",
        "least squares with prior knowledge on smooth courses of the sizes; uncertainties, the roughness of the voxels among them, integrated over all beams that can be",
    );
    let bench = Bench {
        material: &material,
        layer: measured.layer,
        layers: measured.layers,
        spacing: measured.spacing,
    };
    let mut charts = Charts::default();
    let size = |coupon: &Coupon, values: &[f64], charts: &mut Charts| {
        coupon.size(&bench, guess(values), charts, observer)
    };
    let priors = priors_of(measured);
    let values: Vec<Measured> = measured
        .all
        .iter()
        .map(|m| Measured {
            value: m.value,
            sigma: m.sigma,
        })
        .collect();
    let coupons: Vec<&Coupon> = measured.all.iter().map(|m| &m.coupon).collect();
    let [least, most] = least_squares::evaluations(priors.len(), ROUNDS);
    let mut asked = 0;
    let begun = Instant::now();
    let mut all = |values: &[f64]| {
        if asked > 0 {
            observer.stage(&format!("all bodies, {asked} of about {most} times"), 0);
        }
        asked += 1;
        let found = sizes(&coupons, &bench, guess(values), &mut charts, observer);
        if asked == 1 {
            let minutes = begun.elapsed().as_secs_f64() / 60.0;
            observer.note(&format!(
                "all bodies once took {:.1} s; a fit draws them {least} to {most} times: {:.1} to {:.1} min, and a wanted strut some of them again",
                60.0 * minutes,
                least as f64 * minutes,
                most as f64 * minutes
            ));
        }
        found
    };
    let fitted = least_squares::fit(&priors, &values, ROUNDS, &mut all)?;
    let finer = Finer::of(&fitted, measured, &bench, observer)?;
    let start = priors.each_ref().map(|p| p.value);
    let rough = fitted.roughness.iter().zip(&finer.off);
    let rough = rough.map(|(r, off)| if off.is_finite() { r.hypot(*off) } else { *r });
    let rough: Vec<f64> = rough.collect();
    let struts = measured.all.iter().zip(&rough);
    let like = struts
        .rev()
        .find(|(m, _)| matches!(m.coupon, Coupon::Strut { .. }));
    let prediction = match (measured.wanted, like) {
        (Some(wanted), Some((like, rough))) => Some(predict(
            wanted,
            (&like.coupon, *rough),
            &start,
            &fitted,
            &mut |coupon, values| size(coupon, values, &mut charts),
        )?),
        _ => None,
    };
    Ok(Answer {
        fitted,
        finer,
        prediction,
    })
}

type Size<'a> = dyn FnMut(&Coupon, &[f64]) -> Result<f64, CouponError> + 'a;

/// The coupon with its first circle at `radius`, the others as far inside it as they were.
fn with_radius(like: &Coupon, radius: f64) -> Coupon {
    let mut moved = like.clone();
    if let Coupon::Strut { circles, .. } = &mut moved {
        let shift = radius - circles.first().map_or(radius, |c| c.0);
        for circle in circles {
            circle.0 = (circle.0 + shift).max(0.02);
        }
    }
    moved
}

fn predict(
    wanted: f64,
    (like, rough): (&Coupon, f64),
    before: &[f64],
    fitted: &Fitted,
    size: &mut Size<'_>,
) -> Result<Prediction, CouponError> {
    let Coupon::Strut { circles, .. } = like else {
        return Ok(Prediction {
            wanted,
            candidates: [Candidate {
                radius: None,
                diameter: [f64::NAN; 2],
            }; 2],
            build: None,
            curves: [Vec::new(), Vec::new()],
        });
    };
    let range = [0.5 * circles[0].0, 2.0 * circles[0].0];
    let mut find = |values: &[f64]| {
        solve_radius(wanted, range, RADIUS, &mut |r| {
            size(&with_radius(like, r), values)
        })
    };
    let (plain, mut plain_curve) = find(before)?;
    let (corrected, mut corrected_curve) = find(&fitted.values)?;
    for curve in [&mut plain_curve, &mut corrected_curve] {
        curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    let mut candidates = Vec::new();
    for radius in [plain, corrected] {
        let diameter = match radius {
            None => [f64::NAN; 2],
            Some(radius) => {
                let coupon = with_radius(like, radius);
                let here = size(&coupon, &fitted.values)?;
                let mut slopes = Vec::new();
                for n in 0..fitted.values.len() {
                    // over the uncertainty itself: shorter steps would show voxels instead of the slope
                    let mut ends = [[0.0; 2]; 2];
                    for (end, side) in ends.iter_mut().zip([-0.7, 0.7]) {
                        let mut moved = fitted.values.clone();
                        let [low, high] = BOUNDS[n];
                        moved[n] = (moved[n] + side * fitted.sigmas[n]).clamp(low, high);
                        *end = [moved[n], size(&coupon, &moved)?];
                    }
                    let width = (ends[1][0] - ends[0][0]).max(f64::MIN_POSITIVE);
                    slopes.push((ends[1][1] - ends[0][1]) / width);
                }
                [here, fitted.sigma_of(&slopes).hypot(rough)]
            }
        };
        candidates.push(Candidate { radius, diameter });
    }
    let candidates = [candidates[0], candidates[1]];
    let known: Vec<usize> = (0..2).filter(|n| candidates[*n].radius.is_some()).collect();
    let choices: Vec<(f64, f64)> = known
        .iter()
        .map(|n| (candidates[*n].diameter[0], candidates[*n].diameter[1]))
        .collect();
    Ok(Prediction {
        wanted,
        candidates,
        build: (!known.is_empty()).then(|| known[which_to_build(wanted, &choices).0]),
        curves: [plain_curve, corrected_curve],
    })
}
