//! Two tellings of one temperature field, sample by sample: how far apart, where, when and how hot.

use std::collections::BTreeMap;

use crate::grid::sample::Sample;

/// A sample and what the other field says there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The sample.
    pub sample: Sample,
    /// What the other field says there, in the same unit.
    pub other: f64,
}

impl Pair {
    /// Sample less other.
    pub fn difference(&self) -> f64 {
        self.sample.value - self.other
    }
}

/// How far apart two fields are, in the unit of the pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Pairs compared.
    pub pairs: usize,
    /// Mean difference.
    pub bias: f64,
    /// Standard deviation of the differences.
    pub deviation: f64,
    /// Mean of the differences without sign.
    pub mean: f64,
    /// Differences without sign that 50, 90, 95 and 99 % of the pairs stay below.
    pub percentiles: [f64; 4],
    /// The pair that is furthest apart.
    pub worst: Pair,
}

/// The shares of [`Apart::percentiles`].
pub const PERCENTILES: [f64; 4] = [0.50, 0.90, 0.95, 0.99];

/// How far apart the pairs are; `None` without any.
///
/// ```
/// use meltpath_thermal::calibration::comparison::{Pair, apart};
/// use meltpath_thermal::grid::sample::Sample;
/// let pair = |kelvin: f64, other: f64| Pair { sample: Sample { place: [0.0; 3], time: 0.0, value: kelvin }, other };
/// let found = apart(&[pair(1000.0, 990.0), pair(1000.0, 1030.0)]).unwrap();
/// assert!((found.bias + 10.0).abs() < 1e-9 && (found.mean - 20.0).abs() < 1e-9);
/// assert_eq!(found.worst.other, 1030.0);
/// ```
pub fn apart(pairs: &[Pair]) -> Option<Apart> {
    let first = pairs.first()?;
    let n = pairs.len() as f64;
    let mean_of = |f: &dyn Fn(&Pair) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let bias = mean_of(&Pair::difference);
    let deviation = mean_of(&|p| (p.difference() - bias).powi(2)).sqrt();
    let mut sizes: Vec<f64> = pairs.iter().map(|p| p.difference().abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let rank = |share: f64| {
        let at = (share * n).ceil() as usize;
        sizes[at.clamp(1, sizes.len()) - 1]
    };
    let worst = pairs.iter().fold(first, |worst, p| {
        if p.difference().abs() > worst.difference().abs() {
            p
        } else {
            worst
        }
    });
    Some(Apart {
        pairs: pairs.len(),
        bias,
        deviation,
        mean: mean_of(&|p| p.difference().abs()),
        percentiles: PERCENTILES.map(rank),
        worst: *worst,
    })
}

/// Mean difference without sign as a share of the sample's temperature in °C (the measure of Béraud 2016, section 3.2.3.3);
/// not a number without pairs.
pub fn relative(pairs: &[Pair]) -> f64 {
    let share = |p: &Pair| {
        let celsius = p.sample.value - crate::material::CELSIUS;
        p.difference().abs() / celsius.abs().max(1.0)
    };
    pairs.iter().map(share).sum::<f64>() / pairs.len() as f64
}

/// A table's samples by place, so that others can be compared with them: the nearest place within a distance, straight between
/// its times.
#[derive(Debug, Clone)]
pub struct Places {
    /// Histories: place, then time and temperature in order of time.
    histories: Vec<([f64; 3], Vec<[f64; 2]>)>,
    /// Histories by box of edge `within`.
    boxes: BTreeMap<[i64; 3], Vec<usize>>,
    within: f64,
}

/// Places nearer than this are one, mm.
const SAME: f64 = 1e-4;

impl Places {
    /// Sorts samples by place; others may be `within` mm of a place.
    pub fn new(samples: &[Sample], within: f64) -> Self {
        let mut by_place: BTreeMap<[i64; 3], Vec<&Sample>> = BTreeMap::new();
        for s in samples {
            let key = s.place.map(|x| (x / SAME).round() as i64);
            by_place.entry(key).or_default().push(s);
        }
        let mut histories = Vec::with_capacity(by_place.len());
        let mut boxes: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
        for group in by_place.into_values() {
            let place = group[0].place;
            let mut history: Vec<[f64; 2]> = group.iter().map(|s| [s.time, s.value]).collect();
            history.sort_by(|a, b| a[0].total_cmp(&b[0]));
            boxes
                .entry(place.map(|x| (x / within).floor() as i64))
                .or_default()
                .push(histories.len());
            histories.push((place, history));
        }
        Places {
            histories,
            boxes,
            within,
        }
    }

    /// Value at a place and time, of the nearest place.
    ///
    /// # Errors
    /// [`Missing`]: no place near enough, or a time outside its samples.
    pub fn at(&self, place: [f64; 3], time: f64) -> Result<There, Missing> {
        let middle = place.map(|x| (x / self.within).floor() as i64);
        let mut best: Option<(f64, usize)> = None;
        for n in 0..27_i64 {
            let shift = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
            let key: [i64; 3] = std::array::from_fn(|a| middle[a] + shift[a]);
            for &h in self.boxes.get(&key).into_iter().flatten() {
                let there = self.histories[h].0;
                let away = (0..3)
                    .map(|a| (there[a] - place[a]).powi(2))
                    .sum::<f64>()
                    .sqrt();
                if away <= self.within && best.is_none_or(|(d, _)| away < d) {
                    best = Some((away, h));
                }
            }
        }
        let (away, h) = best.ok_or(Missing::Place)?;
        let there = |value| There { value, away };
        let history = &self.histories[h].1;
        let after = history.partition_point(|s| s[0] < time);
        // a time within rounding of a sample is that sample's
        let slack = 1e-9 + 1e-9 * time.abs();
        let near = |s: &[f64; 2]| (s[0] - time).abs() <= slack;
        if let Some(s) = history[after.saturating_sub(1)..]
            .iter()
            .take(2)
            .find(|s| near(s))
        {
            return Ok(there(s[1]));
        }
        match (after.checked_sub(1), history.get(after)) {
            (Some(before), Some(next)) => {
                let b = history[before];
                let share = (time - b[0]) / (next[0] - b[0]);
                Ok(there(b[1] + share * (next[1] - b[1])))
            }
            _ => Err(Missing::Time),
        }
    }
}

/// What a table says near a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct There {
    /// The value.
    pub value: f64,
    /// How far from there it was taken, mm.
    pub away: f64,
}

/// Why a sample has no counterpart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Missing {
    /// Nothing near its place.
    Place,
    /// Nothing at its time.
    Time,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample(place: [f64; 3], time: f64, kelvin: f64) -> Sample {
        Sample {
            place,
            time,
            value: kelvin,
        }
    }

    proptest! {
        /// Percentiles against a full sort, bias and deviation against their definition.
        #[test]
        fn figures_are_those_of_their_definitions(d in prop::collection::vec(-300.0..300.0_f64, 1..200)) {
            let pairs: Vec<Pair> = d.iter().map(|d| Pair { sample: sample([0.0; 3], 0.0, 1500.0 + d), other: 1500.0 }).collect();
            let found = apart(&pairs).unwrap();
            for (share, limit) in PERCENTILES.iter().zip(found.percentiles) {
                let below = d.iter().filter(|d| d.abs() <= limit + 1e-9).count() as f64;
                prop_assert!(below >= share * d.len() as f64 - 1e-9);
            }
            let rms = (d.iter().map(|d| d * d).sum::<f64>() / d.len() as f64).sqrt();
            prop_assert!((found.bias.hypot(found.deviation) - rms).abs() < 1e-6);
        }
    }

    #[test]
    fn a_table_is_read_between_its_times_and_near_its_places() {
        let samples = [
            sample([0.0, 0.0, 0.0], 0.0, 1000.0),
            sample([0.0, 0.0, 0.0], 1e-3, 2000.0),
            sample([1.0, 0.0, 0.0], 0.0, 500.0),
        ];
        let places = Places::new(&samples, 0.05);
        let there = places.at([0.03, 0.0, 0.0], 2.5e-4).unwrap();
        assert!((there.value - 1250.0).abs() < 1e-9 && (there.away - 0.03).abs() < 1e-12);
        assert_eq!(places.at([0.0, 0.06, 0.0], 0.0), Err(Missing::Place));
        assert_eq!(places.at([0.0, 0.0, 0.0], 2e-3), Err(Missing::Time));
        // one sample alone serves its own time
        let alone = There {
            value: 500.0,
            away: 0.0,
        };
        assert_eq!(places.at([1.0, 0.0, 0.0], 0.0), Ok(alone));
    }
}
