//! What the command line prints: lists, JSON, completions, pages, data of the user's own.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn meltpath(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_meltpath"))
        .args(args)
        .current_dir(folder)
        .env("MELTPATH_DATA", folder.join("own"))
        .output()
        .unwrap()
}

fn printed(args: &[&str], folder: &Path) -> String {
    let output = meltpath(args, folder);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn lists_tell_names_and_where_they_come_from() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    for of in [
        "wires",
        "gases",
        "maps",
        "pools",
        "energies",
        "cells",
        "robots",
        "materials",
        "heads",
        "recipes",
        "guns",
        "focus",
        "examples",
    ] {
        assert!(!printed(&["list", of], folder).is_empty(), "{of}");
    }
    fs::create_dir_all(folder.join("own/wires")).unwrap();
    fs::write(
        folder.join("own/wires/mine.toml"),
        "name = \"wire of mine\"\n",
    )
    .unwrap();
    let wires = printed(&["list", "wires"], folder);
    let mine = wires.lines().find(|l| l.starts_with("mine ")).unwrap();
    assert!(
        mine.contains("wire of mine") && mine.ends_with("mine.toml"),
        "{mine}"
    );
    assert!(wires.contains("er4043-1.2") && wires.contains("shipped with meltpath"));
    let json: Value = serde_json::from_str(&printed(&["list", "wires", "--json"], folder)).unwrap();
    assert_eq!(json["schema"], "meltpath-command/1");
    assert_eq!(json["exit_code"], 0);
    let names: Vec<&str> = json["wires"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| w["name"].as_str().unwrap())
        .collect();
    assert!(names.contains(&"mine"), "{names:?}");
}

#[test]
fn shells_and_man_are_served() {
    let dir = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = printed(&["completions", shell], dir.path());
        assert!(text.contains("identify"), "{shell}");
    }
    printed(&["man", "pages"], dir.path());
    let page = fs::read_to_string(dir.path().join("pages/meltpath-run.1")).unwrap();
    assert!(page.contains(".TH meltpath-run"), "{page}");
    // beside them what the book says of files
    for (name, key) in [("job.md", "`[waam]`"), ("data.md", "## wire")] {
        let page = fs::read_to_string(dir.path().join("pages").join(name)).unwrap();
        assert!(page.contains(key), "{name}");
    }
}

/// Errors are JSON too, beside the words for people.
#[test]
fn what_is_refused_is_told_to_programs() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(
        dir.path().join("job.toml"),
        "part = 3\n[process]\nkind = \"waam\"\n",
    )
    .unwrap();
    let output = meltpath(&["run", "job.toml", "--json"], dir.path());
    assert_eq!(output.status.code(), Some(2));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["exit_code"], 2);
    assert!(json["errors"].as_array().unwrap().len() > 1, "{json}");
}

/// A wire that is not the template's, a gas and a map by their names: the whole chain, its verdict as JSON, and the folder of the run
/// run again as it stands, somewhere else, without the user's folder.
#[test]
fn a_run_in_a_wire_of_ones_own_runs_again_from_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let ship = |kind: &str, from: &str, to: &str, id: [&str; 2]| {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../data/{kind}/{from}.toml"));
        let text = fs::read_to_string(path).unwrap().replace(id[0], id[1]);
        fs::create_dir_all(folder.join("own").join(kind)).unwrap();
        fs::write(folder.join(format!("own/{kind}/{to}.toml")), text).unwrap();
    };
    let wire = ["\"er70s-6-0.9\"", "\"my-wire\""];
    ship("wires", "er70s-6-0.9", "my-wire", wire);
    ship(
        "process-maps",
        "er70s-6-0.9-cmt-m21",
        "my-wire-cmt-m21",
        wire,
    );
    printed(
        &[
            "new",
            "waam",
            "wall",
            "--shape",
            "thin-wall",
            "--wire",
            "my-wire",
        ],
        folder,
    );
    let job = fs::read_to_string(folder.join("wall/job.toml")).unwrap();
    let job = job.replace("# count = 20 ", "count = 3 ");
    let job = format!("{job}\n[simulation]\ncell = \"1 mm\"\n");
    fs::write(folder.join("wall/job.toml"), job).unwrap();
    let run = |job: &str, out: &str, at: &Path, own: &Path| {
        let output = Command::new(env!("CARGO_BIN_EXE_meltpath"))
            .args(["run", job, "--out", out, "--json"])
            .current_dir(at)
            .env("MELTPATH_DATA", own)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let told: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|e| unreachable!("{e}: {said}"));
        (output.status.code().unwrap(), told)
    };
    let (code, first) = run("wall/job.toml", "first", folder, &folder.join("own"));
    let status = |told: &Value, id: &str| {
        let checks = told["verdict"]["checks"].as_array().unwrap();
        let check = checks.iter().find(|c| c["id"] == id).unwrap();
        (
            check["status"].as_str().unwrap().to_owned(),
            check["remedy"].is_string(),
        )
    };
    // nothing passes on the pool of another wire, nor where nobody measured the feed
    assert!(code == 4 || code == 1, "{code} {first}");
    for id in ["borrowed", "ctwd-known"] {
        assert_eq!(status(&first, id), ("cannot-say".to_owned(), true), "{id}");
    }
    assert!(folder.join("first/data/wires/my-wire.toml").is_file());
    assert!(
        folder
            .join("first/data/process-maps/my-wire-cmt-m21.toml")
            .is_file()
    );
    let elsewhere = tempfile::tempdir().unwrap();
    fs::rename(folder.join("first"), elsewhere.path().join("first")).unwrap();
    fs::remove_dir_all(folder.join("wall")).unwrap();
    let (again, second) = run(
        "first/job.toml",
        "second",
        elsewhere.path(),
        Path::new("nowhere"),
    );
    assert_eq!(again, code);
    assert_eq!(first["verdict"]["checks"], second["verdict"]["checks"]);
}

/// A program whose points the arm does not reach is written, and no script goes on as if it were one to drive.
#[test]
fn a_program_that_the_arm_does_not_reach_ends_with_a_code() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    printed(&["new", "waam", "wall", "--shape", "thin-wall"], folder);
    let file = folder.join("wall/job.toml");
    let plain = fs::read_to_string(&file).unwrap();
    let plain = plain.replace("# count = 20 ", "count = 2 ");
    for (place, code) in [(0, 0), (9000, 1)] {
        let machine = format!(
            "[machine]\nrobot = \"fanuc-arcmate-120ic\"\nplace = [\"{place} mm\", \"0 mm\", \"0 mm\"]\n"
        );
        let job = if plain.contains("\n[machine]\n") {
            plain.replace("\n[machine]\n", &format!("\n{machine}"))
        } else {
            format!("{plain}\n{machine}")
        };
        fs::write(&file, job).unwrap();
        let plan = format!("{place}.melt");
        printed(
            &["plan", "wall/job.toml", "--as-written", "--out", &plan],
            folder,
        );
        let out = format!("out-{place}");
        let args = [
            "program",
            "wall/job.toml",
            "--toolpath",
            &plan,
            "--out",
            &out,
        ];
        let output = meltpath(&args, folder);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert_eq!(
            said.contains("does not hold the torch"),
            code == 1,
            "{said}"
        );
        assert!(folder.join(out).is_dir());
    }
}

/// A thickness that no beam explains: the checks of the fit are told as those of any verdict, each by its own outcome.
#[test]
fn a_fit_tells_its_verdict() {
    let dir = tempfile::tempdir().unwrap();
    let file = "layers = 1\nspacing = \"100 µm\"\n[[wall]]\nmeasured = \"8 mm\"\nsigma = \"20 µm\"\ncurrent = \"3 mA\"\nvoltage = \"60 kV\"\nfocus = \"4 mA\"\nspeed = \"800 mm/s\"\n";
    fs::write(dir.path().join("m.toml"), file).unwrap();
    let output = meltpath(&["fit", "m.toml", "--out", "out"], dir.path());
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("fail  misses of measurements"), "{said}");
    assert!(said.contains("verdict: fail"), "{said}");
    assert!(!said.contains("cannot say: "), "{said}");
}
