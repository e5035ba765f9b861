//! Maps in plots: a grid of cells coloured by their value, and the scale of the colours.

use std::fmt::Write as _;

use meltpath_geometry::math::DVec2;

use crate::colour::ColourMap;
use crate::escape::escape;
use crate::number::significant;

/// Colours that a map is drawn with.
const LEVELS: usize = 64;

/// Values over a grid of equal cells, such as temperatures in a section.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Name in the legend.
    pub name: String,
    /// Unit as written for people; empty when the value has none.
    pub unit: String,
    /// Lower left and upper right corner of the grid.
    pub corners: [DVec2; 2],
    /// Cells along x.
    pub columns: usize,
    /// One value per cell, row by row from below; not a number where there is none.
    pub values: Vec<f64>,
    /// Ends of the colour scale; values beyond take the end colours. The range of the values when absent.
    pub range: Option<[f64; 2]>,
    /// Which colours.
    pub colours: ColourMap,
}

impl Map {
    /// Cells along y.
    pub fn rows(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Ends of the colour scale.
    pub fn ends(&self) -> [f64; 2] {
        self.range.unwrap_or_else(|| {
            let finite = || self.values.iter().copied().filter(|v| v.is_finite());
            let low = finite().fold(f64::INFINITY, f64::min);
            let high = finite().fold(f64::NEG_INFINITY, f64::max);
            if low < high {
                [low, high]
            } else {
                [low, low + 1.0]
            }
        })
    }

    fn level(&self, value: f64) -> Option<usize> {
        let [low, high] = self.ends();
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        share
            .is_finite()
            .then(|| (share * (LEVELS - 1) as f64).round() as usize)
    }
}

/// Colour of a share of the scale, as in style sheets.
fn colour(map: ColourMap, share: f64) -> String {
    let stops = map.stops();
    let x = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let low = (x as usize).min(stops.len() - 2);
    let weight = x - low as f64;
    let mut text = String::from("#");
    for (a, b) in stops[low].iter().zip(stops[low + 1]) {
        let mixed = f64::from(*a) + weight * (f64::from(b) - f64::from(*a));
        let _ = write!(text, "{:02x}", mixed.round() as u8);
    }
    text
}

/// Draws the cells; `place` goes from values to the drawing. Cells of one colour that lie side by side become one.
pub(super) fn cells(out: &mut String, map: &Map, place: impl Fn(DVec2) -> DVec2) {
    let (columns, rows) = (map.columns, map.rows());
    if columns == 0 || rows == 0 {
        return;
    }
    let [low, high] = map.corners;
    let size = (high - low) / DVec2::new(columns as f64, rows as f64);
    let mut paths = vec![String::new(); LEVELS];
    for (j, row) in map.values.chunks_exact(columns).enumerate() {
        let levels: Vec<Option<usize>> = row.iter().map(|v| map.level(*v)).collect();
        let mut begin = 0;
        for run in levels.chunk_by(|a, b| a == b) {
            let end = begin + run.len();
            if let Some(level) = run[0] {
                let corner =
                    |i: usize, j: usize| place(low + size * DVec2::new(i as f64, j as f64));
                let (a, b) = (corner(begin, j), corner(end, j + 1));
                let _ = write!(
                    paths[level],
                    "M{:.1} {:.1}H{:.1}V{:.1}H{:.1}Z",
                    a.x, a.y, b.x, b.y, a.x
                );
            }
            begin = end;
        }
    }
    out.push_str("<g shape-rendering=\"crispEdges\">");
    for (level, path) in paths.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
        let fill = colour(map.colours, level as f64 / (LEVELS - 1) as f64);
        let _ = write!(out, "<path fill=\"{fill}\" d=\"{path}\"/>");
    }
    out.push_str("</g>");
}

/// The scale in the legend: its colours between its ends.
pub(super) fn scale(map: &Map) -> String {
    const STEPS: u32 = 16;
    let mut html = String::new();
    let [low, high] = map.ends().map(|v| escape(&significant(v, 4)).into_owned());
    let _ = write!(
        html,
        "<li>{} {low} <svg class=\"swatch\" width=\"96\" height=\"12\" aria-hidden=\"true\">",
        escape(&map.name)
    );
    for n in 0..STEPS {
        let fill = colour(map.colours, f64::from(n) / f64::from(STEPS - 1));
        let _ = write!(
            html,
            "<rect fill=\"{fill}\" x=\"{}\" y=\"1\" width=\"6\" height=\"10\"/>",
            6 * n
        );
    }
    let _ = write!(html, "</svg> {high} {}</li>", escape(&map.unit));
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(values: Vec<f64>) -> Map {
        Map {
            name: "temperature".to_owned(),
            unit: "°C".to_owned(),
            corners: [DVec2::ZERO, DVec2::new(4.0, 2.0)],
            columns: 4,
            values,
            range: None,
            colours: ColourMap::Sequential,
        }
    }

    #[test]
    fn cells_of_one_colour_become_one_and_gaps_stay_empty() {
        let nan = f64::NAN;
        let drawn = |values: Vec<f64>| {
            let mut out = String::new();
            cells(&mut out, &map(values), |p| 10.0 * p);
            out
        };
        let text = drawn(vec![0.0, 0.0, 1.0, 1.0, nan, nan, nan, 0.0]);
        assert_eq!(text.matches('M').count(), 3, "{text}");
        assert!(text.contains("M0.0 0.0H20.0V10.0H0.0Z"), "{text}");
        // both ends of the scale
        assert!(
            text.contains("#440154") && text.contains("#fde725"),
            "{text}"
        );
        assert!(!text.contains("NaN"));
        assert_eq!(drawn(vec![nan; 8]).matches('M').count(), 0);
        assert_eq!(drawn(vec![3.0; 8]).matches('M').count(), 2);
        let legend = scale(&map(vec![750.0, 750.0, 4000.0, 4000.0]));
        assert!(
            legend.contains("temperature 750 <") && legend.contains("> 4000 °C"),
            "{legend}"
        );
    }
}
