//! `meltpath focus`: the focus calibration of an electron gun from walls that were built with it.

mod file;
pub mod found;

use std::path::{Path, PathBuf};

use meltpath_base::output::OutputFolder;
use meltpath_base::{Check, Fact, Limit, Measure, Observer, Provenance, Reporter, Status, Verdict};
use meltpath_gun::focus_walls::{FromWalls, WallsError, from_walls};

use crate::cancel::{Stop, stops};
use crate::outcome::RunFolder;
use crate::views;

pub use file::{Walls, WallsFile};
pub use found::Found;

/// Walls may scatter about their lines by so much of their thickness, %: the source's are 4 to 14 % off where it checks them.
const SCATTER: f64 = 10.0;

meltpath_base::passes_on! {
    /// Why walls gave no calibration.
    pub enum FocusCommandError {
        /// What stops any command.
        Stop(Stop),
        /// The walls.
        Walls(WallsError),
    }
}

stops!(FocusCommandError);

/// Finds the calibration of a file of walls and writes a folder.
///
/// # Errors
/// [`FocusCommandError`]; nothing is written then.
pub fn calibrate(
    path: &Path,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Found, FocusCommandError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let walls = file::read(path)?;
    crate::outcome::record_inputs(&mut provenance, &[path])?;
    let calibrated = from_walls(&walls.all, walls.line.thickness)?;
    provenance.model(
        "focus calibration",
        "two lines of least squares through the thickness of walls, which meet between two of them (Béraud 2016, section 3.2.2.1.3)",
    );
    provenance.model("thickness of walls", &walls.line.source);
    let mut found = Found {
        verdict: Verdict {
            checks: vec![scatter(&walls, &calibrated), known(&walls, &calibrated)],
            facts: facts(&walls, &calibrated),
            warnings: reporter.warnings(),
        },
        walls,
        calibrated,
        folder: PathBuf::new(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let report = views::focus::report(&path.display().to_string(), &found, &provenance);
    let files = |folder: &OutputFolder| views::focus::write_files(folder, &found);
    found.folder = crate::outcome::leave(home, &report, files)?;
    Ok(found)
}

/// Whether walls lie on two lines.
fn scatter(walls: &Walls, found: &FromWalls) -> Check {
    let sum: f64 = walls.all.iter().map(|w| w.thickness).sum();
    let share = 100.0 * found.scatter * walls.all.len() as f64 / sum;
    let title = "scatter of the walls about their lines, of their thickness";
    let value = Measure::exact(share, "%");
    let check = Check::judge("scatter", title, value, Limit::AtMost(SCATTER));
    if check.status == Status::Pass && found.currents.contains(&2) {
        // a wall that belongs to the other line, or is measured wrong, does not show
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        return check
            .because("the line on one side of the sharpest focus goes through its two walls, however far they are off")
            .remedy("build a third wall on that side, with another focus current");
    }
    check.remedy(
        "look at the walls farthest off in the report, measure them again, or build more of them",
    )
}

/// Whether the line of thickness over diameter is known for all diameters that are told by it.
fn known(walls: &Walls, found: &FromWalls) -> Check {
    let [least, greatest] = walls.line.diameters;
    let ends = found
        .pieces
        .iter()
        .flat_map(|p| p.range.map(|focus| p.intercept + p.slope * focus));
    let beyond = ends
        .map(|d| (d - greatest).max(least - d))
        .fold(0.0, f64::max);
    let title = "diameters beyond those for which the thickness of walls is known";
    let value = Measure::exact(1e3 * beyond, "µm");
    let check = Check::judge("thickness-known", title, value, Limit::AtMost(0.0));
    let check = match check.status {
        Status::Pass => check,
        _ => Check {
            status: Status::CannotSay,
            ..check
        },
    };
    let reason = format!(
        "{}: for {:.0} to {:.0} µm",
        walls.line.source,
        1e3 * least,
        1e3 * greatest
    );
    check.because(&reason).remedy(
        "write [thickness] with a line that was found for such walls: cut some, or simulate them",
    )
}

fn facts(walls: &Walls, found: &FromWalls) -> Vec<Fact> {
    let slope = walls.line.thickness.slope;
    let [piece, _] = found.pieces;
    let spot = piece.intercept + piece.slope * found.sharpest;
    vec![
        Fact::new(
            "sharpest",
            "focus current of the smallest spot",
            Measure::exact(1e3 * found.sharpest, "mA"),
            "a beam that was calibrated well is sharpest at 0 mA",
        ),
        Fact::new(
            "smallest-spot",
            "diameter of the smallest spot",
            Measure::new(1e3 * spot, 1e3 * found.scatter / slope, "µm"),
            "",
        ),
    ]
}
