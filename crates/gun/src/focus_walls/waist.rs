//! Where a beam is sharpest, and how thick its wall is there, by either of two forms: two lines that meet, or a caustic, a hyperbola
//! w² = w0² + s² (f - f0)², with a slope of its own on each side as the lines have. Every waist is tried, with the slopes of least squares
//! for it, so that all that are about as good as the best are known: the noise of walls does not part them by a formula where a wall stands
//! beside the focus, or where a side is short.
//!
//! Hyperbola: ISO 11146-1, section 9; its two slopes are ours. Bounds by what is left (profile likelihood): D. M. Bates, D. G. Watts,
//! "Nonlinear Regression Analysis and Its Applications" (1988), section 6.1.

/// Steps in which a least value is looked for before it is closed in on.
const STEPS: usize = 16;
/// Narrower by the golden ratio so often: to 2e-5 of a step.
const CLOSER: usize = 22;
/// Halvings of the step in which a bound lies.
const HALVINGS: usize = 12;
/// Steps of Gauss and Newton for a slope.
const SLOPES: usize = 6;

/// What the walls lie on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Two lines that meet at the waist.
    Lines,
    /// A hyperbola about the waist.
    Caustic,
}

/// A waist: the current there, A, and how thick a wall is, without what a beam of no diameter leaves, mm.
pub(super) type Waist = [f64; 2];

/// Which of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    Current,
    Width,
}

/// The waist of least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sharpest<'a> {
    form: Form,
    /// Walls in the order of their currents: current, A, and thickness without what a beam of no diameter leaves, mm.
    walls: &'a [[f64; 2]],
    /// The waist, between the first wall and the last.
    pub(super) waist: Waist,
    /// Sum of squares that it leaves, mm².
    pub(super) squares: f64,
}

impl Sharpest<'_> {
    /// That of `walls` in the order of their currents, two at least.
    pub(super) fn of(walls: &[[f64; 2]], form: Form) -> Sharpest<'_> {
        let mut found = Sharpest {
            form,
            walls,
            waist: [0.0; 2],
            squares: 0.0,
        };
        let (current, squares) = least(found.range(Of::Current), |f| found.best(Of::Current, f).1);
        found.waist = [current, found.best(Of::Current, current).0];
        found.squares = squares;
        found
    }

    /// Between which ends one of both is looked for.
    fn range(&self, of: Of) -> [f64; 2] {
        let widest = self.walls.iter().map(|w| w[1]).fold(f64::EPSILON, f64::max);
        match of {
            Of::Current => [self.walls[0][0], self.walls[self.walls.len() - 1][0]],
            Of::Width => [0.0, widest],
        }
    }

    /// With one of both `given`: the other that leaves least, and what it leaves.
    fn best(&self, of: Of, given: f64) -> (f64, f64) {
        match of {
            Of::Current => least(self.range(Of::Width), |width| self.left([given, width])),
            Of::Width => least(self.range(Of::Current), |focus| self.left([focus, given])),
        }
    }

    /// Sum of squares that a waist leaves, mm².
    fn left(&self, waist: Waist) -> f64 {
        let split = self.walls.partition_point(|w| w[0] < waist[0]);
        let (falls, rises) = self.walls.split_at(split);
        match self.form {
            Form::Lines => straight(falls, waist) + straight(rises, waist),
            Form::Caustic => curved(falls, waist) + curved(rises, waist),
        }
    }

    /// Between which currents, A, and widths, mm, waists leave no more than `most`.
    pub(super) fn within(&self, most: f64) -> [[f64; 2]; 2] {
        [(Of::Current, self.waist[0]), (Of::Width, self.waist[1])].map(|(of, best)| {
            self.range(of)
                .map(|end| bound(best, end, |x| self.best(of, x).1 <= most))
        })
    }
}

/// What the walls of one side leave of the best line from the waist, none of which gets thinner away from it.
fn straight(walls: &[[f64; 2]], [focus, width]: Waist) -> f64 {
    let (mut over, mut under) = (0.0, f64::MIN_POSITIVE);
    for wall in walls {
        let x = (wall[0] - focus).abs();
        over += x * (wall[1] - width);
        under += x * x;
    }
    let slope = f64::max(over / under, 0.0);
    let by = |wall: &[f64; 2]| width + slope * (wall[0] - focus).abs();
    walls.iter().map(|w| (w[1] - by(w)).powi(2)).sum()
}

/// What the walls of one side leave of the best hyperbola about the waist.
fn curved(walls: &[[f64; 2]], [focus, width]: Waist) -> f64 {
    let own = width.powi(2);
    let square = |wall: &[f64; 2]| (wall[0] - focus).powi(2);
    // the square of the slope: as the squares of the thickness tell it, then of the thickness itself
    let (mut over, mut under) = (0.0, f64::MIN_POSITIVE);
    for wall in walls {
        over += square(wall) * (wall[1].powi(2) - own);
        under += square(wall).powi(2);
    }
    let mut slope = f64::max(over / under, 0.0);
    for _ in 0..SLOPES {
        (over, under) = (0.0, f64::MIN_POSITIVE);
        for wall in walls {
            let by = (own + slope * square(wall)).sqrt().max(f64::EPSILON);
            let change = 0.5 * square(wall) / by;
            over += change * (wall[1] - by);
            under += change.powi(2);
        }
        let next = f64::max(slope + over / under, 0.0);
        let settled = (next - slope).abs() <= 1e-9 * next;
        slope = next;
        if settled {
            break;
        }
    }
    let by = |wall: &[f64; 2]| (own + slope * square(wall)).sqrt();
    walls.iter().map(|w| (w[1] - by(w)).powi(2)).sum()
}

/// Where a function is least between two ends, and its value there: the least of some steps, then closer beside it.
fn least([from, to]: [f64; 2], of: impl Fn(f64) -> f64) -> (f64, f64) {
    let step = (to - from) / STEPS as f64;
    let less = |a: (f64, f64), b: (f64, f64)| if b.1 < a.1 { b } else { a };
    let steps = (0..=STEPS).map(|k| from + step * k as f64);
    let best = steps.map(|x| (x, of(x))).reduce(less);
    let best = best.unwrap_or((from, f64::INFINITY));
    let (mut low, mut high) = ((best.0 - step).max(from), (best.0 + step).min(to));
    let inner = |low: f64, high: f64| high - (high - low) / std::f64::consts::GOLDEN_RATIO;
    let at = |x: f64| (x, of(x));
    let (mut a, mut b) = (at(inner(low, high)), at(inner(high, low)));
    for _ in 0..CLOSER {
        if a.1 < b.1 {
            high = b.0;
            (b, a) = (a, at(inner(low, high)));
        } else {
            low = a.0;
            (a, b) = (b, at(inner(high, low)));
        }
    }
    less(best, less(a, b))
}

/// How far from `best` towards `end` something holds.
fn bound(best: f64, end: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let step = (end - best) / STEPS as f64;
    let last = (1..=STEPS).rev().find(|k| holds(best + step * *k as f64));
    let mut inside = best + step * last.unwrap_or(0) as f64;
    if last == Some(STEPS) {
        return end;
    }
    let mut outside = inside + step;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    outside
}
