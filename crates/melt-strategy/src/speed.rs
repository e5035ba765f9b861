//! Speed along a beam path as factors of the path's own, and what a machine that cannot vary it makes of them.

use meltpath_thermal::beam::{BeamError, BeamPath, BeamPoint};

/// Factors on a path's speed, one per interval of the path's own time.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedProfile {
    /// Ends of the intervals, s of the path's own time, rising; one more than factors.
    knots: Vec<f64>,
    factors: Vec<f64>,
}

impl SpeedProfile {
    /// The path's own speed, in intervals of at most `length` mm that end at the path's points. A beam that is off keeps its
    /// own time: an interval for each such piece.
    pub fn of(path: &BeamPath, length: f64) -> Self {
        let mut knots = vec![path.begin()];
        for pair in path.points().windows(2) {
            let [a, b] = [pair[0], pair[1]];
            if b.time <= a.time {
                continue;
            }
            let way = (b.x - a.x).hypot(b.y - a.y);
            let pieces = if a.is_on() {
                (way / length).ceil().max(1.0)
            } else {
                1.0
            };
            for n in 1..=pieces as usize {
                // the last one to the bit: else a piece as long as the rounding would be left
                knots.push(if n as f64 == pieces {
                    b.time
                } else {
                    a.time + (b.time - a.time) * n as f64 / pieces
                });
            }
        }
        SpeedProfile {
            factors: vec![1.0; knots.len() - 1],
            knots,
        }
    }

    /// A profile from factors at the ends of intervals.
    pub(crate) fn from_parts(knots: Vec<f64>, factors: Vec<f64>) -> Self {
        SpeedProfile { knots, factors }
    }

    /// The intervals: from, to (s of the path's own time) and factor.
    pub fn intervals(&self) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        let ends = self.knots.windows(2);
        ends.zip(&self.factors).map(|(w, f)| (w[0], w[1], *f))
    }

    /// The factors, to be changed.
    pub fn factors_mut(&mut self) -> &mut [f64] {
        &mut self.factors
    }

    /// The factors.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Shares of what is changed, by the path's own time, that stand at the least and at the greatest of these factors: there a search would go
    /// on if it might.
    pub fn share_at(&self, bounds: [f64; 2]) -> [f64; 2] {
        let (mut changed, mut at) = (0.0, [0.0; 2]);
        for (from, to, factor) in self.intervals() {
            // a beam that is off keeps its own time
            if factor.to_bits() == 1.0_f64.to_bits() {
                continue;
            }
            changed += to - from;
            for (at, bound) in at.iter_mut().zip(bounds) {
                if (factor / bound - 1.0).abs() < 1e-9 {
                    *at += to - from;
                }
            }
        }
        at.map(|at| if changed > 0.0 { at / changed } else { 0.0 })
    }

    /// The path at these speeds, beginning at its own time.
    ///
    /// # Errors
    /// [`BeamError::Point`] where a factor is not above zero.
    pub fn apply(&self, path: &BeamPath) -> Result<BeamPath, BeamError> {
        let mut out: Vec<BeamPoint> = Vec::new();
        let mut next = path.points().iter().peekable();
        let mut time = path.begin();
        let mut put = |p: BeamPoint| {
            let same =
                |a: &BeamPoint| (a.x, a.y, a.is_on()) == (p.x, p.y, p.is_on()) && a.time == p.time;
            if !out.last().is_some_and(same) {
                out.push(p);
            }
        };
        for (from, to, factor) in self.intervals() {
            // what the path says at the beginning of the interval: its last point there sets the beam
            while let Some(p) = next.next_if(|p| p.time <= from) {
                put(BeamPoint { time, ..*p });
            }
            put(BeamPoint {
                time,
                ..path.at(from)
            });
            while let Some(p) = next.next_if(|p| p.time < to) {
                put(BeamPoint {
                    time: time + (p.time - from) / factor,
                    ..*p
                });
            }
            time += (to - from) / factor;
        }
        for p in next {
            put(BeamPoint { time, ..*p });
        }
        BeamPath::new(out)
    }

    /// Each factor replaced by the nearest of `levels` (by ratio): for controllers, or charts, that know only those. Without
    /// levels nothing changes.
    #[must_use]
    pub fn snapped(&self, levels: &[f64]) -> Self {
        let far = |level: f64, factor: f64| (level / factor).ln().abs();
        let nearest = |factor: f64| {
            let nearer = |a: f64, b: &f64| {
                if far(*b, factor) < far(a, factor) {
                    *b
                } else {
                    a
                }
            };
            let (first, others) = levels.split_first()?;
            Some(others.iter().fold(*first, nearer))
        };
        SpeedProfile {
            knots: self.knots.clone(),
            factors: self
                .factors
                .iter()
                .map(|f| nearest(*f).unwrap_or(*f))
                .collect(),
        }
    }

    /// One factor per straight piece of the path, that takes the same time: for controllers that cannot vary the speed along
    /// a line (Béraud 2016, section 3.3.2.2).
    #[must_use]
    pub fn by_line(&self, path: &BeamPath) -> Self {
        let mut out = self.clone();
        for pair in path.points().windows(2) {
            let inside = |n: usize| {
                let middle = 0.5 * (self.knots[n] + self.knots[n + 1]);
                (pair[0].time..pair[1].time).contains(&middle)
            };
            let of: Vec<usize> = (0..self.factors.len()).filter(|n| inside(*n)).collect();
            let own: f64 = of.iter().map(|n| self.knots[n + 1] - self.knots[*n]).sum();
            let taken: f64 = of
                .iter()
                .map(|n| (self.knots[n + 1] - self.knots[*n]) / self.factors[*n])
                .sum();
            for n in of {
                out.factors[n] = own / taken;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_stands_at_its_bounds_is_told() {
        let knots = vec![0.0, 1.0, 2.0, 4.0, 5.0];
        // a factor of one is that of a beam that is off
        let profile = SpeedProfile::from_parts(knots, vec![0.6, 1.0, 3.0, 0.9]);
        assert_eq!(profile.share_at([0.6, 3.0]), [0.25, 0.5]);
        assert_eq!(
            SpeedProfile::of(&zigzag(), 1.0).share_at([0.6, 1.0]),
            [0.0; 2]
        );
    }

    fn zigzag() -> BeamPath {
        let start = BeamPoint::start(300.0, 0.4);
        BeamPath::along(
            &[[0.0, 0.0], [3.0, 0.0], [3.0, 0.1], [0.0, 0.1]],
            1000.0,
            start,
        )
        .unwrap()
    }

    proptest! {
        #[test]
        fn corners_stay_and_times_add_up(factors in prop::collection::vec(0.5..3.0_f64, 70)) {
            let path = zigzag();
            let mut profile = SpeedProfile::of(&path, 0.1);
            profile.factors_mut().iter_mut().zip(&factors).for_each(|(f, g)| *f = *g);
            let fast = profile.apply(&path).unwrap();
            let expected: f64 = profile.intervals().map(|(a, b, f)| (b - a) / f).sum();
            prop_assert!((fast.end() - expected).abs() < 1e-12);
            for corner in path.points() {
                prop_assert!(fast.points().iter().any(|p| (p.x, p.y) == (corner.x, corner.y)));
            }
            let by_line = profile.by_line(&path).apply(&path).unwrap();
            prop_assert!((by_line.end() - fast.end()).abs() < 1e-12);
        }
    }

    /// Intervals end at the path's points to the bit: no piece is as short as the rounding of its time.
    #[test]
    fn no_piece_is_shorter_than_it_was_cut() {
        let start = BeamPoint::start(300.0, 0.4);
        for n in 1..200 {
            let corners = [
                [0.0, 0.0],
                [0.137 * f64::from(n), 0.3],
                [1.1, 0.7],
                [0.2, 0.9],
            ];
            let path = BeamPath::along(&corners, 980.0, start).unwrap();
            let mut profile = SpeedProfile::of(&path, 0.06);
            let knots: Vec<f64> = profile.intervals().map(|(_, to, _)| to).collect();
            for p in &path.points()[1..] {
                assert!(knots.contains(&p.time), "{n}");
            }
            for (k, f) in profile.factors_mut().iter_mut().enumerate() {
                *f = 1.0 + 0.01 * (k % 7) as f64;
            }
            let weaker = crate::lever::Lever::Power.apply(&profile, &path).unwrap();
            for pair in weaker.points().windows(2) {
                let way = (pair[1].x - pair[0].x).hypot(pair[1].y - pair[0].y);
                assert!(way == 0.0 || way > 1e-3, "{n}: {way}");
            }
        }
    }

    #[test]
    fn the_own_speed_gives_the_path_back() {
        let path = zigzag();
        let same = SpeedProfile::of(&path, 0.1).apply(&path).unwrap();
        for n in 0..100 {
            let t = path.end() * f64::from(n) / 100.0;
            let (a, b) = (path.at(t), same.at(t));
            assert!((a.x - b.x).hypot(a.y - b.y) < 1e-9 && a.power == b.power);
        }
    }
}
