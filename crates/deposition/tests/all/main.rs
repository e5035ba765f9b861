//! The bead: the carpets and walls of Rouchon 2022, process maps, and laws that hold for any path.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that fails stops here"
)]

mod assembly;
mod carpets;
mod conservation;
mod plain;
mod process_map;
mod shapes;
mod support;
mod uncertainty;
mod uneven;
mod walls;
mod workpiece;
