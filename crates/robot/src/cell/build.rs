//! From a cell's file to the cell: what the tables say together, and all that is wrong with it at once.

use std::ops::Range;
use std::path::Path;

use meltpath_base::Length;
use meltpath_base::settings::{
    self, File, Kind, Node, Problem, Problems, Reader, Setting, Under, nearest,
};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::file::{
    ArmKind, ArmTable, AxisTable, CellFile, Direction, ElbowShows, FROM_URDF, JointsTable,
    PositionerTable, ShapesTable, TrackTable,
};
use super::layout::{Arrangement, Cell, SHAPES, Shapes, Source, Table};
use super::linked::Linked;
use super::urdf::Taken;
use super::{frame, sound, touched};
use crate::kinematics::{
    Arm, Chain, Geometry, Joint, JointKind, Limits, OffsetWrist, OrthoParallel,
};

/// A cell from its file's text.
///
/// ```
/// use meltpath_robot::cell;
/// let text = r#"
/// name = "my arm"
/// [arm]
/// source = "data sheet of my arm"
/// shoulder_height = "500 mm"
/// upper_arm = "700 mm"
/// forearm = "700 mm"
/// flange = "100 mm"
/// [joints]
/// source = "data sheet of my arm"
/// low = ["-170 deg", "-100 deg", "-100 deg", "-180 deg", "-120 deg", "-350 deg"]
/// high = ["170 deg", "100 deg", "100 deg", "180 deg", "120 deg", "350 deg"]
/// "#;
/// let cell = cell::read(text).unwrap();
/// assert!((cell.arm.forward([0.0; 6]).position.z - 2000.0).abs() < 1e-9); // stretched upright
/// let problems = cell::read(&text.replace("\"700 mm\"", "\"-7 mm\"")).unwrap_err();
/// assert_eq!(problems.0.len(), 2); // both, each with its place
/// ```
///
/// # Errors
/// Every problem with its place.
pub fn read(text: &str) -> Result<Cell, Problems> {
    read_in(text, None)
}

/// The same of a file in `folder`, which may name a URDF beside it.
///
/// # Errors
/// Every problem with its place.
pub fn read_beside(text: &str, folder: &Path) -> Result<Cell, Problems> {
    read_in(text, Some(folder))
}

/// The URDF that a file names, and where it does.
struct Urdf(Range<usize>, String);

impl settings::Value for Urdf {
    const KIND: Kind = Kind::File;

    fn read(node: &Node<'_>, place: &settings::Place<'_>, reader: &mut Reader) -> Option<Self> {
        let File(name) = File::read(node, place, reader)?;
        Some(Urdf(node.span(), name))
    }

    fn json(&self) -> settings::Json {
        self.1.clone().into()
    }
}

fn read_in(text: &str, folder: Option<&Path>) -> Result<Cell, Problems> {
    // what is wrong with the file as a whole is told below
    let urdf = settings::peek::<Urdf>(text, &["urdf"]).ok().flatten();
    let taken = match &urdf {
        None => None,
        Some(Urdf(span, name)) => {
            let taken = match folder {
                Some(folder) => Taken::of(name, folder),
                None => Err("a file that ships names no other".to_owned()),
            };
            let wrong = |what| Problem::new(format!("urdf = {name:?}: {what}")).at(span.clone());
            Some((taken.map_err(wrong)?, span.clone()))
        }
    };
    let under = taken.as_ref().map(|(taken, span)| Under {
        text: &taken.toml,
        span: span.clone(),
        mixed: &FROM_URDF,
    });
    let read = settings::read_over::<CellFile>(text, under.as_ref());
    let mut problems = read.problems;
    let Some(mut file) = read.settings else {
        return Err(problems.into());
    };
    let taken = taken.map(|(taken, _)| taken);
    if let Some(taken) = &taken {
        taken.over(&mut file, &mut problems);
    }
    let cell = build(&file, taken.as_ref(), &mut problems);
    match cell {
        Some(cell) if problems.is_empty() => Ok(cell),
        _ => Err(problems.into()),
    }
}

fn build(file: &CellFile, taken: Option<&Taken>, problems: &mut Vec<Problem>) -> Option<Cell> {
    let arm = arm(&file.arm, &file.joints, problems);
    let track = file
        .track
        .as_ref()
        .and_then(|t| track(&file.track, t, problems));
    let positioner = file
        .positioner
        .as_ref()
        .and_then(|p| positioner(&file.positioner, p, problems));
    let mut sources = sources(file, problems);
    // beside a number that is wrong by itself these tell nothing
    if let Some(arm) = arm.as_ref().filter(|_| problems.is_empty()) {
        problems.extend(sound::shapes(file, &arm.chain));
    }
    let links = match arm.as_ref().filter(|_| problems.is_empty()) {
        Some(arm) => Linked::of(file, taken, &arm.chain, problems),
        None => None,
    };
    let linked = links.unwrap_or_default();
    if let Some(shapes) = sources.iter_mut().find(|s| s.of == SHAPES) {
        shapes.guesses.extend(linked.guesses);
    }
    let places = touched::places(file, (track.as_ref(), positioner.as_ref()), problems);
    Some(Cell {
        name: file.name.value.clone(),
        maker: *file.maker,
        arrangement: *file.arrangement,
        arm: arm?,
        carrier_from_base: places.carrier_from_base,
        track,
        positioner,
        carrier_from_torch: frame::pose(*file.torch.position, *file.torch.angles),
        torch_from_wire_tip: Pose {
            position: DVec3::new(0.0, 0.0, file.torch.wire.0),
            ..Pose::IDENTITY
        },
        carrier_from_table: places.carrier_from_table,
        carrier_from_part: places.carrier_from_part,
        shapes: file
            .shapes
            .as_ref()
            .zip(linked.links)
            .map(|(s, links)| Shapes {
                links,
                torch: s.torch.0,
                nozzle: s.nozzle.map(|l| l.0),
                table: table(s, file.positioner.is_some()),
            }),
        files: linked.files,
        sources,
        touched: places.touched,
    })
}

/// A table that stands reaches the floor: no lower than this under its top, mm.
const TO_THE_FLOOR: f64 = 2000.0;
/// A table that a positioner carries, with what turns beneath it, where the file does not say, mm: a guess.
const FACEPLATE: f64 = 100.0;

fn table(shapes: &ShapesTable, turns: bool) -> Option<Table> {
    let size = (*shapes.table)?.map(|l| l.0);
    let silent = if turns { FACEPLATE } else { TO_THE_FLOOR };
    Some(Table {
        size,
        thickness: shapes.table_thickness.map_or(silent, |t| t.0),
    })
}

fn arm(
    table: &Setting<ArmTable>,
    joints: &JointsTable,
    problems: &mut Vec<Problem>,
) -> Option<Arm> {
    let limits = limits(joints, problems);
    problems.extend(sound::turns(joints, &limits));
    problems.extend(sound::zeros(joints));
    problems.extend(sound::lengths(table));
    let signs = joints.directions.map(|d| d.map(sign));
    if table.kind.value != ArmKind::SphericalWrist {
        let help = "leave it out: the axes have their own directions";
        let told = |key: &str| format!("{key} is of spherical wrists only");
        let rules = [
            (
                joints.zero.is_written(),
                joints.zero.problem(told(&joints.zero.name)).help(help),
            ),
            (
                signs.is_some(),
                joints
                    .directions
                    .problem(told(&joints.directions.name))
                    .help(help),
            ),
        ];
        problems.extend(settings::broken(rules));
    }
    let sign = signs.unwrap_or([1.0; 6]);
    let (mut chain, geometry) = match *table.kind {
        ArmKind::SphericalWrist => {
            let keys = [
                &table.shoulder_height,
                &table.upper_arm,
                &table.forearm,
                &table.flange,
            ];
            let [c1, c2, c3, c4] = needed(table, keys, problems)?;
            let parameters = OrthoParallel {
                a1: optional(&table.shoulder_forward),
                a2: -optional(&table.forearm_above_elbow),
                b: optional(&table.arm_aside),
                c1,
                c2,
                c3,
                c4,
                zero: joints.zero.map_or([0.0; 6], |z| z.map(|a| a.0)),
                sign,
            };
            (
                parameters.chain(limits),
                Geometry::SphericalWrist(parameters),
            )
        }
        ArmKind::OffsetWrist => {
            let keys = [
                &table.shoulder_height,
                &table.upper_arm,
                &table.forearm,
                &table.wrist_aside,
                &table.wrist_offset,
                &table.flange,
            ];
            let [d1, a2, a3, d4, d5, d6] = needed(table, keys, problems)?;
            let parameters = OffsetWrist {
                d1,
                a2,
                a3,
                d4,
                d5,
                d6,
            };
            (parameters.chain(limits), Geometry::OffsetWrist(parameters))
        }
        ArmKind::Axes => {
            let flange = optional(&table.flange);
            (
                any_chain(table, &limits, flange, problems)?,
                Geometry::Other,
            )
        }
    };
    let end_from_flange = frame::pose(*table.flange_offset, *table.flange_angles);
    let end_from_flange = (end_from_flange != Pose::IDENTITY).then_some(end_from_flange);
    if let Some(turned) = end_from_flange {
        chain.last_from_end = chain.last_from_end.then(turned);
    }
    let coupling = match *joints.elbow_shows {
        ElbowShows::Joint => 0.0,
        // the forearm's angle to the level counts as the third joint does: both together, less what the second adds
        ElbowShows::Level => sign[1] * sign[2],
    };
    Some(Arm {
        chain,
        geometry,
        end_from_flange,
        coupling,
    })
}

fn sign(direction: Direction) -> f64 {
    match direction {
        Direction::With => 1.0,
        Direction::Against => -1.0,
    }
}

fn optional(length: &Setting<Option<Length>>) -> f64 {
    length.map_or(0.0, |l| l.0)
}

/// The lengths that a kind of arm needs, mm; each that is missing is told.
fn needed<const N: usize>(
    table: &Setting<ArmTable>,
    lengths: [&Setting<Option<Length>>; N],
    problems: &mut Vec<Problem>,
) -> Option<[f64; N]> {
    for length in lengths.iter().filter(|l| !l.is_written()) {
        let message = format!(
            "{} is missing: an arm of the kind \"{}\" needs it",
            length.name,
            table.kind.word()
        );
        problems.push(
            table
                .problem(message)
                .help("take it from the drawing of the robot's data sheet"),
        );
    }
    if lengths.iter().any(|l| l.is_none()) {
        return None;
    }
    Some(lengths.map(optional))
}

/// The limits of six joints; those that are swapped or equal are told.
fn limits(joints: &JointsTable, problems: &mut Vec<Problem>) -> [Limits; 6] {
    std::array::from_fn(|i| {
        let (low, high) = (joints.low[i], joints.high[i]);
        if let Some(wrong) = sound::order(low.0, high.0) {
            let of = format!("joint {}", i + 1);
            problems.push(sound::told(&joints.low, &of, (low, high), wrong));
        }
        Limits {
            low: low.0,
            high: high.0,
            speed: joints.speed.map(|s| s[i].0),
            acceleration: joints.acceleration.map(|a| a[i].0),
        }
    })
}

fn any_chain(
    table: &Setting<ArmTable>,
    limits: &[Limits; 6],
    flange: f64,
    problems: &mut Vec<Problem>,
) -> Option<Chain> {
    if table.axes.len() != 6 {
        let message = format!(
            "{} has {} axes; an arm has six",
            table.axes.name,
            table.axes.len()
        );
        problems.push(table.problem(message));
        return None;
    }
    let joints = joints("J", &table.axes, &table.axes.name, limits, problems)?;
    let last_from_end = Pose {
        position: DVec3::new(0.0, 0.0, flange),
        ..Pose::IDENTITY
    };
    Some(Chain {
        joints,
        last_from_end,
    })
}

/// Turning joints of written axes.
fn joints(
    prefix: &str,
    axes: &[AxisTable],
    key: &str,
    limits: &[Limits],
    problems: &mut Vec<Problem>,
) -> Option<Vec<Joint>> {
    let mut joints = Vec::new();
    for (i, (axis, limits)) in axes.iter().zip(limits).enumerate() {
        let Some(direction) = DVec3::from_array(*axis.axis).try_normalize() else {
            let message = format!("axis {} of {key} has no direction", i + 1);
            problems.push(
                axis.axis
                    .problem(message)
                    .help("write for example [0, 0, 1]"),
            );
            continue;
        };
        joints.push(Joint {
            name: format!("{prefix}{}", i + 1),
            kind: JointKind::Revolute,
            parent_from_joint: frame::pose(*axis.position, *axis.angles),
            axis: direction,
            limits: *limits,
        });
    }
    (joints.len() == axes.len()).then_some(joints)
}

fn track(
    setting: &Setting<Option<TrackTable>>,
    table: &TrackTable,
    problems: &mut Vec<Problem>,
) -> Option<Chain> {
    let Some(axis) = DVec3::from_array(*table.axis).try_normalize() else {
        let message = format!("{} has no direction", table.axis.name);
        problems.push(
            table
                .axis
                .problem(message)
                .help("write for example [1, 0, 0]"),
        );
        return None;
    };
    if let Some(wrong) = sound::order(table.low.0, table.high.0) {
        let ends = (*table.low, *table.high);
        problems.push(sound::told(&table.low, &setting.name, ends, wrong));
    }
    let joint = Joint {
        name: "track".to_owned(),
        kind: JointKind::Prismatic,
        parent_from_joint: Pose {
            position: DVec3::from_array(table.position.map(|l| l.0)),
            ..Pose::IDENTITY
        },
        axis,
        limits: Limits {
            low: table.low.0,
            high: table.high.0,
            speed: table.speed.map(|s| s.0),
            acceleration: table.acceleration.map(|a| a.0),
        },
    };
    Some(Chain {
        joints: vec![joint],
        last_from_end: Pose::IDENTITY,
    })
}

fn positioner(
    setting: &Setting<Option<PositionerTable>>,
    table: &PositionerTable,
    problems: &mut Vec<Problem>,
) -> Option<Chain> {
    let count = table.axes.len();
    let speeds = table.speed.as_ref().map_or(count, |s| s.len());
    let accelerations = table.acceleration.as_ref().map_or(count, |a| a.len());
    if [table.low.len(), table.high.len(), speeds, accelerations] != [count; 4] {
        let message = format!(
            "{} has {count} axes: low, high, speed and acceleration take as many values",
            setting.name
        );
        problems.push(setting.problem(message));
        return None;
    }
    let limits: Vec<Limits> = (0..count)
        .map(|i| Limits {
            low: table.low[i].0,
            high: table.high[i].0,
            speed: table.speed.as_ref().map(|s| s[i].0),
            acceleration: table.acceleration.as_ref().map(|a| a[i].0),
        })
        .collect();
    for (i, l) in limits.iter().enumerate() {
        if let Some(wrong) = sound::order(l.low, l.high) {
            let of = format!("axis {} of {}", i + 1, setting.name);
            let ends = (table.low[i], table.high[i]);
            problems.push(sound::told(&table.low, &of, ends, wrong));
        }
    }
    let joints = joints("P", &table.axes, &table.axes.name, &limits, problems)?;
    Some(Chain {
        joints,
        last_from_end: Pose::IDENTITY,
    })
}

/// Where the numbers come from; guesses that name no key are told.
fn sources(file: &CellFile, problems: &mut Vec<Problem>) -> Vec<Source> {
    let mut sources = Vec::new();
    let mut of = |of, says: Option<&String>, guesses: &[String]| {
        let says = says.cloned();
        sources.push(Source {
            of,
            says,
            guesses: guesses.to_vec(),
        });
    };
    of("arm", Some(&*file.arm.source), &file.arm.guesses);
    of("joints", Some(&*file.joints.source), &file.joints.guesses);
    if let Some(track) = file.track.as_ref() {
        of("track", Some(&*track.source), &[]);
    }
    if let Some(positioner) = file.positioner.as_ref() {
        of("positioner", Some(&*positioner.source), &positioner.guesses);
    }
    // what leads from the tip of the wire to the part must be known; the world is where the base stands, and the part where the
    // table lies, unless something is said of them
    of("torch", file.torch.source.as_ref(), &[]);
    let table_on_robot = *file.arrangement == Arrangement::TorchOnRobot;
    for (name, frame, counts) in [
        ("base", &file.base, false),
        ("table", &file.table, table_on_robot),
        ("part", &file.part, !table_on_robot),
    ] {
        if counts || frame.says_something() {
            of(name, frame.source.as_ref(), &[]);
        }
    }
    if let Some(shapes) = file.shapes.as_ref() {
        if shapes.table_thickness.is_written() && shapes.table.is_none() {
            let message = format!(
                "{} is written, but not how large the table is",
                shapes.table_thickness.name
            );
            let problem = shapes.table_thickness.problem(message);
            problems.push(problem.help("write shapes.table too"));
        }
        let silent = shapes.table.is_some() && !shapes.table_thickness.is_written();
        // a table that stands cannot be deeper than it is taken to be; one that turns can
        let guessed = (silent && file.positioner.is_some())
            .then(|| shapes.table_thickness.name.rsplit('.').next())
            .flatten();
        let guesses: Vec<String> = guessed.into_iter().map(str::to_owned).collect();
        of(SHAPES, shapes.source.as_ref(), &guesses);
    }
    known_guesses::<ArmTable>(&file.arm.guesses, problems);
    known_guesses::<JointsTable>(&file.joints.guesses, problems);
    if let Some(positioner) = file.positioner.as_ref() {
        known_guesses::<PositionerTable>(&positioner.guesses, problems);
    }
    sources
}

/// Guesses are keys of their table.
fn known_guesses<T: settings::Value>(guesses: &Setting<Vec<String>>, problems: &mut Vec<Problem>) {
    let settings::Kind::Table(table) = T::KIND else {
        return;
    };
    let keys = || table.keys.iter().map(|k| k.name);
    for guess in guesses.iter().filter(|g| keys().all(|k| k != g.as_str())) {
        let problem = guesses.problem(format!(
            "{} names \"{guess}\", which is no key of its table",
            guesses.name
        ));
        problems.push(match nearest(guess, keys()) {
            Some(near) => problem.help(format!("did you mean \"{near}\"?")),
            None => problem.help(format!(
                "keys are {}",
                keys().collect::<Vec<_>>().join(", ")
            )),
        });
    }
}
