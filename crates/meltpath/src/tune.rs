//! `meltpath tune`: the control of a head's axes designed, compared and exported.
//!
//! Source: Rasoanarivo 2020, § 2.2.2 (cascade, step by step), § 2.2.3 (refinement by swarm), chapter 3 (H-infinity). Beyond it:
//! a controller that serves motors whose modes moved, and exported controllers judged as exported.

pub mod choose;
pub(crate) mod design;
pub(crate) mod error;
pub(crate) mod export;
pub mod file;
pub(crate) mod refinement;
pub mod settings;
pub(crate) mod trial;

use std::path::Path;

use meltpath_base::{Check, Limit, Measure, Observer, Reporter, Status, Verdict};
use meltpath_control::export::{ExportError, Exported};

use crate::identify::of_motor;
use crate::job::{JobError, Problems, Written};
use crate::outcome::{Outcome, RunFolder};
use crate::views;
use design::AxisResult;
pub use error::{StepError, TuneError};
use file::{Choice, TuneFile, WordName};
use settings::Settings;

/// Tunes the axes that a file names.
///
/// # Errors
/// [`TuneError`]; nothing is written then.
pub fn tune(path: &Path, home: RunFolder, observer: &dyn Observer) -> Result<Outcome, TuneError> {
    let text = crate::text_file::read(path).map_err(|source| JobError::Io {
        path: path.to_path_buf(),
        source,
    })?;
    let here = path.parent().unwrap_or(Path::new(""));
    let refused = |problems: Problems| JobError::in_file(path, &text, problems);
    let file = Written::<TuneFile>::parse(&text, TuneFile::check).map_err(|p| refused(p.into()))?;
    let settings = settings::resolve(&file, here).map_err(refused)?;
    let folder = home.create()?;
    let reporter = Reporter::new();
    let record = design::record(&settings, &reporter)?;
    let mut results: Vec<AxisResult> = Vec::new();
    for task in &settings.tasks {
        let twin = results.iter().find(|r| {
            let renamed = settings::AxisTask {
                name: task.name,
                ..r.task.clone()
            };
            renamed == *task
        });
        let result = match twin {
            Some(done) => AxisResult {
                task: task.clone(),
                // both may go into one drive
                export: done.export.clone().map(|export| Exported {
                    name: design::name_of(task),
                    ..export
                }),
                ..done.clone()
            },
            None => design::design(task, &settings, record.as_deref(), &reporter, observer)
                .map_err(|e| placed(e, &settings, &refused))?,
        };
        results.push(result);
    }
    let verdict = Verdict {
        checks: results.iter().flat_map(|r| checks(r, &settings)).collect(),
        facts: results.iter().flat_map(views::tune::facts).collect(),
        warnings: reporter.digest(3),
    };
    let mut provenance = settings.provenance.clone();
    crate::outcome::record_inputs(&mut provenance, &[path])?;
    observer.stage("write results", 0);
    let name = title(path);
    views::tune::write(&folder, &name, &settings, &results, &verdict, &provenance)?;
    export::write(&folder, &settings, &results)?;
    folder.write("tune.toml", |w| w.write_all(text.as_bytes()))?;
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// A controller that cannot be made is the fault of the bandwidth or the templates in the file, one that cannot leave that of its word.
fn placed(
    error: TuneError,
    settings: &Settings,
    refused: &dyn Fn(Problems) -> JobError,
) -> TuneError {
    let TuneError::Step { axis, source, .. } = &error else {
        return error;
    };
    let (h, export) = (&settings.file.h_infinity, &settings.file.export);
    let said = |step: &str| format!("{axis} axis, {step}: {source}");
    let (problem, help) = match source {
        StepError::Hinf(_) if h.sensitivity.is_written() => (
            h.sensitivity.problem(said("H-infinity")),
            "write lower crossovers in the templates of [h-infinity], or a bandwidth in their place",
        ),
        StepError::Hinf(_) => (
            h.bandwidth.problem(said("H-infinity")),
            "write a lower h-infinity.bandwidth",
        ),
        StepError::Export(ExportError::Word { .. } | ExportError::Unstable { .. }) => (
            export.bits.problem(said("export")),
            "write other export.bits, of coefficients and of signals, or export.word = \"single\"",
        ),
        _ => return error,
    };
    refused(problem.help(help).into()).into()
}

/// The run's name: the file's, or its folder's.
fn title(path: &Path) -> String {
    let plain = |p: Option<&std::ffi::OsStr>| p.map(|s| s.to_string_lossy().into_owned());
    plain(path.file_stem())
        .filter(|s| s != "tune")
        .or_else(|| plain(path.parent().and_then(Path::file_name)))
        .filter(|s| !s.is_empty())
        .unwrap_or_else(|| "axis tuning".to_owned())
}

/// What makes the exported controller bear more: a longer word and more samples where it has few, the one for motors that differ, where it was
/// found and is not the one, and less bandwidth.
fn sturdier(result: &AxisResult, settings: &Settings) -> String {
    let export = &settings.file.export;
    let leaves = result.export.is_some();
    let mut ways: Vec<&str> = Vec::new();
    if leaves && *export.every > 1 {
        ways.push("export.every = 1");
    }
    if leaves && *export.word == WordName::Fixed {
        ways.push("more bits after the point (export.bits), or export.word = \"single\"");
    }
    ways.push(match (result.choice, &result.robust) {
        (Choice::Robust, _) | (Choice::HInfinity, None) => "a lower h-infinity.bandwidth",
        (Choice::HInfinity, Some(_)) => {
            "export.controller = \"robust\", or a lower h-infinity.bandwidth"
        }
        (Choice::Cascade, Some(_)) => {
            "export.controller = \"robust\", or slower loops (cascade.first_maximum)"
        }
        (Choice::Cascade, None) => "slower loops (cascade.first_maximum)",
    });
    ways.join(", or ")
}

/// The controller for motors that differ, where it was searched and not found: another one leaves.
fn not_found(result: &AxisResult, settings: &Settings) -> Option<Check> {
    let why = result.robust_lacks.as_ref()?;
    let letter = result.task.name.letter();
    let check = Check {
        status: match *settings.file.export.controller {
            Some(Choice::Robust) => Status::Fail,
            None => Status::Warn,
            // beside the one that is asked for
            Some(_) => Status::NotChecked,
        },
        ..Check::not_checked(
            &format!("{letter}-robust"),
            &format!(
                "{}: a controller for motors that differ",
                letter.to_ascii_uppercase()
            ),
            &format!("{why}; the {} controller leaves", result.chosen().name),
        )
    };
    Some(check.remedy(
        "a larger robust.resonance, a smaller robust.modulus_margin, robust.mode_shift or robust.delay, a robust.order of 5 or more, more robust.iterations, or a lower h-infinity.bandwidth",
    ))
}

/// How far the exported controller stays from the critical point over the spread of motors.
fn distance(result: &AxisResult, settings: &Settings) -> Option<Check> {
    let worst = result.chosen().closest()?;
    let letter = result.task.name.letter();
    let (latest, shift) = (settings.latest(), settings.mode_shift());
    let modes = shift.map_or("modes in place".to_owned(), |shift| {
        format!("modes moved by ±{:.0} %", 100.0 * shift)
    });
    let late = if latest > 0.0 {
        format!(", voltages up to {:.1} µs late", 1e6 * latest)
    } else {
        String::new()
    };
    let check = Check::judge(
        &format!("{letter}-mode"),
        &format!(
            "{}: distance to the critical point of the exported controller as it runs, {modes}{late}",
            letter.to_ascii_uppercase(),
        ),
        Measure::exact(worst.distance, ""),
        Limit::AtLeast(0.99 * settings.spread.modulus_margin),
    );
    if check.status == Status::Pass && worst.distance > 0.0 {
        return Some(check);
    }
    let check = Check {
        // an unstable loop has no distance
        status: if worst.distance > 0.0 {
            check.status
        } else {
            Status::Fail
        },
        ..check
    };
    let what = if worst.distance > 0.0 {
        "closest"
    } else {
        "unstable"
    };
    let check = check.because(&format!(
        "{what} with the modes at {:+.1} % and voltages {:.1} µs late",
        100.0 * (worst.shift - 1.0),
        1e6 * worst.delay
    ));
    let smaller = match (shift.is_some(), latest > 0.0) {
        (true, true) => ", or a smaller robust.mode_shift or robust.delay",
        (true, false) => ", or a smaller robust.mode_shift",
        (false, true) => ", or a smaller robust.delay",
        (false, false) => "",
    };
    Some(check.remedy(format!("{}{smaller}", sturdier(result, settings))))
}

fn checks(result: &AxisResult, settings: &Settings) -> Vec<Check> {
    let letter = result.task.name.letter();
    let upper = letter.to_ascii_uppercase();
    let misfit = result.task.misfit;
    let mut checks: Vec<Check> = misfit
        .map(|over| of_motor(letter, over))
        .into_iter()
        .collect();
    let wanted = result.task.targets.position.margin.to_degrees();
    if let Some(figures) = &result.position {
        checks.push(
            Check::judge(
                &format!("{letter}-margin"),
                &format!("{upper}: phase margin of the position loop after the synthesis"),
                Measure::exact(figures.crossover.value.to_degrees(), "deg"),
                // the bisection ends a hair on either side
                Limit::AtLeast(wanted - 0.01),
            )
            .remedy("a slower position loop, or a faster speed loop (cascade.first_maximum)"),
        );
    }
    let chosen = result.chosen();
    checks.extend(distance(result, settings));
    checks.extend(not_found(result, settings));
    if *settings.file.compare.draws > 0 {
        checks.push(
            Check::judge(
                &format!("{letter}-scatter"),
                &format!(
                    "{upper}: of {} scattered motors those that the exported controller loses",
                    *settings.file.compare.draws
                ),
                Measure::exact(chosen.lost() as f64, ""),
                Limit::AtMost(0.0),
            )
            .remedy(sturdier(result, settings)),
        );
    } else {
        checks.push(Check::not_checked(
            &format!("{letter}-scatter"),
            &format!("{upper}: scattered motors that the exported controller loses"),
            "compare.draws is 0: none was run",
        ));
    }
    if let Some(exported) = &result.as_exported {
        checks.push(
            Check::judge(
                &format!("{letter}-export"),
                &format!("{upper}: error as exported over error as designed"),
                Measure::exact(exported.error.rms() / chosen.bare.error.rms(), ""),
                Limit::AtMost(1.05),
            )
            .remedy("more bits (export.bits) or a longer word (export.word), export.form = \"sections\", or a higher export.limit"),
        );
    }
    checks
}
