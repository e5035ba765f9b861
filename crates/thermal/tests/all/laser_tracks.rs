//! The same engines under a laser: single tracks on a bare plate of IN625, measured by NIST (AM-Bench 2018-02).
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::Material;
use meltpath_thermal::material::file::{Readings, read};
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::pool::MeltPool;
use meltpath_thermal::pool::fusion::{Following, FusionMap, boiling_number, follow};
use meltpath_thermal::pool::history::Memory;
use meltpath_thermal::pool::moving_source::MovingSource;
use meltpath_thermal::solver::run::draw;
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Face, Faces, Solver};

const PREHEAT: f64 = 293.15;

struct Track {
    name: &'static str,
    /// W, mm/s, spot (four standard deviations) mm.
    beam: [f64; 3],
    /// Width and depth, mm.
    measured: [f64; 2],
}

fn alloy() -> Material {
    let text = meltpath_data::materials::IN625_LASER.text;
    read(text, Readings::default()).unwrap()
}

fn beam() -> Beam {
    Beam {
        efficiency: alloy().absorptivity.unwrap(),
        depth: Depth::Surface,
    }
}

fn line(length: f64, speed: f64, [power, spot]: [f64; 2]) -> BeamPath {
    let start = BeamPoint::start(power, spot);
    BeamPath::along(&[[0.0, 0.0], [length, 0.0]], speed, start).unwrap()
}

/// The pool at the end of a track on cells of `cell` mm, without loss by evaporation, as the engine has none.
fn by_solver(track: &Track, cell: f64) -> MeltPool {
    let [power, speed, spot] = track.beam;
    let alloy = alloy();
    let solver = drawn(
        &line(1.4, speed, [power, spot]),
        [[-0.15, 1.6], [-0.15, 0.15]],
        cell,
    );
    MeltPool::of(&solver.temperature(), alloy.liquidus, [1.0, 0.0])
}

/// The solver after a path.
fn drawn(path: &BeamPath, [x, y]: [[f64; 2]; 2], cell: f64) -> Solver<f32> {
    let grid = Grid::covering(
        DVec3::new(x[0], y[0], -0.15),
        DVec3::new(x[1], y[1], 0.0),
        DVec3::splat(cell),
    )
    .unwrap();
    let faces = Faces {
        top: Surface::Insulated,
        sides: Face::Insulated,
        bottom: Face::Insulated,
    };
    let mut solver: Solver<f32> = Solver::new(grid, alloy(), faces).unwrap();
    let step = 0.9 * solver.stable_step();
    draw(&mut solver, path, &beam(), step, &mut [], &Silent).unwrap();
    solver
}

fn engine(path: BeamPath) -> MovingSource {
    let medium = Medium::effective(&alloy(), PREHEAT, Body::HalfSpace).unwrap();
    MovingSource::new(medium, path, beam(), Memory::Folded).unwrap()
}

fn by_engine(track: &Track) -> MeltPool {
    let [power, speed, spot] = track.beam;
    let path = line(1.8, speed, [power, spot]);
    let end = path.end();
    let mut engine = engine(path);
    engine.advance(end).unwrap();
    engine.measure(alloy().liquidus).unwrap().pool
}

/// Lane et al. 2020 (Integrating Materials and Manufacturing Innovation 9), table 4.
const TRACKS: [Track; 6] = [
    track("AMMT B", [179.2, 800.0, 0.170], [0.123, 0.036]),
    track("AMMT A", [137.9, 400.0, 0.170], [0.148, 0.042]),
    track("AMMT C", [179.2, 1200.0, 0.170], [0.106, 0.030]),
    track("CBM A", [150.0, 400.0, 0.100], [0.171, 0.151]),
    track("CBM B", [195.0, 800.0, 0.100], [0.133, 0.091]),
    track("CBM C", [195.0, 1200.0, 0.100], [0.100, 0.060]),
];

const fn track(name: &'static str, beam: [f64; 3], measured: [f64; 2]) -> Track {
    Track {
        name,
        beam,
        measured,
    }
}

#[test]
fn means_of_the_laws_stand_for_the_laws() {
    let (ours, reference) = (by_engine(&TRACKS[0]), by_solver(&TRACKS[0], 0.006_25));
    let micrometres = |p: &MeltPool| [p.width, p.depth, p.length].map(|v| (1e3 * v).round());
    println!(
        "engine {:?}, solver {:?} µm",
        micrometres(&ours),
        micrometres(&reference)
    );
    // whole cells count in the solver's pool
    assert!((ours.width - reference.width).abs() < 0.0125);
    assert!((ours.depth - reference.depth).abs() < 0.00625);
    assert!((ours.length / reference.length - 1.0).abs() < 0.15);
}

#[test]
fn measured_tracks_are_met_where_heat_is_conducted_and_flagged_where_it_is_not() {
    let alloy = alloy();
    let medium = Medium::effective(&alloy, PREHEAT, Body::HalfSpace).unwrap();
    for track in &TRACKS {
        let pool = by_engine(track);
        let [power, speed, spot] = track.beam;
        let absorbed = alloy.absorptivity.unwrap() * power;
        let number = boiling_number(&alloy, &medium, absorbed, speed, spot).unwrap();
        let [width, depth] = track.measured;
        let slender = depth / width;
        println!(
            "{}: width {:.0} for {:.0} µm, depth {:.0} for {:.0} µm, boiling number {number:.2}, measured depth/width {slender:.2}",
            track.name,
            1e3 * pool.width,
            1e3 * width,
            1e3 * pool.depth,
            1e3 * depth
        );
        assert!((pool.width / width - 1.0).abs() < 0.25, "{}", track.name);
        if slender < 0.5 {
            assert!(number < 0.5, "{}: {number}", track.name);
            assert!((pool.depth / depth - 1.0).abs() < 0.25, "{}", track.name);
        } else {
            // deeper than wide by half: vapour digs, conduction alone gives a lower bound
            assert!(number > 0.6, "{}: {number}", track.name);
            assert!(pool.depth < depth, "{}", track.name);
        }
    }
}

#[test]
fn what_melts_through_is_what_the_reference_solver_melts_through() {
    let corners = [
        [0.0, 0.0],
        [0.8, 0.0],
        [0.8, 0.14],
        [0.0, 0.14],
        [0.0, 0.28],
        [0.8, 0.28],
    ];
    let start = line(1.0, 800.0, [179.2, 0.17]).points()[0];
    let path = BeamPath::along(&corners, 800.0, start).unwrap();
    let (depth, cell) = (0.02, 0.01);
    let solver = drawn(&path, [[-0.2, 1.0], [-0.2, 0.48]], cell);
    let field = solver.highest_temperature();
    let grid = &field.grid;
    let liquidus = alloy().liquidus;
    let low = [grid.origin.x, grid.origin.y];
    let high = [
        grid.origin.x + grid.cells[0] as f64 * cell,
        grid.origin.y + grid.cells[1] as f64 * cell,
    ];
    let mut map = FusionMap::covering(low, high, cell, depth, PREHEAT).unwrap();
    let following = Following {
        step: 0.04,
        per_pool: 4,
    };
    let trace = follow(&mut engine(path), liquidus, &mut map, following, &Silent).unwrap();
    assert!(trace.iter().all(|p| p.pool.hottest > liquidus));
    // the plane lies on a face between cells: the mean of the two planes
    let top = grid.planes();
    let [nx, _] = grid.cells;
    let (mut both, mut either) = (0, 0);
    for (n, ours) in map.hotter(liquidus).enumerate() {
        let at = |below: usize| field.at(n % nx, n / nx, top - below);
        let theirs = 0.5 * (at(2) + at(3)) > liquidus;
        both += u32::from(ours && theirs);
        either += u32::from(ours || theirs);
    }
    let share = f64::from(both) / f64::from(either);
    println!("both {both}, either {either}: {share:.3}");
    assert!(either > 1500 && share > 0.88, "{share}");
}

#[test]
fn lines_too_far_apart_leave_powder_between_them() {
    let liquidus = alloy().liquidus;
    let shares: Vec<f64> = [0.08, 0.12, 0.2]
        .into_iter()
        .map(|hatch| {
            let corners: Vec<[f64; 2]> = (0..6)
                .flat_map(|n| {
                    let y = f64::from(n) * hatch;
                    if n % 2 == 0 {
                        [[0.0, y], [1.5, y]]
                    } else {
                        [[1.5, y], [0.0, y]]
                    }
                })
                .collect();
            let start = line(1.0, 800.0, [179.2, 0.17]).points()[0];
            let path = BeamPath::along(&corners, 800.0, start).unwrap();
            // the inner lines
            let mut map =
                FusionMap::covering([0.3, hatch], [1.2, 4.0 * hatch], 0.005, 0.02, PREHEAT)
                    .unwrap();
            let following = Following {
                step: 0.05,
                per_pool: 4,
            };
            follow(&mut engine(path), liquidus, &mut map, following, &Silent).unwrap();
            map.hotter(liquidus).filter(|m| *m).count() as f64 / map.highest.len() as f64
        })
        .collect();
    println!("melted through: {shares:.3?}");
    assert!(shares[0] > 0.999 && shares[2] < 0.8 && shares[1] >= shares[2]);
}

#[test]
fn a_map_too_large_is_refused() {
    let error = FusionMap::covering([0.0; 2], [500.0; 2], 0.01, 0.03, PREHEAT).unwrap_err();
    assert!(error.to_string().contains("larger cells"), "{error}");
}
