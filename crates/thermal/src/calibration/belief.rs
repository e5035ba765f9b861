//! What is believed of parameters: exp(−cost/2) over all that they may be, integrated on a grid.
//!
//! Slopes at one place would do where the cost is a bowl. One body for two numbers leaves a curved valley, and a bound cuts it off.

/// Nodes of a grid at most: the more parameters, the fewer along each.
const NODES: f64 = 5_000.0;
/// Nodes along a parameter at most.
const ALONG: f64 = 401.0;
/// Cost above the least from which a place is not believed: e to the −15.
const BEYOND: f64 = 30.0;
/// Grids at most, each over where the one before believes.
const GRIDS: u32 = 16;
/// Share of the nodes that is kept from grid to grid: what is believed may lie between nodes that are not.
const KEPT: f64 = 0.25;
/// Grids about the best node, each over its cell.
const CLOSER: u32 = 8;
/// Nodes of them along a parameter.
const CELL: usize = 9;

/// What is believed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Belief {
    /// Where the cost is least.
    pub(super) best: Vec<f64>,
    /// The least cost.
    pub(super) least: f64,
    /// Means.
    pub(super) mean: Vec<f64>,
    /// Mean products of what lies off the best.
    pub(super) covariance: Vec<Vec<f64>>,
}

impl Belief {
    /// After `cost` within `domain`. Nothing where no cost is finite.
    pub(super) fn of(domain: &[[f64; 2]], cost: &dyn Fn(&[f64]) -> f64) -> Option<Self> {
        let mut grid = Grid::over(domain);
        let mut costs = grid.costs(cost);
        let mut best = grid.best(&costs)?;
        // of this grid: one weight at least is one, however far below the best lies
        let mut own = best.1;
        for _ in 1..GRIDS {
            let Some(narrower) = grid.narrower(&costs, best.1) else {
                break;
            };
            // nothing answers between the nodes of the wider grid: that one stays
            let narrower = Grid::over(&narrower);
            let there = narrower.costs(cost);
            let Some(found) = narrower.best(&there) else {
                break;
            };
            (grid, costs, own) = (narrower, there, found.1);
            if found.1 < best.1 {
                best = found;
            }
        }
        let mut cell = grid.clone();
        for _ in 0..CLOSER {
            let step = cell.steps();
            let about = best.0.iter().zip(&step).zip(domain);
            let about: Vec<[f64; 2]> = about
                .map(|((b, s), d)| [(b - s).max(d[0]), (b + s).min(d[1])])
                .collect();
            cell = Grid {
                domain: about,
                along: CELL,
            };
            let found = cell.best(&cell.costs(cost));
            best = found.filter(|b| b.1 < best.1).unwrap_or(best);
        }
        let (best, least) = best;
        let n = domain.len();
        let (mut all, mut mean) = (0.0, vec![0.0; n]);
        let mut covariance = vec![vec![0.0; n]; n];
        for (k, cost) in costs.iter().enumerate() {
            let weight = grid.share(k) * (-0.5 * (cost - own)).exp();
            if weight > 0.0 {
                let at = grid.at(k);
                all += weight;
                for i in 0..n {
                    mean[i] += weight * at[i];
                    for j in 0..n {
                        covariance[i][j] += weight * (at[i] - best[i]) * (at[j] - best[j]);
                    }
                }
            }
        }
        let over = |x: &mut f64| *x /= all;
        mean.iter_mut().for_each(over);
        covariance.iter_mut().flatten().for_each(over);
        Some(Belief {
            best,
            least,
            mean,
            covariance,
        })
    }

    /// Standard uncertainties of the best.
    pub(super) fn sigmas(&self) -> Vec<f64> {
        let own = self.covariance.iter().enumerate();
        own.map(|(i, row)| row[i].max(0.0).sqrt()).collect()
    }
}

/// Nodes over a box, its faces included.
#[derive(Clone)]
struct Grid {
    domain: Vec<[f64; 2]>,
    /// Nodes along each parameter.
    along: usize,
}

impl Grid {
    fn over(domain: &[[f64; 2]]) -> Self {
        Grid {
            domain: domain.to_vec(),
            along: NODES
                .powf(1.0 / domain.len() as f64)
                .clamp(CELL as f64, ALONG) as usize,
        }
    }

    fn count(&self) -> usize {
        self.along.pow(self.domain.len() as u32)
    }

    /// The index of node `k` along each parameter.
    fn indices(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.domain.len()).scan(k, |rest, _| {
            let index = *rest % self.along;
            *rest /= self.along;
            Some(index)
        })
    }

    fn at(&self, k: usize) -> Vec<f64> {
        let last = (self.along - 1) as f64;
        let each = self.indices(k).zip(&self.domain);
        // the faces to the bit: bounds are met there
        each.map(|(i, [low, high])| {
            let share = i as f64 / last;
            low * (1.0 - share) + high * share
        })
        .collect()
    }

    /// The share of a node: half of one on a face.
    fn share(&self, k: usize) -> f64 {
        let face = |i: usize| i == 0 || i + 1 == self.along;
        self.indices(k)
            .map(|i| if face(i) { 0.5 } else { 1.0 })
            .product()
    }

    fn steps(&self) -> Vec<f64> {
        let last = (self.along - 1) as f64;
        self.domain.iter().map(|d| (d[1] - d[0]) / last).collect()
    }

    fn costs(&self, cost: &dyn Fn(&[f64]) -> f64) -> Vec<f64> {
        (0..self.count()).map(|k| cost(&self.at(k))).collect()
    }

    fn best(&self, costs: &[f64]) -> Option<(Vec<f64>, f64)> {
        let finite = costs.iter().enumerate().filter(|(_, c)| c.is_finite());
        let least = finite.min_by(|a, b| a.1.total_cmp(b.1))?;
        Some((self.at(least.0), *least.1))
    }

    /// A box with what is believed that is narrower than this grid's: of as many of the best nodes as leave one, down to those that are believed.
    fn narrower(&self, costs: &[f64], least: f64) -> Option<Vec<[f64; 2]>> {
        let mut rising: Vec<f64> = costs.iter().copied().filter(|c| c.is_finite()).collect();
        rising.sort_by(f64::total_cmp);
        let mut kept = KEPT * rising.len() as f64;
        loop {
            let most = rising.get(kept as usize).copied().unwrap_or(least);
            let believed = most <= least + BEYOND;
            let found = self.below(costs, most.max(least + BEYOND));
            let narrow = |(b, d): (&[f64; 2], &[f64; 2])| b[1] - b[0] < 0.8 * (d[1] - d[0]);
            if found.iter().zip(&self.domain).any(narrow) {
                return Some(found);
            }
            if believed {
                return None;
            }
            kept *= KEPT;
        }
    }

    /// The box of the nodes whose cost is below `most`, a step wider.
    fn below(&self, costs: &[f64], most: f64) -> Vec<[f64; 2]> {
        let mut found = vec![[usize::MAX, 0]; self.domain.len()];
        for (k, _) in costs.iter().enumerate().filter(|(_, c)| **c <= most) {
            for (i, range) in self.indices(k).zip(&mut found) {
                *range = [range[0].min(i), range[1].max(i)];
            }
        }
        let steps = self.steps();
        let wider = found.iter().zip(&steps).zip(&self.domain);
        wider
            .map(|(([from, to], step), [low, high])| {
                let from = low + step * (from.saturating_sub(1)) as f64;
                let to = if to + 2 >= self.along {
                    *high
                } else {
                    low + step * (to + 1) as f64
                };
                [from, to]
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl has its own figures, also where it is far narrower than the domain; cut off at its middle it has those of a half of it.
    #[test]
    fn a_bowl_is_believed_as_it_is() {
        let domain = [[0.0, 1.0], [0.0, 2.0]];
        for sigma in [0.1, 1e-3] {
            let cost = |x: &[f64]| ((x[0] - 0.43) / sigma).powi(2) + ((x[1] - 0.9) / sigma).powi(2);
            let found = Belief::of(&domain, &cost).unwrap();
            for (best, wanted) in found.best.iter().zip([0.43, 0.9]) {
                assert!((best - wanted).abs() < 1e-3 * sigma, "{best}");
            }
            for s in found.sigmas() {
                assert!((s / sigma - 1.0).abs() < 0.01, "{s}");
            }
            assert!(found.covariance[0][1].abs() < 0.01 * sigma * sigma);
        }
        let half = Belief::of(&[[0.5, 1.0]], &|x: &[f64]| ((x[0] - 0.3) / 0.1).powi(2)).unwrap();
        assert_eq!(half.best, [0.5]);
        // beyond two sigmas: mean 0.373 of one above the bound
        assert!((half.mean[0] - 0.5373).abs() < 1e-3, "{:?}", half.mean);
    }

    /// A valley is as long as what cuts it off, and what has no cost is not believed.
    #[test]
    fn a_valley_is_as_long_as_its_ends() {
        let valley = |x: &[f64]| ((x[0] * x[1] - 1.0) / 0.05).powi(2);
        let found = Belief::of(&[[0.5, 2.0], [0.1, 5.0]], &valley).unwrap();
        // over ln x from -0.69 to 0.69, x = e^u weighed alike in u
        let (log, ends) = (2.0 * 2f64.ln(), [0.5, 2.0]);
        let mean = (ends[1] - ends[0]) / log;
        assert!((found.mean[0] / mean - 1.0).abs() < 0.05, "{found:?}");
        assert_eq!(Belief::of(&[[0.0, 1.0]], &|_: &[f64]| f64::INFINITY), None);
    }
}
