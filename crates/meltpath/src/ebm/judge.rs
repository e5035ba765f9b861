//! The paths of a job on the reference solver: shares in the window with what moves them.

use meltpath_base::{Observer, Reporter};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::judgement::{Body, Resolution, Share, Variant, judge};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::part::{Rectangle, within};
use meltpath_thermal::run::RunError;
use meltpath_thermal::solver::State;
use meltpath_thermal::strategy::StrategyError;

use super::region::{Below, Contour};
use super::run::EbmError;
use super::settings::{Judge, Settings, Window};
use super::simulate::Drawn;

/// One run of the judge.
#[derive(Debug, Clone)]
pub struct Run {
    /// What it changes.
    pub variant: Variant,
    /// Cell, step as taken, power.
    pub resolution: Resolution,
    /// The judged voxels.
    pub tally: Tally,
    /// What the solver lost of the heat.
    pub residual: f64,
    /// Updates of cells.
    pub updates: u64,
}

/// A path as the reference solver sees it.
#[derive(Debug, Clone)]
pub struct JudgedPath {
    /// The share in the window.
    pub share: Share,
    /// The runs, the one as asked first.
    pub runs: Vec<Run>,
    /// Highest temperatures of the run as asked, K.
    pub highest: Field,
    /// The same voxels on the charts, in the charts' window.
    pub on_charts: Option<Tally>,
}

/// What the judge found.
#[derive(Debug, Clone)]
pub struct Judged {
    /// The window on the scale of this solver.
    pub classes: Classes,
    /// The path as given.
    pub given: JudgedPath,
    /// The one with better speeds.
    pub better: Option<JudgedPath>,
}

/// Half the width of the square in the middle of a good body that its temperature is read from, mm.
const MIDDLE: f64 = 0.6;

/// Voxels of the top plane of `highest` well inside the contour and the part.
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
    Tally::of(highest, classes, |[i, j, k]| k == top && judged[j * nx + i])
}

fn body(settings: &Settings) -> Body<'_> {
    Body {
        material: &settings.material,
        beam: &settings.beam,
        layer: settings.layer,
        ground: match settings.below {
            Below::Metal => State::Dense,
            Below::Areas(_) => State::Powder,
        },
    }
}

fn cut(path: &BeamPath, rectangle: &Rectangle) -> Result<BeamPath, EbmError> {
    let part = within(path, rectangle).map_err(StrategyError::from)?;
    part.ok_or(EbmError::EmptyPart {
        low: rectangle.low,
        high: rectangle.high,
    })
}

/// The window on the scale of the reference solver.
fn classes(
    settings: &Settings,
    judging: &Judge,
    observer: &dyn Observer,
) -> Result<Classes, EbmError> {
    let melting = settings.material.liquidus;
    match &settings.window {
        Window::Fixed(window) => Ok(Classes {
            melting,
            window: *window,
        }),
        Window::Good { path, width } => {
            let points: Vec<[f64; 2]> = path.points().iter().map(|p| [p.x, p.y]).collect();
            let hull = Contour::hull(&points);
            let middle = hull.deepest();
            let square = Rectangle {
                low: middle,
                high: middle,
            }
            .grown(MIDDLE);
            let part = cut(path, &square.grown(judging.beyond.max(MIDDLE)))?;
            // as many layers of the good body as of the job
            let layers = vec![part; settings.lower.len() + 1];
            let drawn = judge(&body(settings), &layers, &judging.resolution, observer)?;
            let any = Classes {
                melting,
                window: [melting, f64::INFINITY],
            };
            let tally = tally(&drawn.highest, &any, &hull, 0.0, Some((&square, 0.0)));
            if tally.molten() == 0 {
                return Err(EbmError::GoodBody);
            }
            Ok(Classes::calibrated(melting, tally.mean, *width))
        }
    }
}

fn judged(
    settings: &Settings,
    judging: &Judge,
    classes: [&Classes; 2],
    path: &BeamPath,
    on_charts: Option<&Field>,
    spare: &Field,
    observer: &dyn Observer,
) -> Result<JudgedPath, EbmError> {
    let mut paths = Vec::with_capacity(settings.lower.len() + 1);
    for path in settings.lower.iter().chain([path]) {
        paths.push(match &judging.part {
            Some(part) => cut(path, &part.grown(judging.beyond))?,
            None => path.clone(),
        });
    }
    let part = judging.part.as_ref().map(|p| (p, judging.beyond));
    let of = |highest: &Field, classes: &Classes| {
        tally(highest, classes, &settings.contour, settings.inside, part)
    };
    let mut runs: Vec<Run> = Vec::new();
    let mut highest = None;
    for variant in Variant::ALL {
        let taken = runs
            .first()
            .map_or(judging.resolution.step, |r: &Run| r.resolution.step);
        let wanted = judging.resolution.of(variant, taken);
        let drawn = judge(&body(settings), &paths, &wanted, observer)?;
        runs.push(Run {
            variant,
            resolution: Resolution {
                step: drawn.step,
                ..wanted
            },
            tally: of(&drawn.highest, classes[0]),
            residual: drawn.residual,
            updates: drawn.updates,
        });
        highest.get_or_insert(drawn.highest);
    }
    let shares: Vec<f64> = runs.iter().map(|r| r.tally.share(Class::Good)).collect();
    let share = Share {
        value: shares[0],
        changes: runs
            .iter()
            .zip(&shares)
            .skip(1)
            .map(|(r, s)| (r.variant, s - shares[0]))
            .collect(),
    };
    Ok(JudgedPath {
        share,
        runs,
        on_charts: on_charts.map(|highest| of(highest, classes[1])),
        highest: highest.unwrap_or_else(|| spare.clone()),
    })
}

/// Judges the path as given and the better one: its path, and what charts say of it where they can.
///
/// # Errors
/// [`EbmError`].
pub fn judge_paths(
    settings: &Settings,
    judging: &Judge,
    on_charts: &Classes,
    given: &Drawn,
    better: Option<(&BeamPath, Option<&Drawn>)>,
    observer: &dyn Observer,
) -> Result<Judged, EbmError> {
    let classes = classes(settings, judging, observer)?;
    let both = [&classes, on_charts];
    Ok(Judged {
        given: judged(
            settings,
            judging,
            both,
            &given.path,
            Some(&given.highest),
            &given.highest,
            observer,
        )?,
        better: better
            .map(|(path, drawn)| {
                let on_charts = drawn.map(|d| &d.highest);
                judged(
                    settings,
                    judging,
                    both,
                    path,
                    on_charts,
                    &given.highest,
                    observer,
                )
            })
            .transpose()?,
        classes,
    })
}

/// Warns where the reference solver leaves the range of the laws.
pub(super) fn tell(judged: &Judged, material: &Material, reporter: &Reporter) {
    let paths = [Some(&judged.given), judged.better.as_ref()];
    let hottest = paths
        .into_iter()
        .flatten()
        .map(|p| p.highest.largest().0)
        .fold(0.0, f64::max);
    if hottest > material.range[1] {
        reporter.warn(
            "laws-extrapolated-judge",
            format!(
                "on the reference solver the hottest cell reaches {:.0} °C, the laws of {} are meant up to {:.0} °C",
                hottest - CELSIUS,
                material.name,
                material.range[1] - CELSIUS
            ),
            "shares compare strategies on one scale; read no boiling or evaporation from them",
        );
    }
}

/// Whether an error is a cancellation.
pub(super) fn cancelled(error: &RunError) -> Option<meltpath_base::Cancelled> {
    match error {
        RunError::Solver(meltpath_thermal::solver::SolverError::Cancelled(c)) => Some(*c),
        _ => None,
    }
}
