//! The distance of the contact tube from the work: by place and time, against the job's limits and against the distances at which
//! the wire feed was measured.

use std::collections::BTreeMap;

use meltpath_base::quantity::Auto;
use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};

use meltpath_deposition::deposit::TubeDistance;

use crate::waam::judge::worst::worst;
use crate::waam::judge::{GrowthError, LayerOutcome, TubePlace};
use crate::waam::settings::Settings;

/// Checks of every simulated sample: nearest and farthest contact tube, and whether the wire feed is known there.
pub(in crate::waam) fn checks(
    layers: &[LayerOutcome],
    ctwd: &[TubePlace],
    growth: &GrowthError,
    settings: &Settings,
) -> Vec<Check> {
    let limits = &settings.limits;
    let mut checks: Vec<Check> = [
        (End::Nearest, Limit::AtLeast(limits.ctwd_min)),
        (End::Farthest, Limit::AtMost(limits.ctwd_max)),
    ]
    .into_iter()
    .filter_map(|(end, limit)| local(layers, growth, end, limit))
    .map(|check| check.remedy(remedy(settings)))
    .collect();
    checks.extend(known(ctwd, settings));
    checks
}

/// Whether the wire's tip stays over the simulated metal, and over the plate, on travels.
pub(in crate::waam) fn travels(passed: &[TubeDistance], growth: &GrowthError) -> Option<Check> {
    let limit = Limit::AtLeast(0.0);
    let measured = passed.iter().map(|p| {
        let sigma = growth.at(p.tool.z - p.distance);
        (p, Measure::new(p.distance, sigma, "mm"))
    });
    let (least, distance) = worst(measured, limit)?;
    let check = Check::judge(
        "travels",
        "travels: least height of the wire's tip over the simulated metal and the plate",
        distance,
        limit,
    );
    let check = check.at(Place::at(least.tool.to_array()));
    Some(
        check
            .because(&at(least.time))
            .remedy("a greater clearance in the cell file, or layers.height as the build grows"),
    )
}

/// What brings the contact tube back.
fn remedy(settings: &Settings) -> &'static str {
    match settings.heights {
        Auto::Auto => {
            "a machine.ctwd farther from the limit; at single places another fill.strategy, or thicker walls below it"
        }
        Auto::Value(_) => {
            "write layers.height = \"auto\": the layer height is not the growth of the wall"
        }
    }
}

/// Which end of the distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Nearest,
    Farthest,
}

impl End {
    /// That end of a layer.
    fn of(self, layer: &LayerOutcome) -> Option<TubePlace> {
        layer.tube.map(|tube| tube[self as usize])
    }
}

/// One end of the distances against its limit.
fn local(layers: &[LayerOutcome], growth: &GrowthError, end: End, limit: Limit) -> Option<Check> {
    // the surface under layer n is layer n-1: its height carries the uncertainty
    let tops = layers
        .iter()
        .map(|b| (b.layer + 1, b.mean_top.unwrap_or(b.planned_top)));
    let below: BTreeMap<u32, f64> = tops.collect();
    let measured = layers.iter().filter_map(|l| {
        let place = end.of(l)?;
        let sigma = growth.at(below.get(&l.layer).copied().unwrap_or(0.0));
        Some((place, Measure::new(place.at.distance, sigma, "mm")))
    });
    let (found, value) = worst(measured, limit)?;
    let (id, title) = match end {
        End::Nearest => ("ctwd-min", "nearest contact tube to work distance"),
        End::Farthest => ("ctwd-max", "farthest contact tube to work distance"),
    };
    let beyond = |l: &LayerOutcome| {
        end.of(l).is_some_and(|p| match limit {
            Limit::AtLeast(bound) => p.at.distance < bound,
            Limit::AtMost(bound) => p.at.distance > bound,
        })
    };
    let mut check = Check::judge(id, title, value, limit)
        .at(place(&found))
        .because(&at(found.at.time));
    if let Some(first) = layers.iter().find(|l| beyond(l)) {
        check = check.because(&format!("critical from layer {} on", first.layer));
    }
    Some(check)
}

/// Points of a bead this near to one another, mm, belong to one stretch.
const NEXT: f64 = 2.0;

/// A stretch of bead whose contact tube is outside some distances.
struct Stretch {
    /// mm.
    length: f64,
    /// Where it is farthest outside.
    worst: TubePlace,
}

/// The longest stretch of bead outside the distances `least` to `greatest`; `None` where all beads lie within.
fn longest_outside(ctwd: &[TubePlace], least: f64, greatest: f64) -> Option<Stretch> {
    let off = |p: &TubePlace| (least - p.at.distance).max(p.at.distance - greatest);
    let joined = |a: &TubePlace, b: &TubePlace| {
        off(a) > 0.0 && off(b) > 0.0 && a.at.tool.distance(b.at.tool) <= NEXT
    };
    let stretches = ctwd.chunk_by(joined).filter_map(|points| {
        let worst = points.iter().max_by(|a, b| off(a).total_cmp(&off(b)))?;
        let length = |w: &[TubePlace]| w[0].at.tool.distance(w[1].at.tool);
        (off(worst) > 0.0).then(|| Stretch {
            length: points.windows(2).map(length).sum(),
            worst: *worst,
        })
    });
    stretches.max_by(|a, b| a.length.total_cmp(&b.length))
}

/// Whether the feed of the wire is known wherever metal is laid: of a stretch of bead longer than the pool, which levels what is
/// shorter, nothing can be said outside the distances at which the feed was measured.
fn known(ctwd: &[TubePlace], settings: &Settings) -> Option<Check> {
    const ID: &str = "ctwd-known";
    const TITLE: &str =
        "longest stretch of bead at contact tube distances where the wire feed was not measured";
    let first = ctwd.first()?;
    let Some(measured) = &settings.map.feed_response else {
        let why = format!(
            "the process map {} does not say at which contact tube distances its wire feed is known",
            settings.map.id
        );
        let check = Check {
            status: Status::CannotSay,
            ..Check::not_checked(ID, TITLE, &why)
        };
        return Some(check.remedy("measure the wire feed at two distances and add a table [feed_response] to the process map; slope 0 for a source that holds its feed"));
    };
    let (least, greatest) = (measured.least.0, measured.greatest.0);
    let beyond = settings.limits.ctwd_beyond;
    let found = longest_outside(ctwd, least - beyond, greatest + beyond);
    let length = found.as_ref().map_or(0.0, |s| s.length);
    let pool = settings.pool.length();
    let check = Check::judge(ID, TITLE, Measure::exact(length, "mm"), Limit::AtMost(pool));
    let status = match check.status {
        Status::Fail => Status::CannotSay,
        other => other,
    };
    let outside = |p: &&TubePlace| !(least - beyond..=greatest + beyond).contains(&p.at.distance);
    let share = 100.0 * ctwd.iter().filter(outside).count() as f64 / ctwd.len() as f64;
    let worst = found.map_or(*first, |s| s.worst);
    let farthest = if length > 0.0 {
        format!("{:.1} mm {}; ", worst.at.distance, at(worst.at.time))
    } else {
        String::new()
    };
    let reason = format!(
        "{farthest}measured from {least:.1} to {greatest:.1} mm, taken to hold {beyond:.1} mm beyond; {share:.1} % of the beads lie outside, as layers are predicted to grow"
    );
    let check = Check {
        status,
        reason,
        ..check
    };
    let check = if length > 0.0 {
        check.at(place(&worst))
    } else {
        check
    };
    Some(check.remedy(format!(
        "{}; or measure the wire feed at that distance, and extend [feed_response] of the process map",
        remedy(settings)
    )))
}

/// How distances are distributed along the beads.
pub(in crate::waam) fn distribution(
    layers: &[LayerOutcome],
    mut distances: Vec<f64>,
) -> Option<Fact> {
    distances.sort_unstable_by(f64::total_cmp);
    let last = distances.len().checked_sub(1)?;
    let at = |share: f64| distances[(last as f64 * share).round() as usize];
    let all = |end: End| {
        layers
            .iter()
            .filter_map(move |l| Some(end.of(l)?.at.distance))
    };
    let near = all(End::Nearest).min_by(f64::total_cmp)?;
    let far = all(End::Farthest).max_by(f64::total_cmp)?;
    let words = format!(
        "along half of the beads; {:.1} to {:.1} mm along nine tenths, {:.1} to {:.1} mm in all",
        at(0.05),
        at(0.95),
        near,
        far
    );
    let title = "contact tube to work distance";
    Some(Fact::new(
        "ctwd",
        title,
        Measure::exact(at(0.5), "mm"),
        &words,
    ))
}

fn place(found: &TubePlace) -> Place {
    Place {
        layer: Some(found.layer),
        bead: found.bead,
        ..Place::at(found.at.tool.to_array())
    }
}

/// A time of the run, for people.
fn at(time: f64) -> String {
    let whole = time.round().max(0.0);
    format!(
        "at {:.0} min {:02.0} s",
        (whole / 60.0).floor(),
        whole % 60.0
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_deposition::deposit::TubeDistance;
    use meltpath_geometry::math::DVec3;

    fn growth(share: f64) -> GrowthError {
        GrowthError {
            share,
            response: None,
        }
    }

    fn tube(layer: u32, distance: f64, x: f64) -> TubePlace {
        TubePlace {
            at: TubeDistance {
                distance,
                tool: DVec3::new(x, 0.0, 5.0),
                time: 192.0,
                command: 3,
            },
            layer,
            bead: Some(9),
        }
    }

    /// A wall programmed 1.2 mm a layer that grows 1.65: its layers, nearer and nearer.
    fn drifting_wall() -> Vec<LayerOutcome> {
        (1..=25)
            .map(|n| LayerOutcome {
                layer: n,
                planned_top: 1.2 * f64::from(n),
                mean_top: Some(1.65 * f64::from(n)),
                tube: Some([15.0, 15.0].map(|d| tube(n, d - 0.45 * f64::from(n - 1), 10.0))),
                ..LayerOutcome::default()
            })
            .collect()
    }

    #[test]
    fn a_drifting_wall_fails_on_its_contact_tube() {
        let limit = Limit::AtLeast(8.0);
        let check = local(&drifting_wall(), &growth(0.05), End::Nearest, limit).unwrap();
        assert_eq!(check.status, Status::Fail);
        assert!(
            check.reason.contains("critical from layer 17 on"),
            "{}",
            check.reason
        );
        assert!(check.reason.contains("at 3 min 12 s"), "{}", check.reason);
        let place = check.place.unwrap();
        assert_eq!((place.layer, place.bead), (Some(25), Some(9)));
        assert_eq!(place.position, Some([10.0, 0.0, 5.0]));
        // an uncertain map cannot say
        let check = local(&drifting_wall(), &growth(0.5), End::Nearest, limit).unwrap();
        assert_eq!(check.status, Status::CannotSay);
    }

    /// One place out of reach in a layer whose mean is far from it.
    #[test]
    fn a_single_place_beyond_the_gas_cover_fails() {
        let mut layers = drifting_wall();
        for layer in &mut layers {
            (layer.ctwd_mean, layer.tube) =
                (15.0, Some([15.0, 15.0].map(|d| tube(layer.layer, d, 10.0))));
        }
        let limit = Limit::AtMost(20.0);
        let check = local(&layers, &growth(0.0), End::Farthest, limit).unwrap();
        assert_eq!(check.status, Status::Pass);
        layers[3].tube = Some([tube(4, 15.0, 10.0), tube(4, 28.0, 70.0)]);
        let check = local(&layers, &growth(0.0), End::Farthest, limit).unwrap();
        assert_eq!(check.status, Status::Fail);
        let place = check.place.unwrap();
        assert_eq!((place.layer, place.position.unwrap()[0]), (Some(4), 70.0));
    }

    /// Two beads that are each too far over a part of their length: the longer stretch counts, not both together.
    #[test]
    fn the_longest_stretch_outside_is_found() {
        let bead = |y: f64, far: std::ops::Range<u32>| {
            (0..80).map(move |k| {
                let distance = if far.contains(&k) {
                    16.0 + 0.01 * f64::from(k)
                } else {
                    14.0
                };
                let mut place = tube(2, distance, 0.5 * f64::from(k));
                place.at.tool.y = y;
                place
            })
        };
        let all: Vec<TubePlace> = bead(0.0, 10..31).chain(bead(9.0, 70..80)).collect();
        let found = longest_outside(&all, 5.0, 15.5).unwrap();
        assert!((found.length - 10.0).abs() < 1e-12, "{}", found.length);
        assert_eq!(found.worst.at.tool.x, 15.0);
        assert!(longest_outside(&all, 5.0, 17.0).is_none());
    }
}
