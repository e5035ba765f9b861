//! The bead: sections, process maps, pursuit, cumulative deposit and its levelling, layer growth.
//!
//! From settings to a bead ([`process_map`]), from beads and motion to a part ([`deposit`] on a plate, [`workpiece`] on
//! anything and along any torch axis). Lengths mm, speeds mm/s.

pub mod assembly;
pub mod bead;
pub mod capillary;
pub mod consumable;
pub mod corner;
pub mod deposit;
pub mod electric;
pub mod energy;
pub mod feed_response;
pub mod process_map;
pub mod pursuit;
pub mod section;
pub mod stepover;
pub mod workpiece;
