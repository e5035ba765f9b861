//! Beads with one corner between two straight legs: where the corner lies, the legs with their sections, the crest, and the points around.
//!
//! Source: Rouchon 2022, §3.4.3.1: the middles of the straight parts place the corner, the plate is levelled around it.

mod ridge;

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_numerics::least_squares::Regression;
use meltpath_numerics::random::Random;

use super::look::Look;
use super::section::Section;

/// Least length of a leg, mm: volumes are taken to 20 mm from the corner, and the straight part begins there.
const LEG: f64 = 30.0;
/// Where the straight part of a leg begins, from the corner, and ends, from its own end, mm.
const STRAIGHT: [f64; 2] = [20.0, 6.0];
/// Least turn of a corner, rad: 15°.
const LEAST: f64 = 0.262;
/// Crest points so near a line are its own, mm.
const ON_LINE: f64 = 0.4;
/// Lines through two crest points that are tried.
const TRIED: u32 = 400;
/// Distance from a leg within which points of the plate are kept, mm.
const AROUND: f64 = 15.0;
/// Share of the crest that may lie off both legs, away from their corner.
const OFF: f64 = 0.15;
/// Share of a line's own points beyond the corner from which on lines cross there.
const ACROSS: f64 = 0.08;
/// Distance from the corner within which points belong to neither line for sure, mm.
const NEAR_CORNER: f64 = 12.0;
/// Windows of the crest: for finding legs, mm, and then in widths of the bead.
const WINDOW: (f64, f64) = (1.5, 0.22);
/// Least share of the bead's height that a crest has.
const HIGH: f64 = 0.5;

/// The crest of a bead's points, mm: on places higher than half its usual top, the surface being the quadratic of least squares within
/// `window` mm.
pub fn crest(points: &[DVec3], window: f64) -> Vec<DVec2> {
    ridge::crest(points, window, HIGH)
}

/// A leg of a bead, seen from the corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Unit vector from the corner outwards, in the frame of the plate.
    pub outwards: DVec2,
    /// From the corner to its end, mm.
    pub length: f64,
    /// Sections across its straight part; `along` is the distance from the corner.
    pub sections: Vec<Section>,
}

/// A bead with a corner that was found. All in the frame of the plate, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Corner {
    /// Where the middles of its legs meet, in the frame of the cloud.
    pub place: DVec3,
    /// The ends of its legs, in the frame of the cloud.
    pub ends: [DVec3; 2],
    /// Where they meet, on the plate.
    pub at: DVec2,
    /// Its legs: a torch that comes along the first turns left into the second.
    pub legs: [Leg; 2],
    /// Its crest.
    pub crest: Vec<DVec2>,
    /// How far apart points of the crest are that share nothing of the scan, mm.
    pub window: f64,
    /// Its points and those of the plate around, above the plate as it lies there.
    pub points: Vec<DVec3>,
    /// Points of the cloud that are its own.
    pub own: usize,
}

impl Corner {
    /// How far its path turns, rad: 0 is straight on.
    pub fn turn(&self) -> f64 {
        let [first, second] = [&self.legs[0], &self.legs[1]];
        (-first.outwards).angle_to(second.outwards).abs()
    }

    /// Mean width, height and area of its straight parts, mm and mm².
    pub fn mean(&self) -> [f64; 3] {
        let all = || self.legs.iter().flat_map(|l| &l.sections);
        let n = all().count() as f64;
        let of = |f: fn(&Section) -> f64| all().map(f).sum::<f64>() / n;
        [of(|s| s.width), of(|s| s.height), of(|s| s.area)]
    }
}

/// Distance of a point from a leg of `length` mm that goes from `at` outwards.
fn from_leg(p: DVec2, at: DVec2, outwards: DVec2, length: f64) -> f64 {
    let d = p - at;
    d.distance(d.dot(outwards).clamp(0.0, length) * outwards)
}

/// A line by a point and a unit vector.
type Line = (DVec2, DVec2);

fn off((at, along): &Line, p: DVec2) -> f64 {
    along.perp_dot(p - *at)
}

/// The line with most points near it, and they.
fn most(points: &[DVec2], random: &mut Random) -> Option<(Line, Vec<DVec2>)> {
    let mut best: Option<(Line, usize)> = None;
    let pick = |random: &mut Random| {
        points[(random.between(0.0, points.len() as f64) as usize).min(points.len() - 1)]
    };
    for _ in 0..TRIED {
        if points.len() < 2 {
            return None;
        }
        let (a, b) = (pick(random), pick(random));
        let Some(along) = (b - a).try_normalize() else {
            continue;
        };
        // near points show no direction
        if a.distance(b) < 5.0 {
            continue;
        }
        let line = (a, along);
        let count = points
            .iter()
            .filter(|p| off(&line, **p).abs() <= ON_LINE)
            .count();
        if best.as_ref().is_none_or(|(_, most)| count > *most) {
            best = Some((line, count));
        }
    }
    let (line, _) = best?;
    let own: Vec<DVec2> = points
        .iter()
        .copied()
        .filter(|p| off(&line, *p).abs() <= ON_LINE)
        .collect();
    Some((fitted(&own)?, own))
}

/// The line of least squares of distances.
fn fitted(points: &[DVec2]) -> Option<Line> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let middle = points.iter().sum::<DVec2>() / n;
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for d in points.iter().map(|p| *p - middle) {
        xx += d.x * d.x;
        yy += d.y * d.y;
        xy += d.x * d.y;
    }
    Some((middle, DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy))))
}

fn meeting(a: &Line, b: &Line) -> Option<DVec2> {
    let turn = a.1.perp_dot(b.1);
    (turn.abs() > 0.02).then(|| a.0 + (b.0 - a.0).perp_dot(b.1) / turn * a.1)
}

/// Corner and directions of the two legs of a crest.
fn legs(crest: &[DVec2]) -> Result<(DVec2, [DVec2; 2]), String> {
    let none = || "no two straight legs of it are seen".to_owned();
    let mut random = Random::new(1);
    let (first, _) = most(crest, &mut random).ok_or_else(none)?;
    let rest: Vec<DVec2> = crest
        .iter()
        .copied()
        .filter(|p| off(&first, *p).abs() > 2.5 * ON_LINE)
        .collect();
    if (rest.len() as f64) < 0.1 * crest.len() as f64 {
        return Err("its crest is one line: it has no corner".to_owned());
    }
    let (second, _) = most(&rest, &mut random).ok_or_else(none)?;
    let mut lines = [first, second];
    let mut at = meeting(&lines[0], &lines[1])
        .ok_or("its straight parts are parallel: beads that touch, or more than one corner")?;
    let mut outwards = [DVec2::X; 2];
    for _ in 0..3 {
        let mut straight = [Vec::new(), Vec::new()];
        for p in crest {
            let [a, b] = lines.each_ref().map(|l| off(l, *p).abs());
            let own = usize::from(b < a);
            if a.min(b) <= 2.0 * ON_LINE && p.distance(at) > STRAIGHT[0] {
                straight[own].push(*p);
            }
        }
        for (k, own) in straight.iter().enumerate() {
            let line = fitted(own).ok_or_else(none)?;
            let mean = own.iter().map(|p| (*p - at).dot(line.1)).sum::<f64>();
            let away = if mean < 0.0 { -line.1 } else { line.1 };
            let behind = own.iter().filter(|p| (**p - at).dot(away) < 0.0).count();
            if behind as f64 > ACROSS * own.len() as f64 {
                return Err("its lines cross: scan beads that touch nothing".to_owned());
            }
            (lines[k], outwards[k]) = (line, away);
        }
        at = meeting(&lines[0], &lines[1])
            .ok_or("its straight parts are parallel: beads that touch, or more than one corner")?;
    }
    let turn = (-outwards[0]).angle_to(outwards[1]).abs();
    if turn < LEAST {
        return Err(format!(
            "its legs turn by {:.0}° alone: that is no corner",
            turn.to_degrees()
        ));
    }
    // left first: a torch that comes along it turns left
    if (-outwards[0]).perp_dot(outwards[1]) < 0.0 {
        outwards.swap(0, 1);
    }
    Ok((at, outwards))
}

/// Two legs from a corner.
struct Legs {
    at: DVec2,
    outwards: [DVec2; 2],
    lengths: [f64; 2],
}

impl Legs {
    /// The leg that a place is nearest to, and how far it is, mm.
    fn nearest(&self, p: DVec2) -> (usize, f64) {
        let [a, b] = [0, 1].map(|k| from_leg(p, self.at, self.outwards[k], self.lengths[k]));
        if a <= b { (0, a) } else { (1, b) }
    }

    /// Sections across the straight part of a leg, of the bead's points and those of the plate.
    fn sections(
        &self,
        leg: usize,
        points: [&[DVec3]; 2],
        look: Look,
    ) -> Result<Vec<Section>, String> {
        let along = self.outwards[leg];
        let [own, beside] = points.map(|points| -> Vec<DVec3> {
            let own = points
                .iter()
                .filter(|p| self.nearest(p.truncate()).0 == leg);
            let seen = |p: &DVec3| {
                let d = p.truncate() - self.at;
                DVec3::new(d.dot(along), along.perp_dot(d), p.z)
            };
            own.map(seen).collect()
        });
        let last = self.lengths[leg] - STRAIGHT[1];
        let step = look.every.min(3.0);
        let count = ((last - STRAIGHT[0]) / step).floor().max(0.0) as u32;
        let (mut sections, mut why) = (Vec::new(), String::new());
        for n in 0..=count {
            let place = STRAIGHT[0] + step * f64::from(n);
            let slab = |points: &[DVec3]| -> Vec<DVec2> {
                let within = points
                    .iter()
                    .filter(|p| (p.x - place).abs() <= 0.5 * step.min(2.0));
                within.map(|p| DVec2::new(p.y, p.z)).collect()
            };
            match Section::of(place, &slab(&own), &slab(&beside), look.near) {
                Ok(section) => sections.push(section),
                Err(told) => why = told,
            }
        }
        if sections.len() < 2 {
            return Err(format!(
                "{} of {} sections of a leg could be measured: {why}",
                sections.len(),
                count + 1
            ));
        }
        Ok(sections)
    }
}

/// The bead of a cluster, which is higher than `look.near`, and of the points `on` the plate. `place` and `ends` are left to the caller.
pub(super) fn corner(cluster: &[DVec3], on: &[DVec3], look: Look) -> Result<Corner, String> {
    let rough = ridge::crest(cluster, WINDOW.0, HIGH);
    if rough.len() < 40 {
        return Err(format!(
            "its crest has {} points: a closer scan, or no bead",
            rough.len()
        ));
    }
    let (at, outwards) = legs(&rough)?;
    let stray = rough.iter().filter(|p| {
        p.distance(at) > NEAR_CORNER
            && outwards
                .iter()
                .all(|u| from_leg(**p, at, *u, f64::MAX) > 3.0 * ON_LINE)
    });
    let share = stray.count() as f64 / rough.len() as f64;
    if share > OFF {
        return Err(format!(
            "{:.0} % of its crest lie off two straight legs: it has more than one corner, or bends; cut the scan round each corner",
            100.0 * share
        ));
    }
    let lengths = outwards.map(|u| {
        let own = cluster.iter().map(|p| p.truncate() - at);
        let near = own.filter(|d| u.perp_dot(*d).abs() < 2.0);
        near.map(|d| d.dot(u)).fold(0.0, f64::max)
    });
    let shortest = lengths[0].min(lengths[1]);
    if shortest < LEG {
        return Err(format!(
            "a leg is {shortest:.0} mm long, {LEG:.0} mm are the least: 50 mm are usual"
        ));
    }
    let legs = Legs {
        at,
        outwards,
        lengths,
    };
    let near: Vec<DVec3> = on
        .iter()
        .copied()
        .filter(|p| legs.nearest(p.truncate()).1 < AROUND)
        .collect();
    let sections = [
        legs.sections(0, [cluster, &near], look)?,
        legs.sections(1, [cluster, &near], look)?,
    ];
    let [first, second] = sections;
    let mut found = Corner {
        place: DVec3::ZERO,
        ends: [DVec3::ZERO; 2],
        at,
        legs: [(0, first), (1, second)].map(|(k, sections)| Leg {
            outwards: outwards[k],
            length: lengths[k],
            sections,
        }),
        crest: Vec::new(),
        window: 0.0,
        points: cluster.iter().chain(&near).copied().collect(),
        own: cluster.len(),
    };
    let [width, ..] = found.mean();
    let window = (WINDOW.1 * width).clamp(0.7, 2.0);
    found.crest = ridge::crest(cluster, window, HIGH);
    found.window = 2.0 * window;
    level(&mut found.points, |p| {
        let (_, off) = legs.nearest(p.truncate());
        off > 0.6 * width + 0.5 && p.z.abs() <= look.near
    });
    Ok(found)
}

/// Takes the plane of least squares through points that are plate off all points.
fn level(points: &mut [DVec3], plate: impl Fn(&DVec3) -> bool) {
    let mut plane = Regression::new(3);
    let mut count = 0;
    for p in points.iter().filter(|p| plate(p)) {
        plane.push([1.0, p.x, p.y], p.z);
        count += 1;
    }
    if count < 100 {
        return;
    }
    if let Ok(found) = plane.solve()
        && let [at, x, y] = found.values[..]
    {
        for p in points {
            p.z -= at + x * p.x + y * p.y;
        }
    }
}
