//! The file that tells what a scan shows.

use std::path::Path;

use meltpath_base::settings::{self, Problem};
use meltpath_base::{Length, Speed, table};
use meltpath_data::wires;
use meltpath_deposition::consumable::Wire;

use crate::data::DataText;
use crate::job::{JobError, PartUnit, Problems, text_of};

table! {
    /// A scan of straight beads on a plate, and the settings that they were laid with.
    pub struct ScanFile {
        /// The scan: a `.ply`, the `.stl` of a mesh, or lines of x, y, z (`.xyz`, `.asc`, `.pts`, `.txt`, `.csv`).
        scan: String => required;
        /// The unit of its numbers.
        unit: PartUnit => default("mm", "what scanners write");
        /// Points so near the plate are the plate. The bead begins above it.
        near: Length where within(0.01, 2.0) => default("0.2 mm", "four times the noise of a laser line scanner");
        /// Distance between sections, which are taken in the middle 60 % of each bead.
        every: Length where within(0.2, 100.0) => default("5 mm", "the source's");
        /// The wire: a name in `data/wires`, or a TOML file of your own.
        wire: String => none("how much of the wire lies in the beads is not told, and no process map is written");
        /// The gas, for the process map.
        gas: String => none("no process map is written");
        /// The transfer mode, for the process map.
        mode: String => none("no process map is written");
        /// Capillary length of the molten metal, √(γ/ρg), of which contact angles are computed.
        capillary_length: Length where within(1.0, 20.0) => default("5.07 mm", "steel, 1.8 N/m and 7150 kg/m³ (Rouchon 2022, section 2.1.3)");
        /// The beads in the order in which they lie: across them from low to high x or y, those in one line along it.
        beads as "bead": Vec<ScanBead> => default([], "sizes alone are told");
    }

    /// The settings of a bead.
    pub struct ScanBead {
        /// Wire feed that was set.
        wire_feed: Speed where positive => required;
        /// Travel speed.
        travel_speed: Speed where positive => required;
        /// Wire feed that was measured.
        measured_feed: Speed where positive => none("that which was set stands in for it");
    }
}

/// The settings of a bead, mm/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Wire feed that was set.
    pub wire_feed: f64,
    /// Travel speed.
    pub travel_speed: f64,
    /// Wire feed that was measured.
    pub measured_feed: Option<f64>,
}

impl Setting {
    /// Wire feed as far as it is known.
    pub fn feed(&self) -> f64 {
        self.measured_feed.unwrap_or(self.wire_feed)
    }
}

/// The file, resolved.
#[derive(Debug, Clone)]
pub struct Scan {
    /// Name of the scan as written.
    pub name: String,
    /// Millimetres per unit of the scan.
    pub unit: f64,
    /// Points so near the plate are the plate, mm.
    pub near: f64,
    /// Distance between sections, mm.
    pub every: f64,
    /// Capillary length of the molten metal, mm.
    pub capillary_length: f64,
    /// The wire.
    pub wire: Option<Wire>,
    /// Gas and mode.
    pub process: Option<[String; 2]>,
    /// Settings of the beads.
    pub beads: Vec<Setting>,
}

/// Some beads with a measured feed and some without are no table.
fn check(file: &ScanFile) -> Vec<Problem> {
    let told = file.beads.iter().filter(|b| b.measured_feed.is_some());
    let told = told.count();
    let some = told > 0 && told < file.beads.len();
    let all = file.beads.len();
    settings::broken([(
        some,
        file.beads.problem(format!(
            "measured_feed is told of {told} of {all} beads: tell it of all or of none"
        )),
    )])
}

/// Reads a file.
///
/// # Errors
/// [`JobError`]: everything wrong, each with its place.
pub(super) fn read(path: &Path) -> Result<Scan, JobError> {
    let text = text_of(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    settings::parse(&text, check)
        .and_then(|file| resolve(&file, folder))
        .map_err(|problems| JobError::in_file(path, &text, problems))
}

fn resolve(file: &ScanFile, folder: &Path) -> Result<Scan, Problems> {
    let wire = match &*file.wire {
        None => None,
        Some(name) => {
            let read = DataText::load("wire", name, wires::ALL, folder)
                .and_then(|text| text.read(Wire::parse));
            Some(read.map_err(|e| e.at(&file.wire))?)
        }
    };
    let setting = |b: &ScanBead| Setting {
        wire_feed: b.wire_feed.0,
        travel_speed: b.travel_speed.0,
        measured_feed: b.measured_feed.map(|v| v.0),
    };
    Ok(Scan {
        name: file.scan.value.clone(),
        unit: file.unit.millimetres(),
        near: file.near.0,
        every: file.every.0,
        capillary_length: file.capillary_length.0,
        wire,
        process: match (&*file.gas, &*file.mode) {
            (Some(gas), Some(mode)) => Some([gas.clone(), mode.clone()]),
            _ => None,
        },
        beads: file.beads.iter().map(setting).collect(),
    })
}
