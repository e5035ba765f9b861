//! What lines that are kept verbatim do to the execution: every line shapes no metal, or is executed, or is told as a gap.

use super::gap::Missing;
use crate::krl;
use crate::modal::{Orientation, Sets};
use crate::program::{COORDINATED, Dialect, JOINTS_AT};
use crate::rapid::harmless;
use crate::scan::{is_variable, routine_name, strip_word};

/// What a line that is kept verbatim does to the execution.
pub(super) enum Effect {
    /// Sets a register.
    Set,
    /// Sets an output or a flag.
    Signal,
    /// Sets an output that may lead to the source.
    Output,
    /// Sets a position register.
    Position,
    /// Selects a frame by a value.
    Frame(Selected),
    /// Weaving begins.
    Weave,
    /// Weaving ends.
    WeaveEnd,
    /// Ends everything.
    Abort,
    /// Waits for something.
    Wait,
    /// Stands until a person lets it go on.
    Pause,
    /// Ends the move before at a standstill.
    Stops,
    /// Says whether moves are prepared ahead: without that every one ends at a standstill.
    Ahead(bool),
    /// Says how moves turn the tool.
    Turns(Sets),
    /// Shapes no metal.
    Passive,
    /// Runs a program whenever something comes true: its name.
    Interrupts(String),
    /// Shapes metal, or may do so, in a way that is not modelled.
    Shapes(Missing),
}

/// Which frame is selected.
#[derive(Clone, Copy)]
pub(super) enum Selected {
    User,
    Tool,
}

/// First words of instructions that shape no metal: inputs and outputs that are not the source's, messages, times, registers that
/// matter only where a move refers to them (and are told there), monitoring.
const PASSIVE: [&str; 20] = [
    "DI",
    "RI",
    "GI",
    "AI",
    "WI",
    "SI",
    "UI",
    "TIMER",
    "MESSAGE",
    "PAYLOAD",
    "SR",
    "AR",
    "LOCK",
    "UNLOCK",
    "COL",
    "ERROR_PROG",
    "RESUME_PROG",
    "DIAG_REC",
    "MONITOR",
    // matters to moves with the word Skip, which are told
    "SKIP",
];

/// The word that a line begins with, in capitals.
pub(super) fn first_word(text: &str) -> String {
    let end = text
        .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
        .unwrap_or(text.len());
    let word = if end == 0 {
        text.chars().take(1).collect()
    } else {
        text[..end].to_owned()
    };
    word.to_ascii_uppercase()
}

/// What a line does.
pub(super) fn effect(text: &str) -> Effect {
    let word = first_word(text);
    match word.as_str() {
        "ABORT" => Effect::Abort,
        "WAIT" => Effect::Wait,
        // how severe a user's alarm is stands in the controller: as it comes, it pauses the program
        "PAUSE" | "UALM" => Effect::Pause,
        "UFRAME_NUM" => Effect::Frame(Selected::User),
        "UTOOL_NUM" => Effect::Frame(Selected::Tool),
        "R" => Effect::Set,
        "PR" => Effect::Position,
        "DO" | "RO" | "SO" | "UO" | "F" | "M" => Effect::Signal,
        "WEAVE" if ends(text) => Effect::WeaveEnd,
        "WEAVE" => Effect::Weave,
        // the end of what was told at its beginning
        "TRACK" if ends(text) => Effect::Passive,
        "CALL" | "RUN" => Effect::Shapes(Missing::Call(text.to_owned())),
        "AO" | "GO" | "WO" => Effect::Output,
        "ARC" | "WELD" => Effect::Shapes(Missing::Output(text.to_owned())),
        "UFRAME" | "UTOOL" | "OVERRIDE" | "OFFSET" | "VOFFSET" | "TOOL_OFFSET" | "TRACK"
        | "LINEAR_MAX_SPEED" | "JOINT_MAX_SPEED" | "$" => {
            Effect::Shapes(Missing::Setting(text.to_owned()))
        }
        word if PASSIVE.contains(&word) => Effect::Passive,
        _ => Effect::Shapes(Missing::Unknown(text.to_owned())),
    }
}

/// How lines of other dialects begin that shape no metal, and those that wait; in capitals, without white space.
fn passive(dialect: Dialect) -> (&'static [&'static str], &'static [&'static str]) {
    match dialect {
        Dialect::FanucLs => (&[], &[]),
        Dialect::Krl => (
            &[
                "&",
                "BAS(#INITMOV",
                "BAS(#ACC",
                "$BWDSTART",
                "$H_POS",
                "$ACC",
                "CONTINUE",
                "$LOAD",
                "PDAT_ACT",
                "SET_CD_PARAMS",
                "MSGNOTIFY(",
                "DECL",
                "INT",
                "REAL",
                "BOOL",
                "EXT",
            ],
            &["WAITFOR"],
        ),
        Dialect::Rapid => (&harmless::ACTS, &harmless::WAITS),
        Dialect::UrScript => (
            &[
                "SET_DIGITAL_OUT(",
                "SET_STANDARD_DIGITAL_OUT(",
                "SET_CONFIGURABLE_DIGITAL_OUT(",
                "SET_TOOL_DIGITAL_OUT(",
                "TEXTMSG(",
                "SET_TCP(",
                "SET_PAYLOAD(",
                "SYNC(",
            ],
            &[
                "STOPL(",
                "STOPJ(",
                "POPUP(",
                "WHILE(GET_STANDARD_DIGITAL_IN(",
            ],
        ),
        Dialect::Inform => (
            &["DOUT", "PULSE", "MSG", "CLS"],
            &["WAIT", "PAUSE", "TIMER"],
        ),
        Dialect::Val3 => (
            &[
                "CLS(",
                "PUT(",
                "PUTLN(",
                "USERPAGE(",
                "LOGMSG(",
                "POPUPMSG(",
                "SETPAYLOAD(",
                "ENABLEPOWER(",
            ],
            &["WAIT(", "WATCH("],
        ),
    }
}

/// What a line of another dialect does that its parser kept verbatim.
pub(super) fn effect_of(dialect: Dialect, text: &str) -> Effect {
    let (passive, waits) = passive(dialect);
    let line: String = text.split_whitespace().collect();
    let line = line.to_ascii_uppercase();
    let begins = |words: &[&str]| words.iter().any(|w| line.starts_with(w));
    let own = match dialect {
        Dialect::Krl => ahead(&line).or_else(|| interrupt(text)).or_else(|| {
            let set = krl::turns(&line)?;
            Some(Effect::Turns(set))
        }),
        Dialect::Rapid if ["SETGO", "SETAO"].contains(&&*first_word(text)) => Some(Effect::Output),
        Dialect::Rapid => near_singularities(&line, text),
        _ => None,
    };
    if let Some(effect) = own {
        return effect;
    }
    // what it ends was told where it began
    let closes = dialect == Dialect::UrScript && line == "END";
    if dialect == Dialect::Inform && line.starts_with("WVON") {
        Effect::Weave
    } else if dialect == Dialect::Inform && line.starts_with("WVOF") {
        Effect::WeaveEnd
    } else if closes {
        Effect::Passive
    } else if ends_all(dialect, &line) {
        Effect::Abort
    } else if dialect == Dialect::Krl && line.starts_with("WEAVE#") {
        Effect::Shapes(Missing::Weave)
    } else if dialect == Dialect::Krl && line == "HALT" {
        // it goes on at a press of the start key
        Effect::Pause
    } else if begins(waits) {
        Effect::Wait
    } else if begins(passive) {
        Effect::Passive
    } else if sets_variable(dialect, text) {
        Effect::Shapes(Missing::Value(text.to_owned()))
    } else {
        Effect::Shapes(Missing::Unknown(text.to_owned()))
    }
}

/// Whether a line ends the program and all that called it.
fn ends_all(dialect: Dialect, line: &str) -> bool {
    match dialect {
        Dialect::UrScript => matches!(line, "HALT" | "HALT()"),
        Dialect::Rapid => line == "EXIT",
        _ => false,
    }
}

/// Whether a line sets a variable, in the languages whose variables are followed.
fn sets_variable(dialect: Dialect, text: &str) -> bool {
    let sign = match dialect {
        Dialect::Krl | Dialect::UrScript => "=",
        Dialect::Rapid => ":=",
        Dialect::FanucLs | Dialect::Inform | Dialect::Val3 => return false,
    };
    let name = text.split_once(sign).map(|(name, _)| name.trim());
    name.is_some_and(is_variable)
}

/// What a line of a KUKA does to the moves that are prepared ahead of the arm (the advance run): without these nothing is rounded.
fn ahead(line: &str) -> Option<Effect> {
    if line.starts_with("$OUT[") {
        return Some(Effect::Stops);
    }
    // it sets three
    if line.starts_with("BAS(#INITMOV") {
        return Some(Effect::Ahead(true));
    }
    let moves: u32 = line.strip_prefix("$ADVANCE=")?.parse().ok()?;
    Some(Effect::Ahead(moves > 0))
}

/// What a line of an ABB says of how the wrist is led near singularities.
fn near_singularities(line: &str, text: &str) -> Option<Effect> {
    Some(match line.strip_prefix("SINGAREA")? {
        "\\OFF" => Effect::Turns(Sets::Orientation(Orientation::Taught)),
        "\\WRIST" => Effect::Turns(Sets::Orientation(Orientation::Free)),
        // the fourth axis is held, whatever is taught
        _ => Effect::Shapes(Missing::Setting(text.to_owned())),
    })
}

/// What a KUKA runs where it stops by itself: it lays no metal.
const STOPS: &str = "IR_STOPM";

/// What a line of a KUKA does that declares an interrupt (`INTERRUPT DECL 4 WHEN $IN[3]==TRUE DO OWN()`) or switches it.
fn interrupt(text: &str) -> Option<Effect> {
    let own = strip_word(text, "GLOBAL").unwrap_or(text).trim_start();
    let rest = strip_word(own, "INTERRUPT")?.trim_start();
    let Some(declared) = strip_word(rest, "DECL") else {
        let switches = ["ON", "OFF", "ENABLE", "DISABLE"];
        let switches = switches.iter().any(|w| strip_word(rest, w).is_some());
        return switches.then_some(Effect::Passive);
    };
    let upper = declared.to_ascii_uppercase();
    let call = upper.rsplit_once(" DO ");
    Some(match call.and_then(|(_, call)| routine_name(call)) {
        Some(STOPS) => Effect::Passive,
        Some(name) => Effect::Interrupts(name.to_owned()),
        None => Effect::Shapes(Missing::Unknown(text.to_owned())),
    })
}

/// Whether the second word of a line is `End`.
fn ends(text: &str) -> bool {
    let mut words = text.split(|c: char| c.is_whitespace() || c == '[');
    words.nth(1).is_some_and(|w| w.eq_ignore_ascii_case("end"))
}

/// Words of a move that change where it goes.
pub(super) fn moves_target(word: &str) -> bool {
    let name = first_word(word);
    matches!(
        name.as_str(),
        "OFFSET" | "TOOL_OFFSET" | "VOFFSET" | "INC" | "SKIP" | "RTCP" | "TA_REF" | "TRACK"
    )
}

/// Words that begin as those of the arc do and are none of them: those of another piece of equipment (`Arc Start E2[1]`).
pub(super) fn switches_arc(word: &str) -> bool {
    matches!(first_word(word).as_str(), "ARC" | "WELD")
}

/// Words of a move that leave its path and speed as they are: the usual acceleration, orientation by the wrist.
pub(super) fn leaves_beads(word: &str) -> bool {
    matches!(first_word(word).as_str(), "ACC100" | "WJNT" | "PTH" | "VJ")
}

/// The word of a move that goes with a positioner: the path in the part is the one written where the positioner stands still.
pub(super) fn coordinated(word: &str) -> bool {
    first_word(word) == COORDINATED
}

/// The share of their speeds at which joints go in a move along a path, %, as its word says it.
pub(super) fn joints_at(word: &str) -> Option<f64> {
    word.strip_prefix(JOINTS_AT)?.trim().parse().ok()
}

/// The program that a word of a move runs on its way, in capitals: `TB .10sec,CALL NAME`.
pub(super) fn called_on_the_way(word: &str) -> Option<String> {
    let word = word.to_ascii_uppercase();
    let (_, name) = word.split_once("CALL")?;
    Some(first_word(name.trim_start()))
}

/// The number after a word, as in `Layer 12`.
pub(super) fn numbered(text: &str, word: &str) -> Option<u32> {
    let mut words = text.split_whitespace();
    words
        .next()
        .filter(|w| w.eq_ignore_ascii_case(word))
        .and_then(|_| words.next()?.parse().ok())
}

/// The bead of its layer, as programs written here say it: `Layer 12 bead 3`; earlier ones said `Pass 3`.
pub(super) fn told_bead(text: &str) -> Option<u32> {
    let words: Vec<&str> = text.split_whitespace().collect();
    match words[..] {
        [layer, _, bead, number]
            if layer.eq_ignore_ascii_case("Layer") && bead.eq_ignore_ascii_case("bead") =>
        {
            number.parse().ok()
        }
        _ => numbered(text, "Pass"),
    }
}

/// A schedule and its wire feed, mm/s, as programs written here say it: `Schedule 2 WFS 8.00 m/min`.
pub(super) fn told_schedule(text: &str) -> Option<(u32, f64)> {
    let number = numbered(text, "Schedule")?;
    let words: Vec<&str> = text.split_whitespace().collect();
    let [_, _, wfs, feed, unit] = words[..] else {
        return None;
    };
    let feed: f64 = feed.parse().ok()?;
    let meant = wfs.eq_ignore_ascii_case("WFS") && unit.eq_ignore_ascii_case("m/min");
    (meant && feed > 0.0 && feed.is_finite()).then_some((number, feed / 0.06))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schedule_is_told_by_its_comment() {
        let told = told_schedule("Schedule 2 WFS 8.00 m/min").unwrap();
        assert_eq!(told.0, 2);
        assert!((told.1 - 8000.0 / 60.0).abs() < 1e-9);
        // controllers that know capitals alone, and editors that know none
        for other in ["SCHEDULE 2 WFS 8.00 M/MIN", "schedule 2 wfs 8.00 m/min"] {
            assert_eq!(told_schedule(other), Some(told));
        }
        assert_eq!(told_bead("layer 12 bead 3"), Some(3));
        for other in [
            "Schedule 2",
            "Schedule 2 feed 8 m/min",
            "Schedule 2 WFS 8 mm/s",
            "Schedule two WFS 8 m/min",
            "Schedule 2 WFS -8 m/min",
        ] {
            assert_eq!(told_schedule(other), None);
        }
    }
}
