//! Whether a program is that of a plan of its job: it is judged as that plan then, with what the plan chose of what the job leaves open.

use meltpath_base::{Fact, Observer, Quiet, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_robot::command::{Smoothing, Source};

use crate::stages::part::Part;
use crate::waam::drive::division;
use crate::waam::drive::site::Site;
use crate::waam::error::WaamError;
use crate::waam::loaded::Loaded;
use crate::waam::plan::mend::ways;
use crate::waam::plan::planned::read_back;
use crate::waam::plan::{self, Plan};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Lengths laid that differ by less, in relation, may be those of one plan.
const SAME_LENGTH: f64 = 1e-3;
/// How far ends of moves may lie apart, mm: the digits of programs of different controllers.
const SAME_PLACE: f64 = 0.02;

/// The plan that a program was written from.
pub(in crate::waam) struct Own {
    /// The job's, with what the plan chose.
    pub(in crate::waam) settings: Settings,
    pub(in crate::waam) plan: Plan,
    /// What it chose, where it chose, and the beads that it divided for the robot.
    pub(in crate::waam) told: Vec<Fact>,
}

/// The plan of the job whose beads `commands` lay, all of them; `None` where they are of other software, or edited.
///
/// # Errors
/// [`WaamError`] when cancelled.
pub(in crate::waam) fn own_plan(
    loaded: &Loaded,
    part: &Part,
    commands: &Commands,
    observer: &dyn Observer,
) -> Result<Option<Own>, WaamError> {
    if loaded.settings.surface.is_some() {
        return Ok(None);
    }
    observer.stage("look for the plan of the program", 0);
    // what is to be told of the job was told when it was read
    let (silent, quiet) = (Reporter::new(), Quiet(observer));
    for (settings, words) in ways(loaded) {
        observer.check()?;
        let Ok(mut plan) = plan::plan(part, &settings, &silent, &quiet) else {
            continue;
        };
        let (long, laid) = (plan.toolpath.deposited_length(), commands.arc_length);
        if (long - laid).abs() > SAME_LENGTH * long {
            continue;
        }
        let read = read_back(
            &loaded.name,
            &mut plan.toolpath,
            Site::flat(&settings),
            (&silent, &quiet),
        );
        let Ok((_, planned)) = read else {
            continue;
        };
        if same_beads(&planned, commands) {
            let title = "chosen by the plan that the program was written from";
            let chosen = words.map(|words| Fact::words("chosen", title, &words));
            return Ok(Some(Own {
                settings,
                plan,
                told: chosen
                    .into_iter()
                    .chain(division::fact(&planned.divided))
                    .collect(),
            }));
        }
    }
    Ok(None)
}

fn same_beads(a: &Commands, b: &Commands) -> bool {
    let (a, b) = (welded(a), welded(b));
    let same = |(p, q): (&(DVec3, Smoothing), &(DVec3, Smoothing))| {
        p.0.distance(q.0) <= SAME_PLACE && p.1 == q.1
    };
    a.len() == b.len() && a.iter().zip(&b).all(same)
}

/// Where the moves with the arc on end, and how.
fn welded(commands: &Commands) -> Vec<(DVec3, Smoothing)> {
    let moves = commands.commands.iter();
    moves
        .filter(|c| matches!(c.source, Source::On { .. }))
        .map(|c| (c.target, c.smoothing))
        .collect()
}
