//! A machine that moves around the part: bodies one upon another, what each axis shows at each moment, and what holds the part.

use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_geometry::{Mesh, Pose};

use super::item::{MAX_LAYER, SceneError, check_points};

/// How a body moves on what carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotion {
    /// It turns: values are rad.
    Turns,
    /// It slides: values are mm.
    Slides,
}

/// The axis that moves a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Which of the machine's axes.
    pub axis: usize,
    /// Turns or slides.
    pub motion: JointMotion,
    /// About or along what, of unit length, in the body's own frame.
    pub along: DVec3,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// What people call it.
    pub name: String,
    /// What carries it, an earlier body; nothing where it stands in the world.
    pub carrier: Option<usize>,
    /// Its frame in the carrier's while its axis is at zero.
    pub carrier_from_body: Pose,
    /// What moves it.
    pub joint: Option<Joint>,
    /// Its shape in its own frame, mm; without triangles where it has none.
    pub mesh: Mesh,
}

/// One axis at every moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What people call it.
    pub name: String,
    /// Its values, rad or mm, one a moment.
    pub values: Vec<f64>,
}

/// A machine and what it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// What people call it.
    pub name: String,
    /// Its bodies; each after what carries it.
    pub bodies: Vec<Body>,
    /// The body that holds the part; nothing where it lies in the world.
    pub holder: Option<usize>,
    /// The part in what holds it.
    pub holder_from_part: Pose,
    /// Its axes.
    pub axes: Vec<Axis>,
    /// The moments, s, in order.
    pub times: Vec<f64>,
    /// The layer at each moment, from 1; 0 for none.
    pub layers: Vec<u32>,
}

impl Machine {
    /// Where every body stands at a moment; all at their zero where there is no such moment.
    pub fn poses(&self, moment: usize) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.bodies.len());
        for body in &self.bodies {
            let carrier = body.carrier.and_then(|c| poses.get(c)).copied();
            let moved = body.joint.map_or(Pose::IDENTITY, |joint| {
                let values = self.axes.get(joint.axis).map(|a| &a.values);
                let value = values.and_then(|v| v.get(moment)).copied();
                let value = value.unwrap_or(0.0);
                match joint.motion {
                    JointMotion::Slides => Pose::at(value * joint.along),
                    JointMotion::Turns => Pose {
                        position: DVec3::ZERO,
                        orientation: DQuat::from_axis_angle(joint.along, value),
                    },
                }
            });
            let here = carrier.unwrap_or(Pose::IDENTITY);
            poses.push(here.then(body.carrier_from_body).then(moved));
        }
        poses
    }

    /// Checks that columns agree, moments are in order, bodies stand after what carries them and meshes are whole.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&self) -> Result<(), SceneError> {
        let count = |what: &str, found: usize| {
            if found == self.times.len() {
                return Ok(());
            }
            Err(SceneError::Count {
                what: format!("{}: {what}", self.name),
                expected: self.times.len(),
                found,
                element: "moment",
            })
        };
        count("layers", self.layers.len())?;
        for axis in &self.axes {
            count(&axis.name, axis.values.len())?;
        }
        let index = |index| SceneError::Index {
            what: self.name.clone(),
            index,
        };
        let finite = |values: &[f64]| values.iter().position(|v| !v.is_finite());
        let columns = self.axes.iter().map(|a| a.values.as_slice());
        if let Some(index) = columns.chain([self.times.as_slice()]).find_map(finite) {
            return Err(SceneError::Point {
                what: self.name.clone(),
                index,
            });
        }
        let backwards = |w: &[f64]| matches!(w, [a, b] if b < a);
        if let Some(at) = self.times.windows(2).position(backwards) {
            return Err(index(at + 1));
        }
        if let Some(&layer) = self.layers.iter().find(|&&l| l > MAX_LAYER) {
            return Err(SceneError::Layer {
                what: self.name.clone(),
                layer,
            });
        }
        for (i, body) in self.bodies.iter().enumerate() {
            let axis = body.joint.map_or(0, |j| j.axis + 1);
            let mesh = &body.mesh;
            let hangs = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= mesh.vertices.len());
            if body.carrier.is_some_and(|c| c >= i)
                || axis > self.axes.len()
                || mesh.triangles.iter().any(hangs)
            {
                return Err(index(i));
            }
            check_points(&body.name, &mesh.vertices)?;
        }
        match self.holder {
            Some(holder) if holder >= self.bodies.len() => Err(index(holder)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine() -> Machine {
        let body = |carrier, joint| Body {
            name: "link".to_owned(),
            carrier,
            carrier_from_body: Pose::IDENTITY,
            joint,
            mesh: Mesh::default(),
        };
        let turn = Joint {
            axis: 0,
            motion: JointMotion::Turns,
            along: DVec3::Z,
        };
        Machine {
            name: "arm".to_owned(),
            bodies: vec![body(None, None), body(Some(0), Some(turn))],
            holder: None,
            holder_from_part: Pose::IDENTITY,
            axes: vec![Axis {
                name: "J1".to_owned(),
                values: vec![0.0, 0.5],
            }],
            times: vec![0.0, 1.0],
            layers: vec![0, 1],
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        machine().check().unwrap();
        let refused = |spoil: fn(&mut Machine)| {
            let mut bad = machine();
            spoil(&mut bad);
            bad.check().unwrap_err()
        };
        assert!(matches!(
            refused(|m| m.axes[0].values.truncate(1)),
            SceneError::Count { found: 1, .. }
        ));
        assert!(matches!(
            refused(|m| m.times[1] = -1.0),
            SceneError::Index { index: 1, .. }
        ));
        assert!(matches!(
            refused(|m| m.bodies[1].carrier = Some(1)),
            SceneError::Index { index: 1, .. }
        ));
        assert!(matches!(
            refused(|m| m.bodies[1].joint.as_mut().unwrap().axis = 1),
            SceneError::Index { index: 1, .. }
        ));
        assert!(matches!(
            refused(|m| m.holder = Some(2)),
            SceneError::Index { index: 2, .. }
        ));
        assert!(matches!(
            refused(|m| m.axes[0].values[0] = f64::NAN),
            SceneError::Point { index: 0, .. }
        ));
        assert!(matches!(
            refused(|m| m.layers[0] = 40_000),
            SceneError::Layer { layer: 40_000, .. }
        ));
    }
}
