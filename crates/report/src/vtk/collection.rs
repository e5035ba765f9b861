//! Collections: one file per layer, played by ParaView's time slider.

use std::io::{self, Write};

use crate::escape::escape;

/// Writes a `.pvd` that lists files by step; `entries` are (step, path relative to the `.pvd`, with `/`).
///
/// # Errors
/// What the system says.
///
/// ```
/// let mut out = Vec::new();
/// meltpath_report::vtk::write_collection(&mut out, &[(1.0, "layers/001.vti".to_owned())]).unwrap();
/// assert!(String::from_utf8(out).unwrap().contains("timestep=\"1\""));
/// ```
pub fn write_collection(out: &mut dyn Write, entries: &[(f64, String)]) -> io::Result<()> {
    out.write_all(
        b"<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    )?;
    for (step, path) in entries {
        writeln!(
            out,
            "<DataSet timestep=\"{step}\" group=\"\" part=\"0\" file=\"{}\"/>",
            escape(path)
        )?;
    }
    out.write_all(b"</Collection>\n</VTKFile>\n")
}
