//! What the findings on a judged path ask for, brought together: one alone may ask for the opposite of the next.

use meltpath_thermal::criteria::Tally;

/// More heat.
pub(in crate::ebm) const MORE: &str = "more power, slower lines, or lines closer together";
const LESS: &str = "less power, a wider spot, faster lines, or lines further apart";
const BOTH: &str = "no power mends both, places that are too cold and places that are too hot";
const CLOSER: &str = "lines closer together and as much faster, which evens both";
const OUT: &str = "lines that reach beyond the contour by a quarter of the spot (hatch.overrun), where it is cold at the rim";

/// What the findings ask for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(in crate::ebm) struct Needs {
    /// More heat somewhere: powder that stays, a foot that does not melt, or most of the section below the window.
    pub(in crate::ebm) heat: bool,
    /// Less somewhere: a surface too hot for a still pool, or most of the section above the window.
    pub(in crate::ebm) cold: bool,
    /// Less beyond the contour, where too much melts.
    pub(in crate::ebm) narrow: bool,
}

impl Needs {
    /// By where most of what misses the window lies.
    pub(in crate::ebm) fn of_window(tally: &Tally) -> Self {
        let [unmelted, porous, _, overheated] = tally.counts;
        let hot = overheated > porous + unmelted;
        Needs {
            heat: !hot,
            cold: hot,
            narrow: false,
        }
    }

    /// All of both.
    pub(in crate::ebm) fn and(self, other: Needs) -> Self {
        Needs {
            heat: self.heat || other.heat,
            cold: self.cold || other.cold,
            narrow: self.narrow || other.narrow,
        }
    }

    /// What to change of the heat: the same for every finding.
    pub(in crate::ebm) fn heat(self) -> String {
        match (self.heat, self.cold, self.narrow) {
            (true, true, true) => format!("{BOTH}: {CLOSER}"),
            (true, true, false) => format!("{BOTH}: first {OUT}; then {CLOSER}"),
            (false, true, _) => LESS.to_owned(),
            (_, false, _) => MORE.to_owned(),
        }
    }

    /// What to change where too much melts beyond the contour.
    pub(in crate::ebm) fn rim(self) -> &'static str {
        if self.heat {
            "lines that end further inside the contour"
        } else {
            "lines that end further inside the contour, or less power along it"
        }
    }
}
