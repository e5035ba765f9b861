//! What of paths matters inside a rectangle: a sweep's time grows with all its edges, wherever they lie.

use clipper2_rust::core::{Path64, Paths64, Point64};

/// A rectangle on the grid, its edges included.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    low: Point64,
    high: Point64,
}

impl Frame {
    /// The frame round paths; of none, one that holds nothing.
    pub(super) fn round(paths: &Paths64) -> Frame {
        let mut frame = Frame {
            low: Point64::new(i64::MAX, i64::MAX),
            high: Point64::new(i64::MIN, i64::MIN),
        };
        for p in paths.iter().flatten() {
            frame.low = Point64::new(frame.low.x.min(p.x), frame.low.y.min(p.y));
            frame.high = Point64::new(frame.high.x.max(p.x), frame.high.y.max(p.y));
        }
        frame
    }

    /// The part common to both.
    pub(super) fn and(self, other: Frame) -> Frame {
        Frame {
            low: Point64::new(self.low.x.max(other.low.x), self.low.y.max(other.low.y)),
            high: Point64::new(self.high.x.min(other.high.x), self.high.y.min(other.high.y)),
        }
    }

    /// The sides beyond which `p` lies, a bit each.
    fn beyond(self, p: Point64) -> u8 {
        u8::from(p.x < self.low.x)
            | u8::from(p.x > self.high.x) << 1
            | u8::from(p.y < self.low.y) << 2
            | u8::from(p.y > self.high.y) << 3
    }

    /// The paths without vertices that do not matter inside: one that lies beyond the same side as its neighbours may go,
    /// for the way between them stays beyond that side, and windings inside are as before. No vertex is new or moved.
    pub(super) fn crop(self, paths: &mut Paths64) {
        for path in &mut *paths {
            self.thin(path);
        }
        paths.retain(|path| path.len() > 2);
    }

    fn thin(self, path: &mut Path64) {
        let Some(&end) = path.last() else { return };
        let mut before = self.beyond(end);
        let mut kept = 0;
        for i in 0..path.len() {
            let here = self.beyond(path[i]);
            let next = if i + 1 < path.len() {
                path[i + 1]
            } else if kept > 0 {
                path[0]
            } else {
                path[i]
            };
            if before & here & self.beyond(next) == 0 {
                path[kept] = path[i];
                kept += 1;
                before = here;
            }
        }
        path.truncate(kept);
    }
}
