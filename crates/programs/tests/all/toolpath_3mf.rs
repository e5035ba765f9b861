//! 3MF toolpaths: golden text, what is written is read, what breaks the specification or is not followed is named.

use std::io::{Cursor, Read as _};

use meltpath_base::{Ratio, Reporter, Silent};
use meltpath_geometry::io::threemf::{MODEL_PART, Package, read_3mf};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::mesh::NamedMesh;
use meltpath_geometry::shapes::cuboid;
use meltpath_programs::toolpath_3mf::{
    Beam, PlanarWriter, Reader, SpatialPath, ToolpathFileError, read_spatial, write_spatial,
};
use meltpath_toolpath::{
    Channel, Event, Layer, Move, Pass, PassHead, PassId, Profile, Role, Toolpath,
};
use proptest::prelude::*;

use crate::toolpath_3mf_of_others::packed;

pub(crate) const LAYER_PART: &str = "Toolpath/Layers/layer00001.xml";

fn block() -> NamedMesh {
    NamedMesh {
        name: "wall <1>".to_owned(),
        mesh: cuboid(DVec3::ZERO, DVec3::new(40.0, 6.0, 3.2)),
    }
}

fn head(role: Role, profile: u16, part: u32) -> PassHead {
    PassHead {
        role,
        profile,
        part,
        ..PassHead::default()
    }
}

fn profile(name: &str) -> Profile {
    Profile {
        name: name.to_owned(),
        speed: 12.5,
        wire_feed: 400.0 / 3.0,
        width: 6.4,
        height: 1.6,
        ..Profile::default()
    }
}

/// A bead that leans and slows down, an arc, a travel, a second layer.
fn path() -> Toolpath {
    let mut first = Layer::new(1, 0.0);
    let mut bead = first.begin(head(Role::Contour, 0, 1), DVec3::ZERO);
    bead.axis(DVec3::Z);
    bead.line_to(DVec3::new(40.0, 0.0, 0.0));
    bead.axis(DVec3::new(0.0, 0.3, 1.0).normalize());
    bead.line_to(DVec3::new(40.0, 6.0, 0.5))
        .set(Channel::Speed, 10.0)
        .set(Channel::WireFeed, 120.0);
    bead.axis(DVec3::new(0.2, 0.3, 1.0).normalize()).turn(0.4);
    first.polyline(
        head(Role::Travel, 1, 1),
        [DVec3::Z * 20.0, DVec3::new(5.0, 0.0, 20.0)],
    );
    let mut second = Layer::new(4, 1.6);
    let mut bead = second.begin(head(Role::Skin, 0, 7), DVec3::ZERO);
    bead.go(
        Move::Arc {
            via: DVec3::new(1.0, 1.0, 0.0),
        },
        DVec3::new(2.0, 0.0, 0.0),
    );
    Toolpath {
        profiles: vec![profile("bead"), profile("travel")],
        layers: vec![first, second],
        ..Toolpath::default()
    }
}

fn written(toolpath: &Toolpath) -> Vec<u8> {
    let to = Cursor::new(Vec::new());
    write_spatial(toolpath, block(), Ratio(0.6), to)
        .unwrap()
        .into_inner()
}

fn part_of(package: &[u8], name: &str) -> String {
    let mut package = Package::open(Cursor::new(package)).unwrap();
    let mut text = String::new();
    let mut part = package.part(name, "which the test reads").unwrap();
    part.read_to_string(&mut text).unwrap();
    text
}

fn parts(package: &[u8], names: &[&str]) -> String {
    let told = |name: &&str| format!("==> {name} <==\n{}", part_of(package, name));
    names.iter().map(told).collect()
}

fn layers(package: &[u8]) -> Result<Vec<Layer>, ToolpathFileError> {
    Reader::new(Cursor::new(package))?.collect()
}

fn beam() -> Beam {
    Beam {
        speed: [700.0, 1500.0],
        power: [150.0, 200.0],
        jump_speed: [4000.0, 6000.0],
    }
}

fn marked(layers: &[Layer]) -> Vec<u8> {
    let mut writer = PlanarWriter::new(Cursor::new(Vec::new()), beam(), "section").unwrap();
    for layer in layers {
        writer.layer(layer).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// A loop, an open line, two joined hatches and one with its own power, in a layer at 0.06 mm.
fn section() -> Layer {
    let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0], [0.0, 0.0]];
    let flat = |p: [f64; 2]| DVec3::new(p[0], p[1], 0.0);
    let mut layer = Layer::new(2, 0.06);
    layer.polyline(head(Role::Contour, 0, 1), square.map(flat));
    layer.polyline(
        head(Role::Contour, 0, 1),
        [[0.5, 0.5], [1.0, 0.5], [1.0, 1.0]].map(flat),
    );
    layer.polyline(head(Role::Jump, 0, 1), [[1.0, 1.0], [0.1, 0.1]].map(flat));
    for y in [0.1, 0.2] {
        layer.polyline(head(Role::Fill, 0, 1), [[0.1, y], [3.9, y]].map(flat));
    }
    let mut hot = layer.begin(head(Role::Fill, 0, 2), flat([0.1, 0.3]));
    hot.line_to(flat([3.9, 0.3])).set(Channel::Power, 250.0);
    layer
}

#[test]
fn the_files_are_these() {
    let names = ["[Content_Types].xml", "_rels/.rels"];
    let linked = ["3D/_rels/3dmodel.model.rels", MODEL_PART, LAYER_PART];
    let second = ["Toolpath/Layers/layer00002.xml"];
    let six = written(&path());
    insta::assert_snapshot!(
        "toolpath_6axis",
        parts(&six, &[&names[..], &linked, &second].concat())
    );
    insta::assert_snapshot!("toolpath_planar", parts(&marked(&[section()]), &linked));
    assert_eq!(six, written(&path()), "the same path gives the same bytes");
}

/// The package is one of the core specification: its part is read as any other.
#[test]
fn the_part_is_in_the_package() {
    let read = read_3mf(Cursor::new(written(&path())), &Reporter::new(), &Silent).unwrap();
    assert_eq!(read, [block()]);
}

#[test]
fn arcs_come_back_as_arcs_and_travels_do_not() {
    let read = read_spatial(Cursor::new(written(&path()))).unwrap();
    assert_eq!(read.found, []);
    let layers = &read.toolpath.layers;
    assert_eq!(layers.iter().map(|l| l.number).collect::<Vec<_>>(), [1, 4]);
    assert_eq!(layers.iter().map(Layer::len).collect::<Vec<_>>(), [1, 1]);
    let arc = layers[1].pass(0);
    assert_eq!((arc.head.role, arc.head.part), (Role::Skin, 7));
    assert!((arc.length() - std::f64::consts::PI).abs() < 1e-3);
    assert!(matches!(arc.move_at(0), Move::Arc { .. }));
    assert_eq!(arc.points[1], DVec3::new(2.0, 0.0, 1.6));
    let profiles = &read.toolpath.profiles;
    assert_eq!(profiles, &[profile("bead")]);
    // other software follows the lines
    let text = part_of(&written(&path()), "Toolpath/Layers/layer00002.xml");
    assert!(text.matches("<point6d").count() > 8, "{text}");
}

#[test]
fn marks_come_back_with_their_speed_and_power() {
    let read = layers(&marked(&[section()])).unwrap();
    let [layer] = &read[..] else {
        panic!("{read:?}")
    };
    layer.sanity_check().unwrap();
    assert_eq!((layer.number, layer.height), (2, 0.06));
    let told: Vec<_> = layer
        .passes()
        .map(|p| {
            let says = |c| p.value(c, 0).unwrap();
            let (speed, power) = (says(Channel::Speed), says(Channel::Power));
            (p.head.role, p.head.part, p.points.to_vec(), speed, power)
        })
        .collect();
    let own = section();
    let wanted: Vec<_> = own
        .passes()
        .filter(|p| p.head.role.deposits())
        .map(|p| {
            let which = usize::from(p.head.role != Role::Contour);
            let power = p.value(Channel::Power, 0).unwrap_or(beam().power[which]);
            let values = (beam().speed[which], power);
            (
                p.head.role,
                p.head.part,
                p.points.to_vec(),
                values.0,
                values.1,
            )
        })
        .collect();
    assert_eq!(told, wanted);
}

/// Points, axes, turns, speeds and feeds of all beads.
type Said = (DVec3, DVec3, f64, Option<[f64; 2]>);

fn said(pass: &Pass<'_>, profiles: &[Profile], height: f64) -> Vec<Said> {
    let profile = &profiles[usize::from(pass.head.profile)];
    let values = |i: usize| {
        [
            pass.value(Channel::Speed, i).unwrap_or(profile.speed),
            pass.value(Channel::WireFeed, i)
                .unwrap_or(profile.wire_feed),
        ]
    };
    let point = |i: usize| {
        (
            pass.points[i] + height * DVec3::Z,
            pass.axis(i).unwrap_or(DVec3::Z),
            pass.turn(i).unwrap_or(0.0),
            i.checked_sub(1).map(values),
        )
    };
    (0..pass.points.len()).map(point).collect()
}

fn all_said(toolpath: &Toolpath) -> Vec<Vec<Said>> {
    let beads = toolpath.layers.iter().flat_map(|l| {
        let beads = l.passes().filter(|p| p.head.role.deposits());
        beads.map(|p| said(&p, &toolpath.profiles, l.height))
    });
    beads.collect()
}

/// Points, axis, turn, speed, feed; the plain ones say nothing but points.
type Random = ([f64; 3], [f64; 3], f64, f64, f64, bool);

fn points() -> impl Strategy<Value = Vec<Random>> {
    let xyz = prop::array::uniform3(-400.0..400.0);
    let axis = prop::array::uniform3(-1.0..1.0);
    prop::collection::vec(
        (xyz, axis, -3.0..3.0, 1.0..40.0, 20.0..400.0, any::<bool>()),
        2..8,
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_is_read(beads in prop::collection::vec((points(), 0u16..2, 0u32..3), 1..6)) {
        let mut toolpath = Toolpath { profiles: vec![profile("a"), profile("a")], ..Toolpath::default() };
        for (k, (points, profile, part)) in beads.iter().enumerate() {
            let mut layer = Layer::new(k as u32 + 1, 1.6 * k as f64);
            let mut pass = layer.begin(head(Role::Fill, *profile, *part), DVec3::from(points[0].0));
            for (i, (xyz, axis, turn, speed, feed, plain)) in points.iter().enumerate() {
                if i > 0 {
                    pass.line_to(DVec3::from(*xyz));
                }
                let axis = DVec3::from(*axis);
                if !plain && axis.length() > 0.1 && axis.normalize().z > -0.99 {
                    pass.axis(axis.normalize()).turn(*turn);
                    pass.set(Channel::Speed, *speed).set(Channel::WireFeed, *feed);
                }
            }
            toolpath.layers.push(layer);
        }
        let package = written(&toolpath);
        let SpatialPath { toolpath: read, found, smoothing } = read_spatial(Cursor::new(&package)).unwrap();
        prop_assert_eq!(found, []);
        prop_assert_eq!(smoothing, Some(Ratio(0.6)));
        read.layers.iter().for_each(|l| l.sanity_check().unwrap());
        let (wanted, got) = (all_said(&toolpath), all_said(&read));
        prop_assert_eq!(got.len(), wanted.len());
        for (a, b) in got.iter().zip(&wanted) {
            prop_assert_eq!(a.len(), b.len());
            for ((p, axis, turn, values), (q, wanted_axis, wanted_turn, wanted_values)) in a.iter().zip(b) {
                prop_assert!(p.distance(*q) < 1e-3);
                prop_assert!(axis.angle_between(*wanted_axis).to_degrees() < 1e-3);
                // near the pole that points down the turn is not told from the axis
                let off = (turn - wanted_turn).rem_euclid(std::f64::consts::TAU);
                prop_assert!(off.min(std::f64::consts::TAU - off).to_degrees() < 1e-3 || wanted_axis.z < -0.9);
                for (v, w) in values.iter().flatten().zip(wanted_values.iter().flatten()) {
                    prop_assert!((v - w).abs() < 1e-8, "{v} {w}");
                }
            }
        }
        // once read, nothing changes any more
        let numbered = Toolpath { profiles: read.profiles.clone(), layers: read.layers.clone(), ..Toolpath::default() };
        let again = read_spatial(Cursor::new(written(&numbered))).unwrap().toolpath;
        prop_assert_eq!(all_said(&again).len(), got.len());
        for (a, b) in all_said(&again).iter().flatten().zip(got.iter().flatten()) {
            prop_assert_eq!(a.0, b.0);
        }
    }

    #[test]
    fn marks_that_are_written_are_read(lines in prop::collection::vec((prop::array::uniform4(-150.0..150.0), 0usize..3, 0u32..3, prop::option::of(1.0..9e3)), 1..30)) {
        let mut layer = Layer::new(1, 0.03);
        for ([x1, y1, x2, y2], role, part, speed) in lines {
            let role = [Role::Fill, Role::Contour, Role::Support][role];
            let mut pass = layer.begin(head(role, 0, part), DVec3::new(x1, y1, 0.0));
            pass.line_to(DVec3::new(x2, y2, 0.0));
            if let Some(speed) = speed {
                pass.set(Channel::Speed, speed);
            }
        }
        let read = layers(&marked(std::slice::from_ref(&layer))).unwrap();
        prop_assert_eq!(read.len(), 1);
        prop_assert_eq!(read[0].len(), layer.len());
        for (a, b) in read[0].passes().zip(layer.passes()) {
            prop_assert_eq!((a.head.role, a.head.part), (b.head.role, b.head.part));
            prop_assert!(a.points.iter().zip(b.points).all(|(p, q)| p.distance(*q) < 1e-3));
            let usual = beam().speed[usize::from(b.head.role != Role::Contour)];
            prop_assert_eq!(a.value(Channel::Speed, 0), Some(b.value(Channel::Speed, 0).unwrap_or(usual)));
        }
    }

    /// A damaged package is refused or read, and never a fault of the reader.
    #[test]
    fn damaged_packages_never_panic(at in 0.0..1.0f64, byte in any::<u8>(), cut in any::<bool>()) {
        for mut package in [written(&path()), marked(&[section()])] {
            let at = (at * package.len() as f64) as usize;
            if cut {
                package.truncate(at);
            } else {
                package[at] = byte;
            }
            let _ = layers(&package);
        }
    }

    /// A damaged text in a sound package.
    #[test]
    fn damaged_layers_never_panic(at in 0.0..1.0f64, byte in 32u8..127, cut in any::<bool>()) {
        let package = written(&path());
        let text = part_of(&package, LAYER_PART);
        let at = (at * text.len() as f64) as usize;
        let damaged = if cut {
            text[..at].to_owned()
        } else {
            format!("{}{}{}", &text[..at], char::from(byte), &text[at + 1..])
        };
        let _ = layers(&packed(&part_of(&package, MODEL_PART), &[(LAYER_PART, &damaged)]));
    }
}

#[test]
fn what_the_format_has_no_words_for_is_told() {
    let refused = |change: fn(&mut Toolpath)| {
        let mut toolpath = path();
        change(&mut toolpath);
        let told = write_spatial(&toolpath, block(), Ratio(0.6), Cursor::new(Vec::new()));
        told.unwrap_err().to_string()
    };
    let dwell = refused(|t| t.profiles[0].dwell = 0.2);
    assert!(dwell.contains("a dwell with the arc on"), "{dwell}");
    let weave = refused(|t| {
        t.layers[0] = Layer::new(1, 0.0);
        let mut bead = t.layers[0].begin(head(Role::Fill, 0, 1), DVec3::ZERO);
        bead.event(Event::Weave(1)).line_to(DVec3::X);
    });
    assert!(weave.contains("no words for a weave"), "{weave}");
    let far = refused(|t| t.layers[0].translate(DVec3::X * 1e7));
    assert!(far.contains("within 200 m"), "{far}");
    let still = refused(|t| t.profiles[0].speed = 0.0);
    assert!(still.contains("the speed is 0"), "{still}");
    let none = refused(|t| t.layers.clear());
    assert!(none.contains("lays and marks nothing"), "{none}");
    let mut below = section();
    below.height = -1.0;
    let mut writer = PlanarWriter::new(Cursor::new(Vec::new()), beam(), "").unwrap();
    let told = writer.layer(&below).unwrap_err().to_string();
    assert!(told.contains("0 or above"), "{told}");
}

#[test]
fn passes_are_numbered_through() {
    let read = read_spatial(Cursor::new(written(&path()))).unwrap();
    let ids: Vec<_> = read.toolpath.passes().map(|p| p.head.id).collect();
    assert_eq!(ids, [PassId(1), PassId(2)]);
}
