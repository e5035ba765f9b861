//! Metal that is laid while the torch stands or slows down: at the start and the end of a bead, and at corners. The wire runs on there,
//! so that a bead lays more than its length says. The controller's times: Rouchon 2022, § 3.3.1.

use meltpath_robot::controller::Controller;
use meltpath_toolpath::Pass;

/// How much bead a machine lays without getting on, as length of bead at its nominal speed, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Standing {
    /// While the torch gets up to speed, and again while it comes to rest, mm.
    end: f64,
    /// At a whole change of direction, mm.
    corner: f64,
    /// Changes of direction up to the first angle cost nothing, from the second on `corner`, in between by proportion; rad.
    turn: (f64, f64),
}

impl Standing {
    /// At `speed` mm/s and a smoothing of 0 to 1: half a transition's metal at either end of a bead, a dwell's at its corners. What
    /// the arc does at its ignition and end (hump, crater) is not in it: no measurement of it is known to us.
    pub(super) fn of(motion: &Controller, smoothing: f64, speed: f64) -> Self {
        let corner = &motion.corner;
        Standing {
            end: 0.5 * motion.transition() * speed,
            corner: motion.dwell(smoothing) * speed,
            turn: (corner.none_below.value.0, corner.full_above.value.0),
        }
    }

    /// Where along `pass` metal is laid without getting on: arc length, and length of bead, mm.
    pub(super) fn places(&self, pass: &Pass<'_>) -> Vec<(f64, f64)> {
        let mut places = vec![(0.0, self.end)];
        let mut along = 0.0;
        let tangent = |i: usize, t: f64| match pass.arc(i) {
            Some(arc) => arc.tangent(t),
            None => pass.points[i + 1] - pass.points[i],
        };
        for i in 0..pass.move_count() {
            if i > 0 {
                let turned = tangent(i - 1, 1.0).angle_between(tangent(i, 0.0));
                let (none, whole) = self.turn;
                let share = ((turned - none) / (whole - none).max(1e-9)).clamp(0.0, 1.0);
                // moves of no length have no direction
                if share > 0.0 {
                    places.push((along, share * self.corner));
                }
            }
            along += pass.move_length(i);
        }
        places.push((along, self.end));
        places
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::{Layer, Move, PassHead};

    use super::*;

    const STANDING: Standing = Standing {
        end: 1.5,
        corner: 0.6,
        turn: (0.1, 0.5),
    };

    fn places(moves: &[(Move, [f64; 2])]) -> Vec<(f64, f64)> {
        let mut layer = Layer::new(1, 0.0);
        let mut pass = layer.begin(PassHead::default(), DVec3::ZERO);
        for &(shape, [x, y]) in moves {
            pass.go(shape, DVec3::new(x, y, 0.0));
        }
        let places = STANDING.places(&layer.pass(0));
        let rounded = |v: f64| (1e6 * v).round() / 1e6;
        places
            .iter()
            .map(|p| (rounded(p.0), rounded(p.1)))
            .collect()
    }

    /// Three sides: two ends, one whole corner, one half way between the angles.
    #[test]
    fn a_bead_stands_at_its_ends_and_corners() {
        let (s, c) = 0.3_f64.sin_cos();
        let sides = [
            [10.0, 0.0],
            [10.0, 10.0],
            [10.0 - 10.0 * s, 10.0 + 10.0 * c],
        ];
        let found = places(&sides.map(|p| (Move::Line, p)));
        assert_eq!(found, [(0.0, 1.5), (10.0, 0.6), (20.0, 0.3), (30.0, 1.5)]);
    }

    #[test]
    fn a_round_turn_is_no_corner() {
        let h = 0.5_f64.sqrt();
        let via = DVec3::new(10.0 + h, 1.0 - h, 0.0);
        let found = places(&[(Move::Line, [10.0, 0.0]), (Move::Arc { via }, [11.0, 1.0])]);
        assert_eq!(found.len(), 2, "{found:?}");
    }
}
