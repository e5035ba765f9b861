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
    /// A joint move: every axis goes evenly from where it stands to where it ends. Where nobody says how that looks it is taken as straight.
    /// Only travels should be joint moves.
    Joint(Option<Course>),
    /// Stays where it is; target and speed have no meaning.
    Wait {
        /// Duration, s.
        time: f64,
    },
}

/// How a joint move looks, as far as its axes are known ([`crate::joint_move`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Course {
    /// How long its axes move at an even pace, s: the controller's smoothing comes in addition.
    pub time: f64,
    /// Length of the tip's way, mm; 0 where it stays.
    pub length: f64,
    /// Directions of the tip at begin and end, of unit length.
    pub directions: [DVec3; 2],
}

impl Kind {
    /// What is known of a joint move.
    pub(crate) fn course(&self) -> Option<&Course> {
        match self {
            Kind::Joint(course) => course.as_ref(),
            Kind::Line | Kind::Arc { .. } | Kind::Wait { .. } => None,
        }
    }
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
