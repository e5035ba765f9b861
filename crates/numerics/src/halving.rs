//! Where an answer changes, by halving.

/// An interval at whose upper end `beyond` holds and at whose lower end it does not, halved `times` times, or until no number lies
/// between its ends. The same bits as halving by hand with `0.5 * (low + high)`.
///
/// ```
/// let [low, high] = meltpath_numerics::halving::halve([0.0, 2.0], 100, |x| x * x > 2.0);
/// assert!(low * low <= 2.0 && high * high > 2.0 && high - low < 1e-15);
/// ```
pub fn halve(
    [mut low, mut high]: [f64; 2],
    times: u32,
    mut beyond: impl FnMut(f64) -> bool,
) -> [f64; 2] {
    for _ in 0..times {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if beyond(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    [low, high]
}

/// The middle of what [`halve`] leaves.
pub fn root(within: [f64; 2], times: u32, beyond: impl FnMut(f64) -> bool) -> f64 {
    let [low, high] = halve(within, times, beyond);
    0.5 * (low + high)
}
