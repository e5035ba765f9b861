//! Two lines of least squares through walls, that meet between two of them.

/// A wall of one line a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// Current of the focus coil, A.
    pub focus: f64,
    /// Its thickness without the grains that stick to it, mm.
    pub thickness: f64,
}

/// A line of least squares through walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Intercept, mm, and slope, mm/A.
    pub(super) coefficients: [f64; 2],
}

impl Line {
    /// The line; nothing of walls at one current.
    fn through(walls: &[Wall]) -> Option<Line> {
        let n = walls.len() as f64;
        let mean = |of: fn(&Wall) -> f64| walls.iter().map(of).sum::<f64>() / n;
        let [x, y] = [mean(|w| w.focus), mean(|w| w.thickness)];
        let (mut xx, mut xy) = (0.0, 0.0);
        for wall in walls {
            xx += (wall.focus - x).powi(2);
            xy += (wall.focus - x) * (wall.thickness - y);
        }
        let slope = xy / xx;
        (xx > 0.0).then_some(Line {
            coefficients: [y - slope * x, slope],
        })
    }

    pub(super) fn at(&self, focus: f64) -> f64 {
        let [intercept, slope] = self.coefficients;
        intercept + slope * focus
    }

    fn squares(&self, walls: &[Wall]) -> f64 {
        let off = |w: &Wall| (w.thickness - self.at(w.focus)).powi(2);
        walls.iter().map(off).sum()
    }
}

/// Both lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lines {
    /// The falling and the rising one.
    pub(super) both: [Line; 2],
    /// How many walls, by their currents, lie on the falling one.
    pub(super) split: usize,
    /// Where they meet, A.
    pub(super) meet: f64,
    /// Sum of squares that they leave, mm².
    pub(super) squares: f64,
}

impl Lines {
    /// The two lines that leave least of walls in the order of their currents, and meet between those that they part; or, where none do, one wall
    /// farther: of a wall just beside the sharpest focus scatter lets both lines meet beyond it.
    pub(super) fn through(walls: &[Wall]) -> Option<Lines> {
        Self::meeting(walls, 0).or_else(|| Self::meeting(walls, 1))
    }

    /// The same of lines that meet at most so many walls `beyond` those that they part.
    fn meeting(walls: &[Wall], beyond: usize) -> Option<Lines> {
        let mut best: Option<Lines> = None;
        for split in 1..walls.len() {
            let (left, right) = walls.split_at(split);
            let ends = [
                left[(split - 1).saturating_sub(beyond)].focus,
                right[beyond.min(right.len() - 1)].focus,
            ];
            let (Some(falls), Some(rises)) = (Line::through(left), Line::through(right)) else {
                continue;
            };
            let [a, b] = [falls, rises].map(|l| l.coefficients);
            let meet = (b[0] - a[0]) / (a[1] - b[1]);
            let sharp = a[1] < 0.0 && b[1] > 0.0;
            if !(sharp && (ends[0]..=ends[1]).contains(&meet)) {
                continue;
            }
            let squares = falls.squares(left) + rises.squares(right);
            if best.is_none_or(|b| squares < b.squares) {
                best = Some(Lines {
                    both: [falls, rises],
                    split,
                    meet,
                    squares,
                });
            }
        }
        best
    }

    /// Thickness by them, mm.
    pub(super) fn at(&self, focus: f64) -> f64 {
        self.both[usize::from(focus > self.meet)].at(focus)
    }
}
