//! Programs: golden text, laws over random toolpaths, programs of other software; CLI layers.
#![allow(clippy::unwrap_used, reason = "a test that fails stops here")]

mod arc_lines;
mod built;
mod cli_layers;
mod coordinated;
mod corners;
mod daily;
mod dialects;
mod flank;
mod followed;
mod foreign;
mod frames;
mod held;
mod held_val3;
mod logic;
mod loops;
mod others;
mod phases;
mod scopes;
mod silence;
mod source;
mod state;
mod told;
mod told_by_cell;
mod toolpath_3mf;
mod toolpath_3mf_of_others;
mod track;
mod turned;
mod weaving;
mod winding;
