//! What the 3D view shows: lines, surfaces, and height maps layer by layer, each with scalars to colour them by.

pub mod data;
mod heights;
mod item;
pub mod machine;

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
pub use meltpath_geometry::raster::Grid;

pub use heights::HeightLayers;
pub use machine::Machine;

pub use item::{MAX_LAYER, Scalar, SceneError, Visibility};
use item::{check_points, check_scalars};

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

/// Everything the view shows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Lines: programmed path, simulated motion, travels.
    pub lines: Vec<LineSet>,
    /// Surfaces: the part, the plate.
    pub surfaces: Vec<Surface>,
    /// The predicted surface, layer by layer.
    pub heights: Option<HeightLayers>,
    /// What moves around the part.
    pub machine: Option<Machine>,
}

impl Scene {
    /// Checks every item.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&self) -> Result<(), SceneError> {
        self.lines.iter().try_for_each(LineSet::check)?;
        self.surfaces.iter().try_for_each(Surface::check)?;
        self.machine.iter().try_for_each(Machine::check)
    }

    /// The highest layer of any item.
    pub fn layers(&self) -> u32 {
        let lines = self
            .lines
            .iter()
            .flat_map(|l| l.polylines.iter().map(|p| p.layer));
        let heights = self
            .heights
            .iter()
            .flat_map(|h| h.numbers().iter().copied());
        lines.chain(heights).max().unwrap_or(0)
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
}
