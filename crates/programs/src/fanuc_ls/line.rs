//! One instruction of `/MN`, from text and to text.

use meltpath_toolpath::{Weave, WeaveShape};

use crate::program::{
    ArcAction, ArcStyle, ArcWord, CommentMark, Instruction, MotionInstruction, MotionKind,
    PositionRef, Speed, SpeedUnit, Termination,
};
use crate::scan::{bracket, number, numbered, strip_prefix, strip_word, tidy, word};

/// The instruction in `text`, which is trimmed and without line number and `;`. What is not recognised is `Raw`.
pub(crate) fn parse(text: &str) -> Instruction {
    let text = text.trim();
    recognise(text).unwrap_or_else(|| Instruction::Raw(tidy(text)))
}

fn recognise(text: &str) -> Option<Instruction> {
    if text.is_empty() {
        return Some(Instruction::Blank);
    }
    let comment = |mark, text: &str| {
        Some(Instruction::Comment {
            mark,
            text: text.trim_end().to_owned(),
        })
    };
    if let Some(rest) = text.strip_prefix('!') {
        return comment(CommentMark::Remark, rest);
    }
    if let Some(rest) = text.strip_prefix("//") {
        return comment(CommentMark::SwitchedOff, rest);
    }
    if let Some(rest) = strip_prefix(text, "--eg:") {
        return comment(CommentMark::Language, rest);
    }
    if let Some(m) = motion(text) {
        return Some(Instruction::Motion(m));
    }
    if let Some((arc, rest)) = arc_word(text)
        && rest.trim().is_empty()
    {
        return Some(Instruction::Arc(arc));
    }
    let assigned = |name| {
        let rest = strip_word(text, name)?.trim_start().strip_prefix('=')?;
        rest.trim().parse().ok()
    };
    if let Some(n) = assigned("UFRAME_NUM") {
        return Some(Instruction::UserFrame(n));
    }
    if let Some(n) = assigned("UTOOL_NUM") {
        return Some(Instruction::ToolFrame(n));
    }
    if let Some(rest) = strip_word(text, "WAIT") {
        let (seconds, unit) = number(rest.trim_start())?;
        let unit = unit.trim();
        let known = unit.eq_ignore_ascii_case("(sec)") || unit.eq_ignore_ascii_case("sec");
        return (known && seconds >= 0.0).then_some(Instruction::Wait(seconds));
    }
    if let Some(rest) = strip_word(text, "CALL") {
        return call(rest.trim());
    }
    if let Some(rest) = strip_word(text, "LBL") {
        let (number, comment) = alone(rest)?;
        return Some(Instruction::Label { number, comment });
    }
    if let Some(rest) = strip_word(text, "JMP") {
        let rest = strip_word(rest.trim_start(), "LBL")?;
        return Some(Instruction::Jump(alone(rest)?.0));
    }
    text.eq_ignore_ascii_case("END").then_some(Instruction::End)
}

/// A bracket with a number that ends the line.
fn alone(text: &str) -> Option<(u32, Option<String>)> {
    let (inner, rest) = bracket(text)?;
    rest.trim().is_empty().then(|| numbered(inner))?
}

fn call(text: &str) -> Option<Instruction> {
    let (name, arguments) = match text.split_once('(') {
        Some((name, rest)) => (name.trim(), rest.strip_suffix(')')?),
        None => (text, ""),
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (!name.is_empty() && name.chars().all(plain)).then(|| Instruction::Call {
        program: name.to_owned(),
        arguments: tidy(arguments),
    })
}

/// A position reference in front of `text`, and what follows it.
fn position(text: &str) -> Option<(PositionRef, &str)> {
    let text = text.trim_start();
    if let Some(rest) = strip_prefix(text, "PR") {
        let (_, after) = bracket(rest)?;
        let name = &text[..text.len() - after.len()];
        return Some((PositionRef::Unresolved(tidy(name)), after));
    }
    let rest = strip_prefix(text, "P")?;
    let (inner, after) = bracket(rest)?;
    let reference = numbered(inner).map_or_else(
        || PositionRef::Unresolved(tidy(&text[..text.len() - after.len()])),
        |(index, comment)| PositionRef::Point { index, comment },
    );
    Some((reference, after))
}

/// An arc word in front of `text`, and what follows it.
fn arc_word(text: &str) -> Option<(ArcWord, &str)> {
    let text = text.trim_start();
    let (style, rest) = strip_word(text, "Arc")
        .map(|r| (ArcStyle::Arc, r))
        .or_else(|| strip_word(text, "Weld").map(|r| (ArcStyle::Weld, r)))?;
    let rest = rest.trim_start();
    let (action, rest) = strip_word(rest, "Start")
        .map(|r| (ArcAction::Start, r))
        .or_else(|| strip_word(rest, "End").map(|r| (ArcAction::End, r)))?;
    let (inner, rest) = bracket(rest.trim_start())?;
    let word = ArcWord {
        action,
        style,
        arguments: tidy(inner),
    };
    Some((word, rest))
}

fn speed_unit(text: &str) -> Option<SpeedUnit> {
    let same = |u: &SpeedUnit| u.symbol().eq_ignore_ascii_case(text);
    SpeedUnit::ALL.into_iter().find(same)
}

/// A speed in front of `text`, and what follows it.
fn speed(text: &str) -> Option<(Speed, &str)> {
    let text = text.trim_start();
    let (head, after) = word(text)?;
    if head.eq_ignore_ascii_case("WELD_SPEED") {
        return Some((Speed::Weld, after));
    }
    if head.eq_ignore_ascii_case("max_speed") {
        return Some((Speed::Maximum, after));
    }
    // the unit may stand apart from its number
    let unit_of = |rest: &'_ str| -> Option<(SpeedUnit, usize)> {
        let (symbol, after) = word(rest)?;
        Some((speed_unit(symbol)?, after.len()))
    };
    if let Some(rest) = strip_prefix(text, "R") {
        let (inner, rest) = bracket(rest)?;
        let (number, _) = numbered(inner)?;
        let (unit, left) = unit_of(rest)?;
        return Some((Speed::Register { number, unit }, &text[text.len() - left..]));
    }
    let (value, rest) = number(text)?;
    let (unit, left) = unit_of(rest)?;
    (value > 0.0).then(|| (Speed::Value { value, unit }, &text[text.len() - left..]))
}

/// A termination in front of `text`, and what follows it.
fn termination(text: &str) -> Option<(Termination, &str)> {
    let (head, after) = word(text)?;
    if head.eq_ignore_ascii_case("FINE") {
        return Some((Termination::Fine, after));
    }
    let Some(rest) = strip_prefix(text.trim_start(), "CNT") else {
        return Some((Termination::Other(head.to_owned()), after));
    };
    let rest = rest.trim_start();
    if let Some(register) = strip_prefix(rest, "R") {
        let (inner, after) = bracket(register)?;
        return Some((Termination::CntRegister(numbered(inner)?.0), after));
    }
    let (digits, after) = word(rest)?;
    let share: u8 = digits.parse().ok()?;
    (share <= 100).then_some((Termination::Cnt(share), after))
}

/// Words of a move behind which stands what runs on its way: time before, time after, distance before.
const ON_THE_WAY: [&str; 3] = ["TB", "TA", "DB"];

fn motion(text: &str) -> Option<MotionInstruction> {
    let mut letters = text.chars();
    let letter = letters.next()?.to_ascii_uppercase();
    let rest = letters.as_str();
    if !rest.starts_with(char::is_whitespace) {
        return None;
    }
    let (first, rest) = position(rest)?;
    let (kind, target, rest) = match letter {
        'J' => (MotionKind::Joint, first, rest),
        'L' => (MotionKind::Linear, first, rest),
        'A' => (MotionKind::CircleArc, first, rest),
        'C' => {
            let (target, rest) = position(rest)?;
            (MotionKind::Circular { via: first }, target, rest)
        }
        _ => return None,
    };
    let (speed, rest) = speed(rest)?;
    let (termination, mut rest) = termination(rest)?;
    let (mut arc, mut extra) = (None, Vec::new());
    loop {
        if arc.is_none()
            && let Some((word, after)) = arc_word(rest)
        {
            arc = Some(word);
            rest = after;
        } else if ON_THE_WAY
            .iter()
            .any(|w| strip_word(rest.trim_start(), w).is_some())
        {
            // what runs so much before or after the target goes to the end of the line
            extra.push(tidy(rest));
            break;
        } else if let Some((head, after)) = word(rest) {
            extra.push(tidy(head));
            rest = after;
        } else {
            break;
        }
    }
    Some(MotionInstruction {
        arc,
        extra,
        ..MotionInstruction::plain(kind, target, speed, termination)
    })
}

/// A thing with its number, and what people call it.
fn with_number(what: &str, number: u32, comment: Option<&str>) -> String {
    let comment = comment.map(|c| format!(":{c}")).unwrap_or_default();
    format!("{what}[{number}{comment}]")
}

fn position_text(position: &PositionRef) -> String {
    match position {
        PositionRef::Point { index, comment } => with_number("P", *index, comment.as_deref()),
        PositionRef::Unresolved(text) => text.clone(),
    }
}

/// A number with up to three decimals and at least one where the unit wants them.
fn speed_text(speed: &Speed) -> String {
    match speed {
        Speed::Value { value, unit } => {
            let mut digits = format!("{value:.3}");
            while digits.ends_with('0') && !digits.ends_with(".0") {
                digits.pop();
            }
            // shares and mm/s are whole on the pendant
            if let (SpeedUnit::Percent | SpeedUnit::MillimetrePerSecond, Some(whole)) =
                (unit, digits.strip_suffix(".0"))
            {
                digits = whole.to_owned();
            }
            format!("{digits}{}", unit.symbol())
        }
        Speed::Register { number, unit } => format!("R[{number}]{}", unit.symbol()),
        Speed::Weld => "WELD_SPEED".to_owned(),
        Speed::Maximum => "max_speed".to_owned(),
        Speed::Other(words) => words.clone(),
    }
}

fn motion_text(m: &MotionInstruction) -> String {
    let target = position_text(&m.target);
    let mut text = match &m.kind {
        MotionKind::Joint => format!("J {target}"),
        MotionKind::Linear => format!("L {target}"),
        MotionKind::CircleArc => format!("A {target}"),
        // the target stands on a line of its own
        MotionKind::Circular { via } => format!("C {}    \n    :  {target}", position_text(via)),
    };
    let termination = match &m.termination {
        Termination::Fine => "FINE".to_owned(),
        Termination::Cnt(share) => format!("CNT{share}"),
        Termination::CntRegister(n) => format!("CNT R[{n}]"),
        Termination::Blend(distance) => format!("CD{distance:.0}"),
        Termination::Other(word) => word.clone(),
    };
    for word in [speed_text(&m.speed), termination] {
        text += " ";
        text += &word;
    }
    for word in m.arc.iter().map(ToString::to_string) {
        text += " ";
        text += &word;
    }
    for word in &m.extra {
        text += " ";
        text += word;
    }
    text + "   "
}

/// What begins a weave: frequency, amplitude, dwell on the right, dwell on the left.
pub(crate) fn weave_text(weave: &Weave) -> String {
    let shape = match weave.shape {
        WeaveShape::Sine => "Sine",
        WeaveShape::Triangle => "Triangle",
        WeaveShape::Circle => "Circle",
    };
    let [left, right] = weave.dwell;
    format!(
        "Weave {shape}[{:.1}Hz,{:.1}mm,{right:.3}s,{left:.3}s]",
        weave.frequency, weave.amplitude
    )
}

/// The instruction as a line of `/MN`, without its number and without `;`.
pub(super) fn write(instruction: &Instruction) -> String {
    let plain = match instruction {
        Instruction::Motion(m) => return motion_text(m),
        Instruction::Arc(word) => word.to_string(),
        Instruction::Weave(None) => "Weave End".to_owned(),
        Instruction::Weave(Some(weave)) => weave_text(weave),
        Instruction::Wait(seconds) => format!("WAIT {seconds:6.2}(sec)"),
        Instruction::UserFrame(n) => format!("UFRAME_NUM={n}"),
        Instruction::ToolFrame(n) => format!("UTOOL_NUM={n}"),
        // no line selects it
        Instruction::Holds(holds) => format!("!the robot holds {holds}"),
        Instruction::Call { program, arguments } if arguments.is_empty() => {
            format!("CALL {program}")
        }
        Instruction::Call { program, arguments } => format!("CALL {program}({arguments})"),
        Instruction::Comment { mark, text } => match mark {
            CommentMark::Remark => format!("!{text}"),
            CommentMark::SwitchedOff => format!("//{text}"),
            CommentMark::Language => format!("--eg:{text}"),
        },
        Instruction::Label { number, comment } => with_number("LBL", *number, comment.as_deref()),
        Instruction::Jump(n) => format!("JMP LBL[{n}]"),
        Instruction::End => "END".to_owned(),
        Instruction::Blank => return "  ".to_owned(),
        Instruction::Raw(text) => text.clone(),
    };
    format!("  {plain}")
}
