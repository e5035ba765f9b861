//! The profile of a cross-section: heights at even steps, from one edge of the beads to the other.

use meltpath_numerics::golden;
use serde::{Deserialize, Serialize};

/// Heights over the plate at even steps across the beads, linear between them; mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Abscissa of the first height.
    pub start: f64,
    /// Distance between heights.
    pub step: f64,
    /// The heights.
    pub z: Vec<f64>,
}

impl Profile {
    /// A flat profile at height 0 from `start` to `end`, with steps of about `step`.
    pub(super) fn flat(start: f64, end: f64, step: f64) -> Self {
        let pieces = ((end - start) / step).ceil().max(1.0);
        Profile {
            start,
            step: (end - start) / pieces,
            z: vec![0.0; pieces as usize + 1],
        }
    }

    /// Abscissa of height number `i`, mm.
    pub fn x(&self, i: usize) -> f64 {
        self.start + self.step * i as f64
    }

    /// Height at `x`, mm; that of the nearer end outside.
    pub fn height(&self, x: f64) -> f64 {
        let g = ((x - self.start) / self.step).clamp(0.0, (self.z.len() - 1) as f64);
        let i = (g as usize).min(self.z.len() - 2);
        let t = g - i as f64;
        self.z[i] * (1.0 - t) + self.z[i + 1] * t
    }

    /// The height nearest to `x`.
    pub(super) fn index(&self, x: f64) -> usize {
        let g = ((x - self.start) / self.step).round();
        g.clamp(0.0, (self.z.len() - 1) as f64) as usize
    }

    /// Area over the plate, mm² (trapezia).
    pub fn area(&self) -> f64 {
        self.area_between(0, self.z.len() - 1)
    }

    pub(super) fn area_between(&self, first: usize, last: usize) -> f64 {
        if first >= last {
            return 0.0;
        }
        let inner: f64 = self.z[first..=last].iter().sum();
        self.step * (inner - 0.5 * (self.z[first] + self.z[last]))
    }

    fn within(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> + Clone {
        (self.index(from)..=self.index(to)).map(|i| (self.x(i), self.z[i]))
    }

    /// Least distance of two parallel lines of any slope around the profile between two abscissae, mm.
    ///
    /// The span of heights is a convex function of the slope of the lines: a golden-section search finds its least value.
    pub fn flatness(&self, from: f64, to: f64) -> f64 {
        let distance = |slope: f64| span(self.within(from, to), slope) / slope.hypot(1.0);
        let [_, least] = golden::least([-1.0, 1.0], 60, distance);
        least
    }
}

fn span(points: impl Iterator<Item = (f64, f64)> + Clone, slope: f64) -> f64 {
    let z = points.map(|(x, z)| z - slope * x);
    z.clone().fold(f64::MIN, f64::max) - z.fold(f64::MAX, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_line_is_flat_and_not_parallel() {
        let mut p = Profile::flat(-5.0, 5.0, 0.01);
        for i in 0..p.z.len() {
            p.z[i] = 0.1 * p.x(i) + 2.0;
        }
        assert!(p.flatness(-4.0, 4.0) < 1e-6);
        assert!((p.area() - 20.0).abs() < 1e-9);
        assert!((p.height(1.234) - 2.1234).abs() < 1e-12);
        assert_eq!(p.height(99.0), p.z[p.z.len() - 1]);
    }
}
