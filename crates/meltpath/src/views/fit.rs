//! What a fit looks like: parameters, measurements before and after, contours for the wanted diameter.

use meltpath_base::number::{significant, with_uncertainty};
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Fact, Measure, Provenance};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::Plot;
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::calibration::coupon::Coupon;
use meltpath_thermal::calibration::fit::Fitted;

use crate::fit::found::{Found, Prediction};

/// Factor and unit in which a measurement is shown.
fn shown(coupon: &Coupon) -> (f64, &'static str) {
    match coupon {
        Coupon::Block { .. } => (100.0, "%"),
        Coupon::Strut { .. } | Coupon::Wall { .. } => (1e3, "µm"),
    }
}

fn parameters(found: &Found) -> Table {
    let mut table = Table::new("Beam", &["", "before (%)", "±", "fitted (%)", "±"]);
    let priors = [
        ("efficiency", found.measurements.efficiency),
        ("diameter, of the calibrated one", found.measurements.width),
    ];
    for (n, (name, before)) in priors.into_iter().enumerate() {
        table.rows.push(vec![
            Cell::text(name),
            Cell::Number(100.0 * before[0]),
            Cell::Number(100.0 * before[1]),
            Cell::Number(100.0 * found.fitted.values[n]),
            Cell::Number(100.0 * found.fitted.sigmas[n]),
        ]);
    }
    let covariance = &found.fitted.covariance;
    let scale = (covariance[0][0] * covariance[1][1]).sqrt();
    table.note = format!(
        "Correlation of the two {:.2}; {} simulations; sum of squared misses, each in its uncertainty, {:.2} over {} measurements.",
        covariance[0][1] / scale,
        found.fitted.evaluations,
        found.fitted.misfit,
        found.measurements.all.len()
    );
    table
}

/// Every body by its name with the unit it is shown in: measured, its uncertainty, the model's roughness, before and fitted.
fn compared(found: &Found) -> impl Iterator<Item = (&str, &'static str, [f64; 5])> {
    let all = found.measurements.all.iter().enumerate();
    all.map(|(n, m)| {
        let (factor, unit) = shown(&m.coupon);
        let Fitted {
            roughness,
            before,
            predicted,
            ..
        } = &found.fitted;
        let values = [m.value, m.sigma, roughness[n], before[n], predicted[n]];
        (m.name.as_str(), unit, values.map(|v| factor * v))
    })
}

fn bodies(found: &Found) -> Table {
    Table::of(
        "Measured and computed",
        compared(found).map(|(name, unit, [value, sigma, rough, before, fitted])| {
            [
                ("body", Cell::text(name)),
                ("unit", Cell::text(unit)),
                ("measured", Cell::Number(value)),
                ("±", Cell::Number(sigma)),
                ("± of the model", Cell::Number(rough)),
                ("before", Cell::Number(before)),
                ("fitted", Cell::Number(fitted)),
                ("miss (in both ±)", Cell::Fixed((value - fitted) / sigma.hypot(rough), 2)),
            ]
        }),
    )
    .noted("Walls without stuck grains. The model's own ±: its sizes go by steps, for they are drawn on voxels.")
}

const NAMES: [&str; 2] = ["uncalibrated", "calibrated"];

fn contours(p: &Prediction) -> Table {
    let mut table = Table::new(
        &format!("First contour of a strut of {:.3} mm", p.wanted),
        &["beam", "radius (mm)", "diameter expected (mm)", "±", ""],
    );
    for (n, c) in p.candidates.iter().enumerate() {
        table.rows.push(vec![
            Cell::text(NAMES[n]),
            c.radius.map_or(Cell::text("none"), |r| Cell::Fixed(r, 3)),
            Cell::Number(c.diameter[0]),
            Cell::Number(c.diameter[1]),
            Cell::text(if p.build == Some(n) {
                "build this one"
            } else {
                ""
            }),
        ]);
    }
    "Both diameters as the calibrated beam gives them, with the uncertainty that efficiency and beam diameter leave; to build: the contour whose expected squared miss is smaller."
        .clone_into(&mut table.note);
    table
}

fn curve_plot(found: &Found, p: &Prediction) -> Plot {
    let points = |curve: &[[f64; 2]]| curve.iter().map(|c| DVec2::new(c[0], c[1])).collect();
    let measured = found
        .measurements
        .all
        .iter()
        .filter_map(|m| match &m.coupon {
            Coupon::Strut { circles, .. } => Some(DVec2::new(circles[0].0, m.value)),
            _ => None,
        })
        .collect();
    let mut plot = Plot::new(
        "Diameter against first contour",
        ["radius", "mm"],
        ["diameter", "mm"],
    );
    for (name, curve) in NAMES.iter().zip(&p.curves) {
        plot = plot.line((*name).to_owned(), points(curve));
    }
    plot.dots("measured", measured).limit("wanted", p.wanted)
}

/// The report.
pub fn report(file: &str, found: &Found, provenance: &Provenance) -> Report {
    let mut sections = vec![Section::new(
        "The beam that explains what was built",
        "",
        vec![],
        vec![parameters(found), bodies(found)],
    )];
    if let Some(p) = &found.prediction {
        sections.push(Section::new(
            "What to build",
            "",
            vec![curve_plot(found, p)],
            vec![contours(p)],
        ));
    }
    Report {
        title: "Beam fitted to measurements".to_owned(),
        subtitle: format!("{file} · {} measurements", found.measurements.all.len()),
        verdict: found.verdict.clone(),
        scene: None,
        sections,
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// The contour that is better built of the two, mm.
pub(crate) fn to_build(p: &Prediction) -> Option<Fact> {
    let (n, radius) = p.build.and_then(|n| Some((n, p.candidates[n].radius?)))?;
    let title = format!("contour to build ({})", NAMES[n]);
    let radius = Measure::exact(radius, "mm");
    Some(Fact::new("contour-to-build", &title, radius, ""))
}

/// What a terminal shows.
pub fn lines(found: &Found) -> Vec<String> {
    let mut lines: Vec<String> = ["efficiency", "diameter, of the calibrated one"]
        .iter()
        .enumerate()
        .map(|(n, name)| {
            let [value, sigma] = [&found.fitted.values, &found.fitted.sigmas].map(|v| 100.0 * v[n]);
            format!("{name}: {} %", with_uncertainty(value, sigma))
        })
        .collect();
    lines.extend(
        compared(found).map(|(name, unit, [value, sigma, _, before, fitted])| {
            let [before, fitted] = [before, fitted].map(|size| significant(size, 4));
            let measured = with_uncertainty(value, sigma);
            format!("{name}: measured {measured} {unit}, before {before}, fitted {fitted}")
        }),
    );
    if let Some(p) = &found.prediction {
        for (n, c) in p.candidates.iter().enumerate() {
            let build = if p.build == Some(n) {
                ": build this one"
            } else {
                ""
            };
            lines.push(match c.radius {
                Some(r) => format!(
                    "{} contour for {:.3} mm: {r:.3} mm, expected {} mm{build}",
                    NAMES[n],
                    p.wanted,
                    with_uncertainty(c.diameter[0], c.diameter[1])
                ),
                None => format!("{} contour for {:.3} mm: none found", NAMES[n], p.wanted),
            });
        }
    }
    lines
}

/// Writes the measurements before and after, and the verdict.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    folder.write("fit.csv", |w| {
        writeln!(w, "body,unit,measured,sigma,model_sigma,before,fitted")?;
        for (name, unit, [value, sigma, rough, before, fitted]) in compared(found) {
            writeln!(w, "{name},{unit},{value},{sigma},{rough},{before},{fitted}")?;
        }
        Ok(())
    })
}
