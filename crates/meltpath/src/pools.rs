//! Measured weld pools and pursuit lengths: of all files that are known, the one that is nearest to what is used.

use std::path::Path;

use meltpath_data::pools;
use meltpath_deposition::consumable::PoolFile;

use crate::data::{DataFileError, DataText, known};

/// A file of pools with how near it is.
#[derive(Debug)]
pub(crate) struct Nearest {
    /// Its text.
    pub(crate) text: DataText,
    /// What it says.
    pub(crate) file: PoolFile,
    /// Whether it is of the same wire, of the same mode, of the same gas.
    pub(crate) same: [bool; 3],
}

impl Nearest {
    /// Its name, where it is of another wire.
    pub(crate) fn of_another_wire(&self) -> Option<String> {
        (!self.same[0]).then(|| self.file.id.value.clone())
    }
}

/// Of the named file, or else of all that a job in `folder` finds, the one that tells what `tells` asks for and is nearest to wire, mode and
/// gas: the same wire counts most, the same gas least.
///
/// # Errors
/// What is wrong with a file.
pub(crate) fn nearest(
    named: Option<&DataText>,
    folder: &Path,
    [wire, mode, gas]: [&str; 3],
    tells: impl Fn(&PoolFile) -> bool,
) -> Result<Option<Nearest>, DataFileError> {
    let all = match named {
        Some(named) => vec![named.clone()],
        None => known(pools::ALL, folder),
    };
    let mut best: Option<Nearest> = None;
    for text in all {
        let file = text.read(PoolFile::parse)?;
        let same = [*file.wire == wire, *file.mode == mode, *file.gas == gas];
        if tells(&file) && best.as_ref().is_none_or(|found| same > found.same) {
            best = Some(Nearest { text, file, same });
        }
    }
    Ok(best)
}
