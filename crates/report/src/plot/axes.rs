//! The axes of a plot: grid lines, ticks, labels.

use std::fmt::Write as _;

use meltpath_geometry::math::DVec2;

use super::frame::{Frame, HEIGHT, Y_TICKS};
use super::ticks::axis_ticks;
use super::{Axis, Plot};
use crate::escape::escape;

/// Draws both axes.
pub(super) fn axes(out: &mut String, plot: &Plot, f: &Frame) {
    let mut grid = String::new();
    let mut labels = String::new();
    for tick in axis_ticks(plot.x.scale, f.lo.x, f.hi.x, 6) {
        let at = f.x(tick.at);
        let _ = write!(grid, "M{at:.1} {:.1}V{:.1}", f.top, f.bottom);
        if let Some(label) = tick.label {
            let _ = write!(
                labels,
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                f.bottom + 17.0,
            );
        }
    }
    for tick in axis_ticks(plot.y.scale, f.lo.y, f.hi.y, Y_TICKS) {
        let at = f.y(tick.at);
        let _ = write!(grid, "M{:.1} {at:.1}H{:.1}", f.left, f.right);
        if let Some(label) = tick.label {
            let _ = write!(
                labels,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                f.left - 7.0,
                at + 4.0,
            );
        }
    }
    let _ = write!(
        out,
        "<path class=\"grid\" d=\"{grid}\"/><path class=\"frame\" d=\"M{0} {1}V{2}H{3}\"/><g class=\"ticks\">{labels}</g>",
        f.left, f.top, f.bottom, f.right
    );
    let middle = DVec2::new(0.5 * (f.left + f.right), 0.5 * (f.top + f.bottom));
    let _ = write!(
        out,
        "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
        middle.x,
        HEIGHT - 8.0,
        axis_label(&plot.x),
    );
    // turned, the text runs upwards: its x is the negative of the page's y
    let _ = write!(
        out,
        "<text class=\"axis\" x=\"{:.1}\" y=\"14\" transform=\"rotate(-90)\" text-anchor=\"middle\">{}</text>",
        -middle.y,
        axis_label(&plot.y),
    );
}

fn axis_label(axis: &Axis) -> String {
    if axis.unit.is_empty() {
        escape(&axis.label).into_owned()
    } else {
        format!("{} ({})", escape(&axis.label), escape(&axis.unit))
    }
}
