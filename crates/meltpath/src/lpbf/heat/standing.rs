//! Where a lit beam stands, and how hot it makes what is below it: a wait from mark to mark is one in the light, and so is what laser delays
//! leave of one between a mark and a jump.
//!
//! The middle of a standing Gaussian spot has a closed form ([`standing_rise`]); the mark that led there has warmed it before, as much at
//! the most as if the beam had stood for the time that it takes over its own spot.

use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_thermal::pool::fusion::standing_rise;

use super::beam::while_it_stands;
use super::settings::HeatSettings;

/// Why a beam stands in the light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// A wait from mark to mark.
    Wait,
    /// The light is on while the simulated spot stands.
    Motion,
}

/// A beam that stands in the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Why.
    pub cause: Cause,
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
    /// A beam of a power that stands for a time after a mark of a speed, wherever.
    pub(super) fn of(
        settings: &HeatSettings,
        (power, speed): (f64, f64),
        (wait, cause): (f64, Cause),
    ) -> Standing {
        let (medium, spot) = (&settings.medium, settings.spot);
        let evaporation = settings.material.evaporation.as_ref();
        let boiling = evaporation.and_then(|e| Some(e.components.first()?.boiling));
        let absorbed = settings.absorptivity * power;
        let rise = standing_rise(medium, absorbed, spot, wait + spot / speed);
        Standing {
            cause,
            wait,
            power,
            place: [0.0; 2],
            layer: None,
            rise,
            number: boiling.map(|b| rise / (b - medium.ambient).max(1.0)),
        }
    }

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
    let stands = job.vectors.iter().enumerate();
    let stands = stands.filter_map(|(i, v)| {
        let power = while_it_stands(v, job.vectors.get(i + 1), law);
        (power > 0.0).then(|| Standing {
            place: [v.end.x, v.end.y],
            layer,
            ..Standing::of(settings, (power, v.speed), (v.wait, Cause::Wait))
        })
    });
    stands.max_by(Standing::hotter)
}
