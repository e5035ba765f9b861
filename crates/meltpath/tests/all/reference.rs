//! The book, the schema and the templates hold to the declarations of the settings.
use std::path::Path;

use meltpath::job::{self, ProcessKind, table_of};
use meltpath::reference::{Subject, page, schema};
use meltpath::start;
use meltpath_base::settings::{Fallback, Kind, Table};

/// `MELTPATH_BLESS=1` writes the page anew.
#[test]
fn the_book_has_every_key() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/job.md");
    if std::env::var_os("MELTPATH_BLESS").is_some() {
        std::fs::write(&path, page()).unwrap();
    }
    let book = std::fs::read_to_string(&path).unwrap();
    assert!(
        book == page(),
        "write it anew: MELTPATH_BLESS=1 cargo test -p meltpath --test all reference::"
    );
}

fn keys(table: &Table, prefix: &str, found: &mut Vec<String>) {
    for key in table.keys {
        let name = format!("{prefix}{}", key.name);
        assert!(!key.text.trim().is_empty(), "{name} says nothing");
        if let Fallback::Default { why, .. } = key.fallback {
            assert!(!why.is_empty(), "the default of {name} has no reason");
        }
        if let Kind::Table(inner) = &key.kind {
            keys(inner, &format!("{name}."), found);
        }
        found.push(name);
    }
}

/// Every key is described, and a job in which no default reads would be refused: all defaults read.
#[test]
fn every_key_is_described_and_every_default_reads() {
    for (kind, least) in [
        (
            ProcessKind::Waam,
            "part = \"a.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"w\"\ngas = \"g\"\nmode = \"m\"\n",
        ),
        (
            ProcessKind::Ebm,
            "part = \"a.stl\"\n[process]\nkind = \"ebm\"\n[hatch]\n[modulation]\n[optimise]\nmethod = \"pid\"\n[judge]\nsolver = \"reference\"\n",
        ),
        (
            ProcessKind::Lpbf,
            "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"h\"\nrecipes = [\"r\"]\n[optimise]\n[heat]\n",
        ),
    ] {
        let mut found = Vec::new();
        keys(&table_of(kind).unwrap(), "", &mut found);
        assert!(found.len() > 30, "{found:?}");
        let read = job::read(least);
        let told: Vec<String> = read.problems.iter().map(ToString::to_string).collect();
        // overrun and modulation exclude each other only where both are written
        assert!(told.is_empty(), "{told:?}");
        for (name, value) in &read.provenance.parameters {
            assert!(found.contains(name), "{name} is recorded and not declared");
            assert!(!value["value"].is_null(), "{name}");
        }
    }
}

/// The jobs that ship read.
#[test]
fn every_example_reads() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut jobs = 0;
    for entry in std::fs::read_dir(examples).unwrap() {
        let job = entry.unwrap().path().join("job.toml");
        if let Ok(text) = std::fs::read_to_string(&job) {
            jobs += 1;
            let read = job::parse(&text);
            assert!(read.is_ok(), "{}: {read:?}", job.display());
        }
    }
    assert!(jobs >= 10, "{jobs}");
}

/// A schema knows each key of the declaration, and each template names its schema.
#[test]
fn schemas_have_every_key_and_templates_name_them() {
    let job = schema(Subject::Job);
    let parts = job["allOf"].as_array().unwrap();
    assert_eq!(parts.len(), 3);
    let waam = &parts[0]["then"]["properties"];
    assert_eq!(waam["fill"]["properties"]["strategy"]["default"], "hybrid");
    assert_eq!(
        waam["waam"]["required"],
        serde_json::json!(["wire", "gas", "mode"])
    );
    let pattern = waam["machine"]["properties"]["ctwd"]["pattern"]
        .as_str()
        .unwrap();
    assert!(pattern.contains("mm|µm"), "{pattern}");
    let tune = schema(Subject::Tune);
    assert_eq!(
        tune["properties"]["h-infinity"]["additionalProperties"],
        false
    );
    for template in [
        start::WAAM_TEMPLATE,
        start::EBM_TEMPLATE,
        start::LPBF_TEMPLATE,
    ] {
        assert!(template.starts_with("#:schema ./job.schema.json\n"));
    }
}
