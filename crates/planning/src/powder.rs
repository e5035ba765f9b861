//! Paths of a beam over powder: hatches, islands, spots, nested contours, and how much energy goes where.

pub mod modulation;
pub mod nested;
pub mod plate;
