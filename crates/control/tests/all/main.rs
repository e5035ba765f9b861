//! Linear systems, synthesis and export: acceptance cases of the scan head, stored plants, exported controllers.
#![allow(clippy::unwrap_used, reason = "a test that fails stops here")]

mod export;
mod reference;
mod scan_head;
mod synthesis_table;
