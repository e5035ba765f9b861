//! Moves of jobs, from text.

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
    pub(super) target: String,
    pub(super) speed: Speed,
    pub(super) termination: Termination,
    pub(super) extra: Vec<String>,
}

/// A move; nothing where the line is none, or says more than is known here.
pub(super) fn line(text: &str, words: Option<&InformWords>) -> Option<Line> {
    let (verb, rest) = word(text)?;
    let path = match verb.to_ascii_uppercase().as_str() {
        "MOVJ" => Path::Joint,
        "MOVL" => Path::Straight,
        "MOVC" => Path::Round,
        _ => return None,
    };
    let (target, mut rest) = word(rest)?;
    let mut line = Line {
        path,
        target: target.to_owned(),
        // that of the welding conditions
        speed: Speed::Weld,
        termination: Termination::Other(NO_LEVEL.to_owned()),
        extra: Vec::new(),
    };
    while let Some((tag, after)) = word(rest) {
        rest = after;
        let number =
            |prefix: &str| finite(strip_prefix(tag, prefix)?).filter(|value| *value >= 0.0);
        if let Some(value) = number("VJ=").filter(|_| path == Path::Joint) {
            line.speed = Speed::share(value);
        } else if let Some(value) = number("V=").filter(|_| path != Path::Joint) {
            let unit = words.map_or(SpeedUnit::MillimetrePerSecond, InformWords::unit);
            line.speed = Speed::Value { value, unit };
        } else if let Some(level) = strip_prefix(tag, "PL=") {
            line.termination = match level.parse::<usize>().ok()? {
                0 => Termination::Fine,
                n => match words.and_then(|w| w.distance(n)) {
                    Some(distance) => Termination::Blend(distance),
                    None => Termination::Other(format!("PL={n}")),
                },
            };
        } else if let Some(radius) = number("CR=").filter(|r| *r > 0.0) {
            line.termination = Termination::Blend(radius);
        } else if ["ACC=", "DEC=", "NWAIT"]
            .iter()
            .any(|w| strip_prefix(tag, w).is_some())
        {
            line.extra.push(tag.to_owned());
        } else {
            return None;
        }
    }
    Some(line)
}
