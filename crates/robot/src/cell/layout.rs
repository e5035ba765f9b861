//! A cell, and where each of its frames lies for joint values.

use std::sync::Arc;

use meltpath_base::choice;
use meltpath_geometry::{Mesh, Pose};

use super::urdf::Named;
use crate::hull::{Excess, Hull};
use crate::kinematics::{Arm, Chain, Joint, JointKind, Limits};

/// So far, rad, chosen axes of a positioner keep from their limits; verdicts ask for 2°.
const KEPT: f64 = 0.05;
/// The same of a track, mm.
const KEPT_OF_TRACK: f64 = 5.0;

choice! {
    /// Who made the robot: whose words name a configuration.
    pub enum Maker {
        Fanuc "fanuc" => "FANUC: CONFIG.",
        Kuka "kuka" => "KUKA: S and T.",
        Abb "abb" => "ABB: confdata.",
        Yaskawa "yaskawa" => "Yaskawa: RCONF.",
        Staubli "staubli" => "Stäubli: config.",
        Universal "universal-robots" => "Universal Robots: none, their first move is in joints.",
        Other "other" => "Another.",
    }

    /// What the robot holds.
    pub enum Arrangement {
        TorchOnRobot "torch-on-robot" => "The torch; the part lies on the table.",
        PartOnRobot "part-on-robot" => "The part; the torch stands in the world.",
    }
}

/// Where numbers of a cell come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// The table of the file.
    pub of: &'static str,
    /// Who says so; nothing where nobody does.
    pub says: Option<String>,
    /// What of it is a guess.
    pub guesses: Vec<String>,
}

/// How well a frame is known by the points of it that were touched, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched {
    /// The table of the file.
    pub of: &'static str,
    /// From the first point to the second, along x.
    pub along: f64,
    /// How far the third lies to the side of it.
    pub aside: f64,
    /// How far the farthest of the others lies off the plane of these; nothing where three were touched, which tell nothing of it.
    pub off_plane: Option<f64>,
}

impl Touched {
    /// By how much the frame is turned where one of its points is wrong by a millimetre, rad.
    pub fn turned_by_a_millimetre(&self) -> f64 {
        (1.0 / self.along.min(self.aside)).atan()
    }
}

/// Links of an arm as bodies.
#[derive(Debug, Clone, PartialEq)]
pub enum Links {
    /// Radius of each, from its joint to the next, the last to the flange, mm.
    Bars([f64; 6]),
    /// Convex hulls of the bodies that its URDF tells, and of their pieces.
    Hulls(Arc<[LinkHull]>),
}

/// A body of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkHull {
    /// The link, from 1; 0 is the base.
    pub link: u8,
    /// Its hull in the frame of the link's joint, of the base for 0.
    pub hull: Hull,
    /// Hulls of its pieces, which together hold all of it; none where the hull itself will do.
    pub pieces: Vec<Hull>,
    /// How far these, or the hull, stand beyond the body.
    pub excess: Excess,
    /// The body itself, in the same frame.
    pub mesh: Mesh,
    /// What it is: the link of the URDF, and the file.
    pub of: String,
}

/// Shapes of a cell, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Shapes {
    /// The links of the arm.
    pub links: Links,
    /// Radius of the torch's body, from the flange to the begin of its nozzle.
    pub torch: f64,
    /// Length and radius of the nozzle, which ends with the contact tube.
    pub nozzle: [f64; 2],
    /// The table; nothing where it is not known.
    pub table: Option<Table>,
}

/// A table, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// Its size along its x and y, its origin in the middle.
    pub size: [f64; 2],
    /// How deep it is below its top, with all that turns beneath it where a positioner carries it.
    pub thickness: f64,
}

/// A robot cell. Frames are named by where they lie: `flange_from_torch` is the pose of the torch in the flange.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// What people call it.
    pub name: String,
    /// Who made the robot.
    pub maker: Maker,
    /// What the robot holds.
    pub arrangement: Arrangement,
    /// The arm.
    pub arm: Arm,
    /// The base in the world, or in the track's carriage.
    pub carrier_from_base: Pose,
    /// One sliding joint from the world to the carriage.
    pub track: Option<Chain>,
    /// One or two turning joints from the world to what carries the table.
    pub positioner: Option<Chain>,
    /// The end of the contact tube in the flange, or in the world where the robot holds the part.
    pub carrier_from_torch: Pose,
    /// The tip of the wire in the torch.
    pub torch_from_wire_tip: Pose,
    /// The table in the world or on the positioner's last axis.
    pub carrier_from_table: Pose,
    /// The part on the table, or in the flange where the robot holds it.
    pub carrier_from_part: Pose,
    /// Shapes of torch, arm and table, where the file tells them.
    pub shapes: Option<Shapes>,
    /// Files that its file names: the URDF, and meshes.
    pub files: Vec<Named>,
    /// Where the numbers come from.
    pub sources: Vec<Source>,
    /// Frames that were touched.
    pub touched: Vec<Touched>,
}

/// Values of all joints of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Values {
    /// Joint angles of the arm, rad (not as FANUC shows them: see [`Arm::joints`]).
    pub arm: [f64; 6],
    /// The track, mm.
    pub track: f64,
    /// The positioner, rad; one of a single axis takes the first.
    pub positioner: [f64; 2],
}

/// Where track (mm) and positioner's axes (rad) stand; what a cell lacks stands at zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct External(pub [f64; 3]);

impl External {
    /// At a share of the way to another place, every axis in step.
    #[must_use]
    pub fn lerp(self, to: External, share: f64) -> External {
        let between = |i: usize| self.0[i] + (to.0[i] - self.0[i]) * share;
        External(std::array::from_fn(between))
    }
}

impl Values {
    /// The arm's joints with track and positioner.
    #[must_use]
    pub fn of(arm: [f64; 6], External([track, first, second]): External) -> Values {
        Values {
            arm,
            track,
            positioner: [first, second],
        }
    }

    /// Track and positioner.
    pub fn external(&self) -> External {
        let [first, second] = self.positioner;
        External([self.track, first, second])
    }
}

/// Every frame of a cell in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frames {
    /// The arm's base.
    pub base: Pose,
    /// The flange.
    pub flange: Pose,
    /// The end of the contact tube.
    pub torch: Pose,
    /// The tip of the wire.
    pub wire_tip: Pose,
    /// The table.
    pub table: Pose,
    /// The part.
    pub part: Pose,
}

impl Frames {
    /// The tip of the wire in the part: what welds.
    pub fn part_from_wire_tip(&self) -> Pose {
        self.part.inverse().then(self.wire_tip)
    }
}

/// The table of a file that says no place.
pub(super) const SHAPES: &str = "shapes";

impl Source {
    /// What is guessed: the whole table, or these keys of it.
    fn guessed(&self) -> Option<String> {
        match &self.says {
            None => Some(self.of.to_owned()),
            Some(_) if self.guesses.is_empty() => None,
            Some(_) => Some(format!("{} ({})", self.of, self.guesses.join(", "))),
        }
    }
}

impl Cell {
    /// Tables and keys of its file that nobody vouches for: those that say where everything is.
    pub fn guesses(&self) -> Vec<String> {
        let places = self.sources.iter().filter(|s| s.of != SHAPES);
        places.filter_map(Source::guessed).collect()
    }

    /// What of its shapes nobody vouches for.
    pub fn guessed_shapes(&self) -> Option<String> {
        let mut shapes = self.sources.iter().filter(|s| s.of == SHAPES);
        shapes.find_map(Source::guessed)
    }

    /// The arm's base in the world for a position of the track in mm.
    fn base(&self, track: f64) -> Pose {
        let carriage = self.track.as_ref().map(|t| t.forward(&[track]));
        carriage
            .unwrap_or(Pose::IDENTITY)
            .then(self.carrier_from_base)
    }

    /// Where everything is.
    pub fn frames(&self, values: &Values) -> Frames {
        let base = self.base(values.track);
        let flange = base.then(self.arm.forward(values.arm));
        let carrier = self
            .positioner
            .as_ref()
            .map(|p| p.forward(&values.positioner));
        let table = carrier
            .unwrap_or(Pose::IDENTITY)
            .then(self.carrier_from_table);
        let (torch, part) = match self.arrangement {
            Arrangement::TorchOnRobot => (
                flange.then(self.carrier_from_torch),
                table.then(self.carrier_from_part),
            ),
            Arrangement::PartOnRobot => {
                (self.carrier_from_torch, flange.then(self.carrier_from_part))
            }
        };
        Frames {
            base,
            flange,
            torch,
            wire_tip: torch.then(self.torch_from_wire_tip),
            table,
            part,
        }
    }

    /// An axis of [`External`], where the cell has it.
    pub fn external_joint(&self, axis: usize) -> Option<&Joint> {
        let (chain, i) = match axis {
            0 => (&self.track, 0),
            _ => (&self.positioner, axis - 1),
        };
        chain.as_ref()?.joints.get(i)
    }

    /// Between which values an axis of [`External`] is led where it is chosen: a little off its limits, as the arm is kept.
    pub(crate) fn external_room(&self, axis: usize) -> Option<[f64; 2]> {
        let joint = self.external_joint(axis)?;
        let kept = match joint.kind {
            JointKind::Revolute => KEPT,
            JointKind::Prismatic => KEPT_OF_TRACK,
        };
        let Limits { low, high, .. } = joint.limits;
        let kept = kept.min(0.45 * (high - low));
        Some([low + kept, high - kept])
    }

    /// The first axis of track and positioner that stands beyond a limit, and by how much, mm or rad.
    pub fn beyond(&self, external: External) -> Option<(usize, f64)> {
        // written angles have steps of a thousandth of a degree
        const ROUNDING: f64 = 1e-4;
        (0..3).find_map(|axis| {
            let margin = self.external_joint(axis)?.limits.margin(external.0[axis]);
            (margin < -ROUNDING).then_some((axis, -margin))
        })
    }

    /// Track and positioner as near to zero as their limits let them stand.
    pub fn at_rest(&self) -> Values {
        let rest = |chain: &Option<Chain>, i: usize| {
            let joint = chain.as_ref().and_then(|c| c.joints.get(i));
            joint.map_or(0.0, |j| 0.0_f64.max(j.limits.low).min(j.limits.high))
        };
        Values {
            arm: [0.0; 6],
            track: rest(&self.track, 0),
            positioner: [0, 1].map(|i| rest(&self.positioner, i)),
        }
    }

    /// Where the flange must be in the arm's base for the wire's tip to lie at `part_from_wire_tip`, with track and positioner at
    /// their values.
    pub fn base_from_flange(&self, part_from_wire_tip: Pose, values: &Values) -> Pose {
        self.holder(values).base_from_flange(part_from_wire_tip)
    }

    /// What leads from the wire's tip in the part to the flange while track and positioner stand at their values.
    pub fn holder(&self, values: &Values) -> Holder {
        self.holder_of(&self.frames(values))
    }

    /// The same, of the frames at these values.
    pub fn holder_of(&self, frames: &Frames) -> Holder {
        let base = frames.base.inverse();
        let flange = frames.flange;
        match self.arrangement {
            Arrangement::TorchOnRobot => Holder {
                arrangement: self.arrangement,
                base_from_held: base.then(frames.part),
                end_from_flange: frames.wire_tip.inverse().then(flange),
            },
            Arrangement::PartOnRobot => Holder {
                arrangement: self.arrangement,
                base_from_held: base.then(frames.wire_tip),
                end_from_flange: frames.part.inverse().then(flange),
            },
        }
    }
}

/// What stands still between the wire's tip in the part and the flange in the arm's base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holder {
    arrangement: Arrangement,
    /// What stands: the part, or the wire's tip where the robot holds the part.
    base_from_held: Pose,
    /// The flange in what the robot holds.
    end_from_flange: Pose,
}

impl Holder {
    /// Where the flange must be in the arm's base for the wire's tip to lie at `part_from_wire_tip`.
    pub fn base_from_flange(&self, part_from_wire_tip: Pose) -> Pose {
        let standing_from_end = match self.arrangement {
            Arrangement::TorchOnRobot => part_from_wire_tip,
            Arrangement::PartOnRobot => part_from_wire_tip.inverse(),
        };
        self.base_from_held
            .then(standing_from_end)
            .then(self.end_from_flange)
    }
}
