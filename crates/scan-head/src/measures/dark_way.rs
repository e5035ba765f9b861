//! Contours that no light reaches: what of the commanded way lies farther than a reach from all light on it, and is not passed by
//! light that goes on beside it either, as it does at corners that the spot cuts.

use meltpath_geometry::math::DVec2;

use super::sweep::{Covered, Interval, Line};

/// How far light reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightReach {
    /// To either side of its path, mm.
    pub aside: f64,
    /// The longest stretch of a contour that it may leave out while it goes on without a break, mm: there the contour is beside its
    /// mark, not dark.
    pub past: f64,
}

impl LightReach {
    /// Of a spot of that diameter, mm, where contour errors of `bound` mm are good.
    pub fn of(spot: f64, bound: f64) -> Self {
        LightReach {
            aside: spot,
            past: PAST * spot.max(bound),
        }
    }
}

/// A corner that is cut is left out over about twice its error to either side.
const PAST: f64 = 4.0;

/// What of contours stays dark.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dark {
    /// Length of all contours that were commanded, mm.
    pub commanded: f64,
    /// Length of them that no light reaches, mm.
    pub length: f64,
    /// The longest stretch without light.
    pub longest: Stretch,
}

/// A stretch of contours without light.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stretch {
    /// Its length, mm.
    pub length: f64,
    /// Where it begins, mm.
    pub from: DVec2,
    /// The number of its layer.
    pub layer: u32,
}

/// A commanded contour, and what of it light reached so far.
#[derive(Debug, Clone)]
pub(super) struct ContourLight {
    vector: u32,
    layer: u32,
    a: DVec2,
    b: DVec2,
    lit: Covered,
}

impl ContourLight {
    /// Vector `vector`, of which nothing is lit.
    pub(super) fn new(vector: u32, layer: u32, [a, b]: [DVec2; 2]) -> Self {
        ContourLight {
            vector,
            layer,
            a,
            b,
            lit: Covered::default(),
        }
    }

    /// Its length, mm.
    pub(super) fn length(&self) -> f64 {
        self.a.distance(self.b)
    }

    /// How far along it the place nearest to a point is, mm.
    pub(super) fn foot(&self, p: DVec2) -> f64 {
        let along = (self.b - self.a).normalize_or_zero();
        (p - self.a).dot(along).clamp(0.0, self.length())
    }

    /// Light passes a stretch of it, mm.
    pub(super) fn pass(&mut self, stretch: Interval) {
        self.lit.add(stretch);
    }

    /// Light within `reach` mm goes along a stroke.
    pub(super) fn light(&mut self, stroke: [DVec2; 2], reach: f64) {
        let line = Line {
            from: self.a,
            along: (self.b - self.a).normalize_or_zero(),
        };
        if let Some([low, high]) = line.swept(stroke, reach)
            && high > 0.0
            && low < self.length()
        {
            self.lit.add([low, high]);
        }
    }
}

/// What stays dark, contour after contour.
#[derive(Debug, Clone, Default)]
pub(super) struct DarkWay {
    found: Dark,
    /// The stretch that reaches the end of the last contour, and that contour's vector.
    open: Option<(u32, Stretch)>,
}

impl DarkWay {
    /// No light reaches a contour any more.
    pub(super) fn close(&mut self, contour: &mut ContourLight) {
        let ContourLight {
            vector,
            layer,
            a,
            b,
            lit,
        } = contour;
        let length = a.distance(*b);
        if length == 0.0 {
            return;
        }
        self.found.commanded += length;
        let before = self.open.take();
        for [low, high] in lit.gaps(length) {
            self.found.length += high - low;
            let begun = before
                .filter(|(last, _)| low == 0.0 && last + 1 == *vector)
                .map(|(_, stretch)| stretch);
            let stretch = Stretch {
                length: high - low + begun.map_or(0.0, |s| s.length),
                from: begun.map_or_else(|| a.lerp(*b, low / length), |s| s.from),
                layer: *layer,
            };
            if stretch.length > self.found.longest.length {
                self.found.longest = stretch;
            }
            if high == length {
                self.open = Some((*vector, stretch));
            }
        }
    }

    /// What was found.
    pub(super) fn found(&self) -> Dark {
        self.found
    }
}
