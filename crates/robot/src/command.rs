//! What the controller is asked to do, one move after the other: a program with everything resolved.

use meltpath_geometry::math::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// How a command goes to its target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Straight.
    Line,
    /// On the circle through the previous target, `via` and the target; straight where these lie on a line.
    Arc {
        /// A point of the arc between its ends, mm.
        via: DVec3,
    },
    /// A joint move. Its path depends on the robot's kinematics, which this room does not have yet: it is taken as
    /// straight. Only travels should be joint moves.
    Joint,
    /// Stays where it is; target and speed have no meaning.
    Wait {
        /// Duration, s.
        time: f64,
    },
}

/// How a command ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Smoothing {
    /// Stops at the target.
    Fine,
    /// Goes on to the next command; 0 is point to point, 1 smooths most (FANUC CNT 0 to CNT 100).
    Cnt(f64),
}

/// The welding source while a command is executed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// No arc.
    Off,
    /// Arc on.
    On {
        /// Actual wire feed speed, mm/s: the programmed one times its correction.
        wire_feed: f64,
    },
}

/// One command. The arc changes at the instant at which the tool passes from one command to the next, see [`crate::interpolation::fir`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// The caller's own number, given back in [`meltpath_toolpath::MotionBlock::command`].
    pub id: u32,
    /// How it goes to its target.
    pub kind: Kind,
    /// Where it ends, mm, part frame.
    pub target: DVec3,
    /// Orientation of the tool at the target: part from tool, the tool's z pointing towards the part.
    pub orientation: DQuat,
    /// Speed along the path, mm/s; finite and positive.
    pub speed: f64,
    /// How it ends.
    pub smoothing: Smoothing,
    /// The welding source on the way.
    pub source: Source,
}

impl Command {
    /// A straight move with a vertical torch and no arc.
    pub fn line(id: u32, target: DVec3, speed: f64, smoothing: Smoothing) -> Self {
        Command {
            id,
            kind: Kind::Line,
            target,
            // half a turn about x: the torch points down
            orientation: DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
            speed,
            smoothing,
            source: Source::Off,
        }
    }
}
