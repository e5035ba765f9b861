//! What several of these tests set up, and what they look for.

use std::path::{Path, PathBuf};

use meltpath::chain;
use meltpath::ebm::plan::{Plan, planned};
use meltpath::job::{Job, load};
use meltpath::outcome::RunFolder::NextIn;
use meltpath_base::{Check, Silent, Verdict};
use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::write_stl;

/// The check `id`.
pub(crate) fn check<'a>(verdict: &'a Verdict, id: &str) -> &'a Check {
    let found = verdict.checks.iter().find(|c| c.id == id);
    found.unwrap_or_else(|| panic!("no check {id}: {verdict:?}"))
}

/// A text says all of this.
#[track_caller]
pub(crate) fn says(text: &impl ToString, words: &[&str]) {
    let text = text.to_string();
    for word in words {
        assert!(text.contains(word), "{word}: {text}");
    }
}

/// Rows of three columns with `=>` between, and `\n` where a line ends.
pub(crate) fn rows(table: &str) -> Vec<[String; 3]> {
    let columns = |row: &str| -> Vec<String> {
        let row = row.replace("\\n", "\n");
        row.split("=>").map(|c| c.trim().to_owned()).collect()
    };
    let rows = table.trim().lines().map(columns);
    rows.map(|row| row.try_into().unwrap()).collect()
}

/// A mesh as a file of a folder.
pub(crate) fn part(folder: &Path, name: &str, mesh: &Mesh) {
    let mut bytes = Vec::new();
    write_stl(mesh, name, &mut bytes).unwrap();
    write(folder, name, bytes);
}

/// A file in a folder.
pub(crate) fn write(folder: &Path, name: impl AsRef<Path>, content: impl AsRef<[u8]>) -> PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, content).unwrap();
    file
}

/// All of these lie in a folder.
#[track_caller]
pub(crate) fn has_files(folder: &Path, names: &[&str]) {
    for name in names {
        assert!(folder.join(name).is_file(), "{name}");
    }
}

/// What a run of a job is refused with.
#[track_caller]
pub(crate) fn refusal(job: &Path) -> String {
    let folder = job.parent().unwrap();
    let error = chain::run(job, NextIn(folder), &Silent).unwrap_err();
    error.to_string()
}

/// Whether it warns of `code`.
pub(crate) fn warned(verdict: &Verdict, code: &str) -> bool {
    verdict.warnings.iter().any(|w| w.code == code)
}

/// A job of the thin wall that ships, with its wire, gas and mode and further tables.
pub(crate) fn thin_wall(folder: &Path, tables: &str) -> PathBuf {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/thin-wall");
    std::fs::copy(example.join("wall.stl"), folder.join("wall.stl")).unwrap();
    let text = format!(
        "part = \"wall.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n{tables}"
    );
    write(folder, "job.toml", text)
}

/// The plan of an electron-beam job.
pub(crate) fn plan_of(file: &Path) -> Plan {
    let (Job::Ebm(read), _) = load(file).unwrap() else {
        unreachable!("the job is an electron-beam job")
    };
    planned(&read, file.parent().unwrap(), &Silent).unwrap()
}

/// What a run was refused with, `meltpath doctor` says before.
pub(crate) fn foretold(error: &impl ToString, job: &Path) {
    let doctor = chain::doctor(job, &Silent).unwrap();
    assert_eq!(error.to_string(), doctor.refused.unwrap().to_string());
}
