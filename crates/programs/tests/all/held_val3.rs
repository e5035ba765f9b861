//! A torch that stands, for a Stäubli: each point of the part is led to it as a tool.

use std::collections::BTreeMap;

use meltpath_base::{Angle, Length, Reporter};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_programs::held::{Holds, Standing};
use meltpath_programs::program::{Coordinates, Instruction, MotionKind, Position, PositionRef};
use meltpath_programs::{Dialect, Missing, TextFile, build, dialect};

use crate::built::{toolpath, two_layers};
use crate::dialects::{held, read, written};
use crate::held::{asked_for, cell, kuka, plan_of, reading, standing, written_and_read};

const FEED: f64 = 400.0 / 3.0;

/// The numbers of a place in a project's data, and the name that it lies in.
fn of_project(text: &str) -> (Pose, String) {
    let of = |key: &str| {
        let (_, rest) = text.split_once(&format!(" {key}=\"")).unwrap();
        rest.split('"').next().unwrap().to_owned()
    };
    let [x, y, z, rx, ry, rz] =
        ["x", "y", "z", "rx", "ry", "rz"].map(|key| of(key).parse::<f64>().unwrap());
    let [rx, ry, rz] = [rx, ry, rz].map(f64::to_radians);
    let pose = Pose {
        position: DVec3::new(x, y, z),
        // about x, then the new y, then the newest z
        orientation: DQuat::from_rotation_x(rx)
            * DQuat::from_rotation_y(ry)
            * DQuat::from_rotation_z(rz),
    };
    (pose, of("fatherId"))
}

/// Where each move of a Stäubli's project puts the flange in the world, as its controller takes it: the point is where the tool comes to.
fn flanges_of_project(files: &[TextFile]) -> Vec<Pose> {
    let data = &files[1].text;
    let value = |name: &str| {
        let (name, key) = name.trim_end_matches(']').split_once('[').unwrap();
        let (_, rest) = data.split_once(&format!("<Data name=\"{name}\"")).unwrap();
        let (values, _) = rest.split_once("</Data>").unwrap();
        let line = values
            .lines()
            .find(|l| l.contains(&format!("key=\"{key}\"")));
        of_project(line.unwrap())
    };
    let lies = |name: &str| {
        let (mut pose, mut father) = value(name);
        while !matches!(father.as_str(), "world[0]" | "flange[0]") {
            let (outer, next) = value(&father);
            (pose, father) = (outer.then(pose), next);
        }
        pose
    };
    let moves = files[0].text.lines().filter_map(|l| {
        let l = l.trim();
        l.starts_with("move")
            .then(|| l.split(['(', ',', ')']).collect::<Vec<_>>())
    });
    let flange = |words: Vec<&str>| {
        let (points, tool) = match words[0] {
            "movec" => (&words[1..3], words[3]),
            _ => (&words[1..2], words[2]),
        };
        let at = points.iter().map(|p| lies(p).then(lies(tool).inverse()));
        at.collect::<Vec<_>>()
    };
    moves.flat_map(flange).collect()
}

#[test]
fn a_staubli_leads_points_of_the_part_to_the_torch() {
    let mut cell = cell();
    let Standing {
        world_from_torch,
        flange_from_part,
    } = standing();
    let words = cell.val3.value.as_mut().unwrap();
    let set = |at: &mut [Length; 3], to: DVec3| {
        *at = to.to_array().map(Length);
    };
    set(&mut words.tool_position.value, world_from_torch.position);
    set(&mut words.part_position.value, flange_from_part.position);
    let angles = |degrees: [f64; 3]| degrees.map(|d| Angle(d.to_radians()));
    words.tool_angles.value = angles([160.0, 0.0, 20.0]);
    words.part_angles.value = angles([0.0, 0.0, 45.0]);
    let plan = toolpath(FEED, two_layers().into());
    let built = build(&plan, &cell, &asked_for(Dialect::Val3), &Reporter::new()).unwrap();
    let built = held(built, Dialect::Val3);
    let files = written(&built, &cell).unwrap().remove(0);
    let found = flanges_of_project(&files);
    // in the order of moves, the point on the way of a circle before its end
    let program = &built.programs[0];
    let at = |target: &PositionRef| {
        let here = |p: &&Position| *target == PositionRef::point(p.index);
        let position = program.positions.iter().find(here).unwrap();
        let Coordinates::Cartesian {
            xyz: [x, y, z],
            wpr_degrees: [w, p, r],
            ..
        } = position.groups[0].coordinates
        else {
            unreachable!("all are told by place")
        };
        let torch_in_part = kuka([x, y, z, r, p, w]);
        let world_from_part = world_from_torch.then(torch_in_part.inverse());
        world_from_part.then(flange_from_part.inverse())
    };
    let wanted = program.instructions.iter().flat_map(|i| match i {
        Instruction::Motion(m) => match &m.kind {
            MotionKind::Circular { via } => vec![at(via), at(&m.target)],
            _ => vec![at(&m.target)],
        },
        _ => Vec::new(),
    });
    let wanted: Vec<Pose> = wanted.collect();
    assert_eq!(found.len(), wanted.len());
    for (a, b) in found.iter().zip(&wanted) {
        assert!(a.position.distance(b.position) < 5e-3, "{a:?} {b:?}");
        assert!(a.orientation.angle_between(b.orientation) < 1e-5);
    }
    // what it says of its frames is what the cell says
    let parsed = read(Dialect::Val3, &files, &cell).program;
    let said = &parsed.said_frames;
    let one = |all: &BTreeMap<u32, Pose>| *all.values().next().unwrap();
    assert!(one(&said.user).position.distance(flange_from_part.position) < 1e-9);
    assert!(one(&said.tool).position.distance(world_from_torch.position) < 1e-9);
}

/// Between two points the torch leaves the line over a part that turns: moves are in pieces, and where that does not help it is told.
#[test]
fn a_part_that_turns_far_over_a_short_way_is_told() {
    let gaps = |step: f64, degrees: f64| {
        let lean = |a: f64| [0.0, a.to_radians().sin(), a.to_radians().cos()];
        let points: Vec<([f64; 3], [f64; 3])> = (0..4)
            .map(|i| {
                (
                    [f64::from(i) * step, 0.0, 0.0],
                    lean(f64::from(i) * degrees),
                )
            })
            .collect();
        let [_, parsed] = written_and_read(&plan_of(&points), Dialect::Val3);
        let reading = reading(&parsed, &Reporter::new());
        reading.gaps.into_iter().map(|g| g.why).collect::<Vec<_>>()
    };
    for (step, degrees) in [(5.0, 1.0), (50.0, 5.0), (100.0, 20.0)] {
        assert_eq!(gaps(step, degrees), []);
    }
    let told = gaps(5.0, 25.0);
    assert!(!told.is_empty());
    let bends = |g: &Missing| matches!(g, Missing::Bends(how) if how.contains("25.0 deg"));
    assert!(told.iter().all(bends), "{told:?}");
}

#[test]
fn a_project_of_both_arrangements_is_not_written() {
    let [_, mut parsed] = written_and_read(&toolpath(FEED, two_layers().into()), Dialect::Val3);
    parsed[0]
        .instructions
        .insert(8, Instruction::Holds(Holds::Torch));
    let told = dialect::write(&parsed[0], &cell()).unwrap_err().to_string();
    assert!(told.contains("the torch on the robot"), "{told}");
}
