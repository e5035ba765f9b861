//! The links of an arm as bodies: radii that its file writes, or hulls of what its URDF tells.

use std::path::Path;

use meltpath_base::settings::Problem;

use super::file::CellFile;
use super::layout::Links;
use super::urdf::{Named, Taken};
use crate::kinematics::Chain;

/// What is known of the links.
#[derive(Debug, Default)]
pub(super) struct Linked {
    /// Nothing where no shapes are told.
    pub(super) links: Option<Links>,
    /// What of them is a guess.
    pub(super) guesses: Vec<String>,
    /// Files that were read.
    pub(super) files: Vec<Named>,
}

impl Linked {
    /// The links of a file whose arm is `chain`.
    pub(super) fn of(
        file: &CellFile,
        taken: Option<&Taken>,
        chain: &Chain,
        problems: &mut Vec<Problem>,
    ) -> Option<Self> {
        let mut linked = Linked {
            files: taken.iter().map(|t| t.named.clone()).collect(),
            ..Linked::default()
        };
        let Some(shapes) = file.shapes.as_ref() else {
            return Some(linked);
        };
        if let Some(radii) = *shapes.links {
            linked.links = Some(Links::Bars(radii.map(|l| l.0)));
            return Some(linked);
        }
        let silent = |what: &str| {
            let message = format!("{} is missing: {what}", shapes.links.name);
            let help = "write the radius of each link around the line from its joint to the next";
            file.shapes.problem(message).help(help)
        };
        let Some(taken) = taken else {
            problems.push(silent("there is no URDF that tells the links"));
            return None;
        };
        let bodies = match taken.bodies(chain) {
            Ok(bodies) => bodies,
            Err(wrong) => {
                problems.push(file.urdf.problem(format!("{}: {wrong}", file.urdf.name)));
                return None;
            }
        };
        let has = |link: u8| bodies.hulls.iter().any(|h| h.link == link);
        let bare: Vec<String> = (1..=6)
            .filter(|link| !has(*link) && length(chain, *link) > SHORT)
            .map(|link| link.to_string())
            .collect();
        if bodies.hulls.is_empty() {
            problems.push(silent("the URDF tells no shape of any link"));
            return None;
        }
        if !bare.is_empty() {
            let told = format!("the URDF tells no shape of link {}", bare.join(", "));
            linked.guesses.push(told);
        }
        if !bodies.beside.is_empty() {
            let told = format!("{} move beside the arm", bodies.beside.join(", "));
            linked.guesses.push(told);
        }
        // beside the URDF, and that beside the robot's file
        let of_urdf = taken.named.copy.as_deref().and_then(Path::parent);
        for Named { file, copy } in bodies.files {
            let copy = of_urdf.zip(copy).map(|(folder, copy)| folder.join(copy));
            let named = Named { file, copy };
            if !linked.files.contains(&named) {
                linked.files.push(named);
            }
        }
        linked.links = Some(Links::Hulls(bodies.hulls.into()));
        Some(linked)
    }
}

/// A link shorter than this has no body of its own, mm.
const SHORT: f64 = 50.0;

/// From the joint of a link to the next, the last to the flange, mm.
fn length(chain: &Chain, link: u8) -> f64 {
    let next = chain.joints.get(usize::from(link));
    let end = next.map_or(chain.last_from_end, |j| j.parent_from_joint);
    end.position.length()
}
