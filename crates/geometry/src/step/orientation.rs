//! Neighbouring faces of a shell run along their common edge in opposite directions; where a file
//! breaks this, the loops of the fewest faces are turned, and it is said.

use std::collections::BTreeMap;

use meltpath_base::Reporter;

use super::entity::Entity;
use crate::brep::{FaceUse, Loop, Sense, ShellRole, Solid};

/// Makes the loops of every shell agree and reports edges that do not close it.
pub(super) fn orient(solid: &mut Solid, entity: Entity<'_>, reporter: &Reporter) {
    let mut turned = Vec::new();
    let mut open = 0usize;
    let mut twisted = 0usize;
    for shell in &solid.shells {
        let sides = sides(solid, &shell.faces);
        if shell.role != ShellRole::Open {
            open += sides.values().filter(|uses| uses.len() % 2 == 1).count();
        }
        let (flips, bad) = flips(&shell.faces, &sides);
        twisted += bad;
        turned.extend(flips);
    }
    turned.sort_unstable();
    turned.dedup();
    for &face in &turned {
        for boundary in &mut solid.faces[face as usize].loops {
            if let Loop::Edges(uses) = boundary {
                uses.reverse();
                for used in uses {
                    used.sense = used.sense.then(Sense::Reversed);
                }
            }
        }
    }
    if !turned.is_empty() {
        let ids: Vec<String> = turned
            .iter()
            .take(8)
            .map(|&f| format!("#{}", solid.faces[f as usize].id))
            .collect();
        reporter.warn(
            "step-loops-turned",
            format!(
                "in {}, the boundaries of {} faces ran against those of their neighbours and have been turned: {}",
                entity.place(),
                turned.len(),
                ids.join(", ")
            ),
            "nothing, if the part looks right: writers are known to do this",
        );
    }
    if open > 0 {
        reporter.warn(
            "step-shell-open",
            format!(
                "in {}, {open} edges of closed shells belong to one face only",
                entity.place()
            ),
            "sew the part in the program that wrote the file, and export it as a solid",
        );
    }
    if twisted > 0 {
        reporter.warn(
            "step-shell-twisted",
            format!(
                "in {}, {twisted} edges join faces that cannot all face outwards",
                entity.place()
            ),
            "check the part's normals in the program that wrote the file",
        );
    }
}

/// Uses of each edge by the faces of a shell: position of the face in the shell, direction.
fn sides(solid: &Solid, faces: &[FaceUse]) -> BTreeMap<u32, Vec<(usize, Sense)>> {
    let mut sides: BTreeMap<u32, Vec<(usize, Sense)>> = BTreeMap::new();
    for (position, used) in faces.iter().enumerate() {
        for boundary in &solid.faces[used.face as usize].loops {
            let Loop::Edges(uses) = boundary else {
                continue;
            };
            for edge in uses {
                sides
                    .entry(edge.edge)
                    .or_default()
                    .push((position, edge.sense.then(used.sense)));
            }
        }
    }
    sides
}

/// Faces to turn so that neighbours agree, the fewest of each connected piece; and the number of
/// edges at which no choice agrees.
fn flips(faces: &[FaceUse], sides: &BTreeMap<u32, Vec<(usize, Sense)>>) -> (Vec<u32>, usize) {
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); faces.len()];
    for uses in sides.values() {
        if let [(a, sa), (b, sb)] = uses[..]
            && a != b
        {
            neighbours[a].push((b, sa == sb));
            neighbours[b].push((a, sa == sb));
        }
    }
    let mut flip: Vec<Option<bool>> = vec![None; faces.len()];
    let mut out = Vec::new();
    let mut twisted = 0;
    for start in 0..faces.len() {
        if flip[start].is_some() {
            continue;
        }
        flip[start] = Some(false);
        let mut piece = vec![(start, false)];
        let mut next = 0;
        while let Some(&(at, here)) = piece.get(next) {
            next += 1;
            for &(other, differs) in &neighbours[at] {
                let wanted = here != differs;
                match flip[other] {
                    None => {
                        flip[other] = Some(wanted);
                        piece.push((other, wanted));
                    }
                    Some(known) if known != wanted => twisted += 1,
                    Some(_) => {}
                }
            }
        }
        let minority = 2 * piece.iter().filter(|p| p.1).count() <= piece.len();
        out.extend(
            piece
                .iter()
                .filter(|p| p.1 == minority)
                .map(|p| faces[p.0].face),
        );
    }
    // each bad edge was met from both sides
    (out, twisted / 2)
}
