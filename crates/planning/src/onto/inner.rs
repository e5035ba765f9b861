//! Places on the top of a layer away from its rims: where one looks how flat it is.

use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset};
use meltpath_geometry::raster::{Grid, rasterise};
use rayon::prelude::*;

use super::lift::{Lift, TopPlace};
use super::settings::OntoSettings;
use crate::PlanError;

/// Places to a stepover, each way: a bead's crest and its valleys are all seen.
const PLACES: f64 = 5.0;

/// The places of a layer whose pieces lie in `regions` of the plane.
pub(super) fn inner(
    lift: &Lift<'_>,
    regions: &[Region],
    settings: &OntoSettings<'_>,
) -> Result<Vec<TopPlace>, PlanError> {
    let join = Join::Round {
        arc_tolerance: 0.05,
    };
    let layer = lift.layer.number;
    let outline = |source| PlanError::Outline { layer, source };
    let cell = settings.fill.stepover / PLACES;
    let mut places = Vec::new();
    for (number, region) in (0..).zip(regions) {
        let within = inset(std::slice::from_ref(region), settings.inside, join).map_err(outline)?;
        let corners = within.iter().flat_map(|r| &r.outer);
        let (low, high) = corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(a, b), p| {
            (a.min(*p), b.max(*p))
        });
        if within.is_empty() {
            continue;
        }
        let count = ((high - low) / cell).ceil();
        let grid = Grid {
            origin: low + 0.5 * cell,
            cell,
            nx: count.x as usize,
            ny: count.y as usize,
        };
        let cells: Vec<(usize, usize)> = rasterise(&within, &grid).cells().collect();
        let centre = |(x, y): (usize, usize)| grid.origin + cell * DVec2::new(x as f64, y as f64);
        let found: Vec<Option<TopPlace>> = cells
            .into_par_iter()
            .map(|at| lift.top(centre(at), number))
            .collect();
        places.extend(found.into_iter().flatten());
    }
    Ok(places)
}
