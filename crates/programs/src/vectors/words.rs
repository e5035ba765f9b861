//! The words of a vector list: kinds and columns.

use meltpath_toolpath::Role;

/// Where the head stands when a layer begins.
pub(super) const START: &str = "start";

/// Words for what vectors are for.
pub(super) const KINDS: [(Role, &str); 5] = [
    (Role::Contour, "contour"),
    (Role::Fill, "fill"),
    (Role::Jump, "jump"),
    (Role::Connection, "connection"),
    (Role::Run, "run"),
];

/// The columns and their headings.
pub(super) const COLUMNS: [&str; 10] = [
    "kind",
    "x_mm",
    "y_mm",
    "z_mm",
    "speed_mm_s",
    "power_W",
    "wait_s",
    "part",
    "layer",
    "height_mm",
];
