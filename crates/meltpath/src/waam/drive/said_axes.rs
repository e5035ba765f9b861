//! Where a cell file says that the axes of a positioner lie in the user frame, against the robot's file: FANUC and Yaskawa positions beside a part that
//! turns in their frame follow the cell's axes, and what is checked follows the robot's.

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::Dialect;
use meltpath_programs::positioner::Line;
use meltpath_robot::cell::{Cell, Values};

use crate::job::waam::ExternalChoice;
use crate::waam::drive::said_frames::{Elsewhere, SAME};
use crate::waam::program::Axes;
use crate::waam::settings::Settings;

/// The axes of the positioner that lie elsewhere by the cell's file than by the robot's, where programs turn the part by them; `plate` is how
/// high the plate lies in the user frame, mm.
pub(in crate::waam) fn axes_elsewhere(
    dialects: &[Dialect],
    external: Option<&Axes>,
    settings: &Settings,
    plate: f64,
) -> Option<Elsewhere> {
    let stands = |axes: &Axes| {
        let mut all = std::iter::once(&axes.start).chain(&axes.ends);
        all.all(|external| external.0[1..] == [0.0; 2])
    };
    // other controllers' frames turn with the part; at zero all stand where the frame tells
    if !dialects.iter().any(|d| turns_in_user_frame(*d)) || external.is_none_or(stands) {
        return None;
    }
    differing(settings, plate)
}

/// Tells of them before anything is planned, where a job plans with them.
pub(in crate::waam) fn tell(settings: &Settings, reporter: &Reporter) {
    let planned = settings.external == ExternalChoice::Free
        && settings.dialects().iter().any(|d| turns_in_user_frame(*d));
    let elsewhere = planned.then(|| differing(settings, 0.0)).flatten();
    if let Some(Elsewhere { reason, remedy }) = elsewhere {
        reporter.warn("positioner-axes", &reason, &remedy);
    }
}

/// Whether positions may be told in a frame in which the table turns.
fn turns_in_user_frame(dialect: Dialect) -> bool {
    matches!(dialect, Dialect::FanucLs | Dialect::Inform)
}

fn differing(settings: &Settings, plate: f64) -> Option<Elsewhere> {
    let cell = settings.robot.as_ref()?;
    let said = settings.cell.program.positioner.as_ref()?.turning().lines?;
    let lines = of_robot(cell, plate);
    let apart: Vec<String> = if said.len() == lines.len() {
        let both = said.iter().zip(&lines).zip(1..);
        both.filter_map(|((said, line), axis)| apart(axis, said, line))
            .collect()
    } else {
        vec![format!(
            "{} axes of the positioner by the cell's file, {} by the robot's",
            said.len(),
            lines.len()
        )]
    };
    let own: Vec<String> = lines.iter().map(shown).collect();
    (!apart.is_empty()).then(|| Elsewhere {
        reason: format!(
            "the arm was checked elsewhere than the program makes it stand: in the user frame, all axes at zero, the cell's file tells other axes of the positioner than the robot's: {}",
            apart.join("; ")
        ),
        remedy: format!(
            "measure which is right, and write it into both: program.positioner.axis of the cell's file; [positioner], [table] of the robot's file, machine.place of the job. By the robot's file the axes would be, the first one first: {}",
            own.join("; ")
        ),
    })
}

/// The axes of the robot's positioner in the user frame, which lies where the part does while all of them stand at zero.
fn of_robot(cell: &Cell, plate: f64) -> Vec<Line> {
    let world_from_user = cell
        .frames(&Values::default())
        .part
        .then(Pose::at(-DVec3::Z * plate));
    let user_from_world = world_from_user.inverse();
    let Some(positioner) = &cell.positioner else {
        return Vec::new();
    };
    let frames = positioner.frames(&[]);
    let joints = positioner.joints.iter().zip(frames);
    joints
        .map(|(joint, frame)| {
            let frame = user_from_world.then(frame);
            Line {
                origin: frame.position,
                direction: frame.orientation * joint.axis,
            }
        })
        .collect()
}

/// How far an axis lies from where it is checked, where that is more than the digits of a file: mm beside it where it comes nearest to the user
/// frame's origin, as a point may be told anywhere along an axis, and deg.
fn apart(axis: u32, said: &Line, checked: &Line) -> Option<String> {
    let near = said.origin - said.direction * said.origin.dot(said.direction);
    let beside = near - checked.origin;
    let beside = beside.reject_from_normalized(checked.direction).length();
    // near 0 an angle by its cosine is lost in rounding
    let sine = said.direction.cross(checked.direction).length();
    let turned = sine.atan2(said.direction.dot(checked.direction));
    let [off, turned_off] = [beside > SAME.0, turned > SAME.1];
    let beside = off.then(|| format!("{beside:.1} mm beside that of the robot's file"));
    let degrees = turned.to_degrees();
    let turned = turned_off.then(|| format!("its direction {degrees:.2} deg off"));
    let told: Vec<String> = beside.into_iter().chain(turned).collect();
    (!told.is_empty()).then(|| format!("axis {axis}: {}", told.join(", ")))
}

/// An axis as a cell's file tells it.
fn shown(line: &Line) -> String {
    let number = |value: f64, digits: i32| {
        let step = 10.0_f64.powi(digits);
        // no zero with a sign
        (value * step).round() / step + 0.0
    };
    let [x, y, z] = line.origin.to_array().map(|v| number(v, 3));
    let [a, b, c] = line.direction.to_array().map(|v| number(v, 6));
    format!("origin = [\"{x} mm\", \"{y} mm\", \"{z} mm\"], direction = [{a}, {b}, {c}]")
}
