//! Progress and cancellation of long stages.

/// The work was cancelled by the person who started it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Watches a long stage and may ask it to stop. Implemented by the command line; [`Silent`] elsewhere.
pub trait Observer: Send + Sync {
    /// A stage begins; `total` counts its units of work (0 when not known).
    fn stage(&self, name: &str, total: u64);
    /// `done` more units of the current stage are finished.
    fn advance(&self, done: u64);
    /// Something a person should read now, before the command ends.
    fn note(&self, _text: &str) {}
    /// Whether the stage should stop as soon as it can.
    fn cancelled(&self) -> bool;

    /// `Err(Cancelled)` once cancellation was asked for: for use with `?` in loops.
    ///
    /// # Errors
    /// [`Cancelled`].
    fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled() {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }
}

/// Passes cancellation on and keeps stages and progress to itself: for many small runs inside one stage.
pub struct Quiet<'a>(pub &'a dyn Observer);

impl Observer for Quiet<'_> {
    fn stage(&self, _name: &str, _total: u64) {}
    fn advance(&self, _done: u64) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// Watches nothing and never cancels.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn stage(&self, _name: &str, _total: u64) {}
    fn advance(&self, _done: u64) {}
    fn cancelled(&self) -> bool {
        false
    }
}
