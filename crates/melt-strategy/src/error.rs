//! Why a strategy could not be found.

use meltpath_thermal::beam::BeamError;
use meltpath_thermal::charts::simulation::ChartSimulationError;
use meltpath_thermal::focus::FocusError;
use meltpath_thermal::solver::run::RunError;

/// Why a strategy could not be found.
#[derive(Debug, thiserror::Error)]
pub enum StrategyError {
    /// The chart simulation.
    #[error(transparent)]
    Simulation(#[from] ChartSimulationError),
    /// The reference solver.
    #[error(transparent)]
    Reference(#[from] RunError),
    /// The path.
    #[error(transparent)]
    Beam(#[from] BeamError),
    /// The focus of the beam.
    #[error(transparent)]
    Focus(#[from] FocusError),
    /// A beam whose diameter does not depend on its focus current.
    #[error(
        "the beam is {diameter} mm wide whatever the focus current: give a focus calibration, or change speed or current"
    )]
    FixedFocus {
        /// Its diameter, mm.
        diameter: f64,
    },
    /// A path without spots where their time is to be changed.
    #[error(
        "the beam rests nowhere on this path, so that there is no time on spots to change: draw spots, or change speed or current"
    )]
    NoSpots,
    /// An aim no metal can have.
    #[error("the aim is {celsius:.0} °C: it must lie above the melting range")]
    Aim {
        /// The aim, °C.
        celsius: f64,
    },
}
