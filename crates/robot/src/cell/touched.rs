//! Frames from touched points: where a frame lies in the arm's base by points of it as the pendant shows them, the wire's tip on each.
//!
//! The first is the frame's origin, the second lies along its x, the third in its xy plane on the side of +y. Further ones lie in that plane,
//! too: how far off it they are tells how well all were touched, which three points cannot tell.

use meltpath_base::Length;
use meltpath_base::settings::{Problem, Setting};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};

use super::file::{CellFile, FrameTable};
use super::frame;
use super::layout::{Arrangement, Touched};
use crate::kinematics::Chain;

/// Points that are nearer to each other, or to the line of the first two, give no direction, mm: touching is good to a millimetre or so.
const NEAREST: f64 = 10.0;
/// No points of a plane lie farther off it, mm: one of them is a slip.
const FARTHEST: f64 = 5.0;
/// No coordinate is greater, mm.
const BEYOND: f64 = 1e5;

/// Where base, table and part lie: each as its table writes it, or as it was touched.
pub(super) struct Places {
    pub(super) carrier_from_base: Pose,
    pub(super) carrier_from_table: Pose,
    pub(super) carrier_from_part: Pose,
    pub(super) touched: Vec<Touched>,
}

/// The places of a file; points are those of track and positioner at zero.
pub(super) fn places(
    file: &CellFile,
    (track, positioner): (Option<&Chain>, Option<&Chain>),
    problems: &mut Vec<Problem>,
) -> Places {
    let mut touched = Vec::new();
    let mut of = |name: &'static str, table: &Setting<FrameTable>, problems: &mut Vec<Problem>| {
        let (pose, told) = frame_of(name, table, problems)?;
        touched.push(told);
        Some(pose)
    };
    // of the base those points are touched whose places in the world are known: its origin and axes
    let base = of("base", &file.base, problems).map(Pose::inverse);
    let carrier_from_base = base.unwrap_or_else(|| frame::of_table(&file.base, problems));
    let at_zero = |chain: Option<&Chain>| {
        chain.map_or(Pose::IDENTITY, |c| c.forward(&vec![0.0; c.joints.len()]))
    };
    let world_from_base = at_zero(track).then(carrier_from_base);
    let in_carrier = |carrier: Pose, base_from_frame: Pose| {
        carrier
            .inverse()
            .then(world_from_base)
            .then(base_from_frame)
    };
    let carrier = at_zero(positioner);
    let carrier_from_table = match of("table", &file.table, problems) {
        Some(table) => in_carrier(carrier, table),
        None => frame::of_table(&file.table, problems),
    };
    let carrier_from_part = match of("part", &file.part, problems) {
        Some(part) => in_carrier(carrier.then(carrier_from_table), part),
        None => frame::of_table(&file.part, problems),
    };
    if *file.arrangement == Arrangement::PartOnRobot && file.part.touched.is_some() {
        let message = format!(
            "{} are points of a frame that stands, and the robot holds the part",
            file.part.touched.name
        );
        let problem = file.part.touched.problem(message);
        problems.push(problem.help("write the part's position and angles in the flange"));
    }
    Places {
        carrier_from_base,
        carrier_from_table,
        carrier_from_part,
        touched,
    }
}

/// The frame in the arm's base, where points of it were touched that give one.
fn frame_of(
    name: &'static str,
    table: &Setting<FrameTable>,
    problems: &mut Vec<Problem>,
) -> Option<(Pose, Touched)> {
    let points = table.touched.as_ref()?;
    let others = [
        table.position.is_written(),
        table.angles.is_written(),
        table.axes.is_some(),
    ];
    if others.contains(&true) {
        let message = format!(
            "{} writes touched points, and position, angles or axes: one of them is enough",
            table.name
        );
        problems.push(table.touched.problem(message));
    }
    let points: Vec<DVec3> = points
        .iter()
        .map(|p| DVec3::from_array(p.map(in_mm)))
        .collect();
    match from_points(name, &points) {
        Ok(found) => Some(found),
        Err((what, help)) => {
            let message = format!("{}: {what}", table.touched.name);
            problems.push(table.touched.problem(message).help(help));
            None
        }
    }
}

fn in_mm(length: Length) -> f64 {
    length.0
}

/// What is wrong with points, and what to do.
type Refused = (String, &'static str);

/// The frame of a table by points of it, mm, and how well they give it.
fn from_points(of: &'static str, points: &[DVec3]) -> Result<(Pose, Touched), Refused> {
    let far = |p: &&DVec3| p.abs().max_element() > BEYOND;
    if let Some(point) = points.iter().find(far) {
        let message = format!("a point is {:.0} mm away", point.abs().max_element());
        return Err((message, "write the places in the arm's base, in mm"));
    }
    let (&[origin, on_x, aside], others) = points.split_first_chunk().ok_or_else(|| {
        let message = format!("{} points give no frame", points.len());
        (
            message,
            "touch three: the origin, one along x, one in the xy plane",
        )
    })?;
    let along = on_x.distance(origin);
    if along < NEAREST {
        let message = format!("the first two points are {along:.1} mm apart");
        return Err((
            message,
            "touch the second along x, as far away as the table lets you",
        ));
    }
    let x = (on_x - origin) / along;
    let off = (aside - origin).reject_from_normalized(x);
    let width = off.length();
    if width < NEAREST {
        let message = format!(
            "the first three points lie on a line within {width:.1} mm, which says nothing of the plane"
        );
        return Err((
            message,
            "touch the third to the side of x, where +y is, as far away as the table lets you",
        ));
    }
    let y = off / width;
    let z = x.cross(y);
    let from_plane = others.iter().map(|p| (*p - origin).dot(z).abs());
    let off_plane = from_plane.reduce(f64::max);
    if let Some(off) = off_plane.filter(|off| *off > FARTHEST) {
        let message = format!("a further point lies {off:.1} mm off the plane of the first three");
        return Err((message, "touch them again: all lie in the frame's xy plane"));
    }
    let pose = Pose {
        position: origin,
        orientation: DQuat::from_mat3(&DMat3::from_cols(x, y, z)),
    };
    let touched = Touched {
        of,
        along,
        aside: width,
        off_plane,
    };
    Ok((pose, touched))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a frame that lies somewhere give that frame.
    #[test]
    fn points_give_their_frame() {
        let frame = Pose::from_wpr(
            DVec3::new(850.0, -320.0, 410.5),
            DVec3::new(0.02, -0.1, 2.5),
        );
        let at = |x: f64, y: f64, z: f64| frame.position + frame.orientation * DVec3::new(x, y, z);
        let points = [
            at(0.0, 0.0, 0.0),
            at(400.0, 0.0, 0.0),
            at(-35.0, 250.0, 0.0),
        ];
        let (found, touched) = from_points("table", &points).unwrap();
        assert!(found.position.distance(frame.position) < 1e-9);
        assert!(found.orientation.angle_between(frame.orientation) < 1e-7);
        let off = [touched.along - 400.0, touched.aside - 250.0];
        assert!(off.iter().all(|off| off.abs() < 1e-9) && touched.off_plane.is_none());
        // a fourth tells how well they were touched
        let four = [&points[..], &[at(300.0, 200.0, 0.4)]].concat();
        let (_, touched) = from_points("table", &four).unwrap();
        assert!((touched.off_plane.unwrap() - 0.4).abs() < 1e-9);
    }

    #[test]
    fn points_that_give_no_frame_are_refused() {
        let p = DVec3::new;
        let refused = |points: &[DVec3]| from_points("base", points).unwrap_err().0;
        let [a, b] = [p(0.0, 0.0, 0.0), p(300.0, 0.0, 0.0)];
        let line = refused(&[a, b, p(600.0, 0.5, 0.0)]);
        assert!(line.contains("on a line within 0.5 mm"), "{line}");
        assert!(refused(&[a, p(0.0, 3.0, 0.0), b]).contains("3.0 mm apart"));
        let off = refused(&[a, b, p(0.0, 300.0, 0.0), p(300.0, 300.0, -12.0)]);
        assert!(off.contains("12.0 mm off the plane"), "{off}");
        assert!(refused(&[a, b]).contains("2 points"));
        assert!(refused(&[a, b, p(0.0, 3e5, 0.0)]).contains("300000 mm away"));
    }
}
