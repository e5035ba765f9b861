//! What models are held against: bodies that are built and measured, fields that others computed, and the fit to them.

mod belief;
pub mod comparison;
pub mod coupon;
mod course;
pub mod fit;
mod places;
