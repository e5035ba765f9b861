//! The file that tells what records of a deposit are of.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use meltpath_base::settings::{self, Json, Kind, Node, Place, Problem, Reader, Value};
use meltpath_base::{Current, Length, Speed, Time, quantity, table};
use meltpath_data::{electric, gases, process_maps, wires};
use meltpath_deposition::consumable::{Gas, Wire};
use meltpath_deposition::electric::file::CircuitFile;
use meltpath_deposition::feed_response::FeedBand;
use meltpath_deposition::process_map::MapFile;
use meltpath_perception::arc::columns::ArcColumns;

use crate::data::{DataText, known};
use crate::job::{JobError, Problems, text_of};

quantity!(
    /// Energy per volume, J/mm³ inside.
    EnergyDensity, "energy per volume", "J/mm3",
    [("J/mm3", 1.0), ("J/mm³", 1.0)]
);

table! {
    /// Records of beads, one a bead or a layer: time, voltage, current and wire feed, and what the beads were laid with.
    pub struct RecordsFile {
        /// The wire: a name in `data/wires`, or a TOML file of your own.
        wire: String => required;
        /// The gas, for the table of energies: a name in `data/gases`, or a TOML file of your own.
        gas: String => none("no energy.toml is written");
        /// The transfer mode, for the table of energies.
        mode: String => none("no energy.toml is written");
        /// The process map that takes what is found: a TOML file of your own, or one that ships.
        map: String => none("no map.toml is written: source.toml holds what to put into yours");
        /// The constants of source, stick-out and arc: a TOML file of your own, or one that ships.
        circuit: String => none("those of this wire, mode and gas, where they ship; else the circuit tells nothing");
        /// Setting of the source's penetration stabiliser: the greatest change to the wire feed that is set; 0 for a source without.
        stabiliser: FeedBand where not_negative => none("how the feed follows the distance is told, but no file is written of it");
        /// Contact tube to work distance in layer 1, for records that tell their layer.
        first_distance: Length where within(1.0, 100.0) => none("each record tells its distance");
        /// How far the torch was lifted from layer to layer.
        layer_height: Length where positive => none("each record tells its distance");
        /// How far the wall grew from layer to layer, as it was measured: its height over the number of its layers.
        growth: Length where positive => none("each record tells its distance");
        /// How well distances are known, one standard deviation.
        distance_uncertainty: Length where within(0.01, 10.0) => default("0.5 mm", "a ruler or a gauge under the nozzle, or the mean height of a scanned layer");
        /// Contact tube to work distance below which the torch is in danger: it is told in which layer.
        least_distance: Length where positive => default("8 mm", "that of jobs (checks.ctwd_min)");
        /// Left out after the ignition: a way or a time.
        ignition: Stretch where positive => default("20 mm", "what the source adds to its beads at both ends, for the pool to settle (Rouchon 2022, section 2.3.3)");
        /// Left out before the arc ends: a way or a time.
        end: Stretch where positive => default("20 mm", "the same at the other end");
        /// An arc burns where the current is at least this.
        arc_current: Current where positive => default("10 A", "base currents of pulsed and short-circuit transfer are above");
        /// Energy that melts the wire, the least that an arc can spend.
        melting_energy: EnergyDensity where positive => computed("12.6 J/mm³ for a wire of 7000 to 8500 kg/m³ (steel, Rouchon 2022, section 2.2); else not checked");
        /// Time between samples.
        sample_time: Time where positive => none("the column of times tells it");
        /// Which columns the records have.
        columns: ArcColumns => required;
        /// The records.
        records as "record": Vec<RecordTable> => required;
    }

    /// A record of a bead.
    pub struct RecordTable {
        /// The record: `.csv`, `.parquet` or `.mat` (level 5), beside this file.
        file: String => required;
        /// Wire feed that was set.
        wire_feed: Speed where positive => required;
        /// Travel speed.
        travel_speed: Speed where positive => required;
        /// Contact tube to work distance.
        distance: Length where within(1.0, 100.0) => none("`layer` tells it, with first_distance, layer_height and growth");
        /// Number of the layer, from 1.
        layer: u32 where within(1.0, 100_000.0) => none("not told");
        /// Where the bead begins in the record, of several in one file.
        from: Time => none("at its begin");
        /// Where it ends.
        to: Time => none("at its end");
    }
}

/// A way or a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stretch {
    /// A way along the bead.
    Way(Length),
    /// A time.
    Time(Time),
}

impl Value for Stretch {
    const KIND: Kind = Kind::Either(&Length::KIND, &Time::KIND);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        match node.get_ref().as_str() {
            Some(text) if Time::parse(text).is_ok() => {
                Time::read(node, place, reader).map(Stretch::Time)
            }
            _ => Length::read(node, place, reader).map(Stretch::Way),
        }
    }

    fn json(&self) -> Json {
        match self {
            Stretch::Way(way) => way.json(),
            Stretch::Time(time) => time.json(),
        }
    }
}

impl Stretch {
    /// As a time, s, at a travel speed in mm/s.
    pub fn seconds(self, travel_speed: f64) -> f64 {
        match self {
            Stretch::Way(way) => way.0 / travel_speed,
            Stretch::Time(time) => time.0,
        }
    }
}

/// What a bead was laid with: mm, mm/s, s.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name of the record as written.
    pub file: String,
    /// Wire feed that was set.
    pub wire_feed: f64,
    /// Travel speed.
    pub travel_speed: f64,
    /// Contact tube to work distance; `None` where nothing tells it.
    pub distance: Option<f64>,
    /// Number of the layer.
    pub layer: Option<u32>,
    /// What of the record is used.
    pub within: [f64; 2],
}

/// The file, resolved.
#[derive(Debug)]
pub struct Records {
    /// As it reads.
    pub file: RecordsFile,
    /// The wire.
    pub wire: Wire,
    /// The gas's identifier.
    pub gas: Option<String>,
    /// The process map that takes what is found, with its text.
    pub map: Option<(MapFile, String)>,
    /// The constants of source, stick-out and arc.
    pub circuit: Option<CircuitFile>,
    /// What each bead was laid with.
    pub settings: Vec<Setting>,
    /// Files of the user's own that were read.
    pub own: Vec<PathBuf>,
}

/// What a record uses of its file, s.
fn within(record: &RecordTable) -> [f64; 2] {
    [
        record.from.map_or(f64::NEG_INFINITY, |t| t.0),
        record.to.map_or(f64::INFINITY, |t| t.0),
    ]
}

/// Records of one file, by its name, that use the same time of it.
fn named_twice(file: &RecordsFile) -> Vec<Problem> {
    let mut before: BTreeMap<&str, Vec<(usize, [f64; 2])>> = BTreeMap::new();
    let mut problems = Vec::new();
    for (n, record) in (1..).zip(file.records.iter()) {
        let [from, to] = within(record);
        let others = before.entry(record.file.as_str()).or_default();
        let shared = |other: &&(usize, [f64; 2])| other.1[0] < to && from < other.1[1];
        if let Some((other, _)) = others.iter().find(shared) {
            let message = format!(
                "records {other} and {n} take the same time of {}: one of them is of another bead",
                *record.file
            );
            let help = "name the file of that bead; of several beads in one file write from and to of each";
            problems.push(record.file.problem(message).help(help));
        }
        others.push((n, [from, to]));
    }
    problems
}

/// Values that do not go together.
fn check(file: &RecordsFile) -> Vec<Problem> {
    let told = [
        file.first_distance.is_some(),
        file.layer_height.is_some(),
        file.growth.is_some(),
    ];
    let by_layers = told == [true; 3];
    let mut problems = settings::broken([
        (
            file.columns.time.is_none() && file.sample_time.is_none(),
            file.columns.problem(
                "nothing tells when samples were taken: name columns.time, or write sample_time",
            ),
        ),
        (
            file.columns.time.is_some() && file.sample_time.is_some(),
            file.sample_time
                .problem("columns.time and sample_time both tell when samples were taken: write one"),
        ),
        (
            file.records.is_empty(),
            file.records.problem("no record is told: write a [[record]] for each"),
        ),
        (
            told != [false; 3] && !by_layers,
            file.first_distance.problem(
                "the distance of a layer needs all of first_distance, layer_height and growth: a wall that grows more than the torch is lifted comes nearer to it",
            ),
        ),
    ]);
    problems.extend(named_twice(file));
    for record in file.records.iter() {
        let (from, to) = (record.from.map(|t| t.0), record.to.map(|t| t.0));
        if let (Some(from), Some(to)) = (from, to)
            && from >= to
        {
            problems.push(record.to.problem("a bead ends after its begin"));
        }
        if record.distance.is_none() && record.layer.is_some_and(|n| n > 1) && !by_layers {
            let message = "at which distance layer was laid is not told";
            let help = "write distance; or first_distance, layer_height and growth for all records";
            problems.push(record.layer.problem(message).help(help));
        }
    }
    problems
}

/// Reads the file of records; the records that it names are read when they are looked through.
///
/// # Errors
/// [`JobError`]: everything wrong, each with its place.
pub fn read(path: &Path) -> Result<Records, JobError> {
    let text = text_of(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    settings::parse(&text, check)
        .and_then(|file| resolve(file, folder))
        .map_err(|problems| JobError::in_file(path, &text, problems))
}

fn resolve(file: RecordsFile, folder: &Path) -> Result<Records, Problems> {
    let mut own = Vec::new();
    let mut noted = |text: &DataText| own.extend(text.file.clone());
    let wire = DataText::load("wire", &file.wire, wires::ALL, folder)
        .and_then(|text| {
            noted(&text);
            text.read(Wire::parse)
        })
        .map_err(|e| e.at(&file.wire))?;
    let gas = match &*file.gas {
        None => None,
        Some(name) => {
            let read = DataText::load("gas", name, gases::ALL, folder).and_then(|text| {
                noted(&text);
                text.read(Gas::parse)
            });
            Some(read.map_err(|e| e.at(&file.gas))?.id.value)
        }
    };
    let map = match &*file.map {
        None => None,
        Some(name) => {
            let text = DataText::load("process map", name, process_maps::ALL, folder)
                .map_err(|e| e.at(&file.map))?;
            noted(&text);
            let read = text.read(|text| settings::parse::<MapFile>(text, |_| Vec::new()));
            Some((read.map_err(|e| e.at(&file.map))?, text.text))
        }
    };
    if let Some((map, _)) = &map {
        fits(&file, (&wire, gas.as_deref()), map)?;
    }
    let circuit = circuit(&file, (&wire, gas.as_deref()), folder, &mut noted)?;
    let settings = file.records.iter().map(|r| setting(&file, r)).collect();
    Ok(Records {
        file,
        wire,
        gas,
        map,
        circuit,
        settings,
        own,
    })
}

/// Refuses a map of another wire, gas or mode.
fn fits(
    file: &RecordsFile,
    (wire, gas): (&Wire, Option<&str>),
    map: &MapFile,
) -> Result<(), Problems> {
    let other = |what: &str, own: &str, its: &str| {
        let message = format!("the map is of the {what} \"{its}\", the records of \"{own}\"");
        (own != its).then(|| file.map.problem(message))
    };
    let gas = gas.and_then(|gas| other("gas", gas, &map.gas));
    let mode = file.mode.as_ref();
    let mode = mode.and_then(|mode| other("mode", mode, &map.mode));
    let wrong = [other("wire", &wire.id, &map.wire), gas, mode];
    let wrong: Vec<Problem> = wrong.into_iter().flatten().collect();
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(wrong.into())
    }
}

/// The constants that are named, or those of the wire, mode and gas.
fn circuit(
    file: &RecordsFile,
    (wire, gas): (&Wire, Option<&str>),
    folder: &Path,
    noted: &mut impl FnMut(&DataText),
) -> Result<Option<CircuitFile>, Problems> {
    let text = if let Some(name) = &*file.circuit {
        let read = DataText::load("circuit", name, electric::ALL, folder);
        Some(read.map_err(|e| e.at(&file.circuit))?)
    } else {
        let id = match (gas, &*file.mode) {
            (Some(gas), Some(mode)) => format!("{}-{mode}-{gas}", *wire.id),
            _ => String::new(),
        };
        let mut all = known(electric::ALL, folder).into_iter();
        all.find(|text| text.name == id)
    };
    let Some(text) = text else {
        return Ok(None);
    };
    noted(&text);
    let read = text.read(CircuitFile::parse);
    Ok(Some(read.map_err(|e| e.at(&file.circuit))?))
}

fn setting(file: &RecordsFile, record: &RecordTable) -> Setting {
    let of_layer = |layer: u32| {
        let rest = (*file.first_distance)?.0;
        let lifted = (*file.layer_height)?.0 - (*file.growth)?.0;
        Some(rest + f64::from(layer - 1) * lifted)
    };
    Setting {
        file: record.file.value.clone(),
        wire_feed: record.wire_feed.0,
        travel_speed: record.travel_speed.0,
        distance: record
            .distance
            .map(|d| d.0)
            .or_else(|| record.layer.and_then(of_layer)),
        layer: *record.layer,
        within: [
            record.from.map_or(f64::NEG_INFINITY, |t| t.0),
            record.to.map_or(f64::INFINITY, |t| t.0),
        ],
    }
}
