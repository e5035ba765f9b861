//! Currents corrected on the judge's solver over the whole section: how a job sets it.

pub mod stages;

use meltpath_melt_strategy::learning::Freedom;

use crate::job::ebm::{ControllerKind, CorrectTable};

/// How currents are corrected.
#[derive(Debug, Clone, PartialEq)]
pub struct Correct {
    /// Rounds on cells twice as large as the judge's, then on the judge's own.
    pub rounds: [u32; 2],
    /// How many of the other aims are tried.
    pub aims: u32,
    /// Drift of the power, a share, over which paths are worth the least that they do.
    pub robust: Option<f64>,
    /// Share of what places wish for that a round does.
    pub gain: f64,
    /// Least and greatest current, as shares of the path's own.
    pub currents: [f64; 2],
    /// Over what length currents are evened out, mm; pieces of one current are as long.
    pub reach: f64,
    /// How often the current can be changed.
    pub freedom: Freedom,
}

impl Correct {
    /// From the job's table.
    pub fn resolve(table: &CorrectTable) -> Self {
        Correct {
            rounds: [*table.rounds, *table.finest],
            aims: *table.aims,
            robust: table.robust.as_ref().map(|drift| drift.0),
            gain: table.gain.0,
            currents: table.currents.map(|s| s.0),
            reach: table.reach.0,
            freedom: match *table.controller {
                ControllerKind::Continuous => Freedom::Continuous,
                ControllerKind::PerLine => Freedom::PerLine,
            },
        }
    }
}
