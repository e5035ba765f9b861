//! The fastest recipe within bounds: speeds, waits and pre-filter, with the delays that suit each, judged by the whole head on a
//! small job.
//!
//! Source: a perspective of Rasoanarivo 2020 (conclusion), which tunes by trial and error. Contours set the contour
//! speed and fills the fill speed: for each pre-filter and wait both are scanned from the fastest on, then bisected, in the same
//! runs. The gate does not act on the mirrors, so each run also tunes its delays. Dry friction makes slow marks worse than faster
//! ones: the rates are not monotone in the speed, and a faster recipe between two scanned speeds may be missed; the found one is
//! within bounds in any case.

use meltpath_base::{Observer, Quiet};
use rayon::prelude::*;

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::error::HeadError;
use crate::head::gate::{Darkness, Gate};
use crate::head::prepared::alone;
use crate::head::ready::ReadyHead;
use crate::head::recipe::{LaserDelays, Recipe};
use crate::head::scan_head::ScanHead;
use crate::head::vector::{ScanJob, ScanJobError};
use crate::head::window::Window;
use crate::measures::contour_error::PathErrors;
use crate::measures::dark_way::LightReach;
use crate::measures::delays::DelayTuning;
use crate::measures::fill_rate::FillRate;
use crate::measures::fill_share::FillShare;
use crate::measures::hatch::HatchDistance;
use crate::measures::strays::lost_by_straying;
use meltpath_toolpath::Role;

/// Lit points are compared with marks commanded at most this long before, s.
const WINDOW: f64 = 4e-3;
/// Steps in which the range of speeds is scanned, from the fastest.
const SCANNED: u32 = 6;
/// Halvings between the fastest good speed scanned and the next.
const HALVINGS: u32 = 2;
/// Steps back where the speeds found apart do not go together.
const STEPS_BACK: u32 = 3;
/// Size of such a step.
const STEP_BACK: f64 = 1.08;
/// What a fill rate may lose where nothing else is asked.
pub const MAY_LOSE: f64 = 0.02;

/// What the search may change, and what the marks must keep.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Slowest and fastest contour, mm/s.
    pub contour_speed: [f64; 2],
    /// Slowest and fastest fill, mm/s.
    pub fill_speed: [f64; 2],
    /// Waits after marks to try, s.
    pub mark_waits: Vec<f64>,
    /// Factors on the recipe's jump speeds to try; the first is that of the search, the others are tried on what it found.
    pub jump_factors: Vec<f64>,
    /// Factors on the mirrors' first filter to try (a shorter one lags less and shakes more).
    pub filter_factors: Vec<f64>,
    /// Contour error that counts as good, mm.
    pub contour_error: f64,
    /// Least share of the lit way along contours within it.
    pub contour_share: f64,
    /// Least fill rate, in the mode that `fill` of the problem judges first; NaN for [`MAY_LOSE`] less than that of the recipe to
    /// begin with.
    pub fill_rate: f64,
}

/// What is searched: the head, the recipe to begin with, the small job of a recipe, its surface to fill, and the time of the
/// whole job.
pub struct Problem<'a> {
    /// The head.
    pub head: &'a ScanHead,
    /// The recipe whose other values are kept.
    pub recipe: &'a Recipe,
    /// The small job that is simulated.
    pub job: &'a (dyn Fn(&Recipe) -> Result<ScanJob, HeadError> + Sync),
    /// Its surface; the first mode is judged.
    pub fill: &'a (dyn Fn(&ScanJob) -> FillRate + Sync),
    /// Samples of the whole job, for its time, at a period in s.
    pub samples: &'a (dyn Fn(&Recipe, f64) -> Result<u64, HeadError> + Sync),
}

/// A recipe that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// It, with its tuned delays.
    pub recipe: Recipe,
    /// Factor on the mirrors' first filter.
    pub filter_factor: f64,
    /// Factor on the jump speeds.
    pub jump_factor: f64,
    /// Time of the whole job, s.
    pub duration: f64,
    /// Share of the way along contours within the bound, on the small job; 1 where none is marked.
    pub contour_share: f64,
    /// 99th percentile of the contour error, mm, on the small job.
    pub contour_error: f64,
    /// The longest stretch of contours without light, mm, on the small job.
    pub unlit: f64,
    /// The longest stretch of light where no mark is, mm, on the small job.
    pub stray: f64,
    /// The longest that may be, mm: [`longest_stray`].
    pub most_stray: f64,
    /// Fill rate on the small job; 1 where no line of a fill is marked.
    pub fill_rate: f64,
    /// Whether all bounds are kept.
    pub within: bool,
}

/// What the search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The fastest recipe within bounds; none where no candidate keeps them.
    pub best: Option<Candidate>,
    /// The recipe that the search began with, as it is but for its tuned delays.
    pub start: Candidate,
    /// All that was tried, in order.
    pub tried: Vec<Candidate>,
    /// The bounds, with the fill rate that held.
    pub bounds: Bounds,
    /// The longest stretch of contours that may stay without light, mm: [`longest_unlit`].
    pub most_unlit: f64,
    /// What the small job marks: the speed of what it does not mark stays that of the recipe.
    pub marks: Marks,
}

/// What a job marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Marks {
    /// Contours.
    pub contours: bool,
    /// Lines of fills.
    pub fills: bool,
}

impl Marks {
    fn of(job: &ScanJob) -> Self {
        let any = |kind| job.vectors.iter().any(|v| v.kind == kind);
        Marks {
            contours: any(Role::Contour),
            fills: any(Role::Fill),
        }
    }
}

impl Found {
    /// The candidates that no other beats in time, contour share and fill rate at once, by rising time.
    pub fn front(&self) -> Vec<&Candidate> {
        let beats = |a: &Candidate, b: &Candidate| {
            a.duration <= b.duration
                && a.contour_share >= b.contour_share
                && a.fill_rate >= b.fill_rate
                && (a.duration < b.duration
                    || a.contour_share > b.contour_share
                    || a.fill_rate > b.fill_rate)
        };
        let mut front: Vec<&Candidate> = self
            .tried
            .iter()
            .filter(|c| !self.tried.iter().any(|o| beats(o, c)))
            .collect();
        front.sort_by(|a, b| a.duration.total_cmp(&b.duration));
        front.dedup_by(|a, b| {
            (a.duration, a.contour_share, a.fill_rate) == (b.duration, b.contour_share, b.fill_rate)
        });
        front
    }

    /// The candidate nearest to the bounds, for when none keeps them.
    pub fn nearest(&self) -> &Candidate {
        let bounds = &self.bounds;
        let miss = |c: &Candidate| {
            (bounds.contour_share - c.contour_share).max(0.0)
                + (bounds.fill_rate - c.fill_rate).max(0.0)
                + (1.0 - self.most_unlit / c.unlit).max(0.0)
                + (1.0 - c.most_stray / c.stray).max(0.0)
        };
        self.tried
            .iter()
            .min_by(|a, b| miss(a).total_cmp(&miss(b)))
            .unwrap_or(&self.start)
    }
}

/// The longest stretch of contours that may stay without light, mm: as far as a spot of a head heals, or as contours may be off.
pub fn longest_unlit(head: &ScanHead, contour_error: f64) -> f64 {
    (2.0 * head.beam.waist).max(contour_error)
}

/// The longest stretch of light that may lie where no mark is, mm: as much, and what the fastest jump of a recipe goes in a sample of the head,
/// since light is switched with samples.
pub fn longest_stray(head: &ScanHead, contour_error: f64, recipe: &Recipe) -> f64 {
    let fastest = recipe.contour_jump_speed.max(recipe.fill_jump_speed);
    longest_unlit(head, contour_error) + fastest * head.period
}

/// The head with its mirrors' first filter scaled.
///
/// ```
/// use meltpath_scan_head::files;
/// use meltpath_scan_head::search::with_filter;
/// # let text = meltpath_data::scan_heads::TWO_AXIS_150.text;
/// let head = files::parse_head(text).unwrap().head;
/// let first = |h: &meltpath_scan_head::head::scan_head::ScanHead| h.mirrors[0].driven().unwrap().prefilter.unwrap().first;
/// assert!((first(&with_filter(&head, 0.5)) - 0.5 * first(&head)).abs() < 1e-12);
/// ```
#[must_use]
pub fn with_filter(head: &ScanHead, factor: f64) -> ScanHead {
    let (mut head, one) = (head.clone(), head.period);
    for axis in head.driven_mirrors() {
        if let Some(filter) = &mut axis.prefilter {
            // an average over no time is none: one sample
            filter.first = (filter.first * factor).max(one);
        }
    }
    head
}

/// One place of the grid: what is held while speeds are bisected.
#[derive(Clone, Copy)]
struct Held {
    filter: f64,
    wait: f64,
    jump: f64,
}

struct Search<'a> {
    problem: &'a Problem<'a>,
    bounds: Bounds,
    heads: Vec<(f64, ReadyHead)>,
    quiet: Quiet<'a>,
}

/// Searches the fastest recipe within bounds. The Observer is told one unit a simulated recipe.
///
/// # Errors
/// [`HeadError`] where the head, the recipe or the job is unsound, or the observer cancels. A recipe that shakes an axis out of its
/// travel or is too fast for the head's sampling is a candidate that keeps no bound, not an error.
pub fn search(
    problem: &Problem<'_>,
    bounds: &Bounds,
    observer: &dyn Observer,
) -> Result<Found, HeadError> {
    check(bounds)?;
    let mut factors = bounds.filter_factors.clone();
    factors.push(1.0);
    let heads = factors
        .iter()
        .map(|&f| Ok((f, with_filter(problem.head, f).ready()?)))
        .collect::<Result<Vec<_>, HeadError>>()?;
    let jump = bounds.jump_factors.first().copied().unwrap_or(1.0);
    let grid: Vec<Held> = bounds
        .filter_factors
        .iter()
        .flat_map(|&filter| {
            bounds
                .mark_waits
                .iter()
                .map(move |&wait| Held { filter, wait, jump })
        })
        .collect();
    let (recipe, mut bounds) = (problem.recipe, bounds.clone());
    let marks = Marks::of(&(problem.job)(recipe)?);
    // of what is not marked nothing is learnt
    if !marks.contours {
        bounds.contour_speed = [recipe.contour_speed; 2];
    }
    if !marks.fills {
        bounds.fill_speed = [recipe.fill_speed; 2];
    }
    let mut search = Search {
        problem,
        bounds: bounds.clone(),
        heads,
        quiet: Quiet(observer),
    };
    let most = grid.len() as u64 * u64::from(2 + SCANNED + HALVINGS + STEPS_BACK) + 1;
    observer.stage("recipe search", most);
    let mut start = search.try_recipe(
        Held {
            filter: 1.0,
            wait: problem.recipe.mark_wait,
            jump: 1.0,
        },
        [problem.recipe.contour_speed, problem.recipe.fill_speed],
    )?;
    if search.bounds.fill_rate.is_nan() {
        search.bounds.fill_rate = start.fill_rate - MAY_LOSE;
    }
    start.recipe.name.clone_from(&problem.recipe.name);
    start.within = search.within(&start);
    let found: Vec<Result<Vec<Candidate>, HeadError>> =
        grid.par_iter().map(|&held| search.speeds(held)).collect();
    let mut tried = vec![start.clone()];
    for candidates in found {
        tried.extend(candidates?);
    }
    let mut best = fastest(&tried);
    if let Some(found) = best.clone() {
        for &jump in bounds.jump_factors.iter().skip(1) {
            let held = Held {
                filter: found.filter_factor,
                wait: found.recipe.mark_wait,
                jump,
            };
            tried.push(
                search.try_recipe(held, [found.recipe.contour_speed, found.recipe.fill_speed])?,
            );
        }
        best = fastest(&tried);
    }
    Ok(Found {
        most_unlit: search.most_unlit(),
        best,
        start,
        tried,
        bounds: search.bounds,
        marks,
    })
}

fn fastest(tried: &[Candidate]) -> Option<Candidate> {
    tried
        .iter()
        .filter(|c| c.within)
        .min_by(|a, b| a.duration.total_cmp(&b.duration))
        .cloned()
}

fn check(bounds: &Bounds) -> Result<(), ScanJobError> {
    let fail = |what, value, wanted| {
        Err(ScanJobError::Value {
            what,
            value,
            wanted,
        })
    };
    for (what, [low, high]) in [
        ("the slowest contour speed", bounds.contour_speed),
        ("the slowest fill speed", bounds.fill_speed),
    ] {
        if !(low > 0.0 && low <= high && high.is_finite()) {
            return fail(
                what,
                low,
                "above zero and not above the fastest, which is finite (mm/s)",
            );
        }
    }
    for (what, values, positive) in [
        ("a wait to try", &bounds.mark_waits, false),
        ("a factor on the jump speeds", &bounds.jump_factors, true),
        ("a factor on the first filter", &bounds.filter_factors, true),
    ] {
        if values.is_empty() {
            return fail(what, f64::NAN, "given: the list is empty");
        }
        for &value in values {
            if !(value.is_finite() && value >= 0.0 && !(positive && value == 0.0)) {
                return fail(
                    what,
                    value,
                    "finite and not negative, and a factor above zero",
                );
            }
        }
    }
    Ok(())
}

/// A range that is halved in the logarithm: what is known to be good, and what is not.
struct Halving {
    good: f64,
    bad: f64,
}

impl Halving {
    fn middle(&self) -> f64 {
        (self.good * self.bad).sqrt()
    }

    fn take(&mut self, at: f64, good: bool) {
        if good {
            self.good = at;
        } else {
            self.bad = at;
        }
    }
}

impl Search<'_> {
    /// The fastest speeds at one place of the grid, with all that was tried on the way.
    fn speeds(&self, held: Held) -> Result<Vec<Candidate>, HeadError> {
        let b = &self.bounds;
        let range = [b.contour_speed, b.fill_speed];
        let good = |c: &Candidate| {
            // either speed may be why the mirrors still move when light comes on
            let clean = c.stray <= c.most_stray;
            let contours = c.contour_share >= b.contour_share && c.unlit <= self.most_unlit();
            [clean && contours, clean && c.fill_rate >= b.fill_rate]
        };
        // for each speed the fastest scanned one that is good, and the next faster one, which is not
        let mut ends: [Option<Halving>; 2] = [None, None];
        let mut tried = Vec::new();
        for step in (0..=SCANNED).rev() {
            let share = f64::from(step) / f64::from(SCANNED);
            let at = |share: f64| range.map(|[low, high]| low * (high / low).powf(share));
            let (speeds, faster) = (at(share), at(share + 1.0 / f64::from(SCANNED)));
            let candidate = self.try_recipe(held, speeds)?;
            for (k, good) in good(&candidate).into_iter().enumerate() {
                if good && ends[k].is_none() {
                    ends[k] = Some(Halving {
                        good: speeds[k],
                        bad: faster[k].min(range[k][1]),
                    });
                }
            }
            tried.push(candidate);
            if ends.iter().all(Option::is_some) {
                break;
            }
        }
        let [Some(contour), Some(fill)] = ends else {
            return Ok(tried);
        };
        let mut ranges = [contour, fill];
        for _ in 0..HALVINGS {
            let speeds = [ranges[0].middle(), ranges[1].middle()];
            let candidate = self.try_recipe(held, speeds)?;
            for (k, good) in good(&candidate).into_iter().enumerate() {
                ranges[k].take(speeds[k], good);
            }
            tried.push(candidate);
        }
        // both speeds together, and slower where one does not stand the other's delays
        let mut speeds = [ranges[0].good, ranges[1].good];
        for _ in 0..=STEPS_BACK {
            let candidate = self.try_recipe(held, speeds)?;
            let good = good(&candidate);
            let within = candidate.within;
            tried.push(candidate);
            if within {
                break;
            }
            for k in [0, 1] {
                if !good[k] {
                    speeds[k] = (speeds[k] / STEP_BACK).max(range[k][0]);
                }
            }
        }
        Ok(tried)
    }

    fn try_recipe(&self, held: Held, speeds: [f64; 2]) -> Result<Candidate, HeadError> {
        self.quiet.0.check()?;
        let base = self.problem.recipe;
        let mut recipe = Recipe {
            name: format!("{}, optimised", base.name),
            contour_speed: speeds[0],
            fill_speed: speeds[1],
            contour_jump_speed: base.contour_jump_speed * held.jump,
            fill_jump_speed: base.fill_jump_speed * held.jump,
            mark_wait: held.wait,
            ..base.clone()
        };
        let head = self
            .heads
            .iter()
            .find(|(f, _)| *f == held.filter)
            .map_or(&self.heads[self.heads.len() - 1].1, |(_, h)| h);
        let period = head.head().period;
        let mut candidate = Candidate {
            duration: ((self.problem.samples)(&recipe, period)? - 1) as f64 * period,
            filter_factor: held.filter,
            jump_factor: held.jump,
            contour_share: 0.0,
            contour_error: f64::INFINITY,
            unlit: f64::INFINITY,
            stray: f64::INFINITY,
            most_stray: longest_stray(head.head(), self.bounds.contour_error, &recipe),
            fill_rate: 0.0,
            within: false,
            recipe: recipe.clone(),
        };
        let job = (self.problem.job)(&recipe)?;
        let mut blocks: Vec<HeadBlock> = Vec::new();
        let ran = head.run(&job, recipe.delays, 1, &self.quiet, &mut blocks);
        self.quiet.0.advance(1);
        match ran {
            Ok(_) => {}
            // shaken out of its travel
            Err(HeadError::Axis { .. }) => return Ok(candidate),
            Err(other) => return Err(other),
        }
        let hits: Vec<_> = blocks.iter().flat_map(|b| b.hit.iter().copied()).collect();
        let (radius, longest) = (head.head().beam.waist, head.head().delays_up_to());
        let shortest = Darkness::of(alone(&job), recipe.delays, period)?.shortest;
        let tuned = DelayTuning::new(&job, &hits, period, longest, radius).tune(shortest);
        recipe.delays = tuned.best.delays;
        let errors = PathErrors::new(
            WINDOW,
            period,
            LightReach::of(2.0 * radius, self.bounds.contour_error),
        );
        let sinks = (errors, (self.problem.fill)(&job));
        let (errors, fill) = judge(&job, recipe.delays, &mut blocks, sinks);
        // as the judge counts them: a data sheet leaves out what makes the spot stray
        let strays = head.head().left_out.flatten();
        candidate.contour_share = errors.contour_share(self.bounds.contour_error, strays);
        candidate.contour_error = errors.contour_way.quantile(0.99);
        candidate.unlit = errors.dark().longest.length;
        candidate.stray = errors.stray.longest.length;
        let lost = strays
            .zip(HatchDistance::of(&job))
            .map_or(0.0, |(sigma, hatch)| {
                lost_by_straying(sigma, hatch, 2.0 * radius)
            });
        candidate.fill_rate = (fill - lost).max(0.0);
        candidate.within = self.within(&candidate);
        candidate.recipe = recipe;
        Ok(candidate)
    }

    fn within(&self, c: &Candidate) -> bool {
        c.contour_share >= self.bounds.contour_share
            && c.unlit <= self.most_unlit()
            && c.stray <= c.most_stray
            && c.fill_rate >= self.bounds.fill_rate
    }

    fn most_unlit(&self) -> f64 {
        longest_unlit(self.problem.head, self.bounds.contour_error)
    }
}

/// Judges a recorded run as if the laser had been switched with other delays. A fill that is none is whole.
fn judge(
    job: &ScanJob,
    delays: LaserDelays,
    blocks: &mut [HeadBlock],
    mut sinks: (PathErrors, FillRate),
) -> (PathErrors, f64) {
    let period = blocks.first().map_or(1.0, |b| b.period);
    let mut window = Window::new(alone(job));
    let mut gate = Gate::new(&mut window, delays, period);
    for block in blocks {
        let first = block.command.first;
        for (k, lit) in block.lit.iter_mut().enumerate() {
            *lit = gate.lit(&mut window, first + k as u64);
        }
        sinks.block(block);
    }
    let share = FillShare::of(&sinks.1.finish(), 0);
    (sinks.0, share.map_or(1.0, |s| s.judged().share))
}
