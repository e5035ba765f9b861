//! What a path that was looked for does to the shape, and to the metal in it.

use meltpath_base::Reporter;

use meltpath_thermal::criteria::Class;

use crate::ebm::judge::{Judged, JudgedPath, of_all};

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
