//! How thick the layers of a file are, by the heights that it tells.

/// The thickest layers that powder beds are laid in, mm: a layer alone in its file that stands no higher lies on the plate.
const THICKEST: f64 = 0.2;

/// Thickness of the layer at `index`, mm, where the heights of all layers of its file, mm, tell it: what it stands above the one before, of
/// the first one what the second stands above it.
pub(super) fn of(heights: &[f64], index: usize) -> Option<f64> {
    let step = match (index, heights) {
        (0, [alone]) => Some(*alone).filter(|height| *height <= THICKEST),
        (0, [first, second, ..]) => Some(second - first),
        _ => Some(heights.get(index)? - heights.get(index - 1)?),
    };
    step.filter(|step| *step > 0.0)
}

#[cfg(test)]
mod tests {
    use super::of;

    #[test]
    fn heights_tell_thicknesses_where_they_can() {
        let near = |found: Option<f64>, wanted: f64| (found.unwrap() - wanted).abs() < 1e-12;
        assert!(near(of(&[0.03, 0.08, 0.18], 2), 0.1));
        assert!(near(of(&[0.03, 0.08, 0.18], 0), 0.05));
        assert!(near(of(&[0.05], 0), 0.05));
        assert_eq!(of(&[5.05], 0), None);
        assert_eq!(of(&[0.0, 0.0], 1), None);
        assert_eq!(of(&[0.2, 0.1], 1), None);
    }
}
