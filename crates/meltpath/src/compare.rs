//! `meltpath compare`: a table of temperatures against a run, or against another table; a run's charts against its judge.

pub mod pairs;
pub mod present;
pub mod quantity;
pub mod samples;

use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Fact, Measure, Observer, Provenance, Reporter, Verdict};
use meltpath_report::html::{ReportError, write_html};
use meltpath_thermal::calibration::comparison::{Apart, Pair, apart, relative};

use crate::ebm::present_voxels::{TEMPERATURES_REFERENCE, VOXELS_REFERENCE};
use crate::outcome::RunError;

use quantity::Quantity;
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
    /// A run without a judge, and no table.
    #[error(
        "{} has nothing to compare its charts with: no {VOXELS_REFERENCE}; run its job with [judge] solver = \"reference\", or give a table",
        .path.display()
    )]
    NoJudge {
        /// The folder.
        path: PathBuf,
    },
    /// Two tables that tell different things.
    #[error("`{table}` tells the {ours}, `{against}` the {theirs}: nothing is told by both")]
    Apart {
        /// The table.
        table: String,
        /// What it tells.
        ours: String,
        /// The other one.
        against: String,
        /// What that tells.
        theirs: String,
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

/// How far apart two tellings of one quantity are.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The quantity.
    pub quantity: Quantity,
    /// The figures.
    pub apart: Apart,
    /// The pairs, in the order of the table.
    pub pairs: Vec<Pair>,
    /// The layer of each pair, from 1; 1 against a table.
    pub layers: Vec<usize>,
    /// Samples left out for their place, and for their time or because the other tells nothing there.
    pub left_out: [usize; 2],
}

/// What a comparison found.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Each quantity that was compared, one at least.
    pub parts: Vec<Compared>,
    /// What was compared, in words.
    pub name: String,
    /// What it was compared with, in words.
    pub against: String,
    /// Edge of a cell of the map, mm.
    pub cell: f64,
    /// Where it was written.
    pub folder: PathBuf,
    /// Notes.
    pub verdict: Verdict,
}

/// Compares the samples of `table` with `against`, a run's folder or a table, and writes a folder. Without a table the charts of
/// the run are compared with the field that its judge left.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn compare(
    against: &Path,
    table: Option<&Path>,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Comparison, RunError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let (name, tables) = match table {
        Some(table) => (table.display().to_string(), vec![table.to_path_buf()]),
        None => ("the reference solver".to_owned(), judged(against)?),
    };
    let found = match table {
        Some(table) if !against.is_dir() => pairs::with_table(against, table, &reporter)?,
        _ => pairs::with_run(against, &tables, &mut provenance, &reporter, observer)?,
    };
    let against_file = [against.to_path_buf()];
    for file in tables.iter().chain(&against_file).filter(|f| f.is_file()) {
        crate::ebm::run::record(&mut provenance, file)?;
    }
    let parts = figures(&name, found.parts, &reporter)?;
    let verdict = Verdict {
        checks: Vec::new(),
        facts: parts.iter().flat_map(told).collect(),
        warnings: reporter.warnings(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let folder = out.map_or_else(|| OutputFolder::create_numbered(runs), OutputFolder::create)?;
    let mut comparison = Comparison {
        cell: found.cell.unwrap_or_else(|| cell_of(&parts)),
        parts,
        name,
        against: found.against,
        folder: PathBuf::new(),
        verdict,
    };
    let report = present::report(&comparison, &provenance);
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

/// The tables that the judge of a run left.
fn judged(run: &Path) -> Result<Vec<PathBuf>, CompareError> {
    let found: Vec<PathBuf> = [TEMPERATURES_REFERENCE, VOXELS_REFERENCE]
        .iter()
        .map(|name| run.join(name))
        .filter(|file| file.is_file())
        .collect();
    if found.is_empty() {
        let path = run.to_path_buf();
        return Err(if path.join("job.toml").is_file() {
            CompareError::NoJudge { path }
        } else {
            CompareError::Run {
                path,
                what: "it has no job.toml".to_owned(),
            }
        });
    }
    Ok(found)
}

/// The figures of each quantity; one without a pair is left out and told where another has some.
fn figures(
    name: &str,
    parts: Vec<pairs::Paired>,
    reporter: &Reporter,
) -> Result<Vec<Compared>, CompareError> {
    let mut found = Vec::new();
    let mut nothing = None;
    for part in parts {
        let [place_words, time_words] = part.words;
        for (count, words) in part.left_out.into_iter().zip(part.words) {
            if count > 0 {
                reporter.warn(
                    "samples-left-out",
                    format!(
                        "{count} of {} samples of the {} of `{name}` are {words}: left out",
                        part.samples,
                        part.quantity.words()
                    ),
                    "",
                );
            }
        }
        match apart(&part.pairs) {
            Some(apart) => found.push(Compared {
                quantity: part.quantity,
                apart,
                pairs: part.pairs,
                layers: part.layers,
                left_out: part.left_out,
            }),
            None => {
                nothing.get_or_insert(CompareError::Nothing {
                    table: name.to_owned(),
                    samples: part.samples,
                    places: part.left_out[0],
                    place_words,
                    times: part.left_out[1],
                    time_words,
                });
            }
        }
    }
    match (nothing, found.is_empty()) {
        (Some(nothing), true) => Err(nothing),
        _ => Ok(found),
    }
}

/// The differences of one quantity: how much is too much depends on the use, so that nothing is judged.
fn told(part: &Compared) -> Vec<Fact> {
    let (shown, suffix) = (part.quantity.shown(), part.quantity.suffix());
    let of = |value: f64, sigma: Option<f64>| Measure {
        value: shown.difference(value),
        sigma: sigma.map(|s| shown.difference(s)),
        unit: shown.difference.to_owned(),
    };
    let title = format!("mean difference of the {}", part.quantity.words());
    let samples = format!("{} samples, table less other", part.apart.pairs);
    let mut facts = vec![Fact::new(
        &format!("difference{suffix}"),
        &title,
        of(part.apart.bias, Some(part.apart.deviation)),
        &samples,
    )];
    if part.quantity.is_in_time() {
        facts.push(Fact::new(
            &format!("difference-without-sign{suffix}"),
            "mean difference without sign",
            of(part.apart.mean, None),
            &format!("{:.2} % of the temperature", 100.0 * relative(&part.pairs)),
        ));
        facts.push(Fact::new(
            &format!("difference-95{suffix}"),
            "difference that 95 % stay below",
            of(part.apart.percentiles[2], None),
            "",
        ));
    }
    facts
}

/// Edge of a map's cell for places without a grid: eighty across, mm.
fn cell_of(parts: &[Compared]) -> f64 {
    let pairs = || parts.iter().flat_map(|p| &p.pairs);
    let extent = [0, 1]
        .map(|axis| {
            let ends = pairs().fold([f64::INFINITY, f64::NEG_INFINITY], |e, p| {
                let v = p.sample.place[axis];
                [e[0].min(v), e[1].max(v)]
            });
            ends[1] - ends[0]
        })
        .into_iter()
        .fold(0.0, f64::max);
    if extent > 0.0 { extent / 80.0 } else { 0.05 }
}
