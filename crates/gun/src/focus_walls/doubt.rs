//! How far a calibration from walls may be trusted: how well it is known where its lines meet, whether a wall is far off, whether the walls lie
//! on a curve.

use meltpath_numerics::least_squares::Regression;
use meltpath_numerics::student::{ONE_SIGMA, Unknowns, as_much_by_chance, within};

use super::lines::{Lines, Wall};

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
    /// Its uncertainty: as many values lie within it as within one standard deviation of a normal distribution, 68 of 100; infinite where
    /// nothing tells the noise.
    pub sigma: f64,
    /// Half of the interval that holds the true value in 95 of 100 calibrations.
    pub most: f64,
}

/// Where the lines meet, from the noise of the walls about them: the current, A, and the thickness, mm. Student's t, for the noise is
/// estimated from the walls themselves, and of few of them badly.
pub(super) fn meeting(lines: &Lines, walls: usize) -> [Told; 2] {
    let freedom = walls.saturating_sub(NUMBERS);
    let noise = noise(lines.squares, freedom).sqrt();
    let [falls, rises] = lines.both;
    let (down, up) = (falls.coefficients[1], rises.coefficients[1]);
    let opening = up - down;
    let [of_falls, of_rises] = [falls, rises].map(|l| l.variance(lines.meet));
    // a line that is higher by one moves where they meet by 1 / opening, and the height there by the other's slope times that
    let current = (of_falls + of_rises).sqrt() / opening;
    let height = (up.powi(2) * of_falls + down.powi(2) * of_rises).sqrt() / opening;
    let told = |value, one: f64| Told {
        value,
        sigma: within(ONE_SIGMA, freedom) * noise * one,
        most: within(MOST, freedom) * noise * one,
    };
    [
        told(lines.meet, current),
        told(falls.at(lines.meet), height),
    ]
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
