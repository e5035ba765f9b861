//! What FANUC programs hang on and nobody tells, by the cell's settings.

use std::collections::BTreeSet;

use super::deciders::Depends;
use super::{ExecutionSettings, Machine};

/// Whether the cell tells it.
fn is_told(settings: &ExecutionSettings, name: &str) -> bool {
    let Some((word, number)) = name.split_once('[') else {
        return false;
    };
    let Ok(number) = number.trim_end_matches(']').parse::<u32>() else {
        return false;
    };
    match word {
        "R" => settings.registers.contains_key(&number),
        "PR" => {
            let told = settings.positions.get(&number);
            told.is_some_and(|t| t.joints.is_some() || t.elements.iter().all(Option::is_some))
        }
        word => settings.signals.contains_key(&(word.to_owned(), number)),
    }
}

/// By name, then by number.
fn in_order(names: BTreeSet<String>) -> Vec<String> {
    let mut names: Vec<String> = names.into_iter().collect();
    names.sort_by_key(|name| {
        let (word, number) = name.split_once('[').unwrap_or((name, ""));
        let number = number.trim_end_matches(']').parse::<u32>();
        (word.to_owned(), number.unwrap_or(0))
    });
    names
}

impl Machine<'_> {
    fn depends(&self) -> &Depends {
        self.depends.get_or_init(|| Depends::of(self.programs))
    }

    /// All that conditions of the programs hang on and that nobody tells.
    pub(super) fn deciders(&self) -> Vec<String> {
        let depends = self.depends();
        self.untold(depends.roots(depends.decides.iter()))
    }

    /// What a register hangs on that nobody tells.
    pub(super) fn untold_of(&self, name: &str) -> Vec<String> {
        self.untold(self.depends().roots(std::iter::once(&name.to_owned())))
    }

    fn untold(&self, mut roots: BTreeSet<String>) -> Vec<String> {
        roots.retain(|name| !name.starts_with("AR[") && !is_told(self.settings, name));
        in_order(roots)
    }
}
