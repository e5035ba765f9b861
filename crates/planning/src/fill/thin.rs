//! Sections about one bead wide: one bead on their centre line. The rest of a region is its body.

use meltpath_geometry::Region;
use meltpath_geometry::boolean::{PlanarError, difference};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::medial::{MedialError, medial_axis};
use meltpath_geometry::offset::{inset, outset};
use meltpath_geometry::section::simplified;

use crate::fill::bend::with_corners;
use crate::fill::chain::{Chain, End, Skeleton, joined, outward};
use crate::fill::outline::{Room, clearance, contains, length, ray, without_start};
use crate::fill::settings::{FillSettings, end_distance};

/// Chains that turn by less run on through a junction, rad (75°): walls of a honeycomb meet at 60°.
pub(crate) const LARGEST_TURN: f64 = 1.309;

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
    let cores = inset(whole, single, join)?;
    let roomy = |rest: Vec<Region>| -> Result<Vec<Region>, PlanarError> {
        let mut kept = Vec::new();
        for piece in rest {
            let room = inset(
                std::slice::from_ref(&piece),
                narrowest.min(0.9 * single),
                join,
            )?;
            if !room.is_empty() {
                kept.push(piece);
            }
        }
        Ok(kept)
    };
    let opened = |cores: &[Region]| outset(cores, single + 1e-3 * width, join);
    if roomy(difference(whole, &opened(&cores)?)?)?.is_empty() {
        return Ok(Split {
            bodies: vec![region.clone()],
            ..Split::default()
        });
    }
    // arcs of an offset in fewer chords, half as far off as a centre line's moves may be: a diagram costs by the chord
    let coarse = simplified(region, 0.5 * settings.facet());
    let skeleton = match medial_axis(&coarse, width / 16.0) {
        Ok(axis) => Skeleton::new(axis),
        Err(trouble) => {
            return Ok(Split {
                bodies: vec![region.clone()],
                lines: Vec::new(),
                trouble: Some(trouble),
            });
        }
    };
    // spots that are wide only where walls meet belong to the walls, if a wall's bead runs through them
    let mut kept = Vec::new();
    let mut spots = Vec::new();
    for core in cores {
        if is_spot(&core, settings)? {
            spots.push(core);
        } else {
            kept.push(core);
        }
    }
    loop {
        let wide_area = Room::new(&outset(&kept, 1e-3 * width, join)?);
        let chains = skeleton.chains(narrowest, single, &|p| wide_area.contains(p));
        let chains = joined(chains, 0.5 * width, LARGEST_TURN);
        let lines: Vec<Vec<DVec2>> = chains
            .iter()
            .map(|chain| centre_line(chain, region, narrowest, settings))
            .filter(|line| length(line) + 1e-9 >= settings.shortest_bead.min(2.0 * stepover))
            .collect();
        let before = kept.len();
        for spot in std::mem::take(&mut spots) {
            let near = outset(std::slice::from_ref(&spot), 0.5 * width, join)?;
            if lines.iter().flatten().any(|&p| contains(&near, p)) {
                spots.push(spot);
            } else {
                kept.push(spot);
            }
        }
        if kept.len() > before {
            continue;
        }
        let mut thin = Vec::new();
        for piece in roomy(difference(whole, &opened(&kept)?)?)? {
            let here = std::slice::from_ref(&piece);
            if lines.iter().flatten().any(|&p| contains(here, p)) {
                thin.push(piece);
            }
        }
        let bodies = if thin.is_empty() {
            vec![region.clone()]
        } else {
            difference(whole, &outset(&thin, 2e-3 * width, join)?)?
        };
        let mut roomy_bodies = Vec::new();
        for body in bodies {
            if !inset(std::slice::from_ref(&body), 0.5 * width, join)?.is_empty() {
                roomy_bodies.push(body);
            }
        }
        return Ok(Split {
            bodies: roomy_bodies,
            lines,
            trouble: None,
        });
    }
}

/// Whether a part of the region in which two beads have room side by side is small enough to be passed by one.
fn is_spot(core: &Region, settings: &FillSettings) -> Result<bool, PlanarError> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for &p in &core.outer {
        (low, high) = (low.min(p), high.max(p));
    }
    let deeper = inset(
        std::slice::from_ref(core),
        0.25 * settings.stepover,
        settings.join(),
    )?;
    Ok(low.distance(high) < 1.5 * settings.width && deeper.is_empty())
}

/// The bead on a chain: from half a width before the section's end, half a stepover before another bead.
fn centre_line(
    chain: &Chain,
    region: &Region,
    narrowest: f64,
    settings: &FillSettings,
) -> Vec<DVec2> {
    let (width, stepover) = (settings.width, settings.stepover);
    let line: Vec<DVec2> = chain.nodes.iter().map(|n| n.position).collect();
    let mut line = with_corners(&line, region, settings);
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
            End::Dead => match ray(region, tip, direction) {
                None => 0.0,
                Some(room) if room < 0.5 * width => 0.5 * width - room,
                Some(room) => {
                    let way = direction * (room - 0.5 * width).min(width);
                    -roomy_way(region, tip, way, narrowest)
                }
            },
        };
        // the last point on the first turn, the first one on the second
        line.reverse();
        line = moved_start(&line, cut, direction);
    }
    line
}

/// How far along `way` the section beside it stays wide enough for a bead, mm: a section may end askew.
fn roomy_way(region: &Region, tip: DVec2, way: DVec2, narrowest: f64) -> f64 {
    const STEPS: u32 = 16;
    let roomy = (1..=STEPS)
        .take_while(|&i| {
            clearance(region, tip + way * (f64::from(i) / f64::from(STEPS))) >= narrowest
        })
        .count();
    way.length() * roomy as f64 / f64::from(STEPS)
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
