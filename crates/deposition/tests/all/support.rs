//! Motion and beads for the deposition tests: ideal constant-speed paths.

use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

/// Table 3.3, V_f 8, V_r 0.75 m/min.
pub(crate) const POOL: PoolModel = PoolModel {
    front: 3.6,
    rear: 10.8,
    half_width: 3.6,
    offset: 1.66,
    pursuit: PursuitLength::Fixed(4.0),
};

/// The seed bead: V_f 8, V_r 0.75 m/min, k_f 1.15, wire 1.0 mm.
pub(crate) fn seed_bead() -> BeadModel {
    let wire_section = std::f64::consts::PI / 4.0;
    BeadModel {
        width: 6.54,
        area: 1.15 * (8.0 / 0.75) * wire_section,
        wire_section,
        efficiency: 1.0,
        width_exponent: 0.345,
        feed_exponent: 0.446,
    }
}

pub(crate) const SPEED: f64 = 12.5;
pub(crate) const DT: f64 = 0.012;

/// Lays one bead along a polyline at constant speed, after a travel with the arc off.
pub(crate) fn bead(
    sink: &mut impl MotionSink,
    path: &[DVec3],
    command: u32,
    clock: &mut f64,
    area: f64,
) {
    let wire_per_mm = area / (std::f64::consts::PI / 4.0);
    let mut block = MotionBlock {
        times: Times::Uniform { t0: *clock, dt: DT },
        ..MotionBlock::default()
    };
    let mut push = |p: DVec3, wire: f64| {
        block.position.push(p);
        block.speed.push(SPEED);
        block.wire.push(wire);
        block.command.push(command);
    };
    push(path[0], 0.0);
    for w in path.windows(2) {
        let length = w[0].distance(w[1]);
        let n = (length / (SPEED * DT)).ceil();
        for k in 1..=n as u32 {
            push(w[0].lerp(w[1], f64::from(k) / n), wire_per_mm * length / n);
        }
    }
    *clock += DT * block.len() as f64;
    sink.block(&block);
    let last = *path.last().unwrap();
    sink.block(&MotionBlock {
        times: Times::Uniform { t0: *clock, dt: DT },
        position: vec![last],
        speed: vec![0.0],
        wire: vec![0.0],
        command: vec![command],
        axis: vec![],
        ..MotionBlock::default()
    });
    *clock += DT;
}

pub(crate) fn xyz(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

pub(crate) fn turned(path: &[DVec3], angle: f64) -> Vec<DVec3> {
    let r = DVec2::from_angle(angle);
    path.iter()
        .map(|p| r.rotate(p.truncate()).extend(p.z))
        .collect()
}
