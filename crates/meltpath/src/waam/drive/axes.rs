//! What is said of a robot's axes: their names, and that nothing passes by a guess of its file.

use meltpath_base::{Check, Status};

/// What people call an axis: joints of the arm from 0, then track and positioner.
pub(in crate::waam) fn axis(number: usize) -> String {
    match number {
        0..6 => format!("joint {}", number + 1),
        6 => "the track".to_owned(),
        _ => format!("axis {} of the positioner", number - 6),
    }
}

/// Nothing passes by a guess.
pub(in crate::waam) fn guessed(check: Check, guesses: &[String]) -> Check {
    if guesses.is_empty() || !matches!(check.status, Status::Pass | Status::Warn) {
        return check;
    }
    let reason = format!(
        "within the limit, but the robot's file guesses {}",
        guesses.join(", ")
    );
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&reason)
    .remedy("measure them, and write them with their `source` into a robot file of your own (meltpath inspect shows it)")
}

/// The first of many words.
pub(in crate::waam) fn shown(words: &[String]) -> String {
    const MOST: usize = 4;
    let first = words.chunks(MOST).next().unwrap_or_default().join("; ");
    match words.len().saturating_sub(MOST) {
        0 => first,
        more => format!("{first}; and {more} changes more"),
    }
}
