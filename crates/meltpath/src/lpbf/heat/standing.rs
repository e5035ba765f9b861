//! Where a lit beam stands between marks, and how hot it makes what is below it: a wait from mark to mark is one in the light.
//!
//! The middle of a standing Gaussian spot has a closed form ([`standing_rise`]); the mark that led there has warmed it before, as much at
//! the most as if the beam had stood for the time that it takes over its own spot.

use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_thermal::material::Material;
use meltpath_thermal::material::medium::Medium;
use meltpath_thermal::pool::fusion::standing_rise;

use super::beam::while_it_stands;

/// A beam that stands in the light between two marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// For how long, s.
    pub wait: f64,
    /// With which power, W.
    pub power: f64,
    /// Where, mm.
    pub place: [f64; 2],
    /// How much the middle of the spot warms, over what it can until it boils.
    pub number: Option<f64>,
}

/// Where the beam stands between the marks up to number `last` and heats the most.
pub(super) fn longest(
    (material, medium): (&Material, &Medium),
    (absorptivity, spot): (f64, f64),
    (job, law): (&ScanJob, PowerLaw),
    last: u32,
) -> Option<Standing> {
    let evaporation = material.evaporation.as_ref();
    let boiling = evaporation.and_then(|e| Some(e.components.first()?.boiling));
    let stands = job.vectors.iter().take(last as usize + 1).enumerate();
    let stands = stands.filter_map(|(i, v)| {
        let power = while_it_stands(v, job.vectors.get(i + 1), law);
        let absorbed = absorptivity * power;
        let time = v.wait + spot / v.speed;
        let rise = standing_rise(medium, absorbed, spot, time);
        (power > 0.0).then(|| {
            let standing = Standing {
                wait: v.wait,
                power,
                place: [v.end.x, v.end.y],
                number: boiling.map(|b| rise / (b - medium.ambient).max(1.0)),
            };
            (rise, standing)
        })
    });
    let hottest = stands.max_by(|a, b| a.0.total_cmp(&b.0));
    hottest.map(|(_, standing)| standing)
}
