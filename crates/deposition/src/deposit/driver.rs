//! Drives the deposit with motion: arc starts, pursuit, substeps, records. Streaming: memory is that of the map plus one
//! layer of path points.

mod laying;

use std::collections::VecDeque;

use meltpath_base::{Place, Reporter};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_toolpath::motion::{MotionBlock, MotionSink};

use super::feeding::{Feeding, check_sizes};
use super::levelling::MoltenZone;
use super::passing::Passing;
use super::record::{ArcStart, LayerRecord, Moment, TubeDistance};
use super::{DepositError, Mode, Settings, Station, Walk};
use crate::bead::{BeadModel, PoolModel};
use crate::pursuit::Pursuit;

type OnLayer<'a> = Box<dyn FnMut(&LayerRecord, &HeightMap) + 'a>;

/// What has been deposited.
#[derive(Debug, Clone, PartialEq)]
pub struct Deposit {
    /// The surface.
    pub map: HeightMap,
    /// Wire fed, mm: with the source's answer to the contact tube distance, where there is one.
    pub wire: f64,
    /// Metal laid, mm³: efficiency times wire section times wire.
    pub volume: f64,
    /// Metal that fell beside the map, mm³; 0 unless the map was too small for the path.
    pub beside: f64,
    /// Where the wire's tip passed nearest over metal and plate on each travel between beads, and how near, mm; below zero in it. A bead's
    /// width around the ends of beads is left out.
    pub passed: Vec<TubeDistance>,
}

/// Lays metal along motion.
///
/// - Give it motion blocks in order of time through [`MotionSink`], then [`Deposition::finish`].
/// - Beads start where wire begins to be fed and end where it stops; layers come from
///   [`Deposition::with_layers`].
/// - Validity: torch within some degrees of vertical, each bead supported by metal or plate; elsewhere a height map
///   cannot hold what happens, and a warning says where.
///
/// ```
/// use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
/// use meltpath_deposition::deposit::{Deposition, Settings};
/// use meltpath_geometry::{math::{DVec2, DVec3}, workpiece::HeightMap};
/// use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};
///
/// let bead = BeadModel { width: 6.5, area: 9.6, wire_section: 0.785, efficiency: 1.0, width_exponent: 0.345, feed_exponent: 0.446 };
/// let pool = PoolModel { front: 3.6, rear: 10.8, half_width: 3.6, offset: 1.66, pursuit: PursuitLength::Fixed(4.0) };
/// let pool = PoolModel::for_bead(&pool, &bead);
/// let map = HeightMap::new(DVec2::splat(-10.0), DVec2::new(50.0, 10.0), 0.5, 0.0).unwrap();
/// let mut deposition = Deposition::new(map, bead, pool, Settings::default()).unwrap();
/// let position: Vec<_> = (0..=400).map(|i| DVec3::X * 0.1 * f64::from(i)).collect();
/// let mut wire = vec![1.22; 401];
/// wire[0] = 0.0;
/// deposition.block(&MotionBlock {
///     times: Times::Uniform { t0: 0.0, dt: 0.008 }, speed: vec![12.5; 401], wire, command: vec![1; 401], axis: vec![], position,
///     ..MotionBlock::default()
/// });
/// let deposit = deposition.finish();
/// assert!((deposit.map.volume() / (400.0 * 1.22 * 0.785) - 1.0).abs() < 1e-9);
/// ```
pub struct Deposition<'a> {
    map: HeightMap,
    bead: BeadModel,
    pool: PoolModel,
    settings: Settings,
    layers: Vec<u32>,
    reporter: Option<&'a Reporter>,
    on_layer: Option<OnLayer<'a>>,
    zone: MoltenZone,
    weights: Vec<(u32, f64)>,
    /// The sample before: where and when.
    previous: Option<(DVec3, f64)>,
    run: Option<Bead>,
    record: Option<LayerRecord>,
    wire: f64,
    volume: f64,
    beside: f64,
    overhang: Option<Overhang>,
    beyond: Beyond,
    passing: Passing,
    told: Told,
}

/// The bead being laid.
struct Bead {
    start: DVec3,
    torch: DVec2,
    pursuit: Option<Pursuit>,
    station: Option<Station>,
    /// Travel of the torch since the arc start, mm.
    travelled: f64,
    /// Volume fed and not laid yet, mm³, and the travel it belongs to, mm.
    pending: f64,
    pending_travel: f64,
    /// The local feed per length.
    feeding: Feeding,
    /// Wire fed over wire asked for, now.
    response: f64,
    /// Path points whose bead is not frozen yet: (travel of the pool, index in the record, ground).
    open: VecDeque<(f64, usize, f64)>,
    /// Ground seen ahead of the stamps (plain mode): (travel, height).
    ahead: VecDeque<(f64, f64)>,
    recorded: f64,
    ground: f64,
}

#[derive(Debug, Clone, Copy)]
struct Overhang {
    position: DVec2,
    length: f64,
}

/// Travel at distances where the source's answer was not measured.
#[derive(Debug, Clone, Copy, Default)]
struct Beyond {
    length: f64,
    of: f64,
    /// Farthest from the reference: tool point and distance.
    worst: Option<(DVec3, f64)>,
}

/// Warnings given once.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    tilted: Option<DVec3>,
    skipped: u64,
}

impl<'a> Deposition<'a> {
    /// A deposition on `map`, by `bead` and `pool`.
    ///
    /// # Errors
    /// [`DepositError::Size`] naming the first size that is not positive and finite.
    pub fn new(
        map: HeightMap,
        bead: BeadModel,
        pool: PoolModel,
        settings: Settings,
    ) -> Result<Self, DepositError> {
        check_sizes(&bead, &pool, &settings)?;
        Ok(Deposition {
            zone: MoltenZone::new(&map),
            map,
            bead,
            pool,
            settings,
            layers: Vec::new(),
            reporter: None,
            on_layer: None,
            weights: Vec::new(),
            previous: None,
            run: None,
            record: None,
            wire: 0.0,
            volume: 0.0,
            beside: 0.0,
            overhang: None,
            beyond: Beyond::default(),
            passing: Passing::default(),
            told: Told::default(),
        })
    }

    /// The layer of each command (index: command number); commands past the end belong to layer 0.
    #[must_use]
    pub fn with_layers(mut self, layer_of_command: Vec<u32>) -> Self {
        self.layers = layer_of_command;
        self
    }

    /// Calls `f` at the end of each layer, with its record and the surface at that time.
    #[must_use]
    pub fn on_layer(mut self, f: impl FnMut(&LayerRecord, &HeightMap) + 'a) -> Self {
        self.on_layer = Some(Box::new(f));
        self
    }

    /// Collects warnings in `reporter`.
    #[must_use]
    pub fn reporting_to(mut self, reporter: &'a Reporter) -> Self {
        self.reporter = Some(reporter);
        self
    }

    /// The surface as it is now.
    pub fn map(&self) -> &HeightMap {
        &self.map
    }

    /// Ends the last bead and layer and hands over the part.
    pub fn finish(mut self) -> Deposit {
        self.end_bead();
        self.end_layer();
        self.passing.arrive(None, self.bead.width);
        if let Some(reporter) = self.reporter {
            if let Some(p) = self.told.tilted {
                reporter.warn_at(
                    "torch-tilted",
                    "the torch leans by more than 15°: the height map lays metal along z only",
                    Place::at(p.to_array()),
                    "keep the torch upright, or take the result there as indicative",
                );
            }
            if self.told.skipped > 0 {
                reporter.warn(
                    "motion-not-finite",
                    format!(
                        "{} motion samples without a finite position or wire were skipped",
                        self.told.skipped
                    ),
                    "check the program",
                );
            }
            self.warn_of_distance(reporter);
            if self.beside > 0.0 {
                reporter.warn(
                    "metal-beside-map",
                    format!("{:.1} mm³ fell beside the height map", self.beside),
                    "make the map a bead wider than the path on every side",
                );
            }
        }
        Deposit {
            map: self.map,
            wire: self.wire,
            volume: self.volume,
            beside: self.beside,
            passed: self.passing.least(),
        }
    }

    /// Tells when more than a hundredth of the beads was laid at distances where the source was not measured.
    fn warn_of_distance(&self, reporter: &Reporter) {
        let (Some(response), Some((tool, distance))) =
            (self.settings.feed_response, self.beyond.worst)
        else {
            return;
        };
        let share = self.beyond.length / self.beyond.of;
        if share > 0.01 {
            let (least, greatest) = response.measured;
            reporter.warn_at(
                "feed-response-extrapolated",
                format!(
                    "{:.0} mm of bead ({:.0} %) are laid with the contact tube outside {least:.1} to {greatest:.1} mm from the part, where the wire feed of the source was measured; farthest out: {distance:.1} mm",
                    self.beyond.length,
                    100.0 * share
                ),
                Place::at(tool.to_array()),
                "keep the contact tube at its distance (layers.height), or measure the feed there",
            );
        }
    }

    fn layer_of(&self, command: u32) -> u32 {
        self.layers.get(command as usize).copied().unwrap_or(0)
    }

    fn begin_bead(&mut self, start: DVec3, time: f64, command: u32) {
        self.passing.arrive(Some(start.truncate()), self.bead.width);
        let layer = self.layer_of(command);
        if self.record.as_ref().is_some_and(|r| r.layer != layer) {
            self.end_layer();
        }
        let record = self.record.get_or_insert_with(|| LayerRecord::new(layer));
        record.beads += 1;
        record.arc_starts.push(ArcStart {
            position: start,
            time,
            command,
        });
        self.run = Some(Bead {
            start,
            torch: start.truncate(),
            pursuit: None,
            station: None,
            travelled: 0.0,
            pending: 0.0,
            pending_travel: 0.0,
            feeding: Feeding::new(&self.bead, &self.pool),
            response: 1.0,
            open: VecDeque::new(),
            ahead: VecDeque::new(),
            recorded: f64::NEG_INFINITY,
            ground: self.map.height(start.truncate()),
        });
    }

    fn end_bead(&mut self) {
        let Some(mut run) = self.run.take() else {
            return;
        };
        if run.pending > 0.0 {
            // an arc that never moved leaves a round dot
            if run.station.is_none() {
                self.start_pursuit(&mut run, DVec2::X);
            }
            match self.settings.mode {
                Mode::Plain => self.lay_plain(&mut run),
                Mode::Build(model) => self.lay_levelled(&mut run, &model),
            }
        }
        self.zone.freeze_all();
        self.settle(&mut run, f64::INFINITY);
    }

    fn end_layer(&mut self) {
        let Some(mut record) = self.record.take() else {
            return;
        };
        let ends = self.pool.length();
        record.close(ends, self.settings.accumulation, self.bead.width);
        let overhang = self.overhang.take();
        record.hanging = overhang.as_ref().map_or(0.0, |o| o.length);
        // less than half a bead is an end that reaches over an edge
        let overhang = overhang.filter(|o| o.length > 0.5 * self.bead.width);
        if let (Some(o), Some(reporter)) = (overhang, self.reporter) {
            let mut place = Place::at(o.position.extend(self.map.height(o.position)).to_array());
            place.layer = Some(record.layer);
            reporter.warn_at(
                "overhang",
                format!(
                    "layer {}: {:.0} mm of bead hang out by more than a quarter of their width, the height map is not valid there",
                    record.layer, o.length
                ),
                place,
                "lean the part less, or support the overhang",
            );
        }
        if let Some(f) = &mut self.on_layer {
            f(&record, &self.map);
        }
    }

    fn start_pursuit(&mut self, run: &mut Bead, heading: DVec2) {
        let start = run.start.truncate();
        run.pursuit = Some(Pursuit::new(
            start.extend(0.0),
            heading.extend(0.0),
            self.pool.pursuit,
            self.settings.pursuit,
        ));
        run.station = Some(Station {
            centre: start - self.pool.offset * heading,
            heading,
            travelled: 0.0,
            rise: 0.0,
        });
    }

    /// The torch moves from `from` to `to` while `wire` mm of wire are fed.
    fn feed(&mut self, from: DVec3, to: DVec3, wire: f64, (time, dt): (f64, f64), command: u32) {
        if self.run.is_some() {
            let layer = self.layer_of(command);
            // one arc may run on into the next layer (a spiral): the bead goes on, the record changes
            if self.record.as_ref().is_some_and(|r| r.layer != layer) {
                if let Some(mut run) = self.run.take() {
                    self.settle(&mut run, f64::INFINITY);
                    self.run = Some(run);
                }
                self.end_layer();
                let mut next = LayerRecord::new(layer);
                next.beads = 1;
                self.record = Some(next);
            }
        } else {
            self.begin_bead(from, time - dt, command);
        }
        let Some(mut run) = self.run.take() else {
            return;
        };
        let length = from.truncate().distance(to.truncate());
        if let Some(r) = &mut self.record {
            r.arc_time += dt;
            r.length += length;
        }
        if run.pursuit.is_none() {
            if let Some(heading) = (to - run.start).truncate().try_normalize() {
                self.start_pursuit(&mut run, heading);
            } else {
                let asked = self.asked_volume(wire);
                let at = Moment {
                    tool: to,
                    time,
                    command,
                };
                run.pending += self.supply(&mut run, at, 0.0, asked);
                self.run = Some(run);
                return;
            }
        }
        let asked = self.asked_volume(wire);
        let mut walk = Walk::along(length);
        while let Some(piece) = walk.next(&self.settings, run.pending_travel) {
            let at = Moment {
                tool: from.lerp(to, piece.end),
                time: time - dt * (1.0 - piece.end),
                command,
            };
            self.substep(&mut run, at, (piece.length, asked * piece.share));
        }
        self.run = Some(run);
    }
}

impl MotionSink for Deposition<'_> {
    fn block(&mut self, block: &MotionBlock) {
        for (i, &to) in block.position.iter().enumerate() {
            let wire = block.wire.get(i).copied().unwrap_or(0.0);
            let time = block.time(i);
            if !(to.is_finite() && wire.is_finite() && time.is_finite()) {
                self.told.skipped += 1;
                continue;
            }
            let before = self.previous.replace((to, time));
            let from = before.map_or(to, |(at, _)| at);
            if wire > 0.0 {
                let leans = block.axis.get(i).is_some_and(|a| a.z < 0.966);
                if leans && self.told.tilted.is_none() {
                    self.told.tilted = Some(to);
                }
                let command = block.command.get(i).copied().unwrap_or(0);
                let dt = block.stretch(i, before.map(|(_, time)| time));
                self.feed(from, to, wire, (time, dt), command);
            } else {
                self.end_bead();
                let at = Moment {
                    tool: to,
                    time,
                    command: block.command.get(i).copied().unwrap_or(0),
                };
                self.passing.pass(&self.map, self.bead.width, at);
            }
        }
    }
}
