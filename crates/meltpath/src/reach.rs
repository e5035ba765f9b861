//! Where on a robot's table a part can stand: a map of margins, each place held for true along the box around the part.

use std::collections::BTreeMap;
use std::path::Path;

use meltpath_base::number::significant;
use meltpath_base::{Cancelled, Observer, Reporter, Silent};
use meltpath_data::robots;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::{Mesh, Pose};
use meltpath_robot::cell::Cell;
use meltpath_robot::posture::{Axes, Held, NotHeld, Rotation, Task, hold};
use meltpath_robot::{Command, Smoothing};

use crate::cancel::cancellable;
use crate::data::{DataFileError, DataText};
use crate::job::PartUnit;
use crate::stages::part::{self, PartError};
use crate::stages::sheet::{self, How};

/// Places along a side of the table.
const PLACES: u32 = 15;

/// Side of the square that is looked at where the size of the table is not known, mm.
const SIDE: f64 = 1500.0;

/// Height over the part that travels take, mm.
const CLEARANCE: f64 = 20.0;

/// Chord error of the mesh made of a STEP file, mm: only its box counts.
const CHORD_ERROR: f64 = 0.1;

meltpath_base::passes_on! {
    /// Why there is no map.
    pub enum ReachError {
        /// The person stopped it.
        Cancelled(Cancelled),
        /// The part.
        Part[PartError],
        /// The robot's file.
        Robot(DataFileError),
    }
}

cancellable!(ReachError:
    PartError => Part, PartError::Cancelled(c) => c;
);

/// A place of the part's origin on the table, mm, and what the arm keeps there: rad, or nothing where the part is out of reach.
type PlaceOnTable = ([f64; 2], Option<f64>);

/// Where a part can stand on the table of a robot, in lines: a map, the best place, and what of it is a guess.
///
/// # Errors
/// [`ReachError`] where part or robot cannot be read.
pub fn reach(
    part: &Path,
    robot: &str,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<String>, ReachError> {
    let text = DataText::load("robot", robot, robots::ALL, Path::new(""))?;
    let cell = text.read(meltpath_robot::cell::read)?;
    let (name, mesh) = outline(part, reporter, observer)?;
    let Some((low, high)) = mesh.bounds() else {
        return Ok(vec![format!("{name} is empty")]);
    };
    let table = cell.shapes.as_ref().and_then(|s| s.table);
    let [x, y] = table.map_or([SIDE, SIDE], |t| t.size);
    let middle = cell.carrier_from_part.orientation * (0.5 * (low + high));
    let grid = |side: f64, i: u32| (f64::from(i) / f64::from(PLACES - 1) - 0.5) * side;
    let mut places: Vec<PlaceOnTable> = Vec::new();
    observer.stage("hold the part at each place", u64::from(PLACES * PLACES));
    for iy in (0..PLACES).rev() {
        for ix in 0..PLACES {
            observer.check()?;
            observer.advance(1);
            let place = [grid(x, ix) - middle.x, grid(y, iy) - middle.y];
            let held = held(&cell, place, low, high);
            places.push((place, held.ok().map(|h| margin(&h))));
        }
    }
    Ok(told(&cell, &name, &places))
}

/// The name of a part and its triangles, set down on the table: a body, or a surface that a wall is built along.
fn outline(
    part: &Path,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(String, Mesh), PartError> {
    let unit = PartUnit::Millimetre;
    // what is odd about a body is no fault of a surface
    let of_body = Reporter::new();
    match part::load(part, unit, DVec3::Z, CHORD_ERROR, &of_body, observer) {
        Ok(body) => {
            reporter.absorb(of_body);
            Ok((body.name, body.mesh))
        }
        Err(PartError::Empty { thin, .. }) if thin > 0.0 => {
            let how = How {
                unit,
                up: DVec3::Z,
                chord_error: CHORD_ERROR,
                faces: None,
            };
            let sheet = sheet::load(part, how, reporter, observer)?;
            Ok((sheet.name, sheet.mesh))
        }
        Err(other) => Err(other),
    }
}

/// The arm along the box around a part whose origin lies at a place: its edges, and a travel over it.
fn held(cell: &Cell, [x, y]: [f64; 2], low: DVec3, high: DVec3) -> Result<Held, NotHeld> {
    let ring = |z: f64| {
        let corners = [
            (low.x, low.y),
            (high.x, low.y),
            (high.x, high.y),
            (low.x, high.y),
            (low.x, low.y),
        ];
        corners.map(|(x, y)| DVec3::new(x, y, z))
    };
    let points: Vec<DVec3> = [low.z, high.z, high.z + CLEARANCE]
        .into_iter()
        .flat_map(ring)
        .collect();
    let commands: Vec<Command> = points
        .iter()
        .zip(0..)
        .map(|(p, id)| Command::line(id, *p, 1.0, Smoothing::Fine))
        .collect();
    let mut cell = cell.clone();
    cell.carrier_from_part.position = DVec3::new(x, y, 0.0);
    let start = Pose {
        position: points.first().copied().unwrap_or_default(),
        orientation: commands
            .first()
            .map_or(Pose::IDENTITY.orientation, |c| c.orientation),
    };
    let task = Task {
        cell: &cell,
        values: cell.at_rest(),
        axes: Axes::Standing,
        start,
        commands: &commands,
        rotation: Rotation::Free,
        configurations: &BTreeMap::new(),
    };
    hold(&task, &Silent)
}

/// The least distance of a joint from its limits or of the wrist from its singularity, rad.
fn margin(held: &Held) -> f64 {
    let m = &held.margins;
    let least = [m.limit, m.wrist, m.elbow].into_iter().flatten();
    least.map(|l| l.value).fold(f64::INFINITY, f64::min)
}

fn told(cell: &Cell, part: &str, places: &[PlaceOnTable]) -> Vec<String> {
    let mut lines = vec![
        format!("{part} on the table of {}", cell.name),
        "deg that the arm keeps from limits and singularities with the middle of the part at each place; . out of reach".to_owned(),
        "x to the right, y up, as the table's".to_owned(),
    ];
    for row in places.chunks(PLACES as usize) {
        let cells = row.iter().map(|(_, margin)| match margin {
            Some(margin) => format!("{:4.0}", margin.to_degrees()),
            None => format!("{:>4}", "."),
        });
        lines.push(cells.collect());
    }
    let held = places
        .iter()
        .filter_map(|(place, margin)| Some((place, (*margin)?)));
    let best = held.fold(None, |best: Option<(&[f64; 2], f64)>, new| match best {
        Some(best) if best.1 >= new.1 => Some(best),
        _ => Some(new),
    });
    lines.push(match best {
        Some(([x, y], margin)) => format!(
            "best: place = [\"{} mm\", \"{} mm\", \"0 mm\"], {} deg",
            whole(*x),
            whole(*y),
            significant(margin.to_degrees(), 3)
        ),
        None => "nowhere on the table: move the table, or take a longer arm".to_owned(),
    });
    let guesses = cell.guesses();
    if !guesses.is_empty() {
        lines.push(format!(
            "GUESSED in the robot's file: {}",
            guesses.join(", ")
        ));
    }
    lines
}

/// A length to the millimetre.
fn whole(value: f64) -> String {
    // adding zero takes the sign from a zero
    format!("{}", value.round() + 0.0)
}

#[cfg(test)]
mod tests {
    use meltpath_data::{find, robots};

    use super::*;

    /// A place that the map calls within reach is: near the arm's own table, and not where the arm does not reach.
    #[test]
    fn a_box_is_held_near_the_table_and_not_far_from_it() {
        let text = find(robots::ALL, "kuka-kr16-r2010-2").map_or("", |f| f.text);
        let Ok(cell) = meltpath_robot::cell::read(text) else {
            panic!("the robot that ships reads")
        };
        let (low, high) = (DVec3::ZERO, DVec3::new(100.0, 80.0, 60.0));
        let near = held(&cell, [-50.0, -40.0], low, high);
        assert!(near.is_ok_and(|h| margin(&h) > 0.1));
        assert!(held(&cell, [1500.0, 0.0], low, high).is_err());
    }
}
