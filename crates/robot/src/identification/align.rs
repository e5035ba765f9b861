//! Which part of a log is its path, where its frame lies, and when each stretch begins.

use std::ops::Range;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::driven::{DrivenPath, Stretch};
use super::frame::Freedom;
use super::log::{GAP, Log, LogError, median};
use super::projection::{Projected, Ruled, Way, project};

/// A tool that stands for longer inside a stretch was stopped, s: no corner lasts so long.
const STANDS: f64 = 1.0;
/// How far the pace of a log may be from the programmed one, as a share.
const PACE: f64 = 0.03;
/// Rest before and behind a stretch that belongs to it, s.
const REST: f64 = 0.4;

/// Why log and path cannot be laid on each other.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AlignError {
    /// The log itself.
    #[error(transparent)]
    Log(#[from] LogError),

    /// Another unit.
    #[error(
        "the log spans {log:.4} and the path {path:.1} mm, its size times {ratio:.3}: tell the unit of the log's places (unit = \"{unit}\")"
    )]
    Unit {
        /// Size of the log, in its numbers.
        log: f64,
        /// Size of the path, mm.
        path: f64,
        /// One over the other.
        ratio: f64,
        /// What it may be.
        unit: &'static str,
    },
    /// Not the whole path.
    #[error(
        "the log goes {log:.1} mm and the path is {path:.1} mm long: log the whole run of this path, or name the path that was driven"
    )]
    Short {
        /// Way of the log, mm.
        log: f64,
        /// Length of the path, mm.
        path: f64,
    },
    /// A path on a line.
    #[error(
        "the path lies on a line, by which the frame of the log cannot be found: drive a path with corners, or log in the path's own frame and write frame = \"same\""
    )]
    Line,
    /// Elsewhere.
    #[error(
        "log and path do not belong together: half of the samples lie more than {half:.2} mm beside the path, and {most:.1} mm at line {line} ({time:.3} s), where the path is at x {:.1}, y {:.1}, z {:.1} mm: {remedy}", place[0], place[1], place[2]
    )]
    Apart {
        /// Median distance, mm.
        half: f64,
        /// The greatest, mm.
        most: f64,
        /// Line of the log there.
        line: usize,
        /// Its time, s.
        time: f64,
        /// Where the path is.
        place: [f64; 3],
        /// What to do.
        remedy: &'static str,
    },
    /// Another pace.
    #[error("the tool goes at {percent:.1} % of the programmed speeds: {remedy}")]
    Pace {
        /// Measured over programmed, %.
        percent: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A stop that is not in the path.
    #[error(
        "the tool stands for {seconds:.2} s from line {line} on ({time:.3} s), near x {:.1}, y {:.1}, z {:.1} mm, where the path has no stop: drive it again without a hold, or tell the stop in the path", place[0], place[1], place[2]
    )]
    Stands {
        /// How long, s.
        seconds: f64,
        /// Line of the log.
        line: usize,
        /// Its time, s.
        time: f64,
        /// Where.
        place: [f64; 3],
    },
}

/// A stretch in the log.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Its samples.
    pub samples: Range<usize>,
    /// How far along the whole path each lies, mm.
    pub arcs: Vec<f64>,
    /// When the middle of its longest move is passed, s.
    pub middle: f64,
    /// The time from its begin to there as the program sets it, without dwells, s.
    pub nominal: f64,
    /// Which move that is.
    pub longest: usize,
}

/// A log laid on its path.
#[derive(Debug, Clone, PartialEq)]
pub struct Aligned {
    /// The path's frame from the log's.
    pub frame: Pose,
    /// Each stretch.
    pub pieces: Vec<Piece>,
    /// Measured pace over the programmed one.
    pub pace: f64,
    /// Median distance of samples from the path, mm.
    pub off: f64,
}

/// Diagonal of the box round points, mm.
fn extent(points: impl Iterator<Item = DVec3>) -> f64 {
    let around = |(low, high): (DVec3, DVec3), p: DVec3| (low.min(p), high.max(p));
    let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), around);
    low.distance(high)
}

/// Lays a log on its path.
///
/// # Errors
/// [`AlignError`].
pub fn align(log: &Log, path: &DrivenPath, freedom: Freedom) -> Result<Aligned, AlignError> {
    log.check()?;
    let way = Way::new(path);
    let size = extent(path.stretches.iter().flat_map(Stretch::chords));
    let spans = extent(log.places.iter().copied());
    let ratio = size / spans.max(1e-12);
    for (times, unit) in [(1000.0, "m"), (25.4, "in"), (10.0, "cm")] {
        // the log may hold more than the path, hardly twice as much
        if (0.4..1.1).contains(&(ratio / times)) {
            return Err(AlignError::Unit {
                log: spans,
                path: size,
                ratio,
                unit,
            });
        }
    }
    let ruler = (8.0 * log.noise()).max(0.1).max(way.length() / 20_000.0);
    let ruled = Ruled::new(log, ruler);
    if ruled.length() < 0.85 * way.length() {
        return Err(AlignError::Short {
            log: ruled.length(),
            path: way.length(),
        });
    }
    let speeds = paces(path, &way);
    let found = project(log, &ruled, &way, &speeds, freedom).ok_or(AlignError::Line)?;
    together(log, &way, &found, freedom)?;
    complete(log, &found)?;
    let pieces = pieces(log, path, &way, &found, 2.0 * ruler);
    let pace = pace(log, path, &way, &found);
    if (pace - 1.0).abs() > PACE {
        return Err(AlignError::Pace {
            percent: 100.0 * pace,
            remedy: if (0.01..=20.0).contains(&pace) {
                "drive at 100 % override, and name the path with the speeds that were driven"
            } else {
                "are the log's times in seconds? tell their unit (time_unit)"
            },
        });
    }
    stands(log, &way, &found, 2.0 * ruler)?;
    let mut off = found.off.clone();
    Ok(Aligned {
        frame: found.frame,
        pieces,
        pace,
        off: median(&mut off),
    })
}

/// The programmed speed at an arc.
fn paces(path: &DrivenPath, way: &Way) -> impl Fn(f64) -> f64 + use<> {
    let mut ends = Vec::new();
    for (stretch, begin) in path.stretches.iter().zip(&way.borders) {
        let mut arc = *begin;
        for (length, command) in stretch.lengths().into_iter().zip(&stretch.commands) {
            arc += length;
            ends.push((arc, command.speed));
        }
    }
    move |arc: f64| {
        let at = ends.partition_point(|(end, _)| *end < arc);
        ends.get(at).or(ends.last()).map_or(1.0, |e| e.1)
    }
}

/// Whether samples lie on the path at all.
fn together(log: &Log, way: &Way, found: &Projected, freedom: Freedom) -> Result<(), AlignError> {
    const BESIDE: f64 = 1.0;
    let half = median(&mut found.off.clone());
    let worst = (0..found.off.len()).max_by(|a, b| found.off[*a].total_cmp(&found.off[*b]));
    let worst = worst.unwrap_or(0);
    let most = found.off[worst];
    let limit = BESIDE.max(6.0 * log.noise());
    // a corner is cut by less than its legs are long; beside straight parts nothing is
    if half <= limit && most <= (20.0 * limit).min(0.25 * way.length()) {
        return Ok(());
    }
    let sample = found.samples.start + worst;
    Err(AlignError::Apart {
        half,
        most,
        line: log.line(sample),
        time: log.times[sample],
        place: way.at(found.arcs[worst]).to_array(),
        remedy: match freedom {
            Freedom::Same => {
                "is this the log of this path? If it is in another frame, write frame = \"fit\""
            }
            Freedom::Rigid => {
                "is this the log of this path, and of the wire's tip rather than the flange? A log by joints needs the robot's file"
            }
        },
    })
}

/// Whether samples are missing along the path.
fn complete(log: &Log, found: &Projected) -> Result<(), AlignError> {
    let usual = log.interval();
    for i in found.samples.clone().skip(1) {
        let gap = log.times[i] - log.times[i - 1];
        if gap > GAP * usual {
            return Err(LogError::Gap {
                line: log.line(i),
                gap,
                usual,
            }
            .into());
        }
    }
    Ok(())
}

/// Whether the tool stands where the path does not.
fn stands(log: &Log, way: &Way, found: &Projected, near: f64) -> Result<(), AlignError> {
    let mut at = 0;
    for i in 1..found.arcs.len() {
        if found.arcs[i] - found.arcs[at] > near {
            at = i;
        }
        let arc = found.arcs[i];
        let time = |k: usize| log.times[found.samples.start + k];
        let seconds = time(i) - time(at);
        let stop = way.borders.iter().any(|b| (b - arc).abs() <= 2.0 * near);
        if stop {
            at = i;
            continue;
        }
        let next = found.arcs.get(i + 1);
        let goes_on = next.is_none_or(|next| next - found.arcs[at] > near);
        if seconds > STANDS && goes_on {
            let sample = found.samples.start + at;
            return Err(AlignError::Stands {
                seconds,
                line: log.line(sample),
                time: log.times[sample],
                place: way.at(arc).to_array(),
            });
        }
    }
    Ok(())
}

/// The measured pace over the programmed one: the median over the middles of moves that last a while.
fn pace(log: &Log, path: &DrivenPath, way: &Way, found: &Projected) -> f64 {
    let mut all = Vec::new();
    for (stretch, begin) in path.stretches.iter().zip(&way.borders) {
        let mut arc = *begin;
        for (length, command) in stretch.lengths().into_iter().zip(&stretch.commands) {
            let [from, to] = [0.35, 0.65].map(|s| found.reaches(arc + s * length));
            arc += length;
            let time = log.times[to] - log.times[from];
            let at = |sample: usize| found.arcs[sample - found.samples.start];
            if time > 0.0 {
                let ratio = (at(to) - at(from)) / time / command.speed;
                // long moves count as often as they are long
                let times = (length / command.speed / 0.5).ceil().min(50.0) as usize;
                all.extend(std::iter::repeat_n(ratio, times));
            }
        }
    }
    if all.is_empty() {
        1.0
    } else {
        median(&mut all)
    }
}

/// Each stretch, with the rest before and behind it.
fn pieces(log: &Log, path: &DrivenPath, way: &Way, found: &Projected, near: f64) -> Vec<Piece> {
    let span = found.samples.clone();
    // when the tool comes to each stop, and when it leaves it
    let stops: Vec<[f64; 2]> = way
        .borders
        .iter()
        .map(|border| {
            let [come, leave] = [border - near, border + near].map(|a| log.times[found.reaches(a)]);
            if *border <= 0.0 {
                [leave - 2.0 * REST, leave]
            } else if *border >= way.length() {
                [come, come + 2.0 * REST]
            } else {
                [come, leave]
            }
        })
        .collect();
    let mut pieces = Vec::new();
    for (k, stretch) in path.stretches.iter().enumerate() {
        let [before, leave] = stops[k];
        let [come, after] = stops[k + 1];
        let from = log.from(leave - REST.min(0.5 * (leave - before)));
        let to = log.from(come + REST.min(0.5 * (after - come)));
        let begin = way.at(way.borders[k]);
        let from = at_rest(log, found.frame, begin, near, (from, log.from(leave)));
        let samples = from..to.max(from + 1).min(log.times.len());
        let arcs = samples.clone().map(|i| {
            let i = i.clamp(span.start, span.end - 1);
            found.arcs[i - span.start]
        });
        let (mut arc, mut time) = (way.borders[k], 0.0);
        let mut longest = (0.0, 0.0, 0.0, 0);
        for (n, (length, command)) in stretch
            .lengths()
            .into_iter()
            .zip(&stretch.commands)
            .enumerate()
        {
            let lasts = length / command.speed;
            if lasts > longest.0 {
                longest = (lasts, arc + 0.5 * length, time + 0.5 * lasts, n);
            }
            arc += length;
            time += lasts;
        }
        pieces.push(Piece {
            arcs: arcs.collect(),
            samples,
            middle: log.times[found.reaches(longest.1)],
            nominal: longest.2,
            longest: longest.3,
        });
    }
    pieces
}

/// The first of the samples from which on the tool stays at a stop: before, it came from elsewhere.
fn at_rest(log: &Log, frame: Pose, stop: DVec3, near: f64, (from, to): (usize, usize)) -> usize {
    let away = |i: &usize| frame.point(log.places[*i]).distance(stop) > 2.0 * near;
    (from..to).rev().find(away).map_or(from, |i| i + 1)
}
