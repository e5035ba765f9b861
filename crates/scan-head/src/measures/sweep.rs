//! What a disc sweeps, cut along a line: exact, whatever the line's direction.

use meltpath_geometry::math::DVec2;

/// A line: where it begins, and its direction of length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) from: DVec2,
    pub(super) along: DVec2,
}

/// From where to where, mm along a line.
pub(super) type Interval = [f64; 2];

impl Line {
    /// What lies within `radius` mm beside the segment `a`–`b`, not beyond its ends.
    pub(super) fn beside(&self, [a, b]: [DVec2; 2], radius: f64) -> Option<Interval> {
        let length = a.distance(b);
        if length == 0.0 {
            return None;
        }
        let way = (b - a) / length;
        let from = self.from - a;
        let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
        for (start, slope, [least, most]) in [
            (from.dot(way), self.along.dot(way), [0.0, length]),
            (
                from.perp_dot(way),
                self.along.perp_dot(way),
                [-radius, radius],
            ),
        ] {
            if slope == 0.0 {
                if start < least || start > most {
                    return None;
                }
                continue;
            }
            let (p, q) = ((least - start) / slope, (most - start) / slope);
            (low, high) = (low.max(p.min(q)), high.min(p.max(q)));
        }
        (low < high).then_some([low, high])
    }

    /// What lies within `radius` mm of a point.
    fn round(&self, centre: DVec2, radius: f64) -> Option<Interval> {
        let to = centre - self.from;
        let beside = to.perp_dot(self.along);
        let half = (radius * radius - beside * beside).sqrt();
        let at = to.dot(self.along);
        // NaN where the line passes by
        (half > 0.0).then_some([at - half, at + half])
    }

    /// What a disc of that radius, mm, covers on its way from `a` to `b`: one interval, since what it sweeps is convex.
    pub(super) fn swept(&self, [a, b]: [DVec2; 2], radius: f64) -> Option<Interval> {
        let parts = [
            self.round(a, radius),
            self.round(b, radius),
            self.beside([a, b], radius),
        ];
        parts
            .into_iter()
            .flatten()
            .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }
}

/// Intervals that are merged at once: fewer are not worth it.
const FEW: usize = 64;

/// What of a line is covered, as it comes.
#[derive(Debug, Clone, Default)]
pub(super) struct Covered {
    intervals: Vec<[f32; 2]>,
    /// How many of them were left when they were merged last.
    merged: usize,
}

impl Covered {
    /// Adds an interval.
    pub(super) fn add(&mut self, [low, high]: Interval) {
        let [low, high] = [low as f32, high as f32];
        if let Some(last) = self.intervals.last_mut()
            && low <= last[1]
            && high >= last[0]
        {
            *last = [last[0].min(low), last[1].max(high)];
            return;
        }
        self.intervals.push([low, high]);
        if self.intervals.len() > 2 * self.merged + FEW {
            self.merge();
        }
    }

    /// What is covered, in order, none twice.
    fn merge(&mut self) {
        let mut all = std::mem::take(&mut self.intervals);
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for [low, high] in all {
            match self.intervals.last_mut() {
                Some(last) if low <= last[1] => last[1] = last[1].max(high),
                _ => self.intervals.push([low, high]),
            }
        }
        self.merged = self.intervals.len();
    }

    /// The same in order, none twice.
    pub(super) fn in_order(&mut self) -> impl Iterator<Item = Interval> + '_ {
        self.merge();
        self.intervals.iter().map(|i| i.map(f64::from))
    }

    /// What is not covered between 0 and `length` mm, in order.
    pub(super) fn gaps(&mut self, length: f64) -> Vec<Interval> {
        let (mut gaps, mut at) = (Vec::new(), 0.0);
        for [low, high] in self.in_order() {
            if low > at {
                gaps.push([at, low.min(length)]);
            }
            at = at.max(high);
        }
        if length > at {
            gaps.push([at, length]);
        }
        gaps.retain(|[low, high]| high > low);
        gaps
    }

    /// Keeps of it what another one covers, too.
    pub(super) fn keep(&mut self, other: &mut Covered) {
        other.merge();
        let mut kept = Covered::default();
        let mut k = 0;
        for [low, high] in self.in_order() {
            let others = &other.intervals;
            while others.get(k).is_some_and(|o| f64::from(o[1]) < low) {
                k += 1;
            }
            for [from, to] in others[k..].iter().map(|o| o.map(f64::from)) {
                if from >= high {
                    break;
                }
                kept.intervals
                    .push([from.max(low) as f32, to.min(high) as f32]);
            }
        }
        *self = kept;
    }

    /// How much of it is covered by another one, too, mm, and how much there is of it.
    pub(super) fn covered_by(&mut self, other: &mut Covered) -> [f64; 2] {
        other.merge();
        let (mut both, mut all, mut k) = (0.0, 0.0, 0);
        for [low, high] in self.in_order() {
            all += high - low;
            while other
                .intervals
                .get(k)
                .is_some_and(|o| f64::from(o[1]) < low)
            {
                k += 1;
            }
            for &[from, to] in other.intervals[k..]
                .iter()
                .take_while(|o| f64::from(o[0]) < high)
            {
                both += (f64::from(to).min(high) - f64::from(from).max(low)).max(0.0);
            }
        }
        [both, all]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec2> {
        (-1.0..1.0f64, -1.0..1.0f64).prop_map(|(x, y)| DVec2::new(x, y))
    }

    proptest! {
        /// A point of the line lies in the interval just where it is near enough to the segment.
        #[test]
        fn a_sweep_is_cut_where_its_rim_is(a in point(), b in point(), from in point(), turn in 0.0..6.3f64, radius in 0.01..0.5f64, at in -2.0..2.0f64) {
            let line = Line { from, along: DVec2::from_angle(turn) };
            let near = crate::measures::segment::distance_to_segment(line.from + at * line.along, a, b);
            prop_assume!((near - radius).abs() > 1e-9);
            let cut = line.swept([a, b], radius);
            let inside = cut.is_some_and(|[low, high]| (low..=high).contains(&at));
            prop_assert_eq!(inside, near < radius, "{:?} {}", cut, near);
        }

        /// Whatever the order of the intervals, what is covered and what is not make up the whole.
        #[test]
        fn gaps_and_what_is_covered_make_the_whole(starts in prop::collection::vec((0.0..9.0f64, 0.0..0.2f64), 0..300)) {
            let mut covered = Covered::default();
            let mut whole = Covered::default();
            whole.add([0.0, 10.0]);
            for (start, length) in starts {
                covered.add([start, start + length]);
            }
            let open: f64 = covered.gaps(10.0).iter().map(|[a, b]| b - a).sum();
            let [reached, all] = whole.covered_by(&mut covered);
            prop_assert!((all - 10.0).abs() < 1e-5);
            prop_assert!((reached + open - 10.0).abs() < 1e-4, "{} {}", reached, open);
        }
    }
}
