//! Programs that are delivered beside the one that is judged: how the arm stands along them, and where they say that part and wire tip are.

use std::sync::Arc;

use meltpath_base::{Check, Status};
use meltpath_programs::Dialect;

use crate::job::waam::ExternalChoice;
use crate::waam::drive::positions::stance;
use crate::waam::drive::said_frames::{self, Elsewhere};
use crate::waam::program::{Chosen, Commands, Programs, spoken};
use crate::waam::settings::Settings;

/// Programs along which the arm goes otherwise than along the one that is judged.
#[derive(Debug, Clone, Default)]
pub(in crate::waam) struct Otherwise {
    /// Those that lead it another way.
    ways: Vec<Dialect>,
    /// Places that they tell elsewhere than the robot's file does.
    elsewhere: Vec<Elsewhere>,
}

impl Otherwise {
    /// Looks at one of them beside the one that is judged. Where the dialect has no words of the arm's maker its program does not say how the arm
    /// stands: nothing is known of it here.
    pub(in crate::waam) fn look(
        &mut self,
        judged: &Programs,
        other: &Programs,
        settings: &Settings,
    ) {
        let Some(cell) = &settings.robot else { return };
        let dialect = spoken(&other.parsed);
        let says = stance(cell, dialect, [0.0; 6]).is_some();
        if says && !alike([&judged.chosen, &other.chosen], settings) {
            self.ways.push(dialect);
        }
    }

    /// Looks at where one of them says that part and torch are.
    pub(in crate::waam) fn look_where(&mut self, commands: &Commands, dialect: Dialect) {
        let of_program = |e: &Elsewhere| e.of_program(dialect);
        self.elsewhere
            .extend(commands.elsewhere.iter().map(of_program));
    }

    /// Takes from a check of the arm what does not hold for all programs.
    pub(in crate::waam) fn undecided(&self, check: Check, settings: &Settings) -> Check {
        let check = said_frames::undecided(check, &self.elsewhere);
        if check.id != "config" || self.ways.is_empty() || check.status == Status::Fail {
            return check;
        }
        let names: Vec<&str> = self.ways.iter().map(|d| d.name()).collect();
        let judged = settings.judged();
        let undecided = Check {
            status: Status::CannotSay,
            reason: String::new(),
            ..check.clone()
        };
        let told = format!(
            "the program for {} leads the arm another way than the one for {}, which is judged here: reach, speeds and collisions of it are not",
            names.join(", "),
            judged.name()
        );
        let words = self.ways.first().map_or("", |d| d.word());
        let checks = undecided.because(&told);
        let checks = match &check.reason[..] {
            "" => checks,
            reason => checks.because(reason),
        };
        checks.remedy(format!(
            "plan a job for it alone: output.programs = [\"{words}\"], or name it first and leave program.dialect out of the cell's file"
        ))
    }
}

/// Whether the arm goes the same way along two programs of a plan.
fn alike([judged, other]: [&Chosen; 2], settings: &Settings) -> bool {
    match (&judged.way, &other.way) {
        (Some(a), Some(b)) if Arc::ptr_eq(a, b) => true,
        // axes that were chosen anew may stand elsewhere
        (Some(_), Some(_)) => {
            settings.external == ExternalChoice::Standing && judged.stances == other.stances
        }
        (None, None) => true,
        _ => false,
    }
}
