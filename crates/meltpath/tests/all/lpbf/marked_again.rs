//! Marks over marks, marks too weak beside others that boil, and marks out of focus: what is reckoned with a spot in focus on a cold bed
//! promises nothing of them.

use std::fmt::Write as _;
use std::path::Path;

use meltpath_base::{Check, Status, Verdict};

use super::promised::{HEAD, folder, job, verdict};
use crate::support::{check, foretold, refusal, says, warned, write};

/// Rows of a square of 1.6 mm whose fill is marked with `power` W (blank: the recipe's) in a focus `z` mm over the plane, and of what follows.
fn square(power: &str, z: &str, more: &str) -> String {
    let mut rows = String::from(
        "kind,x_mm,y_mm,z_mm,power_W,layer,height_mm\nstart,0,0,,,1,0.02\ncontour,1.6,0,,,1,0.02\ncontour,1.6,1.6,,,1,0.02\ncontour,0,1.6,,,1,0.02\ncontour,0,0,,,1,0.02\n",
    );
    for line in 0..15 {
        let y = 0.1 + 0.1 * f64::from(line);
        writeln!(rows, "jump,0.1,{y},{z},,1,0.02").unwrap();
        writeln!(rows, "fill,1.5,{y},{z},{power},1,0.02").unwrap();
    }
    rows + more
}

/// A head and a recipe under which these squares pass.
fn set_up(folder: &Path) {
    let head = HEAD.replace("25 µm", "60 µm").replace("0.32 ms", "0.1 ms");
    write(folder, "head.toml", head);
    let recipe = super::promised::recipe("100 µs");
    let recipe = recipe
        .replace("200 W", "250 W")
        .replace("\"320 µs\"", "\"100 µs\"");
    let recipe = recipe.replace(
        "polygon_wait = { value = \"0.5 ms\"",
        "polygon_wait = { value = \"0 ms\"",
    );
    write(
        folder,
        "recipe.toml",
        recipe + "power_down_to = { value = \"20 W\", source = \"a test\" }\n",
    );
}

const HEAT: &str = "[heat]\nlayer = \"20 µm\"\n[checks]\nfusion = \"85 %\"\n";

fn told(rows: &str, tables: &str) -> Verdict {
    let dir = folder();
    set_up(dir.path());
    write(dir.path(), "a.csv", rows);
    verdict(dir.path(), &job("a.csv", tables))
}

fn value(check: &Check) -> f64 {
    check.value.as_ref().unwrap().value
}

/// Lines to and fro over 0.4 mm, each a little beside the one before.
fn to_and_fro(count: u32, aside: f64) -> String {
    let mut rows = String::from("jump,0.6,0.6,,,1,0.02\n");
    for k in 0..count {
        let x = if k % 2 == 0 { 1.0 } else { 0.6 };
        let y = 0.6 + aside * f64::from(k % 5);
        writeln!(rows, "fill,{x},{y},,,1,0.02").unwrap();
    }
    rows
}

/// One line drawn forty times on end heats its place until it boils; drawn once more long after it hardly does.
#[test]
fn a_line_drawn_again_and_again_is_judged_on_what_it_left() {
    let once = told(&square("", "", ""), HEAT);
    for id in ["fusion-1", "keyhole-1"] {
        assert_eq!(check(&once, id).status, Status::Pass, "{once:?}");
    }
    assert!(once.checks.iter().all(|c| c.id != "again-1"));
    assert!(!warned(&once, "marked-twice"));
    for aside in [0.0, 0.002] {
        let often = told(&square("", "", &to_and_fro(41, aside)), HEAT);
        let again = check(&often, "again-1");
        assert_eq!(again.status, Status::CannotSay, "{again:?}");
        assert!(value(again) > 1600.0, "{again:?}");
        says(&again.reason, &["marks go over it", "one pool"]);
        let keyhole = check(&often, "keyhole-1");
        assert_eq!(keyhole.status, Status::CannotSay, "{keyhole:?}");
        says(
            &keyhole.reason,
            &["on a cold bed", "keyhole number at least"],
        );
        let [x, y, _] = keyhole.place.as_ref().unwrap().position.unwrap();
        assert!((0.6..=1.0).contains(&x) && (0.59..0.62).contains(&y));
        let note = often.warnings.iter().find(|w| w.code == "marked-twice");
        says(&note.unwrap().message, &["marks on one place", "again-1"]);
    }
    let late = "jump,0.1,0.5,,,1,0.02\nfill,1.5,0.5,,,1,0.02\n";
    let twice = told(&square("", "", late), HEAT);
    let again = check(&twice, "again-1");
    assert!(
        again.status == Status::Pass && value(again) < 100.0,
        "{again:?}"
    );
    assert_eq!(check(&twice, "keyhole-1").status, Status::Pass);
    // without heat they are counted
    let counted = told(&square("", "", &to_and_fro(41, 0.0)), "");
    let note = counted.warnings.iter().find(|w| w.code == "marked-twice");
    says(
        &note.unwrap().message,
        &["up to 42 marks on one place", "not judged without [heat]"],
    );
}

/// A square of 0.9 mm: contours of the recipe's power, within them lines of 0.6 mm and `power` W to and fro, `apart` mm from one to the next,
/// each `times` times.
fn short_lines(power: u32, apart: f64, times: u32) -> String {
    let mut rows = String::from(
        "kind,x_mm,y_mm,z_mm,power_W,layer,height_mm\nstart,0,0,,,1,0.02\ncontour,0.9,0,,,1,0.02\ncontour,0.9,0.9,,,1,0.02\ncontour,0,0.9,,,1,0.02\ncontour,0,0,,,1,0.02\njump,0.15,0.15,,,1,0.02\n",
    );
    let lines = (0.6 / apart + 1e-9) as u32;
    for k in 0..(lines + 1) * times {
        let x = if k % 2 == 0 { 0.75 } else { 0.15 };
        let y = 0.15 + apart * f64::from(k / times);
        writeln!(rows, "fill,{x},{y},,{power},1,0.02").unwrap();
    }
    rows
}

/// Lines that melt enough of the layer together, drawn again or so close that the metal is still liquid between them: the engine sums their
/// heat, and does not know what a melt does that is heated again. What lines melt on solid ground it knows.
#[test]
fn what_only_one_pool_melts_is_not_promised() {
    for (power, apart, times, share, status) in [
        (250, 0.1, 4, "85 %", Status::CannotSay),
        (250, 0.05, 1, "75 %", Status::CannotSay),
        // with what falls on solid ground alone it is enough
        (250, 0.05, 1, "60 %", Status::Pass),
        (250, 0.1, 1, "65 %", Status::Pass),
        // too little were all molten beside them
        (80, 0.1, 8, "85 %", Status::Fail),
    ] {
        let heat = HEAT.replace("85 %", share);
        let found = told(&short_lines(power, apart, times), &heat);
        let fusion = check(&found, "fusion-1");
        let case = format!("{power} W, {apart} mm, {times} times, {share}: {fusion:?}");
        assert_eq!(fusion.status, status, "{case}");
        // the share that the engine tells is what passed before
        let told = value(fusion) >= share.trim_end_matches(" %").parse().unwrap();
        assert_eq!(told, status != Status::Fail, "{case}");
        if status == Status::CannotSay {
            says(&fusion.reason, &["still liquid", "without that heat"]);
            let [x, y, _] = fusion.place.as_ref().unwrap().position.unwrap();
            assert!((0.1..0.8).contains(&x) && (0.1..0.8).contains(&y), "{case}");
        }
    }
}

/// Vapour under the contours excuses no fill that melts nothing.
#[test]
fn what_boils_elsewhere_excuses_no_powder() {
    let weak = told(&square("5", "", ""), HEAT);
    let fusion = check(&weak, "fusion-1");
    assert_eq!(fusion.status, Status::Fail, "{fusion:?}");
    says(&fusion.reason, &["vapour deepens some of the pools"]);
    // where all marks bring vapour the share stays a lower bound
    let deep = HEAT.replace("20 µm", "90 µm");
    let thick = told(&square("", "", ""), &deep);
    assert_eq!(check(&thick, "fusion-1").status, Status::CannotSay);
}

/// A head without a focus axis cannot mark out of focus; one with it does, and what is reckoned with the spot in focus says nothing.
#[test]
fn marks_out_of_focus_are_refused_or_not_promised() {
    let dir = folder();
    set_up(dir.path());
    let file = |z: &str| write(dir.path(), "a.csv", square("", z, ""));
    file("8");
    let wrong = write(dir.path(), "wrong.toml", job("a.csv", ""));
    let told = refusal(&wrong);
    says(
        &told,
        &[
            "line 7",
            "8 mm over the plane",
            "78.1 µm in radius for 60 µm",
        ],
    );
    foretold(&told, &wrong);
    // a tenth of the Rayleigh length is focus enough
    file("1");
    let near = verdict(dir.path(), &job("a.csv", ""));
    assert!(near.checks.iter().all(|c| c.id != "spot-1"));
    let moves = job("a.csv", HEAT).replace("head.toml", "three-axis-350");
    file("-5");
    let far = verdict(dir.path(), &moves);
    let spot = check(&far, "spot-1");
    assert_eq!(spot.status, Status::CannotSay);
    says(&spot.reason, &["5 mm below the plane", "35 µm in focus"]);
    for id in ["fusion-1", "keyhole-1"] {
        let check = check(&far, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, &["reckoned with the spot in focus"]);
    }
    assert!(far.facts.iter().all(|f| f.id != "fill-1"));
}

/// Powers of jumps are passed over, and told.
#[test]
fn powers_of_jumps_are_told() {
    let rows = square("", "", "jump,0,0,,200,1,0.02\n");
    let found = told(&rows, "");
    let note = found
        .warnings
        .iter()
        .find(|w| w.code == "power-without-light");
    says(&note.unwrap().message, &["1 vectors", "line 37"]);
    assert!(!warned(
        &told(&square("", "", ""), ""),
        "power-without-light"
    ));
}
