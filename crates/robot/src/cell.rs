//! What stands in a robot cell: arm, track, positioner, torch and part, with the frames between them, read from a file.

mod axes;
mod build;
mod file;
mod frame;
mod layout;
mod sound;
mod stance;
mod urdf;

pub use axes::AXES;
pub use build::read;
pub use file::{ArmKind, CellFile};
pub use layout::{
    Arrangement, Cell, External, Frames, Holder, Maker, Shapes, Source, Table, Values,
};
pub use stance::Stance;
pub use urdf::{JointFault, UrdfError, from_urdf};
