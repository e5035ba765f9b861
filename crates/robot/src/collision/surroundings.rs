//! What stands around torch and arm: plate, metal and table.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::distance::Bounds;
use super::form::Form;
use super::metal::Metal;
use super::pairs::Pairs;
use crate::cell::{Arrangement, Cell, Shapes};

/// What stands around a program while it is executed.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// Shapes of torch and arm.
    pub shapes: &'a Shapes,
    /// Plate and metal while a command is executed.
    pub metal: &'a (dyn Fn(u32) -> &'a Metal + Sync),
    /// Thickness of the plate between part and table, mm; zero where there is none.
    pub plate: f64,
    /// Which bodies are looked at against which.
    pub pairs: Pairs,
}

impl<'a> Surroundings<'a> {
    /// What stands around a cell's torch and arm.
    pub fn new(
        cell: &Cell,
        shapes: &'a Shapes,
        metal: &'a (dyn Fn(u32) -> &'a Metal + Sync),
        plate: f64,
    ) -> Self {
        Surroundings {
            shapes,
            metal,
            plate,
            pairs: Pairs::new(cell, shapes),
        }
    }
}

/// How far down columns of metal go, mm: to the underside of the plate, under which the table or the arm begins. A table that is not known
/// may be anywhere below.
pub(super) fn foot(cell: &Cell, around: &Surroundings<'_>) -> f64 {
    match (cell.arrangement, around.shapes.table) {
        (Arrangement::TorchOnRobot, None) => f64::NEG_INFINITY,
        _ => -around.plate,
    }
}

/// The table in its own frame, with the part in it, which lies still on it; nothing where it is not known.
pub(super) fn table(cell: &Cell, around: &Surroundings<'_>) -> Option<(Pose, Bounds)> {
    let table = around.shapes.table?;
    if cell.arrangement == Arrangement::PartOnRobot {
        return None;
    }
    let [x, y] = table.size;
    let half = DVec3::new(0.5 * x, 0.5 * y, 0.0);
    let top = -around.plate;
    let bounds = Bounds {
        low: -half + (top - table.thickness) * DVec3::Z,
        high: half + top * DVec3::Z,
    };
    Some((cell.carrier_from_part, bounds))
}

/// The distance of a body from the table, mm, where it is less than `most`; else no less than `most`.
pub(super) fn to_table(
    (table_from_part, bounds): &(Pose, Bounds),
    form: &Form<'_>,
    most: f64,
) -> f64 {
    form.seen_from(*table_from_part)
        .nearest_piece(most, |form, most| form.to_box(*bounds, most))
}
