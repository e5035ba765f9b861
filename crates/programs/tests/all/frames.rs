//! Where programs say that their frames lie: in numbers, in sums of constants, written out where they are selected, or not readably.

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::Instruction;
use meltpath_programs::shared_frames::{agree, own_frames, tell_in_part};
use meltpath_programs::{Dialect, Open, Program, Reading, dialect, read_toolpath};

use crate::dialects::cell;
use crate::told::motions;

fn read(dialect: Dialect, text: &str, data: Option<&str>) -> Program {
    let data = data.map(str::as_bytes);
    let parsed = dialect::read(dialect, text.as_bytes(), data, &cell(&[100.0])).unwrap();
    parsed.into_iter().next().unwrap().program
}

fn run(program: &Program) -> Reading {
    let settings = cell(&[100.0]).execution(10.0);
    let programs = std::slice::from_ref(program);
    read_toolpath(programs, &settings, 1000.0, &Reporter::new()).unwrap()
}

fn module(data: &str, lines: &str) -> Program {
    let text = format!("MODULE m\n{data}\nPROC main()\n{lines}\nENDPROC\nENDMODULE\n");
    read(Dialect::Rapid, &text, None)
}

const HOME: &str = "[[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGun;";

#[test]
fn the_place_of_a_tool_may_be_a_sum_of_constants() {
    let tool = |of: &str, x: &str| {
        let data = format!(
            "{of};\nPERS tooldata tGun:=[TRUE,[[{x},0,342],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];"
        );
        module(&data, &format!("MoveJ {HOME}")).said_frames
    };
    for (x, wanted) in [
        ("off+-19.5", -16.5),
        ("-off", -3.0),
        ("1.5E1 - off", 12.0),
        ("2e-1+off+1", 4.2),
    ] {
        let said = tool("CONST num off:=3", x);
        let at = said.tool.values().next().unwrap().position.x;
        assert!((at - wanted).abs() < 1e-12, "{x}: {at}");
        assert_eq!(said.unread, []);
    }
    for (of, x) in [
        ("PERS num off:=3", "off+1"),
        ("CONST num off:=3", "2*off"),
        ("CONST num off:=3", "other"),
    ] {
        let said = tool(of, x);
        assert!(said.tool.is_empty());
        let (line, text) = said.unread.first().unwrap();
        assert_eq!(*line, 3);
        assert!(text.starts_with("PERS tooldata tGun"), "{text}");
    }
}

/// An object that a unit moves says its places in numbers, though they are not where it stands.
#[test]
fn an_object_on_a_unit_is_read() {
    let data =
        "PERS wobjdata wMoved:=[FALSE,FALSE,\"STN1\",[[500,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];";
    let line = format!("MoveJ {}", HOME.replace(';', "\\WObj:=wMoved;"));
    assert_eq!(module(data, &line).said_frames.unread, []);
}

#[test]
fn moves_in_objects_that_are_told_in_numbers_are_in_one_frame() {
    let data = "PERS tooldata tGun:=[TRUE,[[0,0,300],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
PERS wobjdata wA:=[FALSE,TRUE,\"\",[[500,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
PERS wobjdata wB:=[FALSE,TRUE,\"\",[[500,40,100],[0.7071067812,0,0,0.7071067812]],[[0,0,0],[1,0,0,0]]];
PERS wobjdata wC:=[FALSE,TRUE,\"\",[[off,40,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
CONST robtarget p1:=[[0,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
CONST robtarget p2:=[[30,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
PERS welddata wd1:=[10,0,[4,8,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];";
    let beads = |object: &str| {
        let lines = format!(
            "MoveJ [[700,0,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
ArcLStart p1,v20,sm1,wd1,fine,tGun\\WObj:=wA;
ArcLEnd p2,v10,sm1,wd1,fine,tGun\\WObj:=wA;
ArcLStart p1,v20,sm1,wd1,fine,tGun\\WObj:={object};
ArcLEnd p2,v10,sm1,wd1,fine,tGun\\WObj:={object};"
        );
        run(&module(data, &lines))
    };
    let reading = beads("wB");
    assert_eq!(reading.gaps, []);
    // the flange at home 700, 0, 900 of the base, the wire's tip 300 mm below
    let start = reading.toolpath.passes().next().unwrap().points[0];
    assert!(
        start.distance(DVec3::new(200.0, 0.0, 500.0)) < 1e-6,
        "{start}"
    );
    let to: Vec<DVec3> = motions(&reading).iter().map(|m| m.to).collect();
    let wanted = [[0.0, 0.0], [30.0, 0.0], [0.0, 40.0], [0.0, 70.0]];
    for (to, [x, y]) in to.iter().zip(wanted) {
        assert!(to.distance(DVec3::new(x, y, 0.0)) < 1e-6, "{to}");
    }
    let other = beads("wC");
    assert!(
        other.gaps[0].why.to_string().contains("in user frame wc"),
        "{:?}",
        other.gaps
    );
}

/// A joint target without offsets of external axes is one as it stands.
#[test]
fn a_joint_target_without_offsets_is_not_kept_as_an_unknown_word() {
    let data = "CONST jointtarget j1:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];";
    let program = module(data, "MoveAbsJ j1\\NoEOffs,v100,fine,tGun;");
    let Some(Instruction::Motion(motion)) = program.instructions.first() else {
        panic!("{:?}", program.instructions)
    };
    assert_eq!(motion.extra, Vec::<String>::new());
}

#[test]
fn bases_and_tools_of_a_kuka_may_be_written_out() {
    let lines = |base: &str, tool: &str| {
        let text = format!(
            "DEF K( )\n$BASE={base}\n$TOOL={tool}\nPTP {{X 1,Y 0,Z 5,A 0,B 0,C 180}}\nEND\n"
        );
        read(Dialect::Krl, &text, None)
    };
    let program = lines(
        "{X 700,Y 300,Z 100,A 90,B 0,C 0}",
        "{FRAME: X 0,Y 0,Z 500,A 0,B 0,C 0}",
    );
    let said = &program.said_frames;
    let (base, tool) = (
        said.user.values().next().unwrap(),
        said.tool.values().next().unwrap(),
    );
    assert_eq!(base.position, DVec3::new(700.0, 300.0, 100.0));
    let x = base.orientation * DVec3::X;
    assert!(x.distance(DVec3::Y) < 1e-12, "{x}");
    assert_eq!(tool.position, DVec3::new(0.0, 0.0, 500.0));
    assert_eq!(run(&program).gaps, []);
    let own = lines("$WORLD", "$NULLFRAME").said_frames;
    assert_eq!(own.user.values().next().unwrap().position, DVec3::ZERO);
    assert_eq!(own.tool.values().next().unwrap().position, DVec3::ZERO);
    // what is not whole is kept, and the refusal says what is read
    let part = lines("{X 700}", "$NULLFRAME");
    let settings = cell(&[100.0]).execution(10.0);
    let refused = read_toolpath(&[part], &settings, 1000.0, &Reporter::new()).unwrap_err();
    assert!(
        refused.to_string().contains("written out in numbers"),
        "{refused}"
    );
}

/// A KUKA program of these lines, with this data list.
fn kuka(lines: &str, data: Option<&str>) -> Program {
    let text = format!("DEF K( )\n{lines}\nPTP {{X 1,Y 0,Z 5,A 0,B 0,C 180}}\nEND\n");
    let data = data.map(|lines| format!("DEFDAT K PUBLIC\n{lines}\nENDDAT\n"));
    read(Dialect::Krl, &text, data.as_deref())
}

const AT_700: &str = "{X 700,Y 300,Z 100,A 90,B 0,C 0}";
const AT_800: &str = "{X 800,Y 300,Z 100,A 90,B 0,C 0}";
const TOOL: &str = "$TOOL={X 0,Y 0,Z 500,A 0,B 0,C 0}";

/// Where the user frames lie that a program selects, in order.
fn selected(program: &Program) -> Vec<Option<f64>> {
    let numbers = program.instructions.iter().filter_map(|i| match i {
        Instruction::UserFrame(n) => Some(n),
        _ => None,
    });
    let at = |n: &u32| program.said_frames.user.get(n).map(|p| p.position.x);
    numbers.map(at).collect()
}

#[test]
fn entries_of_a_kukas_tables_that_a_program_sets_are_read() {
    let select = "$BASE=BASE_DATA[1]";
    let ways = [
        (format!("BASE_DATA[1]={AT_700}\n{select}"), None),
        (
            format!("base_data[ 1 ] = {AT_700} ; the table\nBAS(#BASE,1)"),
            None,
        ),
        (
            format!("DECL FRAME myBase\nmyBase={AT_700}\n$BASE=myBase"),
            None,
        ),
        (
            "$BASE=TABLE1".to_owned(),
            Some(format!("DECL FRAME TABLE1={AT_700}")),
        ),
        (
            "BASE_DATA[1]=TABLE1\n$BASE=BASE_DATA[1]".to_owned(),
            Some(format!("DECL FRAME TABLE1={AT_700}")),
        ),
        (
            format!("BASE_DATA[2]={AT_700}\nBASE_DATA[1]=BASE_DATA[2]\n{select}"),
            None,
        ),
        (select.to_owned(), Some(format!("BASE_DATA[1]={AT_700}"))),
        (
            format!("BASE_DATA[1]={AT_700}\nFDAT_ACT=FP1"),
            Some("DECL FDAT FP1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE}".to_owned()),
        ),
    ];
    for (lines, data) in ways {
        let program = kuka(&format!("{TOOL}\n{lines}"), data.as_deref());
        assert_eq!(selected(&program), [Some(700.0)], "{lines}");
        let said = &program.said_frames;
        assert_eq!(
            (&said.unread[..], &said.changed[..]),
            (&[][..], &[][..]),
            "{lines}"
        );
        assert_eq!(run(&program).gaps, [], "{lines}");
    }
    let tool = kuka(
        "TOOL_DATA[3]={X 1,Y 2,Z 500,A 0,B 0,C 0}\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[3]",
        None,
    );
    assert_eq!(
        tool.said_frames.tool[&3].position,
        DVec3::new(1.0, 2.0, 500.0)
    );
    assert_eq!(tool.said_frames.user.len(), 0);
}

/// What was selected stays as it was: an entry that is set anew holds from where it is selected again.
#[test]
fn the_last_that_sets_an_entry_before_it_is_selected_holds() {
    let select = "$BASE=BASE_DATA[1]";
    let program = kuka(
        &format!(
            "{TOOL}\nBASE_DATA[1]={AT_700}\n{select}\nPTP {{X 1,Y 0,Z 5,A 0,B 0,C 180}}\nBASE_DATA[1]={AT_800}\nPTP {{X 2,Y 0,Z 5,A 0,B 0,C 180}}\n{select}"
        ),
        None,
    );
    assert_eq!(selected(&program), [Some(700.0), Some(800.0)]);
    assert_eq!(run(&program).gaps, []);
    // positions of the data list keep to no entry that lies at several places
    let data = "DECL FDAT FP1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE}\nDECL E6POS XP1={X 1,Y 0,Z 5,A 0,B 0,C 180,S 6,T 27,E1 0,E2 0,E3 0,E4 0,E5 0,E6 0}";
    let program = kuka(
        &format!(
            "BASE_DATA[1]={AT_700}\nFDAT_ACT=FP1\nLIN XP1\nBASE_DATA[1]={AT_800}\nFDAT_ACT=FP1\nLIN XP1"
        ),
        Some(data),
    );
    assert_eq!(selected(&program), [Some(700.0), Some(800.0)]);
    assert_eq!(run(&program).gaps, []);
}

#[test]
fn an_entry_that_is_no_plain_numbers_is_told() {
    for line in [
        "BASE_DATA[1]={X xOff,Y 300,Z 100,A 90,B 0,C 0}",
        "BASE_DATA[1]={X 700}",
        "BASE_DATA[1].X=700",
        "BASE_DATA[1]=BASE_DATA[7]",
        "BASE_DATA[i]={X 700,Y 300,Z 100,A 90,B 0,C 0}",
        "BASE_DATA[1]=GEO(1)",
        // no angle
        "BASE_DATA[1]={X 700,Y 300,Z 100,A 1E300,B 0,C 0}",
    ] {
        let program = kuka(&format!("{TOOL}\n{line}\n$BASE=BASE_DATA[1]"), None);
        assert_eq!(selected(&program), [None], "{line}");
        let gaps = run(&program).gaps;
        assert_eq!(gaps.len(), 1, "{line}: {gaps:?}");
        assert_eq!(gaps[0].why.open(), Open::Places);
    }
    for (x, a) in [("xOff", "90"), ("700", "1E300"), ("700", "-1000001")] {
        let line = format!("BASE_DATA[1]={{X {x},Y 300,Z 100,A {a},B 0,C 0}}");
        let listed = kuka(&format!("{TOOL}\n$BASE=BASE_DATA[1]"), Some(&line));
        assert_eq!(listed.said_frames.unread, [(2, line)], "{listed:?}");
    }
    // a base and a position that are written out
    let lines = "$BASE={X 700,Y 300,Z 100,A 1E300,B 0,C 0}\nPTP {X 1,Y 0,Z 5,A 0,B 1E300,C 180}";
    let gaps = run(&kuka(&format!("{TOOL}\n$BASE=BASE_DATA[1]\n{lines}"), None)).gaps;
    let found: Vec<u32> = gaps.iter().map(|g| g.line).collect();
    assert_eq!(found, [4, 5], "{gaps:?}");
    // moves in the frame that the controller had before
    let late = kuka(
        &format!(
            "{TOOL}\n$BASE=BASE_DATA[1]\nPTP {{X 1,Y 0,Z 5,A 0,B 0,C 180}}\nBASE_DATA[1]={AT_700}\n$BASE=BASE_DATA[1]"
        ),
        None,
    );
    assert_eq!(late.said_frames.changed.len(), 1, "{:?}", late.said_frames);
}

/// The controller's tables are those of all programs.
#[test]
fn an_entry_is_set_for_the_programs_that_are_called() {
    let set = |lines: &str| kuka(lines, None);
    let plain = || set(&format!("{TOOL}\n$BASE=BASE_DATA[1]"));
    let agreed = |mut programs: Vec<Program>| {
        agree(&mut programs);
        let last = programs.pop().unwrap();
        (selected(&last), last.said_frames.changed.len())
    };
    let main = set(&format!("BASE_DATA[1]={AT_700}\nSUB()"));
    assert_eq!(agreed(vec![main, plain()]), (vec![Some(700.0)], 0));
    let late = set(&format!("SUB()\nBASE_DATA[1]={AT_700}"));
    assert_eq!(agreed(vec![late, plain()]).1, 1);
    let several = set(&format!(
        "BASE_DATA[1]={AT_700}\nSUB()\nBASE_DATA[1]={AT_800}\nSUB()"
    ));
    assert_eq!(agreed(vec![several, plain()]).1, 1);
    let own = set(&format!(
        "{TOOL}\nBASE_DATA[1]={AT_800}\n$BASE=BASE_DATA[1]"
    ));
    let main = set(&format!("BASE_DATA[1]={AT_700}\nSUB()"));
    assert_eq!(agreed(vec![main, own]).1, 1);
    assert_eq!(agreed(vec![plain(), plain()]), (vec![None], 0));
}

/// The same positions, told in the robot's own frame and moved into the part's, lie where they did: to half of the last digit, 1e-9 mm, along each axis.
#[test]
fn positions_in_the_robots_own_frame_are_those_in_the_parts() {
    let turned = |at: [f64; 3], wpr: [f64; 3]| {
        let wpr = DVec3::from_array(wpr.map(f64::to_radians));
        Pose::from_wpr(DVec3::from_array(at), wpr)
    };
    let part = turned([1050.0, -190.0, 127.0], [5.0, -0.7, 17.0]);
    let own = turned([3.0, -2.0, 525.0], [1.0, 2.0, -3.0]);
    let own_from_part = own.inverse().then(part);
    let at = [[1.0, 2.0, 5.0], [40.0, -3.0, 7.0], [41.5, 20.25, -0.125]];
    let tool = turned([0.0; 3], [170.0, 12.0, -40.0]);
    let lines = |base: &str, from: Pose| {
        let line = |xyz: &[f64; 3]| {
            let to = from.then(Pose::at(DVec3::from_array(*xyz)).then(tool));
            let [x, y, z] = to.position.to_array();
            let [c, b, a] = to.wpr().to_array().map(f64::to_degrees);
            format!("PTP {{X {x:.9},Y {y:.9},Z {z:.9},A {a:.9},B {b:.9},C {c:.9}}}")
        };
        let all: Vec<String> = at.iter().map(line).collect();
        format!("{TOOL}\n$BASE={base}\n$VEL.CP=0.1\n{}", all.join("\n"))
    };
    let plain = kuka(&lines("BASE_DATA[1]", Pose::IDENTITY), None);
    for base in ["$WORLD", "$NULLFRAME", "BASE_DATA[0]"] {
        let mut told = kuka(&lines(base, own_from_part), None);
        let [number] = own_frames(&told)[..] else {
            panic!("{base}")
        };
        tell_in_part(&mut told, number, "1", [part, own]);
        let [a, b] = [&plain, &told].map(|p| motions(&run(p)));
        for (a, b) in a.iter().zip(&b).take(2) {
            let apart = a.to.distance(b.to);
            assert!(apart < 0.9e-9, "{base}: {apart:e} mm");
            assert!(a.axis.distance(b.axis) < 1e-10, "{base}");
            assert_eq!(a.control.frames.0, b.control.frames.0, "{base}");
        }
        assert_eq!((a.len(), b.len()), (3, 3), "from the first to the last");
    }
}

/// The lines of a bead whose arc is struck in other frames than it ends in, by dialect.
fn across() -> Vec<(Program, [&'static str; 2])> {
    let fanuc = |between: &str| {
        let position = |n: u32, x: u32, frames: &str| {
            format!(
                "P[{n}]{{\n GP1:\n {frames}, CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = 0 mm, Z = 0 mm, W = 180 deg, P = 0 deg, R = 0 deg\n}};\n"
            )
        };
        let frames = match between {
            "UFRAME_NUM=2" => "UF : 2, UT : 1",
            _ => "UF : 1, UT : 2",
        };
        let text = format!(
            "/PROG F\n/MN\n1: UFRAME_NUM=1 ;\n2: UTOOL_NUM=1 ;\n3:L P[1] 20mm/sec FINE Arc Start[1] ;\n4: {between} ;\n5:L P[2] 10mm/sec FINE Arc End[1] ;\n/POS\n{}{}/END\n",
            position(1, 0, "UF : 1, UT : 1"),
            position(2, 60, frames)
        );
        read(Dialect::FanucLs, &text, None)
    };
    let abb = |tool: &str, object: &str| {
        let target = |x: u32| format!("[[{x},0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
        module(
            "PERS welddata wd1:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];",
            &format!(
                "MoveL {},v100,fine,tGun\\WObj:=wA;\nArcLStart {},v20,sm1,wd1,fine,tGun\\WObj:=wA;\nArcLEnd {},v10,sm1,wd1,fine,{tool}\\WObj:={object};",
                target(0),
                target(0),
                target(60)
            ),
        )
    };
    let job = "/JOB\n//NAME Y\n//POS\n///NPOS 2,0,0,0,0,0\n///USER 1\n///TOOL 1\n///POSTYPE USER\n///RECTAN\n///RCONF 1,0,0,0,0,0,0,0\nC0=0,0,0,180,0,0\n///USER 2\nC1=60,0,0,180,0,0\n//INST\nNOP\nMOVL C0 V=20.0\nARCON ASF#(1)\nMOVL C1 V=10.0\nARCOF\nEND\n";
    let script = "def p():\n  set_tcp(p[0,0,0.1,0,0,0])\n  movel(pose_trans(Part, p[0,0,0,0,3.14159265,0]),v=0.02)\n  set_job(1)\n  set_analog_out(0, 6)\n  set_digital_out(0, True)\n  set_tcp(p[0,0,0.2,0,0,0])\n  movel(pose_trans(Part, p[0.06,0,0,0,3.14159265,0]),v=0.01)\n  set_digital_out(0, False)\nend\n";
    vec![
        (fanuc("UFRAME_NUM=2"), ["user frame 1 ", "user frame 2 "]),
        (fanuc("UTOOL_NUM=2"), ["tool frame 1 ", "tool frame 2:"]),
        (abb("tGun", "wB"), ["user frame wa ", "user frame wb "]),
        (
            abb("tOther", "wA"),
            ["tool frame tgun ", "tool frame tother:"],
        ),
        (
            read(Dialect::Inform, job, None),
            ["user frame 1 ", "user frame 2 "],
        ),
        (
            read(Dialect::UrScript, script, None),
            ["tool frame 1 ", "tool frame 2:"],
        ),
    ]
}

/// Start and end of such a bead are no two points of one frame.
#[test]
fn a_bead_that_begins_in_other_frames_than_it_ends_is_told() {
    for (program, words) in across() {
        let gaps = run(&program).gaps;
        let told: Vec<String> = gaps.iter().map(|g| g.why.to_string()).collect();
        let across = told.iter().find(|t| t.starts_with("this bead goes from"));
        let across = across.unwrap_or_else(|| panic!("{:?}: {told:?}", program.dialect));
        for words in words {
            assert!(across.contains(words), "{words}: {across}");
        }
    }
}

/// Where both frames are told in numbers the bead is laid between the places as they lie.
#[test]
fn a_bead_between_frames_told_in_numbers_is_laid_so() {
    let data = "PERS wobjdata wA:=[FALSE,TRUE,\"\",[[500,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
PERS wobjdata wB:=[FALSE,TRUE,\"\",[[500,0,100],[1,0,0,0]],[[0,7,0],[1,0,0,0]]];
PERS welddata wd1:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];";
    let target = |x: u32| format!("[[{x},0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let [a, b] = [target(0), target(60)];
    let lines = format!(
        "MoveL {a},v100,fine,tGun\\WObj:=wA;\nArcLStart {a},v20,sm1,wd1,fine,tGun\\WObj:=wA;\nArcLEnd {b},v10,sm1,wd1,fine,tGun\\WObj:=wB;"
    );
    let reading = run(&module(data, &lines));
    assert_eq!(reading.gaps, []);
    let bead = reading
        .toolpath
        .passes()
        .find(|p| p.head.role.deposits())
        .unwrap();
    let along = bead.points[1] - bead.points[0];
    assert!(along.distance(DVec3::new(60.0, 7.0, 0.0)) < 1e-6, "{along}");
}
