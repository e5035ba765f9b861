//! What a robot holds while a program runs: the torch, or the part before a torch that stands.

use std::fmt;

use meltpath_geometry::Pose;

/// What a robot holds, as a program says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// The torch; the part lies still, or on a positioner.
    Torch,
    /// The part; the torch stands.
    Part,
    /// Both, which no controller moves by.
    Both,
    /// Neither, which no controller moves by.
    Neither,
}

impl Holds {
    /// What is held where it is said of the torch and of the part.
    pub(crate) fn of(torch: Held, part: Held) -> Self {
        match (torch, part) {
            (Held::ByRobot, Held::Standing) => Holds::Torch,
            (Held::Standing, Held::ByRobot) => Holds::Part,
            (Held::ByRobot, Held::ByRobot) => Holds::Both,
            (Held::Standing, Held::Standing) => Holds::Neither,
        }
    }

    /// Whether a controller moves by it.
    pub fn is_sound(self) -> bool {
        matches!(self, Holds::Torch | Holds::Part)
    }
}

impl fmt::Display for Holds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Holds::Torch => "the torch",
            Holds::Part => "the part",
            Holds::Both => "both torch and part",
            Holds::Neither => "neither torch nor part",
        })
    }
}

/// Who holds a tool or a work object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Held {
    /// The robot.
    ByRobot,
    /// Nobody: it stands in the world.
    Standing,
}

/// Where everything lies that stands still while the robot holds the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The wire's tip in the world, its z along the wire towards the work.
    pub world_from_torch: Pose,
    /// The part in the flange.
    pub flange_from_part: Pose,
}
