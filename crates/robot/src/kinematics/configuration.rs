//! The words by which FANUC's controllers name one of the ways to hold a pose: CONFIG.
//!
//! Rules as measured at 16 joint sets on FANUC's own off-line controller (github.com/LeroyDu56/CrossArm, tests/fixtures/probes) and
//! on an R-2000iB (onerobotics.com, The perils of six-axis robots, 2013).

use std::fmt;
use std::str::FromStr;

use super::arm::{Arm, Geometry};

/// Angles nearer to a border than this are on it, deg: controllers show three digits.
const SHOWN: f64 = 1e-3;

/// The side of the wrist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrist {
    /// `N`: J5 at most zero.
    NoFlip,
    /// `F`: J5 above zero.
    Flip,
}

/// The side of the elbow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elbow {
    /// `U`: the forearm bends forward from the upper arm.
    Up,
    /// `D`: it bends back.
    Down,
}

/// Where the centre of the wrist lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// `T`: in front of the first axis.
    Front,
    /// `B`: behind it.
    Back,
}

/// A way to hold a pose, in FANUC's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Configuration {
    /// Flip or no flip.
    pub wrist: Wrist,
    /// Up or down.
    pub elbow: Elbow,
    /// Toward or backward.
    pub side: Side,
    /// Whole turns of J1, J4 and J6: 0 between -180 and 180 deg.
    pub turns: [i32; 3],
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wrist = match self.wrist {
            Wrist::NoFlip => 'N',
            Wrist::Flip => 'F',
        };
        let elbow = match self.elbow {
            Elbow::Up => 'U',
            Elbow::Down => 'D',
        };
        let side = match self.side {
            Side::Front => 'T',
            Side::Back => 'B',
        };
        let [j1, j4, j6] = self.turns;
        write!(f, "{wrist} {elbow} {side}, {j1}, {j4}, {j6}")
    }
}

/// A text that names no configuration.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is no CONFIG such as \"N U T, 0, 0, 0\"")]
pub struct NoConfiguration(String);

impl FromStr for Configuration {
    type Err = NoConfiguration;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let no = || NoConfiguration(text.to_owned());
        let mut parts = text.split(',').map(str::trim);
        let letters: String = parts.next().unwrap_or_default().split(' ').collect();
        let [wrist, elbow, side] = *letters.as_bytes() else {
            return Err(no());
        };
        let turns: Vec<i32> = parts.map_while(|p| p.parse().ok()).collect();
        Ok(Configuration {
            wrist: match wrist {
                b'N' => Wrist::NoFlip,
                b'F' => Wrist::Flip,
                _ => return Err(no()),
            },
            elbow: match elbow {
                b'U' => Elbow::Up,
                b'D' => Elbow::Down,
                _ => return Err(no()),
            },
            side: match side {
                b'T' => Side::Front,
                b'B' => Side::Back,
                _ => return Err(no()),
            },
            turns: turns.try_into().map_err(|_| no())?,
        })
    }
}

/// Whole turns: 0 between -180 and 180 deg, which itself is of the next.
fn turns(angle: f64) -> i32 {
    let beyond = (angle.to_degrees().abs() + 180.0 + SHOWN).div_euclid(360.0);
    angle.signum() as i32 * beyond as i32
}

impl Arm {
    /// What FANUC's controllers call joint angles; nothing for an arm without a spherical wrist.
    pub fn configuration(&self, joints: [f64; 6]) -> Option<Configuration> {
        let Geometry::SphericalWrist(arm) = self.geometry else {
            return None;
        };
        let [behind, bent_back] = arm.behind(joints);
        Some(Configuration {
            wrist: if joints[4].to_degrees() > SHOWN {
                Wrist::Flip
            } else {
                Wrist::NoFlip
            },
            elbow: if bent_back { Elbow::Down } else { Elbow::Up },
            side: if behind { Side::Back } else { Side::Front },
            turns: [0, 3, 5].map(|i: usize| turns(joints[i])),
        })
    }
}
