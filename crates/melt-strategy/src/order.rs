//! In which order the lines or spots of a path are drawn: heat that a line leaves behind preheats the next one.
//!
//! Béraud 2016, section 3.3.2.1 (lateral edges), and what it leaves open (section 4.2: the path itself as a lever).

use meltpath_thermal::beam::{BeamError, BeamPath, BeamPoint};

/// An order of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// All of one remainder first: the first, the `n`th after it and so on, then those beside them.
    Every(usize),
    /// From the middle of the path to its ends, sides in turn.
    FromTheMiddle,
    /// The last one first.
    Backwards,
}

/// A straight run of a path with the beam on, or a spot: point numbers from its first to its last.
type Run = (usize, usize);

/// Spots, and straight runs of at least `shortest` mm. Shorter ones, such as the links between the lines of a zigzag, are left out.
fn runs(points: &[BeamPoint], shortest: f64) -> Vec<Run> {
    let step = |n: usize| [points[n + 1].x - points[n].x, points[n + 1].y - points[n].y];
    let heats = |n: usize| points[n].is_on() && points[n + 1].time > points[n].time;
    let mut found: Vec<Run> = Vec::new();
    let mut n = 0;
    while n + 1 < points.len() {
        if !heats(n) {
            n += 1;
            continue;
        }
        let first = n;
        let along = step(first);
        n += 1;
        if along == [0.0, 0.0] {
            found.push((first, n));
            continue;
        }
        while n + 1 < points.len() && heats(n) {
            let next = step(n);
            let dot = along[0] * next[0] + along[1] * next[1];
            // 20° and more is a corner
            if dot < 0.94 * along[0].hypot(along[1]) * next[0].hypot(next[1]) {
                break;
            }
            n += 1;
        }
        let way = (points[n].x - points[first].x).hypot(points[n].y - points[first].y);
        if way >= shortest {
            found.push((first, n));
        }
    }
    found
}

/// The straight lines and spots of `path` in another order, jumps in no time between them; lines shorter than `shortest` mm are
/// left out.
///
/// # Errors
/// [`BeamError`].
///
/// ```
/// use meltpath_thermal::beam::{BeamPath, BeamPoint};
/// use meltpath_melt_strategy::order::{Order, reorder};
/// let start = BeamPoint::start(300.0, 0.4);
/// let corners: Vec<[f64; 2]> = (0..4).flat_map(|n| {
///     let y = 0.125 * f64::from(n);
///     if n % 2 == 0 { [[0.0, y], [2.0, y]] } else { [[2.0, y], [0.0, y]] }
/// }).collect();
/// let path = BeamPath::along(&corners, 1000.0, start).unwrap();
/// let other = reorder(&path, Order::Every(2), 0.2).unwrap();
/// assert!((other.end() - 0.008).abs() < 1e-12);
/// assert_eq!(other.at(0.003).y, 0.25);
/// ```
pub fn reorder(path: &BeamPath, order: Order, shortest: f64) -> Result<BeamPath, BeamError> {
    let points = path.points();
    let lines = runs(points, shortest);
    let mut sequence: Vec<usize> = (0..lines.len()).collect();
    match order {
        Order::Every(n) => sequence.sort_by_key(|i| (i % n.max(1), *i)),
        Order::FromTheMiddle => {
            sequence.sort_by_key(|i| (2 * i + 1).abs_diff(lines.len()));
        }
        Order::Backwards => sequence.reverse(),
    }
    let mut time = path.begin();
    let mut out = Vec::with_capacity(points.len() + lines.len());
    for (first, last) in sequence.into_iter().map(|i| lines[i]) {
        let begun = points[first].time;
        out.extend(points[first..=last].iter().map(|p| BeamPoint {
            time: time + (p.time - begun),
            ..*p
        }));
        time += points[last].time - begun;
        if let Some(end) = out.last_mut() {
            *end = end.off();
        }
    }
    BeamPath::new(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Spots are reordered like lines, however short their jumps.
    #[test]
    fn spots_change_places() {
        let points = (0..4_u32).flat_map(|n| {
            [0.0, 0.1].map(|rest| BeamPoint {
                time: 0.1 * f64::from(n) + rest,
                x: 0.05 * f64::from(n),
                y: 0.0,
                power: 300.0,
                spot: 0.4,
            })
        });
        let path = BeamPath::new(points.collect()).unwrap();
        let other = reorder(&path, Order::Every(2), 0.15).unwrap();
        let seen = [0.05, 0.15, 0.25, 0.35].map(|t| other.at(t).x);
        assert_eq!(
            seen,
            [0.0, 0.1, 0.05, 0.15].map(|x: f64| (x / 0.05).round() * 0.05)
        );
    }

    /// A run ends at a corner of 20 degrees, however its lines lie and whatever their lengths are.
    #[test]
    fn runs_end_at_corners() {
        for tilt in [0.0, 0.4, 1.1, 2.5] {
            for (bend, parts) in [(10f64, 1), (30f64, 2), (90f64, 2), (170f64, 2)] {
                let way = |angle: f64, long: f64| [long * f64::cos(angle), long * f64::sin(angle)];
                let (first, next) = (way(tilt, 7.0), way(tilt + bend.to_radians(), 0.3));
                let corners = [[0.0, 0.0], first, [first[0] + next[0], first[1] + next[1]]];
                let start = BeamPoint {
                    time: 0.0,
                    x: 0.0,
                    y: 0.0,
                    power: 300.0,
                    spot: 0.4,
                };
                let path = BeamPath::along(&corners, 1000.0, start).unwrap();
                assert_eq!(runs(path.points(), 0.2).len(), parts, "{tilt} {bend}");
            }
        }
    }

    proptest! {
        /// Every order draws the same lines for the same time.
        #[test]
        fn orders_keep_lines(lines in 1..30_u32, every in 1..7_usize) {
            let start = BeamPoint { time: 0.5, x: 0.0, y: 0.0, power: 300.0, spot: 0.4 };
            let corners: Vec<[f64; 2]> = (0..lines).flat_map(|n| {
                let y = 0.1 * f64::from(n);
                if n % 2 == 0 { [[0.0, y], [3.0, y]] } else { [[3.0, y], [0.0, y]] }
            }).collect();
            let path = BeamPath::along(&corners, 1000.0, start).unwrap();
            for order in [Order::Every(every), Order::FromTheMiddle, Order::Backwards] {
                let other = reorder(&path, order, 0.2).unwrap();
                prop_assert!((other.end() - 0.5 - 0.003 * f64::from(lines)).abs() < 1e-9);
                let mut heights: Vec<i64> = (0..lines)
                    .map(|n| other.at(0.5 + 0.003 * (f64::from(n) + 0.5)))
                    .map(|p| { assert!(p.is_on()); (p.y * 10.0).round() as i64 })
                    .collect();
                heights.sort_unstable();
                prop_assert_eq!(heights, (0..i64::from(lines)).collect::<Vec<_>>());
            }
        }
    }
}
