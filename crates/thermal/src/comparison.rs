//! Two tellings of one temperature field, sample by sample: how far apart, where, when and how hot.

use std::collections::BTreeMap;

use crate::grid::{Field, Grid};

/// What a field says somewhere at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Where, mm.
    pub place: [f64; 3],
    /// When, s.
    pub time: f64,
    /// Temperature, K; or s where times are compared.
    pub value: f64,
}

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
/// use meltpath_thermal::comparison::{Pair, Sample, apart};
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

/// Value of a field between the centres of its cells, straight along each axis; beyond the outer centres theirs. `None`
/// outside the grid.
pub fn between(field: &Field, place: [f64; 3]) -> Option<f64> {
    let corners = around(&field.grid, place)?;
    Some(
        corners
            .iter()
            .map(|&([i, j, k], weight)| weight * field.at(i, j, k))
            .sum(),
    )
}

/// Value of the cell in which a place lies. `None` outside the grid.
pub fn nearest(field: &Field, place: [f64; 3]) -> Option<f64> {
    let cells = around(&field.grid, place)?;
    let nearest = cells.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let [i, j, k] = nearest.0;
    Some(field.at(i, j, k))
}

/// The cells round a place and their weights.
pub fn around(grid: &Grid, place: [f64; 3]) -> Option<Vec<([usize; 3], f64)>> {
    let axis = |at: f64, origin: f64, edge: f64, cells: usize| -> Option<[(usize, f64); 2]> {
        let x = (at - origin) / edge;
        if !(x > -1e-9 && x < cells as f64 + 1e-9) {
            return None;
        }
        let x = (x - 0.5).clamp(0.0, (cells - 1) as f64);
        let low = (x as usize).min(cells.saturating_sub(2));
        let share = x - low as f64;
        Some([(low, 1.0 - share), ((low + 1).min(cells - 1), share)])
    };
    let x = axis(place[0], grid.origin.x, grid.edge[0], grid.cells[0])?;
    let y = axis(place[1], grid.origin.y, grid.edge[1], grid.cells[1])?;
    let z = along_planes(grid, place[2])?;
    let mut out = Vec::with_capacity(8);
    for (k, c) in z {
        for (j, b) in y {
            for (i, a) in x {
                if a * b * c > 0.0 {
                    out.push(([i, j, k], a * b * c));
                }
            }
        }
    }
    Some(out)
}

/// The same along the planes, whose heights may differ.
fn along_planes(grid: &Grid, z: f64) -> Option<[(usize, f64); 2]> {
    let top = grid.top();
    if !(z > grid.origin.z - 1e-9 && z < top + 1e-9) {
        return None;
    }
    let mut centres = Vec::with_capacity(grid.planes());
    let mut floor = grid.origin.z;
    for h in &grid.heights {
        centres.push(floor + 0.5 * h);
        floor += h;
    }
    let last = centres.len() - 1;
    let above = centres.partition_point(|c| *c <= z);
    if above == 0 {
        return Some([(0, 1.0), (0, 0.0)]);
    }
    if above > last {
        return Some([(last, 1.0), (last, 0.0)]);
    }
    let share = (z - centres[above - 1]) / (centres[above] - centres[above - 1]);
    Some([(above - 1, 1.0 - share), (above, share)])
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

    /// Value at a place and time.
    ///
    /// # Errors
    /// [`Missing`]: no place near enough, or a time outside its samples.
    pub fn at(&self, place: [f64; 3], time: f64) -> Result<f64, Missing> {
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
        let (_, h) = best.ok_or(Missing::Place)?;
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
            return Ok(s[1]);
        }
        match (after.checked_sub(1), history.get(after)) {
            (Some(before), Some(next)) => {
                let b = history[before];
                let share = (time - b[0]) / (next[0] - b[0]);
                Ok(b[1] + share * (next[1] - b[1]))
            }
            _ => Err(Missing::Time),
        }
    }
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
    use meltpath_geometry::math::DVec3;
    use proptest::prelude::*;

    fn sample(place: [f64; 3], time: f64, kelvin: f64) -> Sample {
        Sample {
            place,
            time,
            value: kelvin,
        }
    }

    proptest! {
        #[test]
        fn a_straight_field_is_met_between_its_cells(p in (0.05..0.95_f64, 0.05..0.75_f64, -0.45..-0.05_f64)) {
            let grid = Grid::covering(DVec3::new(0.0, 0.0, -0.5), DVec3::new(1.0, 0.8, 0.0), DVec3::new(0.1, 0.1, 0.1)).unwrap();
            let [nx, ny] = grid.cells;
            let of = |c: DVec3| 1000.0 + 300.0 * c.x - 200.0 * c.y + 500.0 * c.z;
            let values = (0..grid.len()).map(|n| of(grid.centre(n % nx, n / nx % ny, n / (nx * ny))) as f32).collect();
            let field = Field { grid, values };
            let found = between(&field, [p.0, p.1, p.2]).unwrap();
            prop_assert!((found - of(DVec3::new(p.0, p.1, p.2))).abs() < 1e-2, "{}", found);
        }

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
    fn outside_is_not_invented() {
        let grid = Grid::covering(
            DVec3::new(0.0, 0.0, -0.1),
            DVec3::new(0.2, 0.2, 0.0),
            DVec3::splat(0.1),
        )
        .unwrap();
        let field = Field {
            values: vec![300.0; grid.len()],
            grid,
        };
        assert_eq!(between(&field, [0.1, 0.1, 0.01]), None);
        assert_eq!(between(&field, [-0.01, 0.1, -0.05]), None);
        assert!(between(&field, [0.2, 0.2, 0.0]).is_some());
    }

    #[test]
    fn a_table_is_read_between_its_times_and_near_its_places() {
        let samples = [
            sample([0.0, 0.0, 0.0], 0.0, 1000.0),
            sample([0.0, 0.0, 0.0], 1e-3, 2000.0),
            sample([1.0, 0.0, 0.0], 0.0, 500.0),
        ];
        let places = Places::new(&samples, 0.05);
        assert!((places.at([0.03, 0.0, 0.0], 2.5e-4).unwrap() - 1250.0).abs() < 1e-9);
        assert_eq!(places.at([0.0, 0.06, 0.0], 0.0), Err(Missing::Place));
        assert_eq!(places.at([0.0, 0.0, 0.0], 2e-3), Err(Missing::Time));
        // one sample alone serves its own time
        assert_eq!(places.at([1.0, 0.0, 0.0], 0.0), Ok(500.0));
    }
}
