//! Which of many layers are alike, so that each kind is made once.

use rayon::prelude::*;

use crate::error::PlanError;

/// Which of many are alike.
pub(crate) struct Alike {
    /// The first of each kind.
    pub(crate) firsts: Vec<usize>,
    /// The kind of each.
    pub(crate) kind: Vec<usize>,
}

impl Alike {
    /// Of `count`, each held against the first of every kind, the latest before.
    pub(crate) fn of(count: usize, are_alike: impl Fn(usize, usize) -> bool) -> Self {
        let mut alike = Alike {
            firsts: Vec::new(),
            kind: Vec::with_capacity(count),
        };
        for i in 0..count {
            let known = alike.firsts.iter().rposition(|&first| are_alike(i, first));
            alike.kind.push(known.unwrap_or(alike.firsts.len()));
            if known.is_none() {
                alike.firsts.push(i);
            }
        }
        alike
    }

    /// What `make` has for each kind, from its first and how many there are, in parallel.
    pub(crate) fn each<T: Send>(
        &self,
        make: impl Fn(usize, u64) -> Result<T, PlanError> + Sync,
    ) -> Result<Vec<T>, PlanError> {
        let mut counts = vec![0; self.firsts.len()];
        for &kind in &self.kind {
            counts[kind] += 1;
        }
        let kinds = self.firsts.par_iter().zip(counts);
        let made: Vec<Result<T, PlanError>> =
            kinds.map(|(&first, count)| make(first, count)).collect();
        made.into_iter().collect()
    }
}
