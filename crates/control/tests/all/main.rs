//! Linear systems, synthesis and export: acceptance cases of the scan head, stored plants, exported controllers.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that fails stops here, and says what it found"
)]

mod assumptions;
mod export;
mod hard_plants;
mod named_plants;
mod reference;
mod scan_head;
mod synthesis_table;
