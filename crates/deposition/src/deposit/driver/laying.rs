//! How metal is laid while the torch moves: what the source feeds, how the bead differs from the nominal one, stamps and steps of the
//! molten zone, and what is noted along the way.

use meltpath_geometry::math::{DVec2, DVec3};

use super::{Bead, Deposition, Overhang};
use crate::deposit::feeding::LocalFeed;
use crate::deposit::levelling::{Levelling, LocalBead};
use crate::deposit::record::{Moment, PathPoint, TubeDistance};
use crate::deposit::{Mode, ROUNDING, Station, plain};

/// Direction of the deposit in plan, once the torch has moved.
fn heading(run: &Bead) -> Option<DVec2> {
    run.pursuit.as_ref().map(|p| p.heading().truncate())
}

impl Deposition<'_> {
    /// Volume of `wire` mm of wire as it arrives in the part, mm³.
    pub(super) fn asked_volume(&self, wire: f64) -> f64 {
        wire * self.bead.wire_section * self.bead.efficiency
    }

    /// What the source really feeds of the volume asked for, over `travel` mm up to a place; booked.
    pub(super) fn supply(&mut self, run: &mut Bead, at: Moment, travel: f64, asked: f64) -> f64 {
        let tool = at.tool;
        let distance = self.distance(run, tool);
        if let Some(record) = &mut self.record {
            record.reach(TubeDistance {
                distance,
                tool,
                time: at.time,
                command: at.command,
            });
        }
        if let Some(response) = self.settings.feed_response {
            run.response = response.ratio(distance);
            let beyond = &mut self.beyond;
            beyond.of += travel;
            if !response.covers(distance) {
                beyond.length += travel;
                let off = |d: f64| (d - response.reference).abs();
                if beyond.worst.is_none_or(|(_, d)| off(distance) > off(d)) {
                    beyond.worst = Some((tool, distance));
                }
            }
        }
        let volume = asked * run.response;
        let wire = volume / (self.bead.wire_section * self.bead.efficiency);
        self.wire += wire;
        self.volume += volume;
        if let Some(r) = &mut self.record {
            r.wire += wire;
            r.volume += volume;
        }
        volume
    }

    /// Contact tube to the surface that this bead finds under the wire, mm.
    fn distance(&self, run: &Bead, tool: DVec3) -> f64 {
        let ground = match self.settings.mode {
            Mode::Plain => run.ground,
            Mode::Build(_) => self.zone.ground_at(&self.map, tool.truncate()),
        };
        self.settings.nominal_ctwd + tool.z - ground
    }

    pub(super) fn substep(&mut self, run: &mut Bead, at: Moment, (travel, asked): (f64, f64)) {
        let tool = at.tool;
        let volume = self.supply(run, at, travel, asked);
        run.travelled += travel;
        run.pending += volume;
        run.pending_travel += travel;
        run.torch = tool.truncate();
        let Some(pursuit) = &mut run.pursuit else {
            return;
        };
        pursuit.follow(run.torch.extend(0.0));
        let laws = (&self.bead, &self.pool);
        run.feeding.pass(laws, travel, (asked, volume));
        match self.settings.mode {
            Mode::Plain => self.lay_plain(run),
            Mode::Build(model) => {
                let due = run.pending_travel.max(run.pending / self.bead.area);
                if due >= model.step - ROUNDING {
                    self.lay_levelled(run, &model);
                }
            }
        }
        if run.travelled - run.recorded >= self.settings.record_step {
            run.recorded = run.travelled;
            self.note(run, at);
        }
    }

    pub(super) fn lay_plain(&mut self, run: &mut Bead) {
        let Some(heading) = heading(run) else {
            return;
        };
        let local = run.feeding.local(&self.bead);
        let pool = self.pool.at_feed(local.ratio, local.wide);
        let at = Station {
            centre: run.torch - pool.offset * heading,
            heading,
            travelled: run.travelled,
            rise: 0.0,
        };
        // the ground just before the pool has not been touched by this bead yet
        let reach = (pool.front - pool.offset).max(0.0) + self.map.cell;
        let seen = self.map.height(run.torch + reach * heading);
        run.ahead.push_back((run.travelled + reach, seen));
        while run.ahead.front().is_some_and(|f| f.0 <= run.travelled) {
            if let Some((_, ground)) = run.ahead.pop_front() {
                run.ground = ground;
            }
        }
        self.beside += plain::stamp(&mut self.map, &mut self.weights, &pool, &at, run.pending);
        (run.pending, run.pending_travel) = (0.0, 0.0);
        run.station = Some(at);
        self.settle(run, run.travelled - pool.front - pool.rear);
    }

    /// One step of the molten zone with all that is pending.
    pub(super) fn lay_levelled(&mut self, run: &mut Bead, model: &Levelling) {
        let (Some(from), Some(heading)) = (run.station, heading(run)) else {
            return;
        };
        let LocalFeed { ratio, wide } = run.feeding.local(&self.bead);
        let pool = self.pool.at_feed(ratio, wide);
        let centre = run.torch - pool.offset * heading;
        let to = Station {
            centre,
            heading,
            travelled: from.travelled + from.centre.distance(centre),
            rise: 0.0,
        };
        let local = LocalBead {
            half_width: 0.5 * self.bead.width * wide,
            height: self.bead.height() * ratio / wide,
            rear: pool.rear,
        };
        let report = self
            .zone
            .step(&mut self.map, model, &local, &from, &to, run.pending);
        self.beside += report.lost;
        if report.hangs {
            let o = self.overhang.get_or_insert(Overhang {
                position: to.centre,
                length: 0.0,
            });
            o.length += to.travelled - from.travelled;
        }
        (run.pending, run.pending_travel) = (0.0, 0.0);
        run.station = Some(to);
        self.settle(run, to.travelled - local.rear);
    }

    /// Records a path point.
    fn note(&mut self, run: &mut Bead, at: Moment) {
        let Moment {
            tool,
            time,
            command,
        } = at;
        let ctwd = self.distance(run, tool);
        let (Some(record), Some(station)) = (&mut self.record, run.station) else {
            return;
        };
        let under_pool = match self.settings.mode {
            Mode::Plain => run.ground,
            Mode::Build(_) => self.zone.ground_at(&self.map, station.centre),
        };
        run.open
            .push_back((station.travelled, record.path.len(), under_pool));
        record.path.push(PathPoint {
            tool,
            time,
            command,
            bead: record.beads - 1,
            ctwd,
            feed: run.response,
            crest: station.centre.extend(under_pool),
            thickness: 0.0,
        });
    }

    /// Measures the crest at the recorded places that have frozen.
    pub(super) fn settle(&mut self, run: &mut Bead, until: f64) {
        let Some(record) = &mut self.record else {
            return;
        };
        while run.open.front().is_some_and(|o| o.0 <= until) {
            let Some((_, index, ground)) = run.open.pop_front() else {
                break;
            };
            let point = &mut record.path[index];
            point.crest.z = self.map.height(point.crest.truncate());
            point.thickness = point.crest.z - ground;
        }
    }
}
