//! The frame of a plot: which values it spans, where they fall in the drawing.

use meltpath_geometry::math::DVec2;

use super::ticks::axis_ticks;
use super::{Aspect, Axis, Bar, Mark, Plot, Scale};

/// Width of the drawing, pixels.
pub(super) const WIDTH: f64 = 520.0;
/// Height of the drawing, pixels.
pub(super) const HEIGHT: f64 = 300.0;
/// Least free space around the frame: left, top, right, bottom.
const MARGIN: [f64; 4] = [48.0, 12.0, 16.0, 46.0];
/// Width of a digit in the tick labels, upper estimate over common fonts.
const DIGIT: f64 = 8.0;
/// Intervals that the vertical axis aims at.
pub(super) const Y_TICKS: u32 = 5;

/// Map from values to the drawing.
pub(super) struct Frame {
    pub(super) lo: DVec2,
    pub(super) hi: DVec2,
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Frame {
    pub(super) fn of(plot: &Plot) -> Frame {
        let (mut lo, mut hi) = extent(&plot.marks);
        pad(&mut lo.x, &mut hi.x, plot.x.range, 0.0);
        pad(&mut lo.y, &mut hi.y, plot.y.range, 0.06);
        let [least_left, top, right, bottom] = MARGIN;
        let longest = axis_ticks(plot.y.scale, lo.y, hi.y, Y_TICKS)
            .iter()
            .filter_map(|t| t.label.as_ref())
            .map(|label| label.chars().count())
            .max();
        let left = (33.0 + DIGIT * longest.unwrap_or(0) as f64).max(least_left);
        let mut frame = Frame {
            lo,
            hi,
            left,
            top,
            right: WIDTH - right,
            bottom: HEIGHT - bottom,
        };
        if plot.aspect == Aspect::Equal {
            frame.widen_to_equal_scales();
        }
        frame
    }

    fn widen_to_equal_scales(&mut self) {
        let size = DVec2::new(self.right - self.left, self.bottom - self.top);
        let per_unit = (size / (self.hi - self.lo)).min_element();
        let missing = size / per_unit - (self.hi - self.lo);
        self.lo -= 0.5 * missing;
        self.hi += 0.5 * missing;
    }

    pub(super) fn x(&self, x: f64) -> f64 {
        self.left + (x - self.lo.x) / (self.hi.x - self.lo.x) * (self.right - self.left)
    }

    pub(super) fn y(&self, y: f64) -> f64 {
        self.bottom - (y - self.lo.y) / (self.hi.y - self.lo.y) * (self.bottom - self.top)
    }

    pub(super) fn place(&self, p: DVec2) -> DVec2 {
        DVec2::new(self.x(p.x), self.y(p.y))
    }
}

/// Smallest box around every finite point of the marks; limits count along y.
fn extent(marks: &[Mark]) -> (DVec2, DVec2) {
    let mut lo = DVec2::INFINITY;
    let mut hi = DVec2::NEG_INFINITY;
    let mut take = |p: DVec2| {
        if p.is_finite() {
            lo = lo.min(p);
            hi = hi.max(p);
        }
    };
    for mark in marks {
        match mark {
            Mark::Line { points, .. } | Mark::Dots { points, .. } => {
                points.iter().copied().for_each(&mut take);
            }
            Mark::Band { lower, upper, .. } => {
                lower.iter().chain(upper).copied().for_each(&mut take);
            }
            Mark::Area { outline, .. } => outline.iter().copied().for_each(&mut take),
            Mark::Map(map) => map.corners.iter().copied().for_each(&mut take),
            Mark::Film(film) => {
                let corners = film.shots.iter().flat_map(|shot| shot.map.corners);
                corners.for_each(&mut take);
            }
            Mark::Bars { bars, .. } => {
                for bar in bars {
                    take(DVec2::new(bar.from, 0.0));
                    take(DVec2::new(bar.to, bar.value));
                }
            }
            Mark::Limit { .. } => {}
        }
    }
    for mark in marks {
        if let Mark::Limit { value, .. } = mark
            && value.is_finite()
        {
            lo.y = lo.y.min(*value);
            hi.y = hi.y.max(*value);
        }
    }
    (lo, hi)
}

/// Settles one axis: the asked range, or the data with `margin` on either side, never empty.
fn pad(lo: &mut f64, hi: &mut f64, asked: Option<[f64; 2]>, margin: f64) {
    if let Some([a, b]) = asked.filter(|[a, b]| a < b && (b - a).is_finite()) {
        (*lo, *hi) = (a, b);
        return;
    }
    if !(lo.is_finite() && hi.is_finite()) {
        (*lo, *hi) = (0.0, 1.0);
    }
    let span = *hi - *lo;
    let least = 1e-9 * lo.abs().max(hi.abs()).max(1e-9);
    let grow = if span > least {
        margin * span
    } else {
        0.5 * lo.abs().max(1.0)
    };
    // bars and counts stand on zero
    let on_zero = *lo == 0.0 && span > least;
    *lo -= if on_zero { 0.0 } else { grow };
    *hi += grow;
}

/// The plot in the coordinates of its frame: decimal logarithms along logarithmic axes.
pub(super) fn straightened(plot: &Plot) -> Plot {
    let along = |scale: Scale, v: f64| match scale {
        Scale::Linear => v,
        // the logarithm of zero would be drawn at the end of the world
        Scale::Logarithmic if v > 0.0 => v.log10(),
        Scale::Logarithmic => f64::NAN,
    };
    let (sx, sy) = (plot.x.scale, plot.y.scale);
    let points = |all: &[DVec2]| -> Vec<DVec2> {
        all.iter()
            .map(|p| DVec2::new(along(sx, p.x), along(sy, p.y)))
            .collect()
    };
    let axis = |a: &Axis| Axis {
        range: a.range.map(|ends| ends.map(|v| along(a.scale, v))),
        ..a.clone()
    };
    let marks = plot
        .marks
        .iter()
        .map(|mark| match mark {
            Mark::Line { name, points: p } => Mark::Line {
                name: name.clone(),
                points: points(p),
            },
            Mark::Dots { name, points: p } => Mark::Dots {
                name: name.clone(),
                points: points(p),
            },
            Mark::Band { name, lower, upper } => Mark::Band {
                name: name.clone(),
                lower: points(lower),
                upper: points(upper),
            },
            Mark::Area { name, outline } => Mark::Area {
                name: name.clone(),
                outline: points(outline),
            },
            Mark::Bars { name, bars } => Mark::Bars {
                name: name.clone(),
                bars: bars
                    .iter()
                    .map(|b| Bar {
                        from: along(sx, b.from),
                        to: along(sx, b.to),
                        value: along(sy, b.value),
                    })
                    .collect(),
            },
            Mark::Limit { name, value } => Mark::Limit {
                name: name.clone(),
                value: along(sy, *value),
            },
            // equal cells stay equal on linear axes only
            Mark::Map(map) => Mark::Map(map.clone()),
            Mark::Film(film) => Mark::Film(film.clone()),
        })
        .collect();
    Plot {
        x: axis(&plot.x),
        y: axis(&plot.y),
        marks,
        ..plot.clone()
    }
}
