//! What contours of layers tell, on layers drawn by hand.

use super::*;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::PassHead;

/// A layer of rectangles (x and y of two corners, which way round they run) and of lines along x, 0.1 mm apart, over others.
fn layer(rings: &[([f64; 4], f64)], filled: &[[f64; 4]]) -> Layer {
    let mut layer = Layer::new(1, 0.0);
    let head = |role| PassHead {
        role,
        ..PassHead::default()
    };
    for ([x, y, u, v], way) in rings {
        let mut corners = vec![[*x, *y], [*u, *y], [*u, *v], [*x, *v], [*x, *y]];
        if *way < 0.0 {
            corners.reverse();
        }
        let points = corners.into_iter().map(|[x, y]| DVec3::new(x, y, 0.0));
        layer.polyline(head(Role::Contour), points);
    }
    for [x, y, u, v] in filled {
        for n in 0..((v - y) / 0.1).round() as u32 {
            let y = y + 0.1 * f64::from(n);
            layer.polyline(
                head(Role::Fill),
                [DVec3::new(*x, y, 0.0), DVec3::new(*u, y, 0.0)],
            );
        }
    }
    layer
}

const SPOT: f64 = 0.08;

fn told(layers: &[Layer]) -> Enclosure {
    let mut found = Found::default();
    for layer in layers {
        found.take(layer, 0.1, SPOT);
    }
    found.enclosure(0.1, SPOT)
}

fn said(layers: &[Layer]) -> Option<Check> {
    told(layers).checks.into_iter().find(|c| c.id == BARE_ID)
}

fn passes(layers: &[Layer]) -> bool {
    said(layers).unwrap().status == Status::Pass
}

const WHOLE: [f64; 4] = [0.0, 0.0, 6.0, 4.0];

#[test]
fn lines_that_are_missing_are_told() {
    let half = layer(&[(WHOLE, 1.0)], &[[0.0, 0.0, 6.0, 2.0]]);
    let full = layer(&[(WHOLE, 1.0)], &[WHOLE]);
    assert!(passes(std::slice::from_ref(&full)));
    let check = said(&[full.clone(), half]).unwrap();
    assert_eq!(check.status, Status::CannotSay);
    // two hatch distances of the half are near its last line and its contour
    assert!((check.value.unwrap().value - 45.0).abs() < 2.0);
    // a layer that lost all its lines; a file of contours alone; one without contours
    let bare = layer(&[(WHOLE, 1.0)], &[]);
    assert!(!passes(&[full, bare.clone()]));
    for (layers, why) in [
        (bare, "no lines of a fill"),
        (layer(&[], &[[0.0, 0.0, 6.0, 2.0]]), "no closed contours"),
    ] {
        let check = said(&[layers]).unwrap();
        assert_eq!(check.status, Status::NotChecked);
        assert!(check.reason.contains(why), "{}", check.reason);
    }
}

/// One line may miss, as hatches that begin anew leave it; three in the middle of a layer may not, nor all of a small body beside a large
/// one, nor five of six all over.
#[test]
fn few_lines_and_small_bodies_count() {
    let without = |gap: f64| {
        layer(
            &[(WHOLE, 1.0)],
            &[[0.0, 0.0, 6.0, 2.0], [0.0, 2.0 + gap, 6.0, 4.0]],
        )
    };
    assert!(passes(&[without(0.1)]));
    assert!(!passes(&[without(0.3)]));
    let small = [8.0, 0.0, 9.0, 1.0];
    let shell = layer(&[(WHOLE, 1.0), (small, 1.0)], &[WHOLE]);
    let check = said(&[shell]).unwrap();
    assert_eq!(check.status, Status::CannotSay);
    assert!((check.value.unwrap().value - 64.0).abs() < 6.0);
    let mut thin = layer(&[(WHOLE, 1.0)], &[]);
    for n in 0..7 {
        let y = 0.6 * f64::from(n);
        let head = PassHead {
            role: Role::Fill,
            ..PassHead::default()
        };
        let ends = [DVec3::new(0.0, y, 0.0), DVec3::new(6.0, y, 0.0)];
        thin.polyline(head, ends);
    }
    assert!(!passes(&[thin]));
}

/// What is a small share of a large area may be an island that nobody marks.
#[test]
fn an_island_that_is_left_out_is_told() {
    let large = [0.0, 0.0, 20.0, 10.0];
    let around = [
        [0.0, 0.0, 20.0, 4.0],
        [0.0, 4.0, 9.0, 6.0],
        [10.5, 4.0, 20.0, 6.0],
        [0.0, 6.0, 20.0, 10.0],
    ];
    let island = layer(&[(large, 1.0)], &around);
    assert!(passes(std::slice::from_ref(&island)));
    let spot = |layers: &[Layer]| {
        let mut checks = told(layers).checks.into_iter();
        checks.find(|c| c.id == "bare-spot")
    };
    let check = spot(&[island]).unwrap();
    assert_eq!(check.status, Status::CannotSay);
    // 1.5 mm between the ends of the lines
    assert!((check.value.unwrap().value - 1.5).abs() < 0.15);
    let [x, y, _] = check.place.unwrap().position.unwrap();
    assert!((x - 9.75).abs() < 0.2 && (4.5..5.5).contains(&y));
    // three lines that miss side by side are narrower; where all is near marks there is none
    let lines = [[0.0, 0.0, 20.0, 4.0], [0.0, 4.3, 20.0, 10.0]];
    let band = spot(&[layer(&[(large, 1.0)], &lines)]).unwrap();
    assert_eq!(band.status, Status::Pass);
    let width = band.value.unwrap().value;
    assert!((0.25..0.45).contains(&width), "{width}");
    let full = spot(&[layer(&[(large, 1.0)], &[large])]).unwrap();
    assert_eq!(
        (full.status, full.value.unwrap().value),
        (Status::Pass, 0.0)
    );
}

/// Lines that miss side by side leave a narrow strip, of a large area a small share: it is told by its length, whichever way it runs.
#[test]
fn a_strip_of_lost_lines_is_told() {
    let large = [0.0, 0.0, 20.0, 20.0];
    let strip = |layers: &[Layer]| {
        let mut checks = told(layers).checks.into_iter();
        checks.find(|c| c.id == "bare-strip")
    };
    let without = |lines: f64, from: f64| {
        let to = 10.0 + 0.1 * lines;
        let rest = [
            [0.0, 0.0, 20.0, 10.0],
            [0.0, 10.0, from, to],
            [0.0, to, 20.0, 20.0],
        ];
        layer(&[(large, 1.0)], &rest)
    };
    assert_eq!(strip(&[without(1.0, 0.0)]), None);
    for lines in [2.0, 4.0] {
        let lost = without(lines, 0.0);
        assert!(passes(std::slice::from_ref(&lost)));
        let check = strip(&[lost]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        assert!((check.value.unwrap().value - 20.0).abs() < 0.5);
        let [_, y, _] = check.place.unwrap().position.unwrap();
        assert!((9.9..10.4).contains(&y), "{y}");
    }
    // a millimetre of it is no strip
    assert_eq!(strip(&[without(4.0, 19.0)]), None);
    let mut slant = layer(&[(large, 1.0)], &[]);
    for n in -200..200 {
        let x = 0.1 * 2.0_f64.sqrt() * f64::from(n);
        let head = PassHead {
            role: Role::Fill,
            ..PassHead::default()
        };
        let ends = [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 20.0, 20.0, 0.0)];
        if !(0..3).contains(&n) {
            slant.polyline(head, ends);
        }
    }
    let check = strip(&[slant]).unwrap();
    assert!(check.value.unwrap().value > 20.0);
}

/// A hatch that runs across, as one along: cells are looked for along each line alone.
#[test]
fn lines_across_fill_as_those_along() {
    let mut slant = layer(&[(WHOLE, 1.0)], &[]);
    for n in -60..100 {
        let x = 0.1 * 2.0_f64.sqrt() * f64::from(n);
        let head = PassHead {
            role: Role::Fill,
            ..PassHead::default()
        };
        let ends = [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 4.0, 4.0, 0.0)];
        slant.polyline(head, ends);
    }
    assert!(passes(&[slant]));
}

/// Holes of either way round are not to be filled, islands in them are; contours side by side are one boundary.
#[test]
fn what_contours_enclose_is_theirs_without_holes() {
    let hole = [1.0, 0.5, 5.0, 3.5];
    let frame = [
        [0.0, 0.0, 6.0, 0.5],
        [0.0, 3.5, 6.0, 4.0],
        [0.0, 0.5, 1.0, 3.5],
        [5.0, 0.5, 6.0, 3.5],
    ];
    for way in [1.0, -1.0] {
        assert!(passes(&[layer(&[(WHOLE, 1.0), (hole, way)], &frame)]));
    }
    let inner = [0.1, 0.1, 5.9, 3.9];
    let half = [[0.0, 0.0, 6.0, 2.0]];
    assert!(!passes(&[layer(&[(inner, 1.0), (WHOLE, 1.0)], &half)]));
    let island = [2.0, 1.0, 4.0, 3.0];
    let rings = [(WHOLE, 1.0), (hole, -1.0), (island, 1.0)];
    let areas: f64 = 24.0 - 12.0 + 4.0;
    let bounds = bounds_of(&layer(&rings, &[]));
    let cells = Cells::of(&bounds, 0.1).unwrap();
    let enclosed = cells.enclosed(&bounds);
    let count = enclosed.iter().filter(|c| **c).count() as f64;
    assert!((count * cells.edge * cells.edge - areas).abs() < 0.5);
    assert_eq!(cells.areas(&enclosed).len(), 2);
}

fn bounds_of(layer: &Layer) -> Vec<outline::Boundary> {
    boundaries(contours(layer, SPOT).rings, 0.1).all
}

/// A square of 4 mm that ends `gap` short of where it begins, half of it filled.
fn open(gap: f64) -> Layer {
    let mut layer = layer(&[], &[[0.0, 0.0, 4.0, 2.0]]);
    let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, gap]];
    let head = PassHead {
        role: Role::Contour,
        ..PassHead::default()
    };
    let points = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
    layer.polyline(head, points);
    layer
}

/// A contour that ends within the spot of where it begins encloses what it encloses; of one that does not nobody knows, and the place of the
/// opening is told. Lines that enclose nothing are no contours.
#[test]
fn contours_that_hardly_close_do_and_open_ones_are_told() {
    for gap in [0.002, 0.05] {
        let check = said(&[open(gap)]).unwrap();
        assert!((check.value.unwrap().value - 45.0).abs() < 3.0, "{gap}");
    }
    for gap in [0.2, 4.0] {
        let told = told(&[open(gap)]);
        let check = &told.checks[0];
        assert_eq!(check.status, Status::CannotSay, "{gap}");
        assert!(check.reason.contains("from where it begins"), "{check:?}");
        let at = check.place.as_ref().unwrap().position.unwrap();
        assert_eq!(at, [0.0, gap, 0.0]);
        let fill = Check::judge("f", "F", Measure::exact(99.0, "%"), Limit::AtLeast(90.0));
        let fill = told.doubt.unwrap().leaves_open(fill);
        assert_eq!(fill.status, Status::CannotSay);
    }
    let mut wall = layer(&[(WHOLE, 1.0)], &[WHOLE]);
    let head = PassHead {
        role: Role::Contour,
        ..PassHead::default()
    };
    let points = [[8.0, 0.0], [9.0, 0.0], [9.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    wall.polyline(head, points);
    assert!(
        told(&[wall])
            .checks
            .iter()
            .all(|c| c.status == Status::Pass)
    );
}

/// What two parts share is to be filled, whether they cross or one lies in the other; where one runs the other way round nobody knows.
#[test]
fn what_parts_share_is_no_hole() {
    let other = [4.0, 0.0, 10.0, 4.0];
    let apart = [[0.0, 0.0, 4.0, 4.0], [6.0, 0.0, 10.0, 4.0]];
    let check = said(&[layer(&[(WHOLE, 1.0), (other, 1.0)], &apart)]).unwrap();
    assert_eq!(check.status, Status::CannotSay);
    assert!((check.value.unwrap().value - 18.0).abs() < 2.0);
    let all = [[0.0, 0.0, 10.0, 4.0]];
    assert!(passes(&[layer(&[(WHOLE, 1.0), (other, 1.0)], &all)]));
    let unlike = told(&[layer(&[(WHOLE, 1.0), (other, -1.0)], &all)]);
    assert_eq!(unlike.checks[0].status, Status::CannotSay);
    assert!(unlike.checks[0].reason.contains("cross"), "{unlike:?}");
    // a body of its own in another one, which ends there
    let frame = [
        [0.0, 0.0, 6.0, 1.0],
        [0.0, 3.0, 6.0, 4.0],
        [0.0, 1.0, 2.0, 3.0],
        [4.0, 1.0, 6.0, 3.0],
    ];
    let mut within = layer(&[(WHOLE, 1.0)], &frame);
    assert!(!passes(std::slice::from_ref(&within)));
    let head = PassHead {
        part: 1,
        role: Role::Contour,
        ..PassHead::default()
    };
    let corners = [[2.0, 1.0], [4.0, 1.0], [4.0, 3.0], [2.0, 3.0], [2.0, 1.0]];
    let points = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
    within.polyline(head, points);
    assert!(!passes(&[within]));
    // a contour that comes twice
    let half = [[0.0, 0.0, 6.0, 2.0]];
    assert!(!passes(&[layer(&[(WHOLE, 1.0), (WHOLE, 1.0)], &half)]));
}

/// Lines across a hole, or beyond all contours.
#[test]
fn lines_where_nothing_is_enclosed_are_told() {
    let hole = [2.0, 1.0, 4.0, 3.0];
    let over = layer(&[(WHOLE, 1.0), (hole, -1.0)], &[WHOLE]);
    let beyond = layer(&[(WHOLE, 1.0)], &[[-1.0, 0.0, 7.0, 4.0]]);
    for (layer, longest, length, x) in [(over, 1.8, 32.0, 2.1), (beyond, 0.9, 72.0, -1.0)] {
        let told = told(&[layer]);
        let check = told.checks.iter().find(|c| c.id == "beside-contours");
        let check = check.unwrap();
        assert_eq!(check.status, Status::CannotSay);
        let value = check.value.as_ref().unwrap().value;
        assert!((value - longest).abs() < 0.11, "{value}");
        let at = check.place.as_ref().unwrap().position.unwrap();
        assert!((at[0] - x).abs() < 0.11, "{at:?}");
        let told: f64 = check.reason.split(' ').next().unwrap().parse().unwrap();
        assert!((told - length).abs() < 0.15 * length, "{}", check.reason);
    }
}
