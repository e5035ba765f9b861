//! Grounds that are colder than any machine's: nothing passes on them.

use meltpath_base::{Check, Status};

use crate::ebm::settings::Settings;
use crate::job::ebm::{JudgeGround, LayerMemory};

/// What is judged of temperatures, of which nothing passes on a ground that no machine has.
pub(super) fn on_cold_ground(checks: Vec<Check>, settings: &Settings) -> Vec<Check> {
    let Some(judging) = &settings.judge else {
        return checks;
    };
    let layers = *settings.job.ebm.layers;
    let cold = if judging.ground == JudgeGround::ThesisBox {
        Some([
            "the ground is held at the start temperature half a millimetre away (judge.ground = \"thesis-box\"): colder than a machine's, and not converged in its depth",
            "judge.ground = \"half-space\" or \"plate\"",
        ])
    } else if layers > 1 && *settings.job.judge.memory == LayerMemory::Metal {
        Some([
            "layers forget their heat (judge.memory = \"metal\"): every one is laid on ground at the start temperature, colder than a machine's",
            "leave judge.memory out: layers keep their heat then",
        ])
    } else {
        None
    };
    match cold {
        Some(cold) => checks.into_iter().map(|check| on(check, cold)).collect(),
        None => checks,
    }
}

fn on(check: Check, [reason, remedy]: [&str; 2]) -> Check {
    if check.status != Status::Pass {
        return check;
    }
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    check.because(reason).remedy(remedy)
}
