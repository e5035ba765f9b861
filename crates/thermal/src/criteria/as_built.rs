//! Shape of what was molten: diameter of a strut, thickness of a wall, from the voxels that became metal.
//!
//! Béraud 2016, section 3.2.2.1: the as-built geometry is the elements that became dense; a strut's diameter is that of
//! its least-squares cylinder.

use crate::grid::Field;

/// A vertical cylinder round the metal of a strut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strut {
    /// Its axis, mm.
    pub centre: [f64; 2],
    /// Its diameter, mm.
    pub diameter: f64,
    /// Root mean square distance of the rim from it, mm.
    pub roughness: f64,
}

/// The least-squares cylinder of the rim of the metal (values of at least 0.5) in planes `planes` of a field; the rim lies
/// halfway between metal and its neighbours, so that voxels do not add to the diameter. `None` with fewer than eight rim points.
pub fn strut(metal: &Field, planes: std::ops::Range<usize>) -> Option<Strut> {
    let rim = rim(metal, planes);
    if rim.len() < 8 {
        return None;
    }
    let n = rim.len() as f64;
    let mut centre = [0, 1].map(|a| rim.iter().map(|p| p[a]).sum::<f64>() / n);
    let mut radius = 0.0;
    // Gauss-Newton on the distances to the circle
    for _ in 0..50 {
        let reach = |p: &[f64; 2]| (p[0] - centre[0]).hypot(p[1] - centre[1]);
        radius = rim.iter().map(reach).sum::<f64>() / n;
        let mut shift = [0.0; 2];
        let mut normal = [[0.0; 2]; 2];
        for p in &rim {
            let d = reach(p).max(1e-12);
            let u = [(p[0] - centre[0]) / d, (p[1] - centre[1]) / d];
            for a in 0..2 {
                shift[a] += u[a] * (d - radius);
                for b in 0..2 {
                    normal[a][b] += u[a] * u[b];
                }
            }
        }
        let det = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
        if det.abs() < 1e-9 {
            return None;
        }
        let step = [
            (normal[1][1] * shift[0] - normal[0][1] * shift[1]) / det,
            (normal[0][0] * shift[1] - normal[1][0] * shift[0]) / det,
        ];
        centre = [centre[0] + step[0], centre[1] + step[1]];
        if step[0].hypot(step[1]) < 1e-9 {
            break;
        }
    }
    let off = |p: &[f64; 2]| ((p[0] - centre[0]).hypot(p[1] - centre[1]) - radius).powi(2);
    Some(Strut {
        centre,
        diameter: 2.0 * radius,
        roughness: (rim.iter().map(off).sum::<f64>() / n).sqrt(),
    })
}

/// Points halfway between metal and what is not.
fn rim(metal: &Field, planes: std::ops::Range<usize>) -> Vec<[f64; 2]> {
    let grid = &metal.grid;
    let [nx, ny] = grid.cells;
    let mut rim = Vec::new();
    for k in planes {
        let dense = |i: usize, j: usize| metal.at(i, j, k) >= 0.5;
        for j in 0..ny {
            for i in 0..nx {
                let c = grid.centre(i, j, k);
                if i + 1 < nx && dense(i, j) != dense(i + 1, j) {
                    rim.push([c.x + 0.5 * grid.edge[0], c.y]);
                }
                if j + 1 < ny && dense(i, j) != dense(i, j + 1) {
                    rim.push([c.x, c.y + 0.5 * grid.edge[1]]);
                }
            }
        }
    }
    rim
}

/// Thickness of a wall along x, between `x` limits, in planes `planes`: mean, and between the planes that enclose it as a
/// micrometer would find it, mm. `None` where there is no metal.
pub fn wall(metal: &Field, x: [f64; 2], planes: std::ops::Range<usize>) -> Option<[f64; 2]> {
    let grid = &metal.grid;
    let [nx, ny] = grid.cells;
    let (mut cells, mut rows) = (0, 0);
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for k in planes {
        for i in (0..nx).filter(|i| (x[0]..=x[1]).contains(&grid.centre(*i, 0, k).x)) {
            rows += 1;
            for j in (0..ny).filter(|j| metal.at(i, *j, k) >= 0.5) {
                cells += 1;
                let y = grid.centre(i, j, k).y;
                ends = [ends[0].min(y), ends[1].max(y)];
            }
        }
    }
    (cells > 0).then(|| {
        let mean = f64::from(cells) / f64::from(rows) * grid.edge[1];
        [mean, ends[1] - ends[0] + grid.edge[1]]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use meltpath_geometry::math::DVec3;
    use proptest::prelude::*;

    fn metal(inside: impl Fn(DVec3) -> bool) -> Field {
        let grid = Grid::covering(
            DVec3::new(-1.0, -1.0, -0.2),
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(0.04, 0.04, 0.05),
        )
        .unwrap();
        let [nx, ny] = grid.cells;
        let values = (0..grid.len())
            .map(|n| {
                f32::from(u8::from(inside(grid.centre(
                    n % nx,
                    n / nx % ny,
                    n / (nx * ny),
                ))))
            })
            .collect();
        Field { grid, values }
    }

    proptest! {
        #[test]
        fn a_cylinder_is_found(x in -0.3..0.3_f64, y in -0.3..0.3_f64, diameter in 0.4..1.2_f64) {
            let field = metal(|c| (c.x - x).hypot(c.y - y) < 0.5 * diameter);
            let found = strut(&field, 0..4).unwrap();
            prop_assert!((found.diameter - diameter).abs() < 0.03, "{}", found.diameter);
            prop_assert!((found.centre[0] - x).hypot(found.centre[1] - y) < 0.02);
        }
    }

    #[test]
    fn a_wall_and_nothing() {
        // 0.40 mm thick, 0.56 mm where it bulges
        let field = metal(|c| c.y.abs() < if c.x.abs() < 0.2 { 0.28 } else { 0.2 });
        let [mean, enclosed] = wall(&field, [-0.8, 0.8], 0..4).unwrap();
        assert!((mean - 0.44).abs() < 0.01, "{mean}");
        assert!((enclosed - 0.56).abs() < 1e-9, "{enclosed}");
        assert_eq!(wall(&metal(|_| false), [-0.8, 0.8], 0..4), None);
        assert_eq!(strut(&metal(|_| false), 0..4), None);
    }
}
