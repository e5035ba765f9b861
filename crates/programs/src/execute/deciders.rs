//! What FANUC programs hang on that nobody tells: registers and signals that conditions and moves read, and that no line sets from what is known.
//! All of it is named at once, by looking at the lines without executing them.

use std::collections::{BTreeMap, BTreeSet};

use super::logic::{deciding, is_logic};
use crate::fanuc_ls::parse_instruction;
use crate::program::{Dialect, Instruction, Program};
use crate::scan::bracket;

/// Names of what the cell may tell, or only the controller knows.
const NAMES: [&str; 19] = [
    "R", "PR", "AR", "DI", "DO", "RI", "RO", "GI", "GO", "AI", "AO", "SI", "SO", "UI", "UO", "WI",
    "WO", "F", "M",
];

/// What lines read, by what they set: `R[3]`, `PR[7]`, `DI[1]`.
#[derive(Debug, Default)]
pub(super) struct Depends {
    /// One entry a line that sets it.
    set: BTreeMap<String, Vec<BTreeSet<String>>>,
    /// What conditions, choices, loops and jumps read.
    pub(super) decides: BTreeSet<String>,
}

/// What a text refers to by numbers.
fn references(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut rest = text;
    while let Some(at) = rest.find('[') {
        let head = &rest[..at];
        let begins = head
            .rfind(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '$'))
            .map_or(0, |i| {
                i + head[i..].chars().next().map_or(1, char::len_utf8)
            });
        let name = head[begins..].to_ascii_uppercase();
        // what stands in the bracket is read, too
        let inner = bracket(&rest[at..]).map_or("", |(inner, _)| inner);
        let number = inner.split([':', ',']).next().unwrap_or_default().trim();
        if NAMES.contains(&&*name) && number.parse::<u32>().is_ok() {
            found.insert(format!("{name}[{number}]"));
        }
        rest = &rest[at + 1..];
    }
    found
}

impl Depends {
    /// Of all programs.
    pub(super) fn of(programs: &[Program]) -> Self {
        let mut depends = Depends::default();
        let fanuc = programs.iter().filter(|p| p.dialect == Dialect::FanucLs);
        for instruction in fanuc.flat_map(|p| &p.instructions) {
            depends.look_at(instruction, 0);
        }
        depends
    }

    fn look_at(&mut self, instruction: &Instruction, depth: usize) {
        match instruction {
            Instruction::Call { arguments, .. } => {
                for (argument, number) in arguments.split(',').zip(1..) {
                    let reads = references(argument);
                    self.set
                        .entry(format!("AR[{number}]"))
                        .or_default()
                        .push(reads);
                }
            }
            Instruction::Raw(text) if is_logic(text) => {
                let (condition, action, sets) = deciding(text);
                self.decides.extend(references(condition));
                if let Some(register) = sets {
                    let reads = references(condition);
                    let names = references(register);
                    for name in names {
                        self.set.entry(name).or_default().push(reads.clone());
                    }
                }
                // one action only follows a condition
                if let Some(action) = action.filter(|_| depth == 0) {
                    self.look_at(&parse_instruction(action), depth + 1);
                }
            }
            Instruction::Raw(text) => {
                let Some((target, value)) = text.split_once('=') else {
                    return;
                };
                // the first reference is what is set
                let name = references(
                    target
                        .get(..target.find(']').map_or(0, |i| i + 1))
                        .unwrap_or_default(),
                );
                let reads = references(value);
                for name in name {
                    self.set.entry(name).or_default().push(reads.clone());
                }
            }
            _ => {}
        }
    }

    /// What `names` hang on that no line sets, or only from itself.
    pub(super) fn roots<'n>(&self, names: impl Iterator<Item = &'n String>) -> BTreeSet<String> {
        let mut open: Vec<String> = names.cloned().collect();
        let mut seen: BTreeSet<String> = open.iter().cloned().collect();
        let mut roots = BTreeSet::new();
        while let Some(name) = open.pop() {
            let setters = self.set.get(&name).map_or(&[][..], |all| all);
            if setters.iter().all(|reads| reads.contains(&name)) {
                roots.insert(name.clone());
            }
            for read in setters.iter().flatten() {
                if seen.insert(read.clone()) {
                    open.push(read.clone());
                }
            }
        }
        roots
    }
}
