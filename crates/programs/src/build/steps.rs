//! How finely programs tell the axes beside the arm.

use meltpath_toolpath::Pass;

use crate::cell::CellProgramming;
use crate::inform::Pulses;
use crate::program::Dialect;

/// Most axes of a positioner.
pub(super) const MOST_TURNING: usize = 3;
/// Most axes, with the track.
pub(super) const MOST_AXES: usize = 1 + MOST_TURNING;
/// Most dialects write thousandths of a mm and of a degree.
const DIGITS: f64 = 1e3;

/// Steps of the axes beside the arm: positions are told for the axes as a program says them, so that the torch is in the part where it is planned.
#[derive(Debug, Clone)]
pub(super) struct Steps {
    /// How many axes carry the arm, before those that turn the part.
    slides: usize,
    /// Steps a mm of the track, a degree of the others.
    each: [f64; MOST_AXES],
}

impl Steps {
    /// Those of a dialect: whole pulses of a Yaskawa.
    pub(super) fn of(cell: &CellProgramming, dialect: Dialect) -> Self {
        let slides = usize::from(cell.track.is_some());
        let mut each = [DIGITS; MOST_AXES];
        if dialect == Dialect::Inform {
            let pulses = Pulses::of(cell);
            if let Some(base) = pulses.of_base() {
                each[0] = base;
            }
            let station = pulses.of_station().unwrap_or_default();
            for (axis, scale) in each.iter_mut().skip(slides).zip(station) {
                *axis = *scale;
            }
        }
        Steps { slides, each }
    }

    /// The track as a program says it, mm.
    pub(super) fn track(&self, along: f64) -> f64 {
        stepped(along, self.each[0])
    }

    /// The axes that turn the part as a program says them, deg; given in rad.
    pub(super) fn turning(&self, angles: &[f64]) -> Vec<f64> {
        let each = self.each.iter().skip(self.slides);
        let pairs = angles.iter().zip(each);
        pairs.map(|(a, n)| stepped(a.to_degrees(), *n)).collect()
    }

    /// The external axes at a point of a pass, those that carry the arm in mm, the others in deg; zeros where it says none.
    pub(super) fn at(&self, pass: &Pass<'_>, i: usize) -> [f64; MOST_AXES] {
        let mut axes = [0.0; MOST_AXES];
        let numbered = axes.iter_mut().zip(&self.each).enumerate();
        for ((number, (axis, steps)), said) in numbered.zip(pass.external(i)) {
            let said = said.unwrap_or(0.0);
            let said = if number < self.slides {
                said
            } else {
                said.to_degrees()
            };
            *axis = stepped(said, *steps);
        }
        axes
    }

    /// Halfway between two places of the axes.
    pub(super) fn halfway(&self, a: [f64; MOST_AXES], b: [f64; MOST_AXES]) -> [f64; MOST_AXES] {
        std::array::from_fn(|i| stepped(0.5 * (a[i] + b[i]), self.each[i]))
    }
}

fn stepped(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps
}
