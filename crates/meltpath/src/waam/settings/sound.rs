//! What a plan is made with, where nothing in it is wrong: the bead, how far apart beads lie, the programs.

use meltpath_base::quantity::Auto;
use meltpath_base::settings::{Problem, Setting};
use meltpath_base::{Origin, Resolved};
use meltpath_deposition::process_map::{Bead, ProcessMap};
use meltpath_deposition::stepover::{Overlap, stepover};
use meltpath_planning::FillSettings;
use meltpath_programs::Dialect;

use super::bead::{check_heights, solve_bead};
use super::woven::{Woven, woven};
use crate::job::WaamJob;
use crate::job::waam::Stepover;

/// What a plan is made with.
pub(super) struct Sound {
    /// The bead that is not woven.
    pub(super) bead: Bead,
    pub(super) woven: Option<Woven>,
    /// Distance of neighbouring beads, mm.
    pub(super) step: Resolved<f64>,
    pub(super) programs: Vec<Dialect>,
}

/// The bead, the stepover and the programs, where none of them, nor the heights of layers, is wrong.
pub(super) fn sound(
    job: &WaamJob,
    map: &ProcessMap,
    programs: Result<Vec<Dialect>, Problem>,
) -> Result<Sound, Vec<Problem>> {
    let (programs, mut problems) = match programs {
        Ok(programs) => (programs, Vec::new()),
        Err(problem) => (Vec::new(), vec![problem]),
    };
    let bead = match solve_bead(&job.waam.bead, map) {
        Ok(bead) => bead,
        Err(problem) => {
            problems.push(problem);
            return Err(problems);
        }
    };
    let woven = match woven(&job.waam.bead.weave, &bead) {
        Ok(woven) => woven,
        Err(problem) => {
            problems.push(problem);
            return Err(problems);
        }
    };
    if woven.is_some() && (job.surface.is_some() || job.onto.is_some()) {
        let weave = &job.waam.bead.weave;
        let message = format!(
            "{} stands beside [surface] or [onto]: layers that are not flat are planned without a weave",
            weave.name
        );
        problems.push(weave.problem(message).help("take one of them out"));
    }
    let planned = woven.as_ref().map_or(&bead, |w| &w.bead);
    let width = planned.width.value;
    let step = resolve_stepover(&job.fill.stepover, width);
    problems.extend(check_heights(&job.layers.height, planned).err());
    problems.extend(check_stepover(&job.fill.stepover, step.value, width).err());
    if problems.is_empty() {
        Ok(Sound {
            bead,
            woven,
            step,
            programs,
        })
    } else {
        Err(problems)
    }
}

fn resolve_stepover(written: &Auto<Stepover>, width: f64) -> Resolved<f64> {
    match *written {
        Auto::Auto => Resolved::new(
            stepover(Overlap::Tangent) * width,
            Origin::Computed(
                "tangent overlap, 0.738 of the bead's width (Ding; Rouchon 2022, § 4.1)".to_owned(),
            ),
        ),
        Auto::Value(Stepover::Length(l)) => Resolved::new(l.0, Origin::Job),
        Auto::Value(Stepover::Widths(n)) => Resolved::new(n.0 * width, Origin::Job),
    }
}

/// Refuses beads too near or too far apart, at their key.
fn check_stepover(written: &Setting<Auto<Stepover>>, step: f64, width: f64) -> Result<(), Problem> {
    let [least, most] = FillSettings::STEPOVERS.map(|w| w * width);
    if (least..=most).contains(&step) {
        return Ok(());
    }
    let message = format!(
        "beads {width:.2} mm wide cannot lie {step:.2} mm apart: between {least:.2} and {most:.2} mm they could"
    );
    let help = "write stepover = \"auto\", or 0.6 to 0.8 bead widths: \"0.7 w\"";
    Err(written.problem(message).help(help))
}
