//! Better paths: orders and strategies tried, speed, time on spots, power or spot changed along the path, on charts or on the reference
//! solver.

use std::time::{Duration, Instant};

use meltpath_base::{Length, Observer, Provenance, Ratio, Reporter, Time};
use meltpath_geometry::Region;
use meltpath_melt_strategy::bed::Bed;
use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::controller::{Accelerator, Controller, Pid, control};
use meltpath_melt_strategy::error::StrategyError;
use meltpath_melt_strategy::learning::{Freedom, Learned, Learning, learn};
use meltpath_melt_strategy::lever::Lever;
use meltpath_melt_strategy::order::{Order, reorder};
use meltpath_melt_strategy::peaks::{Draw, crossed, with_charts, with_reference};
use meltpath_melt_strategy::prediction::{Prediction, Reference, predict};
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::run::draw as draw_path;

use super::hatch::{Hatch, HatchError, pattern};
use super::judge::{body, centre, ground, middle};
use super::run::EbmError;
use super::settings::{Settings, Window};
use super::simulate::tally;
use crate::job::ebm::{
    Change, ControllerKind, OptimiseMethod, OptimiseSolver, OptimiseTable, OrderChoice,
};

/// How a better path is looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimise {
    /// How.
    pub method: OptimiseMethod,
    /// What is changed.
    pub change: Change,
    /// What temperatures are taken from.
    pub solver: OptimiseSolver,
    /// How often it can be changed.
    pub controller: ControllerKind,
    /// Paths to try besides the given one, each with its name.
    pub others: Vec<(String, BeamPath)>,
    /// Orders to try.
    pub orders: Vec<OrderChoice>,
    /// Rounds of learning.
    pub rounds: u32,
    /// Least and greatest factor.
    pub bounds: [f64; 2],
    /// Length of a piece of one factor, mm.
    pub piece: f64,
    /// Edge of a cell of the reference solver, mm.
    pub cell: f64,
    /// Planes of cells in a layer there.
    pub planes: u32,
    /// Its longest step, s.
    pub step: f64,
}

fn kebab(value: &impl std::fmt::Debug) -> String {
    let mut out = String::new();
    for c in format!("{value:?}").chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push('-');
        }
        out.extend(c.to_lowercase());
    }
    out
}

impl Optimise {
    /// From the job's table; `hatch` and `region` where a hatch draws.
    ///
    /// # Errors
    /// [`HatchError`] of a strategy that cannot fill the region.
    pub fn resolve(
        table: &OptimiseTable,
        hatch: Option<&Hatch>,
        region: &Region,
        r: &mut Provenance,
    ) -> Result<Self, HatchError> {
        for (name, value) in [
            ("optimise.method", kebab(&table.method)),
            ("optimise.change", kebab(&table.change)),
            ("optimise.solver", kebab(&table.solver)),
            ("optimise.controller", kebab(&table.controller)),
        ] {
            r.written_or(name, Some(value), String::new(), "");
        }
        let reference = table.solver == OptimiseSolver::Reference;
        let rounds = if table.method == OptimiseMethod::Predictive {
            r.written_or("optimise.rounds", table.rounds, 0, "prediction alone")
        } else {
            r.written_or(
                "optimise.rounds",
                table.rounds,
                12,
                "the share hardly grows after them",
            )
        };
        let bounds = table.speeds.map(|s| s.map(|r| r.0.0));
        let bounds = r.written_or(
            "optimise.speeds",
            bounds,
            [0.6, 3.0],
            "what a deflection follows easily",
        );
        let planes = r.written_or(
            "optimise.planes",
            table.planes.as_ref().map(|p| *p.get_ref()),
            1,
            "a plane a layer",
        );
        let cell = table.cell.map(|c| c.0);
        let cell = r
            .written_or(
                "optimise.cell",
                cell,
                Length(0.0625),
                "half the thesis' distance of lines",
            )
            .0;
        let step = table.step.map(|s| s.0);
        let step = r
            .written_or(
                "optimise.step",
                step,
                Time(8e-6),
                "half of it moves shares by less than a point",
            )
            .0;
        let default = if reference { cell } else { 0.25 };
        let piece = r
            .written_or(
                "optimise.piece",
                table.piece.map(|p| p.0),
                Length(default),
                "a cell of the reference solver; four voxels of the charts",
            )
            .0;
        let mut others = Vec::new();
        if let Some(hatch) = hatch {
            let wanted = table.strategies.iter().copied();
            for strategy in wanted.filter(|s| pattern(*s) != hatch.plan.pattern) {
                let other = hatch.with(strategy);
                let path = other.path(std::slice::from_ref(region), 1, &Reporter::new())?;
                others.push((kebab(&strategy), path));
            }
        }
        Ok(Optimise {
            method: table.method,
            change: table.change,
            solver: table.solver,
            controller: table.controller,
            others,
            orders: table.orders.clone(),
            rounds: rounds.min(200),
            bounds,
            piece,
            cell,
            planes,
            step,
        })
    }

    /// The given path and the others to try.
    fn candidates(&self, given: &BeamPath) -> Result<Vec<(String, BeamPath)>, EbmError> {
        let mut found = vec![("as given".to_owned(), given.clone())];
        found.extend(self.others.clone());
        for choice in &self.orders {
            let order = match choice {
                OrderChoice::AsGiven => continue,
                OrderChoice::EverySecond => Order::Every(2),
                OrderChoice::EveryThird => Order::Every(3),
                OrderChoice::EveryFourth => Order::Every(4),
                OrderChoice::FromTheMiddle => Order::FromTheMiddle,
                OrderChoice::Backwards => Order::Backwards,
            };
            // links between lines are shorter than two voxels
            let path = reorder(given, order, 0.15).map_err(StrategyError::from)?;
            found.push((kebab(choice), path));
        }
        Ok(found)
    }

    /// What looking on the reference solver costs where one drawing takes `one`, in words.
    fn cost(&self, one: Duration) -> String {
        let orders = self.orders.iter().filter(|o| **o != OrderChoice::AsGiven);
        let tried = match self.others.len() + orders.count() {
            0 => 0,
            others => (others as u32 + 1) * (TRIAL_ROUNDS + 1),
        };
        let mut drawings = f64::from(tried + self.rounds + 1);
        if self.method == OptimiseMethod::Predictive {
            // each piece is drawn ahead twice, a little further than it reaches, and then once
            drawings += 1.0 + 2.0 * (1.0 + AHEAD / self.predicted_piece());
        }
        let one = one.as_secs_f64();
        format!(
            "as much as {drawings:.0} drawings of {one:.1} s in all, {:.1} min",
            drawings * one / 60.0
        )
    }

    /// Length of the pieces that are predicted, mm.
    fn predicted_piece(&self) -> f64 {
        self.piece.max(0.125)
    }

    fn lever(&self, settings: &Settings) -> Result<Lever, EbmError> {
        Ok(match self.change {
            Change::Speed => Lever::Speed,
            Change::Dwell => Lever::Dwell,
            Change::Current => Lever::Power,
            Change::Focus => Lever::Spot(settings.gun.spots()?),
        })
    }

    fn freedom(&self) -> Freedom {
        match self.controller {
            ControllerKind::Continuous => Freedom::Continuous,
            ControllerKind::PerLine => Freedom::PerLine,
        }
    }
}

/// What was tried of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Its name.
    pub name: String,
    /// Share in the window as drawn, and after a few rounds.
    pub shares: [f64; 2],
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
    /// What the reference solver says of the given path and of this one, where it was looked for there.
    pub reference: Option<OnReference>,
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

/// How far beyond a piece its effect is looked at, mm: the hottest place follows the beam by half its width.
const AHEAD: f64 = 0.2;
/// Rounds of learning that a candidate gets before the best one is chosen.
const TRIAL_ROUNDS: u32 = 4;

struct Search<'a> {
    settings: &'a Settings,
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
        let s = self.settings;
        tally(highest, self.classes, &s.contour, s.inside).share(Class::Good)
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
            lever: self.how.lever(self.settings)?,
            levels: Vec::new(),
            freedom: self.how.freedom(),
        };
        let s = self.settings;
        // a voxel at the border teaches too, so that those just inside are warm from both sides
        let lines = self.lines.map(|grid| (grid, crossed(grid, path)));
        let on_line = |p: [f64; 2]| {
            lines.as_ref().is_none_or(|(grid, crossed)| {
                let [i, j] = [(0, grid.origin.x), (1, grid.origin.y)]
                    .map(|(a, origin)| ((p[a] - origin) / grid.edge[a]) as usize);
                crossed[j * grid.cells[0] + i]
            })
        };
        let judged = |p: [f64; 2]| s.contour.depth(p) > 0.75 * s.inside && on_line(p);
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
        let candidates = self.how.candidates(&self.settings.path)?;
        if candidates.len() == 1 {
            return Ok((self.settings.path.clone(), None, Vec::new()));
        }
        let mut trials = Vec::new();
        let mut best: Option<(f64, BeamPath, SpeedProfile)> = None;
        for (name, path) in candidates {
            let found = self.learned(draw, &path, TRIAL_ROUNDS, None, observer)?;
            let reached = found.scores.iter().copied().fold(0.0, f64::max);
            trials.push(Trial {
                name,
                shares: [found.scores[0], reached],
            });
            if best.as_ref().is_none_or(|(most, _, _)| reached > *most) {
                best = Some((reached, path, found.profile));
            }
        }
        let best = best.map(|(_, path, profile)| (path, Some(profile)));
        let (path, profile) = best.unwrap_or((self.settings.path.clone(), None));
        Ok((path, profile, trials))
    }

    fn prediction(&self) -> Result<Prediction, EbmError> {
        let speed = fastest(&self.settings.path).0;
        Ok(Prediction {
            aim: self.aim(),
            bounds: self.how.bounds,
            length: self.how.predicted_piece(),
            ahead: AHEAD / speed.max(1.0),
            lever: self.how.lever(self.settings)?,
            levels: Vec::new(),
        })
    }
}

/// Looks for a better path on charts, from the state of `ready`.
///
/// # Errors
/// [`EbmError`].
pub fn on_charts(
    settings: &Settings,
    how: &Optimise,
    ready: &ChartSimulation,
    classes: &Classes,
    observer: &dyn Observer,
) -> Result<Found, EbmError> {
    let search = Search {
        settings,
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
                &search.prediction()?,
                observer,
            )?;
            Some(found)
        }
        OptimiseMethod::Accelerate | OptimiseMethod::Pid => {
            let mut simulation = ready.clone();
            let mut controller = online(settings, how, search.aim(), &path)?;
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
                reference: None,
            });
        }
    };
    let found = search.learned(&mut draw, &path, how.rounds, first, observer)?;
    Ok(Found {
        path: found.path,
        scores: found.scores,
        trials,
        reference: None,
    })
}

/// Steps between two looks of a controller.
const LOOK: usize = 4;

fn online(
    settings: &Settings,
    how: &Optimise,
    aim: f64,
    path: &BeamPath,
) -> Result<Box<dyn Controller>, EbmError> {
    if how.method == OptimiseMethod::Pid {
        // gains of a first-order pool that answers within a beam diameter, some 0.4 ms
        let ambient = settings.material.start;
        return Ok(Box::new(Pid::new(
            aim,
            ambient,
            [2.0, 2e3, 0.0],
            how.bounds,
        )));
    }
    let (speed, diameter) = fastest(path);
    let look = settings.simulation.step * LOOK as f64;
    Ok(Box::new(Accelerator::of_thesis(aim, diameter, speed, look)))
}

/// Looks for a better path on the reference solver; the window is found there too.
///
/// # Errors
/// [`EbmError`].
pub fn on_reference(
    settings: &Settings,
    how: &Optimise,
    observer: &dyn Observer,
) -> Result<Found, EbmError> {
    let melting = settings.material.liquidus;
    let resolution = Resolution {
        cell: how.cell,
        planes: how.planes,
        step: how.step,
        power: 1.0,
    };
    let classes = match &settings.window {
        Window::Fixed(window) => Classes {
            melting,
            window: *window,
        },
        Window::Good { path, width } => {
            let lower = vec![path.as_ref().clone(); settings.lower.len()];
            let below = settings.below_good();
            let ground = ground(&below);
            let bed = body(settings, &ground).bed(&[path], &lower, &resolution, observer);
            let bed = bed.map_err(StrategyError::from)?;
            let drawn =
                with_reference(&bed.solver, &bed.beam, bed.step, settings.layer)(path, observer)?;
            // as [judge] reads it, so that both speak of one window
            let (hull, square) = middle(path);
            let centre = centre(&drawn.highest, melting, &hull, &square)?;
            Classes::calibrated(melting, centre, *width)
        }
    };
    let search = Search {
        settings,
        how,
        classes: &classes,
        gain: 0.5,
        lines: None,
    };
    let mut around: Vec<&BeamPath> = how.others.iter().map(|(_, path)| path).collect();
    around.push(&settings.path);
    let ground = ground(&settings.below);
    let bed = body(settings, &ground).bed(&around, &settings.lower, &resolution, observer);
    let Bed { solver, beam, step } = bed.map_err(StrategyError::from)?;
    let begun = Instant::now();
    let (given, updates) = drawn_as_given(&solver, &beam, step, settings, observer)?;
    let told = Told {
        observer,
        what: how.cost(begun.elapsed()),
    };
    let observer: &dyn Observer = &told;
    let mut draw = with_reference(&solver, &beam, step, settings.layer);
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
            &search.prediction()?,
            observer,
        )?)
    } else {
        profile
    };
    let found = search.learned(&mut draw, &path, how.rounds, first, observer)?;
    let judged = |highest: Field| {
        let found = tally(&highest, &classes, &settings.contour, settings.inside);
        (highest, found)
    };
    Ok(Found {
        path: found.path,
        scores: found.scores,
        trials,
        reference: Some(OnReference {
            given: judged(given),
            better: judged(found.highest),
            classes,
            step,
            updates,
        }),
    })
}

/// Highest temperatures of the path as given, and the updates of a cell that drawing it takes.
fn drawn_as_given(
    bed: &Solver<f32>,
    beam: &Beam,
    step: f64,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(Field, f64), EbmError> {
    let path = &settings.path;
    let mut solver = bed.clone();
    draw_path(&mut solver, path, beam, step, &mut [], observer).map_err(StrategyError::from)?;
    let updates = solver.updates() - bed.updates();
    let highest = solver.highest_temperature();
    Ok((highest.over_layer(settings.layer), updates as f64))
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

    /// Shares in the window, as given and better.
    pub fn shares(&self) -> [Ratio; 2] {
        [&self.given, &self.better].map(|(_, tally)| Ratio(tally.share(Class::Good)))
    }
}
