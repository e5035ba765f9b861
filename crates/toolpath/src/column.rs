//! A column of numbers that may be left unsaid.

use std::ops::Range;

/// Numbers by index, some of them unsaid; what lies behind the last one said takes no room.
#[derive(Debug, Clone, Default)]
pub(crate) struct Column(Vec<f64>);

impl Column {
    /// A column from its numbers, NaN for those unsaid.
    pub(crate) fn from_values(mut values: Vec<f64>) -> Self {
        while values.last().is_some_and(|v| v.is_nan()) {
            values.pop();
        }
        Column(values)
    }

    /// The numbers up to the last one said, NaN for those unsaid.
    pub(crate) fn values(&self) -> &[f64] {
        &self.0
    }

    pub(crate) fn get(&self, i: usize) -> Option<f64> {
        self.0.get(i).copied().filter(|v| !v.is_nan())
    }

    /// Says number `i`.
    pub(crate) fn set(&mut self, i: usize, value: f64) {
        if let Some(place) = self.0.get_mut(i) {
            *place = value;
        } else if !value.is_nan() {
            self.0.resize(i, f64::NAN);
            self.0.push(value);
        }
    }

    /// Whether any number of a range is said.
    pub(crate) fn any(&self, range: Range<usize>) -> bool {
        let end = range.end.min(self.0.len());
        self.0
            .get(range.start..end)
            .is_some_and(|values| values.iter().any(|v| !v.is_nan()))
    }

    #[cfg(test)]
    pub(crate) fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<f64>()
    }

    pub(crate) fn shrink_to_fit(&mut self) {
        self.0.shrink_to_fit();
    }
}

impl PartialEq for Column {
    /// Equal to the bit; unsaid numbers are equal.
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        self.0.len() == other.0.len() && self.0.iter().zip(&other.0).all(same)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_equal_where_they_say_the_same() {
        let column = |values: &[f64]| Column::from_values(values.to_vec());
        assert_eq!(column(&[1.0, f64::NAN, 2.0]), column(&[1.0, f64::NAN, 2.0]));
        assert_eq!(column(&[1.0, f64::NAN]), column(&[1.0]));
        for other in [&[1.0, 2.0][..], &[f64::NAN], &[1.0, 1.0], &[]] {
            assert_ne!(column(&[1.0]), column(other));
        }
        assert_ne!(column(&[1.0]), column(&[1.5]));
    }
}
