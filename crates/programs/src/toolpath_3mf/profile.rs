//! A profile of a toolpath as a package says it: what is followed, what is only told, how geometry varies it.

use meltpath_toolpath::Channel;
use quick_xml::name::QName;

use super::words::Kind;
use super::xml::{Fault, Start, Words, broken, count, number, positive, words};

/// How many factors there are.
pub(super) const FACTORS: [&str; 4] = ["e", "f", "g", "h"];

/// What is not followed, and whether it shapes what is laid or marked.
pub(super) type Remark = (String, bool);

/// A value that points vary: between `least` and `most`, by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Modifier {
    pub(super) channel: Channel,
    /// Index into [`FACTORS`].
    pub(super) factor: usize,
    least: f64,
    most: f64,
}

impl Modifier {
    /// The value at a factor from 0 to 1, its ends to the last bit.
    pub(super) fn value(&self, factor: f64) -> f64 {
        if factor == 0.0 {
            self.least
        } else if factor == 1.0 {
            self.most
        } else {
            // without the digits that the product invents
            let value = self.least + factor * (self.most - self.least);
            (value * 1e9).round() / 1e9
        }
    }
}

/// A profile.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct SaidProfile {
    pub(super) uuid: String,
    pub(super) name: String,
    pub(super) deposition_speed: Option<f64>,
    pub(super) laser_speed: Option<f64>,
    pub(super) power: Option<f64>,
    pub(super) jump_speed: Option<f64>,
    pub(super) focus: Option<f64>,
    pub(super) spot_radius: Option<f64>,
    pub(super) laser: Option<u32>,
    pub(super) width: Option<f64>,
    pub(super) height: Option<f64>,
    /// Waits before and after, s.
    pub(super) waits: [Option<f64>; 2],
    pub(super) wire_feed: Option<f64>,
    /// How much corners are smoothed, 0 to 1.
    pub(super) smoothing: Option<f64>,
    /// What nobody here knows: name and value.
    pub(super) others: Vec<(String, String)>,
    pub(super) modifiers: Vec<Modifier>,
}

impl SaidProfile {
    pub(super) fn read(start: &Start<'_, '_>) -> Result<Self, Fault> {
        let mut profile = SaidProfile {
            uuid: uuid(&start.required("uuid")?)?,
            name: start.required("name")?,
            ..SaidProfile::default()
        };
        start.each(|whose, name, text| profile.take(whose, name, text))?;
        Ok(profile)
    }

    fn take(&mut self, whose: Words<'_>, name: &str, text: &str) -> Result<(), Fault> {
        let above = |with_zero| positive(name, text, with_zero).map(Some);
        let micros = || positive(name, text, true).map(|t| Some(t * 1e-6));
        match (whose, name) {
            (Words::Own, "uuid" | "name") => {}
            (Words::Own, "laserpower") => self.power = above(true)?,
            (Words::Own, "laserspeed") => self.laser_speed = above(false)?,
            (Words::Own, "jumpspeed") => self.jump_speed = above(false)?,
            (Words::Own, "laserfocus") => self.focus = Some(number(name, text)?),
            (Words::Own, "spotradius") => self.spot_radius = above(false)?,
            (Words::Own, "laserindex") => self.laser = Some(count(name, text, 0)?),
            (Words::Own, "depositionspeed") => self.deposition_speed = above(false)?,
            (Words::Own, "beadwidth") => self.width = above(false)?,
            (Words::Own, "beadheight") => self.height = above(false)?,
            (Words::Own, "prewaittime") => self.waits[0] = micros()?,
            (Words::Own, "postwaittime") => self.waits[1] = micros()?,
            (Words::Ours, "wirefeed") => self.wire_feed = above(false)?,
            (Words::Ours, "smoothing") => {
                self.smoothing = above(true)?;
                if self.smoothing > Some(1.0) {
                    return Err(broken(format!("{name}=\"{text}\" is not between 0 and 1")));
                }
            }
            (Words::Own, _) => {
                return Err(broken(format!(
                    "a profile has no attribute `{name}`, and what others add has a namespace"
                )));
            }
            (_, name) => self.others.push((name.to_owned(), text.to_owned())),
        }
        Ok(())
    }

    /// Takes in a modifier of this profile; those that are not followed are refused before any layer is read, as the specification asks.
    pub(super) fn modify(&mut self, start: &Start<'_, '_>, kind: Kind) -> Result<(), Fault> {
        let target = start.required("attribute")?;
        let how = start.required("type")?;
        let found = start.resolver.resolve_attribute(QName(&target));
        let whose = words(&found.0)?;
        let followed = match (whose, found.1.as_ref()) {
            (Words::Own, "depositionspeed") => {
                (kind != Kind::Planar).then_some((Channel::Speed, self.deposition_speed))
            }
            (Words::Own, "laserspeed") => {
                (kind == Kind::Planar).then_some((Channel::Speed, self.laser_speed))
            }
            (Words::Own, "laserpower") => {
                (kind == Kind::Planar).then_some((Channel::Power, self.power))
            }
            (Words::Ours, "wirefeed") => Some((Channel::WireFeed, self.wire_feed)),
            _ => None,
        };
        let Some((channel, nominal)) = followed.filter(|_| how == "constant") else {
            return Err(Fault::Broken(
                format!(
                    "the profile \"{}\" varies {target} along the path ({how}), which is not followed here",
                    self.name
                ),
                "export without this modifier: speed, power and wire feed are followed where they are constant along each line",
            ));
        };
        if nominal.is_none() {
            return Err(broken(format!(
                "the profile \"{}\" varies {target}, which it does not say",
                self.name
            )));
        }
        let named = start.required("factor")?;
        let factor = FACTORS.iter().position(|f| *f == named);
        let factor =
            factor.ok_or_else(|| broken(format!("factor=\"{named}\" is none of e, f, g, h")))?;
        let mut taken = self.modifiers.iter();
        if taken.any(|m| m.factor == factor || m.channel == channel) {
            return Err(broken(format!(
                "the profile \"{}\" varies {target}, or by the factor {named}, twice",
                self.name
            )));
        }
        let bound = |name: &str| number(name, &start.required(name)?);
        let (least, most) = (bound("minvalue")?, bound("maxvalue")?);
        let allowed = least > 0.0 || (least == 0.0 && channel == Channel::Power);
        if least >= most || !allowed {
            return Err(broken(format!(
                "the profile \"{}\" varies {target} between {least} and {most}: the first must be the smaller one, and a value that it may have",
                self.name
            )));
        }
        self.modifiers.push(Modifier {
            channel,
            factor,
            least,
            most,
        });
        Ok(())
    }

    /// Why the metal of a profile that deposits in space is not all that it says; each with what.
    pub(super) fn gaps(&self) -> Vec<Remark> {
        let mut all = Vec::new();
        if self.deposition_speed.is_none() {
            all.push("it says no speed (depositionspeed)".to_owned());
        }
        if self.wire_feed.is_none() {
            all.push("it says no wire feed".to_owned());
        }
        if self.waits.iter().flatten().any(|t| *t > 0.0) {
            all.push("its waits (prewaittime, postwaittime) are left out".to_owned());
        }
        if self.power.is_some_and(|p| p > 0.0) {
            all.push("its laser (laserpower) is not simulated, metal is laid by an arc".to_owned());
        }
        all.extend(self.unknown());
        all.into_iter().map(|what| (what, true)).collect()
    }

    /// What is not followed of a profile that a beam marks with in a plane.
    pub(super) fn not_followed(&self) -> Vec<Remark> {
        let mut all = Vec::new();
        if self.waits.iter().flatten().any(|t| *t > 0.0) {
            all.push("its waits (prewaittime, postwaittime) are left to the recipe".to_owned());
        }
        if let Some(focus) = self.focus.filter(|f| *f != 0.0) {
            all.push(format!("its laserfocus of {focus} mm is not followed"));
        }
        if let Some(radius) = self.spot_radius {
            all.push(format!("its spotradius of {radius} mm is left to the head"));
        }
        if self.deposition_speed.is_some() || self.wire_feed.is_some() {
            all.push("what it says of a deposited bead is not followed".to_owned());
        }
        all.extend(self.unknown());
        let shapes = all.into_iter().map(|what| (what, true));
        let left = [
            (
                self.jump_speed.is_some(),
                "its jumpspeed is left to the recipe",
            ),
            (
                self.power.is_none(),
                "it says no laserpower: that of the recipe is taken",
            ),
            (
                self.laser_speed.is_none(),
                "it says no laserspeed: that of the recipe is taken",
            ),
        ];
        let left = left.into_iter().filter(|(so, _)| *so);
        shapes
            .chain(left.map(|(_, what)| (what.to_owned(), false)))
            .collect()
    }

    fn unknown(&self) -> impl Iterator<Item = String> {
        let others = self.others.iter();
        others.map(|(name, value)| format!("what its {name}=\"{value}\" does is not known here"))
    }
}

/// A UUID in small letters.
pub(super) fn uuid(text: &str) -> Result<String, Fault> {
    let groups: Vec<&str> = text.split('-').collect();
    let hex = |g: &&str| g.bytes().all(|b| b.is_ascii_hexdigit());
    let sound = groups.iter().map(|g| g.len()).eq([8, 4, 4, 4, 12]) && groups.iter().all(hex);
    if sound {
        Ok(text.to_ascii_lowercase())
    } else {
        Err(broken(format!("uuid=\"{text}\" is no UUID")))
    }
}
