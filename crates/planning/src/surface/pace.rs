//! Travel speeds that follow the thickness of a layer: at one wire feed a bead lays the less the faster it goes.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;
use meltpath_geometry::sheet::thinned;

use super::pass::{SurfacePass, SurfacePoint};
use crate::fill::Paces;

/// What is thicker or thinner by no more than this share has one speed: the scatter of bead heights.
const EVEN: f64 = 0.03;

/// How a layer's speeds follow its thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// How thick the layer grows at the speeds of its fill, mm.
    pub grown: f64,
    /// The speed goes down with this power of the thickness: 1 where beads lie at a distance that is set. A bead alone gets wider the slower
    /// it is laid, as the power p of its section, and its speed goes down with the power 1/(1 - p).
    pub power: f64,
    /// The speed of the passes' profile, and how much slower and faster a thickness may be laid.
    pub paces: Paces,
    /// The slowest and the fastest speed that is known, mm/s.
    pub known: [f64; 2],
    /// Shortest stretch with a speed of its own, mm.
    pub shortest: f64,
}

impl Pace {
    /// The thinnest and the thickest layer that can be laid, mm.
    pub fn able(&self) -> [f64; 2] {
        let thick = |share: f64| self.grown * share.powf(-1.0 / self.power);
        [self.paces.fastest, self.paces.slowest].map(thick)
    }

    /// The speed of each move of a bead, mm/s, where the fill asks for `speeds`.
    pub(crate) fn speeds(
        &self,
        points: &[SurfacePoint],
        speeds: &[Option<f64>],
    ) -> Vec<Option<f64>> {
        let moves = points.windows(2).map(|ends| self.step(ends));
        let moves: Vec<(f64, f64)> = moves.collect();
        let mut paced = Vec::with_capacity(moves.len());
        while paced.len() < moves.len() {
            let first = paced.len();
            let end = self.stretch(&moves[first..], &speeds[first.min(speeds.len())..]) + first;
            let length: f64 = moves[first..end].iter().map(|m| m.0).sum();
            let volume: f64 = moves[first..end].iter().map(|m| m.0 * m.1).sum();
            let thick = if length > 0.0 {
                volume / length
            } else {
                moves[first].1
            };
            let asked = speeds
                .get(first)
                .copied()
                .flatten()
                .unwrap_or(self.paces.nominal);
            let share = (self.grown / thick)
                .powf(self.power)
                .max(self.paces.slowest)
                .min(self.paces.fastest);
            let [slowest, fastest] = self.known;
            let speed = (asked * share).max(slowest).min(fastest);
            paced.resize(end, Some(speed));
        }
        paced
    }

    /// How many moves from the first on have one speed.
    fn stretch(&self, moves: &[(f64, f64)], speeds: &[Option<f64>]) -> usize {
        let (mut long, mut thin, mut thick) = (0.0, f64::INFINITY, 0.0_f64);
        for (i, (length, here)) in moves.iter().enumerate() {
            (thin, thick) = (thin.min(*here), thick.max(*here));
            let other = speeds.get(i) != speeds.first();
            let uneven = long >= self.shortest && thick > (1.0 + EVEN) * thin;
            if i > 0 && (other || uneven) {
                return i;
            }
            long += length;
        }
        moves.len()
    }

    /// Length of a move and its thickness, mm: what it grows to where there is nothing below.
    fn step(&self, ends: &[SurfacePoint]) -> (f64, f64) {
        let thick = |p: &SurfacePoint| p.spacing().unwrap_or(self.grown);
        let length = ends[0].position.distance(ends[1].position);
        (length, 0.5 * (thick(&ends[0]) + thick(&ends[1])))
    }

    /// Passes of a wall, by number, as thick everywhere as the metal under them is far: every point is laid from the nearest place of the
    /// pass before, and the speed of each move, mm/s, follows that. Moves along which it changes are divided. `chord_error` is how far the
    /// polyline of what is laid on may lie beside its course, mm.
    ///
    /// Places with nothing of the pass before within ten times what it grows to are left as they are.
    pub fn wall(
        &self,
        passes: &[SurfacePass],
        chord_error: f64,
    ) -> (Vec<SurfacePass>, Vec<Vec<Option<f64>>>) {
        let mut before: &[SurfacePass] = &[];
        let (mut laid, mut speeds) = (Vec::new(), Vec::new());
        for group in passes.chunk_by(|a, b| a.number == b.number) {
            let next = before.first().map(|b| b.number + 1);
            let under = if next == Some(group[0].number) {
                before
            } else {
                &[]
            };
            let lines: Vec<Vec<DVec3>> = under
                .iter()
                .map(|p| p.points.iter().map(|q| q.position).collect())
                .collect();
            let near = Segments::new(lines.iter().map(Vec::as_slice), 2.0 * self.grown);
            for pass in group {
                let (points, own) = self.on_nearest(pass, &near, chord_error);
                laid.push(SurfacePass {
                    number: pass.number,
                    points,
                });
                speeds.push(own);
            }
            before = group;
        }
        (laid, speeds)
    }

    /// The same of passes that say themselves what each point is laid on, as turns of a spiral.
    pub fn as_laid(
        &self,
        passes: &[SurfacePass],
        chord_error: f64,
    ) -> (Vec<SurfacePass>, Vec<Vec<Option<f64>>>) {
        let nothing = Segments::new([], 2.0 * self.grown);
        let each = passes.iter().map(|pass| {
            let (points, speeds) = self.on_nearest(pass, &nothing, chord_error);
            let number = pass.number;
            (SurfacePass { number, points }, speeds)
        });
        each.unzip()
    }

    /// The points of a pass on the nearest place of `near`, and the speeds of its moves.
    fn on_nearest(
        &self,
        pass: &SurfacePass,
        near: &Segments,
        chord_error: f64,
    ) -> (Vec<SurfacePoint>, Vec<Option<f64>>) {
        // (point, whether the pass has it itself)
        let mut dense: Vec<(SurfacePoint, bool)> = Vec::new();
        dense.extend(pass.points.first().map(|p| (*p, true)));
        for pair in pass.points.windows(2) {
            let length = pair[0].position.distance(pair[1].position);
            let pieces = (length / self.shortest).ceil().clamp(1.0, 1e5) as u32;
            let share = |k: u32| f64::from(k) / f64::from(pieces);
            dense.extend((1..pieces).map(|k| (pair[0].towards(&pair[1], share(k)), false)));
            dense.push((pair[1], true));
        }
        for (point, _) in &mut dense {
            let nearest = near.nearest(point.position, 10.0 * self.grown);
            point.from = nearest.map(|n| n.point).or(point.from);
        }
        let points: Vec<SurfacePoint> = dense.iter().map(|p| p.0).collect();
        let speeds = self.speeds(&points, &[]);
        let feet: Vec<DVec3> = points
            .iter()
            .map(|p| p.from.unwrap_or(p.position))
            .collect();
        let stays = thinned(&feet, 0.5 * chord_error);
        let mut kept = (Vec::new(), Vec::new());
        for (i, (point, own)) in dense.into_iter().enumerate() {
            let changes = i > 0 && i < speeds.len() && speeds[i] != speeds[i - 1];
            if own || changes || stays[i] {
                if i > 0 {
                    kept.1.push(speeds[i - 1]);
                }
                kept.0.push(point);
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pace() -> Pace {
        Pace {
            grown: 1.5,
            power: 1.0 / (1.0 - 0.345),
            paces: Paces {
                nominal: 12.5,
                slowest: 0.5,
                fastest: 2.0,
            },
            known: [3.0, 25.0],
            shortest: 3.0,
        }
    }

    fn pass(number: u32, ends: [DVec3; 2], below: Option<[f64; 2]>) -> SurfacePass {
        let point = |i: usize| SurfacePoint {
            position: ends[i],
            normal: DVec3::Y,
            growth: DVec3::Z,
            from: below.map(|b| ends[i] - b[i] * DVec3::Z),
        };
        SurfacePass {
            number,
            points: vec![point(0), point(1)],
        }
    }

    /// A fan: the second of two straight passes lies from 1.2 to 2 mm over the first, on one move each.
    fn fan(from: f64, to: f64) -> Vec<SurfacePass> {
        let along = |z: [f64; 2]| [DVec3::Z * z[0], DVec3::new(60.0, 0.0, z[1])];
        vec![
            pass(1, along([1.5, 1.5]), Some([1.5, 1.5])),
            pass(2, along([1.5 + from, 1.5 + to]), Some([9.0, 9.0])),
        ]
    }

    #[test]
    fn a_move_over_a_fan_has_a_speed_for_each_thickness() {
        let (laid, speeds) = pace().wall(&fan(1.2, 2.0), 0.05);
        assert_eq!(
            (laid[0].points.len(), &speeds[0][..]),
            (2, &[Some(12.5)][..])
        );
        let fan = &laid[1].points;
        assert_eq!(speeds[1].len() + 1, fan.len());
        // laid from the nearest place, not from that of a parameter
        assert!((fan[0].spacing().unwrap() - 1.2).abs() < 2e-3);
        for (ends, speed) in fan.windows(2).zip(&speeds[1]) {
            let thick = 0.5 * (ends[0].spacing().unwrap() + ends[1].spacing().unwrap());
            // what a bead alone grows to: its section over its width
            let section = 12.5 / speed.unwrap();
            let grown = 1.5 * section / section.powf(0.345);
            assert!((grown / thick - 1.0).abs() < 0.05, "{grown} {thick}");
        }
        // steps that a machine follows
        for pair in speeds[1].windows(2) {
            let step = pair[0].unwrap() / pair[1].unwrap();
            assert!((1.0..1.15).contains(&step), "{step}");
        }
    }

    #[test]
    fn speeds_stay_within_what_is_known() {
        let (_, speeds) = pace().wall(&fan(0.2, 9.0), 0.05);
        let of =
            |f: fn(f64, f64) -> f64, from: f64| speeds[1].iter().map(|s| s.unwrap()).fold(from, f);
        assert_eq!(of(f64::max, 0.0), 25.0);
        assert_eq!(of(f64::min, 99.0), 0.5 * 12.5);
        let [thin, thick] = pace().able();
        assert!((thin - 1.5 * 2.0_f64.powf(-0.655)).abs() < 1e-12);
        assert!((thick - 1.5 * 2.0_f64.powf(0.655)).abs() < 1e-12);
    }

    proptest! {
        /// Metal is what the wall asks for, whatever its fan is: speed times section is wire, and section over width is thickness.
        #[test]
        fn metal_fills_the_wall(from in 1.0..2.2_f64, to in 1.0..2.2_f64) {
            let (laid, speeds) = pace().wall(&fan(from, to), 0.05);
            let moves = || laid[1].points.windows(2).zip(&speeds[1]);
            let length = |ends: &[SurfacePoint]| ends[0].position.distance(ends[1].position);
            let grown = |speed: f64| 1.5 * (12.5 / speed).powf(0.655);
            let laid: f64 = moves().map(|(e, s)| length(e) * grown(s.unwrap())).sum();
            let asked = 0.5 * (from + to) * moves().map(|(e, _)| length(e)).sum::<f64>();
            prop_assert!((laid / asked - 1.0).abs() < 2e-3, "{laid} {asked}");
        }
    }
}
