//! The reference heads, plates and recipes, as they ship.

use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::files::{self, HeadData};
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::plate::SquarePlate;

pub(crate) fn two_axis_data() -> HeadData {
    files::parse_head(include_str!(
        "../../../../data/scan-heads/two-axis-150.toml"
    ))
    .unwrap()
}

pub(crate) fn three_axis_data() -> HeadData {
    files::parse_head(include_str!(
        "../../../../data/scan-heads/three-axis-350.toml"
    ))
    .unwrap()
}

pub(crate) fn two_axis() -> ScanHead {
    two_axis_data().head
}

pub(crate) fn three_axis() -> ScanHead {
    three_axis_data().head
}

/// Recipes 1, 2 and 3.
pub(crate) fn recipes() -> [Recipe; 3] {
    [
        include_str!("../../../../data/recipes/industrial.toml"),
        include_str!("../../../../data/recipes/uniform.toml"),
        include_str!("../../../../data/recipes/doubled.toml"),
    ]
    .map(|text| files::parse_recipe(text).unwrap())
}

/// REF-2X.
pub(crate) fn motor() -> Galvanometer {
    two_axis().mirrors[1].motor.clone()
}

/// The first square of a plate, at the centre of the field.
pub(crate) fn one(plate: SquarePlate) -> SquarePlate {
    SquarePlate {
        columns: 1,
        rows: 1,
        ..plate
    }
}
