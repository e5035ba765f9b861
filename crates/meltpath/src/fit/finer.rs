//! What finer charts and more layers would change of a fit: every body once more at the fitted beam.

use meltpath_base::Observer;
use meltpath_thermal::calibration::coupon::{BeamGuess, Bench, Charts, Coupon, CouponError, sizes};
use meltpath_thermal::calibration::fit::Fitted;

use super::measurements::{LAYERS, Measurements, finer};

/// The fit against finer charts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Finer {
    /// Spacing of the charts, mm.
    pub(super) spacing: f64,
    /// Layers of each body.
    pub(super) layers: u32,
    /// How much larger each body would be on charts and layers without an end: what finer ones change, taken to go with the square of the
    /// spacing. Not a number where the model does not answer on them.
    pub(super) off: Vec<f64>,
    /// How far the parameters would move by that.
    pub(super) moved: Vec<f64>,
}

impl Finer {
    /// Draws the bodies at the fitted beam.
    ///
    /// # Errors
    /// When the work is given up; a beam that does not answer moves by what is not a number.
    pub(super) fn of(
        fitted: &Fitted,
        measured: &Measurements,
        bench: &Bench<'_>,
        observer: &dyn Observer,
    ) -> Result<Self, CouponError> {
        let spacing = finer(bench.spacing);
        let finer = Bench {
            spacing,
            layers: bench.layers.max(LAYERS),
            ..*bench
        };
        let coupons: Vec<&Coupon> = measured.all.iter().map(|m| &m.coupon).collect();
        let guess = BeamGuess {
            efficiency: fitted.values[0],
            width: fitted.values[1],
        };
        observer.stage(
            &format!("all bodies once more, charts {:.1} µm apart", 1e3 * spacing),
            0,
        );
        let drawn = sizes(&coupons, &finer, guess, &mut Charts::default(), observer);
        let off = match drawn {
            Ok(drawn) => {
                let left = 1.0 - (spacing / bench.spacing).powi(2);
                let pairs = drawn.iter().zip(&fitted.predicted);
                pairs.map(|(fine, coarse)| (fine - coarse) / left).collect()
            }
            Err(why) => {
                observer.check().map_err(|_| why)?;
                vec![f64::NAN; coupons.len()]
            }
        };
        Ok(Finer {
            spacing,
            layers: finer.layers,
            moved: fitted.moved(&off),
            off,
        })
    }
}
