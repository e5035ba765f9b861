//! What is common to weaves in programs.

use meltpath_toolpath::Weave;

use crate::program::Instruction;

/// A weave as its length along the path tells it again, with controllers that are told that: its frequency in steps of 0.001 Hz, its amplitude in steps of 0.001 mm.
pub(crate) fn told(weave: &Weave) -> Weave {
    let stepped = |value: f64| (value * 1e3).round() / 1e3;
    Weave {
        frequency: stepped(weave.frequency),
        amplitude: stepped(weave.amplitude),
        ..*weave
    }
}

/// Whether an instruction begins or ends a weave.
pub(crate) fn is_of_weave(instruction: &Instruction) -> bool {
    match instruction {
        Instruction::Weave(_) => true,
        Instruction::Raw(text) => ["Weave ", "Weave[", "WVON ", "WVOF"]
            .iter()
            .any(|w| text.starts_with(w)),
        _ => false,
    }
}
