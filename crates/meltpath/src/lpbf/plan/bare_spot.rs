//! The widest spot and the longest strip within closed contours that no mark comes near: of a large area an island or lines that a file lost
//! are a small share.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::measures::outline::NEAR;

use crate::lpbf::plan::cells::Cells;

/// What to do where lines are missing.
pub(super) const LOST: &str = "lines that the file lost: hatch the part anew; where contours alone, or lines of other layers, are to fill it, judge a file without these contours";
/// How wide a spot may be, in hatch distances or spots, whichever is more: where lines end short of a corner. Ours.
const WIDE: f64 = 5.0;
/// How long a strip may be, in hatch distances or spots, whichever is more: a line or two that begin late where a contour curves. Ours.
const LONG: f64 = 20.0;

/// The widest circle within closed contours that no mark enters.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct BareSpot {
    layer: u32,
    /// Diameter, mm.
    width: f64,
    at: DVec2,
}

impl BareSpot {
    /// Looks at the cells of a layer that are enclosed and lie near no mark; its lines lie `hatch` mm apart.
    pub(super) fn take(&mut self, (layer, cells): (u32, &Cells), bare: &[bool], hatch: f64) {
        let Some((cell, depth)) = cells.deepest(bare) else {
            return;
        };
        let width = 2.0 * (depth + NEAR * hatch);
        if width > self.width {
            *self = BareSpot {
                layer,
                width,
                at: cells.middle(cell),
            };
        }
    }

    /// How wide it is, 0 where all lies near marks: `wide` is the hatch distance or the spot, mm.
    pub(super) fn check(&self, wide: f64) -> Check {
        let BareSpot { layer, width, at } = *self;
        let most = WIDE * wide;
        let check = Check::judge(
            "bare-spot",
            "widest spot within closed contours that no mark comes near",
            Measure::exact(width, "mm"),
            Limit::AtMost(most),
        );
        if width == 0.0 {
            return check;
        }
        let place = Place {
            layer: Some(layer),
            ..Place::at([at.x, at.y, 0.0])
        };
        let check = check.at(place);
        if width <= most {
            return check;
        }
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        check.because(UNSAID).remedy(LOST)
    }
}

const UNSAID: &str = "whether that is meant the file does not say";

/// The longest strip within closed contours that marks do not cover.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct BareStrip {
    layer: u32,
    /// mm.
    length: f64,
    at: DVec2,
}

impl BareStrip {
    /// Looks at the cells of a layer that are enclosed and not covered.
    pub(super) fn take(&mut self, (layer, cells): (u32, &Cells), bare: &[bool]) {
        let Some((cell, length)) = cells.longest(bare) else {
            return;
        };
        if length > self.length {
            *self = BareStrip {
                layer,
                length,
                at: cells.middle(cell),
            };
        }
    }

    /// Told where it is longer than it may be: marks cover what is nearer than `cover` mm, `wide` is the hatch distance or the spot, mm.
    pub(super) fn check(&self, cover: f64, wide: f64) -> Option<Check> {
        let BareStrip { layer, length, at } = *self;
        let most = LONG * wide;
        if length <= most {
            return None;
        }
        let check = Check::judge(
            "bare-strip",
            "longest strip within closed contours that marks do not cover",
            Measure::exact(length, "mm"),
            Limit::AtMost(most),
        );
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        let place = Place {
            layer: Some(layer),
            ..Place::at([at.x, at.y, 0.0])
        };
        let reason = format!(
            "nowhere nearer to a mark than {} mm, so more than {} mm wide from mark to mark; {UNSAID}",
            significant(cover, 3),
            significant(2.0 * cover, 3)
        );
        Some(check.because(&reason).at(place).remedy(LOST))
    }
}
