//! Recipes as data files.

use crate::files::figure::{Figure, HeadFileError, POWER, Reading, SPEED, TIME, read};
use crate::head::power::PowerLaw;
use crate::head::recipe::{LaserDelays, Recipe, SkyWriting};
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecipeFile {
    name: String,
    contour_speed: Figure,
    fill_speed: Figure,
    contour_jump_speed: Figure,
    fill_jump_speed: Figure,
    power: Figure,
    jump_wait: Figure,
    mark_wait: Figure,
    polygon_wait: Figure,
    laser_on_delay: Figure,
    laser_off_delay: Figure,
    /// The power follows the spot's speed, down to this.
    power_down_to: Option<Figure>,
    /// Sky-writing: time at the line's speed before and after each line of a fill.
    run_in: Option<Figure>,
    run_out: Option<Figure>,
}

/// Reads a recipe's TOML text.
///
/// # Errors
/// [`HeadFileError`] with the place in the file.
pub fn parse_recipe(text: &str) -> Result<Recipe, HeadFileError> {
    let file: RecipeFile = toml::from_str(text).map_err(|e| HeadFileError::Form(e.to_string()))?;
    let r = Reading { table: "recipe" };
    let power = read!(r, file, power, POWER);
    let or_zero = |key, figure: &Option<Figure>| {
        figure
            .as_ref()
            .map_or(Ok(0.0), |figure| r.get(key, figure, TIME))
    };
    let (run_in, run_out) = (
        or_zero("run_in", &file.run_in)?,
        or_zero("run_out", &file.run_out)?,
    );
    Ok(Recipe {
        contour_speed: read!(r, file, contour_speed, SPEED),
        fill_speed: read!(r, file, fill_speed, SPEED),
        contour_jump_speed: read!(r, file, contour_jump_speed, SPEED),
        fill_jump_speed: read!(r, file, fill_jump_speed, SPEED),
        contour_power: power,
        fill_power: power,
        jump_wait: read!(r, file, jump_wait, TIME),
        mark_wait: read!(r, file, mark_wait, TIME),
        polygon_wait: read!(r, file, polygon_wait, TIME),
        delays: LaserDelays {
            on: read!(r, file, laser_on_delay, TIME),
            off: read!(r, file, laser_off_delay, TIME),
        },
        power_law: match &file.power_down_to {
            None => PowerLaw::Constant,
            Some(least) => PowerLaw::WithSpeed {
                least: r.get("power_down_to", least, POWER)?,
            },
        },
        sky_writing: (file.run_in.is_some() || file.run_out.is_some())
            .then_some(SkyWriting { run_in, run_out }),
        name: file.name,
    })
}
