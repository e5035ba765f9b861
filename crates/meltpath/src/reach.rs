//! Where on a robot's table a part can stand, or in its flange be held: a map of margins, each place held for true along the box around the part.

mod map;

use std::collections::BTreeMap;
use std::path::Path;

use meltpath_base::{Cancelled, Observer, Reporter, Silent};
use meltpath_data::robots;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::{Mesh, Pose};
use meltpath_robot::cell::{Arrangement, Cell};
use meltpath_robot::posture::{Axes, Held, NotHeld, Rotation, Task, hold};
use meltpath_robot::{Command, Smoothing};

use crate::cancel::cancellable;
use crate::data::{DataFileError, DataText};
use crate::job::PartUnit;
use crate::stages::part::{self, PartError};
use crate::stages::sheet::{self, How};
pub use map::{Found, Map};
use map::{Margin, PLACES, Place, told};

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

/// Where a part can stand on the table of a robot, or be held in its flange: a map, the best place, and what of it is a guess. `unit` is that of
/// a part file that carries none.
///
/// # Errors
/// [`ReachError`] where part or robot cannot be read.
pub fn reach(
    part: &Path,
    unit: PartUnit,
    robot: &str,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Map, ReachError> {
    let text = DataText::load("robot", robot, robots::ALL, Path::new(""))?;
    let cell = text.robot()?;
    let (name, mesh) = outline(part, unit, reporter, observer)?;
    let Some((low, high)) = mesh.bounds() else {
        return Ok(Map {
            lines: vec![format!("{name} is empty")],
            found: Found::NoPlace,
        });
    };
    let window = Window::of(&cell, &mesh);
    let mut places: Vec<Place> = Vec::new();
    observer.stage("hold the part at each place", u64::from(PLACES * PLACES));
    for iy in (0..PLACES).rev() {
        for ix in 0..PLACES {
            observer.check()?;
            observer.advance(1);
            let place = window.place([ix, iy]);
            let held = held(&cell, place.at, low, high);
            let margin = held.ok().map(|h| Margin::of(&h));
            places.push(Place { margin, ..place });
        }
    }
    Ok(told(&cell, &name, &places))
}

/// Where the part's places are looked for: the middle of its box goes over a rectangle around the origin of the table, or of the flange.
struct Window {
    /// The sides of the rectangle, mm.
    sides: [f64; 2],
    /// The box of the part along the axes of the carrier, from the part's origin, mm.
    low: DVec3,
    high: DVec3,
    /// The height of the part's origin, mm.
    height: f64,
    /// The edge that the part may hang over, mm; nothing where there is none, or nobody says where.
    edge: Option<[f64; 2]>,
    arrangement: Arrangement,
}

impl Window {
    fn of(cell: &Cell, mesh: &Mesh) -> Self {
        let (low, high) = in_carrier(cell, mesh);
        let table = cell.shapes.as_ref().and_then(|s| s.table).map(|t| t.size);
        let (sides, height, edge) = match cell.arrangement {
            Arrangement::TorchOnRobot => (table.unwrap_or([SIDE, SIDE]), 0.0, table),
            // the flange's axis goes through the part: who holds it farther aside holds it by something else
            Arrangement::PartOnRobot => {
                let size = high - low;
                let height = cell.carrier_from_part.position.z;
                ([size.x, size.y], height, None)
            }
        };
        Window {
            sides,
            low,
            high,
            height,
            edge,
            arrangement: cell.arrangement,
        }
    }

    /// A place, its margin not yet known.
    fn place(&self, at: [u32; 2]) -> Place {
        let of_middle: [f64; 2] = std::array::from_fn(|i| {
            (f64::from(at[i]) / f64::from(PLACES - 1) - 0.5) * self.sides[i]
        });
        let middle = 0.5 * (self.low + self.high);
        let [x, y] = [of_middle[0] - middle.x, of_middle[1] - middle.y];
        let beyond = |i: usize, side: f64| {
            ([x, y][i] + self.high[i]).max(-[x, y][i] - self.low[i]) - 0.5 * side
        };
        let over = self
            .edge
            .map_or(0.0, |t| beyond(0, t[0]).max(beyond(1, t[1])));
        let aside = match self.arrangement {
            Arrangement::TorchOnRobot => 0.0,
            Arrangement::PartOnRobot => of_middle[0].hypot(of_middle[1]),
        };
        Place {
            at: [x, y, self.height],
            margin: None,
            over: if over > ROUNDING { over } else { 0.0 },
            aside,
        }
    }
}

/// The box of the part along the axes of the table, or of the flange, from the part's origin.
fn in_carrier(cell: &Cell, mesh: &Mesh) -> (DVec3, DVec3) {
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
fn held(cell: &Cell, place: [f64; 3], low: DVec3, high: DVec3) -> Result<Held, NotHeld> {
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
    cell.carrier_from_part.position = DVec3::from_array(place);
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
        let near = held(&cell, [-50.0, -40.0, 0.0], low, high);
        assert!(near.is_ok_and(|h| Margin::of(&h).least > 0.1));
        assert!(held(&cell, [1500.0, 0.0, 0.0], low, high).is_err());
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
            told.lines
                .into_iter()
                .find(|l| l.starts_with("best: "))
                .unwrap()
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
