//! B-spline curves and surfaces, rational or not (Piegl and Tiller, The NURBS Book, 2nd ed., ch. 2-4).

use crate::math::DVec3;

/// Highest degree that is evaluated: far above what kernels write.
pub const MAX_DEGREE: usize = 25;

/// Why control points, knots and weights do not make a spline.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SplineError {
    /// Degree 0 or above [`MAX_DEGREE`].
    #[error("degree {0} is not between 1 and {MAX_DEGREE}")]
    Degree(usize),
    /// Knots do not match the control points and the degree.
    #[error("{knots} knots for {points} control points of degree {degree}, expected {}", points + degree + 1)]
    Counts {
        /// Number of knots, repeated ones counted.
        knots: usize,
        /// Number of control points.
        points: usize,
        /// Degree.
        degree: usize,
    },
    /// Fewer control points than degree + 1, or rows of different length.
    #[error("too few control points for degree {0}, or rows of different length")]
    Points(usize),
    /// Knots fall, are not finite, or leave no interval.
    #[error("the knots fall or leave no interval")]
    Knots,
    /// A weight is not above zero, or their number is wrong.
    #[error("the weights are not one positive number for each control point")]
    Weights,
}

/// Knots and degree of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    degree: usize,
    knots: Vec<f64>,
}

/// Values of the non-zero basis functions and of their first and second derivatives.
struct Values {
    first: usize,
    rows: [[f64; MAX_DEGREE + 1]; 3],
}

impl Basis {
    /// Checks and keeps a knot vector with repeated knots written out.
    ///
    /// # Errors
    /// [`SplineError`] when the knots do not serve `points` control points.
    pub fn new(degree: usize, knots: Vec<f64>, points: usize) -> Result<Self, SplineError> {
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(SplineError::Degree(degree));
        }
        if points <= degree {
            return Err(SplineError::Points(degree));
        }
        if knots.len() != points + degree + 1 {
            return Err(SplineError::Counts {
                knots: knots.len(),
                points,
                degree,
            });
        }
        let rising = knots.windows(2).all(|w| w[0] <= w[1]) && knots.iter().all(|k| k.is_finite());
        if !rising || knots[degree] >= knots[points] {
            return Err(SplineError::Knots);
        }
        Ok(Self { degree, knots })
    }

    /// The degree.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// First and last parameter.
    pub fn domain(&self) -> [f64; 2] {
        let n = self.knots.len() - self.degree - 1;
        [self.knots[self.degree], self.knots[n]]
    }

    /// Distinct knots of the domain, ends included: between two of them the spline is one polynomial.
    pub fn breaks(&self) -> Vec<f64> {
        let n = self.knots.len() - self.degree - 1;
        let mut breaks = self.knots[self.degree..=n].to_vec();
        breaks.dedup();
        breaks
    }

    /// The index i of the interval [kᵢ, kᵢ₊₁) that holds `t`, clamped to the domain.
    fn span(&self, t: f64) -> usize {
        let n = self.knots.len() - self.degree - 1;
        let inside = &self.knots[self.degree..n];
        let i = inside.partition_point(|&k| k <= t).max(1) - 1 + self.degree;
        // the last interval that begins at or before t and is not empty, also where the end is repeated more often than needed
        let mut before = (self.degree..=i).rev();
        before
            .find(|&j| self.knots[j] < self.knots[j + 1])
            .unwrap_or(i)
    }

    /// Basis functions and derivatives at `t` (The NURBS Book, algorithm A2.3, to order 2).
    fn values(&self, t: f64) -> Values {
        let p = self.degree;
        let [lo, hi] = self.domain();
        let t = t.clamp(lo, hi);
        let i = self.span(t);
        let mut table = [[0.0; MAX_DEGREE + 1]; MAX_DEGREE + 1];
        let mut left = [0.0; MAX_DEGREE + 1];
        let mut right = [0.0; MAX_DEGREE + 1];
        table[0][0] = 1.0;
        for j in 1..=p {
            left[j] = t - self.knots[i + 1 - j];
            right[j] = self.knots[i + j] - t;
            let mut saved = 0.0;
            for r in 0..j {
                // lower triangle: knot differences; upper triangle: basis functions
                table[j][r] = right[r + 1] + left[j - r];
                let term = table[r][j - 1] / table[j][r];
                table[r][j] = saved + right[r + 1] * term;
                saved = left[j - r] * term;
            }
            table[j][j] = saved;
        }
        let mut rows = [[0.0; MAX_DEGREE + 1]; 3];
        for j in 0..=p {
            rows[0][j] = table[j][p];
        }
        let order = p.min(2);
        for r in 0..=p {
            let mut a = [[0.0; 3]; 2];
            a[0][0] = 1.0;
            let (mut s1, mut s2) = (0, 1);
            let mut factor = 1.0;
            for k in 1..=order {
                let pk = p - k;
                let mut d = 0.0;
                if r >= k {
                    a[s2][0] = a[s1][0] / table[pk + 1][r - k];
                    d = a[s2][0] * table[r - k][pk];
                }
                let j1 = if r + 1 >= k { 1 } else { k - r };
                let j2 = if r <= pk + 1 { k - 1 } else { p - r };
                for j in j1..=j2 {
                    a[s2][j] = (a[s1][j] - a[s1][j - 1]) / table[pk + 1][r + j - k];
                    d += a[s2][j] * table[r + j - k][pk];
                }
                if r <= pk {
                    a[s2][k] = -a[s1][k - 1] / table[pk + 1][r];
                    d += a[s2][k] * table[r][pk];
                }
                factor *= (p + 1 - k) as f64;
                rows[k][r] = d * factor;
                std::mem::swap(&mut s1, &mut s2);
            }
        }
        Values { first: i - p, rows }
    }
}

/// A B-spline curve; parameters run over [`Basis::domain`].
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsCurve {
    basis: Basis,
    points: Vec<DVec3>,
    /// Empty for a polynomial spline.
    weights: Vec<f64>,
}

impl NurbsCurve {
    /// Checks and keeps a spline; `weights` empty for a polynomial one.
    ///
    /// # Errors
    /// [`SplineError`] when the parts do not fit.
    pub fn new(
        degree: usize,
        knots: Vec<f64>,
        points: Vec<DVec3>,
        weights: Vec<f64>,
    ) -> Result<Self, SplineError> {
        let basis = Basis::new(degree, knots, points.len())?;
        check_weights(&weights, points.len())?;
        Ok(Self {
            basis,
            points,
            weights,
        })
    }

    /// A polyline, one parameter unit for each side; needs two points.
    ///
    /// # Errors
    /// [`SplineError`] for fewer points.
    pub fn polyline(points: Vec<DVec3>) -> Result<Self, SplineError> {
        let last = points.len().saturating_sub(1);
        let mut knots = vec![0.0];
        knots.extend((0..=last).map(|i| i as f64));
        knots.push(last as f64);
        Self::new(1, knots, points, Vec::new())
    }

    /// Knots and degree.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Control points, mm.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Point, first and second derivative at `t`.
    pub fn derivatives(&self, t: f64) -> [DVec3; 3] {
        let values = self.basis.values(t);
        let mut sum = [DVec3::ZERO; 3];
        let mut weight = [0.0; 3];
        for j in 0..=self.basis.degree {
            let index = values.first + j;
            let point = self.points[index];
            let w = self.weights.get(index).copied().unwrap_or(1.0);
            for k in 0..3 {
                let b = values.rows[k][j] * w;
                sum[k] += b * point;
                weight[k] += b;
            }
        }
        if self.weights.is_empty() {
            return sum;
        }
        let c = sum[0] / weight[0];
        let d1 = (sum[1] - weight[1] * c) / weight[0];
        let d2 = (sum[2] - 2.0 * weight[1] * d1 - weight[2] * c) / weight[0];
        [c, d1, d2]
    }
}

/// A B-spline surface; control point (i, j) belongs to the i-th u and the j-th v basis function.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsSurface {
    u: Basis,
    v: Basis,
    /// Row by row: all v of the first u, then of the next.
    points: Vec<DVec3>,
    /// Empty for a polynomial spline.
    weights: Vec<f64>,
    columns: usize,
}

impl NurbsSurface {
    /// Checks and keeps a spline; `points[i][j]`, `weights` row by row or empty for a polynomial one.
    ///
    /// # Errors
    /// [`SplineError`] when the parts do not fit.
    pub fn new(
        degrees: [usize; 2],
        knots: [Vec<f64>; 2],
        points: Vec<Vec<DVec3>>,
        weights: Vec<f64>,
    ) -> Result<Self, SplineError> {
        let rows = points.len();
        let columns = points.first().map_or(0, Vec::len);
        if points.iter().any(|row| row.len() != columns) {
            return Err(SplineError::Points(degrees[1]));
        }
        let [ku, kv] = knots;
        let u = Basis::new(degrees[0], ku, rows)?;
        let v = Basis::new(degrees[1], kv, columns)?;
        check_weights(&weights, rows * columns)?;
        Ok(Self {
            u,
            v,
            points: points.into_iter().flatten().collect(),
            weights,
            columns,
        })
    }

    /// Knots and degree in u and v.
    pub fn bases(&self) -> [&Basis; 2] {
        [&self.u, &self.v]
    }

    /// Point and first derivatives at (u, v).
    pub fn tangents(&self, u: f64, v: f64) -> [DVec3; 3] {
        let bu = self.u.values(u);
        let bv = self.v.values(v);
        let mut sum = [DVec3::ZERO; 3];
        let mut weight = [0.0; 3];
        for i in 0..=self.u.degree {
            let row = (bu.first + i) * self.columns + bv.first;
            let mut part = [DVec3::ZERO; 2];
            let mut part_w = [0.0; 2];
            for j in 0..=self.v.degree {
                let w = self.weights.get(row + j).copied().unwrap_or(1.0);
                let point = self.points[row + j];
                for k in 0..2 {
                    let b = bv.rows[k][j] * w;
                    part[k] += b * point;
                    part_w[k] += b;
                }
            }
            for (k, (du, dv)) in [(0, 0), (1, 0), (0, 1)].into_iter().enumerate() {
                sum[k] += bu.rows[du][i] * part[dv];
                weight[k] += bu.rows[du][i] * part_w[dv];
            }
        }
        if self.weights.is_empty() {
            return sum;
        }
        let s = sum[0] / weight[0];
        [
            s,
            (sum[1] - weight[1] * s) / weight[0],
            (sum[2] - weight[2] * s) / weight[0],
        ]
    }
}

fn check_weights(weights: &[f64], points: usize) -> Result<(), SplineError> {
    let sound = weights.iter().all(|&w| w > 0.0 && w.is_finite());
    if weights.is_empty() || (sound && weights.len() == points) {
        Ok(())
    } else {
        Err(SplineError::Weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quarter circle of radius 2 as a rational quadratic.
    fn quarter() -> NurbsCurve {
        NurbsCurve::new(
            2,
            vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
            vec![DVec3::X * 2.0, (DVec3::X + DVec3::Y) * 2.0, DVec3::Y * 2.0],
            vec![1.0, 0.5_f64.sqrt(), 1.0],
        )
        .unwrap()
    }

    #[test]
    fn rational_quadratic_is_a_circle() {
        let curve = quarter();
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            let [c, d1, _] = curve.derivatives(t);
            assert!((c.length() - 2.0).abs() < 1e-14);
            assert!(c.dot(d1).abs() < 1e-13);
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let knots = vec![0.0, 0.0, 0.0, 0.0, 0.3, 0.3, 0.7, 1.0, 1.0, 1.0, 1.0];
        let points = (0..7)
            .map(|i| {
                let x = f64::from(i);
                DVec3::new(x, (x * 1.3).sin() * 3.0, (x * 0.7).cos())
            })
            .collect();
        let weights = vec![1.0, 2.0, 0.5, 1.5, 1.0, 3.0, 1.0];
        let curve = NurbsCurve::new(3, knots, points, weights).unwrap();
        let h = 1e-5;
        for t in [0.05, 0.2, 0.45, 0.81, 0.95] {
            let [_, d1, d2] = curve.derivatives(t);
            let [p, a, _] = curve.derivatives(t + h);
            let [m, b, _] = curve.derivatives(t - h);
            assert!((d1 - (p - m) / (2.0 * h)).length() < 1e-6 * d1.length().max(1.0));
            assert!((d2 - (a - b) / (2.0 * h)).length() < 1e-6 * d2.length().max(1.0));
        }
    }

    #[test]
    fn ends_and_unclamped_knots() {
        let curve = quarter();
        assert_eq!(curve.derivatives(0.0)[0], DVec3::X * 2.0);
        assert_eq!(curve.derivatives(1.0)[0], DVec3::Y * 2.0);
        let uniform = NurbsCurve::new(
            2,
            (0..8).map(f64::from).collect(),
            vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE],
            Vec::new(),
        )
        .unwrap();
        assert_eq!(uniform.basis().domain(), [2.0, 5.0]);
        // a uniform quadratic begins midway between its first two points
        assert_eq!(uniform.derivatives(2.0)[0], DVec3::X * 0.5);
        // an end that is repeated once too often leaves the last point without a share
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let line = NurbsCurve::new(1, vec![0.0, 0.0, 1.0, 1.0, 1.0], points, Vec::new()).unwrap();
        assert_eq!(line.derivatives(1.0)[0], DVec3::X);
    }

    #[test]
    fn wrong_parts_are_refused() {
        let point = vec![DVec3::ZERO, DVec3::X];
        assert!(matches!(
            NurbsCurve::new(1, vec![0.0, 0.0, 1.0], point.clone(), Vec::new()),
            Err(SplineError::Counts { .. })
        ));
        assert!(matches!(
            NurbsCurve::new(1, vec![0.0, 0.0, 0.0, 0.0], point.clone(), Vec::new()),
            Err(SplineError::Knots)
        ));
        assert!(matches!(
            NurbsCurve::new(1, vec![0.0, 0.0, 1.0, 1.0], point.clone(), vec![1.0, 0.0]),
            Err(SplineError::Weights)
        ));
        assert!(matches!(
            NurbsCurve::new(0, vec![0.0, 1.0, 2.0], point, Vec::new()),
            Err(SplineError::Degree(0))
        ));
    }
}
