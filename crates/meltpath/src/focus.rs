//! `meltpath focus`: the focus calibration of an electron gun from walls that were built with it.

mod file;
pub mod found;

use std::path::{Path, PathBuf};

use meltpath_base::number::significant;
use meltpath_base::output::OutputFolder;
use meltpath_base::{Check, Fact, Limit, Measure, Observer, Provenance, Reporter, Status, Verdict};
use meltpath_gun::focus_walls::{FromWalls, RARE, Told, WallsError, from_walls};

use crate::cancel::{Stop, stops};
use crate::outcome::RunFolder;
use crate::views;

pub use file::{Walls, WallsFile};
pub use found::Found;

/// Walls may scatter about their lines by so much of their thickness, %: the source's are 4 to 14 % off where it checks them.
const SCATTER: f64 = 10.0;
/// The smallest spot must be known to so much of itself in 95 of 100 calibrations, %: as well as walls are asked to lie on their lines.
const SPOT: f64 = 10.0;

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
    provenance.model(
        "bounds of the sharpest focus",
        "two lines that meet, and a hyperbola with a slope on each side unless the walls rule it out (Fisher's F, 1 in 100)",
    );
    provenance.model("thickness of walls", &walls.line.source);
    let mut found = Found {
        verdict: Verdict {
            checks: vec![
                scatter(&walls, &calibrated),
                apart(&calibrated),
                straight(&calibrated),
                spot_known(&calibrated),
                known(&walls, &calibrated),
            ],
            facts: facts(&calibrated),
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
    // to a ten-thousandth of a per cent: what is left of exact walls is rounding
    let share = (1e4 * share).round() / 1e4;
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

/// A check that cannot say where it does not pass: whether the walls or the lines are wrong is not known.
fn doubted(check: Check) -> Check {
    match check.status {
        Status::Pass => check,
        _ => Check {
            status: Status::CannotSay,
            ..check
        },
    }
}

/// Whether all walls go with the lines through the others.
fn apart(found: &FromWalls) -> Check {
    let named = found.apart.as_ref();
    let count = named.map_or(0, |a| a.walls.len());
    let title = "walls that do not go with the lines through the others";
    let value = Measure::exact(count as f64, "");
    let check = doubted(Check::judge(
        "walls-apart",
        title,
        value,
        Limit::AtMost(0.0),
    ));
    let Some(named) = named else {
        return check;
    };
    let tell = named.walls.iter().zip(&named.others).map(|(wall, others)| {
        format!(
            "the wall at {} mA is {:.1} µm thick, the others say {:.1} µm",
            significant(1e3 * wall.focus, 4),
            1e3 * wall.thickness,
            1e3 * others
        )
    });
    check.because(&tell.collect::<Vec<_>>().join("; ")).remedy(
        "measure it again, and look whether it was taken for another; or leave it out of the file",
    )
}

/// Whether the walls of either side lie on a line, not on a curve.
fn straight(found: &FromWalls) -> Check {
    let title = "chance that walls on two lines look as curved as these";
    let Some(curve) = found.curve else {
        let reason = match found.apart {
            Some(_) => "a wall that does not go with the others hides it",
            None => {
                "no side of the sharpest focus has four walls, and three show no curve beside their scatter"
            }
        };
        let check = Check::not_checked("straight", title, reason);
        return check.remedy("build four walls with different focus currents on a side");
    };
    let value = Measure::exact(100.0 * curve.chance, "%");
    let limit = Limit::AtLeast(100.0 * RARE);
    let check = doubted(Check::judge("straight", title, value, limit));
    if check.status == Status::Pass {
        return check;
    }
    check
        .because("the walls lie on a curve, as those of a beam that narrows less and less towards its focus: where two lines meet is not its smallest spot")
        .remedy("build walls only where thickness goes straight, on both sides, or measure the spot near the sharpest focus by other means")
}

/// Middle and half of the interval of 95 of 100 calibrations, of thousandths.
fn most(told: Told) -> [f64; 2] {
    let [low, high] = told.most.map(|end| 1e3 * end);
    [0.5 * (low + high), 0.5 * (high - low)]
}

/// Whether the smallest spot is known, from where the lines meet, and from the waist of a caustic that explains the walls as well.
fn spot_known(found: &FromWalls) -> Check {
    let [middle, half] = most(found.spot);
    let share = 100.0 * half / middle;
    let title = "how far the smallest spot may be off, in 95 of 100 calibrations, of its diameter";
    let value = Measure::exact(share, "%");
    let check = doubted(Check::judge(
        "spot-known",
        title,
        value,
        Limit::AtMost(SPOT),
    ));
    if check.status == Status::Pass {
        return check;
    }
    let reason = match found.caustic {
        Some(waist) => format!(
            "whether the beam narrows along two lines or along a caustic the walls do not tell: the lines meet at {:.1} mA; {}",
            1e3 * found.sharpest,
            otherwise(waist)
        ),
        None => "so little do the walls, their number and their distance from the sharpest focus say of where the lines meet".to_owned(),
    };
    check
        .because(&reason)
        .remedy("build more walls, above all near the sharpest focus on both sides")
}

/// What a caustic says that explains the walls as well as the lines do.
fn otherwise([focus, diameter]: [f64; 2]) -> String {
    let [focus, diameter] = [1e3 * focus, 1e3 * diameter];
    format!(
        "a caustic explains the walls about as well, with its waist of {diameter:.0} µm at {focus:.1} mA"
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
    let check = doubted(check);
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

fn facts(found: &FromWalls) -> Vec<Fact> {
    let within = |told: Told| {
        let [middle, half] = most(told);
        let within = format!(
            "in 95 of 100 calibrations within {}",
            Measure::new(middle, half, "")
        );
        match found.caustic {
            Some(waist) => format!("{within}; {}", otherwise(waist)),
            None => within,
        }
    };
    let of = |told: Told, unit| Measure::new(1e3 * told.value, 1e3 * told.sigma, unit);
    vec![
        Fact::new(
            "sharpest",
            "focus current of the smallest spot",
            of(found.sharpest_told, "mA"),
            &format!(
                "{}; a beam that was calibrated well is sharpest at 0 mA",
                within(found.sharpest_told)
            ),
        ),
        Fact::new(
            "smallest-spot",
            "diameter of the smallest spot",
            of(found.spot, "µm"),
            &within(found.spot),
        ),
    ]
}
