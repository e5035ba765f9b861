//! KUKA programs in KRL: a `.src` with the instructions and a `.dat` with the positions, read and written; the arc by ArcTech.
//!
//! Moves are written plainly (`$VEL.CP`, `$APO.CDIS`, `LIN XP1 C_DIS`), beads by the calls and triggers that ArcTech's own lines make
//! (`ArcMainNG`), one weld data set for each pair of schedule and speed: a bead's speed is that of its weld data. Both forms are read,
//! and those of the inline forms (`FDAT_ACT`, `LDAT_ACT`, `BAS(#CP_PARAMS, …)`) too. The form of ArcTech's calls is that of published
//! programs of ArcTech Basic 3.3: check it against the controller at hand.
//!
//! Where the robot holds the part the torch that stands is the base, the part the tool, and `$IPO_MODE` is `#TCP`: KUKA's "external TCP".

mod arc;
mod data;
mod entries;
mod list;
mod motion;
mod parse;
mod select;
mod set;
mod switched;
mod tables;
mod turned;
mod variables;
mod with;
mod words;
mod write;

pub use parse::read;
pub(crate) use turned::turns;
pub use words::{KrlWords, WeaveAmplitude};
pub use write::write;

use crate::held::Standing;
use crate::program::{Attribute, Instruction};

/// What every program begins with: the stop interrupt and the basic settings of motion.
pub(crate) fn opening() -> Vec<Instruction> {
    [
        "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM( )",
        "INTERRUPT ON 3",
        "BAS(#INITMOV,0)",
    ]
    .map(|line| Instruction::Raw(line.to_owned()))
    .to_vec()
}

/// What the controller's frames are to be where the torch stands.
pub(crate) fn standing(standing: &Standing, (base, tool): (u32, u32)) -> [String; 2] {
    let [torch, part] = [&standing.world_from_torch, &standing.flange_from_part].map(data::frame);
    [
        format!("BASE_DATA[{base}]={torch}, the torch in the world"),
        format!("TOOL_DATA[{tool}]={part}, the part in the flange"),
    ]
}

/// The key under which a program holds the machine that its base is coupled to.
const COUPLED: &str = "EK";

/// Tells that the base of a program is coupled to a machine.
pub(crate) fn coupled(machine: u32) -> Attribute {
    Attribute {
        key: COUPLED.to_owned(),
        value: machine.to_string(),
    }
}

/// Whether the base of a program is coupled to this machine.
pub(crate) fn is_coupled_to(program: &crate::program::Program, machine: u32) -> bool {
    program.attribute(COUPLED) == Some(coupled(machine).value.as_str())
}

/// Whether the base of a program is coupled to a machine that moves.
pub(crate) fn is_coupled(program: &crate::program::Program) -> bool {
    program.attribute(COUPLED).is_some()
}
