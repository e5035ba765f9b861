//! A program that other software wrote: read, executed, simulated, and judged as far as every line of it was simulated.

mod doubts;
mod levels;
mod stands;

use std::path::{Path, PathBuf};

use meltpath_base::{Check, Fact, Observer, Reporter, Verdict};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;
use meltpath_programs::Program;
use meltpath_robot::command::{Kind, Source};
use meltpath_robot::posture::NotHeld;
use meltpath_toolpath::Toolpath;

use super::error::WaamError;
use super::judge::{layer_checks, target_checks};
use super::loaded::{SHOWN_WARNINGS, load, other_process, subtitle};
use super::plan::{self, Plan, PlanStageError};
use super::program::{self, Commands};
use super::run::{Shown, load_part, write_common};
use super::settings::{Settings, resolve};
use super::surface::{Shape, held};
use crate::job::{self, Job, JobError};
use crate::outcome::{Outcome, RunFolder, record_inputs};
use crate::stages::part::Part;
use crate::start::WAAM_TEMPLATE;
use crate::views::waam::sheet::operator_sheet;
use crate::waam::deposit::metal::{self, Laid, against_part};
use crate::waam::deposit::simulate::{Build, PlannedLayer, Simulation, simulate};
use crate::waam::deposit::tube;
use crate::waam::drive::lean::Leaning;
use crate::waam::drive::own_frame;
use crate::waam::drive::reach;
use crate::waam::drive::said_axes::axes_elsewhere;
use crate::waam::drive::said_frames::undecided;
use crate::waam::drive::site::Site;
use crate::waam::drive::spacing;
use crate::waam::drive::travels;
use crate::waam::drive::unsure;
use crate::waam::judge::checks::{
    borrowed_check, fixed_torch_check, heat_check, programmed, range_check, tool_check,
};
use crate::waam::judge::doubt::{self, Doubt};
use crate::waam::judge::facts::{build_facts, times};
use crate::waam::judge::feet;
use crate::waam::plan::other_job;
use crate::waam::plan::own::{Own, own_plan};
use crate::waam::plan::planned::read_back;
use crate::waam::program::{files, toolpath_file};
use doubts::{doubts, far_from_plate};
use levels::{along, levels};
use stands::Stands;

/// Simulates a program, the main program of a folder, or a 3MF toolpath, with the process, cell and limits of `job` or stated defaults; the part is judged where a job
/// names one, and a program of a plan of that job as the plan, with what it chose. Where a line that shapes metal was not simulated, or no job names the wire, nothing passes: the checks of the metal
/// say that they cannot say, and why.
///
/// # Errors
/// [`WaamError`]; nothing is written then.
pub fn simulate_program(
    main: &Path,
    job: Option<&Path>,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Outcome, WaamError> {
    let reporter = Reporter::new();
    let loaded = job.map(|job| load(job, &reporter)).transpose()?;
    let told = match &loaded {
        Some(loaded) => loaded.settings.clone(),
        None => defaults(main, &reporter)?,
    };
    let settings = &told;
    let main = &files::main_of(main, &settings.cell.program)?;
    let mut stands = Stands::of(loaded.as_ref(), observer)?;
    let executed = if toolpath_file::is_package(main) {
        let name = loaded.as_ref().map_or("toolpath", |l| &l.name);
        of_toolpath((main, name), stands.site(settings), (&reporter, observer))?
    } else {
        of_program(main, settings, (&reporter, observer))?
    };
    let folder = home.create()?;
    // a surface is no part to hold metal against
    let part = loaded
        .as_ref()
        .filter(|loaded| loaded.settings.surface.is_none())
        .map(|loaded| load_part(loaded, &reporter, observer))
        .transpose()?;
    if let Some(toolpath) = executed.toolpath.as_ref().filter(|_| job.is_some()) {
        other_job::tell(toolpath, part.as_ref(), settings, &reporter);
    }
    let (parsed, commands) = (&executed.parsed, &executed.commands);
    let own = match (&loaded, &part) {
        (Some(loaded), Some(part)) => own_plan(loaded, part, commands, (&reporter, observer))?,
        _ => None,
    };
    stands.before((loaded.as_ref(), own.as_ref()), commands, observer)?;
    let settings = own.as_ref().map_or(settings, |own| &own.settings);
    let simulation = built(own.as_ref(), commands, settings, (&reporter, observer))?;
    // where nothing is known of neighbours beads are taken as single ones, the more uncertain case
    let growth = settings.growth_error(own.as_ref().map_or(1.0, |own| own.plan.single));
    let metal = stands.metal(&simulation, commands, settings);
    let along = reach::along(parsed, commands, settings, &metal, observer);
    observer.check()?;
    let seen = Seen {
        job,
        executed: &executed,
        part: part.as_ref(),
        own: own.as_ref(),
        stands: &stands,
        simulation: &simulation,
        settings,
    };
    let (checks, facts) = seen.judged(along.as_ref(), (&reporter, observer))?;
    let verdict = Verdict {
        checks,
        facts,
        warnings: reporter.digest(SHOWN_WARNINGS),
    };
    let mut provenance = settings.provenance.clone();
    if let Some(own) = &own {
        own.plan.record(&mut provenance);
    }
    let files: Vec<&Path> = executed.files.iter().map(PathBuf::as_path).collect();
    record_inputs(&mut provenance, &files)?;
    let title = main
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    let bead_diameter = 0.7 * settings.bead.height.value;
    let names: Vec<String> = parsed.iter().map(|p| p.name.clone()).collect();
    let what = part.as_ref().map_or("program", |p| p.name.as_str());
    let shown = Shown {
        title,
        subtitle: match job {
            Some(_) => subtitle(what, settings),
            None => format!("{what} · wire not known · cell {}", settings.cell_name),
        },
        part: part.as_ref(),
        settings,
        simulation: &simulation,
        commands,
        sheet: job
            .filter(|_| commands.lays())
            .map(|_| operator_sheet(settings, &simulation, &names)),
        growth,
        bead_diameter,
        film: reach::film(along),
    };
    observer.stage("write results", 0);
    write_common(&folder, &shown, &verdict, &provenance)?;
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// A program that was executed, and all that is known around it.
struct Seen<'a> {
    job: Option<&'a Path>,
    executed: &'a Executed,
    part: Option<&'a Part>,
    own: Option<&'a Own>,
    stands: &'a Stands,
    simulation: &'a Simulation,
    settings: &'a Settings,
}

impl Seen<'_> {
    /// Its checks and facts.
    fn judged(
        &self,
        along: Option<&Result<reach::Along, NotHeld>>,
        (reporter, observer): (&Reporter, &dyn Observer),
    ) -> Result<(Vec<Check>, Vec<Fact>), WaamError> {
        let (parsed, commands) = (&self.executed.parsed[..], &self.executed.commands);
        let settings = self.settings;
        let laid = Laid::of(self.simulation);
        let mut checks = match (self.own, self.part) {
            _ if !commands.lays() => vec![nothing_laid()],
            (Some(own), Some(part)) => {
                metal::checks(&laid, (part, &own.plan), settings, (reporter, observer))?
            }
            _ => foreign_checks(&laid, self.part, settings, (reporter, observer))?,
        };
        let turned = reach::turned(along, commands);
        let leaning = Leaning::of(turned, commands, settings);
        self.decide(&mut checks, &leaning);
        // of a plan of the job's own too: what is laid is what the program says
        if self.job.is_some() {
            checks.extend(range_check(programmed(commands, settings), settings));
            checks.extend(feet::check(commands, settings));
            checks.extend(tool_check(settings));
        }
        checks.push(doubt::lines_check(&commands.gaps, reporter));
        let of_arm = arm_checks(along, (parsed, commands), settings).into_iter();
        checks.extend(of_arm.map(|check| self.stands.undecided(check)));
        checks.extend(held::checks(self.stands.site(settings), commands));
        let tilt = leaning.check(settings);
        checks.extend(tilt.map(|check| undecided(check, &commands.elsewhere)));
        let mut facts = if commands.lays() {
            build_facts(self.simulation, commands, settings)
        } else {
            times(&self.simulation.summary, settings)
        };
        facts.extend(reach::facts(along, commands, settings));
        facts.extend(leaning.fact());
        facts.extend(self.own.iter().flat_map(|own| own.told.clone()));
        if self.job.is_none() {
            facts.retain(|f| !OF_THE_WIRE.contains(&f.id.as_str()));
        }
        Ok((checks, facts))
    }

    /// Takes the decision from checks of the metal where there are doubts.
    fn decide(&self, checks: &mut [Check], leaning: &Leaning) {
        let (parsed, commands) = (&self.executed.parsed, &self.executed.commands);
        let settings = self.settings;
        leaning.tell(checks);
        for check in checks.iter_mut() {
            if check.id == TRAVELS {
                *check = unsure::undecided_over_metal(check.clone(), &commands.unsure);
            }
        }
        let mut doubts = doubts(self.job, commands, settings);
        if self.own.is_none() {
            // a program of the job's plan lies where that does, wherever it begins, and its layers were looked at with the plan
            doubts.extend(far_from_plate(commands, settings));
            doubts.extend(doubt::of_hanging(&self.simulation.layers));
        }
        doubts.extend(self.stands.doubt());
        doubts.extend(leaning.doubts());
        let corners = doubt::of_corners(program::spoken(parsed), settings);
        let speeds = || doubt::of_speeds(programmed(commands, settings).map(|s| s.speed), settings);
        doubts.extend(corners.or_else(speeds));
        leave_undecided(checks, &doubts, commands, settings);
    }
}

/// What is told of the metal of a program without arc.
fn nothing_laid() -> Check {
    Check::not_checked(
        "metal",
        "metal: height, contact tube distance, against the part",
        "the program lays no metal: its arc stays off",
    )
}

/// The metal of a program, on what of its plan was laid before.
fn built(
    own: Option<&Own>,
    commands: &Commands,
    settings: &Settings,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Simulation, WaamError> {
    let (mut map, layers) = ground(own.map(|own| &own.plan), commands, settings)?;
    if let Some(before) = own.and_then(|own| own.before.as_ref()) {
        // what is to be told of these beads was told where they were laid
        let build = Build::of(before, &layers, map, settings);
        map = simulate(build, &Reporter::new(), observer)?.deposit.map;
    }
    let build = Build::of(commands, &layers, map, settings).beside_robot(settings);
    Ok(simulate(build, reporter, observer)?)
}

/// The checks of the arm along programs, and of the words by which they hold what they hold.
fn arm_checks(
    along: Option<&Result<reach::Along, NotHeld>>,
    (parsed, commands): (&[Program], &Commands),
    settings: &Settings,
) -> Vec<Check> {
    let mut checks = reach::checks(along, (parsed, commands), settings);
    checks.extend(fixed_torch_check(&[program::spoken(parsed)], settings));
    checks
}

/// What is simulated, and from which files.
struct Executed {
    parsed: Vec<Program>,
    files: Vec<PathBuf>,
    commands: Commands,
    /// The plan that was read, where it was no program.
    toolpath: Option<Toolpath>,
}

/// A program and those that it calls, lowered to the plate.
fn of_program(
    main: &Path,
    settings: &Settings,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Executed, WaamError> {
    let (mut parsed, files) = files::read(main, &settings.cell.program, reporter)?;
    own_frame::settle(&mut parsed, settings, reporter);
    own_frame::tell_in_cells(&mut parsed, settings);
    let mut commands = program::commands_or_moves(&parsed, settings, reporter)?;
    let plate = settings.plate_height.unwrap_or(0.0);
    let axes = axes_elsewhere(
        &[program::spoken(&parsed)],
        commands.external.as_ref(),
        settings,
        plate,
    );
    commands.elsewhere.extend(axes);
    commands.lower(plate);
    spacing::tell(&parsed, &commands, settings, reporter);
    travels::pace(&parsed, &mut commands, settings, observer);
    Ok(Executed {
        parsed,
        files,
        commands,
        toolpath: None,
    })
}

/// A toolpath says what is laid, not how one goes there: the job's cell does that, as it does for a plan of the job's own.
fn of_toolpath(
    (path, name): (&Path, &str),
    site: Site<'_>,
    told: (&Reporter, &dyn Observer),
) -> Result<Executed, WaamError> {
    let (mut toolpath, smoothing, gaps) = toolpath_file::read(path, site.settings)?;
    let settings = &Settings {
        smoothing: smoothing.map_or(site.settings.smoothing, |s| s.0),
        ..site.settings.clone()
    };
    let site = Site { settings, ..site };
    let (programs, mut commands) = read_back(name, &mut toolpath, site, told)?;
    commands.gaps.extend(gaps);
    Ok(Executed {
        parsed: programs.parsed,
        files: vec![path.to_path_buf()],
        commands,
        toolpath: Some(toolpath),
    })
}

/// The plate, and the layers of the plan or of a program whose plan is unknown.
fn ground(
    plan: Option<&Plan>,
    commands: &Commands,
    settings: &Settings,
) -> Result<(HeightMap, Vec<PlannedLayer>), WaamError> {
    let Some(plan) = plan else {
        let map = plan::plate(laid(commands).into_iter(), settings)?;
        let layers = levels(commands, &map, settings).map_err(PlanStageError::Planar)?;
        return Ok((map, layers));
    };
    let map = plan.plate(settings)?;
    let layers = plan.planned_layers(&map, settings);
    Ok((map, layers.map_err(PlanStageError::Planar)?))
}

/// The checks of the metal of a program whose plan is unknown.
fn foreign_checks(
    laid: &Laid<'_>,
    part: Option<&Part>,
    settings: &Settings,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Vec<Check>, WaamError> {
    let growth = settings.growth_error(1.0);
    let (limits, remedies) = (&settings.limits, &settings.remedies);
    let mut checks = Vec::new();
    if let Some(part) = part {
        let (metal, over) = (laid.map, settings.least_over());
        let outcome = against_part(part, settings, over, metal, &growth, (reporter, observer))?;
        checks.extend(target_checks(&outcome, limits, remedies));
    } else {
        checks.push(Check::not_checked(
            "part",
            "lack, excess and stock against the part",
            match settings.surface.as_ref().map(|asked| &asked.shape) {
                Some(Shape::Wall(_)) => {
                    "the job builds a wall along a surface, which a run of the job judges"
                }
                Some(Shape::Onto(_)) => {
                    "the job builds layers on a body, which a run of the job judges"
                }
                None => "no job was given: name one with --job to judge the part",
            },
        ));
    }
    checks.extend(layer_checks(laid.layers, &growth, limits, remedies));
    checks.extend(tube::checks(laid.layers, laid.ctwd, &growth, settings));
    checks.extend(tube::travels(laid.passed, &growth));
    checks.extend(borrowed_check(settings));
    checks.push(heat_check());
    Ok(checks)
}

/// Takes the decision from checks of the metal by what is doubted, and by a torch that stands with the arc on.
fn leave_undecided(
    checks: &mut [Check],
    doubts: &[Doubt],
    commands: &Commands,
    settings: &Settings,
) {
    let standing = doubt::of_standing_torch(commands, settings);
    let of_metal = doubt::of_metal(doubts, standing.as_ref(), settings);
    let of_part = [of_own_frame(commands), of_metal.clone()].concat();
    for check in checks.iter_mut() {
        let part = OF_THE_PART.contains(&check.id.as_str());
        let doubts = if part { &of_part } else { &of_metal };
        doubt::undecided(std::slice::from_mut(check), doubts);
    }
    if let Some(standing) = standing {
        doubt::undecided_under_torch(checks, doubts, standing);
    }
}

/// Checks that hold metal against the part.
const OF_THE_PART: [&str; 3] = ["lack", "excess", "stock"];

/// The check of the wire's tip over the metal.
const TRAVELS: &str = "travels";

/// Where a part lies in the robot's own frame the program does not say.
fn of_own_frame(commands: &Commands) -> Vec<Doubt> {
    let doubt = commands.in_own_frame.then(|| Doubt {
        reason: "beads are told in the robot's own frame, not in that of the part: where the part lies in it is not known".to_owned(),
        remedy: unsure::OWN_FRAME.to_owned(),
    });
    doubt.into_iter().collect()
}

/// Corners round the places where metal is laid: the beads from their starts on, arcs with their bulge, as far as the torch swings
/// about them, mm; of a program without arc round all its places.
fn laid(commands: &Commands) -> Vec<DVec2> {
    let swings = commands.weaves.iter().map(|w| w.amplitude);
    let swing = DVec2::splat(swings.fold(0.0, f64::max));
    let mut corners = Vec::new();
    let mut from = commands.start.position;
    for c in &commands.commands {
        // waits have no target
        if matches!(c.kind, Kind::Wait { .. }) {
            continue;
        }
        if matches!(c.source, Source::On { .. }) || !commands.lays() {
            corners.push(from.truncate());
            corners.extend(along(from, &c.kind, c.target));
        }
        from = c.target;
    }
    corners
        .into_iter()
        .flat_map(|p| [p - swing, p + swing])
        .collect()
}

/// Facts that count only where the wire is known.
const OF_THE_WIRE: [&str; 3] = ["wire-mass", "wire-feed", "energy"];

/// The settings that stand in for those of a missing job: those of the template of `meltpath new waam`.
fn defaults(main: &Path, reporter: &Reporter) -> Result<Settings, WaamError> {
    reporter.warn(
        "defaults",
        "no job was given: wire, gas, mode, wire feed, cell and limits are those of a new job",
        "name your job with --job",
    );
    let text = WAAM_TEMPLATE.to_owned();
    let Job::Waam(job) = job::parse(&text).map_err(|e| JobError::in_file(main, &text, e))? else {
        return Err(other_process(main, &text));
    };
    let settings = resolve(&job, Path::new(""), reporter);
    Ok(settings.map_err(|e| JobError::in_file(main, &text, e))?)
}
