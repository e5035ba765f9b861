//! Metal in space: the flat walls of the height map, the same walls in any direction, a pipe and a torus.
mod fronts;
mod leaning;

use crate::support::*;
use crate::uneven::{astray, uneven};
use meltpath_deposition::bead::PoolModel;
use meltpath_deposition::deposit::{Deposition, Mode, Settings};
use meltpath_deposition::workpiece::{Laid, Laying};
use meltpath_geometry::math::{DMat3, DQuat, DVec2, DVec3};
use meltpath_geometry::shapes::cuboid;
use meltpath_geometry::workpiece::{Columns, HeightMap, Voxels};
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

/// Turns a wall: rotation about the origin, then a shift that takes it off the lattice.
#[derive(Clone, Copy)]
struct Turn(DMat3, DVec3);

impl Turn {
    const NONE: Turn = Turn(DMat3::IDENTITY, DVec3::ZERO);

    fn about(axis: DVec3, degrees: f64) -> Self {
        let q = DQuat::from_axis_angle(axis.normalize(), degrees.to_radians());
        Turn(DMat3::from_quat(q), DVec3::new(0.13, -0.21, 0.08))
    }
}

/// Motion with torch axes: moves the paths and axes of an upright one.
struct Turned<'a, S>(&'a mut S, Turn);

impl<S: MotionSink> MotionSink for Turned<'_, S> {
    fn block(&mut self, block: &MotionBlock) {
        let Turn(m, shift) = self.1;
        let mut block = block.clone();
        block.axis = vec![m * DVec3::Z; block.len()];
        for p in &mut block.position {
            *p = m * *p + shift;
        }
        self.0.block(&block);
    }
}

/// A plate 4 mm thick under z = 0, turned, over x and y from `lo` to `hi`, in a box that holds `height` mm over it.
fn plate(turn: Turn, (lo, hi, height): (DVec2, DVec2, f64), cell: f64) -> Voxels {
    let Turn(m, shift) = turn;
    let corners = |z0: f64, z1: f64, grow: f64| {
        let (lo, hi) = (lo - grow, hi + grow);
        [z0, z1].into_iter().flat_map(move |z| {
            [(lo.x, lo.y), (hi.x, lo.y), (hi.x, hi.y), (lo.x, hi.y)]
                .map(|(x, y)| m * xyz(x, y, z) + shift)
        })
    };
    let all: Vec<DVec3> = corners(-5.0, height, 1.0).collect();
    let low = all.iter().copied().reduce(DVec3::min).unwrap();
    let high = all.iter().copied().reduce(DVec3::max).unwrap();
    // a lattice through the plate's top where it is upright
    let snapped = (low / cell).floor() * cell;
    let mut voxels = Voxels::new(snapped, high, cell).unwrap();
    let mut slab = cuboid(lo.extend(-4.0), hi.extend(0.0));
    slab.vertices.iter_mut().for_each(|v| *v = m * *v + shift);
    assert_eq!(voxels.fill_mesh(&slab).unwrap().open, 0.0);
    voxels
}

fn laying(voxels: Voxels, settings: Settings) -> Laying<'static> {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    Laying::new(voxels, model, pool, settings).unwrap()
}

/// The paths of a wall: layers of beads along x, at `y`, from other ends in turn.
fn wall(layers: u32, ys: &[f64], rise: f64, length: f64) -> Vec<Vec<DVec3>> {
    (0..layers)
        .flat_map(|n| {
            ys.iter().map(move |&y| {
                let z = rise * f64::from(n);
                let mut path = vec![xyz(0.0, y, z), xyz(length, y, z)];
                if n % 2 == 1 {
                    path.reverse();
                }
                path
            })
        })
        .collect()
}

const LO: DVec2 = DVec2::new(-14.0, -22.0);
const HI: DVec2 = DVec2::new(74.0, 22.0);

fn in_space(paths: &[Vec<DVec3>], turn: Turn, cell: f64, settings: Settings) -> Laid {
    let voxels = plate(turn, (LO, HI, 30.0), cell);
    let before = voxels.volume();
    let mut d = laying(voxels, settings);
    let mut clock = 0.0;
    for path in paths {
        bead(
            &mut Turned(&mut d, turn),
            path,
            1,
            &mut clock,
            seed_bead().area,
        );
    }
    let laid = d.finish();
    let error = (laid.voxels.volume() - before) / laid.volume - 1.0;
    assert!(error.abs() < 1e-6, "volume {error}");
    assert_eq!(laid.beside, 0.0);
    laid.voxels.sanity_check().unwrap();
    laid
}

fn on_map(paths: &[Vec<DVec3>], cell: f64, settings: Settings) -> HeightMap {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let map = HeightMap::new(LO, HI, cell, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, settings).unwrap();
    let mut clock = 0.0;
    for path in paths {
        bead(&mut d, path, 1, &mut clock, model.area);
    }
    d.finish().map
}

/// Height of voxels over a place of an upright plate.
fn height(laid: &Laid, turn: Turn, p: DVec2) -> f64 {
    let Turn(m, shift) = turn;
    let columns = Columns {
        origin: shift,
        axes: [m.x_axis, m.y_axis, m.z_axis],
        side: laid.voxels.cell(),
    };
    laid.voxels
        .column(&columns, (p.x, p.y), (-3.0, 45.0, 46.0))
        .map_or(f64::NAN, |c| c.cover * c.top + (1.0 - c.cover) * c.foot)
}

/// Mean section over the middle of a wall: height at each lateral place.
fn section(at: impl Fn(DVec2) -> f64) -> Vec<f64> {
    (-36..=36)
        .map(|j| 0.25 * f64::from(j))
        .map(|y| {
            (0..40)
                .map(|i| at(DVec2::new(20.0 + 0.5 * f64::from(i), y)))
                .sum::<f64>()
                / 40.0
        })
        .collect()
}

/// A bead with its own axes, closed or open, at constant speed.
fn lay_along(d: &mut Laying<'_>, path: &[(DVec3, DVec3)], clock: &mut f64) {
    let wire_per_mm = seed_bead().area / seed_bead().wire_section;
    let mut block = MotionBlock {
        times: Times::Uniform { t0: *clock, dt: DT },
        ..MotionBlock::default()
    };
    for (i, &(p, axis)) in path.iter().enumerate() {
        let length = if i == 0 {
            0.0
        } else {
            path[i - 1].0.distance(p)
        };
        block.position.push(p);
        block.axis.push(axis);
        block.wire.push(wire_per_mm * length);
        block.command.push(1);
    }
    // the arc stops
    block.position.push(path[path.len() - 1].0);
    block.axis.push(path[path.len() - 1].1);
    block.wire.push(0.0);
    block.command.push(1);
    *clock += DT * block.len() as f64;
    d.block(&block);
}

fn pipe(radius: f64, turns: &[f64], layers: u32, cell: f64) -> (Laid, f64) {
    let reach = radius + 4.0 * f64::from(layers) + 4.0;
    let mut voxels = Voxels::new(
        DVec3::new(-30.0, -reach, -reach),
        DVec3::new(30.0, reach, reach),
        cell,
    )
    .unwrap();
    let n = 180;
    let ring = |x: f64| {
        (0..n).map(move |i| {
            let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            xyz(x, radius * a.cos(), radius * a.sin())
        })
    };
    let mut vertices: Vec<DVec3> = ring(-28.0).chain(ring(28.0)).collect();
    vertices.push(xyz(-28.0, 0.0, 0.0));
    vertices.push(xyz(28.0, 0.0, 0.0));
    let n = n as u32;
    let triangles = (0..n)
        .flat_map(|i| {
            let j = (i + 1) % n;
            [
                [i, n + j, j],
                [i, n + i, n + j],
                [2 * n, i, j],
                [2 * n + 1, n + j, n + i],
            ]
            .map(|[a, b, c]| [a, c, b])
        })
        .collect();
    let mesh = meltpath_geometry::Mesh {
        vertices,
        triangles,
    };
    assert!(mesh.volume() > 0.0);
    let fill = voxels.fill_mesh(&mesh).unwrap();
    assert!(
        (fill.volume / mesh.volume() - 1.0).abs() < 2e-3,
        "{} {}",
        fill.volume,
        mesh.volume()
    );
    let before = voxels.volume();
    let mut d = laying(voxels, Settings::default());
    let mut clock = 0.0;
    for n in 0..layers {
        for &x in turns {
            let r = radius + 1.65 * f64::from(n);
            let count = (std::f64::consts::TAU * r / 0.15) as u32;
            let path: Vec<(DVec3, DVec3)> = (0..=count)
                .map(|i| {
                    let a = std::f64::consts::TAU * f64::from(i) / f64::from(count) + f64::from(n);
                    let out = xyz(0.0, a.cos(), a.sin());
                    (xyz(x, 0.0, 0.0) + r * out, out)
                })
                .collect();
            lay_along(&mut d, &path, &mut clock);
        }
    }
    let laid = d.finish();
    let error = (laid.voxels.volume() - before) / laid.volume - 1.0;
    assert!(error.abs() < 1e-6, "volume {error}");
    (laid, before)
}

fn torus(passes: u32, dp: f64, cell: f64, missing: Option<u32>) -> Laid {
    let (big, small) = (50.0, 15.0);
    let mut voxels = Voxels::new(
        DVec3::new(-80.0, -25.0, -4.0),
        DVec3::new(25.0, 25.0, 75.0),
        cell,
    )
    .unwrap();
    voxels
        .fill_box(DVec3::new(-30.0, -25.0, -4.0), DVec3::new(25.0, 25.0, 0.0))
        .unwrap();
    let before = voxels.volume();
    let mut d = laying(voxels, Settings::default());
    let mut clock = 0.0;
    let count = 640;
    let mut u = vec![0.0f64; count + 1];
    for pass in 0..passes {
        let path: Vec<(DVec3, DVec3)> = (0..=count)
            .map(|i| {
                let v = std::f64::consts::TAU * i as f64 / count as f64;
                let r = big + small * v.cos();
                let p = xyz(r * u[i].cos() - big, small * v.sin(), r * u[i].sin());
                let lean = 0.5 * u[i];
                (p, xyz(-lean.sin(), 0.0, lean.cos()))
            })
            .collect();
        if missing != Some(pass) {
            lay_along(&mut d, &path, &mut clock);
        }
        for (i, u) in u.iter_mut().enumerate() {
            let v = std::f64::consts::TAU * i as f64 / count as f64;
            let r = big + small * v.cos();
            *u += (1.0 - dp * dp / (2.0 * r * r)).acos();
        }
    }
    let laid = d.finish();
    let error = (laid.voxels.volume() - before) / laid.volume - 1.0;
    assert!(error.abs() < 1e-6, "volume {error}");
    laid
}

/// Mean height over the middle of a wall `half` mm to each side of y = 0, and the width of its section at height `z`.
fn measures(section: &[f64], half: f64, z: f64) -> (f64, f64) {
    let inside: Vec<f64> = section
        .iter()
        .enumerate()
        .filter(|(j, _)| (*j as f64 - 36.0).abs() * 0.25 <= half)
        .map(|(_, h)| *h)
        .collect();
    let mean = inside.iter().sum::<f64>() / inside.len() as f64;
    // linear between places: the flanks are vertical to a column
    let crossing = |w: &[f64]| ((z - w[0]) / (w[1] - w[0])).clamp(0.0, 1.0);
    let left = section
        .windows(2)
        .position(|w| w[0] < z && w[1] >= z)
        .unwrap();
    let right = section
        .windows(2)
        .rposition(|w| w[0] >= z && w[1] < z)
        .unwrap();
    let width = 0.25
        * (right as f64 + crossing(&section[right..]) - left as f64 - crossing(&section[left..]));
    (mean, width)
}

/// A wall of voxels beside that of the height map: (height, width) of both.
fn beside(ys: &[f64], layers: u32, turn: Turn, cell: f64) -> [(f64, f64); 2] {
    let paths = wall(layers, ys, 1.65, 60.0);
    let map = on_map(&paths, cell.min(0.5), Settings::default());
    let laid = in_space(&paths, turn, cell, Settings::default());
    let half = ys.iter().copied().fold(2.0, f64::max);
    let z = 4.0;
    let flat = measures(&section(|p| map.height(p)), half, z);
    let here = measures(&section(|p| height(&laid, turn, p)), half, z);
    let mesh = laid.voxels.to_mesh();
    assert!(closed(&mesh));
    let error = mesh.volume() / laid.voxels.volume() - 1.0;
    assert!(
        error.abs() < if cell > 0.5 { 0.02 } else { 0.005 },
        "mesh {error}"
    );
    [flat, here]
}

#[test]
fn flat_walls_are_those_of_the_height_map() {
    for (ys, layers) in [(vec![0.0], 8), (vec![-4.62, 0.0, 4.62], 5)] {
        let [map, here] = beside(&ys, layers, Turn::NONE, 0.5);
        assert!((here.0 / map.0 - 1.0).abs() < 0.006, "{map:?} {here:?}");
        assert!((here.1 - map.1).abs() < 0.15, "{map:?} {here:?}");
    }
}

#[test]
fn walls_are_the_same_in_any_direction() {
    let turns = [
        Turn::about(DVec3::X, 30.0),
        Turn::about(DVec3::Y, 90.0),
        Turn::about(DVec3::new(1.0, -2.0, 0.7), 53.0),
    ];
    for (ys, layers) in [(vec![0.0], 8), (vec![-4.62, 0.0, 4.62], 5)] {
        for turn in turns {
            let [map, here] = beside(&ys, layers, turn, 0.5);
            assert!((here.0 / map.0 - 1.0).abs() < 0.025, "{map:?} {here:?}");
            assert!((here.1 - map.1).abs() < 0.4, "{map:?} {here:?}");
        }
    }
}

#[test]
fn a_turned_wall_converges_with_the_voxels() {
    let turn = Turn::about(DVec3::new(1.0, -2.0, 0.7), 53.0);
    // a voxel of 1 mm is half a bead high
    for (cell, bound) in [(1.0, 0.08), (0.5, 0.015), (0.25, 0.01)] {
        let [map, here] = beside(&[0.0], 4, turn, cell);
        let error = here.0 / map.0 - 1.0;
        assert!(error.abs() < bound, "{cell}: {error}");
    }
}

fn closed(mesh: &meltpath_geometry::Mesh) -> bool {
    let mut balance = std::collections::HashMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *balance.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    balance.values().all(|n| *n == 0)
}

fn thickness(laid: &Laid, beads: std::ops::Range<u32>) -> (f64, f64, f64) {
    let mut t: Vec<f64> = laid
        .path
        .iter()
        .filter(|p| beads.contains(&p.bead))
        .map(|p| p.thickness)
        .collect();
    t.sort_by(f64::total_cmp);
    (
        t.iter().sum::<f64>() / t.len() as f64,
        t[t.len() / 20],
        t[t.len() * 19 / 20],
    )
}

#[test]
fn a_pipe_takes_beads_all_round() {
    let (laid, _) = pipe(25.0, &[0.0], 3, 0.5);
    let plate = seed_bead().height();
    // the first as on a plate, the others as on a wall; all round within a tenth of a bead of the mean and nine places of ten
    // within a fifth
    for (bead, expected) in [(0, plate), (1, 1.65), (2, 1.65)] {
        let (mean, low, high) = thickness(&laid, bead..bead + 1);
        assert!((mean - expected).abs() < 0.1 * plate, "{mean} {expected}");
        assert!(
            high - mean < 0.2 * plate && mean - low < 0.2 * plate,
            "{low} {high}"
        );
    }
    // what is farther out is where beads begin and end
    let off = uneven(&laid, 0.5 * plate)
        .into_iter()
        .chain(astray(&laid, 15.0, 0.5 * plate));
    for u in off {
        let seam = f64::from(u.bead);
        let seam = (25.0 + 1.65 * seam) * xyz(0.0, seam.cos(), seam.sin());
        assert!(u.position.distance(seam) < 7.0, "{u:?}");
    }
    assert!(laid.loose.is_empty());
    let mesh = laid.voxels.to_mesh();
    assert!(closed(&mesh));
    assert!((mesh.volume() / laid.voxels.volume() - 1.0).abs() < 0.005);
}

#[test]
fn a_torus_grows_along_its_own_passes() {
    let half = 0.5 * seed_bead().height();
    let laid = torus(20, 1.65, 0.5, None);
    let (mean, low, high) = thickness(&laid, 1..20);
    assert!(
        (mean - 1.6).abs() < 0.1 && high - low < half,
        "{mean} {low} {high}"
    );
    let mesh = laid.voxels.to_mesh();
    assert!(closed(&mesh));
    assert!((mesh.volume() / laid.voxels.volume() - 1.0).abs() < 0.005);
    // metal wherever a pass ran under later ones, or told
    let off: Vec<_> = uneven(&laid, half)
        .into_iter()
        .chain(astray(&laid, 15.0, half))
        .collect();
    let told = |p: DVec3| off.iter().any(|u| u.position.distance(p) < u.length + 4.0);
    let under = laid.path.iter().filter(|p| (1..19).contains(&p.bead));
    let mut places = 0;
    for p in under {
        assert!(laid.voxels.sample(p.tool) > 0.5 || told(p.tool), "{p:?}");
        places += 1;
    }
    assert!(places > 2500);
}

#[test]
fn a_missing_pass_is_told_as_a_hole_all_round() {
    let half = 0.5 * seed_bead().height();
    let whole = |laid: &Laid, bead: u32| -> f64 {
        let found = astray(laid, 15.0, half);
        found
            .iter()
            .filter(|u| u.bead == bead && u.excess > 0.0)
            .map(|u| u.length)
            .sum()
    };
    assert_eq!(whole(&torus(7, 1.65, 0.5, None), 5), 0.0);
    // of 94 mm round; where beads begin and end they stand higher, and fill a part of it
    assert!(whole(&torus(7, 1.65, 0.5, Some(5)), 5) > 50.0);
}

#[test]
fn stamps_alone_are_the_parabola_in_any_direction() {
    let settings = Settings {
        mode: Mode::Plain,
        ..Settings::default()
    };
    for turn in [Turn::NONE, Turn::about(DVec3::new(1.0, -2.0, 0.7), 53.0)] {
        let laid = in_space(&wall(1, &[0.0], 0.0, 60.0), turn, 0.5, settings);
        let found = section(|p| height(&laid, turn, p));
        let model = seed_bead();
        let worst = found
            .iter()
            .enumerate()
            .map(|(j, h)| {
                let y = 0.25 * (j as f64 - 36.0);
                let parabola = (model.height() * (1.0 - (2.0 * y / model.width).powi(2))).max(0.0);
                (h - parabola).abs()
            })
            .fold(0.0, f64::max);
        // the toes of a turned bead blur by a third of a voxel
        assert!(worst < 0.2, "{worst}");
    }
}

/// Each layer is told once, with the metal that is there by then.
#[test]
fn layers_are_told_when_they_are_whole() {
    let voxels = plate(Turn::about(DVec3::X, 0.0), (LO, HI, 30.0), 0.5);
    let before = voxels.volume();
    let mut told = Vec::new();
    let mut d = laying(voxels, Settings::default())
        .with_layers(vec![0, 7, 8, 9])
        .on_layer(|layer, metal| told.push((layer, metal.volume() - before)));
    let (mut clock, area) = (0.0, seed_bead().area);
    for (command, path) in (1..).zip(wall(3, &[0.0], 2.0, 40.0)) {
        bead(&mut d, &path, command, &mut clock, area);
    }
    let laid = d.finish();
    assert_eq!(told.iter().map(|t| t.0).collect::<Vec<_>>(), [7, 8, 9]);
    for (count, (_, volume)) in (1..).zip(&told) {
        let wanted = laid.volume * f64::from(count) / 3.0;
        assert!((volume / wanted - 1.0).abs() < 1e-6, "{told:?}");
    }
}

#[test]
fn motion_that_is_no_motion_is_skipped_and_told() {
    let reporter = meltpath_base::Reporter::default();
    let voxels = plate(Turn::NONE, (LO, HI, 8.0), 1.0);
    let before = voxels.volume();
    let mut d = laying(voxels, Settings::default()).reporting_to(&reporter);
    let n = 6;
    d.block(&MotionBlock {
        times: Times::Uniform { t0: 0.0, dt: DT },
        position: vec![
            DVec3::ZERO,
            xyz(f64::NAN, 0.0, 0.0),
            DVec3::X,
            DVec3::X,
            2.0 * DVec3::X,
            500.0 * DVec3::X,
        ],
        axis: vec![
            DVec3::Z,
            DVec3::Z,
            DVec3::ZERO,
            DVec3::Z,
            DVec3::Z,
            DVec3::Z,
        ],
        wire: vec![1.0; n],
        command: vec![0; n],
        ..MotionBlock::default()
    });
    let laid = d.finish();
    let error = laid.voxels.volume() - before + laid.beside - laid.volume;
    assert!(error.abs() < 1e-6 * laid.volume, "{error}");
    assert!(laid.beside > 0.0);
    let told: Vec<String> = reporter.warnings().iter().map(|w| w.code.clone()).collect();
    for code in ["motion-not-finite", "metal-beside-voxels"] {
        assert!(told.iter().any(|t| t == code), "{told:?}");
    }
}
