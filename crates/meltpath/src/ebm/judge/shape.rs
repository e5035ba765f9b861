//! What a path that was looked for does to the shape, and to the metal in it.

use meltpath_base::Reporter;

use meltpath_thermal::criteria::Class;

use crate::ebm::judge::{Judged, JudgedPath, of_all};
use crate::ebm::optimise::Optimise;
use crate::ebm::optimise::search::Found;
use crate::ebm::rounds::Round;
use crate::job::ebm::OptimiseSolver;

/// Warns where a path that was looked for inside the contour melts more outside than the given one.
pub(in crate::ebm) fn tell_of_shape(judged: &Judged, how: &Optimise, reporter: &Reporter) {
    /// Share of the section that is worth a word.
    const WORTH: f64 = 1e-3;
    let Some(better) = &judged.better else {
        return;
    };
    let [before, after] = [&judged.given, better].map(|path| path.runs[0].outside.share);
    if after < before + WORTH {
        return;
    }
    let (why, help) = match how.solver {
        OptimiseSolver::Judge => (
            "less than checks.outside counts for the search, on coarse cells",
            "a smaller checks.outside, or [correct]: it goes on to the judge's own cells",
        ),
        OptimiseSolver::Charts | OptimiseSolver::Reference => (
            "it looks at what lies inside the contour, its rim left out",
            "optimise.solver = \"judge\", or [correct] in place of [optimise]: both keep to the shape first; or lines that end further inside the contour",
        ),
    };
    reporter.warn(
        "outside-grew",
        format!(
            "the path that [optimise] found melts {:.2} % of the section's area outside the contour, the path as given {:.2} %: {why}",
            100.0 * after,
            100.0 * before
        ),
        help,
    );
}

/// Warns where a path that was looked for does worse than the given one in what the checks count: the search has its own measure, on its
/// own model.
pub(in crate::ebm) fn tell_of_loss(judged: &Judged, how: &Optimise, reporter: &Reporter) {
    /// Share of the section that is worth a word.
    const WORTH: f64 = 0.01;
    let Some(better) = &judged.better else {
        return;
    };
    let of = |path: &JudgedPath| {
        let run = &path.runs[0];
        let share = |class| of_all(&run.tally, class);
        // with the sign of what is worse
        [
            ("in the window", share(Class::Good), -1.0),
            ("left as powder", share(Class::Unmelted), 1.0),
            (
                "not fused to what lies below",
                run.unfused.unwrap_or(0.0),
                1.0,
            ),
        ]
    };
    let both = of(&judged.given).into_iter().zip(of(better));
    let worse = both.filter(|(before, after)| after.2 * (after.1 - before.1) > WORTH);
    let worse: Vec<String> = worse
        .map(|((what, before, _), (_, after, _))| {
            let [before, after] = [before, after].map(|share| 100.0 * share);
            format!("{after:.1} % {what} for {before:.1} % by the path as given")
        })
        .collect();
    if worse.is_empty() {
        return;
    }
    let help = match how.solver {
        OptimiseSolver::Judge => {
            "shape came first: a larger checks.outside or checks.rim, or lines that end further inside the contour, leave more to the window"
        }
        OptimiseSolver::Charts | OptimiseSolver::Reference => {
            "the path as given: leave [optimise] out, or look at what the checks count: optimise.solver = \"judge\", or [correct]"
        }
    };
    reporter.warn(
        "search-lost",
        format!(
            "the path that [optimise] found is worse on the reference solver: {}",
            worse.join(", ")
        ),
        help,
    );
}

/// Warns where a changed path is worse than the given one on the judge's own cells, so that the given one is handed back.
pub(in crate::ebm) fn tell_withdrawn(
    given: &JudgedPath,
    changed: &JudgedPath,
    reporter: &Reporter,
) {
    let [before, after] = [given, changed].map(|path| {
        let run = &path.runs[0];
        [of_all(&run.tally, Class::Good), run.outside.share].map(|share| 100.0 * share)
    });
    reporter.warn(
        "search-withdrawn",
        format!(
            "what was found on coarse cells is worse on the judge's own: {:.1} % of the section in the window and {:.2} % molten outside, for {:.1} and {:.2} % by the path as given, which is handed back",
            after[0], after[1], before[0], before[1]
        ),
        "finer cells for both (judge.cell), two planes a layer (judge.planes), or [correct], whose last round is on the judge's own cells",
    );
}

/// Warns where much of what a search changed stands at the least or the greatest factor that it may take: the bounds decided, not the search.
pub(in crate::ebm) fn tell_of_bounds(found: &Found, bounds: [f64; 2], reporter: &Reporter) {
    /// Share of what was changed that is worth a word.
    const WORTH: f64 = 0.25;
    let Some(at) = found.at_bounds else {
        return;
    };
    let told = at.into_iter().zip(bounds).zip(["least", "greatest"]);
    let told = told.filter(|((share, _), _)| *share > WORTH);
    let told: Vec<String> = told
        .map(|((share, bound), which)| {
            format!(
                "{:.0} % of what was changed stand at {:.0} %, the {which} that optimise.speeds allows",
                100.0 * share,
                100.0 * bound
            )
        })
        .collect();
    if told.is_empty() {
        return;
    }
    reporter.warn(
        "search-at-bound",
        format!("{}: the bounds chose there, not the search", told.join(", ")),
        "let it go farther (optimise.speeds, such as [\"20 %\", \"300 %\"]), or begin nearer to what is wanted: the speed, current or dwell of the path",
    );
}

/// Warns where paths were to be robust and the window is too narrow for it: then no place stays in it through all of the drift.
pub(in crate::ebm) fn tell_of_drift(round: &Round, (drift, key): (f64, &str), reporter: &Reporter) {
    let Some([less, more]) = round.moves() else {
        return;
    };
    let half = 0.5 * (round.window[1] - round.window[0]);
    let moved = less.abs().max(more.abs());
    if moved <= half {
        return;
    }
    let percent = 100.0 * drift;
    reporter.warn(
        "drift-beyond-window",
        format!(
            "{percent:.1} % less and {percent:.1} % more power move the section by {less:+.0} and {more:+.0} K, half the window is {half:.0} K: whatever the path, no place stays there with both; at least {:.1} % of it stay with each of the three powers",
            100.0 * round.in_window()
        ),
        format!(
            "a window of {moved:.0} K to either side, if the metal bears it, or a power that holds within {:.1} % ({key})",
            percent * half / moved
        ),
    );
}
