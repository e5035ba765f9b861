//! The file of pursuit lengths that measured corners make.

use std::fmt::Write;

use toml::Value;

use super::super::file::Scan;
use super::super::found::MeasuredCorner;
use super::judge::usable;

/// Corners whose angles are within this of each other are one, rad: half a degree.
const SAME: f64 = 0.0087;
/// Most angles of a law.
const MOST: usize = meltpath_deposition::pursuit::law::MOST;

/// The length of one angle.
struct Row {
    turn: f64,
    length: f64,
    sigma: f64,
    /// What the crest of the deposit's model shows when it is laid with the length of each, mm: the mean.
    shown: f64,
    beads: Vec<usize>,
}

/// Why corners make no law.
pub(crate) type NoLaw = (String, &'static str);

/// The pursuit lengths of corners of one angle: their mean, and its uncertainty from the crests or from how they scatter, whichever is more.
fn rows(corners: &[MeasuredCorner]) -> Vec<Row> {
    let mut all: Vec<(usize, &MeasuredCorner)> = corners.iter().enumerate().collect();
    all.retain(|(_, c)| usable(c).is_ok());
    all.sort_by(|a, b| a.1.told.turn.abs().total_cmp(&b.1.told.turn.abs()));
    let same = |a: &(usize, &MeasuredCorner), b: &(usize, &MeasuredCorner)| {
        b.1.told.turn.abs() - a.1.told.turn.abs() < SAME
    };
    let row = |of: &[(usize, &MeasuredCorner)]| {
        let found: Vec<[f64; 2]> = of
            .iter()
            .filter_map(|(_, c)| c.pursuit.as_ref().ok())
            .map(|p| [p.length, p.sigma])
            .collect();
        let n = found.len() as f64;
        let length = found.iter().map(|p| p[0]).sum::<f64>() / n;
        let squares: f64 = found.iter().map(|p| (p[0] - length).powi(2)).sum();
        let scatter = (squares / (n - 1.0).max(1.0) / n).sqrt();
        let told = found.iter().map(|p| p[1] * p[1]).sum::<f64>().sqrt() / n;
        Row {
            turn: of[0].1.told.turn.abs(),
            length,
            sigma: told.max(scatter),
            shown: of
                .iter()
                .map(|(_, c)| c.shown_by_model.unwrap_or(f64::NAN))
                .sum::<f64>()
                / n,
            beads: of.iter().map(|(k, _)| k + 1).collect(),
        }
    };
    all.chunk_by(same).map(row).collect()
}

/// The file, as a job reads it.
///
/// # Errors
/// What is lacking, and what to do.
pub(crate) fn of(scan: &Scan, corners: &[MeasuredCorner]) -> Result<String, NoLaw> {
    let (Some(wire), Some([gas, mode])) = (&scan.wire, &scan.process) else {
        return Err((
            "the file does not tell wire, gas and mode".to_owned(),
            "write wire, gas and mode for one",
        ));
    };
    let rows = rows(corners);
    if rows.is_empty() {
        let why = corners.iter().find_map(|c| usable(c).err());
        return Err((
            format!(
                "no corner gives a length ({})",
                why.unwrap_or_else(|| "none was measured".to_owned())
            ),
            "mend what the checks tell first; sharper corners say more",
        ));
    }
    if rows.len() > MOST {
        return Err((
            format!("{} angles are more than the {MOST} of a law", rows.len()),
            "leave some of the corners out",
        ));
    }
    let word = |text: &str| Value::String(text.to_owned()).to_string();
    let source = word(&scan.name);
    let mut text = format!(
        "# Written by `meltpath measure` from {} corners. Name it in a job: [waam] pursuit = \"pursuit.toml\".\n# Linear between the angles, constant below and beyond.\nschema = 1\nid = {}\nwire = {}\ngas = {}\nmode = {}\n",
        rows.iter().map(|r| r.beads.len()).sum::<usize>(),
        word(&format!("{}-{mode}-{gas}-measured", *wire.id)),
        word(&wire.id),
        word(gas),
        word(mode),
    );
    for row in rows {
        let beads: Vec<String> = row.beads.iter().map(usize::to_string).collect();
        // writing into a string does not fail
        let _ = write!(
            text,
            "\n[[pursuit]]\ncorner = \"{:.2}°\"\nlength = {{ value = {:.3}, unit = \"mm\", uncertainty = {:.3}, source = {source}, page = \"scan\", note = \"nearest to the crest of corner {}{}\" }}\n",
            row.turn.to_degrees(),
            row.length,
            row.sigma,
            beads.join(", "),
            if row.shown.is_finite() {
                format!(
                    "; a job's deposit with it shows {:.2} mm by its own crest",
                    row.shown
                )
            } else {
                String::new()
            }
        );
    }
    Ok(text)
}
