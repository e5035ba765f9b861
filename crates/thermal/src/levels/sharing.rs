//! Tiles of a step shared by threads.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

/// Tiles below which one thread is faster than handing work to others, these being awake ([`beside`]). Chosen: half and twice as many, with as
/// many at a time, take as long within the scatter of a virtual machine.
const WORTH_SHARING: usize = 8;
/// Tiles that one thread takes at a time, at least.
const AT_A_TIME: usize = 3;

/// Does `work` on each of `all`, on several threads where there is enough of it: what each does is its own, in any order.
pub(super) fn share<T: Send>(all: Vec<T>, work: impl Fn(T) + Sync + Send) {
    if all.len() >= WORTH_SHARING && rayon::current_num_threads() > 1 {
        let several = all.into_par_iter().with_min_len(AT_A_TIME);
        several.for_each(work);
    } else {
        all.into_iter().for_each(work);
    }
}

/// Does `work` with one more thread awake, if there is one to spare: steps of some 0.1 ms are shared by threads that look for work all the
/// time; one that sleeps is woken too late for them.
pub(super) fn beside<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    /// Tells the other thread that the work has ended, also where it ends by a panic.
    struct Ended<'a>(&'a AtomicBool);
    impl Drop for Ended<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Release);
        }
    }
    let ended = AtomicBool::new(false);
    let looking = || {
        while !ended.load(Ordering::Acquire) {
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                // another program's thread that has work goes before
                std::thread::yield_now();
            }
        }
    };
    let working = || {
        let _ended = Ended(&ended);
        work()
    };
    if rayon::current_num_threads() > 1 {
        rayon::join(working, looking).0
    } else {
        working()
    }
}
