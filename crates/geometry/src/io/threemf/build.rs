//! From 3MF objects and build items to meshes in millimetres.

use std::collections::BTreeMap;

use meltpath_base::Reporter;

use super::element::Placed;
use super::error::ThreeMfError;
use super::limits::{MAX_DEPTH, MAX_INSTANCES, MAX_TRIANGLES};
use super::model::{Kind, Model, Object, Shape};
use crate::Mesh;
use crate::math::DAffine3;
use crate::mesh::NamedMesh;

/// Places every build item of the start part.
pub(super) fn instantiate(
    models: &BTreeMap<String, Model>,
    start: &str,
    reporter: &Reporter,
) -> Result<Vec<NamedMesh>, ThreeMfError> {
    let mut placing = Placing {
        models,
        instances: 0,
        triangles: 0,
    };
    let mut made = Vec::new();
    let items = models.get(start).map_or(&[][..], |m| &m.items);
    for (k, item) in items.iter().enumerate() {
        if !item.printable {
            reporter.warn(
                "3mf-unprintable-skipped",
                format!(
                    "build item {} (object {}) is switched off in its slicer: it was left out",
                    k + 1,
                    item.object
                ),
                "",
            );
            continue;
        }
        let user = || format!("build item {}", k + 1);
        let (part, object) = placing.find(start, item, user)?;
        match object.kind {
            Kind::Part => {}
            Kind::Support => {
                reporter.warn(
                    "3mf-support-skipped",
                    format!(
                        "build item {} (object {}) is support, not part: it was left out",
                        k + 1,
                        item.object
                    ),
                    "",
                );
                continue;
            }
            Kind::Other => {
                return Err(ThreeMfError::Model {
                    part: start.to_owned(),
                    position: 0,
                    message: format!(
                        "build item {} uses object {}, whose type `other` must not be built",
                        k + 1,
                        item.object
                    ),
                });
            }
        }
        if object.has_slices {
            reporter.warn(
                "3mf-slices-ignored",
                format!(
                    "object {} also carries ready-made slices: they were ignored and its mesh was read",
                    item.object
                ),
                "check the size and shape: the mesh may be a mere placeholder",
            );
        }
        let mut mesh = Mesh::default();
        let frame = (DAffine3::IDENTITY, placing.unit(start));
        placing.place(part, object, item, frame, 0, &mut mesh)?;
        if mesh.triangles.is_empty() {
            continue;
        }
        let name = if object.name.is_empty() {
            format!("object {}", item.object)
        } else {
            object.name.clone()
        };
        made.push(NamedMesh { name, mesh });
    }
    if made.is_empty() {
        return Err(ThreeMfError::NothingToBuild);
    }
    Ok(made)
}

struct Placing<'m> {
    models: &'m BTreeMap<String, Model>,
    instances: u64,
    triangles: u64,
}

impl<'m> Placing<'m> {
    /// One unit of a model part in mm.
    fn unit(&self, part: &str) -> f64 {
        self.models.get(part).map_or(1.0, |m| m.unit)
    }

    /// The object that `placed` names in `part`, or in the part that its path leads to.
    fn find(
        &self,
        part: &'m str,
        placed: &'m Placed,
        user: impl Fn() -> String,
    ) -> Result<(&'m str, &'m Object), ThreeMfError> {
        let part = placed.path.as_deref().unwrap_or(part);
        let object = self
            .models
            .get(part)
            .and_then(|m| m.objects.get(&placed.object));
        object
            .map(|o| (part, o))
            .ok_or_else(|| ThreeMfError::MissingObject {
                part: part.to_owned(),
                user: user(),
                object: placed.object,
            })
    }

    /// Adds the triangles of an object, placed by `placed` inside a container (its frame in mm, and the unit of
    /// the part that `placed` stands in), to `mesh`.
    fn place(
        &mut self,
        part: &'m str,
        object: &'m Object,
        placed: &Placed,
        (container, placing_unit): (DAffine3, f64),
        depth: usize,
        mesh: &mut Mesh,
    ) -> Result<(), ThreeMfError> {
        if depth > MAX_DEPTH {
            return Err(ThreeMfError::Nesting {
                object: placed.object,
            });
        }
        self.instances += 1;
        // a translation counts in the unit of the part that places, vertices in that of the part that holds them
        let mut here = placed.transform;
        here.translation *= placing_unit;
        let transform = container * here;
        let unit = self.unit(part);
        match &object.shape {
            Shape::Mesh(own) => {
                self.triangles += own.triangles.len() as u64;
                let vertices = mesh.vertices.len() as u64 + own.vertices.len() as u64;
                if self.triangles > MAX_TRIANGLES
                    || self.instances > MAX_INSTANCES
                    || vertices > u64::from(u32::MAX)
                {
                    return Err(ThreeMfError::TooMany);
                }
                let shift = mesh.vertices.len() as u32;
                let to_mm = own
                    .vertices
                    .iter()
                    .map(|&p| transform.transform_point3(p * unit));
                mesh.vertices.extend(to_mm);
                // a mirror turns triangles inside out: turn them back
                let mirrored = transform.matrix3.determinant() < 0.0;
                mesh.triangles.extend(own.triangles.iter().map(|t| {
                    let [a, b, c] = t.map(|v| v + shift);
                    if mirrored { [a, c, b] } else { [a, b, c] }
                }));
            }
            Shape::Components(components) => {
                if self.instances > MAX_INSTANCES {
                    return Err(ThreeMfError::TooMany);
                }
                for component in components {
                    let user = || format!("a component of object {}", placed.object);
                    let (inner_part, inner) = self.find(part, component, user)?;
                    if inner_part == part && inner.order >= object.order {
                        return Err(ThreeMfError::MissingObject {
                            part: part.to_owned(),
                            user: user(),
                            object: component.object,
                        });
                    }
                    self.place(
                        inner_part,
                        inner,
                        component,
                        (transform, unit),
                        depth + 1,
                        mesh,
                    )?;
                }
            }
        }
        Ok(())
    }
}
