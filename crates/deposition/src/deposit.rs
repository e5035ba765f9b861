//! The growing part: metal laid along the simulated motion on a height map, bead after bead.
//!
//! Two models share the driver. *Plain* sums half-ellipsoid stamps (Rouchon 2022, eq. 3.10-3.13): one bead on a flat
//! plate. *Build* lets each bead level on what it lands on ([`levelling`]): whole builds. Both put down exactly
//! the volume that was fed.

mod driver;
pub(crate) mod feeding;
pub mod footprint;
pub mod levelling;
mod passing;
pub(crate) mod plain;
mod record;

pub use driver::{Deposit, Deposition};
pub use levelling::Levelling;
pub use record::{
    Accumulation, ArcStart, LayerRecord, PathPoint, Spread, TubeDistance, mean_along,
};

use meltpath_geometry::math::DVec2;
use serde::{Deserialize, Serialize};

use crate::feed_response::FeedResponse;
use crate::pursuit::PursuitMode;

/// How metal meets what it lands on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Stamps add up without seeing the surface: right for one bead on a plate, a pile of parabolas otherwise.
    Plain,
    /// The molten zone levels on what lies under it.
    Build(Levelling),
}

/// Settings of a deposition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// How metal meets what it lands on.
    pub mode: Mode,
    /// How the bead follows the torch.
    pub pursuit: PursuitMode,
    /// Longest travel of one stamp, mm.
    pub stamp: f64,
    /// Distance from contact tube to part that the plan meant, mm: the tool point then touches the surface.
    pub nominal_ctwd: f64,
    /// What the source feeds at other distances than the one of the process map; `None`: always what the motion says.
    /// Then the bead and its `area` are those at the reference distance.
    pub feed_response: Option<FeedResponse>,
    /// Distance between recorded path points, mm.
    pub record_step: f64,
    /// Excess of the bead's thickness over the layer's mean, as a share of it, from which a place is recorded as an
    /// accumulation: over a bead's width of path.
    pub accumulation: f64,
}

/// Travel by which a step of the molten zone may come early, mm: rounding.
pub(crate) const ROUNDING: f64 = 1e-9;
/// Pieces of one motion sample at most.
const MOST_PIECES: f64 = 1e6;

impl Settings {
    /// How far the torch goes next on its way of `length` mm, `done` mm along it and `since` mm after the last step of the molten
    /// zone: at most one stamp, and never past a step. So steps lie at the same places of the path however the motion is sampled.
    fn piece(&self, length: f64, done: f64, since: f64) -> f64 {
        let (left, grain) = (length - done, length / MOST_PIECES);
        let to_step = match self.mode {
            Mode::Plain => f64::INFINITY,
            Mode::Build(model) => (model.step - since).max(grain),
        };
        let stamp = self.stamp.max(grain);
        let end = left.min(to_step);
        let piece = if end <= stamp + ROUNDING { end } else { stamp };
        if left - piece <= ROUNDING {
            left
        } else {
            piece
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            mode: Mode::Build(Levelling::default()),
            pursuit: PursuitMode::Rope,
            stamp: 0.15,
            nominal_ctwd: 15.0,
            feed_response: None,
            record_step: 0.5,
            accumulation: 0.3,
        }
    }
}

/// A straight way of the torch, walked in pieces.
#[derive(Debug)]
pub(crate) struct Walk {
    length: f64,
    done: Option<f64>,
}

/// One piece of a way.
#[derive(Debug)]
pub(crate) struct Piece {
    /// Its length, mm.
    pub(crate) length: f64,
    /// Its share of the way: a torch that stands feeds all at once.
    pub(crate) share: f64,
    /// Where it ends: the share of the way from its beginning.
    pub(crate) end: f64,
}

impl Walk {
    /// Of `length` mm.
    pub(crate) fn along(length: f64) -> Self {
        let done = Some(0.0);
        Walk { length, done }
    }

    /// The next piece, `since` mm after the last step of the molten zone; none at the end of the way.
    pub(crate) fn next(&mut self, settings: &Settings, since: f64) -> Option<Piece> {
        let (length, done) = (self.length, self.done?);
        let piece = settings.piece(length, done, since);
        let on = piece < length - done;
        let done = if on { done + piece } else { length };
        self.done = (done < length).then_some(done);
        let of = |part: f64| if length > 0.0 { part / length } else { 1.0 };
        Some(Piece {
            length: piece,
            share: of(piece),
            end: of(done),
        })
    }
}

/// Why a deposition cannot start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DepositError {
    /// A size that must be positive and finite is not.
    #[error("deposition: {what} is {value}, it must be a positive finite number")]
    Size {
        /// Which size.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Local frame of a piece of bead: the pool's centre and its forward direction in plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Station {
    /// Centre of the pool, mm.
    pub(crate) centre: DVec2,
    /// Unit forward direction.
    pub(crate) heading: DVec2,
    /// Distance travelled by the centre since the arc start, mm.
    pub(crate) travelled: f64,
    /// How high the path runs here over one plane, mm: the molten zone levels along the path, not across its rises. 0 on a
    /// height map.
    pub(crate) rise: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of the molten zone that rounding puts just behind a stamp is taken with it: no piece of a billionth of a stamp is left over.
    #[test]
    fn pieces_end_at_steps_whatever_the_rounding() {
        let settings = Settings::default();
        let Mode::Build(model) = settings.mode else {
            panic!("builds level by default")
        };
        let stamp = settings.stamp;
        // 10 mm to go, and the next step half a billionth of a millimetre behind a stamp's travel
        let to_step = stamp + 0.5 * ROUNDING;
        let piece = settings.piece(10.0, 0.0, model.step - to_step);
        assert!((piece - to_step).abs() < 1e-13, "{piece:e}");
        // well behind it a stamp comes first, before it the step does
        assert_eq!(settings.piece(10.0, 0.0, model.step - stamp - 0.01), stamp);
        let before = settings.piece(10.0, 0.0, model.step - 0.1);
        assert!((before - 0.1).abs() < 1e-12, "{before}");
        // what is left of the way is one piece, or what rounding leaves of it
        assert_eq!(settings.piece(10.0, 10.0 - 0.1, 0.0), 10.0 - (10.0 - 0.1));
        let plain = Settings {
            mode: Mode::Plain,
            ..settings
        };
        assert_eq!(plain.piece(10.0, 0.0, 0.0), stamp);
    }
}
