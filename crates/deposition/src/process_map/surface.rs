//! Quadratic response surfaces (interpolator B of the source): Rouchon 2022, eq. 2.1, 2.2, after Suryakumar 2011.

use meltpath_numerics::least_squares::Regression;
use serde::{Deserialize, Serialize};

use super::import::MeasuredBead;

/// C₁ + C₂V_f + C₃V_r + C₄V_f² + C₅V_r² + C₆V_fV_r for width and height, speeds in m/min, sizes in mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// C₁…C₆ of the width.
    pub width: [f64; 6],
    /// C₁…C₆ of the height.
    pub height: [f64; 6],
}

/// How well a surface fits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FitQuality {
    /// Coefficient of determination.
    pub r_squared: f64,
    /// Standard deviation of the residuals, with the degrees of freedom taken off, mm.
    pub sigma: f64,
}

fn terms(vf: f64, vr: f64) -> [f64; 6] {
    [1.0, vf, vr, vf * vf, vr * vr, vf * vr]
}

impl Surface {
    /// Least-squares surfaces through measured beads; `None` with fewer than six beads or settings that do not span
    /// the six terms. Returns the surface with the quality of (width, height).
    pub fn fit(beads: &[MeasuredBead]) -> Option<(Self, FitQuality, FitQuality)> {
        let rows: Vec<[f64; 6]> = beads
            .iter()
            .map(|b| terms(b.wire_feed, b.travel_speed))
            .collect();
        let fit = |values: Vec<f64>| -> Option<([f64; 6], FitQuality)> {
            let mut system = Regression::new(6);
            for (row, value) in rows.iter().zip(&values) {
                system.push(*row, *value);
            }
            let c: [f64; 6] = system.solve().ok()?.values.try_into().ok()?;
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let total: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            let left: f64 = rows
                .iter()
                .zip(&values)
                .map(|(r, v)| (r.iter().zip(&c).map(|(a, b)| a * b).sum::<f64>() - v).powi(2))
                .sum();
            Some((
                c,
                FitQuality {
                    r_squared: if total > 0.0 { 1.0 - left / total } else { 1.0 },
                    sigma: (left / (n - 6.0).max(1.0)).sqrt(),
                },
            ))
        };
        let (width, wq) = fit(beads.iter().map(|b| b.width).collect())?;
        let (height, hq) = fit(beads.iter().map(|b| b.height).collect())?;
        Some((Surface { width, height }, wq, hq))
    }

    /// Width, mm.
    pub fn width_at(&self, vf: f64, vr: f64) -> f64 {
        terms(vf, vr)
            .iter()
            .zip(&self.width)
            .map(|(t, c)| t * c)
            .sum()
    }

    /// Height, mm.
    pub fn height_at(&self, vf: f64, vr: f64) -> f64 {
        terms(vf, vr)
            .iter()
            .zip(&self.height)
            .map(|(t, c)| t * c)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waam_ac7_known_coefficients_come_back() {
        let truth = Surface {
            width: [1.5, 0.8, -2.1, -0.02, 0.7, 0.11],
            height: [2.2, 0.15, -1.4, 0.004, 0.5, -0.06],
        };
        let mut beads = Vec::new();
        for vf in [2.0, 4.0, 6.0, 8.0, 10.0] {
            for vr in [0.5, 1.0, 1.5] {
                beads.push(MeasuredBead {
                    wire_feed: vf,
                    travel_speed: vr,
                    width: truth.width_at(vf, vr),
                    height: truth.height_at(vf, vr),
                });
            }
        }
        let (got, wq, hq) = Surface::fit(&beads).unwrap();
        for (a, b) in got
            .width
            .iter()
            .chain(&got.height)
            .zip(truth.width.iter().chain(&truth.height))
        {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        assert!(wq.r_squared > 1.0 - 1e-12 && hq.r_squared > 1.0 - 1e-12);
        beads[0].width += 1.0;
        let (_, worse, _) = Surface::fit(&beads).unwrap();
        assert!(worse.r_squared < 0.999 && worse.sigma > 0.1);
        assert!(Surface::fit(&beads[..5]).is_none());
        let line: Vec<_> = beads
            .iter()
            .filter(|b| b.travel_speed == 0.5)
            .copied()
            .collect();
        assert!(Surface::fit(&[line.clone(), line].concat()).is_none());
    }
}
