//! Weaves that controllers tell by their length along the path.

use meltpath_toolpath::Weave;

/// A weave as its length tells it again: its frequency in steps of 0.001 Hz, its amplitude in steps of 0.001 mm.
pub(crate) fn told(weave: &Weave) -> Weave {
    let stepped = |value: f64| (value * 1e3).round() / 1e3;
    Weave {
        frequency: stepped(weave.frequency),
        amplitude: stepped(weave.amplitude),
        ..*weave
    }
}
