//! Whether the window of good temperatures says anything on the judge's solver: limits hold on the model that they were found with, and a
//! body known to be good is another than the one that is judged.

use meltpath_base::{Check, Status};

use crate::ebm::plan::{Plan, Window};
use crate::ebm::settings::Good;
use crate::job::ebm::WindowModel;

const CURE: &str = "window.body, a rectangle that the hatch is known to build well, or window.good, the path of a body known to be good: both are drawn on this solver; or limits that were found with this solver, its surface and its cells, and  model = \"solver\"  beside them";

/// The check of the window, which cannot say where the window has no place on this solver.
pub(in crate::ebm) fn on_its_scale(check: Check, plan: &Plan) -> Check {
    let Some((reason, cure)) = doubt(plan) else {
        return check;
    };
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let cure = match check.remedy.as_deref() {
        Some(others) => format!("{others}; {cure}"),
        None => cure.to_owned(),
    };
    check.because(&reason).remedy(cure)
}

/// Why the window has no place on this solver, and what would give it one.
fn doubt(plan: &Plan) -> Option<(String, &'static str)> {
    match (&plan.settings.window, &plan.window) {
        (Good::Limits { model, written, .. }, _) => {
            let limits = if *written {
                "window.low and window.high"
            } else {
                "2700 and 2760 °C, which stand where no window is written,"
            };
            match model {
                Some(WindowModel::Solver) => None,
                None if *written => Some((
                    format!("{limits} do not say with which model they were found (window.model)"),
                    CURE,
                )),
                Some(WindowModel::Thesis) | None => Some((
                    format!("{limits} lie on the scale of the simulator of Béraud 2016, by which this solver's temperatures cannot be judged"),
                    CURE,
                )),
            }
        }
        (Good::Path { .. }, Window::Good { path, .. }) if **path == plan.path => Some((
            "the body that is to be known as good is the path that is judged: it is only as even as itself".to_owned(),
            "the path of another body as window.good",
        )),
        _ => None,
    }
}
