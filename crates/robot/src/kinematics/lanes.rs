//! The closed form of spherical wrists for many poses side by side: the steps of `OrthoParallel::solve` without branches, each way at the turns
//! nearest to the middle of the limits and checked by the chain from the angles returned.
//!
//! Every step is a loop over the poses of a block, which the compiler makes vector instructions of. The arithmetic is the same under all registers,
//! and so are the bits. Poses at or beside a singularity or the border of reach are named doubtful: there the solver of single poses decides.

#![expect(
    clippy::inline_always,
    reason = "the loops have to be compiled for the registers they are called under"
)]
#![expect(
    clippy::needless_range_loop,
    reason = "each step is one loop over all lanes of all it reads and writes"
)]

use std::f64::consts::{PI, TAU};

use meltpath_geometry::math::{DMat3, DVec3};
use meltpath_numerics::vector::Loop;

use super::angles::{atan2, rounded, sin_cos};
use super::ortho_parallel::OrthoParallel;
use super::planar::{ON_SHOULDER, ROUNDING, STRAIGHT};
use super::solution::{HELD, IN_LINE};

/// Poses of a block: two registers of the widest.
pub(super) const LANES: usize = 16;

/// So many times what the solver of single poses calls singular or at the border is doubtful.
const BESIDE: f64 = 2.0;

/// A number of each pose.
pub(super) type Lane = [f64; LANES];

const NONE: Lane = [0.0; LANES];

/// What the loops need to know of an arm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    lengths: OrthoParallel,
    /// The limits of what the controller shows, rad.
    low: [f64; 6],
    high: [f64; 6],
    /// How much of the second joint is added to the third in what is shown.
    coupling: f64,
    /// From the elbow to the centre of the wrist, mm.
    forearm: f64,
    /// How that line leans from the forearm, rad.
    lean: f64,
}

/// Poses of the flange: the rotation's columns, then the position in mm.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub(super) rotation: [Lane; 9],
    pub(super) position: [Lane; 3],
}

/// One way of each pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    /// Joint angles, rad.
    pub(super) angles: [Lane; 6],
    /// The least distance of a joint from its limits, rad; below zero beyond one.
    pub(super) margin: Lane,
    /// The joint that has it, from 0.
    pub(super) tightest: Lane,
}

/// The arm in front or behind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// One where the arm reaches the pose on this side, else zero.
    pub(super) reached: Lane,
    /// The first joint's angle, rad, and its sine and cosine from upright.
    q1: Lane,
    s1: Lane,
    k1: Lane,
    /// How far the wrist is out from the second joint, mm.
    out: Lane,
}

/// Second and third joint, rad, the sine and cosine of the second from upright, and of both together.
#[derive(Debug, Clone, Copy)]
struct Bent {
    q2: Lane,
    q3: Lane,
    s2: Lane,
    k2: Lane,
    s23: Lane,
    k23: Lane,
}

/// All ways of each pose.
#[derive(Debug, Clone)]
pub(super) struct Eight {
    /// In the order of the solver of single poses: front and back, elbow one way and the other, wrist one way and the other.
    pub(super) ways: [Way; 8],
    /// Front and back.
    pub(super) sides: [Side; 2],
    /// Above zero where the solver of single poses is to decide.
    pub(super) doubt: Lane,
    bent: [Bent; 2],
    /// Angles of the wrist from upright, rad.
    wrist: [Lane; 3],
}

impl Form {
    /// Of lengths, the limits of what the controller shows (rad), and how much of the second joint it adds to the third.
    pub(super) fn new(lengths: OrthoParallel, [low, high]: [[f64; 6]; 2], coupling: f64) -> Self {
        Form {
            lengths,
            low,
            high,
            coupling,
            forearm: lengths.a2.hypot(lengths.c3),
            lean: lengths.a2.atan2(lengths.c3),
        }
    }

    /// Where the loops' chain puts the flange, for joint angles in rad.
    pub(super) fn forward(&self, joints: [f64; 6]) -> (DMat3, DVec3) {
        let q = self.lengths.upright(joints);
        let turns = [q[0], q[1], q[1] + q[2], q[3], q[4], q[5]].map(sin_cos);
        let ([x, y, z], at) = chain(&self.lengths, turns);
        (
            DMat3::from_cols(x.into(), y.into(), z.into()),
            DVec3::from_array(at),
        )
    }
}

impl Block {
    pub(super) fn empty() -> Self {
        Block {
            rotation: [NONE; 9],
            position: [NONE; 3],
        }
    }
}

impl Eight {
    pub(super) fn none() -> Self {
        let way = Way {
            angles: [NONE; 6],
            margin: NONE,
            tightest: NONE,
        };
        let side = Side {
            reached: NONE,
            q1: NONE,
            s1: NONE,
            k1: NONE,
            out: NONE,
        };
        let bent = Bent {
            q2: NONE,
            q3: NONE,
            s2: NONE,
            k2: NONE,
            s23: NONE,
            k23: NONE,
        };
        Eight {
            ways: [way; 8],
            sides: [side; 2],
            doubt: NONE,
            bent: [bent; 2],
            wrist: [NONE; 3],
        }
    }
}

/// Finds all ways of a block.
pub(super) struct Solve<'a> {
    pub(super) form: &'a Form,
    pub(super) block: &'a Block,
    pub(super) found: &'a mut Eight,
}

impl Loop for Solve<'_> {
    #[inline(always)]
    fn run(self) {
        let Solve { form, block, found } = self;
        let Eight {
            ways,
            sides,
            doubt,
            bent,
            wrist,
        } = found;
        shoulder(form, block, sides, doubt);
        for (side, ways) in sides.iter_mut().zip(ways.chunks_exact_mut(4)) {
            elbow(form, block, side, bent, doubt);
            for (bent, ways) in bent.iter().zip(ways.chunks_exact_mut(2)) {
                turn_wrist((side, bent), block, wrist, doubt);
                for (way, over) in ways.iter_mut().zip([false, true]) {
                    finish(form, (side, bent), (wrist, over), way);
                    check(form, block, (side, bent), way, doubt);
                }
            }
        }
    }
}

/// One where it holds, else zero.
#[inline(always)]
fn one(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

/// At least zero.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// The angle of a joint from one that the arm upright counts, rad.
#[inline(always)]
fn counted(form: &Form, joint: usize, upright: f64) -> f64 {
    (upright - form.lengths.zero[joint]) * form.lengths.sign[joint]
}

/// The angle from upright of a joint's own.
#[inline(always)]
fn upright(form: &Form, joint: usize, angle: f64) -> f64 {
    form.lengths.sign[joint] * angle + form.lengths.zero[joint]
}

/// An angle at the turn nearest to the middle of its limits, where the controller shows it as `shown`.
#[inline(always)]
fn turned(form: &Form, joint: usize, angle: f64, shown: f64) -> f64 {
    let middle = 0.5 * (form.low[joint] + form.high[joint]);
    angle - TAU * rounded((shown - middle) * (1.0 / TAU))
}

/// How far a joint that is shown so is from its limits, rad.
#[inline(always)]
fn margin(form: &Form, joint: usize, shown: f64) -> f64 {
    let (below, above) = (shown - form.low[joint], form.high[joint] - shown);
    if below < above { below } else { above }
}

/// The centre of the wrist.
#[inline(always)]
fn centre(form: &Form, block: &Block, i: usize) -> [f64; 3] {
    let c4 = form.lengths.c4;
    [
        block.position[0][i] - c4 * block.rotation[6][i],
        block.position[1][i] - c4 * block.rotation[7][i],
        block.position[2][i] - c4 * block.rotation[8][i],
    ]
}

/// The first joint in front and behind.
#[inline(always)]
fn shoulder(form: &Form, block: &Block, [front, back]: &mut [Side; 2], doubt: &mut Lane) {
    let (a1, b) = (form.lengths.a1, form.lengths.b);
    for i in 0..LANES {
        let [x, y, _] = centre(form, block, i);
        let out = (x * x + y * y).sqrt();
        let forward = positive((out - b) * (out + b)).sqrt();
        let (towards, aside) = (atan2(y, x), atan2(b, forward));
        let q1 = counted(form, 0, towards - aside);
        let q1 = turned(form, 0, q1, q1);
        (front.s1[i], front.k1[i]) = sin_cos(upright(form, 0, q1));
        front.q1[i] = q1;
        front.out[i] = forward - a1;
        front.reached[i] = one(out > b.abs());
        let q1 = counted(form, 0, towards + aside + PI);
        let q1 = turned(form, 0, q1, q1);
        (back.s1[i], back.k1[i]) = sin_cos(upright(form, 0, q1));
        back.q1[i] = q1;
        back.out[i] = -forward - a1;
        back.reached[i] = one(out > b.abs());
        doubt[i] = one(forward < BESIDE * ON_SHOULDER);
    }
}

/// Second and third joint at the turns at which they are returned.
#[inline(always)]
fn turned_arm(form: &Form, q2: f64, q3: f64) -> (f64, f64) {
    let q2 = counted(form, 1, q2);
    let q2 = turned(form, 1, q2, q2);
    let q3 = counted(form, 2, q3);
    (q2, turned(form, 2, q3, q3 + form.coupling * q2))
}

/// Second and third joint, the elbow bent one way and the other: `planar::reach`.
#[inline(always)]
fn elbow(
    form: &Form,
    block: &Block,
    side: &mut Side,
    [one_way, other]: &mut [Bent; 2],
    doubt: &mut Lane,
) {
    let (l1, l2) = (form.lengths.c2, form.forearm);
    let (longest, difference) = (l1 + l2, l1 - l2);
    let shortest = difference.abs();
    for i in 0..LANES {
        let up = centre(form, block, i)[2] - form.lengths.c1;
        let out = side.out[i];
        let distance = (up * up + out * out).sqrt();
        let reached = side.reached[i] * one(distance <= longest) * one(distance >= shortest);
        let border = one((distance - longest).abs() < BESIDE * ROUNDING)
            + one((distance - shortest).abs() < BESIDE * ROUNDING);
        let over = positive((longest - distance) * (longest + distance));
        let under = positive((distance - difference) * (distance + difference));
        let bend = 2.0 * atan2(over.sqrt(), under.sqrt());
        // sine and cosine from those of the half
        let sum = over + under;
        let sine = 2.0 * (over * under).sqrt() / sum;
        let cosine = (under - over) / sum;
        let towards = atan2(out, up);
        let aside = atan2(l2 * sine, l1 + l2 * cosine);
        let flat = one(sine < BESIDE * STRAIGHT) + one(distance < BESIDE * ON_SHOULDER);
        let (q2, q3) = turned_arm(form, towards - aside, bend - form.lean);
        let (second, third) = (upright(form, 1, q2), upright(form, 2, q3));
        (one_way.s2[i], one_way.k2[i]) = sin_cos(second);
        (one_way.s23[i], one_way.k23[i]) = sin_cos(second + third);
        (one_way.q2[i], one_way.q3[i]) = (q2, q3);
        let (q2, q3) = turned_arm(form, towards + aside, -bend - form.lean);
        let (second, third) = (upright(form, 1, q2), upright(form, 2, q3));
        (other.s2[i], other.k2[i]) = sin_cos(second);
        (other.s23[i], other.k23[i]) = sin_cos(second + third);
        (other.q2[i], other.q3[i]) = (q2, q3);
        side.reached[i] = reached;
        doubt[i] += border + reached * flat;
    }
}

/// The wrist's angles from upright for an arm.
#[inline(always)]
fn turn_wrist(
    (side, bent): (&Side, &Bent),
    block: &Block,
    [fourth, fifth, sixth]: &mut [Lane; 3],
    doubt: &mut Lane,
) {
    let r = &block.rotation;
    for i in 0..LANES {
        let (s1, k1, s23, k23) = (side.s1[i], side.k1[i], bent.s23[i], bent.k23[i]);
        // what is left of the rotation after the arm's
        let (level_x, xy) = (k1 * r[0][i] + s1 * r[1][i], k1 * r[1][i] - s1 * r[0][i]);
        let (level_y, yy) = (k1 * r[3][i] + s1 * r[4][i], k1 * r[4][i] - s1 * r[3][i]);
        let (level_z, zy) = (k1 * r[6][i] + s1 * r[7][i], k1 * r[7][i] - s1 * r[6][i]);
        let xx = k23 * level_x - s23 * r[2][i];
        let yx = k23 * level_y - s23 * r[5][i];
        let zx = k23 * level_z - s23 * r[8][i];
        let zz = s23 * level_z + k23 * r[8][i];
        let sine = (zx * zx + zy * zy).sqrt();
        let (s4, k4) = (zy / sine, zx / sine);
        fourth[i] = atan2(zy, zx);
        fifth[i] = atan2(sine, zz);
        sixth[i] = atan2(k4 * xy - s4 * xx, k4 * yy - s4 * yx);
        doubt[i] += side.reached[i] * one(sine < BESIDE * IN_LINE);
    }
}

/// One way as it is returned, the wrist turned over or not.
#[inline(always)]
fn finish(
    form: &Form,
    (side, bent): (&Side, &Bent),
    (wrist, over): (&[Lane; 3], bool),
    way: &mut Way,
) {
    let (half, sign) = if over { (PI, -1.0) } else { (0.0, 1.0) };
    let [a1, a2, a3, a4, a5, a6] = &mut way.angles;
    for i in 0..LANES {
        let q4 = counted(form, 3, wrist[0][i] + half);
        let q4 = turned(form, 3, q4, q4);
        let q5 = counted(form, 4, sign * wrist[1][i]);
        let q5 = turned(form, 4, q5, q5);
        let q6 = counted(form, 5, wrist[2][i] + half);
        let q6 = turned(form, 5, q6, q6);
        let (q1, q2, q3) = (side.q1[i], bent.q2[i], bent.q3[i]);
        let mut least = margin(form, 0, q1);
        let mut tightest = 0.0;
        let others = [q2, q3 + form.coupling * q2, q4, q5, q6];
        for (joint, shown) in [1, 2, 3, 4, 5].into_iter().zip(others) {
            let next = margin(form, joint, shown);
            tightest = if next < least { joint as f64 } else { tightest };
            least = if next < least { next } else { least };
        }
        (way.margin[i], way.tightest[i]) = (least, tightest);
        (a1[i], a2[i], a3[i]) = (q1, q2, q3);
        (a4[i], a5[i], a6[i]) = (q4, q5, q6);
    }
}

/// Doubts where the chain of the returned angles does not hold the pose.
#[inline(always)]
fn check(form: &Form, block: &Block, (side, bent): (&Side, &Bent), way: &Way, doubt: &mut Lane) {
    let r = &block.rotation;
    for i in 0..LANES {
        let turns = [
            (side.s1[i], side.k1[i]),
            (bent.s2[i], bent.k2[i]),
            (bent.s23[i], bent.k23[i]),
            sin_cos(upright(form, 3, way.angles[3][i])),
            sin_cos(upright(form, 4, way.angles[4][i])),
            sin_cos(upright(form, 5, way.angles[5][i])),
        ];
        let ([x, y, z], at) = chain(&form.lengths, turns);
        let turned = apart(x, [r[0][i], r[1][i], r[2][i]])
            + apart(y, [r[3][i], r[4][i], r[5][i]])
            + apart(z, [r[6][i], r[7][i], r[8][i]]);
        let p = &block.position;
        let off = apart(at, [p[0][i], p[1][i], p[2][i]]);
        // the square of a small rotation is half the sum of squares of what it changes
        let held = one(off < HELD[0] * HELD[0]) * one(turned < 2.0 * HELD[1] * HELD[1]);
        doubt[i] += side.reached[i] * (1.0 - held);
    }
}

/// The columns of the flange's rotation and its position, mm, for the sines and cosines of the angles from upright: of the first joint, the second,
/// second and third together, the fourth, fifth and sixth.
#[inline(always)]
fn chain(p: &OrthoParallel, turns: [(f64, f64); 6]) -> ([[f64; 3]; 3], [f64; 3]) {
    let [first, (s2, k2), both, (s4, k4), (s5, k5), (s6, k6)] = turns;
    let ((s1, k1), (s23, k23)) = (first, both);
    let x = [k4 * k5 * k6 - s4 * s6, s4 * k5 * k6 + k4 * s6, -s5 * k6];
    let y = [-k4 * k5 * s6 - s4 * k6, -s4 * k5 * s6 + k4 * k6, s5 * s6];
    let z = carried([k4 * s5, s4 * s5, k5], first, both);
    let out = p.a1 + p.c2 * s2 + p.a2 * k23 + p.c3 * s23;
    let up = p.c1 + p.c2 * k2 - p.a2 * s23 + p.c3 * k23;
    let at = [
        k1 * out - s1 * p.b + p.c4 * z[0],
        s1 * out + k1 * p.b + p.c4 * z[1],
        up + p.c4 * z[2],
    ];
    ([carried(x, first, both), carried(y, first, both), z], at)
}

/// A direction of the wrist in the base.
#[inline(always)]
fn carried([x, y, z]: [f64; 3], (s1, k1): (f64, f64), (s23, k23): (f64, f64)) -> [f64; 3] {
    let level = k23 * x + s23 * z;
    [k1 * level - s1 * y, s1 * level + k1 * y, k23 * z - s23 * x]
}

/// The square of what lies between.
#[inline(always)]
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}
