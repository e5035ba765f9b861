//! Fill rate: the share of a surface that the marking reaches, on cells as wide as the spot or on the surface itself.
//!
//! Source: Rasoanarivo 2020, § 2.6.2, fig. 2.73. "Reached" is not defined there and decides the number
//! (docs/theory/sources.md): several modes, and the mode is told with every number.

use std::sync::Arc;

use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::signed_area;
use serde::{Deserialize, Serialize};

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::prepared::Prepared;
use crate::measures::fill_share::AreaFill;
use crate::measures::outline::{Outline, Outlines, rows_within};
use crate::measures::swept_surface::{Rate, SweptSurface};
use meltpath_toolpath::Role;

/// When a cell counts as reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FillMode {
    /// A lit sample lies in it; only every n-th sample counts. The thesis' reading; it depends on the sampling.
    SampledPoints {
        /// n.
        every: u32,
    },
    /// The lit path crosses it.
    Segments,
    /// Its centre lies under the spot swept along the lit path.
    SweptSpot,
    /// No cells: the surface itself under the spot swept along the lit path. It does not depend on where a grid lies.
    SweptSurface,
}

impl FillMode {
    /// The mode in words.
    pub fn words(self) -> &'static str {
        match self {
            FillMode::SampledPoints { .. } => "cells with a lit sample",
            FillMode::Segments => "cells crossed by the lit path",
            FillMode::SweptSpot => "cell centres under the swept spot",
            FillMode::SweptSurface => "surface under the swept spot",
        }
    }
}

/// Cells of one rectangle.
#[derive(Debug, Clone)]
pub struct Cells {
    low: DVec2,
    cell: f64,
    columns: usize,
    rows: usize,
    reached: Vec<bool>,
    /// The cells that count; all where it is none.
    wanted: Option<Arc<[bool]>>,
}

impl Cells {
    /// Cells of side `cell` mm over a rectangle; the last ones may reach beyond it.
    pub fn new(low: DVec2, high: DVec2, cell: f64) -> Self {
        let count = |length: f64| (length / cell - 1e-9).ceil().max(1.0) as usize;
        let (columns, rows) = (count(high.x - low.x), count(high.y - low.y));
        Cells {
            low,
            cell,
            columns,
            rows,
            reached: vec![false; columns * rows],
            wanted: None,
        }
    }

    /// Cells over lines, of which those count whose centre lies beside a line, at most half of `hatch` mm away.
    fn beside_lines(lines: &[[DVec2; 2]], hatch: f64, cell: f64) -> Self {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &[a, b] in lines {
            low = low.min(a).min(b);
            high = high.max(a).max(b);
        }
        if lines.is_empty() {
            (low, high) = (DVec2::ZERO, DVec2::ZERO);
        }
        let half = 0.5 * hatch;
        let mut cells = Cells::new(low - half, high + half, cell);
        for &[a, b] in lines {
            let along = (b - a).normalize_or_zero();
            let length = a.distance(b);
            cells.near(a, b, half, |centre| {
                let from = centre - a;
                (0.0..=length).contains(&from.dot(along)) && from.perp_dot(along).abs() <= half
            });
        }
        let reached = vec![false; cells.reached.len()];
        cells.wanted = Some(std::mem::replace(&mut cells.reached, reached).into());
        cells
    }

    /// Cells over an outline, of which those count whose centre lies within it.
    fn within_outline(outline: &Outline, cell: f64) -> Self {
        let points = || outline.boundaries.iter().flat_map(|b| &b.ring);
        let low = points().copied().reduce(DVec2::min).unwrap_or_default();
        let high = points().copied().reduce(DVec2::max).unwrap_or_default();
        let mut cells = Cells::new(low, high, cell);
        let heights: Vec<f64> = (0..cells.rows)
            .map(|j| low.y + (j as f64 + 0.5) * cell)
            .collect();
        let mut wanted = vec![false; cells.reached.len()];
        for (j, spans) in rows_within(&outline.boundaries, &heights)
            .into_iter()
            .enumerate()
        {
            for span in spans {
                let at = |x: f64| ((x - low.x) / cell - 0.5).ceil().max(0.0) as usize;
                let [from, to] = span.map(|x| at(x).min(cells.columns));
                wanted[j * cells.columns..][from..to].fill(true);
            }
        }
        if let Some((marks, near)) = &outline.near {
            for [a, b] in marks {
                cells.swept(*a, *b, *near);
            }
            for (wanted, near) in wanted.iter_mut().zip(&mut cells.reached) {
                *wanted = *wanted && std::mem::take(near);
            }
        }
        cells.wanted = Some(wanted.into());
        cells
    }

    /// The share of cells reached; 1 where none counts.
    pub fn rate(&self) -> f64 {
        let (all, reached) = self.counts();
        if all == 0 {
            1.0
        } else {
            reached as f64 / all as f64
        }
    }

    /// Number of cells that count and number of them reached.
    pub fn counts(&self) -> (u64, u64) {
        let reached = self.reached.iter();
        match &self.wanted {
            None => (
                self.reached.len() as u64,
                reached.filter(|r| **r).count() as u64,
            ),
            Some(wanted) => (
                wanted.iter().filter(|w| **w).count() as u64,
                reached
                    .zip(wanted.iter())
                    .filter(|(r, w)| **r && **w)
                    .count() as u64,
            ),
        }
    }

    /// Marks the cell of a point.
    #[inline]
    pub fn point(&mut self, p: DVec2) {
        let at = (p - self.low) / self.cell;
        if at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f64 && at.y < self.rows as f64 {
            self.reached[at.y as usize * self.columns + at.x as usize] = true;
        }
    }

    /// Marks the cells that a segment crosses: it is cut where it meets the grid's lines.
    pub fn segment(&mut self, a: DVec2, b: DVec2) {
        let (from, to) = ((a - self.low) / self.cell, (b - self.low) / self.cell);
        let mut cuts = vec![0.0, 1.0];
        for (p, q) in [(from.x, to.x), (from.y, to.y)] {
            let (low, high) = (p.min(q).ceil() as i64, p.max(q).floor() as i64);
            for line in low..=high {
                let t = (line as f64 - p) / (q - p);
                if t > 0.0 && t < 1.0 {
                    cuts.push(t);
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        for pair in cuts.windows(2) {
            self.point(a.lerp(b, 0.5 * (pair[0] + pair[1])));
        }
    }

    /// Marks the cells whose centre lies within `radius` mm of a segment.
    pub fn swept(&mut self, a: DVec2, b: DVec2, radius: f64) {
        self.near(a, b, radius, |centre| {
            crate::measures::segment::distance_to_segment(centre, a, b) <= radius
        });
    }

    /// Marks the cells near a segment whose centre is wanted.
    fn near(&mut self, a: DVec2, b: DVec2, radius: f64, wanted: impl Fn(DVec2) -> bool) {
        let low = ((a.min(b) - radius - self.low) / self.cell - 0.5).ceil();
        let high = ((a.max(b) + radius - self.low) / self.cell - 0.5).floor();
        let range = |low: f64, high: f64, count: usize| {
            let from = low.max(0.0) as usize;
            let to = (high + 1.0).clamp(0.0, count as f64) as usize;
            from..to.max(from)
        };
        for j in range(low.y, high.y, self.rows) {
            for i in range(low.x, high.x, self.columns) {
                let centre = self.low + (DVec2::new(i as f64, j as f64) + 0.5) * self.cell;
                if wanted(centre) {
                    self.reached[j * self.columns + i] = true;
                }
            }
        }
    }
}

/// What must be filled.
#[derive(Debug, Clone)]
enum Surface {
    /// Rectangles, told by the vectors' blocks: their lowest and highest corners.
    Rectangles(Vec<[DVec2; 2]>),
    /// What lies within the outline of each layer; of one without, at most half of the hatch distance, mm, beside its fill lines.
    Layers(f64, Outlines),
}

impl Surface {
    /// The number of the area that a vector belongs to.
    fn area(&self, layer: &Prepared, i: usize) -> u32 {
        match self {
            Surface::Rectangles(_) => layer.job.vectors[i].block,
            Surface::Layers(..) => layer.first,
        }
    }

    /// That area, of which nothing is reached yet.
    fn begin(&self, layer: &Prepared, area: u32, spot: f64, modes: &[FillMode]) -> Area {
        match self {
            Surface::Rectangles(all) => {
                let [low, high] = all.get(area as usize).copied().unwrap_or_default();
                let reached = modes.iter().map(|mode| match mode {
                    FillMode::SweptSurface => {
                        Reached::Surface(SweptSurface::rectangle(low, high, spot))
                    }
                    _ => Reached::Cells(Cells::new(low, high, spot)),
                });
                Area {
                    key: area,
                    layer: layer.number,
                    middle: low.midpoint(high),
                    surface: (high - low).element_product(),
                    reached: reached.collect(),
                    outlined: false,
                }
            }
            Surface::Layers(hatch, outlines) => {
                match outlines.of(layer.number, &layer.job, *hatch) {
                    Some(outline) => Area::within(&outline, layer, spot, modes),
                    None => Area::beside_lines(layer, *hatch, spot, modes),
                }
            }
        }
    }
}

/// About what an outline encloses, mm²: where it is not measured.
fn corners_area(outline: &Outline) -> f64 {
    let areas = outline
        .boundaries
        .iter()
        .map(|b| signed_area(&b.ring).abs());
    areas.sum()
}

/// What is reached of an area in one mode.
#[derive(Debug)]
enum Reached {
    Cells(Cells),
    Surface(SweptSurface),
}

/// A square or layer while it is marked.
#[derive(Debug)]
struct Area {
    /// By what its vectors are known.
    key: u32,
    layer: u32,
    middle: DVec2,
    surface: f64,
    /// In each mode.
    reached: Vec<Reached>,
    /// Whether contours fill, too: they lie within the outline.
    outlined: bool,
}

impl Area {
    /// What lies within the outline of a layer.
    fn within(outline: &Outline, layer: &Prepared, spot: f64, modes: &[FillMode]) -> Self {
        let reached = modes.iter().map(|mode| match mode {
            FillMode::SweptSurface => Reached::Surface(SweptSurface::within_outline(outline, spot)),
            _ => Reached::Cells(Cells::within_outline(outline, spot)),
        });
        let corners = || outline.boundaries.iter().flat_map(|b| &b.ring);
        Area {
            key: layer.first,
            layer: layer.number,
            middle: corners().sum::<DVec2>() / corners().count().max(1) as f64,
            surface: corners_area(outline),
            reached: reached.collect(),
            outlined: true,
        }
    }

    /// What lies beside the lines of a layer.
    fn beside_lines(layer: &Prepared, hatch: f64, spot: f64, modes: &[FillMode]) -> Self {
        let job = &layer.job;
        let lines: Vec<[DVec2; 2]> = (0..job.vectors.len())
            .filter(|&i| job.vectors[i].kind == Role::Fill)
            .map(|i| [job.start_of(i).truncate(), job.vectors[i].end.truncate()])
            .filter(|[a, b]| a != b)
            .collect();
        let reached = modes.iter().map(|mode| match mode {
            FillMode::SweptSurface => {
                Reached::Surface(SweptSurface::beside_lines(&lines, hatch, spot))
            }
            _ => Reached::Cells(Cells::beside_lines(&lines, hatch, spot)),
        });
        let ends = lines.iter().flatten();
        Area {
            key: layer.first,
            layer: layer.number,
            middle: ends.clone().sum::<DVec2>() / (2 * lines.len()).max(1) as f64,
            // what lines of that distance fill, where no surface is measured
            surface: lines.iter().map(|[a, b]| hatch * a.distance(*b)).sum(),
            reached: reached.collect(),
            outlined: false,
        }
    }

    fn finish(mut self) -> AreaFill {
        let mut rates = Vec::with_capacity(self.reached.len());
        for reached in &mut self.reached {
            rates.push(match reached {
                Reached::Cells(cells) => Rate {
                    share: cells.rate(),
                    doubt: 0.0,
                },
                Reached::Surface(surface) => {
                    let (measured, rate) = surface.rate();
                    self.surface = measured;
                    rate
                }
            });
        }
        if self.surface <= 0.0 {
            rates.clear();
        }
        AreaFill {
            layer: self.layer,
            middle: self.middle,
            surface: self.surface,
            rates,
        }
    }
}

/// Fill rates of rectangles or of layers while a run streams; only light commanded for fills counts, and for contours where
/// the outline is known. One rectangle or layer is held at a time.
#[derive(Debug)]
pub struct FillRate {
    surface: Surface,
    /// Diameter of the spot and side of the cells, mm.
    spot: f64,
    modes: Vec<FillMode>,
    /// The square or layer now.
    area: Option<Area>,
    last: Option<DVec2>,
    finished: Vec<AreaFill>,
}

impl FillRate {
    /// For rectangles, one after the other, given by their lowest and highest corners, mm: a job marks them as blocks 0, 1… with a
    /// spot of diameter `spot` mm.
    pub fn of_rectangles(rectangles: Vec<[DVec2; 2]>, spot: f64, modes: &[FillMode]) -> Self {
        Self::over(Surface::Rectangles(rectangles), spot, modes)
    }

    /// For layers: the surface to fill lies within their outlines, which contours fill, too; of a layer without, within half of `hatch` mm
    /// beside its fill lines.
    pub fn of_layers(hatch: f64, outlines: Outlines, spot: f64, modes: &[FillMode]) -> Self {
        Self::over(Surface::Layers(hatch, outlines), spot, modes)
    }

    fn over(surface: Surface, spot: f64, modes: &[FillMode]) -> Self {
        FillRate {
            surface,
            spot,
            modes: modes.to_vec(),
            area: None,
            last: None,
            finished: Vec::new(),
        }
    }

    /// Ends the area now.
    fn leave(&mut self) {
        self.finished.extend(self.area.take().map(Area::finish));
    }

    /// How each square or layer was filled, in order.
    pub fn finish(mut self) -> Vec<AreaFill> {
        self.leave();
        self.finished
    }
}

impl HeadSink for FillRate {
    fn block(&mut self, block: &HeadBlock) {
        let radius = 0.5 * self.spot;
        for (k, &p) in block.hit.iter().enumerate() {
            let Some((layer, i)) = block.vector(k) else {
                continue;
            };
            let key = self.surface.area(layer, i);
            if self.area.as_ref().is_none_or(|area| area.key != key) {
                self.leave();
                self.area = Some(self.surface.begin(layer, key, self.spot, &self.modes));
                self.last = None;
            }
            // the light of a fill may last into the wait or the connection behind it, not into contours that fill nothing
            let outlined = self.area.as_ref().is_some_and(|area| area.outlined);
            let apart = layer.job.vectors[i].kind == Role::Contour && !outlined;
            if block.lit[k] < 0.5 || apart {
                self.last = None;
                continue;
            }
            let from = self.last.replace(p).unwrap_or(p);
            let reached = self.area.iter_mut().flat_map(|area| &mut area.reached);
            for (reached, mode) in reached.zip(&self.modes) {
                match (reached, mode) {
                    (Reached::Surface(surface), _) => surface.sweep([from, p], radius),
                    (Reached::Cells(cells), FillMode::SampledPoints { every }) => {
                        let sample = block.command.first + k as u64;
                        if sample.is_multiple_of(u64::from((*every).max(1))) {
                            cells.point(p);
                        }
                    }
                    (Reached::Cells(cells), FillMode::Segments) => cells.segment(from, p),
                    (Reached::Cells(cells), _) => cells.swept(from, p, radius),
                }
            }
        }
    }
}
