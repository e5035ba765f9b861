//! Records of made-up controllers, by other formulas than the library's: two averages in closed form, and trapezoids of speed with parabolas
//! round corners.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_numerics::random::Random;
use meltpath_robot::identification::Log;

/// A point that the path leads to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) place: DVec3,
    /// Speed of the way to it, mm/s.
    pub(super) speed: f64,
    /// What the controller does there: the dwell of two averages, s, or the radius of a blend, mm; nothing for a stop.
    pub(super) passes: Option<f64>,
    /// How long the program waits there, s.
    pub(super) wait: f64,
}

/// The tool in time, from the begin of the first move on, and how long it takes.
pub(super) struct Drive {
    pub(super) place: Box<dyn Fn(f64) -> DVec3>,
    pub(super) duration: f64,
}

/// The third integral of a step.
fn cubic(t: f64) -> f64 {
    t.max(0.0).powi(3) / 6.0
}

/// Two moving averages over rectangles of speed: each rectangle is the difference of two ramps, and a ramp averaged twice is four cubics.
pub(super) fn two_averages(start: DVec3, corners: &[Corner], [t1, t2]: [f64; 2]) -> Drive {
    let ramp =
        move |t: f64| (cubic(t) - cubic(t - t1) - cubic(t - t2) + cubic(t - t1 - t2)) / (t1 * t2);
    let mut pulses: Vec<(DVec3, [f64; 2])> = Vec::new();
    let (mut from, mut time) = (start, 0.0);
    for corner in corners {
        let way = corner.place - from;
        let lasts = way.length() / corner.speed;
        pulses.push((way / lasts, [time, time + lasts]));
        time += lasts + corner.passes.unwrap_or(t1 + t2) + corner.wait;
        from = corner.place;
    }
    let place = move |t: f64| {
        let gone = |(velocity, [begin, end]): &(DVec3, [f64; 2])| {
            *velocity * (ramp(t - begin) - ramp(t - end))
        };
        start + pulses.iter().map(gone).sum::<DVec3>()
    };
    Drive {
        place: Box::new(place),
        duration: time,
    }
}

/// Trapezoids of speed, speeding up at `acceleration` mm/s², and a parabola from a radius before each corner to a radius behind it.
pub(super) fn blended(start: DVec3, corners: &[Corner], acceleration: f64) -> Drive {
    // pieces of constant acceleration: begin, place, velocity, acceleration
    let mut pieces: Vec<(f64, DVec3, DVec3, DVec3)> = Vec::new();
    let (mut time, mut place, mut from) = (0.0, start, start);
    let mut rests = true;
    for (k, corner) in corners.iter().enumerate() {
        let along = (corner.place - from).normalize();
        let speed = corner.speed;
        let ramp = speed / acceleration;
        if rests {
            pieces.push((time, place, DVec3::ZERO, along * acceleration));
            time += ramp;
            place += along * (0.5 * speed * ramp);
        }
        let next = corners
            .get(k + 1)
            .map(|n| (n.place - corner.place).normalize());
        let (radius, lasts) = match corner.passes.zip(next) {
            Some((radius, _)) => (radius, 2.0 * radius / speed),
            None => (0.5 * speed * ramp, ramp),
        };
        let leaves = corner.place - along * radius;
        pieces.push((time, place, along * speed, DVec3::ZERO));
        time += place.distance(leaves) / speed;
        let after = corner.passes.and(next).map_or(DVec3::ZERO, |n| n * speed);
        let bend = (after - along * speed) / lasts.max(1e-9);
        pieces.push((time, leaves, along * speed, bend));
        time += lasts;
        rests = after == DVec3::ZERO;
        place = if rests {
            pieces.push((time, corner.place, DVec3::ZERO, DVec3::ZERO));
            time += corner.wait;
            corner.place
        } else {
            corner.place + after.normalize() * radius
        };
        from = corner.place;
    }
    let at = move |t: f64| {
        let n = pieces.partition_point(|p| p.0 <= t);
        let Some((begin, place, velocity, bend)) = n.checked_sub(1).map(|n| pieces[n]) else {
            return start;
        };
        let t = t - begin;
        place + velocity * t + bend * (0.5 * t * t)
    };
    Drive {
        place: Box::new(at),
        duration: time,
    }
}

/// How a log is written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Logging {
    /// Time between samples, s.
    pub(super) every: f64,
    /// Standard deviation of a component, mm.
    pub(super) noise: f64,
    /// The log's frame from the path's.
    pub(super) frame: Pose,
    pub(super) seed: u64,
}

/// The log of a drive, from a while before it until a while after it.
pub(super) fn sampled(drive: &Drive, logging: Logging) -> Log {
    let mut random = Random::new(logging.seed);
    let shift = random.between(0.0, logging.every);
    let mut log = Log::default();
    let count = ((drive.duration + 1.6) / logging.every) as usize;
    for i in 0..count {
        let time = i as f64 * logging.every;
        let at = logging.frame.point((drive.place)(time + shift - 0.8));
        let noise = DVec3::from_array([0; 3].map(|_| random.normal())) * logging.noise;
        log.times.push(37.0 + time);
        log.places.push(at + noise);
        log.lines.push(i + 2);
    }
    log
}
