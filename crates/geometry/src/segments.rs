//! Polylines in space, asked for the place nearest to a point.

use std::collections::HashMap;

use crate::math::DVec3;

/// Polylines in a grid of cubes.
#[derive(Debug, Clone)]
pub struct Segments {
    cell: f64,
    pieces: Vec<[DVec3; 2]>,
    /// The polyline of each segment.
    lines: Vec<u32>,
    cubes: HashMap<[i64; 3], Vec<u32>>,
}

/// The place of polylines nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// How far it is, mm.
    pub distance: f64,
    /// Where, mm.
    pub point: DVec3,
    /// The polyline, from 0.
    pub line: u32,
}

/// Where a segment is nearest to a point, as the share of its way: for how far the point lies along it, times its length, and for its
/// length squared. A segment without length is its beginning.
#[inline]
pub fn nearest_share(along: f64, squared: f64) -> f64 {
    if squared > 0.0 {
        (along / squared).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

impl Segments {
    /// The segments of polylines with finite points. `cell` is the size of a cube, mm, above zero: about as far as people will ask.
    pub fn new<'a>(lines: impl IntoIterator<Item = &'a [DVec3]>, cell: f64) -> Self {
        let mut all = Segments {
            cell,
            pieces: Vec::new(),
            lines: Vec::new(),
            cubes: HashMap::new(),
        };
        for (line, points) in (0..).zip(lines) {
            for pair in points.windows(2) {
                all.add([pair[0], pair[1]], line);
            }
        }
        all
    }

    fn add(&mut self, [a, b]: [DVec3; 2], line: u32) {
        // pieces no longer than a cube lie in few of them
        let pieces = (a.distance(b) / self.cell).ceil().max(1.0);
        let count = pieces as u32;
        for k in 0..count {
            let from = a.lerp(b, f64::from(k) / pieces);
            let to = if k + 1 == count {
                b
            } else {
                a.lerp(b, f64::from(k + 1) / pieces)
            };
            let index = self.pieces.len() as u32;
            self.pieces.push([from, to]);
            self.lines.push(line);
            let (low, high) = (self.cube(from.min(to)), self.cube(from.max(to)));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        self.cubes.entry([x, y, z]).or_default().push(index);
                    }
                }
            }
        }
    }

    fn cube(&self, p: DVec3) -> [i64; 3] {
        (p / self.cell).floor().to_array().map(|x| x as i64)
    }

    /// The nearest place, no farther than `within` mm; of places equally near that of the first segment.
    pub fn nearest(&self, p: DVec3, within: f64) -> Option<Nearest> {
        let centre = self.cube(p);
        let mut best: Option<(f64, u32, DVec3)> = None;
        let mut shell = 0;
        // cubes beyond shell k are at least k cubes away
        loop {
            self.visit(centre, shell, |index| {
                let [a, b] = self.pieces[index as usize];
                let way = b - a;
                let point = a + nearest_share((p - a).dot(way), way.length_squared()) * way;
                let off = p.distance_squared(point);
                if best.is_none_or(|(d, i, _)| off < d || (off == d && index < i)) {
                    best = Some((off, index, point));
                }
            });
            let seen = shell as f64 * self.cell;
            if seen >= within || best.is_some_and(|(d, _, _)| d.sqrt() <= seen) {
                break;
            }
            shell += 1;
        }
        let (off, index, point) = best?;
        let distance = off.sqrt();
        (distance <= within).then(|| Nearest {
            distance,
            point,
            line: self.lines[index as usize],
        })
    }

    /// Calls `take` for the segments of all cubes `shell` away from the one in the middle.
    fn visit(&self, centre: [i64; 3], shell: i64, mut take: impl FnMut(u32)) {
        for x in -shell..=shell {
            for y in -shell..=shell {
                let inner = x.abs() < shell && y.abs() < shell;
                let step = if inner { (2 * shell).max(1) } else { 1 };
                let mut z = -shell;
                while z <= shell {
                    let key = [centre[0] + x, centre[1] + y, centre[2] + z];
                    if let Some(found) = self.cubes.get(&key) {
                        found.iter().copied().for_each(&mut take);
                    }
                    z += step;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn place() -> impl Strategy<Value = DVec3> {
        let x = -30.0..30.0;
        (x.clone(), x.clone(), x).prop_map(|(x, y, z)| DVec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn the_nearest_place_is_that_of_all_segments(
            points in proptest::collection::vec(place(), 2..12),
            asked in proptest::collection::vec(place(), 1..20),
            cell in 0.5..40.0,
        ) {
            let segments = Segments::new([points.as_slice()], cell);
            for p in asked {
                let direct = points.windows(2).map(|w| {
                    let way = w[1] - w[0];
                    let share = ((p - w[0]).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                    p.distance(w[0] + share * way)
                });
                let direct = direct.fold(f64::INFINITY, f64::min);
                let found = segments.nearest(p, 200.0).unwrap();
                prop_assert!((found.distance - direct).abs() < 1e-9);
                prop_assert!((found.point.distance(p) - direct).abs() < 1e-9);
                prop_assert!(segments.nearest(p, 0.99 * direct).is_none());
            }
        }
    }

    #[test]
    fn nothing_is_near_nothing() {
        assert_eq!(Segments::new([], 1.0).nearest(DVec3::ZERO, 5.0), None);
    }
}
