//! Beam diameter against focus current, and how to calibrate it from walls that were built and walls that were simulated.
//!
//! Béraud 2016, section 3.2.2.1.3: the diameter depends on the focus current alone. Walls of single tracks are measured
//! over a range of focus currents; their thickness falls, then rises, along two straight lines. The same walls simulated
//! over a range of diameters give thickness against diameter; the two together give diameter against current.

/// One straight piece of a focus calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocusPiece {
    /// Focus currents it holds for, A.
    pub range: [f64; 2],
    /// Diameter at zero current, mm.
    pub intercept: f64,
    /// Change of diameter with current, mm/A.
    pub slope: f64,
}

/// Beam diameter φ against focus current.
#[derive(Debug, Clone, PartialEq)]
pub struct FocusCalibration {
    pieces: Vec<FocusPiece>,
}

/// Why a focus, or a calibration, was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FocusError {
    /// The focus current lies outside the calibration.
    #[error(
        "focus current {focus:.4} A lies outside the calibration, {from:.4} to {to:.4} A: measure walls there and calibrate again"
    )]
    Outside {
        /// The current, A.
        focus: f64,
        /// Smallest calibrated current, A.
        from: f64,
        /// Largest calibrated current, A.
        to: f64,
    },
    /// A calibration without pieces, or with pieces that do not follow each other.
    #[error("a focus calibration needs at least one piece, and pieces that follow each other")]
    Pieces,
    /// Too few walls, or all alike.
    #[error(
        "{found} {what} at different settings: a calibration needs at least {needed}, spread over the range of use"
    )]
    Few {
        /// Which walls.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A value that is not finite.
    #[error("{what} number {index} is not finite")]
    Value {
        /// Which walls.
        what: &'static str,
        /// Which of them, from 0.
        index: usize,
    },
    /// Simulated walls that do not become thicker with the beam.
    #[error(
        "the simulated walls change by {slope:.3} mm of thickness per mm of diameter: thickness must grow with diameter to be turned round; simulate over a range where it does"
    )]
    Flat {
        /// The slope found.
        slope: f64,
    },
}

impl FocusCalibration {
    /// A calibration in pieces that follow each other.
    ///
    /// # Errors
    /// [`FocusError::Pieces`].
    pub fn new(pieces: Vec<FocusPiece>) -> Result<Self, FocusError> {
        let ordered = pieces.iter().all(|p| p.range[0] < p.range[1])
            && pieces.windows(2).all(|w| w[0].range[1] == w[1].range[0]);
        if pieces.is_empty() || !ordered {
            return Err(FocusError::Pieces);
        }
        Ok(FocusCalibration { pieces })
    }

    /// The same diameter (mm) at any focus current.
    pub fn constant(diameter: f64) -> Self {
        FocusCalibration {
            pieces: vec![FocusPiece {
                range: [f64::NEG_INFINITY, f64::INFINITY],
                intercept: diameter,
                slope: 0.0,
            }],
        }
    }

    /// The pieces, by rising current.
    pub fn pieces(&self) -> &[FocusPiece] {
        &self.pieces
    }

    /// Beam diameter φ at `focus` A, mm.
    ///
    /// # Errors
    /// [`FocusError::Outside`].
    pub fn diameter(&self, focus: f64) -> Result<f64, FocusError> {
        self.pieces
            .iter()
            .find(|p| (p.range[0]..=p.range[1]).contains(&focus))
            .map(|p| p.intercept + p.slope * focus)
            .ok_or_else(|| FocusError::Outside {
                focus,
                from: self.pieces[0].range[0],
                to: self.pieces[self.pieces.len() - 1].range[1],
            })
    }
}

/// What stuck grains add to a micrometer's reading, mm: on each side, grains whose quarter is molten into the wall stand
/// out by three quarters of their diameter.
///
/// ```
/// // largest grains of 163 µm: 244.5 µm (Béraud 2016, section 3.2.2.1.3)
/// assert_eq!(meltpath_thermal::focus::stuck_grains(0.163), 0.2445);
/// ```
pub fn stuck_grains(largest_grain: f64) -> f64 {
    2.0 * 0.75 * largest_grain
}

/// A calibration with the lines it was made of.
#[derive(Debug, Clone, PartialEq)]
pub struct FocusFit {
    /// Diameter against current, over the measured currents.
    pub calibration: FocusCalibration,
    /// Focus current of the thinnest wall, A; zero on a machine whose own calibration is right.
    pub sharpest: f64,
    /// Measured thickness against current: `[intercept mm, slope mm/A]` on either side of the sharpest.
    pub measured: [[f64; 2]; 2],
    /// Simulated thickness against diameter: `[intercept mm, slope]`.
    pub simulated: [f64; 2],
    /// Standard deviation of the measured walls about their lines, mm.
    pub scatter: f64,
    covariance: [[f64; 3]; 3],
    simulation: Straight,
}

impl FocusFit {
    /// Standard uncertainty of the diameter at `focus` A, mm: scatter of the walls about both fits.
    ///
    /// # Errors
    /// [`FocusError::Outside`].
    pub fn sigma(&self, focus: f64) -> Result<f64, FocusError> {
        let diameter = self.calibration.diameter(focus)?;
        let x = hinge(focus, self.sharpest);
        let mut variance = 0.0;
        for (row, xi) in self.covariance.iter().zip(x) {
            for (c, xj) in row.iter().zip(x) {
                variance += xi * c * xj;
            }
        }
        variance += self.simulation.variance(diameter);
        Ok(variance.sqrt() / self.simulated[1])
    }
}

/// Calibrates from `measured` walls `[focus current A, thickness of the metal mm]` (grains taken off, see
/// [`stuck_grains`]) and `simulated` ones `[diameter mm, thickness mm]`.
///
/// # Errors
/// [`FocusError::Few`] below five measured or two simulated walls, [`FocusError::Value`], [`FocusError::Flat`].
pub fn calibrate(measured: &[[f64; 2]], simulated: &[[f64; 2]]) -> Result<FocusFit, FocusError> {
    let walls = distinct("measured walls", measured, 5)?;
    let simulation = Straight::through(&distinct("simulated walls", simulated, 2)?);
    let [base, slope] = [simulation.intercept, simulation.slope];
    if slope.is_nan() || slope <= 1e-3 {
        return Err(FocusError::Flat { slope });
    }
    let (sharpest, fit) = best_hinge(&walls);
    let [lowest, falling, rising] = fit.values;
    let measured = [falling, rising].map(|s| [lowest - s * sharpest, s]);
    let ends = [walls[0][0], walls[walls.len() - 1][0]];
    let ranges = [[ends[0], sharpest], [sharpest, ends[1]]];
    let pieces = ranges
        .into_iter()
        .zip(measured)
        .map(|(range, [i, s])| FocusPiece {
            range,
            intercept: (i - base) / slope,
            slope: s / slope,
        });
    // three line parameters and the place of the bend
    let freedom = walls.len() - 4;
    let scatter = (fit.residual / freedom as f64).sqrt();
    Ok(FocusFit {
        calibration: FocusCalibration::new(pieces.collect())?,
        sharpest,
        measured,
        simulated: [base, slope],
        scatter,
        covariance: fit.inverse.map(|row| row.map(|c| c * scatter * scatter)),
        simulation,
    })
}

/// The walls sorted by setting, where there are `needed` different settings.
fn distinct(
    what: &'static str,
    walls: &[[f64; 2]],
    needed: usize,
) -> Result<Vec<[f64; 2]>, FocusError> {
    let wrong = |w: &[f64; 2]| !(w[0].is_finite() && w[1].is_finite());
    if let Some(index) = walls.iter().position(wrong) {
        return Err(FocusError::Value { what, index });
    }
    let mut walls = walls.to_vec();
    walls.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let found = walls.chunk_by(|a, b| a[0] == b[0]).count();
    if found < needed {
        return Err(FocusError::Few {
            what,
            found,
            needed,
        });
    }
    Ok(walls)
}

/// A straight line by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Straight {
    intercept: f64,
    slope: f64,
    mean: f64,
    spread: f64,
    count: f64,
    scatter: f64,
}

impl Straight {
    fn through(points: &[[f64; 2]]) -> Self {
        let count = points.len() as f64;
        let mean = points.iter().map(|p| p[0]).sum::<f64>() / count;
        let level = points.iter().map(|p| p[1]).sum::<f64>() / count;
        let spread: f64 = points.iter().map(|p| (p[0] - mean).powi(2)).sum();
        let slope = points
            .iter()
            .map(|p| (p[0] - mean) * (p[1] - level))
            .sum::<f64>()
            / spread;
        let intercept = level - slope * mean;
        let residual: f64 = points
            .iter()
            .map(|p| (p[1] - intercept - slope * p[0]).powi(2))
            .sum();
        Straight {
            intercept,
            slope,
            mean,
            spread,
            count,
            scatter: (residual / (count - 2.0).max(1.0)).sqrt(),
        }
    }

    fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }

    fn variance(&self, x: f64) -> f64 {
        self.scatter.powi(2) * (1.0 / self.count + (x - self.mean).powi(2) / self.spread)
    }
}

/// Two lines that meet: value at the bend, slope before it, slope after it.
struct Hinge {
    values: [f64; 3],
    inverse: [[f64; 3]; 3],
    residual: f64,
}

fn hinge(x: f64, bend: f64) -> [f64; 3] {
    [1.0, (x - bend).min(0.0), (x - bend).max(0.0)]
}

fn fit_hinge(points: &[[f64; 2]], bend: f64) -> Option<Hinge> {
    let mut normal = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    for [x, y] in points {
        let row = hinge(*x, bend);
        for i in 0..3 {
            right[i] += row[i] * y;
            for j in 0..3 {
                normal[i][j] += row[i] * row[j];
            }
        }
    }
    let inverse = invert(&normal)?;
    let values = inverse.map(|row| row.iter().zip(right).map(|(a, b)| a * b).sum());
    let residual = points
        .iter()
        .map(|[x, y]| {
            let fitted: f64 = hinge(*x, bend).iter().zip(values).map(|(a, b)| a * b).sum();
            (y - fitted).powi(2)
        })
        .sum();
    Some(Hinge {
        values,
        inverse,
        residual,
    })
}

/// The best bend: where the lines through the points on either side of a gap meet inside that gap, or on a point.
fn best_hinge(points: &[[f64; 2]]) -> (f64, Hinge) {
    let mut bends: Vec<f64> = points[1..points.len() - 1].iter().map(|p| p[0]).collect();
    for k in 2..points.len() - 1 {
        let (before, after) = points.split_at(k);
        let (a, b) = (Straight::through(before), Straight::through(after));
        let meet = (b.intercept - a.intercept) / (a.slope - b.slope);
        if (before[k - 1][0]..=after[0][0]).contains(&meet) {
            bends.push(meet);
        }
    }
    let mut best: Option<(f64, Hinge)> = None;
    for bend in bends {
        if let Some(fit) = fit_hinge(points, bend)
            && best.as_ref().is_none_or(|(_, b)| fit.residual < b.residual)
        {
            best = Some((bend, fit));
        }
    }
    // five different currents leave at least one inner point with a sound fit; else a single line
    best.unwrap_or_else(|| {
        let line = Straight::through(points);
        let middle = points[points.len() / 2][0];
        let fit = Hinge {
            values: [line.at(middle), line.slope, line.slope],
            inverse: [[0.0; 3]; 3],
            residual: line.scatter.powi(2) * (line.count - 2.0),
        };
        (middle, fit)
    })
}

/// The inverse of a symmetric matrix by cofactors; `None` where it has none.
fn invert(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let cofactor = |i: usize, j: usize| {
        let [a, b] = [(i + 1) % 3, (i + 2) % 3];
        let [c, d] = [(j + 1) % 3, (j + 2) % 3];
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
    let scale = m[0][0] * m[1][1] * m[2][2];
    (determinant.abs() > 1e-12 * scale)
        .then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn thesis() -> FocusCalibration {
        // Béraud 2016, eqs. 3.2.6-7, in A and mm
        FocusCalibration::new(vec![
            FocusPiece {
                range: [-3e-3, 7.15e-3],
                intercept: 0.551_67,
                slope: -34.5,
            },
            FocusPiece {
                range: [7.15e-3, 30e-3],
                intercept: 0.132_15,
                slope: 24.21,
            },
        ])
        .unwrap()
    }

    #[test]
    fn ebm_a08_diameter_against_focus_current() {
        let focus = thesis();
        for (current, diameter) in [
            (0.0, 0.551_67),
            (4e-3, 0.413_67),
            (7e-3, 0.310_17),
            (-3e-3, 0.655_17),
            (14e-3, 0.471_09),
        ] {
            assert!((focus.diameter(current).unwrap() - diameter).abs() < 1e-5);
        }
        assert!(matches!(
            focus.diameter(31e-3),
            Err(FocusError::Outside { .. })
        ));
        // where the branches cross
        let [a, b] = [focus.pieces[0], focus.pieces[1]];
        let crossing = (a.intercept - b.intercept) / (b.slope - a.slope);
        assert!((crossing - 7.1456e-3).abs() < 1e-7);
    }

    /// Walls at −3 to 30 mA on the thesis' lines: e = −20.7 I + 451.0 and 14.526 I + 199.29 µm, I in mA.
    fn walls() -> Vec<[f64; 2]> {
        (0..12)
            .map(|n| -3.0 + 3.0 * f64::from(n))
            .map(|i: f64| {
                let e = (-20.7 * i + 451.0).max(14.526 * i + 199.29);
                [1e-3 * i, 1e-3 * e]
            })
            .collect()
    }

    #[test]
    fn ebm_a09_the_tool_recovers_both_lines() {
        // e = 0.60 φ + 120 µm (eq. 3.2.5)
        let simulated = [0.3, 0.5, 0.8].map(|d| [d, 0.6 * d + 0.120]);
        let fit = calibrate(&walls(), &simulated).unwrap();
        let expected = thesis();
        for (ours, theirs) in fit.calibration.pieces().iter().zip(expected.pieces()) {
            assert!((ours.slope / theirs.slope - 1.0).abs() < 5e-3);
            assert!((ours.intercept / theirs.intercept - 1.0).abs() < 5e-3);
        }
        assert!((fit.sharpest - 7.1456e-3).abs() < 1e-6);
        assert!(fit.scatter < 1e-9);
    }

    #[test]
    fn scatter_becomes_uncertainty() {
        let simulated = [0.3, 0.5, 0.8].map(|d| [d, 0.6 * d + 0.120]);
        let mut rough = walls();
        for (n, wall) in rough.iter_mut().enumerate() {
            wall[1] += if n % 2 == 0 { 0.02 } else { -0.02 };
        }
        let fit = calibrate(&rough, &simulated).unwrap();
        let sigma = fit.sigma(4e-3).unwrap();
        assert!((0.005..0.05).contains(&sigma), "{sigma}");
        let off = (fit.calibration.diameter(4e-3).unwrap() - 0.413_67).abs();
        assert!(off < 3.0 * sigma, "{off} {sigma}");
    }

    #[test]
    fn what_cannot_be_calibrated_is_refused() {
        let simulated = [[0.3, 0.3], [0.5, 0.42]];
        let few = calibrate(&walls()[..4], &simulated);
        assert!(matches!(few, Err(FocusError::Few { found: 4, .. })));
        let flat = calibrate(&walls(), &[[0.3, 0.3], [0.5, 0.3]]);
        assert!(matches!(flat, Err(FocusError::Flat { .. })));
        let broken = calibrate(&[[0.0, f64::NAN]; 6], &simulated);
        assert!(matches!(broken, Err(FocusError::Value { index: 0, .. })));
    }

    proptest! {
        #[test]
        fn any_two_lines_are_recovered(bend in 0.005..0.02_f64, falling in -40.0..-5.0_f64, rising in 5.0..40.0_f64) {
            let walls: Vec<[f64; 2]> = (0..12)
                .map(|n| -0.003 + 0.003 * f64::from(n))
                .map(|i| [i, 0.3 + falling * (i - bend).min(0.0) + rising * (i - bend).max(0.0)])
                .collect();
            let fit = calibrate(&walls, &[[0.3, 0.3], [0.8, 0.8]]).unwrap();
            prop_assert!((fit.sharpest - bend).abs() < 1e-9);
            prop_assert!((fit.measured[0][1] / falling - 1.0).abs() < 1e-6);
            prop_assert!((fit.measured[1][1] / rising - 1.0).abs() < 1e-6);
        }
    }
}
