//! The bead that a wire-arc job asks for: its settings, its layers, what the source feeds.

use std::ops::RangeInclusive;

use meltpath_base::quantity::{Auto, Quantity};
use meltpath_base::settings::{Datum, Problem, Setting};
use meltpath_base::{Length, Origin, Provenance, Reporter, Resolved, Speed};
use meltpath_deposition::feed_response::FeedResponse;
use meltpath_deposition::process_map::{Bead, ProcessMap, Target};

use crate::job::waam::{BeadTable, FeedResponseChoice, LayerHeights, SourceTable};

/// m/min per mm/s.
pub(in crate::waam) const PER_MINUTE: f64 = 0.06;

/// A free edge of the metal lies this share of the bead's width outside its axis: walls are 0.9 widths wide (Rouchon 2022,
/// § 4.4).
pub(in crate::waam) const FREE_EDGE: f64 = 0.45;

/// How many times beyond the range of its process map a bead is extrapolated, with a warning, before it is refused.
const FURTHEST: f64 = 2.0;

/// Thinnest and thickest layer, in heights of a single bead: below, the plan is hundreds of layers that no bead can make;
/// above, the beads never meet.
const THINNEST: f64 = 0.1;
const THICKEST: f64 = 3.0;

/// A number of a data file with its source.
pub(in crate::waam) fn datum<Q: Quantity, T>(d: &Datum<Q>, unit: impl Fn(f64) -> T) -> Resolved<T> {
    let note = d
        .note
        .as_ref()
        .map_or_else(String::new, |n| format!(": {n}"));
    Resolved {
        value: unit(d.number()),
        origin: Origin::Data(format!("{}, {}{note}", d.source, d.page)),
        sigma: d.uncertainty.map(unit),
    }
}

/// A value in a unit that no key has.
pub(in crate::waam) fn with_unit(resolved: Resolved<f64>, unit: &str) -> Resolved<String> {
    let shown = |number: f64| format!("{number} {unit}");
    Resolved {
        value: shown(resolved.value),
        origin: resolved.origin,
        sigma: resolved.sigma.map(shown),
    }
}

/// What the source feeds at other contact tube distances: on where the process map knows, for wire, gas and mode.
pub(in crate::waam) fn feed_response(
    r: &mut Provenance,
    source: &SourceTable,
    map: &ProcessMap,
    wire_feed: f64,
    reporter: &Reporter,
) -> Option<FeedResponse> {
    let name = &source.feed_response.name;
    if *source.feed_response == FeedResponseChoice::Off {
        return None;
    }
    let stabiliser = source.penetration_stabiliser.map(|s| s.0);
    let Some(measured) = &map.feed_response else {
        if stabiliser.is_some_and(|s| s > 0.0) {
            reporter.warn(
                "feed-response-unknown",
                format!("the process map {} does not say what the source feeds at other contact tube distances: the penetration stabiliser is left out", map.id),
                "measure the wire feed on the first and on a high layer of a wall, and add a table [feed_response] to the map",
            );
        }
        let why = "not measured for this wire, gas and mode".to_owned();
        r.value(name, Resolved::new("off", Origin::Default(why)));
        return None;
    };
    let slope = datum(&measured.slope, |slope| slope);
    r.value(name, Resolved::new("on", slope.origin.clone()));
    r.value("waam.source.feed_slope", with_unit(slope, "m/min per mm"));
    r.value(
        "waam.source.feed_reference_ctwd",
        datum(&measured.reference, Length),
    );
    let band = datum(&measured.stabiliser, |per_minute| {
        Speed(per_minute / PER_MINUTE)
    });
    source
        .penetration_stabiliser
        .or_from(r, band.value, band.origin);
    map.response(wire_feed, stabiliser)
}

/// The bead of the settings that are given; in the middle of the map where none are.
pub(in crate::waam) fn solve_bead(
    given: &Setting<BeadTable>,
    map: &ProcessMap,
) -> Result<Bead, Problem> {
    let mut target = Target {
        wire_feed: given.wire_feed.map(|v| v.0),
        travel_speed: given.travel_speed.map(|v| v.0),
        width: given.width.map(|v| v.0),
        height: given.height.map(|v| v.0),
    };
    if target == Target::default() {
        let middle = |(low, high): (f64, f64)| Some(0.5 * (low + high) / PER_MINUTE);
        target.wire_feed = middle(map.validity.wire_feed);
        target.travel_speed = middle(map.validity.travel_speed);
    }
    let beads = map
        .solve(&target)
        .map_err(|e| given.problem(e.to_string()))?;
    let none = || given.problem("the process map has no bead for these values");
    let bead = beads.first().copied().ok_or_else(none)?;
    let v = &map.validity;
    let far = |speed: f64, (low, high): (f64, f64)| {
        !(low / FURTHEST..=high * FURTHEST).contains(&(speed * PER_MINUTE))
    };
    if far(bead.wire_feed, v.wire_feed) || far(bead.travel_speed, v.travel_speed) {
        let message = format!(
            "the map \"{}\" cannot make a bead of {:.2} m/min wire feed at {:.3} m/min travel: it knows {} to {} m/min by {} to {} m/min, and {FURTHEST} times beyond that nothing can be said",
            map.id,
            bead.wire_feed * PER_MINUTE,
            bead.travel_speed * PER_MINUTE,
            v.wire_feed.0,
            v.wire_feed.1,
            v.travel_speed.0,
            v.travel_speed.1
        );
        return Err(given.problem(message).help(
            "choose settings inside the map, or measure beads there and name that map: map = \"my-map.toml\"",
        ));
    }
    Ok(bead)
}

/// Heights of layers that a bead can make, mm.
pub(in crate::waam) fn buildable(bead: &Bead) -> RangeInclusive<f64> {
    let h = bead.height.value;
    THINNEST * h..=THICKEST * h
}

/// Refuses layers that no such bead can make.
pub(in crate::waam) fn check_heights(
    heights: &Setting<Auto<LayerHeights>>,
    bead: &Bead,
) -> Result<(), Problem> {
    let Auto::Value(list) = &**heights else {
        return Ok(());
    };
    let h = bead.height.value;
    let buildable = buildable(bead);
    let (least, most) = (buildable.start(), buildable.end());
    match list.iter().map(|l| l.0).find(|l| !buildable.contains(l)) {
        None => Ok(()),
        Some(bad) => {
            let message = format!(
                "layers.height {bad} mm cannot be built with a bead {h:.2} mm high: between {least:.2} and {most:.2} mm could"
            );
            Err(heights
                .problem(message)
                .help("write height = \"auto\", or choose another bead"))
        }
    }
}
