//! Three insets of about 126,000 vertices of hard polygons: ours beside the Clipper2 C++ library, one thread each,
//! in one run. `cargo run --release` prints the times, the ratio and both areas.

use std::time::Instant;

use clipper2c_sys as cpp;
use meltpath_geometry::Region;
use meltpath_geometry::boolean::GRID_PER_MM;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset};

#[path = "../../../crates/geometry/benches/hard_polygons/mod.rs"]
mod hard_polygons;

const DISTANCES: [f64; 3] = [1.0, 1.5, 2.0];
const ARC_TOLERANCE: f64 = 0.01;

/// Memory for one C++ object of `size` bytes, as the C wrapper wants it; leaked, which a benchmark may.
fn place(size: usize) -> *mut std::ffi::c_void {
    let words = vec![0_u128; size.div_ceil(16)].into_boxed_slice();
    Box::into_raw(words).cast()
}

fn cpp_paths(polygon: &[hard_polygons::Points]) -> *mut cpp::ClipperPaths64 {
    // SAFETY: every pointer handed over was just made by the library in memory of the size it asks for
    unsafe {
        let paths = cpp::clipper_paths64(place(cpp::clipper_paths64_size()));
        for ring in polygon {
            let mut points: Vec<_> = ring
                .iter()
                .map(|&(x, y)| cpp::ClipperPoint64 {
                    x: (x * GRID_PER_MM).round() as i64,
                    y: (y * GRID_PER_MM).round() as i64,
                })
                .collect();
            let path = cpp::clipper_path64_of_points(
                place(cpp::clipper_path64_size()),
                points.as_mut_ptr(),
                points.len(),
            );
            cpp::clipper_paths64_add_path(paths, path);
        }
        paths
    }
}

fn cpp_insets(mut paths: *mut cpp::ClipperPaths64) -> f64 {
    // SAFETY: as above; each result is an object of the library that lives to the end of the process
    unsafe {
        for distance in DISTANCES {
            let offset = cpp::clipper_clipperoffset(
                place(cpp::clipper_clipperoffset_size()),
                2.0,
                ARC_TOLERANCE * GRID_PER_MM,
                0,
                0,
            );
            cpp::clipper_clipperoffset_add_paths64(
                offset,
                paths,
                cpp::ClipperJoinType_ROUND_JOIN,
                cpp::ClipperEndType_POLYGON_END,
            );
            paths = cpp::clipper_clipperoffset_execute(
                place(cpp::clipper_paths64_size()),
                offset,
                -distance * GRID_PER_MM,
            );
            cpp::clipper_delete_clipperoffset(offset);
        }
        cpp::clipper_paths64_area(paths) / (GRID_PER_MM * GRID_PER_MM)
    }
}

fn our_insets(regions: &[Region]) -> f64 {
    let join = Join::Round { arc_tolerance: ARC_TOLERANCE };
    let mut current = regions.to_vec();
    for distance in DISTANCES {
        current = inset(&current, distance, join).expect("finite polygons");
    }
    current.iter().map(Region::area).sum()
}

fn best(runs: usize, mut f: impl FnMut() -> f64) -> (f64, f64) {
    let mut best = (f64::INFINITY, 0.0);
    for _ in 0..runs {
        let start = Instant::now();
        let area = f();
        let time = start.elapsed().as_secs_f64();
        if time < best.0 {
            best = (time, area);
        }
    }
    best
}

fn main() {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .expect("the first pool of the process");
    for (name, set) in [
        ("28 stars of 4,500 vertices", hard_polygons::hard_set()),

    ] {
        let ring = |p: &hard_polygons::Points| p.iter().map(|&p| DVec2::from(p)).collect();
        let regions: Vec<_> = set
            .iter()
            .map(|rings| Region {
                outer: ring(&rings[0]),
                holes: rings[1..].iter().map(ring).collect(),
            })
            .collect();
        let vertices: usize = set.iter().flatten().map(Vec::len).sum();
        let together = [set.iter().flatten().cloned().collect::<Vec<_>>()];
        let (one_call, area) = best(1, || cpp_insets(cpp_paths(&together[0])));
        let (split, split_area) = best(5, || set.iter().map(|p| cpp_insets(cpp_paths(p))).sum());
        let (ours, our_area) = best(5, || our_insets(&regions));
        println!("{name}, {vertices} vertices, three insets, one thread");
        println!("  Clipper2 C++, one call      {:8.1} ms, area {area:.4} mm²", one_call * 1e3);
        println!("  Clipper2 C++, per polygon   {:8.1} ms, area {split_area:.4} mm²", split * 1e3);
        println!("  meltpath                    {:8.1} ms, area {our_area:.4} mm²", ours * 1e3);
        println!(
            "  ratio {:.2} to one call, {:.2} to per polygon",
            ours / one_call,
            ours / split
        );
    }
}
