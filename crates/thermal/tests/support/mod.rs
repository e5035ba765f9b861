//! What several test files need: the material and charts that are computed once.
#![allow(dead_code, reason = "each test file uses its part of it")]

use std::sync::OnceLock;

use meltpath_base::Silent;
use meltpath_thermal::chart::{ChartSet, ChartSettings};
use meltpath_thermal::chart_build::compute;
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::material_file::{Readings, read};

/// Ti6Al4V of the thesis.
pub(crate) fn titanium() -> Material {
    read(
        include_str!("../../../../data/materials/ti6al4v-ebm.toml"),
        Readings::default(),
    )
    .unwrap()
}

/// Charts at 60 kV; a test file uses one or two settings, each computed once.
pub(crate) fn charts(current: f64, focus: f64, diameter: f64, stop: f64) -> &'static ChartSet {
    static SLOW: OnceLock<ChartSet> = OnceLock::new();
    static FAST: OnceLock<ChartSet> = OnceLock::new();
    let slot = if current < 3e-3 { &SLOW } else { &FAST };
    let set = slot.get_or_init(|| {
        let settings = ChartSettings {
            stop: stop + CELSIUS,
            ..ChartSettings::of_thesis(60e3, current, focus, diameter)
        };
        compute(&settings, &titanium(), &Silent).unwrap()
    });
    assert!(set.settings.serves(60e3, current, focus));
    set
}
