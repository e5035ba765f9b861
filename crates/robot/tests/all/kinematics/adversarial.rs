//! Poses chosen to break the closed forms: at singularities and a hair beside them, at limits, at the border of reach.

use std::f64::consts::{PI, TAU};

use meltpath_numerics::Matrix;
use meltpath_numerics::dense::singular_values;
use meltpath_numerics::random::Random;
use meltpath_robot::kinematics::numeric::apart;
use meltpath_robot::kinematics::{Arm, Geometry, Solution};

use super::{all, anywhere, check, shipped};

/// A small number of any size, or none.
fn hair(random: &mut Random) -> f64 {
    match random.bits() % 4 {
        0 => 0.0,
        1 => -(10.0_f64.powf(random.between(-16.0, -2.0))),
        _ => 10.0_f64.powf(random.between(-16.0, -2.0)),
    }
}

/// Joints at a singularity, a limit or the border, or a hair beside.
pub(super) fn nasty(arm: &Arm, random: &mut Random) -> [f64; 6] {
    let mut joints = anywhere(random);
    let half_turns = |random: &mut Random| PI * f64::from((random.bits() % 3) as u32) - PI;
    for _ in 0..=random.bits() % 2 {
        match (random.bits() % 4, &arm.geometry) {
            // wrist in line
            (0, _) => joints[4] = half_turns(random) + hair(random),
            // stretched or folded
            (1, Geometry::SphericalWrist(p)) => {
                let bend = half_turns(random) + hair(random);
                joints[2] = (bend - p.a2.atan2(p.c3) - p.zero[2]) * p.sign[2];
            }
            (1, _) => joints[2] = half_turns(random) + hair(random),
            // the wrist on the first axis, as far as the arm can bring it there
            (2, Geometry::SphericalWrist(p)) => {
                let (k, lean) = (p.a2.hypot(p.c3), p.a2.atan2(p.c3));
                let q2 = p.sign[1] * joints[1] + p.zero[1];
                let sine = (-p.a1 - p.c2 * q2.sin()) / k;
                if sine.abs() <= 1.0 {
                    let q3 = sine.asin() - q2 - lean;
                    joints[2] = (q3 - p.zero[2]) * p.sign[2] + hair(random);
                }
            }
            // right angles
            (2, _) => joints = joints.map(|q| (q / (0.5 * PI)).round() * 0.5 * PI + hair(random)),
            // at limits
            _ => {
                let limits = arm.chain.joints.iter().map(|j| j.limits);
                let mut shown = arm.shown(joints);
                for (value, limit) in shown.iter_mut().zip(limits) {
                    if random.bits().is_multiple_of(2) {
                        *value = if random.bits().is_multiple_of(2) {
                            limit.low
                        } else {
                            limit.high
                        };
                    }
                }
                joints = arm.joints(shown);
            }
        }
    }
    joints
}

/// Whether a solution is the joints' own way to hold the pose, but for what is free or flat at a singularity.
fn same_way(arm: &Arm, solution: &Solution, joints: &[f64; 6]) -> bool {
    let singular = solution.singular;
    let offset = matches!(arm.geometry, Geometry::OffsetWrist(_));
    let (mut a, mut b) = (solution.angles, *joints);
    // the joints that a wrist in line sets free are the less certain the nearer it is
    let of_wrist: &[usize] = if offset { &[1, 2, 3, 5] } else { &[3, 5] };
    for i in of_wrist {
        let turns = ((a[*i] - b[*i]) / TAU).round();
        a[*i] = b[*i] + (a[*i] - b[*i] - TAU * turns) * joints[4].sin();
    }
    let mut free = |i: usize| (a[i], b[i]) = (0.0, 0.0);
    if singular.wrist {
        for i in of_wrist {
            free(*i);
        }
    }
    // a double root doubles the digits lost, and the wrist of an arm that is off by them may be near its own singularity
    if singular.elbow || singular.shoulder {
        [3, 4, 5].into_iter().for_each(&mut free);
    }
    // with an offset the two ways are one, without one the first joint is free
    let on_axis = matches!(arm.geometry, Geometry::SphericalWrist(p) if p.b == 0.0);
    if singular.shoulder && on_axis {
        [0, 3, 4, 5].into_iter().for_each(&mut free);
    }
    if singular.folded {
        [1, 3, 4, 5].into_iter().for_each(&mut free);
    }
    let tolerance = if singular.any() { 1e-4 } else { 1e-6 };
    apart(&a, &b) < tolerance + lost(arm, joints, 1e-15)
}

/// How far joint values may be off because the pose is known to `digits` only: these over the least singular value of how the flange
/// moves with the joints, lengths in metres, an arm's size.
pub(super) fn lost(arm: &Arm, joints: &[f64; 6], digits: f64) -> f64 {
    let columns = arm.chain.jacobian(joints);
    let entry = |row: usize, joint: usize| {
        let (moved, turned) = columns[joint];
        if row < 3 {
            moved[row] / 1000.0
        } else {
            turned[row - 3]
        }
    };
    let least = *singular_values(&Matrix::from_fn(6, 6, entry))
        .unwrap()
        .last()
        .unwrap();
    digits / least
}

fn holds(poses: u32) {
    let mut random = Random::new(4);
    for (name, arm) in all() {
        let mut singular = 0;
        for _ in 0..poses {
            let joints = nasty(&arm, &mut random);
            let solutions = check(name, &arm, arm.forward(joints));
            let found = solutions.iter().any(|s| same_way(&arm, s, &joints));
            assert!(found, "{name}: {joints:?} is not among {solutions:?}");
            singular += u32::from(solutions.iter().any(|s| s.singular.any()));
        }
        assert!(
            singular > poses / 4,
            "{name}: {singular} singular poses only"
        );
    }
}

#[test]
fn nasty_poses_are_held_and_named() {
    holds(2_000);
}

#[test]
#[ignore = "long validation: a hundred thousand poses a robot"]
fn a_hundred_thousand_nasty_poses_are_held_and_named() {
    holds(100_000);
}

/// Each singularity by its name, on an arm that has it.
#[test]
fn singularities_have_names() {
    let arm = shipped("staubli-rx60bl").arm;
    let named = |joints: [f64; 6]| {
        let found = check("RX60BL", &arm, arm.forward(joints));
        found
            .iter()
            .map(|s| s.singular.to_string())
            .collect::<Vec<_>>()
    };
    assert!(named([0.3, 0.4, 0.5, 0.6, 0.0, 0.8]).contains(&"wrist".to_owned()));
    assert!(named([0.3, 0.4, 0.0, 0.6, 0.7, 0.8]).contains(&"elbow".to_owned()));
    assert!(
        named([0.3, 0.4, PI, 0.6, 0.7, 0.8])
            .iter()
            .any(|n| n.contains("folded arm"))
    );
    // upright with both links alike: the wrist as near to the first axis as the offset of 49 mm lets it
    assert!(
        named([0.3, -0.5, 1.0, 0.6, 0.7, 0.8])
            .iter()
            .all(|n| n.contains("shoulder"))
    );
    assert!(
        named([0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
            .iter()
            .all(|n| n == "none")
    );
}
