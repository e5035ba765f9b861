//! What the filling of layers costs and covers, on parts of one's own.
//!
//! `outlines 6.5 4.8 2.0 a.stl b.stl` fills layers of 2 mm with beads 6.5 mm wide and 4.8 mm apart by the default strategy, and prints
//! a line a part: layers, vertices and area of a section, seconds of its slices and of its fill, and what stays bare. `reached` is what
//! a round bead of half the width can cover at all: the rest lies in corners and where a section is narrower than a bead. One thread
//! with `RAYON_NUM_THREADS=1`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a measurement that fails stops here; its figures are what it is for"
)]

use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::boolean::intersection;
use meltpath_geometry::io::stl::read_stl;
use meltpath_geometry::offset::{Join, inset, outset, stroke};
use meltpath_geometry::section::{Slice, SlicePlan, slice};
use meltpath_geometry::{Plane, Region};
use meltpath_planning::{
    ContourOrder, FillLayer, FillSettings, LineAngle, Paces, PassIds, Strategy, plan_layers,
};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |n: usize| words[n].parse::<f64>().unwrap();
    let height = number(2);
    let settings = FillSettings {
        strategy: Strategy::Hybrid {
            contours: 1,
            order: ContourOrder::OutsideIn,
            angle: LineAngle::Best,
        },
        paces: Some(Paces::about(12.5, (0.0, 50.0))),
        ..FillSettings::new(number(0), number(1))
    };
    println!("part layers vertices area_mm2 slice_s fill_s bare_% reachable_bare_% bead_m");
    for path in &words[3..] {
        part(path, height, &settings);
    }
}

fn part(path: &str, height: f64, settings: &FillSettings) {
    let file = BufReader::new(File::open(path).unwrap());
    let mesh = read_stl(file, None, &Reporter::new(), &Silent)
        .unwrap()
        .mesh;
    let top = mesh.vertices.iter().fold(0.0_f64, |t, v| t.max(v.z));
    let count = (top / height + 0.5).ceil() as u32 - 1;
    let heights: Vec<f64> = (0..count).map(|i| (f64::from(i) + 0.5) * height).collect();
    let begun = Instant::now();
    let plan = SlicePlan::new(Plane::horizontal(0.0), heights.clone());
    let slices = slice(&mesh, &plan, &Reporter::new(), &Silent).unwrap();
    let sliced = begun.elapsed();
    let planes: Vec<Plane> = heights.iter().map(|h| Plane::horizontal(*h)).collect();
    let layers: Vec<FillLayer<'_>> = (1..)
        .zip(slices.iter().zip(&planes))
        .map(|(number, (slice, plane))| FillLayer {
            number,
            plane,
            regions: &slice.regions,
        })
        .collect();
    let begun = Instant::now();
    let ids = PassIds { part: 0 };
    let plans = plan_layers(&layers, settings, ids, &Reporter::new(), &Silent).unwrap();
    let filled = begun.elapsed();
    let area: f64 = slices.iter().map(Slice::area).sum();
    let all = || plans.iter().flat_map(|p| &p.coverage);
    let bare: f64 = all().map(|c| c.lack_area).sum();
    let metres: f64 = all().map(|c| c.fill_ratio * c.area).sum::<f64>() / settings.stepover * 1e-3;
    let vertices: usize = slices[0]
        .regions
        .iter()
        .flat_map(Region::rings)
        .map(Vec::len)
        .sum();
    println!(
        "{path} {} {vertices} {:.0} {:.2} {:.2} {:.3} {:.3} {:.1}",
        layers.len(),
        area / layers.len() as f64,
        sliced.as_secs_f64(),
        filled.as_secs_f64(),
        100.0 * bare / area,
        100.0 * reachable(&slices[0].regions, &plans[0], settings) / slices[0].area(),
        metres,
    );
}

/// Area of a layer, mm², that a round bead can reach and none covers.
fn reachable(
    regions: &[Region],
    plan: &meltpath_planning::LayerPlan,
    settings: &FillSettings,
) -> f64 {
    let half = 0.5 * settings.width;
    let join = Join::Round {
        arc_tolerance: 1e-3 * settings.width,
    };
    let within = outset(&inset(regions, half, join).unwrap(), half, join).unwrap();
    let within = intersection(&within, regions).unwrap();
    let lines: Vec<_> = plan
        .path
        .passes()
        .map(|p| {
            p.flatten(settings.tolerance)
                .0
                .iter()
                .map(|q| q.truncate())
                .collect()
        })
        .collect();
    let metal = stroke(&lines, half + settings.tolerance, 2e-3 * settings.width).unwrap();
    let area = |r: &[Region]| r.iter().map(Region::area).sum::<f64>();
    area(&within) - area(&intersection(&within, &metal).unwrap())
}
