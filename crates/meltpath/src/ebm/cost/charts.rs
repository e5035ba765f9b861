//! What charts cost to compute, told from their settings.

use meltpath_thermal::charts::ChartSettings;

/// Time of computing the charts of one setting at 25 µm, s of one core; measured, 1.2 s at 270 W and 2.6 s at 108 W.
const SECONDS: f64 = 3.0;
/// See `SECONDS`, mm.
const CELL: f64 = 0.025;
/// Half the width and the depth of the block that they are computed on, mm, at least.
const BLOCK: f64 = 0.5;
/// Longest step, s.
const STEP: f64 = 2.5e-6;
/// Arrangements of powder and metal, each with a block of its own.
const LAYOUTS: f64 = 4.0;
/// Bytes of a cell of a block, and of the copy that cooling starts from.
const PER_CELL: f64 = 48.0;
/// Bytes of what is kept of a point at each step.
const PER_POINT: f64 = 4.0;
/// How long heating usually takes, s.
const HEATING: f64 = 1e-3;

/// Of melts of titanium, nickel and steel, mm²/s.
const DIFFUSIVITY: f64 = 10.0;

/// Seconds of one core, and bytes of memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChartCost {
    /// s.
    pub(crate) seconds: f64,
    /// Bytes.
    pub(crate) bytes: f64,
}

/// Of the charts of one setting, over `grounds` temperatures of the ground, one after the other.
pub(crate) fn cost(charts: &ChartSettings, grounds: f64) -> ChartCost {
    let cell = charts.cell;
    let half = BLOCK.max(1.5 * charts.radius);
    let depth = BLOCK.max(1.25 * charts.reach);
    let cells = (half / cell + 2.0).powi(2) * (depth / cell + 2.0);
    let points = (charts.radius / cell + 2.0) * (charts.reach / cell + 2.0);
    let step = STEP.min(cell * cell / (6.0 * DIFFUSIVITY));
    let larger = (half / BLOCK).powi(2) * depth / BLOCK;
    ChartCost {
        seconds: SECONDS * grounds * larger * (CELL / cell).powi(5),
        bytes: LAYOUTS * (PER_CELL * cells + PER_POINT * points * HEATING / step),
    }
}
