//! The distance of the contact tube from the work: by place and time, against the job's limits and against the distances at which
//! the wire feed was measured.

use meltpath_base::quantity::Auto;
use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};

use super::judge::{GrowthError, LayerOutcome, TubePlace};
use super::settings::Settings;
use super::simulate::CtwdPoint;

/// Checks of every simulated sample: nearest and farthest contact tube, and whether the wire feed is known there.
pub(super) fn checks(
    layers: &[LayerOutcome],
    ctwd: &[CtwdPoint],
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
    checks.extend(known(layers, ctwd, settings));
    checks
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

    /// The layer that holds that end of the build.
    fn worst(self, layers: &[LayerOutcome]) -> Option<(&LayerOutcome, TubePlace)> {
        let all = layers.iter().filter_map(|l| Some((l, self.of(l)?)));
        let order = |a: &TubePlace, b: &TubePlace| a.at.distance.total_cmp(&b.at.distance);
        match self {
            End::Nearest => all.min_by(|a, b| order(&a.1, &b.1)),
            End::Farthest => all.max_by(|a, b| order(&a.1, &b.1)),
        }
    }
}

/// One end of the distances against its limit.
fn local(layers: &[LayerOutcome], growth: &GrowthError, end: End, limit: Limit) -> Option<Check> {
    let (layer, found) = end.worst(layers)?;
    // the surface under layer n is layer n-1: its height carries the uncertainty
    let below = layers.iter().find(|b| b.layer + 1 == layer.layer);
    let sigma = growth.at(below.map_or(0.0, |b| b.mean_top.unwrap_or(b.planned_top)));
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
    let value = Measure::new(found.at.distance, sigma, "mm");
    let mut check = Check::judge(id, title, value, limit)
        .at(place(layer, &found))
        .because(&at(found.at.time));
    if let Some(first) = layers.iter().find(|l| beyond(l)) {
        check = check.because(&format!("critical from layer {} on", first.layer));
    }
    Some(check)
}

/// Whether the feed of the wire is known wherever metal is laid: beyond the distances at which it was measured nothing can be said.
fn known(layers: &[LayerOutcome], ctwd: &[CtwdPoint], settings: &Settings) -> Option<Check> {
    const ID: &str = "ctwd-known";
    const TITLE: &str = "contact tube beyond the distances at which the wire feed was measured";
    let (near, far) = (End::Nearest.worst(layers)?, End::Farthest.worst(layers)?);
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
    let (nearer, farther) = (least - near.1.at.distance, far.1.at.distance - greatest);
    let (layer, found) = if nearer > farther { near } else { far };
    let outside = |d: f64| d < least || d > greatest;
    let count = ctwd.iter().filter(|(_, d)| outside(*d)).count();
    let share = 100.0 * count as f64 / ctwd.len().max(1) as f64;
    let check = Check::judge(
        ID,
        TITLE,
        Measure::exact(nearer.max(farther).max(0.0), "mm"),
        Limit::AtMost(settings.limits.ctwd_beyond),
    );
    let status = match check.status {
        Status::Fail => Status::CannotSay,
        other => other,
    };
    let reason = format!(
        "{:.1} mm {}; measured from {least:.1} to {greatest:.1} mm, {share:.1} % of the beads lie outside",
        found.at.distance,
        at(found.at.time)
    );
    let check = Check {
        status,
        reason,
        ..check
    };
    Some(check.at(place(layer, &found)).remedy(format!(
        "{}; or measure the wire feed at that distance, and extend [feed_response] of the process map",
        remedy(settings)
    )))
}

/// How distances are distributed along the beads.
pub(super) fn distribution(layers: &[LayerOutcome], mut distances: Vec<f64>) -> Option<Fact> {
    distances.sort_unstable_by(f64::total_cmp);
    let last = distances.len().checked_sub(1)?;
    let at = |share: f64| distances[(last as f64 * share).round() as usize];
    let (near, far) = (
        End::Nearest.worst(layers)?.1,
        End::Farthest.worst(layers)?.1,
    );
    let words = format!(
        "along half of the beads; {:.1} to {:.1} mm along nine tenths, {:.1} to {:.1} mm in all",
        at(0.05),
        at(0.95),
        near.at.distance,
        far.at.distance
    );
    let title = "contact tube to work distance";
    Some(Fact::new(
        "ctwd",
        title,
        Measure::exact(at(0.5), "mm"),
        &words,
    ))
}

fn place(layer: &LayerOutcome, found: &TubePlace) -> Place {
    Place {
        layer: Some(layer.layer),
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

    fn tube(distance: f64, x: f64) -> TubePlace {
        TubePlace {
            at: TubeDistance {
                distance,
                tool: DVec3::new(x, 0.0, 5.0),
                time: 192.0,
                command: 3,
            },
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
                tube: Some([15.0, 15.0].map(|d| tube(d - 0.45 * f64::from(n - 1), 10.0))),
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
            (layer.ctwd_mean, layer.tube) = (15.0, Some([15.0, 15.0].map(|d| tube(d, 10.0))));
        }
        let limit = Limit::AtMost(20.0);
        let check = local(&layers, &growth(0.0), End::Farthest, limit).unwrap();
        assert_eq!(check.status, Status::Pass);
        layers[3].tube = Some([tube(15.0, 10.0), tube(28.0, 70.0)]);
        let check = local(&layers, &growth(0.0), End::Farthest, limit).unwrap();
        assert_eq!(check.status, Status::Fail);
        let place = check.place.unwrap();
        assert_eq!((place.layer, place.position.unwrap()[0]), (Some(4), 70.0));
    }
}
