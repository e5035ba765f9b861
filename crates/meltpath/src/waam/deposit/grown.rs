//! The height by which the simulated build grows per layer, named where checks fail because layers are planned otherwise.

use meltpath_base::Check;

use crate::waam::judge::LayerOutcome;
use crate::waam::settings::Settings;
use crate::waam::settings::bead::buildable;

/// Planned layers are alike where their heights differ by this share at most.
const ALIKE: f64 = 0.02;
/// Growth so near to the plan, share of it, is not what a check fails by.
const AS_PLANNED: f64 = 0.02;

/// Names the height to write in the remedies of checks that fail by it.
pub(super) fn name(checks: &mut [Check], layers: &[LayerOutcome], settings: &Settings) {
    let Some(Growth { planned, grown }) = growth(layers, settings) else {
        return;
    };
    if (grown / planned - 1.0).abs() <= AS_PLANNED || !buildable(&settings.bead).contains(&grown) {
        return;
    }
    let by_it = |id: &str| match id {
        "height" => true,
        "ctwd-min" => grown > planned,
        "ctwd-max" => grown < planned,
        _ => false,
    };
    for check in checks.iter_mut().filter(|c| by_it(&c.id)) {
        if let Some(other) = &check.remedy {
            check.remedy = Some(format!(
                "write layers.height = \"{grown:.2} mm\", by which a layer grows here ({planned:.2} mm planned); or {other}"
            ));
        }
    }
}

/// What a layer grows by, and what was planned, mm.
struct Growth {
    planned: f64,
    grown: f64,
}

/// The mean growth of layers that are planned alike, each at the planned contact tube distance: where the tube came nearer meanwhile the source
/// fed less. The first layer, which a plate carries, and the last, which ends at the part's top, are left out; `None` of fewer than three others.
fn growth(layers: &[LayerOutcome], settings: &Settings) -> Option<Growth> {
    let inner = layers.get(..layers.len().checked_sub(1)?)?;
    let wanted = settings.feed_at(settings.ctwd);
    let steps: Option<Vec<[f64; 2]>> = inner
        .windows(2)
        .map(|w| {
            let fed = settings.feed_at(w[1].ctwd_mean) / wanted;
            let grown = (w[1].mean_top? - w[0].mean_top?) / fed;
            Some([w[1].planned_top - w[0].planned_top, grown])
        })
        .collect();
    let steps = steps?;
    let count = steps.len() as f64;
    let [planned, grown] = [0, 1].map(|k| steps.iter().map(|s| s[k]).sum::<f64>() / count);
    let alike = |s: &[f64; 2]| (s[0] / planned - 1.0).abs() <= ALIKE;
    let known = steps.len() >= 3 && steps.iter().all(alike) && grown.is_finite();
    known.then_some(Growth { planned, grown })
}
