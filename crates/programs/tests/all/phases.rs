//! What other programs say of the begin and the end of beads beside their moves, and of axes along them: laid, or told.

use meltpath_base::Reporter;
use meltpath_programs::{CellProgramming, Dialect, Missing, Reading, dialect, read_toolpath};
use meltpath_toolpath::{Channel, Move};

use crate::dialects::cell;

/// What a program comes to, and whether a note tells that its crater is not known.
fn run(
    (dialect, text, data): (Dialect, &str, Option<&str>),
    cell: &CellProgramming,
) -> (Reading, bool) {
    let parsed = dialect::read(dialect, text.as_bytes(), data.map(str::as_bytes), cell).unwrap();
    let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
    let reporter = Reporter::new();
    let reading = read_toolpath(&programs, &cell.execution(10.0), 1000.0, &reporter).unwrap();
    let told = reporter.warnings();
    let note = told.iter().any(|w| w.code == "crater-not-told");
    (reading, note)
}

/// Times, s, and feeds, m/min, with which the torch stands while the arc is on.
fn stands(reading: &Reading) -> Vec<(f64, f64)> {
    let laid = reading
        .toolpath
        .passes()
        .filter(|p| p.head.role.deposits())
        .flat_map(|p| {
            (0..p.move_count())
                .filter_map(|i| match p.move_at(i) {
                    Move::Spot { time } => {
                        let feed = p.value(Channel::WireFeed, i).unwrap_or(0.0);
                        Some((time, (feed * 6.0).round() / 100.0))
                    }
                    _ => None,
                })
                .collect::<Vec<_>>()
        });
    laid.collect()
}

fn whys(reading: &Reading) -> Vec<String> {
    reading.gaps.iter().map(|g| g.why.to_string()).collect()
}

/// A KUKA bead that is struck with weld data 1 and ends by 3.
fn kuka(weld: &str, end: &str) -> (Reading, bool) {
    let source = "DEF K( )
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$VEL.CP=0.1
LIN {X 0,Y 0,Z 20,A 0,B 0,C 180}
ArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP2)
LIN {X 0,Y 0,Z 0,A 0,B 0,C 180}
ArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP2)
$VEL.CP=gArcBasVelDefinition
ArcMainNG(#ArcOffBeforeMoveStd,WDAT3,WP2)
LIN {X 60,Y 0,Z 0,A 0,B 0,C 180}
ArcMainNG(#ArcOffAfterMoveStd,WDAT3,WP2)
END
";
    let data = format!(
        "DEFDAT K\nDECL stArcDat_T WDAT1={{Weld {{Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0}}{weld}}}\n{end}ENDDAT\n"
    );
    run((Dialect::Krl, source, Some(&data)), &cell(&[100.0, 50.0]))
}

/// Beads in another mode of the source than the cell's are other beads.
#[test]
fn another_mode_of_the_source_is_told() {
    let mut cell = cell(&[100.0, 50.0]);
    let own = cell.krl.as_ref().unwrap().job_mode.value.clone();
    for (mode, told) in [(own.as_str(), 0), ("PULSE", 1)] {
        let text = format!(",Strike {{JobModeId[] \"{mode}\",StartTime 0.0}}");
        let source = "DEF K( )\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.1\nLIN {X 0,Y 0,Z 20,A 0,B 0,C 180}\nArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP2)\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 180}\nArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP2)\n$VEL.CP=gArcBasVelDefinition\nArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP2)\nLIN {X 60,Y 0,Z 0,A 0,B 0,C 180}\nArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP2)\nEND\n";
        let data = format!(
            "DEFDAT K\nDECL stArcDat_T WDAT1={{Weld {{Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0}}{text},Crater {{CraterTime 0.0}}}}\nENDDAT\n"
        );
        let (reading, _) = run((Dialect::Krl, source, Some(&data)), &cell);
        let modes = reading
            .gaps
            .iter()
            .filter(|g| matches!(&g.why, Missing::Mode(m) if m == mode));
        assert_eq!(modes.count(), told, "{mode}: {:?}", whys(&reading));
    }
    // a cell that says nothing of ArcTech has no mode to hold it to
    cell.krl.value = None;
    let (reading, _) = kuka(",Strike {JobModeId[] \"PULSE\",StartTime 0.0}", "");
    assert!(whys(&reading).iter().any(|why| why.contains("PULSE")));
}

/// The crater is that of the data by which the arc ends, not of those that it was struck with.
#[test]
fn a_kuka_crater_is_that_of_the_end() {
    let crater = |time: &str, channels: &str| {
        format!(",Crater {{CraterTime {time},Channel1 {channels},Channel3 0.0}}")
    };
    let ends = |crater: &str| {
        let inner = crater.trim_start_matches(',');
        format!("DECL stArcDat_T WDAT3={{{inner}}}\n")
    };
    for (weld, end, wanted, note) in [
        ("0.5", "2.5", vec![(2.5, 6.0)], false),
        ("0.5", "0.0", vec![], false),
        ("0.5", "", vec![], true),
    ] {
        let end = match end {
            "" => String::new(),
            time => ends(&crater(time, "1,Channel2 6.0")),
        };
        let (reading, told) = kuka(&crater(weld, "1,Channel2 6.0"), &end);
        assert_eq!(stands(&reading), wanted, "{end}");
        assert_eq!((whys(&reading), told), (vec![], note), "{end}");
    }
    // with the channels of the crater
    let (reading, _) = kuka("", &ends(&crater("2", "2,Channel2 3.0")));
    assert_eq!(stands(&reading), [(2.0, 3.0)]);
    assert_eq!(whys(&reading), Vec::<String>::new());
}

/// Beads that are struck or end on the fly, or whose feed is led over to another, are not those that are laid here.
#[test]
fn what_arctech_does_on_the_fly_is_told() {
    let advanced = |on: &str, off: &str, slope: &str| {
        format!(
            ",Advanced {{SlopeOption {slope},SlopeTime 4.0,SlopeDistance 0.0,OnTheFlyActiveOn {on},OnTheFlyActiveOff {off}}}"
        )
    };
    let end = |advanced: &str| {
        format!("DECL stArcDat_T WDAT3={{Crater {{CraterTime 0.0,Channel1 1}}{advanced}}}\n")
    };
    let plain = advanced("FALSE", "FALSE", "#None");
    for (weld, ends, told) in [
        (plain.clone(), plain.clone(), None),
        (
            advanced("TRUE", "FALSE", "#None"),
            plain.clone(),
            Some("OnTheFlyActiveOn TRUE of WDAT1"),
        ),
        (
            plain.clone(),
            advanced("FALSE", "TRUE", "#None"),
            Some("OnTheFlyActiveOff TRUE of WDAT3"),
        ),
        (
            advanced("FALSE", "TRUE", "#Time"),
            plain,
            Some("SlopeOption #Time of WDAT1"),
        ),
    ] {
        let (reading, _) = kuka(&weld, &end(&ends));
        let wanted = told.map(|told| Missing::Phase(told.to_owned()).to_string());
        assert_eq!(whys(&reading), Vec::from_iter(wanted), "{weld} {ends}");
    }
}

/// An ABB bead that is struck with one seam's data and ends with another's.
fn abb(seams: &str, [struck, end]: [&str; 2], axes: [&str; 2]) -> (Reading, bool) {
    let target = |x: u32, axis: &str| {
        format!("[[{x},0,0],[0,0,1,0],[0,0,0,0],[{axis},9E9,9E9,9E9,9E9,9E9]]")
    };
    let [from, to] = [target(0, axes[0]), target(60, axes[1])];
    let text = format!(
        "MODULE m\n{seams}PERS welddata wd1:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nPROC main()\nMoveL {from},v100,fine,tTorch\\WObj:=wPart;\nArcLStart {from},v20,{struck},wd1,fine,tTorch\\WObj:=wPart;\nArcLEnd {to},v10,{end},wd1,fine,tTorch\\WObj:=wPart;\nENDPROC\nENDMODULE\n"
    );
    run((Dialect::Rapid, &text, None), &cell(&[100.0, 50.0]))
}

#[test]
fn an_abb_crater_is_that_of_its_seam_data() {
    let none = "[0,0,0,0,0,0,0,0,0]";
    let seam = |name: &str, delay: f64, heat: [f64; 2], fill: f64, arc: &str| {
        let [speed, time] = heat;
        format!(
            "PERS seamdata {name}:=[0.2,0.1,{none},{delay},0,{speed},{time},0,{none},0.3,{fill},{arc},0.1,0.1,{none},0.5];\n"
        )
    };
    let filled = "[1,6,0,0,0,0,0,0,0]";
    let less = "[2,3,0,0,0,0,0,0,0]";
    let still = [0.0, 0.0];
    let no: [&str; 0] = [];
    for (seams, names, wanted, gaps, note) in [
        (
            seam("smA", 0.0, still, 0.0, none),
            ["smA"; 2],
            vec![],
            &no[..],
            false,
        ),
        (
            seam("smA", 0.0, still, 2.5, filled),
            ["smA"; 2],
            vec![(2.5, 6.0)],
            &no,
            false,
        ),
        (
            seam("smA", 0.0, still, 2.5, less),
            ["smA"; 2],
            vec![(2.5, 3.0)],
            &no,
            false,
        ),
        (
            seam("smA", 0.0, still, 2.5, filled) + &seam("smB", 0.0, still, 0.0, none),
            ["smB", "smA"],
            vec![(2.5, 6.0)],
            &["it is struck with smB and ends with smA"],
            false,
        ),
        (
            seam("smA", 1.5, still, 0.0, none),
            ["smA"; 2],
            vec![],
            &["ign_move_delay 1.5 of smA"],
            false,
        ),
        (
            seam("smA", 0.0, [2.0, 1.5], 0.0, none),
            ["smA"; 2],
            vec![],
            &["heat_speed 2 of smA", "heat_time 1.5 of smA"],
            false,
        ),
        (String::new(), ["smX"; 2], vec![], &no, true),
    ] {
        let (reading, told) = abb(&seams, names, ["9E9"; 2]);
        assert_eq!(stands(&reading), wanted, "{seams}");
        let whys = whys(&reading);
        assert_eq!(whys.len(), gaps.len(), "{whys:?}");
        assert!(
            whys.iter().zip(gaps).all(|(a, b)| a.contains(b)),
            "{whys:?}"
        );
        assert_eq!(told, note, "{seams}");
    }
}

/// A Yaskawa bead with these lines round it.
fn yaskawa(on: &str, off: &str, cell: &CellProgramming) -> (Reading, bool) {
    let job = format!(
        "/JOB\n//NAME Y\n//POS\n///NPOS 2,0,0,0,0,0\n///USER 1\n///TOOL 1\n///POSTYPE USER\n///RECTAN\n///RCONF 1,0,0,0,0,0,0,0\nC0=0,0,0,180,0,0\nC1=60,0,0,180,0,0\n//INST\nNOP\nMOVL C0 V=20.0\n{on}\nMOVL C1 V=10.0\n{off}\nEND\n"
    );
    run((Dialect::Inform, &job, None), cell)
}

#[test]
fn times_of_a_yaskawas_arc_are_laid_or_told() {
    let mut told = cell(&[100.0]);
    let words = told.inform.value.as_mut().unwrap();
    words.arc_start.value = vec!["ARCON AC={1} AVP={2} T=2.00".to_owned()];
    words.arc_end.value = vec!["ARCOF AC=160 AVP=80 T=20.00".to_owned()];
    let plain = cell(&[100.0]);
    for (on, off, cell, wanted, gap, note) in [
        ("ARCON ASF#(1)", "ARCOF", &plain, vec![], false, false),
        (
            "ARCON ASF#(1)",
            "ARCOF AEF#(2)",
            &plain,
            vec![],
            false,
            true,
        ),
        (
            "ARCON ASF#(1)",
            "ARCOF T=0.50",
            &plain,
            vec![(0.5, 6.0)],
            false,
            false,
        ),
        (
            "ARCON ASF#(1)",
            "ARCOF AC=160 T=0.50",
            &plain,
            vec![],
            true,
            false,
        ),
        (
            "ARCON AC=1 AVP=6 T=2.00",
            "ARCOF AC=160 AVP=80 T=20.00",
            &told,
            vec![(2.0, 6.0)],
            true,
            false,
        ),
        (
            "ARCON AC=1 AVP=6 T=2.00",
            "ARCOF",
            &told,
            vec![(2.0, 6.0)],
            false,
            true,
        ),
    ] {
        let (reading, noted) = yaskawa(on, off, cell);
        assert_eq!(stands(&reading), wanted, "{on} {off}");
        let told = whys(&reading);
        let wanted = gap.then(|| Missing::CraterFeed(off.to_owned()).to_string());
        assert_eq!(told, Vec::from_iter(wanted), "{on} {off}");
        assert_eq!(noted, note, "{on} {off}");
    }
}

/// An axis that moves while metal is laid, from zero or from where no position says.
#[test]
fn an_axis_that_moves_from_zero_along_a_bead_is_told() {
    let seam = "PERS seamdata smA:=[0,0,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0];\n";
    let moved = vec![Missing::ExternalAxes.to_string()];
    for (axes, wanted) in [
        (["0", "100"], &moved),
        (["9E9", "100"], &moved),
        (["100", "100"], &vec![]),
        (["9E9", "9E9"], &vec![]),
    ] {
        let (reading, _) = abb(seam, ["smA"; 2], axes);
        assert_eq!(&whys(&reading), wanted, "{axes:?}");
    }
    let inline = |e: &str| format!("X 0,Y 0,Z 0,A 0,B 0,C 180,E1 {e},E2 0,E3 0,E4 0,E5 0,E6 0");
    let kuka = |from: &str, to: &str| {
        let [from, to] = [inline(from), inline(to).replace("X 0", "X 60")];
        let source = format!(
            "DEF K( )\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.1\nLIN {{{from}}}\nArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP2)\nLIN {{{from}}}\nArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP2)\n$VEL.CP=gArcBasVelDefinition\nArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP2)\nLIN {{{to}}}\nArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP2)\nEND\n"
        );
        let data = "DEFDAT K\nDECL stArcDat_T WDAT1={Weld {Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0},Crater {CraterTime 0.0}}\nENDDAT\n";
        run((Dialect::Krl, &source, Some(data)), &cell(&[100.0])).0
    };
    assert_eq!(whys(&kuka("0.0", "100.0")), moved);
    assert_eq!(whys(&kuka("100.0", "0.0")), moved);
    assert!(whys(&kuka("0.0", "0.0")).is_empty());
}

/// A KUKA bead of two moves whose corner is rounded, with a line before the first and between them.
fn rounded(first: &str, between: &str) -> Reading {
    let source = format!(
        "DEF K( )\nBAS(#INITMOV,0)\n{first}\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.1\n$APO.CDIS=2\nArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP2)\nLIN {{X 0,Y 0,Z 0,A 0,B 0,C 180}}\nArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP2)\n$VEL.CP=gArcBasVelDefinition\nLIN {{X 60,Y 0,Z 0,A 0,B 0,C 180}} C_DIS\n{between}\nArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP2)\nLIN {{X 60,Y 60,Z 0,A 0,B 0,C 180}}\nArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP2)\nEND\n"
    );
    let data = "DEFDAT K\nDECL stArcDat_T WDAT1={Weld {Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0},Crater {CraterTime 0.0}}\nENDDAT\n";
    run((Dialect::Krl, &source, Some(data)), &cell(&[100.0])).0
}

/// What a KUKA does not prepare ahead it does not round: corners passed as rounded that were stops, with 27 % more time of the arc.
#[test]
fn a_kuka_that_prepares_nothing_ahead_rounds_nothing() {
    for (first, between, stops) in [
        ("", "", false),
        ("$ADVANCE=3", "", false),
        ("$ADVANCE = 0", "", true),
        ("$ADVANCE=0\nBAS(#INITMOV,0)", "", false),
        ("", "$OUT[4]=TRUE", true),
        ("", "CONTINUE\n$OUT[4]=TRUE", false),
        ("", "CONTINUE\n$OUT[4]=TRUE\n$OUT[5]=TRUE", true),
    ] {
        let reading = rounded(first, between);
        assert_eq!(whys(&reading), Vec::<String>::new(), "{between}");
        let stood = stands(&reading).iter().any(|s| s.0 == 0.0);
        assert_eq!(stood, stops, "{first} {between}");
    }
}

/// A script that stops the arm between beads that are rounded stands with the arc on.
#[test]
fn a_script_that_stops_with_the_arc_on_is_told() {
    let text = "def w():\n  movel(p[0,0,0.03,3.14,0,0], v=0.1)\n  set_job(1)\n  set_analog_out(0, 6)\n  set_digital_out(0, True)\n  movel(p[0.06,0,0,3.14,0,0], v=0.01, r=0.002)\n  stopl(0.5)\n  movel(p[0.06,0.06,0,3.14,0,0], v=0.01)\n  set_digital_out(0, False)\n  stopl(0.5)\nend\n";
    let (reading, _) = run((Dialect::UrScript, text, None), &cell(&[100.0]));
    let told = reading
        .gaps
        .iter()
        .filter(|g| g.why == Missing::WaitWithArc);
    assert_eq!(told.count(), 1);
}
