//! What the findings on a judged path ask for, brought together: one alone may ask for the opposite of the next.

use meltpath_thermal::criteria::Tally;

/// More heat.
pub(in crate::ebm) const MORE: &str = "more power, slower lines, or lines closer together";
const LESS: &str = "less power, a wider spot, faster lines, or lines further apart";
const BOTH: &str = "no power mends both, places that are too cold and places that are too hot";
const CLOSER: &str = "lines closer together and as much faster, which evens both";
/// Share of the section beside the window, on either side, from which that side is to be mended.
const MUCH: f64 = 0.1;
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
    /// By what misses the window: both where much lies on either side of it, else the side of most.
    pub(in crate::ebm) fn of_window(tally: &Tally) -> Self {
        let [unmelted, porous, _, overheated] = tally.counts.map(|n| n as f64);
        let (below, above) = (unmelted + porous, overheated);
        let much = MUCH * tally.voxels as f64;
        let hot = above > below;
        Needs {
            heat: !hot || below > much,
            cold: hot || above > much,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a section that is too hot is no less to be mended than a quarter that is too cold.
    #[test]
    fn much_on_both_sides_of_the_window_asks_for_neither_more_nor_less() {
        let needs = |counts: [usize; 4]| {
            let needs = Needs::of_window(&Tally {
                voxels: counts.iter().sum(),
                counts,
                mean: 2800.0,
                deviation: 0.0,
                hottest: (3000.0, [0; 3]),
            });
            (needs.heat, needs.cold)
        };
        assert_eq!(needs([3, 24, 48, 25]), (true, true));
        assert_eq!(needs([3, 22, 48, 27]), (true, true));
        assert_eq!(needs([3, 24, 65, 8]), (true, false));
        assert_eq!(needs([0, 8, 62, 30]), (false, true));
        assert_eq!(needs([0, 4, 90, 6]), (false, true));
        assert_eq!(needs([2, 4, 90, 4]), (true, false));
    }
}
