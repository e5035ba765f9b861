//! Contact tube to part distance, layer after layer. Source: Rouchon 2022, §4.3; the bookkeeping of layers
//! is ours.

use serde::{Deserialize, Serialize};

/// How the torch climbs and the wall grows, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Climb {
    /// Distance on the first layer.
    pub nominal: f64,
    /// Rise of the torch per layer.
    pub programmed: f64,
    /// Growth of the wall per layer.
    pub growth: f64,
}

impl Climb {
    /// Distance when layer `n` (counted from 1) is laid, mm: growth is counted from the first layer on.
    pub fn distance(&self, n: u32) -> f64 {
        self.nominal + f64::from(n.saturating_sub(1)) * (self.programmed - self.growth)
    }

    /// First layer whose distance is at or below `limit` (or above `most`), up to `layers`; `None` when all are within.
    ///
    /// ```
    /// use meltpath_deposition::ctwd::Climb;
    /// let wall = Climb { nominal: 15.0, programmed: 1.2, growth: 1.654 };
    /// assert_eq!(wall.critical_layer(8.0, 20.0, 25), Some(17));
    /// ```
    pub fn critical_layer(&self, limit: f64, most: f64, layers: u32) -> Option<u32> {
        (1..=layers).find(|&n| {
            let d = self.distance(n);
            d <= limit || d >= most
        })
    }
}

/// Growth per layer that a distance measured on layer `n` implies, mm; `None` on the first layer.
pub fn growth_from_distance(nominal: f64, programmed: f64, n: u32, distance: f64) -> Option<f64> {
    let steps = n.checked_sub(1).filter(|s| *s > 0)?;
    Some(programmed + (nominal - distance) / f64::from(steps))
}

/// First layer of a run of distances (in order of layers) that leaves `limit`..`most`.
pub fn first_outside(distances: &[(u32, f64)], limit: f64, most: f64) -> Option<u32> {
    distances
        .iter()
        .find(|(_, d)| !(*d > limit && *d < most))
        .map(|(layer, _)| *layer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waam_ac38_distance_of_the_thin_wall() {
        let wall = Climb {
            nominal: 15.0,
            programmed: 1.2,
            growth: 1.654,
        };
        assert!(
            (wall.distance(22) - 5.47).abs() < 0.005,
            "{}",
            wall.distance(22)
        );
        // the build was stopped after layer 22 at 5.47 mm: an alarm at 5.5 mm stops it there, at 8 mm before
        assert_eq!(wall.critical_layer(5.5, 30.0, 25), Some(22));
        assert!(wall.critical_layer(8.0, 30.0, 25).unwrap() < 22);
        let growth = growth_from_distance(15.0, 1.2, 22, 5.47).unwrap();
        assert!((growth - 1.654).abs() < 1e-3);
        assert_eq!(growth_from_distance(15.0, 1.2, 1, 15.0), None);
    }

    #[test]
    fn measured_runs_tell_their_first_bad_layer() {
        let run = [(1, 15.0), (2, 11.0), (3, 7.9), (4, 9.0)];
        assert_eq!(first_outside(&run, 8.0, 20.0), Some(3));
        assert_eq!(first_outside(&run, 5.0, 20.0), None);
        assert_eq!(first_outside(&[(1, f64::NAN)], 5.0, 20.0), Some(1));
    }
}
