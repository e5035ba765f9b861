//! Travel speeds that follow the thickness of a layer: at one wire feed a bead lays the less the faster it goes.

use crate::fill::Paces;
use crate::surface::SurfacePoint;

/// What is thicker or thinner by no more than this share has one speed: the scatter of bead heights.
const EVEN: f64 = 0.03;

/// How a layer's speeds follow its thickness.
pub(super) struct Pace {
    /// How thick the layer grows at the speeds of its fill, mm.
    pub(super) grown: f64,
    /// The speed of the passes' profile, and how much slower and faster a thickness may be laid.
    pub(super) paces: Paces,
    /// The slowest and the fastest speed that is known, mm/s.
    pub(super) known: [f64; 2],
    /// Shortest stretch with a speed of its own, mm.
    pub(super) shortest: f64,
}

impl Pace {
    /// The speed of each move of a bead, mm/s, where the fill asks for `speeds`.
    pub(super) fn speeds(
        &self,
        points: &[SurfacePoint],
        speeds: &[Option<f64>],
    ) -> Vec<Option<f64>> {
        let moves: Vec<(f64, f64)> = points.windows(2).map(step).collect();
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
}

/// Length of a move and its thickness, mm.
fn step(ends: &[SurfacePoint]) -> (f64, f64) {
    let thick = |p: &SurfacePoint| p.spacing().unwrap_or(0.0);
    let length = ends[0].position.distance(ends[1].position);
    (length, 0.5 * (thick(&ends[0]) + thick(&ends[1])))
}
