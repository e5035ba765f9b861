//! What moves the torch of a wire-arc job: the cell's controller, and the robot where the job names one.

use std::path::Path;

use meltpath_base::settings::Problem;
use meltpath_base::{Provenance, Reporter};
use meltpath_data::{cells, robots};
use meltpath_geometry::math::DVec3;
use meltpath_programs::Dialect;
use meltpath_robot::cell as robot;

use crate::data::{Cell, DataText};
use crate::job::waam::{ExternalChoice, MachineTable};

/// What moves the torch.
pub(in crate::waam) struct Machine {
    /// The cell: controller and programs.
    pub(in crate::waam) cell: Cell,
    /// The robot, where the job names one.
    pub(in crate::waam) robot: Option<robot::Cell>,
    /// The files that are the user's own.
    pub(in crate::waam) own: Vec<DataText>,
}

/// Cell and robot: everything wrong with either is told.
pub(in crate::waam) fn load(
    machine: &MachineTable,
    folder: &Path,
    reporter: &Reporter,
    r: &mut Provenance,
) -> Result<Machine, Vec<Problem>> {
    let cell = DataText::load("cell", &machine.cell, cells::ALL, folder)
        .and_then(|text| Ok((Cell::of(&text)?, text)))
        .map_err(|e| e.at(&machine.cell));
    let ((cell, text), robot) = match (cell, robot_of(machine, folder)) {
        (Ok(cell), Ok(robot)) => (cell, robot),
        (cell, robot) => {
            let mut found = cell.err().unwrap_or_default();
            found.extend(robot.err().unwrap_or_default());
            return Err(found);
        }
    };
    text.warn(cells::ALL, reporter);
    let mut own: Vec<DataText> = text.file.is_some().then_some(text).into_iter().collect();
    let robot = robot.map(|(robot, text)| {
        text.warn(robots::ALL, reporter);
        own.extend(text.file.is_some().then_some(text));
        r.model(
            "robot arm",
            "closed forms after Brandstötter, Angerer, Hofbaur 2014 (spherical wrists) and of our own (offset wrists); CONFIG as FANUC's off-line controller shows it",
        );
        robot
    });
    Ok(Machine { cell, robot, own })
}

/// The robot that a job names, its part where the job places it.
fn robot_of(
    machine: &MachineTable,
    folder: &Path,
) -> Result<Option<(robot::Cell, DataText)>, Vec<Problem>> {
    let Some(name) = machine.robot.as_ref() else {
        if machine.place.is_written() {
            let message = format!("{} is written, but no robot", machine.place.name);
            let problem = machine.place.problem(message);
            return Err(vec![problem.help("name the robot: machine.robot")]);
        }
        return Ok(None);
    };
    let (mut cell, text) = DataText::load("robot", name, robots::ALL, folder)
        .and_then(|text| Ok((text.robot()?, text)))
        .map_err(|e| e.at(&machine.robot))?;
    if let Some(place) = *machine.place {
        cell.carrier_from_part.position = DVec3::from_array(place.map(|l| l.0));
    }
    Ok(Some((cell, text)))
}

/// Refuses to move what is not there, or what no program could tell.
pub(in crate::waam) fn check_external(
    machine: &MachineTable,
    robot: Option<&robot::Cell>,
    cell: &Cell,
    programs: &[Dialect],
) -> Result<(), Problem> {
    let key = &machine.external;
    if **key == ExternalChoice::Standing {
        return Ok(());
    }
    let refused = |what: &str, help: &str| {
        let message = format!("{} = \"free\", but {what}", key.name);
        Err(key.problem(message).help(help))
    };
    let axes = |robot: &robot::Cell| robot.positioner.as_ref().map_or(0, |p| p.joints.len());
    match robot {
        None => refused(
            "the job names no robot",
            "name one with a track or a positioner: machine.robot",
        ),
        Some(r) if r.track.is_none() && r.positioner.is_none() => refused(
            "the robot's file has neither track nor positioner",
            "write [track] or [positioner] into a robot file of your own",
        ),
        Some(r) if r.track.is_some() && cell.program.track.is_none() && !programs.is_empty() => {
            refused(
                "the cell's file does not say how its controller is told the track",
                "write [program.track] into the cell's file (source, user_frame; unit for ABB), or output.programs = []: the way is then planned and checked without a program",
            )
        }
        Some(r) => match &*cell.program.positioner {
            Some(told) if told.axes.len() != axes(r) && !programs.is_empty() => refused(
                &format!(
                    "the robot's positioner has {} axes and the cell's program.positioner {}",
                    axes(r),
                    told.axes.len()
                ),
                "write both alike",
            ),
            _ => Ok(()),
        },
    }
}

/// The contact tube to work distance for which a cell's tool frame is set, mm.
pub(in crate::waam) fn nominal_distance(cell: &Cell) -> f64 {
    cell.program.contact_tube_distance.0
}

/// The wire of a job ends `ctwd` mm from the contact tube, and its programs lead that end: so the arm is followed, however long the wire is in the
/// robot's file.
pub(in crate::waam) fn wire_length(robot: &mut robot::Cell, ctwd: f64, reporter: &Reporter) {
    const SAME: f64 = 0.5;
    let wire = &mut robot.torch_from_wire_tip.position.z;
    if (*wire - ctwd).abs() > SAME {
        reporter.warn(
            "robot-wire",
            format!("the torch of the robot's file ends {wire:.1} mm behind its wire's tip, the job works at {ctwd:.1} mm: the arm is followed with a wire so long"),
            "set the controller's tool frame to the wire's tip at that distance, and write it in torch.wire of the robot's file and program.contact_tube_distance of the cell's",
        );
    }
    *wire = ctwd;
}
