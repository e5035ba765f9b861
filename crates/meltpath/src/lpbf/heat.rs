//! What the laser melts: the marked path, with its lag, its corners and its late light, drawn by the semi-analytic heat engine
//! beside the commanded one.
//!
//! A layer is joined to the one below where the metal was liquid at its lower face. What the commanded path melts there and
//! the marked one does not is the machine's doing; what neither melts, the recipe's.

mod beam;
mod dwell;
mod judge;
mod keyhole;
mod standing;
mod surface;

use std::path::Path;

use meltpath_base::number::significant;
use meltpath_base::settings::{Problem, Problems};
use meltpath_base::{Length, Observer, Provenance, Ratio};
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_thermal::beam::{Beam, BeamError, BeamPath, BeamPoint};
use meltpath_thermal::material::file::Readings;
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::pool::fusion::{
    Following, FusionError, FusionMap, TracePoint, boiling_number, follow,
};
use meltpath_thermal::pool::history::Memory;
use meltpath_thermal::pool::keyhole::{Beyond, Keyhole, Laser, keyhole};
use meltpath_thermal::pool::moving_source::{MovingSource, MovingSourceError};
use meltpath_thermal::solver::source::Depth;

use crate::job::lpbf::HeatTable;
use crate::material::load;
use beam::{commanded, lit};
use meltpath_toolpath::Role;
use standing::{Standing, longest};
use surface::{beside, closed};

pub use beam::BeamRecord;
pub(super) use dwell::{check as dwell_check, told as tell_waits};
pub use judge::check;
pub(crate) use judge::dug;
pub(super) use keyhole::check as keyhole_check;

/// Distance along the path from look to look, in spot diameters.
const LOOK: f64 = 0.7;

/// Looks from one measured pool to the next.
const PER_POOL: usize = 4;

/// How much less and more is absorbed in the third and fourth drawing: what measured tracks that conduct differ by from the engine
/// (docs/theory/heat.md, tracks that NIST measured: depths by −23 %, widths by +23 %).
const ABSORBED: [f64; 2] = [0.8, 1.2];

/// Resolved `[heat]`.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatSettings {
    /// The material.
    pub material: Material,
    /// What stands for it in the engine.
    pub medium: Medium,
    /// Share of the power that becomes heat.
    pub absorptivity: f64,
    /// Depth that must become liquid, mm.
    pub layer: f64,
    /// Edge of the map's cells, mm.
    pub cell: f64,
    /// Spot diameter (four standard deviations), mm.
    pub spot: f64,
    /// Room round the marks, mm.
    pub margin: f64,
    /// Marks followed at most, mm.
    pub marks: f64,
    /// Least share of the check.
    pub share: f64,
}

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

/// Resolves `[heat]` of a job in `folder` for a beam of `spot` mm on layers of `layer` mm, whose check wants at least `share`.
///
/// # Errors
/// Everything wrong, with its place.
pub fn resolve(
    table: &HeatTable,
    share: f64,
    [spot, layer]: [f64; 2],
    folder: &Path,
    provenance: &mut Provenance,
) -> Result<HeatSettings, Problems> {
    let named = &table.material;
    let loaded = load(named, Readings::default(), folder).map_err(|e| e.at(named))?;
    loaded.tell(provenance);
    let material = loaded.material;
    let own = table.absorptivity.map(|a| a.0).or(material.absorptivity).ok_or_else(|| {
        let message = format!("\"{}\" says nothing of absorptivity", **named);
        named.problem(message).help(
            "give it in the job: [heat] absorptivity = \"35 %\"; or as [absorptivity] in the material file",
        )
    })?;
    let preheat = table.preheat.0;
    warmed(table, &material)?;
    let medium = Medium::effective(&material, preheat, Body::HalfSpace).map_err(|_| {
        let message = format!(
            "the bed is at {:.0} °C, the material is liquid from {:.0} °C",
            preheat - CELSIUS,
            material.liquidus - CELSIUS
        );
        table
            .preheat
            .problem(message)
            .help("give heat.preheat below it")
    })?;
    let settings = HeatSettings {
        medium,
        absorptivity: table.absorptivity.or_computed(provenance, Ratio(own)).0,
        layer: table.layer.or_computed(provenance, Length(layer)).0,
        cell: table.cell.or_computed(provenance, Length(0.25 * spot)).0,
        spot,
        margin: table.margin.0,
        marks: table.marks.0,
        share,
        material,
    };
    fits(table, &settings)?;
    provenance.model(
        "melt pools of the laser",
        "superposition of moving Gaussians on a half space with mean properties (Carslaw and Jaeger 1959; Eagar and Tsai 1983); \
         conduction only, dense metal, absorptivity constant; keyholes flagged by the normalised enthalpy of King et al. 2014, \
         their depth told by the scaling of Gan et al. 2021 where it was measured",
    );
    Ok(settings)
}

/// Refuses beds below absolute zero, and those that begin to melt.
fn warmed(table: &HeatTable, material: &Material) -> Result<(), Problem> {
    let bed = table.preheat.0;
    let told = if bed < 0.0 {
        let zero = -CELSIUS;
        format!(
            "the bed is at {:.0} °C, below absolute zero, {zero} °C",
            bed - CELSIUS
        )
    } else if bed >= material.solidus {
        format!(
            "the bed is at {:.0} °C, the material begins to melt at {:.0} °C",
            bed - CELSIUS,
            material.solidus - CELSIUS
        )
    } else {
        return Ok(());
    };
    Err(table.preheat.problem(told).help(format!(
        "a bed is solid: give heat.preheat below {:.0} °C",
        material.solidus - CELSIUS
    )))
}

/// Refuses cells of which the margin alone would have more than any map.
fn fits(table: &HeatTable, settings: &HeatSettings) -> Result<(), Problem> {
    let across = 2.0 * settings.margin / settings.cell;
    if across * across <= FusionMap::LARGEST {
        return Ok(());
    }
    // whichever is farther from the spot's own size
    let coarse = settings.margin / settings.spot > settings.spot / settings.cell;
    let message = format!(
        "a map with {} mm beyond the marks in cells of {} mm would have more than {:.0} million cells",
        significant(settings.margin, 3),
        significant(settings.cell, 3),
        1e-6 * FusionMap::LARGEST
    );
    Err(if coarse {
        let help = "is it in mm? a fraction of a millimetre holds what melts beyond the marks";
        table
            .margin
            .problem(format!("heat.margin: {message}"))
            .help(help)
    } else {
        let help = "a larger one; left out it is a quarter of the spot";
        table
            .cell
            .problem(format!("heat.cell: {message}"))
            .help(help)
    })
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

/// Boiling numbers of a kind of marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Boiling {
    /// Of which marks.
    pub kind: Role,
    /// The greatest.
    pub number: f64,
    /// The keyhole there, by scaling, or why nothing is said of it.
    pub keyhole: Result<Keyhole, Beyond>,
    /// Where the mark ends of which that is told, mm.
    pub end: [f64; 2],
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
    /// How near the surface is to boiling.
    pub boiling: Vec<Boiling>,
    /// Where the lit beam stands between marks and heats the most.
    pub standing: Option<Standing>,
    /// Whether marks were left out.
    pub cut: bool,
}

/// Draws the first square or layer of a recipe, whose lines lie `hatch` mm apart and whose power follows a law.
///
/// # Errors
/// [`HeatError`].
pub fn melt(
    settings: &HeatSettings,
    (job, law): (&ScanJob, PowerLaw),
    record: BeamRecord,
    hatch: f64,
    observer: &dyn Observer,
) -> Result<RecipeHeat, HeatError> {
    let asked = commanded((job, law), record.last, settings.marks, settings.spot)?;
    let (last, cut) = (record.last, record.cut);
    let marked = BeamPath::new(record.points)?;
    let plain = frame(settings, &asked, hatch)?;
    let drawn = |name, path, share| drawn(settings, &plain, (name, path, share), observer);
    let (first, others) = rayon::join(
        || drawn("as commanded", &asked, 1.0),
        || three(|name, share| drawn(name, &marked, share)),
    );
    let [second, third, fourth] = others;
    let drawings = [first?, second?, third?, fourth?];
    let found = Found {
        boiling: boiling(settings, job, last),
        standing: longest(
            (&settings.material, &settings.medium),
            (settings.absorptivity, settings.spot),
            (job, law),
            last,
        ),
        cut,
    };
    Ok(told(settings, drawings, (&asked, hatch), found))
}

/// Draws the path that the same recipe has on a head that behaves otherwise: what was commanded is that of `value`.
///
/// # Errors
/// [`HeatError`].
pub(super) fn melt_otherwise(
    settings: &HeatSettings,
    value: &RecipeHeat,
    (job, law, record): (&ScanJob, PowerLaw, BeamRecord),
    hatch: f64,
    observer: &dyn Observer,
) -> Result<RecipeHeat, HeatError> {
    let asked = commanded((job, law), record.last, settings.marks, settings.spot)?;
    let plain = frame(settings, &asked, hatch)?;
    let cut = record.cut;
    let marked = BeamPath::new(record.points)?;
    let [second, third, fourth] =
        three(|name, share| drawn(settings, &plain, (name, &marked, share), observer));
    let drawings = [value.drawings[0].clone(), second?, third?, fourth?];
    let found = Found {
        boiling: value.boiling.clone(),
        standing: value.standing,
        cut,
    };
    Ok(told(settings, drawings, (&asked, hatch), found))
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
fn frame(settings: &HeatSettings, asked: &BeamPath, hatch: f64) -> Result<FusionMap, HeatError> {
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
        settings.layer,
        settings.medium.ambient,
    )?)
}

/// Follows a path of which a share of the heat is absorbed, on the map `plain`.
fn drawn(
    settings: &HeatSettings,
    plain: &FusionMap,
    (name, path, share): (&'static str, &BeamPath, f64),
    observer: &dyn Observer,
) -> Result<Melted, HeatError> {
    let beam = Beam {
        efficiency: share * settings.absorptivity,
        depth: Depth::Surface,
    };
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

/// What is told of a recipe beside its drawings.
struct Found {
    boiling: Vec<Boiling>,
    standing: Option<Standing>,
    cut: bool,
}

/// Areas and shares of the drawings.
fn told(
    settings: &HeatSettings,
    mut drawings: [Melted; 4],
    (asked, hatch): (&BeamPath, f64),
    found: Found,
) -> RecipeHeat {
    let liquidus = settings.material.liquidus;
    let melted = drawings
        .each_ref()
        .map(|d| d.map.hotter(liquidus).collect::<Vec<bool>>());
    let plain = &drawings[0].map;
    let mut surface = closed(&melted[0], plain.cells, hatch / settings.cell);
    // what is commanded to be drawn counts where nothing melts, too
    beside(&mut surface, plain, asked, 0.5 * hatch);
    let count = |cells: &mut dyn Iterator<Item = bool>| cells.filter(|c| *c).count() as f64;
    let all = count(&mut surface.iter().copied());
    let one = settings.cell * settings.cell;
    for (drawing, here) in drawings.iter_mut().zip(&melted) {
        let inside = count(&mut here.iter().zip(&surface).map(|(a, b)| *a && *b));
        drawing.area = count(&mut here.iter().copied()) * one;
        drawing.share = inside / all.max(1.0);
    }
    RecipeHeat {
        surface: all * one,
        cold: cold(&drawings[0].map, &surface, &melted[1]),
        boiling: found.boiling,
        standing: found.standing,
        drawings,
        cut: found.cut,
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

fn boiling(settings: &HeatSettings, job: &ScanJob, last: u32) -> Vec<Boiling> {
    let of = |power: f64, speed: f64| {
        let absorbed = settings.absorptivity * power;
        let (material, medium) = (&settings.material, &settings.medium);
        boiling_number(material, medium, absorbed, speed, settings.spot)
    };
    [Role::Contour, Role::Fill]
        .into_iter()
        .filter_map(|kind| {
            let marks = job.vectors.iter().take(last as usize + 1);
            let (number, laser, end) = marks
                .filter(|v| v.kind == kind && v.speed > 0.0)
                .filter_map(|v| {
                    let laser = Laser {
                        power: v.power,
                        speed: v.speed,
                        spot: settings.spot,
                        flat: settings.absorptivity,
                    };
                    Some((of(v.power, v.speed)?, laser, [v.end.x, v.end.y]))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some(Boiling {
                kind,
                number,
                keyhole: keyhole(&settings.material, settings.medium.ambient, laser),
                end,
            })
        })
        .collect()
}
