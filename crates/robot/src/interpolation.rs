//! What a robot's controller makes of its commands: lines and arcs through two moving averages, corners rounded or dwelt at.

pub mod corner;
pub mod fir;
mod history;
pub mod joints;
pub mod riders;
mod timeline;
pub(crate) mod track;
