//! Generator of test parts as watertight meshes: outlines in the plane, terraces (extrusions at several
//! heights), bodies of revolution, boxes, sheets and tubes of squares. Unlimited, exact, seeded where random.

mod cuboid;
mod outlines;
mod parts;
mod revolve;
mod squares;
mod terrace;

pub use cuboid::cuboid;
pub use outlines::{
    cross, ell, gear, honeycomb, islands, plate, random_star, ring, spiral, star, tee, truss,
};
pub use parts::{
    boss_on_plate, box_wall, cone, flange, impeller_blank, ribbed_bracket, thin_wall, vase,
};
pub use revolve::revolve;
pub use squares::{sheet, tube};
pub use terrace::{Terrace, extrude, terrace};
