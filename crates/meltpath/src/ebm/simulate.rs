//! Charts, the chart simulation of a path, the window, better speeds.

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::ChartSet;
use meltpath_thermal::charts::simulation::{ChartSimulation, ChartSimulationError};
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::solver::State;

use super::correct::stages::{Corrected, corrected};
use super::cost::{drawing, extent};
use super::error::EbmError;
use super::gun::drawn::{self as at_gun, AtGun};
use super::judge::{self, Judged, JudgedPath, Previewed, of_all};
use super::optimise::Optimise;
use super::optimise::on_judge::on_judge;
use super::optimise::search::{Found, on_charts, on_reference};
use super::plan::{Plan, Window};
use super::rounds::merit;
use super::settings::Settings;
use crate::ebm::judge::{ends, shape};
use crate::ebm::plan::region::{Below, Contour};
use crate::ebm::preview::charts::{Charts, charts_of};
use crate::ebm::preview::drawn::Drawn;
use crate::ebm::preview::film::{self, Film};
use crate::job::ebm::{Change, ChartPreview, OptimiseSolver};

/// Everything a run finds.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// What charts show, where they draw.
    pub preview: Option<Preview>,
    /// The better path, where one is looked for.
    pub found: Option<Found>,
    /// The path with corrected currents, where the job asks for it.
    pub corrected: Option<Corrected>,
    /// What the reference solver says, where the job asks for it.
    pub judged: Option<Judged>,
    /// What the gun makes of the path, where the job names one.
    pub gun: Option<AtGun>,
    /// Whether the changed path is worse on the judge's own cells than the given one, which is handed back then.
    pub withdrawn: bool,
}

impl Outcome {
    /// The path that the run judges: the better one where there is one.
    pub fn path<'a>(&'a self, plan: &'a Plan) -> &'a BeamPath {
        if self.withdrawn {
            return &plan.path;
        }
        changed(self.found.as_ref(), self.corrected.as_ref()).unwrap_or(&plan.path)
    }
}

/// The path that takes the place of the given one, where there is one.
fn changed<'a>(found: Option<&'a Found>, corrected: Option<&'a Corrected>) -> Option<&'a BeamPath> {
    corrected.map(|c| &c.path).or(found.map(|f| &f.path))
}

/// What charts show.
#[derive(Debug, Clone)]
pub struct Preview {
    /// The window.
    pub classes: Classes,
    /// The path as given.
    pub given: Drawn,
    /// The better path, where charts can draw it.
    pub better: Option<Drawn>,
    /// The charts, to be kept.
    pub charts: Vec<ChartSet>,
}

impl Preview {
    /// The last drawing.
    pub fn shown(&self) -> &Drawn {
        self.better.as_ref().unwrap_or(&self.given)
    }
}

/// Voxels round paths, fresh powder on what lies below.
fn start<'a>(
    settings: &Settings,
    paths: impl Iterator<Item = &'a BeamPath>,
    below: &Below,
    charts: &Charts,
) -> Result<ChartSimulation, EbmError> {
    let [low, high] = extent(settings, paths);
    let edge = DVec3::new(
        settings.job.simulation.voxel.0,
        settings.job.simulation.voxel.0,
        settings.job.ebm.layer.0,
    );
    let grid = Grid::covering(low, high, edge).map_err(ChartSimulationError::from)?;
    let mut simulation = charts.simulation(&grid, settings)?;
    simulation.set_state(|c| {
        if c.z > -settings.job.ebm.layer.0 || !below.is_metal([c.x, c.y]) {
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
    charts: &Charts,
    observer: &dyn Observer,
) -> Result<ChartSimulation, EbmError> {
    let mut simulation = start(settings, lower.iter().chain([last]), below, charts)?;
    for path in lower {
        simulation.draw(path, &[], &mut |_, _| (), observer)?;
        simulation.add_layer();
    }
    Ok(simulation)
}

/// The judged voxels: of the top plane, inside the contour.
pub(crate) fn tally(highest: &Field, classes: &Classes, contour: &Contour, inside: f64) -> Tally {
    judge::tally(highest, classes, contour, inside, None)
}

fn draw_last(
    mut simulation: ChartSimulation,
    path: &BeamPath,
    plan: &Plan,
    classes: &Classes,
    observer: &dyn Observer,
) -> Result<Drawn, EbmError> {
    let settings = &plan.settings;
    let duration = path.end() - path.begin();
    let at: Vec<f64> = (1..=*settings.job.simulation.frames)
        .map(|n| {
            path.begin() + duration * f64::from(n) / f64::from(*settings.job.simulation.frames)
        })
        .collect();
    let frames = *settings.job.simulation.frames as usize;
    let mut film = Film::new(simulation.grid(), frames, &film::places(plan));
    let begin = path.begin();
    let mut look = |time: f64, s: &ChartSimulation| film.take(time - begin, s);
    simulation.draw(path, &at, &mut look, observer)?;
    let highest = simulation.highest_temperature();
    Ok(Drawn {
        path: path.clone(),
        tally: tally(
            &highest,
            classes,
            &plan.contour,
            settings.job.region.inside.0,
        ),
        simulation,
        highest,
        film,
    })
}

/// The top plane of a field.
pub(crate) fn top(field: &Field) -> Vec<f64> {
    let plane = field.grid.cells[0] * field.grid.cells[1];
    field.values[field.values.len() - plane..]
        .iter()
        .map(|v| f64::from(*v))
        .collect()
}

/// The window: as written, or round what the middle of a good body reaches.
fn classes(plan: &Plan, charts: &Charts, observer: &dyn Observer) -> Result<Classes, EbmError> {
    let settings = &plan.settings;
    let melting = settings.material.liquidus;
    match &plan.window {
        Window::Fixed(window) => Ok(Classes {
            melting,
            window: *window,
        }),
        Window::Good { path, width } => {
            let mut simulation = before_last_layer(
                settings,
                &vec![path.as_ref().clone(); plan.lower.len()],
                path,
                &plan.below_good(),
                charts,
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
pub(crate) fn centre_of_good(
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

/// Draws the path with charts, looks for a better one where the job says so, and draws that too.
fn previewed(
    plan: &Plan,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(Preview, Option<Found>), EbmError> {
    let settings = &plan.settings;
    let paths = plan.drawn();
    let cost = drawing(plan);
    observer.stage(&cost.words(), 0);
    let charts = charts_of(settings, &paths, reporter, observer)?;
    let classes = classes(plan, &charts, observer)?;
    if let Window::Good { path, .. } = &plan.window {
        ends::tell_of_window(settings, path, classes.window, reporter);
    }
    let ready = before_last_layer(
        settings,
        &plan.lower,
        &plan.path,
        &plan.below,
        &charts,
        observer,
    )?;
    // drawn from again only where a better path is looked for
    let (start, ready) = match &settings.optimise {
        Some(how) => (ready.clone(), Some((how, ready))),
        None => (ready, None),
    };
    let given = draw_last(start, &plan.path, plan, &classes, observer)?;
    given.simulation.tell(reporter);
    let found = match &ready {
        Some((how, ready)) if how.solver == OptimiseSolver::Charts => {
            Some(on_charts(plan, how, ready, &classes, observer)?)
        }
        Some((how, _)) => Some(on_solver(plan, how, observer)?),
        None => None,
    };
    let (better, more) = match (&found, ready) {
        (Some(found), Some((_, ready))) if charts.serve(&found.path) => {
            let drawn = draw_last(ready, &found.path, plan, &classes, observer)?;
            (Some(drawn), Vec::new())
        }
        (Some(found), Some((how, _))) if how.change == Change::Current => {
            let (drawn, sets) = other_powers(plan, found, &classes, reporter, observer)?;
            (Some(drawn), sets)
        }
        // charts know nothing of other spots
        _ => (None, Vec::new()),
    };
    let preview = Preview {
        classes,
        given,
        better,
        charts: charts.own.into_iter().chain(more).collect(),
    };
    Ok((preview, found))
}

/// Looks for a better path on the solver that the job names.
fn on_solver(plan: &Plan, how: &Optimise, observer: &dyn Observer) -> Result<Found, EbmError> {
    match (how.solver, &plan.settings.judge) {
        (OptimiseSolver::Judge, Some(judging)) => on_judge(plan, judging, how, observer),
        // the job's check lets nobody look on the judge's solver where there is none
        _ => on_reference(plan, how, observer),
    }
}

/// Simulates the job, and changes the speeds where it says so.
///
/// # Errors
/// [`EbmError`].
pub fn simulate(
    plan: &Plan,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Outcome, EbmError> {
    let settings = &plan.settings;
    let (preview, found) = match settings.preview {
        ChartPreview::Drawn => {
            let (preview, found) = previewed(plan, reporter, observer)?;
            (Some(preview), found)
        }
        ChartPreview::None => {
            let how = settings.optimise.as_ref();
            let found = how.map(|how| on_solver(plan, how, observer));
            (None, found.transpose()?)
        }
    };
    let corrected = corrections(plan, found.as_ref(), observer)?;
    let changes = changed(found.as_ref(), corrected.as_ref()).filter(|path| **path != plan.path);
    let better = changes.map(|path| Previewed {
        path,
        // charts drew what was found, not what was made of it on the solver
        highest: match corrected {
            Some(_) => None,
            None => preview
                .as_ref()
                .and_then(|p| Some(&p.better.as_ref()?.highest)),
        },
    });
    let mut judged = judged(plan, preview.as_ref(), better, observer)?;
    let withdrawn = !on_another_model(plan, corrected.as_ref())
        && withdrawn(
            plan,
            judged.as_mut(),
            preview.as_ref(),
            (reporter, observer),
        )?;
    if let (Window::Good { path, .. }, None, Some(judged)) = (&plan.window, &preview, &judged) {
        ends::tell_of_window(settings, path, judged.classes.window, reporter);
    }
    if let (Some(judged), Some(how), None) = (&judged, &settings.optimise, &corrected) {
        shape::tell_of_shape(judged, how, reporter);
        shape::tell_of_loss(judged, how, reporter);
    }
    if let (Some(found), Some(how)) = (&found, &settings.optimise) {
        shape::tell_of_bounds(found, how.bounds, reporter);
        if let (Some(drift), Some(round)) = (how.robust, found.rounds.get(found.kept)) {
            shape::tell_of_drift(round, (drift, "optimise.robust"), reporter);
        }
    }
    if let (Some(found), Some(how)) = (&corrected, &settings.correct)
        && let Some(drift) = how.robust
    {
        let round = &found.rounds[found.kept];
        shape::tell_of_drift(round, (drift, "correct.robust"), reporter);
    }
    let paths_judged = judged
        .iter()
        .flat_map(|j| [Some(&j.given), j.better.as_ref()]);
    tell_outside(paths_judged.flatten(), reporter);
    ends::tell(hottest(judged.as_ref(), found.as_ref()), settings, reporter);
    let mut outcome = Outcome {
        gun: None,
        preview,
        found,
        corrected,
        judged,
        withdrawn,
    };
    if let Some(preview) = outcome.preview.as_mut().filter(|_| withdrawn) {
        preview.better = None;
    }
    outcome.gun = at_gun::examined(plan, outcome.path(plan));
    Ok(outcome)
}

/// Whether the changed path is worse on the judge's own cells than the given one, which is then judged in its place. Not asked of a path
/// that the job wants looked for on another model: there a note says so.
fn withdrawn(
    plan: &Plan,
    judged: Option<&mut Judged>,
    preview: Option<&Preview>,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<bool, EbmError> {
    let job = &plan.settings.job;
    let Some(found) = judged else {
        return Ok(false);
    };
    let Some(better) = &found.better else {
        return Ok(false);
    };
    let [before, after] = [&found.given, better].map(|path| {
        let share = of_all(&path.runs[0].tally, Class::Good);
        let shares = [share, path.runs[0].outside.share, share];
        merit(shares, job.checks.outside.0)
    });
    // a path that bears drift may be worse with the power as set, the only one that both were drawn with here: its shape must hold
    let settings = &plan.settings;
    let robust = match (&settings.correct, &settings.optimise) {
        (Some(correct), _) => correct.robust,
        (None, Some(optimise)) => optimise.robust,
        (None, None) => None,
    };
    let kept = match robust {
        Some(_) => after.0 || !before.0,
        None => after >= before,
    };
    if kept {
        return Ok(false);
    }
    shape::tell_withdrawn(&found.given, better, reporter);
    if let Some(given) = self::judged(plan, preview, None, observer)? {
        *found = given;
    }
    Ok(true)
}

/// Whether the job itself says that a path is looked for on another model than the judge's solver, and nothing goes on from there.
fn on_another_model(plan: &Plan, corrected: Option<&Corrected>) -> bool {
    let table = plan.settings.job.optimise.as_ref();
    let written = table.and_then(|table| *table.solver);
    corrected.is_none() && written.is_some_and(|solver| solver != OptimiseSolver::Judge)
}

/// The hottest temperatures on the reference solver, K: of the path that the verdict is of, and of the path as given where that is
/// another. The judge's where it judges, else what a search saw.
fn hottest(judged: Option<&Judged>, found: Option<&Found>) -> Option<(f64, Option<f64>)> {
    if let Some(judged) = judged {
        let given = judged.given.highest.largest().0;
        let better = judged.better.as_ref().map(|p| p.highest.largest().0);
        return Some(better.map_or((given, None), |better| (better, Some(given))));
    }
    let looked_at = found?.reference.as_ref()?;
    let [given, better] = [&looked_at.given.0, &looked_at.better.0].map(|f| f.largest().0);
    Some((better, Some(given)))
}

/// The path with corrected currents, where the job asks for it.
fn corrections(
    plan: &Plan,
    found: Option<&Found>,
    observer: &dyn Observer,
) -> Result<Option<Corrected>, EbmError> {
    let Some((how, judging)) = plan
        .settings
        .correct
        .as_ref()
        .zip(plan.settings.judge.as_ref())
    else {
        return Ok(None);
    };
    let path = found.map_or(&plan.path, |f| &f.path);
    corrected(plan, judging, how, path, observer).map(Some)
}

/// What the solver says of the paths as the gun draws them, where the job asks for it.
fn judged(
    plan: &Plan,
    preview: Option<&Preview>,
    better: Option<Previewed<'_>>,
    observer: &dyn Observer,
) -> Result<Option<Judged>, EbmError> {
    let Some(judging) = &plan.settings.judge else {
        return Ok(None);
    };
    let as_drawn = better.map(|b| at_gun::drawn(plan, b.path)).transpose()?;
    let drawn = at_gun::plan_as_drawn(plan)?;
    let given = Previewed {
        path: &drawn.path,
        highest: preview.map(|p| &p.given.highest),
    };
    let better = better
        .zip(as_drawn.as_ref())
        .map(|(better, path)| Previewed { path, ..better });
    let on_charts = preview.map(|p| &p.classes);
    judge::judge_paths(&drawn, judging, on_charts, given, better, observer).map(Some)
}

/// Warns of places of the job that the judge did not draw.
fn tell_outside<'a>(paths: impl Iterator<Item = &'a JudgedPath>, reporter: &Reporter) {
    let Some(outside) = paths.map(|p| &p.watched.outside).find(|o| !o.is_empty()) else {
        return;
    };
    let places: Vec<String> = outside
        .iter()
        .map(|[x, y, z]| format!("({x}, {y}, {z}) mm"))
        .collect();
    reporter.warn(
        "places-outside",
        format!(
            "judge.places {} lie outside what the reference solver draws: nothing is kept of them",
            places.join(", ")
        ),
        "choose places within 0.5 mm of the path and of the build plane, or a larger judge.part",
    );
}

/// Draws a found path whose powers need charts of their own, which come back too.
fn other_powers(
    plan: &Plan,
    found: &Found,
    classes: &Classes,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(Drawn, Vec<ChartSet>), EbmError> {
    let (settings, lower, path) = (&plan.settings, &plan.lower, &found.path);
    let paths: Vec<&BeamPath> = lower.iter().chain([path]).collect();
    let charts = charts_of(settings, &paths, reporter, observer)?;
    let ready = before_last_layer(settings, lower, path, &plan.below, &charts, observer)?;
    let drawn = draw_last(ready, path, plan, classes, observer)?;
    Ok((drawn, charts.own))
}

/// Draws the paths of all layers again with charts and looks at each at its `times`, in order; layers count from 0, times are
/// those of the layer's path.
pub(crate) fn look_at(
    plan: &Plan,
    times: &[Vec<f64>],
    look: &mut dyn FnMut(usize, &ChartSimulation),
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(), EbmError> {
    let settings = &plan.settings;
    let paths: Vec<&BeamPath> = plan.lower.iter().chain([&plan.path]).collect();
    let charts = charts_of(settings, &paths, reporter, observer)?;
    let mut simulation = start(settings, paths.iter().copied(), &plan.below, &charts)?;
    for (layer, (path, times)) in paths.into_iter().zip(times).enumerate() {
        if layer > 0 {
            simulation.add_layer();
        }
        simulation.draw(path, times, &mut |_, s| look(layer, s), observer)?;
    }
    simulation.tell(reporter);
    Ok(())
}
