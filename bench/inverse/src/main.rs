//! Inverse kinematics beside rs-opw-kinematics 3.0 in one run, for the robots with a spherical wrist that ship: poses a second and core, and whether
//! ours misses a way that it finds. `cargo run --release` looks at a million random and a hundred thousand nasty poses a robot;
//! `cargo run --release -- 10000 abb` at so many random and a tenth as many nasty ones, of the robots whose names begin so.

use std::f64::consts::{PI, TAU};

use meltpath_data::robots;
use meltpath_geometry::Pose;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::singular_values;
use meltpath_numerics::random::Random;
use meltpath_numerics::vector::Level;
use meltpath_robot::cell;
use meltpath_robot::kinematics::numeric::{apart, distance};
use meltpath_robot::kinematics::{Arm, Batch, Geometry, OrthoParallel, Poses, Solution, Ways};
use rs_opw_kinematics::glam;
use rs_opw_kinematics::kinematic_traits::{Kinematics, Pose as TheirPose};
use rs_opw_kinematics::kinematics_impl::OPWKinematics;
use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

/// Poses that are solved at once.
const CHUNK: usize = 10_000;

/// The same arm; lengths in metres, as theirs are.
fn theirs(arm: &OrthoParallel) -> OPWKinematics {
    OPWKinematics::new(Parameters {
        a1: arm.a1 / 1000.0,
        a2: arm.a2 / 1000.0,
        b: arm.b / 1000.0,
        c1: arm.c1 / 1000.0,
        c2: arm.c2 / 1000.0,
        c3: arm.c3 / 1000.0,
        c4: arm.c4 / 1000.0,
        offsets: arm.zero.map(|zero| -zero),
        sign_corrections: arm.sign.map(|sign| sign as i8),
        dof: 6,
    })
}

fn their_pose(pose: Pose) -> TheirPose {
    TheirPose::from_parts(
        glam::DVec3::from_array((pose.position / 1000.0).to_array()),
        glam::DQuat::from_array(pose.orientation.to_array()),
    )
}

fn anywhere(random: &mut Random) -> [f64; 6] {
    std::array::from_fn(|_| random.between(-PI, PI))
}

/// A small number of any size, or none.
fn hair(random: &mut Random) -> f64 {
    let size = 10.0_f64.powf(random.between(-16.0, -2.0));
    [0.0, -size, size, size][(random.bits() % 4) as usize]
}

/// At a singularity of wrist, elbow or shoulder, at right angles or limits, or a hair beside.
fn nasty(arm: &Arm, p: &OrthoParallel, random: &mut Random) -> [f64; 6] {
    let mut joints = anywhere(random);
    for _ in 0..=random.bits() % 2 {
        let half_turns = PI * ((random.bits() % 3) as f64 - 1.0);
        match random.bits() % 5 {
            0 => joints[4] = half_turns + hair(random),
            1 => {
                let bend = half_turns + hair(random);
                joints[2] = (bend - p.a2.atan2(p.c3) - p.zero[2]) * p.sign[2];
            }
            2 => {
                let second = p.sign[1] * joints[1] + p.zero[1];
                let sine = (-p.a1 - p.c2 * second.sin()) / p.a2.hypot(p.c3);
                if sine.abs() <= 1.0 {
                    let third = sine.asin() - second - p.a2.atan2(p.c3);
                    joints[2] = (third - p.zero[2]) * p.sign[2] + hair(random);
                }
            }
            3 => joints = joints.map(|q| (q / (0.5 * PI)).round() * 0.5 * PI + hair(random)),
            _ => {
                let mut shown = arm.shown(joints);
                for (value, joint) in shown.iter_mut().zip(&arm.chain.joints) {
                    if random.bits() % 2 == 0 {
                        *value = joint.limits.low;
                    }
                }
                joints = arm.joints(shown);
            }
        }
    }
    joints
}

/// Whether a way of ours is theirs, but for what is free or flat at a singularity.
fn same_way(p: &OrthoParallel, ours: &Solution, theirs: &[f64; 6]) -> bool {
    let singular = ours.singular;
    let (mut a, mut b) = (ours.angles, *theirs);
    // the joints that a wrist in line sets free are the less certain the nearer it is
    for i in [3, 5] {
        let turns = ((a[i] - b[i]) / TAU).round();
        a[i] = b[i] + (a[i] - b[i] - TAU * turns) * b[4].sin();
    }
    let mut free = |joints: &[usize]| {
        for i in joints {
            (a[*i], b[*i]) = (0.0, 0.0);
        }
    };
    if singular.wrist {
        free(&[3, 5]);
    }
    if singular.elbow || singular.shoulder {
        free(&[3, 4, 5]);
    }
    if singular.shoulder && p.b == 0.0 {
        free(&[0, 3, 4, 5]);
    }
    if singular.folded {
        free(&[1, 3, 4, 5]);
    }
    apart(&a, &b) < if singular.any() { 1e-3 } else { 1e-6 }
}

/// How far joints of a way that is off its pose may be from the way that is not: what it is off (metres, rad) over the least singular value of how
/// the flange moves with the joints.
fn lost(arm: &Arm, joints: &[f64; 6], off: f64) -> f64 {
    let columns = arm.chain.jacobian(joints);
    let entry = |row: usize, joint: usize| {
        let (moved, turned) = columns[joint];
        if row < 3 {
            moved[row] / 1000.0
        } else {
            turned[row - 3]
        }
    };
    let values = singular_values(&Matrix::from_fn(6, 6, entry)).expect("finite");
    off / values.last().copied().unwrap_or(0.0)
}

#[derive(Default)]
struct Compared {
    poses: u32,
    /// Ways of theirs that hold the pose to 1e-6 mm and 1e-9 rad, and of these what ours has not.
    exact: u64,
    missed: u64,
    /// Those that hold it to their one part per million only, and of these what ours has not.
    loose: u64,
    loose_missed: u64,
    /// Ways that are ours as far as a way that is so much off its pose can tell, beside a singularity.
    alike: u64,
    /// Poses for which they find nothing and we do, and the other way round.
    they_none: u32,
    we_none: u32,
    /// The first way that is missed.
    first: Option<String>,
}

fn compare(arm: &Arm, p: &OrthoParallel, poses: &[Pose], told: &mut Compared) {
    let (batch, opw) = (Batch::of(arm), theirs(p));
    let mut ways = Ways::default();
    for poses in poses.chunks(CHUNK) {
        batch.inverse(&poses.iter().copied().collect::<Poses>(), &mut ways);
        for (i, pose) in poses.iter().enumerate() {
            let ours: Vec<Solution> = ways.of(i).map_or_else(|_| Vec::new(), Iterator::collect);
            let found = opw.inverse(&their_pose(*pose));
            told.poses += 1;
            told.they_none += u32::from(found.is_empty() && !ours.is_empty());
            told.we_none += u32::from(ours.is_empty() && !found.is_empty());
            for way in found {
                let [off, turned] = distance(arm.forward(way), *pose);
                let exact = off < 1e-6 && turned < 1e-9;
                let mut missed = !ours.iter().any(|s| same_way(p, s, &way));
                if missed {
                    // near a singularity a way that is off its pose a little is off in its joints by much
                    let digits = 10.0 * lost(arm, &way, off / 1000.0 + turned + 1e-15);
                    let near = ours.iter().any(|s| apart(&s.angles, &way) < digits);
                    told.alike += u64::from(near);
                    missed = !near;
                }
                let (all, lacking) = if exact {
                    (&mut told.exact, &mut told.missed)
                } else {
                    (&mut told.loose, &mut told.loose_missed)
                };
                *all += 1;
                *lacking += u64::from(missed);
                if missed && told.first.is_none() {
                    told.first = Some(format!("{off:e} mm, {turned:e} rad off: {way:?} of {ours:?}"));
                }
            }
        }
    }
}

/// Nanoseconds that this thread has computed: other programs on the machine do not count.
fn computed() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let first = text.split(' ').next().and_then(|n| n.parse().ok());
    first.expect("nanoseconds")
}

/// Poses a second over some seconds: the clock of threads goes in steps of milliseconds.
fn speed(count: usize, mut run: impl FnMut() -> usize) -> f64 {
    let since = computed();
    let mut runs = 0.0;
    loop {
        std::hint::black_box(run());
        runs += 1.0;
        let taken = computed() - since;
        if taken > 2e9 {
            return 1e9 * runs * count as f64 / taken;
        }
    }
}

fn main() {
    let given = std::env::args().nth(1).and_then(|n| n.parse().ok());
    let count: u32 = given.unwrap_or(1_000_000);
    println!("registers: {:?}", Level::widest());
    let wanted = std::env::args().nth(2).unwrap_or_default();
    for file in robots::ALL.iter().filter(|f| f.name.starts_with(&wanted)) {
        let arm = cell::read(file.text).expect("a cell that ships").arm;
        let Geometry::SphericalWrist(p) = arm.geometry else {
            continue;
        };
        let mut random = Random::new(1);
        let poses: Vec<Pose> = (0..CHUNK).map(|_| arm.forward(anywhere(&mut random))).collect();
        let together: Poses = poses.iter().copied().collect();
        let their_poses: Vec<TheirPose> = poses.iter().map(|p| their_pose(*p)).collect();
        let opw = theirs(&p);
        let mut ways = Ways::default();
        let of_level = |level: Level, ways: &mut Ways| {
            let batch = Batch::with(&arm, level);
            speed(CHUNK, || {
                batch.inverse(&together, ways);
                ways.len()
            })
        };
        let widest = of_level(Level::widest(), &mut ways);
        let portable = of_level(Level::PORTABLE, &mut ways);
        let alone = speed(CHUNK, || {
            let found = poses.iter().filter_map(|p| arm.inverse(*p).ok());
            found.map(|f| f.solutions.len()).sum()
        });
        let opw_alone = speed(CHUNK, || their_poses.iter().map(|p| opw.inverse(p).len()).sum());
        println!(
            "{}: at once {:.2} (without vector registers {:.2}), one by one {:.2}, rs-opw {:.2} million poses/s and core",
            file.name,
            1e-6 * widest,
            1e-6 * portable,
            1e-6 * alone,
            1e-6 * opw_alone,
        );
        let mut told = [Compared::default(), Compared::default()];
        for _ in 0..count.div_ceil(100_000) {
            let poses: Vec<Pose> = (0..count.min(100_000))
                .map(|_| arm.forward(anywhere(&mut random)))
                .collect();
            compare(&arm, &p, &poses, &mut told[0]);
        }
        let poses: Vec<Pose> = (0..count / 10)
            .map(|_| arm.forward(nasty(&arm, &p, &mut random)))
            .collect();
        compare(&arm, &p, &poses, &mut told[1]);
        for (kind, told) in ["random", "nasty"].into_iter().zip(told) {
            println!(
                "  {} {kind} poses: of {} ways of rs-opw {} are missed; of {} more that miss the pose by over 1e-6 mm or 1e-9 rad {}; {} are ours but for the digits that a singularity takes; nothing found for {} poses by rs-opw, {} by ours",
                told.poses, told.exact, told.missed, told.loose, told.loose_missed, told.alike, told.they_none, told.we_none,
            );
            if let Some(first) = told.first {
                println!("  the first: {first}");
            }
        }
    }
}
