//! Programs for a torch that stands while the robot holds the part: written, read, and those of others, as KUKA's and ABB's controllers take them.

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_programs::held::{Holds, Standing};
use meltpath_programs::program::{Coordinates, Instruction, Program};
use meltpath_programs::{
    BuildSettings, CellProgramming, Dialect, ExecutionSettings, Gap, Missing, Open, Reading, build,
    dialect, read_toolpath,
};
use meltpath_toolpath::Toolpath;
use proptest::prelude::*;

use crate::built::{toolpath, two_layers};
use crate::dialects::{asked, executed, held, read, text_of, told, written};
use crate::told::motions;

const FEED: f64 = 400.0 / 3.0;
const SPOKEN: [Dialect; 3] = [Dialect::Krl, Dialect::Rapid, Dialect::Val3];

/// A torch beside the arm that leans, and a part on a holder that is turned.
pub(crate) fn standing() -> Standing {
    let turn = |axis: DVec3, degrees: f64| DQuat::from_axis_angle(axis, degrees.to_radians());
    Standing {
        world_from_torch: Pose {
            position: DVec3::new(1200.5, -350.25, 900.125),
            orientation: turn(DVec3::X, 160.0) * turn(DVec3::Z, 20.0),
        },
        flange_from_part: Pose {
            position: DVec3::new(5.0, 0.0, 80.0),
            orientation: turn(DVec3::Z, 45.0),
        },
    }
}

pub(crate) fn cell() -> CellProgramming {
    crate::dialects::cell(&[FEED, 100.0])
}

pub(crate) fn asked_for(dialect: Dialect) -> BuildSettings {
    BuildSettings {
        standing: Some(standing()),
        ..asked(dialect)
    }
}

/// The programs of a plan, and the same read back from what is written.
pub(crate) fn written_and_read(plan: &Toolpath, dialect: Dialect) -> [Vec<Program>; 2] {
    let cell = cell();
    let built = build(plan, &cell, &asked_for(dialect), &Reporter::new()).unwrap();
    let built = held(built, dialect);
    let files = written(&built, &cell).unwrap();
    let parsed = files.iter().map(|f| read(dialect, f, &cell).program);
    let parsed: Vec<Program> = parsed.collect();
    for (program, files) in parsed.iter().zip(&files) {
        assert_eq!(&dialect::write(program, &cell).unwrap(), files);
    }
    [built.programs, parsed]
}

#[test]
fn golden_programs_for_a_torch_that_stands() {
    let cell = cell();
    for dialect in SPOKEN {
        let plan = toolpath(FEED, two_layers().into());
        let built = build(&plan, &cell, &asked_for(dialect), &Reporter::new()).unwrap();
        let files = written(&held(built, dialect), &cell).unwrap().concat();
        insta::assert_snapshot!(format!("standing_torch_{dialect:?}"), told(&files));
    }
}

/// Dialects without words for it write what they wrote.
#[test]
fn other_dialects_say_nothing_of_it() {
    let plan = toolpath(FEED, two_layers().into());
    for dialect in [Dialect::FanucLs, Dialect::Inform] {
        let build = |asked: &BuildSettings| build(&plan, &cell(), asked, &Reporter::new()).unwrap();
        assert_eq!(build(&asked_for(dialect)), build(&asked(dialect)));
    }
}

/// The six numbers of a KUKA's pose, mm and deg, as the text has them.
fn numbers(line: &str) -> [f64; 6] {
    let inner = line.split_once('{').unwrap().1;
    let mut all = inner.split([',', '}']).take(6).map(|field| {
        let number = field.split(' ').nth(1).unwrap();
        number.parse::<f64>().unwrap()
    });
    std::array::from_fn(|_| all.next().unwrap())
}

/// A turns about z, then B about the new y, then C about the newest x.
pub(crate) fn kuka([x, y, z, a, b, c]: [f64; 6]) -> Pose {
    let [a, b, c] = [a, b, c].map(f64::to_radians);
    Pose {
        position: DVec3::new(x, y, z),
        orientation: DQuat::from_rotation_z(a)
            * DQuat::from_rotation_y(b)
            * DQuat::from_rotation_x(c),
    }
}

/// Axis and position of the poses of a plan, in the part.
pub(crate) fn plan_of(points: &[([f64; 3], [f64; 3])]) -> Toolpath {
    let mut layer = meltpath_toolpath::Layer::new(1, 0.0);
    let head = crate::built::head(1, meltpath_toolpath::Role::Contour);
    let at = |(position, axis): &([f64; 3], [f64; 3])| {
        let position = (DVec3::from_array(*position) * 1e3).round() * 1e-3;
        (
            position,
            DVec3::from_array(*axis).try_normalize().unwrap_or(DVec3::Z),
        )
    };
    let mut points = points.iter().map(at);
    let (first, axis) = points.next().unwrap();
    let mut pass = layer.begin(head, first);
    pass.axis(axis);
    for (point, axis) in points {
        pass.line_to(point).axis(axis);
    }
    toolpath(FEED, vec![layer])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_for_a_torch_that_stands_is_read(
        points in proptest::collection::vec((prop::array::uniform3(-500.0..500.0_f64), prop::array::uniform3(-1.0..1.0_f64)), 2..12),
    ) {
        let plan = plan_of(&points);
        for dialect in SPOKEN {
            let [built, parsed] = written_and_read(&plan, dialect);
            for (wanted, found) in built.iter().zip(&parsed) {
                prop_assert_eq!(wanted.positions.len(), found.positions.len());
                for (a, b) in wanted.positions.iter().zip(&found.positions) {
                    let pose = |c: &Coordinates| match c {
                        Coordinates::Cartesian { xyz: [x, y, z], wpr_degrees: [w, p, r], .. } => kuka([*x, *y, *z, *r, *p, *w]),
                        _ => unreachable!("all are told by place"),
                    };
                    let [a, b] = [a, b].map(|p| pose(&p.groups[0].coordinates));
                    prop_assert!((a.position - b.position).abs().max_element() < 1e-3, "{:?} {:?}", a, b);
                    prop_assert!(a.orientation.angle_between(b.orientation) < 1e-3_f64.to_radians());
                }
            }
            if dialect == Dialect::Val3 {
                // points of a random plan turn the part far: told, see below
                continue;
            }
            let (wanted, found) = (executed(&built, &cell()), executed(&parsed, &cell()));
            prop_assert_eq!(found.len(), wanted.len());
            for (a, b) in found.iter().zip(&wanted) {
                prop_assert_eq!(a.control.holds, Some(Holds::Part));
                prop_assert_eq!((a.burns, a.layer, a.bead), (b.burns, b.layer, b.bead));
            }
        }
    }

    /// A KUKA is told the part in the torch's frame; an ABB the torch in the part, as ever.
    #[test]
    fn a_kuka_is_told_the_inverse(
        points in proptest::collection::vec((prop::array::uniform3(-300.0..300.0_f64), prop::array::uniform3(-1.0..1.0_f64)), 2..6),
    ) {
        let plan = plan_of(&points);
        let cell = cell();
        let built = build(&plan, &cell, &asked_for(Dialect::Krl), &Reporter::new()).unwrap();
        let text = &written(&held(built.clone(), Dialect::Krl), &cell).unwrap()[0][1].text;
        let lines = text.lines().filter(|l| l.starts_with("DECL POS"));
        for (line, position) in lines.zip(&built.programs[0].positions) {
            let Coordinates::Cartesian { xyz: [x, y, z], wpr_degrees: [w, p, r], .. } = position.groups[0].coordinates else {
                unreachable!("all are told by place")
            };
            let both = kuka(numbers(line)).then(kuka([x, y, z, r, p, w]));
            prop_assert!(both.position.length() < 1e-3, "{}", both.position.length());
            prop_assert!(both.orientation.angle_between(DQuat::IDENTITY) < 1e-3_f64.to_radians());
        }
        let other = BuildSettings { standing: None, ..asked_for(Dialect::Rapid) };
        let rapid = |asked: &BuildSettings| build(&plan, &cell, asked, &Reporter::new()).unwrap().programs[0].positions.clone();
        prop_assert_eq!(rapid(&other), rapid(&asked_for(Dialect::Rapid)));
    }
}

/// Looking along y the first angle and the third are one.
#[test]
fn an_inverse_that_looks_along_y_is_written_once_and_the_same() {
    for second in [89.999_999_6, 90.0, -89.999_999_7] {
        let [_, mut parsed] = written_and_read(&toolpath(FEED, two_layers().into()), Dialect::Krl);
        let turned = kuka([30.0, -20.0, 12.5, 33.0, second, 21.0]).inverse();
        let wpr = turned.wpr().to_array().map(f64::to_degrees);
        let group = &mut parsed[0].positions[0].groups[0];
        if let Coordinates::Cartesian {
            xyz, wpr_degrees, ..
        } = &mut group.coordinates
        {
            (*xyz, *wpr_degrees) = (turned.position.to_array(), wpr);
        }
        let files = dialect::write(&parsed[0], &cell()).unwrap();
        let again = read(Dialect::Krl, &files, &cell());
        assert_eq!(dialect::write(&again.program, &cell()).unwrap(), files);
    }
}

/// Each of several programs says it, and so does the one that calls them.
#[test]
fn every_program_of_several_says_it() {
    let mut cell = cell();
    cell.lines_per_program.value = 50;
    cell.points_per_program.value = 20;
    let layers = (0..5).map(|i| {
        let mut layer = meltpath_toolpath::Layer::new(i + 1, 0.0);
        let head = crate::built::head(i, meltpath_toolpath::Role::Contour);
        let points = (0..8).map(|k| DVec3::new(f64::from(k) * 10.0, 5.0, f64::from(i) * 1.6));
        layer.polyline(head, points);
        layer
    });
    let plan = toolpath(FEED, layers.collect());
    for dialect in SPOKEN {
        let built = build(&plan, &cell, &asked_for(dialect), &Reporter::new()).unwrap();
        let built = held(built, dialect);
        // a project is one program
        assert!(built.programs.len() > 2 || dialect == Dialect::Val3);
        let files = written(&built, &cell).unwrap();
        let parsed = files.iter().map(|f| read(dialect, f, &cell).program);
        let parsed: Vec<Program> = parsed.collect();
        let says = |p: &Program| p.instructions.contains(&Instruction::Holds(Holds::Part));
        assert!(parsed.iter().all(says));
        let (found, wanted) = (executed(&parsed, &cell), executed(&built.programs, &cell));
        // a Stäubli's moves of 10 mm are in two pieces
        let pieces = if dialect == Dialect::Val3 { 2 } else { 1 };
        assert_eq!(found.iter().filter(|m| m.burns).count(), 5 * 7 * pieces);
        for (a, b) in found.iter().zip(&wanted) {
            assert!(a.to.distance(b.to) < 1e-3 && a.control.holds == Some(Holds::Part));
        }
    }
}

/// What the comments at the begin of programs tell of the frames.
#[test]
fn a_program_tells_where_torch_and_part_are_to_be() {
    let [_, parsed] = written_and_read(&toolpath(FEED, two_layers().into()), Dialect::Krl);
    let comments = parsed[0].instructions.iter().filter_map(|i| match i {
        Instruction::Comment { text, .. } => Some(text.as_str()),
        _ => None,
    });
    let comments: Vec<&str> = comments.collect();
    let Standing {
        world_from_torch,
        flange_from_part,
    } = standing();
    for (text, name, wanted) in [
        (comments[0], "BASE_DATA[1]=", world_from_torch),
        (comments[1], "TOOL_DATA[1]=", flange_from_part),
    ] {
        assert!(text.starts_with(name), "{text}");
        let told = kuka(numbers(text));
        assert!(told.position.distance(wanted.position) < 1e-3, "{text}");
        assert!(told.orientation.angle_between(wanted.orientation) < 1e-5);
    }
}

/// Where moves lead, mm, with what the robot holds; what was not simulated; what was told.
type Played = (Vec<(DVec3, Option<Holds>)>, Vec<Gap>, String);

/// The programs of a KUKA's files as they are executed.
fn krl(source: &str, list: &str) -> Played {
    krl_file(&format!("DEF S( )\n{source}\nEND\n"), list)
}

/// Those of a source file with all of its programs.
fn krl_file(source: &str, list: &str) -> Played {
    played(&krl_programs(source, list))
}

fn krl_programs(source: &str, list: &str) -> Vec<Program> {
    let list = format!("DEFDAT S\n{list}\nENDDAT\n");
    let parsed = dialect::read(
        Dialect::Krl,
        source.as_bytes(),
        Some(list.as_bytes()),
        &cell(),
    );
    parsed.unwrap().into_iter().map(|p| p.program).collect()
}

fn rapid(data: &str, moves: &str) -> Played {
    let module = format!(
        "MODULE m\n{data}\nLOCAL PERS welddata wd1:=[10,0,[1,8,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nPROC main()\n{moves}\nENDPROC\nENDMODULE\n"
    );
    let parsed = dialect::read(Dialect::Rapid, module.as_bytes(), None, &cell());
    let programs: Vec<Program> = parsed.unwrap().into_iter().map(|p| p.program).collect();
    played(&programs)
}

pub(crate) fn reading(programs: &[Program], reporter: &Reporter) -> Reading {
    let known = ExecutionSettings {
        assumed_speed: 10.0,
        ..cell().execution(10.0)
    };
    read_toolpath(programs, &known, 1e3, reporter).unwrap()
}

fn played(programs: &[Program]) -> Played {
    let reporter = Reporter::new();
    let reading = reading(programs, &reporter);
    let all = motions(&reading)
        .iter()
        .map(|m| (m.to, m.control.holds))
        .collect();
    let warnings = reporter.warnings();
    let told: Vec<String> = warnings.iter().map(|w| w.message.clone()).collect();
    (all, reading.gaps, told.join("\n"))
}

/// The torch at `at` in the part, its wire along the part's -z, as a KUKA is told it: half a turn about x is its own inverse.
fn told_to_kuka(name: &str, [x, y, z]: [f64; 3]) -> String {
    let [y, z] = [y, z].map(|v| v + 0.0);
    format!("DECL POS X{name}={{X {},Y {y},Z {z},A 0,B 0,C 180}}", -x)
}

const WELD: &str = "DECL stArcDat_T WDAT1={Weld {JobModeId[] \"Job mode\",ParamSetId[] \"Set2\",Velocity 0.01,Channel1 1,Channel2 8.0,Channel3 0.0}}";
const FRAMES: &str = "$BASE=BASE_DATA[3]\n$TOOL=TOOL_DATA[2]\n";

/// Places of three points in the part, and their list.
fn three() -> ([DVec3; 3], String) {
    let at = [[1.0, 2.0, 30.0], [1.0, 2.0, 0.0], [41.0, 2.0, 0.0]];
    let lines = (1..)
        .zip(at)
        .map(|(n, at)| told_to_kuka(&format!("P{n}"), at));
    let lines: Vec<String> = lines.chain([WELD.to_owned()]).collect();
    (at.map(DVec3::from_array), lines.join("\n"))
}

const BEAD: &str = "$VEL.CP=0.1\nPTP XP1\nArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP1)\nLIN XP2\nArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP1)\n$VEL.CP=gArcBasVelDefinition\nArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP1)\nLIN XP3\nArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP1)\n";

fn same(found: &[(DVec3, Option<Holds>)], wanted: &[DVec3]) -> bool {
    found.len() == wanted.len()
        && found
            .iter()
            .zip(wanted)
            .all(|((a, _), b)| a.distance(*b) < 1e-9)
}

#[test]
fn a_kuka_with_an_external_tcp_is_read() {
    let (at, list) = three();
    let (found, gaps, _) = krl(&format!("{FRAMES}$IPO_MODE=#TCP\n{BEAD}"), &list);
    assert_eq!(gaps, []);
    assert!(same(&found, &at[1..]), "{found:?}");
    assert!(found.iter().all(|(_, holds)| *holds == Some(Holds::Part)));
    // the inline forms, old and new, home by its joints before and after
    let frames = "DECL FDAT FHOME={TOOL_NO 0,BASE_NO 0,IPO_FRAME #BASE}\nDECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nDECL FDAT FP1={TOOL_NO 2,BASE_NO 3,IPO_FRAME #TCP}\nDECL FDAT FP2={TOOL_NO 2,BASE_NO 3,IPO_FRAME #TCP}\nDECL FDAT FP3={TOOL_NO 2,BASE_NO 3,IPO_FRAME #TCP}";
    let list = format!("{list}\n{frames}");
    let home = "FDAT_ACT=FHOME\nBAS(#PTP_PARAMS,20)\nPTP XHOME\n";
    let (found, gaps, told) = krl(&format!("{home}FDAT_ACT=FP1\n{BEAD}{home}"), &list);
    assert_eq!(gaps, [], "{told}");
    assert!(same(&found, &at[1..]), "{found:?}");
    let spline = BEAD
        .replace("PTP XP1", "SPTP XP1 WITH $TOOL = STOOL2(FP1), $BASE = SBASE(FP1.BASE_NO), $IPO_MODE = SIPO_MODE(FP1.IPO_FRAME)")
        .replace("LIN XP2", "SLIN XP2 WITH $VEL = SVEL_CP(0.1), $IPO_MODE = SIPO_MODE(FP2.IPO_FRAME)")
        .replace("LIN XP3", "SLIN XP3 WITH $IPO_MODE = SIPO_MODE(FP3.IPO_FRAME)");
    let (found, gaps, _) = krl(&format!("{FRAMES}{spline}"), &list);
    assert_eq!(gaps, []);
    assert!(same(&found, &at[1..]), "{found:?}");
}

#[test]
fn a_kuka_that_changes_in_the_middle_is_told() {
    let (at, list) = three();
    // a bead with the torch on the robot behind one with the part on it
    let again = format!("{FRAMES}$IPO_MODE=#TCP\n{BEAD}$IPO_MODE=#BASE\n{BEAD}");
    let (found, gaps, told) = krl(&again, &list);
    let (here, beads) = (Holds::Torch, Holds::Part);
    let why: Vec<&Missing> = gaps.iter().map(|g| &g.why).collect();
    assert!(
        why.contains(&&Missing::HeldOtherwise { here, beads }),
        "{gaps:?}"
    );
    assert!(gaps[0].why.remedy().contains("by themselves"));
    assert!(same(&found, &at[1..]), "{found:?} {told}");
    // a travel alone is left out, and told
    let (found, gaps, told) = krl(
        &format!("{FRAMES}$IPO_MODE=#TCP\n{BEAD}$IPO_MODE=#BASE\n$VEL.CP=0.1\nLIN XP1\n"),
        &list,
    );
    assert_eq!(gaps, []);
    assert!(same(&found, &at[1..]), "{found:?}");
    assert!(told.contains("the robot holds the torch there"), "{told}");
    // where the arm goes along it nobody can say
    let alone = format!(
        "DEF S( )\n{FRAMES}$IPO_MODE=#TCP\n{BEAD}$IPO_MODE=#BASE\n$VEL.CP=0.1\nLIN XP1\nEND\n"
    );
    let reading = reading(&krl_programs(&alone, &list), &Reporter::new());
    let [travel] = &reading.left_out[..] else {
        panic!("{:?}", reading.left_out)
    };
    assert_eq!(travel.why, Missing::HeldOtherwise { here, beads });
    assert_eq!(travel.why.open(), Open::Places);
    // whether the basic settings set it back nobody says
    let (_, gaps, _) = krl(
        &format!("{FRAMES}$IPO_MODE=#TCP\nBAS(#INITMOV,0)\n{BEAD}"),
        &list,
    );
    assert!(gaps[0].text.contains("$IPO_MODE"), "{gaps:?}");
    // a mode that is a variable
    let (_, gaps, _) = krl(&format!("{FRAMES}$IPO_MODE=MODE\n{BEAD}"), &list);
    assert_eq!(gaps.len(), 1, "{gaps:?}");
}

/// What is set holds for the programs that are called; those that do not say it are read the usual way, which is told.
#[test]
fn a_kuka_that_sets_it_in_another_program_is_told() {
    let (_, list) = three();
    let source = format!("DEF S( )\n{FRAMES}$IPO_MODE=#TCP\nSUB( )\nEND\nDEF SUB( )\n{BEAD}END\n");
    let (_, gaps, _) = krl_file(&source, &list);
    assert!(
        gaps.iter()
            .all(|g| g.why == Missing::HoldsUnsaid(Holds::Torch))
            && !gaps.is_empty(),
        "{gaps:?}"
    );
}

const STANDS: &str =
    "PERS tooldata tGun:=[FALSE,[[1200,0,900],[0,1,0,0]],[5,[0,0,50],[1,0,0,0],0,0,0]];";
const HELD: &str =
    "PERS wobjdata wHeld:=[TRUE,TRUE,\"\",[[0,0,80],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];";

fn moves(tool: &str) -> String {
    let at = |[x, y, z]: [f64; 3]| {
        format!("[[{x},{y},{z}],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    };
    let [first, second, third] = [[1.0, 2.0, 30.0], [1.0, 2.0, 0.0], [41.0, 2.0, 0.0]].map(at);
    format!(
        "MoveJ {first},v100,fine,{tool};\nArcLStart {second},v100,sm1,wd1,fine,{tool};\nArcLEnd {third},v100,sm1,wd1,fine,{tool};"
    )
}

#[test]
fn an_abb_with_a_stationary_tool_is_read() {
    let (at, _) = three();
    let both = format!("{STANDS}\n{HELD}");
    for data in [both.as_str(), STANDS, HELD] {
        let (found, gaps, told) = rapid(data, &moves("tGun\\WObj:=wHeld"));
        assert_eq!(gaps, [], "{told}");
        assert!(same(&found, &at[1..]), "{found:?}");
        assert!(found.iter().all(|(_, holds)| *holds == Some(Holds::Part)));
    }
    // home by its joints, with the flange as tool
    let home = "MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;";
    let (found, gaps, _) = rapid(
        &both,
        &format!("{home}\n{}\n{home}", moves("tGun\\WObj:=wHeld")),
    );
    assert_eq!(gaps, []);
    assert!(same(&found, &at[1..]), "{found:?}");
    // where a module says nothing, nothing is said
    let (found, gaps, _) = rapid("", &moves("tGun\\WObj:=wHeld"));
    assert_eq!(gaps, []);
    assert!(found.iter().all(|(_, holds)| holds.is_none()));
}

#[test]
fn an_abb_whose_data_do_not_agree_is_told() {
    let held = STANDS.replace("[FALSE,", "[TRUE,");
    let stands = HELD.replace("[TRUE,TRUE", "[FALSE,TRUE");
    for (data, wanted) in [
        (format!("{held}\n{HELD}"), Holds::Both),
        (format!("{STANDS}\n{stands}"), Holds::Neither),
    ] {
        let (_, gaps, _) = rapid(&data, &moves("tGun\\WObj:=wHeld"));
        let why: Vec<&Missing> = gaps.iter().map(|g| &g.why).collect();
        assert!(why.contains(&&Missing::Holds(wanted)), "{gaps:?}");
    }
    // without its object the base stands, and so does the torch
    let (_, gaps, _) = rapid(STANDS, &moves("tGun"));
    assert_eq!(gaps[0].why, Missing::Holds(Holds::Neither));
    // the line that ends the program does
    let ends = format!(
        "IF tGun.robhold OR NOT wHeld.robhold EXIT;\n{}",
        moves("tGun\\WObj:=wHeld")
    );
    let (_, gaps, _) = rapid(&format!("{STANDS}\n{HELD}"), &ends);
    assert_eq!(gaps, []);
    let (_, gaps, _) = rapid(&format!("{held}\n{stands}"), &ends);
    assert!(gaps[0].text.contains("EXIT"), "{gaps:?}");
    // a part that is fetched with a gripper: a travel that leads elsewhere
    let grip = "PERS tooldata tGrip:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];";
    let fetch = "MoveL [[500,0,90],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGrip;";
    let all = format!("{fetch}\n{}", moves("tGun\\WObj:=wHeld"));
    let (at, _) = three();
    let (found, gaps, told) = rapid(&format!("{grip}\n{STANDS}\n{HELD}"), &all);
    assert_eq!(gaps, []);
    assert!(same(&found, &at[1..]), "{found:?}");
    assert!(told.contains("the robot holds the torch there"), "{told}");
}

#[test]
fn what_cannot_be_held_is_refused() {
    let plan = toolpath(FEED, two_layers().into());
    let mut cell = cell();
    cell.rapid.value.as_mut().unwrap().work_object.value = "wobj0".to_owned();
    let built = build(&plan, &cell, &asked_for(Dialect::Rapid), &Reporter::new()).unwrap();
    let refused = dialect::write(&built.programs[0], &cell).unwrap_err();
    assert!(
        refused.to_string().contains("program.rapid.work_object"),
        "{refused}"
    );
    // with the torch on the robot nothing is said
    let (program, _) = text_of(
        &plan,
        &crate::dialects::cell(&[FEED, 100.0]),
        Dialect::Rapid,
    );
    let said = |i: &Instruction| matches!(i, Instruction::Holds(_));
    assert!(!program.instructions.iter().any(said));
}
