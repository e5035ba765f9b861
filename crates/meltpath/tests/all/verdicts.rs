//! Remedies of verdicts are applied: what a check says to change is changed in the job, and the check passes then.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::{check, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::{chain, tune};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::{Mesh, shapes};

use super::names::in_style;

fn run(folder: &Path, text: &str) -> Verdict {
    let job = write(folder, "job.toml", text);
    let outcome = chain::run(&job, NextIn(&folder.join("runs")), &Silent).unwrap();
    assert!(in_style(&outcome.folder) > 3);
    outcome.verdict
}

/// A check that does not pass, in a job where `from` stands as `bad`; what its remedy names, and the job with that written.
struct Case {
    id: &'static str,
    from: &'static str,
    bad: &'static str,
    named: &'static str,
    cure: &'static str,
}

/// Verdicts of the jobs that ran in a folder: many cases share the job that is good.
struct Runs<'a> {
    folder: &'a Path,
    done: BTreeMap<String, Verdict>,
}

impl<'a> Runs<'a> {
    fn new(folder: &'a Path) -> Self {
        let done = BTreeMap::new();
        Runs { folder, done }
    }

    fn verdict(&mut self, text: String) -> &Verdict {
        let folder = self.folder;
        self.done
            .entry(text)
            .or_insert_with_key(|text| run(folder, text))
    }
}

impl Case {
    fn is_cured_by_its_remedy(&self, runs: &mut Runs<'_>, good: &str) {
        let Case {
            id,
            from,
            bad,
            named,
            cure,
        } = *self;
        assert!(good.contains(from), "{from}");
        let before = runs.verdict(good.replacen(from, bad, 1));
        let failed = check(before, id);
        assert!(
            matches!(failed.status, Status::Fail | Status::CannotSay),
            "{failed:?}"
        );
        let remedy = failed.remedy.as_deref().unwrap_or_default();
        assert!(remedy.contains(named), "{id}: {remedy}");
        let after = runs.verdict(good.replacen(from, cure, 1));
        let passed = check(after, id);
        assert_eq!(passed.status, Status::Pass, "{passed:?}");
    }
}

const WAAM: &str = r#"part = "part.stl"
build_direction = [0.0, 0.0, 1.0]
[process]
kind = "waam"
[waam]
wire = "x90-ig-1.0"
gas = "m14"
mode = "cmt"
[waam.bead]
wire_feed = "8 m/min"
travel_speed = "0.75 m/min"
[layers]
height = "auto"
pause = "30 s"
[fill]
strategy = "hybrid"
stepover = "auto"
spacing = "adjust"
[machine]
cell = "arcmate-120ic"
smoothing = "50 %"
ctwd = "15 mm"
[target]
allowance = "2 mm"
[checks]
accumulation = "62 %"
"#;

fn part(folder: &Path, mesh: &Mesh) {
    let mut file = fs::File::create(folder.join("part.stl")).unwrap();
    write_stl(mesh, "part", &mut file).unwrap();
}

const HEIGHT: &str = "height = \"auto\"";
const THIN: &str = "height = \"1.2 mm\"";
const THICK: &str = "height = \"4 mm\"";
const CTWD: &str = "ctwd = \"15 mm\"";
const NEAR: &str = "ctwd = \"9 mm\"";
const FAR: &str = "ctwd = \"21 mm\"";
const SMOOTHING: &str = "smoothing = \"50 %\"";
const ROUGH: &str = "smoothing = \"0 %\"";
// where the torch waits layers are planned as much higher, and less metal lies beyond the part than the usual limit allows: a closer one
const USUAL_EXCESS: &str =
    "smoothing = \"50 %\"\nctwd = \"15 mm\"\n[target]\nallowance = \"2 mm\"\n[checks]\n";
const ROUGH_EXCESS: &str = "smoothing = \"0 %\"\nctwd = \"15 mm\"\n[target]\nallowance = \"2 mm\"\n[checks]\nexcess = \"12 %\"\n";
const LITTLE_EXCESS: &str = "smoothing = \"50 %\"\nctwd = \"15 mm\"\n[target]\nallowance = \"2 mm\"\n[checks]\nexcess = \"12 %\"\n";
const ALLOWANCE: &str = "allowance = \"2 mm\"";
const NONE: &str = "allowance = \"0 mm\"\nallowance_top = \"0 mm\"";
const BARE: &str = "allowance = \"2 mm\"\nallowance_top = \"0 mm\"";
const COVERED: &str = "allowance = \"2 mm\"\nallowance_top = \"4 mm\"";
const STEPOVER: &str = "stepover = \"auto\"";
const WIDE: &str = "stepover = \"0.95 w\"";
const CLOSE: &str = "stepover = \"0.70 w\"";
const SMALL: &str = "[substrate]\nsize = [\"42 mm\", \"42 mm\"]\n[target]";
const LARGE: &str = "[substrate]\nsize = [\"90 mm\", \"90 mm\"]\n[target]";
const AUTO: &str = "write layers.height = \"auto\"";

#[rustfmt::skip]
const CASES: &[Case] = &[
    Case { id: "excess", from: HEIGHT, bad: THIN, named: AUTO, cure: HEIGHT },
    Case { id: "height", from: HEIGHT, bad: THIN, named: AUTO, cure: HEIGHT },
    Case { id: "ctwd-min", from: HEIGHT, bad: THIN, named: AUTO, cure: HEIGHT },
    Case { id: "lack", from: HEIGHT, bad: THICK, named: AUTO, cure: HEIGHT },
    Case { id: "ctwd-known", from: HEIGHT, bad: THICK, named: AUTO, cure: HEIGHT },
    Case { id: "ctwd-min", from: CTWD, bad: NEAR, named: "machine.ctwd", cure: CTWD },
    Case { id: "ctwd-max", from: CTWD, bad: FAR, named: "machine.ctwd", cure: CTWD },
    Case { id: "ctwd-known", from: CTWD, bad: FAR, named: "machine.ctwd", cure: CTWD },
    Case { id: "excess", from: USUAL_EXCESS, bad: ROUGH_EXCESS, named: "machine.smoothing", cure: LITTLE_EXCESS },
    Case { id: "accumulation", from: SMOOTHING, bad: ROUGH, named: "machine.smoothing", cure: SMOOTHING },
    Case { id: "lack", from: ALLOWANCE, bad: NONE, named: "raise target.allowance", cure: ALLOWANCE },
    Case { id: "stock", from: ALLOWANCE, bad: BARE, named: "raise target.allowance_top", cure: COVERED },
    Case { id: "flatness", from: STEPOVER, bad: WIDE, named: "a smaller fill.stepover", cure: CLOSE },
    Case { id: "flatness", from: SMOOTHING, bad: ROUGH, named: "machine.smoothing", cure: SMOOTHING },
    Case { id: "plate", from: "[target]", bad: SMALL, named: "substrate.size", cure: LARGE },
];

#[test]
fn remedies_of_a_wire_arc_verdict_are_true() {
    let folder = tempfile::tempdir().unwrap();
    let block = shapes::extrude(&[shapes::plate(40.0, 24.0)], 8.0);
    part(folder.path(), &block);
    let mut runs = Runs::new(folder.path());
    for case in CASES {
        case.is_cured_by_its_remedy(&mut runs, WAAM);
    }
    // a cone on its tip hangs over; turned, it does not
    part(folder.path(), &shapes::cone(20.0, 8.0, 10.0));
    let turned = Case {
        id: "overhang",
        from: "[0.0, 0.0, 1.0]",
        bad: "[0.0, 0.0, -1.0]",
        named: "build_direction",
        cure: "[0.0, 0.0, 1.0]",
    };
    turned.is_cured_by_its_remedy(&mut Runs::new(folder.path()), WAAM);
}

/// Lines of 2 mm over a square. The charts see most of it below the window of the thesis.
#[test]
fn remedies_of_an_electron_beams_verdict_are_true() {
    let folder = tempfile::tempdir().unwrap();
    let job = "[process]\nkind = \"ebm\"\n[ebm]\n[hatch]\n[charts]\nmemory = \"none\"\nspacing = \"50 µm\"\n[simulation]\nframes = 2\n\
         [region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"2 mm\", \"2 mm\"], [\"0 mm\", \"2 mm\"]]\n[judge]\nsolver = \"none\"\n";
    let good = |verdict: &Verdict| {
        let fact = verdict.facts.iter().find(|f| f.id == "in-window-charts");
        fact.unwrap().value.as_ref().unwrap().value
    };
    let before = run(folder.path(), job);
    let remedy = check(&before, "in-window").remedy.clone().unwrap();
    for named in ["more power", "[optimise]", "window.body", "[judge]"] {
        assert!(remedy.contains(named), "{remedy}");
    }
    let told = |verdict: &Verdict| {
        let mut all = verdict.warnings.iter();
        let found = all.find(|w| w.code == "charts-saturated");
        found.map(|w| w.remedy.clone().unwrap())
    };
    assert!(told(&before).unwrap().contains("charts.stop"));
    let cured = job.replace(
        "[charts]\n",
        "[window]\nbody = [\"2 mm\", \"2 mm\"]\n[charts]\nstop = \"3700 °C\"\n",
    );
    let after = run(folder.path(), &cured);
    assert!(good(&after) > good(&before) + 5.0, "{after:?}");
    assert_eq!(told(&after), None);
    let remedy = check(&after, "in-window").remedy.clone().unwrap();
    assert!(
        !remedy.contains("window.body") && remedy.contains("[judge]"),
        "{remedy}"
    );
}

const JUDGED: &str = r#"[process]
kind = "ebm"
[ebm]
efficiency = "50 %"
[hatch]
current = "4.5 mA"
overrun = "0.15 mm"
[charts]
spacing = "50 µm"
stop = "2400 °C"
[simulation]
frames = 1
[window]
low = "1700 °C"
high = "9000 °C"
model = "solver"
[region]
contour = [["0 mm", "0 mm"], ["2 mm", "0 mm"], ["2 mm", "0.6 mm"], ["0 mm", "0.6 mm"]]
[checks]
rim = "0.25 mm"
farthest = "0.3 mm"
[judge]
solver = "reference"
cell = "0.15 mm"
step = "10 us"
"#;

/// The solver judges: what a check says to change, and what ends a doubt. The job as it stands is the cure of all.
#[test]
fn remedies_of_the_electron_beams_judge_are_true() {
    let folder = tempfile::tempdir().unwrap();
    let good = run(folder.path(), JUDGED);
    let (weak, hot) = ("current = \"1.5 mA\"", "current = \"9 mA\"");
    let (long, coarse) = ("overrun = \"0.6 mm\"", "cell = \"0.3 mm\"");
    let part = "cell = \"0.15 mm\"\npart = [[\"0.5 mm\", \"0.1 mm\"], [\"1.5 mm\", \"0.5 mm\"]]";
    for (bad, ids, named) in [
        (
            weak,
            &["in-window", "unmelted", "unfused", "molten-outside"][..],
            "more power",
        ),
        (hot, &["in-window", "unmelted"], "less power"),
        (
            long,
            &["molten-outside", "molten-farthest"],
            "lines that end further inside",
        ),
        (
            coarse,
            &["in-window", "unmelted"],
            "finer cells (judge.cell)",
        ),
        (part, &["in-window", "unmelted"], "leave judge.part out"),
    ] {
        let (key, _) = bad.split_once(" = ").unwrap();
        let line = JUDGED.lines().find(|l| l.starts_with(key)).unwrap();
        let verdict = run(folder.path(), &JUDGED.replacen(line, bad, 1));
        for id in ids {
            let failed = check(&verdict, id);
            let undecided = matches!(failed.status, Status::Fail | Status::CannotSay);
            let remedy = failed.remedy.as_deref().unwrap_or_default();
            assert!(undecided && remedy.contains(named), "{bad}: {failed:?}");
            let sound = check(&good, id);
            assert_eq!(sound.status, Status::Pass, "{id}: {sound:?}");
        }
    }
}

/// A recipe as it ships, with other values.
fn recipe(folder: &Path, name: &str, changes: &[(&str, &str)]) {
    let mut text = meltpath_data::recipes::INDUSTRIAL.text.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    fs::write(folder.join(name), text).unwrap();
}

#[test]
fn remedies_of_a_laser_verdict_are_true() {
    let folder = tempfile::tempdir().unwrap();
    recipe(folder.path(), "fast.toml", &[("300 W", "120 W")]);
    // contours that melt nothing count as powder: they are slower, too
    let slow = [
        ("300 W", "120 W"),
        ("1000 mm/s", "250 mm/s"),
        ("1500 mm/s", "250 mm/s"),
    ];
    recipe(folder.path(), "slow.toml", &slow);
    let job = |head: &str, recipe: &str, checks: &str| {
        format!(
            "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"{head}\"\nrecipes = [\"{recipe}\"]\ndelays = \"tuned\"\n\
             [plate]\nblock = [1, 1]\nside = \"2 mm\"\nhatch = \"0.1 mm\"\n{checks}\n"
        )
    };
    let ranged = job(
        "two-axis-150",
        "industrial",
        "[checks]\ncontour_error = \"300 µm\"",
    );
    let ranged = ranged.replace("side = \"2 mm\"\nhatch = \"0.1 mm\"\n", "");
    // the same heads, their friction measured
    let measured = |line: &str| match line.split_once(", low = ") {
        Some((value, _)) => format!("{value}, source = \"ramps\" }}\n"),
        None => format!("{line}\n"),
    };
    for (name, shipped) in [
        ("measured.toml", meltpath_data::scan_heads::TWO_AXIS_150),
        (
            "measured-350.toml",
            meltpath_data::scan_heads::THREE_AXIS_350,
        ),
    ] {
        let head: String = shipped.text.lines().map(measured).collect();
        fs::write(folder.path().join(name), head).unwrap();
    }
    let contour = job(
        "measured.toml",
        "industrial",
        "[checks]\ncontour_share = \"70 %\"",
    );
    let filled = |least: &str| {
        job(
            "three-axis-350",
            "industrial",
            &format!("[checks]\nfill_rate = \"{least}\""),
        )
    };
    let (fill, more_fill) = (filled("60 %"), filled("75 %"));
    let heat = job(
        "measured-350.toml",
        "fast.toml",
        "[heat]\n[checks]\nfusion = \"75 %\"",
    );
    let heat = heat.replace("0.1 mm", "0.07 mm");
    let wide = "hatch = \"0.1 mm\"";
    let (tuned, own, hinf, preview) = (
        "delays = \"tuned\"",
        "delays = \"recipe\"",
        "delays = \"tuned\"\ncontroller = \"h-infinity\"",
        "delays = \"tuned\"\npath = \"preview\"",
    );
    #[rustfmt::skip]
    let cases = [
        (&ranged, Case { id: "contour-1", from: tuned, bad: tuned, named: "lpbf.controller = \"h-infinity\"", cure: hinf }),
        (&contour, Case { id: "contour-1", from: tuned, bad: tuned, named: "lpbf.controller = \"h-infinity\"", cure: hinf }),
        (&contour, Case { id: "contour-1", from: tuned, bad: tuned, named: "lpbf.path = \"preview\"", cure: preview }),
        (&fill, Case { id: "fill-1", from: tuned, bad: own, named: "lpbf.delays = \"tuned\"", cure: tuned }),
        (&more_fill, Case { id: "fill-1", from: wide, bad: wide, named: "a closer hatch", cure: "hatch = \"0.08 mm\"" }),
        (&heat, Case { id: "fusion-1", from: "fast.toml", bad: "fast.toml", named: "slower marks", cure: "slow.toml" }),
    ];
    let mut runs = Runs::new(folder.path());
    for (good, case) in cases {
        case.is_cured_by_its_remedy(&mut runs, good);
    }
}

#[test]
fn remedies_of_a_tuning_are_true() {
    let folder = tempfile::tempdir().unwrap();
    let tuned = |position: &str, more: &str| {
        let file = folder.path().join("tune.toml");
        let text = format!(
            "head = \"two-axis-150\"\naxes = [\"y\"]\n[cascade]\nfirst_maximum = [\"300 us\", \"600 us\", \"{position}\"]\n\
             [compare]\ndraws = 0\n{more}"
        );
        fs::write(&file, text).unwrap();
        let outcome = tune::tune(&file, NextIn(&folder.path().join("runs")), &Silent).unwrap();
        in_style(&outcome.folder);
        check(&outcome.verdict, "y-mode").clone()
    };
    let export = "[export]\ncontroller = \"h-infinity\"\n";
    let slower = "[h-infinity]\nbandwidth = \"150 Hz\"\n";
    for (position, bad, named, cure) in [
        ("1000 us", export, "export.controller = \"robust\"", ""),
        ("660 us", "", "a lower h-infinity.bandwidth", slower),
    ] {
        let failed = tuned(position, bad);
        assert_eq!(failed.status, Status::Fail, "{failed:?}");
        let remedy = failed.remedy.unwrap();
        assert!(remedy.starts_with(named), "{remedy}");
        let passed = tuned(position, cure);
        assert_eq!(passed.status, Status::Pass, "{passed:?}");
    }
}

/// Where a part of the section is too cold and another too hot every check says the same, no check asks for more or for less power,
/// and what they say mends both: on three shapes that no example holds.
#[test]
fn a_section_too_cold_and_too_hot_is_mended_as_all_checks_say() {
    let folder = tempfile::tempdir().unwrap();
    let job = |region: &str, strategy: &str, [spacing, speed, overrun]: [f64; 3]| {
        let text = format!(
            "[process]\nkind = \"ebm\"\n[region]\ncontour = [{region}]\n[hatch]\nstrategy = \"{strategy}\"\nspacing = \"{spacing} mm\"\n\
             speed = \"{speed} mm/s\"\noverrun = \"{overrun} mm\"\n[charts]\npreview = \"none\"\n[window]\nbody = [\"2 mm\", \"1.5 mm\"]\n[judge]\ncell = \"0.0625 mm\"\n"
        );
        run(folder.path(), &text)
    };
    for (region, strategy, spacing, speed) in [
        (
            "[\"0 mm\", \"0 mm\"], [\"3 mm\", \"0 mm\"], [\"3 mm\", \"1.2 mm\"], [\"0 mm\", \"1.2 mm\"]",
            "lines",
            0.25,
            1000.0,
        ),
        (
            "[\"0 mm\", \"0 mm\"], [\"3 mm\", \"0 mm\"], [\"3 mm\", \"1 mm\"], [\"1 mm\", \"1 mm\"], [\"1 mm\", \"2.5 mm\"], [\"0 mm\", \"2.5 mm\"]",
            "lines",
            0.2,
            1500.0,
        ),
        (
            "[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"1 mm\", \"1.5 mm\"]",
            "one-way",
            0.125,
            1500.0,
        ),
    ] {
        let before = job(region, strategy, [spacing, speed, 0.0]);
        for id in ["in-window", "unmelted", "unfused", "molten-farthest"] {
            let remedy = check(&before, id).remedy.as_deref().unwrap();
            assert!(remedy.contains("no power mends both"), "{id}: {remedy}");
            for one in ["more power", "less power"] {
                assert!(!remedy.contains(one), "{id}: {remedy}");
            }
        }
        // beyond the contour by a quarter of the spot, twice as many lines, twice as fast
        let after = job(region, strategy, [0.5 * spacing, 2.0 * speed, 0.1]);
        let value = |verdict: &Verdict, id: &str| check(verdict, id).value.as_ref().unwrap().value;
        for id in ["unmelted", "unfused"] {
            let [cold, mended] = [&before, &after].map(|v| value(v, id));
            assert!(cold > 1.0 && mended < 0.2, "{region} {id}: {cold} {mended}");
        }
        let [hot, mended] = [&before, &after].map(|v| {
            let found = v.facts.iter().find(|f| f.id == "hottest").unwrap();
            found.value.as_ref().unwrap().value
        });
        println!("{region}: {hot:.0} °C, then {mended:.0} °C");
        assert!(mended < hot - 50.0, "{region}: {hot} {mended}");
        assert!(value(&after, "molten-farthest") < 0.2);
    }
}
