//! Memory of a scan-head job does not grow with its layers: from a layer file and from a part.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::alloc::System;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use cap::Cap;
use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::Silent;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::shapes;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// Vectors of a layer.
const VECTORS: u32 = 4000;

/// A vector list of layers of short lines, the light off between them.
fn list(path: &Path, layers: u32) {
    let mut to = BufWriter::new(File::create(path).unwrap());
    writeln!(to, "kind,x [mm],y [mm],layer,height [mm],speed [mm/s]").unwrap();
    for layer in 1..=layers {
        let height = 0.04 * f64::from(layer);
        writeln!(to, "start,0,0,{layer},{height},").unwrap();
        for k in 0..VECTORS / 2 {
            let (x, y) = (0.9 * f64::from(k % 10), 0.05 * f64::from(k / 10));
            writeln!(to, "jump,{x},{y},{layer},{height},5000").unwrap();
            writeln!(to, "fill,{},{y},{layer},{height},2000", x + 0.8).unwrap();
        }
    }
    to.into_inner().unwrap();
}

/// The most that a job held, bytes beyond what was held before it.
fn most(folder: &Path, name: &str, text: &str) -> usize {
    let job = folder.join(format!("{name}.toml"));
    fs::write(&job, text).unwrap();
    let out = folder.join(name);
    chain::run(&job, At(&out), &Silent).unwrap();
    MEMORY.max_allocated()
}

const HEAD: &str = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"uniform\"]\ndelays = \"recipe\"\n";

#[test]
fn memory_does_not_grow_with_the_layers() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path();
    for layers in [10, 150] {
        list(&place.join(format!("{layers}.csv")), layers);
    }
    let job =
        |layers: u32| format!("{HEAD}layers = \"{layers}.csv\"\n[layers]\nrange = [1, {layers}]\n");
    // what has been held at most can only grow: the small job first
    let few = most(place, "few", &job(10));
    let many = most(place, "many", &job(150));
    let at_once = 140 * VECTORS as usize * 56;
    // how far the threads are ahead of one another decides of some 2 MB, in either job
    assert!(
        many < few + at_once / 8,
        "10 layers {few} bytes, 150 layers {many}; their vectors at once {at_once} more"
    );
    let mut stl = Vec::new();
    write_stl(&shapes::thin_wall(12.0, 10.0, 8.0), "block", &mut stl).unwrap();
    fs::write(place.join("block.stl"), stl).unwrap();
    let job = |layers: u32| {
        let hatch = "[section]\nheight = \"6 mm\"\n[hatch]\nspacing = \"0.5 mm\"\n";
        let hatch = hatch.replace("[hatch]", &format!("layers = {layers}\n[hatch]"));
        format!("part = \"block.stl\"\n{HEAD}{hatch}")
    };
    let few = most(place, "few-of-a-part", &job(5));
    let many = most(place, "many-of-a-part", &job(60));
    assert!(many < few + 500_000, "{few} {many}");
}
