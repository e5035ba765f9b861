//! How much room each body still has at least, so that it need not be looked at in every place.

use super::metal::Metal;
use super::motion::Gone;

/// How much farther than is of interest a body is looked for, mm: what is found there spares the places after it.
const AHEAD: f64 = 25.0;

/// What is known of the room around each bar.
#[derive(Default)]
pub(super) struct Rooms<'a> {
    pub(super) metal: Vec<Room>,
    pub(super) table: Vec<Room>,
    /// The metal that was looked at.
    of: Option<&'a Metal>,
}

impl<'a> Rooms<'a> {
    /// Nothing is known of the room in other metal.
    pub(super) fn of(&mut self, metal: &'a Metal, count: usize) {
        if self.of.is_none_or(|of| !std::ptr::eq(of, metal)) {
            self.metal.clear();
        }
        self.of = Some(metal);
        self.metal.resize(count, Room::UNKNOWN);
        self.table.resize(count, Room::UNKNOWN);
    }
}

/// What is known of the room around one bar, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Room {
    /// No more than its distance.
    least: f64,
    /// Whether it is its distance in this very place.
    looked: bool,
}

impl Room {
    const UNKNOWN: Room = Room {
        least: f64::NEG_INFINITY,
        looked: false,
    };

    /// Goes on by a stretch. Its distances at both ends of it where it may come nearer than `below`: `look` tells those at its begin and,
    /// where it is asked with `true`, at its end, up to a most.
    pub(super) fn looked(
        &mut self,
        gone: Gone,
        below: f64,
        look: impl Fn(bool, f64) -> f64,
    ) -> Option<[f64; 2]> {
        let Gone { chord, bend } = gone;
        if self.least - chord - bend >= below {
            self.least -= chord;
            self.looked = false;
            return None;
        }
        let most = below + chord + 2.0 * bend + AHEAD;
        let mut before = self.least;
        let now = look(true, most);
        let near = |before| Gone::least([before, now], &[gone]) < below;
        if !self.looked && near(before) {
            before = look(false, most);
        }
        *self = Room {
            least: now,
            // what lies beyond the most may be farther: with more of interest it is to be looked at again
            looked: now < most,
        };
        near(before).then_some([before, now])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where nothing was of interest a body may be farther than what was asked for: with more of interest its distance is what it is.
    #[test]
    fn what_was_not_looked_at_is_not_near() {
        let gone = Gone {
            chord: 1.0,
            bend: 0.1,
        };
        // as far as is asked for, and no farther
        let look = |_: bool, most: f64| most.min(40.0);
        let mut room = Room::UNKNOWN;
        assert!(room.looked(gone, -1e6, look).is_none());
        assert!(room.looked(gone, 10.0, look).is_none());
        let [a, b] = room.looked(gone, 50.0, look).unwrap();
        assert!(a >= 35.0 && b >= 35.0, "{a} {b}");
    }
}
