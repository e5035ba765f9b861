//! Charts made ready for a simulation: rates of change of enthalpy in one table per share of powder and plane of voxels,
//! and cooling curves for any length of time.
//!
//! Rules: Béraud 2016, section 3.2.3.2, with the corrections of docs/theory/sources.md, charts.

use crate::charts::{ChartSet, CoolingCurve, HeatingCurve};

/// What a voxel does that is hotter than the end of a heating curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PastTheEnd {
    /// It cools as its depth does after the beam went off: what happens to metal that a moving beam leaves behind.
    #[default]
    Cools,
    /// It takes the last value of the curve, as the thesis' text reads: temperatures then fall at once under the rim of
    /// a passing beam. Kept to show its effect.
    LastValue,
}

/// Entries of the rate tables along enthalpy.
const ENTRIES: usize = 768;
/// How far beyond the charts' hottest enthalpy the tables go.
const MARGIN: f64 = 1.1;

/// Rates and cooling of one chart set on the planes of voxels.
#[derive(Debug, Clone)]
pub(crate) struct Rates {
    /// Distances per table row.
    distances: usize,
    per_distance: f32,
    per_entry: f32,
    planes: usize,
    /// J/(mm³·s), `[ground][share][plane][enthalpy][distance]`.
    table: Vec<f32>,
    shares: Vec<f64>,
    /// Enthalpies of the grounds, the cold one first, J/mm³.
    grounds: Vec<f32>,
    /// `[ground][share][plane]`.
    cooling: Vec<Fall>,
    /// Radius of the heated zone, mm.
    pub(crate) radius: f64,
}

/// Where between the shares of the charts a column lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Between {
    low: u16,
    high: u16,
    weight: f32,
}

/// Where between the grounds of the charts a voxel lies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Warmth {
    low: usize,
    weight: f32,
}

/// Where between the distances of the charts a column lies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ring {
    index: usize,
    weight: f32,
}

impl Rates {
    /// Tables for planes of voxels whose centres lie at `depths` mm, for steps of `dt` s.
    pub(crate) fn new(set: &ChartSet, depths: &[f64], past: PastTheEnd, dt: f64) -> Self {
        let charts = || {
            let warm = set.warm.iter().flat_map(|w| &w.charts);
            set.charts.iter().chain(warm)
        };
        let hottest = charts()
            .flat_map(|c| c.heating.iter().map(|h| h.end))
            .fold(0.0_f32, f32::max);
        let step = MARGIN * f64::from(hottest) / (ENTRIES - 1) as f64;
        let (n, spacing) = (set.distances.len(), set.distances[1] - set.distances[0]);
        let mut table = Vec::with_capacity(charts().count() * depths.len() * ENTRIES * n);
        let mut cooling = Vec::new();
        for chart in charts() {
            for &depth in depths {
                let (h, w) = place(&set.depths, depth);
                for entry in 0..ENTRIES {
                    let g = entry as f64 * step;
                    for r in 0..n {
                        let at = |h: usize| {
                            let curve = set.heating(chart, h, r);
                            rate(curve, &chart.cooling[h], g, step, past, dt)
                        };
                        table.push(((1.0 - w) * at(h) + w * at(h + 1)) as f32);
                    }
                }
                cooling.push(Fall::new(&chart.cooling[h], &chart.cooling[h + 1], w, step));
            }
        }
        Rates {
            distances: n,
            per_distance: (1.0 / spacing) as f32,
            per_entry: (1.0 / step) as f32,
            planes: depths.len(),
            table,
            shares: set.charts.iter().map(|c| c.powder_share).collect(),
            grounds: std::iter::once(0.0)
                .chain(set.warm.iter().map(|w| w.enthalpy as f32))
                .collect(),
            cooling,
            radius: set.settings.radius,
        }
    }

    /// Where a share of powder lies between the charts'.
    pub(crate) fn between(&self, share: f64) -> Between {
        let last = self.shares.len() - 1;
        let high = self.shares.partition_point(|s| *s < share).min(last);
        let low = if self.shares[high] > share {
            high.saturating_sub(1)
        } else {
            high
        };
        let width = self.shares[high] - self.shares[low];
        // a set has a handful of shares
        let short = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        Between {
            low: short(low),
            high: short(high),
            weight: if width > 0.0 {
                ((share - self.shares[low]) / width) as f32
            } else {
                0.0
            },
        }
    }

    /// Where a distance lies between the charts'.
    #[inline]
    pub(crate) fn ring(&self, distance: f32) -> Ring {
        let x = distance * self.per_distance;
        let index = (x as usize).min(self.distances - 2);
        Ring {
            index,
            weight: x - index as f32,
        }
    }

    /// Where ground of an enthalpy (J/mm³) lies between the charts'; as the warmest beyond it.
    #[inline]
    pub(crate) fn warmth(&self, ground: f32) -> Warmth {
        let last = self.grounds.len() - 1;
        if ground <= 0.0 || last == 0 {
            return Warmth::default();
        }
        let low = self.grounds[1..last].partition_point(|g| *g <= ground);
        let (from, to) = (self.grounds[low], self.grounds[low + 1]);
        Warmth {
            low,
            weight: ((ground - from) / (to - from)).min(1.0),
        }
    }

    /// Rate of change of enthalpy `g` above the ground in a plane, J/(mm³·s).
    #[inline]
    pub(crate) fn heating(
        &self,
        between: Between,
        warmth: Warmth,
        plane: usize,
        ring: Ring,
        g: f32,
    ) -> f32 {
        let on = |ground: usize| {
            let table = ground * self.shares.len();
            let first = self.one(table + usize::from(between.low), plane, ring, g);
            if between.weight == 0.0 {
                first
            } else {
                let second = self.one(table + usize::from(between.high), plane, ring, g);
                first + between.weight * (second - first)
            }
        };
        let cold = on(warmth.low);
        if warmth.weight == 0.0 {
            cold
        } else {
            cold + warmth.weight * (on(warmth.low + 1) - cold)
        }
    }

    #[inline]
    fn one(&self, share: usize, plane: usize, ring: Ring, g: f32) -> f32 {
        let x = (g * self.per_entry).clamp(0.0, (ENTRIES - 1) as f32);
        let entry = (x as usize).min(ENTRIES - 2);
        let w = x - entry as f32;
        let start = ((share * self.planes + plane) * ENTRIES + entry) * self.distances + ring.index;
        let row = &self.table[start..start + self.distances + 2];
        let near = row[0] + ring.weight * (row[1] - row[0]);
        let (a, b) = (row[self.distances], row[self.distances + 1]);
        let far = a + ring.weight * (b - a);
        near + w * (far - near)
    }

    /// Enthalpy above the ground after `time` s without a beam.
    pub(crate) fn cooled(
        &self,
        between: Between,
        warmth: Warmth,
        plane: usize,
        g: f32,
        time: f64,
    ) -> f32 {
        let after = |fall: &Fall| fall.after(f64::from(g), time);
        self.mixed(between, warmth, plane, after) as f32
    }

    /// Time in which `g` above the ground cools to `to`, s.
    pub(crate) fn time_to(
        &self,
        between: Between,
        warmth: Warmth,
        plane: usize,
        g: f32,
        to: f32,
    ) -> f64 {
        let passed = |fall: &Fall| fall.age(f64::from(to)) - fall.age(f64::from(g));
        self.mixed(between, warmth, plane, passed)
    }

    /// A value of the cooling curves between shares of powder and grounds.
    fn mixed(
        &self,
        between: Between,
        warmth: Warmth,
        plane: usize,
        value: impl Fn(&Fall) -> f64,
    ) -> f64 {
        let on = |ground: usize| {
            let at = |share: usize| {
                value(&self.cooling[(ground * self.shares.len() + share) * self.planes + plane])
            };
            let low = at(between.low.into());
            if between.weight == 0.0 {
                low
            } else {
                low + f64::from(between.weight) * (at(between.high.into()) - low)
            }
        };
        let cold = on(warmth.low);
        if warmth.weight == 0.0 {
            cold
        } else {
            cold + f64::from(warmth.weight) * (on(warmth.low + 1) - cold)
        }
    }
}

/// The grid points round `x`: the lower one and the weight of the upper one; constant beyond the ends.
fn place(grid: &[f64], x: f64) -> (usize, f64) {
    let spacing = grid[1] - grid[0];
    let at = ((x - grid[0]) / spacing).clamp(0.0, (grid.len() - 1) as f64);
    let index = (at as usize).min(grid.len() - 2);
    (index, at - index as f64)
}

/// Rate of one curve at `g`, averaged over an entry of the table so that the time to pass it is right.
fn rate(
    heating: &HeatingCurve,
    cooling: &CoolingCurve,
    g: f64,
    step: f64,
    past: PastTheEnd,
    dt: f64,
) -> f64 {
    let end = f64::from(heating.end);
    if g < end {
        let (low, high) = ((g - 0.5 * step).max(0.0), (g + 0.5 * step).min(end));
        let time = heating.time(high) - heating.time(low);
        if time > 0.0 { (high - low) / time } else { 0.0 }
    } else {
        match past {
            PastTheEnd::Cools => -cooling.rate(g),
            PastTheEnd::LastValue => (end - g) / dt,
        }
    }
}

/// How enthalpy falls with time: ages at evenly spaced enthalpies, from the highest down; exponential beyond both ends.
#[derive(Debug, Clone)]
struct Fall {
    top: f64,
    step: f64,
    /// Age at `top − i·step`, s.
    ages: Vec<f64>,
    /// Relative rates beyond the ends, 1/s.
    ends: [f64; 2],
}

impl Fall {
    fn new(a: &CoolingCurve, b: &CoolingCurve, weight: f64, step: f64) -> Self {
        let rate = |g: f64| (1.0 - weight) * a.rate(g) + weight * b.rate(g);
        let top = f64::from(a.from.max(b.from));
        let low = f64::from(a.to.max(b.to)).min(top - 2.0 * step).max(step);
        let entries = (((top - low) / step) as usize).max(1);
        let mut ages = vec![0.0];
        let mut age = 0.0;
        for i in 0..entries {
            // Simpson's rule on the time per enthalpy
            let g = top - i as f64 * step;
            let slow = |g: f64| 1.0 / rate(g).max(1e-9);
            age += step / 6.0 * (slow(g) + 4.0 * slow(g - 0.5 * step) + slow(g - step));
            ages.push(age);
        }
        let last = top - entries as f64 * step;
        Fall {
            top,
            step,
            ages,
            ends: [rate(top) / top, rate(last) / last],
        }
    }

    fn bottom(&self) -> f64 {
        self.top - (self.ages.len() - 1) as f64 * self.step
    }

    /// Time since `top` was passed, s; negative above it.
    fn age(&self, g: f64) -> f64 {
        let last = self.ages.len() - 1;
        if g >= self.top {
            return (self.top / g).ln() / self.ends[0];
        }
        let bottom = self.bottom();
        if g <= bottom {
            return self.ages[last] + (bottom / g.max(1e-9)).ln() / self.ends[1];
        }
        let x = (self.top - g) / self.step;
        let i = (x as usize).min(last - 1);
        self.ages[i] + (x - i as f64) * (self.ages[i + 1] - self.ages[i])
    }

    /// Enthalpy after `time` s.
    fn after(&self, g: f64, time: f64) -> f64 {
        if g <= 0.0 {
            return g;
        }
        let age = self.age(g) + time;
        let last = self.ages.len() - 1;
        if age <= 0.0 {
            return self.top * (-self.ends[0] * age).exp();
        }
        if age >= self.ages[last] {
            return self.bottom() * (-self.ends[1] * (age - self.ages[last])).exp();
        }
        let i = self.ages.partition_point(|a| *a <= age) - 1;
        let share = (age - self.ages[i]) / (self.ages[i + 1] - self.ages[i]);
        self.top - (i as f64 + share) * self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::{Chart, ChartSettings};
    use proptest::prelude::*;

    fn curve() -> CoolingCurve {
        // halves every millisecond
        let at = |i: usize| 8.0 - 7.0 * i as f64 / 512.0;
        CoolingCurve {
            from: 8.0,
            to: 1.0,
            times: (0..513)
                .map(|i| (1e-3 * (8.0 / at(i)).log2()) as f32)
                .collect(),
        }
    }

    /// Charts of two shares of powder whose points heat at 100 and 500 J/(mm³·s), and cool a hundred times as slowly.
    fn two_shares() -> ChartSet {
        let chart = |powder_share: f64, rate: f64| {
            let heating = HeatingCurve {
                end: 10.0,
                times: (0..129)
                    .map(|i| (10.0 / rate * f64::from(i) / 128.0) as f32)
                    .collect(),
            };
            let cooling = CoolingCurve {
                from: 8.0,
                to: 1.0,
                times: (0..513)
                    .map(|i| (700.0 / rate * f64::from(i) / 512.0) as f32)
                    .collect(),
            };
            Chart {
                powder_share,
                heating: vec![heating; 4],
                cooling: vec![cooling; 2],
            }
        };
        ChartSet {
            settings: ChartSettings::for_beam(300.0, 0.4),
            material: String::new(),
            fingerprint: 0,
            depths: vec![0.025, 0.075],
            distances: vec![0.0, 0.1],
            charts: vec![chart(0.2, 100.0), chart(0.6, 500.0)],
            warm: Vec::new(),
        }
    }

    #[test]
    fn a_share_of_powder_lies_between_those_of_the_charts() {
        let rates = Rates::new(&two_shares(), &[0.05], PastTheEnd::Cools, 1e-6);
        let cold = Warmth::default();
        // below the first, on it, a quarter and the half of the way, on the second, beyond it
        for (share, rate) in [
            (0.0, 100.0),
            (0.2, 100.0),
            (0.3, 200.0),
            (0.4, 300.0),
            (0.6, 500.0),
            (1.0, 500.0),
        ] {
            let between = rates.between(share);
            let found = rates.heating(between, cold, 0, rates.ring(0.03), 5.0);
            assert!((found / rate - 1.0).abs() < 1e-3, "{share}: {found}");
            // what is left after a millisecond is mixed, not the rates
            let cooled = rates.cooled(between, cold, 0, 5.0, 1e-3);
            let wanted = 5.0 - 1e-5 * rate;
            assert!((cooled - wanted).abs() < 1e-4, "{share}: {cooled} {wanted}");
        }
    }

    proptest! {
        #[test]
        fn cooling_twice_is_cooling_once(g in 0.1..12.0_f64, a in 0.0..5e-3_f64, b in 0.0..5e-3_f64) {
            let fall = Fall::new(&curve(), &curve(), 0.3, 0.01);
            let once = fall.after(g, a + b);
            let twice = fall.after(fall.after(g, a), b);
            prop_assert!((once - twice).abs() < 1e-9 * g);
            prop_assert!((once / (g * 0.5_f64.powf(1e3 * (a + b))) - 1.0).abs() < 0.02);
        }
    }
}
