//! Many poses at once against the same poses one by one.

use std::f64::consts::PI;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_numerics::random::Random;
use meltpath_numerics::vector::Level;
use meltpath_robot::kinematics::numeric::{apart, distance};
use meltpath_robot::kinematics::{Arm, Batch, Poses, Solution, Unreachable, Ways};

use super::adversarial::{lost, nasty};
use super::{all, anywhere};

/// All ways of every pose.
fn at_once(batch: &Batch<'_>, poses: &[Pose]) -> Vec<Result<Vec<Solution>, Unreachable>> {
    let mut ways = Ways::default();
    batch.inverse(&poses.iter().copied().collect(), &mut ways);
    assert_eq!(ways.len(), poses.len());
    (0..poses.len())
        .map(|i| ways.of(i).map(Iterator::collect))
        .collect()
}

/// Holds what is found at once against what is found one by one: the same ways in the same order, each of which holds its pose.
fn agree(name: &str, arm: &Arm, poses: &[Pose]) {
    let found = at_once(&Batch::of(arm), poses);
    for (pose, found) in poses.iter().zip(found) {
        let found = match (found, arm.inverse(*pose)) {
            (Err(a), Err(b)) => {
                assert_eq!(a, b, "{name}: {pose:?}");
                continue;
            }
            (Ok(found), Ok(known)) => (found, known.solutions),
            (found, known) => panic!("{name}: {found:?} but {known:?} of {pose:?}"),
        };
        let (found, known) = found;
        assert_eq!(found.len(), known.len(), "{name}: {found:?} but {known:?}");
        for (a, b) in found.iter().zip(&known) {
            let [off, turned] = distance(arm.forward(a.angles), *pose);
            assert!(off < 1e-6 && turned < 1e-9, "{name}: {off:e} {turned:e}");
            // a pose near a singularity holds fewer digits of the joints
            let digits = 1e-12 + lost(arm, &b.angles, 1e-14);
            let far = apart(&a.angles, &b.angles);
            assert!(far < digits, "{name}: {far:e} of {digits:e} at {b:?}");
            // half a turn from the middle of its limits either turn is as near
            let joints = arm.chain.joints.iter().zip(arm.shown(a.angles));
            let turned = joints.zip(arm.shown(b.angles)).all(|((joint, a), b)| {
                let middle = 0.5 * (joint.limits.low + joint.limits.high);
                (a - b).abs() < PI || ((a - middle).abs() - PI).abs() < 2.0 * digits
            });
            assert!(turned && a.singular == b.singular, "{name}: {a:?} {b:?}");
            assert!(
                (a.margin - b.margin).abs() < 2.0 * digits,
                "{name}: {a:?} {b:?}"
            );
            let limits = arm.chain.joints[a.tightest].limits;
            let own = limits.margin(arm.shown(a.angles)[a.tightest]);
            assert!((own - a.margin).abs() < 1e-12, "{name}: {a:?} {b:?}");
        }
    }
}

fn random_poses_agree(poses: u32, seed: u64) {
    let mut random = Random::new(seed);
    for (name, arm) in all() {
        let poses: Vec<Pose> = (0..poses)
            .map(|_| arm.forward(anywhere(&mut random)))
            .collect();
        agree(name, &arm, &poses);
    }
}

fn nasty_poses_agree(poses: u32, seed: u64) {
    let mut random = Random::new(seed);
    for (name, arm) in all() {
        let poses: Vec<Pose> = (0..poses)
            .map(|_| arm.forward(nasty(&arm, &mut random)))
            .collect();
        agree(name, &arm, &poses);
    }
}

#[test]
fn random_poses_are_solved_at_once_as_one_by_one() {
    random_poses_agree(5_000, 2);
}

#[test]
fn nasty_poses_are_solved_at_once_as_one_by_one() {
    nasty_poses_agree(5_000, 5);
}

#[test]
#[ignore = "long validation: tens of thousands of poses a robot"]
fn more_poses_are_solved_at_once_as_one_by_one() {
    random_poses_agree(20_000, 11);
    nasty_poses_agree(20_000, 12);
}

/// Poses out of reach, or anywhere in a box around the arm, and what is no pose at all.
#[test]
fn poses_out_of_reach_are_told_as_one_by_one() {
    let mut random = Random::new(8);
    for (name, arm) in all() {
        let mut poses: Vec<Pose> = (0..2_000)
            .map(|_| Pose {
                position: DVec3::new(
                    random.between(-2500.0, 2500.0),
                    random.between(-2500.0, 2500.0),
                    random.between(-1000.0, 2500.0),
                ),
                ..arm.forward(anywhere(&mut random))
            })
            .collect();
        poses.push(Pose::at(DVec3::new(1e9, 0.0, 0.0)));
        agree(name, &arm, &poses);
        let nowhere = Pose::at(DVec3::new(f64::NAN, 0.0, 0.0));
        for found in at_once(&Batch::of(&arm), &[poses[0], nowhere, poses[1]])
            .into_iter()
            .skip(1)
            .take(1)
        {
            assert!(found.is_err(), "{name}: {found:?}");
        }
    }
}

/// Whatever the number of poses and whatever stands beside a pose, its ways are the same bits, under all registers.
#[test]
fn ways_are_the_same_bits_in_any_company() {
    let mut random = Random::new(3);
    for (name, arm) in all() {
        let poses: Vec<Pose> = (0..70)
            .map(|_| arm.forward(anywhere(&mut random)))
            .collect();
        let [widest, portable] =
            [Level::widest(), Level::PORTABLE].map(|level| Batch::with(&arm, level));
        let known = at_once(&widest, &poses);
        for count in [0, 1, 2, 15, 16, 17, 31, 32, 33, 64, 70] {
            let last = poses.len() - count;
            assert_eq!(at_once(&widest, &poses[last..]), known[last..], "{name}");
            assert_eq!(at_once(&portable, &poses[..count]), known[..count]);
        }
        let again: Poses = poses.iter().copied().collect();
        assert_eq!(again.len(), poses.len());
        assert!((0..poses.len()).all(|i| again.at(i) == poses[i]));
    }
}

/// Of random poses hardly any is left to the solver of single poses; what is left to it has its digits.
#[test]
fn spherical_wrists_are_solved_side_by_side() {
    let mut random = Random::new(6);
    for (name, arm) in all() {
        let poses: Vec<Pose> = (0..200)
            .map(|_| arm.forward(nasty(&arm, &mut random)))
            .collect::<Vec<_>>()
            .into_iter()
            .chain((7..207).map(|seed| arm.forward(anywhere(&mut Random::new(seed)))))
            .collect();
        let mut ways = Ways::default();
        Batch::of(&arm).inverse(&poses.iter().copied().collect(), &mut ways);
        for (i, pose) in poses.iter().enumerate().filter(|(i, _)| ways.is_alone(*i)) {
            let found = ways.of(i).map(Iterator::collect::<Vec<_>>);
            assert_eq!(found, arm.inverse(*pose).map(|known| known.solutions));
        }
        let alone = (200..400).filter(|i| ways.is_alone(*i)).count();
        let spherical = arm.configuration([0.1; 6]).is_some();
        assert_eq!(alone == 0, spherical, "{name}: {alone} by themselves");
    }
}
