//! A bead with a corner: its pursuit length, its volumes by definition, and how far the deposit's model is from it.

pub mod deviation;
pub(super) mod judge;
pub(super) mod law;
pub mod relief;
pub(super) mod torch;
mod way;

use meltpath_deposition::consumable::Wire;
use meltpath_deposition::corner::{Balance, Fold, Passage, REACH, Target};
use meltpath_deposition::pursuit::PursuitMode;
use meltpath_deposition::pursuit::identify::{Identified, identify};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_perception::beads::{self, Corner};

use super::file::{CornerSetting, Scan};
use super::found::MeasuredCorner;
use relief::Relief;
use way::{along, path};

/// Crest points so near the ends of a bead are left out, mm: start and end are none of its corner's.
const ENDS: f64 = 6.0;
/// Standard uncertainty of a length because a crest is smoothed where it bends: errors on computed beads of 45 to 150° are half to one and
/// a half times it.
const CREST: f64 = 0.01;
/// How far beside half the bead's width its metal is looked for at a corner, mm.
const BESIDE: f64 = 2.5;

/// From the frame of the plate to that of the path.
struct Frame {
    at: DVec2,
    along: DVec2,
}

impl Frame {
    fn seen(&self, p: DVec2) -> DVec2 {
        let d = p - self.at;
        DVec2::new(d.dot(self.along), self.along.perp_dot(d))
    }
}

/// Whether a place is away from the ends of a bead.
fn between_ends(p: DVec2, turn: f64, legs: [f64; 2]) -> bool {
    let (way, _) = along(p, turn);
    way > ENDS - legs[0] && way < legs[1] - ENDS
}

/// The way on of a torch that comes the other way along the same legs: its turn has the other sign.
fn reversed(path: &[DVec2]) -> Vec<DVec2> {
    path.iter().rev().copied().collect()
}

/// What a corner that was found tells.
pub(super) fn of(corner: &Corner, told: CornerSetting, scan: &Scan) -> MeasuredCorner {
    let wire_section = scan.wire.as_ref().map(Wire::section);
    let order = if told.turn > 0.0 { [0, 1] } else { [1, 0] };
    let [first, second] = order.map(|k| &corner.legs[k]);
    let frame = Frame {
        at: corner.at,
        along: -first.outwards,
    };
    let legs = [first.length, second.length];
    let turn = told.turn;
    let nominal = path(turn, legs);
    let torch: Vec<DVec2> = match &told.torch {
        Some(samples) => samples.iter().map(|s| s.1).collect(),
        None => nominal.to_vec(),
    };
    let crest: Vec<DVec2> = corner
        .crest
        .iter()
        .map(|p| frame.seen(*p))
        .filter(|p| between_ends(*p, turn, legs))
        .collect();
    let find = |way: &[DVec2], mode| identify(way, &crest, mode, corner.window);
    let pursuit = find(&torch, PursuitMode::Rope).map(|found| Identified {
        sigma: found.sigma.hypot(CREST * found.length),
        ..found
    });
    // up to a right angle nothing pushes the follower back, and both are one
    let rigid = if turn.abs() > std::f64::consts::FRAC_PI_2 {
        find(&torch, PursuitMode::Rigid).ok().map(|r| r.length)
    } else {
        pursuit.as_ref().ok().map(|p| p.length)
    };
    let other = find(&reversed(&torch), PursuitMode::Rope);
    let mean = corner.mean();
    let [width, height, area] = mean;
    let points: Vec<DVec3> = corner
        .points
        .iter()
        .map(|p| frame.seen(p.truncate()).extend(p.z))
        .collect();
    let relief = Relief::of(&points);
    let reach = 0.5 * width + BESIDE;
    let (measured, shown) = relief.volume(|p| {
        let (s, off) = along(p, turn);
        s.abs() <= REACH && off <= reach
    });
    let passage = told
        .torch
        .as_ref()
        .and_then(|samples| Passage::of(samples, turn));
    let speed = told.setting.travel_speed;
    let passed = passage.unwrap_or(Passage::steady(speed));
    let section = profile(corner, order);
    let target = Target {
        angle: turn,
        section: |v| section.at(v),
        half_width: section.half_width(),
    };
    let balance = Balance {
        measured,
        wire: wire_section.map(|s| s * told.setting.feed() * passed.time),
        nominal: 2.0 * REACH * area,
        path: passed.length * area,
        fold: target.fold(),
    };
    let deviation = pursuit.as_ref().ok().and_then(|pursuit| {
        let laid = deviation::Laid {
            width,
            area,
            wire_section: wire_section.unwrap_or(1.0),
            length: pursuit.length,
            setting: &told.setting,
            pools: &scan.pools,
            turn,
            legs,
        };
        deviation::of(&relief, &laid, told.torch.as_deref(), &pursuit.curve)
    });
    let shown_by_model = deviation
        .as_ref()
        .and_then(|d| shown_by(&d.metal, &torch, corner.window, (turn, legs)));
    MeasuredCorner {
        shown_by_model,
        place: corner.place,
        ends: order.map(|k| corner.ends[k]),
        seen: corner.turn(),
        legs,
        mean,
        scatter: scatter(corner, area),
        crest,
        relief,
        rigid,
        other_way: other.ok().map(|o| o.off),
        pursuit,
        balance,
        parabola: Fold::of_parabola(turn, width, height),
        slowing: passage.map(|p| p.kinematic(area, speed)),
        shown,
        deviation,
        told,
    }
}

/// The pursuit length that the crest of the model's metal shows, mm.
fn shown_by(
    metal: &[DVec3],
    torch: &[DVec2],
    window: f64,
    (turn, legs): (f64, [f64; 2]),
) -> Option<f64> {
    let crest: Vec<DVec2> = beads::crest(metal, 0.5 * window)
        .into_iter()
        .filter(|p| between_ends(*p, turn, legs))
        .collect();
    let found = identify(torch, &crest, PursuitMode::Rope, window).ok()?;
    Some(found.length)
}

/// Standard deviation of the area over sections, mm², and how many there are.
fn scatter(corner: &Corner, mean: f64) -> (f64, usize) {
    let sections = corner.legs.iter().flat_map(|l| &l.sections);
    let squares: Vec<f64> = sections.map(|s| (s.area - mean).powi(2)).collect();
    let degrees = (squares.len() as f64 - 1.0).max(1.0);
    (
        (squares.iter().sum::<f64>() / degrees).sqrt(),
        squares.len(),
    )
}

/// The mean section of the straight parts: heights at even steps across, left of the path positive.
struct Profile {
    heights: Vec<f64>,
    step: f64,
}

impl Profile {
    /// Height at a distance from the middle, mm.
    fn at(&self, v: f64) -> f64 {
        let place = v / self.step + 0.5 * (self.heights.len() - 1) as f64;
        if !(place >= 0.0 && place <= (self.heights.len() - 1) as f64) {
            return 0.0;
        }
        let low = (place as usize).min(self.heights.len() - 2);
        let share = place - low as f64;
        self.heights[low] * (1.0 - share) + self.heights[low + 1] * share
    }

    fn half_width(&self) -> f64 {
        0.5 * self.step * (self.heights.len() - 1) as f64
    }
}

/// The mean of all sections. Those of the first leg are seen from the corner, against the way of the torch: left and right change places.
fn profile(corner: &Corner, order: [usize; 2]) -> Profile {
    const STEP: f64 = 0.25;
    let [width, ..] = corner.mean();
    let count = (1.1 * width / STEP).ceil() as usize | 1;
    let mut sums = vec![(0.0, 0.0); count];
    for (leg, side) in order.into_iter().zip([-1.0, 1.0]) {
        for section in &corner.legs[leg].sections {
            for p in &section.points {
                let v = side * (p.x - section.centre);
                let place = (v / STEP + 0.5 * (count - 1) as f64).round();
                if place >= 0.0
                    && let Some(sum) = sums.get_mut(place as usize)
                {
                    *sum = (sum.0 + p.y, sum.1 + 1.0);
                }
            }
        }
    }
    let mut heights: Vec<f64> = sums
        .iter()
        .map(|(z, n)| if *n > 0.0 { (z / n).max(0.0) } else { 0.0 })
        .collect();
    // the plate's noise is no section
    let least = 0.02 * heights.iter().copied().fold(0.0, f64::max);
    for h in &mut heights {
        if *h < least {
            *h = 0.0;
        }
    }
    Profile {
        heights,
        step: STEP,
    }
}
