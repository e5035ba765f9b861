//! Single tracks on bare plates of IN625 that NIST measured (AM-Bench 2018-02), on the solver that judges, with the laws themselves.
use crate::support::on_levels;
use meltpath_base::Silent;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::grid::Field;
use meltpath_thermal::grid::sample::Sample;
use meltpath_thermal::levels::{Levels, Setup};
use meltpath_thermal::material::file::{Readings, read};
use meltpath_thermal::material::law::Law;
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::pool::fusion::boiling_number;
use meltpath_thermal::pool::keyhole::{Laser, Mode, keyhole};
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::watch::Watch;
use meltpath_thermal::solver::{Face, State};

/// Where a track is looked at, and where it ends, mm: the pool is steady there.
const LOOK: f64 = 1.0;
const END: f64 = 2.2;
/// How deep highest temperatures are kept, mm.
const KEPT: f64 = 0.12;
/// Temperature at which the cameras' evaluation takes the metal as frozen, and where its cooling rate ends, K.
const FROZEN: f64 = 1290.0 + CELSIUS;
const COOLED: f64 = 1190.0 + CELSIUS;
/// Absorptivity of foils of this alloy while the melt was flat: Ye et al. 2019, table 1.
const MEASURED_ON_FOILS: f64 = 0.28;
/// Pressure of the gas over the plate, Pa.
const GAS: f64 = 1e5;

struct Track {
    name: &'static str,
    /// W, mm/s, spot (four standard deviations) mm.
    beam: [f64; 3],
    /// Width and depth of the section, length on the cameras, µm.
    measured: [f64; 3],
    /// Ours with the shipped absorptivity on cells of 5 µm, as recorded.
    ours: [f64; 3],
    /// What of it is met within 10 %; why the rest is not stands in docs/theory/heat.md.
    met: [bool; 3],
}

const fn track(
    name: &'static str,
    beam: [f64; 3],
    measured: [f64; 3],
    ours: [f64; 3],
    met: [bool; 3],
) -> Track {
    Track {
        name,
        beam,
        measured,
        ours,
        met,
    }
}

/// Lane et al. 2020, table 4; lengths of AMMT by its exposures of 20 µs.
const FIRST: [Track; 3] = [
    track(
        "AMMT B",
        [179.2, 800.0, 0.170],
        [123.0, 36.0, 359.0],
        [143.0, 34.0, 325.6],
        [false, true, true],
    ),
    track(
        "CBM B",
        [195.0, 800.0, 0.100],
        [133.0, 91.0, 780.0],
        [118.0, 37.0, 296.2],
        [false, false, false],
    ),
    track(
        "CBM C",
        [195.0, 1200.0, 0.100],
        [100.0, 60.0, 754.0],
        [107.6, 30.4, 301.8],
        [true, false, false],
    ),
];

/// What was run last, after what is expected of it had been written down.
const LAST: [Track; 3] = [
    track(
        "AMMT A",
        [137.9, 400.0, 0.170],
        [148.0, 42.0, 300.0],
        [155.4, 43.1, 288.3],
        [true, true, true],
    ),
    track(
        "AMMT C",
        [179.2, 1200.0, 0.170],
        [106.0, 30.0, 370.0],
        [126.0, 25.0, 293.7],
        [false, false, false],
    ),
    track(
        "CBM A",
        [150.0, 400.0, 0.100],
        [171.0, 151.0, 659.0],
        [128.8, 45.4, 251.7],
        [false, false, false],
    ),
];

/// AM-Bench 2022-03, single tracks on a bare plate of IN718: case; W, mm/s, spot (four standard deviations) mm; width and depth
/// measured, width and depth of ours as recorded, µm.
type Later = (&'static str, [f64; 3], [f64; 2], [f64; 2]);

/// NIST, measurement and result descriptions of AMB2022-03, table 4 (doi 10.18434/mds2-2718).
const IN718: [Later; 7] = [
    ("0", [285.0, 960.0, 0.067], [136.3, 139.7], [94.5, 30.3]),
    ("1.1", [285.0, 960.0, 0.049], [106.2, 227.2], [78.1, 28.1]),
    ("1.2", [285.0, 960.0, 0.082], [141.7, 102.4], [108.5, 31.6]),
    ("2.1", [285.0, 1200.0, 0.067], [112.9, 109.7], [91.6, 27.3]),
    ("2.2", [285.0, 800.0, 0.067], [156.1, 176.5], [98.2, 32.2]),
    ("3.1", [325.0, 960.0, 0.067], [134.3, 166.1], [97.1, 31.3]),
    ("3.2", [245.0, 960.0, 0.067], [129.4, 116.9], [92.7, 29.0]),
];

/// A bare plate: the layer that the solver lays is metal too.
fn plate(text: &str) -> Material {
    let mut alloy = read(text, Readings::default()).unwrap();
    alloy.powder.relative_density = Law::constant(1.0);
    alloy
}

fn bare() -> Material {
    plate(meltpath_data::materials::IN625_LASER.text)
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Width, depth, length, µm.
    size: [f64; 3],
    /// From freezing on, K/s.
    cooling: f64,
    hottest: f64,
    /// Share of the absorbed heat that vapour takes.
    vapour: f64,
}

fn setup(cell: f64, alloy: &Material) -> Setup {
    let mut heights = vec![cell; (KEPT / cell).round() as usize];
    let (mut height, mut depth) = (cell, KEPT);
    while depth < 0.6 {
        height *= 1.5;
        depth += height;
        heights.push(height);
    }
    heights.reverse();
    let covered = [[-0.4, -0.4], [END + 0.2, 0.4]];
    Setup {
        layer: cell,
        tracked: KEPT,
        top: Surface::Evaporating {
            surroundings: alloy.start,
            ambient: GAS,
        },
        beyond: Face::Imposed(alloy.start),
        ..on_levels(covered, (cell, 4), heights)
    }
}

fn drawn(track: &Track, beam: Beam, cell: f64) -> Seen {
    drawn_on(&bare(), track.beam, beam, cell)
}

fn drawn_on(alloy: &Material, [power, speed, spot]: [f64; 3], beam: Beam, cell: f64) -> Seen {
    let start = BeamPoint::start(power, spot);
    let path = BeamPath::along(&[[0.0, 0.0], [END, 0.0]], speed, start).unwrap();
    let setup = setup(cell, alloy);
    let matter = setup.ground(alloy, &|_| State::Dense);
    let mut levels = Levels::new(setup, alloy.clone(), matter).unwrap();
    // a cell of the uppermost plane, beside the middle of the track
    let watch = Watch {
        places: vec![[LOOK, 1e-4, -0.5 * cell]],
        every: 2e-7,
    };
    levels.draw(&path, &beam, &watch, &Silent).unwrap();
    let corners = [[LOOK - 0.5 * cell, -0.2], [LOOK + 0.5 * cell, 0.2]];
    let section = levels.highest_temperature(corners);
    let samples = levels.watched(corners, Vec::new()).samples;
    let [molten, frozen] = passes(&samples, FROZEN);
    let [_, cooled] = passes(&samples, COOLED);
    let ledger = levels.ledger();
    Seen {
        size: [
            1e3 * width(&section, alloy.liquidus),
            1e3 * depth(&section, alloy.liquidus),
            1e3 * speed * (frozen - molten),
        ],
        cooling: (FROZEN - COOLED) / (cooled - frozen),
        hottest: section.largest().0,
        vapour: ledger.evaporated / ledger.absorbed,
    }
}

/// When the place grows hotter than `kelvin` first, and colder last, s. While it freezes it may pass there more than once.
fn passes(samples: &[Sample], kelvin: f64) -> [f64; 2] {
    let times: Vec<f64> = samples
        .windows(2)
        .filter(|w| (w[0].value > kelvin) != (w[1].value > kelvin))
        .map(|w| {
            let share = (kelvin - w[0].value) / (w[1].value - w[0].value);
            w[0].time + share * (w[1].time - w[0].time)
        })
        .collect();
    let (first, last) = (times[0], times[times.len() - 1]);
    let once = last - times[1] <= 0.02 * (last - first);
    assert!(
        times.len().is_multiple_of(2) && once,
        "one pool passes: {times:?}"
    );
    [first, last]
}

/// Where highest temperatures across the track pass `kelvin` in the uppermost plane, straight between the middles of cells, mm.
pub(crate) fn width(section: &Field, kelvin: f64) -> f64 {
    let grid = &section.grid;
    let top = grid.planes() - 1;
    let ends: Vec<f64> = (1..grid.cells[1])
        .map(|j| (j, section.at(0, j - 1, top), section.at(0, j, top)))
        .filter(|(_, a, b)| (*a > kelvin) != (*b > kelvin))
        .map(|(j, a, b)| (j as f64 - 0.5 + (kelvin - a) / (b - a)) * grid.edge[1])
        .collect();
    assert_eq!(ends.len(), 2, "one pool: {ends:?}");
    ends[1] - ends[0]
}

/// Where highest temperatures below the track pass `kelvin`, straight between the middles of cells, mm.
pub(crate) fn depth(section: &Field, kelvin: f64) -> f64 {
    let grid = &section.grid;
    let depths = grid.depths();
    let middle = |k: usize| depths[k] + 0.5 * grid.heights[k];
    let peak = |k: usize| {
        let plane = (0..grid.cells[1]).map(|j| section.at(0, j, k));
        plane.fold(0.0, f64::max)
    };
    let below = (0..grid.planes()).rposition(|k| peak(k) <= kelvin).unwrap();
    let [hot, cold] = [peak(below + 1), peak(below)];
    let share = (hot - kelvin) / (hot - cold);
    middle(below + 1) + share * (middle(below) - middle(below + 1))
}

fn on_the_surface(efficiency: f64) -> Beam {
    Beam {
        efficiency,
        depth: Depth::Surface,
    }
}

fn shipped() -> Beam {
    on_the_surface(bare().absorptivity.unwrap())
}

fn told(track: &Track, cell: f64, seen: &Seen) {
    println!(
        "{}, cells of {:.1} µm: width, depth, length {:.0?} µm for {:?}, cools at {:.2e} K/s, hottest {:.0} K, vapour takes {:.1} %",
        track.name,
        1e3 * cell,
        seen.size,
        track.measured,
        seen.cooling,
        seen.hottest,
        100.0 * seen.vapour,
    );
}

/// The tracks of a half, each on cells of 10 and 5 µm: what is converged, what is met, what is not.
fn held_against(tracks: &[Track]) {
    for track in tracks {
        let [coarse, fine] = [0.01, 0.005].map(|cell| {
            let seen = drawn(track, shipped(), cell);
            told(track, cell, &seen);
            seen
        });
        for n in 0..3 {
            let moved = coarse.size[n] / fine.size[n] - 1.0;
            assert!(moved.abs() < 0.09, "{}, {n}: {moved}", track.name);
            let recorded = fine.size[n] - track.ours[n];
            assert!(recorded.abs() < 1.5, "{}, {n}: {:?}", track.name, fine.size);
            let off = track.ours[n] / track.measured[n] - 1.0;
            println!("   off by {:.0} %", 100.0 * off);
            assert_eq!(off.abs() < 0.1, track.met[n], "{}, {n}: {off}", track.name);
        }
        if track.measured[1] < 0.5 * track.measured[0] {
            let depth = fine.size[1] / track.measured[1] - 1.0;
            assert!(depth.abs() < 0.2, "{}: {depth}", track.name);
        } else {
            // vapour digs: conduction tells two thirds of the depth and half of the length at most
            let [_, depth, length] = [0, 1, 2].map(|n| fine.size[n] / track.measured[n]);
            assert!(depth < 0.6 && length < 0.5, "{}", track.name);
        }
    }
}

#[test]
#[ignore = "half of the measured tracks, ten seconds"]
fn am_bench_2018_02_the_half_looked_at_first() {
    held_against(&FIRST);
}

#[test]
#[ignore = "the other half of the measured tracks, ten seconds"]
fn am_bench_2018_02_the_half_looked_at_last() {
    held_against(&LAST);
}

/// What does not explain the shallow tracks: the absorptivity that others measured, a narrower spot.
#[test]
#[ignore = "three measured tracks, fifteen seconds"]
fn am_bench_2018_02_neither_absorptivity_nor_spot_explains_the_width() {
    let [wide, fast] = [&FIRST[0], &LAST[1]];
    let narrow = [wide.beam[0], wide.beam[1], 0.136];
    let flat = bare().absorptivity.unwrap();
    for (beam, share, recorded) in [
        (wide.beam, MEASURED_ON_FOILS, [132.0, 29.0, 276.0]),
        (fast.beam, MEASURED_ON_FOILS, [115.0, 21.0, 239.6]),
        (narrow, flat, [132.4, 35.8, 317.8]),
    ] {
        let seen = drawn_on(&bare(), beam, on_the_surface(share), 0.005);
        println!("{beam:?}, {share}: {seen:.0?}");
        for (size, recorded) in seen.size.iter().zip(recorded) {
            assert!((size - recorded).abs() < 1.5, "{beam:?}: {seen:?}");
        }
    }
}

#[test]
#[ignore = "two measured tracks on fine cells, two minutes"]
fn am_bench_2018_02_cells_of_half_the_edge() {
    for track in [&FIRST[2], &LAST[1]] {
        let seen = drawn(track, shipped(), 0.0025);
        told(track, 0.0025, &seen);
        for (fine, ours) in seen.size.iter().zip(track.ours) {
            assert!((fine / ours - 1.0).abs() < 0.04, "{:?}", seen.size);
        }
    }
}

/// The absorptivity and the keyhole of Gan et al. 2021, the heat even down to the keyhole's end (a line source, Swift-Hook and Gick
/// 1973): nearer to what was measured than the surface alone, and not near.
#[test]
#[ignore = "three measured tracks, half a minute"]
fn am_bench_2018_02_with_a_keyhole_by_scaling() {
    let deep = [&LAST[2], &FIRST[1], &FIRST[2]];
    // keyhole's depth; width, depth, length of the pool, µm
    let recorded = [
        [87.4, 121.2, 97.0, 362.6],
        [52.9, 97.9, 60.0, 354.7],
        [24.9, 88.5, 35.0, 291.1],
    ];
    for (track, ours) in deep.into_iter().zip(recorded) {
        let [power, speed, spot] = track.beam;
        let laser = Laser {
            power,
            speed,
            spot,
            flat: MEASURED_ON_FOILS,
        };
        let alloy = bare();
        let told = keyhole(&alloy, alloy.start, laser).unwrap();
        assert_eq!(told.mode, Mode::Transition);
        let line = Beam {
            efficiency: told.absorptivity,
            depth: Depth::Even { depth: told.depth },
        };
        let seen = drawn(track, line, 0.005);
        self::told(track, 0.005, &seen);
        println!("   {told:?}");
        assert!((1e3 * told.depth - ours[0]).abs() < 0.5, "{told:?}");
        for (size, recorded) in seen.size.iter().zip(&ours[1..]) {
            assert!((size - recorded).abs() < 1.5, "{}: {seen:?}", track.name);
        }
        let depth = seen.size[1] / track.measured[1];
        assert!(told.depth < 1e-3 * track.measured[1], "{told:?}");
        assert!(depth > track.ours[1] / track.measured[1] && depth < 0.7);
    }
}

/// All seven tracks are deep: the boiling number flags them, their spots are narrower than the keyhole scaling was measured on.
#[test]
#[ignore = "seven measured tracks, half a minute"]
fn am_bench_2022_03_tracks_are_flagged_as_deep() {
    let alloy = plate(meltpath_data::materials::IN718_LASER.text);
    let medium = Medium::effective(&alloy, alloy.start, Body::HalfSpace).unwrap();
    let flat = alloy.absorptivity.unwrap();
    for (case, beam, [width, depth], ours) in IN718 {
        let [power, speed, spot] = beam;
        let number = boiling_number(&alloy, &medium, flat * power, speed, spot).unwrap();
        let seen = drawn_on(&alloy, beam, on_the_surface(flat), 0.005);
        println!(
            "case {case}: width {:.0} for {width} µm, depth {:.0} for {depth} µm, boiling number {number:.2}, hottest {:.0} K",
            seen.size[0], seen.size[1], seen.hottest
        );
        let laser = Laser {
            power,
            speed,
            spot,
            flat,
        };
        assert!(number > 1.0, "{case}: {number}");
        assert_eq!(
            keyhole(&alloy, alloy.start, laser).unwrap_err().what,
            "a spot"
        );
        for (size, recorded) in seen.size.iter().zip(ours) {
            assert!((size - recorded).abs() < 1.5, "{case}: {seen:?}");
        }
        // conduction tells an eighth to a third of the depth
        let off = seen.size[1] / depth;
        assert!((0.12..0.37).contains(&off), "{case}: {off}");
    }
}
