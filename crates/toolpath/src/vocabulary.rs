//! The words in which passes are told: what they are for, how they move, what varies and happens along them.

use meltpath_base::choice;
use meltpath_geometry::math::DVec3;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Stable identifier of a pass: survives re-planning of others and restart.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PassId(
    /// The number.
    pub u32,
);

/// What a pass is for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Along the boundary of a region.
    Contour,
    /// Inside a region.
    #[default]
    Fill,
    /// On an outer surface.
    Skin,
    /// Holds what would fall.
    Support,
    /// Moves without depositing.
    Travel,
    /// Goes elsewhere, beam off.
    Jump,
    /// Goes from one line of a fill to the next, beam off.
    Connection,
    /// Runs up to or out of a line at its speed, beam off.
    Run,
}

impl Role {
    /// All of them.
    pub const ALL: [Role; 8] = [
        Role::Contour,
        Role::Fill,
        Role::Skin,
        Role::Support,
        Role::Travel,
        Role::Jump,
        Role::Connection,
        Role::Run,
    ];

    /// Whether metal is laid or melted along the pass: the arc burns, or the beam is on.
    pub fn deposits(self) -> bool {
        match self {
            Role::Contour | Role::Fill | Role::Skin | Role::Support => true,
            Role::Travel | Role::Jump | Role::Connection | Role::Run => false,
        }
    }
}

/// How a pass goes from one of its points to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Move {
    /// Straight.
    Line,
    /// On the circle through the start, `via` and the end.
    Arc {
        /// A point of the arc between its ends, mm.
        via: DVec3,
    },
    /// Stays at the end point for `time` seconds.
    Spot {
        /// Duration, s.
        time: f64,
    },
}

/// A value that may vary along a pass, one per move; where a move says none, the pass' [`crate::Profile`] does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Travel speed, mm/s.
    Speed,
    /// Wire feed speed, mm/s.
    WireFeed,
    /// Beam power, W.
    Power,
    /// Diameter of the beam's spot, mm.
    Spot,
    /// Dwell at the end of the move, s.
    Dwell,
}

impl Channel {
    /// All of them, in the order in which a layer keeps them.
    pub const ALL: [Channel; 5] = [
        Channel::Speed,
        Channel::WireFeed,
        Channel::Power,
        Channel::Spot,
        Channel::Dwell,
    ];
}

/// Something that happens at a point of a pass. A pass that deposits starts its arc at its first point and ends it at its last
/// without saying so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// Weaving begins with this number of [`crate::Toolpath::weaves`], from 1; 0 ends it, and so does the end of the pass.
    Weave(u32),
}

choice! {
    /// How the tool swings about its path.
    pub enum WeaveShape {
        Sine "sine" => "A sine across the path.",
        Triangle "triangle" => "Straight lines from side to side.",
        Circle "circle" => "Circles about the path.",
    }
}

impl<'de> Deserialize<'de> for WeaveShape {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let word = String::deserialize(from)?;
        Self::from_word(&word).ok_or_else(|| D::Error::custom(format!("weave `{word}` is unknown")))
    }
}

/// A weave: a swing about the path, across the tool's axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Weave {
    /// How the tool swings.
    pub shape: WeaveShape,
    /// Swings a second, Hz, without the dwells.
    pub frequency: f64,
    /// From the path to one side, mm.
    pub amplitude: f64,
    /// How long the tool stays on the left and on the right while it goes on along the path, s.
    pub dwell: [f64; 2],
}

/// What a pass is, apart from where it goes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PassHead {
    /// Stable identifier. A pass that follows one of the same identifier goes on with it: it begins where that ends, with the arc on, as one
    /// bead that winds from layer to layer does.
    pub id: PassId,
    /// Part, counted from 0.
    pub part: u32,
    /// Region or entity of the layer, counted from 0.
    pub entity: u32,
    /// Bead of the entity, counted from 0.
    pub bead: u32,
    /// Index into [`crate::Toolpath::profiles`].
    pub profile: u16,
    /// What the pass is for.
    pub role: Role,
}

/// Which side of the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Left of the direction of travel, seen against the tool axis.
    Left,
    /// Right of it.
    Right,
}

/// A bead beside this one along an interval of arc length, as placed by the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Start of the interval, mm along the pass.
    pub from: f64,
    /// End of the interval, mm along the pass.
    pub to: f64,
    /// Side of the pass on which the neighbour lies.
    pub side: Side,
    /// The neighbouring pass.
    pub pass: PassId,
    /// Mean distance between the two centre lines on the interval, mm.
    pub distance: f64,
    /// Layer of the neighbour, counted from 1.
    pub layer: u32,
}
