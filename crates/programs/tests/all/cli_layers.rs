//! CLI layer files: text and binary, there and back, and layer by layer.

use std::collections::BTreeMap;

use meltpath_geometry::math::DVec3;
use meltpath_programs::cli::{CliError, Form, Reader, Writer};
use meltpath_toolpath::{Layer, Move, PassHead, PassId, Role};
use proptest::prelude::*;

fn read(bytes: &[u8]) -> Result<Vec<Layer>, CliError> {
    Reader::new(bytes)?.collect()
}

fn parts() -> BTreeMap<u32, String> {
    [(2, "bracket".to_owned())].into()
}

fn written(layers: &[Layer], form: Form) -> Result<Vec<u8>, CliError> {
    let mut bytes = Vec::new();
    let mut writer = Writer::new(&mut bytes, form, &parts(), Some(layers.len()))?;
    for layer in layers {
        writer.layer(layer)?;
    }
    writer.finish()?;
    Ok(bytes)
}

/// As machines write it: comments, units of 5 µm, a label, several commands a line.
const FOREIGN: &str = "$$HEADERSTART\n// made by hand //\n$$ASCII\n$$UNITS/00000000.005000\n$$VERSION/200\n$$LABEL/1,part1\n\
    $$DATE/070920\n$$DIMENSION/00000000.000,0.0,0.0,10,10,1\n$$LAYERS/000002\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/8.0\n\
    $$POLYLINE/1,1,5,0,0,2000,0,2000,2000,0,2000,0,0 $$HATCHES/1,2,100,100,1900,100,1900,120,100,120\n$$LAYER/16.0\n$$GEOMETRYEND";

#[test]
fn a_foreign_file_reads() {
    let mut file = Reader::new(FOREIGN.as_bytes()).unwrap();
    assert_eq!(file.parts, [(1, "part1".to_owned())].into());
    let layer = file.next().unwrap().unwrap();
    layer.sanity_check().unwrap();
    assert!((layer.height - 0.04).abs() < 1e-15);
    assert_eq!((layer.number, layer.len()), (1, 3));
    let contour = layer.pass(0);
    assert_eq!((contour.head.role, contour.head.part), (Role::Contour, 1));
    assert_eq!(contour.points[2], DVec3::new(10.0, 10.0, 0.0));
    assert!((contour.length() - 40.0).abs() < 1e-12);
    assert_eq!(layer.pass(2).head.role, Role::Fill);
    let last = file.next().unwrap().unwrap();
    assert!(last.is_empty() && last.number == 2 && file.next().is_none());
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
    let layers = read(&bytes).unwrap();
    assert!((layers[0].height - 0.07).abs() < 1e-12);
    let line = layers[0].pass(0);
    assert_eq!(line.head.part, 3);
    assert!((line.points[1] - DVec3::new(0.3, 0.4, 0.0)).length() < 1e-12);
    // a promise of more points than the file holds costs no memory
    for v in [127_u16, 0, 0, 130, 1, 0, 0, 0, 0xffff, 0x7fff] {
        bytes.extend(v.to_le_bytes());
    }
    let error = read(&bytes).unwrap_err().to_string();
    assert!(error.contains("ends inside"), "{error}");
}

/// A file that holds other layers than its header tells was cut short, or holds what is not meant: its layers come, then the refusal, once.
#[test]
fn a_file_of_other_layers_than_its_header_tells_is_refused() {
    let layers: Vec<Layer> = (1..=3)
        .map(|number| {
            let mut layer = Layer::new(number, 0.03 * f64::from(number));
            layer.polyline(PassHead::default(), [DVec3::ZERO, DVec3::X]);
            layer
        })
        .collect();
    for form in [Form::Ascii, Form::Binary] {
        for told in [None, Some(0), Some(2), Some(3), Some(8)] {
            let mut bytes = Vec::new();
            let mut writer = Writer::new(&mut bytes, form, &parts(), told).unwrap();
            for layer in &layers {
                writer.layer(layer).unwrap();
            }
            writer.finish().unwrap();
            let mut found: Vec<_> = Reader::new(bytes.as_slice()).unwrap().collect();
            if let Some(told @ (2 | 8)) = told {
                let error = found.pop().unwrap().unwrap_err().to_string();
                let wanted = format!("tells {told} layers, the file holds 3");
                assert!(error.contains(&wanted), "{error}");
            }
            assert_eq!(found.iter().filter(|l| l.is_ok()).count(), 3, "{told:?}");
            assert_eq!(found.len(), 3);
        }
    }
}

/// What stands in a comment is no command; one that is not closed ends with its line.
#[test]
fn commands_in_comments_are_not_obeyed() {
    let text = "$$HEADERSTART // was $$UNITS/2 //\n$$ASCII $$UNITS/1 $$HEADEREND\n$$GEOMETRYSTART\n\
        // old: $$LAYER/9 and $$POLYLINE/1,1,2,0,0,5,5 // $$LAYER/0.1\n\
        $$HATCHES/1,1,0,0,10,0 // not closed: $$LAYER/7\n\
        $$HATCHES/1,1,0,1,10,1//$$HATCHES/1,1,0,2,10,2//\n$$LAYER/0.2\n$$GEOMETRYEND//$$LAYER/8//\n";
    let layers: Vec<Layer> = Reader::new(text.as_bytes())
        .unwrap()
        .collect::<Result<_, _>>()
        .unwrap();
    let told: Vec<_> = layers.iter().map(|l| (l.height, l.len())).collect();
    assert_eq!(told, [(0.1, 2), (0.2, 0)]);
}

#[test]
fn planned_layers_are_written_as_shape() {
    let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let mut layer = Layer::new(1, 0.06);
    let head = |role: Role| PassHead {
        role,
        ..PassHead::default()
    };
    let mut disc = layer.begin(head(Role::Contour), p(1.0, 0.0));
    disc.go(Move::Arc { via: p(0.0, 1.0) }, p(-1.0, 0.0));
    disc.go(Move::Arc { via: p(0.0, -1.0) }, p(1.0, 0.0));
    layer.polyline(head(Role::Jump), [p(1.0, 0.0), p(0.2, 0.0)]);
    layer.polyline(
        head(Role::Contour),
        [p(0.2, 0.0), p(0.0, -0.2), p(-0.2, 0.0), p(0.2, 0.0)],
    );
    layer.polyline(head(Role::Fill), [p(0.3, 0.0), p(0.9, 0.0), p(0.9, 0.1)]);
    let text = String::from_utf8(written(&[layer.clone()], Form::Ascii).unwrap()).unwrap();
    assert!(text.contains("$$POLYLINE/0,1,") && text.contains("$$POLYLINE/0,0,4,"));
    assert!(
        text.contains("$$HATCHES/0,2,0.3,0,0.9,0,0.9,0,0.9,0.1\n"),
        "{text}"
    );
    let again = &read(text.as_bytes()).unwrap()[0];
    assert_eq!(again.len(), 4);
    assert!((again.pass(0).length() - std::f64::consts::TAU).abs() < 1e-2);
    layer.polyline(head(Role::Fill), [DVec3::Z, DVec3::X]);
    assert!(matches!(
        written(&[layer], Form::Ascii),
        Err(CliError::Value { .. })
    ));
}

/// Alignment is one of bytes: text has none.
#[test]
fn alignment_of_text_means_nothing() {
    let aligned = FOREIGN.replace("$$ASCII\n", "$$ASCII\n$$ALIGN\n");
    assert_eq!(
        read(aligned.as_bytes()).unwrap(),
        read(FOREIGN.as_bytes()).unwrap()
    );
}

#[test]
fn mistakes_are_named_where_they_are() {
    for (wrong, right, expected) in [
        ("$$UNITS/00000000.005000\n", "", "$$UNITS is missing"),
        ("$$ASCII\n", "", "neither"),
        ("$$ASCII\n", "$$BINARY\n$$ALIGN\n", "ALIGN"),
        ("$$POLYLINE/1,1,5", "$$POLYLINE/1,1,6", "line 13"),
        ("$$POLYLINE/1,1,5", "$$POLYLINE/1,7,5", "0, 1 or 2"),
        ("2000,0,2000,2000", "2000,0,2OOO,2000", "2OOO"),
        ("$$LAYER/16.0\n$$GEOMETRYEND", "", "cut off"),
        ("$$LAYER/16.0", "$$SPHERE/16.0", "SPHERE"),
    ] {
        let text = FOREIGN.replace(wrong, right);
        let error = read(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    assert!(matches!(
        written(&[Layer::new(1, f64::NAN)], Form::Ascii),
        Err(CliError::Value { .. })
    ));
}

#[test]
fn a_file_that_ends_in_one_dollar_ends() {
    let text = b"$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/1\n$";
    assert!(read(text).is_err());
    let text = b"$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/1\n$$LAYER/2\n$$SPHERE/$";
    assert!(read(text).is_err());
}

/// Layers as a reader numbers and names them.
fn files() -> impl Strategy<Value = Vec<Layer>> {
    // what 32-bit reals hold exactly, so that both forms give the same
    let point = || {
        (-100_000_i32..100_000, -100_000_i32..100_000)
            .prop_map(|(x, y)| DVec3::new(f64::from(x), f64::from(y), 0.0) / 64.0)
    };
    let contour = (0_u32..9, prop::collection::vec(point(), 1..8))
        .prop_map(|(part, points)| vec![(part, Role::Contour, points)]);
    let hatches =
        (0_u32..9, prop::collection::vec((point(), point()), 0..8)).prop_map(|(part, lines)| {
            let lines = lines.into_iter();
            lines
                .map(|(a, b)| (part, Role::Fill, vec![a, b]))
                .collect::<Vec<_>>()
        });
    let layer = (
        0_i32..1000,
        prop::collection::vec(prop_oneof![contour, hatches], 0..5),
    );
    prop::collection::vec(layer, 0..5).prop_map(|all| {
        let mut layers = Vec::new();
        let mut id = 0;
        for (number, (z, items)) in (1..).zip(all) {
            let mut layer = Layer::new(number, f64::from(z) / 32.0);
            for (part, role, points) in items.into_iter().flatten() {
                let head = PassHead {
                    id: PassId(id),
                    part,
                    profile: u16::from(role == Role::Fill),
                    role,
                    ..PassHead::default()
                };
                layer.polyline(head, points);
                id += 1;
            }
            layers.push(layer);
        }
        layers
    })
}

proptest! {
    #[test]
    fn both_forms_give_the_file_back(layers in files()) {
        for form in [Form::Ascii, Form::Binary] {
            let bytes = written(&layers, form).unwrap();
            prop_assert_eq!(Reader::new(bytes.as_slice()).unwrap().parts, parts());
            prop_assert_eq!(&read(&bytes).unwrap(), &layers);
        }
    }
}
