//! Remedies are applied: the complaint is gone then, and no other comes in its place.

use crate::support::says;
use std::fs;
use std::path::{Path, PathBuf};

use meltpath::chain::{self, Diagnosis, RunError};
use meltpath::job::{self, JobError, ProcessKind, table_of};
use meltpath::reference::Subject;
use meltpath::{data, start};
use meltpath_base::Silent;
use meltpath_base::settings::{Kind, Problem, Table};

/// A folder with a new job, and the job's text.
fn new(kind: ProcessKind) -> (tempfile::TempDir, PathBuf, String) {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("job");
    let job = match kind {
        ProcessKind::Waam => start::waam(&folder, "ring", None),
        ProcessKind::Ebm => start::ebm(&folder),
        ProcessKind::Lpbf => start::lpbf(&folder),
    };
    let job = job.unwrap();
    let text = fs::read_to_string(&job).unwrap();
    (dir, job, text)
}

fn doctor(job: &Path, text: &str) -> Diagnosis {
    fs::write(job, text).unwrap();
    chain::doctor(job, &Silent).unwrap()
}

/// What a job is refused for; empty where it is taken.
fn problems(job: &Path, text: &str) -> Vec<Problem> {
    match doctor(job, text).refused {
        None => Vec::new(),
        Some(RunError::Job(JobError::Text { problems, .. })) => problems,
        Some(other) => panic!("{other}"),
    }
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// Puts every fix in its place, the last one first.
fn mended(text: &str, problems: &[Problem]) -> String {
    let mut found: Vec<_> = problems
        .iter()
        .map(|p| (p.span.clone().unwrap(), p.fix.clone().unwrap()))
        .collect();
    found.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    found
        .into_iter()
        .fold(text.to_owned(), |mut text, (span, fix)| {
            text.replace_range(span, &fix);
            text
        })
}

#[test]
fn what_a_message_says_to_write_mends_the_job() {
    let (_dir, job, good) = new(ProcessKind::Waam);
    assert_eq!(problems(&job, &good), []);
    for (from, to) in [
        (
            "travel_speed = \"0.75 m/min\"",
            "travel_speed = \"0,75 m/min\"",
        ),
        ("travel_speed = \"0.75 m/min\"", "travel_speed = 0,75 m/min"),
        (
            "travel_speed = \"0.75 m/min\"",
            "travel_sped = \"0.75 m/min\"",
        ),
        ("ctwd = \"15 mm\"", "ctwd = 15"),
        ("ctwd = \"15 mm\"", "ctwd = \"15\""),
        ("ctwd = \"15 mm\"", "ctwd = 15 mm"),
        ("# strategy = \"hybrid\"", "strategy = \"hibrid\""),
        ("# smoothing = \"50 %\"", "smoothing = 50 %"),
        ("[machine]", "[machin]"),
    ] {
        let bad = replaced(&good, from, to);
        let found = problems(&job, &bad);
        let mendable: Vec<_> = found.iter().filter(|p| p.fix.is_some()).cloned().collect();
        assert!(!mendable.is_empty(), "{to}: {found:?}");
        let left = problems(&job, &mended(&bad, &mendable));
        assert_eq!(left, [], "{to}");
    }
}

/// Mistakes that do not hang together are told at once: a value that does not read, a file that is not there, a wire that nobody
/// knows; a stepover and a layer that no such bead can make. The key with the wrong value is not listed as if it were unwritten.
#[test]
fn independent_mistakes_are_told_together() {
    let (_dir, job, good) = new(ProcessKind::Waam);
    let part = good.lines().find(|l| l.starts_with("part = ")).unwrap();
    let bad = replaced(&good, "lack = \"0.5 %\"", "lack = \"0.5\"");
    let bad = replaced(&bad, "x90-ig-1.0", "x91");
    let bad = replaced(&bad, part, "part = \"gone.stl\"");
    let found = problems(&job, &bad);
    let places: Vec<&str> = found
        .iter()
        .map(|p| &bad[p.span.clone().unwrap()])
        .collect();
    assert_eq!(places, ["\"0.5\"", "\"gone.stl\"", "\"x91\""], "{found:?}");
    let lines = doctor(&job, &bad).lines;
    assert!(
        lines.iter().any(|l| l == "lack: wrong: see below"),
        "{lines:?}"
    );
    let gone = problems(&job, &replaced(&good, part, "part = \"gone.stl\""));
    assert!(gone.len() == 1 && gone[0].span.is_some(), "{gone:?}");

    let bad = replaced(&good, "height = \"auto\" ", "height = \"0.0001 mm\" ");
    let bad = replaced(&bad, "stepover = \"auto\"", "stepover = \"40 mm\"");
    assert_eq!(problems(&job, &bad).len(), 2);

    let (_dir, job, good) = new(ProcessKind::Ebm);
    let bad = replaced(&good, "\"ti6al4v-ebm\"", "\"tin\"");
    let bad = replaced(&bad, "in_window = \"20 %\"", "in_window = \"20\"");
    assert_eq!(problems(&job, &bad).len(), 2);
    let (_dir, job, good) = new(ProcessKind::Lpbf);
    let bad = replaced(&good, "[lpbf]", "[heat]\npreheat = 3\n[lpbf]");
    let head = good.lines().find(|l| l.starts_with("head = ")).unwrap();
    let bad = replaced(&bad, head, "head = \"mine\"");
    assert_eq!(problems(&job, &bad).len(), 2);
}

/// A remedy in words: what is written instead, and that the complaint named it.
#[test]
fn remedies_in_words_end_the_complaint() {
    let heat = "[heat]\nmaterial = \"mine.toml\"\n";
    for (kind, (from, bad), named, cure) in [
        (
            ProcessKind::Waam,
            ("height = \"auto\" ", "height = \"0.0001 mm\" "),
            "write height = \"auto\"",
            "height = \"auto\" ",
        ),
        (
            ProcessKind::Waam,
            ("stepover = \"auto\"", "stepover = \"40 mm\""),
            "0.6 to 0.8 bead widths: \"0.7 w\"",
            "stepover = \"0.7 w\"",
        ),
        (
            ProcessKind::Waam,
            ("[process]\nkind = \"waam\"\n", ""),
            "add\n[process]\nkind = \"waam\"",
            "[process]\nkind = \"waam\"\n",
        ),
        (
            ProcessKind::Lpbf,
            ("\n[lpbf]\n", &format!("\n{heat}\n[lpbf]\n")),
            "[heat] absorptivity = \"35 %\"",
            &format!("\n{heat}absorptivity = \"35 %\"\n\n[lpbf]\n"),
        ),
        (
            ProcessKind::Lpbf,
            ("\n[lpbf]\n", "\n[heat]\npreheat = \"1400 °C\"\n\n[lpbf]\n"),
            "give heat.preheat below",
            "\n[heat]\npreheat = \"200 °C\"\n\n[lpbf]\n",
        ),
    ] {
        let (_dir, job, good) = new(kind);
        let alloy = meltpath_data::materials::IN625_LASER.text;
        let at = alloy.find("[absorptivity]").unwrap();
        let end = at + alloy[at..].find("\n\n").unwrap();
        let mute = format!("{}{}", &alloy[..at], &alloy[end..]);
        fs::write(job.with_file_name("mine.toml"), mute).unwrap();
        let found = problems(&job, &replaced(&good, from, bad));
        let told = |p: &Problem| p.help.as_deref().is_some_and(|help| help.contains(named));
        assert!(found.iter().any(told), "{named}: {found:?}");
        let left = problems(&job, &replaced(&good, from, cure));
        assert_eq!(left, [], "{named}");
    }
}

#[test]
fn a_warning_goes_with_its_remedy() {
    let (_dir, job, good) = new(ProcessKind::Waam);
    let warned = |text: &str| doctor(&job, text).lines.join("\n").contains("may not fuse");
    let wide = replaced(&good, "stepover = \"auto\"", "stepover = \"0.95 w\"");
    let flat = replaced(
        &wide,
        "travel_speed = \"0.75 m/min\"",
        "travel_speed = \"1.5 m/min\"",
    );
    assert!(warned(&flat));
    assert!(!warned(&replaced(&flat, "0.95 w", "0.70 w")));
}

/// Data of the user's own, with mistakes: each answered in that file, and mended by what is said.
#[test]
fn files_of_ones_own_are_answered_in_their_place() {
    let (_dir, job, good) = new(ProcessKind::Waam);
    let text = replaced(&good, "wire = \"x90-ig-1.0\"", "wire = \"mine.toml\"");
    let text = replaced(&text, "cell = \"arcmate-120ic\"", "cell = \"cell.toml\"");
    let wire = meltpath_data::wires::X90_IG_1_0.text;
    let cell = meltpath_data::cells::ARCMATE_120IC.text;
    let put = |wire: &str, cell: &str| {
        fs::write(job.with_file_name("mine.toml"), wire).unwrap();
        fs::write(job.with_file_name("cell.toml"), cell).unwrap();
        problems(&job, &text)
    };
    assert_eq!(put(wire, cell), []);
    let bad_wire = replaced(wire, "value = 1.0", "value = \"1,0\"");
    let bad_wire = replaced(&bad_wire, "standard =", "standart =");
    let bad_cell = replaced(cell, "clearance = \"20 mm\"", "clearance = 20");
    let found = put(&bad_wire, &bad_cell);
    let of = |name: &str| -> Vec<Problem> {
        let mine = |p: &&Problem| p.file.as_ref().is_some_and(|f| f.name.ends_with(name));
        found
            .iter()
            .filter(mine)
            .filter(|p| p.fix.is_some())
            .cloned()
            .collect()
    };
    assert_eq!(
        (of("mine.toml").len(), of("cell.toml").len()),
        (2, 1),
        "{found:?}"
    );
    let told = found[0].to_string();
    says(
        &told,
        &["mine.toml:5:1: there is no key `standart`; did you mean"],
    );
    let left = put(
        &mended(&bad_wire, &of("mine.toml")),
        &mended(&bad_cell, &of("cell.toml")),
    );
    assert_eq!(left, []);
    // an unknown name lists what ships
    let unknown = replaced(&good, "wire = \"x90-ig-1.0\"", "wire = \"x91\"");
    assert!(
        problems(&job, &unknown)[0]
            .message
            .contains("\"x90-ig-1.0\"")
    );
    assert!(data::is_file("mine.toml"));
}

fn keys(table: &Table, prefix: &str, found: &mut Vec<String>) {
    for key in table.keys {
        let name = format!("{prefix}{}", key.name);
        if let Kind::Table(inner) = &key.kind {
            keys(inner, &format!("{name}."), found);
        }
        found.push(name);
    }
}

/// Every dotted key that a text of the product names is one that may be written.
#[test]
fn keys_that_messages_name_exist() {
    let mut declared = Vec::new();
    let kinds = [ProcessKind::Waam, ProcessKind::Ebm, ProcessKind::Lpbf];
    for table in kinds
        .into_iter()
        .filter_map(table_of)
        .chain(Subject::Tune.table())
    {
        keys(&table, "", &mut declared);
    }
    let tables: Vec<&str> = declared
        .iter()
        .filter_map(|k| k.split_once('.'))
        .map(|k| k.0)
        .collect();
    let mut named = 0;
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let code = fs::read_to_string(&path).unwrap();
            let code = code.split("#[cfg(test)]").next().unwrap();
            for line in code.lines().filter(|l| !l.trim_start().starts_with("//")) {
                // what stands between quotes; one word alone is a name in the provenance
                let line = line.replace("\\\"", "'");
                let quoted = line.split('"').skip(1).step_by(2);
                for text in quoted.filter(|text| text.contains(' ')) {
                    for word in text.split(|c: char| !(c.is_ascii_lowercase() || "._-".contains(c)))
                    {
                        let word = word.trim_matches('.');
                        let file = Path::new(word).extension().is_some_and(|e| {
                            ["toml", "csv", "json", "melt", "stl", "html", "step", "ls"]
                                .iter()
                                .any(|known| e == *known)
                        });
                        let Some((table, _)) = word.split_once('.').filter(|_| !file) else {
                            continue;
                        };
                        if tables.contains(&table) {
                            named += 1;
                            let known = declared.iter().any(|k| k == word);
                            assert!(known, "{}: {word} is no key: {text}", path.display());
                        }
                    }
                }
            }
        }
    }
    assert!(named > 20, "{named}");
    assert!(job::parse("").is_err());
}
