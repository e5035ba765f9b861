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

    /// The body of the fuzz target `cli_layers` on files that were damaged in several ways at once. Three million cases ran without a failure.
    #[test]
    fn damaged_files_never_panic(file in files(), text in any::<bool>(), edits in prop::collection::vec(edit(), 1..6)) {
        let mut bytes = if text {
            cli::write_ascii(&file).unwrap().into_bytes()
        } else {
            cli::write_binary(&file).unwrap()
        };
        for edit in &edits {
            edit.apply(&mut bytes);
        }
        if let Ok(read) = cli::parse(&bytes) {
            if let Ok(text) = cli::write_ascii(&read) {
                prop_assert_eq!(&cli::parse(text.as_bytes()).unwrap().layers, &read.layers);
            }
            if let Ok(binary) = cli::write_binary(&read) {
                prop_assert_eq!(cli::parse(&binary).unwrap().layers.len(), read.layers.len());
            }
        }
    }
}

/// One damage to a file.
#[derive(Debug, Clone)]
enum Edit {
    /// Another byte.
    Byte(prop::sample::Index, u8),
    /// A piece is lost.
    Lose(prop::sample::Index, usize),
    /// A piece is written again elsewhere.
    Repeat(prop::sample::Index, prop::sample::Index, usize),
    /// Something a writer might have meant comes in between.
    Insert(prop::sample::Index, &'static [u8]),
    /// The rest is lost.
    End(prop::sample::Index),
}

/// Numbers and words at the edge of the format.
const INSERTED: &[&[u8]] = &[
    b"4294967295",
    b"-1",
    b"1e308",
    b"1e-308",
    b"NaN",
    b"inf",
    b",",
    b"/",
    b"//",
    b"$$",
    b"$$LAYER/",
    b"$$POLYLINE/1,1,99999999,",
    b"$$HATCHES/1,1,0,0,1,1",
    b"$$UNITS/0",
    b"$$BINARY",
    b"$$GEOMETRYEND",
    b"\xff\xff\xff\xff",
    b"\x82\x00",
    b"\x84\x00",
    b"\x80\x00",
];

fn edit() -> impl Strategy<Value = Edit> {
    let at = any::<prop::sample::Index>;
    prop_oneof![
        (at(), any::<u8>()).prop_map(|(at, byte)| Edit::Byte(at, byte)),
        (at(), 1_usize..40).prop_map(|(at, length)| Edit::Lose(at, length)),
        (at(), at(), 1_usize..60).prop_map(|(from, to, length)| Edit::Repeat(from, to, length)),
        (at(), prop::sample::select(INSERTED)).prop_map(|(at, what)| Edit::Insert(at, what)),
        at().prop_map(Edit::End),
    ]
}

impl Edit {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        let n = bytes.len();
        match self {
            Edit::Byte(at, byte) => bytes[at.index(n)] = *byte,
            Edit::Lose(at, length) => {
                let from = at.index(n);
                bytes.drain(from..n.min(from + length));
            }
            Edit::Repeat(from, to, length) => {
                let from = from.index(n);
                let piece = bytes[from..n.min(from + length)].to_vec();
                let to = to.index(n);
                bytes.splice(to..to, piece);
            }
            Edit::Insert(at, what) => {
                let at = at.index(n);
                bytes.splice(at..at, what.iter().copied());
            }
            Edit::End(at) => bytes.truncate(at.index(n)),
        }
    }
}
