//! What of a mesh of any make counts as its inside: what sees hardly anything of the world around. Holds for several shells that reach into each
//! other, for triangles that show either way, and for meshes with gaps, whose inside no sign of a distance tells.

use crate::Mesh;
use crate::distance::Distance;
use crate::math::DVec3;

/// Directions in which a place looks.
const DIRECTIONS: u32 = 24;
/// A place that sees the world in fewer of them lies inside: through gaps in a skin little is seen.
const SEEN: u32 = 3;

/// A mesh that is asked what lies in it.
#[derive(Debug)]
pub struct Sight {
    of: Distance,
}

impl Sight {
    /// Of a mesh with finite vertices; its own copy is kept.
    pub fn new(mesh: &Mesh) -> Self {
        Sight {
            of: Distance::new(mesh),
        }
    }

    /// The triangle that is nearest to a point, by its corners, and how far it is, mm; nothing of a mesh without any.
    pub fn nearest(&self, p: DVec3) -> Option<([DVec3; 3], f64)> {
        self.of.nearest_face(p)
    }

    /// Whether a point lies inside. One that a closed skin surrounds does; one in a hollow that is open to less than an eighth of all directions is
    /// taken for inside, too.
    ///
    /// ```
    /// use meltpath_geometry::{math::DVec3, shapes::cuboid, sight::Sight};
    /// let cube = Sight::new(&cuboid(DVec3::ZERO, DVec3::ONE));
    /// assert!(cube.is_inside(DVec3::splat(0.4)) && !cube.is_inside(DVec3::splat(1.1)));
    /// ```
    pub fn is_inside(&self, p: DVec3) -> bool {
        let mut seen = 0;
        for i in 0..DIRECTIONS {
            seen += u32::from(!self.of.is_met(p, direction(i)));
            if seen == SEEN {
                return false;
            }
            if seen + DIRECTIONS - 1 - i < SEEN {
                break;
            }
        }
        true
    }
}

/// Even directions on the sphere, none along an axis, neighbours far apart. Source: Swinbank, Purser 2006, "Fibonacci grids", Q. J. R.
/// Meteorol. Soc. 132.
fn direction(i: u32) -> DVec3 {
    // steps prime to their number: the first ones lie all over
    let k = f64::from(i * 13 % DIRECTIONS);
    let z = 1.0 - (2.0 * k + 1.0) / f64::from(DIRECTIONS);
    let angle = k * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let out = (1.0 - z * z).sqrt();
    DVec3::new(out * angle.cos(), out * angle.sin(), z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::cuboid;

    fn cube(low: f64, high: f64) -> Mesh {
        cuboid(DVec3::splat(low), DVec3::splat(high))
    }

    /// Of two that reach into each other, turned inside out, and without a triangle.
    #[test]
    fn whatever_its_make_the_inside_is_inside() {
        let mut two = cube(0.0, 10.0);
        two.add(&cube(5.0, 20.0));
        let mut turned = two.clone();
        turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        for mesh in [&two, &turned] {
            let sight = Sight::new(mesh);
            for (at, inside) in [(1.0, true), (7.0, true), (19.0, true), (20.1, false)] {
                assert_eq!(sight.is_inside(DVec3::splat(at)), inside, "{at}");
            }
            assert!(!sight.is_inside(DVec3::new(12.0, 4.0, 4.0)));
        }
        // small triangles, of which one is missing
        let mut round = crate::shapes::revolve(
            &[[0.0, 0.0], [10.0, 0.0], [10.0, 20.0], [0.0, 20.0]].map(Into::into),
            40,
        );
        round.triangles.remove(17);
        assert!(Sight::new(&round).is_inside(DVec3::new(1.0, 2.0, 9.0)));
        // half of it away: a bowl
        let sight = Sight::new(&cube(0.0, 10.0));
        let mut bowl = cube(0.0, 10.0);
        bowl.triangles
            .retain(|t| !t.iter().all(|v| bowl.vertices[*v as usize].z > 9.0));
        assert!(!Sight::new(&bowl).is_inside(DVec3::new(5.0, 5.0, 8.0)));
        assert!(sight.is_inside(DVec3::new(5.0, 5.0, 8.0)));
        let nothing = Sight::new(&Mesh::default());
        assert!(!nothing.is_inside(DVec3::ZERO) && nothing.nearest(DVec3::ZERO).is_none());
    }

    #[test]
    fn the_nearest_triangle_is_told() {
        let sight = Sight::new(&cube(0.0, 10.0));
        let (corners, far) = sight.nearest(DVec3::new(3.0, 4.0, 12.0)).unwrap();
        assert!((far - 2.0).abs() < 1e-12 && corners.iter().all(|c| c.z == 10.0));
    }
}
