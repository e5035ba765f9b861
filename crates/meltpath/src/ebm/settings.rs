//! Every value of an electron-beam job resolved: what was written, and the stated defaults.

use std::path::{Path, PathBuf};

use meltpath_base::settings::{File, Problem, Setting};
use meltpath_base::{Length, Provenance, Ratio, Reporter, Temperature, Warning};
use meltpath_geometry::math::DVec3;
use meltpath_gun::Machine;
use meltpath_gun::focus::FocusCalibration;
use meltpath_melt_strategy::bed::{Between, Domain, Resolution};
use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::beam::Beam;
use meltpath_thermal::charts::simulation;
use meltpath_thermal::material::Material;
use meltpath_thermal::material::enthalpy::BELOW;
use meltpath_thermal::material::file::Readings;
use meltpath_thermal::material::medium::Body;
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;

use super::correct::Correct;
use super::gun;
use super::optimise::Optimise;
use crate::ebm::gun::focus;
use crate::ebm::plan::hatch::{BeamHatch, law};
use crate::ebm::plan::region::{Below, Contour};
use crate::job::ebm::{
    ChartMemory, ChartPreview, EbmJob, EbmTable, Ground, HatchStrategy, JudgeGround, JudgeSolver,
    JudgeTable, LayerMemory, Point, Ring, Vapour, WindowModel,
};
use crate::job::{PartUnit, Problems, Written};
use crate::material::{Loaded, load};
use crate::stages::section::Cut;

/// The material whose window the limits are where none are written: that of Béraud 2016.
const MATERIAL_OF_WINDOW: &str = "ti6al4v-ebm";

/// What remembers earlier lines: the thesis' domain, at the start temperature half a millimetre below the build plane, as the
/// reference solver that judges has it.
const GROUND: Body = Body::Cooled { thickness: 0.5 };

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// A beam path.
    Path {
        /// Its file.
        file: PathBuf,
        /// What of it is judged; its hull where absent.
        contour: Option<Contour>,
        /// What lies below the first layer.
        below: Below,
    },
    /// A region that is hatched.
    Region {
        /// Its contour.
        contour: Contour,
        /// What lies below the first layer.
        below: Below,
        /// What fills it.
        hatch: BeamHatch,
    },
    /// A part of which sections are hatched.
    Part {
        /// The part.
        part: PartFile,
        /// What fills them.
        hatch: BeamHatch,
    },
}

impl Subject {
    /// The file that says what is drawn.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Subject::Path { file, .. } => Some(file),
            Subject::Part { part, .. } => Some(&part.file),
            Subject::Region { .. } => None,
        }
    }

    /// What fills it.
    pub fn hatch(&self) -> Option<&BeamHatch> {
        match self {
            Subject::Path { .. } => None,
            Subject::Region { hatch, .. } | Subject::Part { hatch, .. } => Some(hatch),
        }
    }
}

/// A part and how it is cut.
#[derive(Debug, Clone, PartialEq)]
pub struct PartFile {
    /// Its file.
    pub file: PathBuf,
    /// Unit of a file that carries none.
    pub unit: PartUnit,
    /// The direction of the file that points up.
    pub up: DVec3,
    /// Which layers are drawn.
    pub cut: Cut,
}

/// What places the window of good temperatures.
#[derive(Debug, Clone, PartialEq)]
pub enum Good {
    /// Two limits.
    Limits {
        /// K.
        kelvin: [f64; 2],
        /// With which model they were found.
        model: Option<WindowModel>,
        /// Whether the job writes them.
        written: bool,
    },
    /// The path of a body known to be good, and a width, K.
    Path {
        /// The path's file.
        file: PathBuf,
        /// Width, K.
        width: f64,
    },
    /// A rectangle that the hatch makes well, and a width, K.
    Body {
        /// Width and height, mm.
        size: [f64; 2],
        /// Width, K.
        width: f64,
    },
}

/// How the path is judged on the reference solver.
#[derive(Debug, Clone, PartialEq)]
pub struct Judge {
    /// What is judged; the whole path where absent.
    pub part: Option<Rectangle>,
    /// How far beyond it the path is drawn, mm.
    pub beyond: f64,
    /// Cells and steps; the ground's extent follows from [`Judge::ground`].
    pub resolution: Resolution,
    /// What the ground is.
    pub ground: JudgeGround,
    /// Thickness of the start plate, mm.
    pub plate: f64,
    /// From one layer to the next; each starts at the start temperature where absent.
    pub between: Option<Between>,
    /// How deep below the build plane temperatures are read, mm.
    pub depth: f64,
    /// Places whose temperature is kept in time, mm; without z on the build plane.
    pub places: Vec<([f64; 2], Option<f64>)>,
    /// Time between two of these temperatures, s.
    pub every: f64,
}

/// A job with every value resolved.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The job: values that need no resolving are read there.
    pub job: EbmJob,
    /// What is drawn.
    pub subject: Subject,
    /// What the values themselves give cause to say.
    pub warnings: Vec<Warning>,
    /// The material.
    pub material: Material,
    /// Its file, where it is not one that ships.
    pub material_file: Option<PathBuf>,
    /// The machine's gun, where the job names one.
    pub gun: Option<Machine>,
    /// Spot against focus current.
    pub focus: FocusCalibration,
    /// Beam to heat.
    pub beam: Beam,
    /// Chart files.
    pub chart_files: Vec<PathBuf>,
    /// Whether charts show the path.
    pub preview: ChartPreview,
    /// How the simulation is carried out.
    pub simulation: simulation::Settings,
    /// What places the window.
    pub window: Good,
    /// Whether and how speeds are changed.
    pub optimise: Option<Optimise>,
    /// Whether and how currents are corrected.
    pub correct: Option<Correct>,
    /// Whether and how the reference solver judges.
    pub judge: Option<Judge>,
    /// What the build plane sees, on the solver.
    pub surface: Surface,
    /// Every value with its origin.
    pub provenance: Provenance,
}

/// Resolves a job whose file lies in `folder`: plain values; nothing is read but the material and the focus calibration.
///
/// # Errors
/// Everything wrong, each with its place in the job: files that are not there, values that cannot be.
pub fn resolve(job: &Written<EbmJob>, folder: &Path) -> Result<Settings, Problems> {
    let mut r = job.provenance.clone();
    let mut problems = missing(job, folder);
    let mut keep = |found: Vec<Problem>| problems.extend(found);
    let material = material(job, folder, &mut r).map_err(&mut keep).ok();
    let focus = focus_of(job, folder, &mut r).map_err(&mut keep).ok();
    let gun = gun::of_job(job, folder).map_err(&mut keep).ok();
    let mut one = |problem| keep(vec![problem]);
    let hatch = hatch(job, focus.as_ref(), &mut r).map_err(&mut one).ok();
    if let Some(Some(gun)) = &gun {
        r.model("gun", &format!("{}: {}", gun.name, gun.source));
    }
    let metal = material.as_ref().map(|loaded| &loaded.material);
    let subject = match (metal, hatch) {
        (Some(metal), Some(hatch)) => subject(job, folder, hatch, metal, &mut r)
            .map_err(&mut one)
            .ok(),
        _ => None,
    };
    let judge = metal.and_then(|metal| {
        let judge = judge(&job.judge, &job.ebm, metal, &mut r);
        judge.map_err(&mut one).ok()
    });
    let (Some(loaded), Some(focus), Some(gun), Some(subject), Some(judge), true) =
        (material, focus, gun, subject, judge, problems.is_empty())
    else {
        return Err(problems.into());
    };
    check_stop(job, &loaded.material)?;
    let window = window(job, folder, &mut r);
    let reporter = Reporter::new();
    warn_of_window(job, &window, &loaded.material, &reporter);
    let material = loaded.material;
    let optimise = job.optimise.as_ref();
    let (charts, sim) = (&job.charts, &job.simulation);
    Ok(Settings {
        job: (**job).clone(),
        optimise: optimise
            .map(|o| Optimise::resolve(o, subject.hatch(), job.usual_search(o), &mut r)),
        preview: job.charts.preview.or_computed(&mut r, job.preview()),
        correct: job.correct.as_ref().map(Correct::resolve),
        subject,
        warnings: reporter.warnings(),
        focus,
        gun,
        chart_files: charts.files.iter().map(|f| folder.join(&**f)).collect(),
        simulation: simulation::Settings {
            step: sim.step.0,
            memory: match *charts.memory {
                ChartMemory::None => simulation::Memory::None,
                ChartMemory::Ground => simulation::Memory::Ground(GROUND),
            },
            ..simulation::Settings::of(&material)
        },
        window,
        judge,
        surface: surface(job),
        material,
        material_file: loaded.file,
        beam: Beam {
            efficiency: job.ebm.efficiency.0,
            depth: Depth::Falling {
                penetration: job.ebm.penetration.0,
            },
        },
        provenance: r,
    })
}

/// Charts end in a melt, below where the laws of materials are known.
fn check_stop(job: &EbmJob, material: &Material) -> Result<(), Problems> {
    /// K.
    const HIGHEST: f64 = 4500.0;
    let stop = &job.charts.stop;
    let known = stop.0 > material.liquidus && stop.0 <= HIGHEST;
    if known || job.preview() == ChartPreview::None {
        return Ok(());
    }
    let message = format!(
        "charts.stop is {}: charts of {} end between its liquidus, {}, and {}",
        **stop,
        material.name,
        Temperature(material.liquidus),
        Temperature(HIGHEST)
    );
    let help = "leave it out, or write a temperature between the two";
    Err(vec![stop.problem(message).help(help)].into())
}

/// What is wrong with the files that a job names in tables of which no key is `wrong`.
pub(crate) fn named(
    job: &Written<EbmJob>,
    folder: &Path,
    wrong: impl Fn(&str) -> bool,
) -> Vec<Problem> {
    let mut problems = missing(job, folder);
    if !wrong("ebm.") {
        let mut r = Provenance::new();
        problems.extend(material(job, folder, &mut r).err().unwrap_or_default());
        problems.extend(focus_of(job, folder, &mut r).err().unwrap_or_default());
        let gun = job.ebm.gun.as_ref();
        let gun = gun.and_then(|name| gun::load(name, folder).err());
        problems.extend(gun.map(|e| e.at(&job.ebm.gun)).unwrap_or_default());
    }
    problems
}

/// Files that the job names and that are not there.
fn missing(job: &EbmJob, folder: &Path) -> Vec<Problem> {
    let one = |key: &Setting<Option<File>>| {
        let file = key.as_ref().map(|file| folder.join(&**file));
        absent(file).map(|message| key.problem(message))
    };
    let charts = job.charts.files.iter().filter_map(|file| {
        let message = absent(Some(folder.join(&**file)))?;
        let help = "left out of charts.files, they are computed by the run";
        Some(job.charts.files.problem(message).help(help))
    });
    let keys = [&job.path, &job.part, &job.window.good];
    keys.into_iter().filter_map(one).chain(charts).collect()
}

/// Why a file cannot be opened.
fn absent(file: Option<PathBuf>) -> Option<String> {
    let file = file?;
    let error = std::fs::metadata(&file).err()?;
    Some(format!("cannot open {}: {error}", file.display()))
}

fn corners(ring: &Ring) -> Vec<[f64; 2]> {
    ring.iter().map(|c| c.map(|v| v.0)).collect()
}

/// What the job says of what lies below.
fn ground(job: &EbmJob) -> Below {
    let region = &job.region;
    match (*job.ebm.ground, &*region.supported) {
        (Ground::Metal, _) => Below::Metal,
        (Ground::Cake, _) => {
            let holes: Vec<_> = region.holes.iter().map(corners).collect();
            let outer = region.contour.iter().map(corners);
            Below::Areas(
                outer
                    .map(|outer| Contour::new(outer).with_holes(holes.clone()))
                    .collect(),
            )
        }
        (Ground::Powder, None) => Below::Areas(Vec::new()),
        (Ground::Powder, Some(supported)) => Below::Areas(vec![Contour::new(corners(supported))]),
    }
}

/// What is drawn.
fn subject(
    job: &EbmJob,
    folder: &Path,
    hatch: Option<BeamHatch>,
    material: &Material,
    r: &mut Provenance,
) -> Result<Subject, Problem> {
    let region = &job.region;
    let contour = region.contour.as_ref().map(|outer| {
        Contour::new(corners(outer)).with_holes(region.holes.iter().map(corners).collect())
    });
    if let Some(file) = &*job.path {
        return Ok(Subject::Path {
            file: folder.join(&**file),
            contour,
            below: ground(job),
        });
    }
    let nothing = || Problem::new("nothing draws the region: write [hatch]");
    let hatch = hatch.ok_or_else(nothing)?;
    let Some(file) = &*job.part else {
        return Ok(Subject::Region {
            contour: contour.unwrap_or_else(|| Contour::new(Vec::new())),
            below: ground(job),
            hatch,
        });
    };
    // the part says it itself
    r.parameters.remove(&job.ebm.ground.name);
    let part = PartFile {
        file: folder.join(&**file),
        unit: *job.part_unit,
        up: DVec3::from_array(job.build_direction.0),
        cut: cut(job, material, r),
    };
    Ok(Subject::Part { part, hatch })
}

fn hatch(
    job: &EbmJob,
    focus: Option<&FocusCalibration>,
    r: &mut Provenance,
) -> Result<Option<BeamHatch>, Problem> {
    let (Some(table), Some(focus)) = (job.hatch.as_ref(), focus) else {
        return Ok(None);
    };
    let mut hatch = BeamHatch::of(table, job.ebm.layer.0, focus, r)
        .map_err(|e| table.focus.problem(format!("hatch.focus: {e}")))?;
    let modulation = match *table.strategy {
        HatchStrategy::Modulated => job.modulation.clone().or_defaults(r),
        _ => job.modulation.value.clone(),
    };
    hatch.law = modulation.map(|table| law(&table, hatch.plan.energy()));
    Ok(Some(hatch))
}

fn cut(job: &EbmJob, material: &Material, r: &mut Provenance) -> Cut {
    let table = &job.section;
    let scaling = table.scaling.or_computed(r, material.scaling.map(Ratio));
    Cut {
        height: table.height.map(|h| h.0),
        island: Some(*table.island),
        scaling: scaling.map(|s| s.0),
        layer: job.ebm.layer.0,
        layers: *job.ebm.layers,
    }
}

/// Warns where the window is the thesis' and the metal is not.
fn warn_of_window(job: &EbmJob, window: &Good, material: &Material, reporter: &Reporter) {
    let other = *job.ebm.material != MATERIAL_OF_WINDOW;
    if other && matches!(window, Good::Limits { written: false, .. }) {
        reporter.warn(
            "window-of-another-material",
            format!(
                "the window of good temperatures, {} to {}, is that of Ti6Al4V in Béraud 2016; the material is {}",
                *job.window.low, *job.window.high, material.name
            ),
            "give the path of a body that you know to be good as window.good, its size as window.body, or both limits",
        );
    }
}

/// What the build plane sees.
fn surface(job: &EbmJob) -> Surface {
    let surroundings = job.ebm.shield.0;
    match *job.ebm.evaporation {
        Vapour::Free => Surface::Evaporating {
            surroundings,
            ambient: job.ebm.chamber.0,
        },
        Vapour::None => Surface::Radiating { surroundings },
    }
}

fn judge(
    table: &JudgeTable,
    ebm: &EbmTable,
    material: &Material,
    r: &mut Provenance,
) -> Result<Option<Judge>, Problem> {
    match *table.solver {
        JudgeSolver::None => return Ok(None),
        JudgeSolver::Reference => {}
    }
    let place = |p: &Point| ([p[0].0, p[1].0], p.get(2).map(|z| z.0));
    Ok(Some(Judge {
        places: table.places.iter().map(place).collect(),
        every: table.every.0,
        part: table.part.map(|corners| {
            let [low, high] = corners.map(|corner| corner.map(|v| v.0));
            Rectangle { low, high }
        }),
        beyond: table.beyond.0,
        depth: table.depth.or_computed(r, Length(0.5 * ebm.layer.0)).0,
        resolution: Resolution {
            cell: table.cell.0,
            planes: *table.planes,
            step: table.step.0,
            domain: Domain::NARROW,
            power: 1.0,
        },
        ground: *table.ground,
        plate: table.plate.0,
        between: between(table, *ebm.layers, material, r)?,
    }))
}

/// What happens from layer to layer; what does not is not recorded.
fn between(
    table: &JudgeTable,
    layers: u32,
    material: &Material,
    r: &mut Provenance,
) -> Result<Option<Between>, Problem> {
    if layers == 1 || *table.memory == LayerMemory::Metal {
        for name in [&table.between.name, &table.powder.name] {
            r.parameters.remove(name);
        }
        if layers == 1 {
            r.parameters.remove(&table.memory.name);
        }
        return Ok(None);
    }
    let powder = table.powder.or_computed(r, Temperature(material.start)).0;
    let lowest = material.start - BELOW;
    if !(lowest..material.solidus).contains(&powder) {
        let message = format!(
            "judge.powder is {}: the solver knows {} from {} to below its solidus, {}",
            Temperature(powder),
            material.name,
            Temperature(lowest),
            Temperature(material.solidus)
        );
        let help = "leave it out: powder is preheated to the start temperature before it melts";
        return Err(table.powder.problem(message).help(help));
    }
    Ok(Some(Between {
        time: table.between.0,
        powder,
    }))
}

/// The material.
fn material(job: &EbmJob, folder: &Path, r: &mut Provenance) -> Result<Loaded, Vec<Problem>> {
    let ebm = &job.ebm;
    let readings = Readings {
        porosity: *ebm.porosity,
        density: *ebm.density,
        powder: *ebm.powder_conductivity,
        ..Readings::default()
    };
    let mut loaded = load(&ebm.material, readings, folder).map_err(|e| e.at(&ebm.material))?;
    loaded.tell(r);
    let metal = &mut loaded.material;
    let bed = ebm.preheat.or_computed(r, Temperature(metal.start)).0;
    if !(metal.range[0]..metal.solidus).contains(&bed) {
        let message = format!(
            "the bed is at {}; the laws of {} hold from {}, and it melts from {}",
            Temperature(bed),
            metal.name,
            Temperature(metal.range[0]),
            Temperature(metal.solidus)
        );
        let help =
            "give a temperature between these, or a material file of your own whose laws reach it";
        return Err(vec![ebm.preheat.problem(message).help(help)]);
    }
    metal.start = bed;
    Ok(loaded)
}

/// Spot against focus current.
fn focus_of(
    job: &EbmJob,
    folder: &Path,
    r: &mut Provenance,
) -> Result<FocusCalibration, Vec<Problem>> {
    let ebm = &job.ebm;
    if let Some(d) = *ebm.diameter {
        r.parameters.remove(&ebm.focus.name);
        return Ok(FocusCalibration::constant(d.0));
    }
    let (focus, source) = focus::load(&ebm.focus, folder).map_err(|e| e.at(&ebm.focus))?;
    r.model("focus calibration", &source);
    Ok(focus)
}

/// What places the window: what does not is not recorded.
fn window(job: &EbmJob, folder: &Path, r: &mut Provenance) -> Good {
    let w = &job.window;
    let width = w.width.0;
    let placed = match (&*w.good, &*w.body) {
        (Some(file), _) => Good::Path {
            file: folder.join(&**file),
            width,
        },
        (None, Some(body)) if job.hatch.is_some() => Good::Body {
            size: body.map(|edge| edge.0),
            width,
        },
        _ => {
            r.parameters.remove(&w.width.name);
            return Good::Limits {
                kelvin: [w.low.0, w.high.0],
                model: *w.model,
                written: w.low.is_written() || w.high.is_written(),
            };
        }
    };
    for name in [&w.low.name, &w.high.name, &w.model.name] {
        r.parameters.remove(name);
    }
    placed
}
