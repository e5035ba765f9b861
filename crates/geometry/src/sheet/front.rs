//! Fronts that go over a surface at a constant distance: each is the line on the surface at that distance, through space, from the
//! nearest place of the front before. Fronts split around holes, merge behind them, close at caps and end at rims by themselves: a
//! front is the border of what has been reached.
//!
//! A place counts as reached only over the surface, so that no front jumps from one leaf to another beside it. Two leaves that lie
//! nearer to each other than the spacing see each other's fronts.

use super::chain::ChainPoint;
use super::thin::thinned;
use super::{NONE, Sheet, SheetError, crossing, positive};
use crate::math::DVec3;
use crate::segments::{Nearest, Segments};

/// One point of a front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontPoint {
    /// Where, mm.
    pub position: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// The nearest place of the front before, mm.
    pub from: DVec3,
}

/// An uninterrupted line of a front.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontLine {
    /// Its points, what has been reached on the left, seen against the normal. A closed line repeats its first point at the end.
    pub points: Vec<FrontPoint>,
    /// The lines of the front before from which it goes on, from 0; several where fronts merge. Of the first front those of the base.
    pub parents: Vec<u32>,
}

/// All lines at one distance from the front before.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Front {
    /// Its lines, open ones first.
    pub lines: Vec<FrontLine>,
}

/// A line that no other goes on from: the surface ends, closes, or another front comes towards it within the spacing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontEnd {
    /// Its front, from 1; 0 for a line of the base.
    pub front: u32,
    /// Its line, from 0.
    pub line: u32,
    /// A point of it, mm.
    pub position: DVec3,
    /// Farthest place of the surface that is left beyond it, mm from it.
    pub left: f64,
}

/// Fronts over a surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fronts {
    /// The lines in which the base meets the surface.
    pub base: Vec<Vec<DVec3>>,
    /// The fronts, from the base on.
    pub fronts: Vec<Front>,
    /// Lines that no other goes on from.
    pub ends: Vec<FrontEnd>,
    /// Area in front of the base that no front reaches, as it hangs together with the base nowhere, mm².
    pub unreached: f64,
}

/// Most fronts.
const MOST: usize = 16_383;
/// How often a segment is halved where it leaves its curve.
const HALVES: u32 = 6;

/// A front while it goes on.
struct Marcher<'a> {
    sheet: &'a Sheet,
    spacing: f64,
    chord_error: f64,
    reached: Vec<bool>,
    /// The last front at which a vertex was looked at.
    seen: Vec<u32>,
}

impl Sheet {
    /// Fronts from where `base` is zero towards where it is above zero, each `spacing` mm from the one before, to within `chord_error`
    /// mm. `base` is the signed distance from the base, mm; what lies on it to within `chord_error` counts as touching.
    ///
    /// # Errors
    /// [`SheetError`]: lengths not above zero, a base that touches nothing or has everything behind it, too many fronts.
    pub fn fronts(
        &self,
        base: impl Fn(DVec3) -> f64,
        spacing: f64,
        chord_error: f64,
    ) -> Result<Fronts, SheetError> {
        positive("the spacing", spacing)?;
        positive("the chord error", chord_error)?;
        let level = |p: DVec3| base(p) - chord_error;
        let reached: Vec<bool> = self.used(|p| level(p) <= 0.0);
        self.check_base(&base, &reached)?;
        let mixed: Vec<u32> = (0..self.mesh.triangles.len() as u32)
            .filter(|&t| self.is_mixed(t, &reached))
            .collect();
        // what touches within the chord error is where it is, what is cut is cut at zero
        let mut lines = self.chains(&mixed, &reached, |a, b| crossing(a, b, &base));
        let mut marcher = Marcher {
            sheet: self,
            spacing,
            chord_error,
            seen: vec![0; reached.len()],
            reached,
        };
        let mut found = Fronts {
            base: lines.iter().map(|l| positions(l)).collect(),
            ..Fronts::default()
        };
        while !lines.is_empty() {
            let number = found.fronts.len() as u32 + 1;
            let before: Vec<Vec<DVec3>> = lines.iter().map(|l| positions(l)).collect();
            let near = Segments::new(before.iter().map(Vec::as_slice), spacing);
            let step = marcher.step(&lines, &near, number);
            let front = marcher.front(&step.lines, &near);
            found.ends.extend(ends(&before, &front, &step, number - 1));
            lines = step.lines;
            if lines.is_empty() {
                break;
            }
            found.fronts.push(front);
            if found.fronts.len() > MOST {
                return Err(SheetError::TooMany {
                    spacing,
                    most: MOST,
                });
            }
        }
        let away = |t: &usize| {
            self.mesh.triangles[*t]
                .iter()
                .any(|&v| !marcher.reached[v as usize])
        };
        let unreached = (0..self.mesh.triangles.len()).filter(away);
        found.unreached = unreached
            .map(|t| {
                let [a, b, c] = self.mesh.corners(t);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        Ok(found)
    }

    /// What holds at each vertex; vertices of no triangle count as holding.
    fn used(&self, holds: impl Fn(DVec3) -> bool) -> Vec<bool> {
        let vertices = (0_u32..).zip(&self.mesh.vertices);
        vertices
            .map(|(v, &p)| self.fan(v).is_empty() || holds(p))
            .collect()
    }

    fn check_base(&self, base: impl Fn(DVec3) -> f64, reached: &[bool]) -> Result<(), SheetError> {
        let corners = self.mesh.triangles.iter().flatten();
        let places = corners.map(|&v| (base(self.mesh.vertices[v as usize]), v));
        let (mut least, mut greatest) = ((f64::INFINITY, 0), (f64::NEG_INFINITY, 0));
        for place in places {
            if place.0 < least.0 {
                least = place;
            }
            if place.0 > greatest.0 {
                greatest = place;
            }
        }
        let at = |v: u32| self.mesh.vertices[v as usize];
        if !reached[least.1 as usize] {
            return Err(SheetError::NoBase {
                gap: least.0,
                at: at(least.1),
            });
        }
        if reached[greatest.1 as usize] {
            return Err(SheetError::Behind {
                depth: -least.0,
                at: at(least.1),
            });
        }
        Ok(())
    }
}

fn positions(line: &[ChainPoint]) -> Vec<DVec3> {
    line.iter().map(|p| p.position).collect()
}

/// One front further.
struct Step {
    lines: Vec<Vec<ChainPoint>>,
    /// Of the vertices reached, how far the farthest lies from each line of the front before.
    depth: Vec<f64>,
}

impl Marcher<'_> {
    /// Takes in what lies within the spacing of the last front, and finds its border.
    fn step(&mut self, lines: &[Vec<ChainPoint>], near: &Segments, number: u32) -> Step {
        let sheet = self.sheet;
        let mut depth = vec![0.0_f64; lines.len()];
        let corners = |t: u32| sheet.mesh.triangles[t as usize];
        let starts = lines.iter().flatten().filter(|p| p.triangle != NONE);
        let mut open: Vec<u32> = starts.flat_map(|p| corners(p.triangle)).collect();
        let mut fresh = Vec::new();
        while let Some(v) = open.pop() {
            let i = v as usize;
            if self.reached[i] || self.seen[i] == number {
                continue;
            }
            self.seen[i] = number;
            let found = near.nearest(sheet.mesh.vertices[i], self.spacing);
            let Some(place) = found.filter(|n| n.distance < self.spacing) else {
                continue;
            };
            let deepest = &mut depth[place.line as usize];
            *deepest = deepest.max(place.distance);
            self.reached[i] = true;
            fresh.push(v);
            open.extend(sheet.fan(v).iter().flat_map(|&t| corners(t)));
        }
        let mut mixed: Vec<u32> = fresh.iter().flat_map(|&v| sheet.fan(v)).copied().collect();
        mixed.sort_unstable();
        mixed.dedup();
        mixed.retain(|&t| sheet.is_mixed(t, &self.reached));
        let level = |p: DVec3| self.level(near, p);
        let coarse = sheet.chains(&mixed, &self.reached, |a, b| crossing(a, b, level));
        let lines = coarse.iter().map(|line| self.refined(line, near)).collect();
        Step { lines, depth }
    }

    /// How much farther than the spacing a point lies from the front before.
    fn level(&self, near: &Segments, p: DVec3) -> f64 {
        let far = near.nearest(p, 3.0 * self.spacing);
        far.map_or(2.0 * self.spacing, |n| n.distance - self.spacing)
    }

    /// The line with points between where its chords leave the curve.
    fn refined(&self, line: &[ChainPoint], near: &Segments) -> Vec<ChainPoint> {
        let mut fine: Vec<ChainPoint> = line.first().copied().into_iter().collect();
        for pair in line.windows(2) {
            self.halve(pair[0], pair[1], near, HALVES, &mut fine);
        }
        fine
    }

    fn halve(
        &self,
        a: ChainPoint,
        b: ChainPoint,
        near: &Segments,
        halves: u32,
        to: &mut Vec<ChainPoint>,
    ) {
        let middle = a.position.midpoint(b.position);
        let off = self.level(near, middle).abs();
        if halves > 0
            && off > 0.25 * self.chord_error
            && let Some(m) = self.settled(middle, a.triangle, near)
        {
            self.halve(a, m, near, halves - 1, to);
            return self.halve(m, b, near, halves - 1, to);
        }
        to.push(b);
    }

    /// A point of a triangle moved onto the front; `None` where that leads out of the triangle.
    fn settled(&self, from: DVec3, triangle: u32, near: &Segments) -> Option<ChainPoint> {
        let across = self.sheet.face_normal(triangle);
        let mut p = from;
        for _ in 0..8 {
            let n: Nearest = near.nearest(p, 3.0 * self.spacing)?;
            let off = n.distance - self.spacing;
            if off.abs() < 1e-9 {
                break;
            }
            let way = (p - n.point) / n.distance.max(f64::MIN_POSITIVE);
            let flat = way - across * way.dot(across);
            let slope = flat.length_squared();
            if slope < 1e-6 {
                return None;
            }
            p -= flat * (off / slope);
        }
        let normal = self.sheet.normal_in(triangle, p)?;
        let settled = self.level(near, p).abs() < 1e-6;
        settled.then_some(ChainPoint {
            position: p,
            normal,
            triangle,
        })
    }

    /// The lines as people get them: without points that say nothing of their course.
    fn front(&self, lines: &[Vec<ChainPoint>], near: &Segments) -> Front {
        let line = |line: &Vec<ChainPoint>| {
            let stays = thinned(&positions(line), 0.5 * self.chord_error);
            let mut parents = Vec::new();
            let mut points = Vec::new();
            for (p, stays) in line.iter().zip(stays) {
                let from = near.nearest(p.position, 3.0 * self.spacing);
                parents.extend(from.map(|n| n.line));
                if stays {
                    points.push(FrontPoint {
                        position: p.position,
                        normal: p.normal,
                        from: from.map_or(p.position, |n| n.point),
                    });
                }
            }
            parents.sort_unstable();
            parents.dedup();
            FrontLine { points, parents }
        };
        Front {
            lines: lines.iter().map(line).collect(),
        }
    }
}

/// The lines of the front before that no line goes on from.
fn ends(before: &[Vec<DVec3>], front: &Front, step: &Step, number: u32) -> Vec<FrontEnd> {
    let goes_on = |line: u32| {
        front
            .lines
            .iter()
            .any(|l| l.parents.binary_search(&line).is_ok())
    };
    let lines = (0..).zip(before);
    let ended = lines.filter(|(line, points)| !goes_on(*line) && !points.is_empty());
    ended
        .map(|(line, points)| FrontEnd {
            front: number,
            line,
            position: points[points.len() / 2],
            left: step.depth[line as usize],
        })
        .collect()
}
