//! Focus calibrations of electron guns: how the beam's diameter depends on the current of the focus coil; those that ship, from
//! `meltpath_data::focus`, and files of the user's own.

use std::path::Path;

use meltpath_base::settings::{self, Problem, Problems};
use meltpath_base::{Current, Length, quantity, table};
use meltpath_data::focus;
use meltpath_gun::focus::{FocusCalibration, FocusPiece};

use crate::data::{DataFileError, DataText};

quantity!(
    /// Diameter per current, mm/A inside.
    FocusSlope, "slope", "mm/A",
    [("µm/mA", 1.0)]
);

table! {
    /// The focus calibration of an electron gun: the beam's diameter against the current of the focus coil, as calibrated.
    pub struct FocusFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Name in words.
        name: String => required;
        /// Who calibrated it.
        source: String => required;
        /// How well it is known.
        uncertainty: String => required;
        /// Straight pieces by increasing current, each beginning where the one before ends.
        piece: Vec<PieceTable> => required;
    }

    /// A straight piece: diameter = intercept + slope · current.
    pub struct PieceTable {
        /// Least current.
        from: Current => required;
        /// Greatest current.
        to: Current => required;
        /// Diameter at zero current.
        intercept: Length => required;
        /// Change of the diameter with the current.
        slope: FocusSlope => required;
    }
}

/// The calibration `name` and where it comes from: one that ships, or, where the name ends in `.toml`, a file relative to `folder`.
///
/// # Errors
/// [`DataFileError`] listing what ships, or saying what is wrong with the file.
///
/// ```
/// let (focus, _) = meltpath::ebm::gun::focus::load("a1-beraud-2016", std::path::Path::new(".")).unwrap();
/// assert!((focus.diameter(4e-3).unwrap() - 0.41367).abs() < 1e-9);
/// ```
pub fn load(name: &str, folder: &Path) -> Result<(FocusCalibration, String), DataFileError> {
    DataText::load("focus calibration", name, focus::ALL, folder)?.read(parse)
}

fn parse(text: &str) -> Result<(FocusCalibration, String), Problems> {
    let file = settings::parse(text, |_: &FocusFile| Vec::new())?;
    let pieces = file.piece.iter().map(|p| FocusPiece {
        range: [p.from.0, p.to.0],
        intercept: p.intercept.0,
        slope: p.slope.0,
    });
    let calibration = FocusCalibration::new(pieces.collect())
        .map_err(|e| -> Problem { file.piece.problem(e.to_string()) })?;
    Ok((calibration, format!("{}: {}", *file.name, *file.source)))
}
