//! Beam diameter against focus current.
//!
//! Béraud 2016, section 3.2.2.1.3: the diameter depends on the focus current alone; it falls, then rises, along two straight
//! lines.

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
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
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
    /// A piece by which a beam has no width somewhere.
    #[error(
        "at {focus:.4} A the calibration makes the beam {diameter:.4} mm wide: every piece needs a diameter above zero at both its ends"
    )]
    Width {
        /// The focus current, A.
        focus: f64,
        /// The diameter there, mm.
        diameter: f64,
    },
    /// A beam whose diameter does not depend on its focus current.
    #[error(
        "the beam is {:.0} µm wide whatever the focus current: give a focus calibration, or change speed or current", 1e3 * .diameter
    )]
    Fixed {
        /// Its diameter, mm.
        diameter: f64,
    },
}

impl FocusCalibration {
    /// A calibration in pieces that follow each other.
    ///
    /// # Errors
    /// [`FocusError::Pieces`]; [`FocusError::Width`] for a piece by which the beam has no width at one of its ends.
    ///
    /// ```
    /// use meltpath_gun::focus::{FocusCalibration, FocusError, FocusPiece};
    /// let falling = FocusPiece { range: [3e-3, 7e-3], intercept: 0.6, slope: -100.0 };
    /// let refused = FocusCalibration::new(vec![falling]).unwrap_err();
    /// assert!(matches!(refused, FocusError::Width { focus: 7e-3, .. })); // -0.1 mm there
    /// ```
    pub fn new(pieces: Vec<FocusPiece>) -> Result<Self, FocusError> {
        let ordered = pieces.iter().all(|p| p.range[0] < p.range[1])
            && pieces.windows(2).all(|w| w[0].range[1] == w[1].range[0]);
        if pieces.is_empty() || !ordered {
            return Err(FocusError::Pieces);
        }
        for piece in &pieces {
            for focus in piece.range {
                let diameter = piece.intercept + piece.slope * focus;
                if diameter <= 0.0 || !diameter.is_finite() {
                    return Err(FocusError::Width { focus, diameter });
                }
            }
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

    /// The piece in which a focus current (A) lies, the lower one where two meet.
    pub fn branch(&self, focus: f64) -> Option<&FocusPiece> {
        let holds = |p: &&FocusPiece| (p.range[0]..=p.range[1]).contains(&focus);
        self.pieces.iter().find(holds)
    }

    /// Beam diameter φ at `focus` A, mm.
    ///
    /// # Errors
    /// [`FocusError::Outside`].
    pub fn diameter(&self, focus: f64) -> Result<f64, FocusError> {
        let [first, last] = [&self.pieces[0], &self.pieces[self.pieces.len() - 1]];
        self.branch(focus)
            .map(|p| p.intercept + p.slope * focus)
            .ok_or(FocusError::Outside {
                focus,
                from: first.range[0],
                to: last.range[1],
            })
    }
}

/// What stuck grains add to a micrometer's reading, mm: on each side, grains whose quarter is molten into the wall stand
/// out by three quarters of their diameter.
///
/// ```
/// // largest grains of 163 µm: 244.5 µm (Béraud 2016, section 3.2.2.1.3)
/// assert_eq!(meltpath_gun::focus::stuck_grains(0.163), 0.2445);
/// ```
pub fn stuck_grains(largest_grain: f64) -> f64 {
    2.0 * 0.75 * largest_grain
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn pieces_follow_each_other() {
        let piece = |from: f64, to: f64| FocusPiece {
            range: [from, to],
            intercept: 0.5,
            slope: 1.0,
        };
        let told = |pieces: &[FocusPiece]| FocusCalibration::new(pieces.to_vec()).is_ok();
        assert!(told(&[piece(0.0, 1.0), piece(1.0, 2.0)]));
        for pieces in [
            vec![],
            vec![piece(1.0, 1.0)],
            vec![piece(1.0, 0.0)],
            vec![piece(0.0, 1.0), piece(1.5, 2.0)],
        ] {
            assert!(!told(&pieces), "{pieces:?}");
        }
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
}
