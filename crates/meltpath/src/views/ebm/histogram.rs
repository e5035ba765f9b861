//! Histograms of the highest temperatures with the window, before and after the path was changed.

use meltpath_geometry::math::DVec2;
use meltpath_report::plot::{Bar, Mark, Plot};
use meltpath_thermal::criteria::{Classes, histogram};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::CELSIUS;

use crate::ebm::judge::Judged;
use crate::ebm::plan::Plan;

/// Width of a bar, K.
const BIN: f64 = 20.0;

/// Shares of the voxels of the last layer that are kept, by temperature.
fn bars(highest: &Field, plan: &Plan, kept: impl Fn([f64; 2]) -> bool) -> Vec<Bar> {
    let top = highest.grid.planes() - 1;
    let judged = |[i, j, k]: [usize; 3]| {
        let c = highest.grid.centre(i, j, k);
        let point = [c.x, c.y];
        k == top && kept(point)
    };
    let found = histogram(highest, BIN, judged);
    let all: usize = found.iter().map(|b| b.1).sum();
    found
        .into_iter()
        .filter(|(from, _)| *from > plan.settings.material.solidus - 200.0)
        .map(|(from, count)| Bar {
            from: from - CELSIUS,
            to: from + BIN - CELSIUS,
            value: 100.0 * count as f64 / (all as f64).max(1.0),
        })
        .collect()
}

/// The outline of bars, as a line.
fn stairs(bars: &[Bar]) -> Vec<DVec2> {
    let mut points = Vec::new();
    let mut last: Option<f64> = None;
    for bar in bars {
        // bars without voxels are left out
        if last.is_none_or(|to| bar.from > to + 1e-6) {
            points.extend(last.map(|to| DVec2::new(to, 0.0)));
            points.push(DVec2::new(bar.from, 0.0));
        }
        points.push(DVec2::new(bar.from, bar.value));
        points.push(DVec2::new(bar.to, bar.value));
        last = Some(bar.to);
    }
    points.extend(last.map(|to| DVec2::new(to, 0.0)));
    points
}

fn drawn(title: &str, before: Vec<Bar>, after: Option<Vec<Bar>>, classes: &Classes) -> Plot {
    let [low, high] = classes.window.map(|k| k - CELSIUS);
    let tallest = before.iter().chain(after.iter().flatten());
    let tallest = tallest.map(|b| b.value).fold(1.0, f64::max);
    let outline = [[low, 0.0], [high, 0.0], [high, tallest], [low, tallest]];
    let plot = Plot::new(title, ["highest temperature", "°C"], ["voxels", "%"]).with(Mark::Area {
        name: format!("window, {low:.0} to {high:.0} °C"),
        outline: outline.map(DVec2::from_array).to_vec(),
    });
    let plot = match after {
        Some(after) => plot
            .bars("better path", after)
            .line("as given", stairs(&before)),
        None => plot.bars("as given", before),
    };
    plot.caption("Voxels of the last layer inside the contour.")
}

/// Of the path as given and of the better one, where there is one.
pub(super) fn plot(
    title: &str,
    given: &Field,
    better: Option<&Field>,
    classes: &Classes,
    plan: &Plan,
) -> Plot {
    let of = |field: &Field| {
        bars(field, plan, |p| {
            plan.contour.depth(p) > plan.settings.job.region.inside.0
        })
    };
    drawn(title, of(given), better.map(of), classes)
}

/// Of the section, or the part of it, that the reference solver judged.
pub(super) fn judged(judged: &Judged, plan: &Plan) -> Plot {
    let part = plan.settings.judge.as_ref().and_then(|j| j.part.as_ref());
    let of = |field: &Field| {
        bars(field, plan, |point| {
            plan.contour.depth(point) > 0.0 && part.is_none_or(|p| p.depth(point) > 0.0)
        })
    };
    let better = judged.better.as_ref().map(|b| of(&b.highest));
    drawn(
        "Highest temperatures on the reference solver",
        of(&judged.given.highest),
        better,
        &judged.classes,
    )
}
