//! What a drift of the power does once the window is set: how far it moves the section, and how much of it a window bears.
//!
//! Where 1 % of the power moves the section by S, a window of the width W bears a drift of W/2S either way at most: that of a place
//! in its middle. Through more no place stays in it, both ways, and at most half of a section does either way, whatever the path.

use meltpath_base::{Check, Fact, Measure};
use meltpath_melt_strategy::judgement::Variant;
use meltpath_thermal::criteria::Class;

use crate::ebm::judge::{JudgedPath, Run, of_all};

pub(super) const DRIFT: [&str; 2] = [
    "drift",
    "section that stays in the window where the power drifts",
];
/// The drift that is told where the job asks for none, per cent of the power.
const TOLD: i8 = 3;
/// Those that the judge draws.
const DRAWN: [i8; 3] = [1, TOLD, 5];

/// What the power moves, and what the window bears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    /// Per cent of the power, either way.
    percent: i8,
    /// By how much less and more of it move the mean of what melts, K.
    moves: [f64; 2],
    /// Half the window, K.
    half: f64,
    /// Least share of the section in the window as it was, with less, more, and as set.
    pub(super) left: f64,
}

impl Drift {
    /// The drift of a job that asks for `asked`, a share of the power, rounded up to one that is drawn. `None` where a run is missing
    /// or melts nothing.
    pub(super) fn of(path: &JudgedPath, asked: Option<f64>) -> Option<Self> {
        let drawn = |asked: f64| {
            DRAWN
                .into_iter()
                .find(|p| f64::from(*p) >= 100.0 * asked - 1e-9)
        };
        let percent = asked.map_or(Some(TOLD), drawn)?;
        let of = |wanted: Variant| {
            let run = path.runs.iter().find(|run| run.variant == wanted)?;
            (run.tally.molten() > 0).then_some(run)
        };
        let as_set = of(Variant::TwiceCell)?;
        let drifted = [of(Variant::Power(-percent))?, of(Variant::Power(percent))?];
        let good = |run: &Run| of_all(&run.as_it_was, Class::Good);
        let [low, high] = path.runs[0].classes.window;
        Some(Drift {
            percent,
            moves: drifted.map(|run| run.tally.mean - as_set.tally.mean),
            half: 0.5 * (high - low),
            left: drifted.map(good).into_iter().fold(good(as_set), f64::min),
        })
    }

    /// The greatest drift that the window bears, per cent of the power, by what less and what more of it move.
    fn borne(&self) -> [f64; 2] {
        let percent = f64::from(self.percent);
        self.moves.map(|k| percent * self.half / k.abs().max(1e-9))
    }

    fn words(&self) -> String {
        let ([less, more], percent) = (self.moves, self.percent);
        format!(
            "{percent} % less and {percent} % more power after the window was set move the section by {less:+.0} and {more:+.0} K; half the window is {:.0} K",
            self.half
        )
    }

    /// As a fact.
    pub(super) fn fact(&self) -> Fact {
        let [less, more] = self.borne();
        let value = Measure::new(0.5 * (less + more), 0.5 * (less - more).abs(), "%");
        let words = format!(
            "{}; at least {:.1} % of the section stay in it with either",
            self.words(),
            100.0 * self.left
        );
        let title = "drift of the power that the window bears at most, whatever the path";
        Fact::new("power-drift", title, value, &words)
    }

    /// Says where no place bears the drift, and what window would.
    pub(super) fn bound(&self, check: Check) -> Check {
        let [less, more] = self.borne();
        let (borne, asked) = (less.min(more), f64::from(self.percent));
        if borne >= asked {
            return check;
        }
        let needed = self.moves[0].abs().max(self.moves[1].abs());
        check.because(&format!(
            "{}: whatever the path, no place stays in it with both, and at most half of the section with either; this window bears {borne:.1} % at most, one of {needed:.0} K to either side would bear {asked} %",
            self.words()
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::Limit;

    /// 27 K a per cent against 30 K: a per cent is borne, three are not.
    #[test]
    fn a_narrow_window_bears_little() {
        let drift = |half: f64| Drift {
            percent: 3,
            moves: [-80.0, 82.0],
            half,
            left: 0.0,
        };
        let fact = drift(30.0).fact();
        assert!(
            (fact.value.as_ref().unwrap().value - 1.11).abs() < 0.01,
            "{fact:?}"
        );
        let told = |half: f64| {
            let measure = Measure::exact(60.0, "%");
            let check = Check::judge("in-window", "", measure, Limit::AtLeast(50.0));
            drift(half).bound(check).reason
        };
        let narrow = told(30.0);
        assert!(
            narrow.contains("no place stays in it with both") && narrow.contains("1.1 % at most"),
            "{narrow}"
        );
        assert!(narrow.contains("82 K to either side"), "{narrow}");
        assert_eq!(told(90.0), "");
    }
}
