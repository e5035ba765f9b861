//! What a data list says: positions, frames, blending, weld data, and what the robot holds.

use std::collections::BTreeMap;

use super::arc::{Advanced, Crater, WeldData, advanced, crater, other_mode, weld_data};
use super::data::{coordinates, fields, number_of, place, text_of};
use super::entries::{Listed, set};
use super::words::WeaveAmplitude;
use crate::held::Holds;
use crate::modal::{Orientation, Round};
use crate::parsed::trimmed;
use crate::program::Coordinates;
use crate::scan::{strip_word, uncommented};

/// What the cell says of ArcTech.
#[derive(Clone, Copy)]
pub(super) struct Told<'a> {
    /// How many channels mean something.
    pub(super) values: usize,
    /// What the amplitude of a weave is.
    pub(super) amplitude: Option<WeaveAmplitude>,
    /// In which mode the source works.
    pub(super) job_mode: Option<&'a str>,
}

/// What the data list says.
#[derive(Default)]
pub(super) struct List {
    pub(super) positions: BTreeMap<String, Coordinates>,
    /// Base and tool.
    pub(super) frames: BTreeMap<String, (Option<u32>, Option<u32>)>,
    /// What the robot holds with these.
    pub(super) holds: BTreeMap<String, Holds>,
    /// Distance of blending, mm.
    pub(super) distances: BTreeMap<String, f64>,
    /// Shares of the usual acceleration, %.
    pub(super) accelerations: BTreeMap<String, f64>,
    /// How moves by these turn the tool, where they say it.
    pub(super) orientations: BTreeMap<String, Orientation>,
    pub(super) rounds: BTreeMap<String, Round>,
    pub(super) welds: BTreeMap<String, WeldData>,
    /// How the arc ends by these.
    pub(super) craters: BTreeMap<String, Crater>,
    pub(super) advanced: BTreeMap<String, Advanced>,
    /// Modes of the source that these set and the cell does not have.
    pub(super) modes: BTreeMap<String, String>,
    /// Entries of the controller's tables of frames that it sets.
    pub(super) entries: Vec<Listed>,
    pub(super) rest: Vec<(u32, String)>,
}

/// The data of moves that every controller holds beside the programs' own: they are the usual ones.
const USUAL: &str = "LDEFAULT";

impl List {
    /// Whether it tells these data of moves, or they are the usual ones.
    pub(super) fn tells(&self, name: &str) -> bool {
        self.distances.contains_key(name) || name == USUAL
    }

    /// Lines of the rest that nobody here read.
    pub(super) fn unread(&self) -> impl Iterator<Item = &(u32, String)> {
        let read = |line: u32| {
            self.entries
                .iter()
                .any(|e| e.line == line && e.pose.is_some())
        };
        self.rest.iter().filter(move |(line, _)| !read(*line))
    }
}

/// How a word of KRL turns the tool along moves.
pub(super) fn orientation(word: &str) -> Orientation {
    match capital(word).as_str() {
        "#VAR" => Orientation::Taught,
        "#CONSTANT" => Orientation::Kept,
        // by the joints, or a value that is not known
        _ => Orientation::Free,
    }
}

/// See [`orientation`], along circles.
pub(super) fn round(word: &str) -> Round {
    match capital(word).as_str() {
        "#BASE" => Round::Frame,
        _ => Round::Path,
    }
}

/// The `NAME` of a variable that positions, frames or data have, without the letters in front of it.
pub(super) fn capital(name: &str) -> String {
    name.trim().to_ascii_uppercase()
}

/// Reads a data list.
pub(super) fn list(text: &str, told: Told<'_>) -> List {
    let mut list = List::default();
    for (line, n) in trimmed(text).zip(1..) {
        let plain = line.is_empty() || line.starts_with([';', '&']);
        if plain || strip_word(line, "DEFDAT").is_some() || strip_word(line, "ENDDAT").is_some() {
            continue;
        }
        if let Some((entry, value)) = set(uncommented(line)) {
            list.entries.push(Listed {
                entry,
                pose: place(entry.0, value),
                line: n,
                text: line.to_owned(),
            });
        }
        if declared(&mut list, line, told).is_none() {
            list.rest.push((n, line.to_owned()));
        }
    }
    list
}

/// Takes in a declaration; nothing where it is of another kind, or does not read.
fn declared(list: &mut List, line: &str, told: Told<'_>) -> Option<()> {
    let rest = strip_word(line, "DECL").unwrap_or(line).trim_start();
    let rest = strip_word(rest, "GLOBAL").unwrap_or(rest).trim_start();
    let (kind, rest) = rest.split_once(char::is_whitespace)?;
    let (name, value) = rest.split_once('=')?;
    let name = capital(name);
    match capital(kind).as_str() {
        "POS" | "E6POS" | "FRAME" | "AXIS" | "E6AXIS" => {
            list.positions.insert(name, coordinates(value)?);
        }
        "FDAT" => {
            let all = fields(value)?;
            let index = |field: &str| number_of(&all, field).map(|n| n as u32);
            let holds = text_of(&all, "IPO_FRAME").and_then(|mode| holds(&mode));
            list.holds.extend(holds.map(|holds| (name.clone(), holds)));
            list.frames
                .insert(name, (index("BASE_NO"), index("TOOL_NO")));
        }
        "LDAT" | "PDAT" => {
            let all = fields(value)?;
            let said = text_of(&all, "ORI_TYP").map(|word| (name.clone(), orientation(&word)));
            list.orientations.extend(said);
            let said = text_of(&all, "CIRC_TYP").map(|word| (name.clone(), round(&word)));
            list.rounds.extend(said);
            if let Some(share) = number_of(&all, "ACC") {
                list.accelerations.insert(name.clone(), share);
            }
            list.distances.insert(name, number_of(&all, "APO_DIST")?);
        }
        "STARCDAT_T" => {
            let found = crater(value, told.values);
            list.craters
                .extend(found.map(|crater| (name.clone(), crater)));
            list.advanced.insert(name.clone(), advanced(value));
            if let Some(mode) = told.job_mode.and_then(|own| other_mode(value, own)) {
                list.modes.insert(name.clone(), mode);
            }
            match weld_data(value, told.values, told.amplitude) {
                Some(weld) => drop(list.welds.insert(name, weld)),
                // the seam's data lay no metal; a strike or a crater alone says no weld
                None => drop(fields(value)?),
            }
        }
        _ => return None,
    }
    Some(())
}

/// What the robot holds where the interpolation is so: `#TCP` is that of a torch that stands.
pub(super) fn holds(mode: &str) -> Option<Holds> {
    match capital(mode).as_str() {
        "#TCP" => Some(Holds::Part),
        "#BASE" => Some(Holds::Torch),
        _ => None,
    }
}
