//! Why a strategy could not be found.

use meltpath_thermal::beam::BeamError;
use meltpath_thermal::charts::simulation::ChartSimulationError;
use meltpath_thermal::solver::SolverError;

meltpath_base::passes_on! {
    /// Why a strategy could not be found.
    pub enum StrategyError {
        /// The chart simulation.
        Simulation(ChartSimulationError),
        /// The reference solver.
        Reference(SolverError),
        /// The path.
        Beam(BeamError);

        /// A path without spots where their time is to be changed.
        #[error(
            "the beam rests nowhere on this path, so that there is no time on spots to change: draw spots, or change speed or power"
        )]
        NoSpots,
        /// An aim no metal can have.
        #[error("the aim is {celsius:.0} °C: it must lie above the melting range")]
        Aim {
            /// The aim, °C.
            celsius: f64,
        },
    }
}
