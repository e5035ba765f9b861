//! The pursuit curve (tractrix): the bead's centre line follows the torch at a constant distance.
//! Source: Rouchon 2022, §3.3.2, eq. 3.4.

use meltpath_geometry::math::DVec3;
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

/// Pursuit length against the angle of the corner (0 straight, π reversal), mm.
///
/// 4 mm up to 75° and 5 mm at 90° are the thesis' values (Rouchon 2022, §3.4; Rouchon 2021, §4); the line to 6 mm at
/// 135° and the constant beyond are our defaults.
pub fn pursuit_length(corner: f64) -> f64 {
    let degrees = corner.abs().to_degrees();
    let knots = [(75.0, 4.0), (90.0, 5.0), (135.0, 6.0)];
    if degrees <= knots[0].0 {
        return knots[0].1;
    }
    for pair in knots.windows(2) {
        let ((a0, l0), (a1, l1)) = (pair[0], pair[1]);
        if degrees <= a1 {
            return l0 + (l1 - l0) * (degrees - a0) / (a1 - a0);
        }
    }
    knots[2].1
}

/// A follower drawn by a leader, updated sample by sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pursuit {
    /// Distance to the leader, mm.
    pub length: f64,
    /// How the follower is drawn.
    pub mode: PursuitMode,
    follower: DVec3,
    heading: DVec3,
}

impl Pursuit {
    /// A follower `length` mm behind `leader`, which is about to move along the unit vector `heading`.
    pub fn new(leader: DVec3, heading: DVec3, length: f64, mode: PursuitMode) -> Self {
        Pursuit {
            length,
            mode,
            follower: leader - length * heading,
            heading,
        }
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec2;

    /// The pursuit curve of a whole leader path cut in steps of at most `step` mm, one point per leader point cut.
    ///
    /// Empty for fewer than two distinct points.
    fn pursuit_curve(leader: &[DVec2], length: f64, mode: PursuitMode, step: f64) -> Vec<DVec2> {
        let Some(heading) = leader
            .windows(2)
            .find_map(|w| (w[1] - w[0]).try_normalize())
        else {
            return Vec::new();
        };
        let step = step.max(1e-3 * length).max(f64::MIN_POSITIVE);
        let mut pursuit = Pursuit::new(leader[0].extend(0.0), heading.extend(0.0), length, mode);
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

    fn corner(angle: f64) -> Vec<DVec2> {
        let turn = DVec2::from_angle(angle.to_radians());
        vec![DVec2::new(-40.0, 0.0), DVec2::ZERO, turn * 40.0]
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
        let mut pursuit = Pursuit::new(DVec3::ZERO, DVec3::X, 4.0, PursuitMode::Rigid);
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
            let mut pursuit = Pursuit::new(DVec3::ZERO, DVec3::X, 5.0, mode);
            (1..2000).any(|i| {
                let from = pursuit.follower();
                pursuit.follow(turn * 0.01 * f64::from(i));
                (pursuit.follower() - from).dot(pursuit.heading()) < -1e-9
            })
        };
        assert!(pushed(PursuitMode::Rigid));
        assert!(!pushed(PursuitMode::Rope));
    }

    #[test]
    fn default_length_follows_the_thesis() {
        assert_eq!(pursuit_length(30f64.to_radians()), 4.0);
        assert!((pursuit_length(-90f64.to_radians()) - 5.0).abs() < 1e-12);
        assert!((pursuit_length(135f64.to_radians()) - 6.0).abs() < 1e-9);
        assert_eq!(pursuit_length(180f64.to_radians()), 6.0);
    }
}
