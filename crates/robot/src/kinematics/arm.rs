//! A six-axis arm: its chain, its closed form where it has one, its limits as the controller shows them.

use std::f64::consts::TAU;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DMat3;

use super::angles::whole;
use super::chain::Chain;
use super::numeric::{self, apart};
use super::offset_wrist::OffsetWrist;
use super::ortho_parallel::OrthoParallel;
use super::solution::{Candidate, Candidates, HELD, Solution, Unreachable};

/// Starts of the search for arms without a closed form.
const STARTS: u64 = 200;

/// Frames that lead to a pose round it by so much at most, mm and rad.
const ROUNDED: [f64; 2] = [1e-6, 1e-7];

/// Two solutions that differ by less in every joint are one, rad.
const SAME: f64 = 1e-9;

/// What closed form an arm has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Geometry {
    /// A spherical wrist on an arm of three axes.
    SphericalWrist(OrthoParallel),
    /// Three parallel axes and an offset wrist.
    OffsetWrist(OffsetWrist),
    /// None: its joint values are searched.
    Other,
}

/// An arm of six turning joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Its joints; their limits are of the values that the controller shows.
    pub chain: Chain,
    /// Its closed form.
    pub geometry: Geometry,
    /// The flange in the end of the closed form, whose z points out along the last axis; nothing where they are one.
    pub end_from_flange: Option<Pose>,
    /// How much of the second joint the controller adds to the third in what it shows: 0 for most; FANUC shows the forearm's angle
    /// to the level, which is the third joint less the second. Source: ros-industrial/fanuc_driver, `fanuc_utils`.
    pub coupling: f64,
}

/// How an arm can hold a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Inverse {
    /// The ways, each checked by the chain from its angles.
    pub solutions: Vec<Solution>,
    /// Whether these are all there are (families at singularities by one of them each), or what a search found.
    pub all: bool,
}

impl Arm {
    /// The pose of the flange in the base for joint angles in rad.
    pub fn forward(&self, joints: [f64; 6]) -> Pose {
        self.chain.forward(&joints)
    }

    /// Whether joint angles, rad, hold the flange at `base_from_flange`, but for the rounding of frames between.
    pub fn holds(&self, base_from_flange: Pose, joints: [f64; 6]) -> bool {
        let [off, turned] = numeric::distance(self.forward(joints), base_from_flange);
        off < ROUNDED[0] && turned < ROUNDED[1]
    }

    /// The angles as the controller shows them, rad.
    pub fn shown(&self, mut joints: [f64; 6]) -> [f64; 6] {
        joints[2] += self.coupling * joints[1];
        joints
    }

    /// The joint angles of what the controller shows, rad.
    pub fn joints(&self, mut shown: [f64; 6]) -> [f64; 6] {
        shown[2] -= self.coupling * shown[1];
        shown
    }

    /// The least distance of joint angles from their limits (rad, below zero beyond one), and the joint that has it, from 0.
    pub fn margin(&self, joints: [f64; 6]) -> (f64, usize) {
        let shown = self.shown(joints);
        let margins = self.chain.joints.iter().zip(shown);
        let margins = margins
            .enumerate()
            .map(|(i, (j, value))| (j.limits.margin(value), i));
        let least = margins.min_by(|a, b| a.0.total_cmp(&b.0));
        least.unwrap_or((f64::INFINITY, 0))
    }

    /// The ways to hold the flange at `base_from_flange`, limits aside: [`Solution::margin`] says which keep them.
    ///
    /// # Errors
    /// [`Unreachable`] where there is none.
    pub fn inverse(&self, base_from_flange: Pose) -> Result<Inverse, Unreachable> {
        let Some(candidates) = self.candidates(base_from_flange) else {
            return self.search(base_from_flange);
        };
        let candidates = candidates?;
        let mut solutions: Vec<Solution> = Vec::with_capacity(8);
        for candidate in candidates.as_slice() {
            let solution = self.finish(*candidate);
            let [off, turned] = numeric::distance(self.forward(solution.angles), base_from_flange);
            let new = solutions
                .iter()
                .all(|s| apart(&s.angles, &solution.angles) > SAME);
            if off < HELD[0] && turned < HELD[1] && new {
                solutions.push(solution);
            }
        }
        if solutions.is_empty() {
            return Err(Unreachable::AtBorder);
        }
        Ok(Inverse {
            solutions,
            all: true,
        })
    }

    /// The candidates of a closed form; nothing where there is none.
    fn candidates(&self, base_from_flange: Pose) -> Option<Result<Candidates, Unreachable>> {
        let base_from_end = match self.end_from_flange {
            Some(turned) => base_from_flange.then(turned.inverse()),
            None => base_from_flange,
        };
        let rotation = DMat3::from_quat(base_from_end.orientation);
        let position = base_from_end.position;
        match self.geometry {
            Geometry::SphericalWrist(arm) => Some(arm.solve(&rotation, position)),
            Geometry::OffsetWrist(arm) => Some(arm.solve(&rotation, position)),
            Geometry::Other => None,
        }
    }

    /// The way to hold the flange that is nearest to where the joints are, limits aside: that of [`Arm::inverse`] without the others.
    ///
    /// # Errors
    /// [`Unreachable`] where there is none.
    pub fn nearest(
        &self,
        base_from_flange: Pose,
        joints: &[f64; 6],
    ) -> Result<[f64; 6], Unreachable> {
        let beside = |angles: [f64; 6]| beside(angles, joints);
        let far = |angles: [f64; 6]| apart(&beside(angles), joints);
        if let Some(candidates) = self.candidates(base_from_flange) {
            let candidates = candidates?;
            let all = candidates.as_slice().iter().map(|c| (c, far(c.angles)));
            let best = all.min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((best, _)) = best {
                let solution = self.finish(*best).angles;
                let [off, turned] = numeric::distance(self.forward(solution), base_from_flange);
                if off < HELD[0] && turned < HELD[1] {
                    return Ok(beside(solution));
                }
            }
        }
        let found = self.inverse(base_from_flange)?.solutions;
        let best = found
            .iter()
            .min_by(|a, b| far(a.angles).total_cmp(&far(b.angles)));
        best.map(|s| beside(s.angles)).ok_or(Unreachable::AtBorder)
    }

    /// The same for a flange that has gone on a little: an arm without a closed form is led there from where its joints are.
    ///
    /// # Errors
    /// [`Unreachable`] where there is none.
    pub fn onward(
        &self,
        base_from_flange: Pose,
        joints: &[f64; 6],
    ) -> Result<[f64; 6], Unreachable> {
        if self.geometry == Geometry::Other
            && let Some(found) = numeric::descend(&self.chain, base_from_flange, *joints)
        {
            let whole = |i: usize| TAU * ((joints[i] - found[i]) / TAU).round();
            return Ok(std::array::from_fn(|i| found[i] + whole(i)));
        }
        self.nearest(base_from_flange, joints)
    }

    fn search(&self, base_from_flange: Pose) -> Result<Inverse, Unreachable> {
        let found = numeric::search(&self.chain, base_from_flange, STARTS);
        if found.is_empty() {
            return Err(Unreachable::NothingFound);
        }
        let singular = super::solution::Singularities::default();
        let solutions = found
            .into_iter()
            .map(|angles| self.finish(Candidate { angles, singular }));
        Ok(Inverse {
            solutions: solutions.collect(),
            all: false,
        })
    }

    /// Each joint at the turn nearest to the middle of its limits.
    fn finish(&self, candidate: Candidate) -> Solution {
        let mut angles = candidate.angles;
        for (i, joint) in self.chain.joints.iter().enumerate().take(6) {
            let middle = 0.5 * (joint.limits.low + joint.limits.high);
            let turns = whole((self.shown(angles)[i] - middle) / TAU);
            angles[i] -= TAU * turns;
        }
        let (margin, tightest) = self.margin(angles);
        Solution {
            angles,
            singular: candidate.singular,
            margin,
            tightest,
        }
    }

    /// The same way with every whole turn of every joint that its limits allow; empty where none do. In the order of the first
    /// joint's turns, then the second's, and so on.
    pub fn turns(&self, joints: [f64; 6]) -> Vec<[f64; 6]> {
        let mut ways = vec![joints];
        for (i, joint) in self.chain.joints.iter().enumerate().take(6) {
            let limits = joint.limits;
            ways = ways
                .into_iter()
                .flat_map(|way| {
                    let shown = self.shown(way)[i];
                    let first = ((limits.low - shown) / TAU).ceil() as i64;
                    let last = ((limits.high - shown) / TAU).floor() as i64;
                    (first..=last).map(move |turn| {
                        let mut turned = way;
                        turned[i] += TAU * turn as f64;
                        turned
                    })
                })
                .collect();
        }
        ways
    }
}

/// The same angles at the turns nearest to where the joints are, rad.
pub(crate) fn beside(angles: [f64; 6], joints: &[f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| angles[i] + TAU * whole((joints[i] - angles[i]) / TAU))
}
