//! How far a calibration from walls may be trusted: how well the sharpest focus is known, whether a wall is far off, whether the walls lie on a
//! curve.

use meltpath_numerics::least_squares::Regression;
use meltpath_numerics::student::{ONE_SIGMA, Unknowns, as_much_by_chance, within};

use super::lines::{Lines, Wall};
use super::waist::{Form, Sharpest, Waist};

/// Numbers of two lines.
const NUMBERS: usize = 4;
/// Least noise of a wall, mm: a micrometer reads whole micrometres, and what it rounds off is no knowledge.
const READING: f64 = 1e-3 * 0.288_675_134_594_812_9;
/// Walls with different currents that a curve of one side is told from.
const OF_A_CURVE: usize = 4;
/// Share of the intervals that hold what they tell.
const MOST: f64 = 0.95;

/// A number with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// The number.
    pub value: f64,
    /// Its uncertainty: as many values lie within it as within one standard deviation of a normal distribution, 68 of 100.
    pub sigma: f64,
    /// The interval that holds the true value in 95 of 100 calibrations; the number need not be its middle.
    pub most: [f64; 2],
}

impl Told {
    /// The same of what is so many times as large.
    pub(super) fn times(self, by: f64) -> Told {
        Told {
            value: by * self.value,
            sigma: by * self.sigma,
            most: self.most.map(|end| by * end),
        }
    }

    /// What is known where either may be true: bounds that hold both, and their middle.
    fn or(self, otherwise: Told) -> Told {
        let most = [
            self.most[0].min(otherwise.most[0]),
            self.most[1].max(otherwise.most[1]),
        ];
        let value = 0.5 * (most[0] + most[1]);
        let sigma = |told: Told| (told.value - value).abs() + told.sigma;
        Told {
            value,
            sigma: sigma(self).max(sigma(otherwise)),
            most,
        }
    }
}

/// How well a waist is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Known {
    /// The current there, A, and the thickness without what a beam of no diameter leaves, mm.
    pub(super) told: [Told; 2],
    /// The waist of a caustic, where the walls lie on one about as well as on two lines.
    pub(super) caustic: Option<Waist>,
}

/// How well the waist is known where two lines meet. Walls on a caustic may look as if they lay on two lines: its waist is held, too, unless it
/// is worse than the lines by more than chance makes it (Fisher's F with one more unknown: both forms have as many).
pub(super) fn waist(meet: Waist, walls: &[[f64; 2]]) -> Known {
    let freedom = walls.len().saturating_sub(NUMBERS);
    let lines = Sharpest::of(walls, Form::Lines);
    let caustic = Sharpest::of(walls, Form::Caustic);
    let by_lines = told_by(&lines, meet, freedom);
    let worse = (caustic.squares - lines.squares) / noise(lines.squares, freedom);
    if as_much_by_chance(worse, Unknowns::One, freedom) < RARE {
        return Known {
            told: by_lines,
            caustic: None,
        };
    }
    let by_caustic = told_by(&caustic, caustic.waist, freedom);
    Known {
        told: [0, 1].map(|k| by_lines[k].or(by_caustic[k])),
        caustic: Some(caustic.waist),
    }
}

/// A waist with the bounds that one form gives it: they hold every waist that leaves no more than Student's t allows beside the best one,
/// whose misses tell the noise.
pub(super) fn told_by(form: &Sharpest, waist: Waist, freedom: usize) -> [Told; 2] {
    let noise = noise(form.squares, freedom);
    let ends = |share| form.within(form.squares + noise * within(share, freedom).powi(2));
    let (one, most) = (ends(ONE_SIGMA), ends(MOST));
    [0, 1].map(|k| Told {
        value: waist[k],
        sigma: 0.5 * (one[k][1] - one[k][0]),
        most: [most[k][0].min(waist[k]), most[k][1].max(waist[k])],
    })
}

/// Variance of a wall from what fits leave: no less than a micrometer's reading has.
fn noise(squares: f64, freedom: usize) -> f64 {
    (squares / freedom.max(1) as f64).max(READING.powi(2))
}

/// Walls that the others do not go with.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// One wall, or two.
    pub walls: Vec<Wall>,
    /// What the lines through the others give for each, mm.
    pub others: Vec<f64>,
    /// Chance that noise alone leaves one wall, or two, of so many as far off.
    pub chance: f64,
    /// Variance of a wall about the lines through the others, mm².
    variance: f64,
}

/// The wall, or the two walls, without which the others lie better on two lines than by any chance worth thinking of: the sum of squares with and
/// without them, each by the lines that are best then (of one wall the square of its deleted studentised residual: Cook and Weisberg,
/// "Residuals and Influence in Regression", 1982, section 2.2.2; `chance` times the number of walls, or pairs, since the worst of them is taken,
/// Bonferroni).
pub(super) fn apart(lines: &Lines, walls: &[Wall]) -> Option<Apart> {
    let n = walls.len();
    let one = (0..n).map(|i| vec![i]);
    let two = (0..n).flat_map(|i| (i + 1..n).map(move |j| vec![i, j]));
    let best = |found: &mut dyn Iterator<Item = Vec<usize>>, times: usize| {
        let all = found.filter_map(|left_out| without(&left_out, lines, walls, times));
        all.min_by(|a, b| a.chance.total_cmp(&b.chance))
    };
    let one = best(&mut one.into_iter(), n);
    let two = best(&mut two.into_iter(), n * (n - 1) / 2);
    // two only where one does not leave the others as they should be
    let sound = |found: &Apart| found.chance < RARE;
    match (one.filter(sound), two.filter(sound)) {
        (Some(one), Some(two)) if two.variance < 0.1 * one.variance => Some(two),
        (None, two) => two,
        (one, _) => one,
    }
}

/// Below this chance something is not by chance.
pub const RARE: f64 = 0.01;

fn without(left_out: &[usize], lines: &Lines, walls: &[Wall], times: usize) -> Option<Apart> {
    let kept = walls.iter().enumerate();
    let kept: Vec<Wall> = kept
        .filter(|(i, _)| !left_out.contains(i))
        .map(|(_, w)| *w)
        .collect();
    let freedom = kept.len().checked_sub(NUMBERS).filter(|n| *n > 0)?;
    let others = Lines::through(&kept)?;
    let more = if left_out.len() == 1 {
        Unknowns::One
    } else {
        Unknowns::Two
    };
    let variance = noise(others.squares, freedom);
    let ratio = (lines.squares - others.squares) / more.number() as f64 / variance;
    let off: Vec<Wall> = left_out.iter().map(|i| walls[*i]).collect();
    Some(Apart {
        others: off.iter().map(|w| others.at(w.focus)).collect(),
        walls: off,
        chance: (times as f64 * as_much_by_chance(ratio, more, freedom)).min(1.0),
        variance,
    })
}

/// Whether the walls lie on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Chance that straight walls with noise look as curved.
    pub chance: f64,
    /// Variance of a wall about the curves, mm².
    variance: f64,
}

/// How curved the walls of each side are: a parabola for each that has walls enough, against its line (Fisher's F). Nothing where no side has
/// walls enough.
pub(super) fn curve(lines: &Lines, walls: &[Wall]) -> Option<Curve> {
    let (left, right) = walls.split_at(lines.split);
    let mut taken = 0.0;
    let mut curved = 0;
    for (side, line) in [left, right].into_iter().zip(lines.both) {
        let mut currents: Vec<f64> = side.iter().map(|w| w.focus).collect();
        currents.dedup();
        if currents.len() < OF_A_CURVE {
            continue;
        }
        let middle = currents.iter().sum::<f64>() / currents.len() as f64;
        let reach = 0.5 * (currents[currents.len() - 1] - currents[0]);
        let mut parabola = Regression::new(3);
        let mut straight = 0.0;
        for wall in side {
            let x = (wall.focus - middle) / reach;
            parabola.push([1.0, x, x * x], wall.thickness);
            straight += (wall.thickness - line.at(wall.focus)).powi(2);
        }
        let c = parabola.solve().ok()?.values;
        let off = |w: &Wall| {
            let x = (w.focus - middle) / reach;
            (w.thickness - c[0] - x * (c[1] + x * c[2])).powi(2)
        };
        taken += straight - side.iter().map(off).sum::<f64>();
        curved += 1;
    }
    let more = match curved {
        0 => return None,
        1 => Unknowns::One,
        _ => Unknowns::Two,
    };
    let freedom = walls.len().checked_sub(NUMBERS + curved)?;
    let variance = noise(lines.squares - taken, freedom);
    let ratio = taken / curved as f64 / variance;
    (freedom > 0).then(|| Curve {
        chance: as_much_by_chance(ratio, more, freedom),
        variance,
    })
}

/// Of a wall apart and a curve the one that explains the walls better, where both would.
pub(super) fn which(apart: Option<Apart>, curve: Option<Curve>) -> (Option<Apart>, Option<Curve>) {
    let curved = curve.filter(|c| c.chance < RARE);
    match (apart, curved) {
        (Some(apart), Some(curved)) if curved.variance < apart.variance => (None, curve),
        (Some(apart), Some(_)) => (Some(apart), None),
        (apart, _) => (apart, curve),
    }
}
