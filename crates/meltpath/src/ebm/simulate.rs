//! Charts, the chart simulation of a path, the window, better speeds.

use std::fs::File;
use std::io::BufReader;

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::chart::{ChartSet, ChartSettings};
use meltpath_thermal::chart_build::warm_grounds;
use meltpath_thermal::chart_simulation::{ChartSimulation, Memory};
use meltpath_thermal::criteria::{Classes, Tally};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::solver::State;
use meltpath_thermal::{chart_build, chart_file};

use super::judge::{self, Judged};
use super::optimise::{Found, on_charts, on_reference};
use super::region::{Below, Contour};
use super::run::EbmError;
use super::settings::{Settings, Window};
use crate::job::ebm::OptimiseSolver;

/// Temperatures of the build plane at one moment.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Time since the last layer began, s.
    pub time: f64,
    /// Temperatures of the top voxels, K.
    pub now: Vec<f64>,
    /// Highest so far, K.
    pub highest: Vec<f64>,
}

/// A path and what it did.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The path.
    pub path: BeamPath,
    /// The simulation after the last layer.
    pub simulation: ChartSimulation,
    /// Highest temperatures of the last layer, K.
    pub highest: Field,
    /// The judged voxels.
    pub tally: Tally,
    /// Pictures of the last layer.
    pub frames: Vec<Frame>,
}

/// Everything a run finds.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The window.
    pub classes: Classes,
    /// The path as given.
    pub given: Drawn,
    /// The better path, and what charts say of it where they can.
    pub found: Option<Found>,
    /// See `found`.
    pub better: Option<Drawn>,
    /// What the reference solver says, where the job asks for it.
    pub judged: Option<Judged>,
    /// The charts, to be kept.
    pub charts: Vec<ChartSet>,
}

/// Settings of the beam on a path, each once.
fn beam_settings<'a>(paths: impl Iterator<Item = &'a BeamPath>) -> Vec<[f64; 3]> {
    let mut found: Vec<[f64; 3]> = Vec::new();
    for p in paths.flat_map(BeamPath::points).filter(|p| p.on) {
        let setting = [p.voltage, p.current, p.focus];
        if !found.contains(&setting) {
            found.push(setting);
        }
    }
    found
}

/// Charts for every setting: from files where they serve, computed otherwise.
fn charts(
    settings: &Settings,
    paths: &[&BeamPath],
    observer: &dyn Observer,
) -> Result<Vec<ChartSet>, EbmError> {
    let mut known = Vec::new();
    for file in &settings.chart_files {
        let shown = |message: String| EbmError::Charts {
            path: file.clone(),
            message,
        };
        let reader = File::open(file).map_err(|e| shown(e.to_string()))?;
        let set =
            chart_file::read(&mut BufReader::new(reader)).map_err(|e| shown(e.to_string()))?;
        known.push(set);
    }
    let material = &settings.material;
    let remember = settings.simulation.memory != Memory::None;
    let mut sets: Vec<ChartSet> = Vec::new();
    for [voltage, current, focus] in beam_settings(paths.iter().copied()) {
        let serves = |s: &&ChartSet| s.settings.serves(voltage, current, focus);
        let mut set = if let Some(set) = known.iter().find(serves) {
            set.clone()
        } else {
            let diameter = settings.beam.focus.diameter(focus)?;
            let wanted = ChartSettings {
                efficiency: settings.beam.efficiency,
                depth: settings.beam.depth,
                layer: settings.layer,
                stop: settings.chart_stop,
                cooling_from: settings.chart_cooling_from,
                cell: settings.chart_spacing,
                reach: 3.5 * settings.penetration,
                ..ChartSettings::of_thesis(voltage, current, focus, diameter)
            };
            chart_build::compute(&wanted, material, observer)?
        };
        if remember && set.warm.is_empty() {
            chart_build::warm(&mut set, &warm_grounds(material), material, observer)?;
        }
        sets.push(set);
    }
    Ok(sets)
}

/// Voxels round paths, fresh powder on what lies below.
fn start<'a>(
    settings: &Settings,
    paths: impl Iterator<Item = &'a BeamPath>,
    below: &Below,
    sets: Vec<ChartSet>,
) -> Result<ChartSimulation, EbmError> {
    let mut low = DVec3::new(f64::INFINITY, f64::INFINITY, 0.0);
    let mut high = DVec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0);
    for p in paths.flat_map(BeamPath::points) {
        low = low.min(DVec3::new(p.x, p.y, 0.0));
        high = high.max(DVec3::new(p.x, p.y, 0.0));
    }
    let margin = DVec3::new(settings.margin, settings.margin, 0.0);
    let depth = DVec3::new(0.0, 0.0, 3.5 * settings.penetration);
    let edge = DVec3::new(settings.voxel, settings.voxel, settings.layer);
    let grid = Grid::covering(low - margin - depth, high + margin, edge)
        .map_err(meltpath_thermal::chart_simulation::ChartSimulationError::from)?;
    let mut simulation =
        ChartSimulation::new(&grid, settings.material.clone(), sets, settings.simulation)?;
    simulation.set_state(|c| {
        if c.z > -settings.layer || !below.is_metal([c.x, c.y]) {
            State::Powder
        } else {
            State::Dense
        }
    });
    Ok(simulation)
}

/// Draws all layers but the last one: what the last one starts from.
fn before_last_layer(
    settings: &Settings,
    lower: &[BeamPath],
    last: &BeamPath,
    below: &Below,
    sets: Vec<ChartSet>,
    observer: &dyn Observer,
) -> Result<ChartSimulation, EbmError> {
    let mut simulation = start(settings, lower.iter().chain([last]), below, sets)?;
    for path in lower {
        simulation.draw(path, &[], &mut |_, _| (), observer)?;
        simulation.add_layer();
    }
    Ok(simulation)
}

/// The judged voxels: of the top plane, inside the contour.
pub(super) fn tally(highest: &Field, classes: &Classes, contour: &Contour, inside: f64) -> Tally {
    judge::tally(highest, classes, contour, inside, None)
}

fn draw_last(
    mut simulation: ChartSimulation,
    path: &BeamPath,
    settings: &Settings,
    classes: &Classes,
    observer: &dyn Observer,
) -> Result<Drawn, EbmError> {
    let duration = path.end() - path.begin();
    let at: Vec<f64> = (1..=settings.frames)
        .map(|n| path.begin() + duration * f64::from(n) / f64::from(settings.frames))
        .collect();
    let mut frames = Vec::new();
    let begin = path.begin();
    let mut look = |time: f64, s: &ChartSimulation| {
        frames.push(Frame {
            time: time - begin,
            now: top(&s.temperature()),
            highest: top(&s.highest_temperature()),
        });
    };
    simulation.draw(path, &at, &mut look, observer)?;
    let highest = simulation.highest_temperature();
    Ok(Drawn {
        path: path.clone(),
        tally: tally(&highest, classes, &settings.contour, settings.inside),
        simulation,
        highest,
        frames,
    })
}

/// The top plane of a field.
pub(super) fn top(field: &Field) -> Vec<f64> {
    let plane = field.grid.cells[0] * field.grid.cells[1];
    field.values[field.values.len() - plane..]
        .iter()
        .map(|v| f64::from(*v))
        .collect()
}

/// The window: as written, or round what the middle of a good body reaches.
fn classes(
    settings: &Settings,
    sets: &[ChartSet],
    observer: &dyn Observer,
) -> Result<Classes, EbmError> {
    let melting = settings.material.liquidus;
    match &settings.window {
        Window::Fixed(window) => Ok(Classes {
            melting,
            window: *window,
        }),
        Window::Good { path, width } => {
            let mut simulation = before_last_layer(
                settings,
                &vec![path.as_ref().clone(); settings.lower.len()],
                path,
                &settings.below_good(),
                sets.to_vec(),
                observer,
            )?;
            simulation.draw(path, &[], &mut |_, _| (), observer)?;
            let highest = simulation.highest_temperature();
            let centre = centre_of_good(&highest, path, melting)?;
            Ok(Classes::calibrated(melting, centre, *width))
        }
    }
}

/// Mean highest temperature in the middle of a body known to be good, K.
pub(super) fn centre_of_good(
    highest: &Field,
    path: &BeamPath,
    melting: f64,
) -> Result<f64, EbmError> {
    let points: Vec<[f64; 2]> = path.points().iter().map(|p| [p.x, p.y]).collect();
    let hull = Contour::hull(&points);
    let deepest = points_inside(highest, &hull);
    let any = Classes {
        melting,
        window: [melting, f64::INFINITY],
    };
    let middle = tally(highest, &any, &hull, 0.7 * deepest);
    if middle.molten() == 0 {
        return Err(EbmError::GoodBody);
    }
    Ok(middle.mean)
}

/// How far inside the hull the innermost voxel lies, mm.
fn points_inside(field: &Field, hull: &Contour) -> f64 {
    let grid = &field.grid;
    let [nx, ny] = grid.cells;
    (0..nx * ny)
        .map(|n| {
            let c = grid.centre(n % nx, n / nx, 0);
            hull.depth([c.x, c.y])
        })
        .fold(0.0, f64::max)
}

/// Simulates the job, and changes the speeds where it says so.
///
/// # Errors
/// [`EbmError`].
pub fn simulate(
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Outcome, EbmError> {
    let mut paths: Vec<&BeamPath> = settings.lower.iter().chain([&settings.path]).collect();
    if let Window::Good { path, .. } = &settings.window {
        paths.push(path);
    }
    let sets = charts(settings, &paths, observer)?;
    let classes = classes(settings, &sets, observer)?;
    let ready = before_last_layer(
        settings,
        &settings.lower,
        &settings.path,
        &settings.below,
        sets.clone(),
        observer,
    )?;
    let given = draw_last(ready.clone(), &settings.path, settings, &classes, observer)?;
    given.simulation.tell(reporter);
    let found = match &settings.optimise {
        Some(how) if how.solver == OptimiseSolver::Reference => {
            Some(on_reference(settings, how, observer)?)
        }
        Some(how) => Some(on_charts(settings, how, &ready, &classes, observer)?),
        None => None,
    };
    let served = |path: &BeamPath| {
        let known = |[voltage, current, focus]: [f64; 3]| {
            let serves = |s: &ChartSet| s.settings.serves(voltage, current, focus);
            sets.iter().any(serves)
        };
        beam_settings([path].into_iter()).into_iter().all(known)
    };
    let better = match &found {
        // charts know nothing of other currents and focus currents
        Some(found) if served(&found.path) => Some(draw_last(
            ready.clone(),
            &found.path,
            settings,
            &classes,
            observer,
        )?),
        _ => None,
    };
    let judged = match &settings.judge {
        Some(judging) => {
            let better = found.as_ref().map(|f| (&f.path, better.as_ref()));
            let verdict =
                judge::judge_paths(settings, judging, &classes, &given, better, observer)?;
            Some(verdict)
        }
        None => None,
    };
    let paths_judged = judged
        .iter()
        .flat_map(|j| [Some(&j.given), j.better.as_ref()]);
    judge::tell_outside(paths_judged.flatten(), reporter);
    let looked_at = found.iter().filter_map(|f| f.reference.as_ref());
    let looked_at = looked_at.flat_map(|r| [&r.given.0, &r.better.0]);
    let paths = judged
        .iter()
        .flat_map(|j| [Some(&j.given), j.better.as_ref()]);
    let fields = looked_at.chain(paths.flatten().map(|p| &p.highest));
    judge::tell(fields, &settings.material, reporter);
    Ok(Outcome {
        classes,
        given,
        found,
        better,
        judged,
        charts: sets,
    })
}

/// Draws the paths of all layers again with charts and looks at each at its `times`, in order; layers count from 0, times are
/// those of the layer's path.
pub(crate) fn look_at(
    settings: &Settings,
    times: &[Vec<f64>],
    look: &mut dyn FnMut(usize, &ChartSimulation),
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(), EbmError> {
    let paths: Vec<&BeamPath> = settings.lower.iter().chain([&settings.path]).collect();
    let sets = charts(settings, &paths, observer)?;
    let mut simulation = start(settings, paths.iter().copied(), &settings.below, sets)?;
    for (layer, (path, times)) in paths.into_iter().zip(times).enumerate() {
        if layer > 0 {
            simulation.add_layer();
        }
        simulation.draw(path, times, &mut |_, s| look(layer, s), observer)?;
    }
    simulation.tell(reporter);
    Ok(())
}
