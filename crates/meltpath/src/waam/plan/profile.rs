//! How beads are laid: the profile of a plan's passes.

use meltpath_toolpath::Profile;

use crate::waam::settings::Settings;

/// That of the job's bead.
pub(in crate::waam) fn profile(settings: &Settings) -> Profile {
    Profile {
        name: "bead".to_owned(),
        speed: settings.bead.travel_speed,
        wire_feed: settings.bead.wire_feed,
        width: settings.bead.width.value,
        height: settings.bead.height.value,
        ..Profile::default()
    }
}
