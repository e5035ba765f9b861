//! What arc words and weave words set: by the cell's tables, by the units that stand in the program, never guessed.

use std::collections::BTreeMap;

use meltpath_base::{Reporter, settings};
use meltpath_data::cells;
use meltpath_programs::{
    ArcValue, CellProgramming, ExecutionSettings, Missing, Reading, WeldSettings,
};
use meltpath_toolpath::{Channel, Event, Move, Weave, WeaveShape};

use crate::told::{motions, program, read};

/// A bead from P[1] by P[2] to P[3], with lines before its first and before its second move.
fn bead(start: &str, before: &[&str], between: &[&str], settings: &ExecutionSettings) -> Reading {
    let mut lines = before.to_vec();
    let on = format!("L P[1] 50mm/sec FINE {start}");
    lines.extend([on.as_str(), "L P[2] WELD_SPEED FINE"]);
    lines.extend(between);
    let end = match start {
        "" => "Arc End[1]".to_owned(),
        start => start.replace("Start", "End"),
    };
    lines.extend(["L P[3] 10mm/sec FINE", end.as_str()]);
    let before = ["L P[1] 50mm/sec FINE"];
    let all: Vec<_> = before.into_iter().chain(lines).collect();
    read(&[program("P", &all)], settings, &Reporter::new()).unwrap()
}

fn schedule(feed: f64, speed: f64) -> WeldSettings {
    WeldSettings {
        wire_feed: feed,
        speed: Some(speed),
        crater: None,
    }
}

/// Where the arc ends: what stands on the crater is laid, or told as not known.
#[test]
fn the_crater_is_filled_as_the_end_of_the_arc_says() {
    let text = "[program]\narc_values = [\"schedule\", \"wire feed, m/min\", \"other\"]\n";
    let rows = "[[program.schedule]]\nnumber = 2\nwire_feed = \"6 m/min\"\n\
        [[program.schedule]]\nnumber = 3\nwire_feed = \"6 m/min\"\ncrater_time = \"0.5 s\"\n\
        [[program.schedule]]\nnumber = 4\nwire_feed = \"6 m/min\"\ncrater_time = \"0 s\"\n";
    let head = cells::ARCMATE_120IC.text.replace("[program]\n", text);
    let listed: CellProgramming = settings::peek(&(head.clone() + rows), &["program"])
        .unwrap()
        .unwrap();
    let unlisted: CellProgramming = settings::peek(&head, &["program"]).unwrap().unwrap();
    // end, time in s and feed in m/min of what stands, whether it is a gap, whether a note tells of it
    for (end, stands, gap, note) in [
        ("Arc End[1,7.0,18.5,20.0s]", Some((20.0, 7.0)), false, false),
        ("Arc End[1,7.0,18.5,0.3sec]", Some((0.3, 7.0)), false, false),
        ("Arc End[2,0.5s]", Some((0.5, 6.0)), false, false),
        ("Arc End[1,7.0,18.5,0.0s]", None, false, false),
        ("Arc End[20.0volts,180.0amps,20.0s]", None, true, false),
        ("Arc End[20.0volts,180.0amps]", None, true, false),
        ("Arc End[1,7.0,18.5,20.0s,0.0]", None, true, false),
        ("Arc End[7]", None, true, false),
        ("Arc End[2]", None, false, true),
        ("Arc End[3]", Some((0.5, 6.0)), false, false),
        ("Arc End[3,7.0,18.5]", Some((0.5, 7.0)), false, false),
        ("Arc End[4]", None, false, false),
    ] {
        let reporter = Reporter::new();
        let lines = [
            "L P[1] 50mm/sec FINE Arc Start[2,7.0,18.5]",
            "L P[2] 10mm/sec FINE",
            end,
        ];
        let known = listed.execution(10.0);
        let reading = read(&[program("P", &lines)], &known, &reporter).unwrap();
        let laid: Vec<_> = reading.toolpath.passes().collect();
        let stood = laid
            .iter()
            .filter(|p| p.head.role.deposits())
            .find_map(|p| {
                (0..p.move_count()).find_map(|i| match p.move_at(i) {
                    Move::Spot { time } => Some((time, p.value(Channel::WireFeed, i))),
                    _ => None,
                })
            });
        assert_eq!(stood.map(|s| s.0), stands.map(|s| s.0), "{end}");
        if let (Some((_, Some(feed))), Some((_, asked))) = (stood, stands) {
            assert!((feed - asked / 0.06).abs() < 1e-9, "{end}: {feed}");
        }
        let whys: Vec<_> = reading
            .gaps
            .iter()
            .map(|g| (g.line, g.why.clone()))
            .collect();
        let told: Vec<_> = gap
            .then(|| (3, Missing::Crater(end.to_owned())))
            .into_iter()
            .collect();
        assert_eq!(whys, told, "{end}");
        let noted = |reporter: &Reporter| {
            let all = reporter.warnings();
            all.iter().any(|w| w.code == "crater-not-told")
        };
        assert_eq!(noted(&reporter), note, "{end}");
        // where the cell lists nothing, a bare end goes on as it did, and is told
        if end == "Arc End[7]" {
            let reporter = Reporter::new();
            let known = unlisted.execution(10.0);
            let reading = read(&[program("P", &lines)], &known, &reporter).unwrap();
            assert!(reading.gaps.is_empty() && noted(&reporter), "{end}");
        }
    }
}

/// A source's job need not have the number of the schedule that tells it.
#[test]
fn schedules_go_by_the_value_that_calls_them() {
    let text = "[program]\narc_values = [\"schedule\", \"other\"]\n";
    let row = |number: u32, feed: u32, job: u32| {
        format!(
            "[[program.schedule]]\nnumber = {number}\nwire_feed = \"{feed} mm/s\"\ntravel_speed = \"9 mm/s\"\nvalues = [{job}, 0]\n"
        )
    };
    let rows = [(1, 100, 4), (2, 120, 5), (3, 130, 5), (5, 140, 6)].map(|(n, f, j)| row(n, f, j));
    let head = cells::ARCMATE_120IC.text.replace("[program]\n", text);
    let cell: CellProgramming = settings::peek(&(head + &rows.concat()), &["program"])
        .unwrap()
        .unwrap();
    let known = cell.execution(10.0);
    // 1 is a number that calls nothing, 5 calls two
    for (called, feed) in [
        (4, Some(100.0)),
        (6, Some(140.0)),
        (1, None),
        (5, None),
        (2, None),
    ] {
        let reading = bead(&format!("Arc Start[{called},0]"), &[], &[], &known);
        assert_eq!(motions(&reading)[1].wire_feed, feed, "{called}");
        assert_eq!(reading.gaps.is_empty(), feed.is_some(), "{called}");
    }
}

#[test]
fn numbers_of_arc_words_mean_what_the_cell_says() {
    let schedules = BTreeMap::from([
        ((None, 3), schedule(100.0, 8.0)),
        ((Some(2), 3), schedule(150.0, 9.0)),
    ]);
    let with = |arc_values: &[ArcValue]| ExecutionSettings {
        schedules: schedules.clone(),
        arc_values: arc_values.to_vec(),
        registers: BTreeMap::from([(5, 3.0)]),
        ..ExecutionSettings::default()
    };
    let feed_second = [
        ArcValue::Schedule,
        ArcValue::MetresPerMinute,
        ArcValue::Other,
    ];
    let procedure = [ArcValue::Procedure, ArcValue::Schedule];
    for (word, values, feed, speed) in [
        ("Arc Start[3]", &[] as &[ArcValue], Some(100.0), Some(8.0)),
        ("Arc Start[R[5]]", &[], Some(100.0), Some(8.0)),
        // a procedure of its own, one that has none, one that is not known
        ("Weld Start[2,3]", &[], Some(150.0), Some(9.0)),
        ("Weld Start[1,3]", &[], Some(100.0), Some(8.0)),
        ("Weld Start[R[9],3]", &[], None, None),
        ("Arc Start[2,R[5]]", &procedure, Some(150.0), Some(9.0)),
        (
            "Arc Start[3,8.5,20.1]",
            &feed_second,
            Some(8.5 / 0.06),
            Some(8.0),
        ),
        // nobody says what these numbers are
        ("Arc Start[3,8.5,20.1]", &[], None, None),
        ("Arc Start[1,R[2]]", &[], None, None),
        ("Arc Start[4]", &feed_second, None, None),
    ] {
        let reading = bead(word, &[], &[], &with(values));
        let first = motions(&reading)[1];
        assert_eq!(
            first.wire_feed.map(|f: f64| (f * 1e6).round()),
            feed.map(|f: f64| (f * 1e6).round()),
            "{word}"
        );
        assert_eq!(first.speed, speed.or(Some(10.0)), "{word}");
        let known = reading.gaps.is_empty();
        assert_eq!(known, feed.is_some(), "{word}: {:?}", reading.gaps);
    }
}

#[test]
fn weaves_are_events_of_the_path_where_it_is_known_what_they_are() {
    let listed = Weave {
        shape: WeaveShape::Sine,
        frequency: 2.0,
        amplitude: 3.0,
        dwell: [0.1, 0.2],
    };
    let settings = ExecutionSettings {
        schedules: BTreeMap::from([((None, 1), schedule(100.0, 8.0))]),
        weaves: BTreeMap::from([(4, listed)]),
        ..ExecutionSettings::default()
    };
    let circle = Weave {
        shape: WeaveShape::Circle,
        frequency: 1.0,
        dwell: [0.05, 0.0],
        ..listed
    };
    for (line, weave) in [
        ("Weave Sine[4]", Some(listed)),
        ("Weave[4]", Some(listed)),
        ("WEAVE CIRCLE[1.0Hz,3.0mm,0.000s,0.050s]", Some(circle)),
        // another shape than the table's, no such number, no units, shapes that are not simulated, no weave that a robot has
        ("Weave Circle[4]", None),
        ("Weave Sine[5]", None),
        ("Weave Sine[1.0,3.0,0.0,0.0]", None),
        ("Weave Figure 8[4]", None),
        ("Weave", None),
    ] {
        let reading = bead("Arc Start[1]", &[line], &["Weave End"], &settings);
        let whys: Vec<_> = reading.gaps.iter().map(|g| g.why.clone()).collect();
        let laid = reading.toolpath.passes().find(|p| p.head.role.deposits());
        let events: Vec<_> = laid.unwrap().events().collect();
        match weave {
            Some(weave) => {
                assert_eq!(whys, [], "{line}");
                assert_eq!(reading.toolpath.weaves, [weave], "{line}");
                assert_eq!(
                    events,
                    [(0, Event::Weave(1)), (1, Event::Weave(0))],
                    "{line}"
                );
            }
            None => assert_eq!((whys, events), (vec![Missing::Weave], vec![]), "{line}"),
        }
    }
    // numbers that no robot weaves with are told as such
    for (line, number) in [
        ("Weave Sine[2.0Hz,300.0mm,0.0s,0.0s]", "300 mm"),
        ("Weave Sine[0.0Hz,3.0mm,0.0s,0.0s]", "0 Hz"),
    ] {
        let reading = bead("Arc Start[1]", &[line], &["Weave End"], &settings);
        let [gap] = &reading.gaps[..] else {
            panic!("{:?}", reading.gaps)
        };
        let told = gap.why.to_string();
        assert!(
            told.contains(number) && told.contains("0.01 to 50 mm"),
            "{told}"
        );
        assert!(!gap.why.remedy().contains("list"), "{line}");
    }
    // travels do not weave
    let off = bead(
        "Arc Start[1]",
        &["Weave[4]", "L P[2] 50mm/sec FINE"],
        &[],
        &settings,
    );
    let travel = off.toolpath.passes().next().unwrap();
    assert_eq!(travel.events().count(), 0);
}
