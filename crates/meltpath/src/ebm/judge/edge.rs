//! How much of a section the beam's own edge lets into the window of good temperatures at most.
//!
//! Metal that is evenly hot ends in an edge no sharper than its beam's ([`Aim`]). The band between the contour and the place where
//! that edge enters the window is cold, whatever the path, as long as no more melts beyond the rim than the job allows. The share is
//! greatest where the section is as hot as the window allows, and where all that may melt beyond the rim does.

use meltpath_base::{Check, Fact, Limit, Measure};
use meltpath_geometry::Region;
use meltpath_geometry::offset::{Join, inset, outset};
use meltpath_melt_strategy::correction::{Aim, Rim};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::{Class, Classes};

use crate::ebm::judge::{JudgedPath, of_all};
use crate::ebm::plan::Plan;

/// Spots are four standard deviations wide.
pub(in crate::ebm) const DEVIATIONS: f64 = 4.0;
/// Arcs of the sections' outlines, mm.
const JOIN: Join = Join::Round {
    arc_tolerance: 1e-3,
};

/// What the edge of the beam allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::ebm) struct Ceiling {
    /// Greatest share of the section in the window.
    pub(in crate::ebm) share: f64,
    /// How wide the band along the contour is that stays below it, mm.
    pub(in crate::ebm) band: f64,
    /// How much further out than the rim the melt may end, so that all that may melt beyond it does, mm.
    pub(in crate::ebm) outward: f64,
    /// Diameter of the beam whose edge it is, mm.
    pub(in crate::ebm) spot: f64,
}

/// Of the widest spot of `path` in a window, K; `None` where the window does not lie above melting, or the section is no outline that
/// can be moved.
pub(in crate::ebm) fn ceiling(plan: &Plan, path: &BeamPath, window: [f64; 2]) -> Option<Ceiling> {
    let (material, checks) = (&plan.settings.material, &plan.settings.job.checks);
    let spot = widest(path);
    let rim = Rim {
        melting: material.liquidus,
        beyond: checks.rim.0,
        width: spot / DEVIATIONS,
    };
    let section = plan.contour.region();
    let outward = outward(&section, [rim.beyond, spot], checks.outside.0)?;
    let cold = Aim::new(material.start, window[1], rim).ok()?;
    let band = (cold.depth_of(window[0]) - outward).max(0.0);
    let left = inset(std::slice::from_ref(&section), band, JOIN).ok()?;
    Some(Ceiling {
        share: area(&left) / section.area(),
        band,
        outward,
        spot,
    })
}

/// The widest spot with which the beam is on, mm.
pub(in crate::ebm) fn widest(path: &BeamPath) -> f64 {
    let spots = path.points().iter().filter(|p| p.is_on());
    spots.map(|p| p.spot).fold(0.0, f64::max)
}

fn area(regions: &[Region]) -> f64 {
    regions.iter().map(Region::area).sum()
}

/// How far beyond the rim an even band reaches whose area is `share` of the section's, at most `most`, mm: by halving.
fn outward(section: &Region, [rim, most]: [f64; 2], share: f64) -> Option<f64> {
    let grown = |by: f64| Some(area(&outset(std::slice::from_ref(section), by, JOIN).ok()?));
    let within = grown(rim)? + share * section.area();
    let (mut low, mut high) = (0.0, most);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if grown(rim + middle)? < within {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// What the edge allows the judged path, where the whole section is judged.
fn of_judged(plan: &Plan, path: &BeamPath, classes: &Classes) -> Option<Ceiling> {
    let judging = plan.settings.judge.as_ref()?;
    match judging.part {
        Some(_) => None,
        None => ceiling(plan, path, classes.window),
    }
}

/// The ceiling as a fact, with the share of it that is reached.
pub(super) fn fact(plan: &Plan, path: &BeamPath, judged: &JudgedPath) -> Option<Fact> {
    let run = &judged.runs[0];
    let Ceiling {
        share, band, spot, ..
    } = of_judged(plan, path, &run.classes)?;
    let checks = &plan.settings.job.checks;
    let reached = if share > 0.0 {
        format!(
            "; {:.0} % of that is reached",
            100.0 * of_all(&run.tally, Class::Good) / share
        )
    } else {
        String::new()
    };
    let words = format!(
        "a band of {band:.2} mm along the contour stays below: the edge of an evenly hot section is no sharper than that of its beam of {spot:.2} mm, as long as at most {} melts beyond {} of the contour{reached}",
        *checks.outside, *checks.rim
    );
    let title = "section that the edge of the beam lets into the window at most";
    Some(Fact::new(
        "in-window-ceiling",
        title,
        Measure::exact(100.0 * share, "%"),
        &words,
    ))
}

/// The check of the window, which says so where it asks for more than the edge of the beam allows.
pub(super) fn below_its_ceiling(
    check: Check,
    plan: &Plan,
    path: &BeamPath,
    judged: &JudgedPath,
) -> Check {
    let found = of_judged(plan, path, &judged.runs[0].classes);
    let asked = match check.limit {
        Some(Limit::AtLeast(percent)) => 0.01 * percent,
        _ => return check,
    };
    let Some(Ceiling { share, spot, .. }) = found.filter(|c| c.share < asked) else {
        return check;
    };
    let more = "a narrower spot, a wider window, or a lower checks.in_window";
    let remedy = match check.remedy.as_deref() {
        Some(others) if !others.is_empty() => format!("{more}; {others}"),
        _ => more.to_owned(),
    };
    check
        .because(&format!(
            "the edge of a beam of {spot:.2} mm lets at most {:.1} % of this section into the window",
            100.0 * share
        ))
        .remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ebm::plan::region::Contour;

    /// Of a square of 2 mm the band beyond a rim of 0.1 mm with a hundredth of its area.
    #[test]
    fn what_may_melt_beyond_the_rim_is_laid_evenly_round() {
        let square = Contour::rectangle([2.0, 2.0]).region();
        let found = outward(&square, [0.1, 0.4], 0.01).unwrap();
        let beyond = |by: f64| 8.0 * by + std::f64::consts::PI * by * by;
        let share = (beyond(0.1 + found) - beyond(0.1)) / 4.0;
        assert!((share - 0.01).abs() < 3e-4, "{found} {share}");
        assert!(outward(&square, [0.1, 0.4], 0.0).unwrap() < 1e-5);
    }
}
