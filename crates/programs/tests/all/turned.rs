//! How tools are turned along moves that do not lead them evenly to what is taught: KUKA's `$ORI_TYPE`, FANUC's `Wjnt`, ABB's `SingArea`, the
//! `mode` of a script. And frames that lie in others.

use std::fmt::Write as _;

use meltpath_base::Reporter;
use meltpath_programs::{
    Dialect, Missing, NoPose, Open, ParseError, Program, Reading, dialect, read_toolpath,
};

use crate::dialects::cell;
use crate::silence::script_cell;
use crate::told::{Told, execute, motions, parsed, program};

fn programs(dialect: Dialect, text: &str, data: Option<&str>) -> Vec<Program> {
    let cell = match dialect {
        Dialect::UrScript => script_cell(),
        _ => cell(&[100.0, 50.0]),
    };
    let data = data.map(str::as_bytes);
    let parsed = dialect::read(dialect, text.as_bytes(), data, &cell).unwrap();
    parsed.into_iter().map(|p| p.program).collect()
}

fn read(dialect: Dialect, text: &str, data: Option<&str>) -> Reading {
    let settings = cell(&[100.0, 50.0]).execution(10.0);
    let programs = programs(dialect, text, data);
    read_toolpath(&programs, &settings, 1e3, &Reporter::new()).unwrap()
}

/// Those of the gaps and of the travels that are about how tools are turned.
fn turned(reading: &Reading) -> Vec<&Missing> {
    let all = reading.gaps.iter().chain(&reading.left_out);
    let about = |why: &&Missing| matches!(why, Missing::Turns(_) | Missing::Turned(_));
    all.map(|gap| &gap.why).filter(about).collect()
}

/// How far the torch leans at the ends of beads, deg.
fn leans(reading: &Reading) -> Vec<f64> {
    let lean = |m: &Told| m.axis.z.abs().clamp(0.0, 1.0).acos().to_degrees();
    let beads = motions(reading).into_iter().filter(|m| m.burns);
    beads.map(|m| lean(&m).round()).collect()
}

/// Two beads of a KUKA behind a start that leans by 20°.
fn kuka(lines: &str, with: &str, taught: f64) -> Reading {
    let data = "DEFDAT K
DECL LDAT LKEEPS={VEL 2.0,ACC 100.0,APO_DIST 3.0,ORI_TYP #CONSTANT}
DECL LDAT LPLAIN={VEL 2.0,ACC 100.0,APO_DIST 3.0}
DECL stArcDat_T WDAT1={Weld {Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0},Crater {CraterTime 0.0}}
ENDDAT
";
    let text = format!(
        "DEF K( )
BAS(#INITMOV,0)
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$VEL.CP=0.1
{lines}
PTP {{X 0,Y 0,Z 20,A 0,B 20,C 180}}
ArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP1)
LIN {{X 0,Y 0,Z 0,A 0,B {taught},C 180}} {with}
ArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP1)
$VEL.CP=gArcBasVelDefinition
LIN {{X 30,Y 0,Z 0,A 0,B {taught},C 180}} {with}
ArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP1)
CIRC {{X 40,Y 10,Z 0,A 0,B {taught},C 180}},{{X 50,Y 0,Z 0,A 0,B {taught},C 180}}
ArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP1)
END
"
    );
    read(Dialect::Krl, &text, Some(data))
}

#[test]
fn a_kuka_keeps_the_tool_as_it_stands_at_the_begin() {
    for (lines, with, wanted) in [
        ("", "", [0.0, 0.0]),
        ("$ORI_TYPE=#VAR", "", [0.0, 0.0]),
        ("$ORI_TYPE=#CONSTANT", "", [20.0, 20.0]),
        ("$ORI_TYPE = #CONSTANT\n$ORI_TYPE=#VAR", "", [0.0, 0.0]),
        ("LDAT_ACT=LKEEPS", "", [20.0, 20.0]),
        ("LDAT_ACT=LKEEPS\nLDAT_ACT=LPLAIN", "", [0.0, 0.0]),
        ("", "WITH $ORI_TYPE=#CONSTANT", [20.0, 0.0]),
        ("", "WITH $ORI_TYPE=SORI_TYP(LKEEPS)", [20.0, 0.0]),
        (
            "$ORI_TYPE=#CONSTANT",
            "WITH $ORI_TYPE=SORI_TYP(LPLAIN)",
            [0.0, 0.0],
        ),
    ] {
        let reading = kuka(lines, with, 0.0);
        assert_eq!(leans(&reading), wanted, "{lines} {with}");
        assert_eq!(turned(&reading), [] as [&Missing; 0], "{lines} {with}");
    }
}

#[test]
fn what_leads_the_wrist_is_told_where_ends_are_turned_otherwise() {
    let by_joints = Missing::Turns("$ORI_TYPE".to_owned());
    for lines in [
        "$ORI_TYPE=#JOINT",
        "$ORI_TYPE=OWN",
        "$ORI_TYPE=#CONSTANT\nBAS(#INITMOV,0)",
    ] {
        assert_eq!(turned(&kuka(lines, "", 0.0)), [&by_joints], "{lines}");
        assert_eq!(
            turned(&kuka(lines, "", 20.0)),
            [] as [&Missing; 0],
            "{lines}"
        );
    }
    assert_eq!(by_joints.open(), Open::Moves);
    let along = Missing::Turned("$CIRC_TYPE".to_owned());
    assert_eq!(turned(&kuka("$CIRC_TYPE=#PATH", "", 20.0)), [&along]);
    assert_eq!(along.open(), Open::Places);

    let lines = |word: &str, to: u32| {
        let bead = format!("L P[2] 10mm/sec FINE Arc Start[1] {word}");
        let ends = format!("L P[{to}] 10mm/sec FINE Arc End[1] {word}");
        let lines = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "L P[1] 50mm/sec FINE",
            &bead,
            &ends,
        ];
        let mut program = program("P", &lines);
        let leaning = program.positions[2].groups.first_mut().unwrap();
        if let meltpath_programs::program::Coordinates::Cartesian { wpr_degrees, .. } =
            &mut leaning.coordinates
        {
            wpr_degrees[0] = 160.0;
        }
        execute(&[program]).unwrap()
    };
    let wrist = Missing::Turns("Wjnt".to_owned());
    assert_eq!(turned(&lines("Wjnt", 3)), [&wrist]);
    assert_eq!(turned(&lines("Wjnt", 1)), [] as [&Missing; 0]);
    assert_eq!(turned(&lines("", 3)), [] as [&Missing; 0]);
}

/// A bead of an ABB whose torch turns by 90° about the wire, behind these lines.
fn abb(lines: &str) -> (Reading, Vec<Program>) {
    let target = |x: u32, q: &str| format!("[[{x},0,0],[{q}],[0,0,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let (from, to) = (target(0, "0,0,1,0"), target(60, "0,0.7071068,0.7071068,0"));
    let text = format!(
        "MODULE m\nPERS seamdata sm1:=[0,0,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0];\nPERS welddata wd1:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nPROC main()\n{lines}MoveJ {from},v100,fine,tTorch\\WObj:=wPart;\nArcLStart {from},v20,sm1,wd1,fine,tTorch\\WObj:=wPart;\nArcLEnd {to},v10,sm1,wd1,fine,tTorch\\WObj:=wPart;\nENDPROC\nENDMODULE\n"
    );
    (
        read(Dialect::Rapid, &text, None),
        programs(Dialect::Rapid, &text, None),
    )
}

#[test]
fn an_abb_near_singularities_and_with_free_configurations() {
    let wrist = Missing::Turns("SingArea".to_owned());
    assert_eq!(turned(&abb("SingArea\\Wrist;\n").0), [&wrist]);
    for lines in [
        "",
        "SingArea\\Off;\n",
        "SingArea\\Wrist;\nSingArea \\Off;\n",
    ] {
        assert_eq!(turned(&abb(lines).0), [] as [&Missing; 0], "{lines}");
        assert!(abb(lines).0.gaps.is_empty(), "{:?}", abb(lines).0.gaps);
    }
    let locked = abb("SingArea\\LockAxis4;\n").0;
    assert!(matches!(&locked.gaps[0].why, Missing::Setting(text) if text.contains("LockAxis4")));

    // joint moves and paths by a switch each
    let bound = |lines: &str| -> Vec<bool> {
        let (_, programs) = abb(lines);
        let all = programs[0].positions.iter().flat_map(|p| &p.groups);
        all.map(|g| format!("{:?}", g.coordinates).contains("config: \"0"))
            .collect()
    };
    assert_eq!(bound(""), [true; 3]);
    assert_eq!(bound("ConfJ\\Off;\nConfL\\On;\n"), [false, true, true]);
    assert_eq!(bound("ConfJ\\On;\nConfL\\Off;\n"), [true, false, false]);
}

#[test]
fn what_a_script_says_of_a_move_and_is_not_read_is_told() {
    let told = |line: &str| {
        let text = format!(
            "def w():
  movel(p[0, 0, 0, 0, 3.14159265, 0], 1.2, 0.1)
  set_job(1)
  set_digital_out(0, True)
  {line}
  set_digital_out(0, False)
end
"
        );
        let reading = read(Dialect::UrScript, &text, None);
        let whys = reading.gaps.iter().map(|gap| gap.why.clone());
        whys.filter(|why| matches!(why, Missing::Word(_) | Missing::Turned(_)))
            .collect::<Vec<_>>()
    };
    let (via, to) = (
        "p[0.05, 0.05, 0, 0, 3.14159265, 0]",
        "p[0.1, 0, 0, 0, 3.14159265, 0]",
    );
    let along = |said: &str| Missing::Turned(said.to_owned());
    let word = |said: &str| Missing::Word(said.to_owned());
    for (line, wanted) in [
        (format!("movec({via}, {to}, 1.2, 0.0125)"), vec![]),
        (format!("movec({via}, {to}, 1.2, 0.0125, 0, 0)"), vec![]),
        (format!("movec({via}, {to}, v=0.0125, mode=0)"), vec![]),
        (
            format!("movec({via}, {to}, v=0.0125, mode=1)"),
            vec![along("mode=1")],
        ),
        (
            format!("movec({via}, {to}, 1.2, 0.0125, 0, 1)"),
            vec![along("mode=1")],
        ),
        (
            format!("movec({via}, {to}, v=0.0125, foo=9)"),
            vec![word("foo=9")],
        ),
        (
            format!("movel({to}, v=0.0125, speed=0.002)"),
            vec![word("speed=0.002")],
        ),
    ] {
        assert_eq!(told(&line), wanted, "{line}");
    }
}

#[test]
fn data_of_a_val3_project_that_do_not_place_a_frame_are_told() {
    let dtx = include_str!("../data/bead.dtx").replace(
        "<Datas>",
        "<Datas>\n<Data name=\"tGun\" type=\"tool\" size=\"1\">\n<Value key=\"0\" z=\"100\" fatherId=\"flange[0]\" />\n</Data>",
    );
    let pgx = include_str!("../data/bead.pgx");
    let unread = |dtx: &str| {
        let programs = programs(Dialect::Val3, pgx, Some(dtx));
        let all = programs[0].said_frames.unread.iter();
        all.map(|(_, told)| told.clone()).collect::<Vec<_>>()
    };
    assert_eq!(unread(&dtx), [""; 0]);
    for (was, is, wanted) in [
        ("world[0]", "wRobot[0]", "no frame wRobot[0]"),
        ("world[0]", "fTable[0]", "it lies in itself"),
        ("flange[0]", "tBase", "no tool tBase"),
        (
            "fatherId=\"fTable[0]\"",
            "fatherId=\"fTable[1]\"",
            "no frame fTable[1]",
        ),
    ] {
        let told = unread(&dtx.replace(was, is));
        assert!(told.len() == 1 && told[0].contains(wanted), "{told:?}");
    }
    // one that lies beyond the size of its array is none
    let beyond = dtx.replace("type=\"frame\" size=\"1\"", "type=\"frame\" size=\"0\"");
    assert_eq!(unread(&beyond).len(), 1);
    let cell = cell(&[100.0]);
    for (was, is, name) in [
        ("name=\"jHome\"", "name=\"fTable\"", "fTable"),
        ("key=\"1\" tmax", "key=\"0\" tmax", "mLay[0]"),
    ] {
        let twice = dtx.replace(was, is);
        let read = dialect::read(Dialect::Val3, pgx.as_bytes(), Some(twice.as_bytes()), &cell);
        assert_eq!(read.unwrap_err(), ParseError::Repeated(name.to_owned()));
    }
}

#[test]
fn frames_of_a_kuka_lie_in_others() {
    let base = |lines: &str| {
        let text = format!(
            "DEF K( )\n{lines}\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.1\nLIN {{X 0,Y 0,Z 20,A 0,B 0,C 180}}\nLIN {{X 9,Y 0,Z 20,A 0,B 0,C 180}}\nEND\n"
        );
        let programs = programs(Dialect::Krl, &text, None);
        let said = &programs[0].said_frames;
        let at = said.user.values().next_back().map(|pose| pose.position);
        (
            at.map(|at| at.to_array().map(f64::round)),
            said.unread.clone(),
        )
    };
    let shift = "{X 10,Y 0,Z 0,A 0,B 0,C 0}";
    // turned by a quarter: what lies along x of the inner one lies along y outside
    let known = format!("BASE_DATA[1]={{X 700,Y 0,Z 0,A 90,B 0,C 0}}\n$BASE=BASE_DATA[1]:{shift}");
    assert_eq!(base(&known), (Some([700.0, 10.0, 0.0]), vec![]));
    // in one of the controller's own it is known where moves lie, in one that nothing tells it is not
    assert_eq!(base(&format!("$BASE=BASE_DATA[1]:{shift}")).1, []);
    let (_, unread) = base(&format!("$BASE=TABLE7:{shift}"));
    assert_eq!(unread, [(2, format!("TABLE7:{shift}"))]);
}

#[test]
fn a_position_without_its_config_and_a_joint_move_that_burns_are_told() {
    let lines = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "L P[1] 50mm/sec FINE",
        "L P[2] 50mm/sec FINE Arc Start[1]",
        "J P[3] 10% FINE Arc End[1]",
        "L P[1] 50mm/sec FINE Arc Start[1]",
        "L P[2] 10mm/sec FINE Arc End[1]",
    ];
    let whole = program("P", &lines);
    let whys = |program: Program| {
        let reading = execute(&[program]).unwrap();
        let all = reading.gaps.into_iter().map(|gap| (gap.line, gap.why));
        all.collect::<Vec<_>>()
    };
    let joint = (5, Missing::JointBead);
    assert!(whys(whole).contains(&joint));
    let mut text = "/PROG P\n/MN\n".to_owned();
    for line in lines {
        writeln!(text, "1:{line} ;").unwrap();
    }
    text += "/POS\n";
    for (i, config) in [
        (1, "CONFIG : 'N U T, 0, 0, 0',"),
        (2, ""),
        (3, "CONFIG : 'N U T, 0, 0, 0',"),
    ] {
        write!(text, "P[{i}]{{\n GP1:\n UF : 1, UT : 1, {config}\n X = {i} mm, Y = 0 mm, Z = 0 mm, W = 180 deg, P = 0 deg, R = 0 deg\n}};\n").unwrap();
    }
    let without = parsed(&(text + "/END\n")).program;
    let missing = Missing::JointPosition("P[2]".to_owned(), NoPose::NoConfig);
    assert!(whys(without).iter().any(|(_, why)| *why == missing));
}
