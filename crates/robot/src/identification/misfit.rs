//! What the model misses at each start, corner and stop of a log, in place and in speed, beside the noise of the log.

use std::ops::Range;

use meltpath_geometry::math::DVec3;

use super::align::{Aligned, Piece};
use super::driven::{DrivenPath, End, Stretch};
use super::fit::Fitted;
use super::log::Log;
use super::model::{Trace, trace};
use crate::interpolation::fir::MotionError;

/// Speeds are slopes of places over at least so long, s.
const SLOPE: f64 = 0.05;
/// Fewest samples of a slope.
const LEAST: usize = 5;

/// What happens there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// The tool starts from rest.
    Start,
    /// It changes its direction and goes on.
    Corner {
        /// Which smoothing, in [`DrivenPath::smoothings`].
        smoothing: usize,
        /// How far, rad.
        turn: f64,
    },
    /// It comes to rest.
    Stop,
}

/// Greatest and root mean square of something.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Miss {
    /// Root mean square, the share of noise taken off.
    pub rms: f64,
    /// The greatest, noise and all.
    pub most: f64,
}

/// A start, a corner or a stop.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// What it is.
    pub seen: Seen,
    /// Which stretch.
    pub stretch: usize,
    /// Which command of the whole path ends or begins there.
    pub command: usize,
    /// Where, mm in the frame of the path.
    pub place: DVec3,
    /// The programmed speed: of the slower of the two moves, mm/s.
    pub speed: f64,
    /// When the model passes it, s of the log.
    pub time: f64,
    /// Samples round it.
    pub samples: Range<usize>,
    /// Places, mm.
    pub places: Miss,
    /// Speeds over the programmed one, as a share.
    pub speeds: Miss,
    /// Least speed there, mm/s: measured, and of the model.
    pub least: [f64; 2],
    /// How far the tool stays away from the point, mm: measured, and of the model.
    pub away: [f64; 2],
}

/// The log and the model, sample by sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Compared {
    /// Samples of the log.
    pub samples: Vec<usize>,
    /// The log in the frame of the path, mm.
    pub log: Vec<DVec3>,
    /// The model, mm.
    pub model: Vec<DVec3>,
    /// Speed of the log, mm/s.
    pub log_speed: Vec<f64>,
    /// Speed of the model, by the same slopes, mm/s.
    pub model_speed: Vec<f64>,
}

/// What was compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Every start, corner and stop, in the order of the path.
    pub events: Vec<Event>,
    /// Each stretch.
    pub stretches: Vec<Compared>,
    /// Standard deviation of one component of a place of the log, mm.
    pub noise: f64,
    /// That of a speed, mm/s.
    pub speed_noise: f64,
}

/// When a stretch's starts, corners and stops are, and how far round them they reach, s from its begin.
struct Moment {
    seen: Seen,
    command: usize,
    place: DVec3,
    speed: f64,
    time: f64,
    reach: [f64; 2],
}

/// A corner in a log that is laid on its path, before anything is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Owned {
    /// Which smoothing, in [`DrivenPath::smoothings`].
    pub smoothing: usize,
    /// Which command of the whole path ends there.
    pub command: usize,
    /// The samples from the middle of the way to it until the middle of the way from it.
    pub samples: Range<usize>,
}

/// The corners of a path, with the samples that belong to each.
pub fn corners(log: &Log, path: &DrivenPath, aligned: &Aligned) -> Vec<Owned> {
    let mut owners = Vec::new();
    let mut border = 0.0;
    for (stretch, piece) in path.stretches.iter().zip(&aligned.pieces) {
        let mut ends = Vec::new();
        let mut arc = border;
        border += stretch.lengths().iter().sum::<f64>();
        for length in stretch.lengths() {
            arc += length;
            ends.push((arc, length));
        }
        let at = |arc: f64| piece.samples.start + piece.arcs.partition_point(|a| *a < arc);
        let all = ends.iter().zip(&stretch.ends).enumerate();
        for (k, ((arc, length), end)) in all {
            let End::Corner { smoothing, .. } = *end else {
                continue;
            };
            let next = ends.get(k + 1).map_or(*length, |e| e.1);
            let samples = at(arc - 0.5 * length)..at(arc + 0.5 * next).min(log.times.len());
            owners.push(Owned {
                smoothing,
                command: stretch.numbers.start + k,
                samples,
            });
        }
    }
    owners
}

fn moments(stretch: &Stretch, found: &Fitted, trace: &Trace) -> Vec<Moment> {
    let half = 0.75 * found.law.sum;
    let speed = |k: usize| stretch.commands.get(k).map_or(f64::INFINITY, |c| c.speed);
    let mut all = vec![Moment {
        seen: Seen::Start,
        command: stretch.numbers.start,
        place: stretch.start.position,
        speed: speed(0),
        time: 0.0,
        reach: [half, 2.0 * half],
    }];
    for (k, end) in stretch.ends.iter().enumerate() {
        let (seen, reach) = match *end {
            End::Through => continue,
            End::Corner {
                smoothing,
                share,
                turn,
            } => {
                let reach = half + 0.5 * share * found.law.dwells[smoothing];
                (Seen::Corner { smoothing, turn }, [reach; 2])
            }
            End::Stop => (Seen::Stop, [2.0 * half, half]),
        };
        all.push(Moment {
            seen,
            command: stretch.numbers.start + k,
            place: stretch.commands[k].target,
            speed: match seen {
                Seen::Stop => speed(k),
                Seen::Start | Seen::Corner { .. } => speed(k).min(speed(k + 1)),
            },
            time: trace.passages[k],
            reach,
        });
    }
    // none reaches beyond the middle between two
    for k in 1..all.len() {
        let between = 0.5 * (all[k].time - all[k - 1].time);
        all[k - 1].reach[1] = all[k - 1].reach[1].min(between);
        all[k].reach[0] = all[k].reach[0].min(between);
    }
    all
}

/// Slopes of places over time, and by how much noise of 1 mm shows in one.
struct Slopes {
    width: usize,
}

impl Slopes {
    fn new(interval: f64) -> Self {
        let width = (0.5 * SLOPE / interval).ceil() as usize;
        Slopes {
            width: width.max(LEAST / 2),
        }
    }

    /// The speed at a sample, mm/s, and its noise for noise of 1 mm.
    fn at(&self, times: &[f64], places: &[DVec3], i: usize) -> (f64, f64) {
        let low = i.saturating_sub(self.width);
        let high = (i + self.width + 1).min(times.len());
        let n = (high - low) as f64;
        let middle = times[low..high].iter().sum::<f64>() / n;
        let mut square = 0.0;
        let mut moment = DVec3::ZERO;
        for (t, p) in times[low..high].iter().zip(&places[low..high]) {
            square += (t - middle).powi(2);
            moment += *p * (t - middle);
        }
        let square = f64::max(square, 1e-30);
        ((moment / square).length(), 1.0 / square.sqrt())
    }
}

/// Log and model of a stretch.
fn compared(
    log: &Log,
    piece: &Piece,
    found: &Fitted,
    begin: f64,
    trace: &Trace,
) -> (Compared, f64) {
    let samples: Vec<usize> = piece.samples.clone().collect();
    let times: Vec<f64> = samples.iter().map(|i| log.times[*i]).collect();
    let place = |i: &usize| found.frame.point(log.places[*i]);
    let of_log: Vec<DVec3> = samples.iter().map(place).collect();
    let of_model: Vec<DVec3> = times.iter().map(|t| trace.at(t - begin)).collect();
    let slopes = Slopes::new(log.interval());
    let mut noise: f64 = 0.0;
    let (mut log_speed, mut model_speed) = (Vec::new(), Vec::new());
    for i in 0..samples.len() {
        let (speed, of_noise) = slopes.at(&times, &of_log, i);
        noise = noise.max(of_noise);
        log_speed.push(speed);
        model_speed.push(slopes.at(&times, &of_model, i).0);
    }
    let all = Compared {
        samples,
        log: of_log,
        model: of_model,
        log_speed,
        model_speed,
    };
    (all, noise)
}

/// Lays the model that was found beside the log, at every start, corner and stop.
///
/// # Errors
/// [`MotionError`].
pub fn events(
    log: &Log,
    path: &DrivenPath,
    aligned: &Aligned,
    found: &Fitted,
) -> Result<Comparison, MotionError> {
    let noise = log.noise();
    let mut all = Comparison {
        events: Vec::new(),
        stretches: Vec::new(),
        noise,
        speed_noise: 0.0,
    };
    for (k, (stretch, piece)) in path.stretches.iter().zip(&aligned.pieces).enumerate() {
        let trace = trace(stretch, &found.law)?;
        let begin = found.begins[k];
        let (rows, slope) = compared(log, piece, found, begin, &trace);
        all.speed_noise = all.speed_noise.max(slope * noise);
        for moment in moments(stretch, found, &trace) {
            let time = begin + moment.time;
            let [from, to] = [time - moment.reach[0], time + moment.reach[1]];
            let at = |time: f64| {
                let i = log.from(time).clamp(piece.samples.start, piece.samples.end);
                i - piece.samples.start
            };
            let rows_of = at(from)..at(to);
            if rows_of.len() < 3 {
                continue;
            }
            all.events.push(event(
                &rows,
                rows_of,
                &moment,
                (k, time),
                noise,
                slope * noise,
            ));
        }
        all.stretches.push(rows);
    }
    Ok(all)
}

/// One of them.
fn event(
    rows: &Compared,
    of: Range<usize>,
    moment: &Moment,
    (stretch, time): (usize, f64),
    noise: f64,
    speed_noise: f64,
) -> Event {
    let n = of.len() as f64;
    let off = |i: usize| rows.log[i].distance(rows.model[i]);
    let slow = |i: usize| (rows.log_speed[i] - rows.model_speed[i]) / moment.speed;
    let miss = |value: &dyn Fn(usize) -> f64, noise: f64| {
        let mean = of.clone().map(|i| value(i).powi(2)).sum::<f64>() / n;
        Miss {
            rms: (mean - noise * noise).max(0.0).sqrt(),
            most: of.clone().map(|i| value(i).abs()).fold(0.0, f64::max),
        }
    };
    let least = |all: &[f64]| {
        all[of.clone()]
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min)
    };
    let nearest = |all: &[DVec3]| {
        let all = all[of.clone()].iter().map(|p| p.distance(moment.place));
        all.fold(f64::INFINITY, f64::min)
    };
    Event {
        seen: moment.seen,
        stretch,
        command: moment.command,
        place: moment.place,
        speed: moment.speed,
        time,
        // noise has three components
        places: miss(&off, noise * 3.0_f64.sqrt()),
        speeds: miss(&slow, speed_noise / moment.speed),
        least: [least(&rows.log_speed), least(&rows.model_speed)],
        away: [nearest(&rows.log), nearest(&rows.model)],
        samples: rows.samples[of.start]..rows.samples[of.end - 1] + 1,
    }
}
