//! Joint values by search, for chains without a closed form: damped least squares from many starts. What it returns was found;
//! that there is no more is never said.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DVec3};
use meltpath_numerics::random::Random;

use super::angles::whole;
use super::chain::Chain;
use super::solution::HELD;

/// A length that weighs as much as a radian, mm: about that of an arm.
const REACH: f64 = 1000.0;

/// Two solutions that differ by less in every joint are one, rad.
const SAME: f64 = 1e-6;

/// How far one pose is from another: position in mm, rotation in rad.
pub fn distance(a: Pose, b: Pose) -> [f64; 2] {
    // the vector part of the difference: exact near zero, where the arc cosine of the scalar part is not
    let turn = a.orientation.inverse() * b.orientation;
    let half = DVec3::new(turn.x, turn.y, turn.z).length();
    [
        a.position.distance(b.position),
        2.0 * half.atan2(turn.w.abs()),
    ]
}

/// Six joint values that hold `pose`, from `starts` random starts (the same for every call): different ones, in the order found.
pub fn search(chain: &Chain, pose: Pose, starts: u64) -> Vec<[f64; 6]> {
    let mut random = Random::new(15);
    let mut found: Vec<[f64; 6]> = Vec::new();
    for _ in 0..starts {
        let start =
            std::array::from_fn(|_| random.between(-std::f64::consts::PI, std::f64::consts::PI));
        let Some(angles) = descend(chain, pose, start) else {
            continue;
        };
        if found.iter().all(|known| apart(known, &angles) > SAME) {
            found.push(angles);
        }
    }
    found
}

/// The greatest difference of two sets of angles, whole turns aside, rad.
pub fn apart(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let turn = std::f64::consts::TAU;
    let differ = a.iter().zip(b).map(|(a, b)| {
        let d = a - b;
        (d - turn * whole(d / turn)).abs()
    });
    differ.fold(0.0, f64::max)
}

/// From a start down to a pose that is held, or nothing.
pub fn descend(chain: &Chain, pose: Pose, start: [f64; 6]) -> Option<[f64; 6]> {
    let mut angles = start;
    let mut damping = 1e-2;
    let (mut residual, mut error) = residual(chain, pose, &angles);
    for _ in 0..200 {
        if distance(chain.forward(&angles), pose)
            .iter()
            .zip(HELD)
            .all(|(d, held)| *d < 1e-3 * held)
        {
            break;
        }
        let columns: Vec<[f64; 6]> = chain
            .jacobian(&angles)
            .iter()
            .map(|(v, w)| [v.x / REACH, v.y / REACH, v.z / REACH, w.x, w.y, w.z])
            .collect();
        let Some(step) = damped(&columns, &residual, damping) else {
            damping *= 10.0;
            continue;
        };
        let next: [f64; 6] = std::array::from_fn(|i| angles[i] + step[i]);
        let (next_residual, next_error) = self::residual(chain, pose, &next);
        if next_error < error {
            (angles, residual, error) = (next, next_residual, next_error);
            damping = (damping * 0.1).max(1e-15);
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    let [position, rotation] = distance(chain.forward(&angles), pose);
    let turn = std::f64::consts::TAU;
    (position < HELD[0] && rotation < HELD[1])
        .then(|| angles.map(|a| a - turn * (a / turn).round()))
}

/// What is left to the pose, lengths in reaches, and its square.
fn residual(chain: &Chain, pose: Pose, angles: &[f64; 6]) -> ([f64; 6], f64) {
    let at = chain.forward(angles);
    let p = (pose.position - at.position) / REACH;
    let turn = pose.orientation * at.orientation.inverse();
    let half = DVec3::new(turn.x, turn.y, turn.z);
    let size = half.length();
    let angle = 2.0 * size.atan2(turn.w.abs()) * turn.w.signum();
    let w = if size > 0.0 {
        half * (angle / size)
    } else {
        DVec3::ZERO
    };
    let r = [p.x, p.y, p.z, w.x, w.y, w.z];
    (r, r.iter().map(|v| v * v).sum())
}

/// The step of least squares with damping, by elimination of the normal equations in blocks of three. `numerics` solves any number
/// of unknowns on the heap; here they are always six, and a search takes thousands of such steps.
fn damped(columns: &[[f64; 6]], residual: &[f64; 6], damping: f64) -> Option<[f64; 6]> {
    let columns: &[[f64; 6]; 6] = columns.try_into().ok()?;
    let dot = |a: &[f64; 6], b: &[f64; 6]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let block = |i: usize, j: usize| {
        let entry = |r: usize, c: usize| {
            let both = dot(&columns[i + r], &columns[j + c]);
            if i == j && r == c {
                both + damping
            } else {
                both
            }
        };
        let column = |c: usize| DVec3::new(entry(0, c), entry(1, c), entry(2, c));
        DMat3::from_cols(column(0), column(1), column(2))
    };
    let right = |i: usize| {
        let of = |k: usize| dot(&columns[i + k], residual);
        DVec3::new(of(0), of(1), of(2))
    };
    let (a, b, d) = (block(0, 0), block(0, 3), block(3, 3));
    let inverse = a.inverse();
    let schur = d - b.transpose() * inverse * b;
    let second = schur.inverse() * (right(3) - b.transpose() * inverse * right(0));
    let first = inverse * (right(0) - b * second);
    let step = [first.x, first.y, first.z, second.x, second.y, second.z];
    step.iter().all(|v| v.is_finite()).then_some(step)
}
