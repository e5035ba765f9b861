//! A plan with the programs that it becomes, and what they command.

use meltpath_base::{Observer, Reporter};
use meltpath_toolpath::Toolpath;

use super::error::WaamError;
use super::hold;
use super::plan::{self, Plan};
use super::program::{Commands, Programs};
use super::settings::Settings;
use super::travels;
use super::wanted::Wanted;
use crate::stages::part::Part;

/// What is known before anything moves.
pub(super) struct Planned {
    pub(super) plan: Plan,
    /// In the dialect of the cell's controller.
    pub(super) programs: Programs,
    pub(super) commands: Commands,
}

/// Plans `part`, writes the programs of the plan and reads them back.
pub(super) fn planned(
    name: &str,
    part: &Part,
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Planned, WaamError> {
    let plan = plan::plan(part, settings, reporter, observer)?;
    let (programs, commands) = read_back(name, &plan.toolpath, settings, (reporter, observer))?;
    Ok(Planned {
        plan,
        programs,
        commands,
    })
}

/// The programs of a toolpath for the cell's controller, and what they command.
pub(super) fn read_back(
    name: &str,
    toolpath: &Toolpath,
    settings: &Settings,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<(Programs, Commands), WaamError> {
    let own = settings.cell.program.dialect.value;
    let programs = hold::write(
        name,
        toolpath,
        (own, Wanted::WHOLE),
        settings,
        None,
        (reporter, observer),
    )?;
    let mut commands = programs.commands(settings, reporter)?;
    travels::pace(&programs.parsed, &mut commands, settings, observer);
    Ok((programs, commands))
}
