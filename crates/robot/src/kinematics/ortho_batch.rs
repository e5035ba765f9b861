//! The closed form of spherical wrists for eight poses at once: the steps of [`OrthoParallel::solve`] without branches, each way
//! checked by the chain from its returned angles.

use super::lanes::{Lanes, Mask, WIDTH, both};
use super::ortho_parallel::{IN_LINE, ON_AXIS, OrthoParallel, ROUNDING};
use super::planar::{ON_SHOULDER, STRAIGHT};
use super::solution::HELD;

/// Poses of the flange: the rotation's columns, then the position in mm.
pub(super) struct Block {
    pub(super) rotation: [Lanes; 9],
    pub(super) position: [Lanes; 3],
}

/// One way for each pose of a block.
pub(super) struct Way {
    /// The robot's angles, rad.
    pub(super) angles: [Lanes; 6],
    /// Where the chain holds the pose with them.
    pub(super) held: Mask,
    /// Where it is singular.
    pub(super) singular: Mask,
}

/// Sines and cosines of the first three joints: of the first, of the second, of second and third together.
struct ArmTurns {
    s1: Lanes,
    k1: Lanes,
    s2: Lanes,
    k2: Lanes,
    s23: Lanes,
    k23: Lanes,
}

impl OrthoParallel {
    /// The eight ways of each pose; `see` is shown them one after the other.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "numbers stay in vector registers only where nothing is called"
    )]
    pub(super) fn solve_block(&self, block: &Block, mut see: impl FnMut(usize, Way)) {
        let all = Lanes::all;
        let r = &block.rotation;
        let c4 = all(self.c4);
        let centre = [0, 1, 2].map(|i| block.position[i] - c4 * r[6 + i]);
        let out = centre[0].length(centre[1]);
        let b = all(self.b);
        let beside = all(self.b.abs() - ROUNDING).below(out);
        let forward = ((out - b) * (out + b)).positive().sqrt();
        let towards = centre[1].atan2(centre[0]);
        let aside = b.atan2(forward);
        let on_axis = forward.below(all(ON_AXIS));
        let half = all(std::f64::consts::PI);
        let sides = [
            (towards - aside, forward - all(self.a1)),
            (towards + aside + half, -forward - all(self.a1)),
        ];
        let (l1, l2) = (self.c2, self.a2.hypot(self.c3));
        let lean = self.a2.atan2(self.c3);
        let mut number = 0;
        for (q1, x) in sides {
            let up = centre[2] - all(self.c1);
            let distance = up.length(x);
            let reached = both(
                distance.below(all(l1 + l2 + ROUNDING)),
                all((l1 - l2).abs() - ROUNDING).below(distance),
            );
            let over = ((all(l1 + l2) - distance) * (all(l1 + l2) + distance)).positive();
            let under = ((distance - all(l1 - l2)) * (distance + all(l1 - l2))).positive();
            let bend = all(2.0) * over.sqrt().atan2(under.sqrt());
            // half-angle formulas of the bend
            let sum = over + under;
            let sine = all(2.0) * (over * under).sqrt() / sum;
            let cosine = (under - over) / sum;
            let to_wrist = x.atan2(up);
            let to_elbow = (all(l2) * sine).atan2(all(l1) + all(l2) * cosine);
            let flat = sine.below(all(STRAIGHT));
            let folded = distance.below(all(ON_SHOULDER));
            let reached = both(beside, reached);
            for (q2, bend) in [(to_wrist - to_elbow, bend), (to_wrist + to_elbow, -bend)] {
                let q3 = bend - all(lean);
                let arm = [q1, q2, q3];
                let singular: Mask = std::array::from_fn(|i| on_axis[i] | flat[i] | folded[i]);
                for way in self.wrist_block(block, &centre, arm) {
                    let held = both(way.held, reached);
                    let singular: Mask = std::array::from_fn(|i| singular[i] | way.singular[i]);
                    see(
                        number,
                        Way {
                            held,
                            singular,
                            ..way
                        },
                    );
                    number += 1;
                }
            }
        }
    }

    /// The robot's angles of the upright ones, and these again from them: what the chain makes of the returned angles.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "see `solve_block`")]
    fn returned<const N: usize>(
        &self,
        first: usize,
        upright: [Lanes; N],
    ) -> ([Lanes; N], [Lanes; N]) {
        let shown = std::array::from_fn(|i| {
            (upright[i] - Lanes::all(self.zero[first + i])) * Lanes::all(self.sign[first + i])
        });
        let again = std::array::from_fn(|i| {
            Lanes::all(self.sign[first + i]) * shown[i] + Lanes::all(self.zero[first + i])
        });
        (shown, again)
    }

    /// The two ways of the wrist for an arm, with the arm's angles.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "see `solve_block`")]
    fn wrist_block(&self, block: &Block, centre: &[Lanes; 3], upright: [Lanes; 3]) -> [Way; 2] {
        let (arm, [q1, q2, q3]) = self.returned(0, upright);
        let ((s1, k1), (s2, k2), (s23, k23)) = (q1.sin_cos(), q2.sin_cos(), (q2 + q3).sin_cos());
        let turns = ArmTurns {
            s1,
            k1,
            s2,
            k2,
            s23,
            k23,
        };
        let r = &block.rotation;
        // the rest of the rotation after the arm's, by columns
        let rest: [[Lanes; 3]; 3] = std::array::from_fn(|column| {
            let [x, y, z] = [0, 1, 2].map(|i| r[3 * column + i]);
            let level = k1 * x + s1 * y;
            [
                k23 * level - s23 * z,
                k1 * y - s1 * x,
                s23 * level + k23 * z,
            ]
        });
        let [rx, ry, rz] = rest;
        let sine = rz[0].length(rz[1]);
        let in_line = sine.below(Lanes::all(IN_LINE));
        let free = sine.below(Lanes::all(1e-14));
        let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
        let q4 = zero.where_or(free, rz[1].atan2(rz[0]));
        let safe = one.where_or(free, sine);
        let (s4, k4) = (
            zero.where_or(free, rz[1] / safe),
            one.where_or(free, rz[0] / safe),
        );
        let q5 = (k4 * rz[0] + s4 * rz[1]).atan2(rz[2]);
        let q6 = (k4 * rx[1] - s4 * rx[0]).atan2(k4 * ry[1] - s4 * ry[0]);
        let half = Lanes::all(std::f64::consts::PI);
        let ways = [[q4, q5, q6], [q4 + half, -q5, q6 + half]];
        ways.map(|upright| {
            let (wrist, again) = self.returned(3, upright);
            Way {
                angles: [arm[0], arm[1], arm[2], wrist[0], wrist[1], wrist[2]],
                held: self.holds(block, centre, &turns, again),
                singular: in_line,
            }
        })
    }

    /// Where the chain of returned angles holds the poses.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "see `solve_block`")]
    fn holds(&self, block: &Block, centre: &[Lanes; 3], arm: &ArmTurns, wrist: [Lanes; 3]) -> Mask {
        let all = Lanes::all;
        let [(s4, k4), (s5, k5), (s6, k6)] = wrist.map(Lanes::sin_cos);
        let ArmTurns {
            s1,
            k1,
            s2,
            k2,
            s23,
            k23,
        } = *arm;
        let columns = [
            [k4 * k5 * k6 - s4 * s6, s4 * k5 * k6 + k4 * s6, -s5 * k6],
            [-k4 * k5 * s6 - s4 * k6, -s4 * k5 * s6 + k4 * k6, s5 * s6],
            [k4 * s5, s4 * s5, k5],
        ];
        let mut square = all(0.0);
        let mut axis = [all(0.0); 3];
        for (column, [x, y, z]) in columns.into_iter().enumerate() {
            let level = k23 * x + s23 * z;
            let turned = [k1 * level - s1 * y, s1 * level + k1 * y, k23 * z - s23 * x];
            for (i, t) in turned.into_iter().enumerate() {
                let off = t - block.rotation[3 * column + i];
                square = square + off * off;
            }
            axis = turned;
        }
        let x = all(self.a1) + all(self.c2) * s2 + all(self.a2) * k23 + all(self.c3) * s23;
        let z = all(self.c1) + all(self.c2) * k2 - all(self.a2) * s23 + all(self.c3) * k23;
        let b = all(self.b);
        let wrist = [k1 * x - s1 * b, s1 * x + k1 * b, z];
        let mut far = all(0.0);
        for i in 0..3 {
            let at = wrist[i] + all(self.c4) * axis[i];
            let wanted = centre[i] + all(self.c4) * block.rotation[6 + i];
            far = far + (at - wanted) * (at - wanted);
        }
        both(
            far.below(all(HELD[0] * HELD[0])),
            square.below(all(2.0 * HELD[1] * HELD[1])),
        )
    }
}

/// How many poses a block has.
pub(super) const POSES: usize = WIDTH;
