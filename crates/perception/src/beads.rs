//! Beads on a plate in a cloud of points, straight or with a corner: which points are theirs, and how wide, high and large their sections are.
//!
//! Source: the pipeline of the thesis, § 2.2.2: plane, clusters above it, sections across the bead. There a parabola through each tells its size; here
//! that is told without a form: beads are not all parabolas.

mod clusters;
mod corner;
mod foot;
mod look;
mod section;

use meltpath_geometry::math::{DVec2, DVec3};

pub use corner::{Corner, Leg, crest};
pub use look::Look;
pub use section::Section;

use crate::plate::Plate;
use clusters::{cell, clusters, range, spread};

/// Share of a bead in its middle where sections are taken.
const MIDDLE: f64 = 0.6;
/// Least length of a bead, in widths and in mm: what is shorter is spatter.
const LONG: (f64, f64) = (3.0, 10.0);
/// A bead that bends away from a line by more of its length is not straight.
const STRAIGHT: f64 = 0.02;

/// Most sections of a bead.
const MOST: f64 = 1000.0;

/// A bead that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Bead {
    /// Its ends on the plate, in the frame of the cloud, mm.
    pub ends: [DVec3; 2],
    /// Its middle on the plate, in the frame of the cloud, mm.
    pub middle: DVec3,
    /// From end to end, mm.
    pub length: f64,
    /// How far its middle line leaves a straight one, mm.
    pub bend: f64,
    /// Its sections, along it.
    pub sections: Vec<Section>,
    /// Points of the cloud that are its own.
    pub points: usize,
}

impl Bead {
    /// Mean width of its sections and the standard uncertainty of that, mm: by what differs from section to section, which grows less with their
    /// number, and by what is common to them, which does not.
    pub fn width(&self) -> [f64; 2] {
        let n = self.sections.len() as f64;
        let mean = |of: &dyn Fn(&Section) -> f64| self.sections.iter().map(of).sum::<f64>() / n;
        let width = mean(&|s| s.width);
        let scatter = mean(&|s| (s.width - width).powi(2)) * n / (n - 1.0).max(1.0);
        let own = mean(&|s| s.width_sigma[0].powi(2));
        let common = mean(&|s| s.width_sigma[1]);
        [width, (scatter.max(own) / n).sqrt().hypot(common)]
    }
}

/// What a cloud holds besides its plate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// Straight beads, from one to the next across them, from low to high x or y of the cloud, whichever that way is nearer to; beads in
    /// one line along them.
    pub beads: Vec<Bead>,
    /// Beads with a corner, where they were asked for: by the places of their corners, from low to high x or y, along whichever they lie
    /// farther apart.
    pub corners: Vec<Corner>,
    /// Middles of what is as large as a bead and is not straight or gave no section, each with why.
    pub refused: Vec<(DVec3, String)>,
    /// Points above the plate that belong to nothing as large as a bead.
    pub spatter: usize,
}

/// Finds the straight beads on a plate.
pub fn beads(points: &[DVec3], plate: &Plate, look: Look) -> Found {
    let mut found = Found::default();
    let (clusters, on) = parted(points, plate, look);
    for cluster in clusters {
        match straight(&cluster, &on, plate, look) {
            Ok(bead) => found.beads.push(bead),
            Err(why) => found.leave(&cluster, plate, why),
        }
    }
    ordered(&mut found.beads, plate.normal());
    found
}

/// Finds the straight beads on a plate and those with a corner. What has two legs is no straight bead, even where it is longer than wide.
pub fn beads_and_corners(points: &[DVec3], plate: &Plate, look: Look) -> Found {
    let mut found = Found::default();
    let (clusters, on) = parted(points, plate, look);
    for cluster in clusters {
        let [low, high] = spread(cluster.iter().map(|p| p.truncate()));
        let large = (high - low).max_element() >= 2.0 * LONG.1;
        let corner = large.then(|| corner::corner(&cluster, &on, look));
        let why = match corner {
            Some(Ok(corner)) => {
                found.corners.push(Corner {
                    place: plate.global(corner.at.extend(0.0)),
                    ends: [0, 1].map(|k| {
                        let leg = &corner.legs[k];
                        plate.global((corner.at + leg.length * leg.outwards).extend(0.0))
                    }),
                    ..corner
                });
                continue;
            }
            Some(Err(why)) => Some((0.5 * (low + high), why)),
            None => None,
        };
        match straight(&cluster, &on, plate, look) {
            Ok(bead) => found.beads.push(bead),
            Err(other) => found.leave(&cluster, plate, why.or(other)),
        }
    }
    ordered(&mut found.beads, plate.normal());
    let [low, high] = spread(found.corners.iter().map(|c| c.place.truncate()));
    let size = high - low;
    let along = |c: &Corner| {
        if size.x > size.y {
            c.place.x
        } else {
            c.place.y
        }
    };
    found.corners.sort_by(|a, b| along(a).total_cmp(&along(b)));
    found
}

/// Where something lies on the plate that is as large as a bead and is none, and why.
type Refused = Option<(DVec2, String)>;

impl Found {
    /// Counts what is no bead.
    fn leave(&mut self, cluster: &[DVec3], plate: &Plate, why: Refused) {
        match why {
            Some((at, why)) => self.refused.push((plate.global(at.extend(0.0)), why)),
            None => self.spatter += cluster.len(),
        }
    }
}

/// What stands on a plate, and the points that lie on it, in its frame.
fn parted(points: &[DVec3], plate: &Plate, look: Look) -> (Vec<Vec<DVec3>>, Vec<DVec3>) {
    let local: Vec<DVec3> = points.iter().map(|p| plate.local(*p)).collect();
    let above: Vec<DVec3> = local.iter().copied().filter(|p| p.z > look.near).collect();
    let on = local.into_iter().filter(|p| p.z.abs() <= look.near);
    (clusters(&above), on.collect())
}

/// The straight bead of a cluster, else why it is none where it is as large as one.
fn straight(cluster: &[DVec3], on: &[DVec3], plate: &Plate, look: Look) -> Result<Bead, Refused> {
    let axis = Axis::of(cluster).ok_or(None)?;
    let (length, width) = axis.extent(cluster);
    if length < LONG.1 || (length < LONG.0 * width && length < 5.0 * LONG.1) {
        return Err(None);
    }
    let bead = bead(cluster, on, &axis, look).map_err(|why| Some((axis.middle, why)))?;
    Ok(Bead {
        ends: bead.ends.map(|p| plate.global(p)),
        middle: plate.global(bead.middle),
        ..bead
    })
}

/// Puts beads into the order of their places: across the longest of them, those in one line along it.
fn ordered(beads: &mut Vec<Bead>, normal: DVec3) {
    let longest = beads.iter().max_by(|a, b| a.length.total_cmp(&b.length));
    let Some(longest) = longest else { return };
    let upwards = |v: DVec3| {
        if v[v.abs().max_position()] < 0.0 {
            -v
        } else {
            v
        }
    };
    let along = upwards((longest.ends[1] - longest.ends[0]).normalize_or_zero());
    let across = upwards(normal.cross(along));
    let line = 0.5 * longest.sections.first().map_or(0.0, |s| s.width);
    beads.sort_by(|a, b| a.middle.dot(across).total_cmp(&b.middle.dot(across)));
    let (mut row, mut last) = (0, f64::NEG_INFINITY);
    let mut placed: Vec<(u32, f64, Bead)> = Vec::with_capacity(beads.len());
    for bead in beads.drain(..) {
        let at = bead.middle.dot(across);
        row += u32::from(at - last > line);
        last = at;
        placed.push((row, bead.middle.dot(along), bead));
    }
    placed.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    beads.extend(placed.into_iter().map(|p| p.2));
}

/// The bead of a cluster, in the frame of the plate.
fn bead(cluster: &[DVec3], on: &[DVec3], axis: &Axis, look: Look) -> Result<Bead, String> {
    let turned: Vec<DVec3> = cluster.iter().map(|p| axis.turned(*p)).collect();
    let beside: Vec<DVec3> = on.iter().map(|p| axis.turned(*p)).collect();
    let [first, last] = range(turned.iter().map(|p| p.x));
    let length = last - first;
    let count = (MIDDLE * length / look.every).floor().clamp(1.0, MOST);
    let mut sections = Vec::new();
    let mut why = String::new();
    for k in 0..=count as usize {
        let along = first + length * (0.5 + MIDDLE * (k as f64 / count - 0.5));
        let slab = |p: &&DVec3| (p.x - along).abs() <= 0.5 * look.every.min(2.0);
        let own: Vec<DVec2> = turned
            .iter()
            .filter(slab)
            .map(|p| DVec2::new(p.y, p.z))
            .collect();
        let plate: Vec<DVec2> = beside
            .iter()
            .filter(slab)
            .map(|p| DVec2::new(p.y, p.z))
            .collect();
        match Section::of(along - first, &own, &plate, look.near) {
            Ok(section) => sections.push(section),
            Err(reason) => why = reason,
        }
    }
    if sections.len() < 3 {
        let told = format!(
            "{} of {} sections could be measured: {why}",
            sections.len(),
            count + 1.0
        );
        return Err(told);
    }
    let line: Vec<DVec2> = sections
        .iter()
        .map(|s| DVec2::new(s.along, s.centre))
        .collect();
    let bend = bend(&line);
    if bend > STRAIGHT * length {
        return Err(format!(
            "its middle leaves a straight line by {bend:.1} mm over {length:.0} mm: straight beads are measured, and those with one corner where the file tells it (corner)"
        ));
    }
    let back = |x: f64, y: f64| axis.back(DVec2::new(x, y)).extend(0.0);
    let centre = line.iter().map(|p| p.y).sum::<f64>() / line.len() as f64;
    Ok(Bead {
        ends: [back(first, centre), back(last, centre)],
        middle: back(0.5 * (first + last), centre),
        length,
        bend,
        sections,
        points: cluster.len(),
    })
}

/// How far a line leaves the straight one of least squares.
fn bend(line: &[DVec2]) -> f64 {
    let n = line.len() as f64;
    let mean = line.iter().sum::<DVec2>() / n;
    let (mut xx, mut xy) = (0.0, 0.0);
    for p in line {
        let d = *p - mean;
        xx += d.x * d.x;
        xy += d.x * d.y;
    }
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    let off = |p: &DVec2| ((p.y - mean.y) - slope * (p.x - mean.x)).abs();
    line.iter().map(off).fold(0.0, f64::max)
}

/// The direction in which a cluster is longest.
struct Axis {
    middle: DVec2,
    along: DVec2,
}

impl Axis {
    /// By the principal axis of the cells that the cluster covers: their number does not hang on how densely each was scanned.
    fn of(cluster: &[DVec3]) -> Option<Self> {
        let mut cells: Vec<[i64; 2]> = cluster.iter().map(|p| cell(*p, 0.5)).collect();
        cells.sort_unstable();
        cells.dedup();
        let at = |c: &[i64; 2]| DVec2::new(c[0] as f64 + 0.5, c[1] as f64 + 0.5) * 0.5;
        let middle = cells.iter().map(at).sum::<DVec2>() / cells.len() as f64;
        let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
        for d in cells.iter().map(|c| at(c) - middle) {
            xx += d.x * d.x;
            yy += d.y * d.y;
            xy += d.x * d.y;
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        (cells.len() > 2).then(|| Axis {
            middle,
            along: DVec2::from_angle(angle),
        })
    }

    /// A point of the plate along and across the axis, its height as it is.
    fn turned(&self, p: DVec3) -> DVec3 {
        let d = p.truncate() - self.middle;
        DVec3::new(d.dot(self.along), self.along.perp_dot(d), p.z)
    }

    fn back(&self, p: DVec2) -> DVec2 {
        self.middle + p.x * self.along + p.y * self.along.perp()
    }

    /// Length, and width in its middle half.
    fn extent(&self, cluster: &[DVec3]) -> (f64, f64) {
        let turned: Vec<DVec3> = cluster.iter().map(|p| self.turned(*p)).collect();
        let [first, last] = range(turned.iter().map(|p| p.x));
        let quarter = 0.25 * (last - first);
        let inner = turned
            .iter()
            .filter(|p| (p.x - 0.5 * (first + last)).abs() < quarter);
        let [low, high] = range(inner.map(|p| p.y));
        (last - first, (high - low).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    /// A plate with beads: each from a point in a direction, so long, wide and high.
    struct Scene {
        random: Random,
        points: Vec<DVec3>,
        noise: f64,
    }

    impl Scene {
        fn new(seed: u64, noise: f64) -> Self {
            Scene {
                random: Random::new(seed),
                points: Vec::new(),
                noise,
            }
        }

        fn plate(&mut self, size: [f64; 2], count: usize) {
            for _ in 0..count {
                let p = DVec2::new(
                    self.random.between(0.0, size[0]),
                    self.random.between(0.0, size[1]),
                );
                let z = self.noise * self.random.normal();
                self.points.push(p.extend(z));
            }
        }

        /// Sections are parabolas. What of the plate lies under the bead is not seen.
        fn bead(&mut self, from: DVec2, angle: f64, size: [f64; 3], count: usize) {
            self.formed(from, angle, (size, |u| 1.0 - u * u), count);
        }

        /// Sections of a form: the share of its height at a share of half its width.
        fn formed(
            &mut self,
            from: DVec2,
            angle: f64,
            ([long, wide, high], form): ([f64; 3], fn(f64) -> f64),
            count: usize,
        ) {
            let along = DVec2::from_angle(angle);
            let inside = |p: &DVec3| {
                let d = p.truncate() - from;
                let (x, y) = (d.dot(along), along.perp_dot(d));
                (0.0..long).contains(&x) && y.abs() < 0.5 * wide
            };
            self.points.retain(|p| !inside(p));
            for _ in 0..count {
                let (x, y) = (
                    self.random.between(0.0, long),
                    self.random.between(-0.5, 0.5) * wide,
                );
                let z = high * form(2.0 * y / wide) + self.noise * self.random.normal();
                self.points
                    .push((from + x * along + y * along.perp()).extend(z));
            }
        }

        fn found(&self) -> (Found, Plate) {
            let plate = Plate::of(&self.points, 0.2).unwrap();
            let look = Look {
                near: 0.2,
                every: 5.0,
            };
            (beads(&self.points, &plate, look), plate)
        }
    }

    fn mean(bead: &Bead, of: impl Fn(&Section) -> f64) -> f64 {
        bead.sections.iter().map(of).sum::<f64>() / bead.sections.len() as f64
    }

    /// waam AC-48, and the second half of AC-45: of a bead 7 x 2 mm nearly all points are its own.
    #[test]
    fn waam_ac48_sizes_of_a_bead_in_a_cloud() {
        for (seed, noise) in [(1, 0.0), (2, 0.03), (3, 0.05)] {
            let mut scene = Scene::new(seed, noise);
            scene.plate([120.0, 60.0], 60_000);
            scene.bead(DVec2::new(10.0, 20.0), 0.2, [90.0, 7.0, 2.0], 30_000);
            let (found, _) = scene.found();
            let [bead] = &found.beads[..] else {
                panic!("{found:?}")
            };
            let [w, h, a] = [
                mean(bead, |s| s.width),
                mean(bead, |s| s.height),
                mean(bead, |s| s.area),
            ];
            assert!((w - 7.0).abs() < 0.05 && (h - 2.0).abs() < 0.05, "{w} {h}");
            assert!((a / (14.0 * 2.0 / 3.0) - 1.0).abs() < 0.02, "{a}");
            assert!((bead.length - 90.0).abs() < 0.5);
            // of a parabola 95 % of the width stand more than a tenth of the height out
            let higher = 30_000.0 * 0.9_f64.sqrt();
            assert!(bead.points as f64 > 0.98 * higher, "{}", bead.points);
            assert!((bead.ends[0].truncate() - DVec2::new(10.0, 20.0)).length() < 0.5);
        }
    }

    /// Height over the plate by the distance from the middle, shares of the height and of half the width.
    type Form = fn(f64) -> f64;

    /// Sections that are no parabolas: ellipse, circle of 2 mm over 7 mm, flat top, triangle. Width and height are their own, and the uncertainty
    /// that is told covers what is off.
    #[test]
    fn widths_are_where_sections_meet_the_plate_whatever_their_form() {
        let circle = |u: f64| {
            let radius = (3.5_f64.powi(2) + 4.0) / 4.0;
            1.0 - 0.5 * (radius - (radius.powi(2) - (3.5 * u).powi(2)).sqrt())
        };
        let forms: [(&str, Form); 5] = [
            ("parabola", |u| 1.0 - u * u),
            ("ellipse", |u| (1.0 - u * u).max(0.0).sqrt()),
            ("circle", circle),
            ("flat top", |u| 1.0 - u.powi(4)),
            ("triangle", |u| 1.0 - u.abs()),
        ];
        let (mut within, mut all) = (0, 0);
        for (name, form) in forms {
            for (seed, noise, count) in [(21, 0.03, 30_000), (22, 0.05, 30_000), (23, 0.03, 7_000)]
            {
                let mut scene = Scene::new(seed, noise);
                scene.plate([120.0, 60.0], 2 * count);
                let size = [90.0, 7.0, 2.0];
                scene.formed(DVec2::new(10.0, 20.0), 0.2, (size, form), count);
                let (found, _) = scene.found();
                let [bead] = &found.beads[..] else {
                    panic!("{name}: {found:?}")
                };
                let n = bead.sections.len() as f64;
                let [w, h, carried] = [
                    mean(bead, |s| s.width),
                    mean(bead, |s| s.height),
                    mean(bead, |s| s.width_sigma[1]),
                ];
                let random = mean(bead, |s| s.width_sigma[0].powi(2)).sqrt() / n.sqrt();
                let sigma = random.hypot(carried);
                assert!((w - 7.0).abs() < 0.14, "{name} {noise}: {w} ± {sigma}");
                // what is sharp is seen blunt
                let blunt = if name == "triangle" { 0.12 } else { 0.02 };
                assert!((h - 2.0).abs() < blunt, "{name} {noise}: {h}");
                within += usize::from((w - 7.0).abs() <= 2.0 * sigma);
                all += 1;
            }
        }
        assert!(within + 1 >= all, "{within} of {all}");
    }

    #[test]
    fn beads_on_one_plate_are_told_apart_and_spatter_is_left() {
        let mut scene = Scene::new(7, 0.02);
        scene.plate([120.0, 90.0], 80_000);
        for (x, y, long, wide) in [
            (15.0, 70.0, 80.0, 5.0),
            (60.0, 45.5, 35.0, 4.0),
            (15.0, 45.0, 35.0, 6.0),
            (15.0, 20.0, 80.0, 8.0),
        ] {
            scene.bead(DVec2::new(x, y), 0.0, [long, wide, 2.0], 20_000);
        }
        scene.bead(DVec2::new(100.0, 34.0), 0.0, [3.0, 3.0, 1.0], 200);
        let (found, _) = scene.found();
        let width = |b: &Bead| mean(b, |s| s.width).round();
        let widths: Vec<f64> = found.beads.iter().map(width).collect();
        // by their places: two of the second row's in one line
        assert_eq!(widths, [8.0, 6.0, 4.0, 5.0]);
        assert!((100..=200).contains(&found.spatter), "{}", found.spatter);
    }

    /// A plate that warps under its bead is levelled beside each section.
    #[test]
    fn a_warped_plate_takes_nothing_from_the_height() {
        let mut scene = Scene::new(9, 0.02);
        scene.plate([120.0, 60.0], 60_000);
        scene.bead(DVec2::new(15.0, 30.0), 0.0, [90.0, 7.0, 2.0], 30_000);
        for p in &mut scene.points {
            p.z += 0.15 * (2.0 * (p.x - 60.0) / 120.0).powi(2);
        }
        let (found, _) = scene.found();
        let h = mean(&found.beads[0], |s| s.height);
        assert!((h - 2.0).abs() < 0.02, "{h}");
    }

    #[test]
    fn a_bead_that_bends_is_refused_with_how_much() {
        let mut scene = Scene::new(11, 0.02);
        scene.plate([120.0, 90.0], 60_000);
        for k in 0..60 {
            let x = 15.0 + 1.5 * f64::from(k);
            let y = 20.0 + 0.01 * (x - 15.0).powi(2);
            let angle = (0.02 * (x - 15.0)).atan();
            scene.bead(DVec2::new(x, y), angle, [3.0, 6.0, 2.0], 800);
        }
        let (found, _) = scene.found();
        assert!(found.beads.is_empty());
        assert!(
            found.refused[0].1.contains("leaves a straight line"),
            "{:?}",
            found.refused
        );
    }
}
