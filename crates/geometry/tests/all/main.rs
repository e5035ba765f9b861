//! Shapes: files in and out, repair, sections, offsets, the growing workpiece.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test that fails stops here; its figures are shown with --nocapture"
)]

mod height_map;
mod mesh_io;
mod mesh_large;
mod mesh_repair;
mod offset;
mod sheet;
mod slice;
mod solids;
mod step;
mod voxels;

/// Cancels whatever it watches.
struct Stop;

impl meltpath_base::Observer for Stop {
    fn stage(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        true
    }
}
