//! STEP files of varied origin against what OpenCASCADE finds in them (`data/step/table.toml`),
//! and against damage.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::Mesh;
use meltpath_geometry::brep::tessellate::tessellate_solid;
use meltpath_geometry::brep::{
    BrepModel, Face, FaceUse, Frame, Sense, Shell, ShellRole, Solid, Surface, TessellateError,
    Tolerance, TorusSheet, tessellate,
};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::step::{self, StepError};
use proptest::prelude::*;

/// This chord error with the default angle.
fn with_chord(chord: f64) -> Tolerance {
    Tolerance {
        chord,
        ..Tolerance::default()
    }
}

/// One row of the table.
#[derive(Debug, serde::Deserialize)]
struct Row {
    name: String,
    solids: usize,
    faces: usize,
    area: f64,
    volume: f64,
    low: [f64; 3],
    high: [f64; 3],
}

#[derive(Debug, serde::Deserialize)]
struct Table {
    file: Vec<Row>,
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/step")
}

fn table() -> Vec<Row> {
    let text = std::fs::read_to_string(folder().join("table.toml")).unwrap();
    toml::from_str::<Table>(&text).unwrap().file
}

fn read(name: &str) -> (BrepModel, Reporter) {
    let reporter = Reporter::new();
    let file = std::fs::File::open(folder().join(name)).unwrap();
    let model = step::read(file, &reporter).unwrap_or_else(|e| panic!("{name}: {e}"));
    (model, reporter)
}

/// Sides of triangles that are not met exactly once in each direction.
fn open_sides(mesh: &Mesh) -> usize {
    let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for side in [[a, b], [b, c], [c, a]] {
            *sides.entry(side).or_default() += 1;
        }
    }
    sides
        .iter()
        .filter(|(side, count)| **count != 1 || sides.get(&[side[1], side[0]]) != Some(&1))
        .count()
}

#[test]
fn area_and_volume_are_those_of_open_cascade() {
    let rows = table();
    assert!(rows.len() >= 12);
    for row in rows {
        let (model, _) = read(&row.name);
        let fine = Tolerance {
            chord: 0.002,
            angle: 0.05,
        };
        let mesh = tessellate(&model, &fine, &Reporter::new(), &Silent)
            .unwrap_or_else(|e| panic!("{}: {e}", row.name));
        let area = (mesh.area() - row.area) / row.area;
        let volume = (mesh.volume() - row.volume) / row.volume;
        assert!(area.abs() < 1e-3, "{}: area off by {area:.2e}", row.name);
        assert!(
            volume.abs() < 1e-3,
            "{}: volume off by {volume:.2e}",
            row.name
        );
        let faces: usize = model.solids.iter().map(|s| s.solid.faces.len()).sum();
        assert_eq!(faces, row.faces, "{}", row.name);
        // a surface model has no solids to OpenCASCADE; here a closed shell is one body
        if row.solids > 0 {
            assert_eq!(model.solids.len(), row.solids, "{}", row.name);
        }
    }
}

#[test]
fn meshes_are_closed_and_as_close_as_asked() {
    for row in table() {
        let (model, _) = read(&row.name);
        let mut last = f64::INFINITY;
        for chord in [0.1, 0.01] {
            let reporter = Reporter::new();
            let mesh = tessellate(&model, &with_chord(chord), &reporter, &Silent)
                .unwrap_or_else(|e| panic!("{} at {chord}: {e}", row.name));
            assert_eq!(open_sides(&mesh), 0, "{} at {chord}", row.name);
            let (lo, hi) = mesh.bounds().unwrap();
            let off = (lo - DVec3::from_array(row.low))
                .abs()
                .max_element()
                .max((hi - DVec3::from_array(row.high)).abs().max_element());
            // the table's box of spline faces is itself only good to some hundredths
            assert!(
                off <= chord + 0.02,
                "{} at {chord}: box off by {off}",
                row.name
            );
            // no triangle leaves the surface by more than the chord: the volume is between offsets
            let lack = (mesh.volume() - row.volume).abs();
            assert!(
                lack <= chord * row.area,
                "{} at {chord}: volume off by {lack}",
                row.name
            );
            assert!(lack <= last, "{} at {chord}: {lack} after {last}", row.name);
            last = lack + 1e-9 * row.volume;
        }
    }
}

#[test]
fn mesh_points_lie_on_the_surfaces_and_the_mesh_is_near_them() {
    // of a torus the distance is known in closed form
    let (model, _) = read("spheres_and_tori.step");
    let ring = model
        .solids
        .iter()
        .find(|s| {
            let whole = 2.0 * std::f64::consts::PI.powi(2) * 20.0 * 25.0;
            let tolerance = Tolerance::default();
            let mesh = tessellate_solid(&s.solid, "", &tolerance, &Reporter::new(), &Silent);
            (mesh.unwrap().volume() / whole - 1.0).abs() < 1e-2
        })
        .expect("the whole torus");
    let chord = 0.02;
    let mesh = tessellate_solid(
        &ring.solid,
        "ring",
        &with_chord(chord),
        &Reporter::new(),
        &Silent,
    )
    .unwrap();
    let centre = {
        let (lo, hi) = mesh.bounds().unwrap();
        // the part was placed at whole millimetres
        (0.5 * (lo + hi)).round()
    };
    let off = |p: DVec3| {
        let p = p - centre;
        ((p.x.hypot(p.y) - 20.0).hypot(p.z) - 5.0).abs()
    };
    for &v in &mesh.vertices {
        assert!(off(v) < 1e-2 * chord + 1e-6);
    }
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        for p in [
            (a + b + c) / 3.0,
            0.5 * (a + b),
            0.5 * (b + c),
            0.5 * (c + a),
        ] {
            assert!(off(p) <= 1.05 * chord, "{}", off(p));
        }
    }
}

#[test]
fn same_mesh_on_any_number_of_threads() {
    let (model, _) = read("cover_ap214.step");
    let mesh_with = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| {
                let tolerance = with_chord(0.05);
                tessellate(&model, &tolerance, &Reporter::new(), &Silent).unwrap()
            })
    };
    assert_eq!(mesh_with(1), mesh_with(4));
}

#[test]
fn one_shape_in_three_units_is_one_shape() {
    let bounds = [
        "cover_ap214.step",
        "cover_ap203_inch.step",
        "cover_ap242_metre.step",
    ]
    .map(|name| {
        let (model, _) = read(name);
        let mesh = tessellate(&model, &with_chord(0.1), &Reporter::new(), &Silent).unwrap();
        mesh.bounds().unwrap()
    });
    for (lo, hi) in bounds {
        assert!(lo.distance(bounds[0].0) < 1e-6 && hi.distance(bounds[0].1) < 1e-6);
    }
}

#[test]
fn assemblies_keep_names_and_places() {
    let (model, _) = read("assembly.step");
    let mut names: Vec<(&str, Vec<String>)> = model
        .solids
        .iter()
        .map(|s| (s.name.as_str(), s.path.clone()))
        .collect();
    names.sort();
    assert_eq!(names.iter().filter(|n| n.0.starts_with("bolt")).count(), 4);
    assert_eq!(names.iter().filter(|n| n.0.starts_with("plate")).count(), 2);
    assert!(
        names
            .iter()
            .all(|n| n.1.iter().any(|p| p.contains("frame"))),
        "{names:?}"
    );
}

/// A solid of one face without boundary.
fn closed_surface(surface: Surface) -> Solid {
    Solid {
        faces: vec![Face {
            surface: Arc::new(surface),
            sense: Sense::Forward,
            loops: Vec::new(),
            id: 1,
        }],
        shells: vec![Shell {
            role: ShellRole::Outer,
            faces: vec![FaceUse {
                face: 0,
                sense: Sense::Forward,
            }],
        }],
        uncertainty: 1e-7,
        ..Solid::default()
    }
}

#[test]
fn surfaces_without_boundary_have_their_closed_forms() {
    let frame = Frame::new(
        DVec3::new(5.0, -3.0, 2.0),
        DVec3::new(1.0, 2.0, 2.0),
        DVec3::X,
    )
    .unwrap();
    // area and volume of the surface of revolution (R + r cos v, r sin v), v from a to b
    let torus = |major: f64, minor: f64, a: f64, b: f64| {
        let n = 20_000;
        let h = (b - a) / f64::from(n);
        let mut sum = [0.0; 2];
        for i in 0..n {
            let v = a + (f64::from(i) + 0.5) * h;
            let rho = major + minor * v.cos();
            sum[0] += TAU * rho.abs() * minor * h;
            sum[1] += std::f64::consts::PI * rho * rho * minor * v.cos() * h;
        }
        [sum[0], sum[1].abs()]
    };
    let meet = (-2.0f64 / 3.0).acos();
    let sheet = |sheet| Surface::Torus {
        frame,
        major: 2.0,
        minor: 3.0,
        sheet,
    };
    let cases = [
        (
            Surface::Sphere { frame, radius: 3.0 },
            [2.0 * TAU * 9.0, 2.0 * TAU / 3.0 * 27.0],
        ),
        (
            Surface::Torus {
                frame,
                major: 5.0,
                minor: 2.0,
                sheet: TorusSheet::Outer,
            },
            torus(5.0, 2.0, 0.0, TAU),
        ),
        (sheet(TorusSheet::Outer), torus(2.0, 3.0, -meet, meet)),
        (sheet(TorusSheet::Inner), torus(2.0, 3.0, meet, TAU - meet)),
    ];
    for (surface, [area, volume]) in cases {
        let label = format!("{surface:?}");
        let solid = closed_surface(surface);
        let mesh = tessellate_solid(
            &solid,
            "closed",
            &Tolerance::default(),
            &Reporter::new(),
            &Silent,
        )
        .unwrap();
        assert_eq!(open_sides(&mesh), 0, "{label}");
        let most = Tolerance::default().chord * area;
        let lack = volume - mesh.volume();
        assert!(
            (0.0..=most).contains(&lack),
            "{label}: {lack} of {volume}, {most} allowed"
        );
        // chords of 20 degrees are 0.5 % short in each direction
        let found = mesh.area();
        assert!(
            (found / area - 1.0).abs() < 1.1e-2,
            "{label}: {found} {area}"
        );
    }
}

#[test]
fn mirrored_placements_keep_normals_outwards() {
    let (model, _) = read("hand_mapped.step");
    assert!(
        model
            .solids
            .iter()
            .any(|s| s.part_from_solid.matrix3.determinant() < 0.0)
    );
    // the mapped body has no product of its own: it keeps its name inside the product's
    assert_eq!(model.solids[0].name, "block");
    assert_eq!(model.solids[0].path, ["M\u{e4}PPED"]);
    for placed in model.solids {
        let one = BrepModel {
            solids: vec![placed],
        };
        let mesh = tessellate(&one, &Tolerance::default(), &Reporter::new(), &Silent).unwrap();
        assert!((mesh.volume() - 15_900.0).abs() < 1e-6, "{}", mesh.volume());
    }
}

#[test]
fn boundaries_that_run_the_wrong_way_are_turned_and_told() {
    let (_, reporter) = read("flange_fillet.step");
    let warnings = reporter.warnings();
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0].code, "step-loops-turned");
    assert!(warnings[0].message.contains("#614"));
}

#[test]
fn a_cancelled_mesh_says_so() {
    let (model, _) = read("cover_ap214.step");
    let refused = tessellate(
        &model,
        &Tolerance::default(),
        &Reporter::new(),
        &crate::Stop,
    );
    assert!(matches!(refused, Err(TessellateError::Cancelled(_))));
    let refused = tessellate(&model, &with_chord(f64::NAN), &Reporter::new(), &Silent);
    assert!(matches!(refused, Err(TessellateError::Tolerance { .. })));
}

/// The samples that are small enough to be damaged many times.
fn victims() -> Vec<Vec<u8>> {
    [
        "bottle.step",
        "cones.step",
        "spheres_and_tori.step",
        "cavities.step",
        "dome.step",
        "hand_seamless.step",
        "hand_faceted.step",
        "hand_mapped.step",
    ]
    .iter()
    .map(|name| std::fs::read(folder().join(name)).unwrap())
    .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn truncated_files_are_refused(which in 0usize..8, part in 0.0..1.0f64) {
        let bytes = &victims()[which];
        let end = (part * (bytes.len() - 20) as f64) as usize;
        let refused = step::parse(&bytes[..end], &Reporter::new());
        let named = matches!(refused, Err(StepError::Truncated { .. } | StepError::NotStep { .. } | StepError::Syntax { .. }));
        prop_assert!(named, "{refused:?}");
    }
}

#[test]
fn errors_name_entity_and_line() {
    let text = |data: &str| {
        format!("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n")
    };
    let units = "#90=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#91))REPRESENTATION_CONTEXT('',''));\n#91=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n";
    let cases = [
        // a body that is not there
        (
            "#1=SHAPE_REPRESENTATION('',(#2),#90);",
            "#1 SHAPE_REPRESENTATION (line 7) refers to #2",
        ),
        (
            "#1=SHAPE_REPRESENTATION('',(#2),#90);\n#2=TESSELLATED_SOLID('',(),$);",
            "#2 TESSELLATED_SOLID (line 8) is not supported",
        ),
        (
            "#1=SHAPE_REPRESENTATION('',(#2),#90);\n#2=MANIFOLD_SOLID_BREP('',#2);",
            "#2 MANIFOLD_SOLID_BREP (line 8)",
        ),
        (
            "#1=SHAPE_REPRESENTATION('',(#2),#90);\n#2=GEOMETRIC_CURVE_SET('',());",
            "1 GEOMETRIC_CURVE_SET",
        ),
        (
            "#1=SHAPE_REPRESENTATION('',(#2),#90);\n#2=MAPPED_ITEM('',#3,#4);\n#3=REPRESENTATION_MAP(#4,#1);\n#4=AXIS2_PLACEMENT_3D('',#5,$,$);\n#5=CARTESIAN_POINT('',(0.,0.,0.));",
            "no shape",
        ),
    ];
    for (data, expected) in cases {
        let refused = step::parse(text(&format!("{units}{data}")).as_bytes(), &Reporter::new());
        let message = refused.expect_err(data).to_string();
        assert!(message.contains(expected), "{data}\n{message}");
    }
}

/// A component whose body lies in another file is not left out in silence; one without a body is told.
#[test]
fn components_in_other_files_are_refused() {
    let text = std::fs::read_to_string(folder().join("assembly.step")).unwrap();
    let body = text
        .find("ADVANCED_BREP_SHAPE_REPRESENTATION('',(")
        .unwrap();
    let comma = body + text[body..].find(",#").unwrap();
    let end = comma + text[comma..].find("),").unwrap();
    let hollow = format!("{}{}", &text[..comma], &text[end..]);
    let outside = "#90001=DOCUMENT_FILE('bolt.stp','',$,#90002,'',$);\n#90002=DOCUMENT_TYPE('');\n";
    let data = hollow.rfind("ENDSEC;").unwrap();
    let referred = format!("{}{outside}{}", &hollow[..data], &hollow[data..]);
    let reporter = Reporter::new();
    let error = step::read(referred.as_bytes(), &reporter).unwrap_err();
    assert!(matches!(error, StepError::Elsewhere { .. }), "{error}");
    assert!(error.to_string().contains("bolt.stp"), "{error}");
    let reporter = Reporter::new();
    step::read(hollow.as_bytes(), &reporter).unwrap();
    let told = reporter.warnings();
    assert!(
        told.iter().any(|w| w.code == "step-empty-component"),
        "{told:?}"
    );
    // a drawing beside a whole assembly is no part of it
    let data = text.rfind("ENDSEC;").unwrap();
    let drawn = format!("{}{outside}{}", &text[..data], &text[data..]);
    let whole = step::read(text.as_bytes(), &Reporter::new()).unwrap();
    let beside = step::read(drawn.as_bytes(), &Reporter::new()).unwrap();
    assert_eq!(whole.solids.len(), beside.solids.len());
}
