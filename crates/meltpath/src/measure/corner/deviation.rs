//! The deposit's model against a scan: the same path, the same section, the pursuit length that was found.
//! Source of the comparison: Rouchon 2022, §3.5.2; the model is that of jobs.

use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength, WIDTH_EXPONENT};
use meltpath_deposition::consumable::{PoolRow, nearest_pool};
use meltpath_deposition::deposit::{Deposition, Settings};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

use super::super::file::Setting;
use super::relief::Relief;
use super::way::{along, path};

/// Cells of the simulated surface, mm.
const CELL: f64 = 0.25;
/// Travel of the torch between samples, mm.
const STEP: f64 = 0.1;
/// Ends of the bead that are not compared, mm.
const ENDS: f64 = 12.0;
/// What is lower than this share of the bead's height is plate.
const PLATE: f64 = 0.12;
/// Farthest that a nearer place of the surface is looked for, mm.
const FAR: f64 = 2.0;

/// What the model lays.
pub(crate) struct Laid<'a> {
    /// Width of the straight parts, mm.
    pub(crate) width: f64,
    /// Their area, mm².
    pub(crate) area: f64,
    /// Section of the wire, mm².
    pub(crate) wire_section: f64,
    /// Pursuit length, mm.
    pub(crate) length: f64,
    /// Settings.
    pub(crate) setting: &'a Setting,
    /// The pools that are known.
    pub(crate) pools: &'a [PoolRow],
    /// Turn of the path, rad.
    pub(crate) turn: f64,
    /// Its legs, mm.
    pub(crate) legs: [f64; 2],
}

/// A cell of the scan and of the model.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Place in the frame of the path, mm.
    pub at: DVec2,
    /// Height that was measured, mm.
    pub measured: f64,
    /// Height of the model, mm.
    pub simulated: f64,
    /// From the measured point to the nearest of the model's surface, positive where it lies higher, mm.
    pub distance: f64,
}

/// A part of a corner with the distances there.
#[derive(Debug, Clone, Copy)]
pub struct Zone {
    /// What it is.
    pub name: &'static str,
    /// Mean distance, mm: positive where the scan is higher.
    pub mean: f64,
    /// Root mean square distance, mm.
    pub rms: f64,
    /// Its cells.
    pub cells: usize,
}

/// How far the deposit's model is from a scan.
#[derive(Debug, Clone)]
pub struct Deviation {
    /// Where either has metal.
    pub cells: Vec<Cell>,
    /// By parts: before the corner, its centre, its sides, downstream, straight after it.
    pub zones: Vec<Zone>,
    /// Metal of the model where the scan has none, near the corner, mm³.
    pub stray: f64,
    /// Metal of the model, mm.
    pub metal: Vec<DVec3>,
    /// Greatest height at the corner over that of the straight parts: measured, and of the model.
    pub tops: [f64; 2],
}

/// The torch's motion: its record, or the path at one speed.
fn motion(laid: &Laid<'_>, record: Option<&[(f64, DVec2)]>) -> MotionBlock {
    let speed = laid.setting.travel_speed;
    let wire = laid.area / laid.wire_section * speed;
    let mut samples: Vec<(f64, DVec2)> = Vec::new();
    if let Some(record) = record {
        samples.extend_from_slice(record);
    } else {
        let mut time = 0.0;
        let way = path(laid.turn, laid.legs);
        samples.push((0.0, way[0]));
        for w in way.windows(2) {
            let length = w[0].distance(w[1]);
            let parts = (length / STEP).ceil();
            for k in 1..=parts as u32 {
                time += length / parts / speed;
                samples.push((time, w[0].lerp(w[1], f64::from(k) / parts)));
            }
        }
    }
    let mut block = MotionBlock::default();
    let mut times = Vec::new();
    let mut last = samples.first().map_or(0.0, |s| s.0);
    for (time, p) in samples {
        let step = time - last;
        last = time;
        times.push(time);
        block.position.push(p.extend(0.0));
        block.speed.push(speed);
        block.wire.push(wire * step);
        block.command.push(1);
    }
    block.times = Times::Each(times);
    block
}

/// The model's surface.
fn simulated(laid: &Laid<'_>, record: Option<&[(f64, DVec2)]>) -> Option<HeightMap> {
    let bead = BeadModel {
        width: laid.width,
        area: laid.area,
        wire_section: laid.wire_section,
        efficiency: 1.0,
        width_exponent: WIDTH_EXPONENT,
        // the wire is fed as it is told
        feed_exponent: 0.0,
    };
    let setting = laid.setting;
    let row = nearest_pool(laid.pools, setting.wire_feed, setting.travel_speed)?;
    let pool = PoolModel::for_bead(&row.model(PursuitLength::Fixed(laid.length)), &bead);
    let block = motion(laid, record);
    let margin = DVec3::splat(pool.length() + laid.width);
    let ends = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = block
        .position
        .iter()
        .fold(ends, |[low, high], p| [low.min(*p), high.max(*p)]);
    let [low, high] = [low - margin, high + margin].map(DVec3::truncate);
    let map = HeightMap::new(low, high, CELL, 0.0).ok()?;
    let mut deposition = Deposition::new(map, bead, pool, Settings::default()).ok()?;
    deposition.block(&block);
    Some(deposition.finish().map)
}

/// Cells higher than the plate, as points.
fn metal(map: &HeightMap, plate: f64) -> Vec<DVec3> {
    let tall = map.z.iter().enumerate().filter(|(_, z)| **z > plate);
    tall.map(|(k, z)| map.centre(k % map.nx, k / map.nx).extend(*z))
        .collect()
}

/// From a measured point to the model's surface, positive where the point lies higher.
fn distance(map: &HeightMap, p: DVec2, z: f64) -> f64 {
    let off = z - map.height(p);
    let step = map.cell;
    let slope = |d: DVec2| (map.height(p + d) - map.height(p - d)) / (2.0 * step);
    let steep = DVec2::new(slope(DVec2::X * step), slope(DVec2::Y * step));
    let mut best = off.abs() / (1.0 + steep.length_squared()).sqrt();
    let reach = DVec2::splat(best.min(FAR));
    let (columns, rows) = map.cells_within(p - reach, p + reach);
    for row in rows {
        for column in columns.clone() {
            let there = map
                .centre(column, row)
                .extend(map.z[map.index(column, row)]);
            best = best.min(there.distance(p.extend(z)));
        }
    }
    best.copysign(off)
}

/// The parts of a corner by the distance along the path, from the corner, and from the pursuit curve, in widths.
const ZONES: [&str; 5] = [
    "before the corner",
    "corner, centre",
    "corner, sides",
    "downstream",
    "straight after it",
];

fn zone(way: f64, from_corner: f64, from_curve: f64) -> Option<usize> {
    if from_corner < 1.2 {
        return match from_curve {
            d if d < 0.2 => Some(1),
            d if (0.3..0.7).contains(&d) => Some(2),
            _ => None,
        };
    }
    match way {
        s if s < -2.0 => Some(0),
        s if (1.2..3.0).contains(&s) => Some(3),
        s if s > 3.5 => Some(4),
        _ => None,
    }
}

fn from_line(line: &[DVec2], p: DVec2) -> f64 {
    let of = |w: &[DVec2]| {
        let way = w[1] - w[0];
        let share = (p - w[0]).dot(way) / way.length_squared().max(1e-12);
        p.distance(w[0] + share.clamp(0.0, 1.0) * way)
    };
    line.windows(2).map(of).fold(f64::INFINITY, f64::min)
}

/// The model against a scan; `curve` is the pursuit curve.
pub(super) fn of(
    relief: &Relief,
    laid: &Laid<'_>,
    record: Option<&[(f64, DVec2)]>,
    curve: &[DVec2],
) -> Option<Deviation> {
    let map = simulated(laid, record)?;
    let (width, height) = (laid.width, 1.5 * laid.area / laid.width);
    let plate = PLATE * height;
    let mut cells = Vec::new();
    let mut found: [Vec<f64>; 5] = Default::default();
    let (mut stray, mut tops) = (0.0, [0.0f64; 2]);
    for (k, z) in relief.z.iter().enumerate() {
        let at = relief.middle(k);
        let (way, off) = along(at, laid.turn);
        let inside = way > ENDS - laid.legs[0] && way < laid.legs[1] - ENDS;
        if !(inside && off < width + 2.0 && z.is_finite()) {
            continue;
        }
        let simulated = map.height(at);
        if z.max(simulated) < plate {
            continue;
        }
        let cell = Cell {
            at,
            measured: *z,
            simulated,
            distance: distance(&map, at, *z),
        };
        cells.push(cell);
        let from_corner = at.length() / width;
        if from_corner < 1.5 {
            tops = [tops[0].max(*z / height), tops[1].max(simulated / height)];
            if *z < plate {
                stray += simulated * relief.cell * relief.cell;
            }
        }
        if z.min(simulated) > plate || from_corner < 1.2 {
            let zone = zone(way / width, from_corner, from_line(curve, at) / width);
            if let Some(zone) = zone {
                found[zone].push(cell.distance);
            }
        }
    }
    let zones = ZONES.iter().zip(found).map(|(name, all)| {
        let n = all.len() as f64;
        Zone {
            name,
            mean: all.iter().sum::<f64>() / n,
            rms: (all.iter().map(|d| d * d).sum::<f64>() / n).sqrt(),
            cells: all.len(),
        }
    });
    Some(Deviation {
        zones: zones.collect(),
        cells,
        stray,
        tops,
        metal: metal(&map, plate),
    })
}
