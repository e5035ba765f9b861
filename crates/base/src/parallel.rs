//! Parallel reductions in fixed chunks: the same bits on 1 and N threads.

use rayon::prelude::*;

/// Length of a chunk; part of the result's bits, so never derived from the thread count.
pub const CHUNK: usize = 4096;

/// Sum of `f` over `items`: chunks of [`CHUNK`] are summed in order, then the chunk sums in order.
///
/// ```
/// let squares = meltpath_base::parallel::sum(&[1.0, 2.0, 3.0], |x| x * x);
/// assert_eq!(squares, 14.0);
/// ```
pub fn sum<T: Sync>(items: &[T], f: impl Fn(&T) -> f64 + Sync) -> f64 {
    let partial: Vec<f64> = items
        .par_chunks(CHUNK)
        .map(|chunk| chunk.iter().map(&f).sum())
        .collect();
    partial.iter().sum()
}

#[cfg(test)]
mod tests {
    #[test]
    fn same_bits_on_any_thread_count() {
        let items: Vec<f64> = (0..100_000).map(|i| (f64::from(i) * 0.37).sin()).collect();
        let on = |threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
                .install(|| super::sum(&items, |x| x * 1.1))
        };
        assert_eq!(on(1).to_bits(), on(4).to_bits());
    }
}
