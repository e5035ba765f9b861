//! What a move says of itself alone, behind `WITH`: `SLIN XP1 WITH $VEL=SVEL_CP(0.3, , LCPDAT1), $TOOL=STOOL2(FP1), $ACC=SACC_CP(LCPDAT1) C_SPL`.

use super::data::fields;
use super::list::{List, capital, holds};
use super::parse::{Routine, Verb, called};
use super::set::{acceleration, acceleration_of, only, speed_of};
use super::turned::{own_orientation, own_round};
use crate::acceleration::Acceleration;
use crate::modal::{Own, Said};
use crate::said_frames::Which;
use crate::scan::{arguments, number, strip_prefix, tidy};

/// Variables whose values leave the path of the torch's tip and its speed as they are, up to their bracket or point: loads,
/// jerk, monitoring.
const PASSIVE: [&str; 4] = ["$LOAD", "$JERK", "$GEAR_JERK", "$COLLMON_TOL_PRO"];
/// Those of joint moves beside.
const OF_JOINTS: [&str; 2] = ["$VEL_AXIS", "$ACC_AXIS"];

/// A move's text, the clauses behind its `WITH`, and how it ends.
pub(super) struct Parts<'t> {
    pub(super) text: &'t str,
    pub(super) clauses: Vec<&'t str>,
    pub(super) ending: Option<&'t str>,
}

/// Takes a move apart.
pub(super) fn parts(text: &str) -> Parts<'_> {
    let Some(at) = text.to_ascii_uppercase().find(" WITH ") else {
        return Parts {
            text,
            clauses: Vec::new(),
            ending: None,
        };
    };
    let (text, with) = (&text[..at], text[at + " WITH ".len()..].trim());
    let mut end = with.len();
    let mut ending = None;
    while let Some((before, last)) = with[..end].trim_end().rsplit_once(char::is_whitespace) {
        if strip_prefix(last, "C_").is_none() {
            break;
        }
        (end, ending) = (before.len(), Some(last));
    }
    Parts {
        text,
        clauses: arguments(with[..end].trim()),
        ending,
    }
}

/// The name in front of `.field`.
fn of_field(value: &str, field: &str) -> Option<String> {
    let name = capital(value);
    name.strip_suffix(field).map(str::to_owned)
}

impl Routine<'_> {
    /// What a move says of itself, and the clauses of which that is not known; nothing where these may change where it goes.
    pub(super) fn own(
        &mut self,
        clauses: &[&str],
        verb: Verb,
        list: &List,
    ) -> Option<(Own, Vec<String>)> {
        let (mut own, mut unknown) = (Own::default(), Vec::new());
        for clause in clauses {
            let (name, value) = clause.split_once('=')?;
            let (name, value) = (capital(name), value.trim());
            let known = match name.as_str() {
                "$BASE" => {
                    own.frames.0 = Some(self.own_frame(Which::User, value, list)?);
                    true
                }
                "$TOOL" => {
                    own.frames.1 = Some(self.own_frame(Which::Tool, value, list)?);
                    true
                }
                "$IPO_MODE" => {
                    self.own_mode(value, list)?;
                    true
                }
                _ => drives(&mut own, (&name, value), verb, list).is_some(),
            };
            if !known {
                unknown.push(tidy(clause));
            }
        }
        Some((own, unknown))
    }

    /// The number of a frame that a move names for itself.
    fn own_frame(&mut self, which: Which, value: &str, list: &List) -> Option<u32> {
        let of = |name: &str| list.frames.get(name).copied();
        match which {
            Which::User => {
                self.couple(None)?;
                if let Some(all) = called(value, "SBASE") {
                    let name = of_field(all.first()?, ".BASE_NO")?;
                    let number = of(&name)?.0?;
                    return Some(self.numbered((which, number)));
                }
                self.selected(which, ("BASE_DATA", value))
            }
            Which::Tool => {
                let data = called(value, "STOOL2").or_else(|| called(value, "STOOL"));
                if let Some(all) = data {
                    let name = capital(all.first()?);
                    let name = name.strip_suffix(".TOOL_NO").unwrap_or(&name);
                    let number = of(name)?.1?;
                    return Some(self.numbered((which, number)));
                }
                self.selected(which, ("TOOL_DATA", value))
            }
        }
    }

    /// What the robot holds along a move that says it for itself.
    fn own_mode(&mut self, value: &str, list: &List) -> Option<()> {
        let said = match called(value, "SIPO_MODE") {
            Some(all) => {
                let name = of_field(all.first()?, ".IPO_FRAME")?;
                list.frames.get(&name)?;
                list.holds.get(&name).copied()
            }
            None => Some(holds(value)?),
        };
        self.hold(said);
        Some(())
    }
}

/// A clause of how a move is driven; nothing where it is none that is known.
fn drives(own: &mut Own, (name, value): (&str, &str), verb: Verb, list: &List) -> Option<()> {
    match name {
        "$VEL" | "$VEL.CP" => {
            let speed = match called(value, "SVEL_CP") {
                // the second says how fast it turns
                Some(all) if all.get(1).is_none_or(|turns| turns.is_empty()) => *all.first()?,
                Some(_) => return None,
                None if fields(value).is_some() => {
                    only(value, "CP")?;
                    value.trim_matches(['{', '}']).trim().get(2..)?.trim()
                }
                None => value,
            };
            own.speed = Some(speed_of(speed, list));
        }
        "$ACC" => {
            own.acceleration = Said::As(match called(value, "SACC_CP") {
                Some(all) => acceleration_of(list, &capital(all.first()?)),
                None => Some(acceleration(value, &format!("{name}={value}"))),
            });
        }
        "$ACC.CP" => {
            let words = format!("{name}={value}");
            own.acceleration = Said::As(Some(Acceleration::metres(value, &words)));
        }
        "$APO" => {
            let data = called(value, "SAPO").or_else(|| called(value, "SAPO_PTP"));
            own.distance = Said::As(match data {
                Some(all) => list.distances.get(&capital(all.first()?)).copied(),
                None => Some(only(value, "CDIS")?),
            });
        }
        "$ORI_TYPE" => own.orientation = Some(own_orientation(value, list)),
        "$CIRC_TYPE" => own.round = Some(own_round(value, list)),
        "$APO.CDIS" => own.distance = Said::As(Some(number(value)?.0)),
        _ => {
            let base = name.split(['[', '.']).next().unwrap_or(name);
            let joint = verb == Verb::Joint && OF_JOINTS.contains(&base);
            if let Some(all) = called(value, "SVEL_JOINT").filter(|_| joint) {
                own.joints = number(all.first()?).map(|(share, _)| share);
            }
            return (joint || PASSIVE.contains(&base)).then_some(());
        }
    }
    Some(())
}
