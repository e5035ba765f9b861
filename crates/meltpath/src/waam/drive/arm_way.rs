//! A way of the robot along moves, kept for programs of the same moves in other words.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_robot::collision::Cleared;
use meltpath_robot::command::{Command, Kind, Source};
use meltpath_robot::posture::Change;

/// A way of the robot along moves.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmWay {
    start: Pose,
    commands: Vec<Command>,
    /// The way.
    pub cleared: Cleared,
    /// Travels of these moves that become joint moves first.
    pub over: Over,
}

/// Travels that become joint moves, over which the arm goes to another way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Over {
    /// The travels.
    pub changes: Vec<Change>,
    /// How much higher their ends lie than those of other travels, mm.
    pub lift: f64,
}

/// Places nearer than this are one, mm and rad: positions have the digits of a file.
const SAME_PLACE: f64 = 1e-6;
/// Speeds within this share of each other are one: each controller rounds them in its own unit.
const SAME_SPEED: f64 = 0.02;

impl ArmWay {
    /// A way along what is commanded, once travels of it are joint moves.
    pub fn along((start, commands): (Pose, &[Command]), cleared: Cleared, over: Over) -> Self {
        ArmWay {
            start,
            commands: commands.to_vec(),
            cleared,
            over,
        }
    }

    /// Whether other moves go where these go.
    pub fn is_along(&self, (start, commands): (Pose, &[Command])) -> bool {
        let pose = |a: (DVec3, DQuat), b: (DVec3, DQuat)| {
            a.0.distance(b.0) < SAME_PLACE && a.1.angle_between(b.1) < SAME_PLACE
        };
        let same = |(a, b): (&Command, &Command)| {
            let kind = match (a.kind, b.kind) {
                (Kind::Arc { via: a }, Kind::Arc { via: b }) => a.distance(b) < SAME_PLACE,
                (a, b) => a == b,
            };
            let burns = |c: &Command| matches!(c.source, Source::On { .. });
            kind && burns(a) == burns(b)
                && pose((a.target, a.orientation), (b.target, b.orientation))
                && (a.speed - b.speed).abs() <= SAME_SPEED * a.speed
        };
        let [a, b] = [self.start, start].map(|p| (p.position, p.orientation));
        self.commands.len() == commands.len()
            && pose(a, b)
            && self.commands.iter().zip(commands).all(same)
    }
}
