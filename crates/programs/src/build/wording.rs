//! How a controller and its cell say what a toolpath asks for: schedules, arc words, smoothing, speeds.

use meltpath_base::Ratio;

use super::error::BuildError;
use crate::cell::{CellProgramming, WeldSchedule};
use crate::inform::{InformWords, zone_near};
use crate::program::{
    ArcAction, ArcStyle, ArcWord, Dialect, Instruction, Speed, SpeedUnit, Termination,
};
use crate::rapid::RapidWords;
use crate::reserved::is_reserved;

/// Shortest wait that can be written, s.
pub(super) const SHORTEST_WAIT: f64 = 0.01;
/// What programs hold no digits for, mm: points closer than this are one.
pub(super) const RESOLUTION: f64 = 1e-3;
/// Wire feeds that differ by less are one, mm/s: half of what comments show.
const SAME_FEED: f64 = 0.005 / 0.06;

/// The words of one controller.
#[derive(Clone, Copy)]
pub(super) struct Wording<'a> {
    pub(super) cell: &'a CellProgramming,
    pub(super) dialect: Dialect,
}

impl<'a> Wording<'a> {
    /// # Errors
    /// [`BuildError`] where the cell does not say what the dialect needs.
    pub(super) fn new(cell: &'a CellProgramming, dialect: Dialect) -> Result<Self, BuildError> {
        check_cell(cell, dialect)?;
        Ok(Wording { cell, dialect })
    }

    /// The schedule of the cell that sets a wire feed, mm/s.
    pub(super) fn listed(&self, wire_feed: f64) -> Option<&'a WeldSchedule> {
        let off = |s: &WeldSchedule| (s.wire_feed.0 - wire_feed).abs();
        let near = self.called().filter(|s| off(s) <= SAME_FEED);
        near.min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// The schedules of the cell that arc words can call.
    fn called(&self) -> impl Iterator<Item = &'a WeldSchedule> {
        let arc = &self.cell.arc;
        let weld = self.dialect == Dialect::FanucLs && *arc.style == ArcStyle::Weld;
        let own = weld.then_some(*arc.procedure);
        let of_procedure = move |s: &&WeldSchedule| match (own, *s.procedure) {
            (Some(own), Some(said)) => own == said,
            _ => true,
        };
        self.cell.schedules.iter().filter(of_procedure)
    }

    /// The number of the schedule that sets a wire feed, mm/s: of a FANUC that lists none for it the first of its range that no other wire
    /// feed has; `taken` tells which of them are.
    pub(super) fn number(&self, wire_feed: f64, taken: impl Fn(u32) -> bool) -> Option<u32> {
        if let Some(listed) = self.listed(wire_feed) {
            return Some(*listed.number);
        }
        if self.dialect != Dialect::FanucLs {
            return None;
        }
        let first = *self.cell.arc.first_schedule;
        let mut range = first..first.saturating_add(*self.cell.arc.schedules);
        range.find(|n| !taken(*n) && self.called().all(|s| *s.number != *n))
    }

    /// The arc word for a schedule.
    pub(super) fn word(&self, action: ArcAction, schedule: u32) -> ArcWord {
        if self.dialect == Dialect::FanucLs {
            return self.cell.arc.word(action, schedule);
        }
        let listed = self.cell.schedules.iter().find(|s| *s.number == schedule);
        ArcWord {
            action,
            style: ArcStyle::Arc,
            arguments: listed.map_or_else(String::new, WeldSchedule::arguments),
        }
    }

    /// Whether the arm must stand where the arc is set anew: outputs are switched at once, moves are queued.
    pub(super) fn stands_for_arc(&self) -> bool {
        self.dialect == Dialect::Val3
    }

    /// How a move ends that is smoothed by a share.
    pub(super) fn smoothed(&self, share: Ratio) -> Termination {
        if self.dialect == Dialect::FanucLs {
            return Termination::Cnt((share.0 * 100.0).round().clamp(0.0, 100.0) as u8);
        }
        let full = self.cell.blend.map_or(0.0, |b| b.0);
        let distance = (share.0.clamp(0.0, 1.0) * full / RESOLUTION).round() * RESOLUTION;
        let distance = match self.dialect {
            // the controller has a few
            Dialect::Inform if distance >= RESOLUTION => {
                zone_near(self.cell.inform.as_ref(), distance)
            }
            _ => distance,
        };
        if distance >= RESOLUTION {
            Termination::Blend(distance)
        } else {
            Termination::Fine
        }
    }

    /// A speed along the path, mm/s, in the cell's unit and digits; for most other controllers than FANUC's in µm/s.
    pub(super) fn speed(&self, mm_per_second: f64) -> Speed {
        if self.dialect == Dialect::Inform {
            let unit = self.cell.inform.as_ref();
            return Self::in_digits(mm_per_second, unit.map(InformWords::unit), 1);
        }
        if self.dialect != Dialect::FanucLs {
            return Speed::path((mm_per_second / RESOLUTION).round() * RESOLUTION);
        }
        let unit = SpeedUnit::from(*self.cell.speed_unit);
        Self::in_digits(mm_per_second, Some(unit), *self.cell.speed_decimals)
    }

    /// Shows people a text while the program runs.
    pub(super) fn shown(&self, text: &str) -> Instruction {
        Instruction::Raw(match self.dialect {
            Dialect::FanucLs => format!("MESSAGE[{text}]"),
            Dialect::Krl => format!("MsgNotify(\"{text}\")"),
            Dialect::Rapid => format!("TPWrite \"{text}\""),
            Dialect::UrScript => format!("textmsg(\"{text}\")"),
            Dialect::Inform => format!("MSG \"{text}\""),
            Dialect::Val3 => format!("logMsg(\"{text}\")"),
        })
    }

    /// Waits for the input that tells that the layer has cooled.
    ///
    /// # Errors
    /// [`BuildError::Cell`] where the cell does not say which, as this controller has it.
    pub(super) fn until_cooled(&self) -> Result<Vec<Instruction>, BuildError> {
        let missing = |key| BuildError::Cell {
            what: "the input that tells that a layer has cooled",
            dialect: self.dialect.name(),
            key,
        };
        let cooled = self.cell.cooled.as_ref();
        let cooled = cooled.ok_or_else(|| missing("cooled"))?;
        let number = || {
            let number = cooled.input.ok_or_else(|| missing("cooled.input"))?;
            let (wanted, known) = match self.dialect {
                Dialect::UrScript => ("0 to 7, a standard digital input", number <= 7),
                _ => ("1 or more, as inputs are counted there", number > 0),
            };
            known.then_some(number).ok_or(BuildError::Word {
                key: "cooled.input",
                text: number.to_string(),
                dialect: self.dialect.name(),
                wanted,
            })
        };
        let name = || cooled.name.as_ref().ok_or_else(|| missing("cooled.name"));
        let lines = match self.dialect {
            Dialect::FanucLs => vec![format!("WAIT DI[{}]=ON", number()?)],
            Dialect::Krl => vec![format!("WAIT FOR $IN[{}]", number()?)],
            Dialect::Rapid => vec![format!("WaitDI {},1", name()?)],
            Dialect::Inform => vec![format!("WAIT IN#({})=ON", number()?)],
            Dialect::UrScript => vec![
                format!("while (get_standard_digital_in({}) == False):", number()?),
                "sync()".to_owned(),
                "end".to_owned(),
            ],
            Dialect::Val3 => vec![format!("wait({})", name()?)],
        };
        Ok(lines.into_iter().map(Instruction::Raw).collect())
    }

    fn in_digits(mm_per_second: f64, unit: Option<SpeedUnit>, decimals: u32) -> Speed {
        let unit = unit.unwrap_or(SpeedUnit::MillimetrePerSecond);
        let per = match unit {
            SpeedUnit::CentimetrePerMinute => 6.0,
            _ => 1.0,
        };
        let scale = 10_f64.powi(decimals.cast_signed());
        let value = (mm_per_second * per * scale).round() / scale;
        Speed::Value { value, unit }
    }
}

/// Whether the cell says what programs of a dialect need, whatever their plan.
///
/// # Errors
/// [`BuildError`] naming the first key that is missing.
pub fn check_cell(cell: &CellProgramming, dialect: Dialect) -> Result<(), BuildError> {
    let (key, what, known) = match dialect {
        Dialect::FanucLs => return Ok(()),
        Dialect::Krl => ("krl", "what ArcTech is given", cell.krl.is_some()),
        Dialect::Rapid => (
            "rapid",
            "the names of tool, work object and seam",
            cell.rapid.is_some(),
        ),
        Dialect::UrScript => (
            "script",
            "where the part lies and what switches the arc",
            cell.script.is_some(),
        ),
        Dialect::Inform => ("inform", "the zones of PL", cell.inform.is_some()),
        Dialect::Val3 => (
            "val3",
            "where part and torch lie and what switches the arc",
            cell.val3.is_some(),
        ),
    };
    let blend = (
        "blend",
        "at which distance a path is left that is smoothed in full",
        cell.blend.is_some(),
    );
    for (key, what, known) in [(key, what, known), blend] {
        if !known {
            return Err(BuildError::Cell {
                what,
                dialect: dialect.name(),
                key,
            });
        }
    }
    if let (Dialect::Rapid, Some(words)) = (dialect, cell.rapid.as_ref()) {
        check_names(words)?;
    }
    for s in cell.schedules.iter().filter(|s| !s.values.is_empty()) {
        let fed: Vec<f64> = s
            .values
            .iter()
            .zip(cell.arc_values.iter())
            .filter_map(|(value, meaning)| (meaning.feed() > 0.0).then_some(value * meaning.feed()))
            .collect();
        let agrees = fed.iter().all(|f| (f - s.wire_feed.0).abs() <= SAME_FEED);
        if s.values.len() != cell.arc_values.len() || !agrees {
            return Err(BuildError::Values {
                number: *s.number,
                wire_feed: s.wire_feed.0,
            });
        }
    }
    Ok(())
}

/// Whether the names of an ABB's data are names there.
fn check_names(words: &RapidWords) -> Result<(), BuildError> {
    // ABB, Technical reference manual RAPID Overview: identifiers
    const LONGEST: usize = 32;
    for (key, name) in [
        ("rapid.tool", &words.tool),
        ("rapid.work_object", &words.work_object),
        ("rapid.seam", &words.seam),
    ] {
        let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let name_of_data = name.len() <= LONGEST
            && name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(letters)
            && !is_reserved(Dialect::Rapid, &name.to_ascii_uppercase());
        if !name_of_data {
            return Err(BuildError::Word {
                key,
                text: format!("\"{}\"", **name),
                dialect: Dialect::Rapid.name(),
                wanted: "a name there: at most 32 letters, digits and underscores, a letter first, and no word of RAPID",
            });
        }
    }
    Ok(())
}
