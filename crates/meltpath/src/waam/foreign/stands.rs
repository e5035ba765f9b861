//! What stands on the table while a program is executed: what layers that are not flat stand on, and what holds it.

use meltpath_base::{Check, Observer, Reporter, Status};
use meltpath_robot::collision::Metal;

use crate::waam::deposit::simulate::Simulation;
use crate::waam::drive::expected::expected;
use crate::waam::drive::site::Site;
use crate::waam::drive::solids::Standing;
use crate::waam::error::WaamError;
use crate::waam::loaded::Loaded;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;
use crate::waam::surface::wall;

/// What stands on the table while a program is executed.
#[derive(Default)]
pub(super) struct Stands {
    /// What layers that are not flat stand on; nothing of flat ones, which stand on their plate.
    standing: Option<Standing>,
    /// Why that is not known.
    unknown: Option<String>,
}

impl Stands {
    /// By the job's plan, as a run has it; of layers that are not flat over the table of a robot.
    ///
    /// # Errors
    /// When cancelled: what cannot be planned is not known.
    pub(super) fn of(loaded: Option<&Loaded>, observer: &dyn Observer) -> Result<Self, WaamError> {
        let Some(loaded) = loaded.filter(|l| l.settings.robot.is_some()) else {
            return Ok(Stands::default());
        };
        let Some(asked) = &loaded.settings.surface else {
            return Ok(Stands::default());
        };
        // what is to be told of the plan is told where it is run
        let placed = wall::placed(loaded, asked, &Reporter::new(), observer);
        observer.check()?;
        Ok(match placed {
            Ok(placed) => Stands {
                standing: Some(placed.standing),
                unknown: None,
            },
            Err(why) => Stands {
                standing: None,
                unknown: Some(why.to_string()),
            },
        })
    }

    /// Where a program is executed.
    pub(super) fn site<'a>(&'a self, settings: &'a Settings) -> Site<'a> {
        Site {
            settings,
            standing: self.standing.as_ref(),
        }
    }

    /// What torch and arm may touch: on a plate the metal that was simulated, elsewhere the beads as they are commanded, on what stands there.
    pub(super) fn metal(
        &self,
        simulation: &Simulation,
        commands: &Commands,
        settings: &Settings,
    ) -> Vec<(u32, Metal)> {
        match self.standing {
            Some(_) => expected(commands, self.site(settings)),
            None => simulation.metal.clone(),
        }
    }

    /// Takes the decision from a collision with what is not known.
    pub(super) fn undecided(&self, check: Check) -> Check {
        match &self.unknown {
            Some(why) if check.id == "collision" && is_well(&check) => Check {
                status: Status::CannotSay,
                ..check
            }
            .because(&format!(
                "what the part stands on is not in it, as the job cannot be planned: {why}"
            ))
            .remedy("a job that `meltpath run` can plan"),
            _ => check,
        }
    }
}

/// Whether nothing was found to come too near.
fn is_well(check: &Check) -> bool {
    matches!(check.status, Status::Pass | Status::Warn)
}
