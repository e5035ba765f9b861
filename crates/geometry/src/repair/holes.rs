//! Patches for holes: the triangulation of a closed rim with the least area (Barequet & Sharir 1995).

use crate::math::DVec3;

/// Rims with more points are left open: the work grows with the cube.
const LONGEST_RIM: usize = 400;

/// Triangles over a rim, as positions in it, in the rim's sense; `None` for a rim that is too short or too long.
pub(super) fn patch(rim: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    let n = rim.len();
    if !(3..=LONGEST_RIM).contains(&n) {
        return None;
    }
    // best[i * n + j]: least area over the rim's part from i to j, closed by the chord
    let mut best = vec![0.0; n * n];
    let mut through = vec![0_usize; n * n];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let mut least = f64::INFINITY;
            let mut at = i + 1;
            for k in i + 1..j {
                let area = 0.5 * (rim[k] - rim[i]).cross(rim[j] - rim[i]).length();
                let total = best[i * n + k] + best[k * n + j] + area;
                if total < least {
                    least = total;
                    at = k;
                }
            }
            best[i * n + j] = least;
            through[i * n + j] = at;
        }
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if j - i >= 2 {
            let k = through[i * n + j];
            triangles.push([i, k, j]);
            open.extend([(i, k), (k, j)]);
        }
    }
    Some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_concave_rim_gets_its_own_area() {
        let rim = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]
            .map(|p| DVec3::new(p[0], p[1], 7.0));
        let patch = patch(&rim).unwrap();
        let area: f64 = patch
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|k| rim[k]);
                0.5 * (b - a).cross(c - a).z
            })
            .sum();
        assert_eq!(patch.len(), 3);
        assert!((area - 10.0).abs() < 1e-12, "{area}");
        assert!(super::patch(&rim[..2]).is_none());
    }
}
