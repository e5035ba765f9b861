//! The controller's data: the `[motion]` table of a cell file, every number with where it comes from.

use meltpath_base::settings::{self, Problem, Problems, Sourced};
use meltpath_base::{Angle, AngularSpeed, Length, Ratio, Speed, Time, table};

table! {
    /// A controller that interpolates by a cascade of two moving averages (FIR), with a dwell at changes of direction.
    /// Source of the model: Rouchon 2022, §3.3.1, pp. 62-66.
    pub struct Controller {
        /// Interpolation period.
        period: Sourced<Time> where positive => required;
        /// Duration T_1 of the first filter: a whole number of periods.
        t1: Sourced<Time> where positive => required;
        /// Duration T_2 of the second filter, at most T_1: a whole number of periods.
        t2: Sourced<Time> where positive => required;
        /// Speed of moves that only turn the tool, and limit of all others' turning.
        rotation_speed: Sourced<AngularSpeed> where positive => required;
        /// Speed of the tool centre point in a joint move at 100 %, where the speeds of the joints are not known.
        joint_speed: Sourced<Speed> where positive => required;
        /// Dwell against smoothing, by increasing smoothing from 0 to 100 %; linear between the entries.
        dwell: Vec<DwellEntry> => required;
        /// What a change of direction is.
        corner: CornerLaw => required;
        /// The slowest and the fastest speed along the path at which it was identified. A tenth beyond them nothing is decided by it.
        speeds: [Speed; 2] => none("not said: it counts at any speed");
    }

    /// Dwell at a change of direction, for one value of the smoothing option.
    pub struct DwellEntry {
        /// Smoothing option: 0 % is point to point.
        smoothing: Ratio where within(0.0, 1.0) => required;
        /// Dwell T_D.
        time: Sourced<Time> where not_negative => required;
    }

    /// Which points of a path are changes of direction.
    pub struct CornerLaw {
        /// No dwell where the direction changes by less.
        none_below: Sourced<Angle> where not_negative => required;
        /// The full dwell where the direction changes by more.
        full_above: Sourced<Angle> where up_to(std::f64::consts::PI) => required;
        /// A chain of chords closer than this to a smooth curve is that curve.
        chord_error: Sourced<Length> where positive => required;
    }
}

/// Why a controller's data cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// Values that contradict each other.
    #[error(transparent)]
    Data(#[from] Problems),
    /// The sampling period does not divide a filter.
    #[error(
        "a sampling period of {dt} s does not divide the filters of {t1} s and {t2} s: take the controller's period of {period} s divided by a whole number"
    )]
    Sampling {
        /// The sampling period asked for, s.
        dt: f64,
        /// T_1, s.
        t1: f64,
        /// T_2, s.
        t2: f64,
        /// The controller's period, s.
        period: f64,
    },
}

/// `a / b` where it is a whole number of at least 1 within rounding.
fn whole(a: f64, b: f64) -> Option<usize> {
    let ratio = a / b;
    let n = ratio.round();
    ((1.0..1e6).contains(&n) && (ratio - n).abs() < 1e-6).then_some(n as usize)
}

/// Filters of one period and no dwell: the speed that is set, everywhere.
const WITHOUT_CORNERS: &str = r#"
period = { value = "2 ms", source = "no model" }
t1 = { value = "2 ms", source = "no model" }
t2 = { value = "2 ms", source = "no model" }
rotation_speed = { value = "90 deg/s", source = "no model" }
joint_speed = { value = "1 m/s", source = "no model" }
corner = { none_below = { value = "5 deg", source = "no model" }, full_above = { value = "30 deg", source = "no model" }, chord_error = { value = "0.15 mm", source = "no model" } }
[[dwell]]
smoothing = "0 %"
time = { value = "4 ms", source = "no model" }
[[dwell]]
smoothing = "100 %"
time = { value = "0 ms", source = "no model" }
"#;

impl Controller {
    /// What stands in for a controller that nobody has identified: it drives the set speed round every corner. What follows from the
    /// speed at corners must not be decided with it.
    #[expect(
        clippy::expect_used,
        clippy::missing_panics_doc,
        reason = "a constant text, read by a test"
    )]
    pub fn without_corners() -> Self {
        settings::parse(WITHOUT_CORNERS, Controller::check).expect("the constant reads")
    }

    /// T_1 + T_2, s: the duration of every transition, and of the stop at a FINE point.
    pub fn transition(&self) -> f64 {
        self.t1.value.0 + self.t2.value.0
    }

    /// The dwell T_D of a change of direction at the smoothing option `share` (0 to 1), s; linear between the entries.
    pub fn dwell(&self, share: f64) -> f64 {
        let mut last: Option<(f64, f64)> = None;
        for entry in self.dwell.iter() {
            let (x, y) = (entry.smoothing.0, entry.time.value.0);
            if share <= x {
                return match last {
                    Some((x0, y0)) if x > x0 => y0 + (y - y0) * (share - x0) / (x - x0),
                    _ => y,
                };
            }
            last = Some((x, y));
        }
        last.map_or(0.0, |(_, y)| y)
    }

    /// The sampling period nearest to 2 ms that divides the controller's, s.
    pub fn sampling(&self) -> f64 {
        let period = self.period.value.0;
        period / (period / 2e-3).round().max(1.0)
    }

    /// What is wrong between its values.
    pub fn check(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        let period = self.period.value.0;
        for filter in [&self.t1, &self.t2] {
            if whole(filter.0, period).is_none() {
                let message = format!(
                    "{} is {}: it must be a whole number of periods, at least 1",
                    filter.name,
                    Time(filter.0)
                );
                let near = Time((filter.0 / period).round().max(1.0) * period);
                problems.push(
                    filter
                        .problem(message)
                        .help(format!("write for example \"{near}\"")),
                );
            }
        }
        if self.t2.value.0 > self.t1.value.0 {
            let message = format!(
                "{} is {}: it must be at most t1",
                self.t2.name,
                Time(self.t2.0)
            );
            problems.push(self.t2.problem(message).help("exchange t1 and t2"));
        }
        let law = &self.corner;
        if law.none_below.0 >= law.full_above.0 {
            let message = format!(
                "{} is {}: it must be below full_above, {}",
                law.none_below.name,
                Angle(law.none_below.0),
                Angle(law.full_above.0)
            );
            problems.push(law.none_below.problem(message));
        }
        if let Some([low, high]) = &*self.speeds
            && !(0.0 < low.0 && low.0 <= high.0)
        {
            let message = format!("{} are {low} and {high}", self.speeds.name);
            let problem = self.speeds.problem(message);
            problems.push(problem.help("write the slowest first, above zero, then the fastest"));
        }
        problems.extend(self.check_dwell());
        problems
    }

    fn check_dwell(&self) -> Option<Problem> {
        let rising = self
            .dwell
            .windows(2)
            .all(|w| w[0].smoothing.0 < w[1].smoothing.0 && w[0].time.0 >= w[1].time.0);
        let ends = self.dwell.first().zip(self.dwell.last());
        let whole_range = ends.is_some_and(|(first, last)| {
            first.smoothing.0 == 0.0
                && (first.time.0 - self.transition()).abs() < 1e-9
                && last.smoothing.0 == 1.0
        });
        let problem = || {
            let name = &self.dwell.name;
            let message = format!("the entries of {name} do not make a law of the dwell");
            self.dwell.problem(message).help(format!(
                "write [[{name}]] by increasing smoothing, from \"0 %\" with {} (t1 + t2) down to \"100 %\", never rising",
                Time(self.transition())
            ))
        };
        (!(rising && whole_range)).then(problem)
    }

    /// The lengths of the two filters in samples of `dt` s.
    pub(crate) fn taps(&self, dt: f64) -> Result<(usize, usize), ControllerError> {
        let (t1, t2) = (self.t1.value.0, self.t2.value.0);
        whole(t1, dt)
            .zip(whole(t2, dt))
            .ok_or(ControllerError::Sampling {
                dt,
                t1,
                t2,
                period: self.period.value.0,
            })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    use meltpath_base::settings;

    /// The controller of the shipped cell.
    pub(crate) fn arcmate() -> Controller {
        let text = meltpath_data::cells::ARCMATE_120IC.text;
        settings::peek(text, &["motion"]).unwrap().unwrap()
    }

    #[test]
    fn nobodys_controller_holds_its_speed() {
        let c = Controller::without_corners();
        assert_eq!(c.check(), []);
        assert!(c.transition() < 5e-3 && c.dwell(0.5) < 3e-3);
    }

    #[test]
    fn the_shipped_cell_is_sound() {
        let c = arcmate();
        assert_eq!(c.check(), []);
        assert!((c.transition() - 0.216).abs() < 1e-12);
        for (share, ms) in [
            (0.0, 216.0),
            (0.25, 117.0),
            (0.5, 49.5),
            (1.0, 0.0),
            (0.6, 34.1),
        ] {
            assert!((c.dwell(share) * 1e3 - ms).abs() < 1e-9, "{share}");
        }
        assert!((c.sampling() - 2e-3).abs() < 1e-15);
    }

    #[test]
    fn unsound_data_are_refused_by_name() {
        let refused = |change: fn(&mut Controller)| {
            let mut c = arcmate();
            change(&mut c);
            c.check()[0].to_string()
        };
        let told = refused(|c| c.t1.value.0 = 0.130);
        assert!(
            told.contains("t1 is 0.13 s") && told.contains("\"0.132 s\""),
            "{told}"
        );
        assert!(refused(|c| c.t2.value.0 = 0.144).contains("t2"));
        assert!(refused(|c| c.dwell[2].time.value.0 = 0.2).contains("dwell"));
        assert!(refused(|c| c.corner.full_above.value.0 = 0.01).contains("corner"));
        assert!(arcmate().taps(0.005).is_err());
    }

    #[test]
    fn unknown_entries_and_bare_numbers_are_errors() {
        let text = meltpath_data::cells::ARCMATE_120IC
            .text
            .replace("rotation_speed", "rotation_sped")
            .replace("value = \"12 ms\"", "value = 12");
        let error = settings::peek::<Controller>(&text, &["motion"]).unwrap_err();
        let told = error.to_string();
        assert!(told.contains("did you mean `rotation_speed`"), "{told}");
        assert!(told.contains("\"12 s\""), "{told}");
    }
}
