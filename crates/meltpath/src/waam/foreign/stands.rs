//! What stands on the table while a program is executed: what layers that are not flat stand on and what holds it, and metal that other programs
//! laid before.

use meltpath_base::{Check, Observer, Reporter, Status};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_robot::collision::Metal;
use meltpath_robot::command::Source;
use meltpath_toolpath::Toolpath;

use crate::waam::deposit::simulate::Simulation;
use crate::waam::drive::bead_pieces;
use crate::waam::drive::columns::side;
use crate::waam::drive::expected::expected;
use crate::waam::drive::site::Site;
use crate::waam::drive::solids::Standing;
use crate::waam::error::WaamError;
use crate::waam::judge::doubt::Doubt;
use crate::waam::loaded::Loaded;
use crate::waam::plan::begun::{beads, begins_at};
use crate::waam::plan::own::Own;
use crate::waam::plan::planned::read_back;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;
use crate::waam::surface::wall;

/// A program that begins farther over its plate than this begins on metal, heights of its bead: some say where a bead ends, not where it begins.
const ON_METAL: f64 = 1.5;

/// What stands on the table while a program is executed.
#[derive(Default)]
pub(super) struct Stands {
    /// What layers that are not flat stand on; nothing of flat ones, which stand on their plate.
    standing: Option<Standing>,
    /// The plan of layers that are not flat.
    toolpath: Option<Toolpath>,
    /// What of it is not known.
    doubt: Option<Doubt>,
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
                toolpath: Some(placed.plan.toolpath),
                doubt: None,
            },
            Err(why) => Stands {
                doubt: Some(Doubt {
                    reason: format!(
                        "what the part stands on is not known, as the job cannot be planned: {why}"
                    ),
                    remedy: "a job that `meltpath run` can plan".to_owned(),
                }),
                ..Stands::default()
            },
        })
    }

    /// Looks for what other programs laid before one begins: of the job's own plan of flat layers that is known.
    ///
    /// # Errors
    /// When cancelled.
    pub(super) fn before(
        &mut self,
        (loaded, own): (Option<&Loaded>, Option<&Own>),
        commands: &Commands,
        observer: &dyn Observer,
    ) -> Result<(), WaamError> {
        let Some(loaded) = loaded.filter(|_| own.is_none() && self.doubt.is_none()) else {
            return Ok(());
        };
        let doubt = begins_on_metal(commands, &loaded.settings);
        let mut first = self.first(commands);
        if first.is_none() && doubt.is_some() {
            self.divide(loaded, observer);
            observer.check()?;
            first = self.first(commands);
        }
        match (first, &self.toolpath, &mut self.standing) {
            (Some(first), Some(toolpath), Some(standing)) => {
                let before = beads(toolpath).take(first);
                standing.beads = before.flat_map(|p| bead_pieces::standing(&p)).collect();
            }
            _ => self.doubt = doubt,
        }
        Ok(())
    }

    /// The bead of the plan of layers that are not flat with which a program begins that is the rest of it, from 0.
    fn first(&self, commands: &Commands) -> Option<usize> {
        begins_at(self.toolpath.as_ref()?, commands)
    }

    /// Divides beads of that plan where the robot needs it, as in its programs.
    fn divide(&mut self, loaded: &Loaded, observer: &dyn Observer) {
        let Some(toolpath) = self.toolpath.as_mut() else {
            return;
        };
        let site = Site {
            settings: &loaded.settings,
            standing: self.standing.as_ref(),
        };
        let told = (&Reporter::new(), observer);
        // a plan without programs keeps its beads
        let _ = read_back(&loaded.name, toolpath, site, told);
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
        let shapes = settings.robot.as_ref().and_then(|r| r.shapes.as_ref());
        match self.standing {
            Some(_) => expected(commands, self.site(settings)),
            None if !commands.lays() && shapes.is_some() => bare(&simulation.deposit.map),
            None => simulation.metal.clone(),
        }
    }

    /// What keeps metal from being decided about.
    pub(super) fn doubt(&self) -> Option<Doubt> {
        self.doubt.clone()
    }

    /// Takes the decision from a collision with what is not known; what comes too near as it is fails all the same.
    pub(super) fn undecided(&self, check: Check) -> Check {
        match &self.doubt {
            Some(doubt) if check.id == "collision" && is_well(&check) => Check {
                status: Status::CannotSay,
                ..check
            }
            .because(&doubt.reason)
            .remedy(doubt.remedy.clone()),
            _ => check,
        }
    }
}

/// Whether nothing was found to come too near.
fn is_well(check: &Check) -> bool {
    matches!(check.status, Status::Pass | Status::Warn)
}

/// Plate and metal before a program that lays none.
fn bare(map: &HeightMap) -> Vec<(u32, Metal)> {
    vec![(0, Metal::of(map, side(map)))]
}

/// The doubt that a program leaves which begins on metal that it does not lay, or lays none itself; nothing of one that begins on the plate.
fn begins_on_metal(commands: &Commands, settings: &Settings) -> Option<Doubt> {
    let remedy =
        "the job whose plan the program is of, as it was then; or the whole program".to_owned();
    if !commands.lays() {
        return Some(Doubt {
            reason: "no plan of the job goes as this program does without arc: what metal stands there meanwhile is not known".to_owned(),
            remedy,
        });
    }
    let burns = |i: &usize| matches!(commands.commands[*i].source, Source::On { .. });
    let laid = || (0..commands.commands.len()).filter(burns);
    let first = laid().next()?;
    let layer = commands.layer_of_command.get(first).copied().unwrap_or(0);
    let heights = laid().map(|i| commands.commands[i].target.z);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    // what is not flat begins anywhere; where nobody says where the plate lies, that is told
    let told = settings.surface.is_none() && settings.plate_height.is_some();
    let begins = if layer > 1 {
        format!("with layer {layer}")
    } else if told && lowest > ON_METAL * settings.bead.height.value {
        format!("{lowest:.1} mm over the plate")
    } else {
        return None;
    };
    Some(Doubt {
        reason: format!(
            "the program begins {begins}, on metal that it does not lay, and is not the rest of a plan of the job: what stands there is not known"
        ),
        remedy,
    })
}
