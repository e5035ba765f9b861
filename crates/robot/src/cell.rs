//! What stands in a robot cell: arm, track, positioner, torch and part, with the frames between them, read from a file.

mod axes;
mod build;
mod file;
mod frame;
mod layout;
mod linked;
mod sound;
mod stance;
mod touched;
mod urdf;

pub use axes::AXES;
pub use build::{read, read_beside};
pub use file::{ArmKind, CellFile, FROM_URDF};
pub use layout::{
    Arrangement, Cell, External, Frames, Holder, LinkHull, Links, Maker, Shapes, Source, Table,
    Touched, Values,
};
pub use stance::Stance;
pub use urdf::{JointFault, LinkFault, Named, UrdfError, from_urdf};
