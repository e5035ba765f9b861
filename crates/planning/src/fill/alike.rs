//! Which of many layers are alike, so that each kind is made once.

/// The kinds of `count` layers, each with its layers in order: every one is held against the first of every kind, the latest before.
pub(crate) fn alike(count: usize, are_alike: impl Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut kinds: Vec<Vec<usize>> = Vec::new();
    for i in 0..count {
        match kinds.iter().rposition(|kind| are_alike(i, kind[0])) {
            Some(known) => kinds[known].push(i),
            None => kinds.push(vec![i]),
        }
    }
    kinds
}
