//! Where the frame of a log lies: the rigid motion that brings points nearest to others.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::symmetric_eigen;

/// Whether a log may lie in another frame than its path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Freedom {
    /// In the same.
    Same,
    /// In another, rigidly.
    Rigid,
}

/// The pose that takes the first of each pair nearest to the second, by least squares; nothing where all lie on a line.
///
/// B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987.
pub fn nearest(pairs: &[(DVec3, DVec3)]) -> Option<Pose> {
    let n = pairs.len() as f64;
    let a = pairs.iter().map(|p| p.0).sum::<DVec3>() / n;
    let b = pairs.iter().map(|p| p.1).sum::<DVec3>() / n;
    let mut s = [[0.0; 3]; 3];
    for (p, q) in pairs {
        let (p, q) = ((*p - a).to_array(), (*q - b).to_array());
        for (row, p) in s.iter_mut().zip(p) {
            for (entry, q) in row.iter_mut().zip(q) {
                *entry += p * q;
            }
        }
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
    let form = Matrix::from_rows([
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ]);
    let found = symmetric_eigen(&form).ok()?;
    // on a line any turn about it is as good
    if found.values[3] - found.values[2] < 1e-3 * found.values[3].abs() {
        return None;
    }
    let v = |i: usize| found.vectors[(i, 3)];
    let orientation = DQuat::from_xyzw(v(1), v(2), v(3), v(0)).normalize();
    let position = b - orientation * a;
    (position.is_finite() && orientation.is_finite()).then_some(Pose {
        position,
        orientation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_polygon_is_brought_back() {
        let pose = Pose {
            position: DVec3::new(800.0, -30.0, 200.0),
            orientation: DQuat::from_rotation_z(2.0) * DQuat::from_rotation_x(0.4),
        };
        let points = [
            DVec3::ZERO,
            DVec3::X * 50.0,
            DVec3::new(50.0, 40.0, 0.0),
            DVec3::new(10.0, 60.0, 0.0),
        ];
        let pairs = points.map(|p| (p, pose.point(p)));
        let found = nearest(&pairs).unwrap();
        for (p, q) in pairs {
            assert!(found.point(p).distance(q) < 1e-9);
        }
        let line = [0.0, 1.0, 5.0].map(|x| (DVec3::X * x, DVec3::Y * x));
        assert_eq!(nearest(&line), None);
    }
}
