//! Why a wire-arc job or one of its stages could not be done.

use std::path::PathBuf;

use meltpath_base::container::ContainerError;
use meltpath_geometry::overhang::OverhangError;
use meltpath_geometry::section::SliceError;
use meltpath_geometry::workpiece::WorkpieceError;
use meltpath_planning::PlanError;
use meltpath_robot::interpolation::fir::MotionError;

use super::plan::PlanStageError;
use super::program::ProgramStageError;
use super::surface::plan::SurfacePlanError;
use crate::cancel::{Stop, cancellable, stops};
use crate::stages::part::PartError;
use crate::waam::deposit::simulate::SimulateError;
use crate::waam::deposit::target::TargetError;

/// Why a wire-arc job or one of its stages could not be done. Nothing was written then.
#[derive(Debug, thiserror::Error)]
pub enum WaamError {
    /// What stops any command.
    #[error(transparent)]
    Stop(#[from] Stop),
    /// The part.
    #[error(transparent)]
    Part(PartError),
    /// The plan.
    #[error(transparent)]
    Plan(PlanStageError),
    /// The passes on a surface.
    #[error("cannot lay passes on the surface: {0}")]
    Surface(#[from] SurfacePlanError),
    /// The program.
    #[error(transparent)]
    Program(ProgramStageError),
    /// The simulation.
    #[error(transparent)]
    Simulate(SimulateError),
    /// The comparison with the part.
    #[error("cannot compare with the part: {0}")]
    Target(TargetError),
    /// The height map.
    #[error(transparent)]
    Workpiece(#[from] WorkpieceError),
    /// A native file.
    #[error("cannot use {}: {source}", .path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ContainerError,
    },
}

stops!(WaamError);

cancellable!(WaamError:
    PartError => Part, PartError::Cancelled(c) => c;
    PlanStageError => Plan,
        PlanStageError::Cancelled(c)
        | PlanStageError::Slice(SliceError::Cancelled(c))
        | PlanStageError::Overhang(OverhangError::Cancelled(c))
        | PlanStageError::Fill(PlanError::Cancelled(c)) => c;
    ProgramStageError => Program, ProgramStageError::Cancelled(c) => c;
    SimulateError => Simulate, SimulateError::Motion(MotionError::Cancelled(c)) => c;
    TargetError => Target, TargetError::Cancelled(c) | TargetError::Slice(SliceError::Cancelled(c)) => c;
);
