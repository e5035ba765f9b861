//! What the command line says: the only place that writes to the standard streams.

use std::io::Write;

/// Writes a line for people to the standard error stream.
pub(crate) fn line_to_stderr(text: &str) {
    // a closed stream is no reason to stop the work
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Writes a line of the result to the standard output.
pub(crate) fn line(text: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{text}");
}
