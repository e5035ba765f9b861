//! Frames as files write them, each made sure to be rigid.

use meltpath_base::settings::{Problem, Setting};
use meltpath_base::{Angle, Length};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};

use super::file::FrameTable;

/// How far written axes may be from unit length, right angles and the right hand: calibrations print four digits.
const RIGID: f64 = 1e-3;

/// The pose of a position and its angles.
pub(super) fn pose(position: [Length; 3], angles: [Angle; 3]) -> Pose {
    Pose::from_wpr(
        DVec3::from_array(position.map(|l| l.0)),
        DVec3::from_array(angles.map(|a| a.0)),
    )
}

/// The pose that a table writes, or what is wrong with it.
pub(super) fn of_table(table: &Setting<FrameTable>, problems: &mut Vec<Problem>) -> Pose {
    let written = pose(*table.position, *table.angles);
    let Some(axes) = *table.axes else {
        return written;
    };
    if table.angles.is_written() {
        let message = format!(
            "{} writes angles and axes: one of them is enough",
            table.name
        );
        problems.push(table.axes.problem(message));
    }
    let matrix = DMat3::from_cols(
        DVec3::from_array(axes[0]),
        DVec3::from_array(axes[1]),
        DVec3::from_array(axes[2]),
    );
    let off = matrix.transpose() * matrix - DMat3::IDENTITY;
    let worst = (0..3)
        .map(|i| off.col(i).abs().max_element())
        .fold(0.0, f64::max);
    if worst > RIGID || matrix.determinant() < 0.0 {
        let what = if worst > RIGID {
            format!("off unit length or right angles by {worst:.4}")
        } else {
            "left-handed".to_owned()
        };
        let problem = table
            .axes
            .problem(format!("{}.axes is no rigid frame: {what}", table.name));
        problems.push(
            problem.help("write unit axes at right angles, z = x × y, one axis in each list"),
        );
    }
    // the nearest rotation keeps z, the axis that matters most, and turns x into its plane
    let z = matrix.z_axis.normalize_or(DVec3::Z);
    let y = z.cross(matrix.x_axis).normalize_or(DVec3::Y);
    let rigid = DMat3::from_cols(y.cross(z), y, z);
    Pose {
        orientation: DQuat::from_mat3(&rigid),
        ..written
    }
}
