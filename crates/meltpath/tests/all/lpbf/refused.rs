//! Scan-head jobs that cannot run, from their files on: each is refused, or told in the verdict, with what to change.

use crate::support::{rows, says, write};
use std::fs;
use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::Silent;

use super::{INDUSTRIAL, THREE};

/// A job as it is written.
struct Job<'a> {
    head: &'a str,
    recipe: &'a str,
    lpbf: &'a str,
    rest: &'a str,
    /// Whether `doctor` says the same before anything runs.
    told_before: bool,
}

impl Default for Job<'_> {
    fn default() -> Self {
        Job {
            head: "three-axis-350",
            recipe: "industrial",
            lpbf: "delays = \"recipe\"",
            rest: "",
            told_before: false,
        }
    }
}

impl Job<'_> {
    fn write(&self, folder: &Path) -> std::path::PathBuf {
        let path = folder.join("job.toml");
        let text = format!(
            "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"{}\"\nrecipes = [\"{}\"]\n{}\n{}\n",
            self.head, self.recipe, self.lpbf, self.rest
        );
        fs::write(&path, text).unwrap();
        path
    }

    /// The words of the refusal, with the help beside the place; no folder is left behind.
    fn refused(&self, folder: &Path) -> String {
        let path = self.write(folder);
        let out = folder.join("out");
        let error = chain::run(&path, At(&out), &Silent).unwrap_err();
        assert!(!out.exists(), "nothing is left behind");
        if self.told_before {
            let before = chain::doctor(&path, &Silent).unwrap().refused.unwrap();
            assert_eq!(before.to_string(), error.to_string());
        }
        error.to_string()
    }

    /// The verdict as text.
    fn verdict(&self, folder: &Path, name: &str) -> String {
        let path = self.write(folder);
        let out = folder.join(name);
        chain::run(&path, At(&out), &Silent).unwrap();
        fs::read_to_string(out.join("verdict.json")).unwrap()
    }
}

/// The line of a key, the first in the file, with another value.
fn with(text: &str, key: &str, value: &str) -> String {
    let at = text.find(&format!("\n{key} = ")).unwrap() + 1;
    let end = at + text[at..].find('\n').unwrap();
    format!(
        "{}{key} = {{ value = \"{value}\", source = \"a test\" }}{}",
        &text[..at],
        &text[end..]
    )
}

/// The three-axis head, whose controller takes laser delays of 0.1 s.
fn patient() -> String {
    let longest = "longest_laser_delay = { value = \"100 ms\", source = \"a trial\" }\n[geometry]";
    THREE.replacen("[geometry]", longest, 1)
}

/// What a job with this head is refused with.
fn own_head(folder: &Path, text: &str) -> String {
    fs::write(folder.join("own.toml"), text).unwrap();
    let job = Job {
        head: "own.toml",
        told_before: true,
        ..Job::default()
    };
    job.refused(folder)
}

#[test]
fn heads_that_cannot_be_built_are_refused_at_their_name() {
    let dir = tempfile::tempdir().unwrap();
    for (key, value, words) in [
        ("travel", "5 deg", ["travel is ±5.000 deg", "head.field"]),
        ("field", "600 mm", ["travel is ±10.000 deg", "head.field"]),
        // what makes the Jacobian singular: the beam would graze a mirror, or miss it
        ("y_rest", "0 deg", ["graze the Y mirror", "[geometry]"]),
        (
            "mirror_offset",
            "300 mm",
            ["no mirror angles", "[geometry]"],
        ),
        ("x_rest", "0 deg", ["graze", "[geometry]"]),
        (
            "cam_radius",
            "2 mm",
            ["deg of the Z axis", "focus.cam_radius"],
        ),
        (
            "plane_z",
            "-20 mm",
            ["the objective's focal length", "[geometry]"],
        ),
        (
            "inertia",
            "-2e-7 kg·m²",
            ["x.inertia is -0.0000002", "above zero"],
        ),
        ("first_filter", "-1 µs", ["x.first_filter is", "above"]),
    ] {
        let error = own_head(dir.path(), &with(THREE, key, value));
        assert!(error.contains("own.toml"), "{key}: {error}");
        for word in words {
            assert!(error.contains(word), "{key}: {error}");
        }
    }
    // figures without sense in the file are told with their place
    for (key, value, words) in [
        ("sampling", "93.75", "head.sampling"),
        ("mirror_offset", "3 kg", "geometry.mirror_offset"),
        ("peak_current", "20 V", "x.peak_current"),
        ("waist", "wide", "beam.waist"),
    ] {
        let error = own_head(dir.path(), &with(THREE, key, value));
        assert!(error.contains(words), "{key}: {error}");
    }
}

#[test]
fn an_unstable_axis_is_named_before_anything_runs() {
    let dir = tempfile::tempdir().unwrap();
    // the loop of the first axis acts later than its margins allow
    let late = with(THREE, "loop_delay", "300 us");
    assert_ne!(late, THREE);
    let error = own_head(dir.path(), &late);
    says(&error, &["X axis", "unstable"]);
}

#[test]
fn recipes_without_sense_are_refused_at_their_name() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("head.toml"), patient()).unwrap();
    for (key, value, words) in [
        ("contour_speed", "0 mm/s", "contour_speed is 0"),
        ("fill_speed", "-5 mm/s", "fill_speed is -0.3"),
        ("fill_jump_speed", "0 m/s", "fill_jump_speed is 0"),
        ("mark_wait", "-1 ms", "mark_wait is -"),
        ("power", "200 mm", "one of \"W\""),
        ("contour_speed", "5000 m/s", "at most 60000 m/min"),
        ("laser_on_delay", "60 ms", "no mark is lit"),
    ] {
        fs::write(dir.path().join("own.toml"), with(INDUSTRIAL, key, value)).unwrap();
        let job = Job {
            head: "head.toml",
            recipe: "own.toml",
            rest: "[plate]\nblock = [1, 1]\nside = \"2 mm\"",
            ..Job::default()
        };
        let error = job.refused(dir.path());
        assert!(error.contains(words), "{key}: {error}");
    }
}

#[test]
fn delays_longer_than_marks_are_told() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("head.toml"), patient()).unwrap();
    let job = |recipe| Job {
        head: "head.toml",
        recipe,
        rest: "[plate]\nblock = [1, 1]\nside = \"2 mm\"",
        ..Job::default()
    };
    // lines of a square of 2 mm last 2 ms at most, its contours 5 ms and their waits
    for [key, value, words] in &rows(
        r"
        laser_on_delay => 3 ms => marks between jumps that stay dark
        laser_off_delay => 5 ms => the light stays on between",
    ) {
        fs::write(dir.path().join("own.toml"), with(INDUSTRIAL, key, value)).unwrap();
        let verdict = job("own.toml").verdict(dir.path(), key);
        assert!(verdict.contains(words), "{verdict}");
        if key == "laser_on_delay" {
            let verdict: serde_json::Value = serde_json::from_str(&verdict).unwrap();
            let checks = verdict["checks"].as_array().unwrap();
            let dark = checks.iter().find(|c| c["id"] == "dark-1").unwrap();
            assert_eq!(
                (&dark["status"], &verdict["status"]),
                (&"fail".into(), &"fail".into())
            );
            assert_eq!(dark["place"]["layer"], 1);
            assert_eq!(dark["place"]["position"].as_array().unwrap().len(), 3);
        }
    }
    let verdict = job("industrial").verdict(dir.path(), "own");
    assert!(!verdict.contains("the light stays on"), "{verdict}");
    let text = with(INDUSTRIAL, "laser_on_delay", "100 us");
    fs::write(dir.path().join("own.toml"), text).unwrap();
    let verdict = job("own.toml").verdict(dir.path(), "soon");
    assert!(!verdict.contains("dark-1"), "{verdict}");
}

/// Own delays that leave marks dark are foretold with what mends it; tuned delays light every mark of squares of any size, whose
/// shortest lines last a few samples.
#[test]
fn tuned_delays_light_every_mark_and_others_are_foretold() {
    let dir = tempfile::tempdir().unwrap();
    let text = with(INDUSTRIAL, "laser_on_delay", "3 ms");
    fs::write(dir.path().join("own.toml"), text).unwrap();
    fs::write(dir.path().join("head.toml"), patient()).unwrap();
    let job = |head: &str, delays: &str, side: &str| {
        let text = format!(
            "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"{head}\"\nrecipes = [\"own.toml\"]\ndelays = \"{delays}\"\n[plate]\nblock = [1, 1]\nside = \"{side}\"\n"
        );
        write(dir.path(), "job.toml", text)
    };
    let path = job("head.toml", "recipe", "2 mm");
    let lines = chain::doctor(&path, &Silent).unwrap().lines;
    let told = |n: &String| n.contains("foretold: fail") && n.contains("lpbf.delays = \"tuned\"");
    assert!(lines.iter().any(told), "{lines:?}");
    for (k, (head, side)) in [
        ("three-axis-350", "10 mm"),
        ("three-axis-350", "2 mm"),
        ("two-axis-150", "7.3 mm"),
    ]
    .into_iter()
    .enumerate()
    {
        let path = job(head, "tuned", side);
        let out = dir.path().join(format!("lit-{k}"));
        let verdict = chain::run(&path, At(&out), &Silent).unwrap().verdict;
        let dark = verdict.checks.iter().find(|c| c.id.starts_with("dark"));
        assert!(dark.is_none(), "{head} {side}: {dark:?}");
    }
}

/// A head whose controller takes delays of 60 µs: none longer is tuned, and a recipe with longer ones is refused.
#[test]
fn delays_stay_within_what_the_head_takes() {
    let dir = tempfile::tempdir().unwrap();
    let longest = "longest_laser_delay = { value = \"60 us\", source = \"a trial\" }\n[geometry]";
    let head = THREE.replacen("[geometry]", longest, 1);
    fs::write(dir.path().join("head.toml"), head).unwrap();
    let job = |lpbf| Job {
        head: "head.toml",
        lpbf,
        rest: "[plate]\nblock = [1, 1]\nside = \"2 mm\"",
        told_before: true,
        ..Job::default()
    };
    let error = job("delays = \"recipe\"").refused(dir.path());
    says(
        &error,
        &["longer than the head's longest_laser_delay, 60 µs"],
    );
    let verdict = job("delays = \"tuned\"").verdict(dir.path(), "tuned");
    assert!(verdict.contains("delays-long"), "{verdict}");
    let table = fs::read_to_string(dir.path().join("tuned/series/delays-1.csv")).unwrap();
    let delays = table
        .lines()
        .skip(1)
        .flat_map(|line| line.split(',').take(2));
    for delay in delays {
        assert!(delay.parse::<f64>().unwrap() <= 60e-6, "{table}");
    }
}

#[test]
fn work_beyond_the_field_is_refused_with_where_it_lies() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |lpbf: &str, rest: &str| {
        Job {
            lpbf,
            rest,
            told_before: true,
            ..Job::default()
        }
        .refused(dir.path())
    };
    let plate = refused("", "[plate]\nblock = [40, 1]");
    says(
        &plate,
        &["the plate leaves the head's field", "plate.block"],
    );
    let side = refused("", "[plate]\nside = \"30 mm\"");
    says(&side, &["pitch of columns", "[plate]"]);
    let cli = |end: f64| {
        format!(
            "$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/0.03\n$$HATCHES/1,1,200,200,{end},200\n$$GEOMETRYEND\n"
        )
    };
    fs::write(dir.path().join("far.cli"), cli(260.0)).unwrap();
    let far = refused("layers = \"far.cli\"", "");
    says(
        &far,
        &[
            "\"far.cli\" leaves the head's field",
            "origin = [\"230.0 mm\", \"200.0 mm\"]",
        ],
    );
    fs::write(dir.path().join("wide.cli"), cli(700.0)).unwrap();
    let wide = refused("layers = \"wide.cli\"", "");
    assert!(wide.contains("larger than the field"), "{wide}");
    // coordinates in metres
    fs::write(dir.path().join("small.cli"), cli(200.004)).unwrap();
    let origin = "[layers]\norigin = [\"200.0 mm\", \"200.0 mm\"]";
    let small = refused("layers = \"small.cli\"", origin);
    says(&small, &["within 4.00 µm", "is the unit right?"]);
    // the origin that is told serves
    let job = Job {
        lpbf: "delays = \"recipe\"\nlayers = \"far.cli\"",
        rest: "[layers]\norigin = [\"230.0 mm\", \"200.0 mm\"]",
        ..Job::default()
    };
    let verdict = job.verdict(dir.path(), "moved");
    // a line of a fill alone has no contours to judge
    assert!(verdict.contains("no contour was marked"), "{verdict}");
}

#[test]
fn mirrors_that_leave_their_travel_are_told() {
    let dir = tempfile::tempdir().unwrap();
    // without a table the head need not reach all of its field; the jump without pre-filter overshoots what it just reaches
    let exact = with(THREE, "travel", "8.34 deg").replace("table_points = 65\n", "");
    fs::write(dir.path().join("own.toml"), exact).unwrap();
    let list = "kind,x [mm],y [mm],speed [mm/s]\nstart,0,0,\njump,174,0,20000\ncontour,164,0,\n";
    fs::write(dir.path().join("edge.csv"), list).unwrap();
    let job = Job {
        head: "own.toml",
        lpbf: "delays = \"recipe\"\nprefilter = \"off\"\nlayers = \"edge.csv\"",
        ..Job::default()
    };
    let verdict = job.verdict(dir.path(), "out");
    says(&verdict, &["the X mirror turns to", "strikes its stop"]);
}

/// Cells and margins of which no map could be made are told before anything is simulated, at the one that is a slip.
#[test]
fn maps_that_cannot_be_made_are_told_before() {
    let dir = tempfile::tempdir().unwrap();
    for (heat, said) in [
        ("cell = \"1 nm\"", "heat.cell: a map"),
        ("margin = \"1000 m\"", "heat.margin: a map"),
    ] {
        let rest = format!("[heat]\n{heat}");
        let job = Job {
            rest: &rest,
            told_before: true,
            ..Job::default()
        };
        says(&job.refused(dir.path()), &[said, "million cells"]);
    }
}

/// The waist in place of what leaves the lens.
#[test]
fn a_waist_that_melts_nothing_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let told = own_head(dir.path(), &with(THREE, "waist", "40 mm"));
    says(&told, &["beam.waist is 40 mm"]);
}

/// A wavelength in another unit.
#[test]
fn a_wavelength_that_no_laser_has_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let told = own_head(dir.path(), &with(THREE, "wavelength", "1070 mm"));
    says(&told, &["beam.wavelength is 1070 mm"]);
}

/// A law of a material that goes below zero is told at its table.
#[test]
fn laws_below_zero_are_told_at_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let shipped = meltpath_data::materials::ALL
        .iter()
        .find(|m| m.name == "in625-laser")
        .unwrap();
    for (law, negative, table) in [
        (
            "[8.275, 0.01472]",
            "[8.275, -0.01472]",
            "[conductivity.solid]",
        ),
        (
            "\n[specific_heat.solid]\npolynomial = [",
            "\n[specific_heat.solid]\npolynomial = [-",
            "[specific_heat.solid]",
        ),
    ] {
        assert!(shipped.text.contains(law), "{law}");
        let text = shipped.text.replace(law, negative);
        let line = text.lines().position(|l| l == table).unwrap() + 1;
        write(dir.path(), "own.toml", text);
        let folder = dir.path();
        let told = meltpath::material::load(
            "own.toml",
            meltpath_thermal::material::file::Readings::default(),
            folder,
        );
        let told = told.unwrap_err().to_string();
        assert!(told.contains(&format!("own.toml:{line}")), "{told}");
    }
}
