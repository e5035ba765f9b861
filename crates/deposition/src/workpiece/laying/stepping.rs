//! One step of the pool in space: what the source feeds, where the patch is, what freezes, what is noted.

use meltpath_geometry::math::{DVec2, DVec3};

use super::{Bead, Laying, Sample, Spot};
use crate::deposit::feeding::LocalFeed;
use crate::deposit::levelling::{Frozen, Levelling, LocalBead};
use crate::deposit::{Mode, ROUNDING, Station, plain};
use crate::workpiece::BEND;
use crate::workpiece::patch::{Patch, Window};
use crate::workpiece::record::{LaidPoint, Loose, Support};

impl Laying<'_> {
    /// What the source really feeds of the volume asked for, booked.
    pub(super) fn supply(&mut self, run: &mut Bead, at: Sample, asked: f64) -> f64 {
        let distance = self.distance(run, at);
        if let Some(response) = self.settings.feed_response {
            run.response = response.ratio(distance);
        }
        let volume = asked * run.response;
        self.laid.wire += volume / (self.bead.wire_section * self.bead.efficiency);
        self.laid.volume += volume;
        volume
    }

    /// Contact tube to the metal that this bead finds under the wire, along the axis, mm; beyond twice the nominal distance there is
    /// none within reach, and that is told.
    fn distance(&mut self, run: &mut Bead, at: Sample) -> f64 {
        self.follow(run, at);
        let nominal = self.settings.nominal_ctwd;
        let Some(patch) = &mut run.patch else {
            return nominal;
        };
        let (_, window) = window_at(&self.bead, &self.settings, patch, (at.tool, at.tool));
        let over = patch.over(&self.voxels, (at.tool, at.axis), &window, nominal);
        nominal + over.min(nominal)
    }

    pub(super) fn substep(&mut self, run: &mut Bead, at: Sample, (travel, asked): (f64, f64)) {
        run.torch = at;
        let volume = self.supply(run, at, asked);
        run.travelled += travel;
        run.pending += volume;
        run.pending_travel += travel;
        let Some(pursuit) = &mut run.pursuit else {
            return;
        };
        pursuit.follow(at.tool);
        let laws = (&self.bead, &self.pool);
        run.feeding.pass(laws, travel, (asked, volume));
        let due = match self.settings.mode {
            Mode::Plain => 0.0,
            Mode::Build(model) => model.step - ROUNDING,
        };
        if run.pending_travel.max(run.pending / self.bead.area) >= due {
            self.lay(run);
        }
        if run.travelled - run.recorded >= self.settings.record_step {
            run.recorded = run.travelled;
            self.note(run, at);
        }
    }

    /// Lays all that is pending.
    pub(super) fn lay(&mut self, run: &mut Bead) {
        let Some(heading) = run.pursuit.as_ref().map(crate::pursuit::Pursuit::heading) else {
            return;
        };
        let local = run.feeding.local(&self.bead);
        self.follow(run, run.torch);
        match self.settings.mode {
            Mode::Plain => self.stamp(run, heading, local),
            Mode::Build(model) => self.level(run, heading, local, &model),
        }
        (run.pending, run.pending_travel) = (0.0, 0.0);
    }

    /// Takes a new patch where the old one is left. Its columns lie along the axis of the metal that freezes next, so that metal
    /// stands on what it was laid on: along the axis at the torch, a pool that turns would slide off the wall sidewards.
    fn follow(&mut self, run: &mut Bead, at: Sample) {
        let rear = run.trail.back().map_or(0.0, |s| s.travelled) - self.pool.rear;
        let molten = |s: &&Spot| s.travelled >= rear && s.axis.dot(at.axis) >= BEND.cos();
        let axis = run.trail.iter().find(molten).map_or(at.axis, |s| s.axis);
        let reach = self.pool.length();
        let margin = self.pool.half_width + 4.0 * self.voxels.cell();
        if let Some(patch) = &run.patch
            && !patch.is_left(at.tool, axis, 2.0 * margin)
        {
            return;
        }
        let ahead = run.trail.back().map_or(DVec3::X, |s| s.heading);
        let half = 2.0 * reach + 2.0 * margin;
        let Some(mut next) = Patch::new(&self.voxels, (at.tool, axis, ahead), half) else {
            return;
        };
        let Some(mut earlier) = run.patch.take() else {
            run.patch = Some(next);
            return;
        };
        if let Mode::Build(model) = self.settings.mode {
            let local = run.feeding.local(&self.bead);
            let bead = self.local_bead(local);
            let trail: Vec<Station> = run.trail.iter().map(|s| station(&next, s)).collect();
            for at in &trail {
                let ground = at.rise - run.over_or_0();
                let window = window(&self.bead, &self.settings, at.rise, ground);
                self.read_about(&mut next, at.centre, &window);
            }
            next.resume(&earlier, (&model, &bead), &trail);
            if next.zone.is_empty() {
                earlier.zone.freeze_all();
            }
        }
        run.patch = Some(earlier);
        if !matches!(self.settings.mode, Mode::Build(_)) || next.zone.is_empty() {
            self.solidify(run, f64::INFINITY);
        }
        run.patch = Some(next);
    }

    fn read_about(&self, patch: &mut Patch, p: DVec2, window: &Window) {
        let reach = 1.5 * self.pool.half_width + 3.0 * patch.columns.side;
        let margin = DVec2::splat(reach);
        patch.read(&self.voxels, (p - margin, p + margin), window);
    }

    fn local_bead(&self, LocalFeed { ratio, wide }: LocalFeed) -> LocalBead {
        LocalBead {
            half_width: 0.5 * self.bead.width * wide,
            height: self.bead.height() * ratio / wide,
            rear: self.pool.at_feed(ratio, wide).rear,
        }
    }

    /// One step of the molten zone.
    fn level(&mut self, run: &mut Bead, heading: DVec3, local: LocalFeed, model: &Levelling) {
        let pool = self.pool.at_feed(local.ratio, local.wide);
        let over = run.over_or_0();
        let (Some(&from), Some(patch)) = (run.trail.back(), &mut run.patch) else {
            return;
        };
        let axis = run.torch.axis;
        let centre = run.torch.tool - pool.offset * heading;
        // columns lean against the torch by up to a patch's turn: the arc strikes the metal aside of what lies under the wire's tip
        let struck = centre - over * axis;
        let (at, window) = window_at(&self.bead, &self.settings, patch, (centre, struck));
        let reach = 1.5 * self.pool.half_width + 3.0 * patch.columns.side;
        let around = DVec2::splat(reach);
        let start = patch.local(from.struck).truncate();
        let (lo, hi) = (start.min(at.truncate()), start.max(at.truncate()));
        patch.read(&self.voxels, (lo - around, hi + around), &window);
        let free = patch.is_void(at.truncate());
        if free {
            patch.hang(at.truncate(), 0.5 * self.bead.width * local.wide, at.z);
        }
        // the path's plane: what the path moves along the axis and the metal does not is drift
        let reach = self.settings.nominal_ctwd;
        let over = patch.over(&self.voxels, (centre, axis), &window, reach);
        let moved = (centre - from.centre).dot(axis);
        let step = centre.distance(from.centre);
        if run.over.is_nan() {
            run.over = over;
        } else {
            let follow = 1.0 - (-step / (0.5 * pool.rear)).exp();
            let drawn = follow * (over - run.over);
            run.over += drawn;
            run.drift += drawn.clamp(moved.min(0.0), moved.max(0.0));
        }
        let spot = Spot {
            centre,
            heading,
            axis,
            travelled: from.travelled + step,
            plane: centre - run.drift * axis,
            struck: centre - run.over * axis,
        };
        let (before, now) = (station(patch, &from), station(patch, &spot));
        let mut bead = self.local_bead(local);
        // where the axis turns fast, the rear freezes earlier
        let bent = run
            .trail
            .iter()
            .rev()
            .find(|s| s.axis.dot(axis) < BEND.cos());
        if let Some(bent) = bent {
            bead.rear = bead.rear.min(spot.travelled - bent.travelled);
        }
        let report = patch
            .zone
            .step(&mut patch.map, model, &bead, &before, &now, run.pending);
        self.owed += report.lost;
        run.support = match (free, report.hangs) {
            (true, _) => Support::None,
            (false, true) => Support::Partial,
            (false, false) => Support::Metal,
        };
        self.book_loose(run, &spot, step);
        run.trail.push_back(spot);
        let past = spot.travelled - self.pool.rear - 2.0 * model.step;
        while run.trail.len() > 2 && run.trail.front().is_some_and(|s| s.travelled < past) {
            run.trail.pop_front();
        }
        self.settle(run, spot.travelled - bead.rear);
        self.solidify(run, spot.travelled - bead.rear);
    }

    /// One stamp, without levelling.
    fn stamp(&mut self, run: &mut Bead, heading: DVec3, local: LocalFeed) {
        let pool = self.pool.at_feed(local.ratio, local.wide);
        let (Some(&from), Some(patch)) = (run.trail.back(), &mut run.patch) else {
            return;
        };
        let centre = run.torch.tool - pool.offset * heading;
        let spot = Spot {
            centre,
            heading,
            axis: run.torch.axis,
            travelled: run.travelled,
            plane: centre,
            struck: centre,
        };
        let (at, window) = window_at(&self.bead, &self.settings, patch, (centre, centre));
        let now = station(patch, &spot);
        // the box of the pool, and a column more
        let (back, ahead) = (
            now.centre - pool.rear * now.heading,
            now.centre + pool.front * now.heading,
        );
        let around = DVec2::splat(pool.half_width + patch.columns.side);
        let corners = (back.min(ahead) - around, back.max(ahead) + around);
        patch.read(&self.voxels, corners, &window);
        let free = patch.is_void(at.truncate());
        patch.hang(at.truncate(), pool.front.max(pool.rear), at.z);
        self.owed += plain::stamp(&mut patch.map, &mut self.weights, &pool, &now, run.pending);
        patch.note_stamp(self.weights.iter().map(|w| w.0), run.travelled);
        run.support = if free { Support::None } else { Support::Metal };
        self.book_loose(run, &spot, centre.distance(from.centre));
        run.trail.clear();
        run.trail.push_back(spot);
        self.settle(run, run.travelled - pool.front - pool.rear);
        self.solidify(run, run.travelled - 1.0);
    }

    fn book_loose(&mut self, run: &Bead, spot: &Spot, step: f64) {
        if run.support == Support::Metal {
            return;
        }
        let bead = self.laid.beads - 1;
        let joins = |l: &Loose| {
            l.bead == bead
                && l.support == run.support
                && spot.centre.distance(l.position) < l.length + 2.0 * step + 1.0
        };
        if let Some(last) = self.laid.loose.last_mut().filter(|l| joins(l)) {
            last.length += step;
        } else {
            self.laid.loose.push(Loose {
                position: spot.centre,
                length: step,
                bead,
                command: run.command,
                support: run.support,
            });
        }
    }

    /// Writes into the voxels what has frozen since; stamps that none has reached since `until`.
    pub(super) fn solidify(&mut self, run: &mut Bead, until: f64) {
        let Some(patch) = &mut run.patch else {
            return;
        };
        let frozen: Vec<Frozen> = match self.settings.mode {
            Mode::Plain => patch.settled_stamps(until),
            Mode::Build(_) => std::mem::take(&mut patch.zone.frozen),
        };
        for f in frozen {
            let p = patch
                .map
                .centre(f.cell % patch.map.nx, f.cell / patch.map.nx);
            if patch.was_void(f.cell) {
                self.laid.loose_volume += f.cover * (f.top - f.floor) * patch.map.cell.powi(2);
            }
            let (at, heights) = ((p.x, p.y), (f.floor, f.top));
            self.owed = self
                .voxels
                .lay(&patch.columns, at, heights, f.cover, self.owed);
        }
    }

    /// Records a path point.
    fn note(&mut self, run: &mut Bead, at: Sample) {
        let ctwd = self.distance(run, at);
        let (Some(patch), Some(spot)) = (&mut run.patch, run.trail.back()) else {
            return;
        };
        let spots = (spot.centre, spot.struck);
        let (_, window) = window_at(&self.bead, &self.settings, patch, spots);
        let reach = self.settings.nominal_ctwd;
        let over = patch.over(&self.voxels, (spot.centre, spot.axis), &window, reach);
        let ground = spot.centre - over * spot.axis;
        run.open
            .push_back((spot.travelled, self.laid.path.len(), ground));
        self.laid.path.push(LaidPoint {
            tool: at.tool,
            axis: at.axis,
            time: at.time,
            command: run.command,
            bead: self.laid.beads - 1,
            ctwd,
            feed: run.response,
            crest: ground,
            thickness: 0.0,
            support: run.support,
        });
    }

    /// Measures the crest at the recorded places that have frozen.
    pub(super) fn settle(&mut self, run: &mut Bead, until: f64) {
        let Some(patch) = &run.patch else {
            return;
        };
        while run.open.front().is_some_and(|o| o.0 <= until) {
            let Some((_, index, ground)) = run.open.pop_front() else {
                break;
            };
            let point = &mut self.laid.path[index];
            point.crest = patch.surface(ground);
            point.thickness = (point.crest - ground).dot(patch.columns.axes[2]);
        }
    }
}

impl Bead {
    /// Height of the path over the metal, mm; 0 before the first step.
    fn over_or_0(&self) -> f64 {
        if self.over.is_nan() { 0.0 } else { self.over }
    }
}

/// A place of the pool in the patch's frame.
fn station(patch: &Patch, spot: &Spot) -> Station {
    let at = patch.local(spot.struck);
    let [x, y, _] = patch.columns.axes;
    let heading = DVec2::new(spot.heading.dot(x), spot.heading.dot(y));
    Station {
        centre: at.truncate(),
        heading: heading.try_normalize().unwrap_or(DVec2::X),
        travelled: spot.travelled,
        rise: patch.local(spot.plane).z,
    }
}

/// How far columns are looked at: around the tool's height `tool`, where the ground was last at `ground`.
fn window(
    bead: &crate::bead::BeadModel,
    settings: &crate::deposit::Settings,
    tool: f64,
    ground: f64,
) -> Window {
    let height = bead.height();
    let cliff = match settings.mode {
        Mode::Plain => 0.0,
        Mode::Build(model) => model.cliff,
    };
    let near = ground.clamp(tool - settings.nominal_ctwd, tool + settings.nominal_ctwd);
    Window {
        low: tool - settings.nominal_ctwd,
        from: near + 1.5 * height,
        ceiling: tool + settings.nominal_ctwd,
        void: near - (cliff + 1.0) * height,
    }
}

/// Where a pool strikes in a patch, at the height of the wire's tip, and its window there.
fn window_at(
    bead: &crate::bead::BeadModel,
    settings: &crate::deposit::Settings,
    patch: &Patch,
    (centre, struck): (DVec3, DVec3),
) -> (DVec3, Window) {
    let (tip, at) = (patch.local(centre).z, patch.local(struck).truncate());
    let ground = patch.ground(at);
    (at.extend(tip), window(bead, settings, tip, ground))
}
