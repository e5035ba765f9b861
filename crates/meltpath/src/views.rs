//! What people look at: results turned into pages, 3D scenes, plots, tables and field files.

pub mod compare;
pub mod ebm;
pub mod fit;
pub mod focus;
pub(crate) mod health;
pub(crate) mod lpbf;
pub mod measure;
pub mod motion_log;
pub mod records;
pub(crate) mod tune;
pub mod waam;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::series::csv::write_columns;

/// Numbers by name and unit as a CSV file; whole ones have no point there.
fn write_csv(
    folder: &OutputFolder,
    name: &str,
    columns: &[(&str, &str, Vec<f64>)],
) -> Result<(), OutputError> {
    folder.write(name, |out| {
        write_columns(out, columns).map_err(std::io::Error::other)
    })
}
