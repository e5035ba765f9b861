//! Where a job is built: its settings, and what stands there before anything is laid.

use crate::waam::drive::solids::Standing;
use crate::waam::settings::Settings;

/// Where a job is built.
#[derive(Clone, Copy)]
pub(in crate::waam) struct Site<'a> {
    /// The job's.
    pub(in crate::waam) settings: &'a Settings,
    /// What layers that are not flat stand on; nothing of flat ones, which stand on their plate.
    pub(in crate::waam) standing: Option<&'a Standing>,
}

impl<'a> Site<'a> {
    /// Of flat layers on a plate.
    pub(in crate::waam) fn flat(settings: &'a Settings) -> Self {
        Site {
            settings,
            standing: None,
        }
    }
}
