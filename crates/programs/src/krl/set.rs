//! Lines that set speed, acceleration and rounding for the moves to come: in the routine that is read, and where programs call each other.

use super::data::{fields, number_of};
use super::list::{List, capital};
use super::parse::{Routine, assigned, called};
use crate::acceleration::Acceleration;
use crate::collected::scaled;
use crate::expression::{Memory, Names, Quotient};
use crate::held::Holds;
use crate::modal::{SetSpeed, Sets};
use crate::scan::{finite, number, tidy};

/// The speed of weld data, as programs name it.
const OF_DATA: &str = ".WELD.VELOCITY";

/// A speed of so many m/s, mm/s: a number, or what plain numbers come to.
fn metres(text: &str) -> Option<f64> {
    let plain = Memory {
        names: Names {
            // whole numbers divide to whole ones
            quotient: Quotient::Unknown,
            ..Names::default()
        },
        ..Memory::default()
    };
    let value = finite(text).or_else(|| plain.number(text))?;
    (value > 0.0).then(|| scaled(value, 1000.0))
}

/// The speed that a value stands for.
pub(super) fn speed_of(value: &str, list: &List) -> SetSpeed {
    if value.eq_ignore_ascii_case("gArcBasVelDefinition") {
        return SetSpeed::Weld;
    }
    let name = capital(value);
    let of_data = name.strip_suffix(OF_DATA);
    let weld = of_data.and_then(|name| list.welds.get(name));
    let known = metres(value).or_else(|| weld.map(|weld| weld.speed));
    known.map_or_else(|| SetSpeed::Other(tidy(value)), SetSpeed::Path)
}

/// What an aggregate of one field says: `{CP 0.01}`.
pub(super) fn only(value: &str, field: &str) -> Option<f64> {
    let all = fields(value)?;
    number_of(&all, field).filter(|_| all.len() == 1)
}

/// The acceleration that data of moves say; in words where nobody tells these.
pub(super) fn acceleration_of(list: &List, name: &str) -> Option<Acceleration> {
    match list.accelerations.get(name) {
        Some(share) => Acceleration::share(*share, &format!("ACC {share} of {name}")),
        None if list.tells(name) => None,
        None => Some(Acceleration::Words(format!("ACC of {name}"))),
    }
}

/// What an assignment to `$ACC` says, in m/s².
pub(super) fn acceleration(value: &str, words: &str) -> Acceleration {
    match only(value, "CP") {
        Some(told) => Acceleration::metres(&told.to_string(), words),
        None => Acceleration::Words(words.to_owned()),
    }
}

impl Routine<'_> {
    /// The line being read sets something.
    pub(super) fn says(&mut self, set: Sets) {
        let at = self.out.program.instructions.len();
        let sets = &mut self.out.program.modal.sets;
        sets.entry(at).or_default().push(set);
    }

    pub(super) fn velocity(&mut self, value: &str, list: &List) {
        self.drives(speed_of(value, list));
    }

    fn drives(&mut self, speed: SetSpeed) {
        self.speed = Some(speed.clone());
        self.says(Sets::Speed(speed));
    }

    /// Joints go at this share of their speeds, %.
    pub(super) fn joints(&mut self, share: f64) {
        self.joint_speed = (share > 0.0).then_some(share);
        if share > 0.0 {
            self.says(Sets::Joints(share));
        }
    }

    /// Corners are left at this distance, mm, where it is known.
    pub(super) fn blends(&mut self, distance: Option<f64>) {
        self.distance = distance;
        self.says(Sets::Distance(distance));
    }

    /// Moves go by these data (`LDAT_ACT`).
    pub(super) fn moves_by(&mut self, name: &str, list: &List) {
        self.blends(list.distances.get(name).copied());
        self.gains(acceleration_of(list, name));
        self.says(Sets::Orientation(list.orientation(name)));
        self.says(Sets::Round(list.round(name)));
    }

    fn gains(&mut self, acceleration: Option<Acceleration>) {
        self.acceleration.clone_from(&acceleration);
        self.says(Sets::Acceleration(acceleration));
    }

    /// What a line, which is kept all the same, says of how quickly moves gain their speed.
    pub(super) fn accelerates(&mut self, line: &str) {
        if let Some(value) = assigned(line, "$ACC.CP") {
            self.gains(Some(Acceleration::metres(value, line)));
        } else if let Some(value) = assigned(line, "$ACC") {
            self.gains(Some(acceleration(value, line)));
        }
        let all = called(line, "BAS").unwrap_or_default();
        let [which, value] = all[..] else {
            return;
        };
        match capital(which).as_str() {
            "#INITMOV" => {
                self.gains(None);
                self.says(Sets::Usual);
                // the controller's own, which nobody tells
                self.drives(SetSpeed::Other(format!("set by {}", tidy(line))));
                // whether it sets the interpolation back is the controller's
                if self.holds == Some(Holds::Part) {
                    self.holds = None;
                    self.out.keep("$IPO_MODE after BAS(#INITMOV,0)");
                }
            }
            "#ACC_CP" => {
                let share = number(value).map_or(0.0, |(share, _)| share);
                self.gains(Acceleration::share(share, line));
            }
            _ => {}
        }
    }
}
