//! How many beads fill a width and how far apart: `n = round((W − w)/d) + 1`, then `(n − 1)·d + w = W`.

use crate::fill::settings::{FillSettings, Spacing};

/// Steps of about `stepover` that divide `room` exactly, and their length; at least one, never wider than `widest`.
pub(crate) fn divide(room: f64, stepover: f64, widest: f64) -> (usize, f64) {
    let mut n = (room / stepover).round().max(1.0);
    if room / n > widest {
        n += 1.0;
    }
    (n as usize, room / n)
}

/// A position across the lines where one would lie best: at an edge of the region, above or below a hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wish {
    /// Where.
    pub(crate) at: f64,
    /// Length of boundary that runs along the lines there, mm.
    pub(crate) flat: f64,
}

/// Cost of a millimetre of flat boundary without its line, against [`stretch`].
const COST_OF_A_MISS: f64 = 1.0;

/// Cost of steps that differ from the stepover, in millimetres of missed flat boundary per bead width of room.
fn stretch(room: f64, settings: &FillSettings) -> f64 {
    let (n, step) = divide(room, settings.stepover, settings.widest_spacing());
    60.0 * settings.width * n as f64 * (step / settings.stepover - 1.0).powi(2)
}

/// Positions of the lines between the first and the last wish (sorted). With [`Spacing::Fill`] both ends have a line and
/// so has each wish between them that is worth the change of spacing it takes; with [`Spacing::Exact`] as many lines
/// at the stepover as fit into the room and what an inset has `lost` of it, in the middle.
pub(crate) fn positions(wishes: &[Wish], lost: f64, settings: &FillSettings) -> Vec<f64> {
    let [first, .., last] = wishes else {
        return wishes.iter().map(|w| w.at).collect();
    };
    let room = last.at - first.at;
    let d = settings.stepover;
    if room < 0.5 * d {
        return vec![0.5 * (first.at + last.at)];
    }
    if settings.spacing == Spacing::Exact {
        let n = ((room + lost) / d).floor().max(0.0);
        let start = 0.5 * (first.at + last.at - n * d);
        // nor may it lay the outer ones on the edge of where lines may lie, where they are cut off
        let at = |i: usize| (start + i as f64 * d).clamp(first.at, last.at);
        return (0..=n as usize).map(at).collect();
    }
    // cheapest way from the first wish to the last over any of those between
    let n = wishes.len();
    let mut missed = vec![0.0; n + 1];
    for (i, w) in wishes.iter().enumerate() {
        missed[i + 1] = missed[i] + COST_OF_A_MISS * w.flat;
    }
    let mut cost = vec![f64::INFINITY; n];
    let mut from = vec![0; n];
    cost[0] = 0.0;
    for j in 1..n {
        for i in 0..j {
            let gap = wishes[j].at - wishes[i].at;
            if cost[i].is_finite() && gap > 0.25 * d {
                let c = cost[i] + stretch(gap, settings) + missed[j] - missed[i + 1];
                if c < cost[j] {
                    (cost[j], from[j]) = (c, i);
                }
            }
        }
    }
    let mut stops = vec![n - 1];
    while let Some(&j) = stops.last()
        && j > 0
    {
        stops.push(from[j]);
    }
    stops.reverse();
    let mut lines = vec![first.at];
    for pair in stops.windows(2) {
        let (a, b) = (wishes[pair[0]].at, wishes[pair[1]].at);
        let (n, step) = divide(b - a, d, settings.widest_spacing());
        lines.extend((1..=n).map(|i| if i == n { b } else { a + i as f64 * step }));
    }
    lines
}

/// The distance between nested contours, mm, that suits widths best. `widths` holds local half widths of the region
/// with the length of centre line that has them; `widest` is the largest half width where it is a spot and not a line
/// (a disc's middle), which only an even number of beads can fill.
pub(crate) fn nested(
    widths: impl Iterator<Item = (f64, f64)>,
    widest: Option<f64>,
    settings: &FillSettings,
) -> f64 {
    let (w, d) = (settings.width, settings.stepover);
    if settings.spacing == Spacing::Exact {
        return d;
    }
    // half widths in bins of a hundredth of a bead, so that the search does not depend on the axis' sampling
    let mut bins = std::collections::BTreeMap::<u32, f64>::new();
    for (radius, length) in widths {
        if 2.0 * radius > w {
            *bins
                .entry((radius / (0.01 * w)).round() as u32)
                .or_default() += length;
        }
    }
    let steps = |room: f64, s: f64| room / s;
    let cost = |s: f64| {
        let mut total = 0.0;
        let mut weight = 0.0;
        for (&bin, &length) in &bins {
            let n = steps(2.0 * 0.01 * w * f64::from(bin) - w, s);
            total += length * (n - n.round().max(1.0)).powi(2);
            weight += length;
        }
        if let Some(radius) = widest {
            let n = steps(2.0 * radius - w, s);
            // the nearest odd number of steps
            let odd = 2.0 * ((n - 1.0) / 2.0).round().max(0.0) + 1.0;
            total += 2.0 * w * (n - odd).powi(2);
            weight += 2.0 * w;
        }
        if weight > 0.0 {
            total / weight + 0.5 * (s / d - 1.0).powi(2)
        } else {
            (s / d - 1.0).powi(2)
        }
    };
    let highest = settings.widest_spacing();
    let lowest = 0.7 * d;
    let mut best = (cost(d), d);
    // the exact divisions of the commonest widths and of the spot, and a fine scan between the bounds
    let exact = bins
        .iter()
        .max_by(|a, b| a.1.total_cmp(b.1))
        .map(|(&bin, _)| 0.01 * w * f64::from(bin))
        .into_iter()
        .chain(widest)
        .flat_map(|radius| {
            let room = 2.0 * radius - w;
            let n = (room / d).round().max(1.0);
            [n - 1.0, n, n + 1.0].map(|n| room / n.max(1.0))
        });
    let scan = (0..=100).map(|i| lowest + (highest - lowest) * f64::from(i) / 100.0);
    for s in exact.chain(scan).filter(|s| (lowest..=highest).contains(s)) {
        let c = cost(s);
        if c < best.0 - 1e-9 {
            best = (c, s);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(spacing: Spacing) -> FillSettings {
        FillSettings {
            spacing,
            ..FillSettings::new(6.5, 4.62)
        }
    }

    #[test]
    fn six_beads_at_the_stepover() {
        let wishes = [
            Wish {
                at: 0.0,
                flat: 120.0,
            },
            Wish {
                at: 5.0 * 4.62,
                flat: 120.0,
            },
        ];
        for spacing in [Spacing::Fill, Spacing::Exact] {
            let lines = positions(&wishes, 0.02, &settings(spacing));
            assert_eq!(lines.len(), 6);
            assert!(lines.windows(2).all(|p| (p[1] - p[0] - 4.62).abs() < 1e-9));
        }
    }

    /// A side of a whole number of spacings has that many lines, half a spacing inside at both ends: the inset's rounding takes none.
    #[test]
    fn exact_lines_stay_where_lines_may_lie() {
        let exact = FillSettings {
            spacing: Spacing::Exact,
            ..FillSettings::new(0.125, 0.125)
        };
        let [low, high] = [0.0625 + 3e-4, 3.9375 - 3e-4];
        let wishes = [low, high].map(|at| Wish { at, flat: 6.0 });
        let lines = positions(&wishes, 0.04 * 0.125, &exact);
        assert_eq!(lines.len(), 32);
        assert!(lines.iter().all(|y| (low..=high).contains(y)), "{lines:?}");
        assert!(lines.windows(2).all(|p| (p[1] - p[0] - 0.125).abs() < 4e-4));
    }

    #[test]
    fn a_hole_between_gets_its_lines_where_that_is_cheap() {
        let wishes = [0.0, 23.0, 37.5, 60.0].map(|at| Wish { at, flat: 30.0 });
        let lines = positions(&wishes, 0.0, &settings(Spacing::Fill));
        for wish in &wishes {
            assert!(
                lines.iter().any(|y| (y - wish.at).abs() < 1e-9),
                "{lines:?}"
            );
        }
        assert!(
            lines
                .windows(2)
                .all(|p| (3.2..=5.3).contains(&(p[1] - p[0]))),
            "{lines:?}"
        );
    }

    #[test]
    fn never_wider_than_melts_together() {
        let (n, step) = divide(1.45 * 4.62, 4.62, 5.2);
        assert_eq!(n, 2);
        assert!(step < 5.2);
    }

    #[test]
    fn nested_contours_fill_a_wall_exactly() {
        let s = settings(Spacing::Fill);
        // 8 beads across: half width (7 d + w) / 2
        let radius = 0.5 * (7.0 * 4.62 + 6.5);
        assert!((nested([(radius, 100.0)].into_iter(), None, &s) - 4.62).abs() < 0.02);
        // a disc fills with an odd number of steps across
        let across = 2.0 * 20.0 - 6.5;
        let n = across / nested(std::iter::empty(), Some(20.0), &s);
        assert!((n - 7.0).abs() < 0.01, "{n}");
    }

    #[test]
    fn beads_lie_as_far_apart_as_melts_together_and_no_farther() {
        // 0.8 of the width are 5.2 mm
        let lines = |room: f64| {
            let wishes = [0.0, room].map(|at| Wish { at, flat: 30.0 });
            positions(&wishes, 0.0, &settings(Spacing::Fill)).len()
        };
        assert_eq!([5.15, 5.25].map(lines), [2, 3]);
    }
}
