//! Where a lit beam stands between marks, and how hot it makes what is below it: a wait from mark to mark is one in the light.
//!
//! The middle of a standing Gaussian spot has a closed form ([`standing_rise`]); the mark that led there has warmed it before, as much at
//! the most as if the beam had stood for the time that it takes over its own spot.

use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_thermal::pool::fusion::standing_rise;

use super::beam::while_it_stands;
use super::settings::HeatSettings;

/// A beam that stands in the light between two marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// For how long, s.
    pub wait: f64,
    /// With which power, W.
    pub power: f64,
    /// Where, mm.
    pub place: [f64; 2],
    /// In which layer, where layers are marked.
    pub layer: Option<u32>,
    /// By how much the middle of the spot warms, K.
    pub rise: f64,
    /// How much the middle of the spot warms, over what it can until it boils.
    pub number: Option<f64>,
}

impl Standing {
    /// Which of two warms the metal more.
    pub(super) fn hotter(&self, other: &Standing) -> std::cmp::Ordering {
        self.rise.total_cmp(&other.rise)
    }
}

/// Where the beam stands between the marks of a layer and heats the most.
pub(super) fn longest(
    settings: &HeatSettings,
    (job, layer): (&ScanJob, Option<u32>),
    law: PowerLaw,
) -> Option<Standing> {
    let (medium, spot) = (&settings.medium, settings.spot);
    let evaporation = settings.material.evaporation.as_ref();
    let boiling = evaporation.and_then(|e| Some(e.components.first()?.boiling));
    let stands = job.vectors.iter().enumerate();
    let stands = stands.filter_map(|(i, v)| {
        let power = while_it_stands(v, job.vectors.get(i + 1), law);
        let absorbed = settings.absorptivity * power;
        let time = v.wait + spot / v.speed;
        let rise = standing_rise(medium, absorbed, spot, time);
        (power > 0.0).then(|| Standing {
            wait: v.wait,
            power,
            place: [v.end.x, v.end.y],
            layer,
            rise,
            number: boiling.map(|b| rise / (b - medium.ambient).max(1.0)),
        })
    });
    stands.max_by(Standing::hotter)
}
