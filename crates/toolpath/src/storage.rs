//! Toolpaths to and from the native container: points and channels as columns, tags and profiles in the index.

use std::ops::Range;

use meltpath_base::container::{Column, Container, ContainerError};
use meltpath_geometry::math::DVec3;
use serde::{Deserialize, Serialize};

use crate::pass::{Channels, Move, Neighbour, Pass, PassId, Role, Tag};
use crate::toolpath::{Profile, Toolpath};

/// Schema of the container that [`to_container`] makes.
pub const TOOLPATH_SCHEMA: &str = "meltpath-toolpath/1";

/// What the index says of one pass; its geometry lies in the columns.
#[derive(Serialize, Deserialize)]
struct PassMeta {
    id: PassId,
    role: Role,
    tag: Tag,
    profile: u32,
    points: u32,
    axes: u32,
    #[serde(default)]
    channels: Channels,
    neighbours: Vec<Neighbour>,
}

#[derive(Serialize, Deserialize)]
struct Meta {
    profiles: Vec<Profile>,
    passes: Vec<PassMeta>,
}

fn push(column: &mut Vec<f64>, v: DVec3) {
    column.extend_from_slice(&v.to_array());
}

/// The toolpath as a container.
pub fn to_container(toolpath: &Toolpath) -> Container {
    let (mut points, mut axes, mut via, mut kinds) = (vec![], vec![], vec![], vec![]);
    let mut passes = Vec::with_capacity(toolpath.passes.len());
    for pass in &toolpath.passes {
        pass.points.iter().for_each(|&p| push(&mut points, p));
        pass.axes.iter().for_each(|&a| push(&mut axes, a));
        for m in &pass.moves {
            let (kind, value) = match *m {
                Move::Line => (0, DVec3::ZERO),
                Move::Arc { via } => (1, via),
                Move::Spot { time } => (2, DVec3::new(time, 0.0, 0.0)),
            };
            kinds.push(kind);
            push(&mut via, value);
        }
        passes.push(PassMeta {
            id: pass.id,
            role: pass.role,
            tag: pass.tag,
            profile: pass.profile,
            points: pass.points.len() as u32,
            axes: pass.axes.len() as u32,
            channels: pass.channels.clone(),
            neighbours: pass.neighbours.clone(),
        });
    }
    let meta = Meta {
        profiles: toolpath.profiles.clone(),
        passes,
    };
    let mut container = Container::new(TOOLPATH_SCHEMA);
    // plain structs of numbers and strings: their JSON exists
    container.meta = serde_json::to_value(&meta).unwrap_or_default();
    container
        .columns
        .insert("points".into(), Column::F64(points));
    container.columns.insert("axes".into(), Column::F64(axes));
    container
        .columns
        .insert("move_kind".into(), Column::U8(kinds));
    container
        .columns
        .insert("move_value".into(), Column::F64(via));
    container
}

/// Takes `count` entries of `column` from the cursor `at`, or says that the column is too short.
fn take<'a, T>(
    column: &'a [T],
    at: &mut usize,
    count: usize,
    name: &str,
) -> Result<&'a [T], ContainerError> {
    let range: Range<usize> = *at..at.saturating_add(count);
    *at = range.end;
    column.get(range).ok_or_else(|| {
        ContainerError::Damaged(format!("column `{name}` is shorter than its passes say"))
    })
}

fn vectors(values: &[f64]) -> Vec<DVec3> {
    values
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&v| DVec3::from_array(v))
        .collect()
}

/// The toolpath of a container.
///
/// # Errors
/// [`ContainerError`] where the container is of another schema or its columns do not fit together.
pub fn from_container(container: &Container) -> Result<Toolpath, ContainerError> {
    if container.schema != TOOLPATH_SCHEMA {
        return Err(ContainerError::Damaged(format!(
            "it holds `{}`, not `{TOOLPATH_SCHEMA}`",
            container.schema
        )));
    }
    let meta: Meta = serde_json::from_value(container.meta.clone())
        .map_err(|e| ContainerError::Damaged(format!("its toolpath index: {e}")))?;
    let (points, axes) = (container.f64("points")?, container.f64("axes")?);
    let (kinds, values) = (container.u8("move_kind")?, container.f64("move_value")?);
    let (mut at_point, mut at_axis, mut at_kind, mut at_value) = (0, 0, 0, 0);
    let mut passes = Vec::with_capacity(meta.passes.len());
    for pass in meta.passes {
        let n = pass.points as usize;
        let moves = n.saturating_sub(1);
        let kind = take(kinds, &mut at_kind, moves, "move_kind")?;
        let value = vectors(take(values, &mut at_value, 3 * moves, "move_value")?);
        let moves = kind
            .iter()
            .zip(value)
            .map(|(&kind, value)| match kind {
                0 => Ok(Move::Line),
                1 => Ok(Move::Arc { via: value }),
                2 => Ok(Move::Spot { time: value.x }),
                other => Err(ContainerError::Damaged(format!(
                    "move kind {other} is unknown"
                ))),
            })
            .collect::<Result<_, _>>()?;
        passes.push(Pass {
            id: pass.id,
            role: pass.role,
            tag: pass.tag,
            profile: pass.profile,
            points: vectors(take(points, &mut at_point, 3 * n, "points")?),
            moves,
            axes: vectors(take(axes, &mut at_axis, 3 * pass.axes as usize, "axes")?),
            channels: pass.channels,
            neighbours: pass.neighbours,
        });
    }
    Ok(Toolpath {
        profiles: meta.profiles,
        passes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_toolpath_survives_storage_to_the_bit() {
        let tag = Tag {
            part: 0,
            layer: 3,
            entity: 1,
        };
        let mut pass = Pass::polyline(
            PassId(7),
            Role::Fill,
            tag,
            vec![DVec3::ZERO, DVec3::X / 3.0, DVec3::Y],
        );
        pass.moves[1] = Move::Arc {
            via: DVec3::new(0.1, 0.7, 0.0),
        };
        pass.axes = vec![DVec3::Z; 3];
        pass.channels.speed = Some(vec![12.5, 10.0]);
        let spot = Pass {
            moves: vec![Move::Spot { time: 0.25 }],
            ..Pass::polyline(PassId(8), Role::Fill, tag, vec![DVec3::X; 2])
        };
        let toolpath = Toolpath {
            profiles: vec![Profile {
                speed: 12.5,
                ..Profile::default()
            }],
            passes: vec![pass, spot],
        };
        let mut bytes = Vec::new();
        to_container(&toolpath).write(&mut bytes).unwrap();
        let read = from_container(&Container::read(&mut &bytes[..]).unwrap()).unwrap();
        assert_eq!(read, toolpath);
    }

    #[test]
    fn short_columns_are_an_error() {
        let tag = Tag {
            part: 0,
            layer: 1,
            entity: 0,
        };
        let toolpath = Toolpath {
            profiles: vec![],
            passes: vec![Pass::polyline(
                PassId(1),
                Role::Fill,
                tag,
                vec![DVec3::ZERO, DVec3::X],
            )],
        };
        let mut container = to_container(&toolpath);
        container
            .columns
            .insert("points".into(), Column::F64(vec![0.0; 3]));
        assert!(matches!(
            from_container(&container),
            Err(ContainerError::Damaged(_))
        ));
        container.schema = "other/1".into();
        assert!(from_container(&container).is_err());
    }
}
