//! What may be written in files, told by their declarations: the reference of the book, and JSON Schemas for editors.

use std::fmt::Write as _;

use meltpath_base::settings::{self, Json, Kind, Table, Value};
use serde_json::json;

use crate::job::{ProcessKind, table_of};
use crate::tune::file::TuneFile;

/// The files that have a schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// A job of any process.
    Job,
    /// A tuning of a scan head's axes.
    Tune,
}

/// The processes in the order of the book, each with its heading.
const PROCESSES: [(ProcessKind, &str); 3] = [
    (ProcessKind::Waam, "Wire arc"),
    (ProcessKind::Ebm, "Electron beam"),
    (ProcessKind::Lpbf, "Laser scan head"),
];

const HEAD: &str = "# The job file

<!-- made from the declarations of the settings: `MELTPATH_BLESS=1 cargo test -p meltpath --test all reference::` -->

A job is one short TOML file. Values carry their unit (`\"0.75 m/min\"`); a bare number where a unit is needed is an error that
says what to write, and so is a key that meltpath does not know. All mistakes of a file are told at once. Everything not written
has a default; `meltpath doctor job.toml` prints every value with where it comes from, counts what is wrong, and exits with 2 for
whatever `meltpath run` would refuse. `meltpath schema job` prints a JSON Schema, with which an editor checks and completes jobs.

Files are relative to the job. `process.kind` says which of the following holds.
";

const PART: &str = "
## Where the part stands

The part file's axes are the part frame (the robot's user frame), turned so that `build_direction` points up, and moved along
it so that the lowest point of the part lies on the plate, z = 0. Across the build direction nothing is moved.
";

/// The page of the book on job files and tuning files.
pub fn page() -> String {
    let mut page = HEAD.to_owned();
    for (kind, heading) in PROCESSES {
        if let Some(table) = table_of(kind) {
            let (word, text) = (kind.word(), table.text.trim());
            // writing into a string does not fail
            let _ = writeln!(
                page,
                "\n## {heading}\n\n`process.kind = \"{word}\"`. {text}\n"
            );
            page += &settings::reference(&table);
        }
    }
    page += PART;
    if let Some(table) = tune() {
        let text = table.text.trim();
        let _ = writeln!(page, "\n# The tuning file\n\n`meltpath tune`: {text}\n");
        page += &settings::reference(&table);
    }
    page
}

fn tune() -> Option<Table> {
    match TuneFile::KIND {
        Kind::Table(table) => Some(table),
        _ => None,
    }
}

/// The JSON Schema of a file.
pub fn schema(subject: Subject) -> Json {
    let mut schema = match subject {
        Subject::Job => job(),
        Subject::Tune => tune().as_ref().map(settings::schema).unwrap_or_default(),
    };
    schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    schema["title"] = json!(match subject {
        Subject::Job => "meltpath job",
        Subject::Tune => "meltpath tuning",
    });
    schema
}

/// `process.kind` selects the tables.
fn job() -> Json {
    let of = |kind: ProcessKind| {
        let table = table_of(kind)?;
        let is =
            json!({"properties": {"process": {"properties": {"kind": {"const": kind.word()}}}}});
        Some(json!({"if": is, "then": settings::schema(&table)}))
    };
    let words: Vec<&str> = PROCESSES.iter().map(|(kind, _)| kind.word()).collect();
    json!({
        "type": "object",
        "required": ["process"],
        "properties": {"process": {"required": ["kind"], "properties": {"kind": {"enum": words}}}},
        "allOf": PROCESSES.iter().filter_map(|(kind, _)| of(*kind)).collect::<Vec<Json>>(),
    })
}
