//! The plan of an electron-beam job: paths read, a part cut, regions hatched, from the resolved settings.

pub mod hatch;
pub mod path_file;
pub mod region;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use meltpath_base::settings::{File, Problem, Setting};
use meltpath_base::{Observer, Reporter, Warning};
use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;
use meltpath_gun::Gun;
use meltpath_melt_strategy::interrupted::Kept;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::charts::simulation::Memory;

use super::cost::before_hatching::fits;
use super::cost::lever::{Lever, Need, refused};
use super::settings::{Good, PartFile, Settings, Subject, resolve};
use crate::ebm::judge::ends::tell_of_window;
use crate::ebm::plan::hatch::BeamHatch;
use crate::ebm::plan::region::{Below, Contour};
use crate::job::ebm::{Change, ChartPreview, EbmJob};
use crate::job::{Problems, Written};
use crate::machine::Machine;
use crate::stages::part;
use crate::stages::section::{Sections, sections};

/// Share of a section over metal from which on charts that remember the ground are right about what they stand on.
const CARRIED: f64 = 0.99;

/// Places of a line that are looked at.
const STRETCHES: u32 = 64;

/// Where the window of good temperatures lies.
#[derive(Debug, Clone, PartialEq)]
pub enum Window {
    /// Between these, K.
    Fixed([f64; 2]),
    /// Of this width (K), centred on the middle of a body known to be good.
    Good {
        /// Its beam path.
        path: Box<BeamPath>,
        /// Width, K.
        width: f64,
    },
}

/// The part of which a section is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnPart {
    /// Its file.
    pub file: PathBuf,
    /// What was found and repaired.
    pub findings: Vec<String>,
    /// Number of the layer that is drawn last, from 1 on the plate, and how many the part has.
    pub layer: [u32; 2],
    /// Separate areas of that layer, and the one that is drawn, from 1.
    pub islands: [usize; 2],
    /// Whether the job says which.
    pub chosen: bool,
    /// Area of the drawn one, mm².
    pub area: f64,
    /// Share of it with metal below the lowest layer that is drawn.
    pub carried: f64,
    /// What the part is drawn larger by, in the plane and along the build direction.
    pub scaling: [f64; 2],
}

/// What is drawn, on what, and what it is compared with.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The values of the job.
    pub settings: Settings,
    /// The beam path of the last layer.
    pub path: BeamPath,
    /// The paths of the layers below it, lowest first.
    pub lower: Vec<BeamPath>,
    /// What the last layer fills.
    pub contour: Contour,
    /// The gun, at the settings of the hatch or of the file.
    pub gun: Gun,
    /// What lies below the first layer.
    pub below: Below,
    /// The part it is a section of.
    pub part: Option<DrawnPart>,
    /// The window.
    pub window: Window,
    /// Paths of other strategies to try, each with its name.
    pub others: Vec<(String, BeamPath)>,
    /// What the settings and planning said.
    pub warnings: Vec<Warning>,
    /// Where the solver keeps layers that it drew until the run is done.
    pub kept: Option<Arc<Kept>>,
}

impl Plan {
    /// The paths that charts draw: of all layers, and of the body known to be good.
    pub(super) fn drawn(&self) -> Vec<&BeamPath> {
        let good = match &self.window {
            Window::Good { path, .. } => Some(path.as_ref()),
            Window::Fixed(_) => None,
        };
        self.lower.iter().chain([&self.path]).chain(good).collect()
    }

    /// What lies below the body known to be good: metal where the region hangs over, since what lies there is the region's own.
    pub fn below_good(&self) -> Below {
        match &self.below {
            Below::Areas(areas) if areas.is_empty() => Below::Areas(Vec::new()),
            _ => Below::Metal,
        }
    }
}

/// Resolves and plans a job whose file lies in `folder`.
///
/// # Errors
/// Everything wrong with its values, or with what is planned from them, each with its place in the job.
pub fn planned(
    job: &Written<EbmJob>,
    folder: &Path,
    observer: &dyn Observer,
) -> Result<Plan, Problems> {
    plan(resolve(job, folder)?, job, observer)
}

/// Plans what `settings` say; `job` gives the places of problems.
///
/// # Errors
/// Files that do not read, a part that cannot be cut, a region that cannot be hatched.
pub fn plan(settings: Settings, job: &EbmJob, observer: &dyn Observer) -> Result<Plan, Problems> {
    let reporter = Reporter::new();
    let drawn = Drawing::of(&settings, job, &reporter, observer);
    let (drawn, window) = match (drawn, window(&settings, job, &reporter)) {
        (Ok(drawn), Ok(window)) => (drawn, window),
        (drawn, window) => {
            let wrong = drawn.err().into_iter().chain(window.err());
            return Err(wrong.collect::<Vec<_>>().into());
        }
    };
    let Drawing {
        mut paths,
        contour,
        hatch,
        gun,
        below,
        part,
    } = drawn;
    focuses(job, &gun)?;
    let path = paths
        .pop()
        .ok_or_else(|| Problem::new("there is no layer to draw"))?;
    // of a part the share is known, and told where it is cut; cake lies beside the section alone
    let beside = *job.ebm.ground == crate::job::ebm::Ground::Cake;
    if let (None, false, Below::Areas(areas)) = (&part, beside, &below) {
        let share = if areas.is_empty() { "all" } else { "parts" };
        warn_of_powder(&settings, share, &reporter);
    }
    if let Window::Fixed(limits) = &window {
        tell_of_window(&settings, &path, *limits, &reporter);
    }
    let others = others(&settings, hatch.as_ref(), &contour.region(), job)?;
    let mut warnings = settings.warnings.clone();
    warnings.extend(reporter.warnings());
    Ok(Plan {
        settings,
        path,
        lower: paths,
        contour,
        gun,
        below,
        part,
        window,
        others,
        warnings,
        kept: None,
    })
}

/// Refuses a search that changes the focus of a beam which no focus current changes.
fn focuses(job: &EbmJob, gun: &Gun) -> Result<(), Problem> {
    let changed = job.optimise.as_ref().map(|table| &table.change);
    let Some(change) = changed.filter(|change| ***change == Change::Focus) else {
        return Ok(());
    };
    let Err(why) = gun.spots() else {
        return Ok(());
    };
    let problem = change.problem(format!("optimise.change: {why}"));
    Err(problem.help(
        "ebm.focus with a focus calibration in place of ebm.diameter, or optimise.change = \"speed\" or \"current\"",
    ))
}

/// What the beam draws.
struct Drawing {
    /// A path for each layer, the lowest first.
    paths: Vec<BeamPath>,
    contour: Contour,
    hatch: Option<BeamHatch>,
    gun: Gun,
    below: Below,
    part: Option<DrawnPart>,
}

impl Drawing {
    fn of(
        settings: &Settings,
        job: &EbmJob,
        reporter: &Reporter,
        observer: &dyn Observer,
    ) -> Result<Self, Problem> {
        match &settings.subject {
            Subject::Path {
                file,
                contour,
                below,
            } => {
                let (path, gun) = beam_path(file, &job.path, settings, reporter)?;
                let hull = || {
                    let on: Vec<[f64; 2]> = path.points().iter().map(|p| [p.x, p.y]).collect();
                    Contour::hull(&on)
                };
                let contour = contour.clone().unwrap_or_else(hull);
                check_inside(&path, file, &contour, job)?;
                holds(&path, job)?;
                Ok(Drawing {
                    paths: vec![path; *settings.job.ebm.layers as usize],
                    contour,
                    hatch: None,
                    gun,
                    below: below.clone(),
                    part: None,
                })
            }
            Subject::Region {
                contour,
                below,
                hatch,
            } => {
                let regions = vec![vec![contour.region()]; *settings.job.ebm.layers as usize];
                let drawn = Hatched {
                    regions: &regions,
                    contour: contour.clone(),
                    below: below.clone(),
                    part: None,
                };
                drawn.by(hatch, settings, job, (reporter, observer))
            }
            Subject::Part { part, hatch } => {
                let (drawn, found) = cut(part, settings, job, reporter, observer)?;
                let Sections {
                    drawn: regions,
                    below,
                    ..
                } = found;
                let last = regions.last().and_then(|regions| regions.first());
                let drawn = Hatched {
                    contour: last.map_or_else(|| Contour::new(Vec::new()), Contour::of),
                    below: below.map_or(Below::Metal, |regions| {
                        Below::Areas(regions.iter().map(Contour::of).collect())
                    }),
                    part: Some(drawn),
                    regions: &regions,
                };
                drawn.by(hatch, settings, job, (reporter, observer))
            }
        }
    }
}

/// What is hatched.
struct Hatched<'a> {
    /// Of each layer, the lowest first.
    regions: &'a [Vec<Region>],
    contour: Contour,
    below: Below,
    part: Option<DrawnPart>,
}

impl Hatched<'_> {
    fn by(
        self,
        hatch: &BeamHatch,
        settings: &Settings,
        job: &EbmJob,
        told: (&Reporter, &dyn Observer),
    ) -> Result<Drawing, Problem> {
        let corners = self.regions.iter().flatten();
        let corners = corners.flat_map(|region| region.outer.iter().copied());
        let (low, high) = corners.fold(
            (DVec2::INFINITY, DVec2::NEG_INFINITY),
            |(low, high), corner| (low.min(corner), high.max(corner)),
        );
        let what = match self.part {
            Some(_) => ("the section of the part", job.part.span.clone()),
            None => ("region.contour", job.region.contour.span.clone()),
        };
        fits(settings, job, what, [low, high].map(|c| c.to_array()))?;
        let hatch = hatch.on(&self.below);
        let paths = self.paths(&hatch, job, told)?;
        Ok(Drawing {
            paths,
            contour: self.contour,
            gun: hatch.gun.clone(),
            hatch: Some(hatch),
            below: self.below,
            part: self.part,
        })
    }

    /// The path of each layer.
    fn paths(
        &self,
        hatch: &BeamHatch,
        job: &EbmJob,
        (reporter, observer): (&Reporter, &dyn Observer),
    ) -> Result<Vec<BeamPath>, Problem> {
        observer.stage("hatch", self.regions.len() as u64);
        let mut paths = Vec::new();
        for (regions, number) in self.regions.iter().zip(1..) {
            // what is cancelled is told by who asked for the plan
            observer
                .check()
                .map_err(|cancelled| Problem::new(cancelled.to_string()))?;
            let path = hatch.path(regions, number, reporter);
            paths.push(path.map_err(|e| e.in_hatch(job))?);
            if let [first] = &*paths {
                holds(first, job)?;
            }
            observer.advance(1);
        }
        Ok(paths)
    }
}

/// Refuses more layers than memory has room for, each with a path like this one.
fn holds(path: &BeamPath, job: &EbmJob) -> Result<(), Problem> {
    let layers = f64::from(*job.ebm.layers);
    let points = path.points().len() as f64;
    let bytes = layers * points * size_of::<BeamPoint>() as f64;
    let few = "fewer layers: a few show whether the last one is as hot as the one before";
    let lever = Lever::of(&job.ebm.layers, layers, few);
    let need = Need::Memory([bytes, Machine::here().bytes]);
    refused("the paths of all layers", need, [lever]).map_or(Ok(()), Err)
}

/// The sections of a part.
fn cut(
    part: &PartFile,
    settings: &Settings,
    job: &EbmJob,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(DrawnPart, Sections), Problem> {
    // far below a voxel
    let chord_error = 0.1 * settings.job.ebm.layer.0;
    let read = part::load(
        &part.file,
        part.unit,
        part.up,
        chord_error,
        reporter,
        observer,
    )
    .map_err(|e| job.part.problem(e.to_string()))?;
    let at = &job.section;
    let found = sections(&read.mesh, &part.cut, reporter, observer)
        .map_err(|e| e.told([&at.height.span, &at.island.span, &job.part.span]))?;
    if found.carried < CARRIED {
        let share = format!("{:.0} %", 100.0 * (1.0 - found.carried));
        warn_of_powder(settings, &share, reporter);
    }
    let last = found.drawn.last().and_then(|regions| regions.first());
    let drawn = DrawnPart {
        file: part.file.clone(),
        findings: read.findings,
        layer: [found.number, found.of],
        islands: [found.islands, *job.section.island as usize],
        chosen: job.section.island.span.is_some(),
        area: last.map_or(0.0, Region::area),
        carried: found.carried,
        scaling: part.cut.scaling,
    };
    Ok((drawn, found))
}

/// Warns where charts draw what lies over powder with a memory of metal.
fn warn_of_powder(settings: &Settings, share: &str, reporter: &Reporter) {
    if settings.preview == ChartPreview::Drawn
        && matches!(settings.simulation.memory, Memory::Ground(_))
    {
        reporter.warn(
            "ground-of-powder",
            format!(
                "{share} of the section lie over powder, which charts that remember the ground take for metal: they read too cold there"
            ),
            "go by the solver's temperatures there (judge.solver), or leave the memory out of the charts (charts.memory = \"none\")",
        );
    }
}

/// Reads the beam path that a key names, and the gun that drew it.
fn beam_path(
    file: &Path,
    key: &Setting<Option<File>>,
    settings: &Settings,
    reporter: &Reporter,
) -> Result<(BeamPath, Gun), Problem> {
    let shown = |what: String| key.problem(format!("{}: {what}", file.display()));
    let record = path_file::read(file).map_err(|e| shown(e.to_string()))?;
    let gun = record.gun(&settings.focus);
    let gun = gun.ok_or_else(|| shown("the beam is never on".to_owned()))?;
    let motion = record.motion(&settings.focus);
    let motion = motion.map_err(|e| shown(e.to_string()))?;
    let path = BeamPath::of(&[motion]).map_err(|e| shown(e.to_string()))?;
    let [otherwise, lit] = record.fed_otherwise(&gun);
    if otherwise > 0 {
        reporter.warn(
            "record-of-several-settings",
            format!(
                "{}: {otherwise} of its {lit} rows with the beam on have another voltage than the first one's {} V, or a focus current that the calibration gives otherwise for the same spot",
                file.display(),
                gun.voltage
            ),
            "path.csv says the same powers and spots with the first row's voltage and branch of the focus, as far as that branch reaches: read voltage and focus from your own file",
        );
    }
    Ok((path, gun))
}

/// Refuses a path that never heats the region it is judged in.
fn check_inside(
    path: &BeamPath,
    file: &Path,
    contour: &Contour,
    job: &EbmJob,
) -> Result<(), Problem> {
    let lit = || path.points().windows(2).filter(|w| w[0].is_on());
    // a line may cross the region between two rows
    let meets = |w: &[BeamPoint]| {
        (0..=STRETCHES).any(|n| {
            let share = f64::from(n) / f64::from(STRETCHES);
            let at = |a: f64, b: f64| a + share * (b - a);
            contour.depth([at(w[0].x, w[1].x), at(w[0].y, w[1].y)]) >= -1e-9
        })
    };
    if lit().any(meets) {
        return Ok(());
    }
    let ends = lit().flatten().fold(
        [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
        |[low, high], p| {
            [
                [low[0].min(p.x), low[1].min(p.y)],
                [high[0].max(p.x), high[1].max(p.y)],
            ]
        },
    );
    let on = format!(
        "{}: the beam is on between {:?} and {:?} mm",
        file.display(),
        ends[0],
        ends[1]
    );
    let (message, help) = if job.region.contour.is_written() {
        (
            format!("{on}, and nowhere inside region.contour"),
            "give both in one frame and in mm, or leave region.contour out: the hull of the path is judged then",
        )
    } else {
        (
            format!("{on}, and the hull of that has no area to judge"),
            "write what is to be molten as region.contour",
        )
    };
    Err(job.path.problem(message).help(help))
}

/// The window: a body known to be good is read or hatched.
fn window(settings: &Settings, job: &EbmJob, reporter: &Reporter) -> Result<Window, Problem> {
    let (path, width) = match (&settings.window, settings.subject.hatch()) {
        (Good::Limits { kelvin, .. }, _) => return Ok(Window::Fixed(*kelvin)),
        (Good::Path { file, width }, _) => {
            let (path, _) = beam_path(file, &job.window.good, settings, reporter)?;
            (path, *width)
        }
        (Good::Body { size, width }, Some(hatch)) => {
            let region = Contour::rectangle(*size).region();
            let body = &job.window.body;
            let half = size.map(|edge| 0.5 * edge);
            let corners = [half.map(|edge| -edge), half];
            fits(settings, job, ("window.body", body.span.clone()), corners)?;
            let path = hatch.of_lines().path(&[region], 1, &Reporter::new());
            let path = path.map_err(|e| e.told("window.body", body))?;
            (path, *width)
        }
        (Good::Body { .. }, None) => {
            return Err(job
                .window
                .body
                .problem("nothing draws window.body: write [hatch]"));
        }
    };
    Ok(Window::Good {
        path: Box::new(path),
        width,
    })
}

/// The paths of the strategies to try besides the hatch's own.
fn others(
    settings: &Settings,
    hatch: Option<&BeamHatch>,
    region: &Region,
    job: &EbmJob,
) -> Result<Vec<(String, BeamPath)>, Problem> {
    let mut others = Vec::new();
    let (Some(hatch), Some(how), Some(table)) = (hatch, &settings.optimise, &*job.optimise) else {
        return Ok(others);
    };
    for strategy in &how.strategies {
        let path = hatch
            .with(*strategy)
            .path(std::slice::from_ref(region), 1, &Reporter::new())
            .map_err(|e| e.told("optimise.strategies", &table.strategies))?;
        others.push((strategy.word().to_owned(), path));
    }
    Ok(others)
}
