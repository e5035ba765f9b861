//! The paths of a job on the reference solver: what becomes of every point of the section, with what moves the figures.

use meltpath_base::{Observer, Reporter};
use meltpath_melt_strategy::bed::{Body, Reading, Resolution};
use meltpath_melt_strategy::error::StrategyError;
use meltpath_melt_strategy::judgement::{Share, Variant, judge, watched};
use meltpath_melt_strategy::part::{Rectangle, within};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::State;
use meltpath_thermal::solver::watch::{Watch, Watched};

use super::drawn::Drawn;
use super::error::EbmError;
use super::plan::{Plan, Window};
use super::region::{Below, Contour};
use super::settings::{Judge, Settings};

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
    /// The share of the section in the window of the run as asked, which a change between the good body and this one would hit.
    pub as_it_was: f64,
    /// What the solver lost of the heat.
    pub residual: f64,
    /// Updates of cells.
    pub updates: u64,
}

/// Metal that is molten outside the contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outside {
    /// Area beyond the rim, as a share of the section's.
    pub share: f64,
    /// Greatest distance from the contour, mm.
    pub farthest: f64,
}

/// A path as the reference solver sees it.
#[derive(Debug, Clone)]
pub struct JudgedPath {
    /// The runs, the one as asked first.
    pub runs: Vec<Run>,
    /// Highest temperatures of the run as asked, K.
    pub highest: Field,
    /// What else the run as asked showed.
    pub watched: Watched,
    /// The same voxels on the charts, in the charts' window.
    pub on_charts: Option<Tally>,
}

impl JudgedPath {
    /// A figure of the run as asked, and what changes of it with each of the others.
    pub fn moved(&self, figure: impl Fn(&Run) -> f64) -> Share {
        let value = figure(&self.runs[0]);
        Share {
            value,
            changes: self.runs[1..]
                .iter()
                .map(|run| (run.variant, figure(run) - value))
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

/// What melts outside the contour, beyond `rim` mm of it or nearer, in the judged part; `section` is the tally inside.
fn outside(
    highest: &Field,
    melting: f64,
    contour: &Contour,
    rim: f64,
    part: Option<&Rectangle>,
    section: &Tally,
) -> Outside {
    let grid = &highest.grid;
    let top = grid.planes() - 1;
    let [nx, ny] = grid.cells;
    let (mut cells, mut farthest) = (0, 0.0_f64);
    for n in 0..nx * ny {
        let (i, j) = (n % nx, n / nx);
        let c = grid.centre(i, j, top);
        let point = [c.x, c.y];
        let away = -contour.depth(point);
        let judged = part.is_none_or(|part| part.depth(point) > 0.0);
        if away > 0.0 && judged && highest.at(i, j, top) >= melting {
            farthest = farthest.max(away);
            cells += usize::from(away > rim);
        }
    }
    Outside {
        share: cells as f64 / section.voxels as f64,
        farthest,
    }
}

/// What the region is drawn on, with `ground` from [`ground`].
pub(super) fn body<'a>(settings: &'a Settings, ground: &'a dyn Fn([f64; 2]) -> State) -> Body<'a> {
    Body {
        material: &settings.material,
        beam: &settings.beam,
        layer: settings.layer,
        reading: settings
            .judge
            .as_ref()
            .map_or(Reading::LayerMean, |j| Reading::Depth(j.depth)),
        ground,
    }
}

/// What lies under the first layer at a place of the region.
pub(super) fn ground(below: &Below) -> impl Fn([f64; 2]) -> State {
    move |point| {
        if below.is_metal(point) {
            State::Dense
        } else {
            State::Powder
        }
    }
}

fn cut(path: &BeamPath, rectangle: &Rectangle) -> Result<BeamPath, EbmError> {
    let part = within(path, rectangle).map_err(StrategyError::from)?;
    part.ok_or(EbmError::EmptyPart {
        low: rectangle.low,
        high: rectangle.high,
    })
}

/// The window on the scale of the reference solver with these cells, steps and power.
fn classes(
    plan: &Plan,
    judging: &Judge,
    resolution: &Resolution,
    observer: &dyn Observer,
) -> Result<Classes, EbmError> {
    let settings = &plan.settings;
    let melting = settings.material.liquidus;
    match &plan.window {
        Window::Fixed(window) => Ok(Classes {
            melting,
            window: *window,
        }),
        Window::Good { path, width } => {
            let (hull, square) = middle(path);
            let part = cut(path, &square.grown(judging.beyond.max(MIDDLE)))?;
            // as many layers of the good body as of the job
            let lower = vec![part.clone(); plan.lower.len()];
            let below = plan.below_good();
            let ground = ground(&below);
            let drawn = judge(
                &body(settings, &ground),
                &lower,
                &part,
                resolution,
                observer,
            )?;
            let centre = centre(&drawn.highest, melting, &hull, &square)?;
            Ok(Classes::calibrated(melting, centre, *width))
        }
    }
}

/// What is looked at in the run as asked: the places of the job, or the hottest one on the charts.
fn watch(plan: &Plan, judging: &Judge, hottest: Option<[f64; 3]>) -> Watch {
    let top = plan.lower.len() as f64 * plan.settings.layer;
    let asked = judging.places.iter();
    let asked = asked.map(|([x, y], z)| [*x, *y, z.unwrap_or(top)]);
    let hottest = hottest.filter(|_| judging.places.is_empty());
    Watch {
        places: asked.chain(hottest).collect(),
        every: judging.every,
    }
}

/// The windows of the variants, found when first needed.
struct Windows<'a> {
    plan: &'a Plan,
    judging: &'a Judge,
    found: Vec<Classes>,
}

impl Windows<'_> {
    fn of(
        &mut self,
        variant: usize,
        resolution: &Resolution,
        observer: &dyn Observer,
    ) -> Result<Classes, EbmError> {
        if let Some(found) = self.found.get(variant) {
            return Ok(*found);
        }
        let found = classes(self.plan, self.judging, resolution, observer)?;
        self.found.push(found);
        Ok(found)
    }
}

fn judged(
    windows: &mut Windows<'_>,
    on_charts: &Classes,
    path: &BeamPath,
    charts: Option<&Field>,
    variants: &[Variant],
    observer: &dyn Observer,
) -> Result<JudgedPath, EbmError> {
    let (plan, judging) = (windows.plan, windows.judging);
    let settings = &plan.settings;
    let wanted = |path: &BeamPath| match &judging.part {
        Some(part) => cut(path, &part.grown(judging.beyond)),
        None => Ok(path.clone()),
    };
    let lower = plan.lower.iter().map(wanted);
    let lower = lower.collect::<Result<Vec<BeamPath>, _>>()?;
    let whole_begin = path.begin();
    let path = wanted(path)?;
    let part = judging.part.as_ref();
    let of = |highest: &Field, classes: &Classes| {
        tally(highest, classes, &plan.contour, 0.0, part.map(|p| (p, 0.0)))
    };
    let ground = ground(&plan.below);
    let body = body(settings, &ground);
    let charts_tally = charts.map(|highest| (of(highest, on_charts), &highest.grid));
    let hottest = charts_tally.as_ref().map(|(tally, grid)| {
        let [i, j, k] = tally.hottest.1;
        grid.centre(i, j, k).to_array()
    });
    let watch = watch(plan, judging, hottest);
    let mut runs: Vec<Run> = Vec::new();
    let mut first: Option<(Field, Classes, f64)> = None;
    let mut seen: Option<Watched> = None;
    for (n, variant) in variants.iter().copied().enumerate() {
        let taken = first.as_ref().map_or(judging.resolution.step, |f| f.2);
        let wanted = judging.resolution.of(variant, taken);
        let watch = (n == 0).then_some(&watch);
        let drawn = watched(&body, &lower, &path, &wanted, watch, observer)?;
        seen = seen.or(drawn.watched);
        let classes = windows.of(n, &wanted, observer)?;
        let window = first.as_ref().map_or(classes, |f| f.1);
        let section = of(&drawn.highest, &classes);
        runs.push(Run {
            outside: outside(
                &drawn.highest,
                classes.melting,
                &plan.contour,
                settings.checks.rim,
                part,
                &section,
            ),
            variant,
            resolution: Resolution {
                step: drawn.step,
                ..wanted
            },
            tally: section,
            as_it_was: of_all(&of(&drawn.highest, &window), Class::Good),
            classes,
            residual: drawn.residual,
            updates: drawn.updates,
        });
        first.get_or_insert((drawn.highest, classes, drawn.step));
    }
    let (Some((highest, _, _)), Some(mut watched)) = (first, seen) else {
        return Err(EbmError::GoodBody);
    };
    watched.count_from(path.begin() - whole_begin);
    Ok(JudgedPath {
        runs,
        on_charts: charts_tally.map(|(tally, _)| tally),
        highest,
        watched,
    })
}

/// Judges the path as given and the better one: its path, and what charts say of it where they can.
///
/// # Errors
/// [`EbmError`].
pub fn judge_paths(
    plan: &Plan,
    judging: &Judge,
    on_charts: &Classes,
    given: &Drawn,
    better: Option<(&BeamPath, Option<&Drawn>)>,
    observer: &dyn Observer,
) -> Result<Judged, EbmError> {
    let mut windows = Windows {
        plan,
        judging,
        found: Vec::new(),
    };
    let mut one = |path: &BeamPath, drawn: Option<&Drawn>, variants: &[Variant]| {
        let highest = drawn.map(|d| &d.highest);
        judged(&mut windows, on_charts, path, highest, variants, observer)
    };
    // of a path that gives way to a better one nothing is claimed
    let variants: &[Variant] = match better {
        Some(_) => &[Variant::Base],
        None => &Variant::ALL,
    };
    let given = one(&given.path, Some(given), variants)?;
    let better = better
        .map(|(path, drawn)| one(path, drawn, &Variant::ALL))
        .transpose()?;
    Ok(Judged {
        classes: given.runs[0].classes,
        given,
        better,
    })
}

/// Warns where fields of the reference solver leave the range of the laws.
pub(super) fn tell<'a>(
    fields: impl Iterator<Item = &'a Field>,
    material: &Material,
    reporter: &Reporter,
) {
    let hottest = fields.map(|f| f.largest().0).fold(0.0, f64::max);
    if hottest > material.range[1] {
        reporter.warn(
            "laws-extrapolated-reference",
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

/// Warns of places of the job that the judge did not draw.
pub(super) fn tell_outside<'a>(paths: impl Iterator<Item = &'a JudgedPath>, reporter: &Reporter) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_thermal::grid::Grid;

    /// A square of 1 mm, metal molten 0.2 mm beyond two of its sides: one row of cells lies beyond the rim, none in the other part.
    #[test]
    fn what_melts_outside_is_counted_beyond_the_rim() {
        let edge = DVec3::new(0.1, 0.1, 0.1);
        let grid = Grid::covering(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.1), edge);
        let grid = grid.unwrap();
        let values = (0..grid.len())
            .map(|n| grid.centre(n % grid.cells[0], n / grid.cells[0], 0))
            .map(|c| {
                if c.x.abs() < 0.7 && c.y.abs() < 0.5 {
                    2100.0
                } else {
                    900.0
                }
            })
            .collect();
        let field = Field { grid, values };
        let square = Contour::rectangle([1.0, 1.0]);
        let classes = Classes {
            melting: 2000.0,
            window: [2050.0, 2200.0],
        };
        let section = tally(&field, &classes, &square, 0.0, None);
        assert_eq!((section.voxels, of_all(&section, Class::Good)), (100, 1.0));
        let found = outside(&field, 2000.0, &square, 0.1, None, &section);
        assert!(
            (found.share - 0.2).abs() < 1e-9 && (found.farthest - 0.15).abs() < 1e-9,
            "{found:?}"
        );
        let right = Rectangle {
            low: [0.0, -1.0],
            high: [0.6, 1.0],
        };
        let found = outside(&field, 2000.0, &square, 0.1, Some(&right), &section);
        assert!(
            found.share == 0.0 && (found.farthest - 0.05).abs() < 1e-9,
            "{found:?}"
        );
    }
}
