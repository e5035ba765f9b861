//! How thick a raked layer really is: powder fills what the melting of the layer below has let sink.
//!
//! Béraud 2016, eqs. 3.2.3-4: `h(0) = p`, `h(i+1) = φ_c h(i) + p`, with `p` the step of the table and `φ_c` the porosity
//! of the consolidated powder.

/// Thickness of layer `layer` (from 0) over ground that is molten in every layer, mm.
///
/// ```
/// use meltpath_thermal::layering::powder_thickness;
/// assert!((powder_thickness(0.05, 0.38, 0) - 0.05).abs() < 1e-12);
/// assert!((powder_thickness(0.05, 0.38, 1) - 0.069).abs() < 1e-12);
/// ```
pub fn powder_thickness(step: f64, porosity: f64, layer: u32) -> f64 {
    // the sum of a geometric series
    settled_thickness(step, porosity) * (1.0 - porosity.powf(f64::from(layer) + 1.0))
}

/// What the thickness tends to, mm.
pub fn settled_thickness(step: f64, porosity: f64) -> f64 {
    step / (1.0 - porosity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ebm_a05_thickness_of_layers() {
        let expected = [50.0, 69.0, 76.22, 78.96, 80.01];
        for (layer, micron) in (0..).zip(expected) {
            let ours = 1e3 * powder_thickness(0.05, 0.38, layer);
            assert!((ours - micron).abs() < 0.01, "{layer}: {ours}");
        }
        assert!((1e3 * settled_thickness(0.05, 0.38) - 80.645).abs() < 0.01);
        // erratum E6: 99 % are passed at the fifth layer already
        let share = |layer| powder_thickness(0.05, 0.38, layer) / settled_thickness(0.05, 0.38);
        assert!(share(3) < 0.99 && share(4) > 0.99);
    }
}
