//! Recipes as data files.

use crate::files::figure::Power;
use crate::head::power::PowerLaw;
use crate::head::recipe::{LaserDelays, Recipe, SkyWriting};
use crate::head::vector::STRONGEST;
use meltpath_base::settings::{self, Problem, Problems, Sourced};
use meltpath_base::{Speed, Time, table};

/// Fastest spot that mirrors draw, mm/s: 1 km/s.
const FASTEST: f64 = 1e6;

/// Longest wait, s.
const LONGEST: f64 = 3600.0;

table! {
    /// Speeds, power, waits and delays of a laser scan job.
    pub struct RecipeFile {
        /// Name in words.
        name: String => required;
        /// Speed on contours.
        contour_speed: Sourced<Speed> where up_to(FASTEST) => required;
        /// Speed on fill lines.
        fill_speed: Sourced<Speed> where up_to(FASTEST) => required;
        /// Speed of jumps between contours.
        contour_jump_speed: Sourced<Speed> where up_to(FASTEST) => required;
        /// Speed of jumps between fill lines.
        fill_jump_speed: Sourced<Speed> where up_to(FASTEST) => required;
        /// Power of the laser.
        power: Sourced<Power> where up_to(STRONGEST) => required;
        /// Wait after a jump.
        jump_wait: Sourced<Time> where within(0.0, LONGEST) => required;
        /// Wait at the end of a mark.
        mark_wait: Sourced<Time> where within(0.0, LONGEST) => required;
        /// Wait at the corners of a contour.
        polygon_wait: Sourced<Time> where within(0.0, LONGEST) => required;
        /// When the laser goes on after its command.
        laser_on_delay: Sourced<Time> => required;
        /// When the laser goes off after its command.
        laser_off_delay: Sourced<Time> => required;
        /// The power follows the spot's speed, down to this.
        power_down_to: Sourced<Power> where within(0.0, STRONGEST) => none("the power is constant");
        /// Sky-writing: time at the line's speed before each line of a fill.
        run_in: Sourced<Time> where within(0.0, LONGEST) => none("none");
        /// Sky-writing: time at the line's speed after each line of a fill.
        run_out: Sourced<Time> where within(0.0, LONGEST) => none("none");
    }
}

/// Reads a recipe's TOML text.
///
/// # Errors
/// Everything wrong, with its place in the file.
pub fn parse_recipe(text: &str) -> Result<Recipe, Problems> {
    let file = settings::parse(text, |_: &RecipeFile| Vec::new())?;
    let power = file.power.0;
    let run = |time: &Option<Sourced<Time>>| time.as_ref().map_or(0.0, |t| t.0);
    let recipe = Recipe {
        contour_speed: file.contour_speed.0,
        fill_speed: file.fill_speed.0,
        contour_jump_speed: file.contour_jump_speed.0,
        fill_jump_speed: file.fill_jump_speed.0,
        contour_power: power,
        fill_power: power,
        jump_wait: file.jump_wait.0,
        mark_wait: file.mark_wait.0,
        polygon_wait: file.polygon_wait.0,
        delays: LaserDelays {
            on: file.laser_on_delay.0,
            off: file.laser_off_delay.0,
        },
        power_law: match &*file.power_down_to {
            None => PowerLaw::Constant,
            Some(least) => PowerLaw::WithSpeed { least: least.0 },
        },
        sky_writing: (file.run_in.is_some() || file.run_out.is_some()).then(|| SkyWriting {
            run_in: run(&file.run_in),
            run_out: run(&file.run_out),
        }),
        name: file.name.value,
    };
    recipe.check().map_err(|e| Problem::new(e.to_string()))?;
    Ok(recipe)
}
