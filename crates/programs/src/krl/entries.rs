//! Entries of the controller's tables of frames, as lines set them: `BASE_DATA[1]={…}`, `TOOL_DATA[1]={…}`.

use meltpath_geometry::Pose;

use crate::said_frames::Which;
use crate::scan::{bracket, strip_prefix};

/// An entry of one of the controller's tables.
pub(super) type Entry = (Which, u32);

/// An entry that a data list sets.
pub(super) struct Listed {
    pub(super) entry: Entry,
    /// Where it lies; nothing where that is not written in numbers.
    pub(super) pose: Option<Pose>,
    pub(super) line: u32,
    pub(super) text: String,
}

/// The tables' names.
pub(super) const TABLES: [(&str, Which); 2] =
    [("BASE_DATA", Which::User), ("TOOL_DATA", Which::Tool)];

/// The number in the bracket of an entry of a table.
pub(super) fn entry(text: &str, table: &str) -> Option<u32> {
    let (inner, rest) = bracket(strip_prefix(text, table)?.trim_start())?;
    rest.trim().is_empty().then(|| inner.trim().parse().ok())?
}

/// The entry that a line sets, and its value's text.
pub(super) fn set(line: &str) -> Option<(Entry, &str)> {
    let (left, value) = line.split_once('=')?;
    let (left, value) = (left.trim(), value.trim());
    let of = |(table, which): (&str, Which)| Some((which, entry(left, table)?));
    let found = TABLES.into_iter().find_map(of)?;
    Some((found, value))
}
