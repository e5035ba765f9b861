//! Voxels: shares of boxes and meshes, columns read and laid in any direction, closed surfaces.
use meltpath_geometry::Mesh;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};
use meltpath_geometry::shapes;
use meltpath_geometry::workpiece::{Columns, Voxels, VoxelsError};
use std::collections::HashMap;

/// A box as a mesh, turned.
fn cuboid(lo: DVec3, hi: DVec3, turn: DMat3) -> Mesh {
    let size = hi - lo;
    let mut mesh = shapes::extrude(&[shapes::plate(size.x, size.y)], size.z);
    for v in &mut mesh.vertices {
        *v = turn * (*v + lo);
    }
    mesh
}

fn joined(a: Mesh, b: &Mesh) -> Mesh {
    let count = a.vertices.len() as u32;
    let mut all = a;
    all.vertices.extend(&b.vertices);
    all.triangles
        .extend(b.triangles.iter().map(|t| t.map(|v| v + count)));
    all
}

fn space() -> Voxels {
    Voxels::new(DVec3::splat(-20.0), DVec3::splat(20.0), 0.5).unwrap()
}

fn any() -> DMat3 {
    DMat3::from_quat(DQuat::from_axis_angle(
        DVec3::new(1.0, -2.0, 0.7).normalize(),
        0.9,
    ))
}

fn is_closed(mesh: &Mesh) -> bool {
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    balance.values().all(|n| *n == 0)
}

#[test]
fn a_box_fills_shares_of_voxels() {
    let mut voxels = space();
    let (lo, hi) = (DVec3::new(-11.3, -8.1, -9.95), DVec3::new(7.7, 14.2, 12.6));
    voxels.fill_box(lo, hi).unwrap();
    voxels.sanity_check().unwrap();
    let volume = (hi - lo).element_product();
    assert!((voxels.volume() / volume - 1.0).abs() < 1e-6);
    // whole blocks inside hold no values
    assert!(voxels.memory() < 4 * 80 * 80 * 80);
    // again, and nothing is added
    let before = voxels.clone();
    voxels.fill_box(lo, hi).unwrap();
    assert_eq!(voxels, before);
}

#[test]
fn meshes_fill_by_their_winding() {
    let (lo, hi) = (DVec3::splat(-10.0), DVec3::new(10.0, 5.0, 7.0));
    for turn in [DMat3::IDENTITY, any()] {
        let one = cuboid(lo, hi, turn);
        let mut voxels = space();
        let fill = voxels.fill_mesh(&one).unwrap();
        voxels.sanity_check().unwrap();
        assert_eq!(fill.open, 0.0);
        assert!((fill.volume / one.volume() - 1.0).abs() < 2e-3, "{fill:?}");
        // a second sheet that overlaps counts once where both are
        let more = cuboid(DVec3::splat(0.0), DVec3::splat(11.0), turn);
        let mut voxels = space();
        let fill = voxels.fill_mesh(&joined(one, &more)).unwrap();
        let union = 20.0 * 15.0 * 17.0 + 11.0_f64.powi(3) - 10.0 * 5.0 * 7.0;
        assert!((fill.volume / union - 1.0).abs() < 3e-3, "{fill:?} {union}");
        voxels.sanity_check().unwrap();
    }
}

#[test]
fn a_mesh_with_a_hole_is_told() {
    let mut mesh = cuboid(DVec3::splat(-10.0), DVec3::splat(10.0), DMat3::IDENTITY);
    // the upper face looks up along the columns
    mesh.triangles.retain(|t| {
        let up = t.map(|v| mesh.vertices[v as usize].z);
        up != [10.0; 3]
    });
    let fill = space().fill_mesh(&mesh).unwrap();
    assert!(fill.open > 0.9, "{fill:?}");
}

#[test]
fn what_makes_no_box_is_refused() {
    let one = DVec3::ONE;
    assert!(matches!(
        Voxels::new(-one, one, 0.0),
        Err(VoxelsError::Cell { .. })
    ));
    assert!(matches!(
        Voxels::new(one, -one, 0.5),
        Err(VoxelsError::Bounds { .. })
    ));
    assert!(matches!(
        Voxels::new(-one, f64::NAN * one, 0.5),
        Err(VoxelsError::Bounds { .. })
    ));
    let Err(VoxelsError::TooLarge { remedy, .. }) = Voxels::new(-1e4 * one, 1e4 * one, 0.5) else {
        panic!("20 m in half millimetres")
    };
    assert!(Voxels::new(-1e4 * one, 1e4 * one, remedy).is_ok());
    // coordinates that are no numbers fill nothing
    let mut mesh = cuboid(-one, one, DMat3::IDENTITY);
    mesh.vertices[3].x = f64::NAN;
    assert!(space().fill_mesh(&mesh).unwrap().volume.is_finite());
}

/// A plate under a `top`, mm.
fn slab(top: f64, turn: DMat3) -> Mesh {
    let low = DVec3::new(-12.0, -12.0, -6.0);
    cuboid(low, DVec3::new(12.0, 12.0, top), turn)
}

fn columns(turn: DMat3) -> Columns {
    Columns {
        origin: DVec3::ZERO,
        axes: [turn.x_axis, turn.y_axis, turn.z_axis],
        side: 0.5,
    }
}

#[test]
fn a_column_reads_the_surface_in_any_direction() {
    for turn in [DMat3::IDENTITY, any()] {
        let mut voxels = space();
        voxels.fill_mesh(&slab(3.3, turn)).unwrap();
        let columns = columns(turn);
        for (x, y) in [(0.25, 0.25), (5.1, -3.7), (-8.2, 6.6)] {
            let from_air = voxels.column(&columns, (x, y), (-5.0, 9.0, 12.0)).unwrap();
            let from_metal = voxels.column(&columns, (x, y), (-5.0, 0.0, 12.0)).unwrap();
            for column in [from_air, from_metal] {
                assert!((column.top - 3.3).abs() < 0.05, "{column:?}");
                assert_eq!(column.cover, 1.0);
            }
        }
        // beside it there is nothing, and out of reach neither
        assert!(
            voxels
                .column(&columns, (14.0, 0.0), (-5.0, 9.0, 12.0))
                .is_none()
        );
        assert!(
            voxels
                .column(&columns, (0.0, 0.0), (4.5, 9.0, 12.0))
                .is_none()
        );
    }
    // half a column of wall, on a floor
    let mut voxels = space();
    voxels
        .fill_box(DVec3::splat(-10.0), DVec3::new(10.0, 10.0, 0.0))
        .unwrap();
    voxels
        .fill_box(DVec3::new(-10.0, -10.0, 0.0), DVec3::new(0.2, 10.0, 5.1))
        .unwrap();
    let columns = columns(DMat3::IDENTITY);
    let column = voxels
        .column(&columns, (0.25, 0.25), (-5.0, 9.0, 12.0))
        .unwrap();
    assert!((column.cover - 0.4).abs() < 1e-6, "{column:?}");
    assert!((column.top - 5.1).abs() < 1e-6, "{column:?}");
    assert!(column.foot.abs() < 0.3, "{column:?}");
}

#[test]
fn metal_laid_in_columns_keeps_its_volume_and_its_height() {
    for turn in [DMat3::IDENTITY, any()] {
        let mut voxels = space();
        voxels.fill_mesh(&slab(0.0, turn)).unwrap();
        let before = voxels.volume();
        let columns = columns(turn);
        let at = |n: i32| 0.5 * f64::from(n) + 0.25;
        let mut owed = 0.0;
        for layer in 0..3 {
            let from = 1.6 * f64::from(layer);
            for iy in -12..12 {
                for ix in -12..12 {
                    let here = (at(ix), at(iy));
                    owed = voxels.lay(&columns, here, (from, from + 1.6), 1.0, owed);
                }
            }
        }
        voxels.sanity_check().unwrap();
        let laid = 3.0 * 1.6 * 144.0;
        let error = (voxels.volume() - before + owed) / laid - 1.0;
        assert!(error.abs() < 1e-9, "{error}");
        assert!(owed.abs() < 1e-6);
        let top = voxels
            .column(&columns, (0.25, 0.25), (-5.0, 9.0, 12.0))
            .unwrap()
            .top;
        assert!((top - 4.8).abs() < 0.15, "{top}");
        let mesh = voxels.to_mesh();
        assert!(is_closed(&mesh));
        assert!((mesh.volume() / voxels.volume() - 1.0).abs() < 0.01);
    }
}

#[test]
fn surfaces_close_at_the_border_of_the_box_and_of_blocks() {
    let mut voxels = Voxels::new(DVec3::ZERO, DVec3::splat(24.0), 0.5).unwrap();
    assert!(voxels.to_mesh().triangles.is_empty());
    // all of the box, in whole blocks
    voxels.fill_box(DVec3::ZERO, DVec3::splat(24.0)).unwrap();
    let mesh = voxels.to_mesh();
    assert!(is_closed(&mesh));
    // the edges lose an eighth of a voxel
    assert!((mesh.volume() / 24.0_f64.powi(3) - 1.0).abs() < 4e-3);
    // two voxels that touch along an edge
    let mut voxels = Voxels::new(DVec3::ZERO, DVec3::splat(24.0), 0.5).unwrap();
    voxels
        .fill_box(DVec3::splat(7.5), DVec3::new(8.0, 8.0, 8.5))
        .unwrap();
    voxels
        .fill_box(DVec3::new(8.0, 8.0, 7.5), DVec3::new(8.5, 8.5, 8.5))
        .unwrap();
    let mesh = voxels.to_mesh();
    assert!(is_closed(&mesh) && mesh.volume() > 0.0);
}

/// Voxels half full put the surface on their centres: no two vertices coincide there, nor as the 32-bit numbers of files.
#[test]
fn vertices_never_coincide() {
    let mut voxels = Voxels::new(DVec3::splat(200.0), DVec3::splat(212.0), 0.5).unwrap();
    // ends in the middle of voxels: half full along faces, a quarter along edges
    voxels
        .fill_box(DVec3::splat(203.25), DVec3::new(207.25, 206.0, 208.75))
        .unwrap();
    voxels
        .fill_box(
            DVec3::new(207.5, 203.0, 203.0),
            DVec3::new(208.0, 203.25, 203.5),
        )
        .unwrap();
    let mesh = voxels.to_mesh();
    assert!(is_closed(&mesh));
    let places: std::collections::HashSet<_> = mesh
        .vertices
        .iter()
        .map(|p| p.as_vec3().to_array().map(f32::to_bits))
        .collect();
    assert_eq!(places.len(), mesh.vertices.len());
}
