//! Moves of jobs, from text.

use super::positions::{Names, Of, names};
use super::words::InformWords;
use crate::program::{Speed, SpeedUnit, Termination};
use crate::scan::{finite, strip_prefix, word};

/// How a move goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Path {
    Joint,
    Straight,
    Round,
}

/// A move without a level of its own: how it ends is the controller's.
pub(super) const NO_LEVEL: &str = "no PL";

/// A move as its line says it.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) path: Path,
    /// What it calls its target.
    pub(super) names: Names,
    /// The arm goes with the station: the path in the part is the one written.
    pub(super) coordinated: bool,
    pub(super) speed: Speed,
    pub(super) termination: Termination,
    pub(super) extra: Vec<String>,
}

/// The word by which a move leads the station along.
pub(super) const STATION: &str = "+MOVJ";

/// A move; nothing where the line is none, or says more than is known here.
pub(super) fn line(text: &str, words: Option<&InformWords>) -> Option<Line> {
    let (verb, rest) = word(text)?;
    let (path, coordinated) = match verb.to_ascii_uppercase().as_str() {
        "MOVJ" => (Path::Joint, false),
        "MOVL" => (Path::Straight, false),
        "MOVC" => (Path::Round, false),
        "SMOVL" => (Path::Straight, true),
        "SMOVC" => (Path::Round, true),
        _ => return None,
    };
    let (target, mut rest) = word(rest)?;
    let mut line = Line {
        path,
        names: Names {
            robot: target.to_owned(),
            ..Names::default()
        },
        coordinated,
        // that of the welding conditions
        speed: Speed::Weld,
        termination: Termination::Other(NO_LEVEL.to_owned()),
        extra: Vec::new(),
    };
    let mut of_station = false;
    while let Some((tag, after)) = word(rest) {
        rest = after;
        if of_station {
            line.station(tag)?;
        } else if tag.eq_ignore_ascii_case(STATION) && line.names.station.is_none() {
            of_station = true;
        } else {
            line.tag(tag, words)?;
        }
    }
    let led = line.names.station.is_some();
    (led || !(of_station || coordinated)).then_some(line)
}

impl Line {
    /// Takes in a word of the arm's move; nothing where it is not known.
    fn tag(&mut self, tag: &str, words: Option<&InformWords>) -> Option<()> {
        let number =
            |prefix: &str| finite(strip_prefix(tag, prefix)?).filter(|value| *value >= 0.0);
        if let Some(value) = number("VJ=").filter(|_| self.path == Path::Joint) {
            self.speed = Speed::share(value);
        } else if let Some(value) = number("V=").filter(|_| self.path != Path::Joint) {
            let unit = words.map_or(SpeedUnit::MillimetrePerSecond, InformWords::unit);
            self.speed = Speed::Value { value, unit };
        } else if let Some(level) = strip_prefix(tag, "PL=") {
            self.termination = match level.parse::<usize>().ok()? {
                0 => Termination::Fine,
                n => match words.and_then(|w| w.distance(n)) {
                    Some(distance) => Termination::Blend(distance),
                    None => Termination::Other(format!("PL={n}")),
                },
            };
        } else if let Some(radius) = number("CR=").filter(|r| *r > 0.0) {
            self.termination = Termination::Blend(radius);
        } else if ["ACC=", "DEC=", "NWAIT"]
            .iter()
            .any(|w| strip_prefix(tag, w).is_some())
        {
            self.extra.push(tag.to_owned());
        } else if names(tag) == Some(Of::Base) && self.names.base.is_none() {
            self.names.base = Some(tag.to_owned());
        } else {
            return None;
        }
        Some(())
    }

    /// Takes in a word of the station's move; nothing where it is not known.
    fn station(&mut self, tag: &str) -> Option<()> {
        if names(tag) == Some(Of::Station) && self.names.station.is_none() {
            self.names.station = Some(tag.to_owned());
            return Some(());
        }
        let share = finite(strip_prefix(tag, "VJ=")?).filter(|share| *share >= 0.0)?;
        // a joint move gives both the same share of what they can do
        if self.speed != Speed::share(share) {
            self.extra.push(tag.to_owned());
        }
        Some(())
    }
}
