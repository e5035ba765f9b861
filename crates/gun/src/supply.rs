//! What a gun is fed with for a beam of some power and spot, and back.

use crate::focus::{FocusCalibration, FocusError};

/// A gun at its accelerating voltage, with the calibration of its focus coil.
#[derive(Debug, Clone, PartialEq)]
pub struct Gun {
    /// Accelerating voltage, V.
    pub voltage: f64,
    /// Spot against the current of the focus coil.
    pub focus: FocusCalibration,
    /// A current of the coil (A) on the branch of the calibration that is used: most spots lie on two.
    pub coil: f64,
}

impl Gun {
    /// Beam current for a power of `power` W, A.
    pub fn current(&self, power: f64) -> f64 {
        power / self.voltage
    }

    /// Power of a beam of `current` A, W.
    pub fn power(&self, current: f64) -> f64 {
        self.voltage * current
    }

    /// Current of the coil for a spot of `spot` mm, A, as far as the branch reaches; to the nanoampere. The gun's own where the
    /// spot does not depend on it.
    pub fn coil(&self, spot: f64) -> f64 {
        let branch = self.focus.branch(self.coil).filter(|b| b.slope != 0.0);
        branch.map_or(self.coil, |b| {
            let wanted = (spot - b.intercept) / b.slope;
            (wanted.clamp(b.range[0], b.range[1]) * 1e9).round() * 1e-9
        })
    }

    /// The least and the greatest spot on the branch that is used, mm.
    ///
    /// # Errors
    /// [`FocusError`]: a coil current outside the calibration, a spot that does not depend on it.
    ///
    /// ```
    /// use meltpath_gun::Gun;
    /// use meltpath_gun::focus::{FocusCalibration, FocusPiece};
    /// let falling = FocusPiece { range: [-3e-3, 7e-3], intercept: 0.55, slope: -35.0 };
    /// let focus = FocusCalibration::new(vec![falling]).unwrap();
    /// let gun = Gun { voltage: 60e3, focus, coil: 4e-3 };
    /// let [least, greatest] = gun.spots().unwrap();
    /// assert!((least - 0.305).abs() < 1e-12 && (greatest - 0.655).abs() < 1e-12);
    /// assert_eq!(gun.coil(0.41), 4e-3);
    /// assert_eq!(gun.coil(0.1), 7e-3);
    /// ```
    pub fn spots(&self) -> Result<[f64; 2], FocusError> {
        let spot = self.focus.diameter(self.coil)?;
        let branch = self.focus.branch(self.coil).filter(|b| b.slope != 0.0);
        let branch = branch.ok_or(FocusError::Fixed { diameter: spot })?;
        let [a, b] = branch
            .range
            .map(|coil| branch.intercept + branch.slope * coil);
        Ok([a.min(b), a.max(b)])
    }
}
