//! Frames that a program sets itself: entries of the controller's tables, `BASE_DATA[1]={…}` and `TOOL_DATA[1]={…}`, and frames that it declares.
//!
//! `$BASE=BASE_DATA[1]` takes what the entry holds there: an entry that is set to several places in a file is another frame each time.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::data::place;
use super::entries::{Entry, Listed, TABLES, entry, set};
use super::list::{List, capital};
use crate::orientation::pose;
use crate::program::Coordinates;
use crate::said_frames::Which;
use crate::scan::strip_word;

/// What a routine knows of the frames that it sets.
pub(super) struct Tables<'a> {
    list: &'a List,
    /// Entries that the file sets to several places.
    several: &'a BTreeSet<Entry>,
    /// What entries hold, as far as the lines before say it.
    now: BTreeMap<Entry, Pose>,
    /// Frames that the routine declares, and where they lie.
    variables: BTreeMap<String, Option<Pose>>,
    /// Entries that were selected as the controller has them.
    untold: BTreeSet<Entry>,
}

/// What an entry is where it is selected.
pub(super) enum Selected {
    /// As the controller has it.
    Untold,
    /// It lies there, wherever it is selected.
    Always(Pose),
    /// It lies there from the line that set it on.
    Now(Pose),
}

impl<'a> Tables<'a> {
    pub(super) fn new(list: &'a List, several: &'a BTreeSet<Entry>) -> Self {
        let known = |l: &Listed| Some((l.entry, l.pose?));
        Tables {
            list,
            several,
            now: list.entries.iter().filter_map(known).collect(),
            variables: BTreeMap::new(),
            untold: BTreeSet::new(),
        }
    }

    /// Where a value lies, frames in frames among them (`BASE_DATA[1]:{X 10,…}`); nothing where it is not known.
    pub(super) fn place(&self, which: Which, value: &str) -> Option<Pose> {
        self.lie(which, &chained(value))
    }

    /// Where frames lie, each in the one before.
    pub(super) fn lie(&self, which: Which, frames: &[&str]) -> Option<Pose> {
        let mut places = frames.iter().map(|own| self.one(which, own));
        let first = places.next()??;
        places.try_fold(first, |pose, own| Some(pose.then(own?)))
    }

    fn one(&self, which: Which, value: &str) -> Option<Pose> {
        let entry = TABLES.into_iter().find_map(|(table, which)| {
            let number = entry(value, table)?;
            Some((which, number))
        });
        if let Some(entry) = entry {
            return self.now.get(&entry).copied();
        }
        match self.variables.get(&capital(value)) {
            Some(known) => *known,
            None => place(which, value).or_else(|| of_list(self.list, value)),
        }
    }

    /// Frames that a line declares: where they lie later lines say.
    pub(super) fn declare(&mut self, line: &str) {
        let Some(rest) = strip_word(line, "DECL") else {
            return;
        };
        let names = strip_word(rest.trim_start(), "FRAME").unwrap_or_default();
        let names = names.split(',').map(capital).filter(|n| !n.is_empty());
        self.variables.extend(names.map(|name| (name, None)));
    }

    /// A frame that the routine declares is set: nothing where it is no such line, or no numbers.
    pub(super) fn assign(&mut self, line: &str) -> Option<()> {
        let (name, value) = line.split_once('=')?;
        let name = capital(name);
        self.variables.get(&name)?;
        let place = self.place(Which::User, value.trim());
        self.variables.insert(name, place);
        place.map(|_| ())
    }

    /// An entry is set: whether moves may have been made in it before, as the controller had it.
    pub(super) fn put(&mut self, entry: Entry, pose: Pose) -> bool {
        self.now.insert(entry, pose);
        self.untold.contains(&entry)
    }

    /// Whether an entry lies at several places.
    pub(super) fn is_several(&self, entry: Entry) -> bool {
        self.several.contains(&entry)
    }

    pub(super) fn selected(&mut self, entry: Entry) -> Selected {
        match self.now.get(&entry) {
            Some(pose) if self.is_several(entry) => Selected::Now(*pose),
            Some(pose) => Selected::Always(*pose),
            None => {
                self.untold.insert(entry);
                Selected::Untold
            }
        }
    }

    /// Whether lines say of an entry where it lies.
    pub(super) fn is_set(&self, entry: Entry) -> bool {
        self.now.contains_key(&entry)
    }

    /// The line of the data list that sets an entry otherwise than in numbers, while no other line does.
    pub(super) fn unread(&self, entry: Entry) -> Option<(u32, String)> {
        let mut all = self.list.entries.iter();
        let listed = all.find(|l| l.entry == entry && l.pose.is_none())?;
        let told = (listed.line, listed.text.clone());
        (!self.is_set(entry)).then_some(told)
    }
}

/// The frames of a value that lie one in the other: what stands between its operators `:`, those in braces left out.
pub(super) fn chained(value: &str) -> Vec<&str> {
    let mut depth = 0_i32;
    let operator = |c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ':' && depth == 0
    };
    value.split(operator).map(str::trim).collect()
}

/// A frame of the data list.
fn of_list(list: &List, name: &str) -> Option<Pose> {
    match list.positions.get(&capital(name))? {
        Coordinates::Cartesian {
            xyz, wpr_degrees, ..
        } => Some(pose(DVec3::from_array(*xyz), *wpr_degrees)),
        Coordinates::Joint(_) | Coordinates::Unread(_) => None,
    }
}

/// The entries that a file sets to several places, or to one that is not known before the file is read in order.
pub(super) fn several(list: &List, lines: &[&str]) -> BTreeSet<Entry> {
    let listed = list.entries.iter().map(|l| (l.entry, l.pose));
    let lines = lines.iter().filter_map(|line| {
        let (entry, value) = set(line)?;
        Some((
            entry,
            place(entry.0, value).or_else(|| of_list(list, value)),
        ))
    });
    let mut places = BTreeMap::new();
    let mut several = BTreeSet::new();
    for (entry, pose) in listed.chain(lines) {
        if *places.entry(entry).or_insert(pose) != pose || pose.is_none() {
            several.insert(entry);
        }
    }
    several
}
