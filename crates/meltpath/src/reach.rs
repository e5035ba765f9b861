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

/// What reaches no farther over an edge is rounding, mm.
const ROUNDING: f64 = 1e-6;

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

/// A place of the part on the table.
#[derive(Debug, Clone, Copy)]
struct PlaceOnTable {
    /// The part's origin, mm.
    at: [f64; 2],
    /// What the arm keeps there, rad; nothing where the part is out of reach.
    margin: Option<f64>,
    /// How far the part reaches over the table's edge, mm: 0 where it does not, or where nobody says how large the table is.
    over: f64,
}

/// Where a part can stand on the table of a robot, in lines: a map, the best place, and what of it is a guess. `unit` is that of a part
/// file that carries none.
///
/// # Errors
/// [`ReachError`] where part or robot cannot be read.
pub fn reach(
    part: &Path,
    unit: PartUnit,
    robot: &str,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<String>, ReachError> {
    let text = DataText::load("robot", robot, robots::ALL, Path::new(""))?;
    let cell = text.read(meltpath_robot::cell::read)?;
    let (name, mesh) = outline(part, unit, reporter, observer)?;
    let Some((low, high)) = mesh.bounds() else {
        return Ok(vec![format!("{name} is empty")]);
    };
    let table = cell.shapes.as_ref().and_then(|s| s.table);
    let [x, y] = table.map_or([SIDE, SIDE], |t| t.size);
    let (low_on, high_on) = on_table(&cell, &mesh);
    let middle = 0.5 * (low_on + high_on);
    let grid = |side: f64, i: u32| (f64::from(i) / f64::from(PLACES - 1) - 0.5) * side;
    let mut places: Vec<PlaceOnTable> = Vec::new();
    observer.stage("hold the part at each place", u64::from(PLACES * PLACES));
    for iy in (0..PLACES).rev() {
        for ix in 0..PLACES {
            observer.check()?;
            observer.advance(1);
            let place = [grid(x, ix) - middle.x, grid(y, iy) - middle.y];
            let held = held(&cell, place, low, high);
            let beyond = |i: usize, side: f64| {
                (place[i] + high_on[i]).max(-place[i] - low_on[i]) - 0.5 * side
            };
            let over = table.map_or(0.0, |t| beyond(0, t.size[0]).max(beyond(1, t.size[1])));
            places.push(PlaceOnTable {
                at: place,
                margin: held.ok().map(|h| margin(&h)),
                over: if over > ROUNDING { over } else { 0.0 },
            });
        }
    }
    Ok(told(&cell, &name, &places))
}

/// The box of the part along the axes of the table, from its origin.
fn on_table(cell: &Cell, mesh: &Mesh) -> (DVec3, DVec3) {
    let turned = |p: &DVec3| cell.carrier_from_part.orientation * *p;
    mesh.vertices
        .iter()
        .map(turned)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        })
}

/// The name of a part and its triangles, set down on the table: a body, or a surface that a wall is built along.
fn outline(
    part: &Path,
    unit: PartUnit,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(String, Mesh), PartError> {
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
        "x to the right, y up, as the table's; ' where the part reaches over the table's edge".to_owned(),
    ];
    for row in places.chunks(PLACES as usize) {
        let cells = row.iter().map(|place| {
            let edge = if place.over > 0.0 { "'" } else { " " };
            match place.margin {
                Some(margin) => format!("{:4.0}{edge}", margin.to_degrees()),
                None => format!("{:>4} ", "."),
            }
        });
        lines.push(cells.collect::<String>().trim_end().to_owned());
    }
    lines.push(match best(places) {
        Some((place, margin)) => format!(
            "best: place = [\"{} mm\", \"{} mm\", \"0 mm\"], {} deg{}",
            whole(place.at[0]),
            whole(place.at[1]),
            significant(margin.to_degrees(), 3),
            over(place.over)
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

/// The place with the greatest margin, the first of several, of those where the part lies on the table as a whole; where there is none of
/// these, of those where the least of it hangs over.
fn best(places: &[PlaceOnTable]) -> Option<(&PlaceOnTable, f64)> {
    let held = || places.iter().filter_map(|p| Some((p, p.margin?)));
    let least = held().map(|(p, _)| p.over).fold(f64::INFINITY, f64::min);
    let mut on = held().filter(|(p, _)| p.over <= least);
    let first = on.next()?;
    Some(on.fold(first, |best, new| if new.1 > best.1 { new } else { best }))
}

/// What is told of a part that hangs over the table's edge.
fn over(by: f64) -> String {
    if by <= 0.0 {
        return String::new();
    }
    format!(
        ": the part reaches {} mm over the table's edge, and nowhere that the arm reaches it lies on the table as a whole; what holds it there is not looked at",
        significant(by, 2)
    )
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

    /// A place where the part lies on the table as a whole comes before one with more room for the arm; else the one that hangs over least.
    #[test]
    fn places_wholly_on_the_table_come_first() {
        let place = |x: f64, margin: Option<f64>, over: f64| PlaceOnTable {
            at: [x, 0.0],
            margin,
            over,
        };
        let found = |places: &[PlaceOnTable]| best(places).map(|(place, _)| place.at[0]);
        let hanging = [place(1.0, Some(0.9), 40.0), place(2.0, Some(0.8), 15.0)];
        let on = [
            place(3.0, Some(0.3), 0.0),
            place(4.0, Some(0.5), 0.0),
            place(5.0, Some(0.5), 0.0),
            place(6.0, None, 0.0),
        ];
        assert_eq!(found(&[&hanging[..], &on[..]].concat()), Some(4.0));
        assert_eq!(found(&hanging), Some(2.0));
        assert_eq!(found(&on[3..]), None);
        assert!(over(15.0).contains("15 mm over the table's edge") && over(0.0).is_empty());
    }

    /// A part as long as the table hangs over it unless it stands in the middle.
    #[test]
    fn a_part_that_hangs_over_the_edge_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("part.stl");
        let of = |size: DVec3| {
            let mesh = meltpath_geometry::shapes::cuboid(DVec3::ZERO, size);
            let mut bytes = Vec::new();
            meltpath_geometry::io::stl::write_stl(&mesh, "part", &mut bytes).unwrap();
            std::fs::write(&path, bytes).unwrap();
            let robot = "fanuc-arcmate-120ic";
            let told = reach(
                &path,
                PartUnit::Millimetre,
                robot,
                &Reporter::new(),
                &Silent,
            )
            .unwrap();
            told.into_iter().find(|l| l.starts_with("best: ")).unwrap()
        };
        let small = of(DVec3::new(300.0, 200.0, 60.0));
        assert!(!small.contains("edge"), "{small}");
        // the table is 1 m long
        let long = of(DVec3::new(1100.0, 100.0, 20.0));
        assert!(
            long.contains("reaches 50 mm over the table's edge"),
            "{long}"
        );
    }
}
