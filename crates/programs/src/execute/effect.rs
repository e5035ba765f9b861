//! What lines that are kept verbatim do to the execution.

/// What a line that is kept verbatim does to the execution.
pub(super) enum Effect {
    /// Decides what comes next.
    Condition,
    /// Repeats.
    Loop,
    /// Sets a register.
    Set(u32, Option<f64>),
    /// Selects a frame by a value that is not known.
    Frame { user: bool },
    /// Ends everything.
    Abort,
    /// Moves nothing.
    Passive,
    /// Not known, or changes the motion in a way that is not modelled.
    Unknown,
}

/// First words of instructions that move nothing.
const PASSIVE: [&str; 24] = [
    "DO", "DI", "RO", "RI", "GO", "GI", "AO", "AI", "WO", "SO", "UO", "F", "TIMER", "MESSAGE",
    "PAYLOAD", "PR", "SR", "AR", "UALM", "$", "LOCK", "UNLOCK", "UFRAME", "UTOOL",
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
    match first_word(text).as_str() {
        "IF" | "ELSE" | "ENDIF" | "SELECT" | "JMP" | "=" | "SKIP" | "CALL" => Effect::Condition,
        "FOR" | "ENDFOR" | "WHILE" | "ENDWHILE" => Effect::Loop,
        "ABORT" => Effect::Abort,
        "UFRAME_NUM" => Effect::Frame { user: true },
        "UTOOL_NUM" => Effect::Frame { user: false },
        "R" => assignment(text).map_or(Effect::Passive, |(n, v)| Effect::Set(n, v)),
        word if PASSIVE.contains(&word) => Effect::Passive,
        _ => Effect::Unknown,
    }
}

/// `R[n]=value`: the register, and the value where it is a plain number.
fn assignment(text: &str) -> Option<(u32, Option<f64>)> {
    let (left, right) = text.split_once('=')?;
    let inner = left.trim().get(2..)?.strip_suffix(']')?;
    let number = inner.split(':').next()?.trim().parse().ok()?;
    let right = right.trim().trim_matches(|c| c == '(' || c == ')');
    let value = right.parse().ok().filter(|v: &f64| v.is_finite());
    Some((number, value))
}

/// Words of a move that change where it goes.
pub(super) fn moves_target(word: &str) -> bool {
    let name = first_word(word);
    matches!(
        name.as_str(),
        "OFFSET" | "TOOL_OFFSET" | "VOFFSET" | "INC" | "SKIP" | "RTCP" | "TA_REF" | "TRACK"
    )
}

/// The number after a word, as in `Layer 12`.
pub(super) fn numbered(text: &str, word: &str) -> Option<u32> {
    let mut words = text.split_whitespace();
    words
        .next()
        .filter(|w| w.eq_ignore_ascii_case(word))
        .and_then(|_| words.next()?.parse().ok())
}
