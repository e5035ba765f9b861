//! The widest spot within closed contours that no mark comes near: of a large area an island that a file lost is a small share.

use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::measures::outline::NEAR;

use crate::lpbf::plan::cells::Cells;

/// What to do where lines are missing.
pub(super) const LOST: &str = "lines that the file lost: hatch the part anew; where contours alone, or lines of other layers, are to fill it, judge a file without these contours";
/// How wide one may be, in hatch distances or spots, whichever is more: four lines that miss side by side leave one as wide. Ours.
const WIDE: f64 = 5.0;

/// The widest circle within closed contours that no mark enters.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct BareSpot {
    layer: u32,
    /// Diameter, mm.
    width: f64,
    at: DVec2,
}

impl BareSpot {
    /// Looks at the enclosed cells of a layer, of which some lie near marks; its lines lie `hatch` mm apart.
    pub(super) fn take(
        &mut self,
        layer: u32,
        (cells, enclosed): (&Cells, &[bool]),
        (marked, hatch): (&[bool], f64),
    ) {
        let bare = enclosed.iter().zip(marked);
        let bare: Vec<bool> = bare.map(|(inside, marked)| *inside && !marked).collect();
        let Some((cell, depth)) = cells.deepest(&bare) else {
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

    /// Told where it is wider than it may be: `wide` is the hatch distance or the spot, mm.
    pub(super) fn check(&self, wide: f64) -> Option<Check> {
        let BareSpot { layer, width, at } = *self;
        let most = WIDE * wide;
        if width <= most {
            return None;
        }
        let check = Check::judge(
            "bare-spot",
            "widest spot within closed contours that no mark comes near",
            Measure::exact(width, "mm"),
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
        let reason = "whether that is meant the file does not say";
        Some(check.because(reason).at(place).remedy(LOST))
    }
}
