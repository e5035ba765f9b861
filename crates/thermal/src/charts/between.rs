//! Charts for a beam power between those of two sets that differ in it alone.
//!
//! A beam of twice the power takes a point to the same enthalpy in somewhat less than half the time, whatever the depth: the
//! logarithm of each time is taken straight along the logarithm of the power. How far that lies from charts computed for
//! the power is measured in `tests/all/chart_between.rs`.

use crate::charts::{Chart, ChartSet, ChartSettings, CoolingCurve, HeatingCurve, WarmGround};

/// Largest ratio of the two powers: within it highest temperatures of lines are those of charts of their own within 10 K in the
/// mean, though single voxels differ by up to 125 K.
pub const WIDEST: f64 = 1.25;

/// Charts for `power` (W) between those of `a` and `b`, in either order. `None` where they differ in more than the power, do
/// not enclose it, or lie more than [`WIDEST`] apart.
pub fn between(a: &ChartSet, b: &ChartSet, power: f64) -> Option<ChartSet> {
    let (low, high) = if a.settings.power <= b.settings.power {
        (a, b)
    } else {
        (b, a)
    };
    let [from, to] = [low, high].map(|s| s.settings.power);
    let alike = ChartSettings {
        power: from,
        ..high.settings.clone()
    } == low.settings;
    let shares = |s: &ChartSet| -> Vec<f64> { s.charts.iter().map(|c| c.powder_share).collect() };
    let grounds = |s: &ChartSet| -> Vec<f64> { s.warm.iter().map(|w| w.enthalpy).collect() };
    let fits = alike
        && low.fingerprint == high.fingerprint
        && low.depths == high.depths
        && low.distances == high.distances
        && shares(low) == shares(high)
        && grounds(low) == grounds(high);
    let enclosed = from < power && power < to && to <= WIDEST * from * (1.0 + 1e-9);
    if !(fits && enclosed) {
        return None;
    }
    let weight = (power / from).ln() / (to / from).ln();
    let mixed = |a: &[Chart], b: &[Chart]| -> Vec<Chart> {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| chart(a, b, weight)).collect()
    };
    let warm = low.warm.iter().zip(&high.warm);
    Some(ChartSet {
        settings: ChartSettings {
            power,
            ..low.settings.clone()
        },
        charts: mixed(&low.charts, &high.charts),
        warm: warm
            .map(|(a, b)| WarmGround {
                charts: mixed(&a.charts, &b.charts),
                ..*a
            })
            .collect(),
        ..low.clone()
    })
}

fn chart(a: &Chart, b: &Chart, weight: f64) -> Chart {
    let heating = a.heating.iter().zip(&b.heating);
    let cooling = a.cooling.iter().zip(&b.cooling);
    Chart {
        powder_share: a.powder_share,
        heating: heating
            .map(|(a, b)| HeatingCurve {
                end: straight(a.end, b.end, weight),
                times: times(&a.times, &b.times, weight),
            })
            .collect(),
        cooling: cooling
            .map(|(a, b)| CoolingCurve {
                from: straight(a.from, b.from, weight),
                to: straight(a.to, b.to, weight),
                times: times(&a.times, &b.times, weight),
            })
            .collect(),
    }
}

fn straight(a: f32, b: f32, weight: f64) -> f32 {
    let (a, b) = (f64::from(a), f64::from(b));
    (a + weight * (b - a)) as f32
}

/// Times on the way from curve to curve; a time of nothing stays nothing, and what rises in both rises between them.
fn times(a: &[f32], b: &[f32], weight: f64) -> Vec<f32> {
    let one = |(a, b): (&f32, &f32)| {
        let (a, b) = (f64::from(*a), f64::from(*b));
        if a > 0.0 && b > 0.0 {
            (a.ln() + weight * (b / a).ln()).exp() as f32
        } else {
            0.0
        }
    };
    a.iter().zip(b).map(one).collect()
}
