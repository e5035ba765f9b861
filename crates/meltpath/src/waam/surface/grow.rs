//! How a wall on a surface grows: its program driven, its metal laid along the torch in voxels, on what the wall stands on.

use meltpath_base::{Observer, Reporter};
use meltpath_deposition::deposit::{DepositError, TubeDistance, mean_along};
use meltpath_deposition::workpiece::{Laid, LaidPoint, Laying};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;
use meltpath_geometry::workpiece::{Voxels, VoxelsError};
use meltpath_robot::Summary;
use meltpath_robot::interpolation::joints::simulate;
use meltpath_toolpath::{MotionBlock, MotionSink};

use super::flatness;
use super::ground::solid;
use super::plan::{Ground, SurfacePlan};
use crate::waam::deposit::simulate::SimulateError;
use crate::waam::deposit::target::spread;
use crate::waam::drive::joint_moves;
use crate::waam::drive::record::{Recorder, Sample};
use crate::waam::judge::{LayerOutcome, TubePlace};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Voxels along the bead's width at least.
const ACROSS: f64 = 12.0;
/// Side of the coarser voxels, by which the finer ones are judged, over theirs.
const COARSER: f64 = 1.5;
/// Room about the passes, widths of the bead.
const ROOM: f64 = 2.0;

/// Metal of one wall, laid twice.
#[derive(Debug)]
pub(crate) struct Grown {
    /// In voxels of `cell`.
    pub(crate) fine: Metal,
    /// In coarser ones.
    pub(crate) coarse: Metal,
    /// Side of the finer voxels, mm.
    pub(crate) cell: f64,
    /// What the wall stands on, in the finer voxels, mm³.
    pub(crate) ground: f64,
}

/// Metal as it was laid.
#[derive(Debug)]
pub(crate) struct Metal {
    pub(crate) laid: Laid,
    /// How flat each layer is inside its rims once it is whole: its number, and 5-95 % of its heights over the planned top, mm.
    pub(crate) flatness: Vec<(u32, f64)>,
}

/// A program driven.
pub(super) struct Driven {
    pub(super) summary: Summary,
    pub(super) samples: Vec<Sample>,
    /// The metal, or why there is no room for it.
    pub(super) grown: Result<Grown, VoxelsError>,
}

impl Driven {
    /// Wire fed, mm: by what the source answers to the distance of the contact tube; as programmed where the metal found no room.
    pub(super) fn wire(&self) -> f64 {
        let laid = self.grown.as_ref().map(|grown| grown.fine.laid.wire);
        laid.unwrap_or(self.summary.wire)
    }
}

/// Pushes motion to the recorder and to what lays metal.
struct Sinks<'a, 'b> {
    recorder: &'a mut Recorder,
    layings: &'a mut [Laying<'b>],
}

impl MotionSink for Sinks<'_, '_> {
    fn block(&mut self, block: &MotionBlock) {
        self.recorder.block(block);
        for laying in &mut *self.layings {
            laying.block(block);
        }
    }
}

/// Drives the commands and lays their metal, in voxels of two sizes.
pub(super) fn drive(
    commands: &Commands,
    plan: &SurfacePlan,
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Driven, SimulateError> {
    let cell = settings.cell_size.min(settings.bead.width.value / ACROSS);
    let grounds = ground(plan, settings, cell)
        .and_then(|fine| Ok([fine, ground(plan, settings, COARSER * cell)?]));
    let mut flatness = [Vec::new(), Vec::new()];
    let (mut layings, mut under, mut trouble) = (Vec::new(), 0.0, None);
    match grounds {
        Ok([fine, coarse]) => {
            under = fine.volume();
            let [of_fine, of_coarse] = &mut flatness;
            layings = vec![
                laying(fine, (plan, commands), settings, of_fine)?.reporting_to(reporter),
                laying(coarse, (plan, commands), settings, of_coarse)?,
            ];
        }
        Err(e) => trouble = Some(e),
    }
    let mut recorder = Recorder::default();
    observer.stage("machine motion and metal", commands.commands.len() as u64);
    let mut sinks = commands.pacing().before(Sinks {
        recorder: &mut recorder,
        layings: &mut layings,
    });
    let along = joint_moves::along(commands, settings);
    let summary = simulate(&along, &settings.controller, observer, &mut sinks)?;
    let summary = commands.pacing().summary(summary, &commands.commands);
    let laid: Vec<Laid> = layings.into_iter().map(Laying::finish).collect();
    let metal = laid.into_iter().zip(flatness);
    let mut metal = metal.map(|(laid, flatness)| Metal { laid, flatness });
    let grown = match (metal.next(), metal.next(), trouble) {
        (Some(fine), Some(coarse), None) => Ok(Grown {
            fine,
            coarse,
            cell,
            ground: under,
        }),
        (.., trouble) => Err(trouble.unwrap_or(VoxelsError::Cell { cell })),
    };
    Ok(Driven {
        summary,
        samples: recorder.finish(),
        grown,
    })
}

/// What lays the beads on a ground and notes how flat each layer is.
fn laying<'a>(
    ground: Voxels,
    (plan, commands): (&'a SurfacePlan, &Commands),
    settings: &Settings,
    flatness: &'a mut Vec<(u32, f64)>,
) -> Result<Laying<'a>, DepositError> {
    let reach = settings.deposit.nominal_ctwd;
    let whole = move |number: u32, voxels: &Voxels| {
        let layer = plan.layers.iter().find(|l| l.number == number);
        let found = layer.and_then(|l| flatness::flatness(voxels, l, reach));
        flatness.extend(found.map(|f| (number, f)));
    };
    let new = Laying::new(ground, settings.bead_model, settings.pool, settings.deposit)?;
    Ok(new
        .with_layers(commands.layer_of_command.clone())
        .on_layer(whole))
}

/// What the wall stands on, in voxels with room for the wall.
fn ground(plan: &SurfacePlan, settings: &Settings, cell: f64) -> Result<Voxels, VoxelsError> {
    let points = plan.passes.iter().flat_map(|p| &p.points);
    let places = points.flat_map(|p| [Some(p.position), p.from]).flatten();
    let (low, high) = places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let room = DVec3::splat(ROOM * settings.bead.width.value);
    let (low, high) = (low - room, high + room);
    // what was not laid is looked for all over the parts
    let parts = match &plan.ground {
        Ground::Body(pieces) => &pieces.pieces[..],
        Ground::Base(_) => &[],
    };
    let bounds = parts.iter().filter_map(|p| p.part.mesh.bounds());
    let (low, high) = bounds.fold((low, high), |(low, high), (a, b)| (low.min(a), high.max(b)));
    // a plane between voxels is theirs exactly
    let low = (low / cell).floor() * cell;
    let mut voxels = Voxels::new(low, high, cell)?;
    match &plan.ground {
        Ground::Base(base) => voxels.fill_mesh(&solid(base, (low, high)))?,
        Ground::Body(pieces) => voxels.fill_mesh(&pieces.body)?,
    };
    Ok(voxels)
}

/// What was predicted of each pass or layer of a plan.
pub(crate) fn outcomes(
    metal: &Metal,
    commands: &Commands,
    settings: &Settings,
    plan: &SurfacePlan,
) -> Vec<LayerOutcome> {
    let layer = |p: &LaidPoint| commands.layer_of_command.get(p.command as usize).copied();
    let passes = metal.laid.path.chunk_by(|a, b| layer(a) == layer(b));
    let pass = |points: &[LaidPoint]| {
        let number = layer(points.first()?)?;
        let inner = inner(points, plan, number, settings.bead.width.value);
        let ends = plan.ends(number);
        let planned = |p: &LaidPoint| {
            let thick = plan.thickness.as_ref();
            let there = thick.and_then(|t| t.at(number, p.tool));
            there.unwrap_or(ends[1] - ends[0])
        };
        let own = outcome(
            (number, ends),
            (points, &inner),
            &planned,
            (commands, settings),
        );
        // a layer too narrow to have an inside is as flat as its beads, as a wall is
        let whole = metal.flatness.iter().find(|f| f.0 == number);
        Some(LayerOutcome {
            flatness: whole.map(|f| f.1).or(own.flatness),
            ..own
        })
    };
    passes.filter_map(pass).collect()
}

/// Where the contact tube is at a point of a pass.
pub(super) fn tube_place(p: &LaidPoint, commands: &Commands) -> TubePlace {
    let command = p.command as usize;
    TubePlace {
        at: TubeDistance {
            distance: p.ctwd,
            tool: p.tool,
            time: p.time,
            command: p.command,
        },
        layer: commands.layer_of_command.get(command).copied().unwrap_or(0),
        bead: commands.bead_of_command.get(command).copied().flatten(),
    }
}

/// The points of a layer on a body more than a bead's width from its rim, where beads slump, as on flat layers; all of a narrower one, and
/// of a wall.
fn inner(points: &[LaidPoint], plan: &SurfacePlan, number: u32, width: f64) -> Vec<LaidPoint> {
    let layer = plan.layers.iter().find(|l| l.number == number);
    let rims = layer.map_or(&[][..], |l| &l.rims[..]);
    let near = Segments::new(rims.iter().map(Vec::as_slice), width);
    let inner = |p: &&LaidPoint| near.nearest(p.tool, width).is_none();
    let inner: Vec<LaidPoint> = points.iter().filter(inner).copied().collect();
    if inner.is_empty() {
        points.to_vec()
    } else {
        inner
    }
}

/// What was predicted of one pass, which is as thick as `planned` says at a point, mm.
fn outcome(
    (number, [bottom, planned_top]): (u32, [f64; 2]),
    (points, inner): (&[LaidPoint], &[LaidPoint]),
    planned: &dyn Fn(&LaidPoint) -> f64,
    (commands, settings): (&Commands, &Settings),
) -> LayerOutcome {
    let (nominal, width) = (settings.deposit.nominal_ctwd, settings.bead.width.value);
    let mean = |f: &dyn Fn(&LaidPoint) -> f64| {
        inner.iter().map(f).sum::<f64>() / inner.len().max(1) as f64
    };
    // how much higher than planned the metal stands on the bead's axis, along the torch
    let height = planned_top - bottom;
    let higher = |p: &LaidPoint| nominal - p.ctwd + p.thickness - planned(p);
    // as thick as it would be where the layer has its mean height
    let thick = |p: &LaidPoint| p.thickness * height / planned(p);
    let place = |p: &LaidPoint| tube_place(p, commands);
    let nearer = |a: &&LaidPoint, b: &&LaidPoint| a.ctwd.total_cmp(&b.ctwd);
    let ends = points
        .iter()
        .min_by(nearer)
        .zip(points.iter().max_by(nearer));
    let thickness = mean(&thick);
    let thickest = mean_along(inner, |p| (p.bead, p.tool, thick(p)), width)
        .into_iter()
        .zip(inner)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    LayerOutcome {
        layer: number,
        planned_top,
        mean_top: Some(planned_top + mean(&higher)),
        flatness: spread(inner.iter().map(higher).collect()),
        ctwd_mean: mean(&|p| p.ctwd),
        ctwd_range: ends.map_or((f64::NAN, f64::NAN), |(a, b)| (a.ctwd, b.ctwd)),
        tube: ends.map(|(a, b)| [place(a), place(b)]),
        accumulation: thickest.map(|(t, p)| (t / thickness - 1.0, p.crest)),
        ..LayerOutcome::default()
    }
}
