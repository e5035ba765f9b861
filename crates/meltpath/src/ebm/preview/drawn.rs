//! A path drawn with charts, and what it did.

use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::criteria::Tally;
use meltpath_thermal::grid::Field;

use crate::ebm::preview::film::Film;

/// A path and what it did.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The path.
    pub path: BeamPath,
    /// The simulation after the last layer.
    pub simulation: ChartSimulation,
    /// Highest temperatures of the last layer, K.
    pub highest: Field,
    /// The judged voxels.
    pub tally: Tally,
    /// Pictures of the last layer.
    pub film: Film,
}
