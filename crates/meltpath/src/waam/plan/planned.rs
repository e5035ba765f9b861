//! A plan with the programs that it becomes, and what they command.

use meltpath_base::{Observer, Reporter};
use meltpath_toolpath::Toolpath;

use crate::stages::part::Part;
use crate::waam::drive::divide;
use crate::waam::drive::hold;
use crate::waam::drive::said_axes::axes_elsewhere;
use crate::waam::drive::site::Site;
use crate::waam::drive::travels;
use crate::waam::error::WaamError;
use crate::waam::plan::{self, Plan};
use crate::waam::program::wanted::Wanted;
use crate::waam::program::{Commands, Programs};
use crate::waam::settings::Settings;

/// What is known before anything moves.
pub(in crate::waam) struct Planned {
    pub(in crate::waam) plan: Plan,
    /// In the dialect that is judged.
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
    let mut plan = plan::plan(part, settings, reporter, observer)?;
    let told = (reporter, observer);
    let site = Site::flat(settings);
    let (programs, commands) = read_back(name, &mut plan.toolpath, site, told)?;
    Ok(Planned {
        plan,
        programs,
        commands,
    })
}

/// How often beads are divided and a way is looked for anew.
const ROUNDS: usize = 4;

/// The programs of a toolpath for the controller that is judged, and what they command. Beads that no way of the job's robot holds as a whole are
/// divided in the toolpath, where that lets it hold all of them.
pub(in crate::waam) fn read_back(
    name: &str,
    toolpath: &mut Toolpath,
    site: Site<'_>,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<(Programs, Commands), WaamError> {
    let whole = written(name, toolpath, site, (reporter, observer))?;
    let mut divisions = whole.0.chosen.divisions.clone();
    let (mut known, mut tried) = (Vec::new(), toolpath.clone());
    for _ in 0..ROUNDS {
        if divisions.is_empty() {
            break;
        }
        let Some(divided) = divide::divided(&tried, &divisions) else {
            break;
        };
        tried = divided;
        known = divide::counted(&known, &divisions);
        // what is to be told of the plan was told of the whole beads
        let (programs, mut commands) = written(name, &tried, site, (&Reporter::new(), observer))?;
        if programs.chosen.way.is_some() {
            commands.divided = known;
            *toolpath = tried;
            return Ok((programs, commands));
        }
        divisions.clone_from(&programs.chosen.divisions);
    }
    Ok(whole)
}

/// The programs of a toolpath as it is, and what they command.
fn written(
    name: &str,
    toolpath: &Toolpath,
    site: Site<'_>,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<(Programs, Commands), WaamError> {
    let settings = site.settings;
    let own = settings.judged();
    let programs = hold::write(
        name,
        toolpath,
        (own, Wanted::WHOLE),
        site,
        None,
        (reporter, observer),
    )?;
    let mut commands = programs.commands(settings, reporter)?;
    let dialects = settings.dialects();
    let axes = axes_elsewhere(&dialects, commands.external.as_ref(), settings, 0.0);
    commands.elsewhere.extend(axes);
    travels::pace(&programs.parsed, &mut commands, settings, observer);
    Ok((programs, commands))
}
