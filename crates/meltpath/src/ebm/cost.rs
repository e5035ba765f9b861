//! What a job will cost, told before it starts: voxels, memory, time of computing.

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::simulation::Memory;

use super::correct::Correct;
use super::error::EbmError;
use super::plan::{Plan, Window};
use super::settings::{Judge, Settings};
use crate::ebm::preview::charts::{Source, sources};
use crate::job::ebm::ChartPreview;

/// Bytes of memory for each voxel, results included; measured on sections of 1 260 and 12 600 mm².
const PER_VOXEL: f64 = 54.0;
/// Bytes for each value of the pictures that a page carries, and how many values it carries at most.
const PER_PICTURED: f64 = 22.0;
/// See `PER_PICTURED`.
const PICTURED: f64 = 12e6;
/// Bytes of everything else.
const REST: f64 = 20e6;
/// Voxels heated in a second by one core; measured.
const HEATED: f64 = 5e7;
/// Memory beyond which a job is refused, bytes.
const MOST: f64 = 64e9;
/// Time of computing the charts of one setting at 25 µm, s of one core; measured, 1.2 s at 270 W and 2.6 s at 108 W.
const CHARTS: f64 = 3.0;

/// Time of computing of the judge's finest run for a second of the path, s of one core, on cells of `JUDGED_CELL` mm: 36 s on a
/// square of 10 mm, 38 s in the mean of 25 m. With `OTHERS` it gives the 137 s that the triangle of the examples took.
const JUDGED: f64 = 37.0;
/// See `JUDGED`.
const JUDGED_CELL: f64 = 0.031_25;
/// Time of computing of all runs of the judge for what lies between two layers, s of one core, on cells of `JUDGED_CELL` mm. An
/// estimate.
const RESTED: f64 = 15.0;
/// What all other runs of the judge take beside the finest one: nine, on cells twice as large. An estimate.
const OTHERS: f64 = 1.5;

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
    let depth = DVec3::new(0.0, 0.0, 3.5 * settings.job.ebm.penetration.0);
    [low - margin - depth, high + margin]
}

fn time(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{:.0} s", seconds.max(1.0))
    } else {
        format!("{:.0} min", seconds / 60.0)
    }
}

/// What drawing with charts will cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Extent of the voxels, mm.
    pub extent: [f64; 2],
    /// Voxels.
    pub voxels: f64,
    /// Bytes of memory.
    pub bytes: f64,
    /// Seconds of one core.
    pub seconds: f64,
}

impl Cost {
    /// Of the drawings that a job needs, without those of optimisers and judges.
    ///
    /// # Errors
    /// [`EbmError::Large`] beyond 64 GB.
    pub(super) fn of(plan: &Plan) -> Result<Self, EbmError> {
        let settings = &plan.settings;
        let own = plan.lower.iter().chain([&plan.path]);
        let [low, high] = extent(settings, own);
        let size = high - low;
        let columns = (size.x / settings.job.simulation.voxel.0).ceil()
            * (size.y / settings.job.simulation.voxel.0).ceil();
        let planes = (size.z / settings.job.ebm.layer.0 - 1e-6).ceil();
        let step = settings.simulation.step;
        let mut updates = 0.0;
        for path in plan.drawn() {
            for w in path.points().windows(2).filter(|w| w[0].is_on()) {
                let radius = 0.7 * w[0].spot;
                let area = std::f64::consts::PI * radius * radius;
                let heated = area / settings.job.simulation.voxel.0.powi(2) * planes;
                updates += heated * (w[1].time - w[0].time) / step;
            }
        }
        let remembering = settings.simulation.memory != Memory::None;
        let voxels = columns * planes;
        let pictured = (columns * f64::from(*settings.job.simulation.frames)).min(PICTURED);
        // an optimiser starts again and again from what it keeps
        let copies = if settings.optimise.is_some() {
            2.0
        } else {
            1.0
        };
        let cost = Cost {
            extent: [size.x, size.y],
            voxels,
            bytes: REST + PER_PICTURED * pictured + copies * PER_VOXEL * voxels,
            seconds: updates / HEATED * if remembering { 2.0 } else { 1.0 },
        };
        if cost.bytes > MOST {
            return Err(EbmError::Large {
                extent: cost.extent,
                gigabytes: 1e-9 * cost.bytes,
                most: 1e-9 * MOST,
            });
        }
        Ok(cost)
    }

    /// In words.
    pub fn words(&self) -> String {
        let [width, depth] = self.extent;
        let memory = if self.bytes < 1e9 {
            format!("{:.0} MB", (1e-6 * self.bytes).max(1.0))
        } else {
            format!("{:.1} GB", 1e-9 * self.bytes)
        };
        let time = time(self.seconds);
        format!(
            "{:.2} million voxels over {width:.1} x {depth:.1} mm: about {memory} of memory and {time} of one core to draw them once",
            1e-6 * self.voxels
        )
    }
}

/// Where the charts come from and what drawing costs, a line each, for `meltpath doctor`.
///
/// # Errors
/// What a run would refuse before it computes.
pub(super) fn lines(plan: &Plan, reporter: &Reporter) -> Result<Vec<String>, EbmError> {
    let settings = &plan.settings;
    let mut lines = match *settings.job.charts.preview {
        ChartPreview::Drawn => charts(plan, reporter)?,
        ChartPreview::None => Vec::new(),
    };
    if let Some(judge) = &settings.judge {
        let seconds = judged(plan, judge);
        lines.push(format!(
            "cost of the judge: about {} of one core",
            time(seconds)
        ));
        if let Some(correct) = &settings.correct {
            let seconds = corrected(plan, judge, correct);
            lines.push(format!(
                "cost of the corrections: about {} of one core",
                time(seconds)
            ));
        }
    }
    Ok(lines)
}

/// The lines of the charts.
fn charts(plan: &Plan, reporter: &Reporter) -> Result<Vec<String>, EbmError> {
    let (settings, cost) = (&plan.settings, Cost::of(plan)?);
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
                let seconds = CHARTS * grounds * (0.025 / s.cell).powi(5);
                (
                    *s,
                    format!(
                        "computed by the run, about {:.0} s of one core",
                        seconds.max(1.0)
                    ),
                )
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

/// How much longer a second of the path takes on the cells of the judge than on those that were measured.
fn finer(judge: &Judge) -> f64 {
    let resolution = &judge.resolution;
    (JUDGED_CELL / resolution.cell).powi(4) * f64::from(resolution.planes).powi(2)
}

/// Seconds of one core that the rounds of `[correct]` take, each drawn once more than there are corrections.
fn corrected(plan: &Plan, judge: &Judge, correct: &Correct) -> f64 {
    let drawn = plan.path.end() - plan.path.begin();
    let drawings = |rounds: u32| match rounds {
        0 => 0.0,
        some => f64::from(some) + 1.0,
    };
    let [coarse, finest] = correct.rounds.map(drawings);
    JUDGED * finer(judge) * drawn * (coarse * OTHERS / 9.0 + finest)
}

/// Seconds of one core that the judge takes: as asked, and with all that moves it, for the path and the good body.
fn judged(plan: &Plan, judge: &Judge) -> f64 {
    let drawn: f64 = plan.drawn().iter().map(|p| p.end() - p.begin()).sum();
    let finer = finer(judge);
    // a path that gives way to a better one is drawn once as asked, too
    let changed = plan.settings.optimise.is_some() || plan.settings.correct.is_some();
    let given = if changed {
        plan.path.end() - plan.path.begin()
    } else {
        0.0
    };
    JUDGED * finer * (drawn * (1.0 + OTHERS) + given) + rested(plan, judge)
}

/// Seconds of one core that layers take to cool on each other, those of a good body too.
fn rested(plan: &Plan, judge: &Judge) -> f64 {
    if judge.between.is_none() {
        return 0.0;
    }
    let paths = match plan.window {
        Window::Fixed(_) => 1,
        Window::Good { .. } => 2,
    };
    let cells = (JUDGED_CELL / judge.resolution.cell).powi(2);
    RESTED * cells * (paths * plan.lower.len()) as f64
}
