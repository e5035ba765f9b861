//! What a gun makes of paths, from outside.
#![allow(clippy::unwrap_used, reason = "a test that fails stops here")]

mod demands;
mod follow;

use meltpath_geometry::math::DVec3;
use meltpath_gun::Machine;
use meltpath_toolpath::{MotionBlock, Times};

/// A gun of which a file's lines are known.
fn gun(lines: &str) -> Machine {
    let text = format!("schema = 1\nname = \"mine\"\nsource = \"its log\"\n{lines}");
    meltpath_gun::machine::parse(&text).unwrap()
}

/// A motion through points: time (s), x and y (mm), power on the way there (W).
fn motion(points: &[[f64; 4]]) -> MotionBlock {
    MotionBlock {
        times: Times::Each(points.iter().map(|p| p[0]).collect()),
        position: points.iter().map(|p| DVec3::new(p[1], p[2], 0.0)).collect(),
        power: points.iter().map(|p| p[3]).collect(),
        spot: vec![0.4; points.len()],
        ..MotionBlock::default()
    }
}
