//! The machine along programs: how the job's robot holds the torch, what that comes near, and the motion to look at.

pub(crate) mod arm_way;
pub(crate) mod axes;
pub(crate) mod bead_pieces;
pub(crate) mod columns;
pub(crate) mod divide;
pub(crate) mod division;
pub(crate) mod driven;
pub(crate) mod expected;
pub(crate) mod film;
pub(crate) mod hold;
pub(crate) mod joint_moves;
pub(crate) mod key_moments;
pub(crate) mod lean;
pub(crate) mod over;
pub(crate) mod own_frame;
mod positions;
pub(crate) mod reach;
pub mod record;
pub(crate) mod said_frames;
pub(crate) mod site;
pub(crate) mod solids;
pub(crate) mod spacing;
pub(crate) mod times;
pub(crate) mod travels;
pub(crate) mod unsure;
mod way;
