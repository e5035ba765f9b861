//! Every value of an electron-beam job resolved: what was written, and the stated defaults.

use std::path::{Path, PathBuf};

use meltpath_base::{Observer, Provenance, Reporter, Warning};
use meltpath_gun::Gun;
use meltpath_gun::focus::FocusCalibration;
use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::charts::simulation;
use meltpath_thermal::material::file::Readings;
use meltpath_thermal::material::medium::Body;
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::source::Depth;

use super::drawing::{Drawing, DrawnPart};
use super::hatch::Hatch;
use super::optimise::Optimise;
use super::region::{Below, Contour};
use super::{focus, path_file};
use crate::job::TextError;
use crate::job::ebm::{ChartMemory, EbmJob};
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

pub(super) fn at(span: std::ops::Range<usize>, message: &impl ToString) -> TextError {
    TextError {
        span: Some(span),
        message: message.to_string(),
        help: None,
    }
}

fn named(value: &impl std::fmt::Debug) -> String {
    format!("{value:?}").to_lowercase()
}

/// Reads a beam path and the gun that drew it: its file, the path, the gun at the settings with which the beam first is on.
pub(super) fn beam_path(
    folder: &Path,
    name: &toml::Spanned<String>,
    focus: &FocusCalibration,
) -> Result<(PathBuf, BeamPath, Gun), TextError> {
    let file = folder.join(name.get_ref());
    let shown = |what: String| at(name.span(), &format!("{}: {what}", file.display()));
    let record = path_file::read(&file).map_err(|e| shown(e.to_string()))?;
    let heats = record.rows().windows(2).find(|w| {
        let power = w[0].voltage * w[0].current;
        w[0].on && power > 0.0 && w[1].time > w[0].time
    });
    let Some(first) = heats.map(|w| w[0]) else {
        return Err(shown("the beam is never on".to_owned()));
    };
    let motion = record.motion(focus).map_err(|e| shown(e.to_string()))?;
    let path = BeamPath::of(&[motion]).map_err(|e| shown(e.to_string()))?;
    let gun = Gun {
        voltage: first.voltage,
        focus: focus.clone(),
        coil: first.focus,
    };
    Ok((file, path, gun))
}

/// Resolves a job whose file lies in `folder`.
///
/// # Errors
/// [`TextError`] with the place in the job where one value is to blame.
pub fn resolve(
    job: &EbmJob,
    folder: &Path,
    observer: &dyn Observer,
) -> Result<Settings, TextError> {
    let mut r = Provenance::new();
    let (loaded, (beam, focus), penetration) = process(job, folder, &mut r)?;
    let Loaded {
        material,
        file: material_file,
        ..
    } = loaded;
    let mm = |v: f64| meltpath_base::Length(v);
    let kelvin = |celsius: f64| meltpath_base::Temperature(celsius + CELSIUS);
    let ebm = &job.ebm;
    let layer = r
        .written_or(
            "ebm.layer",
            ebm.layer.map(|l| l.0),
            mm(0.05),
            "step of the table in Béraud 2016",
        )
        .0;
    let layers = r
        .written_or("ebm.layers", ebm.layers, 1, "the path is drawn once")
        .max(1);
    if job.part.is_none() {
        r.written_or("ebm.ground", Some(named(&ebm.ground)), String::new(), "");
    }
    let charts = &job.charts;
    let chart_stop = r.written_or(
        "charts.stop",
        charts.stop,
        kelvin(2800.0),
        "Béraud 2016, section 3.2.2.3",
    );
    let cooling = r.written_or(
        "charts.cooling_from",
        charts.cooling_from,
        kelvin(2800.0),
        "Béraud 2016, section 3.2.2.3",
    );
    let spacing = r.written_or(
        "charts.spacing",
        charts.spacing.map(|s| s.0),
        mm(0.025),
        "converged within 2 °C of mean error",
    );
    r.written_or(
        "charts.memory",
        charts.memory.map(|m| named(&m)),
        named(&ChartMemory::default()),
        "Béraud 2016: a voxel knows its own history only",
    );
    let sim = &job.simulation;
    let voxel = r
        .written_or(
            "simulation.voxel",
            sim.voxel.map(|v| v.0),
            mm(0.057),
            "voxels of the thesis' large cases",
        )
        .0;
    let margin = r
        .written_or(
            "simulation.margin",
            sim.margin.map(|v| v.0),
            mm(0.5),
            "Béraud 2016, section 3.2.2.1",
        )
        .0;
    let step = r
        .written_or(
            "simulation.step",
            sim.step.map(|s| s.0),
            meltpath_base::Time(2.5e-6),
            "melting takes 0.03 ms at 300 W",
        )
        .0;
    let frames = r
        .written_or(
            "simulation.frames",
            sim.frames,
            24,
            "enough to see the beam move",
        )
        .clamp(1, 500);
    let reporter = Reporter::new();
    let drawn = Drawing::of(
        job,
        folder,
        (&material, &focus),
        [f64::from(layers), layer],
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
    let path = paths.pop().ok_or_else(|| TextError {
        span: None,
        message: "there is no layer to draw".to_owned(),
        help: None,
    })?;
    let inside = r
        .written_or(
            "region.inside",
            job.region.inside.map(|i| i.0),
            mm(0.2),
            "rims melt with what lies beside them",
        )
        .0;
    let share = |v: f64| meltpath_base::Ratio(v);
    let in_window = r
        .written_or(
            "checks.in_window",
            job.checks.in_window.map(|v| v.0),
            share(0.5),
            "half of the metal",
        )
        .0;
    let unmelted = r
        .written_or(
            "checks.unmelted",
            job.checks.unmelted.map(|v| v.0),
            share(0.01),
            "powder left inside is a hole",
        )
        .0;
    let optimise = job.optimise.as_ref().map(|o| {
        Optimise::resolve(o, drawn_hatch.as_ref(), &contour.region(), &mut r).map_err(|e| {
            TextError {
                span: None,
                message: format!("optimise.strategies: {e}"),
                help: None,
            }
        })
    });
    let optimise = optimise.transpose()?;
    let judge = judge(job, &mut r);
    let simulation = simulation::Settings {
        step,
        memory: match charts.memory.unwrap_or_default() {
            ChartMemory::None => simulation::Memory::None,
            ChartMemory::Ground => simulation::Memory::Ground(GROUND),
        },
        ..simulation::Settings::of(&material)
    };
    Ok(Settings {
        path_file,
        path,
        lower: paths,
        warnings: reporter.warnings(),
        penetration,
        layer,
        below,
        part,
        chart_files: charts
            .files
            .iter()
            .map(|f| folder.join(f.get_ref()))
            .collect(),
        chart_stop: chart_stop.0,
        chart_cooling_from: cooling.0.min(chart_stop.0),
        chart_spacing: spacing.0,
        voxel,
        margin,
        frames,
        sections: sim.sections.iter().map(|p| p.map(|v| v.0)).collect(),
        simulation,
        contour,
        inside,
        window,
        optimise,
        judge,
        in_window,
        unmelted,
        material,
        material_file,
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
) -> Result<(), TextError> {
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
    Err(TextError {
        span: job.path.as_ref().map(toml::Spanned::span),
        message: format!(
            "{}: the beam is on between {:?} and {:?} mm, and nowhere inside region.contour",
            file.display(),
            ends[0],
            ends[1]
        ),
        help: Some(
            "give both in one frame and in mm, or leave region.contour out: the hull of the path is judged then"
                .to_owned(),
        ),
    })
}

/// Warns where the window is the thesis' and the metal is not.
fn warn_of_window(job: &EbmJob, window: &Window, material: &Material, reporter: &Reporter) {
    let written = job.window.low.is_some() || job.window.high.is_some();
    let own = job.ebm.material.as_ref();
    let other = own.is_some_and(|m| m.get_ref() != THESIS_MATERIAL);
    if other && !written && matches!(window, Window::Fixed(_)) {
        reporter.warn(
            "window-of-another-material",
            format!(
                "the window of good temperatures, 2700 to 2760 °C, is that of Ti6Al4V in Béraud 2016; the material is {}",
                material.name
            ),
            "give the path of a body that you know to be good as window.good, its size as window.body, or both limits",
        );
    }
}

fn judge(job: &EbmJob, r: &mut Provenance) -> Option<Judge> {
    let table = job.judge.as_ref()?;
    r.written_or(
        "judge.solver",
        Some(named(&table.solver)),
        String::new(),
        "",
    );
    let part = table.part.as_ref().map(|p| {
        let [low, high] = p.get_ref().map(|corner| corner.map(|v| v.0));
        Rectangle { low, high }
    });
    let mut length = |name: &str, written: Option<f64>, default: f64, why: &str| {
        r.written_or(
            name,
            written.map(meltpath_base::Length),
            meltpath_base::Length(default),
            why,
        )
        .0
    };
    let beyond = length(
        "judge.beyond",
        table.beyond.map(|b| b.0.0),
        0.75,
        "six lines of the thesis; heat laid further away has left through the ground",
    );
    let cell = length(
        "judge.cell",
        table.cell.map(|c| c.0.0),
        0.0625,
        "half the thesis' distance of lines",
    );
    let planes = r.written_or(
        "judge.planes",
        table.planes.as_ref().map(|p| *p.get_ref()),
        1,
        "a plane a layer",
    );
    let step = r
        .written_or(
            "judge.step",
            table.step.map(|s| s.0),
            meltpath_base::Time(4e-6),
            "a twelfth of a cell at 980 mm/s",
        )
        .0;
    let every = r
        .written_or(
            "judge.every",
            table.every.map(|s| s.0),
            meltpath_base::Time(5e-5),
            "a voxel at 980 mm/s",
        )
        .0;
    let places = table.places.iter().map(|p| {
        let at = |n: usize| p.get_ref().get(n).map(|v| v.0);
        ([0, 1].map(|n| at(n).unwrap_or_default()), at(2))
    });
    Some(Judge {
        places: places.collect(),
        every,
        part,
        beyond,
        resolution: Resolution {
            cell,
            planes,
            step,
            power: 1.0,
        },
    })
}

/// Material, beam with its focus, and its penetration.
fn process(
    job: &EbmJob,
    folder: &Path,
    r: &mut Provenance,
) -> Result<(Loaded, (Beam, FocusCalibration), f64), TextError> {
    let ebm = &job.ebm;
    let name = ebm.material.as_ref().map(|m| m.get_ref().clone());
    let name = r.written_or(
        "ebm.material",
        name,
        THESIS_MATERIAL.to_owned(),
        "the material of Béraud 2016",
    );
    let span = |s: &Option<toml::Spanned<String>>| s.as_ref().map_or(0..0, toml::Spanned::span);
    let readings = Readings {
        porosity: ebm.porosity.unwrap_or_default(),
        density: ebm.density.unwrap_or_default(),
        ..Readings::default()
    };
    r.written_or(
        "ebm.porosity",
        ebm.porosity.map(|p| named(&p)),
        named(&readings.porosity),
        "erratum E1: the printed law is no porosity",
    );
    r.written_or(
        "ebm.density",
        ebm.density.map(|d| named(&d)),
        named(&readings.density),
        "erratum E2: the printed cells are exchanged",
    );
    let loaded = load(&name, readings, folder).map_err(|e| at(span(&ebm.material), &e))?;
    loaded.tell(r);
    let focus = if let Some(d) = ebm.diameter {
        r.written_or("ebm.diameter", Some(d.0), d.0, "");
        FocusCalibration::constant(d.0.0)
    } else {
        let name = ebm.focus.as_ref().map(|f| f.get_ref().clone());
        let name = r.written_or(
            "ebm.focus",
            name,
            "a1-beraud-2016".to_owned(),
            "the machine of Béraud 2016",
        );
        let (focus, source) = focus::builtin(&name).map_err(|e| at(span(&ebm.focus), &e))?;
        r.model("focus calibration", &source);
        focus
    };
    let efficiency = r.written_or(
        "ebm.efficiency",
        ebm.efficiency.map(|e| e.0),
        meltpath_base::Ratio(0.9),
        "Zäh and Lutzmann, quoted in Béraud 2016",
    );
    let penetration = r
        .written_or(
            "ebm.penetration",
            ebm.penetration.map(|p| p.0),
            meltpath_base::Length(0.1),
            "Béraud 2016, eq. 3.2.2",
        )
        .0;
    let beam = Beam {
        efficiency: efficiency.0,
        depth: Depth::Falling { penetration },
    };
    Ok((loaded, (beam, focus), penetration))
}

fn window(
    job: &EbmJob,
    folder: &Path,
    (hatch, focus): (Option<&Hatch>, &FocusCalibration),
    r: &mut Provenance,
) -> Result<Window, TextError> {
    let w = &job.window;
    let good = match (&w.good, &w.body, hatch) {
        (Some(file), _, _) => Some((file.get_ref().clone(), beam_path(folder, file, focus)?.1)),
        (None, Some(body), Some(hatch)) => {
            let size = body.map(|edge| edge.0.0);
            let region = Contour::rectangle(size).region();
            let path = hatch.of_lines().path(&[region], 1, &Reporter::new());
            let path = path.map_err(|e| TextError {
                span: None,
                message: format!("window.body: {e}"),
                help: None,
            })?;
            let name = format!("lines of [hatch] over {} x {} mm", size[0], size[1]);
            Some((name, path))
        }
        _ => None,
    };
    if let Some((name, path)) = good {
        let width = w.width.as_ref().map(|w| w.get_ref().0);
        let width = r.written_or(
            "window.width (K)",
            width,
            60.0,
            "the thesis' window, 2700 to 2760 °C",
        );
        r.written_or("window.good", Some(name), String::new(), "");
        return Ok(Window::Good {
            path: Box::new(path),
            width,
        });
    }
    let kelvin = |celsius: f64| meltpath_base::Temperature(celsius + CELSIUS);
    let why = "Béraud 2016, section 3.3.2.1, on the scale of the thesis' simulator";
    let low = r.written_or("window.low", w.low, kelvin(2700.0), why).0;
    let high = r.written_or("window.high", w.high, kelvin(2760.0), why).0;
    if low >= high {
        return Err(TextError {
            span: None,
            message: "the window's lower limit is not below its upper one (2700 and 2760 °C where not written)".to_owned(),
            help: Some("write both window.low and window.high".to_owned()),
        });
    }
    Ok(Window::Fixed([low, high]))
}
