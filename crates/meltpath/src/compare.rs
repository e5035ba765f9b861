//! `meltpath compare`: a table of temperatures against a run, or against another table.

pub mod present;
pub mod samples;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Check, Measure, Observer, Provenance, Reporter, Verdict};
use meltpath_report::html::{ReportError, write_html};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::comparison::{Apart, Missing, Pair, Places, Sample, apart, around};
use toml::Spanned;

use crate::ebm::run::part_copy;
use crate::ebm::settings::{Settings, resolve};
use crate::ebm::{EbmError, simulate};
use crate::job::ebm::WindowTable;
use crate::job::{self, EbmJob, Job, JobError};
use crate::outcome::RunError;

use samples::Layers;
pub use samples::SamplesError;

/// Why nothing could be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A table.
    #[error(transparent)]
    Samples(#[from] SamplesError),
    /// A folder that is no run of an electron beam.
    #[error(
        "{} is no run of an electron beam: {what}; give the folder that `meltpath run` wrote, or a table",
        .path.display()
    )]
    Run {
        /// The folder.
        path: PathBuf,
        /// What is missing.
        what: String,
    },
    /// No sample has a counterpart.
    #[error(
        "none of the {samples} samples of `{table}` can be compared: {places} lie {place_words}, {times} are {time_words}"
    )]
    Nothing {
        /// The table.
        table: String,
        /// Its samples.
        samples: usize,
        /// Without a counterpart in place.
        places: usize,
        /// What that means.
        place_words: &'static str,
        /// Without one in time.
        times: usize,
        /// What that means.
        time_words: &'static str,
    },
}

/// What a comparison found.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The figures.
    pub apart: Apart,
    /// The pairs, in the order of the table.
    pub pairs: Vec<Pair>,
    /// The layer of each pair, from 1; 1 against a table.
    pub layers: Vec<usize>,
    /// Samples left out for their place and for their time.
    pub left_out: [usize; 2],
    /// What the table was compared with, in words.
    pub against: String,
    /// Edge of a cell of the map, mm.
    pub cell: f64,
    /// Where it was written.
    pub folder: PathBuf,
    /// Notes.
    pub verdict: Verdict,
}

/// Samples further than this from every place of a table have no counterpart there, mm.
pub const WITHIN: f64 = 0.05;

/// Compares the samples of `table` with `against`, a run's folder or a table, and writes a folder.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn compare(
    against: &Path,
    table: &Path,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Comparison, RunError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let found = if against.is_dir() {
        with_run(against, table, &mut provenance, &reporter, observer)?
    } else {
        with_table(against, table, &reporter)?
    };
    for file in [table, against].into_iter().filter(|f| f.is_file()) {
        crate::ebm::run::record(&mut provenance, file)?;
    }
    let name = table.display().to_string();
    let (place_words, time_words) = found.words;
    let figures = apart(&found.pairs).ok_or(CompareError::Nothing {
        table: name.clone(),
        samples: found.samples,
        places: found.left_out[0],
        place_words,
        times: found.left_out[1],
        time_words,
    })?;
    for (count, words) in found.left_out.into_iter().zip([place_words, time_words]) {
        if count > 0 {
            reporter.warn(
                "samples-left-out",
                format!(
                    "{count} of {} samples of `{name}` are {words}: left out",
                    found.samples
                ),
                "",
            );
        }
    }
    let check = Check {
        value: Some(Measure::new(figures.bias, figures.deviation, "K")),
        ..Check::not_checked(
            "difference",
            &format!(
                "mean difference of {} samples, table less other",
                figures.pairs
            ),
            "told, not judged: how much is too much depends on the use",
        )
    };
    let verdict = Verdict {
        checks: vec![check],
        warnings: reporter.warnings(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let folder = out.map_or_else(|| OutputFolder::create_numbered(runs), OutputFolder::create)?;
    let mut comparison = Comparison {
        apart: figures,
        pairs: found.pairs,
        layers: found.layers,
        left_out: found.left_out,
        against: found.against,
        cell: found.cell,
        folder: PathBuf::new(),
        verdict,
    };
    let report = present::report(&name, &comparison, &provenance);
    folder.write("report.html", |w| {
        write_html(w, &report).map_err(|e| match e {
            ReportError::Io(e) => e,
            ReportError::Scene(e) => std::io::Error::other(e),
        })
    })?;
    present::write_files(&folder, &comparison)?;
    let written: Result<_, OutputError> = folder.commit();
    comparison.folder = written?;
    Ok(comparison)
}

/// Pairs, and what had no counterpart.
struct Paired {
    pairs: Vec<Pair>,
    layers: Vec<usize>,
    samples: usize,
    left_out: [usize; 2],
    words: (&'static str, &'static str),
    against: String,
    cell: f64,
}

fn with_table(against: &Path, table: &Path, reporter: &Reporter) -> Result<Paired, RunError> {
    let told = |e: SamplesError| CompareError::from(e);
    // heights tell the layers of two tables apart
    let (other, ours) = (
        samples::of_any_layer(against, reporter).map_err(told)?,
        samples::of_any_layer(table, reporter).map_err(told)?,
    );
    let places = Places::new(&other, WITHIN);
    let mut left_out = [0; 2];
    let mut pairs = Vec::with_capacity(ours.len());
    for sample in &ours {
        match places.at(sample.place, sample.time) {
            Ok(kelvin) => pairs.push(Pair {
                sample: *sample,
                other: kelvin,
            }),
            Err(Missing::Place) => left_out[0] += 1,
            Err(Missing::Time) => left_out[1] += 1,
        }
    }
    Ok(Paired {
        cell: cell_of(&pairs),
        layers: vec![1; pairs.len()],
        pairs,
        samples: ours.len(),
        left_out,
        words: (
            "further than 0.05 mm from every place of the other table",
            "outside the times of the other table there",
        ),
        against: against.display().to_string(),
    })
}

/// Edge of a map's cell for places without a grid: eighty across, mm.
fn cell_of(pairs: &[Pair]) -> f64 {
    let extent = [0, 1]
        .map(|axis| {
            let ends = pairs
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |e, p| {
                    let v = p.sample.place[axis];
                    [e[0].min(v), e[1].max(v)]
                });
            ends[1] - ends[0]
        })
        .into_iter()
        .fold(0.0, f64::max);
    if extent > 0.0 { extent / 80.0 } else { 0.05 }
}

/// The job of a run, so that its field can be drawn again: its path and its charts lie in its folder.
fn settings_of(folder: &Path, observer: &dyn Observer) -> Result<Settings, RunError> {
    let wrong = |what: String| CompareError::Run {
        path: folder.to_path_buf(),
        what,
    };
    let file = folder.join("job.toml");
    if !file.is_file() {
        return Err(wrong("it has no job.toml".to_owned()).into());
    }
    let (job, text) = job::load(&file)?;
    let Job::Ebm(job) = job else {
        return Err(wrong("its job is of another process".to_owned()).into());
    };
    let spanned = |name: String| Spanned::new(0..0, name);
    let mut charts = Vec::new();
    for n in 1.. {
        let name = format!("charts/{n}.melt");
        if !folder.join(&name).is_file() {
            break;
        }
        charts.push(spanned(name));
    }
    if !folder.join("path.csv").is_file() || charts.is_empty() {
        return Err(wrong("it has no path.csv or no charts".to_owned()).into());
    }
    let job = EbmJob {
        path: job.path.map(|_| spanned("path.csv".to_owned())),
        part: job.part.map(|p| spanned(part_copy(Path::new(p.get_ref())))),
        charts: crate::job::ebm::ChartsTable {
            files: charts,
            ..job.charts
        },
        window: WindowTable::default(),
        optimise: None,
        judge: None,
        ..*job
    };
    let mut settings = resolve(&job, folder, observer).map_err(|e| {
        RunError::Job(JobError::Text {
            path: file,
            text,
            span: None,
            message: e.message,
            help: e.help,
        })
    })?;
    // of a job that hatches its region the last layer too is the one in the folder
    let path = File::open(folder.join("path.csv"))
        .map_err(|e| e.to_string())
        .and_then(|f| BeamPath::from_csv(BufReader::new(f)).map_err(|e| e.to_string()));
    settings.path = path.map_err(|e| wrong(format!("its path.csv does not read: {e}")))?;
    Ok(settings)
}

fn with_run(
    folder: &Path,
    table: &Path,
    provenance: &mut Provenance,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Paired, RunError> {
    let settings = settings_of(folder, observer)?;
    let paths: Vec<&BeamPath> = settings.lower.iter().chain([&settings.path]).collect();
    let layers = Layers {
        count: paths.len(),
        thickness: settings.layer,
    };
    let rows = samples::read(table, layers, reporter).map_err(CompareError::from)?;
    let slack = 0.5 * settings.simulation.step;
    let mut left_out = [0; 2];
    let mut of_layer: Vec<Vec<(usize, Sample)>> = vec![Vec::new(); paths.len()];
    for (n, row) in rows.iter().enumerate() {
        let path = paths[row.layer - 1];
        let time = row.sample.time;
        if time > path.begin() - slack && time < path.end() + slack {
            let sample = Sample {
                time: time.min(path.end()),
                ..row.sample
            };
            of_layer[row.layer - 1].push((n, sample));
        } else {
            left_out[1] += 1;
        }
    }
    let mut times = Vec::with_capacity(paths.len());
    for samples in &mut of_layer {
        samples.sort_by(|a, b| a.1.time.total_cmp(&b.1.time));
        let mut own: Vec<f64> = samples.iter().map(|(_, s)| s.time).collect();
        own.dedup();
        times.push(own);
    }
    let mut seen = vec![[0; 2]; paths.len()];
    let mut found: Vec<(usize, Pair)> = Vec::with_capacity(rows.len());
    let mut look = |layer: usize, s: &meltpath_thermal::chart_simulation::ChartSimulation| {
        let [group, next] = &mut seen[layer];
        let time = times[layer][*group];
        *group += 1;
        while let Some((n, sample)) = of_layer[layer].get(*next).filter(|(_, s)| s.time <= time) {
            *next += 1;
            match around(s.grid(), sample.place) {
                Some(cells) => found.push((
                    *n,
                    Pair {
                        sample: *sample,
                        other: cells
                            .iter()
                            .map(|&([i, j, k], w)| w * s.temperature_at(i, j, k))
                            .sum(),
                    },
                )),
                None => left_out[0] += 1,
            }
        }
    };
    simulate::look_at(&settings, &times, &mut look, reporter, observer).map_err(EbmError::told)?;
    found.sort_by_key(|(n, _)| *n);
    provenance.model(
        "chart simulation",
        "drawn again from the run's job, path and charts; straight between the centres of voxels, at the nearest time step",
    );
    Ok(Paired {
        layers: found.iter().map(|(n, _)| rows[*n].layer).collect(),
        samples: rows.len(),
        pairs: found.into_iter().map(|(_, p)| p).collect(),
        left_out,
        words: (
            "outside the voxels of the run",
            "before their layer's path begins or after it ends",
        ),
        against: format!("the run {}", folder.display()),
        cell: settings.voxel,
    })
}
