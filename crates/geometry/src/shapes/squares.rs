//! Sheets and tubes of squares, each cut along its diagonal.

use crate::{Mesh, math::DVec3};

/// A sheet of `rows` x `columns` squares, corner `(i, k)` at `f(i, k)`, without the squares that `cut` names.
pub fn sheet(
    rows: u32,
    columns: u32,
    cut: impl Fn(u32, u32) -> bool,
    f: impl Fn(f64, f64) -> DVec3,
) -> Mesh {
    squares([rows, columns], columns + 1, cut, f)
}

/// A tube of `rows` rings of `columns` squares; `f` takes the share of the height and that of the turn, 0 to 1.
pub fn tube(rows: u32, columns: u32, f: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let (high, round) = (f64::from(rows), f64::from(columns));
    let whole = |_, _| false;
    squares([rows, columns], columns, whole, |i, k| {
        f(i / high, k / round)
    })
}

/// Squares on rows of `wide` corners; those after the last corner begin anew.
fn squares(
    [rows, columns]: [u32; 2],
    wide: u32,
    cut: impl Fn(u32, u32) -> bool,
    f: impl Fn(f64, f64) -> DVec3,
) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=rows {
        let corner = |k| f(f64::from(i), f64::from(k));
        mesh.vertices.extend((0..wide).map(corner));
    }
    for i in 0..rows {
        for k in (0..columns).filter(|k| !cut(i, *k)) {
            let at = |i: u32, k: u32| i * wide + k % wide;
            let (a, b, c, d) = (at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six squares of 2 x 3 mm less one: its corners stay, its area goes.
    #[test]
    fn squares_that_are_cut_out_are_missing() {
        let place = |i: f64, k: f64| DVec3::new(2.0 * k, 3.0 * i, 1.0);
        let whole = sheet(2, 3, |_, _| false, place);
        assert_eq!((whole.vertices.len(), whole.triangles.len()), (12, 12));
        let mesh = sheet(2, 3, |i, k| (i, k) == (1, 2), place);
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (12, 10));
        let middle = |t: usize| mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        let area: f64 = (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                0.5 * (b - a).cross(c - a).z
            })
            .sum();
        assert!((area - 30.0).abs() < 1e-12, "{area}");
        assert!((0..10).all(|t| middle(t).x < 4.0 || middle(t).y < 3.0));
    }
}
