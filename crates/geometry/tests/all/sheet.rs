//! Fronts on faces of STEP files.

use std::path::PathBuf;

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::brep::tessellate::tessellate_solid;
use meltpath_geometry::brep::{BrepModel, Solid, Surface, Tolerance};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::sheet::{FrontLine, Sheet};
use meltpath_geometry::{Mesh, step};

const CHORD: f64 = 0.02;

fn model(name: &str) -> BrepModel {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/step");
    step::read(
        std::fs::File::open(folder.join(name)).unwrap(),
        &Reporter::new(),
    )
    .unwrap()
}

fn meshed(solid: &Solid) -> Mesh {
    let tolerance = Tolerance {
        chord: CHORD,
        ..Tolerance::default()
    };
    tessellate_solid(solid, "piece", &tolerance, &Reporter::new(), &Silent).unwrap()
}

/// Fronts over every curved face of two files lie on the exact surface, and keep their distance.
#[test]
fn fronts_on_faces_of_a_file_lie_on_their_surfaces() {
    let mut faces = 0;
    for name in ["spheres_and_tori.step", "bottle.step"] {
        for placed in &model(name).solids {
            for f in 0..placed.solid.faces.len() as u32 {
                let surface = placed.solid.faces[f as usize].surface.clone();
                if matches!(*surface, Surface::Plane(_)) {
                    continue;
                }
                let mesh = meshed(&placed.solid.piece(&[f]).unwrap());
                let (low, high) = mesh.bounds().unwrap();
                let size = high - low;
                let spacing = size.max_element() / 12.0;
                // cut in the middle, across the longest side
                let way = if size.x >= size.max_element() {
                    DVec3::X
                } else if size.y >= size.z {
                    DVec3::Y
                } else {
                    DVec3::Z
                };
                let middle = 0.5 * (low + high);
                let sheet = Sheet::new(&mesh, spacing).unwrap();
                let found = sheet
                    .fronts(|p| (p - middle).dot(way), spacing, 0.01)
                    .unwrap();
                assert!(
                    (3..=12).contains(&found.fronts.len()),
                    "{name} {f}: {}",
                    found.fronts.len()
                );
                for point in found
                    .fronts
                    .iter()
                    .flat_map(|f| &f.lines)
                    .flat_map(|l| &l.points)
                {
                    let uv = surface.locate(point.position, None, 2.0 * CHORD);
                    let off = surface.point(uv).distance(point.position);
                    assert!(off < 1.5 * CHORD, "{name} {f}: {off} mm off");
                    assert!((point.position.distance(point.from) - spacing).abs() < 1e-6);
                    assert!(point.normal.dot(surface.normal(uv)).abs() > 0.9);
                }
                faces += 1;
            }
        }
    }
    assert!(faces > 5, "{faces}");
}

/// Faces that share an edge are one surface: fronts run over it.
#[test]
fn fronts_run_from_face_to_face() {
    let placed = &model("bottle.step").solids[0];
    let solid = &placed.solid;
    let all: Vec<u32> = (0..solid.faces.len() as u32).collect();
    let whole = meshed(&solid.piece(&all).unwrap());
    let parts: f64 = all
        .iter()
        .map(|&f| meshed(&solid.piece(&[f]).unwrap()).area())
        .sum();
    assert!((whole.area() / parts - 1.0).abs() < 1e-3);
    assert!((whole.area() / meshed(solid).area() - 1.0).abs() < 1e-9);
    let low = whole.bounds().unwrap().0;
    let sheet = Sheet::new(&whole, 3.0).unwrap();
    let found = sheet.fronts(|p| p.z - low.z - 5.0, 3.0, 0.01).unwrap();
    assert_eq!(found.unreached, 0.0);
    assert!(found.fronts.len() > 10);
    let closed = |l: &FrontLine| l.points[0].position == l.points[l.points.len() - 1].position;
    assert!(found.fronts[..3].iter().all(|f| f.lines.iter().all(closed)));
    assert!(solid.piece(&[all.len() as u32]).is_none());
}
