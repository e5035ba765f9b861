//! Which files a dialect has, and who writes and reads them.

use crate::cell::CellProgramming;
use crate::parsed::{ParseError, Parsed};
use crate::program::{Dialect, Program};
use crate::written::{TextFile, WriteError};
use crate::{fanuc_ls, inform, krl, rapid, ur_script, val3};

impl Dialect {
    /// Whether its words for a tool that stands while the robot holds the part are written and read: those of KUKA's external TCP, of ABB's
    /// `robhold`, and a Stäubli's tools for points of the part.
    pub fn has_words_for_a_standing_torch(self) -> bool {
        matches!(self, Dialect::Krl | Dialect::Rapid | Dialect::Val3)
    }

    /// The dialect of files whose names end so, in any case.
    pub fn of_extension(extension: &str) -> Option<Dialect> {
        match extension.to_ascii_lowercase().as_str() {
            "ls" => Some(Dialect::FanucLs),
            "src" => Some(Dialect::Krl),
            "mod" | "modx" | "prg" => Some(Dialect::Rapid),
            "script" => Some(Dialect::UrScript),
            "jbi" => Some(Dialect::Inform),
            "pgx" => Some(Dialect::Val3),
            _ => None,
        }
    }

    /// How the names of its files end.
    pub fn extension(self) -> &'static str {
        match self {
            Dialect::FanucLs => "ls",
            Dialect::Krl => "src",
            Dialect::Rapid => "mod",
            Dialect::UrScript => "script",
            Dialect::Inform => "JBI",
            Dialect::Val3 => "pgx",
        }
    }

    /// How the name of the file ends that holds a program's data beside it.
    pub fn companion(self) -> Option<&'static str> {
        match self {
            Dialect::Krl => Some("dat"),
            Dialect::Val3 => Some("dtx"),
            _ => None,
        }
    }
}

/// The files of a program in its dialect.
///
/// # Errors
/// [`WriteError`].
pub fn write(program: &Program, cell: &CellProgramming) -> Result<Vec<TextFile>, WriteError> {
    let missing = |table| WriteError::NoTable {
        program: program.name.clone(),
        table,
        dialect: program.dialect.name(),
    };
    let files = match program.dialect {
        Dialect::FanucLs => Ok(vec![TextFile {
            name: format!("{}.LS", program.name),
            text: fanuc_ls::write(program)?,
        }]),
        Dialect::Krl => krl::write(program, cell.krl.as_ref().ok_or_else(|| missing("krl"))?),
        Dialect::Rapid => rapid::write(
            program,
            cell.rapid.as_ref().ok_or_else(|| missing("rapid"))?,
        ),
        Dialect::UrScript => ur_script::write(
            program,
            cell.script.as_ref().ok_or_else(|| missing("script"))?,
        ),
        Dialect::Inform => inform::write(
            program,
            cell.inform.as_ref().ok_or_else(|| missing("inform"))?,
            &inform::Pulses::of(cell),
        ),
        Dialect::Val3 => val3::write(program, cell.val3.as_ref().ok_or_else(|| missing("val3"))?),
    }?;
    let most = cell.bytes_per_file.unwrap_or(usize::MAX);
    match files.iter().find(|f| f.text.len() > most) {
        Some(file) => Err(WriteError::TooLarge {
            file: file.name.clone(),
            bytes: file.text.len(),
            most,
        }),
        None => Ok(files),
    }
}

/// The programs of a file, the main one first; `data` is the file beside it. The cell says what values and lines of the arc mean.
///
/// # Errors
/// [`ParseError`].
pub fn read(
    dialect: Dialect,
    bytes: &[u8],
    data: Option<&[u8]>,
    cell: &CellProgramming,
) -> Result<Vec<Parsed>, ParseError> {
    let values = cell.arc_values.len();
    match dialect {
        Dialect::FanucLs => Ok(vec![fanuc_ls::read(bytes)?]),
        Dialect::Krl => krl::read(bytes, data, values, cell.krl.as_ref()),
        Dialect::Rapid => rapid::read(bytes, values),
        Dialect::UrScript => ur_script::read(bytes, cell.script.as_ref()),
        Dialect::Inform => inform::read(bytes, cell.inform.as_ref(), &inform::Pulses::of(cell)),
        Dialect::Val3 => val3::read(bytes, data, cell.val3.as_ref()),
    }
}
