//! How flat a layer on a body is: its metal over its planned top, all over the layer inside its rims, once it is whole. Flat layers
//! are measured alike, in cells of their height map.

use meltpath_geometry::workpiece::{Columns, Voxels};
use meltpath_planning::onto::{OntoLayer, TopPlace};
use rayon::prelude::*;

use crate::waam::deposit::target::spread;

/// 5-95 % of the heights of a layer over its planned top lie so far apart, mm; `None` where it is too narrow to have an inside. Metal is
/// looked for as far as `reach` from the top, mm; where there is none its height is that of the lowest place looked at.
pub(super) fn flatness(voxels: &Voxels, layer: &OntoLayer, reach: f64) -> Option<f64> {
    let height = |place: &TopPlace| {
        let up = place.growth;
        let (x, y) = up.any_orthonormal_pair();
        let columns = Columns {
            origin: place.position,
            axes: [x, y, up],
            side: voxels.cell(),
        };
        let column = voxels.column(&columns, (0.0, 0.0), (-reach, 0.5 * reach, reach));
        column.map_or(-reach, |c| c.top)
    };
    spread(layer.inner.par_iter().map(height).collect())
}
