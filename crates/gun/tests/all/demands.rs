//! What paths ask of guns in vain.

use meltpath_gun::demands::{Demands, What, demands};
use meltpath_toolpath::MotionBlock;

use crate::{gun, motion};

/// Everything but what a test changes is known.
const KNOWN: &str = "least_power = { value = \"50 W\", source = \"log\" }\ngreatest_power = { value = \"1 kW\", source = \"log\" }\n\
    [current]\nchange = \"CURRENT\"\nslew = { value = \"100 mA/ms\", source = \"log\" }\nbetween = \"blanked\"\n\
    [deflection]\nspeed = \"SPEED\"\nlag = { value = \"10 µs\", source = \"log\" }\njump = { value = \"50 µs\", source = \"log\" }\n\
    greatest_speed = { value = \"5000 mm/s\", source = \"log\" }\n\
    [points]\nrest = \"timed\"\nleast_dwell = { value = \"100 µs\", source = \"log\" }\n";

fn asked(motion: &MotionBlock, current: &str, speed: &str) -> Demands {
    let lines = KNOWN.replace("CURRENT", current).replace("SPEED", speed);
    demands(motion, &gun(&lines))
}

/// Two pieces of one line, or with a bend, or with a jump between them, of other powers and speeds.
fn pieces(end: [f64; 2], jump: bool, power: f64, takes: f64) -> MotionBlock {
    let begin = if jump { [1.0, 0.5] } else { [1.0, 0.0] };
    let end = [begin[0] + end[0], begin[1] + end[1]];
    let mut points = vec![[0.0, 0.0, 0.0, 0.0], [1e-3, 1.0, 0.0, 300.0]];
    if jump {
        points.push([1e-3, begin[0], begin[1], 0.0]);
    }
    points.push([1e-3 + takes, end[0], end[1], power]);
    motion(&points)
}

#[test]
fn currents_and_speeds_change_where_a_gun_can_change_them() {
    let places = [([1.0, 0.0], false), ([0.0, 1.0], false), ([1.0, 0.0], true)];
    let words = ["anywhere", "between-lines", "between-passes"];
    for (n, (end, jump)) in places.into_iter().enumerate() {
        for (m, word) in words.into_iter().enumerate() {
            // the place is one that a gun allows which changes there or at finer places
            let allowed = m <= n;
            let current = asked(&pieces(end, jump, 400.0, 1e-3), word, "between-passes");
            let speed = asked(&pieces(end, jump, 300.0, 2e-3), "between-passes", word);
            for (found, what) in [(current, What::Current), (speed, What::Speed)] {
                assert!(found.unknown.is_empty(), "{:?}", found.unknown);
                assert_eq!(found.vain.is_empty(), allowed, "{what:?} {n} {word}");
                for demand in found.vain {
                    assert_eq!(
                        (demand.what, demand.places, demand.at),
                        (what, 1, [1.0, 0.0])
                    );
                }
            }
        }
    }
}

#[test]
fn what_is_out_of_range_is_told_with_its_place() {
    let found = |points: &[[f64; 4]]| asked(&motion(points), "anywhere", "anywhere");
    for (power, what) in [(20.0, What::LeastPower), (1500.0, What::GreatestPower)] {
        let found = found(&[
            [0.0, 3.0, 4.0, 0.0],
            [1e-3, 4.0, 4.0, power],
            [2e-3, 5.0, 4.0, power],
        ]);
        assert_eq!((found.vain[0].what, found.vain[0].places), (what, 2));
        let words = found.vain[0].to_string();
        assert!(
            words.contains("2 places") && words.contains("x 3.00, y 4.00 mm"),
            "{words}"
        );
    }
    let fast = found(&[[0.0, 0.0, 0.0, 0.0], [1e-4, 1.0, 0.0, 300.0]]);
    assert_eq!(fast.vain[0].what, What::GreatestSpeed);
    let jump = found(&[
        [0.0, 0.0, 0.0, 0.0],
        [1e-3, 1.0, 0.0, 300.0],
        [1.1e-3, 3.0, 0.0, 0.0],
    ]);
    assert_eq!(jump.vain[0].what, What::GreatestSpeed);
    let rest = found(&[[0.0, 0.0, 0.0, 0.0], [5e-5, 0.0, 0.0, 300.0]]);
    assert_eq!(rest.vain[0].what, What::LeastDwell);
    assert!((rest.vain[0].values[1] - 1e-4).abs() < 1e-12);
    assert!(
        found(&[[0.0, 0.0, 0.0, 0.0], [2e-4, 0.0, 0.0, 300.0]])
            .vain
            .is_empty()
    );
}

/// Only what a path leans on is missed.
#[test]
fn unknown_figures_count_where_a_path_needs_them() {
    let nothing = gun("");
    let unknown = |points: &[[f64; 4]]| demands(&motion(points), &nothing).unknown.join(" ");
    let line = unknown(&[
        [0.0, 0.0, 0.0, 0.0],
        [1e-3, 1.0, 0.0, 300.0],
        [2e-3, 1.0, 1.0, 300.0],
    ]);
    assert!(
        line.contains("deflection.lag") && line.contains("greatest_power"),
        "{line}"
    );
    for other in ["jump", "current", "speed", "dwell"] {
        assert!(!line.contains(other), "{other}: {line}");
    }
    let jumps = unknown(&[
        [0.0, 0.0, 0.0, 0.0],
        [1e-3, 1.0, 0.0, 300.0],
        [1e-3, 0.0, 1.0, 0.0],
        [2e-3, 1.0, 1.0, 200.0],
        [3e-3, 2.0, 1.0, 250.0],
        [4e-3, 2.0, 1.0, 250.0],
    ]);
    for needed in [
        "deflection.jump",
        "current.between",
        "current.slew",
        "current.change",
        "points.rest",
    ] {
        assert!(jumps.contains(needed), "{needed}: {jumps}");
    }
}

/// The beam goes off and on again at one place: what follows is another pass, also where it goes straight on.
#[test]
fn a_dark_pause_ends_a_pass() {
    let run = |pause: f64| {
        let points = [
            [0.0, 0.0, 0.0, 0.0],
            [1e-3, 1.0, 0.0, 300.0],
            [1e-3 + pause, 1.0, 0.0, 0.0],
            [2e-3 + pause, 2.0, 0.0, 400.0],
        ];
        let found = asked(&motion(&points), "between-passes", "anywhere");
        found.vain.iter().map(|d| d.what).collect::<Vec<_>>()
    };
    assert_eq!(run(1e-3), []);
    assert_eq!(run(0.0), [What::Current]);
}
