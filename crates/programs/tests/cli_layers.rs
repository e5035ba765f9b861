//! CLI layer files: text and binary, there and back, damaged, and as toolpaths.

use meltpath_geometry::math::DVec2;
use meltpath_programs::cli::{self, CliError, Direction, Item, Layer, LayerFile};
use meltpath_toolpath::{Profile, Role};
use proptest::prelude::*;

/// As machines write it: comments, units of 5 µm, a label, several commands a line.
const FOREIGN: &str = "$$HEADERSTART\n// made by hand //\n$$ASCII\n$$UNITS/00000000.005000\n$$VERSION/200\n$$LABEL/1,part1\n\
    $$DATE/070920\n$$DIMENSION/00000000.000,0.0,0.0,10,10,1\n$$LAYERS/000002\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/8.0\n\
    $$POLYLINE/1,1,5,0,0,2000,0,2000,2000,0,2000,0,0 $$HATCHES/1,2,100,100,1900,100,1900,120,100,120\n$$LAYER/16.0\n$$GEOMETRYEND";

#[test]
fn a_foreign_file_reads() {
    let file = cli::parse(FOREIGN.as_bytes()).unwrap();
    assert_eq!(file.labels, [(1, "part1".to_owned())]);
    assert_eq!(file.layers.len(), 2);
    assert!((file.layers[0].height - 0.04).abs() < 1e-15);
    let [
        Item::Polyline {
            direction: Direction::Outer,
            points,
            ..
        },
        Item::Hatches { lines, .. },
    ] = file.layers[0].items.as_slice()
    else {
        panic!("{:?}", file.layers[0].items)
    };
    assert_eq!(points[2], DVec2::splat(10.0));
    assert_eq!(lines.len(), 2);
    let toolpath = file.to_toolpath(Profile::default(), Profile::default());
    assert_eq!(toolpath.passes.len(), 3);
    assert_eq!(toolpath.passes[2].role, Role::Fill);
    assert!((toolpath.passes[0].length() - 40.0).abs() < 1e-12);
}

/// The short commands of the binary form, written by hand.
#[test]
fn short_binary_commands_read() {
    let mut bytes = b"$$HEADERSTART\n$$BINARY\n$$UNITS/0.01\n$$HEADEREND".to_vec();
    for v in [
        128_u16, 7, 129, 3, 2, 2, 10, 20, 30, 40, 131, 3, 1, 1, 2, 3, 4,
    ] {
        bytes.extend(v.to_le_bytes());
    }
    let file = cli::parse(&bytes).unwrap();
    assert!((file.layers[0].height - 0.07).abs() < 1e-12);
    let Item::Polyline {
        part: 3,
        direction: Direction::Open,
        points,
    } = &file.layers[0].items[0]
    else {
        panic!("{:?}", file.layers)
    };
    assert!((points[1] - DVec2::new(0.3, 0.4)).length() < 1e-12);
}

#[test]
fn mistakes_are_named_where_they_are() {
    for (wrong, right, expected) in [
        ("$$UNITS/00000000.005000\n", "", "$$UNITS is missing"),
        ("$$ASCII\n", "", "neither"),
        ("$$ASCII\n", "$$ASCII\n$$ALIGN\n", "ALIGN"),
        ("$$POLYLINE/1,1,5", "$$POLYLINE/1,1,6", "line 13"),
        ("$$POLYLINE/1,1,5", "$$POLYLINE/1,7,5", "0, 1 or 2"),
        ("2000,0,2000,2000", "2000,0,2OOO,2000", "2OOO"),
        ("$$LAYER/16.0\n$$GEOMETRYEND", "", "cut off"),
        ("$$LAYER/16.0", "$$SPHERE/16.0", "SPHERE"),
    ] {
        let text = FOREIGN.replace(wrong, right);
        let error = cli::parse(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let file = LayerFile {
        labels: vec![],
        layers: vec![Layer {
            height: f64::NAN,
            items: vec![],
        }],
    };
    assert!(matches!(
        cli::write_ascii(&file),
        Err(CliError::Value { .. })
    ));
}

fn files() -> impl Strategy<Value = LayerFile> {
    // what 32-bit reals hold exactly, so that both forms give the same
    let point = || {
        (-100_000_i32..100_000, -100_000_i32..100_000)
            .prop_map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)) / 64.0)
    };
    let polyline =
        (0_u32..9, 0..3, prop::collection::vec(point(), 0..8)).prop_map(|(part, d, points)| {
            Item::Polyline {
                part,
                direction: [Direction::Inner, Direction::Outer, Direction::Open][d as usize],
                points,
            }
        });
    let hatches = (
        0_u32..9,
        prop::collection::vec((point(), point()).prop_map(|(a, b)| [a, b]), 0..8),
    )
        .prop_map(|(part, lines)| Item::Hatches { part, lines });
    let layer = (
        0_i32..1000,
        prop::collection::vec(prop_oneof![polyline, hatches], 0..5),
    )
        .prop_map(|(z, items)| Layer {
            height: f64::from(z) / 32.0,
            items,
        });
    prop::collection::vec(layer, 0..5).prop_map(|layers| LayerFile {
        labels: vec![(2, "bracket".to_owned())],
        layers,
    })
}

proptest! {
    #[test]
    fn both_forms_give_the_file_back(file in files()) {
        prop_assert_eq!(&cli::parse(cli::write_ascii(&file).unwrap().as_bytes()).unwrap(), &file);
        prop_assert_eq!(&cli::parse(&cli::write_binary(&file).unwrap()).unwrap(), &file);
    }

    #[test]
    fn damaged_files_never_panic(file in files(), at in 0_usize..4000, byte in any::<u8>(), cut in 0_usize..4000) {
        for mut bytes in [cli::write_ascii(&file).unwrap().into_bytes(), cli::write_binary(&file).unwrap()] {
            let n = bytes.len();
            bytes[at % n] = byte;
            bytes.truncate(n - cut % n);
            if let Ok(read) = cli::parse(&bytes) {
                let text = cli::write_ascii(&read).unwrap();
                prop_assert_eq!(cli::parse(text.as_bytes()).unwrap().layers, read.layers);
            }
        }
    }
}
