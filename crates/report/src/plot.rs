//! Plots as data: axes, and marks drawn in order. [`svg`] draws them.

mod axes;
mod frame;
mod line;
mod map;
pub mod svg;
mod ticks;

use meltpath_geometry::math::DVec2;

pub use map::Map;

/// How an axis runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps are equally long.
    #[default]
    Linear,
    /// Equal ratios are equally long; points at or below zero leave gaps.
    Logarithmic,
}

/// One axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// Name, such as `height`.
    pub label: String,
    /// Unit as written for people; empty when the value has none.
    pub unit: String,
    /// Ends; from the marks when absent.
    pub range: Option<[f64; 2]>,
    /// How it runs.
    pub scale: Scale,
}

impl Axis {
    /// An axis over the range of its marks.
    pub fn new(label: &str, unit: &str) -> Self {
        Axis {
            label: label.to_owned(),
            unit: unit.to_owned(),
            range: None,
            scale: Scale::Linear,
        }
    }

    /// An axis of equal ratios, such as the frequency of a Bode plot.
    pub fn logarithmic(label: &str, unit: &str) -> Self {
        Axis {
            scale: Scale::Logarithmic,
            ..Axis::new(label, unit)
        }
    }

    /// The same axis between given ends.
    #[must_use]
    pub fn between(self, from: f64, to: f64) -> Self {
        Axis {
            range: Some([from, to]),
            ..self
        }
    }
}

/// Label and unit.
impl From<[&str; 2]> for Axis {
    fn from([label, unit]: [&str; 2]) -> Self {
        Axis::new(label, unit)
    }
}

/// Whether both axes have the same scale.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Aspect {
    /// Each axis fills the frame.
    #[default]
    Free,
    /// A millimetre is as long along x as along y: sections, profiles.
    Equal,
}

/// One bar of a histogram or bar chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// Start along x.
    pub from: f64,
    /// End along x.
    pub to: f64,
    /// Height along y.
    pub value: f64,
}

/// One picture of a film.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// When, as written beside the slider.
    pub label: String,
    /// The picture.
    pub map: Map,
}

/// Maps of one grid and one colour scale, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Name beside the slider.
    pub name: String,
    /// The pictures; their maps name the legend.
    pub shots: Vec<Shot>,
}

impl Film {
    /// The picture that is shown first.
    pub fn first(&self) -> usize {
        self.shots.len() / 2
    }
}

/// Something drawn. Points are (x, y) in the units of the axes; a point that is not finite leaves a gap.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A line through points.
    Line {
        /// Name in the legend.
        name: String,
        /// The points.
        points: Vec<DVec2>,
    },
    /// Dots, such as measurements.
    Dots {
        /// Name in the legend.
        name: String,
        /// The points.
        points: Vec<DVec2>,
    },
    /// The band of one standard uncertainty or of a range.
    Band {
        /// Name in the legend.
        name: String,
        /// Lower edge.
        lower: Vec<DVec2>,
        /// Upper edge, at the x of the lower one.
        upper: Vec<DVec2>,
    },
    /// A filled outline, such as a section of the part.
    Area {
        /// Name in the legend.
        name: String,
        /// The closed outline.
        outline: Vec<DVec2>,
    },
    /// Bars from zero.
    Bars {
        /// Name in the legend.
        name: String,
        /// The bars.
        bars: Vec<Bar>,
    },
    /// Coloured cells, along linear axes.
    Map(Map),
    /// Maps in time, one shown at a time, with a slider.
    Film(Film),
    /// A horizontal limit.
    Limit {
        /// Name in the legend.
        name: String,
        /// Where it lies along y.
        value: f64,
    },
}

impl Mark {
    /// The name in the legend.
    pub fn name(&self) -> &str {
        match self {
            Mark::Line { name, .. }
            | Mark::Dots { name, .. }
            | Mark::Band { name, .. }
            | Mark::Area { name, .. }
            | Mark::Bars { name, .. }
            | Mark::Limit { name, .. } => name,
            Mark::Map(map) => &map.name,
            Mark::Film(film) => &film.name,
        }
    }
}

/// A plot: marks share the colour of their place among lines, dots and bars; a band takes the colour of the line
/// that follows it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Marks, drawn in order.
    pub marks: Vec<Mark>,
    /// Scales of the axes.
    pub aspect: Aspect,
    /// What to see, in a sentence; empty for none.
    pub caption: String,
}

impl Plot {
    /// An empty plot.
    pub fn new(title: &str, x: impl Into<Axis>, y: impl Into<Axis>) -> Self {
        Plot {
            title: title.to_owned(),
            x: x.into(),
            y: y.into(),
            ..Plot::default()
        }
    }

    /// The same plot with one more mark.
    #[must_use]
    pub fn with(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }

    /// The same plot with one more line.
    #[must_use]
    pub fn line(self, name: impl Into<String>, points: Vec<DVec2>) -> Self {
        let name = name.into();
        self.with(Mark::Line { name, points })
    }

    /// The same plot with more dots.
    #[must_use]
    pub fn dots(self, name: impl Into<String>, points: Vec<DVec2>) -> Self {
        let name = name.into();
        self.with(Mark::Dots { name, points })
    }

    /// The same plot with one more band.
    #[must_use]
    pub fn band(self, name: impl Into<String>, lower: Vec<DVec2>, upper: Vec<DVec2>) -> Self {
        let name = name.into();
        self.with(Mark::Band { name, lower, upper })
    }

    /// The same plot with more bars.
    #[must_use]
    pub fn bars(self, name: impl Into<String>, bars: Vec<Bar>) -> Self {
        let name = name.into();
        self.with(Mark::Bars { name, bars })
    }

    /// The same plot with one more limit.
    #[must_use]
    pub fn limit(self, name: impl Into<String>, value: f64) -> Self {
        let name = name.into();
        self.with(Mark::Limit { name, value })
    }

    /// The same plot with a caption.
    #[must_use]
    pub fn caption(self, caption: &str) -> Self {
        Plot {
            caption: caption.to_owned(),
            ..self
        }
    }
}

/// A histogram of the finite `values` in `bins` equal intervals.
///
/// ```
/// let bars = meltpath_report::plot::histogram(&[0.0, 0.1, 0.9, 1.0, f64::NAN], 2);
/// assert_eq!(bars.iter().map(|b| b.value).collect::<Vec<_>>(), [2.0, 2.0]);
/// ```
pub fn histogram(values: &[f64], bins: usize) -> Vec<Bar> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let lo = finite().fold(f64::INFINITY, f64::min);
    let hi = finite().fold(f64::NEG_INFINITY, f64::max);
    if lo > hi {
        return Vec::new();
    }
    let bins = bins.max(1);
    // equal values make one bin of unit width about them
    let (lo, hi) = if lo < hi {
        (lo, hi)
    } else {
        (lo - 0.5, hi + 0.5)
    };
    let width = (hi - lo) / bins as f64;
    let mut counts = vec![0_u64; bins];
    for v in finite() {
        counts[(((v - lo) / width) as usize).min(bins - 1)] += 1;
    }
    counts
        .into_iter()
        .enumerate()
        .map(|(i, count)| Bar {
            from: lo + i as f64 * width,
            to: lo + (i + 1) as f64 * width,
            value: count as f64,
        })
        .collect()
}
