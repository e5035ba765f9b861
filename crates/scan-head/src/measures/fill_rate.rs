//! Fill rate: the share of a surface that the marking reaches, on cells as wide as the spot.
//!
//! Source: Rasoanarivo 2020, § 2.6.2, fig. 2.73. "Reached" is not defined there and decides the number
//! (docs/theory/sources.md): three modes, and the mode is told with every number.

use std::sync::Arc;

use meltpath_geometry::math::DVec2;
use serde::{Deserialize, Serialize};

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::vector::{ScanJob, VectorKind};

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
}

impl FillMode {
    /// The mode in words.
    pub fn words(self) -> &'static str {
        match self {
            FillMode::SampledPoints { .. } => "cells with a lit sample",
            FillMode::Segments => "cells crossed by the lit path",
            FillMode::SweptSpot => "cell centres under the swept spot",
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
    pub fn beside_lines(lines: &[(DVec2, DVec2)], hatch: f64, cell: f64) -> Self {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &(a, b) in lines {
            low = low.min(a).min(b);
            high = high.max(a).max(b);
        }
        if lines.is_empty() {
            (low, high) = (DVec2::ZERO, DVec2::ZERO);
        }
        let half = 0.5 * hatch;
        let mut cells = Cells::new(low - half, high + half, cell);
        for &(a, b) in lines {
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

/// The hatch distance of a job's fill: the median distance between neighbouring parallel lines; none with fewer than two.
pub fn hatch_distance(job: &ScanJob) -> Option<f64> {
    /// Sine of the largest angle between lines called parallel.
    const PARALLEL: f64 = 0.01;
    let mut distances = Vec::new();
    let mut before: Option<(DVec2, DVec2)> = None;
    for (i, v) in job.vectors.iter().enumerate() {
        if v.kind != VectorKind::Fill {
            continue;
        }
        let (a, b) = (job.start_of(i).truncate(), v.end.truncate());
        let along = (b - a).normalize_or_zero();
        if let Some((from, to)) = before {
            let other = (to - from).normalize_or_zero();
            let distance = (from.midpoint(to) - a).perp_dot(along).abs();
            if other.perp_dot(along).abs() < PARALLEL && distance > 0.0 {
                distances.push(distance);
            }
        }
        before = Some((a, b));
    }
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied()
}

/// What must be filled.
#[derive(Debug, Clone)]
enum Surface {
    /// Rectangles, told by the vectors' blocks: their lowest and highest corners.
    Rectangles(Vec<[DVec2; 2]>),
    /// What lies beside the fill lines of each layer: where layers begin, and the hatch distance.
    Layers(Vec<u32>, f64),
}

/// Fill rates of rectangles or of layers while a run streams; only light commanded for fills counts. One rectangle or
/// layer is held at a time.
#[derive(Debug)]
pub struct FillRate<'a> {
    job: &'a ScanJob,
    surface: Surface,
    /// Diameter of the spot and side of the cells, mm.
    spot: f64,
    modes: Vec<FillMode>,
    /// The square or layer now, from 0.
    area: u32,
    cells: Vec<Cells>,
    last: Option<DVec2>,
    /// For each finished area, the rate in each mode.
    rates: Vec<Vec<f64>>,
}

impl<'a> FillRate<'a> {
    /// For rectangles, one after the other, given by their lowest and highest corners, mm: `job` marks them as blocks 0, 1… with a spot
    /// of diameter `spot` mm.
    pub fn of_rectangles(
        job: &'a ScanJob,
        rectangles: Vec<[DVec2; 2]>,
        spot: f64,
        modes: &[FillMode],
    ) -> Self {
        Self::over(job, Surface::Rectangles(rectangles), spot, modes)
    }

    /// For layers that begin with the vectors `first`: the surface to fill lies within half of `hatch` mm beside their fill lines.
    pub fn of_layers(
        job: &'a ScanJob,
        first: &[u32],
        hatch: f64,
        spot: f64,
        modes: &[FillMode],
    ) -> Self {
        Self::over(job, Surface::Layers(first.to_vec(), hatch), spot, modes)
    }

    fn over(job: &'a ScanJob, surface: Surface, spot: f64, modes: &[FillMode]) -> Self {
        let mut rate = FillRate {
            job,
            surface,
            spot,
            modes: modes.to_vec(),
            area: 0,
            cells: Vec::new(),
            last: None,
            rates: Vec::new(),
        };
        rate.enter(0);
        rate
    }

    fn enter(&mut self, area: u32) {
        let cells = match &self.surface {
            Surface::Rectangles(all) => {
                let [low, high] = all.get(area as usize).copied().unwrap_or_default();
                Cells::new(low, high, self.spot)
            }
            Surface::Layers(first, hatch) => {
                let k = area as usize;
                let from = first.get(k).map_or(0, |&f| f as usize);
                let to = first
                    .get(k + 1)
                    .map_or(self.job.vectors.len(), |&f| f as usize);
                let lines: Vec<(DVec2, DVec2)> = (from..to)
                    .filter(|&i| self.job.vectors[i].kind == VectorKind::Fill)
                    .map(|i| {
                        (
                            self.job.start_of(i).truncate(),
                            self.job.vectors[i].end.truncate(),
                        )
                    })
                    .collect();
                Cells::beside_lines(&lines, *hatch, self.spot)
            }
        };
        self.area = area;
        self.cells = vec![cells; self.modes.len()];
        self.last = None;
    }

    /// The area that a vector belongs to.
    fn area_of(&self, vector: u32) -> u32 {
        match &self.surface {
            Surface::Rectangles(_) => self.job.vectors[vector as usize].block,
            Surface::Layers(first, _) => {
                let next = first.get(self.area as usize + 1);
                self.area + u32::from(next.is_some_and(|&f| vector >= f))
            }
        }
    }

    /// For each square or layer, in order, its rate in each mode.
    pub fn finish(mut self) -> Vec<Vec<f64>> {
        self.rates
            .push(self.cells.iter().map(Cells::rate).collect());
        self.rates
    }
}

impl HeadSink for FillRate<'_> {
    fn block(&mut self, block: &HeadBlock) {
        let radius = 0.5 * self.spot;
        for (k, &vector) in block.command.vector.iter().enumerate() {
            let v = &self.job.vectors[vector as usize];
            let area = self.area_of(vector);
            if area != self.area {
                let rates = self.cells.iter().map(Cells::rate).collect();
                self.rates.push(rates);
                self.enter(area);
            }
            let p = block.hit[k];
            // the light of a fill may last into the wait or the connection behind it, not into contours
            if block.lit[k] < 0.5 || v.kind == VectorKind::Contour {
                self.last = None;
                continue;
            }
            let from = self.last.unwrap_or(p);
            for (cells, mode) in self.cells.iter_mut().zip(&self.modes) {
                match *mode {
                    FillMode::SampledPoints { every } => {
                        if (block.command.first + k as u64).is_multiple_of(u64::from(every.max(1)))
                        {
                            cells.point(p);
                        }
                    }
                    FillMode::Segments => cells.segment(from, p),
                    FillMode::SweptSpot => cells.swept(from, p, radius),
                }
            }
            self.last = Some(p);
        }
    }
}
