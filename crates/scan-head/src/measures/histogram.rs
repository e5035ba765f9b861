//! Counts of values in bins of equal width, with shares and quantiles.

/// A histogram of not negative values in equal bins; the last bin holds what lies beyond.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Width of a bin.
    pub bin: f64,
    /// Counts.
    pub counts: Vec<u64>,
    /// Largest value.
    pub largest: f64,
    /// Sum of all values.
    pub sum: f64,
}

impl Histogram {
    /// Of `bins` bins of width `bin`.
    pub fn new(bin: f64, bins: usize) -> Self {
        Histogram {
            bin,
            counts: vec![0; bins.max(1)],
            largest: 0.0,
            sum: 0.0,
        }
    }

    /// Adds a value.
    #[inline]
    pub fn add(&mut self, value: f64) {
        self.add_many(value, 1);
    }

    /// Adds a value `count` times.
    #[inline]
    pub fn add_many(&mut self, value: f64, count: u64) {
        let at = ((value / self.bin) as usize).min(self.counts.len() - 1);
        self.counts[at] += count;
        self.largest = self.largest.max(value);
        self.sum += count as f64 * value;
    }

    /// Number of values.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Mean of the values; 0 without any.
    pub fn mean(&self) -> f64 {
        self.sum / self.total().max(1) as f64
    }

    /// The share of values below `value`, to the bin below; 1 without any.
    pub fn share_below(&self, value: f64) -> f64 {
        let bins = ((value / self.bin + 1e-9) as usize).min(self.counts.len());
        let total = self.total();
        if total == 0 {
            return 1.0;
        }
        self.counts[..bins].iter().sum::<u64>() as f64 / total as f64
    }

    /// The share of values within `value` of zero where each strays besides by `sigma`, normally distributed, one standard deviation; 1
    /// without any.
    pub fn share_with_strays(&self, value: f64, sigma: f64) -> f64 {
        let total = self.total();
        if total == 0 {
            return 1.0;
        }
        let below = |x: f64| 0.5 * libm::erfc(-x / sigma * std::f64::consts::FRAC_1_SQRT_2);
        let of = |(k, count): (usize, &u64)| {
            let middle = self.bin * (k as f64 + 0.5);
            *count as f64 * (below(value - middle) - below(-value - middle))
        };
        self.counts.iter().enumerate().map(of).sum::<f64>() / total as f64
    }

    /// The value below which the share `q` of values lies, linear within the bin.
    pub fn quantile(&self, q: f64) -> f64 {
        let goal = q * self.total() as f64;
        let mut before = 0.0;
        for (k, &count) in self.counts.iter().enumerate() {
            let after = before + count as f64;
            if after >= goal && count > 0 {
                let inside = (goal - before) / count as f64;
                return (self.bin * (k as f64 + inside)).min(self.largest);
            }
            before = after;
        }
        self.largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values at zero that stray by 20 µm: the normal law's 86.6 % lie within 30 µm, 98.8 % within 50; nothing is left where strays are
    /// far greater, and all where they are small.
    #[test]
    fn strays_take_values_out_of_their_bound() {
        let mut all = Histogram::new(1e-6, 2000);
        all.add_many(0.0, 1000);
        for (bound, sigma, share) in [
            (0.03, 0.02, 0.8664),
            (0.05, 0.02, 0.9876),
            (0.03, 5.0, 0.0048),
            (0.03, 0.001, 1.0),
        ] {
            let found = all.share_with_strays(bound, sigma);
            assert!((found - share).abs() < 1e-4, "{bound} {sigma}: {found}");
        }
    }
}
