//! Pairs of a comparison: samples of a table, and what a run or another table says there.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use meltpath_base::{Observer, Provenance, Reporter, settings};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::calibration::comparison::{Missing, Pair, Places};
use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::grid::sample::{Sample, around, between, nearest};

use super::error::CompareError;
use super::quantity::Quantity;
use super::samples::{self, Layers, Row, SamplesError, Told};
use crate::ebm::plan::path_file;
use crate::ebm::plan::{Plan, planned};
use crate::ebm::preview::charts::beam_settings;
use crate::ebm::settings::Settings;
use crate::ebm::simulate;
use crate::job::ebm::JudgeSolver;
use crate::job::{self, Job, JobError};

/// Samples further than this from every place of a table have no counterpart there, mm.
pub const WITHIN: f64 = 0.05;

/// Pairs of one quantity, and what had no counterpart.
#[derive(Debug)]
pub struct Paired {
    /// The quantity.
    pub quantity: Quantity,
    /// The pairs, in the order of the table.
    pub pairs: Vec<Pair>,
    /// Their layers.
    pub layers: Vec<usize>,
    /// How far the two places of each pair lie apart, mm; empty where the other is a field, which tells every place.
    pub away: Vec<f64>,
    /// Samples of the table.
    pub samples: usize,
    /// Those without a counterpart in place, and those without one in time.
    pub left_out: [usize; 2],
    /// Places of the other table without a counterpart in this one; none where it is a field.
    pub unmet: usize,
    /// What that means.
    pub words: [&'static str; 2],
}

/// Everything that was paired.
#[derive(Debug)]
pub struct Found {
    /// Quantity by quantity.
    pub parts: Vec<Paired>,
    /// What the table was compared with, in words.
    pub against: String,
    /// Edge of a cell of what it was compared with, mm.
    pub cell: Option<f64>,
}

/// The nearest places of another table.
pub(super) fn with_table(
    against: &Path,
    table: &Path,
    reporter: &Reporter,
) -> Result<Found, CompareError> {
    let wrong = |e: SamplesError| CompareError::from(e);
    // heights tell the layers of two tables apart
    let (other, ours) = (
        samples::of_any_layer(against, reporter).map_err(wrong)?,
        samples::of_any_layer(table, reporter).map_err(wrong)?,
    );
    let of = |rows: &[Row]| rows.iter().map(|r| r.sample).collect::<Vec<Sample>>();
    let mut parts = Vec::new();
    for (quantity, rows) in &ours {
        let Some((_, theirs)) = other.iter().find(|(q, _)| q == quantity) else {
            continue;
        };
        let places = Places::new(&of(theirs), WITHIN);
        let mut left_out = [0; 2];
        let (mut pairs, mut away) = (Vec::with_capacity(rows.len()), Vec::new());
        for sample in of(rows) {
            match places.at(sample.place, sample.time) {
                Ok(there) => {
                    away.push(there.away);
                    pairs.push(Pair {
                        sample,
                        other: there.value,
                    });
                }
                Err(Missing::Place) => left_out[0] += 1,
                Err(Missing::Time) => left_out[1] += 1,
            }
        }
        let own = Places::new(&of(rows), WITHIN);
        let theirs = of(theirs).into_iter();
        parts.push(Paired {
            unmet: theirs.filter(|s| own.at(s.place, s.time).is_err()).count(),
            quantity: *quantity,
            layers: vec![1; pairs.len()],
            away,
            pairs,
            samples: rows.len(),
            left_out,
            words: [
                "further than 0.05 mm from every place of the other table",
                "outside the times of the other table there",
            ],
        });
    }
    if parts.is_empty() {
        let told = |told: &Told| {
            let words = told.iter().map(|(q, _)| q.words());
            words.collect::<Vec<_>>().join(", the ")
        };
        return Err(CompareError::Apart {
            table: table.display().to_string(),
            ours: told(&ours),
            against: against.display().to_string(),
            theirs: told(&other),
        });
    }
    Ok(Found {
        parts,
        against: against.display().to_string(),
        cell: None,
    })
}

/// The job of a run, so that its field can be drawn again: its path and its charts lie in its folder.
fn plan_of(folder: &Path, observer: &dyn Observer) -> Result<Plan, CompareError> {
    let wrong = |what: String| CompareError::Run {
        path: folder.to_path_buf(),
        what,
    };
    let file = folder.join("job.toml");
    if !file.is_file() {
        return Err(wrong("it has no job.toml".to_owned()));
    }
    let (job, text) = job::load(&file)?;
    let Job::Ebm(job) = job else {
        return Err(wrong("its job is of another process".to_owned()));
    };
    let mut charts = Vec::new();
    for n in 1.. {
        let name = format!("charts/{n}.melt");
        if !folder.join(&name).is_file() {
            break;
        }
        charts.push(settings::File(name));
    }
    if !folder.join("path.csv").is_file() {
        return Err(wrong("it has no path.csv".to_owned()));
    }
    if charts.is_empty() {
        let path = folder.to_path_buf();
        return Err(CompareError::NoCharts { path });
    }
    let mut job = *job;
    let tables = &mut job.tables;
    if let Some(path) = &mut tables.path.value {
        "path.csv".clone_into(&mut path.0);
    }
    tables.charts.value.files.value = charts;
    // the field alone is drawn again
    tables.window.value.good.value = None;
    tables.window.value.body.value = None;
    tables.optimise.value = None;
    tables.correct.value = None;
    tables.judge.value.solver.value = JudgeSolver::None;
    let mut plan =
        planned(&job, folder, observer).map_err(|e| JobError::in_file(&file, &text, e))?;
    // of a job that hatches its region the last layer too is the one in the folder
    let unreadable = |e: &dyn std::fmt::Display| wrong(format!("its path.csv does not read: {e}"));
    let record = path_file::read(&folder.join("path.csv")).map_err(|e| unreadable(&e))?;
    let motion = record
        .motion(&plan.settings.focus)
        .map_err(|e| unreadable(&e))?;
    plan.path = BeamPath::of(&[motion]).map_err(|e| unreadable(&e))?;
    let drawn = plan.lower.iter().chain([&plan.path]);
    let spots: BTreeSet<u64> = beam_settings(drawn)
        .iter()
        .map(|s| s[1].to_bits())
        .collect();
    if spots.len() > plan.settings.chart_files.len() {
        let what = "its path changes the focus along the way, which charts do not draw; compare the tables in its folder `series`";
        return Err(wrong(what.to_owned()));
    }
    Ok(plan)
}

/// The samples of one layer, in order of time, and where they stand in the table.
struct OfLayer {
    in_time: Vec<(usize, Sample)>,
    /// Of what is known when the layer is drawn: quantity, row, sample.
    at_end: Vec<(Quantity, usize, Sample)>,
    /// When to look.
    times: Vec<f64>,
    /// How many of the times have been looked at, and how many samples in time met.
    seen: [usize; 2],
}

/// Pairs in the making: for each quantity the row of the table and the pair.
type Making = Vec<(Quantity, usize, Pair)>;

/// What charts say at the samples that are due, when they are looked at.
fn look(layer: &mut OfLayer, s: &ChartSimulation, found: &mut Making, left_out: &mut LeftOut) {
    let time = layer.times[layer.seen[0]];
    layer.seen[0] += 1;
    while let Some((n, sample)) = layer
        .in_time
        .get(layer.seen[1])
        .filter(|(_, s)| s.time <= time)
    {
        layer.seen[1] += 1;
        match around(s.grid(), sample.place) {
            Some(cells) => {
                let kelvin = |&([i, j, k], w): &([usize; 3], f64)| w * s.temperature_at(i, j, k);
                let pair = Pair {
                    sample: *sample,
                    other: cells.iter().map(kelvin).sum(),
                };
                found.push((Quantity::Temperature, *n, pair));
            }
            None => left_out.count(Quantity::Temperature, Missing::Place),
        }
    }
    if layer.seen[0] < layer.times.len() || layer.at_end.is_empty() {
        return;
    }
    // lines that lie beside each other freeze at quite other times: no straight line between cells
    let (highest, above, fell) = (s.highest_temperature(), s.time_above(), s.fell());
    for (quantity, n, sample) in &layer.at_end {
        let other = match quantity {
            Quantity::Temperature | Quantity::Highest => between(&highest, sample.place),
            Quantity::Molten => nearest(&above, sample.place),
            Quantity::Solidified => nearest(&fell, sample.place),
        };
        match other {
            Some(other) if other.is_finite() => found.push((
                *quantity,
                *n,
                Pair {
                    sample: *sample,
                    other,
                },
            )),
            Some(_) => left_out.count(*quantity, Missing::Time),
            None => left_out.count(*quantity, Missing::Place),
        }
    }
}

/// Samples without a counterpart.
#[derive(Default)]
struct LeftOut([[usize; 2]; Quantity::ALL.len()]);

impl LeftOut {
    fn count(&mut self, quantity: Quantity, missing: Missing) {
        self.0[quantity as usize][missing as usize] += 1;
    }
}

/// What the charts of a run say, drawn again.
pub(super) fn with_run(
    folder: &Path,
    tables: &[PathBuf],
    provenance: &mut Provenance,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Found, CompareError> {
    let plan = plan_of(folder, observer)?;
    let paths: Vec<&BeamPath> = plan.lower.iter().chain([&plan.path]).collect();
    let layers = Layers {
        count: paths.len(),
        thickness: plan.settings.job.ebm.layer.0,
    };
    let mut told = Told::new();
    for table in tables {
        for (quantity, rows) in
            samples::read(table, layers, reporter).map_err(CompareError::from)?
        {
            match told.iter_mut().find(|(q, _)| *q == quantity) {
                Some((_, all)) => all.extend(rows),
                None => told.push((quantity, rows)),
            }
        }
    }
    let mut left_out = LeftOut::default();
    let mut of_layers: Vec<OfLayer> = paths
        .iter()
        .enumerate()
        .map(|(n, path)| of_layer(&told, n + 1, path, &plan.settings, &mut left_out))
        .collect();
    let times: Vec<Vec<f64>> = of_layers.iter().map(|l| l.times.clone()).collect();
    let mut found = Making::new();
    let mut see = |layer: usize, s: &ChartSimulation| {
        look(&mut of_layers[layer], s, &mut found, &mut left_out);
    };
    simulate::look_at(&plan, &times, &mut see, reporter, observer)?;
    found.sort_by_key(|(quantity, n, _)| (*quantity, *n));
    provenance.model(
        "chart simulation",
        "drawn again from the run's job, path and charts; straight between the centres of voxels, at the nearest time step; times molten and of freezing of the nearest voxel",
    );
    let parts = told.iter().map(|(quantity, rows)| {
        let of = || found.iter().filter(|(q, _, _)| q == quantity);
        Paired {
            quantity: *quantity,
            layers: of().map(|(_, n, _)| rows[*n].layer).collect(),
            away: Vec::new(),
            pairs: of().map(|(_, _, pair)| *pair).collect(),
            samples: rows.len(),
            left_out: left_out.0[*quantity as usize],
            unmet: 0,
            words: [
                "outside the voxels of the run",
                if quantity.is_in_time() {
                    "before their layer's path begins or after it ends"
                } else {
                    "where the run's metal was not molten, or had not frozen when its path ended"
                },
            ],
        }
    });
    Ok(Found {
        parts: parts.collect(),
        against: format!("the run {}", folder.display()),
        cell: Some(plan.settings.job.simulation.voxel.0),
    })
}

/// What the tables tell of a layer whose path is `path`.
fn of_layer(
    told: &Told,
    layer: usize,
    path: &BeamPath,
    settings: &Settings,
    left_out: &mut LeftOut,
) -> OfLayer {
    let slack = 0.5 * settings.simulation.step;
    let mut of = OfLayer {
        in_time: Vec::new(),
        at_end: Vec::new(),
        times: Vec::new(),
        seen: [0; 2],
    };
    for (quantity, rows) in told {
        for (n, row) in rows.iter().enumerate().filter(|(_, r)| r.layer == layer) {
            let time = row.sample.time;
            if !quantity.is_in_time() {
                of.at_end.push((*quantity, n, row.sample));
            } else if time > path.begin() - slack && time < path.end() + slack {
                let sample = Sample {
                    time: time.min(path.end()),
                    ..row.sample
                };
                of.in_time.push((n, sample));
            } else {
                left_out.count(*quantity, Missing::Time);
            }
        }
    }
    of.in_time.sort_by(|a, b| a.1.time.total_cmp(&b.1.time));
    of.times = of.in_time.iter().map(|(_, s)| s.time).collect();
    if !of.at_end.is_empty() {
        of.times.push(path.end());
    }
    of.times.dedup();
    of
}
