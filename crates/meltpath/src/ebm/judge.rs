//! The paths of a job on the solver for whole layers: what becomes of every point of the section, with what moves the figures.

pub(crate) mod advice;
pub(super) mod areas;
mod beyond;
mod cold;
mod doubt;
mod drift;
pub(in crate::ebm) mod edge;
pub mod ends;
pub(crate) mod facts;
pub(in crate::ebm) mod fused;
pub mod lower;
mod on_lower;
mod scale;
pub(crate) mod shape;
pub(crate) mod under;
pub(crate) mod verdict;

use meltpath_base::{Observer, Quiet};
use meltpath_melt_strategy::bed::{Body, Resolution};
use meltpath_melt_strategy::error::StrategyError;
use meltpath_melt_strategy::judgement::{Drawn as Reference, Share, Variant, watched};
use meltpath_melt_strategy::layer_heat::LayerHeat;
use meltpath_melt_strategy::part::{Rectangle, within};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::solver::ledger::Ledger;
use meltpath_thermal::solver::watch::{Watch, Watched};

use super::error::EbmError;
use super::plan::{Plan, Window};
use super::settings::Judge;
pub use crate::ebm::judge::areas::{Hole, Hollow, Outside};
use crate::ebm::judge::areas::{fullest_hole, hollows, outside};
use crate::ebm::judge::beyond::{area_beyond, area_within, cells_beyond};
use crate::ebm::judge::ends::{Ends, Surface, ends};
use crate::ebm::judge::fused::unfused;
use crate::ebm::judge::lower::Lower;
use crate::ebm::judge::under::{body, domain, ground};
use crate::ebm::plan::region::Contour;
use rayon::prelude::*;

/// The table of the voxels that melted on the reference solver, in a run's folder.
pub(crate) const VOXELS_REFERENCE: &str = "series/voxels-reference.csv";
/// That of the temperatures in time.
pub(crate) const TEMPERATURES_REFERENCE: &str = "series/temperatures-reference.csv";

/// One run of the judge.
#[derive(Debug, Clone)]
pub struct Run {
    /// What it changes.
    pub variant: Variant,
    /// Cell, step as taken, power.
    pub resolution: Resolution,
    /// All points of the section, in the window of this run: that of the good body drawn with the same cell, step, ground and
    /// power.
    pub tally: Tally,
    /// What melts outside the contour.
    pub outside: Outside,
    /// That window.
    pub classes: Classes,
    /// The same in the window of the run as asked, which a change between the good body and this one would hit.
    pub as_it_was: Tally,
    /// Share of what lies over metal that does not melt down to it; `None` where no metal lies below.
    pub unfused: Option<f64>,
    /// The hole of the region, or the narrow gap of its outline, of which most melts; `None` where there is none.
    pub hole: Option<Hole>,
    /// Where the heat went, and what left as vapour.
    pub ledger: Ledger,
    /// What the solver lost of the heat.
    pub residual: f64,
}

/// A path as the reference solver sees it.
#[derive(Debug, Clone)]
pub struct JudgedPath {
    /// The runs, the one as asked first.
    pub runs: Vec<Run>,
    /// Highest temperatures of the run as asked, K.
    pub highest: Field,
    /// The same where the layer meets the one below, K, in the top plane.
    pub foot: Field,
    /// What else the run as asked showed.
    pub watched: Watched,
    /// The heat of its layers, the lowest first.
    pub layers: Vec<LayerHeat>,
    /// Where a pool of conduction ends.
    pub ends: Ends,
    /// What is known of the layers below.
    pub lower: Option<Lower>,
    /// Area of whatever melts, mm².
    pub molten: f64,
    /// Share of the section so far beside the path that it is not looked at: powder.
    pub undrawn: f64,
    /// The same voxels on the charts, in the charts' window.
    pub on_charts: Option<Tally>,
}

impl JudgedPath {
    /// A figure of the run as asked, and what changes of it with each of the others.
    pub fn moved(&self, figure: impl Fn(&Run) -> f64) -> Share {
        Share {
            value: figure(&self.runs[0]),
            changes: self.runs[1..]
                .iter()
                .map(|run| {
                    let other = &self.runs[run.variant.compared()];
                    (run.variant, figure(run) - figure(other))
                })
                .collect(),
        }
    }

    /// The share of the section in the window.
    pub fn in_window(&self) -> Share {
        self.moved(|run| of_all(&run.tally, Class::Good))
    }
}

/// Share of all points in a class.
pub fn of_all(tally: &Tally, class: Class) -> f64 {
    tally.counts[class as usize] as f64 / tally.voxels as f64
}

/// A path, and its highest temperatures on charts where these drew it, K.
#[derive(Debug, Clone, Copy)]
pub struct Previewed<'a> {
    /// The path.
    pub path: &'a BeamPath,
    /// What charts say.
    pub highest: Option<&'a Field>,
}

/// What the judge found.
#[derive(Debug, Clone)]
pub struct Judged {
    /// The window on the scale of this solver.
    pub classes: Classes,
    /// The path as given; where there is a better one, its run as asked alone.
    pub given: JudgedPath,
    /// The one with better speeds.
    pub better: Option<JudgedPath>,
}

/// Half the width of the square in the middle of a good body that its temperature is read from, mm.
const MIDDLE: f64 = 0.6;
/// How long after the beam has left it the middle of a good body may grow hotter, s.
const FROZEN: f64 = 5e-3;
/// The hull of a good body's path, and the square in its middle.
pub(super) fn middle(path: &BeamPath) -> (Contour, Rectangle) {
    let points: Vec<[f64; 2]> = path.points().iter().map(|p| [p.x, p.y]).collect();
    let hull = Contour::hull(&points);
    let middle = hull.deepest();
    let square = Rectangle {
        low: middle,
        high: middle,
    };
    (hull, square.grown(MIDDLE))
}

/// Mean highest temperature in the square in the middle of a good body, K.
pub(super) fn centre(
    highest: &Field,
    melting: f64,
    hull: &Contour,
    square: &Rectangle,
) -> Result<f64, EbmError> {
    let any = Classes {
        melting,
        window: [melting, f64::INFINITY],
    };
    let tally = tally(highest, &any, hull, 0.0, Some((square, 0.0)));
    if tally.molten() == 0 {
        return Err(EbmError::GoodBody);
    }
    Ok(tally.mean)
}

/// Voxels of the top plane of `highest` well inside the contour and the part. What of these lies beyond the field, which ends where no
/// heat of the path melts, stays powder.
pub(super) fn tally(
    highest: &Field,
    classes: &Classes,
    contour: &Contour,
    inside: f64,
    part: Option<(&Rectangle, f64)>,
) -> Tally {
    let grid = &highest.grid;
    let top = grid.planes() - 1;
    let [nx, ny] = grid.cells;
    let judged: Vec<bool> = (0..nx * ny)
        .map(|n| {
            let c = grid.centre(n % nx, n / nx, top);
            let point = [c.x, c.y];
            contour.depth(point) > inside
                && part.is_none_or(|(part, beyond)| part.depth(point) > (inside - beyond).max(0.0))
        })
        .collect();
    let part = part.map(|(part, beyond)| part.grown(-(inside - beyond).max(0.0)));
    let far = cells_beyond(
        grid,
        area_beyond(grid, contour, inside, part.as_ref(), None),
    );
    Tally::of(highest, classes, |[i, j, k]| k == top && judged[j * nx + i]).with_powder(far)
}

/// Area of the top plane that melts, inside the contour or not, mm².
fn molten_area(highest: &Field, melting: f64) -> f64 {
    let grid = &highest.grid;
    let [nx, ny] = grid.cells;
    let top = grid.planes() - 1;
    let cells = (0..nx * ny).filter(|n| highest.at(n % nx, n / nx, top) >= melting);
    cells.count() as f64 * grid.edge[0] * grid.edge[1]
}

/// Whether metal melts up to where the field ends: more may melt beyond.
pub(crate) fn melts_at_the_edge(highest: &Field, melting: f64) -> bool {
    let [nx, ny] = highest.grid.cells;
    let top = highest.grid.planes() - 1;
    let molten = |i: usize, j: usize| highest.at(i, j, top) >= melting;
    (0..nx).any(|i| molten(i, 0) || molten(i, ny - 1))
        || (0..ny).any(|j| molten(0, j) || molten(nx - 1, j))
}

/// Draws with the first `count` variants, as many at once as there are threads; what the others halve is the step that the second
/// one took.
fn variants(
    resolution: &Resolution,
    count: usize,
    draw: &(dyn Fn(&Resolution, Variant) -> Result<Reference, EbmError> + Sync),
) -> Result<Vec<(Resolution, Reference)>, EbmError> {
    let some = |variants: &[Variant], step: f64| {
        let one = |variant: &Variant| {
            let wanted = resolution.of(*variant, step);
            draw(&wanted, *variant).map(|drawn| (wanted, drawn))
        };
        variants.par_iter().map(one).collect::<Result<Vec<_>, _>>()
    };
    let (first, rest) = Variant::ALL[..count].split_at(count.min(2));
    let mut found = some(first, resolution.step)?;
    if let Some((_, twice)) = found.get(1) {
        let step = twice.step;
        found.extend(some(rest, step)?);
    }
    Ok(found)
}

/// The windows on the scale of the solver, with the cells, steps, ground and power of each of the first `count` variants.
pub(super) fn windows(
    plan: &Plan,
    judging: &Judge,
    resolution: &Resolution,
    count: usize,
    observer: &dyn Observer,
) -> Result<Vec<Classes>, EbmError> {
    let settings = &plan.settings;
    let melting = settings.material.liquidus;
    let (path, width) = match &plan.window {
        Window::Fixed(window) => {
            let classes = Classes {
                melting,
                window: *window,
            };
            return Ok(vec![classes; count]);
        }
        Window::Good { path, width } => (path, *width),
    };
    let (hull, square) = middle(path);
    let focus = square.grown(judging.beyond.max(MIDDLE));
    // as many layers of the good body as of the job; of the last one what comes after the middle has frozen warms it no more
    let lower = vec![path.as_ref().clone(); plan.lower.len()];
    let path = match within(path, &focus).map_err(StrategyError::from)? {
        Some(part) => &path.between(path.begin(), part.end() + FROZEN),
        None => path.as_ref(),
    };
    let below = plan.below_good();
    let ground = ground(&below);
    let nothing = Watch {
        places: Vec::new(),
        every: f64::INFINITY,
    };
    let drawn = variants(resolution, count, &|wanted, _| {
        let body = Body {
            kept: plan.kept.as_deref(),
            ..body(settings, &ground)
        };
        let seen = (Some(&focus), &nothing);
        let drawn = watched(&body, &lower, path, wanted, seen, &Quiet(observer))?;
        observer.advance(1);
        Ok(drawn)
    })?;
    let classes = |(_, drawn): &(Resolution, Reference)| -> Result<Classes, EbmError> {
        let centre = centre(&drawn.highest, melting, &hull, &square)?;
        Ok(Classes::calibrated(melting, centre, width))
    };
    drawn.iter().map(classes).collect()
}

/// What is looked at in the run as asked: the places of the job, or the hottest one on the charts.
fn watch(plan: &Plan, judging: &Judge, hottest: Option<[f64; 3]>) -> Watch {
    let top = plan.lower.len() as f64 * plan.settings.job.ebm.layer.0;
    let asked = judging.places.iter();
    let asked = asked.map(|([x, y], z)| [*x, *y, z.unwrap_or(top)]);
    let hottest = hottest.filter(|_| judging.places.is_empty());
    Watch {
        places: asked.chain(hottest).collect(),
        every: judging.every,
    }
}

/// What the paths of a job are judged with.
struct Court<'a> {
    plan: &'a Plan,
    judging: &'a Judge,
    resolution: Resolution,
    on_charts: Option<&'a Classes>,
    /// What is to stay free of metal within the outline.
    hollows: Vec<(Hollow, Contour)>,
}

impl Court<'_> {
    fn tally(&self, highest: &Field, classes: &Classes) -> Tally {
        let part = self.judging.part.as_ref().map(|p| (p, 0.0));
        tally(highest, classes, &self.plan.contour, 0.0, part)
    }

    /// A run with its own window, and that of the run as set.
    fn run(
        &self,
        n: usize,
        wanted: Resolution,
        drawn: &Reference,
        [classes, as_set]: [&Classes; 2],
    ) -> Run {
        let (plan, classes) = (self.plan, *classes);
        let tally = self.tally(&drawn.highest, &classes);
        Run {
            outside: outside(
                &drawn.highest,
                classes.melting,
                &plan.contour,
                plan.settings.job.checks.rim.0,
                self.judging.part.as_ref(),
                area_within(&plan.contour, self.judging.part.as_ref()),
            ),
            hole: fullest_hole(
                &drawn.highest,
                classes.melting,
                &self.hollows,
                self.judging.part.as_ref(),
            ),
            variant: Variant::ALL[n],
            resolution: Resolution {
                step: drawn.step,
                ..wanted
            },
            as_it_was: self.tally(&drawn.highest, as_set),
            unfused: unfused(self.plan, self.judging.part.as_ref(), &drawn.foot),
            ledger: drawn.ledger,
            tally,
            classes,
            residual: drawn.residual,
        }
    }

    /// Draws a path with the first `count` variants.
    fn drawn(
        &self,
        previewed: Previewed<'_>,
        count: usize,
        observer: &dyn Observer,
    ) -> Result<Vec<(Resolution, Reference)>, EbmError> {
        let (plan, judging) = (self.plan, self.judging);
        let ground = ground(&plan.below);
        let Previewed { path, highest } = previewed;
        let hottest = highest.zip(self.on_charts).map(|(highest, classes)| {
            let [i, j, k] = self.tally(highest, classes).hottest.1;
            highest.grid.centre(i, j, k).to_array()
        });
        let watch = watch(plan, judging, hottest);
        let focus = judging.part.map(|p| p.grown(judging.beyond));
        variants(&self.resolution, count, &|wanted, _| {
            let body = Body {
                kept: plan.kept.as_deref(),
                ..body(&plan.settings, &ground)
            };
            let seen = (focus.as_ref(), &watch);
            let drawn = watched(&body, &plan.lower, path, wanted, seen, &Quiet(observer))?;
            observer.advance(1);
            Ok(drawn)
        })
    }

    fn judged(
        &self,
        previewed: Previewed<'_>,
        drawn: Vec<(Resolution, Reference)>,
        windows: &[Classes],
    ) -> Result<JudgedPath, EbmError> {
        let runs = drawn.iter().zip(windows).enumerate();
        let runs = runs
            .map(|(n, ((wanted, drawn), own))| self.run(n, *wanted, drawn, [own, &windows[0]]))
            .collect();
        let surfaces: Vec<Surface<'_>> = drawn
            .iter()
            .zip(Variant::ALL)
            .map(|((_, drawn), variant)| Surface {
                variant,
                highest: &drawn.surface,
            })
            .collect();
        let ends = ends(
            &self.plan.settings,
            previewed.path,
            &surfaces,
            |field, classes| self.tally(field, classes),
        );
        let of_layers = drawn.iter().zip(Variant::ALL);
        let lower = Lower::of(
            &self.plan.settings,
            &self.plan.lower,
            of_layers.map(|((_, drawn), variant)| (variant, drawn.layers.as_slice())),
        );
        let (_, first) = drawn.into_iter().next().ok_or(EbmError::GoodBody)?;
        Ok(JudgedPath {
            runs,
            on_charts: previewed
                .highest
                .zip(self.on_charts)
                .map(|(highest, classes)| self.tally(highest, classes)),
            ends,
            lower,
            undrawn: {
                let (grid, contour) = (&first.highest.grid, &self.plan.contour);
                let part = self.judging.part.as_ref();
                area_beyond(grid, contour, 0.0, part, None) / contour.region().area()
            },
            molten: molten_area(&first.highest, self.plan.settings.material.liquidus),
            highest: first.highest,
            foot: first.foot,
            watched: first.watched,
            layers: first.layers,
        })
    }
}

/// Judges the path as given and the better one.
///
/// # Errors
/// [`EbmError`].
pub fn judge_paths(
    plan: &Plan,
    judging: &Judge,
    on_charts: Option<&Classes>,
    given: Previewed<'_>,
    better: Option<Previewed<'_>>,
    observer: &dyn Observer,
) -> Result<Judged, EbmError> {
    let resolution = Resolution {
        domain: domain(plan, judging),
        ..judging.resolution
    };
    if let Some(part) = judging.part
        && within(&plan.path, &part.grown(judging.beyond))
            .map_err(StrategyError::from)?
            .is_none()
    {
        let Rectangle { low, high } = part.grown(judging.beyond);
        return Err(EbmError::EmptyPart { low, high });
    }
    let court = Court {
        plan,
        judging,
        resolution,
        on_charts,
        hollows: hollows(&plan.contour, plan.settings.job.checks.rim.0),
    };
    let all = Variant::ALL.len();
    // of a path that gives way to a better one nothing is claimed
    let count = if better.is_some() { 1 } else { all };
    let of_good = match plan.window {
        Window::Fixed(_) => 0,
        Window::Good { .. } => all,
    };
    let of_better = if better.is_some() { all } else { 0 };
    observer.stage("judge the path", (of_good + count + of_better) as u64);
    // all at once: cores share whole runs better than the steps of one
    let draw = |path: Previewed<'_>, count: usize| court.drawn(path, count, observer);
    let (windows, (on_given, on_better)) = rayon::join(
        || windows(plan, judging, &resolution, all, observer),
        || rayon::join(|| draw(given, count), || better.map(|path| draw(path, all))),
    );
    let windows = windows?;
    let better = better.zip(on_better);
    Ok(Judged {
        classes: windows[0],
        given: court.judged(given, on_given?, &windows)?,
        better: better
            .map(|(path, drawn)| court.judged(path, drawn?, &windows))
            .transpose()?,
    })
}
