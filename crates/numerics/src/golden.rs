//! The least value of a function of one number, by golden section.

/// Where a function with one minimum between two ends is least, and its value there: the interval shrinks to 0.618 of itself `times` times.
/// Of several minima one is found.
///
/// ```
/// let [x, least] = meltpath_numerics::golden::least([0.0, 4.0], 60, |x| (x - 1.5) * (x - 1.5) + 2.0);
/// assert!((x - 1.5).abs() < 1e-7 && (least - 2.0).abs() < 1e-12);
/// ```
pub fn least([mut low, mut high]: [f64; 2], times: u32, mut f: impl FnMut(f64) -> f64) -> [f64; 2] {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let [mut a, mut b] = [high - RATIO * (high - low), low + RATIO * (high - low)];
    let [mut at_a, mut at_b] = [f(a), f(b)];
    for _ in 0..times {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - RATIO * (high - low);
            at_a = f(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + RATIO * (high - low);
            at_b = f(b);
        }
    }
    let middle = 0.5 * (low + high);
    [middle, f(middle)]
}
