//! The links of a URDF as bodies of the arm: what stands on which joint, and the hull of each.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::shapes::{cuboid, revolve};
use meltpath_geometry::{Mesh, Pose};

use super::error::{LinkFault, UrdfError};
use super::links::{Form, Piece, pieces};
use super::mesh::{self, Named};
use super::read::Joint;
use crate::cell::layout::LinkHull;
use crate::hull::{Fineness, Hull, Pieces};

/// Sides of what is round.
const SIDES: u32 = 32;

/// A link on the joint that carries it.
pub(super) struct Carried {
    pub(super) link: String,
    /// How many joints of the arm lie before it.
    pub(super) joint: u8,
    /// In the frame of the last of these, of the file's root before the first; mm.
    pub(super) joint_from_link: Pose,
}

/// The bodies of an arm.
#[derive(Debug, Default)]
pub(crate) struct Bodies {
    /// Each in the frame of its joint; the base in the root of the file.
    pub(crate) hulls: Vec<LinkHull>,
    /// Files that were read.
    pub(crate) files: Vec<Named>,
    /// Links of the file that hang beside the arm on joints of their own, and have a shape.
    pub(crate) beside: Vec<String>,
}

/// The links that the arm's way carries, and those that move by joints beside it.
pub(super) fn carried(root: &str, joints: &[Joint], way: &[&Joint]) -> (Vec<Carried>, Vec<String>) {
    let mut of_parent: BTreeMap<&str, Vec<&Joint>> = BTreeMap::new();
    for joint in joints {
        of_parent.entry(&joint.parent).or_default().push(joint);
    }
    let (mut all, mut beside) = (Vec::new(), Vec::new());
    let mut open = vec![(root, Some((0, Pose::IDENTITY)))];
    while let Some((link, place)) = open.pop() {
        match place {
            Some((joint, joint_from_link)) => all.push(Carried {
                link: link.to_owned(),
                joint,
                joint_from_link,
            }),
            None => beside.push(link.to_owned()),
        }
        for next in of_parent.get(link).into_iter().flatten() {
            let on_way = way.iter().any(|j| j.name == next.name);
            let place = place.and_then(|(joint, pose)| {
                if next.moves() {
                    (on_way && next.turns()).then_some((joint + 1, Pose::IDENTITY))
                } else {
                    Some((joint, pose.then(next.pose())))
                }
            });
            open.push((&next.child, place));
        }
    }
    (all, beside)
}

/// The bodies of links, from the text of a URDF that lies in `folder`.
pub(super) fn bodies(
    text: &str,
    folder: &Path,
    (carried, beside): (Vec<Carried>, Vec<String>),
) -> Result<Bodies, UrdfError> {
    let pieces = pieces(text)?;
    let of = |link: &str| pieces.get(link).map_or(&[][..], Vec::as_slice);
    let mut found = Bodies {
        beside: beside.into_iter().filter(|l| !of(l).is_empty()).collect(),
        ..Bodies::default()
    };
    for link in carried {
        let all = of(&link.link);
        let collides = all.iter().any(|p| p.collides);
        for piece in all.iter().filter(|p| p.collides == collides) {
            found.add(&link, piece, folder)?;
        }
    }
    found.hulls.sort_by_key(|h| h.link);
    Ok(found)
}

impl Bodies {
    fn add(&mut self, link: &Carried, piece: &Piece, folder: &Path) -> Result<(), UrdfError> {
        let Some(form) = &piece.form else {
            return Ok(());
        };
        let (mut mesh, ball, what) = match form {
            Form::Mesh { file, scale } => {
                let read = mesh::read(file, *scale, folder);
                let (mesh, named) = read.map_err(|fault| piece.wrong(&link.link, fault))?;
                let what = named
                    .file
                    .file_name()
                    .map(PathBuf::from)
                    .unwrap_or_default();
                self.files.push(named);
                (mesh, None, what.display().to_string())
            }
            Form::Box(size) => (cuboid(-0.5 * *size, 0.5 * *size), None, "box".to_owned()),
            Form::Cylinder { radius, length } => {
                (cylinder(*radius, *length), None, "cylinder".to_owned())
            }
            Form::Ball(radius) => (ball(*radius), Some(*radius), "sphere".to_owned()),
        };
        let place = link.joint_from_link.then(piece.pose);
        for v in &mut mesh.vertices {
            *v = place.point(*v);
        }
        let is_mesh = matches!(form, Form::Mesh { .. });
        let taken = match ball {
            Some(radius) => Hull::with(vec![place.position], radius).map(Pieces::from),
            None if is_mesh => Pieces::of(&mesh, Fineness::default()),
            None => Hull::of(&mesh.vertices).map(Pieces::from),
        };
        if taken.is_none() {
            return Err(piece.wrong(&link.link, LinkFault::Empty { what }));
        }
        let seen = if piece.collides {
            ""
        } else {
            ", as it is seen"
        };
        self.hulls.extend(taken.map(|taken| LinkHull {
            link: link.joint,
            hull: taken.whole,
            pieces: taken.pieces,
            excess: taken.excess,
            mesh,
            of: format!("{}: {what}{seen}", link.link),
        }));
        Ok(())
    }
}

/// A cylinder along z around the origin, no point of the round one outside.
fn cylinder(radius: f64, length: f64) -> Mesh {
    let out = radius / (0.5 * TAU / f64::from(SIDES)).cos();
    let (low, high) = (-0.5 * length, 0.5 * length);
    let profile = [[0.0, low], [out, low], [out, high], [0.0, high]];
    revolve(&profile.map(DVec2::from), SIDES)
}

/// A ball around the origin, to look at.
fn ball(radius: f64) -> Mesh {
    const HALF: u32 = 12;
    let at = |i: u32| {
        let angle = 0.5 * TAU * f64::from(i) / f64::from(HALF);
        let out = if i == 0 || i == HALF {
            0.0
        } else {
            angle.sin()
        };
        radius * DVec2::new(out, -angle.cos())
    };
    let profile: Vec<DVec2> = (0..=HALF).map(at).collect();
    revolve(&profile, SIDES)
}

/// Moves bodies into other frames of their joints.
pub(super) fn moved(hulls: &mut [LinkHull], frames: impl Fn(u8) -> Pose) {
    for body in hulls {
        let new_from_old = frames(body.link);
        let at = |p: &DVec3| new_from_old.point(*p);
        body.mesh.vertices.iter_mut().for_each(|v| *v = at(v));
        body.excess.place = at(&body.excess.place);
        for hull in body.pieces.iter_mut().chain([&mut body.hull]) {
            let points = hull.points().iter().map(at).collect();
            if let Some(moved) = Hull::with(points, hull.radius()) {
                *hull = moved;
            }
        }
    }
}
