//! What the laser melts: the marked path, with its lag, its corners and its late light, drawn by the semi-analytic heat engine
//! beside the commanded one.
//!
//! A layer is joined to the one below where the metal was liquid at its lower face. What the commanded path melts there and
//! the marked one does not is the machine's doing; what neither melts, the recipe's.

mod again;
mod beam;
mod boiling;
mod dwell;
mod ground;
mod judge;
mod keyhole;
mod pace;
mod settings;
mod standing;
mod surface;
mod weakest;

use meltpath_base::Observer;
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_thermal::beam::{Beam, BeamError, BeamPath, BeamPoint};
use meltpath_thermal::pool::fusion::{Following, FusionError, FusionMap, TracePoint, follow};
use meltpath_thermal::pool::history::Memory;
use meltpath_thermal::pool::moving_source::{MovingSource, MovingSourceError};
use meltpath_thermal::solver::source::Depth;

use again::WarmPlaces;
use beam::{commanded, lit};
use boiling::Boiling;
pub use ground::OnLiquid;
use ground::{GroundError, Parted};
use pace::Slow;
use standing::Standing;
use surface::{beside, closed};
use weakest::Choice;

pub(super) use again::check as again_check;
pub use beam::BeamRecord;
pub(super) use dwell::{check as dwell_check, told as tell_waits};
pub use judge::check;
pub(crate) use judge::dug;
pub(super) use keyhole::check as keyhole_check;
pub use pace::{LitPace, Pace};
pub use settings::{HeatSettings, resolve};
pub(super) use weakest::{Looked, look};

/// Distance along the path from look to look, in spot diameters.
const LOOK: f64 = 0.7;

/// Looks from one measured pool to the next.
const PER_POOL: usize = 4;

/// How much less and more is absorbed in the third and fourth drawing: what measured tracks that conduct differ by from the engine
/// (docs/theory/heat.md, tracks that NIST measured: depths by −23 %, widths by +23 %).
const ABSORBED: [f64; 2] = [0.8, 1.2];

meltpath_base::passes_on! {
    /// Why the heat of a path could not be told.
    pub enum HeatError {
        /// The path.
        Path(BeamError),
        /// The engine.
        Fusion(FusionError),
        /// The pool's medium.
        Engine(MovingSourceError),
    }
}

impl From<GroundError> for HeatError {
    fn from(error: GroundError) -> Self {
        match error {
            GroundError::Path(error) => HeatError::Path(error),
            GroundError::Fusion(error) => HeatError::Fusion(error),
        }
    }
}

/// What one drawing melted.
#[derive(Debug, Clone)]
pub struct Melted {
    /// In words.
    pub name: &'static str,
    /// Highest temperatures at the layer's lower face.
    pub map: FusionMap,
    /// Pools along the path.
    pub trace: Vec<TracePoint>,
    /// Area melted through, mm².
    pub area: f64,
    /// Share of the surface that is melted through.
    pub share: f64,
}

/// Where something stayed powder under the marked path: middle of a square of [`Cold::SIDE`] mm, and the share of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cold {
    /// Middle, mm.
    pub place: [f64; 2],
    /// Share of its cells that belong to the surface and are not melted through.
    pub share: f64,
}

impl Cold {
    /// Side of the squares, mm.
    pub const SIDE: f64 = 0.1;
}

/// What a head did in light.
#[derive(Debug, Clone)]
pub(super) struct InLight {
    /// What the power follows.
    pub(super) law: PowerLaw,
    /// The path of what is looked at.
    pub(super) record: BeamRecord,
    /// How the spot ran, in all layers.
    pub(super) pace: Pace,
}

/// What a recipe melts.
#[derive(Debug, Clone)]
pub struct RecipeHeat {
    /// As commanded, as marked, as marked with a fifth less and a fifth more absorbed.
    pub drawings: [Melted; 4],
    /// The surface, mm²: half a hatch beside the commanded lines, and what these melt through, with the gaps between.
    pub surface: f64,
    /// Where the marked path leaves powder, by squares.
    pub cold: Vec<Cold>,
    /// Which layer or square is drawn.
    pub choice: Choice,
    /// How near its marks bring the surface to boiling.
    pub own: Vec<Boiling>,
    /// How near the marks of all layers do.
    pub boiling: Vec<Boiling>,
    /// Where the lit beam stands and heats the most, in all layers: between marks, or as simulated.
    pub standing: Option<Standing>,
    /// Where the simulated spot runs nearest to a keyhole, in all layers.
    pub slowest: Option<Slow>,
    /// Places that are marked again while they are warm, in all layers.
    pub warm: Option<WarmPlaces>,
    /// Share of the surface that a fifth more absorbed melts through, or that lies beside marks that bring it near boiling: more is not melted.
    pub bound: f64,
    /// What is drawn where the metal is still liquid, as marked.
    pub liquid: Option<OnLiquid>,
    /// Whether marks were left out.
    pub cut: bool,
}

/// Draws the layer or square of a recipe that is looked at, whose lines lie `hatch` mm apart.
///
/// # Errors
/// [`HeatError`].
pub(super) fn melt(
    settings: &HeatSettings,
    looked: &Looked,
    InLight { law, record, pace }: InLight,
    hatch: f64,
    observer: &dyn Observer,
) -> Result<RecipeHeat, HeatError> {
    let asked = commanded((&looked.job, law), settings.marks, settings.spot)?;
    let cut = record.cut;
    let marked = BeamPath::new(record.points)?;
    let plain = frame(settings, &asked, [hatch, looked.choice.depth])?;
    let drawn = |name, path, share| drawn(settings, &plain, (name, path, share), observer);
    let (first, (others, ground)) = rayon::join(
        || drawn("as commanded", &asked, 1.0),
        || {
            rayon::join(
                || three(|name, share| drawn(name, &marked, share)),
                || on_solid(settings, &plain, &marked, observer),
            )
        },
    );
    let [second, third, fourth] = others;
    let drawings = [first?, second?, third?, fourth?];
    Ok(told(
        settings,
        (drawings, ground?),
        (&asked, hatch),
        (looked, cut, &pace),
    ))
}

/// Draws the path that the same recipe has on a head that behaves otherwise: what was commanded is that of `value`.
///
/// # Errors
/// [`HeatError`].
pub(super) fn melt_otherwise(
    settings: &HeatSettings,
    value: &RecipeHeat,
    looked: &Looked,
    InLight { law, record, pace }: InLight,
    hatch: f64,
    observer: &dyn Observer,
) -> Result<RecipeHeat, HeatError> {
    let asked = commanded((&looked.job, law), settings.marks, settings.spot)?;
    let plain = frame(settings, &asked, [hatch, looked.choice.depth])?;
    let cut = record.cut;
    let marked = BeamPath::new(record.points)?;
    let (others, ground) = rayon::join(
        || three(|name, share| drawn(settings, &plain, (name, &marked, share), observer)),
        || on_solid(settings, &plain, &marked, observer),
    );
    let [second, third, fourth] = others;
    let drawings = [value.drawings[0].clone(), second?, third?, fourth?];
    Ok(told(
        settings,
        (drawings, ground?),
        (&asked, hatch),
        (looked, cut, &pace),
    ))
}

/// The marked path with what the job says is absorbed, with less and with more.
fn three<R: Send>(draw: impl Fn(&'static str, f64) -> R + Sync) -> [R; 3] {
    let [less, more] = ABSORBED;
    let (second, (third, fourth)) = rayon::join(
        || draw("as marked", 1.0),
        || {
            rayon::join(
                || draw("as marked, a fifth less absorbed", less),
                || draw("as marked, a fifth more absorbed", more),
            )
        },
    );
    [second, third, fourth]
}

/// The map round the commanded marks, nothing melted. Half a hatch and a spot beside them it holds whatever the margin: what is
/// judged lies there.
fn frame(
    settings: &HeatSettings,
    asked: &BeamPath,
    [hatch, depth]: [f64; 2],
) -> Result<FusionMap, HeatError> {
    let margin = settings.margin.max(0.5 * hatch + settings.spot);
    let marks = |axis: fn(&BeamPoint) -> f64| {
        let ends = lit(asked).flatten().map(axis);
        ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    };
    let ([x0, x1], [y0, y1]) = (marks(|p| p.x), marks(|p| p.y));
    Ok(FusionMap::covering(
        [x0 - margin, y0 - margin],
        [x1 + margin, y1 + margin],
        settings.cell,
        depth,
        settings.medium.ambient,
    )?)
}

/// A beam of which a share of what the job says is absorbed.
fn beam(settings: &HeatSettings, share: f64) -> Beam {
    Beam {
        efficiency: share * settings.absorptivity,
        depth: Depth::Surface,
    }
}

/// What the marked path draws on liquid ground, and what it melts without the heat that falls there; `None` where there is no such ground.
fn on_solid(
    settings: &HeatSettings,
    plain: &FusionMap,
    marked: &BeamPath,
    observer: &dyn Observer,
) -> Result<Option<(Parted, Melted)>, HeatError> {
    let Some(parted) = ground::parted(settings, marked, beam(settings, 1.0), observer)? else {
        return Ok(None);
    };
    let what = ("as marked on solid ground", &parted.solid, 1.0);
    let melted = drawn(settings, plain, what, observer)?;
    Ok(Some((parted, melted)))
}

/// Follows a path of which a share of the heat is absorbed, on the map `plain`.
fn drawn(
    settings: &HeatSettings,
    plain: &FusionMap,
    (name, path, share): (&'static str, &BeamPath, f64),
    observer: &dyn Observer,
) -> Result<Melted, HeatError> {
    let beam = beam(settings, share);
    let mut engine = MovingSource::new(settings.medium, path.clone(), beam, Memory::Folded)?;
    let mut map = plain.clone();
    let following = Following {
        step: LOOK * settings.spot,
        per_pool: PER_POOL,
    };
    let trace = follow(
        &mut engine,
        settings.material.liquidus,
        &mut map,
        following,
        observer,
    )?;
    Ok(Melted {
        name,
        map,
        trace,
        area: 0.0,
        share: 0.0,
    })
}

/// Areas and shares of the drawings.
fn told(
    settings: &HeatSettings,
    (mut drawings, ground): ([Melted; 4], Option<(Parted, Melted)>),
    (asked, hatch): (&BeamPath, f64),
    (looked, cut, pace): (&Looked, bool, &Pace),
) -> RecipeHeat {
    let liquidus = settings.material.liquidus;
    let melted = drawings
        .each_ref()
        .map(|d| d.map.hotter(liquidus).collect::<Vec<bool>>());
    let plain = &drawings[0].map;
    let mut surface = closed(&melted[0], plain.cells, hatch / settings.cell);
    // what is commanded to be drawn counts where nothing melts, too
    beside(&mut surface, plain, (asked, |_| true), 0.5 * hatch);
    let count = |cells: &mut dyn Iterator<Item = bool>| cells.filter(|c| *c).count() as f64;
    let all = count(&mut surface.iter().copied());
    let one = settings.cell * settings.cell;
    let mut bound = melted[3].clone();
    let near_boiling = |way: [&BeamPoint; 2]| boiling::vapour(settings, way);
    beside(&mut bound, plain, (asked, near_boiling), 0.5 * hatch);
    let of_surface = |cells: &[bool]| {
        let both = cells.iter().zip(&surface).map(|(a, b)| *a && *b);
        both.filter(|c| *c).count() as f64 / all.max(1.0)
    };
    let liquid = ground.map(|(parted, melted)| {
        let without: Vec<bool> = melted.map.hotter(liquidus).collect();
        let mut with = bound.clone();
        beside(&mut with, plain, (&parted.liquid, |_| true), 0.5 * hatch);
        OnLiquid {
            length: parted.length,
            place: parted.place,
            without: of_surface(&without),
            with: of_surface(&with),
        }
    });
    let bound = of_surface(&bound);
    for (drawing, here) in drawings.iter_mut().zip(&melted) {
        drawing.area = count(&mut here.iter().copied()) * one;
        drawing.share = of_surface(here);
    }
    // squares have no layers
    let layered = |layer: Option<u32>| looked.choice.layer.and(layer);
    let standing = pace.standing.map(|s| Standing {
        layer: layered(s.layer),
        ..s
    });
    RecipeHeat {
        surface: all * one,
        cold: cold(&drawings[0].map, &surface, &melted[1]),
        choice: looked.choice,
        own: looked.own.clone(),
        boiling: looked.all.clone(),
        standing: looked
            .standing
            .into_iter()
            .chain(standing)
            .max_by(Standing::hotter),
        slowest: pace.slowest.map(|s| Slow {
            boiling: Boiling {
                layer: layered(s.boiling.layer),
                ..s.boiling
            },
            ..s
        }),
        warm: looked.warm,
        bound,
        liquid,
        drawings,
        cut,
    }
}

/// Squares in which the marked path leaves powder on the surface, from below to above.
fn cold(map: &FusionMap, surface: &[bool], marked: &[bool]) -> Vec<Cold> {
    let wide = (Cold::SIDE / map.cell).round().max(1.0) as usize;
    let [nx, ny] = map.cells;
    let mut squares = Vec::new();
    for j in (0..ny).step_by(wide) {
        for i in (0..nx).step_by(wide) {
            let (mut missing, mut all) = (0_u32, 0_u32);
            for y in j..(j + wide).min(ny) {
                for n in y * nx + i..y * nx + (i + wide).min(nx) {
                    all += 1;
                    missing += u32::from(surface[n] && !marked[n]);
                }
            }
            if missing > 0 {
                let middle = |k: usize, axis: usize| {
                    map.origin[axis] + (k as f64 + 0.5 * wide as f64) * map.cell
                };
                squares.push(Cold {
                    place: [middle(i, 0), middle(j, 1)],
                    share: f64::from(missing) / f64::from(all),
                });
            }
        }
    }
    squares
}
