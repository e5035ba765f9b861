//! Machine and metal: the commands of a program become motion, the motion becomes metal, layer by layer.

use meltpath_base::{Observer, Reporter};
use meltpath_deposition::bead::{BeadModel, PoolModel};
use meltpath_deposition::deposit::{
    Deposit, DepositError, Deposition, LayerRecord, Settings, TubeDistance,
};
use meltpath_geometry::Pose;
use meltpath_geometry::raster::Mask;
use meltpath_geometry::workpiece::HeightMap;
use meltpath_report::scene::{Grid, HeightLayers, Scalar, SceneError};
use meltpath_robot::cell::Cell;
use meltpath_robot::collision::Metal;
use meltpath_robot::command::Command;
use meltpath_robot::controller::Controller;
use meltpath_robot::interpolation::fir::MotionError;
use meltpath_robot::interpolation::joints::{self, Along};
use meltpath_robot::joint_move::JointMove;
use meltpath_robot::pacing::Pacing;
use meltpath_robot::summary::Summary;
use meltpath_robot::weave::Weaving;
use meltpath_toolpath::{MotionBlock, MotionSink, Weave};

use crate::waam::deposit::target::{layer_top, spread};
use crate::waam::drive::columns::side;
use crate::waam::drive::record::{Recorder, Sample};
use crate::waam::judge::{LayerOutcome, TubePlace};
use crate::waam::program::Commands;
use crate::waam::settings::Settings as JobSettings;

/// Height errors beyond this take the end colours, mm.
const SHOWN_ERROR: f64 = 2.0;

meltpath_base::passes_on! {
    /// Why a simulation could not be made.
    pub enum SimulateError {
        /// The commands cannot be driven, or the person cancelled.
        Motion(MotionError),
        /// The bead cannot be laid.
        Deposit(DepositError),
        /// The heights cannot be shown.
        Scene(SceneError),
    }
}

/// One planned layer, as the simulation needs it.
#[derive(Debug, Clone, Default)]
pub struct PlannedLayer {
    /// Number, from 1.
    pub layer: u32,
    /// Planned height of its top, mm.
    pub top: f64,
    /// Cells well inside it, where its flatness is judged; empty for walls of one bead.
    pub inner: Mask,
}

/// What the simulation starts from.
#[derive(Debug, Clone)]
pub struct Build<'a> {
    /// Where the tool stands at first.
    pub start: Pose,
    /// The commands, numbered by their position.
    pub commands: &'a [Command],
    /// The cell that drives them, where the job names a robot.
    pub cell: Option<&'a Cell>,
    /// Joint moves whose axes are known at both ends.
    pub joint_moves: &'a [JointMove],
    /// The layer of each command; 0 for none.
    pub layer_of_command: Vec<u32>,
    /// The bead of each command, counted from 1 in its layer; empty where nobody asks.
    pub bead_of_command: &'a [Option<u32>],
    /// The weave of each command, in `weaves` from 1; 0 for none.
    pub weave_of_command: &'a [u32],
    /// The weaves.
    pub weaves: &'a [Weave],
    /// The planned layers, in order.
    pub layers: &'a [PlannedLayer],
    /// The controller.
    pub controller: &'a Controller,
    /// The pace at which its motion is driven.
    pub pacing: &'a Pacing,
    /// The bare plate.
    pub map: HeightMap,
    /// The bead.
    pub bead: BeadModel,
    /// The pool.
    pub pool: PoolModel,
    /// How metal is laid.
    pub settings: Settings,
    /// Side of the columns in which each layer's metal is kept for collisions, mm; `None`: it is not.
    pub columns: Option<f64>,
}

impl<'a> Build<'a> {
    /// The build of a program by the settings of a job; no metal is kept for collisions.
    pub(in crate::waam) fn of(
        commands: &'a Commands,
        layers: &'a [PlannedLayer],
        map: HeightMap,
        settings: &'a JobSettings,
    ) -> Self {
        Build {
            start: commands.start,
            commands: &commands.commands,
            cell: settings.robot.as_ref(),
            joint_moves: &commands.joint_moves,
            layer_of_command: commands.layer_of_command.clone(),
            bead_of_command: &commands.bead_of_command,
            weave_of_command: &commands.weave_of_command,
            weaves: &commands.weaves,
            layers,
            controller: &settings.controller,
            pacing: commands.pacing(),
            map,
            bead: settings.bead_model,
            pool: settings.pool,
            settings: settings.deposit,
            columns: None,
        }
    }

    /// Keeps each layer's metal in columns, where the job's robot has shapes that may touch it.
    #[must_use]
    pub(in crate::waam) fn beside_robot(self, settings: &JobSettings) -> Self {
        let shapes = settings.robot.as_ref().and_then(|r| r.shapes.as_ref());
        let columns = shapes.map(|_| side(&self.map));
        Build { columns, ..self }
    }
}

/// What came out.
#[derive(Debug)]
pub struct Simulation {
    /// Times.
    pub summary: Summary,
    /// The motion, thinned.
    pub samples: Vec<Sample>,
    /// Contact tube distance along the beads, in order of time.
    pub ctwd: Vec<TubePlace>,
    /// Layer by layer.
    pub layers: Vec<LayerOutcome>,
    /// The metal.
    pub deposit: Deposit,
    /// The surface after each layer, thinned as it comes: the maps of all layers would not fit in memory.
    pub heights: HeightLayers,
    /// Number of ignitions.
    pub arc_starts: usize,
    /// Plate and metal at the end of each layer, where columns were asked for.
    pub metal: Vec<(u32, Metal)>,
}

/// Pushes motion to the recorder and to the deposition.
struct Both<'a, 'b> {
    recorder: &'a mut Recorder,
    deposition: &'a mut Deposition<'b>,
}

impl MotionSink for Both<'_, '_> {
    fn block(&mut self, block: &MotionBlock) {
        self.recorder.block(block);
        self.deposition.block(block);
    }
}

/// Drives the commands and lays the metal.
///
/// # Errors
/// [`SimulateError`].
pub fn simulate(
    build: Build<'_>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Simulation, SimulateError> {
    let grid = Grid {
        origin: build.map.origin,
        cell: build.map.cell,
        nx: build.map.nx,
        ny: build.map.ny,
    };
    let mut heights = HeightLayers::new("predicted surface", grid, build.layers.len().max(1))?
        .with_scalar(Scalar::new("height error", "mm", Vec::new()).diverging(SHOWN_ERROR));
    let mut layers = Vec::new();
    let mut ctwd = Vec::new();
    let mut arc_starts = 0;
    let mut trouble = None;
    let mut metal = Vec::new();
    let columns = build.columns;
    let (planned, beads) = (build.layers, build.bead_of_command);
    let on_layer = |record: &LayerRecord, map: &HeightMap| {
        let plan = planned.iter().find(|p| p.layer == record.layer);
        let place = |at: TubeDistance| TubePlace {
            at,
            layer: record.layer,
            bead: beads.get(at.command as usize).copied().flatten(),
        };
        let tube = record.tube.map(|ends| ends.map(place));
        layers.push(LayerOutcome {
            tube,
            ..outcome(record, map, plan)
        });
        ctwd.extend(record.path.iter().map(|p| place(p.distance())));
        arc_starts += record.arc_starts.len();
        metal.extend(columns.map(|side| (record.layer, Metal::of(map, side))));
        let top = plan.map_or(0.0, |p| p.top);
        let error: Vec<f64> = map
            .z
            .iter()
            .map(|z| if *z > map.base { z - top } else { f64::NAN })
            .collect();
        if let Err(e) = heights.push(record.layer, &map.z, &[&error]) {
            trouble = Some(e);
        }
    };
    let mut recorder = Recorder::default();
    let mut deposition = Deposition::new(build.map, build.bead, build.pool, build.settings)?
        .with_layers(build.layer_of_command)
        .reporting_to(reporter)
        .on_layer(on_layer);
    let mut both = build.pacing.before(Both {
        recorder: &mut recorder,
        deposition: &mut deposition,
    });
    observer.stage("machine motion and metal", build.commands.len() as u64);
    let along = Along {
        cell: build.cell,
        moves: build.joint_moves,
        start: build.start,
        commands: build.commands,
    };
    let controller = build.controller;
    let summary = if build.weaves.is_empty() {
        joints::simulate(&along, controller, observer, &mut both)?
    } else {
        let weaves = (build.weaves, build.weave_of_command);
        let mut weaving = Weaving::new(weaves.0, weaves.1, controller, &mut both)
            .map_err(MotionError::Controller)?;
        let summary = joints::simulate(&along, controller, observer, &mut weaving)?;
        weaving.finish();
        summary
    };
    let summary = build.pacing.summary(summary, build.commands);
    let deposit = deposition.finish();
    if let Some(e) = trouble {
        return Err(e.into());
    }
    Ok(Simulation {
        summary,
        samples: recorder.finish(),
        ctwd,
        layers,
        deposit,
        heights,
        arc_starts,
        metal,
    })
}

/// The outcome of one layer.
pub(in crate::waam) fn outcome(
    record: &LayerRecord,
    map: &HeightMap,
    plan: Option<&PlannedLayer>,
) -> LayerOutcome {
    let inner = plan.and_then(|p| layer_top(map, &map.z, &p.inner));
    let crests = || spread(record.path.iter().map(|p| p.crest.z).collect());
    let worst = record
        .accumulations
        .iter()
        .max_by(|a, b| a.ratio.total_cmp(&b.ratio));
    LayerOutcome {
        layer: record.layer,
        planned_top: plan.map_or(f64::NAN, |p| p.top),
        mean_top: record.crest.map(|c| c.mean),
        flatness: inner.map(|t| t.spread).or_else(crests),
        ctwd_mean: record.ctwd.map_or(f64::NAN, |c| c.mean),
        ctwd_range: record
            .ctwd
            .map_or((f64::NAN, f64::NAN), |c| (c.least, c.greatest)),
        tube: None,
        accumulation: worst.map(|a| (a.ratio - 1.0, a.position)),
        wire: record.wire,
        arc_time: record.arc_time,
        length: record.length,
        hanging: record.hanging,
        beads: record.beads,
    }
}
