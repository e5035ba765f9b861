//! Whether a plan that is named beside a job is one of that job: the feed, the speed and the size of its beads, and how far they reach, are held
//! against the job's. What differs stays as the plan has it, and is told.

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Profile, Toolpath};

use crate::stages::part::Part;
use crate::waam::plan::own::SAME_SETTING;
use crate::waam::settings::Settings;
use crate::waam::settings::bead::PER_MINUTE;

/// How far the outermost axes may lie from the sides of the part, allowance left out, in bead widths: a tip narrower than a bead is not laid.
const BESIDE: f64 = 1.5;
/// How far the highest beads may lie from the top of the part, in heights of a bead.
const FROM_TOP: f64 = 3.0;

/// Tells where a plan differs from what its job asks for.
pub(in crate::waam) fn tell(
    toolpath: &Toolpath,
    part: Option<&Part>,
    settings: &Settings,
    reporter: &Reporter,
) {
    let mut words = beads(toolpath, settings);
    words.extend(part.and_then(|part| reach(toolpath, part, settings)));
    if !words.is_empty() {
        reporter.warn(
            "plan-of-another-job",
            format!(
                "the plan is not one of this job, and is laid as it says: {}",
                words.join("; ")
            ),
            "name the job that it was planned by, or plan this one anew: meltpath plan",
        );
    }
}

/// How its beads differ from the job's.
fn beads(toolpath: &Toolpath, settings: &Settings) -> Vec<String> {
    let bead = &settings.bead;
    let laid = toolpath.passes().filter(|p| p.head.role.deposits());
    let mut used: Vec<usize> = laid.map(|p| usize::from(p.head.profile)).collect();
    used.sort_unstable();
    used.dedup();
    let profiles = used.iter().filter_map(|i| toolpath.profiles.get(*i));
    let mut words: Vec<String> = profiles
        .flat_map(|p: &Profile| {
            let speed = |v: f64| format!("{:.2} m/min", v * PER_MINUTE);
            let length = |v: f64| format!("{v:.2} mm");
            let of = |what: &str, plan: f64, job: f64, shown: &dyn Fn(f64) -> String| {
                // what is zero is not said
                (plan > 0.0 && (plan - job).abs() > SAME_SETTING * job)
                    .then(|| format!("{what} {}, the job's {}", shown(plan), shown(job)))
            };
            [
                of("wire feed", p.wire_feed, bead.wire_feed, &speed),
                of("travel speed", p.speed, bead.travel_speed, &speed),
                of("bead width", p.width, bead.width.value, &length),
                of("bead height", p.height, bead.height.value, &length),
            ]
        })
        .flatten()
        .collect();
    if toolpath.weaves.first() != settings.weave.as_ref() {
        words.push("its beads are woven otherwise".to_owned());
    }
    words
}

/// How far its beads reach, where that is not as far as the part.
fn reach(toolpath: &Toolpath, part: &Part, settings: &Settings) -> Option<String> {
    let laid = toolpath.passes().filter(|p| p.head.role.deposits());
    let points = laid.flat_map(|p| p.points.iter().copied());
    let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let (least, most) = part.mesh.bounds()?;
    let side = settings.allowance + BESIDE * settings.bead.width.value;
    let above = settings.least_over() + FROM_TOP * settings.bead.height.value;
    let off = (low - least).abs().max((high - most).abs());
    // fewer layers may be asked for
    let lower = settings.count.is_none() && off.z > above;
    (off.x > side || off.y > side || lower).then(|| {
        let size = |low: DVec3, high: DVec3| {
            format!(
                "x {:.0} to {:.0}, y {:.0} to {:.0}, z up to {:.0} mm",
                low.x, high.x, low.y, high.y, high.z
            )
        };
        format!(
            "its beads reach from {}, the job's part from {}",
            size(low, high),
            size(least, most)
        )
    })
}
