//! A verdict on the terminal: what fails first, in colour; facts apart from checks; the report and the exit code.

use std::path::Path;
use std::process::{Command, Stdio};

use meltpath::outcome::Outcome;
use meltpath_base::{Place, Status, Verdict};
use serde_json::json;

use crate::exit_code::{CANNOT_SAY, PART_FAILS};
use crate::progress::Progress;
use crate::show::{
    Colour, Reports, Voice, coloured, line, line_to_stderr, progress_line, reports, tell, voice,
};

pub(crate) fn show_timers(progress: &Progress) {
    progress.finish();
    let timers = progress.timers();
    let total: f64 = timers.iter().map(|(_, t)| t.as_secs_f64()).sum();
    progress_line("");
    for (stage, time) in timers {
        progress_line(&format!("  {stage:28} {:8.2} s", time.as_secs_f64()));
    }
    progress_line(&format!("  {:28} {total:8.2} s", "total"));
}

fn colour(status: Status) -> Colour {
    match status {
        Status::Fail => Colour::Red,
        Status::CannotSay | Status::Warn => Colour::Yellow,
        Status::Pass => Colour::Green,
        Status::NotChecked => Colour::Grey,
    }
}

/// The verdict in words: what fails first, facts apart from checks; of a quiet command what does not pass.
pub(crate) fn show_verdict(verdict: &Verdict) {
    if voice() == Voice::Json {
        tell("verdict", verdict.to_json());
        return;
    }
    let placed = |place: &Option<Place>| {
        let place = place.as_ref().map(ToString::to_string);
        place
            .filter(|p| !p.is_empty())
            .map_or(String::new(), |p| format!(" ({p})"))
    };
    let quiet = voice() == Voice::Quiet;
    let shown = |status: Status| !quiet || matches!(status, Status::Fail | Status::CannotSay);
    if !quiet {
        line("");
    }
    for check in verdict
        .in_reading_order()
        .into_iter()
        .filter(|c| shown(c.status))
    {
        let word = format!("{:>12}", check.status.words());
        line(&format!(
            "{}  {}: {}{}",
            coloured(&word, colour(check.status)),
            check.title,
            check.line(),
            placed(&check.place)
        ));
        if let Some(remedy) = &check.remedy {
            line(&format!("{:>12}  → {remedy}", ""));
        }
    }
    if !quiet {
        for warning in &verdict.warnings {
            line(&format!("{:>12}  {}", "note", warning.message));
        }
        for fact in &verdict.facts {
            let said = fact.line();
            line(&format!(
                "{:>12}  {}: {said}{}",
                "fact",
                fact.title,
                placed(&fact.place)
            ));
        }
        line("");
    }
    let status = verdict.status();
    line(&format!(
        "verdict: {}. {}",
        coloured(status.words(), colour(status)),
        verdict.sentence()
    ));
}

pub(crate) fn verdict_code(verdict: &Verdict) -> u8 {
    match verdict.status() {
        Status::Fail => PART_FAILS,
        Status::CannotSay => CANNOT_SAY,
        // checks of which none was made have not been passed
        Status::NotChecked if !verdict.checks.is_empty() => CANNOT_SAY,
        Status::Pass | Status::Warn | Status::NotChecked => 0,
    }
}

/// Tells what was judged, and where the report is; the exit code that says it.
pub(crate) fn judged(progress: &Progress, outcome: &Outcome) -> u8 {
    show_timers(progress);
    show_verdict(&outcome.verdict);
    show_report(&outcome.folder);
    verdict_code(&outcome.verdict)
}

/// Tells where the report of a folder is, and opens it where that is asked for.
pub(crate) fn show_report(folder: &Path) {
    let report = folder.join("report.html");
    if voice() == Voice::Json {
        tell("folder", json!(folder));
        tell("report", json!(report));
    } else {
        line(&format!("report:  {}", report.display()));
    }
    if reports() == Reports::Opened && open(&report).is_err() {
        line_to_stderr("note: nothing was found that opens the report");
    }
}

/// Opens a file with what the system opens such files with.
fn open(file: &Path) -> std::io::Result<()> {
    let opener = if cfg!(windows) {
        "explorer"
    } else if cfg!(target_os = "macos") {
        "open"
    } else {
        "xdg-open"
    };
    let mut command = Command::new(opener);
    let quiet = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    quiet.arg(file).spawn().map(drop)
}

#[cfg(test)]
mod tests {
    use meltpath_base::Check;

    use super::*;

    #[test]
    fn what_fails_outweighs_what_cannot_be_said() {
        let code = |statuses: &[Status]| {
            let check = |status: &Status| Check {
                status: *status,
                ..Check::not_checked("a", "A", "")
            };
            verdict_code(&Verdict {
                checks: statuses.iter().map(check).collect(),
                ..Verdict::default()
            })
        };
        assert_eq!(code(&[]), 0);
        assert_eq!(code(&[Status::Pass, Status::Warn, Status::NotChecked]), 0);
        assert_eq!(code(&[Status::NotChecked, Status::NotChecked]), 4);
        assert_eq!(code(&[Status::CannotSay, Status::Warn]), 4);
        assert_eq!(code(&[Status::CannotSay, Status::Fail]), 1);
    }
}
