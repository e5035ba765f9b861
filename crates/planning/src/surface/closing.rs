//! Where a wall closes: passes so narrow that one pool covers much of them are left out, and the opening is told.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;

use super::pass::SurfacePass;

/// An opening that a wall keeps where its passes become too narrow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Number of the widest pass that is left out.
    pub pass: u32,
    /// Its middle, mm.
    pub position: DVec3,
    /// Its length over π: the diameter of a round opening, mm.
    pub width: f64,
    /// Length of all passes that are left out there, mm.
    pub length: f64,
}

/// Passes without those at closing ends that are shorter than `least` mm round, and the openings that stay.
///
/// An end closes where its last pass is shorter than half of `least`; a narrow pipe, as wide at its end as before, is kept, and so is a
/// neck that widens again: a pass is left out only where no other stands on it. With `least` of four pools the heading turns
/// by a right angle within one pool: on a shorter round the pool runs into its own beginning, and the arm turns torch or table
/// once round within seconds. (Ours: no measurement of shorter rounds stands behind the bead.)
///
/// Passes come sorted by number, as plans have them; `spacing` is the distance between them, mm.
pub fn without_narrow(
    mut passes: Vec<SurfacePass>,
    least: f64,
    spacing: f64,
) -> (Vec<SurfacePass>, Vec<Opening>) {
    let mut openings: Vec<Opening> = Vec::new();
    let mut kept: Vec<SurfacePass> = Vec::with_capacity(passes.len());
    // from the last on, as those above decide
    while let Some(pass) = passes.pop() {
        let long = pass.length();
        if !pass.is_closed() || long >= least || bears(&pass, &kept, spacing) {
            kept.push(pass);
            continue;
        }
        let ring = &pass.points[1..];
        let sum: DVec3 = ring.iter().map(|p| p.position).sum();
        let position = sum / ring.len() as f64;
        // what it stood on before belongs to the same opening
        let same = |o: &&mut Opening| {
            o.pass == pass.number + 1 && o.position.distance(position) <= 0.5 * long + spacing
        };
        let above = openings.iter_mut().find(same);
        if above.is_none() && long >= 0.5 * least {
            kept.push(pass);
            continue;
        }
        let wider = Opening {
            pass: pass.number,
            position,
            width: long / std::f64::consts::PI,
            length: long + above.as_ref().map_or(0.0, |o| o.length),
        };
        match above {
            Some(opening) => *opening = wider,
            None => openings.push(wider),
        }
    }
    kept.reverse();
    openings.reverse();
    (kept, openings)
}

/// Whether a pass of the next number in `kept`, whose last come first, was laid from a place of `pass`.
fn bears(pass: &SurfacePass, kept: &[SurfacePass], spacing: f64) -> bool {
    let line: Vec<DVec3> = pass.points.iter().map(|p| p.position).collect();
    let ring = Segments::new([line.as_slice()], spacing);
    let next = kept
        .iter()
        .rev()
        .take_while(|k| k.number <= pass.number + 1)
        .filter(|k| k.number == pass.number + 1);
    next.flat_map(|k| &k.points)
        .filter_map(|p| p.from)
        .any(|from| ring.nearest(from, 0.1 * spacing).is_some())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::surface::SurfacePoint;

    /// Round passes of these radii, a millimetre above each other, about a vertical axis at x.
    fn rounds(radii: &[f64], x: f64) -> Vec<SurfacePass> {
        let place = |radius: f64, z: f64, i: usize| {
            let (s, c) = (TAU * (i % 90) as f64 / 90.0).sin_cos();
            DVec3::new(x + radius * c, radius * s, z)
        };
        let mut passes: Vec<SurfacePass> = Vec::new();
        for (k, radius) in radii.iter().enumerate() {
            let point = |i| SurfacePoint {
                position: place(*radius, k as f64, i),
                normal: DVec3::X,
                growth: DVec3::Z,
                from: (k > 0).then(|| place(radii[k - 1], k as f64 - 1.0, i)),
            };
            passes.push(SurfacePass {
                number: k as u32 + 1,
                points: (0..=90).map(point).collect(),
            });
        }
        passes
    }

    #[test]
    fn a_cap_stays_open_and_says_how_wide() {
        let passes = rounds(&[20.0, 12.0, 7.0, 3.0, 0.5], 0.0);
        let (kept, openings) = without_narrow(passes, 50.0, 1.0);
        assert_eq!(kept.iter().map(|p| p.number).collect::<Vec<_>>(), [1, 2]);
        let [opening] = openings[..] else {
            panic!("{openings:?}")
        };
        assert_eq!(opening.pass, 3);
        assert!((opening.width - 14.0).abs() < 0.01, "{opening:?}");
        assert!((opening.length - TAU * 10.5).abs() < 0.1, "{opening:?}");
        assert!(opening.position.distance(DVec3::new(0.0, 0.0, 2.0)) < 1e-9);
    }

    #[test]
    fn a_neck_is_kept_and_two_caps_are_two_openings() {
        let neck = rounds(&[20.0, 6.0, 5.0, 9.0, 20.0], 0.0);
        assert_eq!(without_narrow(neck.clone(), 50.0, 1.0), (neck, vec![]));
        let mut both = rounds(&[20.0, 6.0, 2.0], 0.0);
        both.extend(rounds(&[20.0, 5.0, 1.0], 100.0));
        both.sort_by_key(|p| p.number);
        let (kept, openings) = without_narrow(both, 50.0, 1.0);
        assert_eq!((kept.len(), openings.len()), (2, 2));
        let mut widths: Vec<f64> = openings.iter().map(|o| o.width * PI / TAU).collect();
        widths.sort_by(f64::total_cmp);
        assert!((widths[0] - 5.0).abs() < 0.01 && (widths[1] - 6.0).abs() < 0.01);
    }

    /// Rounds of 12 mm would close a cap: what stands on them keeps them.
    #[test]
    fn a_neck_of_any_width_bears_what_stands_on_it() {
        let neck = rounds(&[20.0, 3.0, 2.0, 3.0, 20.0], 0.0);
        assert_eq!(without_narrow(neck.clone(), 50.0, 1.0), (neck, vec![]));
    }

    /// Six tenths of a millimetre beside a cap a wall goes on: the cap closes all the same.
    #[test]
    fn what_stands_on_the_wall_beside_does_not_stand_on_a_cap() {
        let mut both = rounds(&[20.0, 2.0], 0.0);
        both.extend(rounds(&[2.0, 2.0, 9.0], 4.6));
        both.sort_by_key(|p| p.number);
        let (kept, openings) = without_narrow(both, 50.0, 1.0);
        assert_eq!((kept.len(), openings.len()), (4, 1));
        assert!((openings[0].width - 4.0).abs() < 0.01, "{openings:?}");
    }

    #[test]
    fn a_narrow_pipe_is_laid_to_its_end() {
        // rounds of 44 mm
        let pipe = rounds(&[7.0; 5], 0.0);
        assert_eq!(without_narrow(pipe.clone(), 50.0, 1.0), (pipe, vec![]));
        // of 19 mm: a post
        let post = without_narrow(rounds(&[3.0; 5], 0.0), 50.0, 1.0);
        assert_eq!((post.0.len(), post.1.len()), (0, 1));
    }

    #[test]
    fn open_passes_and_long_ones_are_as_they_were() {
        let mut passes = rounds(&[20.0, 15.0], 0.0);
        passes[1].points.truncate(10);
        assert_eq!(
            without_narrow(passes.clone(), 50.0, 1.0),
            (passes, Vec::new())
        );
    }
}
