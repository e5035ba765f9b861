//! Fill rate: the share of a surface that the marking reaches, on cells as wide as the spot.
//!
//! Source: Rasoanarivo 2020, § 2.6.2, fig. 2.73. "Reached" is not defined there and decides the number (specification
//! § 14.2): three modes, and the mode is told with every number.

use meltpath_geometry::math::DVec2;
use serde::{Deserialize, Serialize};

use super::head::{HeadBlock, HeadSink};
use super::job::{ScanJob, VectorKind};
use super::plate::SquarePlate;

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
        }
    }

    /// The share of cells reached.
    pub fn rate(&self) -> f64 {
        self.reached.iter().filter(|r| **r).count() as f64 / self.reached.len() as f64
    }

    /// Number of cells and number reached.
    pub fn counts(&self) -> (u64, u64) {
        (
            self.reached.len() as u64,
            self.reached.iter().filter(|r| **r).count() as u64,
        )
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
                if super::contour_error::distance_to_segment(centre, a, b) <= radius {
                    self.reached[j * self.columns + i] = true;
                }
            }
        }
    }
}

/// Fill rates of a plate's squares while a run streams; only light commanded for fills counts. One square is held at a time.
#[derive(Debug)]
pub struct FillRate<'a> {
    job: &'a ScanJob,
    plate: &'a SquarePlate,
    /// Diameter of the spot and side of the cells, mm.
    spot: f64,
    modes: Vec<FillMode>,
    square: u32,
    cells: Vec<Cells>,
    last: Option<DVec2>,
    /// For each finished square, the rate in each mode.
    rates: Vec<Vec<f64>>,
}

impl<'a> FillRate<'a> {
    /// For the squares of `plate` marked by `job` with a spot of diameter `spot` mm.
    pub fn new(job: &'a ScanJob, plate: &'a SquarePlate, spot: f64, modes: &[FillMode]) -> Self {
        let mut rate = FillRate {
            job,
            plate,
            spot,
            modes: modes.to_vec(),
            square: 0,
            cells: Vec::new(),
            last: None,
            rates: Vec::new(),
        };
        rate.enter(0);
        rate
    }

    fn enter(&mut self, square: u32) {
        let (low, high) = self.plate.fill_area(square);
        self.square = square;
        self.cells = vec![Cells::new(low, high, self.spot); self.modes.len()];
        self.last = None;
    }

    /// For each square, in order, its rate in each mode.
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
            if v.block != self.square {
                let rates = self.cells.iter().map(Cells::rate).collect();
                self.rates.push(rates);
                self.enter(v.block);
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
