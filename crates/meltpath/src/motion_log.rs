//! `meltpath measure` of a log of the tool: filter times and dwells of a controller, for the `[motion]` of its cell.

mod error;
pub mod file;
pub mod found;
mod judge;
mod path;
mod samples;
mod table;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use meltpath_base::output::OutputFolder;
use meltpath_base::{Observer, Provenance, Reporter, Verdict};
use meltpath_robot::identification::fit::IdentificationError;
use meltpath_robot::identification::misfit::Owned;
use meltpath_robot::identification::{align, corners, events, identify};

use crate::outcome::RunFolder;
use crate::records::has_key;
use crate::views;

pub use error::MotionLogError;
pub use file::{MotionLogFile, read as read_file};
pub use found::Found;
pub use path::Driven;

/// Whether a file tells of a log of the tool.
///
/// A file that does not read is none: what reads scans tells what is wrong.
pub fn is_of_motion(path: &Path) -> bool {
    let text = crate::job::text_of(path).unwrap_or_default();
    has_key(&text, "log") && !has_key(&text, "scan")
}

/// Share of the corners of each smoothing that are fitted; the rest is foretold.
const FITTED: f64 = 2.0 / 3.0;
/// Fewest corners of a smoothing of which some are held back.
const LEAST: usize = 3;

/// Reads a log and the path that was driven, and writes a folder.
///
/// # Errors
/// [`MotionLogError`]; nothing is written then.
pub fn motion_log(
    file: &Path,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Found, MotionLogError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let told = file::read(file)?;
    let source = told.folder.join(&told.file.log.0);
    observer.stage("read log and path", 0);
    let driven = path::of(&told, &reporter)?;
    let log = samples::read(&told, &source)?;
    let mut inputs = vec![file, &source];
    inputs.extend(driven.files.iter().map(PathBuf::as_path));
    crate::outcome::record_inputs(&mut provenance, &inputs)?;
    observer.check()?;
    observer.stage("lay the log on the path", 0);
    let name = source.display().to_string();
    let freedom = told.file.frame.freedom();
    let aligned = align(&log, &driven.path, freedom).map_err(|why| MotionLogError::Align {
        file: name.clone(),
        why,
    })?;
    let owned = corners(&log, &driven.path, &aligned);
    let held = held_back(&owned);
    let parts: Vec<Range<usize>> = owned
        .iter()
        .filter(|o| held.contains(&o.command))
        .map(|o| o.samples.clone())
        .collect();
    let used = |i: usize| !parts.iter().any(|p| p.contains(&i));
    observer.check()?;
    observer.stage("fit filters and dwells", 0);
    let fitted = identify(&log, &driven.path, &aligned, freedom, &used, observer);
    let fitted = fitted.map_err(|why| match why {
        IdentificationError::Cancelled(cancelled) => MotionLogError::from(cancelled),
        why => MotionLogError::Fit { file: name, why },
    })?;
    let compared = events(&log, &driven.path, &aligned, &fitted)?;
    let mut found = Found {
        filters: fitted.filters(),
        told,
        driven,
        log,
        aligned,
        fitted,
        compared,
        held,
        verdict: Verdict::default(),
        motion: None,
        folder: PathBuf::new(),
    };
    let checks = judge::checks(&found);
    match table::of(&found, &checks) {
        Ok(text) => found.motion = Some(text),
        Err(why) => reporter.warn(
            "no-motion",
            format!("no motion.toml is written: {why}"),
            "mend what the check tells; without [motion] the checks of the metal \"cannot say\", which is right for this controller until then",
        ),
    }
    judge::warn(&found, &reporter);
    found.verdict = Verdict {
        facts: judge::facts(&found),
        checks,
        warnings: reporter.warnings(),
    };
    models(&mut provenance);
    observer.stage("write results", 0);
    observer.check()?;
    let report = views::motion_log::report(&file.display().to_string(), &found, &provenance);
    let files = |folder: &OutputFolder| views::motion_log::write_files(folder, &found);
    found.folder = crate::outcome::leave(home, &report, files)?;
    Ok(found)
}

/// The last third of the corners of each smoothing, by their commands: these are foretold.
fn held_back(owned: &[Owned]) -> BTreeSet<usize> {
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for corner in owned {
        let group = groups.entry(corner.smoothing).or_default();
        group.push(corner.command);
    }
    let mut held = BTreeSet::new();
    for group in groups.values().filter(|g| g.len() >= LEAST) {
        let fitted = (FITTED * group.len() as f64).round() as usize;
        held.extend(group.iter().skip(fitted));
    }
    held
}

fn models(provenance: &mut Provenance) {
    provenance.model(
        "robot motion",
        "Rouchon 2022, § 3.3.1: two moving averages with a dwell at corners, as jobs drive it",
    );
    provenance.model(
        "identification",
        "least squares over all samples of the log but those of corners that are held back (Gauss and Newton's steps), of the sum of the filters, the square of their difference, the dwell of each smoothing, the begin of each stretch and the frame of the log",
    );
    provenance.model(
        "frame of the log",
        "rigid motion of least squares by unit quaternions (Horn 1987)",
    );
    provenance.model(
        "deviations",
        "covariance of least squares from what is left, raised by what neighbouring samples have in common (ours)",
    );
}
