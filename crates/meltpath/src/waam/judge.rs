//! The verdict of a wire-arc build: predicted values against the job's limits, each with its uncertainty.

pub(crate) mod checks;
pub(crate) mod doubt;
mod energy;
pub(crate) mod facts;
pub(crate) mod feet;
pub(crate) mod worst;

use meltpath_base::quantity::Auto;
use meltpath_base::{Check, Limit, Measure, Place};
use meltpath_deposition::deposit::TubeDistance;
use meltpath_deposition::feed_response::FeedResponse;
use meltpath_geometry::math::DVec3;

use crate::job::waam::Starts;
use crate::waam::deposit::target::Comparison;

/// The standard uncertainty of growth, and what becomes of it as the build grows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrowthError {
    /// Of one layer, share of its growth.
    pub share: f64,
    /// What the source answers to the contact tube distance that an error of height changes; `None`: nothing.
    pub response: Option<FeedResponse>,
}

impl GrowthError {
    /// A predicted height when each layer grows by `deviations` standard uncertainties more than predicted, mm.
    pub fn shifted(&self, height: f64, deviations: f64) -> f64 {
        let growth = deviations * self.share;
        height
            + match self.response {
                Some(response) => response.height_error(growth, height.max(0.0)),
                None => growth * height,
            }
    }

    /// Standard uncertainty of a height, mm.
    pub fn at(&self, height: f64) -> f64 {
        0.5 * (self.shifted(height, 1.0) - self.shifted(height, -1.0))
    }
}

/// What cells, and the places of beads between them, do to unevenness, share of it: the scatter of the flatness of walls and zigzags of
/// ten layers, on cells of 0.25 to 1 mm that were moved, was 1 to 7 %.
const GRID: f64 = 0.05;

/// The standard uncertainty of something uneven, as flatness is: of growth, and of the cells.
fn of_uneven(growth: &GrowthError, value: f64) -> f64 {
    growth.share.hypot(GRID) * value
}

/// The limits, with defaults filled in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest lack, share of the part's volume.
    pub lack: f64,
    /// Largest excess, share of the part's volume.
    pub excess: f64,
    /// Smallest machining stock, mm.
    pub stock_min: f64,
    /// Largest height error of a layer, mm.
    pub height_error: f64,
    /// Largest flatness of a layer, mm.
    pub flatness: f64,
    /// Smallest contact tube to work distance, mm.
    pub ctwd_min: f64,
    /// Largest contact tube to work distance, mm.
    pub ctwd_max: f64,
    /// How far beyond the measured distances the law of the wire feed is taken to hold, mm.
    pub ctwd_beyond: f64,
    /// Largest local thickness beyond the mean of the layer, share of it.
    pub accumulation: f64,
    /// Largest shift of a layer over the one below, bead widths.
    pub overhang: f64,
    /// Smallest distance of a joint from its limits, rad.
    pub joint_margin: f64,
    /// Largest angle between torch and vertical, rad, where somebody knows it.
    pub tilt: Option<f64>,
    /// Smallest distance of torch and arm from what they may touch, mm.
    pub clearance: f64,
}

/// Where the contact tube was at a distance, and on which bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TubePlace {
    /// Distance, place and time.
    pub at: TubeDistance,
    /// The layer, from 1.
    pub layer: u32,
    /// The bead of its layer, counted from 1.
    pub bead: Option<u32>,
}

/// What was predicted of one layer.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LayerOutcome {
    /// Number, from 1.
    pub layer: u32,
    /// Planned height of its top over the plate, mm.
    pub planned_top: f64,
    /// Predicted mean height inside the layer, mm; `None` where no cell lies inside.
    pub mean_top: Option<f64>,
    /// 5-95 % spread of heights inside the layer, mm.
    pub flatness: Option<f64>,
    /// Mean contact tube to work distance while it was deposited, mm.
    pub ctwd_mean: f64,
    /// Smallest and largest contact tube to work distance while it was deposited, mm.
    pub ctwd_range: (f64, f64),
    /// Where the contact tube was nearest and farthest, of every simulated sample.
    pub tube: Option<[TubePlace; 2]>,
    /// Largest local thickness beyond the mean of the layer, as a share of it, and where.
    pub accumulation: Option<(f64, DVec3)>,
    /// Wire used, mm.
    pub wire: f64,
    /// Time with arc, s.
    pub arc_time: f64,
    /// Length of its beads, mm.
    pub length: f64,
    /// Length of its beads of which more than a quarter of the width hangs out, mm.
    pub hanging: f64,
    /// Number of beads.
    pub beads: u32,
}

/// The build compared with the target at the predicted growth, and at growth one standard deviation lower and higher.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetOutcome {
    /// Volume of the finished part, mm³.
    pub volume: f64,
    /// At the predicted growth.
    pub expected: Comparison,
    /// One standard deviation lower.
    pub low: Comparison,
    /// One standard deviation higher.
    pub high: Comparison,
    /// Standard uncertainty of where metal ends sideways, mm.
    pub edge: f64,
    /// How far most of the metal round the place of the least stock over faces that look up stands above the face, mm; where that place is
    /// a well through the layers.
    pub round: Option<f64>,
}

/// What to do about checks that fail, where it depends on what the job already says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Remedies {
    /// Layers higher or lower than planned.
    pub height: &'static str,
    /// Metal in heaps.
    pub accumulation: &'static str,
    /// Metal missing in the part.
    pub lack: &'static str,
    /// Too much metal.
    pub excess: &'static str,
}

impl Remedies {
    /// For a job's layer heights and starts of beads.
    pub fn of<H>(heights: &Auto<H>, starts: Starts) -> Self {
        let accumulation = match starts {
            Starts::Spread => "more machine.smoothing, or a fill.strategy with fewer sharp corners",
            Starts::Aligned => {
                "fill.starts = \"spread\", more machine.smoothing, or a fill.strategy with fewer sharp corners"
            }
        };
        match heights {
            Auto::Auto => Remedies {
                accumulation,
                height: "more machine.smoothing where the torch waits at corners, height corrected at the machine every few layers, or a process map of beads of your own",
                lack: "raise target.allowance; see the place in the 3D view",
                excess: "more machine.smoothing where the torch waits at corners, another fill.strategy, or allow more in checks.excess",
            },
            Auto::Value(_) => Remedies {
                accumulation,
                height: "write layers.height = \"auto\", or correct the height at the machine every few layers",
                lack: "write layers.height = \"auto\", or raise target.allowance; see the place in the 3D view",
                excess: "write layers.height = \"auto\", or allow more in checks.excess",
            },
        }
    }
}

/// Checks that compare the metal with the finished part.
pub fn target_checks(outcome: &TargetOutcome, limits: &Limits, remedies: &Remedies) -> Vec<Check> {
    let share = |v: f64| 100.0 * v / outcome.volume;
    let spread = |low: f64, high: f64| 0.5 * (low - high).abs();
    let (e, l, h) = (&outcome.expected, &outcome.low, &outcome.high);
    let placed = |check: Check, at: Option<(DVec3, f64)>| match at {
        Some((p, _)) => check.at(Place::at(p.to_array())),
        None => check,
    };
    let lack = Measure::new(share(e.lack), share(spread(l.lack, h.lack)), "%");
    let excess = Measure::new(share(e.excess), share(spread(l.excess, h.excess)), "%");
    let mut checks = vec![
        placed(
            Check::judge(
                "lack",
                "lack of metal in the finished part",
                lack,
                Limit::AtMost(100.0 * limits.lack),
            ),
            e.lack_at,
        )
        .remedy(remedies.lack),
        placed(
            Check::judge(
                "excess",
                "metal beyond part + allowance",
                excess,
                Limit::AtMost(100.0 * limits.excess),
            ),
            e.excess_at,
        )
        .remedy(remedies.excess),
    ];
    checks.extend(stock_check(outcome, limits));
    checks
}

/// Machining stock at the place most likely below its limit. Over faces that look sideways it is known no better than where the metal ends
/// there, and that moves by half of what the bead's width does; over slopes the share of it that their normal has.
fn stock_check(outcome: &TargetOutcome, limits: &Limits) -> Option<Check> {
    let (e, l, h) = (&outcome.expected, &outcome.low, &outcome.high);
    let limit = Limit::AtLeast(limits.stock_min);
    let faces = e.stock.iter().zip(l.stock.iter().zip(&h.stock));
    let places = faces.filter_map(|(stock, (low, high))| {
        let (stock, at) = (*stock)?;
        let of_height = 0.5 * ((*low)?.0 - (*high)?.0).abs();
        let of_edge = outcome.edge * at.normal.truncate().length();
        let sigma = of_height.hypot(of_edge);
        Some((at, Measure::new(stock, sigma, "mm")))
    });
    let (at, stock) = worst::worst(places, limit)?;
    let title = "machining stock over the finished part";
    let check = Check::judge("stock", title, stock, limit).at(Place::at(at.position.to_array()));
    let well = outcome.round.filter(|round| *round >= limits.stock_min);
    Some(match well {
        Some(round) if at.looks_up() => check.remedy(format!(
            "another fill.strategy, or a smaller fill.stepover: the metal round this place stands {round:.1} mm over the face, and a well between beads stays one however many layers come (target.allowance_top does not fill it)"
        )),
        _ if at.looks_up() => check.remedy("raise target.allowance_top"),
        _ => check.remedy("raise target.allowance"),
    })
}

/// Checks of layers: height, flatness, accumulations.
pub fn layer_checks(
    layers: &[LayerOutcome],
    growth: &GrowthError,
    limits: &Limits,
    remedies: &Remedies,
) -> Vec<Check> {
    let mut checks = Vec::new();
    let worst = |value: &dyn Fn(&LayerOutcome) -> Option<f64>| {
        layers
            .iter()
            .filter_map(|l| value(l).map(|v| (v, l)))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let limit = Limit::AtMost(limits.height_error);
    let heights = layers.iter().filter_map(|l| {
        let top = l.mean_top?;
        let error = Measure::new((top - l.planned_top).abs(), growth.at(top), "mm");
        Some(((l, top), error))
    });
    if let Some(((layer, top), error)) = worst::worst(heights, limit) {
        let word = if top > layer.planned_top {
            "taller"
        } else {
            "lower"
        };
        checks.push(
            Check::judge(
                "height",
                &format!(
                    "layer height (layer {} is {word} than planned)",
                    layer.layer
                ),
                error,
                limit,
            )
            .at(Place::layer(layer.layer))
            .remedy(remedies.height),
        );
    }
    if let Some((flatness, layer)) = worst(&|l| l.flatness) {
        checks.push(
            Check::judge("flatness", "flatness of layers (5-95 % of heights)", Measure::new(flatness, of_uneven(growth, flatness), "mm"), Limit::AtMost(limits.flatness))
                .at(Place::layer(layer.layer))
                .remedy("a smaller fill.stepover, more machine.smoothing, or another fill.strategy: see the accumulations in the 3D view"),
        );
    }
    if let Some((over, layer)) = worst(&|l| l.accumulation.map(|(over, _)| over)) {
        let position = layer.accumulation.map(|(_, p)| p.to_array());
        let found = Measure::new(100.0 * over, 100.0 * of_uneven(growth, over), "%");
        checks.push(
            Check::judge(
                "accumulation",
                "accumulation: thickness over a bead's width of path, beyond the mean of its layer",
                found,
                Limit::AtMost(100.0 * limits.accumulation),
            )
            .at(Place {
                position,
                layer: Some(layer.layer),
                ..Place::default()
            })
            .remedy(remedies.accumulation),
        );
    }
    checks
}

#[cfg(test)]
mod tests {
    use meltpath_base::Status;

    use super::*;
    use crate::waam::deposit::stock::SurfacePoint;

    const REMEDIES: Remedies = Remedies {
        height: "height",
        accumulation: "accumulation",
        lack: "lack",
        excess: "excess",
    };
    const LIMITS: Limits = Limits {
        lack: 0.005,
        excess: 0.3,
        stock_min: 0.3,
        height_error: 1.0,
        flatness: 1.5,
        ctwd_min: 8.0,
        ctwd_max: 20.0,
        ctwd_beyond: 0.5,
        accumulation: 1.0,
        overhang: 0.25,
        joint_margin: 0.0,
        clearance: 0.0,
        tilt: None,
    };

    fn growth(share: f64) -> GrowthError {
        GrowthError {
            share,
            response: None,
        }
    }

    #[test]
    fn a_regulated_error_stays_below_its_share_of_the_height() {
        let free = growth(0.05);
        assert_eq!((free.at(40.0), free.shifted(40.0, -1.0)), (2.0, 38.0));
        let regulated = GrowthError {
            response: Some(FeedResponse {
                reference: 15.0,
                slope: 0.022,
                limits: (0.6, 1.2),
                measured: (5.0, 15.0),
            }),
            ..free
        };
        assert!((regulated.at(40.0) - 0.05 / 0.022 * (1.0 - (-0.88_f64).exp())).abs() < 1e-12);
        assert!(regulated.at(1000.0) < 0.05 / 0.022);
    }

    #[test]
    fn a_drifting_wall_fails_on_its_height() {
        // programmed 1.2 mm a layer, it grows 1.65
        let layers: Vec<LayerOutcome> = (1..=25)
            .map(|n| LayerOutcome {
                layer: n,
                planned_top: 1.2 * f64::from(n),
                mean_top: Some(1.65 * f64::from(n)),
                ..LayerOutcome::default()
            })
            .collect();
        let checks = layer_checks(&layers, &growth(0.05), &LIMITS, &REMEDIES);
        let height = checks.iter().find(|c| c.id == "height").unwrap();
        assert_eq!(height.status, Status::Fail);
        assert_eq!(height.place.as_ref().unwrap().layer, Some(25));
        assert!(height.remedy.is_some());
    }

    /// Near the plate a height is well known, and 0.5 mm too much is nothing; at 100 mm a height that is known to a hundredth may be far off.
    #[test]
    fn the_height_that_is_told_is_the_one_most_likely_too_far_off() {
        let layer = |layer, planned_top, mean_top| LayerOutcome {
            layer,
            planned_top,
            mean_top: Some(mean_top),
            ..LayerOutcome::default()
        };
        let layers = [layer(1, 2.0, 2.5), layer(50, 100.0, 100.1)];
        let checks = layer_checks(&layers, &growth(0.0095), &LIMITS, &REMEDIES);
        let height = checks.iter().find(|c| c.id == "height").unwrap();
        assert_eq!(height.place.as_ref().unwrap().layer, Some(50));
        assert_eq!(height.status, Status::Warn);
    }

    #[test]
    fn lack_carries_the_uncertainty_of_growth() {
        let with = |lack: f64| Comparison {
            lack,
            ..Comparison::default()
        };
        let outcome = TargetOutcome {
            volume: 1000.0,
            expected: with(0.0),
            low: with(30.0),
            high: with(0.0),
            edge: 0.0,
            round: None,
        };
        let checks = target_checks(&outcome, &LIMITS, &REMEDIES);
        assert_eq!(checks[0].status, Status::CannotSay);
        assert!((checks[0].value.as_ref().unwrap().sigma.unwrap() - 1.5).abs() < 1e-12);
    }

    /// Enough metal over a well known top, less of it than is known of a flank.
    #[test]
    fn stock_of_flanks_carries_how_wide_the_bead_is() {
        let at = |normal| SurfacePoint {
            position: DVec3::ZERO,
            normal,
        };
        let compared = |top: f64| Comparison {
            stock: [Some((top, at(DVec3::Z))), Some((0.9, at(DVec3::X)))],
            ..Comparison::default()
        };
        let found = |edge: f64| {
            let outcome = TargetOutcome {
                volume: 1000.0,
                expected: compared(0.8),
                low: compared(0.7),
                high: compared(0.9),
                edge,
                round: None,
            };
            let checks = target_checks(&outcome, &LIMITS, &REMEDIES);
            checks.into_iter().find(|c| c.id == "stock").unwrap()
        };
        let (known, unknown) = (found(0.0), found(0.7));
        assert_eq!(known.status, Status::Pass);
        assert_eq!(known.value.unwrap().value, 0.8);
        assert_ne!(unknown.status, Status::Pass);
        assert_eq!(unknown.value.unwrap(), Measure::new(0.9, 0.7, "mm"));
    }

    #[test]
    fn stock_is_raised_over_the_face_that_lacks_it() {
        let [side, top] = ["raise target.allowance", "raise target.allowance_top"];
        for (normal, round, wanted) in [
            (DVec3::X, None, side),
            (DVec3::Z, None, top),
            (DVec3::Z, Some(-0.5), top),
            // more layers do not fill a well
            (DVec3::Z, Some(3.0), "another fill.strategy"),
            (DVec3::X, Some(3.0), side),
        ] {
            let point = SurfacePoint {
                position: DVec3::ZERO,
                normal,
            };
            let bare = Comparison {
                stock: [Some((0.0, point)), None],
                ..Comparison::default()
            };
            let outcome = TargetOutcome {
                volume: 1000.0,
                expected: bare.clone(),
                low: bare.clone(),
                high: bare,
                edge: 0.1,
                round,
            };
            let checks = target_checks(&outcome, &LIMITS, &REMEDIES);
            let stock = checks.iter().find(|c| c.id == "stock").unwrap();
            assert_eq!(stock.status, Status::Fail);
            let remedy = stock.remedy.as_deref().unwrap();
            let whole = remedy == wanted || round.is_some() && remedy.starts_with(wanted);
            assert!(whole, "{remedy}");
        }
    }
}
