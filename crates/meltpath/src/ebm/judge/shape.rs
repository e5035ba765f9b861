//! What a path that was looked for does to the shape.

use meltpath_base::Reporter;

use crate::ebm::judge::Judged;

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
