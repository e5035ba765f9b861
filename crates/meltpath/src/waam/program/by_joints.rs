//! Positions that programs give by joints: the job's robot says where the wire's tip is there.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_programs::held::{Holds, Standing};
use meltpath_programs::program::{Axis, Coordinates};
use meltpath_programs::{ExecutionSettings, NoPose, Program};
use meltpath_robot::cell::{Arrangement, Cell, External, Values};
use meltpath_robot::kinematics::JointKind;

use crate::waam::maker::reads;
use crate::waam::settings::Settings;

/// Where the wire's tip is at each position that is given by joints, in the frame that the beads are told in, by program and number;
/// else why that is not known.
pub(in crate::waam) fn poses(
    programs: &[Program],
    known: &ExecutionSettings,
    settings: &Settings,
) -> BTreeMap<(usize, u32), Result<Pose, NoPose>> {
    let plate = settings.plate_height.unwrap_or(0.0);
    let mut poses = BTreeMap::new();
    for (number, program) in programs.iter().enumerate() {
        for position in &program.positions {
            let robot = position.groups.iter().find(|g| g.number == 1);
            let Some(Coordinates::Joint(axes)) = robot.map(|g| &g.coordinates) else {
                continue;
            };
            let found = match &settings.robot {
                None => Err(NoPose::NoRobot),
                Some(cell) if !reads(cell.maker, program.dialect) => Err(NoPose::OtherMaker),
                Some(cell) => {
                    let said = known.external_axes(program, position);
                    pose(cell, axes, &said).ok_or(NoPose::Axes)
                }
            };
            let lifted = found.map(|mut pose| {
                pose.position.z += plate;
                pose
            });
            poses.insert((number, position.index), lifted);
        }
    }
    poses
}

/// Where the wire's tip is at the position registers that the cell tells by joints; else why that is not known.
pub(in crate::waam) fn registers(
    programs: &[Program],
    known: &ExecutionSettings,
    settings: &Settings,
) -> BTreeMap<u32, Result<Pose, NoPose>> {
    let plate = settings.plate_height.unwrap_or(0.0);
    let dialect = programs.first().map(|p| p.dialect);
    let told = known.positions.iter();
    let by_joints = told.filter_map(|(number, told)| Some((*number, told.joints?)));
    by_joints
        .map(|(number, joints)| {
            let found = match &settings.robot {
                None => Err(NoPose::NoRobot),
                Some(cell) if dialect.is_some_and(|d| !reads(cell.maker, d)) => {
                    Err(NoPose::OtherMaker)
                }
                Some(cell) => pose(cell, &Axis::joints(joints), &[]).ok_or(NoPose::Axes),
            };
            let lifted = found.map(|mut pose| {
                pose.position.z += plate;
                pose
            });
            (number, lifted)
        })
        .collect()
}

/// Where torch and part are, where the robot holds the part.
pub(in crate::waam) fn standing(cell: &Cell) -> Option<Standing> {
    (holds(cell) == Holds::Part).then(|| Standing {
        world_from_torch: cell.carrier_from_torch.then(cell.torch_from_wire_tip),
        flange_from_part: cell.carrier_from_part,
    })
}

/// What the robot holds.
pub(in crate::waam) fn holds(cell: &Cell) -> Holds {
    match cell.arrangement {
        Arrangement::TorchOnRobot => Holds::Torch,
        Arrangement::PartOnRobot => Holds::Part,
    }
}

/// Where the wire's tip is in the part, with external axes as they are said; nothing where they are not those of the cell.
fn pose(cell: &Cell, axes: &[Axis], said: &[f64]) -> Option<Pose> {
    let (shown, _) = Axis::of_arm(axes)?;
    let still = || said.iter().all(|v| *v == 0.0);
    let rest = || still().then(|| cell.at_rest().external());
    let external = external(cell, said).or_else(rest)?;
    let joints = cell.arm.joints(shown.map(f64::to_radians));
    let frames = cell.frames(&Values::of(joints, external));
    Some(frames.part_from_wire_tip())
}

/// Which external axes turn, by how many a program says: the positioner's, the track, or the track and the positioner's.
pub(crate) fn turning(cell: &Cell) -> BTreeMap<usize, Vec<bool>> {
    let turns = |axis| Some(cell.external_joint(axis)?.kind == JointKind::Revolute);
    let track: Vec<bool> = turns(0).into_iter().collect();
    let table: Vec<bool> = (1..3).map_while(turns).collect();
    let both = [&track[..], &table].concat();
    // as `external` takes them: where both have as many axes these are the positioner's
    [both, track, table]
        .into_iter()
        .map(|axes| (axes.len(), axes))
        .collect()
}

/// Track and positioner as a program says them, mm or rad, the track first; one alone where there are as many axes as it has; nothing
/// where none or others are said than the cell has.
pub(crate) fn external(cell: &Cell, said: &[f64]) -> Option<External> {
    let rest = cell.at_rest();
    let turning = cell.positioner.as_ref().map_or(0, |p| p.joints.len());
    let sliding = usize::from(cell.track.is_some());
    let axis = |axes: &[f64], i: usize| axes.get(i).copied().unwrap_or(0.0);
    let (track, turned) = match said.len() {
        0 => return None,
        n if n == turning => (rest.track, said),
        n if n == sliding => (axis(said, 0), &rest.positioner[..]),
        n if n == sliding + turning => (axis(said, 0), said.get(sliding..).unwrap_or_default()),
        _ => return None,
    };
    Some(External([track, axis(turned, 0), axis(turned, 1)]))
}
