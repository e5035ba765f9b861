//! A focus calibration from walls: one wall for each focus current, as thick as the beam made it.
//!
//! Béraud 2016, section 3.2.2.1.3: the thickness falls, then rises with the focus current, along two straight lines; how thick a wall a
//! beam of some diameter makes is a third.

use crate::focus::{FocusCalibration, FocusError, FocusPiece};

/// Least walls: one more than two lines have numbers.
const WALLS: usize = 5;

/// A wall of one line a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// Current of the focus coil, A.
    pub focus: f64,
    /// Its thickness without the grains that stick to it, mm.
    pub thickness: f64,
}

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
    let mut best: Option<(f64, [[f64; 2]; 2], f64)> = None;
    for split in 1..walls.len() {
        let (left, right) = walls.split_at(split);
        let ends = [left[split - 1].focus, right[0].focus];
        let (Some(falls), Some(rises)) = (line(left), line(right)) else {
            continue;
        };
        let meet = (rises[0] - falls[0]) / (falls[1] - rises[1]);
        let sharp = falls[1] < 0.0 && rises[1] > 0.0;
        if !(sharp && (ends[0]..=ends[1]).contains(&meet)) {
            continue;
        }
        let squares = squares(left, falls) + squares(right, rises);
        if best.is_none_or(|(least, ..)| squares < least) {
            best = Some((squares, [falls, rises], meet));
        }
    }
    let (squares, lines, sharpest) = best.ok_or(WallsError::NoSharpest)?;
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
    Ok(FromWalls {
        calibration,
        pieces,
        lines,
        currents: [falling, currents.len() - falling],
        sharpest,
        scatter: (squares / (walls.len() - 4) as f64).sqrt(),
    })
}

/// Intercept and slope of least squares; nothing of walls at one current.
fn line(walls: &[Wall]) -> Option<[f64; 2]> {
    let n = walls.len() as f64;
    let mean = |of: fn(&Wall) -> f64| walls.iter().map(of).sum::<f64>() / n;
    let [x, y] = [mean(|w| w.focus), mean(|w| w.thickness)];
    let (mut xx, mut xy) = (0.0, 0.0);
    for wall in walls {
        xx += (wall.focus - x).powi(2);
        xy += (wall.focus - x) * (wall.thickness - y);
    }
    let slope = xy / xx;
    (xx > 0.0).then_some([y - slope * x, slope])
}

fn squares(walls: &[Wall], [intercept, slope]: [f64; 2]) -> f64 {
    let off = |w: &Wall| (w.thickness - intercept - slope * w.focus).powi(2);
    walls.iter().map(off).sum()
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
}
