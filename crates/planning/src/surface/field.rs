//! Directions of the torch that a person gives at places, and what they are between.

use std::collections::HashMap;

use meltpath_geometry::math::DVec3;

use super::pass::SurfacePass;

/// Directions that agree by less than this share of their length turn over between their places: 60° to both sides of their mean.
const AGREE: f64 = 0.5;

/// Why directions say nothing of a wall.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// No place near.
    #[error("pass {pass} is more than {reach:.1} mm from every place of the directions at ({:.1}, {:.1}, {:.1}) mm of the build: give some there", .at.x, .at.y, .at.z)]
    Sparse {
        /// The pass.
        pass: u32,
        /// Where, mm.
        at: DVec3,
        /// How far a place counts, mm.
        reach: f64,
    },
    /// Directions beside each other that show against each other.
    #[error("the directions about ({:.1}, {:.1}, {:.1}) mm of the build, at pass {pass}, show against each other: a torch cannot turn over between them", .at.x, .at.y, .at.z)]
    Flips {
        /// The pass.
        pass: u32,
        /// Where, mm.
        at: DVec3,
    },
}

/// Directions at places. Between them the direction is a mean, by the weights of Shepard with an end: ((R - d) / (R d))² of a place at the
/// distance d within the reach R. It is that of a place at the place, and turns evenly between. (Franke and Nielson 1980.)
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    reach: f64,
    /// Places with unit directions, in cubes as wide as the reach.
    cubes: HashMap<[i64; 3], Vec<[DVec3; 2]>>,
}

impl Field {
    /// Of places and directions of any length but zero, each of which counts up to `reach` mm away.
    pub fn new(places: impl IntoIterator<Item = [DVec3; 2]>, reach: f64) -> Self {
        let mut field = Field {
            reach,
            cubes: HashMap::new(),
        };
        for [at, direction] in places {
            let cube = field.cube(at);
            let own = field.cubes.entry(cube).or_default();
            own.push([at, direction.normalize_or_zero()]);
        }
        field
    }

    fn cube(&self, p: DVec3) -> [i64; 3] {
        (p / self.reach).floor().to_array().map(|v| v as i64)
    }

    /// The mean of the directions about a place, shorter than one the less they agree; nothing where none is near.
    fn mean(&self, p: DVec3) -> Option<DVec3> {
        let [x, y, z] = self.cube(p);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        let beside =
            (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
        for [i, j, k] in beside {
            for [at, direction] in self.cubes.get(&[x + i, y + j, z + k]).into_iter().flatten() {
                let far = p.distance(*at);
                if far >= self.reach {
                    continue;
                }
                if far < 1e-9 * self.reach {
                    return Some(*direction);
                }
                let weight = ((self.reach - far) / (self.reach * far)).powi(2);
                sum += weight * *direction;
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }

    /// The unit direction at a place; nothing where no place is near, or where those that are show against each other.
    pub fn at(&self, p: DVec3) -> Option<DVec3> {
        self.mean(p)
            .filter(|m| m.length() >= AGREE)?
            .try_normalize()
    }

    /// Passes that have a direction everywhere, divided so that no move is longer than an eighth of the reach: the torch turns along it.
    ///
    /// # Errors
    /// [`FieldError`] with the first place that has none.
    pub fn along(&self, passes: &[SurfacePass]) -> Result<Vec<SurfacePass>, FieldError> {
        let each = passes.iter().map(|pass| {
            let divided = pass.divided(0.125 * self.reach);
            let mut before: Option<DVec3> = None;
            for point in &divided.points {
                let (pass, at) = (pass.number, point.position);
                match self.mean(at) {
                    None => {
                        let reach = self.reach;
                        return Err(FieldError::Sparse { pass, at, reach });
                    }
                    Some(mean) if mean.length() < AGREE => {
                        return Err(FieldError::Flips { pass, at });
                    }
                    Some(mean) => {
                        // between two points it may turn over without being seen at either
                        let here = mean.normalize();
                        if before.is_some_and(|before| before.dot(here) < AGREE) {
                            return Err(FieldError::Flips { pass, at });
                        }
                        before = Some(here);
                    }
                }
            }
            Ok(divided)
        });
        each.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::SurfacePoint;

    /// Directions that lean more and more along x, a place each 5 mm.
    fn leaning() -> Field {
        let place = |k: u32| {
            let x = 5.0 * f64::from(k);
            let (sin, cos) = (0.01 * x).sin_cos();
            [DVec3::X * x, 3.0 * DVec3::new(sin, 0.0, cos)]
        };
        Field::new((0..=10).map(place), 12.0)
    }

    #[test]
    fn a_direction_is_that_of_its_place_and_turns_evenly_between() {
        let field = leaning();
        let angle = |x: f64| {
            let d = field.at(DVec3::X * x).unwrap();
            d.x.atan2(d.z)
        };
        assert!((angle(20.0) - 0.2).abs() < 1e-9);
        let mut before = angle(0.0);
        for k in 1..=500 {
            let x = 0.1 * f64::from(k);
            let here = angle(x);
            assert!((here - 0.01 * x).abs() < 0.03, "{x} {here}");
            assert!((here - before).abs() < 0.006, "{x}");
            before = here;
        }
    }

    #[test]
    fn what_is_far_and_what_turns_over_is_told() {
        let pass = |x: [f64; 2]| SurfacePass {
            number: 4,
            points: x
                .map(|x| SurfacePoint {
                    position: DVec3::X * x,
                    normal: DVec3::Y,
                    growth: DVec3::Z,
                    from: None,
                })
                .to_vec(),
        };
        let field = leaning();
        let divided = field.along(&[pass([0.0, 50.0])]).unwrap();
        assert_eq!(divided[0].points.len(), 35);
        let far = field.along(&[pass([0.0, 63.0])]).unwrap_err();
        assert!(
            far.to_string().contains("pass 4 is more than 12.0 mm"),
            "{far}"
        );
        let against = [[DVec3::ZERO, DVec3::Z], [DVec3::X * 4.0, -DVec3::Z]];
        let over = Field::new(against, 12.0)
            .along(&[pass([0.0, 4.0])])
            .unwrap_err();
        assert!(matches!(over, FieldError::Flips { pass: 4, .. }));
        assert_eq!(Field::new(against, 12.0).at(DVec3::X * 2.0), None);
    }
}
