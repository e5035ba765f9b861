//! The whole chain and its stages, from a job file to a folder of results.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, OutputFolder, write_file};
use meltpath_base::settings::Problem;
use meltpath_base::{Check, Observer, Provenance, Reporter, Verdict};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_report::html::{Report, ReportError, write_html};
use meltpath_toolpath::{Toolpath, storage};

use super::checks::{build_facts, overhang_check, plan_facts, plate_check, program_check};
use super::error::WaamError;
use super::judge::{self, GrowthError, TargetOutcome, layer_checks, target_checks};
use super::plan::{self, PlanStageError};
use super::program::{self, Commands};
use super::settings::{Settings, resolve};
use super::simulate::{Build, PlannedLayer, Simulation, simulate};
use super::target::{Target, compare};
use crate::job::waam::Dialect;
use crate::job::{self, Job, JobError, WaamJob};
use crate::outcome::{Examined, Outcome, json, record_inputs};
use crate::stages::part::{self, Part, PartError};
use crate::views;
use crate::views::waam::sheet::operator_sheet;

/// Warnings of one kind that a verdict tells one by one.
const SHOWN_WARNINGS: usize = 3;

/// A job file with its resolved values.
struct Loaded {
    path: PathBuf,
    text: String,
    name: String,
    settings: Settings,
}

/// The job, read and resolved.
fn load(path: &Path, reporter: &Reporter) -> Result<Loaded, WaamError> {
    let (job, text) = job::load(path)?;
    let Job::Waam(job) = job else {
        return Err(other_process(path, &text));
    };
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let settings =
        resolve(&job, &folder, reporter).map_err(|e| JobError::in_file(path, &text, e))?;
    Ok(Loaded {
        path: path.to_path_buf(),
        name: job_name(path, &job),
        text,
        settings,
    })
}

/// A job of another process where a wire-arc one is needed.
fn other_process(path: &Path, text: &str) -> WaamError {
    let place = text.find("[process]").map(|at| at..at + 9);
    let problem = Problem::new("this command is for wire-arc jobs")
        .at(place)
        .help("`meltpath run` takes jobs of every process");
    WaamError::Job(JobError::in_file(path, text, problem))
}

/// A name for people: the part's, or the folder's where the job file has none of its own.
fn job_name(path: &Path, job: &WaamJob) -> String {
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let own = stem(path).filter(|s| s != "job");
    let folder = || {
        path.parent()
            .and_then(Path::file_name)
            .map(|n| n.to_string_lossy().into_owned())
    };
    own.or_else(folder)
        .or_else(|| stem(Path::new(&**job.part)))
        .unwrap_or_else(|| "job".to_owned())
}

fn output(out: Option<&Path>, runs: &Path) -> Result<OutputFolder, OutputError> {
    out.map_or_else(|| OutputFolder::create_numbered(runs), OutputFolder::create)
}

fn load_part(
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Part, PartError> {
    part::load(
        &settings.part,
        settings.part_unit,
        settings.up,
        settings.chord_error,
        reporter,
        observer,
    )
}

/// The whole chain: a new folder `out`, else the next free number in `runs`.
///
/// # Errors
/// [`WaamError`]; nothing is written then.
pub fn run(
    job: &Path,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Outcome, WaamError> {
    let reporter = Reporter::new();
    let loaded = load(job, &reporter)?;
    let folder = output(out, runs)?;
    let settings = &loaded.settings;
    let part = load_part(settings, &reporter, observer)?;
    observer.check()?;
    let plan = plan::plan(&part, settings, &reporter, observer)?;
    let programs = program::write(&loaded.name, &plan.toolpath, settings, &reporter)?;
    let commands = program::commands(
        &programs.parsed,
        &programs.schedules,
        settings.bead.wire_feed,
        settings,
        &reporter,
    )?;
    let map = plan.plate(settings)?;
    let layers = plan
        .planned_layers(&map, settings)
        .map_err(PlanStageError::Planar)?;
    let build = built(&commands, &layers, map, settings);
    let simulation = simulate(build, &reporter, observer)?;
    observer.stage("compare with the part", 0);
    let target = Target::new(
        &part.mesh,
        settings.allowance,
        &simulation.deposit.map,
        &reporter,
        observer,
    )?;
    let growth = settings.growth_error(plan.single);
    let at = |deviations: f64| {
        let shifted = |height: f64| growth.shifted(height, deviations);
        compare(&simulation.deposit.map, &target, shifted)
    };
    let outcome = TargetOutcome {
        volume: target.volume,
        expected: at(0.0),
        low: at(-1.0),
        high: at(1.0),
    };
    let mut checks = target_checks(&outcome, &settings.limits, &settings.remedies);
    checks.extend(layer_checks(
        &simulation.layers,
        &growth,
        &settings.limits,
        &settings.remedies,
    ));
    checks.push(overhang_check(&plan, settings));
    checks.extend(plate_check(&plan, settings));
    checks.push(program_check(&programs, &plan.toolpath, &commands));
    checks.extend(judge::not_checked());
    let mut facts = build_facts(&simulation, settings);
    facts.extend(plan_facts(&plan, settings));
    let verdict = Verdict {
        checks,
        facts,
        warnings: reporter.digest(SHOWN_WARNINGS),
    };
    let mut provenance = settings.provenance.clone();
    plan.record(&mut provenance);
    record_inputs(&mut provenance, &[&loaded.path, &settings.part])?;
    let written: &[_] = if settings.programs.contains(&Dialect::FanucLs) {
        &programs.files
    } else {
        &[]
    };
    let shown = Shown {
        title: loaded.name.clone(),
        part: Some(&part),
        settings,
        simulation: &simulation,
        commands: &commands,
        program_names: written.iter().map(|f| f.name.clone()).collect(),
        growth,
        bead_diameter: 0.7 * plan.height.value,
    };
    observer.stage("write results", 0);
    write_common(&folder, &shown, &verdict, &provenance)?;
    views::waam::write_passes(&folder, &plan.toolpath)?;
    folder.write("job.toml", |w| w.write_all(loaded.text.as_bytes()))?;
    folder.write("toolpath.melt", |w| storage::write(&plan.toolpath, w))?;
    for file in written {
        folder.write(&format!("program/{}", file.name), |w| {
            w.write_all(file.text.as_bytes())
        })?;
    }
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// What the report and the common files are made of.
struct Shown<'a> {
    title: String,
    part: Option<&'a Part>,
    settings: &'a Settings,
    simulation: &'a Simulation,
    commands: &'a Commands,
    program_names: Vec<String>,
    growth: GrowthError,
    bead_diameter: f64,
}

fn built<'a>(
    commands: &'a Commands,
    layers: &'a [PlannedLayer],
    map: HeightMap,
    settings: &'a Settings,
) -> Build<'a> {
    Build {
        start: commands.start,
        commands: &commands.commands,
        layer_of_command: commands.layer_of_command.clone(),
        layers,
        controller: &settings.cell.motion,
        map,
        bead: settings.bead_model,
        pool: settings.pool,
        settings: settings.deposit,
    }
}

/// The report, the verdict, the provenance, the fields and the series.
fn write_common(
    folder: &OutputFolder,
    shown: &Shown<'_>,
    verdict: &Verdict,
    provenance: &Provenance,
) -> Result<(), WaamError> {
    let settings = shown.settings;
    let layers = &shown.commands.layer_of_command;
    views::waam::write_files(
        folder,
        shown.simulation,
        layers,
        Some(settings.plate_thickness),
    )?;
    let report = Report {
        title: shown.title.clone(),
        subtitle: format!(
            "{} · wire {} · {} · {} · cell {}",
            shown.part.map_or("program", |p| p.name.as_str()),
            *settings.wire.name,
            *settings.gas.name,
            settings.mode.to_uppercase(),
            settings.cell_name
        ),
        verdict: verdict.clone(),
        scene: Some(views::waam::scene(
            shown.simulation,
            layers,
            shown.bead_diameter,
            shown.part,
        )),
        sections: views::waam::sections(shown.simulation, &shown.growth, &settings.limits),
        sheet: Some(operator_sheet(
            settings,
            shown.simulation,
            &shown.program_names,
        )),
        provenance: provenance.clone(),
    };
    folder.write("report.html", |w| {
        write_html(w, &report).map_err(|e| match e {
            ReportError::Io(e) => e,
            ReportError::Scene(e) => std::io::Error::other(e),
        })
    })?;
    json(folder, "verdict.json", &verdict.to_json())?;
    // plain structs of numbers and strings: their JSON exists
    json(
        folder,
        "provenance.json",
        &serde_json::to_value(provenance).unwrap_or_default(),
    )?;
    Ok(())
}

/// Plans only, into a new file. Returns a summary in words.
///
/// # Errors
/// [`WaamError`].
pub fn plan_to_file(job: &Path, out: &Path, observer: &dyn Observer) -> Result<String, WaamError> {
    let reporter = Reporter::new();
    let loaded = load(job, &reporter)?;
    if out.exists() {
        return Err(OutputError::Exists(out.to_path_buf()).into());
    }
    let part = load_part(&loaded.settings, &reporter, observer)?;
    let plan = plan::plan(&part, &loaded.settings, &reporter, observer)?;
    write_file(out, |w| storage::write(&plan.toolpath, w))?;
    let mut lines = vec![format!(
        "{} beads, {:.1} m, in {} layers of {:.3} mm",
        plan.toolpath.pass_count(),
        plan.toolpath.deposited_length() / 1000.0,
        plan.layers.len(),
        plan.height.value
    )];
    lines.extend(part.findings);
    lines.extend(
        reporter
            .warnings()
            .into_iter()
            .map(|w| format!("note: {}", w.message)),
    );
    Ok(lines.join("\n"))
}

/// Reads a plan.
///
/// # Errors
/// [`WaamError::Container`].
pub fn read_toolpath(path: &Path) -> Result<Toolpath, WaamError> {
    let failed = |source| WaamError::Container {
        path: path.to_path_buf(),
        source,
    };
    let file = File::open(path).map_err(|e| failed(e.into()))?;
    storage::read(&mut BufReader::new(file)).map_err(failed)
}

/// Writes the program of a plan into a new folder. Returns the names of its files.
///
/// # Errors
/// [`WaamError`].
pub fn program_to_folder(
    job: &Path,
    toolpath: &Path,
    out: &Path,
) -> Result<Vec<String>, WaamError> {
    let reporter = Reporter::new();
    let loaded = load(job, &reporter)?;
    let toolpath = read_toolpath(toolpath)?;
    let programs = program::write(&loaded.name, &toolpath, &loaded.settings, &reporter)?;
    let folder = OutputFolder::create(out)?;
    for file in &programs.files {
        folder.write(&file.name, |w| w.write_all(file.text.as_bytes()))?;
    }
    folder.commit()?;
    Ok(programs.files.into_iter().map(|f| f.name).collect())
}

/// Simulates a program, with the process, cell and limits of `job` or stated defaults; the part is judged where a job
/// names one.
///
/// # Errors
/// [`WaamError`]; nothing is written then.
pub fn simulate_program(
    main: &Path,
    job: Option<&Path>,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Outcome, WaamError> {
    let reporter = Reporter::new();
    let parsed = program::read(main, &reporter)?;
    let loaded = match job {
        Some(job) => load(job, &reporter)?,
        None => defaults(main, &reporter)?,
    };
    let settings = &loaded.settings;
    let commands = program::commands(&parsed, &[], settings.bead.wire_feed, settings, &reporter)?;
    let folder = output(out, runs)?;
    let part = job
        .map(|_| load_part(settings, &reporter, observer))
        .transpose()?;
    let arc = |c: &&meltpath_robot::command::Command| {
        matches!(c.source, meltpath_robot::command::Source::On { .. })
    };
    let map = plan::plate(
        commands
            .commands
            .iter()
            .filter(arc)
            .map(|c| c.target.truncate()),
        settings,
    )?;
    let layers = levels(&commands, settings);
    let simulation = simulate(
        built(&commands, &layers, map, settings),
        &reporter,
        observer,
    )?;
    // nothing is known of neighbours here: beads are taken as single ones, the more uncertain case
    let growth = settings.growth_error(1.0);
    let mut checks = Vec::new();
    if let Some(part) = &part {
        let target = Target::new(
            &part.mesh,
            settings.allowance,
            &simulation.deposit.map,
            &reporter,
            observer,
        )?;
        let at = |deviations: f64| {
            let shifted = |height: f64| growth.shifted(height, deviations);
            compare(&simulation.deposit.map, &target, shifted)
        };
        let outcome = TargetOutcome {
            volume: target.volume,
            expected: at(0.0),
            low: at(-1.0),
            high: at(1.0),
        };
        checks.extend(target_checks(
            &outcome,
            &settings.limits,
            &settings.remedies,
        ));
    } else {
        checks.push(Check::not_checked(
            "part",
            "lack, excess and stock against the part",
            "no job was given: name one with --job to judge the part",
        ));
    }
    checks.extend(layer_checks(
        &simulation.layers,
        &growth,
        &settings.limits,
        &settings.remedies,
    ));
    checks.extend(judge::not_checked());
    let verdict = Verdict {
        checks,
        facts: build_facts(&simulation, settings),
        warnings: reporter.digest(SHOWN_WARNINGS),
    };
    let mut provenance = settings.provenance.clone();
    record_inputs(&mut provenance, &[main])?;
    let title = main
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    let bead_diameter = 0.7 * settings.bead.height.value;
    let program_names = parsed.iter().map(|p| p.name.clone()).collect();
    let shown = Shown {
        title,
        part: part.as_ref(),
        settings,
        simulation: &simulation,
        commands: &commands,
        program_names,
        growth,
        bead_diameter,
    };
    observer.stage("write results", 0);
    write_common(&folder, &shown, &verdict, &provenance)?;
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// The layers of a program whose plan is unknown: each ends where the next one begins.
fn levels(commands: &Commands, settings: &Settings) -> Vec<PlannedLayer> {
    let on = commands
        .commands
        .iter()
        .zip(&commands.layer_of_command)
        .filter(|(_, l)| **l > 0);
    let mut bottoms = std::collections::BTreeMap::<u32, f64>::new();
    for (c, layer) in on {
        let z = bottoms.entry(*layer).or_insert(c.target.z);
        *z = z.min(c.target.z);
    }
    let list: Vec<(u32, f64)> = bottoms.into_iter().collect();
    let step = match list.as_slice() {
        [.., (_, a), (_, b)] => b - a,
        _ => settings.bead.height.value,
    };
    list.iter()
        .enumerate()
        .map(|(i, (layer, bottom))| PlannedLayer {
            layer: *layer,
            top: list.get(i + 1).map_or(bottom + step, |next| next.1),
            ..PlannedLayer::default()
        })
        .collect()
}

/// The job that stands for a missing one: the template of `meltpath new waam`.
fn defaults(main: &Path, reporter: &Reporter) -> Result<Loaded, WaamError> {
    reporter.warn(
        "defaults",
        "no job was given: wire, gas, mode, wire feed, cell and limits are those of a new job",
        "name your job with --job",
    );
    let text = crate::start::WAAM_TEMPLATE.to_owned();
    let Job::Waam(job) = job::parse(&text).map_err(|e| JobError::in_file(main, &text, e))? else {
        return Err(other_process(main, &text));
    };
    let settings =
        resolve(&job, Path::new(""), reporter).map_err(|e| JobError::in_file(main, &text, e))?;
    Ok(Loaded {
        path: main.to_path_buf(),
        text,
        name: "program".to_owned(),
        settings,
    })
}

/// What is resolved in a job, and what it warns of.
///
/// # Errors
/// [`WaamError`] for whatever a run refuses before it computes: a part that cannot be used too.
pub fn examine(job: &Path, observer: &dyn Observer) -> Result<Examined, WaamError> {
    let reporter = Reporter::new();
    let loaded = load(job, &reporter)?;
    load_part(&loaded.settings, &reporter, observer)?;
    Ok(Examined {
        provenance: loaded.settings.provenance,
        notes: Vec::new(),
        warnings: reporter.warnings(),
    })
}
