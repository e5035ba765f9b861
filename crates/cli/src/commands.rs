//! What each command does: calls the library, shows the outcome, chooses the exit code.

use std::path::{Path, PathBuf};

use meltpath::outcome::Outcome;
use meltpath::reference::{Subject, schema};
use meltpath::start::{self, StartError};
use meltpath::waam;
use meltpath::{chain, compare, fit, health, identify, inspect, reach, tune};
use meltpath_base::{Place, Reporter, Status, Verdict};

use crate::arguments::{Arguments, Command, HealthArguments, NewProcess};
use crate::exit_code::{CANNOT_SAY, INPUT_WRONG, PART_FAILS};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::show::{line, line_to_stderr};

/// Executes the command and returns the exit code.
pub(crate) fn execute(arguments: &Arguments) -> u8 {
    if let Some(threads) = arguments.threads
        && rayon::ThreadPoolBuilder::new()
            .num_threads(threads.max(1))
            .build_global()
            .is_err()
    {
        line_to_stderr("note: the number of threads could not be set; all cores are used");
    }
    let outcome = match &arguments.command {
        Command::Run { job, out } => run(job, out.as_deref()),
        Command::Plan { job, out } => plan(job, out.as_deref()),
        Command::Program { job, toolpath, out } => program(job, toolpath, out.as_deref()),
        Command::Simulate { program, job, out } => {
            simulate(program, job.as_deref(), out.as_deref())
        }
        Command::Inspect { file } => inspect_file(file),
        Command::Reach { part, robot } => mapped(part, robot),
        Command::New {
            process: NewProcess::Waam { name, shape },
        } => made(start::waam(name, shape)),
        Command::New {
            process: NewProcess::Lpbf { name },
        } => made(start::lpbf(name)),
        Command::New {
            process: NewProcess::Ebm { name },
        } => made(start::ebm(name)),
        Command::Compare {
            against,
            table,
            out,
        } => compared(against, table.as_deref(), out.as_deref()),
        Command::Fit { measurements, out } => fitted(measurements, out.as_deref()),
        Command::Health(arguments) => tested(arguments),
        Command::Doctor { job } => doctor(job),
        Command::Schema { of } => Ok(print_schema(*of)),
        Command::Tune { file, out } => tuned(file, out.as_deref()),
        Command::Identify {
            record,
            mapping,
            ramps,
            ramps_mapping,
        } => {
            let ramps = ramps
                .as_deref()
                .map(|r| (r, ramps_mapping.as_deref().unwrap_or(mapping)));
            identified(record, mapping, ramps)
        }
    };
    outcome.unwrap_or_else(Failure::show)
}

/// A name beside `file`: its stem and a suffix.
fn beside(file: &Path, suffix: &str) -> PathBuf {
    let stem = file
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    file.with_file_name(format!("{stem}{suffix}"))
}

fn show_timers(progress: &Progress) {
    progress.finish();
    let timers = progress.timers();
    let total: f64 = timers.iter().map(|(_, t)| t.as_secs_f64()).sum();
    line_to_stderr("");
    for (stage, time) in timers {
        line_to_stderr(&format!("  {stage:28} {:8.2} s", time.as_secs_f64()));
    }
    line_to_stderr(&format!("  {:28} {total:8.2} s", "total"));
}

/// The verdict in words: what fails first, facts apart from checks.
fn show_verdict(verdict: &Verdict) {
    let placed = |place: &Option<Place>| {
        let place = place.as_ref().map(ToString::to_string);
        place
            .filter(|p| !p.is_empty())
            .map_or(String::new(), |p| format!(" ({p})"))
    };
    line("");
    for check in verdict.in_reading_order() {
        line(&format!(
            "{:>12}  {}: {}{}",
            check.status.words(),
            check.title,
            check.line(),
            placed(&check.place)
        ));
        if let Some(remedy) = &check.remedy {
            line(&format!("{:>12}  → {remedy}", ""));
        }
    }
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
    line(&format!(
        "verdict: {}. {}",
        verdict.status().words(),
        verdict.sentence()
    ));
}

fn verdict_code(verdict: &Verdict) -> u8 {
    match verdict.status() {
        Status::Fail => PART_FAILS,
        Status::CannotSay => CANNOT_SAY,
        Status::Pass | Status::Warn | Status::NotChecked => 0,
    }
}

/// Tells what was judged, and where the report is; the exit code that says it.
fn judged(progress: &Progress, outcome: &Outcome) -> u8 {
    show_timers(progress);
    show_verdict(&outcome.verdict);
    show_report(&outcome.folder);
    verdict_code(&outcome.verdict)
}

fn show_report(folder: &Path) {
    line(&format!(
        "report:  {}",
        folder.join("report.html").display()
    ));
}

fn run(job: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(job, "-runs");
    let outcome = chain::run(job, out, &runs, &progress)?;
    Ok(judged(&progress, &outcome))
}

fn tuned(file: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(file, "-runs");
    let outcome = tune::tune(file, out, &runs, &progress)?;
    let code = judged(&progress, &outcome);
    line(&format!(
        "controllers for whole jobs:  {}",
        outcome.folder.join("controllers.json").display()
    ));
    Ok(code)
}

fn plan(job: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let path = out.map_or_else(|| beside(job, "-toolpath.melt"), Path::to_path_buf);
    let summary = waam::plan_to_file(job, &path, &progress)?;
    show_timers(&progress);
    line(&summary);
    line(&format!("plan:    {}", path.display()));
    Ok(0)
}

fn program(job: &Path, toolpath: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let path = out.map_or_else(|| beside(job, "-program"), Path::to_path_buf);
    for file in waam::program_to_folder(job, toolpath, &path)? {
        line(&path.join(file).display().to_string());
    }
    Ok(0)
}

fn simulate(program: &Path, job: Option<&Path>, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(program, "-runs");
    let outcome = waam::simulate_program(program, job, out, &runs, &progress)?;
    Ok(judged(&progress, &outcome))
}

fn inspect_file(file: &Path) -> Result<u8, Failure> {
    let progress = Progress::new();
    let reporter = Reporter::new();
    let findings = inspect::inspect(file, &reporter, &progress)?;
    progress.finish();
    for finding in findings {
        line(&finding);
    }
    show_notes(&reporter);
    Ok(0)
}

fn mapped(part: &Path, robot: &str) -> Result<u8, Failure> {
    let progress = Progress::new();
    let reporter = Reporter::new();
    let lines = reach::reach(part, robot, &reporter, &progress)?;
    progress.finish();
    for text in &lines {
        line(text);
    }
    show_notes(&reporter);
    Ok(0)
}

fn made(job: Result<PathBuf, StartError>) -> Result<u8, Failure> {
    let job = job?;
    line(&format!("made {}", job.display()));
    line(&format!("next: meltpath run {}", job.display()));
    Ok(0)
}

fn identified(record: &Path, mapping: &Path, ramps: Option<(&Path, &Path)>) -> Result<u8, Failure> {
    let reporter = Reporter::new();
    let mut found = identify::identify(record, mapping, &reporter)?;
    if let Some((ramps, mapping)) = ramps {
        identify::add_friction(&mut found, ramps, mapping, &reporter)?;
    }
    for finding in found.lines(record) {
        line(&finding);
    }
    show_notes(&reporter);
    Ok(0)
}

fn compared(against: &Path, table: Option<&Path>, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(table.unwrap_or(against), "-compare");
    let found = compare::compare(against, table, out, &runs, &progress)?;
    show_timers(&progress);
    for part in &found.parts {
        let (a, shown) = (&part.apart, part.quantity.shown());
        let unit = shown.difference;
        let digits = if part.quantity.is_temperature() { 1 } else { 3 };
        let told = |value: f64| format!("{:.digits$}", shown.difference(value));
        line("");
        line(&format!(
            "{}: {} samples of {} compared with {}",
            part.quantity.words(),
            a.pairs,
            found.name,
            found.against
        ));
        line(&format!(
            "bias {} {unit}, standard deviation {} {unit}, mean without sign {} {unit}",
            told(a.bias),
            told(a.deviation),
            told(a.mean),
        ));
        line(&format!(
            "50, 90, 95, 99 % within {} {unit}",
            a.percentiles.map(told).join(", ")
        ));
        let worst = &a.worst.sample;
        let when = if part.quantity.is_in_time() {
            format!(", {:.6} s", worst.time)
        } else {
            String::new()
        };
        line(&format!(
            "furthest apart: {} {unit} at x {:.3}, y {:.3}, z {:.3} mm{when}",
            told(a.worst.difference()),
            worst.place[0],
            worst.place[1],
            worst.place[2],
        ));
    }
    for warning in &found.verdict.warnings {
        line(&format!("note: {}", warning.message));
    }
    show_report(&found.folder);
    Ok(0)
}

fn fitted(measurements: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(measurements, "-fit");
    let found = fit::fit(measurements, out, &runs, &progress)?;
    show_timers(&progress);
    line("");
    for finding in meltpath::views::fit::lines(&found) {
        line(&finding);
    }
    for warning in &found.verdict.warnings {
        line(&format!("note: {}", warning.message));
    }
    show_report(&found.folder);
    Ok(0)
}

fn tested(arguments: &HealthArguments) -> Result<u8, Failure> {
    let a = arguments;
    let subject = health::Subject::find(&a.machine, &a.head, &a.axis)?;
    if let Some(folder) = &a.signal {
        let made = subject.write_signal(folder)?;
        line(&format!("made {}", made.display()));
        line(
            "play stage1.csv as motor voltage in open loop, stage2.csv as set-points of the closed loop; record voltage, current, angle and set-point",
        );
        return Ok(0);
    }
    let bench = match (a.records.as_slice(), &a.mapping) {
        ([first, second], Some(mapping)) => health::Bench::Records {
            first: first.clone(),
            second: second.clone(),
            mapping: mapping.clone(),
        },
        _ => health::Bench::Simulated(a.change.clone()),
    };
    let now = || health::iso(std::time::SystemTime::now());
    let circumstances = health::Circumstances {
        time: a.time.clone().unwrap_or_else(now),
        temperature: a.temperature,
        accept: a.accept,
    };
    let reporter = Reporter::new();
    let outcome = health::test(&subject, &bench, &a.history, &circumstances, &reporter)?;
    show_verdict(&outcome.verdict);
    line(&format!(
        "{}: {} (test {})",
        subject.name(),
        outcome.rating.words(),
        outcome.tests
    ));
    line(&format!(
        "report:  {}",
        outcome.folder.join("report.html").display()
    ));
    Ok(verdict_code(&outcome.verdict))
}

/// Warnings as notes.
fn show_notes(reporter: &Reporter) {
    for warning in reporter.warnings() {
        let remedy = warning.remedy.map(|r| format!("; {r}")).unwrap_or_default();
        line(&format!("note: {}{remedy}", warning.message));
    }
}

fn doctor(job: &Path) -> Result<u8, Failure> {
    let progress = Progress::new();
    let diagnosis = chain::doctor(job, &progress)?;
    progress.finish();
    for finding in &diagnosis.lines {
        line(finding);
    }
    let problems = diagnosis.problems();
    line("");
    line(&match problems {
        0 => "no problem: `meltpath run` takes this job".to_owned(),
        1 => "1 problem: `meltpath run` refuses this job".to_owned(),
        n => format!("{n} problems: `meltpath run` refuses this job"),
    });
    Ok(match diagnosis.refused {
        None => 0,
        Some(refused) => {
            Failure::from(refused).show();
            INPUT_WRONG
        }
    })
}

fn print_schema(of: Subject) -> u8 {
    line(&format!("{:#}", schema(of)));
    0
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
        assert_eq!(code(&[Status::CannotSay, Status::Warn]), 4);
        assert_eq!(code(&[Status::CannotSay, Status::Fail]), 1);
    }
}
