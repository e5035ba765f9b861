//! What a job will cost, told before it starts: voxels, memory, time of computing.

pub(in crate::ebm) mod before_hatching;
pub(crate) mod charts;
mod judged;
pub(crate) mod lever;
pub(in crate::ebm) mod refused;
mod room;
mod voxels;
pub(crate) mod words;

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::simulation::Memory;

use super::error::EbmError;
use super::plan::Plan;
use super::settings::Settings;
use crate::ebm::optimise::Optimise;
use crate::ebm::preview::charts::{Source, sources};
use crate::job::ebm::{Change, ChartPreview, EbmJob, OptimiseSolver};
use crate::machine::Machine;
use voxels::{Cost, depth, planes};
use words::{memory, time};

/// What a search on the judge's solver may take without being asked for, s of one core: an hour, the rest of which two cores halve.
const AFFORDABLE: f64 = 3600.0;
/// Voxels heated in a second by one core; measured.
const HEATED: f64 = 5e7;

/// Lowest and highest corner of the voxels round paths, mm.
pub(super) fn extent<'a>(
    settings: &Settings,
    paths: impl Iterator<Item = &'a BeamPath>,
) -> [DVec3; 2] {
    let mut low = DVec3::new(f64::INFINITY, f64::INFINITY, 0.0);
    let mut high = DVec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0);
    for p in paths.flat_map(BeamPath::points) {
        low = low.min(DVec3::new(p.x, p.y, 0.0));
        high = high.max(DVec3::new(p.x, p.y, 0.0));
    }
    let margin = DVec3::new(
        settings.job.simulation.margin.0,
        settings.job.simulation.margin.0,
        0.0,
    );
    let depth = DVec3::new(0.0, 0.0, depth(settings));
    [low - margin - depth, high + margin]
}

/// Of the drawings that a job needs, without those of optimisers and judges.
pub(super) fn drawing(plan: &Plan) -> Cost {
    let settings = &plan.settings;
    let own = plan.lower.iter().chain([&plan.path]);
    let [low, high] = extent(settings, own);
    let planes = planes(settings);
    let (voxel, step) = (settings.job.simulation.voxel.0, settings.simulation.step);
    let mut updates = 0.0;
    for path in plan.drawn() {
        for w in path.points().windows(2).filter(|w| w[0].is_on()) {
            let radius = 0.7 * w[0].spot;
            let area = std::f64::consts::PI * radius * radius;
            let heated = area / voxel.powi(2) * planes;
            updates += heated * (w[1].time - w[0].time) / step;
        }
    }
    let remembering = settings.simulation.memory != Memory::None;
    Cost {
        seconds: updates / HEATED * if remembering { 2.0 } else { 1.0 },
        ..Cost::of_extent(settings, [high.x - low.x, high.y - low.y])
    }
}

/// Where the charts come from and what drawing costs, a line each, for `meltpath doctor`.
///
/// # Errors
/// What a run would refuse before it computes.
pub(super) fn lines(plan: &Plan, reporter: &Reporter) -> Result<Vec<String>, EbmError> {
    let settings = &plan.settings;
    let mut lines = match settings.preview {
        ChartPreview::Drawn => of_charts(plan, reporter)?,
        ChartPreview::None => Vec::new(),
    };
    if let Some(judge) = &settings.judge {
        let seconds = judged::judged(plan, judge);
        lines.push(format!(
            "cost of the judge: about {} of one core and {} of memory",
            time(seconds),
            memory(judged::memory(plan, judge, Machine::here().cores))
        ));
        if let Some(how) = searching(plan) {
            let seconds = judged::searched(plan, judge, how);
            lines.push(format!(
                "cost of the search on the judge's coarse cells: about {} of one core",
                time(seconds)
            ));
        }
        if let Some(correct) = &settings.correct {
            let seconds = judged::corrected(plan, judge, correct);
            lines.push(format!(
                "cost of the corrections: about {} of one core",
                time(seconds)
            ));
        }
    }
    Ok(lines)
}

/// The search, where it is on the judge's solver.
pub(in crate::ebm::cost) fn searching(plan: &Plan) -> Option<&Optimise> {
    let how = plan.settings.optimise.as_ref();
    how.filter(|how| how.solver == OptimiseSolver::Judge)
}

/// Looks for a path on charts where the job does not say on what, and the judge's solver would take too long.
pub(in crate::ebm) fn settle_search(plan: &mut Plan, job: &EbmJob, reporter: &Reporter) {
    let (Some(how), Some(judge)) = (searching(plan), &plan.settings.judge) else {
        return;
    };
    let seconds = judged::searched(plan, judge, how);
    let solver_alone =
        matches!(how.change, Change::Current | Change::Focus) || how.robust.is_some();
    let Some(table) = job.optimise.as_ref() else {
        return;
    };
    let written = table.solver.is_written() || *job.charts.preview == Some(ChartPreview::None);
    if seconds <= AFFORDABLE || solver_alone || written {
        return;
    }
    reporter.warn(
        "search-on-charts",
        format!(
            "the path is looked for on charts, inside the contour: on the judge's solver, over the whole section, that would take about {} of one core",
            time(seconds)
        ),
        "optimise.solver = \"judge\" takes the time; \"charts\" says that this is meant; fewer orders, strategies or rounds, or larger cells (judge.cell) take less",
    );
    let settings = &mut plan.settings;
    for key in [
        &table.solver.name,
        &table.rounds.name,
        &table.piece.name,
        &job.charts.preview.name,
    ] {
        settings.provenance.parameters.remove(key);
    }
    let hatch = settings.subject.hatch().cloned();
    let charts = OptimiseSolver::Charts;
    settings.optimise = Some(Optimise::resolve(
        table,
        hatch.as_ref(),
        charts,
        &mut settings.provenance,
    ));
    settings.preview = job
        .charts
        .preview
        .or_computed(&mut settings.provenance, ChartPreview::Drawn);
}

/// The lines of the charts.
fn of_charts(plan: &Plan, reporter: &Reporter) -> Result<Vec<String>, EbmError> {
    let (settings, cost) = (&plan.settings, drawing(plan));
    let mut lines = Vec::new();
    for source in sources(settings, &plan.drawn(), reporter)?.own {
        let (s, from) = match source {
            Source::File(path, set) => (set.settings, path.display().to_string()),
            Source::Between([a, b], set) => {
                let from = format!("between {} and {}", a.display(), b.display());
                (set.settings, from)
            }
            Source::Computed(s) => {
                let grounds = match settings.simulation.memory {
                    Memory::None => 1.0,
                    Memory::Ground(_) => 4.0,
                };
                let seconds = charts::cost(&s, grounds).seconds;
                let seconds = time(seconds);
                let from = format!("computed by the run, about {seconds} of one core");
                (*s, from)
            }
        };
        lines.push(format!(
            "charts of {:.1} W on {:.1} µm: {from}",
            s.power,
            1e3 * s.spot
        ));
    }
    lines.push(format!("cost: {}", cost.words()));
    Ok(lines)
}
