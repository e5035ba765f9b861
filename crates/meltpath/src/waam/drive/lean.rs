//! How the torch leans against gravity: what of it is judged, and how it leans where track and positioner move.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec3;
use meltpath_robot::cell::{Arrangement, Values};
use meltpath_robot::posture::Lean;

use crate::waam::judge::doubt::Doubt;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

pub(in crate::waam) const ID: &str = "tilt";
pub(in crate::waam) const TITLE: &str = "torch against the vertical, at most";

/// Beads are measured on tables as level as this, rad: 1°.
const LEVEL: f64 = 0.0175;

/// How the torch leans while a positioner turns the part.
#[derive(Debug, Clone)]
pub(crate) struct Turned {
    lean: Lean,
    place: Place,
}

impl Turned {
    /// Of a lean whose greatest is at a place.
    pub(in crate::waam) fn new(lean: Lean, place: Place) -> Self {
        Turned { lean, place }
    }

    /// Its greatest, judged.
    pub(in crate::waam) fn check(&self, settings: &Settings) -> Check {
        let angle = self.lean.greatest.value;
        check(angle, Some(self.place.clone()), settings)
    }

    /// The mean over the time of the arc.
    pub(in crate::waam) fn fact(&self) -> Fact {
        let mean = Measure::exact(self.lean.mean().to_degrees(), "deg");
        let words = "the positioner turns the part meanwhile; over the time of the arc";
        Fact::new("tilt-mean", "torch against the vertical, mean", mean, words)
    }

    /// Beads of flat layers that lean farther than those that were measured.
    pub(in crate::waam) fn doubt(&self) -> Option<Doubt> {
        let angle = self.lean.greatest.value;
        (angle > LEVEL).then(|| Doubt {
            reason: format!(
                "the torch leans by up to {:.1} deg from the vertical while the positioner turns the part ({}), and beads were measured level",
                angle.to_degrees(),
                self.place
            ),
            remedy: "machine.external = \"standing\", or the part elsewhere: machine.place".to_owned(),
        })
    }
}

/// How far flat layers lie from level, rad: as the table lies and a positioner turns it, or as the torch stands over a part that the robot holds.
#[derive(Debug, Clone, Copy)]
pub(in crate::waam) struct Lying(f64);

impl Lying {
    /// Of moves over a part that the robot's file places; nothing of a job that names no robot.
    pub(in crate::waam) fn of(moves: &Commands, settings: &Settings) -> Option<Self> {
        let cell = settings.robot.as_ref()?;
        let rest = cell.at_rest();
        let lies = |values: &Values| {
            let frames = cell.frames(values);
            let axis = match cell.arrangement {
                Arrangement::PartOnRobot => frames.wire_tip.tool_axis(),
                Arrangement::TorchOnRobot => frames.part.orientation * DVec3::Z,
            };
            axis.angle_between(DVec3::Z)
        };
        let axes = moves.external.iter();
        let moved = axes.flat_map(|axes| std::iter::once(&axes.start).chain(&axes.ends));
        let moved = moved.map(|external| lies(&Values::of(rest.arm, *external)));
        let most = moved.reduce(f64::max);
        Some(Lying(most.unwrap_or_else(|| lies(&rest))))
    }

    /// It, judged; nothing where layers lie as level as the beads that were measured and the job writes no limit.
    pub(in crate::waam) fn check(self, settings: &Settings) -> Option<Check> {
        let told = self.0 > LEVEL || settings.limits.tilt.is_some();
        told.then(|| check(self.0, None, settings))
    }

    /// Beads of flat layers that lean farther than those that were measured.
    pub(in crate::waam) fn doubt(self) -> Option<Doubt> {
        (self.0 > LEVEL).then(|| Doubt {
            reason: format!(
                "layers lie up to {:.1} deg from level, as the robot's file places table, part and torch, and beads were measured level",
                self.0.to_degrees()
            ),
            remedy: "a level table ([table] of the robot's file), or a positioner that turns the part level".to_owned(),
        })
    }
}

/// The greatest lean that is allowed, rad: what the job writes, else what was seen on beads as large as its own.
pub(crate) fn limit(settings: &Settings) -> Option<f64> {
    let area = settings.bead.area.value;
    let seen = || settings.map.greatest_tilt(area);
    settings.limits.tilt.or_else(seen)
}

/// The check of a lean, rad: within a written limit; without one what is as level as the beads that were measured passes.
pub(in crate::waam) fn check(angle: f64, at: Option<Place>, settings: &Settings) -> Check {
    let measure = Measure::exact(angle.to_degrees(), "deg");
    let area = settings.bead.area.value;
    let check = if settings.limits.tilt.is_none() && angle <= LEVEL {
        let limit = Limit::AtMost(LEVEL.to_degrees().round());
        Check::judge(ID, TITLE, measure, limit).because("as level as the beads that were measured")
    } else if let Some(limit) = limit(settings) {
        let check = Check::judge(ID, TITLE, measure, Limit::AtMost(limit.to_degrees()))
            .remedy("a smaller surface.tilt, or a positioner that turns the part");
        match &settings.map.tilt {
            Some(seen) if settings.limits.tilt.is_none() => check.because(&format!(
                "pools of {area:.1} mm² or more were seen to stay so far: {}, {}",
                *seen.source, *seen.page
            )),
            _ => check,
        }
    } else if let Some(seen) = &settings.map.tilt {
        let check = Check {
            status: Status::CannotSay,
            value: Some(measure),
            ..Check::not_checked(ID, TITLE, "")
        };
        let largest = seen.rows.iter().map(|r| r[0]).fold(0.0, f64::max);
        check
            .because(&format!(
                "the bead has {area:.1} mm², and pools of {largest:.1} mm² at most were seen to stay: {}, {}",
                *seen.source, *seen.page
            ))
            .remedy("a smaller bead; or lay a leaning one of this size, and write the angle up to which it stays: checks.tilt")
    } else {
        let check = Check {
            status: Status::CannotSay,
            value: Some(measure),
            ..Check::not_checked(ID, TITLE, "")
        };
        check
            .because(&format!(
                "how far a pool of {} in mode {} may lean was not measured",
                *settings.wire.name, settings.mode
            ))
            .remedy("lay a leaning bead, and write the angle up to which it stays: checks.tilt, or [tilt] of the process map")
    };
    match at {
        Some(place) => check.at(place),
        None => check,
    }
}
