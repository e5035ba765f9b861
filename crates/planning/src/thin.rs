//! Sections about one bead wide: one bead on their centre line. The rest of a region is its body.

use meltpath_geometry::Region;
use meltpath_geometry::boolean::{PlanarError, difference};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::medial::{MedialError, medial_axis};
use meltpath_geometry::offset::{inset, outset};

use crate::chain::{Chain, End, Skeleton, joined, outward};
use crate::outline::{contains, length, ray, without_start};
use crate::settings::{FillSettings, end_distance};

/// Chains that turn by less run on through a junction, rad (75°): walls of a honeycomb meet at 60°.
const LARGEST_TURN: f64 = 1.309;

/// A region taken apart.
#[derive(Default)]
pub(crate) struct Split {
    /// What takes two beads or more side by side.
    pub(crate) bodies: Vec<Region>,
    /// Centre lines of the sections that take one; a closed one repeats its first point.
    pub(crate) lines: Vec<Vec<DVec2>>,
    /// Why the centre lines are missing, where they are.
    pub(crate) trouble: Option<MedialError>,
}

/// Takes `region` apart. Sections narrower than twice `narrowest` get nothing.
pub(crate) fn split(
    region: &Region,
    narrowest: f64,
    settings: &FillSettings,
) -> Result<Split, PlanarError> {
    let (width, stepover) = (settings.width, settings.stepover);
    let (single, join) = (settings.single_radius(), settings.join());
    let whole = std::slice::from_ref(region);
    let open = outset(&inset(whole, single, join)?, single + 1e-3 * width, join)?;
    let narrow = difference(whole, &open)?;
    let mut roomy = Vec::new();
    for piece in narrow {
        if !inset(
            std::slice::from_ref(&piece),
            narrowest.min(0.9 * single),
            join,
        )?
        .is_empty()
        {
            roomy.push(piece);
        }
    }
    if roomy.is_empty() {
        return Ok(Split {
            bodies: vec![region.clone()],
            ..Split::default()
        });
    }
    let skeleton = match medial_axis(region, width / 16.0) {
        Ok(axis) => Skeleton::new(axis),
        Err(trouble) => {
            return Ok(Split {
                bodies: vec![region.clone()],
                lines: Vec::new(),
                trouble: Some(trouble),
            });
        }
    };
    let mut chains = skeleton.chains(narrowest, single);
    chains.retain(|c| c.ends.contains(&End::Junction) || c.length() > 0.25 * width);
    let chains = joined(chains, 0.5 * width, LARGEST_TURN);
    let mut lines = Vec::new();
    let mut taken = vec![false; roomy.len()];
    for chain in &chains {
        let line = centre_line(chain, region, settings);
        if length(&line) + 1e-9 < settings.shortest_bead.min(2.0 * stepover) {
            continue;
        }
        for (piece, taken) in roomy.iter().zip(&mut taken) {
            *taken |= line
                .iter()
                .any(|&p| contains(std::slice::from_ref(piece), p));
        }
        lines.push(line);
    }
    let thin: Vec<Region> = roomy
        .into_iter()
        .zip(taken)
        .filter_map(|(piece, taken)| taken.then_some(piece))
        .collect();
    let bodies = if thin.is_empty() {
        vec![region.clone()]
    } else {
        difference(whole, &outset(&thin, 2e-3 * width, join)?)?
    };
    Ok(Split {
        bodies,
        lines,
        trouble: None,
    })
}

/// The bead on a chain: from half a width before the section's end, half a stepover before another bead.
fn centre_line(chain: &Chain, region: &Region, settings: &FillSettings) -> Vec<DVec2> {
    let (width, stepover) = (settings.width, settings.stepover);
    let mut line: Vec<DVec2> = chain.nodes.iter().map(|n| n.position).collect();
    if chain.is_closed() {
        return line;
    }
    for end in [1, 0] {
        let (tip, direction) = outward(chain, end, 0.25 * width);
        let cut = match chain.ends[end] {
            // the bead of the wide part runs a quarter of a stepover beyond the axis' point of that radius
            End::Wide => end_distance(stepover) + 0.25 * stepover,
            End::Junction => end_distance(stepover),
            End::Narrow => 0.0,
            End::Dead => {
                ray(region, tip, direction).map_or(0.0, |room| (0.5 * width - room).max(-width))
            }
        };
        // the last point on the first turn, the first one on the second
        line.reverse();
        line = moved_start(&line, cut, direction);
    }
    line
}

/// The line with its first point cut back by `cut`, or moved on along `direction` where that is negative.
fn moved_start(line: &[DVec2], cut: f64, direction: DVec2) -> Vec<DVec2> {
    if cut >= 0.0 {
        // never more than leaves a third of the bead
        return without_start(line, cut.min(length(line) / 3.0));
    }
    let mut longer = vec![line[0] - direction * cut];
    longer.extend_from_slice(line);
    longer
}
