//! What may be written in files, told by their declarations: the reference of the book, and JSON Schemas for editors.

use std::fmt::Write as _;

use meltpath_base::settings::{self, Json, Kind, Table, Value};
use serde_json::json;

use meltpath_base::choice;
use meltpath_deposition::consumable::{Gas, PoolFile, Wire};
use meltpath_deposition::electric::file::CircuitFile;
use meltpath_deposition::energy::EnergyFile;
use meltpath_deposition::process_map::MapFile;
use meltpath_gun::machine::GunFile;
use meltpath_perception::Mapping;
use meltpath_robot::cell::{CellFile, FROM_URDF};
use meltpath_scan_head::files::{HeadFile, MotorFile, RecipeFile};
use meltpath_thermal::material::file::MaterialFile;

use crate::data::Cell;
use crate::ebm::gun::focus::FocusFile;
use crate::fit::measurements::MeasurementsFile;
use crate::focus::WallsFile;
use crate::job::{ProcessKind, table_of};
use crate::measure::ScanFile;
use crate::motion_log::MotionLogFile;
use crate::records::RecordsFile;
use crate::tune::file::TuneFile;

choice! {
    /// The files that have a schema.
    pub enum Subject {
        Job "job" => "A job of any process.",
        Tune "tune" => "A tuning of a scan head's axes.",
        Measurements "measurements" => "Measured bodies, to which a beam is fitted.",
        Walls "walls" => "Walls that were built for a focus calibration.",
        Scan "scan" => "A scan of beads on a plate.",
        Records "records" => "Records of beads: voltage, current, wire feed.",
        MotionLog "motion-log" => "A log of the tool along a path that was driven.",
        Mapping "mapping" => "The mapping of a record: which column is what.",
        Wire "wire" => "A wire.",
        Gas "gas" => "A shielding gas.",
        Map "map" => "A process map: bead sizes against settings.",
        Pool "pool" => "Weld pools.",
        Energy "energy" => "Electric energies per volume of wire fed.",
        Circuit "circuit" => "The circuit of source, stick-out and arc.",
        Cell "cell" => "A robot cell's controller and programs.",
        Robot "robot" => "A robot with what stands around it.",
        Material "material" => "A material of heat.",
        Head "head" => "A scan head.",
        Motor "motor" => "A motor of a scan head, as `meltpath identify` prints it.",
        Recipe "recipe" => "A recipe of laser scan jobs.",
        Gun "gun" => "An electron gun: what it can do, and how fast.",
        Focus "focus" => "The focus calibration of an electron gun.",
    }
}

/// The data files in the order of the book: how a job names them, and in which folder of the data those that ship lie.
const DATA: [(Subject, &str); 14] = [
    (
        Subject::Wire,
        "`wire = \"my-wire.toml\"` in `[waam]`; `data/wires`",
    ),
    (
        Subject::Gas,
        "`gas = \"my-gas.toml\"` in `[waam]`; `data/gases`",
    ),
    (
        Subject::Map,
        "`map = \"my-map.toml\"` in `[waam]`; `data/process-maps`",
    ),
    (
        Subject::Pool,
        "`pool = \"my-pool.toml\"` in `[waam]`; `data/pools`",
    ),
    (
        Subject::Energy,
        "`energy = \"my-energy.toml\"` in `[waam]`; `data/energy`",
    ),
    (
        Subject::Circuit,
        "`circuit = \"my-circuit.toml\"` in a file of records; `data/electric`",
    ),
    (
        Subject::Cell,
        "`cell = \"my-cell.toml\"` in `[machine]`; `data/cells`",
    ),
    (
        Subject::Robot,
        "`robot = \"my-robot.toml\"` in `[machine]`; `data/robots`",
    ),
    (
        Subject::Material,
        "`material = \"my-material.toml\"` in `[ebm]` and `[heat]`; `data/materials`",
    ),
    (
        Subject::Head,
        "`head = \"my-head.toml\"` in `[lpbf]` and in a tuning file; `data/scan-heads`",
    ),
    (
        Subject::Motor,
        "`x = \"my-motor.toml\"` in `[motor]` of a tuning file; none ships",
    ),
    (
        Subject::Recipe,
        "`recipes = [\"my-recipe.toml\"]` in `[lpbf]`; `data/recipes`",
    ),
    (
        Subject::Gun,
        "`gun = \"my-gun.toml\"` in `[ebm]`; `data/guns`",
    ),
    (
        Subject::Focus,
        "`focus = \"my-focus.toml\"` in `[ebm]`; `data/focus`",
    ),
];

impl Subject {
    /// Its table; none for a job, whose tables depend on the process.
    pub fn table(self) -> Option<Table> {
        let kind = match self {
            Subject::Job => return None,
            Subject::Tune => TuneFile::KIND,
            Subject::Measurements => MeasurementsFile::KIND,
            Subject::Walls => WallsFile::KIND,
            Subject::Scan => ScanFile::KIND,
            Subject::Records => RecordsFile::KIND,
            Subject::MotionLog => MotionLogFile::KIND,
            Subject::Mapping => Mapping::KIND,
            Subject::Wire => Wire::KIND,
            Subject::Gas => Gas::KIND,
            Subject::Map => MapFile::KIND,
            Subject::Pool => PoolFile::KIND,
            Subject::Energy => EnergyFile::KIND,
            Subject::Circuit => CircuitFile::KIND,
            Subject::Cell => Cell::KIND,
            Subject::Robot => CellFile::KIND,
            Subject::Material => MaterialFile::KIND,
            Subject::Head => HeadFile::KIND,
            Subject::Motor => MotorFile::KIND,
            Subject::Recipe => RecipeFile::KIND,
            Subject::Gun => GunFile::KIND,
            Subject::Focus => FocusFile::KIND,
        };
        match kind {
            Kind::Table(table) => Some(table),
            _ => None,
        }
    }
}

/// The processes in the order of the book, each with its heading.
const PROCESSES: [(ProcessKind, &str); 3] = [
    (ProcessKind::Waam, "Wire arc"),
    (ProcessKind::Ebm, "Electron beam"),
    (ProcessKind::Lpbf, "Laser scan head"),
];

const HEAD: &str = "# The job file

<!-- made from the declarations of the settings: `MELTPATH_BLESS=1 cargo test -p meltpath-app --test all reference::` -->

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

/// The pages of the book on files, each with its name there.
pub fn pages() -> [(&'static str, String); 2] {
    [("job.md", page()), ("data.md", data_page())]
}

/// On job files and what other commands read.
fn page() -> String {
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
    for (subject, heading, read_by) in [
        (Subject::Tune, "The tuning file", "`meltpath tune`"),
        (
            Subject::Measurements,
            "The file of measurements",
            "`meltpath fit`",
        ),
        (Subject::Walls, "The file of walls", "`meltpath focus`"),
        (Subject::Scan, "The file of a scan", "`meltpath measure`"),
        (
            Subject::Records,
            "The file of records",
            "`meltpath measure`, of records of beads",
        ),
        (
            Subject::MotionLog,
            "The file of a log of the tool",
            "`meltpath measure`, of a dry run",
        ),
        (
            Subject::Mapping,
            "The mapping of a record",
            "`meltpath identify`, `meltpath health` and tuning on a record",
        ),
    ] {
        page += &told(subject, |_, text| {
            format!("# {heading}\n\n{read_by}: {text}")
        });
    }
    page
}

/// A file other than a job: what its word and its own text make of its beginning, and its keys.
fn told(subject: Subject, begin: impl Fn(&str, &str) -> String) -> String {
    let Some(table) = subject.table() else {
        return String::new();
    };
    let word = subject.word();
    let begin = begin(word, table.text.trim());
    let keys = settings::reference(&table);
    format!("\n{begin} Schema: `meltpath schema {word}`.\n\n{keys}")
}

const DATA_HEAD: &str = "# Data files

<!-- made from the declarations of the settings: `MELTPATH_BLESS=1 cargo test -p meltpath-app --test all reference::` -->

Wires, gases, process maps, weld pools, energies, circuits, cells, robots, materials, heads, motors, recipes, guns and focus calibrations are TOML files. The quickest way
to one of your own: copy the one that ships (`crates/data` of the source), and change its numbers.

A job names a file in one of two ways:

- by its path, relative to the job: `wire = \"my-wire.toml\"`;
- by a name without `.toml`: `wire = \"my-wire\"`. It is looked for, in this order, in `data/wires` beside the job, in `wires` of your
  own folder, and among those that ship. The first one found wins. Where it hides one that ships, a warning says so.

Your own folder is `~/.config/meltpath` (`$XDG_CONFIG_HOME/meltpath`; on Windows `%APPDATA%\\meltpath`), or the one that the environment
variable `MELTPATH_DATA` names. Its subfolders are called as in `crates/data`: `wires`, `gases`, `process-maps`, `pools`, `energy`, `electric`,
`cells`, `robots`, `materials`, `scan-heads`, `recipes`, `guns`, `focus`. `meltpath list wires` tells which there are, and where each comes from.

A run copies the files of your own that it used into its folder.

Every number says where it comes from. There are two forms:

- with the unit in the text: `{ value = \"12 ms\", source = \"identified on our robot\", uncertainty = \"1 ms\" }`;
- with the unit beside it: `{ value = 1.2, unit = \"mm\", source = \"data sheet\", page = \"2\", uncertainty = 0.01 }`.

In both, `uncertainty` (one standard deviation) and `note` may be left out; in the first, `page` too. Either form may be
written as a table of its own, `[diameter]`.

All mistakes of a file are told at once, each with its place. For an editor that checks and completes while you write, save the
schema, `meltpath schema wire > wire.schema.json`, and begin the file with `#:schema ./wire.schema.json`.
";

/// On data files.
fn data_page() -> String {
    let mut page = DATA_HEAD.to_owned();
    for (subject, named) in DATA {
        page += &told(subject, |word, text| {
            format!("## {word}\n\n{text} {named}.")
        });
    }
    page
}

/// The JSON Schema of a file.
pub fn schema(subject: Subject) -> Json {
    let mut schema = match subject.table() {
        Some(table) => settings::schema(&table),
        None => job(),
    };
    if subject == Subject::Robot {
        unless_in_a_urdf(&mut schema);
    }
    schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    schema["title"] = json!(format!("meltpath {}", subject.word()));
    schema
}

/// What a robot's file must say is asked of it where it names no URDF that says it.
fn unless_in_a_urdf(schema: &mut Json) {
    let mut asked = json!({"required": FROM_URDF});
    for table in FROM_URDF {
        let own = schema["properties"][table].as_object_mut();
        if let Some(required) = own.and_then(|own| own.remove("required")) {
            asked["properties"][table] = json!({"required": required});
        }
    }
    if let Some(required) = schema["required"].as_array_mut() {
        required.retain(|key| !FROM_URDF.iter().any(|table| key == table));
    }
    schema["if"] = json!({"required": ["urdf"]});
    schema["then"] = json!(true);
    schema["else"] = asked;
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
