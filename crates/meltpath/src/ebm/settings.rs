//! Every value of an electron-beam job resolved: what was written, and the stated defaults.

use std::path::{Path, PathBuf};

use meltpath_base::settings::Problem;
use meltpath_base::{Observer, Provenance, Reporter, Warning};
use meltpath_gun::Gun;
use meltpath_gun::focus::FocusCalibration;
use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::charts::simulation;
use meltpath_thermal::material::Material;
use meltpath_thermal::material::file::Readings;
use meltpath_thermal::material::medium::Body;
use meltpath_thermal::solver::source::Depth;

use super::drawing::{Drawing, DrawnPart};
use super::hatch::Hatch;
use super::optimise::Optimise;
use super::region::{Below, Contour};
use super::{focus, path_file};
use crate::job::Written;
use crate::job::ebm::{ChartMemory, EbmJob, JudgeTable, Point};
use crate::material::{Loaded, load};

/// Places of a line that are looked at.
const STRETCHES: u32 = 64;

/// The material of Béraud 2016.
const THESIS_MATERIAL: &str = "ti6al4v-ebm";

/// What remembers earlier lines: the thesis' domain, at the start temperature half a millimetre below the build plane, as the
/// reference solver that judges has it.
const GROUND: Body = Body::Cooled { thickness: 0.5 };

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

/// How the path is judged on the reference solver.
#[derive(Debug, Clone, PartialEq)]
pub struct Judge {
    /// What is judged; the whole path where absent.
    pub part: Option<Rectangle>,
    /// How far beyond it the path is drawn, mm.
    pub beyond: f64,
    /// Cells and steps.
    pub resolution: Resolution,
    /// Places whose temperature is kept in time, mm; without z on the build plane.
    pub places: Vec<([f64; 2], Option<f64>)>,
    /// Time between two of these temperatures, s.
    pub every: f64,
}

/// A job with every value resolved.
#[derive(Debug, Clone)]
pub struct Settings {
    /// File of the beam path, where it comes from one.
    pub path_file: Option<PathBuf>,
    /// The beam path of the last layer.
    pub path: BeamPath,
    /// The paths of the layers below it, lowest first.
    pub lower: Vec<BeamPath>,
    /// What planning said of the hatch.
    pub warnings: Vec<Warning>,
    /// The material.
    pub material: Material,
    /// Its file, where it is not one that ships.
    pub material_file: Option<PathBuf>,
    /// The gun.
    pub gun: Gun,
    /// Beam to heat.
    pub beam: Beam,
    /// Penetration of the beam, mm.
    pub penetration: f64,
    /// Layer thickness, mm.
    pub layer: f64,
    /// What lies below the first layer.
    pub below: Below,
    /// The part it is a section of.
    pub part: Option<DrawnPart>,
    /// Chart files.
    pub chart_files: Vec<PathBuf>,
    /// Heating of charts stops, cooling begins, K; spacing, mm.
    pub chart_stop: f64,
    /// See `chart_stop`.
    pub chart_cooling_from: f64,
    /// See `chart_stop`.
    pub chart_spacing: f64,
    /// Edge of a voxel, mm.
    pub voxel: f64,
    /// Powder beyond the path, mm.
    pub margin: f64,
    /// Pictures in time.
    pub frames: u32,
    /// Places of sections, mm.
    pub sections: Vec<[f64; 2]>,
    /// How the simulation is carried out.
    pub simulation: simulation::Settings,
    /// The contour.
    pub contour: Contour,
    /// How far inside it voxels are judged, mm.
    pub inside: f64,
    /// The window.
    pub window: Window,
    /// Whether and how speeds are changed.
    pub optimise: Option<Optimise>,
    /// Whether and how the reference solver judges.
    pub judge: Option<Judge>,
    /// Least share in the window.
    pub in_window: f64,
    /// Greatest share that stays powder.
    pub unmelted: f64,
    /// Every value with its origin.
    pub provenance: Provenance,
}

impl Settings {
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

/// Resolves a job whose file lies in `folder`.
///
/// # Errors
/// [`Problem`] with the place in the job where one value is to blame.
pub fn resolve(
    job: &Written<EbmJob>,
    folder: &Path,
    observer: &dyn Observer,
) -> Result<Settings, Problem> {
    let mut r = job.provenance.clone();
    let (loaded, beam, focus) = process(job, folder, &mut r)?;
    let material = loaded.material;
    let reporter = Reporter::new();
    let drawn = Drawing::of(
        job,
        folder,
        (&material, &focus),
        (&reporter, observer),
        &mut r,
    )?;
    if let (Some(file), Some(path)) = (&drawn.path_file, drawn.paths.last()) {
        check_inside(path, file, &drawn.contour, job)?;
    }
    let window = window(job, folder, (drawn.hatch.as_ref(), &focus), &mut r)?;
    warn_of_window(job, &window, &material, &reporter);
    let Drawing {
        path_file,
        mut paths,
        contour,
        hatch: drawn_hatch,
        gun,
        below,
        part,
    } = drawn;
    let path = paths
        .pop()
        .ok_or_else(|| Problem::new("there is no layer to draw"))?;
    let optimise = job.optimise.as_ref().map(|o| {
        Optimise::resolve(o, drawn_hatch.as_ref(), &contour.region(), &mut r)
            .map_err(|e| o.strategies.problem(format!("optimise.strategies: {e}")))
    });
    let (charts, sim) = (&job.charts, &job.simulation);
    Ok(Settings {
        path_file,
        path,
        lower: paths,
        warnings: reporter.warnings(),
        penetration: job.ebm.penetration.0,
        layer: job.ebm.layer.0,
        below,
        part,
        chart_files: charts.files.iter().map(|f| folder.join(&**f)).collect(),
        chart_stop: charts.stop.0,
        chart_cooling_from: charts.cooling_from.0.min(charts.stop.0),
        chart_spacing: charts.spacing.0,
        voxel: sim.voxel.0,
        margin: sim.margin.0,
        frames: *sim.frames,
        sections: sim.sections.iter().map(|p| p.map(|v| v.0)).collect(),
        simulation: simulation::Settings {
            step: sim.step.0,
            memory: match *charts.memory {
                ChartMemory::None => simulation::Memory::None,
                ChartMemory::Ground => simulation::Memory::Ground(GROUND),
            },
            ..simulation::Settings::of(&material)
        },
        contour,
        inside: job.region.inside.0,
        window,
        optimise: optimise.transpose()?,
        judge: job.judge.as_ref().map(judge),
        in_window: job.checks.in_window.0,
        unmelted: job.checks.unmelted.0,
        material,
        material_file: loaded.file,
        gun,
        beam,
        provenance: r,
    })
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
    let message = format!(
        "{}: the beam is on between {:?} and {:?} mm, and nowhere inside region.contour",
        file.display(),
        ends[0],
        ends[1]
    );
    let help = "give both in one frame and in mm, or leave region.contour out: the hull of the path is judged then";
    Err(job.path.problem(message).help(help))
}

/// Warns where the window is the thesis' and the metal is not.
fn warn_of_window(job: &EbmJob, window: &Window, material: &Material, reporter: &Reporter) {
    let written = job.window.low.is_written() || job.window.high.is_written();
    let other = *job.ebm.material != THESIS_MATERIAL;
    if other && !written && matches!(window, Window::Fixed(_)) {
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

fn judge(table: &JudgeTable) -> Judge {
    let place = |p: &Point| ([p[0].0, p[1].0], p.get(2).map(|z| z.0));
    Judge {
        places: table.places.iter().map(place).collect(),
        every: table.every.0,
        part: table.part.map(|corners| {
            let [low, high] = corners.map(|corner| corner.map(|v| v.0));
            Rectangle { low, high }
        }),
        beyond: table.beyond.0,
        resolution: Resolution {
            cell: table.cell.0,
            planes: *table.planes,
            step: table.step.0,
            power: 1.0,
        },
    }
}

/// Material, beam and its focus.
fn process(
    job: &EbmJob,
    folder: &Path,
    r: &mut Provenance,
) -> Result<(Loaded, Beam, FocusCalibration), Problem> {
    let ebm = &job.ebm;
    let readings = Readings {
        porosity: *ebm.porosity,
        density: *ebm.density,
        ..Readings::default()
    };
    let loaded =
        load(&ebm.material, readings, folder).map_err(|e| ebm.material.problem(e.to_string()))?;
    loaded.tell(r);
    let focus = if let Some(d) = *ebm.diameter {
        r.parameters.remove(&ebm.focus.name);
        FocusCalibration::constant(d.0)
    } else {
        let (focus, source) =
            focus::builtin(&ebm.focus).map_err(|e| ebm.focus.problem(e.to_string()))?;
        r.model("focus calibration", &source);
        focus
    };
    let beam = Beam {
        efficiency: ebm.efficiency.0,
        depth: Depth::Falling {
            penetration: ebm.penetration.0,
        },
    };
    Ok((loaded, beam, focus))
}

/// Where the window lies: what does not place it is not recorded.
fn window(
    job: &EbmJob,
    folder: &Path,
    (hatch, focus): (Option<&Hatch>, &FocusCalibration),
    r: &mut Provenance,
) -> Result<Window, Problem> {
    let w = &job.window;
    let path = match (&*w.good, &*w.body, hatch) {
        (Some(file), _, _) => path_file::beam_path(&folder.join(&**file), &w.good, focus)?.0,
        (None, Some(body), Some(hatch)) => {
            let region = Contour::rectangle(body.map(|edge| edge.0)).region();
            let path = hatch.of_lines().path(&[region], 1, &Reporter::new());
            path.map_err(|e| w.body.problem(format!("window.body: {e}")))?
        }
        _ => {
            r.parameters.remove(&w.width.name);
            return Ok(Window::Fixed([w.low.0, w.high.0]));
        }
    };
    r.parameters.remove(&w.low.name);
    r.parameters.remove(&w.high.name);
    Ok(Window::Good {
        path: Box::new(path),
        width: w.width.0,
    })
}
