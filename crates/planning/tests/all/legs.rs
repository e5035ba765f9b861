//! Legs of every width: whatever a leg takes, no place stays dry in which a bead has room.

use super::*;
use meltpath_geometry::offset::{inset, stroke};

/// A bracket of two legs, and a hook of three, `leg` wide, with the allowance round them.
fn bracket(leg: f64, allowance: f64) -> [Vec<Region>; 2] {
    let l = 70.0;
    let (a, b) = (leg, l - leg);
    let corners: [&[[f64; 2]]; 2] = [
        &[[0.0, 0.0], [l, 0.0], [l, a], [a, a], [a, l], [0.0, l]],
        &[
            [0.0, 0.0],
            [l, 0.0],
            [l, l],
            [b, l],
            [b, a],
            [a, a],
            [a, l],
            [0.0, l],
        ],
    ];
    corners.map(|c| {
        let outer = c.iter().copied().map(DVec2::from_array).collect();
        let join = Join::Round {
            arc_tolerance: 0.02,
        };
        outset(&[solid(outer)], allowance, join).unwrap()
    })
}

/// Radius of the largest disc without metal, mm, to a tenth.
fn driest(plan: &LayerPlan, regions: &[Region]) -> f64 {
    let lines: Vec<Vec<DVec2>> = plan
        .path
        .passes()
        .map(|p| p.flatten(0.02).0.iter().map(|v| v.truncate()).collect())
        .collect();
    let metal = stroke(&lines, 0.5 * plan.settings.width, 0.01).unwrap();
    let bare = difference(regions, &metal).unwrap();
    let join = Join::Round {
        arc_tolerance: 0.02,
    };
    let room = |r: f64| !inset(&bare, r, join).unwrap().is_empty();
    let radii = (1..=200).map(|i| 0.1 * f64::from(i));
    radii.take_while(|r| room(*r)).last().unwrap_or(0.0)
}

/// Every width in steps of half a millimetre, by every strategy and spacing, in layers of both directions, with and without adapted speeds.
#[test]
fn no_leg_keeps_a_hole_that_a_bead_fills() {
    let turning = LineAngle::Turning {
        first: 0.0,
        step: std::f64::consts::FRAC_PI_2,
    };
    let hybrid = Fill::Hybrid {
        contours: 1,
        order: ContourOrder::InsideOut,
        angle: turning,
    };
    let zigzag = Fill::Zigzag { angle: turning };
    // either allowance with the directions and speeds of four legs
    let legs = (8..=80).map(|half| 0.5 * f64::from(half));
    for (i, leg) in legs.enumerate() {
        let allowance = [0.0, 2.0][(i / 4) % 2];
        let regions = bracket(leg, allowance);
        // legs that meet are a block
        let regions = &regions[..if leg > 34.0 { 1 } else { 2 }];
        for strategy in [hybrid, zigzag, RASTER, INSIDE_OUT, SPIRAL] {
            for (spacing, most) in [(Spacing::Fill, 0.25), (Spacing::Exact, 0.5)] {
                for (k, region) in regions.iter().enumerate() {
                    let layer = 1 + (i + k) as u32 % 2;
                    let paces = [None, Some(Paces::about(12.5, (5.0, 25.0)))];
                    let s = FillSettings {
                        spacing,
                        paces: paces[(i / 2) % 2],
                        ..settings(strategy)
                    };
                    let plan = plan_on(layer, region, &s);
                    let dry = driest(&plan, region);
                    assert!(
                        dry <= most * WIDTH,
                        "leg {leg} + {allowance}, shape {k}, {strategy:?} {spacing:?}, layer {layer}: {dry:.1} mm"
                    );
                }
            }
        }
    }
}
