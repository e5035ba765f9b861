//! The targets: a name, seeds, how they are damaged, and what must hold.

mod clouds;
mod dialects;
mod machines;
mod parts;
mod paths;
mod records;
mod settings;
mod toolpaths;

use std::path::Path;

use meltpath_data::File;

use crate::mutate::Form;

/// One parser under test.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name: that of the fuzz target too.
    pub name: &'static str,
    /// How its seeds are damaged.
    pub form: Form,
    /// Valid inputs.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// What must hold of any bytes; panics where it does not.
    pub body: fn(&[u8]),
}

/// Every target.
pub const TARGETS: &[Target] = &[
    parts::STEP,
    parts::STL,
    parts::THREE_MF,
    parts::THREE_MF_MODEL,
    paths::FANUC_LS,
    dialects::KRL,
    dialects::RAPID,
    dialects::UR_SCRIPT,
    dialects::INFORM,
    dialects::VAL3,
    paths::CLI_LAYERS,
    paths::CLI_BINARY,
    paths::VECTOR_LIST,
    toolpaths::TOOLPATH_3MF,
    paths::BEAM_PATH,
    paths::CONTAINER,
    paths::TOOLPATH_INDEX,
    paths::CHARTS,
    settings::JOB,
    settings::WIRE,
    settings::GAS,
    settings::PROCESS_MAP,
    settings::POOL,
    settings::ENERGY,
    machines::CELL,
    machines::ROBOT,
    machines::URDF,
    machines::GUN,
    machines::FOCUS,
    machines::MOTOR,
    machines::TUNE,
    machines::CONTROLLERS,
    machines::HEALTH_HISTORY,
    settings::MATERIAL,
    settings::SCAN_HEAD,
    settings::RECIPE,
    settings::MAPPING,
    settings::MEASUREMENTS,
    settings::SCAN_FILE,
    settings::RECORDS_FILE,
    clouds::PLY,
    clouds::LINES,
    records::CSV,
    records::MAT,
    records::PARQUET,
    records::SAMPLES,
];

/// The target of a name.
///
/// # Panics
/// Where there is none.
pub fn named(name: &str) -> &'static Target {
    TARGETS
        .iter()
        .find(|t| t.name == name)
        .unwrap_or_else(|| panic!("there is no fuzz target {name}"))
}

/// Files of the repository with one of `endings`, at most `longest` bytes each.
fn files(folder: &str, endings: &[&str], longest: usize) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(folder);
    let mut paths: Vec<_> = std::fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .filter(|p| {
            p.extension()
                .is_some_and(|e| endings.iter().any(|wanted| e == *wanted))
        })
        .collect();
    paths.sort();
    let mut found: Vec<Vec<u8>> = paths.iter().map(|p| std::fs::read(p).unwrap()).collect();
    found.retain(|bytes| bytes.len() <= longest);
    assert!(!found.is_empty(), "{} has no seeds", folder.display());
    found
}

/// A reader that wants a file gets one with this ending.
fn in_file(bytes: &[u8], ending: &str, read: impl FnOnce(&Path)) {
    let mut file = tempfile::Builder::new().suffix(ending).tempfile().unwrap();
    std::io::Write::write_all(&mut file, bytes).unwrap();
    read(file.path());
}

/// A target over text.
const fn text(name: &'static str, seeds: fn() -> Vec<Vec<u8>>, body: fn(&[u8])) -> Target {
    Target {
        name,
        form: Form::Text,
        seeds,
        body,
    }
}

fn shipped(files: &[File]) -> Vec<Vec<u8>> {
    files.iter().map(|f| f.text.as_bytes().to_vec()).collect()
}

/// TOML is text: what is not was refused before.
fn with_text(bytes: &[u8], read: impl FnOnce(&str)) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        read(text);
    }
}
