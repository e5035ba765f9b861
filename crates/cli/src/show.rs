//! What the command line says: the only place that writes to the standard streams.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

/// Version of the JSON that `--json` prints.
const SCHEMA: &str = "meltpath-command/1";

/// How a command speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Voice {
    /// In words, all of them.
    Words,
    /// In words, those that answer.
    Quiet,
    /// One JSON object at the end.
    Json,
}

/// What is done with a report once it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reports {
    /// Its place is told.
    Told,
    /// It is opened, too.
    Opened,
}

struct Speaker {
    voice: Voice,
    reports: Reports,
    lines: Vec<String>,
    told: Vec<(String, Value)>,
}

static SPEAKER: Mutex<Speaker> = Mutex::new(Speaker {
    voice: Voice::Words,
    reports: Reports::Told,
    lines: Vec::new(),
    told: Vec::new(),
});

fn with<T>(f: impl FnOnce(&mut Speaker) -> T) -> T {
    f(&mut SPEAKER.lock().unwrap_or_else(PoisonError::into_inner))
}

/// From now on the command speaks so.
pub(crate) fn speak(voice: Voice, reports: Reports) {
    with(|s| (s.voice, s.reports) = (voice, reports));
}

/// How the command speaks.
pub(crate) fn voice() -> Voice {
    with(|s| s.voice)
}

/// Whether reports are opened.
pub(crate) fn reports() -> Reports {
    with(|s| s.reports)
}

/// Writes a line for people to the standard error stream.
pub(crate) fn line_to_stderr(text: &str) {
    // a closed stream is no reason to stop the work
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// The same of what goes on, which is not asked of a quiet command.
pub(crate) fn progress_line(text: &str) {
    if voice() == Voice::Words {
        line_to_stderr(text);
    }
}

/// Writes a line of the result to the standard output.
pub(crate) fn line(text: &str) {
    if voice() == Voice::Json {
        with(|s| s.lines.push(text.to_owned()));
    } else {
        let _ = writeln!(std::io::stdout().lock(), "{text}");
    }
}

/// Tells a value of the result to programs.
pub(crate) fn tell(key: &str, value: Value) {
    with(|s| s.told.push((key.to_owned(), value)));
}

/// Ends what is said: programs are told all of it, with the exit code.
pub(crate) fn finish(code: u8) {
    with(|s| {
        if s.voice == Voice::Json {
            let mut all = json!({"schema": SCHEMA, "exit_code": code, "lines": s.lines});
            if let Some(all) = all.as_object_mut() {
                all.extend(std::mem::take(&mut s.told));
            }
            let _ = writeln!(std::io::stdout().lock(), "{all:#}");
        }
    });
}

/// Colours, where a person looks: on a terminal, unless `NO_COLOR` is set.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Colour {
    Red,
    Yellow,
    Green,
    Grey,
}

/// A word in a colour.
pub(crate) fn coloured(word: &str, colour: Colour) -> String {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    if plain || !std::io::stdout().is_terminal() {
        return word.to_owned();
    }
    let code = match colour {
        Colour::Red => 31,
        Colour::Yellow => 33,
        Colour::Green => 32,
        Colour::Grey => 90,
    };
    format!("\u{1b}[{code}m{word}\u{1b}[0m")
}
