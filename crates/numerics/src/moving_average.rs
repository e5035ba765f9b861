//! Moving averages of numbers and vectors, without drift.

use std::ops::{Add, AddAssign, Mul};

/// What can be averaged: numbers and vectors.
pub trait Average:
    Copy + Default + Add<Output = Self> + AddAssign + Mul<f64, Output = Self>
{
}

impl<T: Copy + Default + Add<Output = T> + AddAssign + Mul<f64, Output = T>> Average for T {}

/// The mean of the last `n` values.
///
/// A running sum that adds the new value and takes the old one away collects rounding for ever. Here the window is the tail
/// of one block of `n` values plus the head of the next, both summed afresh (after van Herk 1992): two additions a value,
/// and an error bounded by one window's rounding however long the stream.
#[derive(Debug, Clone)]
pub struct MovingAverage<T> {
    /// Before `at`: the values of this block; from `at` on: sums of the previous block's tails.
    window: Vec<T>,
    head: T,
    at: usize,
    inverse: f64,
}

impl<T: Average> MovingAverage<T> {
    /// The average over `n >= 1` values, all `value` so far.
    pub fn new(n: usize, value: T) -> Self {
        let mut average = MovingAverage {
            window: vec![value; n],
            head: T::default(),
            at: 0,
            inverse: 1.0 / n as f64,
        };
        average.close_block();
        average
    }

    /// Turns the full block into sums of its tails.
    fn close_block(&mut self) {
        let mut tail = T::default();
        for v in self.window.iter_mut().rev() {
            tail += *v;
            *v = tail;
        }
        self.head = T::default();
        self.at = 0;
    }

    /// Takes the next value and gives the mean of the last `n`.
    #[inline]
    pub fn push(&mut self, value: T) -> T {
        self.head += value;
        self.window[self.at] = value;
        self.at += 1;
        if let Some(&tail) = self.window.get(self.at) {
            (tail + self.head) * self.inverse
        } else {
            let mean = self.head * self.inverse;
            self.close_block();
            mean
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn equals_the_plain_mean(n in 1_usize..40, values in proptest::collection::vec(-1e3..1e3, 1..200)) {
            let start = Complex64::new(7.0, 7.0);
            let mut average = MovingAverage::new(n, start);
            let mut all = vec![start; n];
            for v in values {
                let v = Complex64::new(v, -2.0 * v);
                all.push(v);
                let plain = all[all.len() - n..].iter().sum::<Complex64>() / n as f64;
                prop_assert!((average.push(v) - plain).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn does_not_drift() {
        let mut average = MovingAverage::new(66, 0.0);
        for i in 0..2_000_000 {
            average.push((f64::from(i) * 0.7).sin() * 1e3);
        }
        for _ in 0..66 {
            average.push(123.456);
        }
        assert!((average.push(123.456) - 123.456).abs() < 1e-11);
    }
}
