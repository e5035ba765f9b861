//! Weaving: the tool swings about its path while it goes along.
//!
//! Controllers add the swing to the interpolated path, across the direction of travel and the tool axis. What turns it on and off and to the
//! side passes the same two moving averages as the motion (Rouchon 2022, §3.3.1), so that the woven path is as smooth as the motion is; the
//! swing itself is drawn in full. Assumptions, to be checked on the controller at hand:
//!
//! - the amplitude is reached in full at every frequency, from T_1 + T_2 after the swing begins, and dies away within T_1 + T_2 after it ends;
//! - where the path turns, the direction across turns with it about the tool axis, within T_1 + T_2, half of it before the corner and half
//!   after; where the tool stands, the swing stands too, as gently;
//! - the tips of a zigzag turn round within T_1, or half the period where that is shorter: as long as a change of speed lasts on the path;
//! - dwells at the sides add to the period while the tool goes on along the path, and the swing begins towards the left.

mod across;
mod weaving;

use std::f64::consts::{FRAC_PI_2, TAU};

use meltpath_toolpath::{Weave, WeaveShape};

pub use weaving::Weaving;

use crate::controller::Controller;

/// The swing of a weave.
#[derive(Debug, Clone, Copy)]
struct Swing<'a> {
    weave: &'a Weave,
    /// The share of the period, without dwells, in which a tip of a zigzag turns round: at most a half.
    tip: f64,
}

impl<'a> Swing<'a> {
    fn new(weave: &'a Weave, controller: &Controller) -> Self {
        Swing {
            weave,
            tip: (controller.t1.value.0 * weave.frequency).min(0.5),
        }
    }

    /// The share of the period that is swung through at a time after the beginning: dwells are taken out.
    fn share(&self, time: f64) -> f64 {
        let period = 1.0 / self.weave.frequency;
        let [left, right] = self.weave.dwell;
        let u = time.rem_euclid(period + left + right);
        let moved = if u < 0.25 * period {
            u
        } else if u < 0.25 * period + left {
            0.25 * period
        } else if u < 0.75 * period + left {
            u - left
        } else if u < 0.75 * period + left + right {
            0.75 * period
        } else {
            u - left - right
        };
        moved / period
    }

    /// Straight from side to side, the tips turned round evenly in `tip` of the period.
    fn zigzag(share: f64, tip: f64) -> f64 {
        let side = (TAU * share).sin();
        let from_path = side.abs().asin() / TAU;
        let slope = 4.0 / (1.0 - tip);
        let to_tip = 0.25 - from_path;
        let value = if to_tip < 0.5 * tip {
            1.0 - slope * to_tip * to_tip / tip
        } else {
            slope * from_path
        };
        value.copysign(side)
    }

    /// Where the swing is at a time after its beginning, in amplitudes: along the travel, and to its left.
    fn at(&self, time: f64) -> [f64; 2] {
        let share = self.share(time);
        match self.weave.shape {
            WeaveShape::Sine => [0.0, (TAU * share).sin()],
            WeaveShape::Triangle => [0.0, Self::zigzag(share, self.tip)],
            WeaveShape::Circle => {
                // it comes to rest where it dwells
                let dwells = self.weave.dwell.iter().any(|d| *d > 0.0);
                let turned = Self::zigzag(share, if dwells { self.tip } else { 0.0 });
                let along = (FRAC_PI_2 * turned).cos();
                [
                    along.copysign((TAU * share).cos()),
                    (FRAC_PI_2 * turned).sin(),
                ]
            }
        }
    }
}

/// The share of a swing that the two moving averages of a controller leave, were it told to them as the path is: how far a controller
/// draws less than it is told where it does not make good for that.
pub fn reached(weave: &Weave, controller: &Controller) -> f64 {
    let left = |filter: f64| {
        let angle = 0.5 * TAU * weave.frequency * filter;
        if angle > 1e-9 {
            angle.sin() / angle
        } else {
            1.0
        }
    };
    (left(controller.t1.value.0) * left(controller.t2.value.0)).abs()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(super) fn sine() -> Weave {
        Weave {
            shape: WeaveShape::Sine,
            frequency: 2.0,
            amplitude: 3.0,
            dwell: [0.0; 2],
        }
    }

    /// With its dwells the swing comes back after each period, and goes through the middle in between.
    #[test]
    fn a_swing_repeats_after_its_period_and_its_dwells() {
        for shape in [WeaveShape::Sine, WeaveShape::Triangle] {
            let weave = Weave {
                shape,
                frequency: 2.0,
                dwell: [0.1, 0.2],
                ..sine()
            };
            let swing = Swing {
                weave: &weave,
                tip: 0.0,
            };
            let side = |time: f64| swing.at(time)[1];
            assert!((side(0.15) - 1.0).abs() < 1e-9 && (side(0.21) - 1.0).abs() < 1e-9);
            assert!((side(0.5) + 1.0).abs() < 1e-9 && (side(0.66) + 1.0).abs() < 1e-9);
            assert!(side(0.35).abs() < 1e-9);
            // an eighth of the period after it has left the right side
            let eighth = if shape == WeaveShape::Sine {
                0.5f64.sqrt()
            } else {
                0.5
            };
            assert!((side(0.675 + 0.0625) + eighth).abs() < 1e-9);
            for time in [0.03, 0.2, 0.4, 0.6, 0.75] {
                assert!((side(time + 0.8) - side(time)).abs() < 1e-9, "{time}");
            }
        }
    }

    /// Tips turn round evenly within their share of the period, and the flanks are straight.
    #[test]
    fn tips_of_a_zigzag_turn_round_in_their_time() {
        for (frequency, tip) in [(2.0, 0.264), (1.0, 0.132), (6.0, 0.5)] {
            let weave = Weave {
                shape: WeaveShape::Triangle,
                frequency,
                ..sine()
            };
            let swing = Swing::new(&weave, &crate::controller::tests::arcmate());
            assert!((swing.tip - tip).abs() < 1e-12);
            let side = |share: f64| swing.at(share / frequency)[1];
            let second = |share: f64| {
                let step = 1e-4;
                (side(share + step) - 2.0 * side(share) + side(share - step)) / (step * step)
            };
            let turning = 8.0 / (tip * (1.0 - tip));
            for from_tip in [0.0, 0.2, 0.4, 0.49] {
                for (at, sign) in [(0.25, -1.0), (0.75, 1.0)] {
                    let found = second(at + from_tip * tip);
                    assert!(
                        (found - sign * turning).abs() < 1e-4 * turning,
                        "{found} {turning}"
                    );
                }
            }
            if tip < 0.5 {
                assert!(second(0.25 - 0.51 * tip).abs() < 1e-4 && second(0.02).abs() < 1e-4);
            }
            assert!((side(0.25) - 1.0).abs() < 1e-12 && (side(0.75) + 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn filters_take_the_more_of_a_swing_the_faster_it_is() {
        let arcmate = crate::controller::tests::arcmate();
        let shares = [0.5, 1.0, 2.0, 5.0].map(|frequency| {
            let weave = Weave {
                frequency,
                ..sine()
            };
            reached(&weave, &arcmate)
        });
        assert!(shares.is_sorted_by(|a, b| a > b), "{shares:?}");
        // two averages of a sine, taken as sums
        let sum = |time: f64| {
            let count = 1000;
            let at = |k: usize| (TAU * 2.0 * time * ((k as f64 + 0.5) / 1000.0 - 0.5)).cos();
            (0..count).map(at).sum::<f64>() / 1000.0
        };
        let wanted = sum(arcmate.t1.value.0) * sum(arcmate.t2.value.0);
        assert!((shares[2] - wanted).abs() < 1e-4, "{shares:?} {wanted}");
        assert!(shares[0] > 0.98 && shares[3] < 0.5);
    }
}
