//! `meltpath compare`: a table of temperatures against a run, or against another table; a run's charts against its judge.

pub mod comparison;
pub mod error;
pub mod pairs;
pub mod quantity;
pub mod samples;

use std::path::{Path, PathBuf};

use meltpath_base::{Fact, Measure, Observer, Provenance, Reporter, Verdict};
use meltpath_thermal::calibration::comparison::{apart, relative};

use crate::ebm::judge::{TEMPERATURES_REFERENCE, VOXELS_REFERENCE};
use crate::outcome::RunFolder;
use crate::views;

pub use comparison::{Compared, Comparison};
pub use error::CompareError;
pub use samples::SamplesError;

/// Compares the samples of `table` with `against`, a run's folder or a table, and writes a folder. Without a table the charts of
/// the run are compared with the field that its judge left.
///
/// # Errors
/// [`CompareError`]; nothing is written then.
pub fn compare(
    against: &Path,
    table: Option<&Path>,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Comparison, CompareError> {
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
        crate::outcome::record_inputs(&mut provenance, &[file])?;
    }
    let parts = figures(&name, found.parts, &reporter)?;
    let verdict = Verdict {
        checks: Vec::new(),
        facts: parts.iter().flat_map(told).collect(),
        warnings: reporter.warnings(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let folder = home.create()?;
    let mut comparison = Comparison {
        cell: found.cell.unwrap_or_else(|| cell_of(&parts)),
        parts,
        name,
        against: found.against,
        folder: PathBuf::new(),
        verdict,
    };
    let report = views::compare::report(&comparison, &provenance);
    crate::outcome::tell(&folder, &report)?;
    views::compare::write_files(&folder, &comparison)?;
    comparison.folder = folder.commit()?;
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
        if part.unmet > 0 {
            reporter.warn(
                "places-unmet",
                format!(
                    "{} places of the {} of the other table have no counterpart in `{name}`, or none at their time: they are in no figure",
                    part.unmet,
                    part.quantity.words()
                ),
                "",
            );
        }
        match apart(&part.pairs) {
            Some(apart) => found.push(Compared {
                quantity: part.quantity,
                apart,
                away: distances(&part.away),
                pairs: part.pairs,
                layers: part.layers,
                left_out: part.left_out,
                unmet: part.unmet,
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

/// Mean and greatest.
fn distances(away: &[f64]) -> Option<[f64; 2]> {
    let greatest = away.iter().copied().reduce(f64::max)?;
    Some([away.iter().sum::<f64>() / away.len() as f64, greatest])
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
    if let Some([mean, greatest]) = part.away {
        let within = 1e3 * pairs::WITHIN;
        facts.push(Fact::new(
            &format!("pairs-apart{suffix}"),
            "mean distance between the two places of a pair",
            Measure::exact(1e3 * mean, "µm"),
            &format!(
                "{:.1} µm at most; the nearest place within {within:.0} µm is taken",
                1e3 * greatest
            ),
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
