//! Lines that switch an arc otherwise than those that are known: told, never passed over.

use meltpath_base::Reporter;
use meltpath_programs::{ArcValue, Dialect, ExecutionSettings, Reading, WeldSettings, dialect};
use meltpath_programs::{CellProgramming, read_toolpath};

use crate::dialects::cell;
use crate::told::{motions, program, read};

fn told(reading: &Reading) -> Vec<&str> {
    reading.gaps.iter().map(|g| g.text.as_str()).collect()
}

fn run(dialect: Dialect, text: &str, data: Option<&str>, cell: &CellProgramming) -> Reading {
    let parsed = dialect::read(dialect, text.as_bytes(), data.map(str::as_bytes), cell).unwrap();
    let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
    read_toolpath(&programs, &cell.execution(10.0), 1000.0, &Reporter::new()).unwrap()
}

/// Two beads' moves of a KUKA, with lines in front of the call before the arc starts, and before it ends.
fn kuka(on: &str, off: &str) -> Reading {
    let source = format!(
        "DEF K( )
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$VEL.CP=0.1
LIN {{X 0,Y 0,Z 20,A 0,B 0,C 180}}
{on}
ArcMainNG(#ArcOnBeforeMoveStd,WDAT1,WP1)
LIN {{X 0,Y 0,Z 0,A 0,B 0,C 180}}
ArcMainNG(#ArcOnAfterMoveStd,WDAT1,WP1)
$VEL.CP=gArcBasVelDefinition
LIN {{X 30,Y 0,Z 0,A 0,B 0,C 180}}
{off}
ArcMainNG(#ArcOffBeforeMoveStd,WDAT1,WP1)
LIN {{X 60,Y 0,Z 0,A 0,B 0,C 180}}
ArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP1)
END
"
    );
    let data = "DEFDAT K\nDECL stArcDat_T WDAT1={Weld {Velocity 0.01,Channel1 1,Channel2 6.0,Channel3 0.0},Crater {CraterTime 0.0}}\nDECL stArcDat_T WDAT2={Weld {Velocity 0.01,Channel1 1,Channel2 3.0,Channel3 0.0},Crater {CraterTime 0.0}}\nENDDAT\n";
    run(Dialect::Krl, &source, Some(data), &cell(&[100.0]))
}

/// Triggers of the inline forms, however they are spaced, are what the calls do; all others switch the arc elsewhere, or with other data.
#[test]
fn calls_of_arctech_that_are_none_of_its_forms_are_told() {
    for (on, off) in [
        ("", ""),
        (
            "TRIGGER WHEN DISTANCE=1 DELAY=ArcGetDelay(#PreDefinition,WDAT1) DO ArcMainNG(#PreDefinition,WDAT1,WP1) PRIO=-1\nTRIGGER WHEN PATH = ArcGetPath(#OnTheFlyArcOn, WDAT1) DELAY = 0 DO ArcMainNG(#ArcOnMoveStd, WDAT1, WP1) PRIO = -1",
            "trigger when path=arcgetpath(#onthefLyArcOff,wdat1) delay=0 do arcmainng(#ArcOffMoveStd,wdat1,wp1) prio=-1",
        ),
    ] {
        let reading = kuka(on, off);
        assert!(reading.gaps.is_empty(), "{on} {off}: {:?}", reading.gaps);
    }
    for line in [
        "TRIGGER WHEN PATH=-10 DELAY=0 DO ArcMainNG(#ArcOffMoveStd,WDAT1,WP1) PRIO=-1",
        "TRIGGER WHEN DISTANCE=0 DELAY=3000 DO ArcMainNG(#ArcOffMoveStd,WDAT1,WP1) PRIO=-1",
        "TRIGGER WHEN PATH=ArcGetPath(#OnTheFlyArcOn,WDAT2) DELAY=0 DO ArcMainNG(#ArcOnMoveStd,WDAT2,WP1) PRIO=-1",
        "ArcMainNG(#Foo,WDAT1,WP1)",
        "ArcMainNG(#ArcOffAfterMoveStd,WDAT1,WP1)",
        "ArcMainNG(#ArcOnBeforeMoveTouch,WDAT1,WP1)",
    ] {
        for reading in [kuka(line, ""), kuka("", line)] {
            assert!(
                told(&reading).contains(&line),
                "{line}: {:?}",
                told(&reading)
            );
        }
    }
}

/// Whole numbers of a `Weld Start` are procedure and schedule, whatever two values of another arc word mean in the cell.
#[test]
fn a_weld_start_calls_procedure_and_schedule() {
    let feed = |wire_feed: f64| WeldSettings {
        wire_feed,
        speed: None,
        crater: None,
    };
    let settings = ExecutionSettings {
        arc_values: vec![ArcValue::Schedule, ArcValue::MetresPerMinute],
        schedules: [((None, 8), feed(150.0))].into(),
        ..ExecutionSettings::default()
    };
    let weld = |start: &str| {
        let lines = [
            format!("L P[1] 40mm/sec FINE {start}"),
            "L P[2] 10mm/sec FINE Weld End[1,8]".to_owned(),
        ];
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let reading = read(&[program("W", &lines)], &settings, &Reporter::new()).unwrap();
        let feeds = motions(&reading).into_iter().find(|m| m.burns);
        feeds.and_then(|m| m.wire_feed)
    };
    assert_eq!(weld("Weld Start[1,8]"), Some(150.0));
    // values with decimals are the cell's
    assert_eq!(weld("Weld Start[1,9.0]"), Some(150.0));
}

/// A bead of another piece of equipment was left out without a word.
#[test]
fn arc_words_of_other_equipment_are_told() {
    let lines = [
        "L P[1] 40mm/sec FINE Arc Start[1]",
        "L P[2] 10mm/sec FINE Arc End[1]",
        "L P[1] 40mm/sec FINE Arc Start E2[1]",
        "L P[2] 10mm/sec FINE Arc End E2[1]",
    ];
    let schedule = WeldSettings {
        wire_feed: 100.0,
        speed: None,
        crater: None,
    };
    let settings = ExecutionSettings {
        schedules: [((None, 1), schedule)].into(),
        ..ExecutionSettings::default()
    };
    let reading = read(&[program("E", &lines)], &settings, &Reporter::new()).unwrap();
    for line in &lines[2..] {
        assert!(
            told(&reading).contains(line),
            "{line}: {:?}",
            told(&reading)
        );
    }
}

/// Whether the arc burns along a plain move between `ArcLStart` and `ArcLEnd` no manual says.
#[test]
fn plain_moves_between_arc_moves_of_an_abb_are_told() {
    let at = |x: u32| format!("[[{x},0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let text = |between: &str| {
        format!(
            "MODULE m\nPERS welddata wd1:=[10,0,[1,6,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nPROC main()\nMoveL {0},v100,fine,tTorch\\WObj:=wPart;\nArcLStart {0},v20,sm1,wd1,fine,tTorch\\WObj:=wPart;\n{between} {1},v10,{2}fine,tTorch\\WObj:=wPart;\nArcLEnd {3},v10,sm1,wd1,fine,tTorch\\WObj:=wPart;\nMoveL {3},v100,fine,tTorch\\WObj:=wPart;\nENDPROC\nENDMODULE\n",
            at(0),
            at(30),
            if between == "ArcL" { "sm1,wd1," } else { "" },
            at(60)
        )
    };
    let lines = |between: &str| {
        let reading = run(Dialect::Rapid, &text(between), None, &cell(&[100.0]));
        let all = reading.gaps.iter().map(|g| g.why.to_string());
        all.filter(|why| why.contains("along MoveL")).count()
    };
    assert_eq!([lines("ArcL"), lines("MoveL")], [0, 1]);
}
