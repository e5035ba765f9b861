//! What is changed along a path so that it heats more or less: speed, time on spots, current or width of the beam.
//!
//! One number says how: a factor above 1 heats less. It multiplies the speed, divides the time on a spot or the current, or
//! multiplies the diameter.

use crate::error::StrategyError;
use crate::speed::SpeedProfile;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::focus::FocusCalibration;

/// What is changed.
#[derive(Debug, Clone, PartialEq)]
pub enum Lever {
    /// The speed, times the factor; where the beam rests its time, divided by it.
    Speed,
    /// The time on each spot, divided by the factor; what moves keeps its speed.
    Dwell,
    /// The beam current, divided by the factor.
    Current,
    /// The beam's diameter, times the factor, by the focus current within the branch of the calibration where it lies.
    Diameter(FocusCalibration),
}

impl Lever {
    /// The path with these factors.
    ///
    /// # Errors
    /// [`StrategyError`]: factors not above zero, a focus without calibration or with one diameter for all.
    ///
    /// ```
    /// use meltpath_thermal::beam::{BeamPath, BeamPoint};
    /// use meltpath_melt_strategy::{lever::Lever, speed::SpeedProfile};
    /// let start = BeamPoint { time: 0.0, x: 0.0, y: 0.0, voltage: 60e3, current: 5e-3, focus: 4e-3, on: true };
    /// let path = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 1000.0, start).unwrap();
    /// let mut factors = SpeedProfile::of(&path, 1.0);
    /// factors.factors_mut()[1] = 2.0;
    /// let weaker = Lever::Current.apply(&factors, &path).unwrap();
    /// assert_eq!(weaker.end(), path.end());
    /// assert_eq!(weaker.at(0.0015).current, 2.5e-3);
    /// let faster = Lever::Speed.apply(&factors, &path).unwrap();
    /// assert!((faster.end() - 0.0025).abs() < 1e-12);
    /// ```
    pub fn apply(
        &self,
        factors: &SpeedProfile,
        path: &BeamPath,
    ) -> Result<BeamPath, StrategyError> {
        let change: Box<dyn Fn(BeamPoint, f64) -> Result<BeamPoint, StrategyError> + '_> =
            match self {
                Lever::Speed | Lever::Dwell => return Ok(self.held(factors, path).apply(path)?),
                Lever::Current => Box::new(|p, factor| {
                    Ok(BeamPoint {
                        current: p.current / factor,
                        ..p
                    })
                }),
                Lever::Diameter(calibration) => Box::new(|p, factor| {
                    Ok(BeamPoint {
                        focus: wider(calibration, p.focus, factor)?,
                        ..p
                    })
                }),
            };
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
            let begun = path.at(from);
            put(if begun.on {
                change(begun, factor)?
            } else {
                begun
            });
            while let Some(p) = next.next_if(|p| p.time < to) {
                put(if p.on { change(*p, factor)? } else { *p });
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
            Lever::Speed | Lever::Current | Lever::Diameter(_) => path.at(from).on,
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
                Lever::Current | Lever::Diameter(_) => to - from,
            };
            times.push(time);
        }
        times
    }

    /// That it has a hold on `path` at all.
    pub(crate) fn check(&self, path: &BeamPath) -> Result<(), StrategyError> {
        if *self == Lever::Dwell && path.rests().next().is_none() {
            return Err(StrategyError::NoSpots);
        }
        Ok(())
    }
}

/// The focus current (A) at which the beam is `factor` times as wide as at `focus`, as far as its branch reaches.
fn wider(calibration: &FocusCalibration, focus: f64, factor: f64) -> Result<f64, StrategyError> {
    let diameter = calibration.diameter(focus)?;
    let branch = calibration
        .pieces()
        .iter()
        .find(|p| (p.range[0]..=p.range[1]).contains(&focus));
    match branch {
        Some(piece) if piece.slope != 0.0 => {
            let wanted = (factor * diameter - piece.intercept) / piece.slope;
            Ok(wanted.clamp(piece.range[0], piece.range[1]))
        }
        _ => Err(StrategyError::FixedFocus { diameter }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_thermal::focus::FocusPiece;

    #[test]
    fn focus_follows_its_branch_and_stays_in_it() {
        let piece = |range: [f64; 2], intercept, slope| FocusPiece {
            range,
            intercept,
            slope,
        };
        let thesis = FocusCalibration::new(vec![
            piece([-3e-3, 7.15e-3], 0.551_67, -34.5),
            piece([7.15e-3, 30e-3], 0.132_15, 24.21),
        ])
        .unwrap();
        let found = wider(&thesis, 4e-3, 1.1).unwrap();
        let ratio = thesis.diameter(found).unwrap() / thesis.diameter(4e-3).unwrap();
        assert!((ratio - 1.1).abs() < 1e-12 && found < 4e-3);
        assert_eq!(wider(&thesis, 4e-3, 0.1).unwrap(), 7.15e-3);
        let fixed = FocusCalibration::constant(0.4);
        assert!(matches!(
            wider(&fixed, 4e-3, 1.1),
            Err(StrategyError::FixedFocus { .. })
        ));
    }

    /// Two spots and a line between them: the time on spots changes, the line does not.
    #[test]
    fn dwell_changes_spots_alone() {
        let at = |time: f64, x: f64| BeamPoint {
            time,
            x,
            y: 0.0,
            voltage: 60e3,
            current: 5e-3,
            focus: 4e-3,
            on: true,
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

    /// Jumps and beam-off pieces stay as they are.
    #[test]
    fn jumps_stay() {
        let at = |time: f64, x: f64, on: bool| BeamPoint {
            time,
            x,
            y: 0.0,
            voltage: 60e3,
            current: 5e-3,
            focus: 4e-3,
            on,
        };
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
        let weaker = Lever::Current.apply(&factors, &path).unwrap();
        for n in 0..400 {
            let t = 1e-5 * f64::from(n) + 5e-6;
            let (a, b) = (path.at(t), weaker.at(t));
            assert!((a.x - b.x).abs() < 1e-9 && a.on == b.on, "{t}: {a:?} {b:?}");
            if a.on {
                assert!((b.current - 4e-3).abs() < 1e-12);
            }
        }
    }
}
