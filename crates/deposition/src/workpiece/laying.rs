//! Drives metal in space with motion: arc starts, pursuit, substeps, the moving patch, what froze into the voxels.

mod stepping;

use std::collections::VecDeque;

use meltpath_base::{Place, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::Voxels;
use meltpath_toolpath::motion::{MotionBlock, MotionSink};

use super::patch::Patch;
use super::record::{Laid, LaidPoint, Loose, Support};
use crate::bead::{BeadModel, PoolModel};
use crate::deposit::feeding::{Feeding, check_sizes};
use crate::deposit::{DepositError, Settings, Walk};
use crate::pursuit::Pursuit;

type OnLayer<'a> = Box<dyn FnMut(u32, &Voxels) + 'a>;

/// Lays metal along motion, along the torch axis at each place, on whatever is in the voxels.
///
/// - Give it motion blocks in order of time through [`MotionSink`], then [`Laying::finish`]. The axis of a sample points from the part to
///   the torch; without axes it is +z.
/// - Beads start where wire begins to be fed and end where it stops.
/// - Metal that has none within reach of the arc (the contact tube's nominal distance, beyond the wire tip) is laid where the tip is, and
///   told: it would fall.
///
/// ```
/// use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
/// use meltpath_deposition::{deposit::Settings, workpiece::Laying};
/// use meltpath_geometry::{math::DVec3, workpiece::Voxels};
/// use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};
///
/// let bead = BeadModel { width: 6.5, area: 9.6, wire_section: 0.785, efficiency: 1.0, width_exponent: 0.345, feed_exponent: 0.446 };
/// let pool = PoolModel { front: 3.6, rear: 10.8, half_width: 3.6, offset: 1.66, pursuit: PursuitLength::Fixed(4.0) };
/// // a plate that stands upright, and the torch level
/// let mut plate = Voxels::new(DVec3::new(-4.0, -12.0, -12.0), DVec3::new(6.0, 52.0, 12.0), 0.5).unwrap();
/// plate.fill_box(DVec3::new(-4.0, -12.0, -12.0), DVec3::new(0.0, 52.0, 12.0)).unwrap();
/// let before = plate.volume();
/// let mut laying = Laying::new(plate, bead, PoolModel::for_bead(&pool, &bead), Settings::default()).unwrap();
/// let position: Vec<_> = (0..=400).map(|i| DVec3::Y * 0.1 * f64::from(i)).collect();
/// let mut wire = vec![1.22; 401];
/// wire[0] = 0.0;
/// laying.block(&MotionBlock {
///     times: Times::Uniform { t0: 0.0, dt: 0.008 }, wire, command: vec![1; 401], axis: vec![DVec3::X; 401], position,
///     ..MotionBlock::default()
/// });
/// let laid = laying.finish();
/// assert!(((laid.voxels.volume() - before) / (400.0 * 1.22 * 0.785) - 1.0).abs() < 1e-6);
/// assert!(laid.loose.is_empty());
/// ```
pub struct Laying<'a> {
    voxels: Voxels,
    bead: BeadModel,
    pool: PoolModel,
    settings: Settings,
    reporter: Option<&'a Reporter>,
    weights: Vec<(u32, f64)>,
    previous: Option<Sample>,
    run: Option<Bead>,
    /// Metal that found no room yet, mm³.
    owed: f64,
    laid: Totals,
    skipped: u64,
    layers: Vec<u32>,
    layer: Option<u32>,
    on_layer: Option<OnLayer<'a>>,
}

/// A motion sample.
#[derive(Debug, Clone, Copy)]
struct Sample {
    tool: DVec3,
    axis: DVec3,
    time: f64,
}

/// What has been booked.
#[derive(Debug, Default)]
struct Totals {
    wire: f64,
    volume: f64,
    loose_volume: f64,
    loose: Vec<Loose>,
    path: Vec<LaidPoint>,
    beads: u32,
}

/// A place of the pool, in the part's frame.
#[derive(Debug, Clone, Copy)]
struct Spot {
    centre: DVec3,
    heading: DVec3,
    axis: DVec3,
    travelled: f64,
    /// The path's plane here: the centre less what the path moved towards or away from the metal.
    plane: DVec3,
    /// Where the torch's axis through the centre meets the metal.
    struck: DVec3,
}

/// The bead being laid.
struct Bead {
    start: DVec3,
    torch: Sample,
    command: u32,
    pursuit: Option<Pursuit>,
    patch: Option<Patch>,
    /// Where the pool has been, as far back as it is molten.
    trail: VecDeque<Spot>,
    /// How far the path moved along the axis without the metal doing so, and its height over the metal, low-passed, mm.
    drift: f64,
    over: f64,
    /// Travel of the torch since the arc start, mm.
    travelled: f64,
    pending: f64,
    pending_travel: f64,
    feeding: Feeding,
    response: f64,
    /// Path points whose bead is not frozen yet: (travel of the pool, index in the path, ground, where).
    open: VecDeque<(f64, usize, DVec3)>,
    recorded: f64,
    support: Support,
}

impl<'a> Laying<'a> {
    /// Beads by `bead` and `pool` on the metal in `voxels`.
    ///
    /// # Errors
    /// [`DepositError::Size`] naming the first size that is not positive and finite.
    pub fn new(
        voxels: Voxels,
        bead: BeadModel,
        pool: PoolModel,
        settings: Settings,
    ) -> Result<Self, DepositError> {
        check_sizes(&bead, &pool, &settings)?;
        Ok(Laying {
            voxels,
            bead,
            pool,
            settings,
            reporter: None,
            weights: Vec::new(),
            previous: None,
            run: None,
            owed: 0.0,
            laid: Totals::default(),
            skipped: 0,
            layers: Vec::new(),
            layer: None,
            on_layer: None,
        })
    }

    /// Collects warnings in `reporter`.
    #[must_use]
    pub fn reporting_to(mut self, reporter: &'a Reporter) -> Self {
        self.reporter = Some(reporter);
        self
    }

    /// The layer of each command (index: command number); commands past the end belong to layer 0.
    #[must_use]
    pub fn with_layers(mut self, layer_of_command: Vec<u32>) -> Self {
        self.layers = layer_of_command;
        self
    }

    /// Calls `f` at the end of each layer, with its number and the metal that is solid by then.
    #[must_use]
    pub fn on_layer(mut self, f: impl FnMut(u32, &Voxels) + 'a) -> Self {
        self.on_layer = Some(Box::new(f));
        self
    }

    /// The metal that is solid by now.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// Ends the last bead and hands over the metal.
    pub fn finish(mut self) -> Laid {
        self.end_bead();
        self.end_layer();
        let laid = Laid {
            voxels: self.voxels,
            wire: self.laid.wire,
            volume: self.laid.volume,
            beside: if self.owed > 1e-6 { self.owed } else { 0.0 },
            loose_volume: self.laid.loose_volume,
            loose: self.laid.loose,
            path: self.laid.path,
            beads: self.laid.beads,
        };
        if let Some(reporter) = self.reporter {
            warn(reporter, &laid, self.skipped);
        }
        laid
    }

    /// Tells that the layer is whole that was laid last.
    fn end_layer(&mut self) {
        if let (Some(layer), Some(f)) = (self.layer.take(), &mut self.on_layer) {
            f(layer, &self.voxels);
        }
    }

    /// Notes the layer of what is laid now; one arc may run on from one layer to the next.
    fn enter_layer(&mut self, command: u32) {
        let layer = self.layers.get(command as usize).copied().unwrap_or(0);
        if self.layer != Some(layer) {
            self.end_layer();
            self.layer = Some(layer);
        }
    }

    fn begin_bead(&mut self, from: Sample, command: u32) {
        self.laid.beads += 1;
        self.run = Some(Bead {
            start: from.tool,
            torch: from,
            command,
            pursuit: None,
            patch: None,
            trail: VecDeque::new(),
            drift: 0.0,
            over: f64::NAN,
            travelled: 0.0,
            pending: 0.0,
            pending_travel: 0.0,
            feeding: Feeding::new(&self.bead, &self.pool),
            response: 1.0,
            open: VecDeque::new(),
            recorded: f64::NEG_INFINITY,
            support: Support::Metal,
        });
    }

    fn start_pursuit(&mut self, run: &mut Bead, heading: DVec3) {
        run.pursuit = Some(Pursuit::new(
            run.start,
            heading,
            self.pool.pursuit,
            self.settings.pursuit,
        ));
        let centre = run.start - self.pool.offset * heading;
        run.trail.push_back(Spot {
            centre,
            heading,
            axis: run.torch.axis,
            travelled: 0.0,
            plane: centre,
            struck: centre,
        });
    }

    fn end_bead(&mut self) {
        let Some(mut run) = self.run.take() else {
            return;
        };
        if run.pending > 0.0 {
            // an arc that never moved leaves a round dot
            if run.trail.is_empty() {
                let aside = run.torch.axis.any_orthonormal_vector();
                self.start_pursuit(&mut run, aside);
            }
            self.lay(&mut run);
        }
        if let Some(patch) = &mut run.patch {
            patch.zone.freeze_all();
        }
        self.settle(&mut run, f64::INFINITY);
        self.solidify(&mut run, f64::INFINITY);
    }

    /// The torch moves while `wire` mm of wire are fed.
    fn feed(&mut self, from: Sample, to: Sample, wire: f64, command: u32) {
        self.enter_layer(command);
        if self.run.is_none() {
            self.begin_bead(from, command);
        }
        let Some(mut run) = self.run.take() else {
            return;
        };
        run.command = command;
        let length = from.tool.distance(to.tool);
        let asked = wire * self.bead.wire_section * self.bead.efficiency;
        if run.pursuit.is_none() {
            run.torch = to;
            if let Some(heading) = (to.tool - run.start).try_normalize() {
                self.start_pursuit(&mut run, heading);
            } else {
                run.pending += self.supply(&mut run, to, asked);
                self.run = Some(run);
                return;
            }
        }
        let mut walk = Walk::along(length);
        while let Some(piece) = walk.next(&self.settings, run.pending_travel) {
            let t = piece.end;
            let axis = from.axis.lerp(to.axis, t);
            let at = Sample {
                tool: from.tool.lerp(to.tool, t),
                axis: axis.try_normalize().unwrap_or(to.axis),
                time: from.time + t * (to.time - from.time),
            };
            self.substep(&mut run, at, (piece.length, asked * piece.share));
        }
        self.run = Some(run);
    }
}

impl MotionSink for Laying<'_> {
    fn block(&mut self, block: &MotionBlock) {
        for (i, &tool) in block.position.iter().enumerate() {
            let wire = block.wire.get(i).copied().unwrap_or(0.0);
            let time = block.time(i);
            let axis = block.axis.get(i).copied().unwrap_or(DVec3::Z);
            let unit = axis.try_normalize();
            let (true, Some(axis)) = (
                tool.is_finite() && wire.is_finite() && time.is_finite(),
                unit,
            ) else {
                self.skipped += 1;
                continue;
            };
            let to = Sample { tool, axis, time };
            let from = self.previous.replace(to).unwrap_or(to);
            if wire > 0.0 {
                let command = block.command.get(i).copied().unwrap_or(0);
                self.feed(from, to, wire, command);
            } else {
                self.end_bead();
            }
        }
    }
}

/// Tells what went wrong, once each.
fn warn(reporter: &Reporter, laid: &Laid, skipped: u64) {
    if skipped > 0 {
        reporter.warn(
            "motion-not-finite",
            format!(
                "{skipped} motion samples without a finite position, axis or wire were skipped"
            ),
            "check the program",
        );
    }
    if laid.beside > 0.0 {
        reporter.warn(
            "metal-beside-voxels",
            format!(
                "{:.1} mm³ found no room in the box of voxels or in its memory",
                laid.beside
            ),
            "make the box wider than the path by two beads on every side, or the voxels larger",
        );
    }
    for (support, id, what) in [
        (
            Support::None,
            "bead-hangs-free",
            "no metal under their axis within reach of the arc",
        ),
        (
            Support::Partial,
            "bead-hangs-over",
            "no metal under a quarter of their width",
        ),
    ] {
        let of_kind = || laid.loose.iter().filter(|l| l.support == support);
        let length: f64 = of_kind().map(|l| l.length).sum();
        if let Some(longest) = of_kind().max_by(|a, b| a.length.total_cmp(&b.length)) {
            reporter.warn_at(
                id,
                format!(
                    "{length:.0} mm of bead have {what}; the longest stretch is {:.0} mm, in bead {}",
                    longest.length,
                    longest.bead + 1
                ),
                Place::at(longest.position.to_array()),
                "lean the torch along the wall, support the bead, or start it on metal",
            );
        }
    }
}
