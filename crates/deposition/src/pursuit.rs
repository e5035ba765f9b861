//! The pursuit curve (tractrix): the bead's centre line follows the torch at a constant distance.
//! Source: Rouchon 2022, §3.3.2, eq. 3.4.

pub mod identify;
pub mod law;

use crate::bead::PursuitLength;
use law::PursuitLaw;
use meltpath_geometry::math::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// How the follower is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PursuitMode {
    /// Always at distance l: faithful to eq. 3.4; beyond 90° of turn the follower is first pushed back.
    Rigid,
    /// The follower moves only when it is farther than l, and never backwards.
    #[default]
    Rope,
}

/// Cosine of the turn (10°) below which the bead is taken to run along the torch's way again: a corner is past there. Ours.
const PAST: f64 = 0.985;

/// Change of the length per millimetre of way: the length follows the corner without dragging the bead. Ours.
const CHANGE: f64 = 0.5;

/// Cosine of the turn (60°) within a length up to which a bend is no corner, unless a law was measured at less. Ours.
const BEND: f64 = 0.5;

/// A follower drawn by a leader, updated sample by sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pursuit {
    law: PursuitLength,
    length: f64,
    mode: PursuitMode,
    leader: DVec3,
    follower: DVec3,
    heading: DVec3,
    corner: f64,
    /// Cosine of the turn up to which the length is that of a straight line.
    straight: f64,
    /// Directions of the leader half a length back, and up to as much before that.
    before: [DVec3; 2],
    /// Way since the first of them, mm.
    since: f64,
}

impl Pursuit {
    /// A follower behind `leader`, which is about to move along the unit vector `heading`.
    pub fn new(leader: DVec3, heading: DVec3, law: PursuitLength, mode: PursuitMode) -> Self {
        let (length, straight) = match law {
            PursuitLength::Fixed(length) => (length, 0.0),
            PursuitLength::ByCorner(law) => (law.length(0.0), law.straight_to().cos().max(BEND)),
        };
        Pursuit {
            law,
            length,
            mode,
            leader,
            follower: leader - length * heading,
            heading,
            corner: 0.0,
            straight,
            before: [heading; 2],
            since: 0.0,
        }
    }

    /// Distance to the leader now, mm.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Where the follower is, mm.
    pub fn follower(&self) -> DVec3 {
        self.follower
    }

    /// Unit vector from the follower to the leader: the direction of the deposit.
    pub fn heading(&self) -> DVec3 {
        self.heading
    }

    /// Moves the leader (by a small part of the length: 0.05 mm or less for a smooth curve) and the follower after it.
    pub fn follow(&mut self, leader: DVec3) {
        if let PursuitLength::ByCorner(law) = self.law {
            self.take_length_of_the_corner(&law, leader);
        }
        let gap = leader - self.follower;
        let distance = gap.length();
        if distance <= 1e-12 * self.length {
            return;
        }
        let heading = gap / distance;
        match self.mode {
            PursuitMode::Rigid => {
                self.follower = leader - self.length * heading;
                self.heading = heading;
            }
            PursuitMode::Rope => {
                if distance > self.length {
                    self.follower = leader - self.length * heading;
                }
                self.heading = heading;
            }
        }
    }

    /// The corner is the widest turn of the torch's way within a length (half a length at least), since the bead last ran
    /// along it: a controller rounds corners, the bead comes round slowly, and the source gives one length for all of a
    /// corner.
    fn take_length_of_the_corner(&mut self, law: &PursuitLaw, leader: DVec3) {
        let motion = leader - self.leader;
        let way = motion.length();
        // shorter ways are gathered: their direction may be that of rounding
        if way < 1e-3 * self.length {
            return;
        }
        self.leader = leader;
        let direction = motion / way;
        self.since += way;
        if self.since > 0.5 * self.length {
            self.before = [direction, self.before[0]];
            self.since = 0.0;
        }
        // no angle is needed where the length is that of a straight line
        let cosine = self.before[1].dot(direction);
        let turn = if cosine < self.straight {
            cosine.max(-1.0).acos()
        } else {
            0.0
        };
        let past = self.heading.dot(direction) > PAST;
        self.corner = if past { turn } else { self.corner.max(turn) };
        let most = CHANGE * way;
        self.length += (law.length(self.corner) - self.length).clamp(-most, most);
    }
}

/// The pursuit curve of a whole leader path cut in steps of at most `step` mm, one point per leader point cut.
///
/// Empty for fewer than two distinct points.
///
/// ```
/// use meltpath_deposition::pursuit::{PursuitMode, pursuit_curve};
/// use meltpath_geometry::math::DVec2;
/// let corner = [DVec2::new(-20.0, 0.0), DVec2::ZERO, DVec2::new(0.0, 20.0)];
/// let curve = pursuit_curve(&corner, 5.0, PursuitMode::Rope, 0.05);
/// let nearest = curve.iter().map(|p| p.length()).fold(f64::MAX, f64::min);
/// assert!((nearest - 3.31).abs() < 0.02);
/// ```
pub fn pursuit_curve(leader: &[DVec2], length: f64, mode: PursuitMode, step: f64) -> Vec<DVec2> {
    let Some(heading) = leader
        .windows(2)
        .find_map(|w| (w[1] - w[0]).try_normalize())
    else {
        return Vec::new();
    };
    let step = step.max(1e-3 * length).max(f64::MIN_POSITIVE);
    let law = PursuitLength::Fixed(length);
    let mut pursuit = Pursuit::new(leader[0].extend(0.0), heading.extend(0.0), law, mode);
    let mut curve = vec![pursuit.follower().truncate()];
    for w in leader.windows(2) {
        let pieces = (w[0].distance(w[1]) / step).ceil().max(1.0) as u32;
        for k in 1..=pieces {
            let at = w[0].lerp(w[1], f64::from(k) / f64::from(pieces));
            pursuit.follow(at.extend(0.0));
            curve.push(pursuit.follower().truncate());
        }
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The law that ships: of the source.
    fn by_corner() -> PursuitLength {
        let text = meltpath_data::pools::X90_IG_1_0_CMT_M14.text;
        let file = crate::consumable::PoolFile::parse(text).unwrap();
        PursuitLength::ByCorner(file.law().unwrap())
    }

    fn corner(angle: f64) -> [DVec2; 3] {
        let turn = DVec2::from_angle(angle.to_radians());
        [DVec2::new(-40.0, 0.0), DVec2::ZERO, turn * 40.0]
    }

    #[test]
    fn waam_ac17_pursuit_after_a_right_angle() {
        for (length, lateral, closest) in [(5.0, 3.240, 3.314), (4.0, 2.592, 2.651)] {
            let step = 0.005;
            let path = corner(90.0);
            let curve = pursuit_curve(&path, length, PursuitMode::Rigid, step);
            // the new leg is the y axis: the lateral distance is −x
            let after = ((40.0 + length) / step) as usize;
            assert!((-curve[after].x - lateral * 1.0).abs() < 0.01 * length / 5.0 + 0.003);
            let near = curve.iter().map(|p| p.length()).fold(f64::MAX, f64::min);
            assert!((near - closest).abs() < 0.01, "{near}");
        }
    }

    #[test]
    fn waam_ac20_inside_of_the_turn_asymmetric_and_tangent_to_the_leader() {
        for mode in [PursuitMode::Rigid, PursuitMode::Rope] {
            let path = corner(60.0);
            let curve = pursuit_curve(&path, 4.0, mode, 0.01);
            let turn = DVec2::from_angle(60f64.to_radians());
            // signed distance to the left of each leg: the turn is to the left, so inside is positive
            let mut late = 0.0f64;
            for p in &curve {
                let (first, second) = (p.y, turn.perp_dot(*p));
                assert!(
                    first > -1e-9 && second > -1e-9,
                    "outside of the turn at {p}"
                );
                late = late.max(if p.dot(turn) > 0.0 { second } else { 0.0 });
            }
            // upstream the curve is on the leg; downstream it comes back only slowly
            assert!(late > 1.0);
            let before = curve
                .iter()
                .filter(|p| p.x < -2.0)
                .map(|p| p.y)
                .fold(0.0, f64::max);
            assert!(late > 2.0 * before, "{late} {before}");
        }
        // the tangent points to the leader
        let mut pursuit = Pursuit::new(
            DVec3::ZERO,
            DVec3::X,
            PursuitLength::Fixed(4.0),
            PursuitMode::Rigid,
        );
        let mut leader = DVec3::ZERO;
        for _ in 0..2000 {
            leader += DVec2::from_angle(0.7).extend(0.0) * 1e-3;
            let from = pursuit.follower();
            pursuit.follow(leader);
            let moved = pursuit.follower() - from;
            let cosine = moved.normalize().dot((leader - from).normalize());
            assert!(cosine.abs() > 1.0 - 1e-6, "{cosine}");
        }
    }

    #[test]
    fn waam_ac19_a_section_extruded_along_the_pursuit_curve_folds() {
        let half = 3.6;
        for length in [2.0, 4.0, 5.0, 6.0] {
            let curve = pursuit_curve(&corner(90.0), length, PursuitMode::Rigid, 0.01);
            let sides = |side: f64| -> Vec<DVec2> {
                let edge = |w: &[DVec2]| w[0] + side * half * (w[1] - w[0]).normalize().perp();
                curve.windows(2).map(edge).collect()
            };
            // the inner edge runs backwards where it folds; the turn is to the left
            let along = |edge: &[DVec2]| -> f64 {
                edge.windows(2)
                    .zip(curve.windows(2))
                    .map(|(e, c)| (e[1] - e[0]).dot(c[1] - c[0]).min(0.0))
                    .sum()
            };
            assert!(along(&sides(1.0)) < -1e-6, "{length}");
            assert!(along(&sides(-1.0)) == 0.0, "{length}");
            // and the outer edge stays away from the outside of the programmed corner
            let outside = DVec2::new(half, -half) * 0.5_f64.sqrt();
            let nearest = curve.iter().map(|p| p.distance(outside));
            assert!(nearest.fold(f64::MAX, f64::min) > half, "{length}");
        }
    }

    #[test]
    fn a_rope_is_only_ever_drawn_forwards() {
        // the follower pushed away from the leader: the cusp of eq. 3.4 beyond 90 degrees
        let pushed = |mode| {
            let turn = DVec2::from_angle(150f64.to_radians()).extend(0.0);
            let mut pursuit = Pursuit::new(DVec3::ZERO, DVec3::X, PursuitLength::Fixed(5.0), mode);
            (1..2000).any(|i| {
                let from = pursuit.follower();
                pursuit.follow(turn * 0.01 * f64::from(i));
                (pursuit.follower() - from).dot(pursuit.heading()) < -1e-9
            })
        };
        assert!(pushed(PursuitMode::Rigid));
        assert!(!pushed(PursuitMode::Rope));
    }

    /// Longest distance of the follower at a corner of `angle` degrees, and the distance 30 mm beyond.
    fn lengths_at(law: PursuitLength, angle: f64, step: f64) -> (f64, f64) {
        let path = corner(angle).map(|p| p.extend(0.0));
        let mut pursuit = Pursuit::new(path[0], DVec3::X, law, PursuitMode::Rope);
        let mut longest = 0.0f64;
        for w in path.windows(2) {
            let pieces = (w[0].distance(w[1]) / step).round() as u32;
            for k in 1..=pieces {
                pursuit.follow(w[0].lerp(w[1], f64::from(k) / f64::from(pieces)));
                longest = longest.max(pursuit.length());
            }
        }
        (longest, pursuit.length())
    }

    #[test]
    fn the_length_is_that_of_the_corner_until_the_bead_has_come_round() {
        for (angle, length) in [
            (45.0, 4.0),
            (75.0, 4.0),
            (90.0, 5.0),
            (-90.0, 5.0),
            (135.0, 6.0),
        ] {
            for step in [0.01, 0.1] {
                let (longest, after) = lengths_at(by_corner(), angle, step);
                assert!((longest - length).abs() < 0.02, "{angle} {step}: {longest}");
                assert!((after - 4.0).abs() < 1e-9, "{angle} {step}: {after}");
            }
        }
    }

    #[test]
    fn a_corner_that_a_controller_rounds_is_still_a_corner() {
        // a right angle drawn as an arc of half a millimetre
        let law = by_corner();
        let mut pursuit = Pursuit::new(DVec3::X * -40.0, DVec3::X, law, PursuitMode::Rope);
        let mut at = DVec3::X * -40.0;
        let mut longest = 0.0f64;
        for k in 0..8000 {
            let angle = (0.02 * f64::from(k - 4000)).clamp(0.0, std::f64::consts::FRAC_PI_2);
            at += DVec2::from_angle(angle).extend(0.0) * 0.01;
            pursuit.follow(at);
            longest = longest.max(pursuit.length());
        }
        assert!((longest - 5.0).abs() < 0.02, "{longest}");
        assert!((pursuit.length() - 4.0).abs() < 1e-9);
    }

    #[test]
    fn a_wide_bend_is_no_corner() {
        let law = by_corner();
        let mut pursuit = Pursuit::new(DVec3::ZERO, DVec3::X, law, PursuitMode::Rope);
        let mut at = DVec3::ZERO;
        for k in 0..6000 {
            at += DVec2::from_angle(0.01 / 8.0 * f64::from(k)).extend(0.0) * 0.01;
            pursuit.follow(at);
            assert_eq!(pursuit.length(), 4.0);
        }
    }

    #[test]
    fn default_length_follows_the_thesis() {
        let PursuitLength::ByCorner(law) = by_corner() else {
            panic!("a law ships")
        };
        for (degrees, length) in [(30.0, 4.0), (-90.0, 5.0), (135.0, 6.0), (180.0, 6.0)] {
            assert!((law.length(f64::to_radians(degrees)) - length).abs() < 1e-12);
        }
    }

    #[test]
    fn a_law_of_ones_own_is_followed_at_blunt_corners_too() {
        let knots = [[30.0, 3.0], [45.0, 3.5], [90.0, 5.0]];
        let law = PursuitLaw::new(&knots.map(|[a, l]: [f64; 2]| [a.to_radians(), l])).unwrap();
        for [angle, length] in knots {
            let (longest, after) = lengths_at(PursuitLength::ByCorner(law), angle, 0.02);
            assert!((longest - length).abs() < 0.05, "{angle}: {longest}");
            assert!((after - 3.0).abs() < 1e-9, "{angle}: {after}");
        }
    }
}
