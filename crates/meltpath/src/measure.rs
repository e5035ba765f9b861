//! `meltpath measure`: sizes of beads from a scan, and a process map of them.

mod corner;
mod file;
pub mod found;
mod judge;
pub mod map;
mod near;

use std::path::{Path, PathBuf};

use meltpath_base::output::OutputFolder;
use meltpath_base::{Observer, Place, Provenance, Reporter, Verdict};
use meltpath_deposition::capillary::Capillary;
use meltpath_geometry::math::DVec3;
use meltpath_perception::beads::{self, Bead, Look, Section};
use meltpath_perception::cloud::{Cloud, CloudError};
use meltpath_perception::plate::Plate;

use crate::cancel::{Stop, stops};
use crate::outcome::RunFolder;
use crate::views;

pub use corner::{deviation, relief};
pub use file::CornerSetting;
pub use file::{Scan, ScanFile, Setting, read as read_file};
pub use found::{Found, Mean, Measured, MeasuredCorner};

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
        #[error("no straight bead{other} was found on the plate of `{scan}`: {above} points lie higher than `near`{told}; {remedy}")]
        NoBead {
            /// The scan.
            scan: String,
            /// What else was looked for.
            other: &'static str,
            /// Points above the plate.
            above: usize,
            /// What was seen instead.
            told: String,
            /// What to do.
            remedy: String,
        },
        /// More or fewer beads than settings.
        #[error("the file tells of {told} beads{kind} and `{scan}` shows {found}: {places}; {remedy}")]
        Count {
            /// The scan.
            scan: String,
            /// What beads they are.
            kind: &'static str,
            /// Beads of the file.
            told: usize,
            /// Beads of the scan.
            found: usize,
            /// Where they lie.
            places: String,
            /// What to do.
            remedy: String,
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
    let (beads, cornered) = found(&scan, &cloud, &plate, &reporter)?;
    observer.check()?;
    judge::warn(&beads, &cloud, &plate, &reporter);
    let mut checks = judge::checks(&scan, &beads);
    // corners alone are no attempt at a map
    let map = match map::of(&scan, &beads, &checks) {
        Ok(map) => Some(map),
        Err(_) if beads.is_empty() => None,
        Err(why) => {
            let told = format!("no process map is written: {}", why.told);
            reporter.warn("no-map", told, why.remedy);
            None
        }
    };
    observer.stage("corners", cornered.len() as u64);
    let mut corners = Vec::new();
    for (corner, told) in cornered.iter().zip(scan.corners.iter().cloned()) {
        observer.check()?;
        corners.push(corner::of(corner, told, &scan));
        observer.advance(1);
    }
    checks.extend(corner::judge::checks(&corners, judge::metal(&scan)));
    let pursuit = pursuit_of(&scan, &corners, &reporter);
    if !corners.is_empty() {
        corner_models(&scan, &mut provenance);
    }
    provenance.model(
        "plate",
        "random samples of three points (Fischler and Bolles 1981), then least squares; levelled beside each section",
    );
    provenance.model(
        "sections",
        "widths where flanks meet the plate, each carried on from its lowest 60 % as a quadratic of height for the square of the distance; heights by a parabola through the middle 30 %; areas by sums of trapezia between means of the points; the parabola of least squares (the thesis on wire-arc deposition, § 2.2.2) tells the form",
    );
    provenance.model(
        "contact angles",
        "the section of liquid at rest of each bead's width and height (Rouchon 2022, section 2.1.3)",
    );
    let mut all = Found {
        verdict: Verdict {
            checks,
            facts: judge::facts(beads.len(), corners.len(), &cloud, &plate),
            warnings: reporter.warnings(),
        },
        scan,
        plate,
        points: cloud.points.len(),
        beads,
        corners,
        pursuit,
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

/// The file of pursuit lengths that corners make; says why where they make none.
fn pursuit_of(scan: &Scan, corners: &[MeasuredCorner], reporter: &Reporter) -> Option<String> {
    if corners.is_empty() {
        return None;
    }
    for c in corners {
        if let Err(why) = corner::judge::usable(c) {
            reporter.warn_at(
                "corner-left-out",
                format!("no pursuit length is taken from {why}"),
                Place::at(c.place.to_array()),
                "look at its plot and at the checks",
            );
        }
    }
    match corner::law::of(scan, corners) {
        Ok(law) => Some(law),
        Err((told, remedy)) => {
            let told = format!("no pursuit lengths are written: {told}");
            reporter.warn("no-pursuit", told, remedy);
            None
        }
    }
}

/// What corners are measured with.
fn corner_models(scan: &Scan, provenance: &mut Provenance) {
    provenance.model(
        "crests",
        "where a quadratic of least squares around each place is highest across its strongest bend (Rouchon 2022, section 3.3.2, the rigorous definition)",
    );
    provenance.model(
        "pursuit length",
        "least squares of the crest's distances from the pursuit curve of a follower that is never pushed back, golden section, place and direction of the path fitted along (Rouchon 2022, eq. 3.4 and 3.5)",
    );
    provenance.model(
        "volumes of a corner",
        "20 mm before and behind the corner, by definition (Rouchon 2022, section 3.4.3); lacunar and redundant volume by the first moments of the mean section",
    );
    provenance.model(
        "deposit compared with",
        &format!(
            "that of jobs, levelled, with the mean section of the straight parts and the weld pool of {} scaled to it",
            scan.pools_of
        ),
    );
}

/// The beads of a scan, straight ones with their settings and those with a corner.
fn found(
    scan: &Scan,
    cloud: &Cloud,
    plate: &Plate,
    reporter: &Reporter,
) -> Result<(Vec<Measured>, Vec<beads::Corner>), MeasureError> {
    let look = Look {
        near: scan.near,
        every: scan.every,
    };
    let seen = near::seen(scan, cloud, plate, look);
    let place = |p: DVec3| format!("x {:.1}, y {:.1}, z {:.1} mm", p.x, p.y, p.z);
    let refused = seen.refused.iter();
    let refused: Vec<String> = refused
        .map(|(p, why)| format!("at {}: {why}", place(*p)))
        .collect();
    if seen.beads.is_empty() && seen.corners.is_empty() {
        let above = |p: &&DVec3| plate.local(**p).z > scan.near;
        return Err(MeasureError::NoBead {
            scan: scan.name.clone(),
            other: if scan.corners.is_empty() {
                ""
            } else {
                " and none with a corner"
            },
            above: cloud.points.iter().filter(above).count(),
            told: [String::new()]
                .into_iter()
                .chain(refused)
                .collect::<Vec<_>>()
                .join("; "),
            remedy: near::remedy(scan, cloud, plate)
                .unwrap_or_else(|| "a bead is three times as long as wide, and 10 mm".to_owned()),
        });
    }
    for message in refused {
        reporter.warn(
            "not-measured",
            message,
            "straight beads with the plate beside them are measured, and beads with one corner where the file tells it (corner)",
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
    counted(scan, cloud, plate, &seen)?;
    let measured = |(k, bead): (usize, Bead)| {
        let setting = scan.beads.get(k).copied();
        let fed = |s: &Setting| Some(scan.wire.as_ref()?.section() * s.feed() / s.travel_speed);
        let [width, height] =
            [|s: &Section| s.width, |s: &Section| s.height].map(|of| mean(&bead.sections, of));
        Measured {
            width,
            width_sigma: bead.width()[1],
            height,
            at_rest: Capillary::of_size(scan.capillary_length, width[0], height[0]),
            area: mean(&bead.sections, |s| s.area),
            fed: setting.as_ref().and_then(fed),
            setting,
            bead,
        }
    };
    let straight = seen.beads.into_iter().enumerate().map(measured);
    Ok((straight.collect(), seen.corners))
}

/// As many beads of each kind as the file tells of, where it tells of any.
fn counted(
    scan: &Scan,
    cloud: &Cloud,
    plate: &Plate,
    seen: &beads::Found,
) -> Result<(), MeasureError> {
    let place = |p: DVec3| format!("x {:.1}, y {:.1}, z {:.1} mm", p.x, p.y, p.z);
    let any = !(scan.beads.is_empty() && scan.corners.is_empty());
    let straight: Vec<String> = seen.beads.iter().map(|b| place(b.middle)).collect();
    let turn = |c: &beads::Corner| {
        let degrees = c.turn().to_degrees();
        format!("{} ({degrees:.0}°)", place(c.place))
    };
    let corners: Vec<String> = seen.corners.iter().map(turn).collect();
    let refused = seen
        .refused
        .iter()
        .map(|(p, why)| format!("at {}: {why}", place(*p)));
    let refused: Vec<String> = refused.collect();
    let plain = if scan.corners.is_empty() {
        ""
    } else {
        " without a corner"
    };
    for (kind, told, places) in [
        (plain, scan.beads.len(), straight),
        (" with a corner", scan.corners.len(), corners),
    ] {
        if any && told != places.len() {
            let mut listed = places.clone();
            listed.extend(refused.iter().map(|why| format!("refused {why}")));
            return Err(MeasureError::Count {
                scan: scan.name.clone(),
                kind,
                told,
                found: places.len(),
                places: if listed.is_empty() {
                    "none".to_owned()
                } else {
                    listed.join("; ")
                },
                remedy: near::remedy(scan, cloud, plate)
                    .unwrap_or_else(|| "write one [[bead]] for each, or cut the scan".to_owned()),
            });
        }
    }
    Ok(())
}

fn mean(sections: &[Section], of: impl Fn(&Section) -> f64) -> Mean {
    let n = sections.len() as f64;
    let mean = sections.iter().map(&of).sum::<f64>() / n;
    let squares: f64 = sections.iter().map(|s| (of(s) - mean).powi(2)).sum();
    [mean, (squares / (n - 1.0).max(1.0)).sqrt()]
}
