//! The command line fed with what it must refuse: exit code 2, a message that says what and where, nothing left behind.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use meltpath::start;

fn meltpath(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_meltpath"))
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn said(output: &Output) -> String {
    // a terminal's line breaks must not hide a word
    String::from_utf8_lossy(&output.stderr)
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// A job folder with a small ring.
fn job(folder: &Path) -> String {
    start::waam(&folder.join("job"), "ring", None).unwrap();
    fs::read_to_string(folder.join("job/job.toml")).unwrap()
}

/// Runs the job with `text` and expects it to be refused, saying every one of `words`.
fn refused(folder: &Path, text: &str, words: &[&str]) {
    fs::write(folder.join("job/job.toml"), text).unwrap();
    let before = fs::read_dir(folder.join("job")).unwrap().count();
    let output = meltpath(&["run", "job/job.toml"], folder);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` is missing in: {said}");
    }
    assert!(!said.contains("panicked"), "{said}");
    assert_eq!(
        fs::read_dir(folder.join("job")).unwrap().count(),
        before,
        "something was left behind"
    );
}

#[test]
fn jobs_with_mistakes_are_refused_with_the_place() {
    let dir = tempfile::tempdir().unwrap();
    let good = job(dir.path());
    for (right, wrong, words) in [
        (
            "# strategy = \"hybrid\"",
            "strategie = \"hybrid\"",
            &["strategie", "job.toml"] as &[_],
        ),
        ("ctwd = \"15 mm\"", "ctwd = 15", &["\"15 mm\"", "\"µm\""]),
        (
            "travel_speed = \"0.75 m/min\"",
            "travel_speed = \"-0.75 m/min\"",
            &["above 0 m/min"],
        ),
        (
            "wire = \"x90-ig-1.0\"",
            "wire = \"x91\"",
            &["x91", "x90-ig-1.0"],
        ),
        ("gas = \"m14\"", "gas = \"helium\"", &["helium"]),
        (
            "part = \"ring.stl\"",
            "part = \"absent.stl\"",
            &["absent.stl"],
        ),
        ("part = \"ring.stl\"", "part = \"ring.iges\"", &["STEP"]),
        (
            "cell = \"arcmate-120ic\"",
            "cell = \"nowhere\"",
            &["nowhere", "arcmate-120ic"],
        ),
        (
            "travel_speed = \"0.75 m/min\"",
            "width = \"30 mm\"",
            &["30"],
        ),
        (
            "travel_speed = \"0.75 m/min\"",
            "travel_speed = \"30 m/min\"",
            &["cannot make", "0.25 to 1.5"],
        ),
        (
            "height = \"auto\" ",
            "height = \"0.0001 mm\"",
            &["layers.height", "could"],
        ),
        ("kind = \"waam\"", "kind = \"milling\"", &["milling"]),
        (
            "wire = \"x90-ig-1.0\"",
            "wire = \"g3si-1.2\"\nmap = \"x90-ig-1.0-cmt-m14\"",
            &["the process map is for wire", "g3si-1.2"],
        ),
    ] {
        assert!(good.contains(right), "{right}");
        refused(dir.path(), &good.replace(right, wrong), words);
    }
}

/// A mistake in a file of the user's own that the job names is shown in that file.
#[test]
fn mistakes_of_data_files_are_shown_in_them() {
    let dir = tempfile::tempdir().unwrap();
    let good = job(dir.path());
    fs::write(
        dir.path().join("job/my-wire.toml"),
        "schema = 1\nid = \"mine\"\nname = \"my own\"\ndiametre = 1\n",
    )
    .unwrap();
    let line = good.lines().find(|l| l.starts_with("wire = ")).unwrap();
    let own = good.replace(line, "wire = \"my-wire.toml\"");
    refused(
        dir.path(),
        &own,
        &["my-wire.toml:4:1", "diametre = 1", "density is missing"],
    );
}

#[test]
fn parts_that_are_no_parts_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let good = job(dir.path());
    let part = dir.path().join("job/ring.stl");
    let whole = fs::read(&part).unwrap();
    let mut nan = whole.clone();
    nan[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    for (bytes, words) in [
        (Vec::new(), &["empty"] as &[_]),
        (whole[..whole.len() / 2].to_vec(), &["ring.stl"]),
        (nan, &["ring.stl"]),
        (b"hello, this is not a part".to_vec(), &["ring.stl"]),
        (b"solid empty\nendsolid empty\n".to_vec(), &["ring.stl"]),
    ] {
        fs::write(&part, bytes).unwrap();
        refused(dir.path(), &good, words);
    }
    // metres taken for millimetres: 0.1 mm wide
    fs::write(&part, &whole).unwrap();
    let tiny = good.replace(
        "part = \"ring.stl\"",
        "part = \"ring.stl\"\npart_unit = \"m\"",
    );
    refused(dir.path(), &tiny, &["unit"]);
    fs::write(
        dir.path().join("job/cut.step"),
        "ISO-10303-21;\nHEADER;\nFILE_SCHEMA((",
    )
    .unwrap();
    refused(
        dir.path(),
        &good.replace("ring.stl", "cut.step"),
        &["cut.step", "line"],
    );
}

#[test]
fn nothing_is_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    job(dir.path());
    fs::create_dir(dir.path().join("taken")).unwrap();
    let output = meltpath(&["run", "job/job.toml", "--out", "taken"], dir.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("never overwritten"),
        "{}",
        said(&output)
    );
    assert_eq!(fs::read_dir(dir.path().join("taken")).unwrap().count(), 0);
    let output = meltpath(&["new", "waam", "job"], dir.path());
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn programs_that_cannot_be_run_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let program = |lines: &str| {
        format!(
            "/PROG  BAD\n/MN\n{lines}/POS\nP[1]{{\n   GP1:\n    UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n    X = 0.0 mm, Y = 0.0 mm, Z = 0.0 mm,\n    W = 180.0 deg, P = 0.0 deg, R = 0.0 deg\n}};\n/END\n"
        )
    };
    for (name, lines, words) in [
        (
            "loop.ls",
            "   1:  UFRAME_NUM=1 ;\n   2:  UTOOL_NUM=1 ;\n   3:  LBL[1] ;\n   4:L P[1] 100mm/sec FINE ;\n   5:  JMP LBL[1] ;\n",
            "loop",
        ),
        ("frame.ls", "   1:L P[1] 100mm/sec FINE ;\n", "UFRAME"),
        (
            "missing.ls",
            "   1:  UFRAME_NUM=1 ;\n   2:  UTOOL_NUM=1 ;\n   3:L P[7] 100mm/sec FINE ;\n",
            "P[7]",
        ),
        ("empty.ls", "", ""),
    ] {
        let mut text = program(lines);
        if name == "frame.ls" {
            // positions can name the frame they stand in; these do not
            text = text.replace("UF : 1, UT : 1", "UF : F, UT : F");
        }
        fs::write(dir.path().join(name), text).unwrap();
        let output = meltpath(&["simulate", name], dir.path());
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        assert!(
            said.contains(words) && !said.contains("panicked"),
            "{name}: {said}"
        );
    }
    fs::write(
        dir.path().join("noise.ls"),
        [0_u8, 159, 146, 150, 10, 13, 255],
    )
    .unwrap();
    assert_eq!(
        meltpath(&["simulate", "noise.ls"], dir.path())
            .status
            .code(),
        Some(2)
    );
}

#[test]
fn beads_beyond_the_plate_fail_the_part() {
    let dir = tempfile::tempdir().unwrap();
    let size = "# size = [\"200 mm\", \"150 mm\"]";
    let good = job(dir.path());
    assert!(good.contains(size));
    let smaller = good.replace(size, "size = [\"130 mm\", \"30 mm\"]");
    refused(dir.path(), &smaller, &["substrate.size", "100 x 100 mm"]);
    // the part stands on it, its allowance does not
    let small = good
        .replace(size, "size = [\"101 mm\", \"101 mm\"]")
        .replace("programs = [\"fanuc-ls\"]", "programs = []");
    assert!(small.contains("programs = []"));
    fs::write(dir.path().join("job/job.toml"), small).unwrap();
    let output = meltpath(&["run", "job/job.toml", "--out", "built"], dir.path());
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let verdict = fs::read_to_string(dir.path().join("built/verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&verdict).unwrap();
    let checks = verdict["checks"].as_array().unwrap();
    let plate = checks.iter().find(|c| c["id"] == "plate").unwrap();
    assert_eq!(plate["status"], "fail", "{plate}");
    // a job that asks for no program gets none
    assert!(!dir.path().join("built/program").exists());
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    // fine cells: the run lasts far longer than the wait below
    let slow = format!("{}\n[simulation]\ncell = \"0.1 mm\"\n", job(dir.path()));
    fs::write(dir.path().join("job/job.toml"), slow).unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_meltpath"))
        .args(["run", "job/job.toml"])
        .current_dir(dir.path())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    let killed = Command::new("kill")
        .args(["-INT", &run.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    assert_eq!(run.wait().unwrap().code(), Some(130));
    let left: Vec<_> = fs::read_dir(dir.path().join("job"))
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    // the job, its schema and its part
    assert_eq!(left.len(), 3, "{left:?}");
}

#[test]
fn help_and_version_are_no_errors() {
    let dir = tempfile::tempdir().unwrap();
    for args in [
        &["--help"] as &[_],
        &["--version"],
        &["run", "--help"],
        &["new", "waam", "--help"],
        &["schema", "wire"],
        &["schema", "gun"],
        &["schema", "focus"],
    ] {
        let output = meltpath(args, dir.path());
        assert_eq!(output.status.code(), Some(0));
        assert!(!output.stdout.is_empty());
    }
    assert_eq!(meltpath(&["fly"], dir.path()).status.code(), Some(2));
    let unknown = meltpath(&["schema", "wires"], dir.path());
    assert_eq!(unknown.status.code(), Some(2));
    assert!(
        said(&unknown).contains(
            "known are job, tune, measurements, walls, scan, records, motion-log, mapping, wire"
        ),
        "{}",
        said(&unknown)
    );
}
