//! How far along its path each sample of a log lies.

use std::ops::Range;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::driven::DrivenPath;
use super::frame::{Freedom, nearest};
use super::log::Log;

/// A path as chords, with how far along it each point lies.
pub(super) struct Way {
    points: Vec<DVec3>,
    arcs: Vec<f64>,
    /// Where each stretch begins, and the end of the last, mm.
    pub(super) borders: Vec<f64>,
}

impl Way {
    pub(super) fn new(path: &DrivenPath) -> Way {
        let mut way = Way {
            points: Vec::new(),
            arcs: Vec::new(),
            borders: vec![0.0],
        };
        for stretch in &path.stretches {
            for point in stretch.chords() {
                let arc = match (way.points.last(), way.arcs.last()) {
                    (Some(last), Some(arc)) => arc + point.distance(*last),
                    _ => 0.0,
                };
                way.points.push(point);
                way.arcs.push(arc);
            }
            way.borders.push(way.length());
        }
        way
    }

    pub(super) fn length(&self) -> f64 {
        self.arcs.last().copied().unwrap_or(0.0)
    }

    /// Its point at an arc.
    pub(super) fn at(&self, arc: f64) -> DVec3 {
        let last = self.points.len() - 1;
        let next = self
            .arcs
            .partition_point(|a| *a < arc)
            .clamp(1, last.max(1));
        let (from, to) = (self.arcs[next - 1], self.arcs[next.min(last)]);
        let share = if to > from {
            (arc - from) / (to - from)
        } else {
            0.0
        };
        self.points[next - 1].lerp(self.points[next.min(last)], share.clamp(0.0, 1.0))
    }

    /// The arc of the point that is nearest to a place, within a window of arcs.
    fn project(&self, place: DVec3, [low, high]: [f64; 2]) -> f64 {
        let first = self.arcs.partition_point(|a| *a < low).saturating_sub(1);
        let mut best = (f64::INFINITY, low.max(0.0));
        for i in first..self.points.len() - 1 {
            if self.arcs[i] > high {
                break;
            }
            let along = self.points[i + 1] - self.points[i];
            let length = along.length();
            if length == 0.0 {
                continue;
            }
            let share = (place - self.points[i]).dot(along) / (length * length);
            let arc = (self.arcs[i] + share.clamp(0.0, 1.0) * length).clamp(low, high);
            let off = place.distance(self.at(arc));
            if off < best.0 {
                best = (off, arc);
            }
        }
        best.1
    }
}

/// A log as far as it moves: samples at least a ruler apart, with the way gone by then.
pub(super) struct Ruled {
    /// Samples.
    pub(super) samples: Vec<usize>,
    /// The way gone, mm.
    pub(super) arcs: Vec<f64>,
    /// How far samples are apart, mm.
    ruler: f64,
}

impl Ruled {
    pub(super) fn new(log: &Log, ruler: f64) -> Ruled {
        let mut ruled = Ruled {
            samples: vec![0],
            arcs: vec![0.0],
            ruler,
        };
        let (mut from, mut arc) = (log.places[0], 0.0);
        for (i, place) in log.places.iter().enumerate() {
            let gone = place.distance(from);
            if gone >= ruler {
                arc += gone;
                from = *place;
                ruled.samples.push(i);
                ruled.arcs.push(arc);
            }
        }
        ruled
    }

    pub(super) fn length(&self) -> f64 {
        self.arcs.last().copied().unwrap_or(0.0)
    }

    /// The sample by which so much way is gone.
    fn sample(&self, arc: f64) -> usize {
        let i = self.arcs.partition_point(|a| *a < arc);
        self.samples[i.min(self.samples.len() - 1)]
    }
}

/// A part of the log that may be the path, mm of way gone, and how it lies.
#[derive(Clone, Copy)]
struct Candidate {
    arcs: [f64; 2],
    frame: Pose,
    off: f64,
}

/// Points at which candidates are compared.
const COMPARED: u32 = 60;
/// Beginnings that are tried.
const BEGINNINGS: f64 = 600.0;
/// Shares of the path by which its log may be shorter, as it cuts corners, or longer, as it is noisy.
const SHORTER: [f64; 6] = [0.0, 0.01, 0.025, 0.05, 0.09, -0.01];

/// The samples that lie along the path, and the arc of each; with the frame of the path from that of the log.
pub(super) struct Projected {
    /// Which samples.
    pub(super) samples: Range<usize>,
    /// How far along the path, mm, never falling.
    pub(super) arcs: Vec<f64>,
    /// The frame.
    pub(super) frame: Pose,
    /// How far off the path, mm.
    pub(super) off: Vec<f64>,
}

impl Projected {
    /// Takes in what lies on the path before and behind, as far as it goes on there: where a path begins is found to a few millimetres only.
    fn extend(&mut self, log: &Log, way: &Way, near: f64) {
        let (mut before, mut behind) = (Vec::new(), Vec::new());
        let laid = |i: usize, window: [f64; 2]| {
            let place = self.frame.point(log.places[i]);
            let arc = way.project(place, window.map(|a| a.clamp(0.0, way.length())));
            let off = place.distance(way.at(arc));
            (off <= near).then_some((arc, off))
        };
        let mut arc = self.arcs.first().copied().unwrap_or(0.0);
        for i in (0..self.samples.start).rev() {
            let Some(found) = laid(i, [arc - near, arc + 0.5 * near]) else {
                break;
            };
            arc = found.0;
            before.push(found);
        }
        arc = self.arcs.last().copied().unwrap_or(0.0);
        for i in self.samples.end..log.places.len() {
            let Some(found) = laid(i, [arc - 0.5 * near, arc + near]) else {
                break;
            };
            arc = found.0;
            behind.push(found);
        }
        self.samples = self.samples.start - before.len()..self.samples.end + behind.len();
        before.reverse();
        let own = self.arcs.drain(..).zip(self.off.drain(..));
        let all: Vec<(f64, f64)> = before.into_iter().chain(own).chain(behind).collect();
        (self.arcs, self.off) = all.into_iter().unzip();
    }

    /// The first sample that lies at an arc or beyond.
    pub(super) fn reaches(&self, arc: f64) -> usize {
        self.samples.start
            + self
                .arcs
                .partition_point(|a| *a < arc)
                .min(self.arcs.len() - 1)
    }
}

/// Where the path lies in a log; nothing where all lies on a line.
pub(super) fn project(
    log: &Log,
    ruled: &Ruled,
    way: &Way,
    speeds: &dyn Fn(f64) -> f64,
    freedom: Freedom,
) -> Option<Projected> {
    let mut best: Option<Candidate> = None;
    let spare = ruled.length() - way.length();
    // more way gone than the path is long: it begins anywhere
    let most = (spare + SHORTER[4] * way.length()).max(0.0);
    let step = (most / BEGINNINGS).max(way.length() / 2000.0);
    let count = (most / step).floor() as u32;
    for k in 0..=count {
        for shorter in SHORTER {
            let from = f64::from(k) * step;
            let to = from + way.length() * (1.0 - shorter);
            if to > ruled.length() + 0.005 * way.length() {
                continue;
            }
            let arcs = [from, to.min(ruled.length())];
            let Some(found) = candidate(log, ruled, way, speeds, freedom, arcs) else {
                continue;
            };
            if best.is_none_or(|b| found.off < b.off) {
                best = Some(found);
            }
        }
    }
    let mut found = refined(log, ruled, way, best?, freedom)?;
    found.extend(log, way, 2.0 * ruled.ruler);
    // the least of all that follow: noise at rest never carries on
    let mut reached = way.length();
    for arc in found.arcs.iter_mut().rev() {
        reached = reached.min(*arc);
        *arc = reached;
    }
    Some(found)
}

/// How well a part of a log fits the path: places, and the speeds that they are passed at.
fn candidate(
    log: &Log,
    ruled: &Ruled,
    way: &Way,
    speeds: &dyn Fn(f64) -> f64,
    freedom: Freedom,
    arcs: [f64; 2],
) -> Option<Candidate> {
    let [from, to] = arcs;
    let mut pairs = Vec::with_capacity(COMPARED as usize + 1);
    let mut last: Option<(f64, f64)> = None;
    let mut paces = Vec::new();
    for k in 0..=COMPARED {
        let share = f64::from(k) / f64::from(COMPARED);
        let sample = ruled.sample(from + share * (to - from));
        let arc = share * way.length();
        pairs.push((log.places[sample], way.at(arc)));
        if let Some((arc0, time0)) = last {
            let pace = (arc - arc0) / (log.times[sample] - time0).max(1e-6);
            let set = speeds(0.5 * (arc + arc0));
            paces.push((pace / set).max(1e-6).ln());
        }
        last = Some((arc, log.times[sample]));
    }
    let frame = match freedom {
        Freedom::Same => Pose::IDENTITY,
        Freedom::Rigid => nearest(&pairs)?,
    };
    let square: f64 = pairs
        .iter()
        .map(|(p, q)| frame.point(*p).distance_squared(*q))
        .sum();
    let places = (square / pairs.len() as f64).sqrt();
    // a log at another pace throughout is told later: here its evenness counts
    let middle = super::log::median(&mut paces.clone());
    let mut uneven: Vec<f64> = paces.iter().map(|p| (p - middle).abs()).collect();
    let uneven = super::log::median(&mut uneven);
    Some(Candidate {
        arcs,
        frame,
        off: places * (1.0 + 3.0 * uneven) + 1e-3 * way.length() * uneven,
    })
}

/// Samples laid on the nearest points of the path, again and again.
fn refined(
    log: &Log,
    ruled: &Ruled,
    way: &Way,
    from: Candidate,
    freedom: Freedom,
) -> Option<Projected> {
    const TIMES: usize = 6;
    let slack = 0.01 * way.length();
    let samples = ruled.sample(from.arcs[0])..ruled.sample(from.arcs[1] + slack) + 1;
    let samples = samples.start..samples.end.min(log.places.len());
    let mut expected: Vec<f64> = Vec::with_capacity(samples.len());
    let mut at = 0;
    for i in samples.clone() {
        while at + 1 < ruled.samples.len() && ruled.samples[at + 1] <= i {
            at += 1;
        }
        let share = (ruled.arcs[at] - from.arcs[0]) / (from.arcs[1] - from.arcs[0]);
        expected.push(share.clamp(0.0, 1.0) * way.length());
    }
    let every = samples.len().div_ceil(4000).max(1);
    let mut frame = from.frame;
    for round in 0..TIMES {
        let width = way.length() * if round < 2 { 0.06 } else { 0.03 };
        let arc = |place: DVec3, expected: f64| {
            let window = [expected - width, expected + width].map(|a| a.clamp(0.0, way.length()));
            way.project(place, window)
        };
        if round + 1 == TIMES {
            let all = samples.clone().zip(&expected);
            let arcs: Vec<f64> = all
                .map(|(i, s)| arc(frame.point(log.places[i]), *s))
                .collect();
            let off = samples.clone().zip(&arcs);
            let off = off.map(|(i, s)| frame.point(log.places[i]).distance(way.at(*s)));
            return Some(Projected {
                off: off.collect(),
                samples,
                arcs,
                frame,
            });
        }
        if freedom == Freedom::Same {
            continue;
        }
        let pairs: Vec<(DVec3, DVec3)> = samples
            .clone()
            .zip(&expected)
            .step_by(every)
            .map(|(i, s)| {
                let place = log.places[i];
                (place, way.at(arc(frame.point(place), *s)))
            })
            .collect();
        frame = nearest(&pairs)?;
    }
    None
}
