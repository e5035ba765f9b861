//! How far apart the points of beads lie in programs of others, against what their controller plans at the speed of each.

use meltpath_base::{Place, Reporter};
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_programs::Program;
use meltpath_programs::spacing::Spacing;
use meltpath_robot::command::{Kind, Source};

use crate::waam::program::{Commands, spoken};
use crate::waam::settings::Settings;

/// Warns of moves of beads that take less time than the controller plans one in.
pub(in crate::waam) fn tell(
    programs: &[Program],
    moves: &Commands,
    settings: &Settings,
    reporter: &Reporter,
) {
    let mut spacing = Spacing::new(&settings.cell.program, spoken(programs));
    let mut from = moves.start.position;
    for command in &moves.commands {
        let Some(length) = length(from, command.kind, command.target) else {
            continue;
        };
        from = command.target;
        if !matches!(command.source, Source::On { .. }) {
            continue;
        }
        spacing.count(length, command.speed, || {
            let (program, line) = moves.line_of_command[command.id as usize];
            let program = programs.get(program as usize);
            Place {
                file: program.map(|p| p.name.clone()),
                line: program.map(|p| p.line_of(line)),
                ..moves.place(command.id, command.target)
            }
        });
    }
    spacing.tell(reporter);
}

/// Length of a move along a path, mm; nothing of a wait.
fn length(from: DVec3, kind: Kind, to: DVec3) -> Option<f64> {
    match kind {
        Kind::Wait { .. } => None,
        Kind::Arc { via } => {
            Some(Arc::through(from, via, to).map_or_else(|| from.distance(to), |arc| arc.length()))
        }
        Kind::Line | Kind::Joint(_) => Some(from.distance(to)),
    }
}
