//! `meltpath measure`: sizes of beads from a scan, and a process map of them.

mod file;
pub mod found;
mod judge;
pub mod map;

use std::path::{Path, PathBuf};

use meltpath_base::output::OutputFolder;
use meltpath_base::{Observer, Provenance, Reporter, Verdict};
use meltpath_deposition::capillary::Capillary;
use meltpath_geometry::math::DVec3;
use meltpath_perception::beads::{Bead, Look, Section, beads};
use meltpath_perception::cloud::{Cloud, CloudError};
use meltpath_perception::plate::Plate;

use crate::cancel::{Stop, stops};
use crate::outcome::RunFolder;
use crate::views;

pub use file::{Scan, ScanFile, Setting};
pub use found::{Found, Mean, Measured};

meltpath_base::passes_on! {
    /// Why nothing was measured.
    pub enum MeasureError {
        /// What stops any command.
        Stop(Stop),
        /// The scan.
        Cloud(CloudError);

        /// Points that span no plane.
        #[error("`{scan}` has {points} points and no plate among them: scan the plate beside the beads, too")]
        Plate {
            /// The scan.
            scan: String,
            /// How many points it has.
            points: usize,
        },
        /// A plate without beads.
        #[error("no straight bead was found on the plate of `{scan}`: {above} points lie higher than `near`{told}; a bead is three times as long as wide, and 10 mm")]
        NoBead {
            /// The scan.
            scan: String,
            /// Points above the plate.
            above: usize,
            /// What was seen instead.
            told: String,
        },
        /// More or fewer beads than settings.
        #[error("the file tells of {told} beads and `{scan}` shows {found}: {places}; write one [[bead]] for each, or cut the scan")]
        Count {
            /// The scan.
            scan: String,
            /// Beads of the file.
            told: usize,
            /// Beads of the scan.
            found: usize,
            /// Where they lie.
            places: String,
        },
    }
}

stops!(MeasureError);

/// Measures the beads of a scan and writes a folder.
///
/// # Errors
/// [`MeasureError`]; nothing is written then.
pub fn measure(
    path: &Path,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Found, MeasureError> {
    let reporter = Reporter::new();
    let mut provenance = Provenance::new();
    let scan = file::read(path)?;
    let source = path.parent().unwrap_or(Path::new("")).join(&scan.name);
    observer.stage("read scan", 0);
    let mut cloud = Cloud::read(&source)?;
    crate::outcome::record_inputs(&mut provenance, &[path, &source])?;
    for p in &mut cloud.points {
        *p *= scan.unit;
    }
    observer.check()?;
    observer.stage("find beads", 0);
    let plate = Plate::of(&cloud.points, scan.near).ok_or_else(|| MeasureError::Plate {
        scan: scan.name.clone(),
        points: cloud.points.len(),
    })?;
    let beads = found(&scan, &cloud, &plate, &reporter)?;
    observer.check()?;
    judge::warn(&beads, &cloud, &plate, &reporter);
    let checks = judge::checks(&scan, &beads);
    let map = match map::of(&scan, &beads, &checks) {
        Ok(map) => Some(map),
        Err(why) => {
            let told = format!("no process map is written: {}", why.told);
            reporter.warn("no-map", told, why.remedy);
            None
        }
    };
    provenance.model(
        "plate",
        "random samples of three points (Fischler and Bolles 1981), then least squares; levelled beside each section",
    );
    provenance.model(
        "sections",
        "a parabola of least squares across the bead, areas by sums of trapezia between means of the points (after the thesis on wire-arc deposition, § 2.2.2)",
    );
    provenance.model(
        "contact angles",
        "the section of liquid at rest of each bead's width and height (Rouchon 2022, section 2.1.3)",
    );
    let mut all = Found {
        verdict: Verdict {
            checks,
            facts: judge::facts(&beads, &cloud, &plate),
            warnings: reporter.warnings(),
        },
        scan,
        plate,
        points: cloud.points.len(),
        beads,
        map,
        folder: PathBuf::new(),
    };
    observer.stage("write results", 0);
    observer.check()?;
    let report = views::measure::report(&path.display().to_string(), &all, &provenance);
    let files = |folder: &OutputFolder| views::measure::write_files(folder, &all);
    all.folder = crate::outcome::leave(home, &report, files)?;
    Ok(all)
}

/// The beads of a scan with their settings.
fn found(
    scan: &Scan,
    cloud: &Cloud,
    plate: &Plate,
    reporter: &Reporter,
) -> Result<Vec<Measured>, MeasureError> {
    let look = Look {
        near: scan.near,
        every: scan.every,
    };
    let seen = beads(&cloud.points, plate, look);
    let place = |p: DVec3| format!("x {:.1}, y {:.1}, z {:.1} mm", p.x, p.y, p.z);
    let refused = seen.refused.iter();
    let refused: Vec<String> = refused
        .map(|(p, why)| format!("at {}: {why}", place(*p)))
        .collect();
    if seen.beads.is_empty() {
        let above = |p: &&DVec3| plate.local(**p).z > scan.near;
        return Err(MeasureError::NoBead {
            scan: scan.name.clone(),
            above: cloud.points.iter().filter(above).count(),
            told: [String::new()]
                .into_iter()
                .chain(refused)
                .collect::<Vec<_>>()
                .join("; "),
        });
    }
    for message in refused {
        reporter.warn(
            "not-measured",
            message,
            "straight beads with the plate beside them are measured",
        );
    }
    if seen.spatter > 0 {
        let message = format!(
            "{} points above the plate belong to nothing as long as a bead",
            seen.spatter
        );
        reporter.warn(
            "spatter",
            message,
            "look whether a bead is cut short: spatter and clamps are left out",
        );
    }
    if !scan.beads.is_empty() && scan.beads.len() != seen.beads.len() {
        let places: Vec<String> = seen.beads.iter().map(|b| place(b.middle)).collect();
        return Err(MeasureError::Count {
            scan: scan.name.clone(),
            told: scan.beads.len(),
            found: seen.beads.len(),
            places: places.join("; "),
        });
    }
    let measured = |(k, bead): (usize, Bead)| {
        let setting = scan.beads.get(k).copied();
        let fed = |s: &Setting| Some(scan.wire.as_ref()?.section() * s.feed() / s.travel_speed);
        let [width, height] =
            [|s: &Section| s.width, |s: &Section| s.height].map(|of| mean(&bead.sections, of));
        Measured {
            width,
            height,
            at_rest: Capillary::of_size(scan.capillary_length, width[0], height[0]),
            area: mean(&bead.sections, |s| s.area),
            fed: setting.as_ref().and_then(fed),
            setting,
            bead,
        }
    };
    Ok(seen.beads.into_iter().enumerate().map(measured).collect())
}

fn mean(sections: &[Section], of: impl Fn(&Section) -> f64) -> Mean {
    let n = sections.len() as f64;
    let mean = sections.iter().map(&of).sum::<f64>() / n;
    let squares: f64 = sections.iter().map(|s| (of(s) - mean).powi(2)).sum();
    [mean, (squares / (n - 1.0).max(1.0)).sqrt()]
}
