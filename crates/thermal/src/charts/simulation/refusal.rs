//! Why a chart simulation is refused, and the check of its step.

use meltpath_base::Cancelled;

use crate::charts::{ChartError, ChartSet};
use crate::grid::GridError;
use crate::material::enthalpy::{CurveError, Enthalpy};

meltpath_base::passes_on! {
    /// Why a simulation was refused or stopped.
    pub enum ChartSimulationError {
        /// The grid.
        Grid(GridError),
        /// The charts.
        Chart(ChartError),
        /// The material.
        Curve(CurveError),
        /// Stopped from outside.
        Cancelled(Cancelled);

        /// Planes that are not the layers of the charts.
        #[error(
            "the voxels' planes must all have one height and reach {reach:.3} mm deep, the charts' heated zone; they are {planes} of {height:.4} mm"
        )]
        Planes {
            /// Depth of the heated zone, mm.
            reach: f64,
            /// Planes given.
            planes: usize,
            /// Height of the top one, mm.
            height: f64,
        },
        /// The beam outside the voxels.
        #[error(
            "at {time:.6} s the beam at ({x:.3}, {y:.3}) mm is outside the voxels {low:?} to {high:?} mm: enlarge the domain (0.5 mm beyond the path is usual) or move the path"
        )]
        Outside {
            /// When, s.
            time: f64,
            /// Where, mm.
            x: f64,
            /// Where, mm.
            y: f64,
            /// Lowest corner, mm.
            low: [f64; 2],
            /// Highest corner, mm.
            high: [f64; 2],
        },
        /// Steps that would jump over the melting of a voxel.
        #[error(
            "a time step of {step:.2e} s loses the phase change: under {power:.1} W on {spot:.1} µm a voxel melts in {melting:.2e} s; use at most {limit:.1e} s"
        )]
        Step {
            /// The step, s.
            step: f64,
            /// Power of the beam, W.
            power: f64,
            /// Its spot, µm.
            spot: f64,
            /// How long the fastest voxel takes from solidus to liquidus, s.
            melting: f64,
            /// The longest step allowed, s.
            limit: f64,
        },
        /// A setting that is not above zero.
        #[error("{what} is {value}: it must be finite and above zero")]
        Setting {
            /// Which.
            what: &'static str,
            /// Its value.
            value: f64,
        },
    }
}

/// Refuses steps longer than half the time in which the fastest voxel melts.
pub(super) fn check_step(
    set: &ChartSet,
    curve: &Enthalpy,
    step: f64,
) -> Result<(), ChartSimulationError> {
    let melting = set
        .charts
        .iter()
        .flat_map(|c| &c.heating)
        .filter(|h| f64::from(h.end) > curve.at_liquidus)
        .map(|h| h.time(curve.at_liquidus) - h.time(curve.at_solidus))
        .fold(f64::INFINITY, f64::min);
    let limit = 0.5 * melting;
    if step > limit {
        let s = &set.settings;
        return Err(ChartSimulationError::Step {
            step,
            power: s.power,
            spot: 1e3 * s.spot,
            melting,
            limit,
        });
    }
    Ok(())
}
