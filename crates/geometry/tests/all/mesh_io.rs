//! STL and 3MF in and out: round trips, damaged files, limits.

use std::{
    fmt::Write as _,
    io::{Cursor, Write},
};

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::mesh::NamedMesh;
use meltpath_geometry::{
    Mesh,
    io::{
        MeshFormat, ReadMeshError, read_mesh,
        stl::{StlError, write_stl},
        threemf::{ThreeMfError, write_3mf},
    },
    math::DVec3,
    shapes,
};
use proptest::prelude::*;

fn read(bytes: &[u8], format: MeshFormat) -> (Result<Vec<NamedMesh>, ReadMeshError>, Vec<String>) {
    let reporter = Reporter::new();
    let folder = tempfile::tempdir().unwrap();
    let name = match format {
        MeshFormat::Stl => "part.stl",
        MeshFormat::ThreeMf => "part.3mf",
    };
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let result = read_mesh(&path, &reporter, &Silent);
    (
        result,
        reporter.warnings().into_iter().map(|w| w.code).collect(),
    )
}

fn stl_error(bytes: &[u8]) -> StlError {
    match read(bytes, MeshFormat::Stl).0 {
        Err(ReadMeshError::Stl(e)) => e,
        other => panic!("{other:?}"),
    }
}

fn threemf_error(bytes: &[u8]) -> ThreeMfError {
    match read(bytes, MeshFormat::ThreeMf).0 {
        Err(ReadMeshError::ThreeMf(e)) => e,
        other => panic!("{other:?}"),
    }
}

fn binary(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_stl(mesh, "part", &mut bytes).unwrap();
    bytes
}

/// As text, as other software writes it, with every digit.
fn text(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("solid part\n");
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let n = (b - a).cross(c - a).normalize_or_zero();
        writeln!(text, "facet normal {} {} {}\nouter loop", n.x, n.y, n.z).unwrap();
        for p in [a, b, c] {
            writeln!(text, "vertex {} {} {}", p.x, p.y, p.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text += "endsolid part\n";
    text.into_bytes()
}

fn flange() -> Mesh {
    shapes::flange((60.0, 12.0), (30.0, 35.0), 18.0, 6, 45.0, 5.5)
}

/// The mesh with coordinates as a binary STL keeps them.
fn rounded(mesh: &Mesh) -> Mesh {
    Mesh {
        vertices: mesh
            .vertices
            .iter()
            .map(|p| p.as_vec3().as_dvec3())
            .collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Corner positions of all triangles: what a file keeps of a mesh.
fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect()
}

#[test]
fn binary_stl_round_trip_welds_back_to_the_same_mesh() {
    let part = rounded(&flange());
    let (meshes, warnings) = read(&binary(&part), MeshFormat::Stl);
    let read_back = &meshes.unwrap()[0];
    assert!(warnings.is_empty());
    assert_eq!(read_back.mesh.vertices.len(), part.vertices.len());
    assert_eq!(corners(&read_back.mesh), corners(&part));
}

#[test]
fn text_stl_keeps_every_digit_and_any_layout() {
    let part = flange();
    let bytes = text(&part);
    let (meshes, warnings) = read(&bytes, MeshFormat::Stl);
    assert_eq!(
        (meshes.unwrap()[0].name.as_str(), warnings.len()),
        ("part", 0)
    );
    let shouting = String::from_utf8(bytes)
        .unwrap()
        .to_uppercase()
        .replace('\n', "\r\n\t ");
    let with_mark = format!("\u{feff}{shouting}");
    let (meshes, _) = read(with_mark.as_bytes(), MeshFormat::Stl);
    assert_eq!(corners(&meshes.unwrap()[0].mesh), corners(&part));
}

/// Facets of an STL as they stand in its bytes: normal, then corners.
fn facets_of_binary(bytes: &[u8]) -> Vec<[DVec3; 4]> {
    let number = |b: &[u8]| f64::from(f32::from_le_bytes(b.try_into().unwrap()));
    let vector = |b: &[u8]| DVec3::new(number(&b[..4]), number(&b[4..8]), number(&b[8..12]));
    let records = bytes[84..].chunks_exact(50);
    let each = |r: &[u8]| [0, 12, 24, 36].map(|at| vector(&r[at..at + 12]));
    records.map(each).collect()
}

fn facets_of_text(bytes: &[u8]) -> Vec<[DVec3; 4]> {
    let text = std::str::from_utf8(bytes).unwrap();
    let numbers: Vec<f64> = text
        .split_whitespace()
        .filter_map(|w| w.parse().ok())
        .collect();
    let vector = |v: &[f64]| DVec3::new(v[0], v[1], v[2]);
    let facets = numbers.chunks_exact(12);
    let each = |f: &[f64]| [0, 3, 6, 9].map(|at| vector(&f[at..at + 3]));
    facets.map(each).collect()
}

#[test]
fn facets_are_written_and_read_as_they_look_outwards() {
    // of a convex body about the origin every facet looks away from it
    let mut cube = shapes::extrude(&[shapes::plate(10.0, 10.0)], 10.0);
    let (lo, hi) = cube.bounds().unwrap();
    for v in &mut cube.vertices {
        *v -= 0.5 * (lo + hi);
    }
    let facets = facets_of_binary(&binary(&cube));
    assert_eq!(facets.len(), 12);
    for [normal, a, b, c] in facets {
        assert!((normal.length() - 1.0).abs() < 1e-6 && normal.dot(a) > 4.9);
        assert!((b - a).cross(c - a).normalize().dot(normal) > 0.999);
    }
    // what other software wrote keeps its sense too
    let corner = "solid t\n\
        facet normal 0 0 -1 outer loop vertex 0 0 0 vertex 0 1 0 vertex 1 0 0 endloop endfacet\n\
        facet normal 0 -1 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 0 1 endloop endfacet\n\
        facet normal 1 1 1 outer loop vertex 1 0 0 vertex 0 1 0 vertex 0 0 1 endloop endfacet\n\
        facet normal -1 0 0 outer loop vertex 0 0 0 vertex 0 0 1 vertex 0 1 0 endloop endfacet\nendsolid t\n";
    let mut as_binary = vec![0; 80];
    as_binary.extend(4u32.to_le_bytes());
    for facet in facets_of_text(corner.as_bytes()) {
        for x in facet
            .iter()
            .flat_map(meltpath_geometry::math::DVec3::to_array)
        {
            as_binary.extend((x as f32).to_le_bytes());
        }
        as_binary.extend([0, 0]);
    }
    for bytes in [corner.as_bytes(), &as_binary] {
        let (meshes, _) = read(bytes, MeshFormat::Stl);
        let volume = meshes.unwrap()[0].mesh.volume();
        assert!((volume - 1.0 / 6.0).abs() < 1e-12, "{volume}");
    }
}

#[test]
fn a_binary_file_whose_header_says_solid_is_binary() {
    let mut bytes = binary(&flange());
    bytes[..80].fill(b' ');
    bytes[..12].copy_from_slice(b"solid flange");
    let (meshes, warnings) = read(&bytes, MeshFormat::Stl);
    assert_eq!(meshes.unwrap()[0].name, "flange");
    assert!(warnings.is_empty());
}

#[test]
fn damaged_stl_files_say_what_and_where() {
    assert!(matches!(stl_error(b""), StlError::Empty));
    assert!(matches!(
        stl_error(b"<html>not found</html>"),
        StlError::NotStl
    ));
    assert!(matches!(
        stl_error(b"solid a\nendsolid a\n"),
        StlError::NoTriangles
    ));
    let part = flange();
    let whole = binary(&part);
    let announced = part.triangles.len() as u32;
    for end in [83, 84, 100, 133, 134, whole.len() - 1] {
        let error = stl_error(&whole[..end]);
        let wanted = if end < 84 {
            1
        } else {
            (end as u64 - 84) / 50 + 1
        };
        assert!(
            matches!(error, StlError::Truncated { triangle, end: e, announced: n }
                if triangle == wanted && e == end as u64 && (n == announced || end < 84)),
            "{end}: {error}"
        );
    }
    let mut nan = whole.clone();
    nan[84 + 50 * 7 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(
        stl_error(&nan),
        StlError::NotFinite {
            triangle: 8,
            offset: 450
        }
    ));
    let letters = text(&part);
    let letters = String::from_utf8(letters).unwrap();
    let comma = letters.replacen("vertex 60", "vertex 60,0", 1);
    assert!(matches!(stl_error(comma.as_bytes()), StlError::Text { line, .. } if line > 1));
    let cut = &letters.as_bytes()[..letters.find("endfacet").unwrap()];
    assert!(matches!(
        stl_error(cut),
        StlError::TextTruncated {
            line: 8,
            expected: "endfacet"
        }
    ));
    let infinite = letters.replacen("vertex 60", "vertex inf", 1);
    assert!(matches!(
        stl_error(infinite.as_bytes()),
        StlError::Text { .. }
    ));
}

#[test]
fn harmless_oddities_of_stl_files_are_warnings() {
    let part = flange();
    let mut bytes = binary(&part);
    bytes.extend([1; 60]);
    let (meshes, warnings) = read(&bytes, MeshFormat::Stl);
    assert_eq!(
        meshes.unwrap()[0].mesh.triangles.len(),
        part.triangles.len()
    );
    assert_eq!(warnings, ["stl-trailing-bytes"]);
    // a count that was cut leaves whole triangles behind it
    let mut bytes = binary(&part);
    let count = part.triangles.len() as u32 - 7;
    bytes[80..84].copy_from_slice(&count.to_le_bytes());
    assert!(matches!(stl_error(&bytes), StlError::Count { more: 7, .. }));
    for count in [0, u32::MAX] {
        let mut bytes = binary(&part);
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        bytes.truncate(bytes.len() - 20);
        assert!(matches!(stl_error(&bytes), StlError::Truncated { .. }));
    }
    for count in [0, u32::MAX] {
        let mut bytes = binary(&part);
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        let (meshes, warnings) = read(&bytes, MeshFormat::Stl);
        assert_eq!(
            meshes.unwrap()[0].mesh.triangles.len(),
            part.triangles.len()
        );
        assert_eq!(warnings, ["stl-count"]);
    }
    let letters = String::from_utf8(text(&part)).unwrap();
    let open = letters
        .trim_end()
        .trim_end_matches("endsolid part")
        .to_owned();
    assert_eq!(
        read(open.as_bytes(), MeshFormat::Stl).1,
        ["stl-unterminated"]
    );
    let twice = format!("{letters}{letters}");
    let (meshes, warnings) = read(twice.as_bytes(), MeshFormat::Stl);
    assert_eq!(
        meshes.unwrap()[0].mesh.triangles.len(),
        2 * part.triangles.len()
    );
    assert_eq!(warnings, ["stl-several-solids"]);
}

#[test]
fn an_unlikely_size_suspects_the_unit() {
    for (scale, suspect) in [(1.0, false), (1e-3, true), (1.0 / 25.4, false), (1e3, true)] {
        let mut part = flange();
        part.vertices.iter_mut().for_each(|p| *p *= scale);
        let warned = read(&binary(&part), MeshFormat::Stl).1 == ["part-unit-suspect"];
        assert_eq!(warned, suspect, "scale {scale}");
    }
}

#[test]
fn files_are_read_by_extension() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Flange.STL");
    std::fs::write(&path, binary(&flange())).unwrap();
    let reporter = Reporter::new();
    assert_eq!(read_mesh(&path, &reporter, &Silent).unwrap().len(), 1);
    let missing = read_mesh(&folder.path().join("no.stl"), &reporter, &Silent);
    assert!(matches!(missing, Err(ReadMeshError::Open { .. })));
    let foreign = read_mesh(&folder.path().join("part.obj"), &reporter, &Silent);
    assert!(
        matches!(foreign, Err(ReadMeshError::Extension { extension, .. }) if extension == "obj")
    );
}

// ---- 3MF

fn packed(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in parts {
        zip.start_file(*name, zip::write::SimpleFileOptions::default())
            .unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

const RELATIONS: &str = r#"<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/part.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;

const TETRA: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="10" y="0" z="0"/><vertex x="0" y="10" z="0"/><vertex x="0" y="0" z="10"/></vertices>
<triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/></triangles></mesh>"#;

fn model(attributes: &str, resources: &str, build: &str) -> Vec<u8> {
    let xml = format!(
        r#"<?xml version="1.0"?><model {attributes} xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>{resources}</resources><build>{build}</build></model>"#
    );
    packed(&[("_rels/.rels", RELATIONS), ("3D/part.model", &xml)])
}

#[test]
fn threemf_round_trip_is_exact_and_repeatable() {
    let meshes = vec![
        NamedMesh {
            name: "a <flange> & \"b\"".to_owned(),
            mesh: flange(),
        },
        NamedMesh {
            name: "cone".to_owned(),
            mesh: shapes::cone(20.0, 10.0, 30.0),
        },
    ];
    let write = || {
        let mut out = Cursor::new(Vec::new());
        write_3mf(&meshes, &mut out).unwrap();
        out.into_inner()
    };
    let bytes = write();
    assert_eq!(bytes, write());
    let (back, warnings) = read(&bytes, MeshFormat::ThreeMf);
    assert_eq!(back.unwrap(), meshes);
    assert!(warnings.is_empty());
}

#[test]
fn units_transforms_and_nested_components_are_applied() {
    let resources = format!(
        r#"<object id="1" name="tetra">{TETRA}</object>
        <object id="2"><components><component objectid="1"/><component objectid="1" transform="-1 0 0 0 1 0 0 0 1 -5 0 0"/></components></object>
        <object id="7" name="pair"><components><component objectid="2" transform="2 0 0 0 2 0 0 0 2 0 0 1"/></components></object>"#
    );
    let build =
        r#"<item objectid="7" transform="0 1 0 -1 0 0 0 0 1 100 0 0"/><item objectid="1"/>"#;
    let (meshes, _) = read(
        &model(r#"unit="inch""#, &resources, build),
        MeshFormat::ThreeMf,
    );
    let meshes = meshes.unwrap();
    assert_eq!(
        (meshes[0].name.as_str(), meshes[1].name.as_str()),
        ("pair", "tetra")
    );
    let inch3 = 25.4_f64.powi(3);
    let tetra = 1000.0 / 6.0;
    assert!(
        (meshes[0].mesh.volume() / (16.0 * tetra * inch3) - 1.0).abs() < 1e-12,
        "mirrored copies count too"
    );
    let (lo, hi) = meshes[0].mesh.bounds().unwrap();
    // x to y by the item's quarter turn; the mirrored copy reaches from -30 to 20
    assert!(
        (lo / 25.4 - DVec3::new(80.0, -30.0, 1.0)).length() < 1e-9,
        "{lo}"
    );
    assert!(
        (hi / 25.4 - DVec3::new(100.0, 20.0, 21.0)).length() < 1e-9,
        "{hi}"
    );
}

#[test]
fn production_paths_lead_to_other_model_parts() {
    let xml = |body: &str| {
        format!(
            r#"<model requiredextensions="p" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06">{body}</model>"#
        )
    };
    let bytes = packed(&[
        ("_rels/.rels", RELATIONS),
        (
            "3D/part.model",
            &xml(
                r#"<resources><object id="1"><components><component p:path="/3D/Objects/a.model" objectid="5"/></components></object></resources><build><item objectid="1"/></build>"#,
            ),
        ),
        (
            "3D/objects/a.model",
            &xml(&format!(
                r#"<resources><object id="5">{TETRA}</object></resources><build/>"#
            )),
        ),
    ]);
    let (meshes, _) = read(&bytes, MeshFormat::ThreeMf);
    assert_eq!(meshes.unwrap()[0].mesh.triangles.len(), 4);
}

/// What builds the first object.
const ITEM: &str = r#"<item objectid="1"/>"#;

/// A tetrahedron as the first object.
fn tetra() -> String {
    format!(r#"<object id="1">{TETRA}</object>"#)
}

fn model_error(bytes: &[u8], word: &str) {
    let error = threemf_error(bytes).to_string();
    assert!(error.contains(word), "`{error}` does not speak of `{word}`");
}

#[test]
fn broken_packages_are_refused_by_name() {
    assert!(matches!(threemf_error(b""), ThreeMfError::Empty));
    assert!(matches!(
        threemf_error(b"PK is not enough"),
        ThreeMfError::Package { .. }
    ));
    assert!(matches!(
        threemf_error(&[0xD0, 0xCF, 0x11, 0xE0, 0xA1]),
        ThreeMfError::Encrypted { .. }
    ));
    let no_rels = packed(&[("3D/part.model", "<model/>")]);
    assert!(
        matches!(threemf_error(&no_rels), ThreeMfError::MissingPart { part, .. } if part == "_rels/.rels")
    );
    let no_part = packed(&[("_rels/.rels", RELATIONS)]);
    assert!(
        matches!(threemf_error(&no_part), ThreeMfError::MissingPart { part, .. } if part == "3D/part.model")
    );
    let relation = r#"<Relationship Target="/3D/b.model" Id="b" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;
    let two = packed(&[(
        "_rels/.rels",
        &RELATIONS.replace("</Relationships>", relation),
    )]);
    assert!(matches!(
        threemf_error(&two),
        ThreeMfError::TwoModels { .. }
    ));
    let whole = model("", &tetra(), ITEM);
    for end in (1..whole.len()).step_by(37) {
        assert!(
            read(&whole[..end], MeshFormat::ThreeMf).0.is_err(),
            "cut at {end}"
        );
    }
}

#[test]
fn what_breaks_the_model_is_told_with_its_place() {
    let (tetra, item) = (tetra(), ITEM);
    model_error(
        &model("", &tetra.replace(r#"v1="1""#, r#"v1="4""#), item),
        "names vertex 4",
    );
    model_error(
        &model("", &tetra.replace(r#"v1="1""#, r#"v1="2""#), item),
        "same vertex twice",
    );
    model_error(
        &model("", &tetra.replace(r#"x="10""#, r#"x="nan""#), item),
        "not finite",
    );
    model_error(
        &model("", &tetra.replace(r#"x="10""#, r#"x="ten""#), item),
        "is not a number",
    );
    model_error(
        &model("", &tetra.replace(r#" y="10""#, ""), item),
        "missing",
    );
    model_error(&model(r#"unit="furlong""#, &tetra, item), "furlong");
    model_error(&model("", &format!("{tetra}{tetra}"), item), "twice");
    model_error(
        &model(
            "",
            &tetra,
            r#"<item objectid="1" transform="1 0 0 0 1 0 0 0 0 0 0 0"/>"#,
        ),
        "flattens",
    );
    model_error(
        &model("", &tetra, r#"<item objectid="1" transform="1 0 0"/>"#),
        "twelve",
    );
    model_error(
        &model("", r#"<object id="1"/>"#, item),
        "neither mesh nor components",
    );
    model_error(
        &model(
            "",
            r#"<object id="1"><components><component objectid="1"/></components></object>"#,
            item,
        ),
        "contains itself",
    );
}

#[test]
fn objects_that_cannot_be_built_are_refused() {
    let (tetra, item) = (tetra(), ITEM);
    let ring = r#"<object id="1"><components><component objectid="2"/></components></object><object id="2"><components><component objectid="1"/></components></object>"#;
    assert!(matches!(
        threemf_error(&model("", ring, item)),
        ThreeMfError::MissingObject { object: 2, .. }
    ));
    assert!(matches!(
        threemf_error(&model("", &tetra, r#"<item objectid="9"/>"#)),
        ThreeMfError::MissingObject { object: 9, .. }
    ));
    assert!(matches!(
        threemf_error(&model("", &tetra, "")),
        ThreeMfError::NothingToBuild
    ));
    let other = tetra.replace(r#"id="1""#, r#"id="1" type="other""#);
    model_error(&model("", &other, item), "must not be built");
    let support = tetra.replace(r#"id="1""#, r#"id="1" type="support""#);
    let two = format!(r#"{support}<object id="2">{TETRA}</object>"#);
    let (meshes, warnings) = read(
        &model("", &two, r#"<item objectid="1"/><item objectid="2"/>"#),
        MeshFormat::ThreeMf,
    );
    assert_eq!(
        (meshes.unwrap().len(), warnings),
        (1, vec!["3mf-support-skipped".to_owned()])
    );
}

#[test]
fn required_extensions_that_change_shapes_are_refused() {
    let (tetra, item) = (tetra(), ITEM);
    let beams = r#"requiredextensions="b" xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02""#;
    assert!(
        matches!(threemf_error(&model(beams, &tetra, item)), ThreeMfError::Extension { name, .. } if name.contains("beam lattice"))
    );
    // what adds metal to the mesh, required or not
    let beams = beams.replacen("requiredextensions=\"b\" ", "", 1);
    let lattice = r#"<b:beamlattice radius="0.5" minlength="0.001"><b:beams><b:beam v1="0" v2="1"/></b:beams></b:beamlattice></mesh>"#;
    let lattice = tetra.replace("</mesh>", lattice);
    assert!(
        matches!(threemf_error(&model(&beams, &lattice, item)), ThreeMfError::Extension { name, .. } if name.contains("beam lattice"))
    );
    let secure = r#"requiredextensions="s" xmlns:s="http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04""#;
    model_error(&model(secure, &tetra, item), "encrypted");
    model_error(
        &model("requiredextensions=\"q\"", &tetra, item),
        "not declared",
    );
    let colours = r#"requiredextensions="m" xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02""#;
    assert!(
        read(&model(colours, &tetra, item), MeshFormat::ThreeMf)
            .0
            .is_ok()
    );
    let sliced = |more: &str| {
        let object = tetra.replace(r#"id="1""#, &format!(r#"id="1" s:slicestackid="3" {more}"#));
        let slice = r#"xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07""#;
        read(&model(slice, &object, item), MeshFormat::ThreeMf)
    };
    assert_eq!(sliced("").1, ["3mf-slices-ignored"]);
    assert!(sliced(r#"s:meshresolution="lowres""#).0.is_err());
    model_error(&model("", &format!("<q:x/>{tetra}"), item), "not declared");
}

#[test]
fn bombs_are_refused() {
    // 80 MB of blanks pack a thousandfold
    let blanks = " ".repeat(80 << 20);
    let bomb = packed(&[("_rels/.rels", RELATIONS), ("3D/part.model", &blanks)]);
    assert!(bomb.len() < 1 << 20);
    assert!(matches!(threemf_error(&bomb), ThreeMfError::Bomb { .. }));
    // each object holds ten copies of the one before: 10^8 tetrahedra
    let mut resources = format!(r#"<object id="1">{TETRA}</object>"#);
    for id in 2..10 {
        let copies = format!(r#"<component objectid="{}"/>"#, id - 1).repeat(10);
        write!(
            resources,
            r#"<object id="{id}"><components>{copies}</components></object>"#
        )
        .unwrap();
    }
    let laughs = model("", &resources, r#"<item objectid="9"/>"#);
    assert!(matches!(threemf_error(&laughs), ThreeMfError::TooMany));
    let mut chain = format!(r#"<object id="1">{TETRA}</object>"#);
    for id in 2..200 {
        write!(
            chain,
            r#"<object id="{id}"><components><component objectid="{}"/></components></object>"#,
            id - 1
        )
        .unwrap();
    }
    let deep = model("", &chain, r#"<item objectid="199"/>"#);
    assert!(matches!(threemf_error(&deep), ThreeMfError::Nesting { .. }));
}

proptest! {
    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read(&bytes, MeshFormat::Stl);
        let _ = read(&bytes, MeshFormat::ThreeMf);
        let mut solid = b"solid ".to_vec();
        solid.extend(&bytes);
        let _ = read(&solid, MeshFormat::Stl);
    }

    #[test]
    fn stl_round_trip_of_random_parts(seed in any::<u64>(), points in 3u32..60) {
        let part = rounded(&shapes::extrude(&[shapes::random_star(seed, points, 5.0, 50.0)], 9.0));
        for bytes in [binary(&part), text(&part)] {
            let (meshes, _) = read(&bytes, MeshFormat::Stl);
            prop_assert_eq!(corners(&meshes.unwrap()[0].mesh), corners(&part));
        }
    }
}
