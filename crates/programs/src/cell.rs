//! How programs of a cell look: the `[program]` table of a cell file.

use meltpath_base::{Angle, Length, Ratio, Speed};
use serde::{Deserialize, Serialize};

use crate::program::{ArcAction, ArcStyle, ArcWord, SpeedUnit};

/// Frames, words, speeds and limits of the programs of one cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellProgramming {
    /// Who says so.
    pub source: String,
    /// Owner in the header.
    pub owner: String,
    /// Motion groups in the header, such as `1,*,*,*,*`.
    pub default_group: String,
    /// Lines of the application header.
    pub application: Vec<String>,
    /// User frame: the part.
    pub user_frame: u32,
    /// Tool frame: the torch, its centre point at the wire tip at the nominal contact-tube distance.
    pub tool_frame: u32,
    /// Configuration of the arm, written into every position. It is not computed.
    pub config: String,
    /// Orientation of the tool when its axis is the build direction.
    pub orientation: Orientation,
    /// Nominal distance from contact tube to work (CTWD).
    pub contact_tube_distance: Length,
    /// Words for the arc.
    pub arc: ArcWords,
    /// Unit of speeds along the path, `cm/min` or `mm/sec`.
    pub speed_unit: SpeedUnit,
    /// Decimals of these speeds.
    pub speed_decimals: u8,
    /// Speed of travels.
    pub travel_speed: Speed,
    /// Speed down to an arc start.
    pub approach_speed: Speed,
    /// Joint speed of the first move.
    pub first_move: Ratio,
    /// Height of travels above the highest surface so far.
    pub clearance: Length,
    /// Smoothing of travels.
    pub travel_smoothing: Ratio,
    /// Longest name, 8 or 32 on most controllers.
    pub name_length: usize,
    /// Most instructions in one program.
    pub lines_per_program: usize,
    /// Most positions in one program.
    pub points_per_program: usize,
}

/// W, P, R.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orientation {
    /// About the fixed x axis, first.
    pub w: Angle,
    /// About the fixed y axis, second.
    pub p: Angle,
    /// About the fixed z axis, last.
    pub r: Angle,
}

impl Orientation {
    pub(crate) fn degrees(&self) -> [f64; 3] {
        [self.w, self.p, self.r].map(|a| (a.0.to_degrees() * 1e9).round() / 1e9)
    }
}

/// How the arc is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArcWords {
    /// `arc` for `Arc Start[schedule]`, `weld` for `Weld Start[procedure,schedule]`.
    pub style: ArcStyle,
    /// Weld procedure, for `weld`.
    pub procedure: u32,
    /// Schedule of the first wire feed of a program; further wire feeds take the next ones.
    pub first_schedule: u32,
    /// How many schedules the controller has from the first one on.
    pub schedules: u32,
}

impl ArcWords {
    /// The word for a schedule.
    pub fn word(&self, action: ArcAction, schedule: u32) -> ArcWord {
        ArcWord {
            action,
            style: self.style,
            arguments: match self.style {
                ArcStyle::Arc => schedule.to_string(),
                ArcStyle::Weld => format!("{},{schedule}", self.procedure),
            },
        }
    }
}

/// Why a cell's `[program]` table cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("[program] {name} is {value}, but must be {wanted}: correct the cell file")]
pub struct CellError {
    /// The entry.
    pub name: &'static str,
    /// What it holds.
    pub value: String,
    /// What it must be.
    pub wanted: &'static str,
}

impl CellProgramming {
    /// Checks that the entries make sense.
    ///
    /// # Errors
    /// [`CellError`] naming the entry.
    pub fn check(&self) -> Result<(), CellError> {
        let check = |ok: bool, name, value: String, wanted| {
            if ok {
                Ok(())
            } else {
                Err(CellError {
                    name,
                    value,
                    wanted,
                })
            }
        };
        let moves = |v: f64| v > 0.0 && v.is_finite();
        for (name, speed) in [
            ("travel_speed", self.travel_speed),
            ("approach_speed", self.approach_speed),
        ] {
            check(moves(speed.0), name, speed.to_string(), "positive")?;
        }
        let path_unit = matches!(
            self.speed_unit,
            SpeedUnit::CentimetrePerMinute | SpeedUnit::MillimetrePerSecond
        );
        check(
            path_unit,
            "speed_unit",
            self.speed_unit.symbol().to_owned(),
            "\"cm/min\" or \"mm/sec\"",
        )?;
        check(
            self.speed_decimals <= 3,
            "speed_decimals",
            self.speed_decimals.to_string(),
            "at most 3",
        )?;
        check(
            moves(self.clearance.0),
            "clearance",
            self.clearance.to_string(),
            "positive",
        )?;
        check(
            (0.01..=1.0).contains(&self.first_move.0),
            "first_move",
            self.first_move.to_string(),
            "from \"1 %\" to \"100 %\"",
        )?;
        check(
            (0.0..=1.0).contains(&self.travel_smoothing.0),
            "travel_smoothing",
            self.travel_smoothing.to_string(),
            "from \"0 %\" to \"100 %\"",
        )?;
        check(
            self.name_length >= 8,
            "name_length",
            self.name_length.to_string(),
            "at least 8",
        )?;
        check(
            self.arc.schedules >= 1,
            "arc.schedules",
            self.arc.schedules.to_string(),
            "at least 1",
        )?;
        check(
            self.lines_per_program >= 50,
            "lines_per_program",
            self.lines_per_program.to_string(),
            "at least 50",
        )?;
        check(
            self.points_per_program >= 20,
            "points_per_program",
            self.points_per_program.to_string(),
            "at least 20",
        )
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct File {
        program: CellProgramming,
    }

    /// The programming of the shipped cell.
    pub(crate) fn arcmate() -> CellProgramming {
        let text = meltpath_data::cells::ARCMATE_120IC.text;
        toml::from_str::<File>(text).unwrap().program
    }

    #[test]
    fn the_shipped_cell_is_sound() {
        arcmate().check().unwrap();
        assert_eq!(arcmate().orientation.degrees(), [180.0, 0.0, 0.0]);
    }

    #[test]
    fn unsound_tables_are_refused_by_name() {
        let refused = |change: fn(&mut CellProgramming)| {
            let mut cell = arcmate();
            change(&mut cell);
            cell.check().unwrap_err().name
        };
        assert_eq!(refused(|c| c.travel_speed.0 = 0.0), "travel_speed");
        assert_eq!(refused(|c| c.speed_unit = SpeedUnit::Percent), "speed_unit");
        assert_eq!(refused(|c| c.clearance.0 = f64::NAN), "clearance");
        assert_eq!(refused(|c| c.lines_per_program = 3), "lines_per_program");
    }

    #[test]
    fn weld_words_carry_their_procedure() {
        let mut arc = arcmate().arc;
        arc.style = ArcStyle::Weld;
        assert_eq!(arc.word(ArcAction::End, 3).to_string(), "Weld End[1,3]");
        assert_eq!(arc.word(ArcAction::End, 3).schedule(), Some(3));
    }
}
