//! Poses a second of which it is known whether torch and arm stay clear of metal, table and each other: bars as robots ship, and hulls of
//! the links' meshes. On one thread, and on all.

use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_data::robots;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::shapes::{revolve, tube};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_geometry::{Mesh, Pose};
use meltpath_numerics::random::Random;
use meltpath_robot::cell::{self, Cell, LinkHull, Links, Values};
use meltpath_robot::collision::{Metal, Surroundings, room};
use meltpath_robot::hull::{Excess, Fineness, Hull, Pieces};
use rayon::prelude::*;

const COUNT: u32 = 10_000;
/// Room that is wanted, mm.
const WANTED: f64 = 10.0;
/// Triangles of all links together.
const TRIANGLES: usize = 20_000;

/// A plate of 400 mm with a wall of 60 mm on it.
fn metal() -> Option<Metal> {
    let corner = DVec2::splat(200.0);
    let mut map = HeightMap::new(-corner, corner, 1.0, 0.0).ok()?;
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            let centre = map.centre(ix, iy);
            if centre.x.abs() < 4.0 && centre.y.abs() < 120.0 {
                let i = map.index(ix, iy);
                map.z[i] = 60.0;
            }
        }
    }
    Some(Metal::of(&map, 2.0))
}

/// A waisted, ribbed body around the line from the origin to `end`.
fn body(end: DVec3, radius: f64, triangles: usize) -> Mesh {
    let sides = 40;
    let rings = (triangles / 2 / sides).max(2) as u32;
    let length = end.length() + 2.0 * radius;
    let at = |i: u32| {
        let share = f64::from(i) / f64::from(rings);
        let waist = 1.0 - 0.3 * (std::f64::consts::PI * share).sin();
        let rib = 1.0 + 0.04 * f64::from(i % 3);
        let out = if i == 0 || i == rings { 0.0 } else { 1.0 };
        DVec2::new(out * waist * rib * radius, share * length - radius)
    };
    let profile: Vec<DVec2> = (0..=rings).map(at).collect();
    let mut mesh = revolve(&profile, sides as u32);
    let along = end.try_normalize().unwrap_or(DVec3::Z);
    let turn = Pose::of_tool(DVec3::ZERO, along, 0.0);
    mesh.vertices.iter_mut().for_each(|v| *v = turn.point(*v));
    mesh
}

/// The same cell, its links told by meshes.
fn with_meshes(cell: &Cell) -> Cell {
    let mut cell = cell.clone();
    let chain = &cell.arm.chain;
    let next = chain.joints.iter().skip(1).map(|j| j.parent_from_joint);
    let ends: Vec<DVec3> = next
        .chain([chain.last_from_end])
        .map(|p| p.position)
        .collect();
    if let Some(shapes) = &mut cell.shapes
        && let Links::Bars(radii) = shapes.links
    {
        let links = (1..).zip(ends.iter().zip(radii));
        let hulls = links.filter_map(|(link, (end, radius))| {
            let mesh = body(*end, radius, TRIANGLES / 6);
            Some(LinkHull {
                link,
                hull: Hull::of(&mesh.vertices)?,
                pieces: Vec::new(),
                excess: Excess::default(),
                mesh,
                of: String::new(),
            })
        });
        shapes.links = Links::Hulls(Arc::from(hulls.collect::<Vec<_>>()));
    }
    cell
}

/// Places all over, and near the part, where something is always near.
fn places(cell: &Cell, near: bool) -> Vec<Values> {
    let mut random = Random::new(7);
    let mut all = Vec::new();
    while all.len() < COUNT as usize {
        let rest = cell.at_rest();
        if !near {
            let limits = cell.arm.chain.joints.iter().map(|j| j.limits);
            let mut values = rest;
            for (value, l) in values.arm.iter_mut().zip(limits) {
                *value = random.between(l.low, l.high);
            }
            all.push(values);
            continue;
        }
        let mut somewhere = |far: f64| random.between(-far, far);
        let tip = DVec3::new(somewhere(150.0), somewhere(150.0), 80.0 + somewhere(80.0));
        let tip = Pose::of_tool(tip, DVec3::Z, somewhere(3.1));
        let flange = cell.base_from_flange(tip, &rest);
        if let Ok(ways) = cell.arm.inverse(flange)
            && let Some(way) = ways.solutions.first()
        {
            all.push(Values {
                arm: way.angles,
                ..rest
            });
        }
    }
    all
}

fn collision(c: &mut Criterion) {
    let Some(metal) = metal() else {
        return;
    };
    let mut group = c.benchmark_group("collision");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    for file in [robots::FANUC_ARCMATE_120IC, robots::UNIVERSAL_UR10E] {
        let Ok(bars) = cell::read(file.text) else {
            continue;
        };
        for (of, cell) in [("bars", &bars), ("hulls", &with_meshes(&bars))] {
            let Some(shapes) = &cell.shapes else {
                continue;
            };
            let at = |_: u32| &metal;
            let around = Surroundings::new(cell, shapes, &at, 20.0);
            let free = |values: &Values| room(cell, &around, (0, values), WANTED) >= WANTED;
            for (where_, near) in [("all over", false), ("at the part", true)] {
                let places = places(cell, near);
                let name = format!("{}/{of}/{where_}", file.name);
                group.bench_function(format!("{name}/one thread"), |b| {
                    b.iter(|| places.iter().filter(|v| free(v)).count());
                });
                group.bench_function(format!("{name}/all threads"), |b| {
                    b.iter(|| places.par_iter().filter(|v| free(v)).count());
                });
            }
        }
    }
    group.finish();
}

/// A ring of 200,000 triangles in convex pieces.
fn pieces(c: &mut Criterion) {
    let (rings, sides) = (500, 200);
    let torus = tube(rings, sides, |along, around| {
        let [a, b] = [along, around].map(|share| std::f64::consts::TAU * share);
        let out = 150.0 + 40.0 * b.cos();
        DVec3::new(out * a.cos(), out * a.sin(), 40.0 * b.sin())
    });
    let mut group = c.benchmark_group("pieces");
    group.sample_size(10);
    let name = format!("ring of {} triangles", torus.triangles.len());
    group.bench_function(name, |b| {
        b.iter(|| Pieces::of(&torus, Fineness::default()).map(|p| p.excess.most));
    });
    group.finish();
}

criterion_group!(benches, collision, pieces);
criterion_main!(benches);
