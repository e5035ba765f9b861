//! What each command does: calls the library, shows the outcome, chooses the exit code.

use std::path::{Path, PathBuf};

use meltpath::job::PartUnit;
use meltpath::list::Listing;
use meltpath::outcome::RunFolder;
use meltpath::reach::Found;
use meltpath::reference::{Subject, schema};
use meltpath::start::{self, StartError};
use meltpath::waam::program::wanted::{Restart, Torch, Wanted};
use meltpath::waam::{self, LeftOpen};
use meltpath::{
    chain, compare, fit, focus, health, identify, inspect, measure, motion_log, reach, records,
    tune,
};
use meltpath_base::{Length, Observer, Reporter, Verdict};
use serde_json::json;

use crate::arguments::{Arguments, Command, HealthArguments, NewProcess};
use crate::exit_code::{INPUT_WRONG, PART_FAILS};
use crate::failure::Failure;
use crate::manual;
use crate::progress::Progress;
use crate::show::{Reports, Voice, finish, line, line_to_stderr, speak, tell};
use crate::verdict::{judged, show_report, show_timers, show_verdict, verdict_code};

/// Executes the command and returns the exit code.
pub(crate) fn execute(arguments: &Arguments) -> u8 {
    let voice = match (arguments.json, arguments.quiet) {
        (true, _) => Voice::Json,
        (false, true) => Voice::Quiet,
        (false, false) => Voice::Words,
    };
    let reports = if arguments.open {
        Reports::Opened
    } else {
        Reports::Told
    };
    speak(voice, reports);
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
        Command::Plan {
            job,
            out,
            as_written,
        } => {
            let open = if *as_written {
                LeftOpen::Defaults
            } else {
                LeftOpen::Chosen
            };
            plan(job, out.as_deref(), open)
        }
        Command::Program {
            job,
            toolpath,
            out,
            from_layer,
            from_bead,
            dry_run,
        } => {
            let restart = |layer: &u32| Restart {
                layer: *layer,
                bead: from_bead.unwrap_or(1),
            };
            let wanted = Wanted {
                from: from_layer.as_ref().map(restart),
                torch: if *dry_run { Torch::Dry } else { Torch::Burns },
            };
            program(job, toolpath, out.as_deref(), wanted)
        }
        Command::Simulate { program, job, out } => {
            simulate(program, job.as_deref(), out.as_deref())
        }
        Command::Inspect {
            file,
            unit,
            chord,
            picture,
        } => inspect_file(file, *unit, *chord, picture.as_deref()),
        Command::List { of } => Ok(list(*of)),
        Command::Completions { shell } => Ok(manual::completions(*shell)),
        Command::Man { out } => manual::pages(out),
        Command::Reach { part, unit, robot } => mapped(part, *unit, robot),
        Command::New {
            process: NewProcess::Waam { name, shape, wire },
        } => made(start::waam(name, shape, wire.as_deref())),
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
        Command::Focus { walls, out } => focused(walls, out.as_deref()),
        Command::Measure { file, out } => measured(file, out.as_deref()),
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
    let code = outcome.unwrap_or_else(Failure::show);
    finish(code);
    code
}

/// The names that a job may use, each with what it is and where it comes from.
fn list(of: Listing) -> u8 {
    let entries = of.entries(Path::new(""));
    let longest = |f: fn(&meltpath::list::Entry) -> &String| {
        entries
            .iter()
            .map(|e| f(e).chars().count())
            .max()
            .unwrap_or(0)
    };
    let (name, what) = (longest(|e| &e.name), longest(|e| &e.what));
    for e in &entries {
        line(&format!("{:name$}  {:what$}  {}", e.name, e.what, e.from));
    }
    let told = entries
        .iter()
        .map(|e| json!({"name": e.name, "what": e.what, "from": e.from}));
    tell(of.word(), told.collect());
    0
}

/// A name beside `file`: its stem and a suffix.
fn beside(file: &Path, suffix: &str) -> PathBuf {
    let stem = file
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    file.with_file_name(format!("{stem}{suffix}"))
}

fn run(job: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(job, "-runs");
    let outcome = chain::run(job, RunFolder::asked(out, &runs), &progress)?;
    Ok(judged(&progress, &outcome))
}

fn tuned(file: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(file, "-runs");
    let outcome = tune::tune(file, RunFolder::asked(out, &runs), &progress)?;
    let code = judged(&progress, &outcome);
    line(&format!(
        "controllers for whole jobs:  {}",
        outcome.folder.join("controllers.json").display()
    ));
    Ok(code)
}

fn plan(job: &Path, out: Option<&Path>, open: LeftOpen) -> Result<u8, Failure> {
    let progress = Progress::new();
    let path = out.map_or_else(|| beside(job, "-toolpath.melt"), Path::to_path_buf);
    let summary = waam::plan_to_file(job, &path, open, &progress)?;
    show_timers(&progress);
    line(&summary);
    line(&format!("plan:    {}", path.display()));
    tell("plan", json!(path));
    Ok(0)
}

fn program(job: &Path, toolpath: &Path, out: Option<&Path>, wanted: Wanted) -> Result<u8, Failure> {
    let suffix = match wanted.variant() {
        whole if whole.is_empty() => "-program".to_owned(),
        variant => format!("-program-{}", variant.to_ascii_lowercase()),
    };
    let path = out.map_or_else(|| beside(job, &suffix), Path::to_path_buf);
    let progress = Progress::new();
    let reporter = Reporter::new();
    let watched = (&reporter, &progress as &dyn Observer);
    let written = waam::program_to_folder(job, toolpath, &path, wanted, watched)?;
    progress.finish();
    for file in &written.files {
        line(&path.join(file).display().to_string());
    }
    show_notes(&reporter);
    // as `reach` of a run: written, and not to be driven
    Ok(if written.held { 0 } else { PART_FAILS })
}

fn simulate(program: &Path, job: Option<&Path>, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(program, "-runs");
    let outcome = waam::simulate_program(program, job, RunFolder::asked(out, &runs), &progress)?;
    Ok(judged(&progress, &outcome))
}

fn inspect_file(
    file: &Path,
    unit: PartUnit,
    chord: Length,
    picture: Option<&Path>,
) -> Result<u8, Failure> {
    let progress = Progress::new();
    let reporter = Reporter::new();
    let how = inspect::How {
        unit,
        chord: chord.0,
    };
    let findings = inspect::inspect(file, how, &reporter, &progress)?;
    progress.finish();
    for finding in findings {
        line(&finding);
    }
    if let Some(picture) = picture {
        inspect::picture(file, picture)?;
        line(&format!("reach drawn in {}", picture.display()));
    }
    show_notes(&reporter);
    Ok(0)
}

fn mapped(part: &Path, unit: PartUnit, robot: &str) -> Result<u8, Failure> {
    let progress = Progress::new();
    let reporter = Reporter::new();
    let map = reach::reach(part, unit, robot, &reporter, &progress)?;
    progress.finish();
    for text in &map.lines {
        line(text);
    }
    show_notes(&reporter);
    Ok(match map.found {
        Found::APlace => 0,
        Found::NoPlace => PART_FAILS,
    })
}

fn made(job: Result<PathBuf, StartError>) -> Result<u8, Failure> {
    let job = job?;
    tell("job", json!(job));
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
    let verdict = found.verdict();
    show_verdict(&verdict);
    Ok(verdict_code(&verdict))
}

fn compared(against: &Path, table: Option<&Path>, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(table.unwrap_or(against), "-compare");
    let found = compare::compare(against, table, RunFolder::asked(out, &runs), &progress)?;
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
        if let Some([mean, greatest]) = part.away {
            line(&format!(
                "the two places of a pair lie {:.1} µm apart in the mean, {:.1} µm at most",
                1e3 * mean,
                1e3 * greatest
            ));
        }
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

/// Shows what a command found, and returns the exit code.
fn show_found(findings: &[String], verdict: &Verdict, folder: &Path) -> u8 {
    line("");
    for finding in findings {
        line(finding);
    }
    show_verdict(verdict);
    show_report(folder);
    verdict_code(verdict)
}

fn fitted(measurements: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(measurements, "-fit");
    let found = fit::fit(measurements, RunFolder::asked(out, &runs), &progress)?;
    show_timers(&progress);
    let findings = meltpath::views::fit::lines(&found);
    Ok(show_found(&findings, &found.verdict, &found.folder))
}

fn focused(walls: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(walls, "-focus");
    let found = focus::calibrate(walls, RunFolder::asked(out, &runs), &progress)?;
    let findings = meltpath::views::focus::lines(&found);
    Ok(show_found(&findings, &found.verdict, &found.folder))
}

fn measured(file: &Path, out: Option<&Path>) -> Result<u8, Failure> {
    let progress = Progress::new();
    let runs = beside(file, "-measured");
    if motion_log::is_of_motion(file) {
        let found = motion_log::motion_log(file, RunFolder::asked(out, &runs), &progress)?;
        show_timers(&progress);
        let findings = meltpath::views::motion_log::lines(&found);
        return Ok(show_found(&findings, &found.verdict, &found.folder));
    }
    if records::is_of_records(file) {
        let found = records::records(file, RunFolder::asked(out, &runs), &progress)?;
        show_timers(&progress);
        let findings = meltpath::views::records::lines(&found);
        return Ok(show_found(&findings, &found.verdict, &found.folder));
    }
    let found = measure::measure(file, RunFolder::asked(out, &runs), &progress)?;
    show_timers(&progress);
    let findings = meltpath::views::measure::lines(&found);
    Ok(show_found(&findings, &found.verdict, &found.folder))
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
    show_report(&outcome.folder);
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
    tell("problems", json!(problems));
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
