//! The layers that are drawn below the judged one: of them the surface alone is looked at.

use meltpath_melt_strategy::judgement::Variant;
use meltpath_melt_strategy::layer_heat::LayerHeat;
use meltpath_thermal::beam::BeamPath;

use crate::ebm::judge::ends::first_end;
use crate::ebm::settings::Settings;

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
}
