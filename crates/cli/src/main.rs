//! The command line of meltpath: arguments, progress, errors with their place, exit codes. All work is in the library.
//!
//! Exit codes: 0 the part passes (or there is nothing to check), 1 the part fails its checks, 2 the input is wrong,
//! 3 a bug in meltpath, 4 nothing fails but a check cannot be decided or none of them was made, 130 interrupted.

mod arguments;
mod commands;
mod exit_code;
mod failure;
mod manual;
mod progress;
mod show;
mod verdict;

use std::process::ExitCode;

use clap::Parser;

use exit_code::{BUG, INPUT_WRONG};

fn main() -> ExitCode {
    // a panic is a bug: say so, with its own exit code, after the library's own message
    let outcome = std::panic::catch_unwind(|| {
        let arguments = match arguments::Arguments::try_parse() {
            Ok(arguments) => arguments,
            Err(error) => {
                // help and version are not errors; clap tells which by its exit code
                let code = if error.use_stderr() { INPUT_WRONG } else { 0 };
                let _ = error.print();
                return code;
            }
        };
        commands::execute(&arguments)
    });
    ExitCode::from(outcome.unwrap_or_else(|_| {
        show::line_to_stderr("meltpath stopped on a bug of its own; please report the message above with your job file");
        BUG
    }))
}
