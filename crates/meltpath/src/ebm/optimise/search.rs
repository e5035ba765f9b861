//! Looks for a better path on charts or on the reference solver.

use std::time::Instant;

use meltpath_base::Observer;
use meltpath_melt_strategy::bed::{Bed, Domain, Resolution};
use meltpath_melt_strategy::controller::{Accelerator, Controller, Pid, control};
use meltpath_melt_strategy::error::StrategyError;
use meltpath_melt_strategy::learning::{Learned, Learning, learn};
use meltpath_melt_strategy::peaks::{Draw, crossed, with_charts, with_reference};
use meltpath_melt_strategy::prediction::{Prediction, Reference, predict};
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::run::draw as draw_path;

use super::{AHEAD, Optimise, TRIAL_ROUNDS};
use crate::ebm::error::EbmError;
use crate::ebm::judge::under::{body, ground};
use crate::ebm::judge::{centre, middle, tally};
use crate::ebm::plan::{Plan, Window};
use crate::ebm::rounds::Round;
use crate::ebm::settings::Settings;
use crate::job::ebm::OptimiseMethod;

/// What was tried of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Its name.
    pub name: String,
    /// Share in the window as drawn, and after a few rounds.
    pub shares: [f64; 2],
    /// What melts outside the contour of the same two, as shares of the section, where the judge's solver scored them.
    pub outside: Option<[f64; 2]>,
}

/// A better path.
#[derive(Debug, Clone)]
pub struct Found {
    /// The path.
    pub path: BeamPath,
    /// Share in the window of each round, the first as it was.
    pub scores: Vec<f64>,
    /// What was tried before.
    pub trials: Vec<Trial>,
    /// Shares of what is changed that stand at the least and at the greatest factor; nothing of controllers that look as they go.
    pub at_bounds: Option<[f64; 2]>,
    /// What the reference solver says of the given path and of this one, where it was looked for there.
    pub reference: Option<OnReference>,
    /// What every round makes of the whole section, where the judge's solver scored them: the path as given first.
    pub rounds: Vec<Round>,
    /// Which of these is handed back.
    pub kept: usize,
}

/// Shares on the reference solver.
#[derive(Debug, Clone)]
pub struct OnReference {
    /// The window there.
    pub classes: Classes,
    /// Highest temperatures and judged voxels of the path as given.
    pub given: (Field, Tally),
    /// The same of the better path.
    pub better: (Field, Tally),
    /// Longest step, s.
    pub step: f64,
    /// Updates of a cell that one drawing takes.
    pub updates: f64,
}

struct Search<'a> {
    plan: &'a Plan,
    how: &'a Optimise,
    classes: &'a Classes,
    /// Relative change of the factor per relative excess.
    gain: f64,
    /// On this grid only columns that the path crosses teach; all of them where there is none. Charts leave what lies
    /// between lines much colder than the lines.
    lines: Option<&'a Grid>,
}

impl Search<'_> {
    fn share(&self, highest: &Field) -> f64 {
        let plan = self.plan;
        tally(
            highest,
            self.classes,
            &plan.contour,
            plan.settings.job.region.inside.0,
            None,
        )
        .share(Class::Good)
    }

    fn aim(&self) -> f64 {
        0.5 * (self.classes.window[0] + self.classes.window[1])
    }

    fn learned(
        &self,
        draw: &mut Draw<'_>,
        path: &BeamPath,
        rounds: u32,
        first: Option<SpeedProfile>,
        observer: &dyn Observer,
    ) -> Result<Learned, EbmError> {
        let learning = Learning {
            aim: self.aim(),
            rounds,
            gain: self.gain,
            bounds: self.how.bounds,
            length: self.how.piece,
            lever: self.how.lever(&self.plan.gun)?,
            levels: Vec::new(),
            freedom: self.how.freedom(),
        };
        let (plan, s) = (self.plan, &self.plan.settings);
        // a voxel at the border teaches too, so that those just inside are warm from both sides
        let lines = self.lines.map(|grid| (grid, crossed(grid, path)));
        let on_line = |p: [f64; 2]| {
            lines.as_ref().is_none_or(|(grid, crossed)| {
                let [i, j] = [(0, grid.origin.x), (1, grid.origin.y)]
                    .map(|(a, origin)| ((p[a] - origin) / grid.edge[a]) as usize);
                crossed[j * grid.cells[0] + i]
            })
        };
        let judged =
            |p: [f64; 2]| plan.contour.depth(p) > 0.75 * s.job.region.inside.0 && on_line(p);
        let score = |f: &Field| self.share(f);
        let found = learn(
            draw,
            &s.material,
            path,
            &learning,
            first,
            &judged,
            &score,
            observer,
        )?;
        Ok(found)
    }

    /// The best candidate after a few rounds each, and where learning stands with it.
    fn choose(
        &self,
        draw: &mut Draw<'_>,
        observer: &dyn Observer,
    ) -> Result<(BeamPath, Option<SpeedProfile>, Vec<Trial>), EbmError> {
        let candidates = self.how.candidates(&self.plan.path, &self.plan.others)?;
        if candidates.len() == 1 {
            return Ok((self.plan.path.clone(), None, Vec::new()));
        }
        let mut trials = Vec::new();
        let mut best: Option<(f64, BeamPath, SpeedProfile)> = None;
        for (name, path) in candidates {
            let found = self.learned(draw, &path, TRIAL_ROUNDS, None, observer)?;
            let reached = found.scores.iter().copied().fold(0.0, f64::max);
            trials.push(Trial {
                name,
                shares: [found.scores[0], reached],
                outside: None,
            });
            if best.as_ref().is_none_or(|(most, _, _)| reached > *most) {
                best = Some((reached, path, found.profile));
            }
        }
        let best = best.map(|(_, path, profile)| (path, Some(profile)));
        let (path, profile) = best.unwrap_or((self.plan.path.clone(), None));
        Ok((path, profile, trials))
    }
}

/// How drawing ahead chooses, towards `aim`, K.
pub(super) fn prediction(plan: &Plan, how: &Optimise, aim: f64) -> Result<Prediction, EbmError> {
    let speed = fastest(&plan.path).0;
    Ok(Prediction {
        aim,
        bounds: how.bounds,
        length: how.predicted_piece(),
        ahead: AHEAD / speed.max(1.0),
        lever: how.lever(&plan.gun)?,
        levels: Vec::new(),
    })
}

/// Looks for a better path on charts, from the state of `ready`.
///
/// # Errors
/// [`EbmError`].
pub fn on_charts(
    plan: &Plan,
    how: &Optimise,
    ready: &ChartSimulation,
    classes: &Classes,
    observer: &dyn Observer,
) -> Result<Found, EbmError> {
    let settings = &plan.settings;
    let search = Search {
        plan,
        how,
        classes,
        gain: 0.8,
        lines: Some(ready.grid()),
    };
    let mut draw = with_charts(ready);
    let (path, profile, trials) = search.choose(&mut draw, observer)?;
    let first = match how.method {
        OptimiseMethod::Learning => profile,
        OptimiseMethod::Predictive => {
            let material = &settings.material;
            let mut engine = ready.clone();
            let found = predict(
                &mut engine,
                material,
                &path,
                &prediction(plan, how, search.aim())?,
                observer,
            )?;
            Some(found)
        }
        OptimiseMethod::Accelerate | OptimiseMethod::Pid => {
            let mut simulation = ready.clone();
            let mut controller = online(settings, how, search.aim(), &path);
            let found = control(&mut simulation, &path, controller.as_mut(), LOOK, observer)?;
            let before = draw(&path, observer)?;
            let better = found.apply(&path).map_err(StrategyError::from)?;
            return Ok(Found {
                path: better,
                scores: vec![
                    search.share(&before.highest),
                    search.share(&simulation.highest_temperature()),
                ],
                trials,
                at_bounds: None,
                reference: None,
                rounds: Vec::new(),
                kept: 0,
            });
        }
    };
    let found = search.learned(&mut draw, &path, how.rounds, first, observer)?;
    Ok(Found {
        path: found.path,
        scores: found.scores,
        trials,
        at_bounds: Some(found.profile.share_at(how.bounds)),
        reference: None,
        rounds: Vec::new(),
        kept: 0,
    })
}

/// Steps between two looks of a controller.
const LOOK: usize = 4;

fn online(settings: &Settings, how: &Optimise, aim: f64, path: &BeamPath) -> Box<dyn Controller> {
    if how.method == OptimiseMethod::Pid {
        // gains of a first-order pool that answers within a beam diameter, some 0.4 ms
        let ambient = settings.material.start;
        return Box::new(Pid::new(aim, ambient, [2.0, 2e3, 0.0], how.bounds));
    }
    let (speed, diameter) = fastest(path);
    let look = settings.simulation.step * LOOK as f64;
    Box::new(Accelerator::for_beam(aim, diameter, speed, look))
}

/// Looks for a better path on the reference solver; the window is found there too.
///
/// # Errors
/// [`EbmError`].
pub fn on_reference(
    plan: &Plan,
    how: &Optimise,
    observer: &dyn Observer,
) -> Result<Found, EbmError> {
    let settings = &plan.settings;
    let melting = settings.material.liquidus;
    let resolution = Resolution {
        cell: how.cell,
        planes: how.planes,
        step: how.step,
        domain: Domain::NARROW,
        power: 1.0,
    };
    let classes = match &plan.window {
        Window::Fixed(window) => Classes {
            melting,
            window: *window,
        },
        Window::Good { path, width } => {
            let lower = vec![path.as_ref().clone(); plan.lower.len()];
            let below = plan.below_good();
            let ground = ground(&below);
            let bed = body(settings, &ground).bed(&[path], &lower, &resolution, observer);
            let bed = bed.map_err(StrategyError::from)?;
            let drawn = with_reference(&bed.solver, &bed.beam, bed.step, settings.job.ebm.layer.0)(
                path, observer,
            )?;
            // as [judge] reads it, so that both speak of one window
            let (hull, square) = middle(path);
            let centre = centre(&drawn.highest, melting, &hull, &square)?;
            Classes::calibrated(melting, centre, *width)
        }
    };
    let search = Search {
        plan,
        how,
        classes: &classes,
        gain: 0.5,
        lines: None,
    };
    let mut around: Vec<&BeamPath> = plan.others.iter().map(|(_, path)| path).collect();
    around.push(&plan.path);
    let ground = ground(&plan.below);
    let bed = body(settings, &ground).bed(&around, &plan.lower, &resolution, observer);
    let Bed { solver, beam, step } = bed.map_err(StrategyError::from)?;
    let begun = Instant::now();
    let (given, updates) = drawn_as_given(&solver, &beam, step, plan, observer)?;
    let told = Told {
        observer,
        what: how.cost(begun.elapsed()),
    };
    let observer: &dyn Observer = &told;
    let mut draw = with_reference(&solver, &beam, step, settings.job.ebm.layer.0);
    let (path, profile, trials) = search.choose(&mut draw, observer)?;
    let first = if how.method == OptimiseMethod::Predictive {
        let mut engine = Reference {
            solver: solver.clone(),
            beam: &beam,
            step,
        };
        let material = &settings.material;
        Some(predict(
            &mut engine,
            material,
            &path,
            &prediction(plan, how, search.aim())?,
            observer,
        )?)
    } else {
        profile
    };
    let found = search.learned(&mut draw, &path, how.rounds, first, observer)?;
    let judged = |highest: Field| {
        let found = tally(
            &highest,
            &classes,
            &plan.contour,
            settings.job.region.inside.0,
            None,
        );
        (highest, found)
    };
    Ok(Found {
        path: found.path,
        scores: found.scores,
        trials,
        at_bounds: Some(found.profile.share_at(how.bounds)),
        reference: Some(OnReference {
            given: judged(given),
            better: judged(found.highest),
            classes,
            step,
            updates,
        }),
        rounds: Vec::new(),
        kept: 0,
    })
}

/// Highest temperatures of the path as given, and the updates of a cell that drawing it takes.
fn drawn_as_given(
    bed: &Solver<f32>,
    beam: &Beam,
    step: f64,
    plan: &Plan,
    observer: &dyn Observer,
) -> Result<(Field, f64), EbmError> {
    let path = &plan.path;
    let mut solver = bed.clone();
    draw_path(&mut solver, path, beam, step, &mut [], observer).map_err(StrategyError::from)?;
    let updates = solver.updates() - bed.updates();
    let highest = solver.highest_temperature();
    Ok((
        highest.over_layer(plan.settings.job.ebm.layer.0),
        updates as f64,
    ))
}

/// Adds to the name of every stage how long it will take in all.
struct Told<'a> {
    observer: &'a dyn Observer,
    what: String,
}

impl Observer for Told<'_> {
    fn stage(&self, name: &str, total: u64) {
        self.observer
            .stage(&format!("{name}; {}", self.what), total);
    }

    fn advance(&self, done: u64) {
        self.observer.advance(done);
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }
}

/// The fastest speed of a path with the beam on, mm/s, and the spot there, mm.
fn fastest(path: &BeamPath) -> (f64, f64) {
    path.points()
        .windows(2)
        .filter(|w| w[0].is_on() && w[1].time > w[0].time)
        .map(|w| {
            let way = (w[1].x - w[0].x).hypot(w[1].y - w[0].y);
            (way / (w[1].time - w[0].time), w[0].spot)
        })
        .fold((0.0, 0.0), |best, s| if s.0 > best.0 { s } else { best })
}

/// What a share of a path stands for, told where it is used.
impl OnReference {
    /// One line about the solver.
    pub fn told(&self) -> String {
        let grid = &self.given.0.grid;
        format!(
            "Reference solver; cells of {:.1} x {:.1} x {:.0} µm, steps of {:.2} µs, {:.0} million updates of a cell a drawing.",
            1e3 * grid.edge[0],
            1e3 * grid.edge[1],
            1e3 * grid.heights.last().copied().unwrap_or_default(),
            1e6 * self.step,
            1e-6 * self.updates
        )
    }
}
