//! Shares of a Gaussian beam in rows of cells, from a table: they are asked for many times a millimetre.

use super::tile::N;

/// The integral of a Gaussian in a table.
#[derive(Debug, Clone)]
pub(crate) struct Bell {
    below: Vec<f64>,
}

impl Bell {
    /// How far it is tabled, in radii of 1/e².
    const REACH: f64 = 4.0;
    const ENTRIES: usize = 8192;

    pub(crate) fn new() -> Self {
        let at = |n: usize| Self::REACH * (2.0 * n as f64 / Self::ENTRIES as f64 - 1.0);
        let below = |n: usize| 0.5 * (1.0 + libm::erf(std::f64::consts::SQRT_2 * at(n)));
        Bell {
            below: (0..=Self::ENTRIES).map(below).collect(),
        }
    }

    /// Share of the power on this side of `x` radii from the middle; straight between entries, off by less than 2e-7.
    fn below(&self, x: f64) -> f64 {
        let place = (x / Self::REACH + 1.0) * (0.5 * Self::ENTRIES as f64);
        let place = place.clamp(0.0, Self::ENTRIES as f64 - 1e-6);
        let n = place as usize;
        self.below[n] + (place - n as f64) * (self.below[n + 1] - self.below[n])
    }

    /// Shares in a row of cells of `edge` mm whose lower end lies `low` mm from the middle.
    pub(crate) fn shares(&self, low: f64, edge: f64, diameter: f64) -> [f64; N] {
        let mut out = [0.0; N];
        let mut left = self.below(2.0 * low / diameter);
        for (i, share) in out.iter_mut().enumerate() {
            let right = self.below(2.0 * (low + (i + 1) as f64 * edge) / diameter);
            *share = right - left;
            left = right;
        }
        out
    }
}
