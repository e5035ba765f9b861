//! What lines set for moves to come: of a KUKA in programs that call each other and for one move alone; speeds that are not known, and
//! tools that turn no faster than their program says, of others too.

use meltpath_base::Reporter;
use meltpath_programs::{Dialect, Missing, Reading, dialect, read_toolpath};

use crate::dialects::cell;
use crate::silence::script_cell;
use crate::told::{execute, motions, program};

const DATA: &str = "DEFDAT K
DECL FDAT FP1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE}
DECL FDAT FP2={TOOL_NO 2,BASE_NO 3,IPO_FRAME #BASE}
DECL LDAT LUSUAL={VEL 2.0,ACC 100.0,APO_DIST 3.0}
DECL LDAT LSLOW={VEL 2.0,ACC 5.0,APO_DIST 3.0}
DECL stArcDat_T WDAT1={Weld {Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0},Crater {CraterTime 0.0}}
ENDDAT
";

/// A bead with these lines in front of its first move, what its first move says behind its place, and routines that follow.
fn bead(lines: &str, with: &str, routines: &str) -> Reading {
    let source = format!(
        "DEF K( )
BAS(#INITMOV,0)
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$VEL.CP=0.1
LIN {{X 0,Y 0,Z 20,A 0,B 0,C 180}}
ArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP1)
LIN {{X 0,Y 0,Z 0,A 0,B 0,C 180}}
ArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP1)
$VEL.CP=gArcBasVelDefinition
{lines}
SLIN {{X 30,Y 0,Z 0,A 0,B 0,C 180}} {with}
ArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP1)
LIN {{X 60,Y 0,Z 0,A 0,B 0,C 180}}
ArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP1)
END
{routines}"
    );
    read(&source)
}

fn read(source: &str) -> Reading {
    let mut cell = cell(&[100.0]);
    // a schedule whose speed is not that of any bead here
    cell.schedules[0].travel_speed.value = Some(meltpath_base::Speed(12.5));
    let data = Some(DATA.as_bytes());
    let parsed = dialect::read(Dialect::Krl, source.as_bytes(), data, &cell).unwrap();
    let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
    read_toolpath(&programs, &cell.execution(10.0), 1e3, &Reporter::new()).unwrap()
}

/// Speeds of what is laid, mm/s.
fn speeds(reading: &Reading) -> Vec<f64> {
    let moves = motions(reading).into_iter().filter(|m| m.burns);
    moves.map(|m| m.speed.unwrap()).collect()
}

fn whys(reading: &Reading) -> Vec<&Missing> {
    reading.gaps.iter().map(|g| &g.why).collect()
}

#[test]
fn what_a_called_kuka_program_sets_holds_for_its_caller() {
    for (lines, routine, wanted) in [
        ("$VEL.CP=0.0125\nSUB()", "$VEL.CP=0.025", 25.0),
        ("$VEL.CP=0.025\nSUB()", "$VEL.CP=0.0125", 12.5),
        ("SUB()", "BAS(#CP_PARAMS,0.025)", 25.0),
        ("SUB()", "$VEL.CP=0.025", 25.0),
        ("$VEL.CP=0.025\nSUB()", "WAIT SEC 0", 25.0),
        ("SUB()", "DEEPER()\nEND\nDEF DEEPER()\n$VEL.CP=0.02", 20.0),
        // what stands behind a return is not run
        ("SUB()", "RETURN\n$VEL.CP=0.025", 10.0),
    ] {
        let reading = bead(lines, "", &format!("DEF SUB()\n{routine}\nEND\n"));
        assert_eq!(speeds(&reading), [wanted; 2], "{lines} {routine}");
        assert_eq!(whys(&reading), [] as [&Missing; 0], "{lines} {routine}");
    }
    let slow = bead("SUB()", "", "DEF SUB()\n$ACC.CP=0.001\nEND\n");
    assert!(matches!(
        whys(&slow)[..],
        [Missing::Acceleration(_), Missing::Acceleration(_)]
    ));
    let aggregate = bead("$ACC={CP 0.001,ORI1 100}", "", "");
    assert_eq!(whys(&aggregate).len(), 2);
    let usual = bead("$ACC.CP=0.001\nSUB()", "", "DEF SUB()\n$ACC.CP=2.3\nEND\n");
    assert_eq!(whys(&usual), [] as [&Missing; 0]);
}

/// A routine lays by what its caller has set: speed, weld data, distance of rounded corners.
#[test]
fn a_called_kuka_program_goes_on_with_what_its_caller_set() {
    let source = |set: &str| {
        format!(
            "DEF K( )
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$VEL.CP=0.1
LIN {{X 0,Y 0,Z 20,A 0,B 0,C 180}}
ArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP1)
LIN {{X 0,Y 0,Z 0,A 0,B 0,C 180}}
{set}
LAY()
END
DEF LAY()
LIN {{X 30,Y 0,Z 0,A 0,B 0,C 180}} C_DIS
ArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP1)
LIN {{X 30,Y 30,Z 0,A 0,B 0,C 180}}
END
"
        )
    };
    let reading = read(&source("$VEL.CP=0.025\n$APO.CDIS=2"));
    assert_eq!(speeds(&reading), [25.0; 2]);
    assert_eq!(whys(&reading), [] as [&Missing; 0]);
    let reading = read(&source("$VEL.CP=gArcBasVelDefinition\n$APO.CDIS=2"));
    assert_eq!(speeds(&reading), [10.0; 2]);
    let reading = read(&source("$VEL.CP=0.025"));
    let word = Missing::Termination("C_DIS".to_owned());
    assert_eq!(whys(&reading), [&word]);
}

#[test]
fn what_a_kuka_move_says_of_itself_holds_for_it_alone() {
    let frames = |reading: &Reading| -> Vec<(u32, u32)> {
        let moves = motions(reading).into_iter().filter(|m| m.burns);
        moves.map(|m| m.control.frames).collect()
    };
    for (with, first) in [
        ("WITH $VEL=SVEL_CP(0.02, , LUSUAL)", 20.0),
        ("WITH $VEL.CP=0.02, $ORI_TYPE=#CONSTANT", 20.0),
        ("with $VEL={CP 0.02}, $ACC=SACC_CP(LUSUAL)", 20.0),
        (
            "WITH $VEL = SVEL_CP(0.02, , LUSUAL), $TOOL = STOOL2(FP1), $BASE = SBASE(FP1.BASE_NO), $IPO_MODE = SIPO_MODE(FP1.IPO_FRAME), $LOAD = SLOAD(FP1.TOOL_NO), $ACC = SACC_CP(LUSUAL), $ORI_TYPE = SORI_TYP(LUSUAL), $APO = SAPO(LUSUAL), $JERK = SJERK(LUSUAL), $COLLMON_TOL_PRO[1] = USE_CM_PRO_VALUES(0)",
            20.0,
        ),
        ("WITH $VEL=SVEL_CP(gArcBasVelDefinition, , LUSUAL)", 10.0),
    ] {
        let reading = bead("", with, "");
        assert_eq!(speeds(&reading), [first, 10.0], "{with}");
        assert_eq!(frames(&reading), [(1, 1); 2], "{with}");
        assert_eq!(whys(&reading), [] as [&Missing; 0], "{with}");
    }
    let slow = "acceleration of 0.001";
    for (with, told) in [
        ("WITH $ACC.CP=0.001, $VEL.CP=0.01", slow),
        ("WITH $ACC={CP 0.001}", slow),
        ("WITH $ACC=SACC_CP(LSLOW)", "ACC 5 of LSLOW"),
        ("WITH $ACC=SACC_CP(LNOWHERE)", "ACC of LNOWHERE"),
        ("WITH $VEL=SVEL_CP(VSLOW, , LUSUAL)", "VSLOW"),
        ("WITH $VEL=SVEL_CP(0.02, 5, LUSUAL)", "$VEL=SVEL_CP"),
        ("WITH $VEL.ORI1=5", "$VEL.ORI1=5"),
        ("WITH $APO.CDIS=2 C_SPL", "C_SPL"),
        ("WITH $BASE=SBASE(FP9.BASE_NO)", "not an instruction"),
    ] {
        let reading = bead("", with, "");
        let whys: Vec<String> = whys(&reading).iter().map(ToString::to_string).collect();
        assert!(
            whys.len() == 1 && whys[0].contains(told),
            "{with}: {whys:?}"
        );
    }
    for (with, own) in [
        ("WITH $BASE=SBASE(FP2.BASE_NO)", (3, 1)),
        ("WITH $BASE=BASE_DATA[3]", (3, 1)),
        ("WITH $TOOL=STOOL2(FP2)", (1, 2)),
    ] {
        let reading = bead("", with, "");
        assert_eq!(frames(&reading), [own, (1, 1)], "{with}");
        assert!(!whys(&reading).is_empty(), "{with}");
    }
    // bases that programs write out have one number in both, and a base of the robot's own is known as one
    let parsed = |source: &str| {
        let parsed = dialect::read(Dialect::Krl, source.as_bytes(), None, &cell(&[100.0]));
        parsed.unwrap().remove(0).program
    };
    let frames = "$TOOL=TOOL_DATA[1]\n$BASE={X 1,Y 0,Z 0,A 0,B 0,C 0}\n";
    let own = "$TOOL=TOOL_DATA[1]\nSLIN {X 0,Y 0,Z 0,A 0,B 0,C 180} WITH $BASE={X 2,Y 0,Z 0,A 0,B 0,C 0}, $VEL.CP=0.1\nSLIN {X 9,Y 0,Z 0,A 0,B 0,C 180} WITH $BASE={X 2,Y 0,Z 0,A 0,B 0,C 0}, $VEL.CP=0.1\n";
    let mut both = [
        parsed(&format!("DEF K()\n{frames}SUB()\nEND\n")),
        parsed(&format!("DEF SUB()\n{own}END\n")),
    ];
    let number = |program: &meltpath_programs::Program, x: f64| {
        let all = &program.said_frames.user;
        let at = all.iter().find(|(_, pose)| pose.position.x == x);
        at.map(|(n, _)| *n).unwrap()
    };
    meltpath_programs::shared_frames::agree(&mut both);
    assert_ne!(number(&both[1], 1.0), number(&both[1], 2.0));
    let settings = cell(&[100.0]).execution(10.0);
    let reading = read_toolpath(&both, &settings, 1e3, &Reporter::new()).unwrap();
    let moved = motions(&reading)[0].control.frames;
    assert_eq!(moved, (number(&both[1], 2.0), 1));
    let world = parsed(
        "DEF K()\n$TOOL=TOOL_DATA[1]\nSLIN {X 0,Y 0,Z 0,A 0,B 0,C 180} WITH $BASE=$WORLD\nEND\n",
    );
    assert_eq!(
        meltpath_programs::shared_frames::own_frames(&world).len(),
        1
    );
    // a base that is written out
    let shifted = bead("", "WITH $BASE={X 0,Y 0,Z 5,A 0,B 0,C 0}", "");
    assert!(matches!(
        whys(&shifted)[0],
        Missing::Frames(..) | Missing::Across(..)
    ));
}

/// The speed of a schedule stands in for none that a line says.
#[test]
fn a_speed_that_is_not_known_is_no_schedules() {
    for (value, known) in [
        ("2.5E-2", Some(25.0)),
        ("0.01+0.01", Some(20.0)),
        ("2*0.01", Some(20.0)),
        ("WDAT1.Weld.Velocity", Some(10.0)),
        // whole numbers divide to whole ones
        ("1/80", None),
        ("WDAT1.Weld.Velocity*2", None),
        ("gArcBasVelDefinition*2", None),
        ("VSLOW", None),
    ] {
        for line in [format!("$VEL.CP={value}"), format!("BAS(#VEL_CP,{value})")] {
            let reading = bead(&line, "", "");
            if let Some(speed) = known {
                assert_eq!(speeds(&reading), [speed; 2], "{line}");
                assert_eq!(whys(&reading), [] as [&Missing; 0], "{line}");
            } else {
                let why = Missing::Speed(value.to_owned());
                assert_eq!(whys(&reading), [&why, &why], "{line}");
            }
        }
    }
    // the controller's own, and none at all
    let defaults = bead("BAS(#INITMOV,0)", "", "");
    let why = Missing::Speed("set by BAS(#INITMOV,0)".to_owned());
    assert_eq!(whys(&defaults), [&why, &why]);
    let text = "MODULE M\nPERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC main()\nMoveL [[0,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;\nArcLStart [[0,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,sm1,[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]],fine,t;\nMoveL [[30,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vSlow,fine,t;\nENDPROC\nENDMODULE\n";
    let cell = cell(&[100.0]);
    let parsed = dialect::read(Dialect::Rapid, text.as_bytes(), None, &cell);
    let programs: Vec<_> = parsed.unwrap().into_iter().map(|p| p.program).collect();
    let reading = read_toolpath(&programs, &cell.execution(10.0), 1e3, &Reporter::new()).unwrap();
    let told = reading
        .gaps
        .iter()
        .filter(|g| g.why == Missing::Speed("vSlow".to_owned()));
    assert_eq!(told.count(), 1, "{:?}", reading.gaps);
}

/// What runs whenever something comes true may lay metal, but for the controller's own stop.
#[test]
fn interrupts_of_a_kuka_run_programs() {
    let call = Missing::Call("OWN".to_owned());
    let declared = "INTERRUPT DECL 4 WHEN $IN[3]==TRUE DO OWN( )";
    for (lines, routines, told) in [
        (declared, "", vec![&call]),
        (
            "GLOBAL INTERRUPT DECL 4 WHEN $IN[3] DO OWN(1)\nINTERRUPT ON 4",
            "",
            vec![&call],
        ),
        (
            "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\nINTERRUPT ON 3",
            "",
            vec![],
        ),
        ("INTERRUPT OFF 4\ninterrupt disable 4", "", vec![]),
        (
            declared,
            "DEF OWN( )\nEND\n",
            vec![&Missing::OnTheWay(declared.to_owned())],
        ),
    ] {
        assert_eq!(whys(&bead(lines, "", routines)), told, "{lines} {routines}");
    }
    let unread = bead("INTERRUPT DECL 4 WHEN $IN[3]==TRUE", "", "");
    assert_eq!(whys(&unread).len(), 1);
}

/// 40° along 60 mm at 1 °/s take 40 s, and 30° along 50 mm at 2 °/s take 15 s.
#[test]
fn a_bead_goes_as_slowly_as_its_tool_may_turn() {
    let place = |x: f64, half: f64| {
        let (sin, cos) = f64::to_radians(half).sin_cos();
        format!("[[{x},0,0],[0,{cos},{sin},0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    };
    let cell = cell(&[100.0, 120.0]);
    let abb = |speed: &str, end: f64| {
        let text = format!(
            "MODULE M\nPERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nCONST speeddata vTurn:=[12.5,1,500,500];\nPERS welddata w:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nPROC main()\nMoveL {0},v100,fine,t;\nArcLStart {0},v100,sm1,w,fine,t;\nArcLEnd {1},{speed},sm1,w,fine,t;\nENDPROC\nENDMODULE\n",
            place(0.0, 0.0),
            place(end, 20.0)
        );
        let parsed = dialect::read(Dialect::Rapid, text.as_bytes(), None, &cell).unwrap();
        let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
        read_toolpath(&programs, &cell.execution(10.0), 1e3, &Reporter::new()).unwrap()
    };
    for (speed, wanted) in [
        ("vTurn", 1.5),
        ("[100,2,500,500]", 3.0),
        ("v100", 10.0),
        ("[100,90,500,500]", 10.0),
    ] {
        let laid = speeds(&abb(speed, 60.0));
        assert!(
            (laid[0] - wanted).abs() < 1e-3 && laid.len() == 1,
            "{speed}: {laid:?}"
        );
    }
    // in place it burns for a time that no toolpath tells
    let told = |speed: &str| whys(&abb(speed, 0.0)).contains(&&Missing::WaitWithArc);
    assert!(told("vTurn") && !told("v100"));
    let dtx = include_str!("../data/bead.dtx");
    let pgx = include_str!("../data/bead.pgx");
    for (limit, wanted) in [("360", 8.0), ("2", 10.0 / 3.0), ("9999", 8.0)] {
        let data = dtx.replacen(
            "tmax=\"8\" rmax=\"360\"",
            &format!("tmax=\"8\" rmax=\"{limit}\""),
            1,
        );
        let data = data.replace("x=\"60\" rx=\"180\"", "x=\"60\" rx=\"150\"");
        let data = Some(data.as_bytes());
        let parsed = dialect::read(Dialect::Val3, pgx.as_bytes(), data, &cell).unwrap();
        let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
        let reading =
            read_toolpath(&programs, &cell.execution(10.0), 1e3, &Reporter::new()).unwrap();
        let laid = speeds(&reading);
        assert!((laid[0] - wanted).abs() < 1e-3, "{limit}: {laid:?}");
    }
}

/// Joints of a straight move, and a global variable beside lines of the arc, which set none.
#[test]
fn scripts_move_straight_to_joints_by_speeds_of_global_variables() {
    let cell = script_cell();
    let text = "def w():
  global vw = 0.0125
  movel(p[0, 0, 0, 0, 3.14159265, 0], 1.2, 0.1)
  set_job(1)
  set_digital_out(0, True)
  movel(p[0.1, 0, 0, 0, 3.14159265, 0], 1.2, vw)
  set_digital_out(0, False)
  movel([0, -1.5, 1.5, -1.5, -1.5, 0], 1.2, 0.1)
end
";
    let parsed = dialect::read(Dialect::UrScript, text.as_bytes(), None, &cell).unwrap();
    let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
    let reading = read_toolpath(&programs, &cell.execution(10.0), 1e3, &Reporter::new()).unwrap();
    assert_eq!(speeds(&reading), [12.5]);
    // where joints lead to without an arm is the one thing that is not known
    let whys: Vec<String> = whys(&reading).iter().map(ToString::to_string).collect();
    assert!(
        matches!(&whys[..], [why] if why.contains("given by joints, and no robot")),
        "{whys:?}"
    );
}

#[test]
fn a_variable_that_is_set_to_an_argument_is_told_so() {
    let reading = bead(
        "SUB(5)",
        "",
        "DEF SUB(ZZ:IN)\nDECL REAL ZZ\nXP1.Z=ZZ+20\nEND\n",
    );
    assert_eq!(whys(&reading), [&Missing::Value("XP1.Z=ZZ+20".to_owned())]);
}

/// A RAPID routine that goes up by a variable of its module, with these lines first; where its beads end.
fn climbed(lines: &str) -> Vec<f64> {
    let at = |x: f64, z: &str| {
        format!("Offs([[{x},0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,{z})")
    };
    let text = format!(
        "MODULE M\nPERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPERS welddata w:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nVAR num h:=0;\nVAR bool late:=FALSE;\nPROC main()\nh:=2;\n{lines}\nMoveL {0},v100,fine,t;\nArcLStart {1},v100,sm1,w,fine,t;\nArcLEnd {2},v100,sm1,w,fine,t;\nENDPROC\nENDMODULE\n",
        at(0.0, "h+20"),
        at(0.0, "h"),
        at(30.0, "h"),
    );
    let parsed = dialect::read(Dialect::Rapid, text.as_bytes(), None, &cell(&[100.0])).unwrap();
    let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
    let settings = cell(&[100.0]).execution(10.0);
    let reading = read_toolpath(&programs, &settings, 1e3, &Reporter::new());
    let moves = reading.map(|r| motions(&r)).unwrap_or_default();
    let burns = moves.iter().filter(|m| m.burns);
    burns.map(|m| m.to.z).collect()
}

#[test]
fn instructions_of_rapid_that_set_nothing_leave_variables_as_they_are() {
    for line in [
        "ClkReset clk1;",
        "GripLoad load0;",
        "WaitDI di1,1;",
        "PDispOff;",
        "TPShow 1;",
    ] {
        assert_eq!(climbed(line), [2.0], "{line}");
    }
    // what may set one does not
    for line in ["WaitDI di1,1\\MaxTime:=5\\TimeFlag:=late;", "Other;"] {
        assert_eq!(climbed(line), [] as [f64; 0], "{line}");
    }
}

#[test]
fn values_that_burn_are_set_again_without_another_start() {
    let go = "L P[1] 100mm/sec FINE";
    let laid = |lines: &[&str]| {
        let executed = execute(&[program("TWICE", lines)]).unwrap();
        let moves = motions(&executed);
        moves.iter().filter(|m| m.burns).count()
    };
    let lines = [
        go,
        "Arc Start[1]",
        "L P[2] 12mm/sec FINE Arc Start[1]",
        "Arc End[1]",
    ];
    assert_eq!(laid(&lines), 1);
}
