//! By which `near` a scan shows what its file tells of: a plate that is warped, or noisy, hides its beads from a small one, and low beads are hidden by a large one.

use meltpath_perception::beads::{Found, Look, beads, beads_and_corners};
use meltpath_perception::cloud::Cloud;
use meltpath_perception::plate::Plate;

use super::file::{NEAR, Scan};

/// What is tried, in `near` of the file: that which is nearest to it first.
const TRIED: [f64; 7] = [2.0, 3.0, 0.5, 4.0, 6.0, 0.25, 8.0];

/// What stands on a plate, of the kinds that the file tells of.
pub(super) fn seen(scan: &Scan, cloud: &Cloud, plate: &Plate, look: Look) -> Found {
    if scan.corners.is_empty() {
        beads(&cloud.points, plate, look)
    } else {
        beads_and_corners(&cloud.points, plate, look)
    }
}

/// Whether beads are those that the file tells of; any, where it tells of none.
fn told(scan: &Scan, found: &Found) -> bool {
    let told = [scan.beads.len(), scan.corners.len()];
    let seen = [found.beads.len(), found.corners.len()];
    seen == told || (told == [0, 0] && seen != [0, 0])
}

/// The `near` that shows the beads which the file tells of, in words, with how far the plate is from a plane; none where none of those tried does.
pub(super) fn remedy(scan: &Scan, cloud: &Cloud, plate: &Plate) -> Option<String> {
    // as it will be written
    let tried = TRIED.map(|by| (by * scan.near * 1e4).round() / 1e4);
    let allowed = tried.into_iter().filter(|near| NEAR.contains(near));
    let (near, better) = allowed
        .filter_map(|near| Some((near, Plate::of(&cloud.points, near)?)))
        .find(|(near, plate)| {
            let look = Look {
                near: *near,
                every: scan.every,
            };
            told(scan, &seen(scan, cloud, plate, look))
        })?;
    let why = if near > scan.near {
        format!(
            "the plate leaves a plane by more than {} mm (warp or noise: {:.2} mm root mean square with near = \"{near} mm\", {:.2} mm of what lies nearer than now)",
            scan.near, better.rms, plate.rms
        )
    } else {
        format!("beads are hardly higher than {} mm", scan.near)
    };
    Some(format!(
        "write near = \"{near} mm\", by which the scan shows what the file tells of: {why}"
    ))
}
