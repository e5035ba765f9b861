//! The corners of a raster.

/// Lines of `line` mm to and fro, `hatch` mm apart, of `length` mm in all.
pub(crate) fn raster(length: f64, line: f64, hatch: f64) -> Vec<[f64; 2]> {
    let lines = (length / (line + hatch)).round() as usize;
    (0..lines)
        .flat_map(|n| {
            let y = n as f64 * hatch;
            if n % 2 == 0 {
                [[0.0, y], [line, y]]
            } else {
                [[line, y], [0.0, y]]
            }
        })
        .collect()
}
