//! The reference heads, as they ship.

use meltpath_machine::scan_head::data;
use meltpath_machine::scan_head::galvanometer::Galvanometer;
use meltpath_machine::scan_head::head::ScanHead;

pub(crate) fn two_axis() -> ScanHead {
    data::parse(include_str!(
        "../../../../data/scan-heads/two-axis-150.toml"
    ))
    .unwrap()
}

pub(crate) fn three_axis() -> ScanHead {
    data::parse(include_str!(
        "../../../../data/scan-heads/three-axis-350.toml"
    ))
    .unwrap()
}

/// REF-2X.
pub(crate) fn motor() -> Galvanometer {
    two_axis().mirrors[1].motor.clone()
}
