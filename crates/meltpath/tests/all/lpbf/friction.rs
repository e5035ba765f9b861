//! A head of one's own whose friction is known as a range, or not at all.

use crate::support::says;
use std::fs;
use std::path::Path;

use meltpath_base::{Check, Measure, Status};

use super::{refused, run, value};

/// A small square, of which corners are a tenth.
const JOB: &str = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"mine.toml\"\nrecipes = [\"uniform\"]\ndelays = \"recipe\"\n\
    [plate]\nblock = [1, 1]\nside = \"3 mm\"\n[checks]\ncontour_share = \"85 %\"\nfill_rate = \"30 %\"\n";

/// A head with this dry friction on both axes, and nothing else that is uncertain.
fn head(coulomb: &str) -> String {
    let shipped = meltpath_data::scan_heads::TWO_AXIS_150.text;
    let own = |line: &str| match line.split(" = ").next() {
        Some("coulomb") => format!("coulomb = {{ {coulomb} }}"),
        Some("bias") => "bias = { value = \"0 N·m\", source = \"ramps\" }".to_owned(),
        Some("viscous") => {
            "viscous = { value = \"3e-6 N·m·s/rad\", source = \"ramps\" }".to_owned()
        }
        _ => line.to_owned(),
    };
    shipped.lines().map(|l| own(l) + "\n").collect()
}

/// A check of the verdict in `out`.
fn check(out: &Path, id: &str) -> Check {
    let text = fs::read_to_string(out.join("verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&text).unwrap();
    let checks: Vec<Check> = serde_json::from_value(verdict["checks"].clone()).unwrap();
    checks.into_iter().find(|c| c.id == id).unwrap()
}

/// A check with that friction.
fn told(dir: &Path, name: &str, coulomb: &str, id: &str) -> Check {
    fs::write(dir.join("mine.toml"), head(coulomb)).unwrap();
    check(&run(dir, name, JOB), id)
}

const LITTLE: &str = "value = \"1 µN·m\", source = \"ramps\"";
const MUCH: &str = "value = \"100 µN·m\", source = \"ramps\"";

#[test]
fn a_range_whose_ends_come_out_otherwise_cannot_be_decided() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let mut figures = Vec::new();
    for (name, coulomb, status) in [
        ("little", LITTLE, Status::Pass),
        ("much", MUCH, Status::Fail),
    ] {
        let found = told(dir, name, coulomb, "contour-1");
        assert_eq!((found.status, &*found.reason), (status, ""), "{name}");
        let share = value(&dir.join(name), "contour-1");
        figures.push(Measure::exact(share, "%").to_string());
    }
    let wide = "value = \"10 µN·m\", low = \"1 µN·m\", high = \"100 µN·m\", source = \"bearings\"";
    let found = told(dir, "wide", wide, "contour-1");
    assert_eq!(found.status, Status::CannotSay);
    let both = format!(
        "{} with the least friction of the head's file, {} with the most",
        figures[0], figures[1]
    );
    says(&found.reason, &["the friction of the axes decides", &both]);
    says(
        &found.remedy.unwrap(),
        &["measure the friction", "identify"],
    );
    // the fill keeps its limit at either end
    let fill = check(&dir.join("wide"), "fill-1");
    assert_eq!(fill.status, Status::Pass, "{fill:?}");
    says(&fill.reason, &["with the least", "with the most"]);
    // any number of threads gives the same bits
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    one.install(|| run(dir, "alone", JOB));
    let verdict = |name: &str| fs::read(dir.join(name).join("verdict.json")).unwrap();
    assert_eq!(verdict("wide"), verdict("alone"));
}

#[test]
fn a_range_whose_ends_come_out_alike_decides() {
    let dir = tempfile::tempdir().unwrap();
    for (name, coulomb, status) in [
        (
            "good",
            "value = \"1 µN·m\", low = \"0 N·m\", high = \"2 µN·m\", source = \"ramps\"",
            Status::Pass,
        ),
        (
            "bad",
            "value = \"100 µN·m\", low = \"90 µN·m\", high = \"110 µN·m\", source = \"ramps\"",
            Status::Fail,
        ),
        // twice the deviation to either side
        (
            "deviation",
            "value = \"1 µN·m\", uncertainty = \"0.5 µN·m\", source = \"identified\"",
            Status::Pass,
        ),
    ] {
        let found = told(dir.path(), name, coulomb, "contour-1");
        assert_eq!(found.status, status, "{found:?}");
        says(&found.reason, &["friction of the head's file"]);
        let told = fs::read_to_string(dir.path().join(name).join("verdict.json")).unwrap();
        assert!(told.contains("of Coulomb torque by the head's file"));
    }
    let told = fs::read_to_string(dir.path().join("deviation/verdict.json")).unwrap();
    assert!(told.contains("X 0 to 2 µN·m, Y 0 to 2 µN·m"), "{told}");
}

#[test]
fn a_guess_without_a_range_promises_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let guess = "value = \"1 µN·m\", source = \"a first guess\"";
    for id in ["contour-1", "fill-1"] {
        let found = told(dir.path(), id, guess, id);
        assert_eq!(found.status, Status::CannotSay);
        says(
            &found.reason,
            &["a guess, without a range", "x.coulomb, y.coulomb"],
        );
        says(&found.remedy.unwrap(), &["low and high"]);
    }
    // a guess that is off by so much at the most is told by its range
    let guess = "value = \"1 µN·m\", low = \"0 N·m\", high = \"2 µN·m\", source = \"a guess\"";
    let found = told(dir.path(), "ranged", guess, "contour-1");
    assert_eq!(found.status, Status::Pass, "{found:?}");
}

#[test]
fn ranges_that_are_none_are_refused_at_their_keys() {
    let dir = tempfile::tempdir().unwrap();
    for (coulomb, words) in [
        (
            "value = \"3 µN·m\", low = \"9 µN·m\", high = \"2 µN·m\", source = \"x\"",
            ["x.coulomb.low is", "above x.coulomb.high", "exchange them"],
        ),
        (
            "value = \"3 µN·m\", low = \"-1 µN·m\", high = \"9 µN·m\", source = \"x\"",
            ["x.coulomb.low is", "zero or above", "must not be negative"],
        ),
        (
            "value = \"30 µN·m\", low = \"1 µN·m\", high = \"9 µN·m\", source = \"x\"",
            [
                "x.coulomb is",
                "outside of its own range",
                "widen the range",
            ],
        ),
        (
            "value = \"3 µN·m\", high = \"9 µN·m\", source = \"x\"",
            ["x.coulomb.low is missing", "both ends", "or neither"],
        ),
    ] {
        fs::write(dir.path().join("mine.toml"), head(coulomb)).unwrap();
        let error = refused(dir.path(), JOB);
        says(&error, &words);
        // with the line of the head's file
        says(&error, &["mine.toml:"]);
    }
    // a law that needs friction has it at the least, too
    let law = "[x.friction]\nkind = \"lugre\"\nstiction = { value = \"2 µN·m\", source = \"x\" }\nstribeck = { value = \"0.5 rad/s\", source = \"x\" }\n\
        stiffness = { value = \"0.02 N·m/rad\", source = \"x\" }\ndamping = { value = \"2e-6 N·m·s/rad\", source = \"x\" }\n";
    let none = "value = \"1 µN·m\", low = \"0 N·m\", high = \"2 µN·m\", source = \"x\"";
    fs::write(dir.path().join("mine.toml"), head(none) + law).unwrap();
    let error = refused(dir.path(), JOB);
    says(
        &error,
        &["not sound with its least friction", "Coulomb torque"],
    );
}
