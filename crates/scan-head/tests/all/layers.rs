//! Jobs that come layer by layer: the same as at once, and refused where they must be.

use std::borrow::Cow;

use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_scan_head::head::block::HeadBlock;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::gate::Darkness;
use meltpath_scan_head::head::job::{prepare, prepare_layers};
use meltpath_scan_head::head::prepared::{Layers, alone};
use meltpath_scan_head::head::ready::ReadyHead;
use meltpath_scan_head::head::recipe::{LaserDelays, Recipe};
use meltpath_scan_head::servo::preview::{PreviewDesign, preview};
use meltpath_toolpath::{Channel, Layer, PassHead, Role};

use super::reference::{recipes, two_axis};

fn head(role: Role) -> PassHead {
    PassHead {
        role,
        ..PassHead::default()
    }
}

/// Planned layers of a triangle and a few lines, layers of two short marks, and layers that say their jumps: these end in a mark
/// and begin with one, so that the light goes on from one to the next.
fn layers() -> Vec<Layer> {
    let mut all = Vec::new();
    for number in 1..=4 {
        let mut layer = Layer::new(number, 0.04 * f64::from(number));
        let corner = |k: f64| DVec3::new(3.0 * k.cos(), 3.0 * k.sin(), 0.0);
        let ring = [0.0, 2.0, 4.0, 0.0].map(corner);
        layer.polyline(head(Role::Contour), ring);
        for k in 0..5 {
            let from = DVec3::new(-1.0, 0.2 * f64::from(k), 0.0);
            layer.polyline(head(Role::Fill), [from, from + DVec3::X * 2.0]);
        }
        all.push(layer);
    }
    for number in 5..40 {
        let mut layer = Layer::new(number, 0.04 * f64::from(number));
        let from = DVec3::new(0.0, 0.1 * f64::from(number), 0.0);
        layer.polyline(head(Role::Fill), [from, from + DVec3::X * 12.0]);
        layer.polyline(head(Role::Fill), [from + DVec3::X * 12.0, from]);
        all.push(layer);
    }
    for number in 40..44 {
        let mut layer = Layer::new(number, 0.04 * f64::from(number));
        let at = |k: f64| DVec3::new(k, 1.0, 0.0);
        let marks = [at(0.0), at(1.0)];
        layer.polyline(head(Role::Contour), marks);
        let mut jump = layer.begin(head(Role::Jump), at(1.0));
        jump.line_to(at(2.0)).set(Channel::Dwell, 2e-4);
        layer.polyline(head(Role::Contour), [at(2.0), at(3.0), at(0.0)]);
        all.push(layer);
    }
    all
}

fn streamed<'a>(layers: &'a [Layer], recipe: &'a Recipe) -> Layers<'a> {
    let each = layers.iter().map(|l| Ok(Cow::Borrowed(l)));
    prepare_layers(Box::new(each), recipe).unwrap()
}

const DELAYS: LaserDelays = LaserDelays {
    on: 150e-6,
    off: 90e-6,
};

#[test]
fn layers_one_by_one_do_what_they_do_at_once() {
    let (layers, recipe) = (layers(), recipes()[0].clone());
    let job = prepare(&layers, &recipe).unwrap();
    let plain = two_axis().ready().unwrap();
    let axes = [
        plain.head().mirrors[0].motor().unwrap(),
        plain.head().mirrors[1].motor().unwrap(),
    ];
    let whole = plain.speed_changes(alone(&job), 5e-4).unwrap();
    let pieces = plain.speed_changes(streamed(&layers, &recipe), 5e-4);
    assert_eq!(whole, pieces.unwrap());
    let design = PreviewDesign::default();
    let ahead = preview(axes, plain.head().period, whole, &design).unwrap();
    let run = |ready: &ReadyHead, layers: Layers<'_>| {
        let mut blocks: Vec<HeadBlock> = Vec::new();
        let told = ready.run_layers(layers, (DELAYS, 1), 1, &Silent, &mut blocks);
        (told.unwrap(), blocks)
    };
    for ready in [plain.clone(), plain.clone().with_previews(ahead)] {
        let (one, at_once) = run(&ready, alone(&job));
        let (two, by_layers) = run(&ready, streamed(&layers, &recipe));
        assert_eq!(one, two);
        let lit = at_once.iter().flat_map(|b| &b.lit).sum::<f64>();
        assert!(lit > 100.0, "{lit}");
        for (a, b) in at_once.iter().zip(&by_layers) {
            assert_eq!(a.command, b.command);
            assert_eq!((&a.hit, &a.lit), (&b.hit, &b.lit));
            for k in 0..a.len() {
                let [(x, i), (y, j)] = [a, b].map(|block| block.vector(k).unwrap());
                assert_eq!(x.job.vectors[i], y.job.vectors[j]);
                assert_eq!(x.job.start_of(i), y.job.start_of(j));
            }
        }
        // a block holds the layers it touches, no more
        let last = by_layers.last().unwrap();
        let numbers: Vec<u32> = last.layers.iter().map(|l| l.number).collect();
        assert_eq!(numbers.last(), Some(&43));
        assert!(numbers.first() > Some(&4), "{numbers:?}");
    }
    let dark = |layers| Darkness::of(layers, DELAYS, plain.head().period).unwrap();
    assert_eq!(dark(alone(&job)), dark(streamed(&layers, &recipe)));
}

#[test]
fn a_survey_tells_every_layer() {
    let (layers, recipe) = (layers(), recipes()[1].clone());
    let ready = two_axis().ready().unwrap();
    let found = ready.survey(streamed(&layers, &recipe)).unwrap();
    let whole = ready
        .survey(alone(&prepare(&layers, &recipe).unwrap()))
        .unwrap();
    assert_eq!(found.layers.len(), layers.len());
    assert_eq!(
        (found.samples, found.short, found.hatch),
        (whole.samples, whole.short, whole.hatch)
    );
    assert_eq!(
        (found.contours, found.fills),
        (whole.contours, whole.fills),
        "to the bit"
    );
    for (layer, told) in layers.iter().zip(&found.layers) {
        assert_eq!((layer.number, layer.height), (told.number, told.height));
        // where layers say their jumps, the light goes on from one layer to the next
        let planned = layer.number < 40;
        assert!(!planned || (layer.deposited_length() - told.marked).abs() < 1e-9);
    }
    assert_eq!(found.first.vectors.len() as u32, found.layers[0].vectors);
}

#[test]
fn a_layer_that_cannot_run_stops_the_job_at_its_place() {
    let (mut layers, recipe) = (layers(), recipes()[0].clone());
    let ready = two_axis().ready().unwrap();
    let before = ready.survey(streamed(&layers[..20], &recipe)).unwrap();
    let vectors: u32 = before.layers.iter().map(|l| l.vectors).sum();
    layers[20].translate(DVec3::X * 500.0);
    let refused = ready.survey(streamed(&layers, &recipe)).unwrap_err();
    let HeadError::Field { index, .. } = refused else {
        panic!("{refused}")
    };
    // its jump is the first that leaves the field
    assert_eq!(index as u32, vectors);
    let mut blocks: Vec<HeadBlock> = Vec::new();
    let job = streamed(&layers, &recipe);
    let ran = ready.run_layers(job, (DELAYS, 1), 1, &Silent, &mut blocks);
    assert_eq!(ran.unwrap_err(), refused);
    // a file that cannot be read any more
    let torn = layers[..3].iter().map(|l| Ok(Cow::Borrowed(l)));
    let torn = torn.chain([Err(HeadError::Layer("line 7 is torn".to_owned()))]);
    let job = prepare_layers(Box::new(torn), &recipe).unwrap();
    let ran = ready.run_layers(job, (DELAYS, 1), 1, &Silent, &mut blocks);
    assert_eq!(ran.unwrap_err().to_string(), "line 7 is torn");
    // nothing at all
    let none = prepare_layers(Box::new(std::iter::empty()), &recipe).unwrap();
    assert!(matches!(ready.survey(none), Err(HeadError::Job(_))));
}
