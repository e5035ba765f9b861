//! The whole chain and its stages, from a job file to a folder of results.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use meltpath_base::output::{OutputError, OutputFolder, write_file};
use meltpath_base::settings::Problem;
use meltpath_base::{Observer, Provenance, Reporter, Verdict};
use meltpath_programs::Dialect;
use meltpath_report::html::Report;
use meltpath_report::sheet::OperatorSheet;
use meltpath_robot::cell::Maker;
use meltpath_toolpath::{Toolpath, storage};

use super::error::WaamError;
use super::judge::GrowthError;
use super::loaded::{Loaded, SHOWN_WARNINGS, load, subtitle, written};
use super::plan;
use super::program::{Commands, ProgramStageError};
use super::settings::{Settings, laws_tried};
use super::surface;
use crate::job::JobError;
use crate::job::common::SubstrateTable;
use crate::outcome::{self, Examined, Outcome, RunFolder};
use crate::stages::part::{self, Part};
use crate::views;
use crate::views::waam::sheet::operator_sheet;
use crate::waam::deposit::simulate::Simulation;
use crate::waam::drive::film::Film;
use crate::waam::drive::lean::Leaning;
use crate::waam::drive::reach;
use crate::waam::drive::said_axes;
use crate::waam::drive::said_frames::undecided;
use crate::waam::drive::site::Site;
use crate::waam::judge::checks::{fixed_torch_check, plan_facts};
use crate::waam::judge::doubt;
use crate::waam::judge::facts::build_facts;
use crate::waam::plan::foretell::Built;
use crate::waam::plan::mend::{leaves_open, mend, settle};
use crate::waam::plan::planned::{Planned, planned};

/// The part of a job; refused where the job's plate is smaller.
pub(super) fn load_part(
    loaded: &Loaded,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Part, WaamError> {
    let settings = &loaded.settings;
    let part = part::load(
        &settings.part,
        settings.part_unit,
        settings.up,
        settings.chord_error,
        reporter,
        observer,
    )?;
    match too_small(&loaded.job.substrate, &part) {
        Some(problem) => Err(JobError::in_file(&loaded.path, &loaded.text, problem).into()),
        None => Ok(part),
    }
}

/// What is wrong with a plate that the part does not fit on.
fn too_small(plate: &SubstrateTable, part: &Part) -> Option<Problem> {
    let size = (*plate.size)?;
    let (low, high) = part.mesh.bounds()?;
    let part = (high - low).truncate().to_array();
    let smaller = size.iter().zip(part).any(|(s, p)| s.0 < p);
    smaller.then(|| {
        let problem = plate.size.problem(format!(
            "the part is {:.0} x {:.0} mm, larger than {}, {:.0} x {:.0} mm",
            part[0], part[1], plate.size.name, size[0].0, size[1].0
        ));
        problem.help("give the size of the plate along x and y of the build, or leave it out: the plate then reaches 25 mm around the part")
    })
}

/// Tells that a build is planned from 0 on, wherever the plate lies for programs of other software.
fn warn_of_plate(settings: &Settings, reporter: &Reporter) {
    if settings.plate_height.is_some_and(|h| h != 0.0) {
        reporter.warn(
            "plate-height",
            "substrate.height counts for programs of other software: this build is planned from 0 mm on",
            "leave it out, or simulate the program of the other software",
        );
    }
}

/// Refuses programs of which it is known before there is a plan that they cannot be written.
fn writable(loaded: &Loaded) -> Result<(), WaamError> {
    let settings = &loaded.settings;
    let words = settings.check_words();
    words.map_err(|(dialect, why)| {
        let why = ProgramStageError::from(why);
        WaamError::Program(why.of(dialect, &settings.programs))
    })?;
    let wrong: Vec<Problem> = settings
        .programs
        .iter()
        .filter_map(|dialect| of_another_maker(loaded, *dialect))
        .collect();
    if wrong.is_empty() {
        return Ok(());
    }
    Err(JobError::in_file(&loaded.path, &loaded.text, wrong).into())
}

/// What is wrong with programs whose positions must say how the arm stands, where the job's robot is none of that controller's.
fn of_another_maker(loaded: &Loaded, dialect: Dialect) -> Option<Problem> {
    let (needed, says) = match dialect {
        Dialect::Inform => (
            Maker::Yaskawa,
            "every position says how the arm stands (RCONF)",
        ),
        Dialect::UrScript => (Maker::Universal, "joint moves say the joints"),
        Dialect::FanucLs | Dialect::Krl | Dialect::Rapid | Dialect::Val3 => return None,
    };
    let found = loaded.settings.robot.as_ref().map(|cell| cell.maker);
    if found == Some(needed) {
        return None;
    }
    let dialect = dialect.word();
    let (has, help) = match found {
        None => ("names no robot (machine.robot)".to_owned(), String::new()),
        Some(maker) => (
            format!("has a robot of maker = \"{}\"", maker.word()),
            format!(", or leave \"{dialect}\" out of output.programs"),
        ),
    };
    let message = format!(
        "programs for {dialect} cannot be written: {says}, and the job {has}: only one of maker = \"{}\" tells it",
        needed.word()
    );
    let (job, asked) = (&loaded.job, &loaded.job.output.programs);
    let problem = if asked.is_written() {
        asked.problem(message)
    } else if job.machine.robot.is_written() {
        job.machine.robot.problem(message)
    } else {
        job.machine.cell.problem(message)
    };
    Some(problem.help(format!(
        "name a robot of this controller's maker (machine.robot; a file of yours says maker){help}"
    )))
}

/// The whole chain.
///
/// # Errors
/// [`WaamError`]; nothing is written then.
pub fn run(job: &Path, home: RunFolder, observer: &dyn Observer) -> Result<Outcome, WaamError> {
    let reporter = Reporter::new();
    let mut loaded = load(job, &reporter)?;
    writable(&loaded)?;
    let folder = home.create()?;
    warn_of_plate(&loaded.settings, &reporter);
    if let Some(asked) = &loaded.settings.surface {
        return surface::run::run(&loaded, asked, folder, &reporter, observer);
    }
    let part = load_part(&loaded, &reporter, observer)?;
    observer.check()?;
    let foretold = settle(&mut loaded, &part, &reporter, observer)?;
    let settings = &loaded.settings;
    if let Some(choice) = foretold.choice() {
        observer.note(&choice);
    }
    if !foretold.checks.is_empty() {
        observer.note("`meltpath doctor` tries other settings that may mend it");
    }
    let Planned {
        plan,
        programs,
        commands,
    } = foretold.planned;
    let Built {
        simulation,
        mut checks,
    } = foretold.built;
    let growth = settings.growth_error(plan.single);
    observer.stage("robot", 0);
    let metal = &simulation.metal;
    let along = reach::along(&programs.parsed, &commands, settings, metal, observer);
    observer.check()?;
    let turned = reach::turned(along.as_ref(), &commands);
    let leaning = Leaning::of(turned, &commands, settings);
    leaning.tell(&mut checks);
    let doubts = leaning.doubts();
    let standing = doubt::of_standing_torch(&commands, settings);
    let of_metal = doubt::of_metal(&doubts, standing.as_ref(), settings);
    doubt::undecided(&mut checks, &of_metal);
    if let Some(standing) = standing {
        doubt::undecided_under_torch(&mut checks, &doubts, standing);
    }
    let tilt = leaning.check(settings);
    checks.extend(tilt.map(|check| undecided(check, &commands.elsewhere)));
    let written = written(
        &loaded,
        &plan.toolpath,
        (&programs, &commands),
        (Site::flat(settings), observer),
    )?;
    checks.push(written.check);
    let of_arm = reach::checks(along.as_ref(), (&programs.parsed, &commands), settings).into_iter();
    checks.extend(of_arm.map(|check| written.otherwise.undecided(check, settings)));
    checks.extend(fixed_torch_check(&settings.dialects(), settings));
    let mut facts = build_facts(&simulation, &commands, settings);
    facts.extend(reach::facts(along.as_ref(), &commands, settings));
    facts.extend(leaning.fact());
    facts.extend(plan_facts(&plan, settings));
    facts.extend(foretold.chosen);
    let verdict = Verdict {
        checks,
        facts,
        warnings: reporter.digest(SHOWN_WARNINGS),
    };
    let mut provenance = settings.provenance.clone();
    plan.record(&mut provenance);
    loaded.record(&mut provenance)?;
    let names: Vec<String> = written.files.iter().map(|f| f.name.clone()).collect();
    let shown = Shown {
        title: loaded.name.clone(),
        subtitle: subtitle(&part.name, settings),
        part: Some(&part),
        settings,
        simulation: &simulation,
        commands: &commands,
        sheet: Some(operator_sheet(settings, &simulation, &names)),
        growth,
        bead_diameter: 0.7 * plan.height.value,
        film: reach::film(along),
    };
    observer.stage("write results", 0);
    write_common(&folder, &shown, &verdict, &provenance)?;
    views::waam::write_passes(&folder, &plan.toolpath)?;
    let built = (part.name.as_str(), &part.mesh);
    loaded.keep(&folder, (&plan.toolpath, built), &written.files)?;
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// What the report and the common files are made of.
pub(super) struct Shown<'a> {
    pub(super) title: String,
    /// What was built of what, in a line.
    pub(super) subtitle: String,
    pub(super) part: Option<&'a Part>,
    pub(super) settings: &'a Settings,
    pub(super) simulation: &'a Simulation,
    pub(super) commands: &'a Commands,
    pub(super) sheet: Option<OperatorSheet>,
    pub(super) growth: GrowthError,
    pub(super) bead_diameter: f64,
    /// What is shown of the robot.
    pub(super) film: Film,
}

/// The report, the verdict, the provenance, the fields and the series.
pub(super) fn write_common(
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
    let mut report = Report {
        title: shown.title.clone(),
        subtitle: shown.subtitle.clone(),
        verdict: verdict.clone(),
        scene: Some(views::waam::scene(
            shown.simulation,
            layers,
            shown.bead_diameter,
            shown.part,
        )),
        sections: views::waam::sections(shown.simulation, &shown.growth, &settings.limits),
        sheet: shown.sheet.clone(),
        provenance: provenance.clone(),
    };
    let records = &shown.simulation.summary.commands;
    let way = (&shown.film, &records[..]);
    views::waam::cell::show(folder, &mut report, settings, way, (shown.commands, None))?;
    outcome::tell(folder, &report)?;
    Ok(())
}

const KEPT: &str =
    "what the job leaves out keeps its default: a run looks at the metal and may choose otherwise";

/// What a plan does with settings that the job leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeftOpen {
    /// As a run: where the plan is expected to fail by its metal, others are tried.
    Chosen,
    /// Their defaults, without a look at the metal.
    Defaults,
}

/// Plans only, into a new file. Returns a summary in words.
///
/// # Errors
/// [`WaamError`].
pub fn plan_to_file(
    job: &Path,
    out: &Path,
    open: LeftOpen,
    observer: &dyn Observer,
) -> Result<String, WaamError> {
    let reporter = Reporter::new();
    let mut loaded = load(job, &reporter)?;
    if out.exists() {
        return Err(OutputError::Exists(out.to_path_buf()).into());
    }
    let (toolpath, mut lines) = if let Some(asked) = &loaded.settings.surface {
        let (plan, lines) = surface::run::plan_only(&loaded, asked, &reporter, observer)?;
        (plan.toolpath, lines)
    } else {
        let part = load_part(&loaded, &reporter, observer)?;
        let is_open = leaves_open(&loaded.job);
        let (plan, chosen) = if is_open && open == LeftOpen::Chosen {
            let foretold = settle(&mut loaded, &part, &reporter, observer)?;
            let choice = foretold.choice();
            (foretold.planned.plan, choice)
        } else if loaded.settings.robot.is_some() {
            // the robot may need beads divided
            let planned = planned(&loaded.name, &part, &loaded.settings, &reporter, observer)?;
            (planned.plan, None)
        } else {
            let plan = plan::plan(&part, &loaded.settings, &reporter, observer)?;
            (plan, None)
        };
        let kept = is_open && open == LeftOpen::Defaults;
        let chosen = chosen.or_else(|| kept.then(|| KEPT.to_owned()));
        let told = format!(
            "{} beads, {:.1} m, in {} layers of {:.3} mm",
            plan.toolpath.pass_count(),
            plan.toolpath.deposited_length() / 1000.0,
            plan.layers.len(),
            plan.height.value
        );
        let lines = std::iter::once(told)
            .chain(chosen)
            .chain(part.findings)
            .collect();
        (plan.toolpath, lines)
    };
    write_file(out, |w| storage::write(&toolpath, w))?;
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

/// What is resolved in a job, what it warns of, and what its plan is expected to fail.
///
/// # Errors
/// [`WaamError`] for whatever a run refuses before it simulates: a part or a plan that cannot be used too.
pub fn examine(job: &Path, observer: &dyn Observer) -> Result<Examined, WaamError> {
    let reporter = Reporter::new();
    let mut loaded = load(job, &reporter)?;
    writable(&loaded)?;
    said_axes::tell(&loaded.settings, &reporter);
    if let Some(asked) = &loaded.settings.surface {
        return surface::run::examine(&loaded, asked, &reporter, observer);
    }
    let part = load_part(&loaded, &reporter, observer)?;
    // layer by layer a plan warns of much: the run tells it
    let foretold = settle(&mut loaded, &part, &Reporter::new(), observer)?;
    let mut lines = foretold.lines();
    // no way to fill holds a wall that leans, or says how wide a woven bead is
    if !foretold.checks.is_empty()
        && foretold.planned.plan.lean.is_none()
        && loaded.settings.weave.is_none()
    {
        lines.push(mend(&loaded, &part, &foretold.checks, observer)?);
    }
    let map = &loaded.settings.map;
    let laws = laws_tried(map).map(|laws| {
        format!(
            "process map {}, laws by their errors on beads left out: {laws}; the first is taken",
            map.id
        )
    });
    Ok(Examined {
        notes: laws.into_iter().chain(lines).collect(),
        provenance: loaded.settings.provenance,
        warnings: reporter.warnings(),
    })
}
