//! 3MF toolpaths of other software: what is followed, what is told, what breaks the specification and is named with its place.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use meltpath_geometry::io::threemf::{MODEL_PART, PackageWriter};
use meltpath_geometry::math::DVec3;
use meltpath_programs::toolpath_3mf::{Kind, Reader, SpatialPath, ToolpathFileError, read_spatial};
use meltpath_toolpath::Channel;

use crate::toolpath_3mf::LAYER_PART;

const LAYER_RELATION: &str = "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03/layer";

/// A package of a model and layers.
pub(crate) fn packed(model: &str, layers: &[(&str, &str)]) -> Vec<u8> {
    let mut package = PackageWriter::new(Cursor::new(Vec::new()), &[]).unwrap();
    let links: Vec<_> = layers
        .iter()
        .map(|(name, _)| (LAYER_RELATION, *name))
        .collect();
    package.relations(MODEL_PART, &links).unwrap();
    for (name, text) in layers.iter().chain([&(MODEL_PART, model)]) {
        package
            .part(name)
            .unwrap()
            .write_all(text.as_bytes())
            .unwrap();
    }
    package.finish().unwrap().into_inner()
}

/// A model and a layer that other software might have written, of a kind, with what a profile says and what the layer holds.
fn foreign(kind: &str, profile: &str, segments: &str) -> [String; 2] {
    let top = if kind == "planar" { " ztop=\"50\"" } else { "" };
    let model = format!(
        r#"<?xml version="1.0"?>
<c:model unit="centimeter" xmlns:c="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
 xmlns:x="http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03" xmlns:v="urn:vendor"
 xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" requiredextensions="p x">
<c:resources><x:toolpathresource id="3" uuid="92f90fa0-e2cc-4cb0-a56b-aa4fd2f51868" unitfactor="0.01" toolpathtype="{kind}">
<x:toolpathprofiles><x:toolpathprofile uuid="54066B90-8346-402b-8bc9-7d7cfdd54686" name="P" {profile}</x:toolpathprofile></x:toolpathprofiles>
<x:toolpathlayers><x:toolpathlayer{top} path="/{LAYER_PART}"/></x:toolpathlayers>
<x:toolpathdata><v:note a="b">text</v:note></x:toolpathdata>
</x:toolpathresource></c:resources><c:build x:toolpathid="3"/></c:model>"#
    );
    let layer = format!(
        r#"<layer xmlns="http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03" xmlns:v="urn:vendor">
<parts><part id="5" uuid="2f1d3c4b-5a6e-4d7c-8b9a-0c1d2e3f4a5b"/></parts>
<profiles><profile id="9" uuid="54066b90-8346-402b-8bc9-7d7cfdd54686"/></profiles>
<data><v:qa/></data><segments>{segments}</segments></layer>"#
    );
    [model, layer]
}

fn read(kind: &str, profile: &str, segments: &str) -> Result<SpatialPath, ToolpathFileError> {
    let [model, layer] = foreign(kind, profile, segments);
    read_spatial(Cursor::new(packed(&model, &[(LAYER_PART, &layer)])))
}

const LINE: &str = r#"<segment type="polyline3d" profileid="9" partid="5"><point3d x="0" y="0" z="-3"/><point3d x="100" y="0" z="5"/></segment>"#;

#[test]
fn other_software_is_followed_and_told() {
    let found = read(
        "3axis",
        r#"depositionspeed="8" prewaittime="2000" v:weave="sine">"#,
        LINE,
    )
    .unwrap();
    let layer = &found.toolpath.layers[0];
    // hundredths of a centimetre
    assert_eq!(
        layer.pass(0).points,
        [DVec3::new(0.0, 0.0, -0.3), DVec3::new(10.0, 0.0, 0.5)]
    );
    assert_eq!(layer.pass(0).axis(0), None);
    assert_eq!(found.toolpath.profiles[0].speed, 8.0);
    let mut told = String::new();
    for f in &found.found {
        assert_eq!(
            (f.part.as_str(), f.segment, f.profile.as_str()),
            (LAYER_PART, 1, "P")
        );
        writeln!(told, "{}", f.what).unwrap();
    }
    assert_eq!(
        told,
        "it says no wire feed\nits waits (prewaittime, postwaittime) are left out\nwhat its weave=\"sine\" does is not known here\n"
    );
    let modified = r#"depositionspeed="8"><x:modifier attribute="depositionspeed" type="constant" factor="g" minvalue="4" maxvalue="8"/>"#;
    let slower = LINE.replace(r#"z="5""#, r#"z="5" g="0.25" tag="3""#);
    let layer = read("3axis", modified, &slower)
        .unwrap()
        .toolpath
        .layers
        .remove(0);
    assert_eq!(layer.pass(0).value(Channel::Speed, 0), Some(5.0));
}

/// Lines that an `arc` counts and that are none are laid as lines, and told: more than there are, and some that lie beside the arc.
#[test]
fn arcs_that_lines_are_none_of_are_told() {
    let said = |at: &str, word: &str| {
        let point =
            |x: i32, y: i32, more: &str| format!(r#"<point3d x="{x}" y="{y}" z="0"{more}/>"#);
        let end = format!(r#" mp:arc="{word}""#);
        let points = [
            point(0, 0, ""),
            point(29, 71, ""),
            point(100, 100, ""),
            at.to_owned(),
            point(200, 0, &end),
        ];
        let segment = format!(
            r#"<segment xmlns:mp="https://github.com/meltpath/meltpath/3mf/1" type="polyline3d" profileid="9" partid="5">{}</segment>"#,
            points.concat()
        );
        let wire = r#"xmlns:mp="https://github.com/meltpath/meltpath/3mf/1" mp:wirefeed="100" depositionspeed="8">"#;
        let read = read("3axis", wire, &segment).unwrap();
        let whats: Vec<String> = read.found.into_iter().map(|f| f.what).collect();
        (read.toolpath.layers[0].pass(0).points.len(), whats)
    };
    let on = r#"<point3d x="171" y="71" z="0"/>"#;
    let (points, told) = said(on, "2 9999");
    assert_eq!(points, 5);
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(
        told[0].contains("arc=\"2 9999\"") && told[0].contains("only 4 lines lead there"),
        "{told:?}"
    );
    let (points, told) = said(r#"<point3d x="171" y="40" z="0"/>"#, "2 4");
    assert_eq!(points, 5);
    assert!(told[0].contains("do not lie on it"), "{told:?}");
    for (at, word) in [(on, "1 1"), (on, "2 4")] {
        let (_, told) = said(at, word);
        assert!(word == "2 4" || told.is_empty(), "{told:?}");
    }
}

/// What a profile says in most of these.
const SAYS: &str = r#"depositionspeed="8">"#;

#[track_caller]
fn refused(kind: &str, profile: &str, segments: &str, told: &str) {
    let error = read(kind, profile, segments).unwrap_err().to_string();
    assert!(error.contains(told), "{told}: {error}");
    assert!(error.contains("byte ") || kind == "planar", "{error}");
}

/// The line of most of these with a word exchanged.
#[track_caller]
fn refused_line(from: &str, to: &str, told: &str) {
    assert!(LINE.contains(from), "{from}");
    refused("3axis", SAYS, &LINE.replacen(from, to, 1), told);
}

#[test]
fn mistakes_of_points_are_named_with_their_place() {
    for (q, told) in [
        (r#"i="0" j="0" k="0" w="0""#, "has no direction"),
        (r#"i="nan" j="0" k="0" w="1""#, "not a finite number"),
        (r#"i="0" j="0" k="0""#, "lacks one of i, j, k, w"),
    ] {
        let first = format!(r#"<point6d x="0" y="0" z="0" {q}/>"#);
        let last = r#"<point6d x="1" y="0" z="0" i="0" j="0" k="0" w="1"/>"#;
        let segment = format!(
            r#"<segment type="polyline6d" profileid="9" partid="5">{first}{last}</segment>"#
        );
        refused("6axis", SAYS, &segment, told);
    }
    refused_line("\"100\"", "\"1e2\"", "x=\"1e2\" is not a whole number");
    refused_line("\"100\"", "\"3000000000\"", "not a whole number");
    refused_line("x=\"100\" ", "", "`point3d` lacks x");
    refused_line(
        "z=\"5\"",
        "z=\"5\" e=\"1\"",
        "which its profile \"P\" does not have",
    );
    refused_line("z=\"5\"", "z=\"5\" e=\"2\"", "not between 0 and 1");
    refused_line("z=\"5\"", "z=\"5\" q=\"2\"", "has no attribute `q`");
}

#[test]
fn mistakes_of_segments_are_named_with_their_place() {
    let mixed = "a segment of type polyline3d in a toolpath that is 6axis";
    refused("6axis", SAYS, LINE, mixed);
    refused("3axis", SAYS, "<bezier/>", "has no place here");
    refused("planar", SAYS, "", "lpbf.layers");
    refused("5axis", SAYS, LINE, "none of planar, 3axis, 6axis");
    refused_line("polyline3d", "spline", "no type of segment that is known");
    refused_line(
        "point3d x=\"100\"",
        "point x=\"100\"",
        "does not hold `point`",
    );
    refused_line("profileid=\"9\"", "profileid=\"8\"", "none of the profiles");
    refused_line("partid=\"5\"", "partid=\"4\"", "none of the parts");
    refused_line("partid", "lasersync=\"1\" partid", "no group of lasers");
    refused_line("<point3d x=\"0\" y=\"0\" z=\"-3\"/>", "", "at least 2");
}

#[test]
fn mistakes_of_profiles_are_named_with_their_place() {
    let modifier = |attribute: &str, kind: &str, least: u32| {
        format!(
            r#"depositionspeed="8"><x:modifier attribute="{attribute}" type="{kind}" factor="e" minvalue="{least}" maxvalue="2"/>"#
        )
    };
    for (profile, told) in [
        (
            modifier("depositionspeed", "linear", 1),
            "export without this modifier",
        ),
        (modifier("v:weave", "constant", 1), "varies v:weave"),
        (
            modifier("q:weave", "constant", 1),
            "prefix `q` is not declared",
        ),
        (
            modifier("depositionspeed", "constant", 0),
            "a value that it may have",
        ),
        (
            modifier("depositionspeed", "constant", 2),
            "must be the smaller one",
        ),
        (r#"depositionspeed="0">"#.to_owned(), "must be above zero"),
        (r#"speed="8">"#.to_owned(), "has no attribute `speed`"),
    ] {
        refused("3axis", &profile, LINE, told);
    }
}

#[test]
fn what_a_package_lacks_or_requires_is_named() {
    let [model, layer] = foreign("3axis", r#"depositionspeed="8">"#, LINE);
    let refused = |model: &str, layers: &[(&str, &str)]| {
        read_spatial(Cursor::new(packed(model, layers)))
            .unwrap_err()
            .to_string()
    };
    let whole = [(LAYER_PART, layer.as_str())];
    for (from, to, told) in [
        (
            r#"requiredextensions="p x""#,
            r#"requiredextensions="p x v""#,
            "needs the 3MF extension `v` (urn:vendor)",
        ),
        (
            r#"xmlns:v="urn:vendor""#,
            r#"xmlns:v="urn:vendor" xmlns:b="http://schemas.3mf.io/3dmanufacturing/binary/2023/05""#,
            "`binary encoding`",
        ),
        (
            r#"toolpathid="3""#,
            r#"toolpathid="4""#,
            "names the toolpath 4",
        ),
        (
            r#"unitfactor="0.01""#,
            r#"unitfactor="-1""#,
            "must be above zero",
        ),
        (r#"uuid="92f90fa0-"#, r#"uuid="92f90fa0"#, "is no UUID"),
        (
            r#"path="/Toolpath"#,
            r#"path="Toolpath"#,
            "does not begin with a slash",
        ),
        (
            "<v:note a=\"b\">text</v:note>",
            "<v:note><![CDATA[x]]></v:note>",
            "CDATA",
        ),
        ("</c:resources>", "", "not well-formed"),
    ] {
        let mut changed = model.replace(from, to);
        if told.contains("binary") {
            changed = changed.replace(
                r#"requiredextensions="p x""#,
                r#"requiredextensions="p x b""#,
            );
        }
        let error = refused(&changed, &whole);
        assert!(error.contains(told), "{told}: {error}");
    }
    let error = refused(&model, &[]);
    assert!(
        error.contains("no relationship") || error.contains("no part"),
        "{error}"
    );
    let none = model.replace("x:toolpathresource", "v:other");
    let none = none.replace(r#" x:toolpathid="3""#, "");
    assert!(refused(&none, &whole).contains("holds no toolpath"));
    let two = model.replace("</c:resources>", r#"<x:toolpathresource id="4" uuid="92f90fa0-e2cc-4cb0-a56b-aa4fd2f51868" unitfactor="1"/></c:resources>"#);
    let two = two.replace(r#" x:toolpathid="3""#, "");
    assert!(refused(&two, &whole).contains("holds 2 toolpaths"));
    // earlier drafts are read as the same
    let draft = model.replace(
        "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03",
        "http://schemas.microsoft.com/3dmanufacturing/toolpath/2019/05",
    );
    assert!(read_spatial(Cursor::new(packed(&draft, &whole))).is_ok());
}

#[test]
fn lasers_at_the_same_time_are_refused() {
    let hatch = |laser: u32| {
        format!(
            r#"<segment type="hatch" profileid="9" partid="5" laserindex="{laser}"><hatch x1="0" y1="0" x2="9" y2="0"/></segment>"#
        )
    };
    let refused = |segments: &str| {
        let [model, layer] = foreign("planar", r#"laserspeed="8" laserfocus="0.5">"#, segments);
        let package = packed(&model, &[(LAYER_PART, &layer)]);
        let mut reader = Reader::new(Cursor::new(&package)).unwrap();
        assert_eq!(reader.kind(), Kind::Planar);
        let layer = reader.next().unwrap();
        (layer.map_err(|e| e.to_string()), reader.found())
    };
    let (error, _) = refused(&(hatch(1) + &hatch(2)));
    assert!(
        error
            .unwrap_err()
            .contains("export the segments of one laser")
    );
    let (layer, found) = refused(&hatch(2));
    // a top of 50 hundredths of a centimetre
    assert_eq!(layer.unwrap().height, 5.0);
    assert_eq!(found.len(), 2);
    assert!(found[0].what.contains("laserfocus of 0.5 mm"), "{found:?}");
    assert!(
        found[1].what.contains("no laserpower: that of the recipe"),
        "{found:?}"
    );
    assert!(found[0].shapes && !found[1].shapes);
    // one after the other where they mark layers of different heights, and together at one height
    let second = LAYER_PART.replace("layer", "other");
    for (top, is_read) in [(51, true), (50, false)] {
        let profile = r#"laserspeed="8" laserpower="200">"#;
        let [model, first] = foreign("planar", profile, &hatch(1));
        let [_, then] = foreign("planar", profile, &hatch(2));
        let both =
            format!("<x:toolpathlayer ztop=\"{top}\" path=\"/{second}\"/></x:toolpathlayers>");
        let model = model.replace("</x:toolpathlayers>", &both);
        let package = packed(&model, &[(LAYER_PART, &first), (&second, &then)]);
        let mut reader = Reader::new(Cursor::new(&package)).unwrap();
        assert!(reader.next().unwrap().is_ok());
        assert_eq!(reader.next().unwrap().is_ok(), is_read, "{top}");
    }
}

/// A megabyte of blanks packs to a thousandth: a real layer does not.
#[test]
fn a_bomb_is_refused() {
    let [model, layer] = foreign("3axis", r#"depositionspeed="8">"#, LINE);
    let blanks = " ".repeat(70 << 20);
    let layer = layer.replace("<segments>", &format!("<segments>{blanks}"));
    let error = read_spatial(Cursor::new(packed(&model, &[(LAYER_PART, &layer)]))).unwrap_err();
    assert!(error.to_string().contains("zip bomb"), "{error}");
}
