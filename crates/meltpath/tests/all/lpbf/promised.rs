//! What a pass of a scan head's job promises, and what is refused since nothing could be promised of it: on a head whose mirrors
//! follow their command with a delay, so that every figure is known beforehand.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Silent, Status, Verdict};

use super::refused;
use crate::support::{check, says, warned, write};

pub(super) const HEAD: &str = r#"[head]
name = "by its data sheet"
sampling = { value = "100 kHz", source = "a test" }
field = { value = "200 mm", source = "a test" }
[geometry]
kind = "f-theta"
focal_length = { value = "330 mm", source = "a test" }
[beam]
waist = { value = "25 µm", source = "a test" }
wavelength = { value = "1070 nm", source = "a test" }
quality = { value = "1.1 1", source = "a test" }
[servo]
tracking_delay = { value = "0.32 ms", source = "a test" }
top_speed = { value = "11 m/s", source = "a test" }
step_length = { value = "20 mm", source = "a test" }
step_time = { value = "3.2 ms", source = "a test" }
bits = 20
left_out = { value = "1 µm", source = "a test" }
"#;

/// A recipe that marks well, with a laser-on delay of `on`.
pub(super) fn recipe(on: &str) -> String {
    let mut text = String::from("name = \"mine\"\n");
    for (key, value) in [
        ("contour_speed", "800 mm/s"),
        ("fill_speed", "800 mm/s"),
        ("contour_jump_speed", "5000 mm/s"),
        ("fill_jump_speed", "5000 mm/s"),
        ("power", "200 W"),
        ("jump_wait", "1 ms"),
        ("mark_wait", "0.5 ms"),
        ("polygon_wait", "0.5 ms"),
        ("laser_on_delay", on),
        ("laser_off_delay", "320 µs"),
    ] {
        writeln!(
            text,
            "{key} = {{ value = \"{value}\", source = \"a test\" }}"
        )
        .unwrap();
    }
    text
}

pub(super) fn job(file: &str, tables: &str) -> String {
    format!(
        "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"head.toml\"\nrecipes = [\"recipe.toml\"]\ndelays = \"recipe\"\nlayers = \"{file}\"\n{tables}"
    )
}

pub(super) fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "head.toml", HEAD);
    write(dir.path(), "recipe.toml", recipe("320 µs"));
    dir
}

pub(super) fn verdict(folder: &Path, text: &str) -> Verdict {
    let job = write(folder, "job.toml", text);
    let out = folder.join("out");
    let verdict = chain::run(&job, At(&out), &Silent).unwrap().verdict;
    fs::remove_dir_all(out).unwrap();
    verdict
}

/// A text CLI file: for each layer the distance of its hatch over a square of 3 mm, none for its contour alone; its header tells
/// `told` layers.
pub(super) fn cli(hatches: &[Option<f64>], told: usize) -> String {
    let mut text = format!(
        "$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$VERSION/200\n$$LAYERS/{told}\n$$HEADEREND\n$$GEOMETRYSTART\n"
    );
    for (k, hatch) in hatches.iter().enumerate() {
        writeln!(text, "$$LAYER/{}", 0.03 * (k + 1) as f64).unwrap();
        text.push_str("$$POLYLINE/1,1,5,0,0,3,0,3,3,0,3,0,0\n");
        let Some(hatch) = hatch else { continue };
        let lines = (2.8 / hatch) as usize;
        write!(text, "$$HATCHES/1,{lines}").unwrap();
        for line in 0..lines {
            let y = 0.1 + hatch * line as f64;
            write!(text, ",0.1,{y},2.9,{y}").unwrap();
        }
        text.push('\n');
    }
    text.push_str("$$GEOMETRYEND\n");
    text
}

/// Layers of contours alone do not make up for one that the spot half fills, nor do well filled ones for a bad one.
#[test]
fn a_badly_filled_layer_fails_whatever_the_others() {
    let dir = folder();
    let tables = |last: usize| {
        format!(
            "[layers]\nrange = [1, {last}]\nhatch = \"0.1 mm\"\n[checks]\nfill_rate = \"75 %\"\n"
        )
    };
    let diluted = [Some(0.1), None, None, None, None];
    write(dir.path(), "a.cli", cli(&diluted, 5));
    let told = verdict(dir.path(), &job("a.cli", &tables(5)));
    let fill = check(&told, "fill-1");
    assert_eq!(fill.status, Status::Fail, "{fill:?}");
    // the spot of 50 µm covers half of what lies 0.1 mm apart, a rim of 0.05 mm between lines and contour is half bare, too, and behind
    // the last line 0.1 mm more
    let value = fill.value.as_ref().unwrap().value;
    assert!((value - 46.0).abs() < 3.0, "{value}");
    assert_eq!(fill.place.as_ref().unwrap().layer, Some(1));

    let hidden = [Some(0.05), Some(0.05), Some(0.05), Some(0.1), Some(0.05)];
    write(dir.path(), "a.cli", cli(&hidden, 5));
    let told = verdict(dir.path(), &job("a.cli", &tables(5)));
    let fill = check(&told, "fill-1");
    assert_eq!(fill.status, Status::Fail, "{fill:?}");
    assert_eq!(fill.place.as_ref().unwrap().layer, Some(4));
    says(
        &fill.reason,
        &["the worst layer or square of 5", "of their whole surface"],
    );

    // contours alone have no fill rate: a limit that is written of it cannot be kept, nor passed over
    write(dir.path(), "a.cli", cli(&[None, None], 2));
    let told = verdict(dir.path(), &job("a.cli", &tables(2)));
    assert_eq!(check(&told, "fill-1").status, Status::CannotSay);
    assert_eq!(check(&told, "enclosed").status, Status::NotChecked);
    assert_eq!(check(&told, "contour-1").status, Status::Pass);
    // a layer that lost its lines is one of a file that has some, whichever is judged
    write(dir.path(), "a.cli", cli(&[Some(0.05), None], 2));
    let told = verdict(dir.path(), &job("a.cli", "[layers]\nrange = [2, 2]\n"));
    let bare = check(&told, "enclosed");
    assert_eq!(bare.status, Status::CannotSay, "{bare:?}");
    assert!(bare.value.as_ref().unwrap().value > 90.0, "{bare:?}");
}

/// The same lines anywhere under the head have the same fill rate, which is no more than the spot's width over their distance, and less by
/// what lies bare between them and their contour.
#[test]
fn the_fill_rate_does_not_depend_on_where_lines_lie() {
    let dir = folder();
    write(dir.path(), "a.cli", cli(&[Some(0.075)], 1));
    let mut found = Vec::new();
    for origin in ["0 mm", "0.013 mm", "0.031 mm"] {
        let tables = format!(
            "[layers]\norigin = [\"{origin}\", \"{origin}\"]\n[checks]\nfill_rate = \"60 %\"\n"
        );
        let told = verdict(dir.path(), &job("a.cli", &tables));
        let fill = check(&told, "fill-1");
        found.push(fill.value.as_ref().unwrap().value);
    }
    let [low, high] = [f64::min, f64::max].map(|f| found.iter().copied().reduce(f).unwrap());
    assert!(high - low < 0.3 && high < 64.0 && low > 57.0, "{found:?}");
}

const SQUARE: &str = "kind,x_mm,y_mm,speed_mm_s,power_W,wait_s,layer,height_mm\nstart,0,0,,,,1,0.03\n\
    contour,10,0,,,,1,0.03\ncontour,10,10,,,,1,0.03\ncontour,0,10,,,,1,0.03\ncontour,0,0,,,,1,0.03\n";

/// A contour whose light comes too late is good as far as it goes: what stays dark fails it, with the place.
#[test]
fn a_contour_that_stays_dark_fails() {
    let dir = folder();
    write(dir.path(), "a.csv", SQUARE);
    let good = verdict(dir.path(), &job("a.csv", ""));
    for id in ["contour-1", "unlit-1"] {
        assert_eq!(check(&good, id).status, Status::Pass, "{:?}", good.checks);
    }
    // 1.1 ms late: 0.62 mm of the first side stay dark
    write(dir.path(), "recipe.toml", recipe("1100 µs"));
    let late = verdict(dir.path(), &job("a.csv", ""));
    let unlit = check(&late, "unlit-1");
    assert_eq!(unlit.status, Status::Fail, "{unlit:?}");
    let dark = unlit.value.as_ref().unwrap().value;
    assert!((0.4..0.7).contains(&dark), "{dark}");
    let place = unlit.place.as_ref().unwrap();
    assert_eq!(place.layer, Some(1));
    assert!(place.position.unwrap()[1].abs() < 0.1, "{place:?}");
    let [good, late] = [&good, &late].map(|v| check(v, "contour-1").value.as_ref().unwrap().value);
    assert!(
        (good - late - 100.0 * dark / 40.0).abs() < 0.1,
        "{good} {late}"
    );

    // nearly all of a mark of 1 mm, which lasts as long as its delays leave light for 48 µm
    write(dir.path(), "recipe.toml", recipe("1190 µs"));
    let short = "kind,x_mm,y_mm\nstart,0,0\ncontour,0.76,0\n";
    write(dir.path(), "a.csv", short);
    let short = verdict(dir.path(), &job("a.csv", ""));
    assert_eq!(check(&short, "contour-1").status, Status::Fail, "{short:?}");
    assert_eq!(check(&short, "unlit-1").status, Status::Fail, "{short:?}");
}

/// Files that are cut short, ranges beyond them, marks without power, waits and speeds of a wrong unit are refused with their place.
#[test]
fn what_cannot_be_promised_is_refused_with_its_place() {
    let dir = folder();
    write(dir.path(), "cut.cli", cli(&[Some(0.1), None, None], 8));
    let told = refused(dir.path(), &job("cut.cli", "[layers]\nrange = [1, 3]\n"));
    says(&told, &["$$LAYERS tells 8 layers", "holds 3", "cut short"]);
    write(dir.path(), "whole.cli", cli(&[Some(0.1), None, None], 3));
    let told = refused(dir.path(), &job("whole.cli", "[layers]\nrange = [2, 9]\n"));
    says(&told, &["2 to 9", "holds the layers 1 to 3"]);
    for (line, words) in [
        ("contour,5,0,,0,,1,0.03", ["line 3", "power_W is 0"]),
        ("contour,5,0,,1e9,,1,0.03", ["line 3", "at most 1000000"]),
        ("contour,5,0,,,1e9,1,0.03", ["line 3", "at most 3600"]),
        ("contour,5,0,1e9,,,1,0.03", ["line 3", "at most 1000000"]),
        // 5 mm at 0.1 µm/s are 14 hours each
        (
            "contour,5,0,1e-4,,,1,0.03\ncontour,0,0,1e-4,,,1,0.03",
            ["27.8 h", "more than a day"],
        ),
    ] {
        let [head, start] = [0, 1].map(|k| SQUARE.lines().nth(k).unwrap());
        write(dir.path(), "a.csv", format!("{head}\n{start}\n{line}\n"));
        let told = refused(dir.path(), &job("a.csv", ""));
        says(&told, &words);
    }
    write(dir.path(), "a.csv", SQUARE);
    write(dir.path(), "recipe.toml", recipe("6 ms"));
    let told = refused(dir.path(), &job("a.csv", ""));
    says(&told, &["6000 µs", "longest_laser_delay, 1200 µs"]);
}

/// Layers that do not rise are told with their number.
#[test]
fn layers_out_of_order_are_told() {
    let dir = folder();
    for (height, out_of_order) in [("0.06", false), ("0.03", true), ("0.01", true)] {
        let second = SQUARE
            .lines()
            .skip(1)
            .map(|l| l.replace(",1,0.03", &format!(",2,{height}")) + "\n");
        let text = SQUARE.to_owned() + &second.collect::<String>();
        write(dir.path(), "a.csv", text);
        let told = verdict(dir.path(), &job("a.csv", "[layers]\nrange = [1, 2]\n"));
        assert_eq!(
            warned(&told, "layers-out-of-order"),
            out_of_order,
            "{height}"
        );
    }
}

/// A recipe search on a file: what it tries, and what of it holds on the whole job.
fn searched(folder: &Path, layers: &[Option<f64>], optimise: &str) -> Verdict {
    write(folder, "a.cli", cli(layers, layers.len()));
    let tables = format!(
        "[layers]\nrange = [1, {}]\nhatch = \"0.1 mm\"\n[optimise]\nmark_waits = [\"0.5 ms\"]\njump_factors = [\"100 %\"]\nfilter_factors = [\"100 %\"]\nfill_speed = [\"700 mm/s\", \"1000 mm/s\"]\n{optimise}",
        layers.len()
    );
    let text = job("a.cli", &tables).replace("delays = \"recipe\"\n", "");
    verdict(folder, &text)
}

/// The search looks at a piece of the first layer: a later one that fills worse than its bound fails, and nothing is said to be
/// within the bounds.
#[test]
fn what_a_search_found_is_judged_on_the_whole_job() {
    let dir = folder();
    for (layers, status) in [
        ([Some(0.05), Some(0.05)], Status::Pass),
        ([Some(0.05), Some(0.1)], Status::Fail),
    ] {
        let told = searched(dir.path(), &layers, "fill_rate = \"80 %\"\n");
        assert_eq!(check(&told, "optimise-fill").status, status, "{told:?}");
        let saved = told.facts.iter().find(|f| f.id == "optimise").unwrap();
        let within = saved.title.contains("within the bounds");
        assert_eq!(within, status == Status::Pass, "{}", saved.title);
    }
}

/// Where no contour is marked none was tried: their speed stays that of the recipe.
#[test]
fn what_was_not_tried_stays_as_the_recipe_has_it() {
    let dir = folder();
    let lines = cli(&[Some(0.05)], 1);
    let lines = lines.lines().filter(|l| !l.starts_with("$$POLYLINE"));
    let lines: String = lines.map(|l| l.to_owned() + "\n").collect();
    write(dir.path(), "lines.cli", lines);
    let tables = "[optimise]\nmark_waits = [\"0.5 ms\"]\njump_factors = [\"100 %\"]\nfilter_factors = [\"100 %\"]\nfill_speed = [\"700 mm/s\", \"1000 mm/s\"]\n";
    let text = job("lines.cli", tables).replace("delays = \"recipe\"\n", "");
    let path = write(dir.path(), "job.toml", text);
    let out = dir.path().join("out");
    chain::run(&path, At(&out), &Silent).unwrap();
    let found = fs::read_to_string(out.join("recipe-optimised.toml")).unwrap();
    says(&found, &["contour_speed = { value = \"800.000 mm/s\""]);
}
