//! ABB programs in RAPID, read and written: one module with its data and one routine a program; the arc by ArcWare.
//!
//! Beads are `ArcLStart`, `ArcL`, `ArcC`, `ArcLEnd` with one `welddata` for each pair of schedule and speed: the speed of a bead is that
//! of its weld data, mm/s. Tool, work object and seam data are the controller's, called by the names that the cell tells. Positions
//! carry their `confdata` where a robot was named, else the monitoring of configurations is off. Where the robot holds the part a program ends at
//! once unless the controller's tool stands (`robhold`); a `robtarget` is the pose of the torch in the part, whoever holds which (Technical
//! reference manual RAPID, tooldata and wobjdata).

mod data;
mod declared;
pub(crate) mod harmless;
mod parse;
mod seam;
mod statements;
mod variables;
mod variants;
mod verbs;
mod words;
mod write;

pub use parse::read;
pub use words::RapidWords;
pub use write::write;

use crate::held::Standing;

/// What the controller's data are to say where the torch stands.
pub(crate) fn standing(standing: &Standing, words: &RapidWords) -> [String; 2] {
    let torch = data::written_pose(&standing.world_from_torch);
    let part = data::written_pose(&standing.flange_from_part);
    let none = data::written_pose(&meltpath_geometry::Pose::IDENTITY);
    let (tool, object) = (&*words.tool, &*words.work_object);
    [
        format!("{tool}: [FALSE,{torch},load of the gripper], the torch in the world"),
        format!("{object}: [TRUE,TRUE,\"\",{part},{none}], the part in the flange"),
    ]
}
