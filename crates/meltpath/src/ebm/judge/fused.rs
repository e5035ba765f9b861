//! What melts down to the metal below.

use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::grid::Field;

use crate::ebm::judge::beyond::{area_beyond, cells_beyond};
use crate::ebm::plan::Plan;

/// Share of the section, or of `part` of it, over metal whose foot stays solid; `None` where no metal lies below.
pub(in crate::ebm) fn unfused(plan: &Plan, part: Option<&Rectangle>, foot: &Field) -> Option<f64> {
    let melting = plan.settings.material.liquidus;
    let grid = &foot.grid;
    let top = grid.planes() - 1;
    let below = plan.lower.is_empty().then_some(&plan.below);
    let far = area_beyond(grid, &plan.contour, 0.0, part, below);
    let far = cells_beyond(grid, far) as u32;
    let (mut cells, mut solid) = (far, far);
    for j in 0..grid.cells[1] {
        for i in 0..grid.cells[0] {
            let c = grid.centre(i, j, top);
            let point = [c.x, c.y];
            let judged = part.is_none_or(|p| p.depth(point) > 0.0);
            let metal = !plan.lower.is_empty() || plan.below.is_metal(point);
            if judged && metal && plan.contour.depth(point) > 0.0 {
                cells += 1;
                solid += u32::from(foot.at(i, j, top) < melting);
            }
        }
    }
    (cells > 0).then(|| f64::from(solid) / f64::from(cells))
}
