//! How far the bead stays behind the torch at a corner, against the corner's angle: as measured at a few angles.

use serde::{Deserialize, Serialize};

/// Most angles of a law.
pub const MOST: usize = 10;

/// Pursuit length against the angle of the corner (0 straight, π reversal): linear between angles that were measured, constant beyond.
///
/// ```
/// use meltpath_deposition::pursuit::law::PursuitLaw;
/// let law = PursuitLaw::new(&[[1.0, 4.0], [2.0, 6.0]]).unwrap();
/// assert_eq!(law.length(-1.5), 5.0);
/// assert_eq!([law.length(0.0), law.length(3.0)], [4.0, 6.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PursuitLaw {
    /// Angle, rad, and length, mm; the angles increase.
    knots: [[f64; 2]; MOST],
    count: usize,
}

/// Why knots make no law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LawError {
    /// None, or more than [`MOST`].
    #[error("a law of pursuit lengths has 1 to {MOST} angles")]
    Count,
    /// An angle or length that is none.
    #[error(
        "angles of a law of pursuit lengths increase from 0 to 180°, and its lengths are positive"
    )]
    Values,
}

impl PursuitLaw {
    /// A law through pairs of angle (rad, increasing) and length (mm).
    ///
    /// # Errors
    /// [`LawError`].
    pub fn new(pairs: &[[f64; 2]]) -> Result<Self, LawError> {
        if pairs.is_empty() || pairs.len() > MOST {
            return Err(LawError::Count);
        }
        let within = |[angle, length]: &[f64; 2]| {
            (0.0..=std::f64::consts::PI).contains(angle) && *length > 0.0 && length.is_finite()
        };
        if !(pairs.iter().all(within) && pairs.windows(2).all(|w| w[0][0] < w[1][0])) {
            return Err(LawError::Values);
        }
        let mut knots = [[0.0; 2]; MOST];
        knots[..pairs.len()].copy_from_slice(pairs);
        Ok(PursuitLaw {
            knots,
            count: pairs.len(),
        })
    }

    /// Its angles, rad, and lengths, mm.
    pub fn knots(&self) -> &[[f64; 2]] {
        &self.knots[..self.count]
    }

    /// The length at a corner, mm; left and right turns are alike.
    pub fn length(&self, corner: f64) -> f64 {
        let corner = corner.abs();
        let knots = self.knots();
        let [mut from, mut length] = knots[0];
        if corner <= from {
            return length;
        }
        for &[to, next] in &knots[1..] {
            if corner <= to {
                return length + (next - length) * (corner - from) / (to - from);
            }
            [from, length] = [to, next];
        }
        length
    }

    /// The widest turn up to which the length is that of a straight line, rad.
    pub fn straight_to(&self) -> f64 {
        let knots = self.knots();
        let same = knots.iter().take_while(|k| k[1] == knots[0][1]).last();
        same.map_or(0.0, |k| k[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_law_is_refused() {
        assert_eq!(PursuitLaw::new(&[]), Err(LawError::Count));
        assert_eq!(PursuitLaw::new(&[[0.1, 4.0]; 11]), Err(LawError::Count));
        for pairs in [
            [[1.0, 4.0], [1.0, 5.0]],
            [[2.0, 4.0], [1.0, 5.0]],
            [[1.0, 4.0], [2.0, 0.0]],
            [[1.0, f64::NAN], [2.0, 1.0]],
            [[-1.0, 4.0], [2.0, 1.0]],
            [[1.0, 4.0], [3.2, 1.0]],
        ] {
            assert_eq!(PursuitLaw::new(&pairs), Err(LawError::Values), "{pairs:?}");
        }
    }

    #[test]
    fn a_law_of_one_angle_is_one_length() {
        let law = PursuitLaw::new(&[[1.5, 3.3]]).unwrap();
        for corner in [0.0, 1.0, -1.5, 3.0] {
            assert_eq!(law.length(corner), 3.3);
        }
        assert_eq!(law.straight_to(), 1.5);
    }
}
