//! Programs that are not the whole of a plan: from a bead on, or without the arc.

use meltpath_toolpath::Toolpath;

use super::error::BuildError;
use crate::program::{Instruction, Program};
use crate::weave::is_of_weave;

/// Where programs begin anew: a bead that is struck afresh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Restart {
    /// Number of its layer.
    pub layer: u32,
    /// Its number among the beads of the layer, from 1.
    pub bead: u32,
}

/// How many passes of a toolpath come before a bead.
///
/// # Errors
/// [`BuildError::NoBead`] where there is no such bead.
pub(super) fn before(toolpath: &Toolpath, at: Restart) -> Result<usize, BuildError> {
    let mut beads = 0;
    for (i, pass) in toolpath.passes().enumerate() {
        if pass.layer == at.layer && pass.head.role.deposits() {
            beads += 1;
            if beads == at.bead {
                return Ok(i);
            }
        }
    }
    let first = toolpath.passes().next().map_or(0, |p| p.layer);
    Err(BuildError::NoBead {
        layer: at.layer,
        bead: at.bead,
        beads,
        layers: (first, toolpath.passes().last().map_or(0, |p| p.layer)),
    })
}

/// Length of the beads of a toolpath, from one of them on where one is named, mm.
///
/// # Errors
/// [`BuildError::NoBead`] where there is no such bead.
pub fn laid_from(toolpath: &Toolpath, from: Option<Restart>) -> Result<f64, BuildError> {
    let skipped = from.map_or(Ok(0), |at| before(toolpath, at))?;
    let laid = toolpath.passes().skip(skipped);
    Ok(laid
        .filter(|p| p.head.role.deposits())
        .map(|p| p.length())
        .sum())
}

/// Takes arc and weaves out of programs: what is left moves as they do.
pub fn dry_run(programs: &mut [Program]) {
    for program in programs {
        program
            .instructions
            .retain(|i| !matches!(i, Instruction::Arc(_)) && !is_of_weave(i));
        for instruction in &mut program.instructions {
            if let Instruction::Motion(motion) = instruction {
                motion.arc = None;
            }
        }
        let lines = program.instructions.len().to_string();
        for attribute in &mut program.attributes {
            if attribute.key == "LINE_COUNT" {
                attribute.value.clone_from(&lines);
            }
        }
    }
}
