//! Beads that no way of the arm holds as a whole: where they are divided, so that the arm can go over to another way in the air between.

use meltpath_base::Observer;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_robot::command::Kind;
use meltpath_robot::posture::{NotHeld, Parting, Task, partings};
use meltpath_toolpath::{Pass, Toolpath};

use crate::waam::drive::division::Division;
use crate::waam::drive::over;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Room from limits and singularities that a way keeps at the ends of a bead beyond what the verdict asks for, rad.
const SPARE: f64 = 0.02;

/// A place of the plan farther from that of its program is another one, mm: programs have fewer digits.
const SAME_PLACE: f64 = 0.1;

/// Where beads are to be divided, so that changes in the air let the arm hold them; none where that does not help.
pub(in crate::waam) fn divisions(
    task: &Task<'_>,
    moves: &Commands,
    settings: &Settings,
    observer: &dyn Observer,
) -> Vec<Division> {
    let room = settings.limits.joint_margin + SPARE;
    let found: Result<Vec<Parting>, NotHeld> =
        partings(task, &over::travels(moves), room, observer);
    let found = found.unwrap_or_default();
    let divisions: Option<Vec<Division>> = found.iter().map(|p| division(p, moves)).collect();
    divisions.unwrap_or_default()
}

/// The bead of a parting, and how far along it that is.
fn division(parting: &Parting, moves: &Commands) -> Option<Division> {
    let at = parting.command as usize;
    let of_bead = |i: usize| {
        let layer = *moves.layer_of_command.get(i)?;
        Some((layer, (*moves.bead_of_command.get(i)?)?))
    };
    let (layer, bead) = of_bead(at)?;
    let before = (0..at)
        .rev()
        .take_while(|i| of_bead(*i) == Some((layer, bead)));
    let gone: f64 = before.map(|i| length(moves, i)).sum();
    Some(Division {
        layer,
        bead,
        at: gone + parting.along,
        position: parting.position,
        end: parting.end,
    })
}

/// The length of a command, mm.
fn length(moves: &Commands, i: usize) -> f64 {
    let from = match i.checked_sub(1).and_then(|i| moves.commands.get(i)) {
        Some(before) => before.target,
        None => moves.start.position,
    };
    let Some(command) = moves.commands.get(i) else {
        return 0.0;
    };
    match command.kind {
        Kind::Wait { .. } => 0.0,
        Kind::Line | Kind::Joint(_) => from.distance(command.target),
        Kind::Arc { via } => match Arc::through(from, via, command.target) {
            Some(arc) => arc.length(),
            None => from.distance(command.target),
        },
    }
}

/// Divides the beads of a toolpath; nothing where one of the places is not on its bead.
pub(in crate::waam) fn divided(toolpath: &Toolpath, at: &[Division]) -> Option<Toolpath> {
    let mut toolpath = toolpath.clone();
    // from the last one on, so that those before keep their numbers
    for division in at.iter().rev() {
        let found = pass_of(&toolpath, division)?;
        toolpath.divide(found, division.at).then_some(())?;
    }
    Some(toolpath)
}

/// The pass that is divided: its layer in the list, and its number there, from 0.
fn pass_of(toolpath: &Toolpath, division: &Division) -> Option<(usize, usize)> {
    let layers = toolpath.layers.iter().enumerate();
    let layers = layers.filter(|(_, l)| l.number == division.layer);
    let passes = layers.flat_map(|(i, layer)| {
        let passes = layer.passes().enumerate();
        passes.map(move |(k, pass)| ((i, k), layer.height, pass))
    });
    let mut beads = passes.filter(|(_, _, pass)| pass.head.role.deposits());
    let (found, height, pass) = beads.nth(division.bead.checked_sub(1)? as usize)?;
    let there = |pass: &Pass<'_>| Some(pass.along(division.at)?.1 + height * DVec3::Z);
    let far = there(&pass)?.distance(division.position);
    (far <= SAME_PLACE).then_some(found)
}

/// Numbers divided beads as they are counted once all are divided; `more` were found after `known` were divided.
pub(in crate::waam) fn counted(known: &[Division], more: &[Division]) -> Vec<Division> {
    let mut all = known.to_vec();
    for (new, before) in more.iter().zip(0..) {
        let shift = |d: &mut Division| {
            let later = d.layer == new.layer && d.bead > new.bead;
            d.bead += u32::from(later);
        };
        all.iter_mut().take(known.len()).for_each(shift);
        let earlier = more.iter().take(before).filter(|d| d.layer == new.layer);
        all.push(Division {
            bead: new.bead + earlier.count() as u32,
            ..*new
        });
    }
    all.sort_by_key(|d| (d.layer, d.bead));
    all
}
