//! What a focus calibration looks like.

use std::fmt::Write;

use meltpath_base::Provenance;
use meltpath_base::number::{WRITTEN, rounded, with_uncertainty};
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_gun::focus_walls::Wall;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::Plot;
use meltpath_report::table::{Cell, Table};
use toml::Value;

use crate::focus::found::Found;

/// Thickness by the lines, and the beam's diameter, mm.
fn at(found: &Found, wall: &Wall) -> [f64; 2] {
    let side = usize::from(wall.focus > found.calibrated.sharpest);
    let value = |[a, b]: [f64; 2]| a + b * wall.focus;
    let piece = found.calibrated.pieces[side];
    [
        value(found.calibrated.lines[side]),
        value([piece.intercept, piece.slope]),
    ]
}

fn walls(found: &Found) -> Table {
    Table::of(
        "Walls",
        found.walls.all.iter().map(|wall| {
            let [line, diameter] = at(found, wall);
            [
                ("focus (mA)", Cell::Number(1e3 * wall.focus)),
                ("thickness (µm)", Cell::Fixed(1e3 * wall.thickness, 1)),
                ("by the lines (µm)", Cell::Fixed(1e3 * line, 1)),
                (
                    "off (%)",
                    Cell::Fixed(100.0 * (wall.thickness / line - 1.0), 1),
                ),
                ("diameter of the beam (µm)", Cell::Fixed(1e3 * diameter, 1)),
            ]
        }),
    )
    .noted(&format!(
        "Thicknesses without {:.1} µm of stuck grains.",
        1e3 * found.walls.grains
    ))
}

fn plot(found: &Found) -> Plot {
    let dots = found.walls.all.iter();
    let dots = dots
        .map(|w| DVec2::new(1e3 * w.focus, 1e3 * w.thickness))
        .collect();
    let over = |of: &dyn Fn(usize, f64) -> f64| {
        let pieces = found.calibrated.pieces.iter().enumerate();
        let ends = pieces.flat_map(|(k, p)| p.range.map(|focus| (k, focus)));
        ends.map(|(k, focus)| DVec2::new(1e3 * focus, 1e3 * of(k, focus)))
            .collect()
    };
    let lines = found.calibrated.lines;
    let pieces = found.calibrated.pieces;
    Plot::new(
        "Walls and beam",
        ["focus", "mA"],
        ["thickness, diameter", "µm"],
    )
    .dots("walls", dots)
    .line(
        "thickness by the lines",
        over(&|k, f| lines[k][0] + lines[k][1] * f),
    )
    .line(
        "diameter of the beam",
        over(&|k, f| pieces[k].intercept + pieces[k].slope * f),
    )
}

/// The report.
pub fn report(file: &str, found: &Found, provenance: &Provenance) -> Report {
    Report {
        title: "Focus calibration".to_owned(),
        subtitle: format!(
            "{file} · {} · {} walls",
            found.walls.name,
            found.walls.all.len()
        ),
        verdict: found.verdict.clone(),
        scene: None,
        sections: vec![Section::new(
            "Walls",
            "",
            vec![plot(found)],
            vec![walls(found)],
        )],
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// What a terminal shows.
pub fn lines(found: &Found) -> Vec<String> {
    let pieces = found.calibrated.pieces.iter();
    let mut lines: Vec<String> = pieces
        .map(|p| {
            let [from, to] = p.range.map(|f| 1e3 * f);
            format!(
                "{from:.2} to {to:.2} mA: diameter = {:.2} µm {:+.3} µm/mA",
                1e3 * p.intercept,
                p.slope
            )
        })
        .collect();
    lines.push("focus.toml: this calibration; name it in a job: [ebm] focus".to_owned());
    lines
}

/// The calibration as a file that jobs read.
fn calibration(found: &Found) -> String {
    let word = |text: &str| Value::String(text.to_owned()).to_string();
    let slope = found.walls.line.thickness.slope;
    let mut text = format!(
        "# Written by `meltpath focus` from {} walls.\nschema = 1\nname = {}\nsource = {}\nuncertainty = {}\n",
        found.walls.all.len(),
        word(&found.walls.name),
        word(&format!(
            "walls, by meltpath focus; their thickness by {}",
            found.walls.line.source
        )),
        word(&format!(
            "walls scatter by {:.1} µm, diameters so by {:.1} µm; smallest spot {} µm at {} mA",
            1e3 * found.calibrated.scatter,
            1e3 * found.calibrated.scatter / slope,
            with_uncertainty(
                1e3 * found.calibrated.spot.value,
                1e3 * found.calibrated.spot.sigma
            ),
            with_uncertainty(
                1e3 * found.calibrated.sharpest_told.value,
                1e3 * found.calibrated.sharpest_told.sigma
            )
        )),
    );
    for p in found.calibrated.pieces {
        let [from, to] = p.range.map(|f| rounded(1e3 * f, WRITTEN));
        let (intercept, slope) = (
            rounded(1e3 * p.intercept, WRITTEN),
            rounded(p.slope, WRITTEN),
        );
        // writing into a string does not fail
        let _ = write!(
            text,
            "\n[[piece]]\nfrom = \"{from} mA\"\nto = \"{to} mA\"\nintercept = \"{intercept} µm\"\nslope = \"{slope} µm/mA\"\n",
        );
    }
    text
}

/// Writes the calibration and the walls.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    folder.write("focus.toml", |w| w.write_all(calibration(found).as_bytes()))?;
    folder.write("walls.csv", |w| {
        writeln!(w, "focus_mA,thickness_um,line_um,diameter_um")?;
        for wall in &found.walls.all {
            let [line, diameter] = at(found, wall);
            let [focus, thickness, line, diameter] =
                [wall.focus, wall.thickness, line, diameter].map(|v| rounded(1e3 * v, WRITTEN));
            writeln!(w, "{focus},{thickness},{line},{diameter}")?;
        }
        Ok(())
    })
}
