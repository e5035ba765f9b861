//! Nested contours of a body: successive insets with their family tree, the centre lines of what gets too narrow on
//! the way, and the inside that is left after a number of levels.

use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::medial::medial_axis;
use meltpath_geometry::offset::{Join, inset};
use meltpath_geometry::{Region, Ring};

use crate::fill::chain::Skeleton;
use crate::fill::outline::{edges, nearest_share};
use crate::fill::settings::FillSettings;
use crate::fill::spacing;
use crate::fill::thin::split;

/// A contour.
pub(crate) struct Contour {
    /// The centre line, the region on its left.
    pub(crate) ring: Ring,
    /// The contour outside it that it follows.
    pub(crate) parent: Option<usize>,
}

/// The contours of a body.
#[derive(Default)]
pub(crate) struct Nest {
    /// From outside inwards, parents before children.
    pub(crate) contours: Vec<Contour>,
    /// Centre lines of sections that get too narrow for a contour on the way in.
    pub(crate) lines: Vec<Vec<DVec2>>,
    /// What is left inside the last level: the regions still to cover.
    pub(crate) rest: Vec<Region>,
}

/// Re-entrant corners of the next contour stay corners up to a right angle: rounded ever wider they leave the corner of the contours inside
/// them bare.
const KEPT: Join = Join::Miter { limit: 1.5 };

/// How deep contours go.
#[derive(Clone, Copy)]
pub(crate) enum Depth {
    /// Until nothing is left.
    Full,
    /// This many levels, the rest starting `inside` mm from the last.
    Levels { count: u32, inside: f64 },
}

/// The contours of `body` at the stepover of `settings`.
pub(crate) fn nest(
    body: &Region,
    depth: Depth,
    settings: &FillSettings,
) -> Result<Nest, PlanarError> {
    let (width, stepover, join) = (settings.width, settings.stepover, settings.join());
    let narrowest = 0.5 * width - 0.25 * stepover;
    let mut nest = Nest::default();
    let mut open = vec![(body.clone(), Vec::<usize>::new())];
    let mut level = 0;
    while !open.is_empty() {
        let mut next = Vec::new();
        for (region, parents) in open {
            let (bodies, lines) = if level == 0 {
                (vec![region], Vec::new())
            } else {
                let parts = split(&region, narrowest, settings)?;
                (parts.bodies, parts.lines)
            };
            nest.lines.extend(lines);
            for body in bodies {
                let mut here = Vec::new();
                for centre in inset(std::slice::from_ref(&body), 0.5 * width, join)? {
                    for ring in centre.rings() {
                        let parent = closest(ring, &parents, &nest.contours);
                        here.push(nest.contours.len());
                        nest.contours.push(Contour {
                            ring: ring.clone(),
                            parent,
                        });
                    }
                }
                let (step, turn) = match depth {
                    Depth::Levels { count, inside } if level + 1 == count => (inside, join),
                    _ => (stepover, KEPT),
                };
                for inner in inset(&[body], step, turn)? {
                    next.push((inner, here.clone()));
                }
            }
        }
        level += 1;
        open = next;
        if let Depth::Levels { count, .. } = depth
            && level >= count
        {
            nest.rest = open.into_iter().map(|(region, _)| region).collect();
            break;
        }
    }
    Ok(nest)
}

/// The distance between the contours of `body` that fills it best.
pub(crate) fn spacing(body: &Region, settings: &FillSettings) -> f64 {
    // without an axis the stepover stays as asked for
    let Ok(axis) = medial_axis(body, 0.125 * settings.width) else {
        return settings.stepover;
    };
    let skeleton = Skeleton::new(axis);
    let widest = skeleton.widest().map(|n| n.radius);
    let long = |radius: f64| -> f64 {
        skeleton
            .edges()
            .filter(|&(r, _)| r > 0.9 * radius)
            .map(|(_, length)| length)
            .sum()
    };
    let spot = widest.filter(|&r| long(r) < settings.width);
    spacing::nested(skeleton.edges(), spot, settings)
}

/// Which of the contours `among` a ring follows: the one nearest to most of its points.
fn closest(ring: &Ring, among: &[usize], contours: &[Contour]) -> Option<usize> {
    if among.len() < 2 {
        return among.first().copied();
    }
    let step = (ring.len() / 16).max(1);
    let mut votes = vec![0_u32; among.len()];
    for &p in ring.iter().step_by(step) {
        let distance = |&i: &usize| {
            edges(&contours[i].ring)
                .map(|(a, b)| p.distance_squared(a.lerp(b, nearest_share(p, a, b))))
                .fold(f64::INFINITY, f64::min)
        };
        let nearest =
            (0..among.len()).min_by(|&i, &j| distance(&among[i]).total_cmp(&distance(&among[j])));
        if let Some(k) = nearest {
            votes[k] += 1;
        }
    }
    let best = (0..among.len()).max_by_key(|&k| (votes[k], std::cmp::Reverse(k)))?;
    Some(among[best])
}

/// Contours in families: each the longest line of descent from a contour, from outside inwards.
pub(crate) fn families(contours: &[Contour]) -> Vec<Vec<usize>> {
    let perimeter = |i: usize| {
        edges(&contours[i].ring)
            .map(|(a, b)| a.distance(b))
            .sum::<f64>()
    };
    let mut heir: Vec<Option<usize>> = vec![None; contours.len()];
    for (i, contour) in contours.iter().enumerate() {
        if let Some(parent) = contour.parent
            && heir[parent].is_none_or(|other| perimeter(i) > perimeter(other))
        {
            heir[parent] = Some(i);
        }
    }
    let is_heir = |i: usize| contours[i].parent.is_some_and(|p| heir[p] == Some(i));
    (0..contours.len())
        .filter(|&i| !is_heir(i))
        .map(|first| std::iter::successors(Some(first), |&i| heir[i]).collect())
        .collect()
}
