//! Records of an arc that lays a bead: voltage, current and wire feed over time, cut to where it burns steadily, and their means.

pub mod columns;
mod range;
pub mod samples;
pub mod steady;

use crate::error::RecordError;

/// Why a record of an arc cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ArcError {
    /// The file, or a column of it.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A column whose unit nobody tells, or one that is none.
    #[error(
        "`{file}`, column \"{column}\": {told}; known are {known}; write {{ column = \"{column}\", unit = \"{example}\" }}"
    )]
    Unit {
        /// Which file.
        file: String,
        /// Its heading.
        column: String,
        /// What is wrong.
        told: String,
        /// Units that are known.
        known: String,
        /// One that would do.
        example: &'static str,
    },
    /// Times that run backwards or stand still.
    #[error("`{file}`, row {row}: {told}")]
    Times {
        /// Which file.
        file: String,
        /// Row from 1.
        row: usize,
        /// What is wrong.
        told: String,
    },
    /// Nothing in it burns.
    #[error(
        "`{file}`: the current nowhere exceeds {threshold} A (its greatest is {greatest:.3} A): no arc burns in it; look at its column and unit, or lower arc_current"
    )]
    NoArc {
        /// Which file.
        file: String,
        /// Least current of an arc, A.
        threshold: f64,
        /// Greatest current of the record, A.
        greatest: f64,
    },
    /// An arc that does not burn longer than what is left out.
    #[error(
        "`{file}`: the arc burns for {burns:.2} s, and {ignition:.2} s after the ignition and {end:.2} s before the end are left out: too little is left; write shorter ignition and end, or leave the record out"
    )]
    Short {
        /// Which file.
        file: String,
        /// How long the arc burns, s.
        burns: f64,
        /// Left out after the ignition, s.
        ignition: f64,
        /// Left out before the end, s.
        end: f64,
    },
    /// Too few samples in what is left.
    #[error(
        "`{file}`: {count} samples lie where the arc burns steadily, and {least} are needed: record more often, or write shorter ignition and end"
    )]
    Few {
        /// Which file.
        file: String,
        /// How many.
        count: usize,
        /// How many are needed.
        least: usize,
    },
    /// Power that the arc would give back.
    #[error(
        "`{file}`: mean power is {power:.0} W, of {voltage:.2} V and {current:.1} A: one of the columns has the wrong sign; write scale = -1.0 for it"
    )]
    Sign {
        /// Which file.
        file: String,
        /// Mean power, W.
        power: f64,
        /// Mean voltage, V.
        voltage: f64,
        /// Mean current, A.
        current: f64,
    },
    /// Wire that is not fed.
    #[error(
        "`{file}`: the wire feed is {feed:.3} mm/s in the mean where the arc burns: there is no energy per volume of no wire; look at its column and unit, or leave columns.feed out"
    )]
    NotFed {
        /// Which file.
        file: String,
        /// Mean feed, mm/s.
        feed: f64,
    },
}
