//! The application as a library: jobs, commands and files as a person writes them, and the folders that they leave.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::panic,
    reason = "a test that fails stops here; its figures are shown with --nocapture"
)]

mod along_track;
mod beside;
mod by_joints;
mod changing_speed;
mod compare;
mod corners;
mod delivered;
mod dialects;
mod divided_beads;
mod ebm;
mod edited;
mod fit;
mod flat;
mod focus;
mod foreign;
mod foretold;
mod frames_of_cells;
mod free_axes;
mod grown;
mod health;
mod identify;
mod joint_moves;
mod leaning;
mod lpbf;
mod measure;
mod metal_and_plan;
mod motion_log;
mod names;
mod onto;
mod over;
mod own_frames;
mod paced;
mod part_on_robot;
mod reach;
mod records;
mod reference;
mod remedies;
mod restarts;
mod standing;
mod support;
mod surface;
mod templates;
mod toolpath_3mf;
mod tune;
mod unsure;
mod verdicts;
mod walls;
mod woven;
