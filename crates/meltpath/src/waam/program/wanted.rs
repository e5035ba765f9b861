//! Which programs of a plan are asked for: all of it, from a bead on, or without the arc.

use meltpath_programs::Dialect;
pub use meltpath_programs::Restart;

/// Whether the arc burns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Torch {
    /// It lays metal.
    Burns,
    /// It only moves, without pauses.
    Dry,
}

/// Which programs of a plan are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// The bead to begin with; `None` lays all.
    pub from: Option<Restart>,
    /// Whether the arc burns.
    pub torch: Torch,
}

impl Wanted {
    /// All of a plan, as it is laid.
    pub const WHOLE: Wanted = Wanted {
        from: None,
        torch: Torch::Burns,
    };

    /// What the names of its programs tell besides; empty for the whole.
    pub fn variant(self) -> String {
        let from = self.from.map(|f| format!("R{}B{}", f.layer, f.bead));
        let dry = (self.torch == Torch::Dry).then(|| "DRY".to_owned());
        let words: Vec<String> = from.into_iter().chain(dry).collect();
        words.join("_")
    }
}

/// The dialect of programs, and which of a plan's.
pub(in crate::waam) type Asked = (Dialect, Wanted);
