//! What is changed along a path so that it heats more or less: speed, time on spots, power or spot of the beam.
//!
//! One number says how: a factor above 1 heats less. It multiplies the speed, divides the time on a spot or the power, or
//! multiplies the diameter of the beam's spot.

use crate::error::StrategyError;
use crate::speed::SpeedProfile;
use meltpath_thermal::beam::{BeamPath, BeamPoint};

/// What is changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lever {
    /// The speed, times the factor; where the beam rests its time, divided by it.
    Speed,
    /// The time on each spot, divided by the factor; what moves keeps its speed.
    Dwell,
    /// The power, divided by the factor.
    Power,
    /// The diameter of the spot, times the factor, between the least and the greatest that the machine gives, mm.
    Spot([f64; 2]),
}

impl Lever {
    /// The path with these factors.
    ///
    /// # Errors
    /// [`StrategyError`]: factors not above zero.
    ///
    /// ```
    /// use meltpath_thermal::beam::{BeamPath, BeamPoint};
    /// use meltpath_melt_strategy::{lever::Lever, speed::SpeedProfile};
    /// let start = BeamPoint::start(300.0, 0.4);
    /// let path = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 1000.0, start).unwrap();
    /// let mut factors = SpeedProfile::of(&path, 1.0);
    /// factors.factors_mut()[1] = 2.0;
    /// let weaker = Lever::Power.apply(&factors, &path).unwrap();
    /// assert_eq!(weaker.end(), path.end());
    /// assert_eq!(weaker.at(0.0015).power, 150.0);
    /// let faster = Lever::Speed.apply(&factors, &path).unwrap();
    /// assert!((faster.end() - 0.0025).abs() < 1e-12);
    /// ```
    pub fn apply(
        &self,
        factors: &SpeedProfile,
        path: &BeamPath,
    ) -> Result<BeamPath, StrategyError> {
        let change = |p: BeamPoint, factor: f64| match *self {
            _ if !p.is_on() => p,
            Lever::Speed | Lever::Dwell => p,
            Lever::Power => BeamPoint {
                power: p.power / factor,
                ..p
            },
            Lever::Spot([least, greatest]) => BeamPoint {
                spot: (factor * p.spot).clamp(least, greatest),
                ..p
            },
        };
        if matches!(self, Lever::Speed | Lever::Dwell) {
            return Ok(self.held(factors, path).apply(path)?);
        }
        let mut points = Vec::with_capacity(path.points().len() + 2 * factors.factors().len());
        let mut put = |p: BeamPoint| {
            if points.last() != Some(&p) {
                points.push(p);
            }
        };
        let mut next = path.points().iter().peekable();
        for (from, to, factor) in factors.intervals() {
            // of several points at the beginning only the last one heats
            while let Some(p) = next.next_if(|p| p.time <= from) {
                if next.peek().is_some_and(|n| n.time <= from) {
                    put(*p);
                }
            }
            put(change(path.at(from), factor));
            while let Some(p) = next.next_if(|p| p.time < to) {
                put(change(*p, factor));
            }
        }
        for p in next {
            put(*p);
        }
        Ok(BeamPath::new(points)?)
    }

    /// Whether it changes what the path does from one of its times to another, between two of its points.
    pub(crate) fn acts(&self, path: &BeamPath, from: f64, to: f64) -> bool {
        match self {
            Lever::Dwell => path.rests_over(from, to),
            Lever::Speed | Lever::Power | Lever::Spot(_) => path.at(from).is_on(),
        }
    }

    /// `factors` with 1 wherever this lever changes nothing.
    fn held(&self, factors: &SpeedProfile, path: &BeamPath) -> SpeedProfile {
        let mut held = factors.clone();
        for (factor, (from, to, _)) in held.factors_mut().iter_mut().zip(factors.intervals()) {
            if !self.acts(path, from, to) {
                *factor = 1.0;
            }
        }
        held
    }

    /// When, in the time of the changed path, each interval of `factors` begins, and the last one ends; s.
    pub(crate) fn times(&self, factors: &SpeedProfile, path: &BeamPath) -> Vec<f64> {
        let mut time = path.begin();
        let mut times = vec![time];
        for (from, to, factor) in self.held(factors, path).intervals() {
            time += match self {
                Lever::Speed | Lever::Dwell => (to - from) / factor,
                Lever::Power | Lever::Spot(_) => to - from,
            };
            times.push(time);
        }
        times
    }

    /// That it has a hold on `path` at all.
    ///
    /// # Errors
    /// [`StrategyError::NoSpots`]: times on spots of a path that rests nowhere.
    pub fn check(&self, path: &BeamPath) -> Result<(), StrategyError> {
        if *self == Lever::Dwell && path.rests().next().is_none() {
            return Err(StrategyError::NoSpots);
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    #[test]
    fn spots_stay_within_what_the_machine_gives() {
        let start = BeamPoint::start(300.0, 0.4);
        let path = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 1000.0, start).unwrap();
        let mut factors = SpeedProfile::of(&path, 1.0);
        factors.factors_mut().copy_from_slice(&[1.1, 2.0, 0.1]);
        let wider = Lever::Spot([0.3, 0.65]).apply(&factors, &path).unwrap();
        let found = [0.5e-3, 1.5e-3, 2.5e-3].map(|t| wider.at(t));
        assert!((found[0].spot - 0.44).abs() < 1e-12);
        assert_eq!([found[1].spot, found[2].spot], [0.65, 0.3]);
        assert!(found.iter().all(|p| p.power == 300.0));
    }

    /// Two spots and a line between them: the time on spots changes, the line does not.
    #[test]
    fn dwell_changes_spots_alone() {
        let at = |time: f64, x: f64| BeamPoint {
            time,
            x,
            y: 0.0,
            power: 300.0,
            spot: 0.4,
        };
        let points = [(0.0, 0.0), (1e-3, 0.0), (2e-3, 1.0), (4e-3, 1.0)];
        let path = BeamPath::new(points.map(|(t, x)| at(t, x)).to_vec()).unwrap();
        let mut factors = SpeedProfile::of(&path, 0.5);
        factors.factors_mut().iter_mut().for_each(|f| *f = 2.0);
        let shorter = Lever::Dwell.apply(&factors, &path).unwrap();
        assert!((shorter.end() - 2.5e-3).abs() < 1e-12);
        assert!((shorter.at(1e-3).x - 0.5).abs() < 1e-9);
        let times = Lever::Dwell.times(&factors, &path);
        let wanted = [0.0, 0.5e-3, 1e-3, 1.5e-3, 2.5e-3];
        assert!(times.iter().zip(wanted).all(|(t, w)| (t - w).abs() < 1e-12));
        let line = path.between(1e-3, 2e-3);
        assert!(matches!(
            Lever::Dwell.check(&line),
            Err(StrategyError::NoSpots)
        ));
        assert!(Lever::Dwell.check(&path).is_ok());
    }

    /// A point on the x axis.
    pub(crate) fn at(time: f64, x: f64, on: bool) -> BeamPoint {
        BeamPoint {
            time,
            x,
            y: 0.0,
            power: if on { 300.0 } else { 0.0 },
            spot: 0.4,
        }
    }

    /// Jumps and beam-off pieces stay as they are.
    #[test]
    fn jumps_stay() {
        let path = BeamPath::new(vec![
            at(0.0, 0.0, true),
            at(1e-3, 1.0, false),
            at(1e-3, 5.0, true),
            at(2e-3, 6.0, false),
            at(3e-3, 9.0, true),
            at(4e-3, 10.0, false),
        ])
        .unwrap();
        let mut factors = SpeedProfile::of(&path, 0.3);
        factors.factors_mut().iter_mut().for_each(|f| *f = 1.25);
        let weaker = Lever::Power.apply(&factors, &path).unwrap();
        for n in 0..400 {
            let t = 1e-5 * f64::from(n) + 5e-6;
            let (a, b) = (path.at(t), weaker.at(t));
            assert!(
                (a.x - b.x).abs() < 1e-9 && a.power.min(240.0) == b.power,
                "{t}: {a:?} {b:?}"
            );
        }
    }
}
