//! The words that switch an arc: on or off, with what, and what they leave to the controller.

use std::fmt;

use meltpath_base::choice;

/// A kept line that has to do with those that switch the arc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArcLine {
    /// It begins as they do; a line behind it goes on otherwise.
    Begins,
    /// It goes on otherwise.
    Breaks,
    /// It sets an output that one of them sets.
    Output,
}

/// What an instruction does to a bead beside its own words, as the data say that it names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unsaid {
    /// How long the arc stands on the crater is known to the controller only: the data, or the word, that it ends by.
    Crater(String),
    /// The arc stands on the crater with values of which it is not known what they feed: the words.
    CraterFeed(String),
    /// The bead begins or ends otherwise than in the words of its moves: what the data say.
    Phase(String),
    /// Whether the arc burns along a move that has no words of it: the verb of the move.
    PlainMove(&'static str),
    /// The source works in a mode that is not the cell's.
    Mode(String),
}

/// Arc on or off.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArcWord {
    /// On or off.
    pub action: ArcAction,
    /// Which words the controller has.
    pub style: ArcStyle,
    /// What stands between the brackets: schedule number, or procedure and schedule, or values.
    pub arguments: String,
}

/// On or off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArcAction {
    /// Arc on.
    Start,
    /// Arc off.
    End,
}

choice! {
    /// Which words the controller has.
    pub enum ArcStyle {
        Arc "arc" => "`Arc Start[1]`.",
        Weld "weld" => "`Weld Start[1,1]`.",
    }

    /// What a number in the brackets of an arc word means.
    pub enum ArcValue {
        Procedure "procedure" => "A weld procedure.",
        Schedule "schedule" => "A weld schedule.",
        MetresPerMinute "wire feed, m/min" => "Wire feed, m/min.",
        CentimetresPerMinute "wire feed, cm/min" => "Wire feed, cm/min.",
        MillimetresPerSecond "wire feed, mm/s" => "Wire feed, mm/s.",
        InchesPerMinute "wire feed, in/min" => "Wire feed, in/min.",
        Other "other" => "Nothing that shapes metal beyond the wire feed: a voltage, a trim.",
    }
}

impl ArcValue {
    /// The wire feed, mm/s, that one of it is; 0 where it is none.
    pub(crate) fn feed(self) -> f64 {
        match self {
            ArcValue::Procedure | ArcValue::Schedule | ArcValue::Other => 0.0,
            ArcValue::MetresPerMinute => 1000.0 / 60.0,
            ArcValue::CentimetresPerMinute => 10.0 / 60.0,
            ArcValue::MillimetresPerSecond => 1.0,
            ArcValue::InchesPerMinute => 25.4 / 60.0,
        }
    }
}

impl ArcWord {
    /// On or off in the controller's usual words.
    pub(crate) fn new(action: ArcAction, arguments: String) -> Self {
        ArcWord {
            action,
            style: ArcStyle::Arc,
            arguments,
        }
    }
}

impl fmt::Display for ArcWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let style = match self.style {
            ArcStyle::Arc => "Arc",
            ArcStyle::Weld => "Weld",
        };
        let action = match self.action {
            ArcAction::Start => "Start",
            ArcAction::End => "End",
        };
        write!(f, "{style} {action}[{}]", self.arguments)
    }
}
