//! The book, the schema and the templates hold to the declarations of the settings.
use std::path::Path;

use meltpath::job::{self, ProcessKind, table_of};
use meltpath::reference::{Subject, pages, schema};
use meltpath::start;
use meltpath_base::settings::{Fallback, Json, Kind, Table};

/// `MELTPATH_BLESS=1` writes the pages anew.
#[test]
fn the_book_has_every_key() {
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference");
    for (name, made) in pages() {
        let path = book.join(name);
        if std::env::var_os("MELTPATH_BLESS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let found = std::fs::read_to_string(&path).unwrap();
        assert!(
            found == made,
            "write {name} anew: MELTPATH_BLESS=1 cargo test --release -p meltpath-app --test all reference::"
        );
    }
}

/// What of `value` a schema refuses: types, keys, words, patterns, bounds, as far as the schemas here use them.
fn refused(value: &Json, schema: &Json, place: &str, found: &mut Vec<String>) {
    let mut wrong = |what: &str| found.push(format!("{place}: {what}: {value}"));
    if let Some(kind) = schema["type"].as_str() {
        let is = match kind {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "integer" => value.is_u64(),
            "number" => value.is_number() || value.is_null(),
            other => panic!("unknown type {other}"),
        };
        if !is {
            wrong(kind);
            return;
        }
    }
    if schema.get("const").is_some_and(|word| word != value) {
        wrong("const");
    }
    if let Some(words) = schema["enum"].as_array()
        && !words.contains(value)
    {
        wrong("enum");
    }
    if let (Some(pattern), Some(text)) = (schema["pattern"].as_str(), value.as_str()) {
        let units = &pattern[pattern.rfind(r"\s*(").unwrap() + 4..pattern.rfind(')').unwrap()];
        let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || "+-.eE".contains(c));
        if !units
            .replace("\\.", ".")
            .split('|')
            .any(|u| u == unit.trim())
        {
            wrong("unit");
        }
    }
    if let Some(number) = value.as_f64() {
        let bound = |word: &str| schema[word].as_f64();
        if bound("minimum").is_some_and(|b| number < b)
            || bound("exclusiveMinimum").is_some_and(|b| number <= b)
            || bound("maximum").is_some_and(|b| number > b)
        {
            wrong("bounds");
        }
    }
    for (word, least) in [("oneOf", 1), ("anyOf", 1)] {
        if let Some(each) = schema[word].as_array() {
            let fits = each.iter().filter(|schema| {
                let mut inner = Vec::new();
                refused(value, schema, place, &mut inner);
                inner.is_empty()
            });
            if fits.count() < least {
                wrong(word);
            }
        }
    }
    if let (Some(items), Some(values)) = (schema.get("items"), value.as_array()) {
        for value in values {
            refused(value, items, place, found);
        }
    }
    let Some(table) = value.as_object().filter(|_| schema["type"] == "object") else {
        return;
    };
    for (key, value) in table {
        let place = format!("{place}.{key}");
        match (
            schema["properties"].get(key),
            &schema["additionalProperties"],
        ) {
            (Some(schema), _) => refused(value, schema, &place, found),
            (None, Json::Bool(false)) => found.push(format!("{place}: unknown")),
            (None, other) => refused(value, other, &place, found),
        }
    }
    for key in schema["required"].as_array().into_iter().flatten() {
        if !table.contains_key(key.as_str().unwrap()) {
            found.push(format!("{place}.{key}: missing"));
        }
    }
}

/// Every data file that ships fits its schema; one with a key, a unit or a word of another kind does not.
#[test]
fn shipped_data_fit_their_schemas() {
    use meltpath_data::{
        cells, energy, focus, gases, guns, materials, pools, process_maps, recipes, robots,
        scan_heads, wires,
    };
    let json = |text: &str| serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
    let said = |value: &Json, subject: Subject| {
        let mut found = Vec::new();
        refused(value, &schema(subject), "", &mut found);
        found
    };
    for (subject, files) in [
        (Subject::Wire, wires::ALL),
        (Subject::Gas, gases::ALL),
        (Subject::Map, process_maps::ALL),
        (Subject::Pool, pools::ALL),
        (Subject::Energy, energy::ALL),
        (Subject::Cell, cells::ALL),
        (Subject::Robot, robots::ALL),
        (Subject::Material, materials::ALL),
        (Subject::Head, scan_heads::ALL),
        (Subject::Recipe, recipes::ALL),
        (Subject::Gun, guns::ALL),
        (Subject::Focus, focus::ALL),
    ] {
        for file in files {
            let value = json(file.text);
            let found = said(&value, subject);
            assert!(found.is_empty(), "{}: {found:?}", file.name);
            let mut other = value.clone();
            other["colour"] = "red".into();
            assert_eq!(said(&other, subject), [".colour: unknown"]);
        }
    }
    let struts =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/ebm-struts/measurements.toml");
    let struts = std::fs::read_to_string(struts).unwrap();
    let mapping = "sample_time = \"50 us\"\n[channels.voltage]\ncolumn = \"U\"\nunit = \"V\"\n[channels.angle]\ncolumn = 2\nunit = \"deg\"\nscale = 6.87e-5\n";
    for (text, subject) in [
        (struts.as_str(), Subject::Measurements),
        (mapping, Subject::Mapping),
    ] {
        let found = said(&json(text), subject);
        assert!(found.is_empty(), "{found:?}");
    }
    let spoilt = |from: &str, to: &str, text: &str, subject: Subject| {
        assert!(text.contains(from), "{from}");
        said(&json(&text.replacen(from, to, 1)), subject)
    };
    let wire = wires::X90_IG_1_0.text;
    assert!(spoilt("value = 1.0", "value = \"1,0\"", wire, Subject::Wire)[0].contains("number"));
    assert!(spoilt("\"mm\"", "\"mn\"", wire, Subject::Wire)[0].contains("enum"));
    let cell = cells::ALL[0].text;
    assert!(spoilt("\"12 ms\"", "\"12 mm\"", cell, Subject::Cell)[0].contains("unit"));
    assert!(spoilt("\"deg\"", "\"degrees\"", mapping, Subject::Mapping)[0].contains("oneOf"));
    assert!(spoilt("\"657 µm\"", "\"657\"", &struts, Subject::Measurements)[0].contains("unit"));
    let head = scan_heads::TWO_AXIS_150.text;
    assert!(spoilt("\"two-axis\"", "\"one-axis\"", head, Subject::Head)[0].contains("oneOf"));
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
    // an arm may come from a URDF: then it need not be written, and its speeds may stand alone
    let robot = schema(Subject::Robot);
    let required = robot["required"].as_array().unwrap();
    assert!(
        required.iter().all(|key| key != "arm" && key != "joints"),
        "{required:?}"
    );
    assert!(robot["properties"]["joints"].get("required").is_none());
    assert_eq!(
        robot["else"]["required"],
        serde_json::json!(["arm", "joints"])
    );
    assert!(robot["else"]["properties"]["joints"]["required"].is_array());
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
