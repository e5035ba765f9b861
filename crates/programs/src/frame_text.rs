//! How a controller shows where a frame lies.

use meltpath_geometry::Pose;

use crate::orientation::{quaternion_of, rotation_vector_of, xyz_of_wpr};
use crate::program::Dialect;
use crate::written::short;

/// A place as people write it for a controller: mm and degrees, m and rad for a Universal Robot.
pub fn shown(dialect: Dialect, pose: &Pose) -> String {
    let list = |values: &[f64], digits| {
        let all: Vec<String> = values.iter().map(|v| short(*v, digits)).collect();
        all.join(", ")
    };
    let at = pose.position.to_array();
    let wpr = pose.wpr().to_array().map(f64::to_degrees);
    match dialect {
        Dialect::UrScript => {
            let at = list(&at.map(|v| v / 1000.0), 6);
            format!("p[{at}, {}]", list(&rotation_vector_of(wpr), 6))
        }
        Dialect::Rapid => format!("[[{}], [{}]]", list(&at, 3), list(&quaternion_of(wpr), 7)),
        Dialect::Val3 => {
            let turned = list(&xyz_of_wpr(wpr), 4);
            format!("x, y, z {} mm, rx, ry, rz {turned} deg", list(&at, 3))
        }
        Dialect::FanucLs | Dialect::Krl | Dialect::Inform => {
            format!("{} mm, {} deg", list(&at, 3), list(&wpr, 4))
        }
    }
}
