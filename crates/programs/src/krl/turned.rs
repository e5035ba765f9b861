//! How the tool is turned along moves, in words of KRL: `$ORI_TYPE`, `$CIRC_TYPE`, and `ORI_TYP` and `CIRC_TYP` of the data of moves.

use super::list::{List, capital, orientation, round};
use super::parse::{assigned, called};
use crate::modal::{Orientation, Round, Sets};

/// What a line sets; nothing where it is none of these.
pub(crate) fn turns(line: &str) -> Option<Sets> {
    let along = assigned(line, "$ORI_TYPE").map(|value| Sets::Orientation(orientation(value)));
    along.or_else(|| Some(Sets::Round(round(assigned(line, "$CIRC_TYPE")?))))
}

/// What a move says of itself behind `WITH`.
pub(super) fn own_orientation(value: &str, list: &List) -> Orientation {
    match called(value, "SORI_TYP").as_deref() {
        Some([name, ..]) => list.orientation(&capital(name)),
        _ => orientation(value),
    }
}

/// See [`own_orientation`].
pub(super) fn own_round(value: &str, list: &List) -> Round {
    let data = called(value, "SCIRC_TYP").or_else(|| called(value, "SCIRC_TYPE"));
    match data.as_deref() {
        Some([name, ..]) => list.round(&capital(name)),
        _ => round(value),
    }
}

impl List {
    /// How data of moves turn the tool: as it is taught, where they do not say it.
    pub(super) fn orientation(&self, name: &str) -> Orientation {
        match self.orientations.get(name) {
            Some(said) => *said,
            None if self.tells(name) => Orientation::Taught,
            None => Orientation::Free,
        }
    }

    /// See [`List::orientation`].
    pub(super) fn round(&self, name: &str) -> Round {
        match self.rounds.get(name) {
            Some(said) => *said,
            None if self.tells(name) => Round::Frame,
            None => Round::Path,
        }
    }
}
