//! The layers that are drawn below the judged one: of them the surface alone is looked at.

use meltpath_base::{Check, Status};
use meltpath_melt_strategy::judgement::Variant;
use meltpath_melt_strategy::layer_heat::LayerHeat;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::material::CELSIUS;

use crate::ebm::judge::doubt::Doubt;
use crate::ebm::judge::ends::first_end;
use crate::ebm::settings::Settings;

const EACH: &str = "judge each of them, too: the same job with ebm.layers lower by one, and of a part section.height lower by a layer";

/// What is known of the layers below the judged one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lower {
    /// How many they are.
    pub layers: usize,
    /// The hottest one, counted from 1, and the highest temperature of its build plane, K, in any of the runs that show whether it is
    /// solved.
    pub hottest: (usize, f64),
    /// Where a pool of conduction ends under their beam, K.
    pub end: f64,
}

impl Lower {
    /// Of paths that were drawn in several runs, each with the heat of its layers; `None` where there are none.
    pub(super) fn of<'a>(
        settings: &Settings,
        lower: &[BeamPath],
        runs: impl Iterator<Item = (Variant, &'a [LayerHeat])>,
    ) -> Option<Lower> {
        let solved = runs.filter(|(variant, _)| !variant.is_of_power());
        let surfaces = solved.flat_map(|(_, layers)| {
            let layers = layers.iter().take(lower.len()).enumerate();
            layers.map(|(n, layer)| (n + 1, layer.surface))
        });
        Some(Lower {
            layers: lower.len(),
            hottest: surfaces.max_by(|a, b| a.1.total_cmp(&b.1))?,
            end: first_end(settings, lower),
        })
    }

    /// What is said of them, and what it leaves of the checks of the layer on them: a pool that is no still one leaves another ground.
    pub(super) fn on(&self, checks: Vec<Check>) -> Vec<Check> {
        let (layer, kelvin) = self.hottest;
        let words = format!(
            "layers drawn below the judged one: {}; what of them melts, stays powder or does not fuse is not looked at; their surface reaches {:.0} °C, in layer {layer}, counted from the lowest one drawn",
            self.layers,
            kelvin - CELSIUS
        );
        let check = Check::not_checked("layers-below", "layers below the judged one", &words);
        let check = Check {
            remedy: Some(EACH.to_owned()),
            ..check
        };
        if kelvin <= self.end {
            return checks.into_iter().chain([check]).collect();
        }
        let doubt = Doubt {
            reason: format!(
                "layer {layer} of those drawn below gets hotter than {:.0} °C, where a pool of conduction ends: what it is laid on is not known",
                self.end - CELSIUS
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
            let checks = lower.on(vec![judged(value)]);
            [checks[0].status, checks[1].status]
        };
        assert_eq!(said(2900.0, 0.0), [Status::Pass, Status::NotChecked]);
        assert_eq!(said(3100.0, 0.0), [Status::CannotSay; 2]);
        assert_eq!(said(3100.0, 5.0), [Status::Fail, Status::CannotSay]);
    }
}
