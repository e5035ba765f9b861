//! A galvanometer as a chain of elementary loads on springs, which the modal model is held to.
//!
//! Source: Rasoanarivo 2020, eq. 2.14-2.17.

use meltpath_control::{Polynomial, SystemError, TransferFunction};
use meltpath_scan_head::axis::galvanometer::Mode;

/// A shaft as a chain of elementary loads behind the rotor (eq. 2.14-2.16).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chain {
    /// Torque constant Kc, N·m/A.
    pub(crate) torque_constant: f64,
    /// Rotor inertia, kg·m².
    pub(crate) rotor_inertia: f64,
    /// Viscous coefficient at the rotor, N·m·s/rad.
    pub(crate) rotor_viscous: f64,
    /// The loads, next to the rotor first.
    pub(crate) loads: Vec<Load>,
}

/// One elementary load and the piece of shaft before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Load {
    /// Inertia, kg·m².
    pub(crate) inertia: f64,
    /// Viscous coefficient, N·m·s/rad.
    pub(crate) viscous: f64,
    /// Stiffness of the shaft towards the rotor, N·m/rad.
    pub(crate) stiffness: f64,
}

impl Chain {
    /// Rotor speed over current (rad/s per A) as a ratio of polynomials of degrees 2n and 2n + 1 (eq. 2.17).
    ///
    /// # Errors
    /// [`SystemError`] where a parameter is not finite.
    pub(crate) fn speed_over_current(&self) -> Result<TransferFunction, SystemError> {
        // θ_j/θ_{j-1} = num/den, from the free end towards the rotor; `rest` is k_j (1 − θ_j/θ_{j−1}) as a ratio
        let mut rest = (Polynomial::new([0.0]), Polynomial::new([1.0]));
        for load in self.loads.iter().rev() {
            // D = s²J + sB + k + rest; θ_j/θ_{j−1} = k/D, so k(1 − k/D) = k(D − k)/D
            let own = Polynomial::new([load.inertia, load.viscous, 0.0]);
            let without = own.times(&rest.1).plus(&rest.0);
            let whole = without.plus(&rest.1.scaled(load.stiffness));
            rest = (without.scaled(load.stiffness), whole);
        }
        let rotor = Polynomial::new([self.rotor_inertia, self.rotor_viscous]);
        // ω/i = Kc/(J s + B + rest/s); rest.0 is divisible by s (every load's D − k is)
        let quotient = divide_by_s(&rest.0);
        let denominator = rotor.times(&rest.1).plus(&quotient);
        TransferFunction::new(
            rest.1.scaled(self.torque_constant).coefficients().to_vec(),
            denominator.coefficients().to_vec(),
        )
    }

    /// The modal split of the chain: base inertia and viscous coefficient, then modes by partial fractions.
    /// Exact where nothing is damped; with damping, K s is the part of each pair's residue that vanishes at rest and the
    /// remainder is neglected.
    ///
    /// # Errors
    /// [`SystemError`] where poles cannot be found.
    pub(crate) fn modal(&self) -> Result<(f64, f64, Vec<Mode>), SystemError> {
        let transfer = self.speed_over_current()?;
        let inertia = self.rotor_inertia + self.loads.iter().map(|l| l.inertia).sum::<f64>();
        let viscous = self.rotor_viscous + self.loads.iter().map(|l| l.viscous).sum::<f64>();
        let slope = transfer.denominator.derivative();
        let mut modes: Vec<Mode> = transfer
            .to_state_space()?
            .poles()?
            .into_iter()
            .filter(|p| p.im > 0.0)
            .map(|p| {
                let residue = transfer.numerator.at(p) / slope.at(p);
                let omega = p.norm();
                Mode {
                    omega,
                    damping: -p.re / omega,
                    gain: 2.0 * residue.re,
                }
            })
            .collect();
        modes.sort_by(|a, b| a.omega.total_cmp(&b.omega));
        Ok((inertia, viscous, modes))
    }
}

fn divide_by_s(p: &Polynomial) -> Polynomial {
    let c = p.coefficients();
    Polynomial::new(c[..c.len().saturating_sub(1)].to_vec())
}
