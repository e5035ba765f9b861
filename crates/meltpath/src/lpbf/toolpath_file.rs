//! What a recipe marks as a 3MF toolpath for other software.

use std::io::Cursor;

use meltpath_base::output::OutputFolder;
use meltpath_programs::toolpath_3mf::{Beam, PlanarWriter};
use meltpath_scan_head::head::recipe::Recipe;

use super::error::LpbfError;
use super::plan::work::Work;

/// Writes the package of recipe number `number`, from 1.
pub(super) fn write(
    folder: &OutputFolder,
    number: usize,
    (name, work): (&str, &Work),
    recipe: &Recipe,
) -> Result<(), LpbfError> {
    let beam = Beam {
        speed: [recipe.contour_speed, recipe.fill_speed],
        power: [recipe.contour_power, recipe.fill_power],
        jump_speed: [recipe.contour_jump_speed, recipe.fill_jump_speed],
    };
    let mut writer = PlanarWriter::new(Cursor::new(Vec::new()), beam, name)?;
    for layer in work.planned()? {
        writer.layer(&*layer?)?;
    }
    let bytes = writer.finish()?.into_inner();
    folder.write(&format!("toolpath-{number}.build.3mf"), |w| {
        w.write_all(&bytes)
    })?;
    Ok(())
}
