//! How well a job is filled: by the whole of its surface, and by the worst of its layers or squares.

use meltpath_geometry::math::DVec2;

use super::swept_surface::Rate;

/// Layers and squares below this surface, mm², are not judged alone: their ends weigh more than their lines.
pub const JUDGED_ALONE: f64 = 1.0;

/// How a square or layer was filled.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaFill {
    /// The number of its layer.
    pub layer: u32,
    /// Its middle, mm.
    pub middle: DVec2,
    /// Its surface to fill, mm².
    pub surface: f64,
    /// The rate in each mode; empty where nothing is to be filled.
    pub rates: Vec<Rate>,
}

/// The worst of the layers or squares that are judged alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstFill {
    /// The number of its layer.
    pub layer: u32,
    /// Its middle, mm.
    pub middle: DVec2,
    /// Its rate.
    pub rate: Rate,
}

/// How a job is filled in one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FillShare {
    /// Of the whole surface to fill.
    pub whole: Rate,
    /// Of the worst area of at least [`JUDGED_ALONE`]; none where all are smaller.
    pub worst: Option<WorstFill>,
    /// Areas that have something to fill.
    pub filled: usize,
}

impl FillShare {
    /// Of all areas, in the mode of number `mode`; none where nothing is to be filled.
    pub fn of(areas: &[AreaFill], mode: usize) -> Option<Self> {
        let rated = || {
            areas
                .iter()
                .filter_map(|area| Some((area, *area.rates.get(mode)?)))
        };
        let surface: f64 = rated().map(|(area, _)| area.surface).sum();
        if surface <= 0.0 {
            return None;
        }
        let mean = |of: fn(Rate) -> f64| rated().map(|(a, r)| a.surface * of(r)).sum::<f64>();
        let doubts: f64 = rated().map(|(a, r)| (a.surface * r.doubt).powi(2)).sum();
        let worst = rated()
            .filter(|(area, _)| area.surface >= JUDGED_ALONE)
            .min_by(|a, b| a.1.share.total_cmp(&b.1.share))
            .map(|(area, rate)| WorstFill {
                layer: area.layer,
                middle: area.middle,
                rate,
            });
        Some(FillShare {
            whole: Rate {
                share: mean(|r| r.share) / surface,
                doubt: doubts.sqrt() / surface,
            },
            worst,
            filled: rated().count(),
        })
    }

    /// What is judged: the worst of those that are judged alone, or the whole where that is worse.
    pub fn judged(&self) -> Rate {
        self.worst
            .map(|w| w.rate)
            .into_iter()
            .chain([self.whole])
            .min_by(|a, b| a.share.total_cmp(&b.share))
            .unwrap_or(self.whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(layer: u32, surface: f64, share: Option<f64>) -> AreaFill {
        AreaFill {
            layer,
            middle: DVec2::ZERO,
            surface,
            rates: share
                .map(|share| Rate { share, doubt: 0.0 })
                .into_iter()
                .collect(),
        }
    }

    /// A layer of contours alone neither helps nor harms; a large badly filled one is not hidden by good ones, a small one counts
    /// by its surface.
    #[test]
    fn a_bad_layer_is_not_hidden() {
        let areas = [
            area(1, 30.0, Some(0.9)),
            area(2, 0.0, None),
            area(3, 10.0, Some(0.5)),
            area(4, 0.5, Some(0.0)),
        ];
        let share = FillShare::of(&areas, 0).unwrap();
        assert_eq!(share.filled, 3);
        assert!((share.whole.share - 32.0 / 40.5).abs() < 1e-12);
        assert_eq!(share.worst.unwrap().layer, 3);
        assert_eq!(share.judged().share, 0.5);
        let small = FillShare::of(&areas[3..], 0).unwrap();
        assert_eq!((small.worst, small.judged().share), (None, 0.0));
        assert_eq!(FillShare::of(&areas[1..2], 0), None);
    }
}
