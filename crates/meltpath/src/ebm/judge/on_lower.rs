//! What the layers below the judged one leave of what is said of it.

use meltpath_base::{Check, Status};
use meltpath_thermal::material::CELSIUS;

use crate::ebm::judge::doubt::Doubt;
use crate::ebm::judge::lower::Lower;

const EACH: &str = "judge each of them, too: the same job with ebm.layers lower by one, and of a part section.height lower by a layer";

/// What is said of them, and what it leaves of the checks of the layer on them: a pool that is no still one leaves another ground.
pub(super) fn on(lower: &Lower, checks: Vec<Check>) -> Vec<Check> {
    let (layer, kelvin) = lower.hottest;
    let words = format!(
        "layers drawn below the judged one: {}; what of them melts, stays powder or does not fuse is not looked at; their surface reaches {:.0} °C, in layer {layer}, counted from the lowest one drawn",
        lower.layers,
        kelvin - CELSIUS
    );
    let check = Check::not_checked("layers-below", "layers below the judged one", &words);
    let check = Check {
        remedy: Some(EACH.to_owned()),
        ..check
    };
    if kelvin <= lower.end {
        return checks.into_iter().chain([check]).collect();
    }
    let doubt = Doubt {
        reason: format!(
            "layer {layer} of those drawn below gets hotter than {:.0} °C, where a pool of conduction ends: what it is laid on is not known",
            lower.end - CELSIUS
        ),
        remedy: "less power, or faster lines, in the layers below".to_owned(),
    };
    let mut checks: Vec<Check> = checks
        .into_iter()
        .map(|check| match check.status {
            Status::NotChecked => check,
            _ => doubt.on(check),
        })
        .collect();
    checks.push(doubt.on(check));
    checks
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::{Limit, Measure};

    #[test]
    fn a_layer_on_a_pool_that_is_no_still_one_is_not_judged() {
        let judged = |value: f64| {
            let found = Measure::exact(value, "%");
            Check::judge("unfused", "Unfused", found, Limit::AtMost(1.0))
        };
        let said = |kelvin: f64, value: f64| {
            let lower = Lower {
                layers: 2,
                hottest: (1, kelvin),
                end: 3000.0,
            };
            let checks = on(&lower, vec![judged(value)]);
            [checks[0].status, checks[1].status]
        };
        assert_eq!(said(2900.0, 0.0), [Status::Pass, Status::NotChecked]);
        assert_eq!(said(3100.0, 0.0), [Status::CannotSay; 2]);
        assert_eq!(said(3100.0, 5.0), [Status::Fail, Status::CannotSay]);
    }
}
