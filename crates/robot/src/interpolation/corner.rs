//! Where the controller dwells: at stops, and at real changes of direction.
//!
//! The dwell T_D of the model (Rouchon 2022, §3.3.1) was identified at corners of 30° and more between segments of 50 mm and more.
//! Put at every via point it would be wrong: a curve cut in chords of 0.5 mm at CNT 50 would run at less than half its speed.
//! The law used here, **an assumption below 30° to be identified from a dry-run log**:
//!
//! 1. At FINE and at CNT 0 the tool stops: dwell T_1 + T_2, exact passage, whatever the angle (thesis p. 65; its bead 12 shows the
//!    accumulation on a straight line). So it does before a wait and at the last command.
//! 2. Elsewhere, the turning at a vertex is split into what a smooth curve through the neighbouring points explains and an excess.
//!    With α the turning at the vertex, and on each side the chord run of length a up to the next vertices, whose turning in the
//!    same sense adds up to β (the run goes on over smaller turnings until β ≥ α/4): that side explains min(β, α, 22.5°) if the
//!    chord's distance from the curve, a·α/8, stays within `chord_error`; the share fades to nothing at twice that. One side is
//!    enough: where a curve runs out into a straight, the last vertex has half the turning of the others.
//!    A circular move explains nothing at its ends: it is not a chord. Where the chain of moves begins or ends, the side takes after the other.
//! 3. Dwell = T_D(CNT) · clamp((excess − `none_below`) / (`full_above` − `none_below`), 0, 1).
//!
//! So chords of a curve carry none whatever their length, a single corner in a path of short collinear moves carries the whole,
//! and a polygon with sides too long to be a curve is corners. Moves shorter than a third of `chord_error` are taken together:
//! their directions are rounding.

use std::f64::consts::FRAC_PI_8;

use meltpath_geometry::math::{DQuat, DVec3};

use crate::command::{Command, Kind, Smoothing};
use crate::controller::Controller;
use crate::interpolation::track::Shape;

/// Vertices looked at on either side before a chain of tiny turnings is taken for straight.
const REACH: usize = 256;
/// Turns of the tool below this are rounding, rad.
const SAME_ORIENTATION: f64 = 1e-7;

/// The path of a command from the previous target; of a joint move its chord ([`crate::interpolation::joints`] bends it).
pub(crate) fn shape(from: DVec3, command: &Command) -> Shape {
    let straight = || {
        let along = command.target - from;
        if along == DVec3::ZERO {
            Shape::Hold(from)
        } else {
            Shape::Line { from, along }
        }
    };
    match command.kind {
        Kind::Wait { .. } => Shape::Hold(from),
        Kind::Line | Kind::Joint(_) => straight(),
        Kind::Arc { via } => meltpath_geometry::arc::Arc::through(from, via, command.target)
            .map_or_else(straight, Shape::Arc),
    }
}

/// Angle by which the tool turns from one orientation to another, rad; 0 where it is rounding.
pub(crate) fn turning(from: DQuat, to: DQuat) -> f64 {
    let angle = from.angle_between(to);
    if angle < SAME_ORIENTATION { 0.0 } else { angle }
}

/// Length of the tip's way, mm, and its directions at both ends; nothing where the tip stays.
fn way(shape: &Shape, command: &Command) -> Option<(f64, [DVec3; 2])> {
    match command.kind.course() {
        Some(course) => (course.length > 0.0).then_some((course.length, course.directions)),
        None => Some((
            shape.length(),
            [shape.start_tangent()?, shape.end_tangent()?],
        )),
    }
}

/// One or several moves taken together, between two vertices.
struct Leg {
    /// Command that ends the leg.
    end: usize,
    length: f64,
    vector: DVec3,
    first: DVec3,
    last: DVec3,
    curved: bool,
}

/// A change of direction between two legs: angle, and the axis it turns about (length sin α).
struct Vertex {
    angle: f64,
    axis: DVec3,
}

/// What one side of a vertex says about its turning.
enum Side {
    /// Turning of a smooth curve, rad.
    Curve(f64),
    /// The chain ends here; the share of the other side's evidence that may stand for it.
    End(f64),
}

fn merge(legs: &mut Vec<Leg>, leg: Leg, shortest: f64) {
    match legs.last_mut() {
        Some(last) if !last.curved && !leg.curved && last.length < shortest => {
            last.vector += leg.vector;
            last.length += leg.length;
            last.end = leg.end;
        }
        _ => legs.push(leg),
    }
}

/// Gives straight legs their directions and finds the turning between neighbours.
fn vertices(legs: &mut [Leg]) -> Vec<Vertex> {
    for leg in legs.iter_mut().filter(|l| !l.curved) {
        leg.first = leg.vector.normalize_or_zero();
        leg.last = leg.first;
    }
    legs.windows(2)
        .map(|pair| {
            let (a, b) = (pair[0].last, pair[1].first);
            let axis = a.cross(b);
            Vertex {
                angle: axis.length().atan2(a.dot(b)),
                axis,
            }
        })
        .collect()
}

/// What the legs before (`forward` = -1) or after (+1) vertex `i` explain of its turning.
fn side(legs: &[Leg], vertices: &[Vertex], i: usize, forward: isize, chord_error: f64) -> Side {
    let here = &vertices[i];
    let mut leg = if forward > 0 { i + 1 } else { i };
    let (mut run, mut turned) = (0.0, 0.0);
    for _ in 0..REACH {
        if legs[leg].curved {
            return Side::Curve(turned);
        }
        run += legs[leg].length;
        let fade = (2.0 - run * here.angle / (8.0 * chord_error)).clamp(0.0, 1.0);
        if fade == 0.0 {
            return Side::Curve(0.0);
        }
        // vertex i lies between legs i and i + 1
        let next = if forward > 0 {
            Some(leg)
        } else {
            leg.checked_sub(1)
        };
        let Some(vertex) = next.and_then(|v| vertices.get(v)) else {
            return Side::End(fade);
        };
        turned += vertex.angle * vertex.axis.dot(here.axis).signum();
        // a wave rather than a curve; collinear points turn either way by rounding
        if turned < -0.1 * here.angle {
            return Side::Curve(0.0);
        }
        if turned >= 0.25 * here.angle {
            return Side::Curve(turned.min(here.angle).min(FRAC_PI_8) * fade);
        }
        leg = leg.wrapping_add_signed(forward);
    }
    Side::Curve(0.0)
}

/// Turning at vertex `i` that no smooth curve through its neighbours explains, rad.
fn excess(legs: &[Leg], vertices: &[Vertex], i: usize, chord_error: f64) -> f64 {
    let before = side(legs, vertices, i, -1, chord_error);
    let after = side(legs, vertices, i, 1, chord_error);
    let explained = match (before, after) {
        (Side::Curve(a), Side::Curve(b)) => a + b,
        (Side::Curve(a), Side::End(f)) | (Side::End(f), Side::Curve(a)) => a * (1.0 + f),
        (Side::End(_), Side::End(_)) => 0.0,
    };
    (vertices[i].angle - explained).max(0.0)
}

/// A chain of moves without a stop, and what becomes of its vertices.
struct Chain<'a> {
    controller: &'a Controller,
    commands: &'a [Command],
    legs: Vec<Leg>,
}

impl Chain<'_> {
    fn close(&mut self, dwells: &mut [f64]) {
        let law = &self.controller.corner;
        let (none, full) = (law.none_below.value.0, law.full_above.value.0);
        let vertices = vertices(&mut self.legs);
        for (i, vertex) in vertices.iter().enumerate() {
            if vertex.angle <= none {
                continue;
            }
            let excess = excess(&self.legs, &vertices, i, law.chord_error.value.0);
            let share = ((excess - none) / (full - none)).clamp(0.0, 1.0);
            let command = self.legs[i].end;
            if let Smoothing::Cnt(smoothing) = self.commands[command].smoothing {
                dwells[command] = share * self.controller.dwell(smoothing);
            }
        }
        self.legs.clear();
    }
}

/// The dwell after each command, s: T_1 + T_2 where the tool stops there.
pub fn dwells(
    start: DVec3,
    orientation: DQuat,
    commands: &[Command],
    controller: &Controller,
) -> Vec<f64> {
    let stop = controller.transition();
    let shortest = controller.corner.chord_error.value.0 / 3.0;
    let mut dwells = vec![0.0; commands.len()];
    let mut chain = Chain {
        controller,
        commands,
        legs: Vec::new(),
    };
    let (mut from, mut turned_from, mut stopped) = (start, orientation, true);
    for (k, command) in commands.iter().enumerate() {
        if matches!(command.kind, Kind::Wait { .. }) {
            if !stopped {
                // the tool comes to rest before it waits
                dwells[k - 1] = stop;
                chain.close(&mut dwells[..k - 1]);
                stopped = true;
            }
            continue;
        }
        let shape = shape(from, command);
        let moves = command.kind.course().is_some_and(|c| c.time > 0.0);
        let turns = moves || turning(turned_from, command.orientation) > 0.0;
        let ends = match command.smoothing {
            Smoothing::Fine => true,
            Smoothing::Cnt(share) => share <= 0.0,
        };
        if let Some((length, [first, last])) = way(&shape, command) {
            let leg = Leg {
                end: k,
                length,
                vector: command.target - from,
                first,
                last,
                curved: matches!(shape, Shape::Arc(_)) || command.kind.course().is_some(),
            };
            merge(&mut chain.legs, leg, shortest);
            stopped = false;
        } else if turns {
            // the tool turns in place: what comes after has no direction to keep
            chain.close(&mut dwells);
            stopped = false;
        }
        if ends && !stopped {
            dwells[k] = stop;
            stopped = true;
            chain.close(&mut dwells);
            dwells[k] = stop;
        }
        (from, turned_from) = (command.target, command.orientation);
    }
    if let (false, Some(last)) = (stopped, dwells.last_mut()) {
        *last = stop;
        let n = dwells.len() - 1;
        chain.close(&mut dwells[..n]);
    }
    dwells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::tests::arcmate;

    /// Dwells at the inner points of a path, in shares of the full dwell at CNT 50.
    fn shares(points: &[DVec3]) -> Vec<f64> {
        let c = arcmate();
        let commands: Vec<_> = (1_u32..)
            .zip(&points[1..])
            .map(|(i, &p)| Command::line(i, p, 12.5, Smoothing::Cnt(0.5)))
            .collect();
        let mut d = dwells(points[0], commands[0].orientation, &commands, &c);
        assert_eq!(d.pop(), Some(c.transition()), "the last command stops");
        d.iter().map(|t| t / c.dwell(0.5)).collect()
    }

    fn polar(radius: f64, degrees: f64) -> DVec3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        DVec3::new(radius * cos, radius * sin, 0.0)
    }

    fn turned(lengths: &[f64], turns: &[f64]) -> Vec<DVec3> {
        let (mut p, mut heading) = (DVec3::ZERO, 0.0);
        let mut points = vec![p];
        for (i, l) in lengths.iter().enumerate() {
            p += polar(*l, heading);
            points.push(p);
            heading += turns.get(i).copied().unwrap_or(0.0);
        }
        points
    }

    #[test]
    fn evidence_of_a_curve_fades_with_the_chord_error_of_its_chords() {
        // three chords that turn by 0.1 rad each; their sagitta is length · angle / 8
        let explained = |length: f64| {
            let leg = |end: usize| Leg {
                end,
                length,
                vector: DVec3::ZERO,
                first: DVec3::ZERO,
                last: DVec3::ZERO,
                curved: false,
            };
            let turn = || Vertex {
                angle: 0.1,
                axis: DVec3::Z * 0.1,
            };
            let legs = [0, 1, 2, 3].map(leg);
            match side(&legs, &[turn(), turn(), turn()], 1, 1, 0.05) {
                Side::Curve(angle) => angle,
                Side::End(_) => f64::NAN,
            }
        };
        // whole up to the chord error, none from twice as much
        for (sagitta, share) in [
            (0.02, 1.0),
            (0.05, 1.0),
            (0.0625, 0.75),
            (0.075, 0.5),
            (0.1, 0.0),
        ] {
            let found = explained(8.0 * sagitta / 0.1);
            assert!((found - 0.1 * share).abs() < 1e-12, "{sagitta}: {found}");
        }
    }

    #[test]
    fn long_segments_follow_the_ramp() {
        for (turn, share) in [
            (3.0, 0.0),
            (5.0, 0.0),
            (10.0, 0.2),
            (17.5, 0.5),
            (30.0, 1.0),
            (90.0, 1.0),
            (150.0, 1.0),
        ] {
            let found = shares(&turned(&[50.0; 4], &[turn, -turn, turn]));
            let same = shares(&turned(&[50.0; 4], &[turn; 3]));
            for d in found.iter().chain(&same) {
                assert!((d - share).abs() < 1e-9, "{turn}: {d}");
            }
        }
    }

    #[test]
    fn chords_of_a_curve_carry_none() {
        for (radius, chord) in [
            (30.0_f64, 5.0_f64),
            (30.0, 3.7),
            (30.0, 0.2),
            (30.0, 0.01),
            (5.0, 1.5),
            (1.0, 0.6),
            (200.0, 12.0),
        ] {
            let step = (chord / radius).to_degrees();
            let n = (360.0 / step) as usize;
            let mut points: Vec<_> = (0..=n).map(|i| polar(radius, i as f64 * step)).collect();
            points.push(polar(radius, 360.0));
            let d = shares(&points);
            assert!(d.iter().all(|&s| s == 0.0), "{radius} {chord}: {d:?}");
        }
    }

    #[test]
    fn chords_of_uneven_length_and_split_facets_carry_none() {
        let mut at = 0.0;
        let mut points = vec![];
        for i in 0..200 {
            points.push(polar(30.0, at));
            at += [9.5, 0.4, 4.0, 7.5, 1.0][i % 5];
        }
        assert!(shares(&points).iter().all(|&s| s == 0.0));
        // a facet cut in two by the diagonal of a meshed cylinder
        let facets: Vec<_> = (0..36).map(|i| polar(20.0, f64::from(i) * 10.0)).collect();
        let split: Vec<_> = facets
            .windows(2)
            .flat_map(|w| [w[0], w[0].lerp(w[1], 0.3)])
            .collect();
        assert!(shares(&split).iter().all(|&s| s == 0.0));
    }

    #[test]
    fn one_corner_among_short_moves_carries_all() {
        let mut points: Vec<_> = (0..200).map(|i| DVec3::X * (f64::from(i) * 0.5)).collect();
        let corner = DVec3::X * 100.0;
        points.extend((0..200).map(|i| corner + DVec3::Y * (f64::from(i) * 0.5)));
        let d = shares(&points);
        assert!((d.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        assert_eq!(d[199], 1.0);
    }

    #[test]
    fn a_kink_on_a_circle_is_a_corner() {
        // 30° more at one vertex of a finely cut circle
        let mut turns = vec![0.4; 200];
        turns[100] = 35.0;
        let d = shares(&turned(&[0.2; 201], &turns));
        assert!(d[100] > 0.9, "{}", d[100]);
        assert!((d.iter().sum::<f64>() - d[100]).abs() < 1e-9);
    }

    #[test]
    fn fillets_are_smooth_and_zigzag_ends_are_corners() {
        let fillet = turned(
            &[50.0, 0.78, 0.78, 0.78, 0.78, 50.0],
            &[11.25, 22.5, 22.5, 22.5, 11.25],
        );
        assert!(
            shares(&fillet).iter().all(|&s| s < 1e-9),
            "{:?}",
            shares(&fillet)
        );
        let zigzag = shares(&turned(
            &[60.0, 4.6, 60.0, 4.6, 60.0],
            &[90.0, 90.0, -90.0, -90.0],
        ));
        assert!(zigzag.iter().all(|&s| s == 1.0));
    }

    #[test]
    fn rounding_to_micrometres_makes_no_corners() {
        let points: Vec<_> = (0..20_000)
            .map(|i| polar(30.0, f64::from(i) * 0.02))
            .map(|p| (p * 1e3).round() / 1e3)
            .collect();
        assert!(shares(&points).iter().all(|&s| s == 0.0));
    }

    #[test]
    fn circular_moves_turn_without_a_dwell_and_end_in_corners() {
        let c = arcmate();
        let cnt = |id, target| Command::line(id, target, 12.5, Smoothing::Cnt(0.5));
        let arc = Command {
            kind: Kind::Arc {
                via: DVec3::new(
                    50.0 + 10.0 * 0.5_f64.sqrt(),
                    10.0 - 10.0 * 0.5_f64.sqrt(),
                    0.0,
                ),
            },
            ..cnt(2, DVec3::new(60.0, 10.0, 0.0))
        };
        let commands = [
            cnt(1, DVec3::X * 50.0),
            arc,
            cnt(3, DVec3::new(60.0, 60.0, 0.0)),
            cnt(4, DVec3::new(90.0, 60.0, 0.0)),
        ];
        let d = dwells(DVec3::ZERO, commands[0].orientation, &commands, &c);
        assert_eq!(d, [0.0, 0.0, c.dwell(0.5), c.transition()]);
    }

    #[test]
    fn stops_before_waits_and_not_twice() {
        let c = arcmate();
        let fine = |id, x| Command::line(id, DVec3::X * x, 12.5, Smoothing::Fine);
        let wait = Command {
            kind: Kind::Wait { time: 1.0 },
            ..fine(9, 0.0)
        };
        let cnt = Command::line(2, DVec3::X * 20.0, 12.5, Smoothing::Cnt(1.0));
        let commands = [
            fine(0, 0.0),
            fine(1, 10.0),
            fine(1, 10.0),
            cnt,
            wait,
            fine(3, 20.0),
        ];
        let d = dwells(DVec3::ZERO, wait.orientation, &commands, &c);
        let stop = c.transition();
        assert_eq!(d, [0.0, stop, 0.0, stop, 0.0, 0.0]);
        assert_eq!(turning(DQuat::IDENTITY, DQuat::from_rotation_x(1e-9)), 0.0);
    }
}
