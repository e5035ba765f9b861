//! Parts: STEP, STL, 3MF.

use std::io::{Cursor, Read, Write};

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::brep::{Tolerance, tessellate};
use meltpath_geometry::io::stl::{read_stl, write_stl};
use meltpath_geometry::io::threemf::{read_3mf, write_3mf};
use meltpath_geometry::mesh::NamedMesh;
use meltpath_geometry::{Mesh, shapes, step};

use super::{Target, files};
use crate::mutate::Form;

/// STEP files: what parses is also meshed.
pub(super) const STEP: Target = Target {
    name: "step",
    form: Form::Text,
    seeds: || files("crates/geometry/tests/data/step", &["step"], 32_000),
    body: |bytes| {
        let Ok(model) = step::parse(bytes, &Reporter::new()) else {
            return;
        };
        let tolerance = Tolerance {
            chord: 1.0,
            ..Tolerance::default()
        };
        if let Ok(mesh) = tessellate(&model, &tolerance, &Reporter::new(), &Silent) {
            assert!(mesh.vertices.iter().all(|v| v.is_finite()));
        }
    },
};

fn part() -> Mesh {
    shapes::flange((60.0, 12.0), (30.0, 35.0), 18.0, 6, 45.0, 5.5)
}

/// An STL as text; normals are not read.
fn text(mesh: &Mesh) -> String {
    let facet = |t| {
        let corners = mesh
            .corners(t)
            .map(|p| format!("vertex {} {} {}", p.x, p.y, p.z));
        let loop_of = corners.join("\n");
        format!("facet normal 0 0 1\nouter loop\n{loop_of}\nendloop\nendfacet\n")
    };
    let facets: String = (0..mesh.triangles.len()).map(facet).collect();
    format!("solid part\n{facets}endsolid part\n")
}

/// STL files, binary and text.
pub(super) const STL: Target = Target {
    name: "stl",
    form: Form::Binary,
    seeds: || {
        let mut binary = Vec::new();
        let small = shapes::flange((10.0, 5.0), (6.0, 8.0), 4.0, 0, 8.0, 1.0);
        write_stl(&part(), "part", &mut binary).unwrap();
        vec![binary, text(&small).into_bytes()]
    },
    body: |bytes| {
        let read = |bytes: &[u8]| {
            let length = Some(bytes.len() as u64);
            read_stl(Cursor::new(bytes), length, &Reporter::new(), &Silent)
        };
        let Ok(stl) = read(bytes) else {
            return;
        };
        let mut written = Vec::new();
        write_stl(&stl.mesh, "again", &mut written).unwrap();
        let again = read(&written).expect("what is written can be read");
        assert_eq!(again.mesh.triangles.len(), stl.mesh.triangles.len());
    },
};

fn package() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let named = NamedMesh {
        name: "part".to_owned(),
        mesh: part(),
    };
    write_3mf(&[named], &mut bytes).unwrap();
    bytes.into_inner()
}

fn read_package(bytes: &[u8]) {
    if let Ok(meshes) = read_3mf(Cursor::new(bytes), &Reporter::new(), &Silent) {
        for named in meshes {
            let count = named.mesh.vertices.len() as u32;
            assert!(named.mesh.triangles.iter().flatten().all(|v| *v < count));
        }
    }
}

/// 3MF packages as they lie on a disk.
pub(super) const THREE_MF: Target = Target {
    name: "threemf",
    form: Form::Binary,
    seeds: || vec![package()],
    body: read_package,
};

/// The model inside a 3MF package: the package round it is whole.
pub(super) const THREE_MF_MODEL: Target = Target {
    name: "threemf_model",
    form: Form::Text,
    seeds: || {
        let mut archive = zip::ZipArchive::new(Cursor::new(package())).unwrap();
        let mut model = Vec::new();
        archive
            .by_name("3D/3dmodel.model")
            .unwrap()
            .read_to_end(&mut model)
            .unwrap();
        let components = r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="inch" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources>
<object id="1" type="model" name="tetra"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices>
<triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/><triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/></triangles></mesh></object>
<object id="2" type="model"><components><component objectid="1"/><component objectid="1" transform="1 0 0 0 1 0 0 0 1 10 0 0"/></components></object>
<object id="3" type="model"><components><component objectid="2"/><component objectid="2" transform="0 1 0 1 0 0 0 0 1 0 20 0"/></components></object>
</resources>
<build><item objectid="3" transform="2 0 0 0 2 0 0 0 2 0 0 5"/><item objectid="1"/></build>
</model>
"#;
        vec![model, components.as_bytes().to_vec()]
    },
    body: |model| {
        let mut whole = zip::ZipArchive::new(Cursor::new(package())).unwrap();
        let mut out = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let stored = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored);
        for n in 0..whole.len() {
            let mut file = whole.by_index(n).unwrap();
            let name = file.name().unwrap().into_owned();
            out.start_file(&name, stored).unwrap();
            if name == "3D/3dmodel.model" {
                out.write_all(model).unwrap();
            } else {
                let mut bytes = Vec::new();
                file.read_to_end(&mut bytes).unwrap();
                out.write_all(&bytes).unwrap();
            }
        }
        read_package(&out.finish().unwrap().into_inner());
    },
};
