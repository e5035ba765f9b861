//! What an inverse kinematics returns: joint values, what is singular about them, or why there are none.

use std::fmt;

/// Errors of position (mm) and of rotation (rad) below which a solution holds its pose. Closed forms keep 1e-9 mm but at the border of
/// reach, where a pose that is beyond it by rounding is held by the stretched or folded arm.
pub(super) const HELD: [f64; 2] = [1e-6, 1e-9];

/// Sines below this count as zero: two axes of the wrist in line.
pub(super) const IN_LINE: f64 = 1e-6;

/// Where an arm loses a freedom: two ways to hold a pose become one, or a joint may turn without moving the flange.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a singularity of its own, and they come together"
)]
pub struct Singularities {
    /// The wrist stands on the first axis (the first joint is free), or, with a shoulder offset, as near to it as it can.
    pub shoulder: bool,
    /// The arm is stretched or folded: elbow one way and the other are one.
    pub elbow: bool,
    /// The arm is folded with the wrist on the shoulder: the second joint is free.
    pub folded: bool,
    /// Two axes of the wrist are in line: the fourth joint (the sixth of an offset wrist) is free.
    pub wrist: bool,
}

impl Singularities {
    /// Whether there is any.
    pub fn any(self) -> bool {
        self.shoulder || self.elbow || self.folded || self.wrist
    }
}

impl fmt::Display for Singularities {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = [
            (self.shoulder, "shoulder"),
            (self.elbow, "elbow"),
            (self.folded, "folded arm"),
            (self.wrist, "wrist"),
        ];
        let names: Vec<&str> = named.iter().filter(|n| n.0).map(|n| n.1).collect();
        f.write_str(if names.is_empty() { "none" } else { "" })?;
        f.write_str(&names.join(", "))
    }
}

/// Joint values of an arm's closed form, not yet checked by its chain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Joint angles, rad.
    pub(super) angles: [f64; 6],
    /// What is singular about them.
    pub(super) singular: Singularities,
}

/// The candidates of a pose: at most eight, on the stack.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidates {
    list: [Candidate; 8],
    count: usize,
}

impl Candidates {
    /// None yet.
    pub(super) fn none() -> Self {
        let nothing = Candidate {
            angles: [0.0; 6],
            singular: Singularities::default(),
        };
        Candidates {
            list: [nothing; 8],
            count: 0,
        }
    }

    /// One more; a ninth, which no arm has, would be lost.
    pub(super) fn push(&mut self, candidate: Candidate) {
        if let Some(place) = self.list.get_mut(self.count) {
            *place = candidate;
            self.count += 1;
        }
    }

    /// These, unless there are none and it is known why.
    ///
    /// # Errors
    /// That.
    pub(super) fn unless(self, why: Option<Unreachable>) -> Result<Self, Unreachable> {
        match why {
            Some(why) if self.count == 0 => Err(why),
            _ => Ok(self),
        }
    }

    /// Those there are.
    pub(super) fn as_slice(&self) -> &[Candidate] {
        &self.list[..self.count]
    }
}

/// One way to hold the flange as asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Joint angles, rad, each at the turn nearest to the middle of its limits.
    pub angles: [f64; 6],
    /// What is singular about it. Where a joint is free, this is one of a family.
    pub singular: Singularities,
    /// The least distance of a joint from its limits, rad; below zero beyond one.
    pub margin: f64,
    /// The joint that has it, from 0.
    pub tightest: usize,
}

/// Why an arm cannot hold a pose, whatever its limits; distances in mm. What helps, who asks knows: what may be moved, and where that is set.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// Beyond the stretched arm.
    #[error("too far by {by:.3} mm for the stretched arm")]
    TooFar {
        /// By how much.
        by: f64,
    },
    /// Nearer than the folded arm.
    #[error("too near by {by:.3} mm for the folded arm")]
    TooNear {
        /// By how much.
        by: f64,
    },
    /// Nearer to the first axis than the arm's plane.
    #[error("too near to the first axis by {by:.3} mm")]
    BesideAxis {
        /// By how much.
        by: f64,
    },
    /// Within rounding of the border of reach, on its far side.
    #[error("at the border of reach, to within rounding")]
    AtBorder,
    /// A numeric search found nothing.
    #[error("no joint values were found by search; there may be some")]
    NothingFound,
}

impl Unreachable {
    /// By how much, mm; nothing where that is not known.
    pub fn by(self) -> f64 {
        match self {
            Unreachable::TooFar { by }
            | Unreachable::TooNear { by }
            | Unreachable::BesideAxis { by } => by,
            Unreachable::AtBorder | Unreachable::NothingFound => 0.0,
        }
    }
}
