//! The axes of a plot: grid lines, ticks, labels.

use std::fmt::Write as _;

use meltpath_geometry::math::DVec2;

use crate::escape::escape;
use crate::number::{fixed, significant, ticks};
use crate::plot::{Axis, Plot, Scale};
use crate::plot_svg::{Frame, HEIGHT, Y_TICKS};

/// Draws both axes.
pub(crate) fn axes(out: &mut String, plot: &Plot, f: &Frame) {
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

/// A line of the grid.
pub(crate) struct Tick {
    /// Where, in the coordinates of the frame.
    pub(crate) at: f64,
    /// What stands at it.
    pub(crate) label: Option<String>,
}

/// Most decades whose parts are drawn too.
const FINE_DECADES: f64 = 8.0;

/// The grid lines of an axis from `lo` to `hi` in the frame's coordinates, about `count` of them labelled.
pub(crate) fn axis_ticks(scale: Scale, lo: f64, hi: f64, count: u32) -> Vec<Tick> {
    let span = hi - lo;
    // an axis within a third of a decade is as good as linear; one of 300 decades is none
    if scale == Scale::Linear || !(0.3..300.0).contains(&span) {
        let (values, decimals) = ticks(lo, hi, count);
        return values
            .into_iter()
            .map(|v| Tick {
                at: v,
                label: Some(match scale {
                    Scale::Linear => tick_label(v, decimals),
                    Scale::Logarithmic => significant(10f64.powf(v), 3),
                }),
            })
            .collect();
    }
    let every = (span / f64::from(count.max(1))).ceil().max(1.0) as i32;
    let parts: &[i32] = if span <= FINE_DECADES {
        &[1, 2, 3, 4, 5, 6, 7, 8, 9]
    } else {
        &[1]
    };
    let mut all = Vec::new();
    for decade in lo.floor() as i32..=hi.ceil() as i32 {
        for &part in parts {
            let at = f64::from(decade) + f64::from(part).log10();
            if at < lo - 1e-9 || at > hi + 1e-9 {
                continue;
            }
            let labelled = match part {
                1 => decade.rem_euclid(every) == 0,
                2 | 5 => span < 1.7,
                _ => false,
            };
            let value = f64::from(part) * 10f64.powi(decade);
            all.push(Tick {
                at,
                label: labelled.then(|| significant(value, 1)),
            });
        }
    }
    all
}

fn tick_label(value: f64, decimals: usize) -> String {
    if value.abs() >= 1e6 {
        significant(value, 4)
    } else {
        fixed(value, decimals)
    }
}

fn axis_label(axis: &Axis) -> String {
    if axis.unit.is_empty() {
        escape(&axis.label).into_owned()
    } else {
        format!("{} ({})", escape(&axis.label), escape(&axis.unit))
    }
}
