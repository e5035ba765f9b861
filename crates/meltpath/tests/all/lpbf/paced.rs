//! What nothing is promised of: marks that do not run as they are commanded, light where no mark is, layers that are left out.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use meltpath_base::{Status, Verdict};

use super::promised::{cli, folder, job, recipe, verdict};
use crate::support::{check, says, write};

fn is_told(told: &Verdict, id: &str) -> bool {
    told.checks.iter().any(|c| c.id == id)
}

/// A circle of 2 mm at 2 m/s, which the delay of the mirrors cuts by 50 µm: in facets of 10.13 µs, of which the clock makes 20 µs each, it runs at
/// half the speed and keeps the bound. That is told, and nothing promised of it; in facets of 79.5 µs it fails.
#[test]
fn facets_that_the_clock_slows_promise_nothing() {
    let dir = folder();
    let fast = recipe("320 µs").replace("800 mm/s", "2000 mm/s");
    write(
        dir.path(),
        "recipe.toml",
        fast.replace("\"0.5 ms\"", "\"0 ms\""),
    );
    let circle = |facets: u32| {
        let mut text = String::from("kind,x_mm,y_mm\nstart,2,0\n");
        for k in 1..=facets {
            let (y, x) = (TAU * f64::from(k) / f64::from(facets)).sin_cos();
            writeln!(text, "contour,{:.6},{:.6}", 2.0 * x, 2.0 * y).unwrap();
        }
        text
    };
    write(dir.path(), "a.csv", circle(620));
    let told = verdict(dir.path(), &job("a.csv", ""));
    let clock = check(&told, "clock-1");
    assert_eq!(clock.status, Status::CannotSay, "{clock:?}");
    assert_eq!(clock.value.as_ref().unwrap().value, 100.0);
    says(&clock.reason, &["1013 mm/s of 2000 mm/s"]);
    assert_eq!(clock.place.as_ref().unwrap().layer, Some(1));
    let contour = check(&told, "contour-1");
    assert_eq!(contour.status, Status::CannotSay, "{contour:?}");
    assert!(contour.value.as_ref().unwrap().value > 95.0, "{contour:?}");
    let time = told.facts.iter().find(|f| f.id == "time-1").unwrap();
    says(&time.reason, &["longer than commanded"]);

    write(dir.path(), "a.csv", circle(79));
    let told = verdict(dir.path(), &job("a.csv", ""));
    assert!(!is_told(&told, "clock-1"), "{:?}", told.checks);
    assert_eq!(check(&told, "contour-1").status, Status::Fail);
}

/// Mirrors of 11 m/s do not mark at 90.
#[test]
fn marks_faster_than_the_mirrors_fail() {
    let dir = folder();
    let lines = |speed: u32| {
        let head = "kind,x_mm,y_mm,speed_mm_s,layer,height_mm\n";
        let mut text = format!("{head}start,0,0,,7,0.21\n");
        for k in 0..3 {
            let (x, y) = (20 * ((k + 1) % 2), 0.1 * f64::from(k));
            writeln!(
                text,
                "connection,{},{y},,7,0.21\nfill,{x},{y},{speed},7,0.21",
                20 - x
            )
            .unwrap();
        }
        text
    };
    write(dir.path(), "a.csv", lines(90_000));
    let told = verdict(dir.path(), &job("a.csv", ""));
    let speed = check(&told, "top-speed-1");
    assert_eq!(speed.status, Status::Fail, "{speed:?}");
    // the middle of the field, where a millimetre is as much of an angle as the data sheet says
    let value = speed.value.as_ref().unwrap().value;
    assert!((value / 818.0 - 1.0).abs() < 0.02, "{value}");
    says(&speed.reason, &["3 marks"]);
    assert_eq!(speed.place.as_ref().unwrap().layer, Some(7));
    write(dir.path(), "a.csv", lines(10_000));
    let told = verdict(dir.path(), &job("a.csv", ""));
    assert!(!is_told(&told, "top-speed-1"), "{:?}", told.checks);
}

/// Light that lasts longer than the wait at the ends of marks goes along with jumps.
#[test]
fn light_where_no_mark_is_fails() {
    let dir = folder();
    let marks = "kind,x_mm,y_mm\nstart,0,0\nfill,5,0\njump,15,0\nfill,20,0\njump,20,9\nfill,25,9\n";
    write(dir.path(), "a.csv", marks);
    let told = verdict(dir.path(), &job("a.csv", ""));
    assert_eq!(check(&told, "stray-1").status, Status::Pass, "{told:?}");
    let long = recipe("320 µs").replace(
        "laser_off_delay = { value = \"320 µs\"",
        "laser_off_delay = { value = \"1200 µs\"",
    );
    write(dir.path(), "recipe.toml", long);
    let told = verdict(dir.path(), &job("a.csv", ""));
    let stray = check(&told, "stray-1");
    assert_eq!(stray.status, Status::Fail, "{stray:?}");
    // 1.2 ms after the command is at the end: 0.5 ms it waits, and 0.7 ms it jumps at 5 m/s, 0.32 ms late
    let longest = stray.value.as_ref().unwrap().value;
    assert!((1.0..2.5).contains(&longest), "{longest}");
    let at = stray.place.as_ref().unwrap().position.unwrap();
    let off = [[5.0, 0.0], [20.0, 0.0]].map(|[x, y]| (at[0] - x).hypot(at[1] - y));
    assert!(off[0].min(off[1]) < 0.15, "{at:?}");
}

/// Of a file whose layers nobody chose one is judged: that is told, and a layer that lies beyond the field, or stays dark, fails.
#[test]
fn layers_that_are_left_out_are_told() {
    let dir = folder();
    write(dir.path(), "recipe.toml", recipe("340 µs"));
    let with = |line: &str| {
        let text = cli(&[Some(0.1), None], 2);
        text.replace(
            "$$GEOMETRYEND",
            &format!("$$HATCHES/1,1,{line}\n$$GEOMETRYEND"),
        )
    };
    let said = |line: &str, tables: &str| {
        write(dir.path(), "a.cli", with(line));
        verdict(dir.path(), &job("a.cli", tables))
    };
    let told = said("0.2,0.2,2.8,0.2", "");
    let left = check(&told, "layers-left-out");
    assert_eq!(left.status, Status::NotChecked, "{left:?}");
    says(&left.reason, &["1 of 2 layers"]);
    let judged = told.facts.iter().find(|f| f.id == "layers").unwrap();
    assert_eq!(judged.reason, "1 of 2");
    for (line, words) in [
        ("99,0,101,0", "field"),
        // a sample, which with the laser-off delay is over before the laser-on delay is
        ("1.5,1.5,1.500001,1.5", "dark"),
    ] {
        let told = said(line, "");
        let left = check(&told, "layers-left-out");
        assert_eq!(left.status, Status::Fail, "{line}: {left:?}");
        says(&left.reason, &[words]);
    }
    let told = said("0.2,0.2,2.8,0.2", "[layers]\nrange = [1, 2]\n");
    assert!(!is_told(&told, "layers-left-out"));
    let judged = told.facts.iter().find(|f| f.id == "layers").unwrap();
    assert_eq!(judged.reason, "2 of 2");
}
