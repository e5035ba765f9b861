//! What is known of the distance at which a file's lines are to lie, and what it leaves open of what they are to fill.

use meltpath_base::number::significant;
use meltpath_base::{Check, Status};

use crate::lpbf::plan::enclosed::{BARE_ID, Doubt, Enclosure};

/// Lines farther apart than so many spots fill nothing by themselves. Ours.
const SPOTS: f64 = 2.0;
/// What says how far apart lines are to lie, or how well they are to fill.
const SAY: &str = "write [layers] hatch, the distance at which lines are to lie";
const SAY_EITHER: &str = "write [layers] hatch, the distance at which lines are to lie, or checks.fill_rate, how much of the surface they are to reach";

/// The distance of a file's lines, and who tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::lpbf) enum Apart {
    /// The job, mm.
    Said(f64),
    /// Their own lines, mm; the job says how much they are to reach.
    Judged(f64),
    /// Their own lines, mm, and nobody says how much they are to reach.
    Inferred(f64),
    /// Nobody: no two lines lie beside each other.
    Unknown,
}

impl Apart {
    /// As the job says it, or else as the lines lie, mm; `limited` where the job says how much they are to reach.
    pub(in crate::lpbf) fn of(said: Option<f64>, lines: Option<f64>, limited: bool) -> Self {
        match (said, lines) {
            (Some(hatch), _) => Apart::Said(hatch),
            (None, Some(hatch)) if limited => Apart::Judged(hatch),
            (None, Some(hatch)) => Apart::Inferred(hatch),
            (None, None) => Apart::Unknown,
        }
    }

    /// What contours tell of lines for a spot of that diameter, mm: nothing of the surface where the distance of lines is not known, nor whether
    /// they come near all of it where they tell a distance that fills nothing.
    pub(in crate::lpbf) fn leaves_open(self, mut enclosure: Enclosure, spot: f64) -> Enclosure {
        let found = enclosure.checks.iter_mut().find(|c| c.id == BARE_ID);
        let (None, Some(check)) = (&enclosure.doubt, found) else {
            return enclosure;
        };
        match self {
            Apart::Inferred(hatch) if hatch > SPOTS * spot => {
                *check = Check {
                    status: Status::CannotSay,
                    reason: format!(
                        "the file's lines lie {} mm apart, the spot is {} mm wide: whether they are to fill the surface nobody says",
                        significant(hatch, 3),
                        significant(spot, 3)
                    ),
                    remedy: Some(SAY_EITHER.to_owned()),
                    ..check.clone()
                };
            }
            Apart::Unknown if !matches!(check.status, Status::Pass | Status::NotChecked) => {
                let doubt = Doubt {
                    reason: "no two lines of the fill lie beside each other: how much of the surface they are to reach is not known".to_owned(),
                    place: check.place.clone().unwrap_or_default(),
                    remedy: SAY,
                };
                *check = doubt.leaves_open(check.clone());
                enclosure.doubt = Some(doubt);
            }
            _ => {}
        }
        enclosure
    }
}
