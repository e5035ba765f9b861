//! How evenly passes lie on a surface, and how far the torch leans, with places.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;

use super::pass::{SurfacePass, SurfacePoint};
use super::torch::{Torch, axes_along};

/// A value at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extreme {
    /// The value.
    pub value: f64,
    /// Number of the pass.
    pub pass: u32,
    /// Where, mm.
    pub position: DVec3,
}

/// How a value is distributed along passes; each point stands for half of the way to its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distribution {
    /// Least value.
    pub least: Extreme,
    /// Greatest value.
    pub greatest: Extreme,
    /// Mean along the length.
    pub mean: f64,
    /// Values below which a twentieth, the half and nineteen twentieths of the length lie.
    pub quantiles: [f64; 3],
}

/// One value of a point, and the length it stands for.
struct Weighted {
    at: Extreme,
    length: f64,
}

/// The distribution of a value that points of passes have; `None` where no point has it.
pub fn distribution(
    passes: &[SurfacePass],
    mut value: impl FnMut(&SurfacePass, usize) -> Option<f64>,
) -> Option<Distribution> {
    let mut all = Vec::new();
    for pass in passes {
        let step = |i: usize| {
            let pair = pass.points.get(i).zip(pass.points.get(i + 1));
            pair.map_or(0.0, |(a, b)| a.position.distance(b.position))
        };
        for (i, point) in pass.points.iter().enumerate() {
            let Some(value) = value(pass, i) else {
                continue;
            };
            let before = if i == 0 { 0.0 } else { step(i - 1) };
            all.push(Weighted {
                at: Extreme {
                    value,
                    pass: pass.number,
                    position: point.position,
                },
                length: 0.5 * (before + step(i)),
            });
        }
    }
    all.sort_by(|a, b| a.at.value.total_cmp(&b.at.value));
    let (least, greatest) = (all.first()?.at, all.last()?.at);
    let total: f64 = all.iter().map(|w| w.length).sum();
    let mean = all.iter().map(|w| w.at.value * w.length).sum::<f64>() / total;
    let below = |share: f64| {
        let mut sum = 0.0;
        let found = all.iter().find(|w| {
            sum += w.length;
            sum >= share * total
        });
        found.map_or(greatest.value, |w| w.at.value)
    };
    Some(Distribution {
        least,
        greatest,
        mean: if total > 0.0 { mean } else { least.value },
        quantiles: [0.05, 0.5, 0.95].map(below),
    })
}

/// How evenly passes lie, against the distance that was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evenness {
    /// Distances from the points that the passes were laid from, mm.
    pub spacing: Distribution,
    /// Greatest ratio between the widest and the closest place of one pass: how much the height of a bead would have to vary along it.
    pub ratio: Extreme,
    /// Greatest deviation from the distance that was asked for, mm, at its place.
    pub deviation: Extreme,
    /// Share of the length whose distance is farther from what was asked for than the tolerance.
    pub beyond: f64,
}

/// How evenly passes lie: every distance against `spacing` ± `tolerance`, mm. `None` where no pass has one before it.
pub fn evenness(passes: &[SurfacePass], spacing: f64, tolerance: f64) -> Option<Evenness> {
    let spacings = distribution(passes, |pass, i| pass.points[i].spacing())?;
    let mut ratio: Option<Extreme> = None;
    for group in passes.chunk_by(|a, b| a.number == b.number) {
        let known = distribution(group, |pass, i| pass.points[i].spacing());
        let Some(d) = known.filter(|d| d.least.value > 0.0) else {
            continue;
        };
        let value = d.greatest.value / d.least.value;
        if ratio.is_none_or(|r| value > r.value) {
            ratio = Some(Extreme {
                value,
                ..d.greatest
            });
        }
    }
    let far = |point: &SurfacePoint| Some((point.spacing()? - spacing).abs());
    let deviations = distribution(passes, |pass, i| far(&pass.points[i]))?;
    let outside = distribution(passes, |pass, i| {
        let far = far(&pass.points[i])?;
        Some(f64::from(u8::from(far > tolerance)))
    })?;
    Some(Evenness {
        spacing: spacings,
        ratio: ratio?,
        deviation: deviations.greatest,
        // a single place has no length, and still is one
        beyond: if outside.greatest.value > 0.0 {
            outside.mean.max(f64::MIN_POSITIVE)
        } else {
            0.0
        },
    })
}

/// Distances from the nearest point of the pass before, mm: what a bead stands on, whichever point it was laid from. First passes,
/// and places with nothing of the pass before within ten times `spacing`, are left out.
pub fn nearest_spacing(passes: &[SurfacePass], spacing: f64) -> Option<Distribution> {
    let groups: Vec<&[SurfacePass]> = passes.chunk_by(|a, b| a.number == b.number).collect();
    let mut found: Vec<Vec<Option<f64>>> = Vec::with_capacity(passes.len());
    for (g, group) in groups.iter().enumerate() {
        let before = g.checked_sub(1).map(|b| groups[b]);
        let before = before.filter(|b| b[0].number + 1 == group[0].number);
        let lines = before.unwrap_or_default().iter();
        let lines: Vec<Vec<DVec3>> = lines
            .map(|p| p.points.iter().map(|q| q.position).collect())
            .collect();
        let near = Segments::new(lines.iter().map(Vec::as_slice), 2.0 * spacing);
        for pass in *group {
            let distance =
                |p: &SurfacePoint| Some(near.nearest(p.position, 10.0 * spacing)?.distance);
            found.push(pass.points.iter().map(distance).collect());
        }
    }
    let mut index = found.iter().flatten();
    // points come in the order in which they were measured
    distribution(passes, |_, _| index.next().copied().flatten())
}

/// Angles between the torch and the vertical, rad.
pub fn tilts(passes: &[SurfacePass], torch: &Torch) -> Option<Distribution> {
    let axes: Vec<DVec3> = axes_along(passes, torch).into_iter().flatten().collect();
    let mut axes = axes.iter();
    distribution(passes, |_, _| Some(axes.next()?.angle_between(torch.up)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_stands_for_half_of_the_way_to_its_neighbours() {
        let at = |x: f64| SurfacePoint {
            position: DVec3::new(x, 0.0, 0.0),
            normal: DVec3::Y,
            growth: DVec3::Z,
            from: None,
        };
        let pass = SurfacePass {
            number: 1,
            points: [0.0, 1.0, 10.0].map(at).to_vec(),
        };
        // values 0, 1, 2 over 0.5, 5 and 4.5 mm
        let found = distribution(&[pass], |_, i| Some(i as f64)).unwrap();
        assert!((found.mean - 1.4).abs() < 1e-12, "{}", found.mean);
        assert_eq!(found.quantiles[1], 1.0);
    }
}
