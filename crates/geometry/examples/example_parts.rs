//! Writes the generated parts of `examples/`: `cargo run -p meltpath-geometry --example example_parts -- examples`.
//! The two STEP parts there come from a CAD kernel: `examples/parts/make_parts.py`.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::io::threemf::write_3mf;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::mesh::NamedMesh;
use meltpath_geometry::{Mesh, shapes};

/// The walls of Rouchon 2022, § 4.3, less the 2 mm of allowance that their jobs add on the sides and on top. A bead of the
/// seed map is 6.54 mm wide.
const WIDTH: f64 = 6.54;
const ALLOWANCE: f64 = 2.0;

/// A wall of `beads` beads, 4.62 mm apart, whose paths are `path` mm long, `layers` layers of `height` mm.
fn wall(path: f64, beads: f64, layers: f64, height: f64) -> Mesh {
    let across = (beads - 1.0) * 4.62 + WIDTH - 2.0 * ALLOWANCE;
    shapes::thin_wall(
        path + WIDTH - 2.0 * ALLOWANCE,
        across,
        layers * height - ALLOWANCE,
    )
}

/// A convex prism: the polygon `profile` (x, z; counter-clockwise seen from -y) between y = `from` and y = `to`.
fn prism(profile: &[(f64, f64)], from: f64, to: f64) -> Mesh {
    let n = profile.len() as u32;
    let at = |y: f64| profile.iter().map(move |&(x, z)| DVec3::new(x, y, z));
    let vertices = at(from).chain(at(to)).collect();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for i in 1..n - 1 {
        triangles.push([0, i, i + 1]);
        triangles.push([n, n + i + 1, n + i]);
    }
    for i in 0..n {
        let j = (i + 1) % n;
        triangles.push([i, n + i, n + j]);
        triangles.push([i, n + j, j]);
    }
    Mesh {
        vertices,
        triangles,
    }
}

/// A pipe Ø 100 / Ø 80, 55 mm tall, with a boss on its side that stands on the plate, so that it needs no support.
fn boss_on_pipe() -> Mesh {
    let mut pipe = shapes::extrude(&[shapes::ring(50.0, 40.0, 180)], 55.0);
    let boss = prism(
        &[(45.0, 0.0), (64.0, 0.0), (64.0, 45.0), (45.0, 45.0)],
        -18.0,
        18.0,
    );
    pipe.add(&boss);
    pipe
}

/// A round bar of 64 corners from a place along an axis.
fn bar(from: DVec3, axis: DVec3, radius: f64, length: f64) -> Mesh {
    const CORNERS: u32 = 64;
    let axis = axis.normalize();
    let u = DVec3::Y;
    let v = axis.cross(u);
    let corner = |i: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(CORNERS)).sin_cos();
        (radius * cos, radius * sin)
    };
    // a prism lies along y: its x, y and z become u, the axis and v
    let outline: Vec<(f64, f64)> = (0..CORNERS).map(corner).collect();
    let mut bar = prism(&outline, 0.0, length);
    for p in &mut bar.vertices {
        *p = from + p.x * v + p.y * axis + p.z * u;
    }
    bar
}

fn main() -> io::Result<()> {
    let examples = PathBuf::from(
        std::env::args()
            .nth(1)
            .unwrap_or_else(|| "examples".to_owned()),
    );
    let stl = |folder: &str, file: &str, mesh: &Mesh| {
        let mut w = BufWriter::new(File::create(examples.join(folder).join(file))?);
        write_stl(mesh, folder, &mut w)?;
        w.flush()
    };
    stl("thin-wall", "wall.stl", &wall(150.0, 1.0, 25.0, 1.2))?;
    stl("raster-wall", "wall.stl", &wall(120.0, 6.0, 25.0, 1.85))?;
    stl("contour-wall", "wall.stl", &wall(120.0, 8.0, 20.0, 1.85))?;
    stl("boss-on-pipe", "boss-on-pipe.stl", &boss_on_pipe())?;
    let plate = shapes::cuboid(DVec3::new(-75.0, -60.0, -12.0), DVec3::new(75.0, 60.0, 0.0));
    stl("node", "plate.stl", &plate)?;
    let block = shapes::cuboid(DVec3::new(-25.0, -20.0, -2.0), DVec3::new(25.0, 20.0, 50.0));
    stl("node", "block.stl", &block)?;
    let strut = bar(DVec3::new(20.0, 0.0, 28.0), DVec3::X, 14.0, 35.0);
    stl("node", "strut.stl", &strut)?;
    let (sin, cos) = 20.0_f64.to_radians().sin_cos();
    let arm = bar(
        DVec3::new(-18.0, 0.0, 25.0),
        DVec3::new(-cos, 0.0, sin),
        13.0,
        45.0,
    );
    stl("node", "arm.stl", &arm)?;
    let blank = NamedMesh {
        name: "impeller-blank".to_owned(),
        mesh: shapes::impeller_blank((24.0, 40.0), (65.0, 10.0), 11.0),
    };
    let mut bytes = io::Cursor::new(Vec::new());
    write_3mf(&[blank], &mut bytes).map_err(io::Error::other)?;
    std::fs::write(
        examples.join("impeller-blank/impeller-blank.3mf"),
        bytes.into_inner(),
    )
}
