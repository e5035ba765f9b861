//! The file of walls that were built for a focus calibration.

use std::path::Path;

use meltpath_base::settings::{self, Problem};
use meltpath_base::{Current, Length, Speed, Voltage, table};
use meltpath_gun::focus::stuck_grains;
use meltpath_gun::focus_walls::{Thickness, Wall};

use crate::job::{JobError, Problems, text_of};

/// The beam of the source's walls: voltage, V, current, A, speed, mm/s.
const SOURCE: [f64; 3] = [60e3, 5e-3, 1400.0];

/// The source's line (Béraud 2016, eq. 3.2.5), from 0.3 mm on. Simulated walls follow it to some 0.4 mm: a wider beam no longer melts its
/// rim (erratum E18).
fn of_source() -> Line {
    Line {
        thickness: Thickness {
            intercept: 0.12,
            slope: 0.6,
        },
        diameters: [0.3, 0.4],
        source: "Béraud 2016, eq. 3.2.5".to_owned(),
    }
}

table! {
    /// Walls of one line a layer, each with another current of the focus coil.
    pub struct WallsFile {
        /// The machine and the date: a calibration holds until the beam is calibrated anew.
        name: String => required;
        /// The largest grain of the powder: stuck grains are part of the thickness.
        largest_grain: Length where positive => none("thicknesses were measured without stuck grains");
        /// Acceleration voltage.
        voltage: Voltage where positive => required;
        /// Beam current.
        current: Current where positive => required;
        /// Speed of the beam.
        speed: Speed where positive => required;
        /// How thick walls of that beam become.
        thickness: ThicknessTable => none("that of Béraud 2016, for walls of Ti6Al4V by its beam: 60 kV, 5 mA, 1400 mm/s");
        /// The walls.
        walls as "wall": Vec<FocusWall> => required;
    }

    /// Thickness of a wall against the beam's diameter: intercept + slope · diameter.
    pub struct ThicknessTable {
        /// Of a beam of no diameter.
        intercept: Length where not_negative => required;
        /// Change with the diameter, a number.
        slope: f64 where positive => required;
        /// Least and greatest diameter for which that was found.
        diameters: [Length; 2] where positive => required;
        /// Who says so.
        source: String => required;
    }

    /// A wall.
    pub struct FocusWall {
        /// Current of the focus coil, an ampere at most to either side.
        focus: Current where within(-1.0, 1.0) => required;
        /// Its thickness as measured.
        measured: Length where positive => required;
    }
}

/// How thick walls become, and how far that is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Thickness over the beam's diameter.
    pub thickness: Thickness,
    /// Least and greatest diameter for which that was found, mm.
    pub diameters: [f64; 2],
    /// Who says so.
    pub source: String,
}

/// The file, resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Walls {
    /// Machine and date.
    pub name: String,
    /// What stuck grains add, mm.
    pub grains: f64,
    /// How thick walls become.
    pub line: Line,
    /// The walls without stuck grains.
    pub all: Vec<Wall>,
}

/// Reads a file.
///
/// # Errors
/// [`JobError`]: everything wrong, each with its place.
pub(super) fn read(path: &Path) -> Result<Walls, JobError> {
    let text = text_of(path)?;
    settings::parse(&text, |_: &WallsFile| Vec::new())
        .and_then(|file| resolve(&file))
        .map_err(|problems| JobError::in_file(path, &text, problems))
}

fn resolve(file: &WallsFile) -> Result<Walls, Problems> {
    let grains = file.largest_grain.map_or(0.0, |g| stuck_grains(g.0));
    let mut problems: Vec<Problem> = Vec::new();
    let mut all = Vec::new();
    for wall in file.walls.iter() {
        let thickness = wall.measured.0 - grains;
        if thickness <= 0.0 {
            let message = format!(
                "a wall of {:.4} mm, of which {grains:.4} mm are stuck grains: nothing is left; was it measured without them?",
                wall.measured.0
            );
            problems.push(wall.measured.problem(message));
        }
        all.push(Wall {
            focus: wall.focus.0,
            thickness,
        });
    }
    if let Some(told) = &*file.thickness
        && told.diameters[0].0 >= told.diameters[1].0
    {
        let message =
            "thickness.diameters: the least comes first, then the greatest, and they differ";
        let help = "write them the other way round";
        problems.push(told.diameters.problem(message).help(help));
    }
    let beam = [file.voltage.0, file.current.0, file.speed.0];
    let line = match &*file.thickness {
        Some(told) => Some(Line {
            thickness: Thickness {
                intercept: told.intercept.0,
                slope: *told.slope,
            },
            diameters: told.diameters.map(|d| d.0),
            source: told.source.value.clone(),
        }),
        None if beam
            .iter()
            .zip(SOURCE)
            .all(|(a, b)| (a / b - 1.0).abs() < 1e-6) =>
        {
            Some(of_source())
        }
        None => {
            let message = "how thick walls of this beam become is not known: the source's line is for 60 kV, 5 mA and 1400 mm/s";
            let help = "build the walls with that beam, or write [thickness] with intercept, slope, diameters and source";
            problems.push(file.thickness.problem(message).help(help));
            None
        }
    };
    match line {
        Some(line) if problems.is_empty() => Ok(Walls {
            name: file.name.value.clone(),
            grains,
            line,
            all,
        }),
        _ => Err(problems.into()),
    }
}
