//! Why an electron-beam job could not be done.

use std::path::PathBuf;

use meltpath_gun::focus::FocusError;
use meltpath_melt_strategy::error::StrategyError;
use meltpath_thermal::charts::build::BuildError;
use meltpath_thermal::charts::simulation::ChartSimulationError;
use meltpath_thermal::levels::LevelsError;
use meltpath_thermal::solver::SolverError;

use crate::cancel::{Stop, cancellable, stops};

/// Why an electron-beam job could not be done. Nothing was written then.
#[derive(Debug, thiserror::Error)]
pub enum EbmError {
    /// What stops any command.
    #[error(transparent)]
    Stop(#[from] Stop),
    /// A chart file.
    #[error(
        "cannot use the charts {}: {message}; left out of charts.files, they are computed by the run", .path.display()
    )]
    Charts {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Charts that could not be computed.
    #[error(transparent)]
    Build(BuildError),
    /// The simulation. Its step is the only one of its settings that a job gives freely, so its refusal names the key.
    #[error("{0}{key}", key = key(.0))]
    Simulation(ChartSimulationError),
    /// Better speeds.
    #[error(transparent)]
    Strategy(StrategyError),
    /// The focus.
    #[error(transparent)]
    Focus(#[from] FocusError),
    /// The reference solver.
    #[error("the reference solver: {0}")]
    Reference(SolverError),
    /// The judge.
    #[error("the judge: {0}")]
    Judge(LevelsError),
    /// A part to judge that the beam does not enter.
    #[error(
        "the beam is never on in the part to be judged, {low:?} to {high:?} mm: change judge.part, or leave it out to judge the whole path"
    )]
    EmptyPart {
        /// Lowest corner, mm.
        low: [f64; 2],
        /// Highest corner, mm.
        high: [f64; 2],
    },
    /// More beam settings than charts can be made for.
    #[error(
        "the path has {settings} different beam settings, and charts serve {most}: each needs charts of its own; round the focus to fewer values (of powers there may be any number)"
    )]
    ManySettings {
        /// Settings on the path.
        settings: usize,
        /// How many may be.
        most: usize,
    },
    /// Charts from files that nothing can be taken between.
    #[error(
        "the charts for {:.1} and {:.1} W differ in more than the power, so that those of the powers between them cannot be taken from them: leave one of the two out of charts.files, and the run computes it",
        powers[0], powers[1]
    )]
    UnlikeCharts {
        /// Their powers, W.
        powers: [f64; 2],
    },
    /// A body known to be good that does not melt.
    #[error(
        "the good body (window.body, window.good) melts nothing in its middle, so that the window cannot be centred on it: a larger window.body, more power, or limits of your own (window.low, window.high)"
    )]
    GoodBody,
}

stops!(EbmError);

fn key(refusal: &ChartSimulationError) -> &'static str {
    match refusal {
        ChartSimulationError::Step { .. } => " (simulation.step; left out it is 2.5 µs)",
        _ => "",
    }
}

cancellable!(EbmError:
    BuildError => Build, BuildError::Solver(SolverError::Cancelled(c)) => c;
    ChartSimulationError => Simulation, ChartSimulationError::Cancelled(c) => c;
    StrategyError => Strategy, StrategyError::Simulation(ChartSimulationError::Cancelled(c)) => c;
    SolverError => Reference, SolverError::Cancelled(c) => c;
    LevelsError => Judge, LevelsError::Cancelled(c) => c;
);
