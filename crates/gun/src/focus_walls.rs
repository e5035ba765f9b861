//! A focus calibration from walls: one wall for each focus current, as thick as the beam made it.
//!
//! Béraud 2016, section 3.2.2.1.3: the thickness falls, then rises with the focus current, along two straight lines; how thick a wall a
//! beam of some diameter makes is a third.

mod doubt;
mod lines;
mod waist;

use crate::focus::{FocusCalibration, FocusError, FocusPiece};
pub use doubt::{Apart, Curve, RARE, Told};
use lines::Lines;
pub use lines::Wall;

/// Least walls: one more than two lines have numbers.
const WALLS: usize = 5;

/// How thick a wall becomes: `intercept + slope · diameter`, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thickness {
    /// Of a beam of no diameter, mm.
    pub intercept: f64,
    /// Change with the beam's diameter.
    pub slope: f64,
}

/// A calibration with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct FromWalls {
    /// The calibration.
    pub calibration: FocusCalibration,
    /// Its pieces.
    pub pieces: [FocusPiece; 2],
    /// Intercept, mm, and slope, mm/A, of the thickness on both sides of the sharpest focus.
    pub lines: [[f64; 2]; 2],
    /// How many different currents each line rests on: of two the line goes through both, however far they are off.
    pub currents: [usize; 2],
    /// Current of the sharpest focus, A.
    pub sharpest: f64,
    /// The same with its uncertainty, from the noise of the walls. Where a caustic explains them as well as the lines do, what is known of
    /// either: bounds that hold both, and their middle.
    pub sharpest_told: Told,
    /// Diameter of the spot there with its uncertainty, mm, told as the current is; the line of thickness over diameter is taken as exact.
    pub spot: Told,
    /// Current, A, and diameter, mm, of the waist of a caustic that explains the walls about as well as two lines; nothing where none does.
    pub caustic: Option<[f64; 2]>,
    /// Walls that the others do not go with.
    pub apart: Option<Apart>,
    /// How curved the walls are; nothing where no side has four of them, or where walls apart explain it better.
    pub curve: Option<Curve>,
    /// Scatter of the walls about the lines, one standard deviation, mm.
    pub scatter: f64,
}

/// Why walls make no calibration.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WallsError {
    /// Too few walls for two lines.
    #[error(
        "{0} walls with different focus currents do not tell two lines: five or more do, two at least on each side of the sharpest focus"
    )]
    Few(usize),
    /// No sharpest focus between the walls.
    #[error(
        "the walls do not grow thinner, then thicker with the focus current: build two walls at least on either side of the sharpest focus"
    )]
    NoSharpest,
    /// A wall thinner than any beam makes.
    #[error(
        "by the walls the beam is {diameter:.4} mm wide at {focus:.4} A: walls so thin do not go with the line of thickness over diameter"
    )]
    TooThin {
        /// The focus current, A.
        focus: f64,
        /// The diameter, mm.
        diameter: f64,
    },
}

/// Finds the calibration: two lines of least squares through the walls that meet between two of them.
///
/// # Errors
/// [`WallsError`].
pub fn from_walls(walls: &[Wall], thickness: Thickness) -> Result<FromWalls, WallsError> {
    let mut walls = walls.to_vec();
    walls.sort_by(|a, b| a.focus.total_cmp(&b.focus));
    let mut currents: Vec<f64> = walls.iter().map(|w| w.focus).collect();
    currents.dedup();
    if currents.len() < WALLS {
        return Err(WallsError::Few(currents.len()));
    }
    let found = Lines::through(&walls).ok_or(WallsError::NoSharpest)?;
    let (lines, sharpest) = (found.both.map(|l| l.coefficients), found.meet);
    let ends = [currents[0], sharpest, currents[currents.len() - 1]];
    let piece = |k: usize| FocusPiece {
        range: [ends[k], ends[k + 1]],
        intercept: (lines[k][0] - thickness.intercept) / thickness.slope,
        slope: lines[k][1] / thickness.slope,
    };
    let pieces = [piece(0), piece(1)];
    let falling = currents.iter().filter(|focus| **focus < sharpest).count();
    let calibration = FocusCalibration::new(pieces.to_vec()).map_err(|e| match e {
        FocusError::Width { focus, diameter } => WallsError::TooThin { focus, diameter },
        _ => WallsError::NoSharpest,
    })?;
    let (apart, curve) = doubt::which(doubt::apart(&found, &walls), doubt::curve(&found, &walls));
    let of_the_beam = |height: f64| height - thickness.intercept;
    let widths: Vec<[f64; 2]> = walls
        .iter()
        .map(|w| [w.focus, of_the_beam(w.thickness)])
        .collect();
    let known = doubt::waist([sharpest, of_the_beam(found.at(sharpest))], &widths);
    let [sharpest_told, width] = known.told;
    Ok(FromWalls {
        sharpest_told,
        spot: width.times(1.0 / thickness.slope),
        caustic: known
            .caustic
            .map(|[focus, width]| [focus, width / thickness.slope]),
        apart,
        curve,
        calibration,
        pieces,
        lines,
        currents: [falling, currents.len() - falling],
        sharpest,
        scatter: (found.squares / (walls.len() - 4) as f64).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The line of the thesis, eq. 3.2.5, mm.
    const THESIS: Thickness = Thickness {
        intercept: 0.12,
        slope: 0.6,
    };

    /// Walls of the lines that the thesis' calibration implies, from -3 to 30 mA by 3.
    fn walls() -> Vec<Wall> {
        let wall = |k: i32| {
            let focus = -3e-3 + 3e-3 * f64::from(k);
            let by = [0.4510 - 20.7 * focus, 0.199_29 + 14.526 * focus];
            Wall {
                focus,
                thickness: by[0].max(by[1]),
            }
        };
        (0..12).map(wall).collect()
    }

    #[test]
    fn ebm_a9_both_lines_are_recovered_from_walls() {
        let found = from_walls(&walls(), THESIS).unwrap();
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.005;
        let [falls, rises] = found.pieces;
        assert!(near(falls.intercept, 0.551_67) && near(falls.slope, -34.5));
        assert!(near(rises.intercept, 0.132_15) && near(rises.slope, 24.21));
        assert!((found.sharpest - 7.146e-3).abs() < 2e-5 && found.scatter < 1e-9);
        assert!(near(found.calibration.diameter(14e-3).unwrap(), 0.471_1));
    }

    /// In any order, with scatter: the scatter is told.
    #[test]
    fn walls_that_scatter_give_lines_near() {
        let mut scattered = walls();
        for (k, wall) in scattered.iter_mut().enumerate() {
            wall.thickness += [0.006, -0.006, -0.006, 0.006][k % 4];
        }
        scattered.reverse();
        let found = from_walls(&scattered, THESIS).unwrap();
        assert!((found.sharpest - 7.146e-3).abs() < 8e-4, "{found:?}");
        assert!((0.005..0.009).contains(&found.scatter), "{found:?}");
    }

    #[test]
    fn walls_that_make_no_calibration_are_refused() {
        assert_eq!(from_walls(&walls()[..4], THESIS), Err(WallsError::Few(4)));
        let twice = [walls(), walls()].concat();
        assert_eq!(from_walls(&twice[..4], THESIS), Err(WallsError::Few(4)));
        let rising = &walls()[4..];
        assert_eq!(from_walls(rising, THESIS), Err(WallsError::NoSharpest));
        let thick = Thickness {
            intercept: 0.35,
            ..THESIS
        };
        let thin = from_walls(&walls(), thick);
        assert!(matches!(thin, Err(WallsError::TooThin { .. })), "{thin:?}");
    }

    /// Walls by lines that meet at 380 µm and 5 mA, with noise.
    fn noisy(currents: &[f64], noise: f64, seed: u64) -> Vec<Wall> {
        let mut random = meltpath_numerics::random::Random::new(seed);
        let wall = |milliamperes: &f64| {
            let off = milliamperes - 5.0;
            let diameter = 380.0 + (-35.0 * off).max(22.0 * off);
            Wall {
                focus: 1e-3 * milliamperes,
                thickness: 1e-3 * (100.0 + 0.7 * diameter + noise * random.normal()),
            }
        };
        currents.iter().map(wall).collect()
    }

    const OURS: Thickness = Thickness {
        intercept: 0.1,
        slope: 0.7,
    };
    const TWELVE: [f64; 12] = [
        -5.0, -2.0, 0.0, 2.0, 4.0, 6.0, 8.0, 11.0, 14.0, 18.0, 22.0, 26.0,
    ];

    /// The sharpest focus and the spot by the lines alone.
    fn by_lines(walls: &[Wall]) -> [Told; 2] {
        let widths: Vec<[f64; 2]> = walls
            .iter()
            .map(|w| [w.focus, w.thickness - OURS.intercept])
            .collect();
        let lines = Lines::through(walls).unwrap();
        let meet = [lines.meet, lines.at(lines.meet) - OURS.intercept];
        let form = waist::Sharpest::of(&widths, waist::Form::Lines);
        let [focus, width] = doubt::told_by(&form, meet, walls.len() - 4);
        [focus, width.times(1.0 / OURS.slope)]
    }

    /// Intervals of the lines hold the truth as often as they say, of twelve walls, of six, and of six far from the focus; and are not wider than that.
    #[test]
    fn uncertainties_hold_the_truth_as_often_as_they_say() {
        let far: [f64; 6] = [-30.0, -25.0, -20.0, 40.0, 50.0, 60.0];
        let six = [-4.0, -1.0, 2.0, 9.0, 14.0, 20.0];
        for (currents, noise) in [(&TWELVE[..], 15.0), (&six, 8.0), (&far, 5.0)] {
            let tries = 1000;
            let mut held = [0; 4];
            for seed in 0..tries {
                let told = by_lines(&noisy(currents, noise, seed));
                for (k, (told, truth)) in [(told[0], 5e-3), (told[1], 0.38)].into_iter().enumerate()
                {
                    let off = (told.value - truth).abs();
                    held[2 * k] += u64::from(off <= told.sigma);
                    held[2 * k + 1] += u64::from((told.most[0]..=told.most[1]).contains(&truth));
                }
            }
            let shares = held.map(|n| n as f64 / tries as f64);
            for [one, most] in [[shares[0], shares[1]], [shares[2], shares[3]]] {
                assert!((0.63..0.75).contains(&one), "{currents:?}: {shares:?}");
                assert!((0.925..0.98).contains(&most), "{currents:?}: {shares:?}");
            }
        }
    }

    /// Walls just beside the sharpest focus tell it, however they scatter.
    #[test]
    fn walls_beside_the_sharpest_focus_are_no_reason_to_refuse() {
        let beside = [-5.0, -2.0, 1.0, 4.9, 5.1, 9.0, 13.0, 18.0];
        for seed in 0..200 {
            let found = from_walls(&noisy(&beside, 5.0, seed), OURS).unwrap();
            assert!((found.spot.value - 0.38).abs() < 0.03, "{seed}");
        }
    }

    /// A wall, or two, measured wrong are named, wherever they stand; sound ones are not.
    #[test]
    fn walls_apart_are_named() {
        let mut named = 0;
        for seed in 0..200 {
            let found = from_walls(&noisy(&TWELVE, 5.0, seed), OURS).unwrap();
            named += u32::from(found.apart.is_some() || found.curve.unwrap().chance < RARE);
        }
        assert!(named <= 10, "{named} of 200 sound calibrations");
        for noise in [0.0, 5.0] {
            for wrong in 0..TWELVE.len() {
                let mut walls = noisy(&TWELVE, noise, 7);
                walls[wrong].thickness *= 1.35;
                let found = from_walls(&walls, OURS).unwrap();
                let apart = found.apart.unwrap();
                assert_eq!(apart.walls, [walls[wrong]], "{wrong} {noise}");
                let share = walls[wrong].thickness / apart.others[0];
                assert!((share - 1.35).abs() < 0.1, "{wrong}: {share}");
            }
            // the second and the eighth taken for each other
            let mut walls = noisy(&TWELVE, noise, 7);
            let other = walls[6].thickness;
            walls[6].thickness = walls[1].thickness;
            walls[1].thickness = other;
            let found = from_walls(&walls, OURS).unwrap();
            assert_eq!(found.apart.unwrap().walls, [walls[1], walls[6]]);
        }
    }

    /// A caustic is a hyperbola: its walls are no lines.
    #[test]
    fn walls_on_a_curve_are_told() {
        let hyperbola = |x: f64| (320.0_f64.powi(2) + (28.0 * (x - 6.0)).powi(2)).sqrt();
        let parabola = |x: f64| 380.0 + 1.1 * (x - 8.0).powi(2);
        for diameter in [&hyperbola as &dyn Fn(f64) -> f64, &parabola] {
            for noise in [0.0, 5.0] {
                let mut walls = noisy(&TWELVE, noise, 3);
                for (wall, x) in walls.iter_mut().zip(TWELVE) {
                    let line = 380.0 + (-35.0 * (x - 5.0)).max(22.0 * (x - 5.0));
                    wall.thickness += 0.7e-3 * (diameter(x) - line);
                }
                let found = from_walls(&walls, OURS).unwrap();
                assert!(
                    found.curve.unwrap().chance < RARE && found.apart.is_none(),
                    "{found:?}"
                );
            }
        }
    }

    /// A beam, and its walls.
    struct Beam {
        /// From that of the sharpest focus and how much the slope makes of the distance to it, µm.
        diameter: fn(f64, f64) -> f64,
        /// Current, mA, and diameter, µm, of the sharpest focus.
        waist: [f64; 2],
        /// µm/mA.
        slopes: [f64; 2],
        /// mA.
        range: [f64; 2],
        walls: usize,
    }

    impl Beam {
        /// Walls with a noise of 11 µm of diameter.
        fn walls(&self, seed: u64) -> Vec<Wall> {
            let mut random = meltpath_numerics::random::Random::new(seed);
            let ([at, waist], [from, to]) = (self.waist, self.range);
            let wall = |k: usize| {
                let focus = from + (to - from) * k as f64 / (self.walls - 1) as f64;
                let more = self.slopes[usize::from(focus > at)] * (focus - at).abs();
                let diameter = (self.diameter)(waist, more) + 11.0 * random.normal();
                Wall {
                    focus: 1e-3 * focus,
                    thickness: 1e-3 * (100.0 + 0.7 * diameter),
                }
            };
            (0..self.walls).map(wall).collect()
        }
    }

    /// Whether nothing but the thickness is left to doubt, and the spot is known to a tenth.
    fn passes(found: &FromWalls) -> bool {
        let [low, high] = found.spot.most;
        let straight = found.curve.is_none_or(|c| c.chance >= RARE);
        found.apart.is_none() && straight && high - low <= 0.2 * found.spot.value
    }

    /// Of beams that narrow along a caustic and of beams that do along lines, of calibrations that pass nine bounds in ten hold the truth. By
    /// the lines alone nearly no current does of the first.
    #[test]
    fn bounds_hold_the_waist_of_a_caustic_too() {
        let beam = |diameter, waist, slopes, range, walls| Beam {
            diameter,
            waist,
            slopes,
            range,
            walls,
        };
        let (book, ours) = ([-3.0, 30.0], [-10.0, 20.0]);
        let (caustic, lines) = (f64::hypot as fn(f64, f64) -> f64, |a, b| a + b);
        for (beam, least) in [
            (beam(caustic, [7.15, 320.0], [24.0, 24.0], book, 12), 12),
            (beam(caustic, [4.0, 400.0], [25.0, 35.0], ours, 15), 10),
            (beam(lines, [7.15, 300.0], [34.5, 24.2], book, 12), 50),
            (beam(lines, [4.0, 260.0], [25.0, 35.0], ours, 15), 50),
        ] {
            let (mut passed, mut held) = (0, 0);
            for seed in 0..60 {
                let found = from_walls(&beam.walls(seed), OURS).unwrap();
                if !passes(&found) {
                    continue;
                }
                passed += 1;
                for (told, truth) in [found.sharpest_told, found.spot].iter().zip(beam.waist) {
                    let [low, high] = told.most;
                    held += u64::from((low..=high).contains(&(1e-3 * truth)));
                }
            }
            let told = format!("{:?}: {held} bounds of {passed}", beam.waist);
            assert!(passed >= least && 10 * held >= 9 * 2 * passed, "{told}");
        }
    }
}
