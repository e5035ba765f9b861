//! Options of head files, of recipes and of the pre-filter, from the job to what they change.

use std::fs;
use std::path::Path;

use super::{INDUSTRIAL, THREE, figures, refused, run};

/// A job of one small square on the three-axis head, with files of its own.
fn job(head: &str, recipe: &str, more: &str) -> String {
    format!(
        "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"{head}\"\nrecipes = [\"{recipe}\"]\n{more}\n[plate]\nblock = [1, 1]\nside = \"2 mm\"\n"
    )
}

fn marked(out: &Path) -> String {
    fs::read_to_string(out.join("marked-path-1.csv")).unwrap()
}

/// Errata 5 and 6 of the source: the printed sign of K1 tan 2θx and the printed projection of the focus height run as heads of
/// their own, each with the table and the inverse that belong to it.
#[test]
fn printed_forms_of_the_geometry_are_keys_of_head_files() {
    let dir = tempfile::tempdir().unwrap();
    let printed = THREE
        .replace(
            "kind = \"three-axis\"\n",
            "kind = \"three-axis\"\npath_sign = \"printed\"\n",
        )
        .replace("[focus]\n", "[focus]\nprojection = \"thesis\"\n");
    fs::write(dir.path().join("printed.toml"), &printed).unwrap();
    let recipe = "delays = \"recipe\"";
    let own = run(
        dir.path(),
        "own",
        &job("three-axis-350", "industrial", recipe),
    );
    let other = run(
        dir.path(),
        "other",
        &job("printed.toml", "industrial", recipe),
    );
    assert_ne!(marked(&own), marked(&other));
    // with the printed sign the lever between the mirrors is missing: the same square takes larger angles of X, not of Y
    let lag =
        |out: &Path, axis: &str| figures(out, &format!("tracking error of {axis} on marks"))[0];
    let (x, y) = (
        lag(&other, "X") / lag(&own, "X"),
        lag(&other, "Y") / lag(&own, "Y"),
    );
    assert!(x > 1.05 && (0.99..1.01).contains(&y), "{x} {y}");
    for (from, to, words) in [
        ("\"printed\"", "\"minus\"", "\"traced\", \"printed\""),
        ("\"thesis\"", "\"both\"", "\"exact\", \"thesis\""),
    ] {
        odd_head(dir.path(), &printed.replace(from, to), words);
    }
}

/// A file of a head is refused with these words.
fn odd_head(folder: &Path, text: &str, words: &str) {
    fs::write(folder.join("odd.toml"), text).unwrap();
    let job = job("odd.toml", "industrial", "delays = \"recipe\"");
    let error = refused(folder, &job);
    assert!(error.contains(words), "{error}");
}

/// Friction laws of head files: bristles that hold the resting mirror less let it come nearer to its set-point.
#[test]
fn friction_laws_are_keys_of_head_files() {
    let dir = tempfile::tempdir().unwrap();
    let with = |table: &str| {
        let none = "\"0 N·m\", source";
        let free = THREE.replace(
            "\"1e-5 N·m\", low = \"0 N·m\", high = \"3e-5 N·m\", source",
            none,
        );
        ["x", "y"].iter().fold(free, |text, axis| {
            text.replace(
                &format!("[{axis}.tuning]"),
                &format!("[{axis}.friction]\n{table}\n[{axis}.tuning]"),
            )
        })
    };
    let figure = |key: &str, value: &str| {
        format!("{key} = {{ value = \"{value}\", source = \"a guess\" }}\n")
    };
    let karnopp = format!(
        "kind = \"karnopp\"\n{}{}",
        figure("stiction", "3e-5 N·m"),
        figure("rest", "0.001 rad/s")
    );
    let lugre = format!(
        "kind = \"lugre\"\n{}{}{}{}",
        figure("stiction", "1.3e-4 N·m"),
        figure("stribeck", "0.5 rad/s"),
        figure("stiffness", "0.02 N·m/rad"),
        figure("damping", "2e-6 N·m·s/rad")
    );
    let delays = "delays = \"recipe\"";
    let mut paths = Vec::new();
    for (name, table) in [("karnopp", &karnopp), ("lugre", &lugre)] {
        let file = format!("{name}.head.toml");
        fs::write(dir.path().join(&file), with(table)).unwrap();
        let out = run(dir.path(), name, &job(&file, "industrial", delays));
        paths.push(marked(&out));
    }
    let own = run(
        dir.path(),
        "own",
        &job("three-axis-350", "industrial", delays),
    );
    paths.push(marked(&own));
    assert!(paths[0] != paths[1] && paths[0] != paths[2] && paths[1] != paths[2]);

    let biased = with(&lugre).replacen(
        "bias = { value = \"0 N·m\"",
        "bias = { value = \"1e-5 N·m\"",
        1,
    );
    let missing = with(&karnopp.replace("rest", "slow"));
    for (text, words) in [
        (biased, "x.bias is of the Coulomb law alone"),
        (missing, "slow"),
    ] {
        odd_head(dir.path(), &text, words);
    }
}

/// The pre-filter's options: alike, Y lags as it did and X as Y; the first average alone lags less.
#[test]
fn pre_filters_are_alike_or_shorter_on_demand() {
    let dir = tempfile::tempdir().unwrap();
    let lag = |choice: &str| {
        let out = run(
            dir.path(),
            choice,
            &job(
                "three-axis-350",
                "industrial",
                &format!("delays = \"recipe\"\nprefilter = \"{choice}\""),
            ),
        );
        ["X", "Y"].map(|axis| figures(&out, &format!("tracking error of {axis} on marks"))[0])
    };
    let (on, alike, first, off) = (lag("on"), lag("alike"), lag("first-only"), lag("off"));
    assert!((alike[1] / on[1] - 1.0).abs() < 0.01, "{on:?} {alike:?}");
    assert!(alike[0] > 1.02 * on[0], "{on:?} {alike:?}");
    // of 221 and 233 µs, 71 and 83 belong to the second average
    for axis in [0, 1] {
        let share = first[axis] / on[axis];
        assert!((0.55..0.75).contains(&share), "{share}");
        assert!(off[axis] < 0.2 * on[axis], "{off:?}");
    }
    let wrong = job("three-axis-350", "industrial", "prefilter = \"second\"");
    assert!(refused(dir.path(), &wrong).contains("first-only"));
}

/// Power with speed: never above the recipe's nor below its least; less energy where the spot is slow under light.
#[test]
fn power_follows_the_speed_down_to_the_recipes_least() {
    let dir = tempfile::tempdir().unwrap();
    let with = format!(
        "{INDUSTRIAL}power_down_to = {{ value = \"60 W\", source = \"the laser's data sheet\" }}\n"
    );
    fs::write(dir.path().join("with.toml"), &with).unwrap();
    let more = "delays = \"recipe\"";
    let output = "[output]\nmotion = \"csv\"\n";
    let plain = run(
        dir.path(),
        "plain",
        &(job("two-axis-150", "industrial", more) + output),
    );
    let led = run(
        dir.path(),
        "led",
        &(job("two-axis-150", "with.toml", more) + output),
    );
    let powers = |out: &Path| -> Vec<f64> {
        let text = fs::read_to_string(out.join("series/motion-1.csv")).unwrap();
        text.lines()
            .skip(1)
            .map(|l| l.split(',').nth(5).unwrap().parse().unwrap())
            .collect()
    };
    let (a, b) = (powers(&plain), powers(&led));
    assert_eq!(a.len(), b.len());
    assert_eq!(marked(&plain), marked(&led), "the path is not changed");
    assert!(a.iter().all(|p| (0.0..=300.0).contains(p)));
    assert!(
        a.iter()
            .zip(&b)
            .all(|(a, b)| b <= a && *b >= 0.2 * a - 1e-9)
    );
    assert!(b.iter().any(|p| *p > 60.0 && *p < 299.0));
    // contours wait at corners under light
    let row = "energy a millimetre, contours, 99 %";
    let (before, after) = (figures(&plain, row)[0], figures(&led, row)[0]);
    assert!(after < 0.6 * before, "{before} {after}");

    fs::write(
        dir.path().join("much.toml"),
        with.replace("\"60 W\"", "\"400 W\""),
    )
    .unwrap();
    let error = refused(dir.path(), &job("two-axis-150", "much.toml", more));
    assert!(error.contains("least power with speed"), "{error}");
}

/// Sky-writing: lines of fills are marked at their speed, without waits. Runs last longer than the pre-filter of 650 µs.
#[test]
fn runs_before_and_after_lines_keep_them_at_speed() {
    let dir = tempfile::tempdir().unwrap();
    let time =
        |key: &str, t: &str| format!("{key} = {{ value = \"{t}\", source = \"a trial\" }}\n");
    let sky = INDUSTRIAL.to_owned() + &time("run_in", "1 ms") + &time("run_out", "1 ms");
    fs::write(dir.path().join("sky.toml"), &sky).unwrap();
    let plain = run(dir.path(), "plain", &job("two-axis-150", "industrial", ""));
    let flown = run(dir.path(), "flown", &job("two-axis-150", "sky.toml", ""));
    let row = "energy a millimetre, fills, 99 %";
    let (before, after) = (figures(&plain, row)[0], figures(&flown, row)[0]);
    // the shortest lines are lit too: with delays that leave them dark 115 % are reached, and a fill of 44 % in place of 53 %
    assert!(after < 0.7 * before && after < 135.0, "{before} {after}");
    let fill = figures(&flown, "fill rate, cell centres under the swept spot, %")[0];
    assert!(fill > 50.0, "{fill}");
    fs::write(
        dir.path().join("back.toml"),
        sky.replacen("\"1 ms\"", "\"-1 ms\"", 1),
    )
    .unwrap();
    let error = refused(dir.path(), &job("two-axis-150", "back.toml", ""));
    assert!(error.contains("run_in is -0.001 s"), "{error}");
}

/// Lines nearer to each other than the mirrors keep apart: light at their starts is spurious for long, and a delay that waited for its end
/// would mark nothing.
#[test]
fn delays_do_not_darken_the_marks_for_the_sake_of_their_starts() {
    let dir = tempfile::tempdir().unwrap();
    let text = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"three-axis-350\"\nrecipes = [\"industrial\"]\n[plate]\nblock = [1, 1]\nside = \"1.5 mm\"\nhatch = \"0.045 mm\"\n";
    let out = run(dir.path(), "narrow", text);
    let verdict = fs::read_to_string(out.join("verdict.json")).unwrap();
    assert!(verdict.contains("spurious-light"), "{verdict}");
    let on = figures(&out, "laser-on delay, µs")[0];
    let fill = figures(&out, "fill rate, cell centres under the swept spot, %")[0];
    assert!(on < 800.0 && fill > 50.0, "{on} µs, {fill} %");
}
