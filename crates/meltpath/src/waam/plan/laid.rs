//! What a controller makes of planned beads: where the metal of a layer really goes, and how much of it. Round corners the torch is slower
//! and cuts across, while the wire goes on: a layer has more metal on less area than its lines say.

use std::collections::BTreeMap;

use meltpath_base::{Observer, Quiet, Reporter};
use meltpath_deposition::deposit::footprint::Footprint;
use meltpath_geometry::Region;
use meltpath_geometry::boolean::{PlanarError, intersection, union};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::stroke;
use meltpath_geometry::sheet::thinned;
use meltpath_robot::interpolation::joints::{self, Along};
use meltpath_toolpath::{Layer, MotionBlock, MotionSink, Toolpath};
use rayon::prelude::*;

use crate::waam::plan::profile::profile;
use crate::waam::program::wanted::Wanted;
use crate::waam::program::{self, Commands};
use crate::waam::settings::Settings;
use crate::waam::settings::bead::FREE_EDGE;

/// Distance between the points of a bead's axis, mm.
const APART: f64 = 0.3;
/// What an axis may lose by its points that are left out, mm.
const THIN: f64 = 0.02;
/// Steps of a bead's width over the nominal one.
const WIDER: f64 = 0.05;
/// Chord error of the edges of metal, mm.
const CHORD: f64 = 0.05;

/// The metal of a layer as it is laid.
#[derive(Debug, Clone, Default)]
pub(in crate::waam) struct Laid {
    /// How long the arc burns, s.
    time: f64,
    /// Axes of its beads.
    lines: Vec<Line>,
}

/// A part of a bead's axis along which the bead is equally wide.
#[derive(Debug, Clone, Default)]
struct Line {
    /// Width over the nominal one, in steps of [`WIDER`].
    wide: u32,
    /// Its points, mm.
    points: Vec<DVec2>,
}

impl Laid {
    /// Its metal as that of so much bead at the job's speed, mm³.
    fn metal(&self, settings: &Settings) -> f64 {
        self.time * settings.bead.travel_speed * settings.bead.area.value
    }

    /// What lies within a share of the beads' local width from their axes.
    fn within(&self, share: f64, settings: &Settings) -> Result<Vec<Region>, PlanarError> {
        let mut wide: BTreeMap<u32, Vec<Vec<DVec2>>> = BTreeMap::new();
        for line in &self.lines {
            wide.entry(line.wide).or_default().push(line.points.clone());
        }
        let step = share * settings.bead.width.value * WIDER;
        let bands = wide.iter();
        let bands = bands.map(|(wide, lines)| stroke(lines, step * f64::from(*wide), CHORD));
        let bands: Vec<Vec<Region>> = bands.collect::<Result<_, _>>()?;
        union(&bands.concat())
    }
}

/// The heights that the metal of layers has over the area that its beads share, mm, from the lowest up; `None` of no metal.
///
/// A free edge lies 0.45 widths outside the axis (Rouchon 2022, § 4.4). Where the layer below stands farther out, as layers whose beads run
/// the other way do at corners, a bead covers it up to the half of its width, as on a plate.
///
/// # Errors
/// [`PlanarError`].
pub(in crate::waam) fn heights(
    laid: &[Laid],
    settings: &Settings,
) -> Result<Vec<Option<f64>>, PlanarError> {
    let reach = |share: f64| {
        let all = laid.par_iter().map(|l| l.within(share, settings));
        all.collect::<Result<Vec<_>, _>>()
    };
    let (own, full) = (reach(FREE_EDGE)?, reach(0.5)?);
    // the first layer as one higher up, on one that runs the other way
    let mut below = own.get(1).cloned().unwrap_or_default();
    let mut heights = Vec::with_capacity(laid.len());
    for (laid, (own, full)) in laid.iter().zip(own.into_iter().zip(full)) {
        let carried = intersection(&full, &below)?;
        below = union(&[own, carried].concat())?;
        let area: f64 = below.iter().map(Region::area).sum();
        let metal = laid.metal(settings);
        heights.push((area > 0.0 && metal > 0.0).then(|| metal / area));
    }
    Ok(heights)
}

/// The metal of layers as the controller of the job drives their programs, each on its own; `None` where no program can be made of one:
/// who writes it tells why.
pub(in crate::waam) fn laid(
    layers: &[&Layer],
    settings: &Settings,
    observer: &dyn Observer,
) -> Option<Vec<Laid>> {
    let quiet = Quiet(observer);
    let one = |layer: &&Layer| driven(layer, settings, &quiet);
    layers.par_iter().map(one).collect()
}

/// One layer, driven.
fn driven(layer: &Layer, settings: &Settings, observer: &dyn Observer) -> Option<Laid> {
    let toolpath = Toolpath {
        profiles: vec![profile(settings)],
        layers: vec![layer.clone()],
        ..Toolpath::default()
    };
    let asked = (settings.cell.program.dialect.value, Wanted::WHOLE);
    let told = Reporter::new();
    let built = program::make("LAYER", &toolpath, asked, settings, &told).ok()?;
    let moves = program::commands(&built.programs, &built.schedules, settings, &told).ok()?;
    let mut axes = Axes::new(settings);
    let along = along(&moves, settings);
    joints::simulate(&along, &settings.controller, observer, &mut axes).ok()?;
    Some(axes.finish())
}

fn along<'a>(moves: &'a Commands, settings: &'a Settings) -> Along<'a> {
    Along {
        cell: settings.robot.as_ref(),
        moves: &moves.joint_moves,
        start: moves.start,
        commands: &moves.commands,
    }
}

/// Follows the torch with the axes of its beads.
struct Axes<'a> {
    settings: &'a Settings,
    laid: Laid,
    /// The bead that is being laid, and its axis since its width changed.
    bead: Option<(Footprint, Line)>,
    /// Where the torch was, and when.
    before: Option<(DVec3, f64)>,
}

impl<'a> Axes<'a> {
    fn new(settings: &'a Settings) -> Self {
        Axes {
            settings,
            laid: Laid::default(),
            bead: None,
            before: None,
        }
    }

    /// The torch goes on to `to` while `wire` mm are fed.
    fn feed(&mut self, from: DVec3, to: DVec3, wire: f64) {
        let settings = self.settings;
        let (footprint, line) = self.bead.get_or_insert_with(|| {
            let laws = (settings.bead_model, settings.pool);
            (
                Footprint::new(from, laws, &settings.deposit),
                Line::default(),
            )
        });
        let Some(on) = footprint.feed(to, wire) else {
            return;
        };
        let wide = (on.wide / WIDER).round() as u32;
        if wide != line.wide && !line.points.is_empty() {
            let next = Line {
                wide,
                // the axis goes on from where it was
                points: line.points.last().copied().into_iter().collect(),
            };
            self.laid.lines.push(std::mem::replace(line, next));
        }
        line.wide = wide;
        let far = |last: &DVec2| last.distance(on.centre) >= APART;
        if line.points.last().is_none_or(far) {
            line.points.push(on.centre);
        }
    }

    /// The arc is off.
    fn stop(&mut self) {
        self.laid.lines.extend(self.bead.take().map(|b| b.1));
        self.laid.lines.retain(|l| !l.points.is_empty());
    }

    fn finish(mut self) -> Laid {
        self.stop();
        for line in &mut self.laid.lines {
            let spatial: Vec<DVec3> = line.points.iter().map(|p| p.extend(0.0)).collect();
            let mut kept = thinned(&spatial, THIN).into_iter();
            line.points.retain(|_| kept.next().unwrap_or(true));
        }
        self.laid
    }
}

impl MotionSink for Axes<'_> {
    fn block(&mut self, block: &MotionBlock) {
        for (i, &to) in block.position.iter().enumerate() {
            let before = self.before;
            self.before = Some((to, block.time(i)));
            match block.wire.get(i) {
                Some(wire) if *wire > 0.0 => {
                    self.laid.time += block.stretch(i, before.map(|b| b.1));
                    self.feed(before.map_or(to, |b| b.0), to, *wire);
                }
                _ if self.bead.is_some() => self.stop(),
                _ => {}
            }
        }
    }
}
