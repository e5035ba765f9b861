//! What the cell tells that programs read.

use std::collections::BTreeMap;

use super::job_lines::variable;
use crate::expression::{Elements, Names};

/// A position register as the cell tells it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ToldPosition {
    /// X, Y, Z, mm, and W, P, R, degrees, as far as they are told.
    pub elements: [Option<f64>; 6],
    /// The joints, degrees as the controller shows them, where it holds these.
    pub joints: Option<[f64; 6]>,
    /// User and tool frame that it is told in, where that is one.
    pub frames: (Option<u32>, Option<u32>),
}

/// What an output sets the welding source to, as the cell tells it.
#[derive(Debug, Clone, PartialEq)]
pub struct ToldOutput {
    /// Its name, in capitals.
    pub name: String,
    /// Its number, where it has one.
    pub number: Option<u32>,
    /// The value that this is about; nothing where it is about all that no other entry names.
    pub value: Option<f64>,
    /// The weld schedule that it calls; nothing where it shapes no metal.
    pub schedule: Option<u32>,
}

/// The places that the cell tells of position registers.
pub(super) fn places(positions: &BTreeMap<u32, ToldPosition>) -> BTreeMap<u32, Elements> {
    let told = positions.iter();
    told.filter(|(_, told)| told.joints.is_none())
        .map(|(number, told)| (*number, told.elements))
        .collect()
}

/// The variables of a Yaskawa that the cell tells.
pub(super) fn variables(told: &BTreeMap<(String, u32), f64>) -> Names {
    let named = told.iter().filter_map(|((name, number), value)| {
        let name = variable(&format!("{name}{number}"))?;
        Some((name, *value))
    });
    Names {
        values: named.collect(),
        ..Names::default()
    }
}
