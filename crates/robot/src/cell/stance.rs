//! How an arm stands, in the words of its maker: CONFIG of FANUC, status and turn of KUKA, confdata of ABB, RCONF of Yaskawa,
//! config of Stäubli. Universal Robots have none: there the joints themselves are said.
//!
//! Sources: FANUC see [`Configuration`]. KUKA: manual of KSS 8 (status: overhead, elbow, fifth axis; turn: the signs of the axes),
//! checked against seven taught positions of published programs, see the tests. ABB: RAPID reference, `confdata` (quarter turns of
//! axes 1, 4, 6; cfx by wrist in front of or behind axis 1 and lower arm, and the sign of axis 5). Yaskawa: NX100 instructions,
//! "Manipulator types" (flip by the angle of the R axis: -90° to 90° is flip; front or rear by the wrist and the S axis) and DX100 data
//! transmission manual, `RCONF`; that the arm is "upper" where the elbow lies over the line from shoulder to wrist is our reading.
//! Stäubli: as published writers of VAL3 have it: lefty where the wrist is in front, elbow and wrist by the signs of axes 3 and 5.

use std::fmt;

use super::layout::{Cell, Maker};
use crate::kinematics::{Arm, Configuration, Geometry};

/// Angles nearer to a border than this are on it, deg: controllers show three digits.
const SHOWN: f64 = 1e-3;
/// How far joints that are found from a program's positions may differ from those that it was written from, deg: it says angles to 0.001 deg and
/// places to 0.001 mm, and a bent wrist makes some times as much of them.
const DIGITS: f64 = 0.01;
/// Joints that are said by their values are held so near, deg: what is read has the digits of a file.
const SAME: f64 = 0.5;

/// How an arm stands, in the words of its maker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stance {
    /// CONFIG.
    Fanuc(Configuration),
    /// Status and turn.
    Kuka {
        /// Bits: 1 overhead, 2 elbow, 4 fifth axis below zero.
        status: u8,
        /// Bits: 1 where the first axis is below zero, 2 the second, and so on.
        turn: u8,
    },
    /// cf1, cf4, cf6, cfx.
    Abb([i32; 4]),
    /// The joints as the controller shows them, deg.
    Joints([f64; 6]),
    /// 1 where: no flip, lower arm, rear, R, T and S at half a turn or more.
    Yaskawa([u8; 6]),
    /// Whether shoulder, elbow and wrist are righty, enegative, wnegative.
    Staubli([bool; 3]),
}

/// Words of a Stäubli's configuration.
const STAUBLI: [[&str; 2]; 3] = [
    ["lefty", "righty"],
    ["epositive", "enegative"],
    ["wpositive", "wnegative"],
];

impl fmt::Display for Stance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stance::Fanuc(configuration) => configuration.fmt(f),
            Stance::Kuka { status, turn } => write!(f, "S {status}, T {turn}"),
            Stance::Abb([a, b, c, d]) => write!(f, "{a},{b},{c},{d}"),
            Stance::Joints(joints) => {
                let all = joints.map(|j| format!("{j:.4}"));
                f.write_str(&all.join(","))
            }
            Stance::Staubli(which) => {
                let words = STAUBLI.iter().zip(which);
                let words: Vec<&str> = words.map(|(w, other)| w[usize::from(*other)]).collect();
                f.write_str(&words.join(","))
            }
            Stance::Yaskawa(bits) => {
                let all = bits.map(|b| b.to_string());
                f.write_str(&all.join(","))
            }
        }
    }
}

impl Stance {
    /// What a position says; nothing where it says nothing, or not in this maker's words.
    pub fn read(maker: Maker, text: &str) -> Option<Stance> {
        match maker {
            Maker::Fanuc => text.parse().ok().map(Stance::Fanuc),
            Maker::Kuka => {
                let (status, turn) = text.split_once(',')?;
                let number = |text: &str, letter: char| -> Option<u8> {
                    text.trim().strip_prefix(letter)?.trim().parse().ok()
                };
                // bits beyond these say how accurate the robot is
                Some(Stance::Kuka {
                    status: number(status, 'S')? & 7,
                    turn: number(turn, 'T')? & 63,
                })
            }
            Maker::Abb => numbers(text).map(Stance::Abb),
            Maker::Universal => numbers(text).map(Stance::Joints),
            Maker::Yaskawa => numbers(text).map(Stance::Yaskawa),
            Maker::Staubli => {
                let words: Vec<&str> = text.split(',').map(str::trim).collect();
                let which = STAUBLI.iter().zip(&words);
                let which = which.map(|(known, w)| known.iter().position(|k| k == w));
                let which: Option<Vec<bool>> = which.map(|i| Some(i? == 1)).collect();
                (words.len() == 3).then_some(())?;
                which?.try_into().ok().map(Stance::Staubli)
            }
            Maker::Other => None,
        }
    }
}

fn numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let all: Option<Vec<T>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    all?.try_into().ok()
}

impl Cell {
    /// Whether an arm with these joints (rad) stands as `wanted` says.
    pub fn stands(&self, joints: [f64; 6], wanted: &Stance) -> bool {
        let Stance::Joints(wanted) = wanted else {
            return self.stance(joints).as_ref() == Some(wanted);
        };
        let shown = self.arm.shown(joints).map(f64::to_degrees);
        shown.iter().zip(wanted).all(|(a, b)| (a - b).abs() < SAME)
    }

    /// Whether an arm that goes on in a straight line or an arc stands as `wanted` says, where a joint (rad) may lie on either side of a border
    /// within the digits of a program. A joint move is another matter: there a border is a whole turn.
    pub fn stands_within_digits(&self, joints: [f64; 6], wanted: &Stance) -> bool {
        let beside = |i: usize, by: f64| {
            let mut beside = joints;
            beside[i] += by.to_radians();
            self.stands(beside, wanted)
        };
        self.stands(joints, wanted) || (0..6).any(|i| beside(i, DIGITS) || beside(i, -DIGITS))
    }

    /// How the arm stands with these joints (rad); nothing where its maker has no words that are known here.
    pub fn stance(&self, joints: [f64; 6]) -> Option<Stance> {
        let shown = self.arm.shown(joints).map(f64::to_degrees);
        match self.maker {
            Maker::Fanuc => self.arm.configuration(joints).map(Stance::Fanuc),
            Maker::Kuka => kuka(&self.arm, joints, shown),
            Maker::Abb => abb(&self.arm, joints, shown),
            Maker::Universal => Some(Stance::Joints(shown)),
            Maker::Yaskawa => yaskawa(&self.arm, joints, shown),
            Maker::Staubli => {
                let [rear, _] = behind(&self.arm, joints)?;
                let below = |i: usize| shown[i] < -SHOWN;
                Some(Stance::Staubli([rear, below(2), below(4)]))
            }
            Maker::Other => None,
        }
    }
}

/// Whether the centre of the wrist lies behind the first axis, and whether the elbow is bent back.
fn behind(arm: &Arm, joints: [f64; 6]) -> Option<[bool; 2]> {
    match arm.geometry {
        Geometry::SphericalWrist(lengths) => Some(lengths.behind(joints)),
        Geometry::OffsetWrist(_) | Geometry::Other => None,
    }
}

fn kuka(arm: &Arm, joints: [f64; 6], shown: [f64; 6]) -> Option<Stance> {
    let [overhead, back] = behind(arm, joints)?;
    let fifth = (-180.0..-SHOWN).contains(&shown[4]) || shown[4] >= 180.0;
    let bits = [overhead, !back, fifth];
    let status = bits.iter().zip(0..).map(|(on, i)| u8::from(*on) << i).sum();
    let turn = shown
        .iter()
        .zip(0..)
        .map(|(angle, i)| u8::from(*angle < -SHOWN) << i)
        .sum();
    Some(Stance::Kuka { status, turn })
}

fn abb(arm: &Arm, joints: [f64; 6], shown: [f64; 6]) -> Option<Stance> {
    let [overhead, back] = behind(arm, joints)?;
    let quarter = |angle: f64| ((angle + SHOWN) / 90.0).floor() as i32;
    let cfx = 4 * i32::from(overhead) + 2 * i32::from(back) + i32::from(shown[4] < -SHOWN);
    Some(Stance::Abb([
        quarter(shown[0]),
        quarter(shown[3]),
        quarter(shown[5]),
        cfx,
    ]))
}

fn yaskawa(arm: &Arm, joints: [f64; 6], shown: [f64; 6]) -> Option<Stance> {
    let [rear, back] = behind(arm, joints)?;
    let [s, _, _, r, _, t] = shown;
    // half a turn is of the first turn, as a controller shows it
    let turned = |angle: f64| angle.abs() > 180.0 + SHOWN;
    let from_flip = (r + SHOWN).rem_euclid(360.0);
    let no_flip = (90.0 + 2.0 * SHOWN..270.0 + 2.0 * SHOWN).contains(&from_flip);
    // behind the first axis an elbow that is bent back lies over the line
    let bits = [no_flip, back != rear, rear, turned(r), turned(t), turned(s)];
    Some(Stance::Yaskawa(bits.map(u8::from)))
}
