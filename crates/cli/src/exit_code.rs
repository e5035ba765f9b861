//! What the command's exit code says.

/// The part fails its checks.
pub(crate) const PART_FAILS: u8 = 1;
/// The input is wrong.
pub(crate) const INPUT_WRONG: u8 = 2;
/// Ctrl-C.
pub(crate) const INTERRUPTED: u8 = 130;
/// Nothing fails, but a check cannot be decided, or none was made.
pub(crate) const CANNOT_SAY: u8 = 4;
/// A bug.
pub(crate) const BUG: u8 = 3;
