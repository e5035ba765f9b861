//! The joint move that leads to the begin of a run from where every axis stands at the end of the one before: what it costs, and its room.

use super::choice::travel;
use super::stretch::apart;
use super::task::Guard;
use crate::cell::Values;

/// A joint move from other beads costs as much as going as far along such a length, mm.
const GOING_OVER: f64 = 1e4;
/// Greatest step of a joint between places of such a move that are looked at, rad: the way that is chosen is swept.
const OVER_STEP: f64 = 0.1;

/// The least room along a joint move of a command, mm, as its guard tells it.
pub(super) fn least_room(from: &Values, to: &Values, (guard, command): (Guard<'_>, u32)) -> f64 {
    let (a, b) = (from.external(), to.external());
    // a metre of the track counts as a radian
    let turned = travel(a, b).sqrt();
    let pieces = (apart(&from.arm, &to.arm).max(turned) / OVER_STEP).ceil();
    let pieces = pieces.max(1.0) as u32;
    let rooms = (0..=pieces).map(|piece| {
        let share = f64::from(piece) / f64::from(pieces);
        let arm = std::array::from_fn(|i| from.arm[i] + (to.arm[i] - from.arm[i]) * share);
        guard(command, &Values::of(arm, a.lerp(b, share)), 0.0)
    });
    rooms.fold(f64::INFINITY, f64::min)
}

/// What a joint move costs, rad²/mm.
pub(super) fn cost_of(from: &Values, to: &Values) -> f64 {
    let squares = from.arm.iter().zip(to.arm).map(|(a, b)| (b - a) * (b - a));
    (squares.sum::<f64>() + travel(from.external(), to.external())) / GOING_OVER
}
