//! What lines set for the moves to come, whichever program makes them: on a KUKA speed (`$VEL.CP`), acceleration (`$ACC.CP`) and the distance of
//! rounded corners (`$APO.CDIS`) hold for programs that are called, and for their callers afterwards.
//!
//! A move of a program holds what the lines of its own routine say; where a line said otherwise before it was run, that counts.

use std::collections::BTreeMap;

use meltpath_toolpath::Weave;

use crate::acceleration::Acceleration;
use crate::said_frames::Which;

/// A speed along the path that is set.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum SetSpeed {
    /// mm/s.
    Path(f64),
    /// That of the weld data that are on.
    Weld,
    /// One that is not known here, in the program's words.
    Other(String),
}

/// What was said of something that may be nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) enum Said<T> {
    /// No line speaks of it.
    #[default]
    No,
    As(Option<T>),
}

impl<T> Said<T> {
    /// This, or the other where it says nothing.
    pub(crate) fn or<'s>(&'s self, other: &'s Said<T>) -> &'s Said<T> {
        match self {
            Said::No => other,
            Said::As(_) => self,
        }
    }
}

/// How the tool is turned along moves by a path.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Orientation {
    /// From how it is turned at the begin to how it is taught at the end.
    #[default]
    Taught,
    /// It stays as it is turned at the begin.
    Kept,
    /// As the controller leads the wrist.
    Free,
}

/// What the tool is turned by along a circle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Round {
    /// The frame of its points.
    #[default]
    Frame,
    /// The direction of the path.
    Path,
}

/// What a line sets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Sets {
    Speed(SetSpeed),
    /// Share of what joints can do, %.
    Joints(f64),
    Acceleration(Option<Acceleration>),
    /// Distance, mm, at which rounded corners are left; nothing where it is not known.
    Distance(Option<f64>),
    Orientation(Orientation),
    Round(Round),
    /// How fast the tool turns at the most, °/s: 0 as it swivels, 1 about its own axis.
    Turning(usize, f64),
    /// What sets motion back to what is usual on the controller: of the tool's turns it is not known what that is.
    Usual,
    /// Speed of the weld data that are on, mm/s; nothing where none are, or their speed is not known.
    Weld(Option<f64>),
    /// How the torch swings, where the routine's own lines have it so already.
    Weave(Option<Weave>),
}

/// What is set while programs run; nothing where no line has set it yet.
#[derive(Debug, Clone, Default)]
pub(crate) struct Now {
    pub(crate) speed: Option<SetSpeed>,
    pub(crate) joints: Option<f64>,
    pub(crate) acceleration: Said<Acceleration>,
    pub(crate) distance: Said<f64>,
    pub(crate) orientation: Orientation,
    pub(crate) round: Round,
    pub(crate) turning: [Option<f64>; 2],
    pub(crate) weld: Option<f64>,
}

/// What a move says of itself alone, whatever was set.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Own {
    pub(crate) speed: Option<SetSpeed>,
    pub(crate) joints: Option<f64>,
    pub(crate) acceleration: Said<Acceleration>,
    pub(crate) distance: Said<f64>,
    pub(crate) orientation: Option<Orientation>,
    pub(crate) round: Option<Round>,
    /// User and tool frame.
    pub(crate) frames: (Option<u32>, Option<u32>),
}

impl Own {
    /// The frame of a kind that it is in.
    pub(crate) fn frame_mut(&mut self, which: Which) -> Option<&mut u32> {
        match which {
            Which::User => self.frames.0.as_mut(),
            Which::Tool => self.frames.1.as_mut(),
        }
    }
}

/// What the lines of a program set.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Modal {
    /// By the index of the instruction in front of which they stand.
    pub(crate) sets: BTreeMap<usize, Vec<Sets>>,
    /// By the index of the move.
    pub(crate) own: BTreeMap<usize, Own>,
}

impl Modal {
    /// The frames of a kind that moves are in for themselves.
    pub(crate) fn own_frames(&self, which: Which) -> impl Iterator<Item = u32> {
        self.own.values().filter_map(move |own| match which {
            Which::User => own.frames.0,
            Which::Tool => own.frames.1,
        })
    }
}
