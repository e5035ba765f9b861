//! Sections of a part: what the beam draws in each layer, and where metal lies below the lowest of them.
//!
//! The part is drawn larger, since it shrinks on cooling (Béraud 2016, section 1.2.2: scaling after orientation, before
//! anything else), and cut at the middle of its layers.

use std::ops::Range;

use meltpath_base::settings::Problem;
use meltpath_base::{Observer, Reporter};
use meltpath_geometry::boolean::{PlanarError, intersection};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::section::{SliceError, SlicePlan, slice};
use meltpath_geometry::{Mesh, Plane, Region};

/// Which layers of a part are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Height of the last layer on the part as designed, mm; half the part's where absent.
    pub height: Option<f64>,
    /// Which of the separate areas of that layer, from 1, the largest first; all where absent.
    pub island: Option<u32>,
    /// What the part is drawn larger by, in the plane and along the build direction.
    pub scaling: [f64; 2],
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// How many layers are drawn, the last one included.
    pub layers: u32,
}

/// The sections.
#[derive(Debug, Clone, PartialEq)]
pub struct Sections {
    /// What is drawn in each layer, the lowest first; what was chosen in the last.
    pub drawn: Vec<Vec<Region>>,
    /// Metal below the lowest drawn layer; `None` where that is the plate.
    pub below: Option<Vec<Region>>,
    /// Share of the last layer's area that has that metal, or the plate, below it.
    pub carried: f64,
    /// Number of the last layer, from 1 on the plate.
    pub number: u32,
    /// Layers of the whole part.
    pub of: u32,
    /// Separate areas in the last layer.
    pub islands: usize,
}

/// Why a part cannot be cut.
#[derive(Debug, thiserror::Error)]
pub enum SectionError {
    /// The cut itself.
    #[error(transparent)]
    Slice(#[from] SliceError),
    /// Areas of two layers that cannot be compared.
    #[error("areas of neighbouring layers cannot be compared: {0}")]
    Planar(#[from] PlanarError),
    /// A part thinner than a layer.
    #[error("the part is {height:.3} mm high: less than a layer of {layer} mm")]
    Flat {
        /// Height of the part as drawn, mm.
        height: f64,
        /// Thickness of a layer, mm.
        layer: f64,
    },
    /// A height above the part.
    #[error("section.height is {height} mm, and the part is {top:.3} mm high")]
    Above {
        /// Height asked for, mm.
        height: f64,
        /// Height of the part as designed, mm.
        top: f64,
    },
    /// Nothing solid there.
    #[error(
        "layer {number} of the part has no area: choose another section.height, or mend the part where its surface is open (`meltpath inspect` tells where)"
    )]
    Empty {
        /// Number of the layer.
        number: u32,
    },
    /// An island that is not there.
    #[error(
        "section.island is {island}: layer {number} has {islands} separate areas, counted from 1"
    )]
    Island {
        /// Asked for.
        island: u32,
        /// Number of the layer.
        number: u32,
        /// How many there are.
        islands: usize,
    },
}

impl SectionError {
    /// The error at the place in the job where a value is to blame: of the height, of the island, of the part.
    pub(crate) fn told(&self, [height, island, part]: [&Option<Range<usize>>; 3]) -> Problem {
        let span = match self {
            SectionError::Above { .. } | SectionError::Empty { .. } => height,
            SectionError::Island { .. } => island,
            SectionError::Slice(_) | SectionError::Planar(_) | SectionError::Flat { .. } => &None,
        };
        Problem::new(self.to_string()).at(span.clone().or_else(|| part.clone()))
    }
}

/// The part as the beam draws it: larger in the plane and along the build direction.
///
/// ```
/// use meltpath::stages::section::scaled;
/// use meltpath_geometry::shapes::{extrude, ring};
/// let disc = extrude(&[ring(50.0, 10.0, 64)], 100.0);
/// let (low, high) = scaled(&disc, [1.0086, 1.0093]).bounds().unwrap();
/// assert!((high.z - low.z - 100.93).abs() < 1e-9);
/// ```
pub fn scaled(mesh: &Mesh, [plane, along]: [f64; 2]) -> Mesh {
    let factor = DVec3::new(plane, plane, along);
    Mesh {
        vertices: mesh.vertices.iter().map(|v| *v * factor).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Cuts `mesh`, which stands on z = 0 with its build direction up.
///
/// # Errors
/// [`SectionError`].
pub fn sections(
    mesh: &Mesh,
    cut: &Cut,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Sections, SectionError> {
    let mesh = scaled(mesh, cut.scaling);
    let top = mesh.bounds().map_or(0.0, |(_, high)| high.z);
    // rounding must not cost the last layer of a part that is a whole number of them
    let of = (top / cut.layer + 1e-6).floor();
    if of < 1.0 {
        let layer = cut.layer;
        return Err(SectionError::Flat { height: top, layer });
    }
    let designed = top / cut.scaling[1];
    let height = cut.height.unwrap_or(0.5 * designed);
    if height > designed + 1e-6 {
        let top = designed;
        return Err(SectionError::Above { height, top });
    }
    // the layer that holds the height; a height on a boundary belongs to the layer below it
    let number = (height * cut.scaling[1] / cut.layer - 1e-6)
        .ceil()
        .clamp(1.0, of) as u32;
    let lowest = number.saturating_sub(cut.layers - 1).max(1);
    tell_missing(cut, number, reporter);
    let middle = |n: u32| (f64::from(n) - 0.5) * cut.layer;
    let heights: Vec<f64> = (lowest.saturating_sub(1).max(1)..=number)
        .map(middle)
        .collect();
    let plan = SlicePlan::new(Plane::horizontal(0.0), heights);
    let mut slices = slice(&mesh, &plan, reporter, observer)?;
    let mut last = slices.pop().map(|s| s.regions).unwrap_or_default();
    last.sort_by(|a, b| b.area().total_cmp(&a.area()));
    let islands = last.len();
    if islands == 0 {
        return Err(SectionError::Empty { number });
    }
    if let Some(island) = cut.island {
        let chosen = (island as usize).checked_sub(1).filter(|n| *n < islands);
        let chosen = chosen.ok_or(SectionError::Island {
            island,
            number,
            islands,
        })?;
        last = vec![last.swap_remove(chosen)];
    }
    let mut drawn = vec![last];
    // what carries the area chosen, and what carries that
    for lower in slices.drain(usize::from(lowest > 1)..).rev() {
        let above = &drawn[drawn.len() - 1];
        let mut carries = Vec::new();
        for region in lower.regions {
            if !intersection(std::slice::from_ref(&region), above)?.is_empty() {
                carries.push(region);
            }
        }
        if carries.is_empty() {
            break;
        }
        drawn.push(carries);
    }
    let complete = drawn.len() as u32 == number + 1 - lowest;
    let below = match (lowest, complete) {
        (1, true) => None,
        // nothing carries it: powder everywhere
        (_, false) => Some(Vec::new()),
        (_, true) => Some(slices.pop().map(|s| s.regions).unwrap_or_default()),
    };
    let area = |regions: &[Region]| regions.iter().map(Region::area).sum::<f64>();
    let carried = match &below {
        None => 1.0,
        Some(metal) => area(&intersection(&drawn[0], metal)?) / area(&drawn[0]),
    };
    drawn.reverse();
    Ok(Sections {
        drawn,
        below,
        carried,
        number,
        of: of as u32,
        islands,
    })
}

/// Tells of layers that are asked for and would lie below the plate.
fn tell_missing(cut: &Cut, number: u32, reporter: &Reporter) {
    if cut.layers > number {
        reporter.warn(
            "layers-not-there",
            format!(
                "{} layers are asked for, and the section lies in layer {number} from the plate: only {number} are drawn",
                cut.layers
            ),
            "a higher section.height, or fewer layers",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::Silent;
    use meltpath_geometry::shapes::{extrude, plate};

    fn block(outline: [[f64; 2]; 4]) -> Region {
        Region {
            outer: outline.map(Into::into).to_vec(),
            holes: Vec::new(),
        }
    }

    fn cut(height: f64, layers: u32) -> Cut {
        Cut {
            height: Some(height),
            island: Some(1),
            scaling: [1.0, 1.0],
            layer: 0.05,
            layers,
        }
    }

    fn area(regions: &[Region]) -> f64 {
        regions.iter().map(Region::area).sum()
    }

    fn of(mesh: &Mesh, cut: &Cut) -> Result<Sections, SectionError> {
        sections(mesh, cut, &Reporter::new(), &Silent)
    }

    /// Two legs of 4 x 4 mm, 10 mm high, and a beam of 20 x 4 x 2 mm on them.
    fn bridge() -> Mesh {
        let mut mesh = Mesh::default();
        let boxes = [
            ([-10.0, -2.0, 0.0], [4.0, 4.0, 10.0]),
            ([6.0, -2.0, 0.0], [4.0, 4.0, 10.0]),
            ([-10.0, -2.0, 10.0], [20.0, 4.0, 2.0]),
        ];
        for (corner, size) in boxes {
            let [x, y, z] = corner;
            let [w, d, h] = size;
            let outline = [[x, y], [x + w, y], [x + w, y + d], [x, y + d]];
            let body = extrude(&[block(outline)], h);
            let offset = mesh.vertices.len() as u32;
            mesh.vertices
                .extend(body.vertices.iter().map(|v| *v + DVec3::new(0.0, 0.0, z)));
            mesh.triangles
                .extend(body.triangles.iter().map(|t| t.map(|v| v + offset)));
        }
        mesh
    }

    #[test]
    fn ebm_a01_a_cube_is_drawn_larger() {
        let outline = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]];
        let cube = extrude(&[block(outline)], 100.0);
        let text = meltpath_data::materials::TI6AL4V_EBM.text;
        let material = meltpath_thermal::material::file::read(
            text,
            meltpath_thermal::material::file::Readings::default(),
        )
        .unwrap();
        let (low, high) = scaled(&cube, material.scaling).bounds().unwrap();
        let wanted = DVec3::new(100.86, 100.86, 100.93);
        assert!((high - low - wanted).abs().max_element() < 1e-9 * 100.0);
    }

    #[test]
    fn the_first_layer_of_a_bridge_hangs_between_its_legs() {
        let found = of(&bridge(), &cut(10.05, 1)).unwrap();
        assert_eq!((found.number, found.of, found.islands), (201, 240, 1));
        assert!((area(&found.drawn[0]) - 80.0).abs() < 1e-6);
        assert!((area(found.below.as_ref().unwrap()) - 32.0).abs() < 1e-6);
        assert_eq!(found.below.unwrap().len(), 2);
        assert!((found.carried - 0.4).abs() < 1e-9);
        // with layers below: the legs that carry it are drawn too
        let found = of(&bridge(), &cut(10.05, 3)).unwrap();
        assert_eq!(found.drawn.len(), 3);
        assert!((area(&found.drawn[0]) - 32.0).abs() < 1e-6);
    }

    #[test]
    fn a_leg_is_chosen_and_stands_on_the_plate() {
        let found = of(&bridge(), &cut(0.05, 4)).unwrap();
        assert_eq!((found.number, found.drawn.len(), found.islands), (1, 1, 2));
        assert_eq!(found.below, None);
        let third = Cut {
            island: Some(3),
            ..cut(0.05, 1)
        };
        let refused = of(&bridge(), &third).unwrap_err().to_string();
        assert!(refused.contains("2 separate areas"), "{refused}");
    }

    #[test]
    fn all_areas_of_a_layer_are_drawn_where_none_is_chosen() {
        let all = Cut {
            island: None,
            ..cut(0.1, 2)
        };
        let found = of(&bridge(), &all).unwrap();
        assert_eq!(found.drawn.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        assert!((area(&found.drawn[1]) - 32.0).abs() < 1e-6);
    }

    #[test]
    fn an_area_that_nothing_carries_lies_in_powder() {
        let mut table = extrude(&[plate(9.0, 9.0)], 1.0);
        for v in &mut table.vertices {
            v.z += 3.0;
        }
        let leg = extrude(&[plate(2.0, 2.0)], 2.9);
        let offset = table.vertices.len() as u32;
        table
            .vertices
            .extend(leg.vertices.iter().map(|v| *v + DVec3::X * 20.0));
        table
            .triangles
            .extend(leg.triangles.iter().map(|t| t.map(|v| v + offset)));
        let found = of(&table, &cut(3.1, 5)).unwrap();
        assert_eq!(found.drawn.len(), 2);
        assert_eq!(found.below, Some(Vec::new()));
    }

    #[test]
    fn heights_beyond_the_part_are_refused() {
        let bar = extrude(&[plate(9.0, 9.0)], 1.0);
        assert!(matches!(
            of(&bar, &cut(1.2, 1)),
            Err(SectionError::Above { .. })
        ));
        assert_eq!(of(&bar, &cut(1.0, 1)).unwrap().number, 20);
        let thick = Cut {
            layer: 2.0,
            ..cut(0.5, 1)
        };
        assert!(matches!(of(&bar, &thick), Err(SectionError::Flat { .. })));
    }

    /// Of five layers up to the second one from the plate two are there.
    #[test]
    fn layers_that_are_not_there_are_told() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let mesh = extrude(&[block(square)], 1.0);
        for (layers, told) in [(5, 1), (2, 0)] {
            let reporter = Reporter::new();
            let found = sections(&mesh, &cut(0.1, layers), &reporter, &Silent).unwrap();
            assert_eq!((found.number, found.drawn.len()), (2, 2));
            let all = reporter.warnings();
            let missing = all.iter().filter(|w| w.code == "layers-not-there");
            assert_eq!(missing.count(), told, "{all:?}");
        }
    }
}
