//! What the beads of a layer cover of each region, and where they do not.

use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::cover::{Cover, Ground};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::{Plane, Region};
use serde::{Deserialize, Serialize};

use crate::fill::outline::{contains, edges};
use crate::fill::settings::FillSettings;

/// A place that no bead covers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Its middle, mm, part frame.
    pub place: DVec3,
    /// Its area, mm².
    pub area: f64,
}

/// How the beads cover one region, each bead taken as wide as a single bead, with round ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Index of the region in the layer; the `entity` of its passes.
    pub region: u32,
    /// Area of the region, mm².
    pub area: f64,
    /// Area of it under beads, mm².
    pub covered_area: f64,
    /// Area of it under none, mm².
    pub lack_area: f64,
    /// Area of beads outside the region, mm².
    pub outside_area: f64,
    /// Bead length at nominal speed times stepover over area: above 1 the beads bring more metal than a flat layer takes.
    pub fill_ratio: f64,
    /// The largest places under no bead, largest first, at most twenty, each larger than a fiftieth of a squared width.
    pub gaps: Vec<Gap>,
}

fn area(regions: &[Region]) -> f64 {
    regions.iter().map(Region::area).sum()
}

/// Coverage of `region`, whose ground is that of the settings' metal, by the polylines `beads`.
pub(crate) fn coverage(
    index: u32,
    region: &Region,
    ground: &Ground,
    beads: &[Vec<DVec2>],
    (plane, settings): (&Plane, &FillSettings),
) -> Result<Coverage, PlanarError> {
    let Cover {
        bare: lack,
        beyond: outside_area,
    } = ground.cover(beads)?;
    let total = region.area();
    // corners fall on the grid of the booleans: no more is bare than there is
    let lack_area = area(&lack).min(total);
    let least = 0.02 * settings.width * settings.width;
    let mut gaps: Vec<Gap> = lack
        .iter()
        .filter(|r| r.area() > least)
        .map(|r| Gap {
            place: plane.from_local(middle(r)),
            area: r.area(),
        })
        .collect();
    gaps.sort_by(|a, b| b.area.total_cmp(&a.area));
    gaps.truncate(20);
    Ok(Coverage {
        region: index,
        area: total,
        covered_area: total - lack_area,
        lack_area,
        outside_area,
        fill_ratio: 0.0,
        gaps,
    })
}

/// The centre of area, or the point of the boundary nearest to it where that lies outside.
fn middle(region: &Region) -> DVec2 {
    let o = region.outer.first().copied().unwrap_or_default();
    let mut moment = DVec2::ZERO;
    for ring in region.rings() {
        for (a, b) in edges(ring) {
            let (a, b) = (a - o, b - o);
            moment += (a + b) * (a.perp_dot(b) / 6.0);
        }
    }
    let total = region.area();
    if total <= 0.0 {
        return o;
    }
    let centre = o + moment / total;
    if contains(std::slice::from_ref(region), centre) {
        return centre;
    }
    let vertices = region.rings().flatten().copied();
    vertices
        .min_by(|a, b| {
            a.distance_squared(centre)
                .total_cmp(&b.distance_squared(centre))
        })
        .unwrap_or(centre)
}
