//! Completions for shells and pages for `man`, made of the arguments; beside them the pages of the book on files.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;

use meltpath::reference;

use crate::arguments::Arguments;
use crate::failure::Failure;
use crate::show::line;

/// The name of the program.
const NAME: &str = "meltpath";

/// Prints the completions of a shell.
pub(crate) fn completions(shell: Shell) -> u8 {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), NAME, &mut text);
    line(String::from_utf8_lossy(&text).trim_end());
    0
}

/// Writes a page for each command into the folder `out`, and the reference of job files and data files.
pub(crate) fn pages(out: &Path) -> Result<u8, Failure> {
    let failed = |e: std::io::Error| Failure::Other(format!("{}: {e}", out.display()));
    std::fs::create_dir_all(out).map_err(failed)?;
    clap_mangen::generate_to(Arguments::command(), out).map_err(failed)?;
    for (name, text) in reference::pages() {
        std::fs::write(out.join(name), text).map_err(failed)?;
    }
    line(&format!("made {}", out.join(format!("{NAME}.1")).display()));
    Ok(0)
}
