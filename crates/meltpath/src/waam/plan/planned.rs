//! A plan with the programs that it becomes, and what they command.

use meltpath_base::{Observer, Reporter};
use meltpath_toolpath::Toolpath;

use crate::stages::part::Part;
use crate::waam::drive::hold;
use crate::waam::drive::travels;
use crate::waam::error::WaamError;
use crate::waam::plan::{self, Plan};
use crate::waam::program::wanted::Wanted;
use crate::waam::program::{Commands, Programs};
use crate::waam::settings::Settings;

/// What is known before anything moves.
pub(in crate::waam) struct Planned {
    pub(in crate::waam) plan: Plan,
    /// In the dialect of the cell's controller.
    pub(in crate::waam) programs: Programs,
    pub(in crate::waam) commands: Commands,
}

/// Plans `part`, writes the programs of the plan and reads them back.
pub(in crate::waam) fn planned(
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
pub(in crate::waam) fn read_back(
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
