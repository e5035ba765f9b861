//! What is lost of a fill whose lines stray to either side.

/// The share of a surface that lines lose by straying, each by `sigma` mm (one standard deviation, on its own): lines `hatch` mm apart leave
/// max(0, p − w + d) bare between each other, for a spot w = `spot` mm wide and d normal with √2 σ, in the mean more than max(0, p − w). Lines
/// so close that others cover the gap between two of them lose less.
///
/// ```
/// use meltpath_scan_head::measures::strays::lost_by_straying;
/// // lines 70 µm apart, a spot of 80 µm, strays of 30 µm: an eighth to a fifth of the surface, where no strays lose nothing
/// let lost = lost_by_straying(0.03, 0.07, 0.08);
/// assert!((lost - 0.177).abs() < 1e-3, "{lost}");
/// assert_eq!(lost_by_straying(0.0, 0.07, 0.08), 0.0);
/// ```
pub fn lost_by_straying(sigma: f64, hatch: f64, spot: f64) -> f64 {
    let apart = std::f64::consts::SQRT_2 * sigma;
    if apart <= 0.0 || hatch <= 0.0 {
        return 0.0;
    }
    let gap = hatch - spot;
    let z = gap / apart;
    let below = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let bare = gap * below + apart * density;
    ((bare - gap.max(0.0)) / hatch).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    /// The mean of gaps that are drawn is that of the law.
    #[test]
    fn the_law_is_the_mean_of_gaps_that_are_drawn() {
        let mut random = Random::new(7);
        for (sigma, hatch, spot) in [(0.03, 0.07, 0.08), (0.01, 0.1, 0.08), (0.05, 0.08, 0.08)] {
            let draws = 200_000;
            let mut bare = 0.0;
            for _ in 0..draws {
                let [a, b] = [random.normal(), random.normal()].map(|x| sigma * x);
                bare += (hatch - spot + a - b).max(0.0);
            }
            let lost = (bare / f64::from(draws) - f64::max(0.0, hatch - spot)) / hatch;
            let law = lost_by_straying(sigma, hatch, spot);
            assert!((lost - law).abs() < 3e-3, "{sigma} {hatch}: {lost} {law}");
        }
    }
}
