//! Small dense linear least squares by Householder reflections: the handful of coefficients of a response surface.

/// Coefficients k minimising |X k − y|² for the rows of X; `None` where the columns are dependent or rows are missing.
pub(crate) fn solve(rows: &[Vec<f64>], y: &[f64]) -> Option<Vec<f64>> {
    let (m, n) = (rows.len(), rows.first()?.len());
    if m < n || y.len() != m {
        return None;
    }
    let mut a: Vec<Vec<f64>> = rows.to_vec();
    let mut b = y.to_vec();
    let size = a.iter().flatten().fold(0.0f64, |s, v| s.max(v.abs()));
    for j in 0..n {
        let norm = a[j..].iter().map(|r| r[j] * r[j]).sum::<f64>().sqrt();
        if norm <= 1e-12 * size * (m as f64).sqrt() {
            return None;
        }
        let alpha = if a[j][j] > 0.0 { -norm } else { norm };
        let mut v: Vec<f64> = a[j..].iter().map(|r| r[j]).collect();
        v[0] -= alpha;
        let vv: f64 = v.iter().map(|x| x * x).sum();
        for c in j..n {
            let dot: f64 = v.iter().zip(&a[j..]).map(|(v, r)| v * r[c]).sum();
            for (v, r) in v.iter().zip(&mut a[j..]) {
                r[c] -= 2.0 * dot / vv * v;
            }
        }
        let dot: f64 = v.iter().zip(&b[j..]).map(|(v, y)| v * y).sum();
        for (v, y) in v.iter().zip(&mut b[j..]) {
            *y -= 2.0 * dot / vv * v;
        }
    }
    let mut k = vec![0.0; n];
    for j in (0..n).rev() {
        let tail: f64 = (j + 1..n).map(|c| a[j][c] * k[c]).sum();
        k[j] = (b[j] - tail) / a[j][j];
    }
    Some(k)
}
