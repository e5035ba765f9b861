//! Process maps: forward, inverse, what they refuse.
use std::fmt::Write as _;

use meltpath_base::Reporter;
use meltpath_deposition::consumable::Wire;
use meltpath_deposition::process_map::{ProcessMap, ProcessMapError, Target};
use proptest::prelude::*;

const M_PER_MIN: f64 = 1000.0 / 60.0;

fn seed() -> ProcessMap {
    ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap()
}

/// A table through the two beads of 6 x 1.8 mm that the thesis quotes for G3Si; the other nodes are made up.
const TWO_POINTS: &str = include_str!("../data/grid.toml");

fn table() -> ProcessMap {
    let wire = Wire::builtin("g3si-1.2").unwrap();
    ProcessMap::parse("table", TWO_POINTS, &wire, &Reporter::new()).unwrap()
}

/// Wire that goes in comes out: what the map calls a bead's area is the feed ratio times the wire's section, less losses.
#[test]
fn waam_ac3_area_from_conservation() {
    let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
    let lost = map.efficiency.0 * map.feed_factor.0;
    for (travel, area) in [(0.75, 8.378), (0.5, 12.566)] {
        let bead = map.bead(8.0 * M_PER_MIN, travel * M_PER_MIN);
        assert!((bead.area.value / lost - area).abs() < 1e-3);
    }
}

/// A bead at a node of the table answers from both of its sides: it is one bead all the same.
#[test]
fn a_node_is_one_answer() {
    let target = Target {
        wire_feed: Some(6.5 * M_PER_MIN),
        width: Some(6.4),
        ..Target::default()
    };
    let found = table().solve(&target).unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0].travel_speed / M_PER_MIN - 0.95).abs() < 1e-9);
}

/// A bead whose section is not that of the metal fed is told, a bead whose section is, is not.
#[test]
fn sections_that_are_not_the_metal_fed_are_told() {
    let told = |factor: f64| {
        let wire = Wire::builtin("g3si-1.2").unwrap();
        let text = TWO_POINTS
            .replace("value = 1.1", &format!("value = {factor}"))
            .replace("kind =", "accept = [\"more-than-fed\"]\nkind =");
        let reporter = Reporter::new();
        let map = ProcessMap::parse("table", &text, &wire, &Reporter::new()).unwrap();
        let bead = map.bead(6.5 * M_PER_MIN, 0.95 * M_PER_MIN);
        map.warn_about(&bead, &reporter);
        let off = 2.0 / 3.0 * bead.width.value * bead.height.value / bead.area.value - 1.0;
        let warned = reporter
            .warnings()
            .iter()
            .any(|w| w.code == "bead-mass-balance");
        assert_eq!(warned, off.abs() > 0.15, "{off}");
        warned
    };
    assert_eq!([0.82, 1.1].map(told), [true, false]);
}

#[test]
fn waam_ac9_equal_areas_along_a_feed_ratio() {
    let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
    let area = |travel: f64| {
        let bead = map.bead(8.0 * travel * M_PER_MIN, travel * M_PER_MIN);
        bead.area.value
    };
    for travel in [0.25, 0.5, 0.75, 1.0, 1.25] {
        assert!((area(travel) / area(0.75) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn waam_ac6_two_settings_make_one_bead_and_none_makes_another() {
    let target = Target {
        width: Some(6.0),
        height: Some(1.8),
        ..Target::default()
    };
    let found = table().solve(&target).unwrap();
    for (vf, vr) in [(4.4, 0.67), (8.5, 1.2)] {
        assert!(
            found
                .iter()
                .any(|b| (b.wire_feed / M_PER_MIN - vf).abs() < 1e-6
                    && (b.travel_speed / M_PER_MIN - vr).abs() < 1e-6),
            "({vf}, {vr}) in {found:?}"
        );
    }
    assert!(
        (found[0].wire_feed / M_PER_MIN - 8.5).abs() < 1e-6,
        "highest rate first"
    );
    let flat = Target {
        width: Some(12.0),
        height: Some(0.5),
        ..Target::default()
    };
    let error = table().solve(&flat).unwrap_err();
    let ProcessMapError::Unreachable {
        closest,
        width,
        height,
        ..
    } = &error
    else {
        panic!("{error}");
    };
    assert!(closest.valid);
    assert!((width.0 - 4.4).abs() < 0.05 && (width.1 - 9.0).abs() < 0.05);
    assert!((height.0 - 1.4).abs() < 0.05 && (height.1 - 2.5).abs() < 0.05);
    assert!(error.to_string().contains("closest"), "{error}");
}

#[test]
fn waam_ac6_iso_lines_pass_through_the_nodes() {
    let b = table().bead(6.5 * M_PER_MIN, 0.95 * M_PER_MIN);
    assert!((b.width.value - 6.4).abs() < 1e-12 && (b.height.value - 1.95).abs() < 1e-12);
    assert!(!table().bead(9.0 * M_PER_MIN, 0.95 * M_PER_MIN).valid);
}

#[test]
fn the_seed_gives_the_quoted_widths_with_its_band() {
    for (vf, vr, w) in [(8.0, 0.75, 6.54), (4.0, 0.75, 4.8)] {
        let b = seed().bead(vf * M_PER_MIN, vr * M_PER_MIN);
        assert!((b.width.value / w - 1.0).abs() < 0.005, "{}", b.width.value);
        assert!((b.width.sigma / b.width.value - 0.075).abs() < 1e-12);
    }
    // pool width ratio of table 3.3
    let narrow = seed().bead(8.0 * M_PER_MIN, 0.75 * M_PER_MIN).width.value;
    let wide = seed().bead(8.0 * M_PER_MIN, 0.5 * M_PER_MIN).width.value;
    assert!((wide / narrow / (8.28 / 7.2) - 1.0).abs() < 0.01);
}

#[test]
fn the_height_alone_takes_the_fastest_wire() {
    let target = Target {
        height: Some(1.9),
        ..Target::default()
    };
    let found = seed().solve(&target).unwrap();
    assert_eq!(found.len(), 1);
    assert!((found[0].height.value - 1.9).abs() < 1e-6);
    // nothing faster makes it
    let faster = Target {
        wire_feed: Some(found[0].wire_feed * 1.01),
        ..target
    };
    let possible = seed().solve(&faster);
    assert!(found[0].wire_feed / M_PER_MIN > 11.99 || possible.is_err());
    // a table may make it between its nodes only: above all of the first row, below all of the second
    let falling = TWO_POINTS
        .replace("kind =", "accept = [\"mass-balance\"]\nkind =")
        .replace("[1.8, 1.6, 1.4]", "[2.0, 1.9, 1.8]")
        .replace("[2.3, 1.95, 1.6]", "[1.5, 1.45, 1.4]")
        .replace("[2.5, 2.1, 1.8]", "[1.2, 1.15, 1.1]");
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let map = ProcessMap::parse("table", &falling, &wire, &Reporter::new()).unwrap();
    let between = Target {
        height: Some(1.65),
        ..Target::default()
    };
    let found = map.solve(&between).unwrap();
    assert!((found[0].wire_feed / M_PER_MIN - 5.87).abs() < 1e-6);
    assert!((found[0].travel_speed / M_PER_MIN - 0.67).abs() < 1e-6);
}

#[test]
fn where_a_table_is_plane_the_settings_are_those_it_was_made_from() {
    // width = 4 + 0.5 V_f - 2 V_r, height = 1.5 + 0.1 V_f - V_r
    let plane = TWO_POINTS
        .replace("kind =", "accept = [\"mass-balance\"]\nkind =")
        .replace("[6.0, 5.1, 4.4]", "[4.86, 4.3, 3.8]")
        .replace("[7.5, 6.4, 5.3]", "[5.91, 5.35, 4.85]")
        .replace("[9.0, 7.2, 6.0]", "[6.91, 6.35, 5.85]")
        .replace("[1.8, 1.6, 1.4]", "[1.27, 0.99, 0.74]")
        .replace("[2.3, 1.95, 1.6]", "[1.48, 1.2, 0.95]")
        .replace("[2.5, 2.1, 1.8]", "[1.68, 1.4, 1.15]");
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let map = ProcessMap::parse("table", &plane, &wire, &Reporter::new()).unwrap();
    let target = Target {
        width: Some(5.5),
        height: Some(1.2),
        ..Target::default()
    };
    let found = map.solve(&target).unwrap();
    assert_eq!(found.len(), 1);
    assert!((found[0].wire_feed / M_PER_MIN - 7.0).abs() < 1e-6);
    assert!((found[0].travel_speed / M_PER_MIN - 1.0).abs() < 1e-6);
}

#[test]
fn what_is_missing_or_senseless_is_told() {
    let seed = seed();
    let none = seed.solve(&Target::default()).unwrap_err();
    assert!(matches!(none, ProcessMapError::Underspecified { .. }));
    let three = Target {
        wire_feed: Some(100.0),
        travel_speed: Some(10.0),
        width: Some(6.0),
        height: None,
    };
    assert!(matches!(
        seed.solve(&three),
        Err(ProcessMapError::Underspecified { .. })
    ));
    let width_only = Target {
        width: Some(6.0),
        ..Target::default()
    };
    assert!(matches!(
        seed.solve(&width_only),
        Err(ProcessMapError::Underspecified { .. })
    ));
    let negative = Target {
        wire_feed: Some(-1.0),
        travel_speed: Some(10.0),
        ..Target::default()
    };
    assert!(matches!(
        seed.solve(&negative),
        Err(ProcessMapError::Value {
            what: "wire_feed",
            ..
        })
    ));
    let tall = Target {
        wire_feed: Some(8.0 * M_PER_MIN),
        height: Some(9.0),
        ..Target::default()
    };
    let error = seed.solve(&tall).unwrap_err().to_string();
    assert!(error.contains("with the value given"), "{error}");
    let reporter = Reporter::new();
    let out = seed.bead(20.0 * M_PER_MIN, 1.0 * M_PER_MIN);
    seed.warn_about(&out, &reporter);
    assert_eq!(reporter.warnings()[0].code, "outside-process-map");
}

#[test]
fn files_that_do_not_read_are_refused_at_their_place() {
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let reporter = Reporter::new();
    for (from, to) in [
        ("schema = 1", "schema = 2"),
        ("4.4, 6.5, 8.5", "4.4, 8.5, 6.5"),
        ("[6.0, 5.1, 4.4]", "[6.0, 5.1]"),
        ("mode = \"cmt\"", "mode = \"cmt\"\ncolour = \"red\""),
        ("value = 1.1", "value = 0.0"),
        ("\"12 m/min\"", "\"12\""),
    ] {
        assert!(TWO_POINTS.contains(from), "{from}");
        let text = TWO_POINTS.replace(from, to);
        let error = ProcessMap::parse("mine.toml", &text, &wire, &reporter).unwrap_err();
        let ProcessMapError::Content(problems) = error else {
            panic!("{from}: {error}")
        };
        let span = problems.0[0].span.clone().unwrap();
        let (a, b) = (text.find(to).unwrap(), text.find(to).unwrap() + to.len());
        assert!(span.start < b && span.end > a, "{from}: {span:?}");
    }
}

#[test]
fn a_quadratic_map_reads_and_turns_round() {
    let mut rows = String::new();
    for vf in [2.0f64, 4.0, 6.0, 8.0, 10.0] {
        for vr in [0.5f64, 1.0, 1.5] {
            let w = 2.0 + 0.7 * vf - 1.5 * vr - 0.01 * vf * vf + 0.4 * vr * vr - 0.1 * vf * vr;
            let h = 1.5 * 1.1 * 1.131 * vf / vr / w;
            let _ = write!(rows, "[{vf}, {vr}, {w}, {h}],");
        }
    }
    let head = TWO_POINTS
        .split("[grid]")
        .next()
        .unwrap()
        .replace("\"grid\"", "\"surface\"");
    let head = head.replace("kind =", "accept = [\"taller-than-wide\"]\nkind =");
    let text = format!("{head}[beads]\nsource = \"test\"\npage = \"-\"\nrows = [{rows}]\n");
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let map = ProcessMap::parse("s", &text, &wire, &Reporter::new()).unwrap();
    let b = map.bead(6.0 * M_PER_MIN, 1.0 * M_PER_MIN);
    let target = Target {
        width: Some(b.width.value),
        wire_feed: Some(b.wire_feed),
        ..Target::default()
    };
    let back = map.solve(&target).unwrap();
    assert!(
        back.iter()
            .any(|c| (c.travel_speed / b.travel_speed - 1.0).abs() < 1e-6)
    );
    assert!(map.width_exponent(b.wire_feed, b.travel_speed) > 0.0);
}

proptest! {
    #[test]
    fn waam_ac6_the_inverse_of_an_interior_point_returns_it(s in 0.02f64..0.98, t in 0.02f64..0.98) {
        for map in [seed(), table()] {
            let (f, r) = if map.id == "two-points" { ((4.4, 8.5), (0.67, 1.2)) } else { ((2.0, 12.0), (0.25, 1.5)) };
            let b = map.bead((f.0 + s * (f.1 - f.0)) * M_PER_MIN, (r.0 + t * (r.1 - r.0)) * M_PER_MIN);
            for target in [
                Target { width: Some(b.width.value), height: Some(b.height.value), ..Target::default() },
                Target { wire_feed: Some(b.wire_feed), height: Some(b.height.value), ..Target::default() },
                Target { travel_speed: Some(b.travel_speed), width: Some(b.width.value), ..Target::default() },
            ] {
                let found = map.solve(&target).unwrap();
                prop_assert!(found.iter().any(|c| (c.wire_feed / b.wire_feed - 1.0).abs() < 1e-6
                    && (c.travel_speed / b.travel_speed - 1.0).abs() < 1e-6), "{:?} {:?} {:?}", map.id, target, found);
                for c in found {
                    prop_assert!((c.width.value / b.width.value - 1.0).abs() < 1e-6 || target.width.is_none());
                    prop_assert!((c.height.value / b.height.value - 1.0).abs() < 1e-6 || target.height.is_none());
                }
            }
        }
    }
}

#[test]
fn a_measured_feed_factor_makes_the_bead_of_that_feed() {
    let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
    let own = map.clone().with_feed_factor(2.0 * map.feed_factor.0);
    let (feed, travel) = (4000.0 / 60.0, 12.5);
    let (a, b) = (own.bead(feed, travel), map.bead(2.0 * feed, travel));
    assert!((a.width.value - b.width.value).abs() < 1e-9);
    assert!((a.area.value - b.area.value).abs() < 1e-9);
    assert!((a.height.value - b.height.value).abs() < 1e-9);
    // what is measured is no longer uncertain: 7.5 % less the 6.1 % of the feed factor
    let sigma = a.area.sigma / a.area.value;
    assert!((sigma - 0.044).abs() < 0.001, "{sigma}");
    assert!(own.feed_factor.uncertainty.is_none());
    // the answer of the source is around the feed that is delivered
    let (r, s) = (
        own.response(feed, None).unwrap(),
        map.response(feed, None).unwrap(),
    );
    assert!((2.0 * r.slope / s.slope - 1.0).abs() < 1e-9);
    assert!(map.response(feed, Some(0.0)).unwrap().ratio(5.0) == 1.0);
}

/// A grid of two by two nodes leaves nothing over to check it by: it needs a deviation that somebody states.
#[test]
fn a_grid_without_nodes_to_spare_needs_a_stated_deviation() {
    let small = TWO_POINTS.split("[grid]").next().unwrap().to_owned()
        + "[grid]\nwire_feed = [4.4, 8.5]\ntravel_speed = [0.67, 1.2]\nwidth = [[6.0, 4.4], [9.0, 6.0]]\n"
        + "height = [[1.8, 1.4], [2.5, 1.8]]\nsource = \"test\"\npage = \"-\"\n";
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let read = |text: &str| ProcessMap::parse("small", text, &wire, &Reporter::new());
    let map = read(&small).unwrap();
    let settings = (8.5 * M_PER_MIN, 0.67 * M_PER_MIN);
    let width = map.bead(settings.0, settings.1).width;
    assert!((width.value - 9.0).abs() < 1e-9, "{width:?}");
    assert!((width.sigma / width.value - 0.05).abs() < 0.03, "{width:?}");
    let bare: String = small
        .lines()
        .filter(|l| !l.starts_with("relative_sigma"))
        .fold(String::new(), |all, line| all + line + "\n")
        .replace("value = 1.1", "uncertainty = 0.03, value = 1.1");
    let told = read(&bare).unwrap_err().to_string();
    assert!(told.contains("two by two nodes"), "{told}");
}

const LEANING: &str = "\n[tilt]\nrows = [[6.0, 90.0], [12.0, 45.0], [9.0, 30.0]]\nsource = \"own beads\"\npage = \"3\"\n";

/// A pool stays where one as large or larger did; of larger ones than any nothing is known, and without the table of none.
#[test]
fn a_pool_leans_as_far_as_larger_ones_did() {
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let text = format!("{TWO_POINTS}{LEANING}");
    let map = ProcessMap::parse("mine", &text, &wire, &Reporter::new()).unwrap();
    let degrees = |area: f64| map.greatest_tilt(area).map(f64::to_degrees);
    let near = |area: f64, wanted: f64| {
        let found = degrees(area).unwrap();
        assert!((found - wanted).abs() < 1e-9, "{area}: {found}");
    };
    near(5.0, 90.0);
    near(6.0, 90.0);
    // one of 9 mm² was seen at 30 deg alone, but a larger one at 45
    near(6.1, 45.0);
    near(9.0, 45.0);
    near(12.0, 45.0);
    assert_eq!(degrees(12.1), None);
    assert_eq!(table().greatest_tilt(1.0), None);
    for (from, to) in [
        ("45.0]", "190.0]"),
        ("[[6.0, 90.0], [12.0, 45.0], [9.0, 30.0]]", "[]"),
    ] {
        let text = text.replace(from, to);
        let error = ProcessMap::parse("mine", &text, &wire, &Reporter::new()).unwrap_err();
        assert!(matches!(error, ProcessMapError::Content(_)), "{error}");
    }
}
