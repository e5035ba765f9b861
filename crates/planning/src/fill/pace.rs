//! Travel speeds that lay as much metal on every square millimetre: where a bead has less room beside it than beads of
//! its layer have on the mean it travels faster, where it has more it travels slower. A bead's room is the part of the layer that is nearer to it
//! than to any other (its Voronoi cell), at a free edge up to 0.45 widths from its axis (walls are 0.9 widths wide,
//! Rouchon 2022, § 4.4). The mean over a layer keeps the nominal speed, so that a layer's metal stays what it was;
//! metal per millimetre goes with the reciprocal of speed at constant wire feed.

use meltpath_base::Reporter;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::inset;
use meltpath_geometry::raster::{Grid, Mask, rasterise};
use meltpath_geometry::{Plane, Region, segments};
use meltpath_toolpath::{Channel, Layer, Move, Pass};

use crate::fill::outline::turned;
use crate::fill::settings::{FillSettings, Paces, Spacing};

/// Cells of the grid per bead width.
const CELLS_PER_WIDTH: f64 = 12.0;
/// Fewest cells per bead width that still tell rooms apart.
const FEWEST_PER_WIDTH: f64 = 5.0;
/// Largest number of cells.
const MOST_CELLS: f64 = 1.6e7;
/// Samples per bead width along a bead.
const SAMPLES_PER_WIDTH: f64 = 8.0;
/// Length over which room is averaged, to either side with falling weight, bead widths: the pool is longer than wide.
const WINDOW: f64 = 1.0;
/// A free edge of the metal lies this far from a bead's axis, bead widths.
const FREE_EDGE: f64 = 0.45;
/// Room farther from a bead than this is nobody's, bead widths.
const REACH: f64 = 0.75;
/// The grid lies turned against the layer by the angle whose tangent is the golden section: along straight sides, most often
/// parallel to an axis, cells then count their share and no row more or less.
const GRID_TURN: f64 = 0.553_574_358_897_045_3;
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
    pass: usize,
    /// The straight side that it is a piece of, all as long, counted over the layer.
    side: usize,
    a: DVec2,
    b: DVec2,
    /// Arc length at `a` and `b`, mm.
    from: f64,
    to: f64,
    /// Area nearer to it than to any other, mm².
    room: f64,
}

/// The passes of a layer with their speeds, where the settings say which speeds the bead can take.
pub(crate) fn adapted(
    path: Layer,
    regions: &[Region],
    plane: &Plane,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Result<Layer, PlanarError> {
    let Some(paces) = settings.paces else {
        return Ok(path);
    };
    if settings.spacing == Spacing::Exact || path.is_empty() {
        return Ok(path);
    }
    let mut samples = sampled(&path, plane, settings);
    let Some(grid) = grid(&samples, settings) else {
        reporter.warn(
            "speeds-not-adapted",
            "a layer is too large for its beads: they keep one travel speed",
            "split the part, or choose a wider bead",
        );
        return Ok(path);
    };
    let fed_to = inset(regions, (0.5 - FREE_EDGE) * settings.width, settings.join())?;
    let fed = rasterise(&turned(&fed_to, GRID_TURN), &grid);
    share_out(&mut samples, &grid, &fed, settings);
    let room: f64 = samples.iter().map(|s| s.room).sum();
    let mean = room / samples.iter().map(|s| s.to - s.from).sum::<f64>();
    let mut first = 0;
    let mut paced = Layer::new(path.number, path.height);
    for (i, pass) in path.passes().enumerate() {
        let count = samples[first..].iter().take_while(|s| s.pass == i).count();
        let runs = runs(&samples[first..first + count], mean, paces, settings);
        first += count;
        if runs.iter().any(|r| r.level != 0) {
            write(&mut paced, &pass, &runs, paces);
        } else {
            paced.push(pass);
        }
    }
    Ok(paced)
}

fn sampled(path: &Layer, plane: &Plane, settings: &FillSettings) -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut side = 0;
    let turn = DVec2::from_angle(GRID_TURN);
    let step = settings.width / SAMPLES_PER_WIDTH;
    for (i, pass) in path.passes().enumerate() {
        let (points, along) = pass.flatten(settings.tolerance);
        for (s, l) in points.windows(2).zip(along.windows(2)) {
            let [p, q] = [s[0], s[1]].map(|p| turn.rotate(plane.to_local(p).truncate()));
            let n = ((l[1] - l[0]) / step).ceil().max(1.0) as usize;
            let at = |k: usize| k as f64 / n as f64;
            samples.extend((0..n).map(|k| Sample {
                pass: i,
                side,
                a: p.lerp(q, at(k)),
                b: p.lerp(q, at(k + 1)),
                from: l[0] + (l[1] - l[0]) * at(k),
                to: l[0] + (l[1] - l[0]) * at(k + 1),
                room: 0.0,
            }));
            side += 1;
        }
    }
    samples
}

fn grid(samples: &[Sample], settings: &FillSettings) -> Option<Grid> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for s in samples {
        low = low.min(s.a).min(s.b);
        high = high.max(s.a).max(s.b);
    }
    let size = high - low + 2.0 * REACH * settings.width;
    let cell = (settings.width / CELLS_PER_WIDTH).max((size.x * size.y / MOST_CELLS).sqrt());
    (cell <= settings.width / FEWEST_PER_WIDTH).then(|| Grid {
        origin: low - REACH * settings.width,
        cell,
        nx: (size.x / cell).ceil() as usize + 1,
        ny: (size.y / cell).ceil() as usize + 1,
    })
}

/// Gives every cell to the sample nearest to it, of equal ones the first.
fn share_out(samples: &mut [Sample], grid: &Grid, fed: &Mask, settings: &FillSettings) {
    let reach = REACH * settings.width;
    let own = FREE_EDGE * settings.width;
    let mut nearest = vec![(f32::INFINITY, u32::MAX); grid.nx * grid.ny];
    let mut first = 0;
    for straight in samples.chunk_by(|one, next| one.side == next.side) {
        // long ones in pieces: a box round a slanting line is mostly empty
        for piece in straight.chunks(2 * SAMPLES_PER_WIDTH as usize) {
            let (a, b) = (piece[0].a, piece[piece.len() - 1].b);
            let way = b - a;
            let square = way.length_squared();
            for (iy, row) in grid.rows_beside(a, b, reach) {
                for ix in row {
                    let p = grid.origin + DVec2::new(ix as f64, iy as f64) * grid.cell;
                    let share = segments::nearest_share((p - a).dot(way), square);
                    let away = p.distance_squared(a.lerp(b, share)) as f32;
                    let cell = &mut nearest[iy * grid.nx + ix];
                    if away < cell.0 {
                        let of_piece = (share * piece.len() as f64) as usize;
                        *cell = (away, (first + of_piece.min(piece.len() - 1)) as u32);
                    }
                }
            }
            first += piece.len();
        }
    }
    // the runs of a row come in order: one look at each cell
    for (iy, row) in nearest.chunks_exact(grid.nx).enumerate() {
        let mut runs = fed.rows.get(iy).into_iter().flatten().peekable();
        for (ix, &(away, owner)) in row.iter().enumerate() {
            if away == f32::INFINITY {
                continue;
            }
            while runs.next_if(|run| run.1 as usize <= ix).is_some() {}
            let mut is_fed = || runs.peek().is_some_and(|run| run.0 as usize <= ix);
            let away = f64::from(away);
            // beside a narrow section a bead feeds what it would anywhere
            if away <= own * own || (away <= reach * reach && is_fed()) {
                samples[owner as usize].room += grid.cell * grid.cell;
            }
        }
    }
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
