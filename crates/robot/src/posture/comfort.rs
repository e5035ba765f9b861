//! What a way to hold the torch costs: joint motion, and how near it is to limits and singularities.

use std::f64::consts::TAU;

use crate::kinematics::{Arm, Joint};

/// Greatest step of a joint between key places, rad: what is found between them is verified.
pub(super) const STEP: f64 = 1.0;

/// A joint or a singularity nearer than this, rad, costs as much per length as [`MOTION`].
const COMFORT: f64 = 0.35;

/// Nearer to a limit than this, rad, a way is as good as blocked: between key places it may come nearer still, and verdicts ask for 2°.
const KEPT: f64 = 0.05;

/// Joint motion that is taken to keep a joint [`COMFORT`] from its limit, rad/mm.
pub(super) const MOTION: f64 = 1e-3;

/// A length that weighs as much as a radian: of distance from a singularity, or of a track's way, mm.
pub const REACH: f64 = 1000.0;

/// A joint farther than this from the middle of its limits is wound up, rad.
const WOUND: f64 = 0.75 * TAU;

/// What a way costs per length, rad²/mm².
pub(super) fn discomfort(arm: &Arm, joints: [f64; 6]) -> f64 {
    // from twice as far on the distance from the limit is that from what is kept of it
    let limit = arm.margin(joints).0;
    let limit = limit.min(2.0 * (limit - KEPT));
    let singular = arm.nearness(joints).map_or(f64::INFINITY, |n| {
        n.wrist.min(n.elbow).min(n.shoulder.abs() / REACH)
    });
    let of = |distance: f64| (MOTION * COMFORT / distance.max(1e-3)).powi(2);
    of(limit) + of(singular)
}

/// Whether a joint winds up the cables.
pub(super) fn is_wound(arm: &Arm, joints: &[f64; 6]) -> bool {
    let wound = |(value, joint): (f64, &Joint)| {
        let middle = 0.5 * (joint.limits.low + joint.limits.high);
        (value - middle).abs() > WOUND
    };
    let mut shown = arm.shown(*joints).into_iter().zip(&arm.chain.joints);
    shown.any(wound)
}

/// Greatest step of a joint over a way that is followed before it is taken, rad: more than [`STEP`] where it is long.
pub(super) fn step_over(gone: f64) -> f64 {
    const LONG: f64 = 80.0;
    STEP * (gone / LONG).clamp(1.0, 3.0)
}

/// The squares of a step of the joints, rad²; nothing where one of them is greater than `most` rad.
pub(super) fn motion(a: &[f64; 6], b: &[f64; 6], most: f64) -> Option<f64> {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        let step = b - a;
        if step.abs() > most {
            return None;
        }
        sum += step * step;
    }
    Some(sum)
}
