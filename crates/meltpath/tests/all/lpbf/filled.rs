//! What is promised of a fill whose lines are few, far apart, or stray.

use meltpath_base::{Status, Verdict};

use super::promised::{HEAD, folder, job, verdict};
use crate::support::{check, says, write};

/// A square of 3 mm with lines at these heights, mm.
fn square(lines: &[f64]) -> String {
    use std::fmt::Write as _;
    let mut text = String::from(
        "$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$VERSION/200\n$$LAYERS/1\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/0.03\n$$POLYLINE/1,1,5,0,0,3,0,3,3,0,3,0,0\n",
    );
    write!(text, "$$HATCHES/1,{}", lines.len()).unwrap();
    for y in lines {
        write!(text, ",0.02,{y},2.98,{y}").unwrap();
    }
    text + "\n$$GEOMETRYEND\n"
}

fn told(lines: &[f64], tables: &str) -> Verdict {
    let dir = folder();
    write(dir.path(), "a.cli", square(lines));
    verdict(dir.path(), &job("a.cli", tables))
}

/// One line tells no distance of lines: neither what is enclosed nor what is filled can be said, and a distance that is written says it.
#[test]
fn a_single_line_fills_nothing() {
    let limit = "[checks]\nfill_rate = \"30 %\"\n";
    let one = told(&[1.5], limit);
    for id in ["enclosed", "fill-1"] {
        let check = check(&one, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(check.remedy.as_ref().unwrap(), &["[layers] hatch"]);
    }
    // what is not known is no fact either
    let one = told(&[1.5], "");
    assert_eq!(check(&one, "enclosed").status, Status::CannotSay);
    assert!(one.facts.iter().all(|f| f.id != "fill-1"), "{one:?}");
    let written = told(&[1.5], &format!("[layers]\nhatch = \"0.1 mm\"\n{limit}"));
    assert_ne!(check(&written, "enclosed").status, Status::Pass);
}

/// Lines a millimetre apart come near all of a square: whether they are to fill it nobody says, until the job does.
#[test]
fn lines_far_apart_promise_no_fill() {
    let lines = [0.5, 1.5, 2.5];
    let bare = told(&lines, "");
    let enclosed = check(&bare, "enclosed");
    assert_eq!(enclosed.status, Status::CannotSay, "{enclosed:?}");
    says(&enclosed.reason, &["1 mm apart", "0.05 mm wide"]);
    says(
        enclosed.remedy.as_ref().unwrap(),
        &["[layers] hatch", "checks.fill_rate"],
    );
    let limited = told(&lines, "[checks]\nfill_rate = \"30 %\"\n");
    assert_eq!(check(&limited, "fill-1").status, Status::Fail);
    let meant = told(&lines, "[layers]\nhatch = \"1 mm\"\n");
    assert_eq!(check(&meant, "enclosed").status, Status::Pass);
}

/// What `left_out` of the head's file does to a square of lines 0.05 mm apart, with a spot of 0.05 mm.
fn strayed(left_out: &str, tables: &str) -> Verdict {
    let dir = folder();
    let line = "left_out = { value = \"1 µm\", source = \"a test\" }\n";
    write(dir.path(), "head.toml", HEAD.replace(line, left_out));
    let lines: Vec<f64> = (1..60).map(|k| 0.05 * f64::from(k)).collect();
    write(dir.path(), "a.cli", square(&lines));
    verdict(dir.path(), &job("a.cli", tables))
}

fn left_out(value: &str, source: &str) -> String {
    format!("left_out = {{ value = \"{value}\", source = \"{source}\" }}\n")
}

/// Lines that stray leave gaps: √2 σ / √(2 π) of them where they lie as far apart as the spot is wide.
#[test]
fn straying_lines_fill_less() {
    let limit = "[checks]\nfill_rate = \"75 %\"\ncontour_error = \"0.2 mm\"\n";
    let fill = |sigma: &str| {
        let found = strayed(&left_out(sigma, "a test"), limit);
        check(&found, "fill-1").clone()
    };
    let [steady, stray] = ["0.1 µm", "20 µm"].map(fill);
    let [a, b] = [&steady, &stray].map(|c| c.value.as_ref().unwrap().value);
    // 0.020 / √π over 0.05 mm
    assert!((a - b - 22.6).abs() < 0.5, "{a} {b}");
    assert_eq!(steady.status, Status::Pass, "{steady:?}");
    assert_ne!(stray.status, Status::Pass, "{stray:?}");
    says(&stray.reason, &["lines stray by 20 µm"]);
}

/// Where the spot strays by more than these look, nothing is said of light and of what is enclosed; nor of anything by a guess, nor of a fill
/// by a data sheet that tells nothing.
#[test]
fn what_strays_far_or_by_a_guess_is_not_promised() {
    let far = strayed(&left_out("200 µm", "a test"), "");
    for id in ["unlit-1", "enclosed"] {
        assert_eq!(check(&far, id).status, Status::CannotSay, "{far:?}");
    }
    let near = strayed(&left_out("1 µm", "a test"), "");
    for id in ["unlit-1", "enclosed", "contour-1"] {
        assert_eq!(check(&near, id).status, Status::Pass, "{near:?}");
    }
    let limit = "[checks]\nfill_rate = \"50 %\"\n";
    let guessed = strayed(&left_out("1 µm", "a guess"), limit);
    for id in ["unlit-1", "contour-1", "fill-1"] {
        let check = check(&guessed, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, &["a guess: servo.left_out"]);
    }
    let silent = strayed("", limit);
    assert_eq!(check(&silent, "fill-1").status, Status::CannotSay);
}

/// Four neighbouring lines that a file lost over all of its width are a small share of a large layer: the strip is told, and how wide it is.
#[test]
fn a_strip_of_lost_lines_is_told() {
    let dir = folder();
    let lines: Vec<f64> = (1..400).map(|k| 0.1 * f64::from(k)).collect();
    let told = |lost: std::ops::Range<usize>| {
        let mut kept = lines.clone();
        kept.drain(lost);
        let text = square(&kept)
            .replace("0,0,3,0,3,3,0,3,0,0", "0,0,10,0,10,40,0,40,0,0")
            .replace(",0.02,", ",0.1,")
            .replace(",2.98,", ",9.9,");
        write(dir.path(), "a.cli", text);
        verdict(dir.path(), &job("a.cli", ""))
    };
    let all = told(0..0);
    assert!(all.checks.iter().all(|c| c.id != "bare-strip"), "{all:?}");
    assert_eq!(check(&all, "bare-spot").value.as_ref().unwrap().value, 0.0);
    let lost = told(200..204);
    let strip = check(&lost, "bare-strip");
    assert_eq!(strip.status, Status::CannotSay);
    let length = strip.value.as_ref().unwrap().value;
    assert!((9.5..=10.0).contains(&length), "{strip:?}");
    says(&strip.reason, &["0.21 mm wide from mark to mark"]);
    let width = check(&lost, "bare-spot").value.as_ref().unwrap().value;
    assert!((0.4..0.55).contains(&width), "{width}");
}
