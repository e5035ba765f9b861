//! The file that tells what a scan shows.

use std::path::Path;

use meltpath_base::settings::{self, File, Problem};
use meltpath_base::{Angle, Length, Speed, table};
use meltpath_data::{gases, wires};
use meltpath_deposition::consumable::{Gas, PoolRow, Wire};
use meltpath_geometry::math::DVec2;

use super::corner::torch;
use crate::data::DataText;
use crate::job::{JobError, PartUnit, Problems, text_of};
use crate::pools::nearest;

/// Least and greatest `near`, mm.
pub(super) const NEAR: std::ops::RangeInclusive<f64> = 0.01..=2.0;

table! {
    /// A scan of beads on a plate, straight or with one corner, and the settings that they were laid with.
    pub struct ScanFile {
        /// The scan: a `.ply`, the `.stl` of a mesh, or lines of x, y, z (`.xyz`, `.asc`, `.pts`, `.txt`, `.csv`).
        scan: String => required;
        /// The unit of its numbers.
        unit: PartUnit => default("mm", "what scanners write");
        /// Points so near the plate are the plate. The bead begins above it.
        near: Length where within(*NEAR.start(), *NEAR.end()) => default("0.2 mm", "four times the noise of a laser line scanner");
        /// Distance between sections, which are taken in the middle 60 % of each bead.
        every: Length where within(0.2, 100.0) => default("5 mm", "the source's");
        /// The wire: a name in `data/wires`, or a TOML file of your own.
        wire: String => none("how much of the wire lies in the beads is not told, and no process map is written");
        /// The gas, for the process map: a name in `data/gases`, or a TOML file of your own.
        gas: String => none("no process map is written");
        /// The transfer mode, for the process map.
        mode: String => none("no process map is written");
        /// Capillary length of the molten metal, √(γ/ρg), of which contact angles are computed.
        capillary_length: Length where within(1.0, 20.0) => default("5.07 mm", "steel, 1.8 N/m and 7150 kg/m³ (Rouchon 2022, section 2.1.3)");
        /// The beads in the order in which they lie: straight ones across them from low to high x or y, those in one line along it; those
        /// with a corner by the places of their corners, from low to high x or y, along whichever they lie farther apart.
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
        /// How far the path turns at the bead's one corner, seen from above in the direction of travel: positive to the left, negative to the right.
        corner: Angle where within(-2.9671, 2.9671) => none("the bead is straight");
        /// Record of the torch along a bead with a corner: columns of time (s), x and y (mm).
        torch: File => none("the torch goes through the corner at its travel speed");
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

/// A corner that the file tells of.
#[derive(Debug, Clone)]
pub struct CornerSetting {
    /// The settings of its bead.
    pub setting: Setting,
    /// How far the path turns, rad, left positive.
    pub turn: f64,
    /// The torch's record in the frame of the path, s and mm.
    pub torch: Option<Vec<(f64, DVec2)>>,
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
    /// The gas's identifier, and the mode.
    pub process: Option<[String; 2]>,
    /// Settings of the straight beads.
    pub beads: Vec<Setting>,
    /// Settings of the beads with a corner.
    pub corners: Vec<CornerSetting>,
    /// The weld pools by which the deposit's model is compared with corners.
    pub pools: Vec<PoolRow>,
    /// The file that they are of.
    pub pools_of: String,
}

/// Least turn of a corner, rad: 20°.
const LEAST_TURN: f64 = 0.349;

/// Some beads with a measured feed and some without are no table.
fn check(file: &ScanFile) -> Vec<Problem> {
    let straight = || file.beads.iter().filter(|b| b.corner.is_none());
    let all = straight().count();
    let told = straight().filter(|b| b.measured_feed.is_some()).count();
    let blunt = |b: &ScanBead| b.corner.is_some_and(|turn| turn.0.abs() < LEAST_TURN);
    settings::broken([
        (
            told > 0 && told < all,
            file.beads.problem(format!(
                "measured_feed is told of {told} of {all} beads: tell it of all or of none"
            )),
        ),
        (
            file.beads.iter().any(blunt),
            file.beads
                .problem("a corner of less than 20° shows no pursuit length: leave corner out of a straight bead, or scan a sharper one"),
        ),
        (
            file.beads
                .iter()
                .any(|b| b.torch.is_some() && b.corner.is_none()),
            file.beads.problem(
                "torch is of beads with a corner: write corner, how far the path turns there",
            ),
        ),
    ])
}

/// Reads the file of a scan, with the records of the torch that it names.
///
/// # Errors
/// [`JobError`]: everything wrong, each with its place.
pub fn read(path: &Path) -> Result<Scan, JobError> {
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
    let gas = match &*file.gas {
        None => None,
        Some(name) => {
            let read = DataText::load("gas", name, gases::ALL, folder)
                .and_then(|text| text.read(Gas::parse));
            Some(read.map_err(|e| e.at(&file.gas))?)
        }
    };
    let ids = [
        wire.as_ref().map_or("", |w: &Wire| w.id.as_str()),
        file.mode.as_deref().unwrap_or_default(),
        gas.as_ref().map_or("", |g: &Gas| g.id.as_str()),
    ];
    let pools = nearest(None, folder, ids, |f| !f.pool.is_empty());
    let pools = pools.map_err(|e| e.at(&file.scan))?;
    let (pools, pools_of) =
        pools.map_or_else(Default::default, |p| (p.file.pool.value, p.file.id.value));
    let setting = |b: &ScanBead| Setting {
        wire_feed: b.wire_feed.0,
        travel_speed: b.travel_speed.0,
        measured_feed: b.measured_feed.map(|v| v.0),
    };
    let mut corners = Vec::new();
    for b in file.beads.iter() {
        let Some(turn) = *b.corner else { continue };
        let torch = match &*b.torch {
            None => None,
            Some(record) => {
                let read = torch::read(&folder.join(&record.0), turn.0);
                Some(read.map_err(|why| vec![b.torch.problem(format!("{}: {why}", record.0))])?)
            }
        };
        corners.push(CornerSetting {
            setting: setting(b),
            turn: turn.0,
            torch,
        });
    }
    Ok(Scan {
        name: file.scan.value.clone(),
        unit: file.unit.millimetres(),
        near: file.near.0,
        every: file.every.0,
        capillary_length: file.capillary_length.0,
        wire,
        process: gas
            .zip(file.mode.value.clone())
            .map(|(gas, mode)| [gas.id.value, mode]),
        beads: file
            .beads
            .iter()
            .filter(|b| b.corner.is_none())
            .map(setting)
            .collect(),
        corners,
        pools,
        pools_of,
    })
}
