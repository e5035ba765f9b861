//! 3MF toolpaths: the model and one layer behind it in one input, put into a sound package.

use std::io::{Cursor, Read, Write};

use meltpath_base::Ratio;
use meltpath_geometry::io::threemf::{MODEL_PART, Package, PackageWriter};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::mesh::NamedMesh;
use meltpath_geometry::shapes::cuboid;
use meltpath_programs::toolpath_3mf::{
    Beam, Kind, PlanarWriter, Reader, read_spatial, write_spatial,
};
use meltpath_toolpath::{Channel, Layer, Move, PassHead, Profile, Role, Toolpath};

use super::Target;
use crate::mutate::Form;

const LAYER: &str = "Toolpath/Layers/layer00001.xml";
const RELATION: &str = "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03/layer";
/// Where the layer begins in an input.
const MARK: &[u8] = b"<layer";

/// A leaning bead that slows down, and one along an arc.
fn path() -> Toolpath {
    let head = PassHead {
        role: Role::Contour,
        ..PassHead::default()
    };
    let mut layer = Layer::new(1, 0.0);
    let mut bead = layer.begin(head, DVec3::ZERO);
    bead.axis(DVec3::new(0.0, 0.6, 0.8));
    bead.line_to(DVec3::X * 20.0).axis(DVec3::Z).turn(0.5);
    bead.line_to(DVec3::new(20.0, 5.0, 1.0))
        .set(Channel::Speed, 8.0);
    let via = DVec3::new(1.0, 1.0, 0.0);
    let mut arc = layer.begin(head, DVec3::ZERO);
    arc.go(Move::Arc { via }, DVec3::X * 2.0);
    Toolpath {
        profiles: vec![Profile {
            name: "bead".to_owned(),
            speed: 10.0,
            wire_feed: 100.0,
            ..Profile::default()
        }],
        layers: vec![layer],
        ..Toolpath::default()
    }
}

fn part() -> NamedMesh {
    NamedMesh {
        name: "part".to_owned(),
        mesh: cuboid(DVec3::ZERO, DVec3::ONE),
    }
}

fn spatial() -> Vec<u8> {
    let written = write_spatial(&path(), part(), Ratio(0.6), Cursor::new(Vec::new()));
    written.unwrap().into_inner()
}

const BEAM: Beam = Beam {
    speed: [700.0, 1500.0],
    power: [150.0, 200.0],
    jump_speed: [4000.0, 6000.0],
};

fn planar(layers: &[Layer]) -> Option<Vec<u8>> {
    let mut writer = PlanarWriter::new(Cursor::new(Vec::new()), BEAM, "part").ok()?;
    for layer in layers {
        writer.layer(layer).ok()?;
    }
    Some(writer.finish().ok()?.into_inner())
}

fn marks() -> Vec<u8> {
    let mut layer = Layer::new(1, 0.04);
    let head = |role| PassHead {
        role,
        ..PassHead::default()
    };
    let loop_of = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ZERO];
    layer.polyline(head(Role::Contour), loop_of);
    layer.polyline(head(Role::Contour), [DVec3::X, DVec3::Y]);
    layer.polyline(head(Role::Fill), [DVec3::ZERO, DVec3::X]);
    layer.polyline(head(Role::Fill), [DVec3::ZERO, DVec3::Y]);
    planar(&[layer]).unwrap()
}

/// The model and the first layer of a package, one behind the other.
fn unpacked(package: &[u8]) -> Vec<u8> {
    let mut package = Package::open(Cursor::new(package)).unwrap();
    let mut all = Vec::new();
    for name in [MODEL_PART, LAYER] {
        let mut part = package.part(name, "which is a seed").unwrap();
        let mut text = Vec::new();
        part.read_to_end(&mut text).unwrap();
        // a second declaration would end the model
        let begin = text.windows(2).position(|w| w == b"?>").unwrap() + 2;
        all.extend(&text[begin..]);
    }
    all
}

fn packed(input: &[u8]) -> Vec<u8> {
    let at = input.windows(MARK.len()).position(|w| w == MARK);
    let (model, layer) = input.split_at(at.unwrap_or(input.len()));
    let mut package = PackageWriter::new(Cursor::new(Vec::new()), &[]).unwrap();
    package.relations(MODEL_PART, &[(RELATION, LAYER)]).unwrap();
    for (name, text) in [(MODEL_PART, model), (LAYER, layer)] {
        package.part(name).unwrap().write_all(text).unwrap();
    }
    package.finish().unwrap().into_inner()
}

/// What is read is sound, can be written where the format holds it, and is read again.
fn body(input: &[u8]) {
    let package = packed(input);
    let Ok(mut reader) = Reader::new(Cursor::new(&package)) else {
        return;
    };
    let (kind, profiles) = (reader.kind(), reader.profiles());
    let Ok(layers) = reader.by_ref().collect::<Result<Vec<Layer>, _>>() else {
        return;
    };
    for layer in &layers {
        layer.sanity_check().expect("what is read is sound");
    }
    if kind == Kind::Planar {
        if let Some(again) = planar(&layers) {
            let again = Reader::new(Cursor::new(&again)).expect("what is written can be read");
            for layer in again {
                layer.expect("what is written can be read");
            }
        }
        return;
    }
    let toolpath = Toolpath {
        profiles,
        layers,
        ..Toolpath::default()
    };
    if let Ok(again) = write_spatial(&toolpath, part(), Ratio(0.6), Cursor::new(Vec::new())) {
        let read = read_spatial(Cursor::new(again.into_inner()));
        let read = read.expect("what is written can be read");
        assert_eq!(read.found, [], "what is written is followed");
    }
}

/// Model and layer of a 3MF toolpath: the package round them is whole.
pub(super) const TOOLPATH_3MF: Target = Target {
    name: "toolpath_3mf",
    form: Form::Text,
    seeds: || vec![unpacked(&spatial()), unpacked(&marks())],
    body,
};
