//! The bead and the weld pool as the deposit needs them: nominal size on a plate, and the pool that lays it.
//! Source: Rouchon 2022, table 3.3 and eq. 3.13; the change with local feed is its perspective P2, law of our own.

use serde::{Deserialize, Serialize};

use crate::pursuit::law::PursuitLaw;
use crate::section::Section;

/// A single straight bead on a plate at nominal settings, and how it changes when the torch slows down.
///
/// Lengths in mm, areas in mm². The section is a parabola of this width and area.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BeadModel {
    /// Width on a plate, mm.
    pub width: f64,
    /// Section, mm²: η·λ·S_f at the wire feed really delivered.
    pub area: f64,
    /// Section of the wire, mm².
    pub wire_section: f64,
    /// Share of the wire that ends in the bead.
    pub efficiency: f64,
    /// Exponent p of w = width·(A/area)^p, A being the local feed per length where the torch slows down; 0 keeps the width.
    pub width_exponent: f64,
    /// Exponent of the width against the wire feed at constant travel speed; 0 keeps the width.
    pub feed_exponent: f64,
}

impl BeadModel {
    /// Height on a plate, mm: that of the parabola.
    pub fn height(&self) -> f64 {
        Section::Parabola.height(self.width, self.area)
    }
}

/// Size of the weld pool around its centre, mm; the centre lies `offset` behind the torch on the pursuit direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoolModel {
    /// Front semi-axis a_f.
    pub front: f64,
    /// Rear semi-axis a_b.
    pub rear: f64,
    /// Lateral semi-axis b.
    pub half_width: f64,
    /// Distance e from the torch back to the centre.
    pub offset: f64,
    /// Pursuit length l.
    pub pursuit: PursuitLength,
}

/// Distance from the torch to the point it draws behind it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PursuitLength {
    /// One length, mm.
    Fixed(f64),
    /// By the angle of the corner that the bead goes round.
    ByCorner(PursuitLaw),
}

/// Exponents of pool length and offset against feed per length, from the two rows of Rouchon 2022, table 3.3
/// (V_r 0.75 to 0.50 m/min at constant wire feed): ln(11.73/10.80)/ln 1.5 and ln(1.85/1.66)/ln 1.5.
pub const REAR_EXPONENT: f64 = 0.204;
/// The same of the pool's width, which is the bead's: ln(4.14/3.60)/ln 1.5, where no process map tells it.
pub const WIDTH_EXPONENT: f64 = 0.345;
/// See [`REAR_EXPONENT`].
pub const OFFSET_EXPONENT: f64 = 0.267;

impl PoolModel {
    /// Length of the pool, mm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.front + self.rear
    }

    /// The measured pool of `reference` scaled to `bead`: half the bead wide, round in front (a_f = b, the source's
    /// hypothesis), as long in proportion to its width as the measured one.
    #[must_use]
    pub fn for_bead(reference: &PoolModel, bead: &BeadModel) -> Self {
        let half_width = 0.5 * bead.width;
        let scale = half_width / reference.half_width;
        PoolModel {
            front: half_width,
            rear: reference.rear * scale,
            half_width,
            offset: reference.offset * scale,
            pursuit: reference.pursuit,
        }
    }

    /// The pool when the feed per length is `ratio` times the nominal and the width `wide` times.
    #[must_use]
    pub(crate) fn at_feed(&self, ratio: f64, wide: f64) -> Self {
        if wide == 1.0 {
            return *self;
        }
        PoolModel {
            front: self.front * wide,
            half_width: self.half_width * wide,
            rear: self.rear * ratio.powf(REAR_EXPONENT),
            offset: self.offset * ratio.powf(OFFSET_EXPONENT),
            pursuit: self.pursuit,
        }
    }
}
