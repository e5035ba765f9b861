//! Travel speeds that lay as much metal on every square millimetre: where a bead has less room beside it than beads of
//! its layer have on the mean it travels faster, where it has more it travels slower. A bead's room is the part of the layer that is nearer to it
//! than to any other (its Voronoi cell), at a free edge up to 0.45 widths from its axis (walls are 0.9 widths wide,
//! Rouchon 2022, § 4.4). The mean over a layer keeps the nominal speed, so that a layer's metal stays what it was;
//! metal per millimetre goes with the reciprocal of speed at constant wire feed.

use meltpath_base::Reporter;
use meltpath_geometry::Plane;
use meltpath_toolpath::{Channel, Layer, Move, Pass};

use crate::fill::rooms::{Rooms, Side};
use crate::fill::settings::{FillSettings, Paces, Spacing};

/// Samples per bead width along a bead.
const SAMPLES_PER_WIDTH: f64 = 8.0;
/// Length over which room is averaged, to either side with falling weight, bead widths: the pool is longer than wide.
const WINDOW: f64 = 1.0;
/// Speeds come in steps of this ratio, so that the program has few of them.
const STEP: f64 = 1.1;
/// Share of a step by which the best speed leaves the one in force before it changes.
const KEPT: f64 = 0.75;
/// Shortest stretch with a speed of its own, bead widths.
const SHORTEST: f64 = 0.5;

/// Length of a pass at its nominal speed that lays as much metal, mm: moves at twice the speed count half.
///
/// `nominal` is the speed of the pass' profile, mm/s.
pub fn nominal_length(pass: &Pass<'_>, nominal: f64) -> f64 {
    if !pass.says(Channel::Speed) {
        return pass.length();
    }
    (0..pass.move_count())
        .map(|i| {
            let speed = pass.value(Channel::Speed, i).unwrap_or(nominal);
            pass.move_length(i) * nominal / speed
        })
        .sum()
}

/// A short straight piece of a bead.
struct Sample {
    /// Arc length at its ends, mm.
    from: f64,
    to: f64,
    /// Area nearer to it than to any other, mm².
    room: f64,
}

/// The passes of a layer with their speeds, where the settings say which speeds the bead can take. `rooms` are those of its regions.
pub(crate) fn adapted(
    path: Layer,
    rooms: Option<&Rooms>,
    plane: &Plane,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Layer {
    let Some(paces) = settings.paces.filter(|_| is_paced(settings)) else {
        return path;
    };
    if path.is_empty() {
        return path;
    }
    let Some(samples) = rooms.and_then(|rooms| sampled(&path, plane, rooms, settings)) else {
        reporter.warn(
            "speeds-not-adapted",
            "a layer is too large for its beads: they keep one travel speed",
            "split the part, or choose a wider bead",
        );
        return path;
    };
    let all = || samples.iter().flatten();
    let room: f64 = all().map(|s| s.room).sum();
    let mean = room / all().map(|s| s.to - s.from).sum::<f64>();
    let mut paced = Layer::new(path.number, path.height);
    for (pass, samples) in path.passes().zip(&samples) {
        let runs = runs(samples, mean, paces, settings);
        if runs.iter().any(|r| r.level != 0) {
            write(&mut paced, &pass, &runs, paces);
        } else {
            paced.push(pass);
        }
    }
    paced
}

/// Whether beads get speeds of their own.
pub(crate) fn is_paced(settings: &FillSettings) -> bool {
    settings.paces.is_some() && settings.spacing != Spacing::Exact
}

/// The samples of each pass; `None` where a layer is too large for them.
fn sampled(
    path: &Layer,
    plane: &Plane,
    rooms: &Rooms,
    settings: &FillSettings,
) -> Option<Vec<Vec<Sample>>> {
    let step = settings.width / SAMPLES_PER_WIDTH;
    let mut sides = Vec::new();
    let mut passes: Vec<Vec<Sample>> = Vec::new();
    for pass in path.passes() {
        let (points, along) = pass.flatten(settings.tolerance);
        let mut samples = Vec::new();
        for (s, l) in points.windows(2).zip(along.windows(2)) {
            let n = ((l[1] - l[0]) / step).ceil().max(1.0) as u32;
            let at = |k: u32| l[0] + (l[1] - l[0]) * (f64::from(k) / f64::from(n));
            samples.extend((0..n).map(|k| Sample {
                from: at(k),
                to: at(k + 1),
                room: 0.0,
            }));
            sides.push(Side {
                ends: [s[0], s[1]].map(|p| plane.to_local(p).truncate()),
                pieces: n,
            });
        }
        passes.push(samples);
    }
    let all = passes.iter_mut().flatten();
    for (sample, room) in all.zip(rooms.of(&sides)?) {
        sample.room = room;
    }
    Some(passes)
}

/// A stretch with one speed: the nominal one times [`STEP`] to the power of `level`.
#[derive(Clone, Copy)]
struct Run {
    from: f64,
    to: f64,
    level: i32,
}

fn runs(samples: &[Sample], mean: f64, paces: Paces, settings: &FillSettings) -> Vec<Run> {
    let half = WINDOW * settings.width;
    let lowest = (paces.slowest.ln() / STEP.ln()).ceil() as i32;
    let highest = (paces.fastest.ln() / STEP.ln()).floor() as i32;
    let mut runs: Vec<Run> = Vec::new();
    let mut first = 0;
    let mut level = 0;
    for s in samples {
        let middle = 0.5 * (s.from + s.to);
        while samples[first].to <= middle - half {
            first += 1;
        }
        // weights that fall off evenly: cells that enter or leave at the window's ends do not show
        let (mut long, mut room) = (0.0, 0.0);
        for other in samples[first..]
            .iter()
            .take_while(|o| o.from < middle + half)
        {
            let away = (0.5 * (other.from + other.to) - middle).abs();
            let weight = (1.0 - away / half).max(0.0);
            long += weight * (other.to - other.from);
            room += weight * other.room;
        }
        let wanted = (mean * long / room.max(1e-9)).ln() / STEP.ln();
        // a speed is kept until another is clearly better
        if (wanted - f64::from(level)).abs() > KEPT {
            level = (wanted.round() as i32).clamp(lowest.min(0), highest.max(0));
        }
        match runs.last_mut() {
            Some(run) if run.level == level => run.to = s.to,
            _ => runs.push(Run {
                from: s.from,
                to: s.to,
                level,
            }),
        }
    }
    merged(runs, SHORTEST * settings.width)
}

/// Runs shorter than `shortest` joined with the neighbour whose speed is nearer, the shortest first.
fn merged(mut runs: Vec<Run>, shortest: f64) -> Vec<Run> {
    loop {
        let small = runs
            .iter()
            .enumerate()
            .map(|(i, r)| (r.to - r.from, i))
            .filter(|&(long, _)| long < shortest)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i)) = small.filter(|_| runs.len() > 1) else {
            return runs;
        };
        let apart = |j: Option<usize>| {
            j.and_then(|j| runs.get(j))
                .map_or(i32::MAX, |r| (r.level - runs[i].level).abs())
        };
        let (before, after) = (apart(i.checked_sub(1)), apart(Some(i + 1)));
        let run = runs.remove(i);
        if before <= after {
            runs[i - 1].to = run.to;
        } else {
            runs[i].from = run.from;
        }
        // neighbours that have the same speed now are one
        runs.dedup_by(|next, run| {
            let same = next.level == run.level;
            if same {
                run.to = next.to;
            }
            same
        });
    }
}

/// Writes a pass with its moves cut where its speed changes, and the speeds.
fn write(to: &mut Layer, pass: &Pass<'_>, runs: &[Run], paces: Paces) {
    let mut to = to.begin(pass.head, pass.points[0]);
    let mut start = 0.0;
    let mut at = 0;
    for i in 0..pass.move_count() {
        let arc = pass.arc(i);
        let long = pass.move_length(i);
        // cuts within a hundredth of a millimetre of an end would leave moves of no length
        let margin = 0.01_f64.min(0.25 * long);
        let mut done = 0.0;
        while at < runs.len() {
            let left = runs[at].to - start;
            let end = if at + 1 < runs.len() && left < long - margin {
                left
            } else {
                long
            };
            if end - done > margin || end >= long {
                let share = |s: f64| s / long;
                let (a, b) = (pass.points[i], pass.points[i + 1]);
                let point = match &arc {
                    _ if end >= long => b,
                    Some(arc) => arc.at(share(end)),
                    None => a.lerp(b, share(end)),
                };
                let shape = match &arc {
                    Some(arc) => Move::Arc {
                        via: arc.at(share(0.5 * (done + end))),
                    },
                    None => pass.move_at(i),
                };
                let speed = paces.nominal * STEP.powi(runs[at].level);
                to.go(shape, point).set(Channel::Speed, speed);
                done = end;
            }
            if end >= long {
                break;
            }
            at += 1;
        }
        start += long;
    }
}
