//! How programs of a cell look: the `[program]` table of a cell file.

use meltpath_base::{Angle, Length, Ratio, Speed};
use serde::{Deserialize, Serialize};

use crate::execute::{ExecutionSettings, WeldSettings};
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
    /// What the weld schedules of the controller set: programs of others are simulated with these.
    #[serde(rename = "schedule", skip_serializing_if = "Vec::is_empty", default)]
    pub schedules: Vec<WeldSchedule>,
    /// Registers that programs of others read before they set them.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub registers: Vec<Register>,
    /// Programs of the cell that lay no metal, such as a torch cleaning: calls to them are passed over.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub passed_over: Vec<String>,
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

/// A weld schedule of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeldSchedule {
    /// Its number.
    pub number: u32,
    /// Programmed wire feed speed.
    pub wire_feed: Speed,
    /// Meaning of `WELD_SPEED` with it.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub travel_speed: Option<Speed>,
}

/// A numeric register of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Register {
    /// Its number.
    pub number: u32,
    /// Its content.
    pub value: f64,
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

/// Fastest speed, mm/s, and greatest clearance, mm, that a cell has.
const FASTEST: f64 = 1e3;

impl CellProgramming {
    /// What the controller knows and programs of others do not say; `assumed_speed` (mm/s) stands for speeds that nothing says.
    pub fn execution(&self, assumed_speed: f64) -> ExecutionSettings {
        let set = |s: &WeldSchedule| WeldSettings {
            wire_feed: s.wire_feed.0,
            speed: s.travel_speed.map(|v| v.0),
        };
        let capital = |name: &String| name.to_ascii_uppercase();
        ExecutionSettings {
            registers: self.registers.iter().map(|r| (r.number, r.value)).collect(),
            schedules: self.schedules.iter().map(|s| (s.number, set(s))).collect(),
            assumed_speed,
            passed_over: self.passed_over.iter().map(capital).collect(),
        }
    }

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
        let moves = |v: f64| v > 0.0 && v <= FASTEST;
        for schedule in &self.schedules {
            let feed = schedule.wire_feed;
            check(
                moves(feed.0),
                "schedule.wire_feed",
                feed.to_string(),
                "positive, at most 60 m/min",
            )?;
            let speed = schedule.travel_speed.unwrap_or(feed);
            check(
                moves(speed.0),
                "schedule.travel_speed",
                speed.to_string(),
                "positive, at most 60 m/min",
            )?;
        }
        for (name, speed) in [
            ("travel_speed", self.travel_speed),
            ("approach_speed", self.approach_speed),
        ] {
            check(
                moves(speed.0),
                name,
                speed.to_string(),
                "positive, at most 60 m/min",
            )?;
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
            "positive, at most 1 m",
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
