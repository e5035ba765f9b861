//! The last few hundred samples, to see how the tool passed a point.

use meltpath_geometry::math::DVec3;

/// A ring of recent samples, addressed by their number in the stream.
#[derive(Debug)]
pub(crate) struct History {
    position: Vec<DVec3>,
    speed: Vec<f64>,
    newest: usize,
}

impl History {
    /// Room for at least `n` samples.
    pub(crate) fn new(n: usize) -> Self {
        let size = n.next_power_of_two();
        History {
            position: vec![DVec3::ZERO; size],
            speed: vec![0.0; size],
            newest: 0,
        }
    }

    fn slot(&self, i: usize) -> usize {
        i & (self.speed.len() - 1)
    }

    /// Records sample `i`; samples come in order.
    #[inline]
    pub(crate) fn record(&mut self, i: usize, position: DVec3, speed: f64) {
        let slot = self.slot(i);
        self.position[slot] = position;
        self.speed[slot] = speed;
        self.newest = i;
    }

    /// The sample number near `near` where `value` is lowest, going downhill from there.
    fn lowest(&self, near: usize, value: impl Fn(usize) -> f64) -> usize {
        let oldest = (self.newest + 1).saturating_sub(self.speed.len());
        let mut i = near.clamp(oldest, self.newest);
        let mut here = value(i);
        let mut ahead = true;
        loop {
            let next = match ahead {
                true if i < self.newest => i + 1,
                false if i > oldest => i - 1,
                _ => i,
            };
            let there = value(next);
            if there < here {
                (i, here) = (next, there);
            } else if ahead && i == near.clamp(oldest, self.newest) {
                ahead = false;
            } else {
                return i;
            }
        }
    }

    /// Distance from `point` to the path near sample `near`, and the lowest speed there; mm and mm/s.
    pub(crate) fn passage(&self, near: usize, point: DVec3) -> (f64, f64) {
        let at = |i: usize| self.position[self.slot(i)];
        let i = self.lowest(near, |i| at(i).distance_squared(point));
        let mut deviation = at(i).distance(point);
        for other in [i.saturating_sub(1), (i + 1).min(self.newest)] {
            deviation = deviation.min(to_segment(point, at(i), at(other)));
        }
        let slowest = self.lowest(near, |i| self.speed[self.slot(i)]);
        (deviation, self.speed[self.slot(slowest)])
    }
}

/// Distance from a point to a segment.
fn to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let t = (p - a).dot(along) / along.length_squared();
    if t.is_finite() {
        p.distance(a + along * t.clamp(0.0, 1.0))
    } else {
        p.distance(a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_nearest_point_and_the_slowest() {
        let mut history = History::new(60);
        for i in 0..500_usize {
            let x = i as f64 * 0.1;
            history.record(i, DVec3::new(x, 1.0, 0.0), (x - 46.31).abs());
        }
        for near in [450, 463, 470] {
            let (deviation, speed) = history.passage(near, DVec3::new(46.05, 0.0, 0.0));
            assert!((deviation - 1.0).abs() < 1e-12);
            assert!((speed - 0.01).abs() < 1e-9);
        }
        // far from what is remembered: the oldest and newest samples stand
        assert!(history.passage(0, DVec3::ZERO).0 > 40.0);
    }
}
