//! What the 3D view shows: lines, surfaces, and height maps layer by layer, each with scalars to colour them by.

use meltpath_geometry::Mesh;
use meltpath_geometry::math::{DVec2, DVec3};

use crate::colour::ColourMap;

/// Highest layer number that the view can tell apart.
pub const MAX_LAYER: u32 = 0x7fff;

/// Why a scene cannot be shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SceneError {
    /// A column does not have one value per element.
    #[error("{what} has {found} values where {expected} are needed: one per {element}")]
    Count {
        /// The column.
        what: String,
        /// Number of elements.
        expected: usize,
        /// Number of values given.
        found: usize,
        /// What a value belongs to.
        element: &'static str,
    },
    /// A point has an infinite or undefined coordinate.
    #[error("point {index} of \"{what}\" is not finite: remove it before showing")]
    Point {
        /// Name of the set.
        what: String,
        /// Index of the point.
        index: usize,
    },
    /// A triangle or polyline refers to a point that is not there, or polylines are out of order.
    #[error(
        "element {index} of \"{what}\" begins or lies at a point that does not exist or is out of order"
    )]
    Index {
        /// Name of the set.
        what: String,
        /// Index of the triangle or polyline.
        index: usize,
    },
    /// More layers than the view can tell apart.
    #[error("layer {layer} of \"{what}\": the view tells layers 0 to {MAX_LAYER} apart")]
    Layer {
        /// Name of the set.
        what: String,
        /// The layer given.
        layer: u32,
    },
    /// The cell size or the counts of a grid make no sense.
    #[error(
        "grid of {nx} x {ny} cells of {cell} mm: both counts and the cell size must be positive"
    )]
    Grid {
        /// Cells along x.
        nx: usize,
        /// Cells along y.
        ny: usize,
        /// Cell size as given, mm.
        cell: String,
    },
}

/// Whether an item is shown when the page opens; a person can change it there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Visibility {
    /// Shown at first.
    #[default]
    Shown,
    /// Hidden at first.
    Hidden,
}

/// A named field over the points of an item.
#[derive(Debug, Clone, PartialEq)]
pub struct Scalar {
    /// Name, such as `speed`.
    pub name: String,
    /// Unit as written for people; empty when the value has none.
    pub unit: String,
    /// One value per point; NaN where there is none.
    pub values: Vec<f32>,
    /// Ends of the colour scale; values beyond take the end colours. The range of the values when absent.
    pub range: Option<[f64; 2]>,
    /// Which colours.
    pub map: ColourMap,
}

impl Scalar {
    /// A sequential scalar over the range of its values.
    pub fn new(name: &str, unit: &str, values: Vec<f32>) -> Self {
        Scalar {
            name: name.to_owned(),
            unit: unit.to_owned(),
            values,
            range: None,
            map: ColourMap::Sequential,
        }
    }

    /// The same scalar with blue-to-red colours over `-limit..limit`.
    #[must_use]
    pub fn diverging(self, limit: f64) -> Self {
        Scalar {
            range: Some([-limit.abs(), limit.abs()]),
            map: ColourMap::Diverging,
            ..self
        }
    }
}

/// How lines are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stroke {
    /// Round beads of this diameter, mm, coloured by a scalar.
    Bead(f64),
    /// Thin grey lines, for moves without deposit.
    Hairline,
}

/// One polyline of a [`LineSet`]: from its first point to the point before the next polyline's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Polyline {
    /// Index of its first point.
    pub first: usize,
    /// Its layer, counted from 1; 0 for lines that belong to none and are always shown.
    pub layer: u32,
}

/// Polylines, up to some millions of points.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSet {
    /// Name in the list of items.
    pub name: String,
    /// Points of all polylines one after another, mm, part frame.
    pub points: Vec<DVec3>,
    /// The polylines, by ascending first point; the first begins at 0.
    pub polylines: Vec<Polyline>,
    /// Fields over the points.
    pub scalars: Vec<Scalar>,
    /// How the lines are drawn.
    pub stroke: Stroke,
    /// Whether they are shown at first.
    pub visibility: Visibility,
}

impl LineSet {
    /// The same lines with at most about `points` points: every k-th point of each polyline and its last one.
    ///
    /// Returns k beside the lines; `None` when they have no more than that already.
    pub fn thinned(&self, points: usize) -> Option<(LineSet, usize)> {
        let every = self.points.len().div_ceil(points.max(2));
        if every <= 1 {
            return None;
        }
        let mut kept = Vec::new();
        let mut polylines = Vec::with_capacity(self.polylines.len());
        for (i, polyline) in self.polylines.iter().enumerate() {
            let past = self
                .polylines
                .get(i + 1)
                .map_or(self.points.len(), |next| next.first);
            polylines.push(Polyline {
                first: kept.len(),
                layer: polyline.layer,
            });
            let last = past.saturating_sub(1);
            kept.extend(
                (polyline.first..past)
                    .filter(|p| (p - polyline.first).is_multiple_of(every) || *p == last),
            );
        }
        let scalars = self
            .scalars
            .iter()
            .map(|s| Scalar {
                values: kept
                    .iter()
                    .filter_map(|&p| s.values.get(p).copied())
                    .collect(),
                ..s.clone()
            })
            .collect();
        let thinned = LineSet {
            name: self.name.clone(),
            points: kept
                .iter()
                .filter_map(|&p| self.points.get(p).copied())
                .collect(),
            polylines,
            scalars,
            stroke: self.stroke,
            visibility: self.visibility,
        };
        Some((thinned, every))
    }

    /// Checks that the counts agree, points are finite, polylines in order and layers in range.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&self) -> Result<(), SceneError> {
        check_points(&self.name, &self.points)?;
        check_scalars(&self.name, &self.scalars, self.points.len())?;
        let mut expected = 0..=0;
        for (index, polyline) in self.polylines.iter().enumerate() {
            if !expected.contains(&polyline.first) || polyline.first >= self.points.len() {
                return Err(SceneError::Index {
                    what: self.name.clone(),
                    index,
                });
            }
            if polyline.layer > MAX_LAYER {
                return Err(SceneError::Layer {
                    what: self.name.clone(),
                    layer: polyline.layer,
                });
            }
            expected = polyline.first + 1..=self.points.len();
        }
        if self.polylines.is_empty() && !self.points.is_empty() {
            return Err(SceneError::Index {
                what: self.name.clone(),
                index: 0,
            });
        }
        Ok(())
    }
}

/// A triangle mesh that is the same at every layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Name in the list of items.
    pub name: String,
    /// The mesh, mm, part frame.
    pub mesh: Mesh,
    /// Fields over the vertices.
    pub scalars: Vec<Scalar>,
    /// 1 opaque, below 1 seen through.
    pub opacity: f64,
    /// Whether it is shown at first.
    pub visibility: Visibility,
}

impl Surface {
    /// Checks that the counts agree, points are finite and triangles refer to vertices.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&self) -> Result<(), SceneError> {
        check_points(&self.name, &self.mesh.vertices)?;
        check_scalars(&self.name, &self.scalars, self.mesh.vertices.len())?;
        let n = self.mesh.vertices.len();
        let wrong = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= n);
        match self.mesh.triangles.iter().position(wrong) {
            Some(index) => Err(SceneError::Index {
                what: self.name.clone(),
                index,
            }),
            None => Ok(()),
        }
    }
}

/// A regular grid in plan, row-major from its first cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Centre of the first cell, mm.
    pub origin: DVec2,
    /// Cell size, mm.
    pub cell: f64,
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
}

/// The predicted surface after chosen layers.
///
/// Snapshots are averaged over blocks of cells as they come, so that the page stays small; [`HeightLayers::shown`]
/// says at which cell size.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightLayers {
    /// Name in the list of items.
    pub name: String,
    /// 1 opaque, below 1 seen through, so that the paths inside show.
    pub opacity: f64,
    /// Whether it is shown at first.
    pub visibility: Visibility,
    given: Grid,
    block: usize,
    shown: Grid,
    numbers: Vec<u32>,
    heights: Vec<f32>,
    scalars: Vec<Scalar>,
}

/// Height values that a page carries at most, over all snapshots: about 10 MB of page for noisy ones.
const SHOWN_VALUES: usize = 12_000_000;

impl HeightLayers {
    /// Begins with no snapshot; `snapshots` is how many will come, which decides the cell size shown.
    ///
    /// # Errors
    /// [`SceneError::Grid`] when the grid is empty or its cell size not positive.
    pub fn new(name: &str, grid: Grid, snapshots: usize) -> Result<Self, SceneError> {
        let usable = grid.nx >= 1 && grid.ny >= 1 && grid.cell > 0.0 && grid.cell.is_finite();
        if !usable || !grid.origin.is_finite() || grid.nx.checked_mul(grid.ny).is_none() {
            return Err(SceneError::Grid {
                nx: grid.nx,
                ny: grid.ny,
                cell: grid.cell.to_string(),
            });
        }
        let fits = |block: usize| {
            let cells = grid.nx.div_ceil(block) as f64 * grid.ny.div_ceil(block) as f64;
            cells * snapshots.max(1) as f64 <= SHOWN_VALUES as f64
        };
        let coarsest = grid.nx.max(grid.ny);
        let block = (1..coarsest).find(|&b| fits(b)).unwrap_or(coarsest);
        let half = 0.5 * grid.cell * (block - 1) as f64;
        let shown = Grid {
            origin: grid.origin + DVec2::splat(half),
            cell: grid.cell * block as f64,
            nx: grid.nx.div_ceil(block),
            ny: grid.ny.div_ceil(block),
        };
        Ok(HeightLayers {
            name: name.to_owned(),
            opacity: 1.0,
            visibility: Visibility::Shown,
            given: grid,
            block,
            shown,
            numbers: Vec::new(),
            heights: Vec::new(),
            scalars: Vec::new(),
        })
    }

    /// Declares a field that every snapshot carries; before the first snapshot. `range` and colours as in [`Scalar`],
    /// whose `values` are ignored.
    #[must_use]
    pub fn with_scalar(mut self, scalar: Scalar) -> Self {
        self.scalars.push(Scalar {
            values: Vec::new(),
            ..scalar
        });
        self
    }

    /// Adds the surface after `layer` (counted from 1): heights, mm, and one frame per declared field, NaN where
    /// there is no value.
    ///
    /// # Errors
    /// [`SceneError::Count`] when a frame does not match the grid or a field is missing, [`SceneError::Layer`]
    /// when layers do not ascend or are too many; nothing is added then.
    pub fn push(
        &mut self,
        layer: u32,
        heights: &[f64],
        scalars: &[&[f64]],
    ) -> Result<(), SceneError> {
        if layer > MAX_LAYER || self.numbers.last().is_some_and(|&last| last >= layer) {
            return Err(SceneError::Layer {
                what: self.name.clone(),
                layer,
            });
        }
        let wrong = |what: &str, expected, found, element| SceneError::Count {
            what: format!("{what} of \"{}\" at layer {layer}", self.name),
            expected,
            found,
            element,
        };
        if scalars.len() != self.scalars.len() {
            return Err(wrong(
                "fields",
                self.scalars.len(),
                scalars.len(),
                "declared field",
            ));
        }
        let cells = self.given.nx * self.given.ny;
        for frame in scalars.iter().chain([&heights]) {
            if frame.len() != cells {
                return Err(wrong("frame", cells, frame.len(), "cell"));
            }
        }
        self.numbers.push(layer);
        block_means(heights, &self.given, self.block, &mut self.heights);
        for (scalar, frame) in self.scalars.iter_mut().zip(scalars) {
            block_means(frame, &self.given, self.block, &mut scalar.values);
        }
        Ok(())
    }

    /// The grid shown; its cell size is a whole multiple of the one given.
    pub fn shown(&self) -> Grid {
        self.shown
    }

    /// The grid given.
    pub fn given(&self) -> Grid {
        self.given
    }

    /// Layers after which the snapshots stand, ascending.
    pub fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// Heights of all snapshots one after another, on the shown grid, mm.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// The fields, their frames one after another, on the shown grid.
    pub fn scalars(&self) -> &[Scalar] {
        &self.scalars
    }
}

/// Appends the mean of the finite values of each block; NaN where a block has none.
fn block_means(frame: &[f64], grid: &Grid, block: usize, out: &mut Vec<f32>) {
    if block == 1 {
        out.extend(frame.iter().map(|&v| v as f32));
        return;
    }
    for by in (0..grid.ny).step_by(block) {
        for bx in (0..grid.nx).step_by(block) {
            let (mut sum, mut count) = (0.0, 0.0);
            for iy in by..(by + block).min(grid.ny) {
                let row = &frame[iy * grid.nx + bx..iy * grid.nx + (bx + block).min(grid.nx)];
                for v in row.iter().filter(|v| v.is_finite()) {
                    sum += v;
                    count += 1.0;
                }
            }
            out.push((sum / count) as f32);
        }
    }
}

/// Everything the view shows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Lines: programmed path, simulated motion, travels.
    pub lines: Vec<LineSet>,
    /// Surfaces: the part, the plate.
    pub surfaces: Vec<Surface>,
    /// The predicted surface, layer by layer.
    pub heights: Option<HeightLayers>,
}

impl Scene {
    /// Checks every item.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&self) -> Result<(), SceneError> {
        self.lines.iter().try_for_each(LineSet::check)?;
        self.surfaces.iter().try_for_each(Surface::check)
    }

    /// The highest layer of any item.
    pub fn layers(&self) -> u32 {
        let lines = self
            .lines
            .iter()
            .flat_map(|l| l.polylines.iter().map(|p| p.layer));
        let heights = self.heights.iter().flat_map(|h| h.numbers.iter().copied());
        lines.chain(heights).max().unwrap_or(0)
    }
}

fn check_points(what: &str, points: &[DVec3]) -> Result<(), SceneError> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(index) => Err(SceneError::Point {
            what: what.to_owned(),
            index,
        }),
        None => Ok(()),
    }
}

fn check_scalars(what: &str, scalars: &[Scalar], expected: usize) -> Result<(), SceneError> {
    match scalars.iter().find(|s| s.values.len() != expected) {
        Some(s) => Err(SceneError::Count {
            what: format!("\"{}\" of \"{what}\"", s.name),
            expected,
            found: s.values.len(),
            element: "point",
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(n: usize) -> LineSet {
        LineSet {
            name: "path".to_owned(),
            points: (0..n).map(|i| DVec3::X * i as f64).collect(),
            polylines: vec![
                Polyline { first: 0, layer: 1 },
                Polyline {
                    first: n / 2,
                    layer: 2,
                },
            ],
            scalars: vec![Scalar::new("index", "", (0..n).map(|i| i as f32).collect())],
            stroke: Stroke::Bead(1.0),
            visibility: Visibility::Shown,
        }
    }

    #[test]
    fn a_scene_that_makes_no_sense_is_refused_with_the_place() {
        let good = lines(10);
        good.check().unwrap();
        let mut bad = good.clone();
        bad.points[3].y = f64::NAN;
        assert!(matches!(
            bad.check(),
            Err(SceneError::Point { index: 3, .. })
        ));
        let mut bad = good.clone();
        bad.scalars[0].values.pop();
        assert!(matches!(
            bad.check(),
            Err(SceneError::Count {
                expected: 10,
                found: 9,
                ..
            })
        ));
        let mut bad = good.clone();
        bad.polylines[1].first = 10;
        assert!(matches!(
            bad.check(),
            Err(SceneError::Index { index: 1, .. })
        ));
        let mut bad = good.clone();
        bad.polylines[1].layer = 40_000;
        assert!(matches!(bad.check(), Err(SceneError::Layer { .. })));
        let surface = Surface {
            name: "part".to_owned(),
            mesh: Mesh {
                vertices: vec![DVec3::ZERO; 3],
                triangles: vec![[0, 1, 3]],
            },
            scalars: vec![],
            opacity: 1.0,
            visibility: Visibility::Shown,
        };
        assert!(matches!(
            surface.check(),
            Err(SceneError::Index { index: 0, .. })
        ));
    }

    #[test]
    fn thinning_keeps_the_ends_of_every_polyline() {
        let whole = lines(1001);
        assert!(whole.thinned(1001).is_none());
        let (thin, every) = whole.thinned(101).unwrap();
        assert_eq!(every, 10);
        thin.check().unwrap();
        assert!(thin.points.len() <= 110);
        assert_eq!(thin.points[thin.polylines[1].first], whole.points[500]);
        assert_eq!(thin.points[thin.polylines[1].first - 1], whole.points[499]);
        assert_eq!(thin.points.last(), whole.points.last());
        assert_eq!(thin.scalars[0].values.last(), Some(&1000.0));
    }

    #[test]
    fn large_maps_are_averaged_and_say_so() {
        let grid = Grid {
            origin: DVec2::ZERO,
            cell: 0.5,
            nx: 1001,
            ny: 1000,
        };
        let mut layers = HeightLayers::new("built", grid, 200).unwrap();
        let shown = layers.shown();
        assert_eq!((shown.nx, shown.ny), (201, 200));
        assert_eq!(shown.cell, 2.5);
        assert_eq!(shown.origin, DVec2::splat(1.0));
        let plane: Vec<f64> = (0..grid.nx * grid.ny)
            .map(|i| (i % grid.nx) as f64 * grid.cell)
            .collect();
        layers.push(1, &plane, &[]).unwrap();
        // the mean of a plane over a block is its value at the block's centre
        assert_eq!(
            f64::from(layers.heights()[7]),
            shown.origin.x + 7.0 * shown.cell
        );
        assert!(matches!(
            layers.push(1, &plane, &[]),
            Err(SceneError::Layer { .. })
        ));
        assert!(matches!(
            layers.push(2, &plane[1..], &[]),
            Err(SceneError::Count { .. })
        ));
        assert_eq!(layers.numbers(), [1]);
    }
}
