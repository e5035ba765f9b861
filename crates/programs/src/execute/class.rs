//! What becomes of lines that are kept verbatim, before anything is known of their values.

use super::effect::{Effect, effect, effect_of};
use super::job_lines::is_inform_logic;
use super::logic::is_logic;
use crate::program::Dialect;

/// What becomes of a line that is kept verbatim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Becomes {
    /// It is executed, as far as the values are known that it names.
    Executed,
    /// It lays no metal.
    Passed,
    /// It may shape metal, and is told where a program is simulated.
    Told,
}

/// What becomes of a line.
pub fn becomes(dialect: Dialect, text: &str) -> Becomes {
    let does = match dialect {
        Dialect::Inform if is_inform_logic(text) => return Becomes::Executed,
        Dialect::FanucLs if is_logic(text) => return Becomes::Executed,
        Dialect::FanucLs => effect(text),
        other => effect_of(other, text),
    };
    match does {
        Effect::Set
        | Effect::Signal
        | Effect::Position
        | Effect::Output
        | Effect::Frame(_)
        | Effect::Weave
        | Effect::WeaveEnd
        | Effect::Abort
        | Effect::Stops
        | Effect::Turns(_)
        | Effect::Ahead(_) => Becomes::Executed,
        Effect::Wait | Effect::Pause | Effect::Passive => Becomes::Passed,
        Effect::Interrupts(_) | Effect::Shapes(_) => Becomes::Told,
    }
}
