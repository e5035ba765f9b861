//! Frames while a routine is read: lines that set them, and those that select them.

use super::entries::{self, Entry, entry};
use super::parse::Routine;
use super::tables::{Selected, chained};
use super::{COUPLED, coupled};
use crate::program::{Instruction, TOOL, USER_FRAME};
use crate::said_frames::{Changed, SetFrame, Which, written_out};
use crate::scan::tidy;

/// Numbers from here on are those of frames that lie in unknown ones; no program writes out so many.
const UNKNOWN: u32 = 1_000_001;

impl Routine<'_> {
    /// A line that sets a frame where it lies; nothing where it is none, or not in numbers.
    pub(super) fn sets_frame(&mut self, line: &str) -> Option<()> {
        if self.tables.assign(line).is_some() {
            let at = self.out.program.instructions.len();
            self.out.program.said_frames.variables.insert(at);
            self.out.keep(line);
            return Some(());
        }
        let (entry, value) = entries::set(line)?;
        let pose = self.tables.place(entry.0, value)?;
        let said = &mut self.out.program.said_frames;
        said.set.push(SetFrame {
            at: Some(self.out.program.instructions.len()),
            which: entry.0,
            number: entry.1,
            pose,
            line: self.out.line,
            text: line.to_owned(),
        });
        if self.tables.put(entry, pose) {
            said.changed.push(Changed {
                program: self.out.program.name.clone(),
                line: self.out.line,
                text: line.to_owned(),
            });
        }
        self.out.keep(line);
        Some(())
    }

    /// The number of a frame that a line selects: an entry of its table, or a frame that is written out or declared.
    pub(super) fn selected(&mut self, which: Which, (table, value): (&str, &str)) -> Option<u32> {
        if let Some(number) = entry(value, table) {
            return Some(self.numbered((which, number)));
        }
        let Some(pose) = self.tables.place(which, value) else {
            return self.unknown(which, value);
        };
        let said = &mut self.out.program.said_frames;
        Some(written_out(said.of_mut(which), pose))
    }

    /// The number of a frame that lies in one of which the program does not say where that is: moves are told in that one where it is a base of the
    /// controller's and the rest is numbers, else its line is told. Nothing of other values.
    fn unknown(&mut self, which: Which, value: &str) -> Option<u32> {
        let parts = chained(value);
        let (first, rest) = parts.split_first().filter(|(_, rest)| !rest.is_empty())?;
        let within = entry(first, "BASE_DATA").filter(|_| which == Which::User);
        let within = within.zip(self.tables.lie(which, rest));
        let (what, name) = match which {
            Which::User => (USER_FRAME, tidy(value)),
            Which::Tool => (TOOL, tidy(value)),
        };
        let known = self.unknown.iter().position(|known| *known == name);
        let at = known.unwrap_or(self.unknown.len());
        let number = UNKNOWN + at as u32;
        if known.is_none() {
            self.out.program.name_frame(what, number, &name);
            match within {
                Some((base, lies)) => {
                    let base = self.numbered((which, base));
                    let said = &mut self.out.program.said_frames;
                    said.told_in.insert(number, (base, lies));
                }
                None => self.unread(&name),
            }
            self.unknown.push(name);
        }
        Some(number)
    }

    /// The number of an entry that is selected: its own, where it does not lie elsewhere on other lines.
    pub(super) fn numbered(&mut self, (which, n): Entry) -> u32 {
        let said = &mut self.out.program.said_frames;
        match self.tables.selected((which, n)) {
            Selected::Now(pose) => return written_out(said.of_mut(which), pose),
            Selected::Always(pose) => drop(said.of_mut(which).insert(n, pose)),
            Selected::Untold => {
                let told = self.tables.unread((which, n));
                if let Some(told) = told.filter(|told| !said.unread.contains(told)) {
                    said.unread.push(told);
                }
            }
        }
        n
    }

    /// Where the frame of the line being read lies is not known.
    pub(super) fn unread(&mut self, line: &str) {
        let told = (self.out.line, line.to_owned());
        self.out.program.said_frames.unread.push(told);
    }

    /// The base turns with a machine, or lies still; nothing where it did otherwise before.
    pub(super) fn couple(&mut self, machine: Option<u32>) -> Option<()> {
        let own = machine.map(coupled);
        let known = self.out.program.attribute(COUPLED);
        if known == own.as_ref().map(|a| a.value.as_str()) {
            return Some(());
        }
        let first = known.is_none() && self.frames.0.is_none();
        self.out.program.attributes.push(own.filter(|_| first)?);
        Some(())
    }

    pub(super) fn tool(&mut self, n: u32) {
        if self.frames.1 != Some(n) || self.called.1 {
            self.called.1 = false;
            self.frames.1 = Some(n);
            self.out.push(Instruction::ToolFrame(n));
        }
    }

    pub(super) fn frame(&mut self, n: u32) {
        if self.frames.0 != Some(n) || self.called.0 {
            self.called.0 = false;
            self.frames.0 = Some(n);
            self.out.push(Instruction::UserFrame(n));
        }
    }
}
