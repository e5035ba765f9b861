//! The standard problem: disturbances and commands in, errors and measurements out.

use super::error::SynthesisError;
use crate::SystemError;
use crate::domain::Domain;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;

/// (errors; measurements) = P (disturbances; commands), commands and measurements last.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneralizedPlant {
    system: StateSpace,
    controls: usize,
    measurements: usize,
}

impl GeneralizedPlant {
    /// A continuous system whose last `controls` inputs are commands and whose last `measurements` outputs are measured.
    ///
    /// # Errors
    /// [`SynthesisError::Channels`], [`SynthesisError::Sampled`].
    pub fn new(
        system: StateSpace,
        controls: usize,
        measurements: usize,
    ) -> Result<Self, SynthesisError> {
        let (inputs, outputs) = (system.inputs(), system.outputs());
        let too_few =
            controls == 0 || measurements == 0 || controls >= inputs || measurements >= outputs;
        if too_few {
            return Err(SynthesisError::Channels {
                inputs,
                outputs,
                controls,
                measurements,
            });
        }
        if system.domain != Domain::Continuous {
            return Err(SynthesisError::Sampled);
        }
        Ok(GeneralizedPlant {
            system,
            controls,
            measurements,
        })
    }

    /// The whole system.
    pub fn system(&self) -> &StateSpace {
        &self.system
    }

    /// Number of commands.
    pub fn controls(&self) -> usize {
        self.controls
    }

    /// Number of measurements.
    pub fn measurements(&self) -> usize {
        self.measurements
    }

    /// Number of disturbances.
    pub fn disturbances(&self) -> usize {
        self.system.inputs() - self.controls
    }

    /// Number of errors.
    pub fn errors(&self) -> usize {
        self.system.outputs() - self.measurements
    }

    /// The loop closed by a controller from measurements to commands.
    ///
    /// # Errors
    /// [`SystemError::Widths`], [`SystemError::AlgebraicLoop`].
    pub fn closed_by(&self, controller: &StateSpace) -> Result<StateSpace, SystemError> {
        if controller.inputs() != self.measurements || controller.outputs() != self.controls {
            return Err(SystemError::Widths {
                what: "controller (measurements and commands)",
                one: self.measurements,
                two: controller.inputs(),
            });
        }
        self.system.lower_fractional(controller)
    }

    pub(super) fn with_system(&self, system: StateSpace) -> Self {
        GeneralizedPlant {
            system,
            ..self.clone()
        }
    }

    pub(super) fn b1(&self) -> Matrix {
        self.system
            .b
            .block(0..self.system.order(), 0..self.disturbances())
    }

    pub(super) fn b2(&self) -> Matrix {
        self.system.b.block(
            0..self.system.order(),
            self.disturbances()..self.system.inputs(),
        )
    }

    pub(super) fn c1(&self) -> Matrix {
        self.system
            .c
            .block(0..self.errors(), 0..self.system.order())
    }

    pub(super) fn c2(&self) -> Matrix {
        self.system
            .c
            .block(self.errors()..self.system.outputs(), 0..self.system.order())
    }

    pub(super) fn d11(&self) -> Matrix {
        self.system
            .d
            .block(0..self.errors(), 0..self.disturbances())
    }

    pub(super) fn d12(&self) -> Matrix {
        self.system
            .d
            .block(0..self.errors(), self.disturbances()..self.system.inputs())
    }

    pub(super) fn d21(&self) -> Matrix {
        self.system
            .d
            .block(self.errors()..self.system.outputs(), 0..self.disturbances())
    }

    pub(super) fn d22(&self) -> Matrix {
        self.system.d.block(
            self.errors()..self.system.outputs(),
            self.disturbances()..self.system.inputs(),
        )
    }
}
