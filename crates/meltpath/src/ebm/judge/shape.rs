//! What a path that was looked for does to the shape, and to the metal in it.

use meltpath_base::Reporter;

use meltpath_thermal::criteria::Class;

use crate::ebm::correct::Correct;
use crate::ebm::correct::rounds::Corrected;
use crate::ebm::judge::{Judged, JudgedPath, of_all};
use crate::ebm::optimise::search::Found;

/// Warns where a path that was looked for inside the contour melts more outside than the given one.
pub(in crate::ebm) fn tell_of_shape(judged: &Judged, reporter: &Reporter) {
    /// Share of the section that is worth a word.
    const WORTH: f64 = 1e-3;
    let Some(better) = &judged.better else {
        return;
    };
    let [before, after] = [&judged.given, better].map(|path| path.runs[0].outside.share);
    if after < before + WORTH {
        return;
    }
    reporter.warn(
        "outside-grew",
        format!(
            "the path that [optimise] found melts {:.2} % of the section's area outside the contour, the path as given {:.2} %: it looks at what lies inside the contour, its rim left out",
            100.0 * after,
            100.0 * before
        ),
        "[correct] in place of [optimise]: it keeps to the shape first, or lines that end further inside the contour",
    );
}

/// Warns where a path that was looked for does worse than the given one in what the checks count: the search has its own measure, on its
/// own model.
pub(in crate::ebm) fn tell_of_loss(judged: &Judged, reporter: &Reporter) {
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
    reporter.warn(
        "search-lost",
        format!(
            "the path that [optimise] found is worse on the reference solver: {}",
            worse.join(", ")
        ),
        "the path as given: leave [optimise] out, or [correct] in its place, which looks at what the checks count",
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
pub(in crate::ebm) fn tell_of_drift(found: &Corrected, how: &Correct, reporter: &Reporter) {
    let round = &found.rounds[found.kept];
    let (Some(drift), Some([less, more])) = (how.robust, round.moves()) else {
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
            "{percent:.1} % less and {percent:.1} % more power move the section by {less:+.0} and {more:+.0} K, half the window is {half:.0} K: whatever the currents, no place stays there with both; at least {:.1} % of it stay with each of the three powers",
            100.0 * round.in_window()
        ),
        format!(
            "a window of {moved:.0} K to either side, if the metal bears it, or a power that holds within {:.1} % (correct.robust)",
            percent * half / moved
        ),
    );
}
