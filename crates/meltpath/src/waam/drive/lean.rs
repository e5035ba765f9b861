//! How the torch leans against gravity: what of it is judged, how it leans as programs say it, and where track and positioner move.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_robot::cell::{Arrangement, Cell, External, Values};
use meltpath_robot::command::{Kind, Source};
use meltpath_robot::posture::Lean;

use crate::waam::drive::slope::{self, LEVEL, Slope};
use crate::waam::judge::doubt::Doubt;
use crate::waam::program::{Axes, Commands};
use crate::waam::settings::Settings;

pub(in crate::waam) const ID: &str = "tilt";
pub(in crate::waam) const TITLE: &str = "torch against the vertical, at most";

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

/// How the torch leans along the beads of a program as it is written.
#[derive(Debug, Clone)]
struct Torch {
    /// From straight down, rad, and where.
    world: (f64, Place),
    /// From upright in the part, rad, and where.
    part: (f64, Place),
}

/// Shares of a move at which the torch is looked at.
const SHARES: [f64; 3] = [0.0, 0.5, 1.0];

impl Torch {
    /// Of moves; a part that no robot's file places lies level. Nothing where no bead is laid.
    fn of(moves: &Commands, settings: &Settings) -> Option<Self> {
        let cell = settings.robot.as_ref();
        let ground = Ground::of(cell, moves.external.as_ref());
        let mut torch: Option<Torch> = None;
        let (mut from, mut before) = (moves.start, None);
        for command in &moves.commands {
            if matches!(command.kind, Kind::Wait { .. }) {
                before = Some(command.id);
                continue;
            }
            if matches!(command.source, Source::On { .. }) {
                for t in SHARES {
                    let way = from.orientation.slerp(command.orientation, t);
                    let at = || moves.place(command.id, from.position.lerp(command.target, t));
                    let part = (way * DVec3::Z).angle_between(DVec3::NEG_Z);
                    let world = ground.lean(way, (before, command.id), t).unwrap_or(part);
                    let torch = torch.get_or_insert_with(|| Torch {
                        world: (world, at()),
                        part: (part, at()),
                    });
                    for (most, angle) in [(&mut torch.world, world), (&mut torch.part, part)] {
                        if angle > most.0 {
                            *most = (angle, at());
                        }
                    }
                }
            }
            (from.position, from.orientation) = (command.target, command.orientation);
            before = Some(command.id);
        }
        torch
    }
}

/// How the part lies in the world along a program.
enum Ground<'a> {
    /// The robot's file places nothing.
    Unknown,
    /// The torch stands in the world and leans by so much, rad.
    Torch(f64),
    /// The part lies still.
    Part(DQuat),
    /// Track and positioner carry it.
    Carried(&'a Cell, &'a Axes),
}

impl<'a> Ground<'a> {
    fn of(cell: Option<&'a Cell>, axes: Option<&'a Axes>) -> Self {
        let Some(cell) = cell else {
            return Ground::Unknown;
        };
        match (cell.arrangement, axes) {
            (Arrangement::PartOnRobot, _) => {
                let axis = cell.frames(&cell.at_rest()).wire_tip.tool_axis();
                Ground::Torch(axis.angle_between(DVec3::Z))
            }
            (Arrangement::TorchOnRobot, None) => {
                Ground::Part(cell.frames(&cell.at_rest()).part.orientation)
            }
            (Arrangement::TorchOnRobot, Some(axes)) => Ground::Carried(cell, axes),
        }
    }

    /// How far a torch that is held so in the part leans from straight down, rad, at a share of a move from the end of one command to that of
    /// another; nothing where that is not known.
    fn lean(&self, way: DQuat, (before, command): (Option<u32>, u32), t: f64) -> Option<f64> {
        let world_from_part = match *self {
            Ground::Unknown => return None,
            Ground::Torch(angle) => return Some(angle),
            Ground::Part(part) => part,
            Ground::Carried(cell, axes) => {
                let (a, b) = (axes.at(before).0, axes.at(Some(command)).0);
                let external = External([0, 1, 2].map(|i| a[i] + t * (b[i] - a[i])));
                let values = Values::of(cell.at_rest().arm, external);
                cell.frames(&values).part.orientation
            }
        };
        Some((world_from_part * way * DVec3::Z).angle_between(DVec3::NEG_Z))
    }
}

/// How the torch leans along a program, and flat layers under it.
#[derive(Debug, Clone)]
pub(in crate::waam) struct Leaning {
    turned: Option<Turned>,
    lying: Option<Lying>,
    torch: Option<Torch>,
    slope: Option<Slope>,
}

/// Checks of metal that is laid as by an upright torch.
const UPRIGHT: [&str; 10] = [
    "lack",
    "excess",
    "stock",
    "height",
    "flatness",
    "accumulation",
    "ctwd-min",
    "ctwd-max",
    "ctwd-known",
    "travels",
];

impl Leaning {
    /// Of moves; `turned` is how the torch leans where it was followed while track and positioner move.
    pub(in crate::waam) fn of(
        turned: Option<Turned>,
        moves: &Commands,
        settings: &Settings,
    ) -> Self {
        // layers that are not flat lie as they are laid
        let flat = settings.surface.is_none() && turned.is_none();
        // what nothing turns lies as the robot's file says, whether the arm reaches it or not
        let lying = flat.then(|| Lying::of(moves, settings)).flatten();
        Leaning {
            turned,
            lying,
            torch: Torch::of(moves, settings),
            slope: moves.slope.clone(),
        }
    }

    /// The greatest lean, judged: of the torch from straight down, or of flat layers from level where that is more. Nothing where both are as
    /// upright as on the beads that were measured and the job writes no limit.
    pub(in crate::waam) fn check(&self, settings: &Settings) -> Option<Check> {
        if let Some(turned) = &self.turned {
            return Some(turned.check(settings));
        }
        if let Some(slope) = &self.slope {
            return Some(slope.undecided(check(slope.angle(), None, settings)));
        }
        let asked = settings.limits.tilt.is_some() || settings.surface.is_some();
        let torch = self.torch.as_ref().map(|t| &t.world);
        match (torch, self.lying) {
            (Some((angle, place)), lying) if lying.is_none_or(|l| *angle > l.0 + ROUNDING) => {
                let told = asked || *angle > LEVEL;
                told.then(|| check(*angle, Some(place.clone()), settings))
            }
            (_, Some(lying)) => lying.check(settings),
            _ => None,
        }
    }

    /// What of it keeps flat layers from being decided about.
    pub(in crate::waam) fn doubts(&self) -> Vec<Doubt> {
        let turned = self.turned.iter().filter_map(Turned::doubt);
        turned
            .chain(self.lying.and_then(Lying::doubt))
            .chain(self.slope.as_ref().map(aslope))
            .collect()
    }

    /// Tells with the checks of flat layers that metal is laid as by an upright torch, where the program's leans.
    pub(in crate::waam) fn tell(&self, checks: &mut [Check]) {
        let Some((angle, place)) = self.torch.as_ref().map(|t| &t.part).filter(|p| p.0 > LEVEL)
        else {
            return;
        };
        let words = format!(
            "metal is laid as by a torch upright on its layers, and it leans by up to {:.1} deg ({place})",
            angle.to_degrees()
        );
        let judged = |c: &&mut Check| c.status != Status::NotChecked;
        for check in checks.iter_mut().filter(judged) {
            if UPRIGHT.contains(&check.id.as_str()) {
                *check = check.clone().because(&words);
            }
        }
    }

    /// The mean lean over the time of the arc, where a positioner turns the part meanwhile.
    pub(in crate::waam) fn fact(&self) -> Option<Fact> {
        self.turned.as_ref().map(Turned::fact)
    }
}

/// Beads of flat layers that lie aslope by the frames of their programs.
fn aslope(slope: &Slope) -> Doubt {
    Doubt {
        reason: slope.reason().to_owned(),
        remedy: slope::REMEDY.to_owned(),
    }
}

/// Leans that differ by less are one, rad: the digits of programs.
const ROUNDING: f64 = 1e-5;

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
