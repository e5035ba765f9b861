//! What layers cost on the solver for whole layers as the judge uses it: computing, memory, heat.
//!
//! `layer_cost 10 50` draws the lines of squares of 10 and 50 mm; `layer_cost cube 50 0.24` a cube of 10 mm, its first 50 layers on
//! cells of 0.24 mm, each on what those below left warm. One thread, so that seconds are those of a core; `threads 2 10` takes two,
//! and tells what passed on the clock;
//! `cell 0.06 10` draws on cells of 60 µm.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a measurement that fails stops here; its figures are what it is for"
)]

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use meltpath_base::{Observer, Silent};
use meltpath_melt_strategy::bed::{Between, Body, Domain, Reading, Resolution};
use meltpath_melt_strategy::judgement::{Drawn, judge};
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::material::file::{Readings, read};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Face, State};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |n: usize| words.get(n).and_then(|w| w.parse::<f64>().ok());
    if words.first().is_some_and(|w| w == "threads") {
        let (threads, side) = number(1).zip(number(2)).unwrap_or((2.0, 10.0));
        cost_of(side, FINE, threads as usize);
    } else if words.first().is_some_and(|w| w == "cell") {
        let (cell, side) = number(1).zip(number(2)).unwrap_or((2.0 * FINE, 10.0));
        cost_of(side, cell, 1);
    } else if words.first().is_some_and(|w| w == "cube") {
        let (layers, cell) = number(1).zip(number(2)).unwrap_or((3.0, 0.24));
        cube(layers as usize, cell);
    } else {
        for side in (0..words.len()).filter_map(number) {
            cost_of(side, FINE, 1);
        }
    }
}

/// Ti6Al4V of the thesis.
pub(crate) fn titanium() -> Material {
    let text = meltpath_data::materials::TI6AL4V_EBM.text;
    read(text, Readings::default()).unwrap()
}

/// Usual cells, mm.
pub(crate) const FINE: f64 = 0.03;
/// Distance of lines, mm.
const APART: f64 = 0.1;
const SPEED: f64 = 980.0;
/// Furthest that a half space is drawn where heat is remembered, mm; that of the application.
const FAR: f64 = 32.0;

/// Seconds that this process has computed, all threads; none where the system does not tell.
fn computed() -> f64 {
    let file = Path::new("/proc/self/stat");
    if !file.exists() {
        return f64::NAN;
    }
    let text = std::fs::read_to_string(file).unwrap();
    // behind the name: the 12th and 13th are hundredths of a second, in the user's code and in the kernel's
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split(' ').collect();
    let ticks = |n: usize| fields[n].parse::<f64>().unwrap();
    0.01 * (ticks(12) + ticks(13))
}

/// The most memory that this process held, MiB; none where the system does not tell.
fn peak_memory() -> f64 {
    let file = Path::new("/proc/self/status");
    if !file.exists() {
        return f64::NAN;
    }
    let text = std::fs::read_to_string(file).unwrap();
    let line = text.lines().find(|l| l.starts_with("VmHWM")).unwrap();
    let kib = line.split_whitespace().nth(1).unwrap();
    kib.parse::<f64>().unwrap() / 1024.0
}

/// Lines to and fro over a square, along x or along y.
fn square(side: f64, along_y: bool) -> BeamPath {
    let lines = (side / APART).round() as usize;
    let corners: Vec<[f64; 2]> = (0..lines)
        .flat_map(|n| {
            let y = (n as f64 + 0.5) * APART;
            let ends = [[0.0, y], [side, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .map(|[x, y]| if along_y { [y, x] } else { [x, y] })
        .collect();
    BeamPath::along(&corners, SPEED, BeamPoint::start(300.0, 0.413_67)).unwrap()
}

/// Tells every twentieth of a path what it has cost so far: a long one may be broken off.
struct Told {
    begun: f64,
    total: AtomicU64,
    done: AtomicU64,
    length: f64,
}

impl Told {
    fn new(length: f64) -> Self {
        Told {
            begun: computed(),
            total: AtomicU64::new(0),
            done: AtomicU64::new(0),
            length,
        }
    }
}

impl Observer for Told {
    fn stage(&self, _: &str, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
    }

    fn advance(&self, more: u64) {
        let before = self.done.fetch_add(more, Ordering::Relaxed);
        let total = self.total.load(Ordering::Relaxed).max(1);
        let part = |done: u64| 20 * done / total;
        if self.length > 5e3 && part(before + more) > part(before) {
            let drawn = self.length * (before + more) as f64 / total as f64;
            let seconds = computed() - self.begun;
            println!(
                "  {:.2} m: {seconds:.0} CPU-s, {:.4} per mm, {:.0} MiB at most",
                1e-3 * drawn,
                seconds / drawn,
                peak_memory()
            );
        }
    }

    fn cancelled(&self) -> bool {
        false
    }
}

/// How far heat goes in `time` s, mm.
fn reach(time: f64) -> f64 {
    let material = titanium();
    let diffusivity =
        material.conductivity(material.solidus) / material.heat_capacity(material.solidus - 1.0);
    (2.5 * (diffusivity * time).sqrt()).max(Domain::NARROW.below)
}

/// Draws paths on metal, each on what those before left, on some threads. Where layers follow each other the bed is held at the
/// start temperature: it radiates what it does above that.
fn drawn(
    paths: &[BeamPath],
    [cell, reach]: [f64; 2],
    (between, threads): (Option<Between>, usize),
    observer: &dyn Observer,
) -> Drawn {
    let material = titanium();
    let beam = Beam {
        efficiency: 0.9,
        depth: Depth::Falling { penetration: 0.1 },
    };
    let body = Body {
        material: &material,
        beam: &beam,
        layer: 0.05,
        reading: Reading::LayerMean,
        ground: &|_| State::Dense,
        beyond: Face::Imposed(material.start),
        surface: Surface::Evaporating {
            surroundings: match between {
                Some(_) => material.start,
                None => 300.0 + CELSIUS,
            },
            ambient: 0.2,
        },
        between,
        kept: None,
    };
    let resolution = Resolution {
        cell,
        planes: 1,
        step: 2e-5,
        domain: Domain {
            below: reach,
            beside: reach,
        },
        power: 1.0,
    };
    let (last, lower) = paths.split_last().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.build().unwrap();
    pool.install(|| judge(&body, lower, last, &resolution, observer))
        .unwrap()
}

/// The lines of a square: what they cost.
pub(crate) fn cost_of(side: f64, cell: f64, threads: usize) {
    let path = square(side, false);
    let (length, reach) = (SPEED * path.end(), reach(path.end()));
    let (begun, clock) = (computed(), Instant::now());
    let drawn = drawn(
        std::slice::from_ref(&path),
        [cell, reach],
        (None, threads),
        &Told::new(length),
    );
    let (seconds, passed) = (computed() - begun, clock.elapsed().as_secs_f64());
    println!(
        "{side} x {side} mm on cells of {:.0} µm, {:.3} m of path in {:.3} s of process, half space of {reach:.1} mm: {passed:.1} s on {threads} thread(s), {seconds:.1} CPU-s, {:.4} per mm, {:.1} million updates per mm; {:.0} MiB at most; heat not accounted for {:.1e}; vapour takes {:.1} %",
        1e3 * cell,
        1e-3 * length,
        path.end(),
        seconds / length,
        1e-6 * drawn.updates as f64 / length,
        peak_memory(),
        drawn.residual,
        100.0 * drawn.ledger.vapour_share(),
    );
    assert!(drawn.residual.abs() < 1e-3, "{}", drawn.residual);
    assert!(drawn.highest.largest().0 > titanium().liquidus);
}

/// A cube of 10 mm, `layers` of it 10 s apart, lines crossing; temperatures of the top before each layer, °C.
pub(crate) fn cube(layers: usize, cell: f64) -> Vec<[f64; 2]> {
    let between = Between {
        time: 10.0,
        powder: titanium().start,
    };
    let paths: Vec<BeamPath> = (0..layers).map(|n| square(10.0, n % 2 == 1)).collect();
    let all: f64 = paths.iter().map(|p| p.end() + between.time).sum();
    let begun = computed();
    let drawn = drawn(
        &paths,
        [cell, reach(all).min(FAR)],
        (Some(between), 1),
        &Silent,
    );
    let seconds = computed() - begun;
    for (n, layer) in drawn.layers.iter().enumerate() {
        let [mean, highest] = layer.before.map(|k| k - CELSIUS);
        if n < 3 || n % 5 == 4 {
            println!(
                "layer {}: top {mean:.1} °C in the mean, {highest:.1} °C at most; beam {:.1} J, vapour {:.1} J, radiated {:.1} J, heat not accounted for {:.1e}",
                n + 1,
                layer.ledger.absorbed,
                layer.ledger.evaporated,
                layer.ledger.radiated,
                layer.residual
            );
        }
        assert!(layer.residual.abs() < 1e-3, "{}", layer.residual);
    }
    println!(
        "{layers} layers of 10 x 10 mm, cells of {:.0} µm: {seconds:.0} CPU-s, {:.0} MiB at most; mean of the last layer's peaks {:.1} °C",
        1e3 * cell,
        peak_memory(),
        mean_peak(&drawn) - CELSIUS,
    );
    let tops = drawn.layers.iter().map(|layer| layer.before);
    tops.map(|t| t.map(|k| k - CELSIUS)).collect()
}

/// Mean highest temperature of the last layer well inside the square, K.
fn mean_peak(drawn: &Drawn) -> f64 {
    let grid = &drawn.highest.grid;
    let top = grid.planes() - 1;
    let columns = (0..grid.cells[1]).flat_map(|j| (0..grid.cells[0]).map(move |i| (i, j)));
    let inside = columns.filter(|(i, j)| {
        let c = grid.centre(*i, *j, top);
        (1.0..9.0).contains(&c.x) && (1.0..9.0).contains(&c.y)
    });
    let values: Vec<f64> = inside.map(|(i, j)| drawn.highest.at(i, j, top)).collect();
    values.iter().sum::<f64>() / values.len() as f64
}
