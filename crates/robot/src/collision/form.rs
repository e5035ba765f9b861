//! The form of a body at its place: round along a line, or a convex hull, and how near it comes to what stands around.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::distance::{Bounds, Segment};
use super::round::{Ends, Round};
use crate::hull::{Hull, distance};

/// How far beyond a hull sides of a box are looked at that may lie at infinity, mm.
const BEYOND: f64 = 100.0;

/// A form at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form<'a> {
    Round(Round),
    Hull(Placed<'a>),
}

/// A hull at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed<'a> {
    hull: &'a Hull,
    /// Hulls of what it is made of; none where it is but one.
    pieces: &'a [Hull],
    at: Pose,
    /// The centre of the ball around it.
    centre: DVec3,
    reach: f64,
}

impl<'a> Form<'a> {
    /// A hull, or hulls of pieces that lie in it.
    pub(super) fn of_hull(hull: &'a Hull, pieces: &'a [Hull], at: Pose) -> Self {
        let (centre, reach) = hull.ball();
        Form::Hull(Placed {
            hull,
            pieces,
            at,
            centre: at.point(centre),
            reach,
        })
    }

    /// The same in another frame.
    pub(super) fn seen_from(&self, other_from_frame: Pose) -> Self {
        match self {
            Form::Round(round) => Form::Round(round.along(Segment {
                a: other_from_frame.point(round.line.a),
                b: other_from_frame.point(round.line.b),
            })),
            Form::Hull(placed) => {
                let at = other_from_frame.then(placed.at);
                Self::of_hull(placed.hull, placed.pieces, at)
            }
        }
    }

    /// The least distance that any of its pieces has by `distance`, which tells it up to a most, mm, where it is less than `most`; else no less
    /// than `most`. They are asked where all of it is not far enough.
    pub(super) fn nearest_piece(&self, most: f64, distance: impl Fn(&Form<'a>, f64) -> f64) -> f64 {
        let Form::Hull(placed) = self else {
            return distance(self, most);
        };
        let single = |hull: &'a Hull| Self::of_hull(hull, &[], placed.at);
        let far = distance(&single(placed.hull), most);
        if placed.pieces.is_empty() || far >= most {
            return far;
        }
        let pieces = placed.pieces.iter().map(single);
        pieces.fold(most, |least, piece| least.min(distance(&piece, least)))
    }

    /// A point of it, or of its pieces' hull.
    pub(super) fn point(&self) -> DVec3 {
        match self {
            Form::Round(round) => round.line.a,
            Form::Hull(placed) => placed.at.point(placed.hull.point()),
        }
    }

    /// How far its points go at most from one place to another, straight, mm.
    pub(super) fn gone(&self, to: &Form<'_>) -> f64 {
        match (self, to) {
            (Form::Round(from), Form::Round(to)) => from.gone(to),
            (Form::Hull(from), Form::Hull(to)) => {
                // what is between its corners goes no farther than they do
                let far = from.hull.corners().iter().map(|c| {
                    let [before, now] = [from, to].map(|placed| placed.at.point(*c));
                    before.distance(now)
                });
                far.fold(0.0, f64::max)
            }
            // bodies keep their forms
            _ => f64::INFINITY,
        }
    }

    /// The lever about a point with which it bends away from its chord where it turns, mm.
    pub(super) fn lever_about(&self, p: DVec3) -> f64 {
        match self {
            Form::Round(round) => round.lever_about(p),
            Form::Hull(placed) => placed.centre.distance(p) + placed.reach,
        }
    }

    /// No more than the distance of a box, mm.
    pub(super) fn at_least_to(&self, bounds: &Bounds) -> f64 {
        match self {
            Form::Round(round) => round.at_least_to(bounds),
            Form::Hull(placed) => placed.at_least_to(bounds),
        }
    }

    /// No more than the distance of a box, mm, and nearer to it than [`Form::at_least_to`], where it is less than `most`; else no less than
    /// `most`. Whether it is the distance itself tells [`Form::is_exact`].
    pub(super) fn nearly_to(&self, bounds: Bounds, most: f64) -> f64 {
        match self {
            Form::Round(round) => round.nearly_to(bounds),
            Form::Hull(placed) => placed.to_box(bounds, most),
        }
    }

    /// Whether what [`Form::nearly_to`] tells is the distance.
    pub(super) fn is_exact(&self) -> bool {
        !matches!(self, Form::Round(round) if round.ends == Ends::Flat)
    }

    /// The distance of a box, mm, where it is less than `most`; else no less than `most`. Zero or less where they touch.
    pub(super) fn to_box(self, bounds: Bounds, most: f64) -> f64 {
        match self {
            Form::Round(round) => round.to_box(bounds, most),
            Form::Hull(placed) => placed.to_box(bounds, most),
        }
    }

    /// The distance of a line with a radius around it, mm, where it is less than `most`; else no less than `most`.
    pub(super) fn to_rod(self, line: &Segment, radius: f64, most: f64) -> f64 {
        match self {
            Form::Round(round) => match round.at_least_to_segment(line) - radius {
                far if far >= most => far,
                _ => round.to_segment(line, most + radius) - radius,
            },
            Form::Hull(placed) => {
                let ends = [line.a, line.b];
                placed.to_points(&ends, most + radius) - radius
            }
        }
    }

    /// The distance of a flat convex face, mm, where it is less than `most`; else no less than `most`. Zero or less where they touch.
    pub(super) fn to_face(self, corners: &[DVec3], most: f64) -> f64 {
        match self {
            Form::Round(round) => round.to_face(corners, most),
            Form::Hull(placed) => placed.to_points(corners, most),
        }
    }

    /// The distance of another, mm, where it is less than `most`; else no less than `most`. Of two round ones with flat ends no more than it.
    pub(super) fn apart(&self, other: &Form<'_>, most: f64) -> f64 {
        self.nearest_piece(most, |one, most| {
            other.nearest_piece(most, |other, most| one.single_apart(other, most))
        })
    }

    /// The same of what is one body each.
    fn single_apart(&self, other: &Form<'_>, most: f64) -> f64 {
        match (self, other) {
            (Form::Round(one), Form::Round(other)) => one.apart(other, most),
            (Form::Hull(placed), Form::Round(round)) | (Form::Round(round), Form::Hull(placed)) => {
                placed.to_round(round, most)
            }
            (Form::Hull(one), Form::Hull(other)) => {
                let (from, far) = (other.centre, other.reach);
                let radii = one.hull.radius() + other.hull.radius();
                let aside = one.centre.distance(from) - one.reach - far;
                if aside >= most {
                    return aside;
                }
                let between = |d| other.foremost(d);
                one.to(between, one.centre - from, most + radii) - radii
            }
        }
    }
}

impl Placed<'_> {
    /// The point of the hull of its points that lies farthest in a direction.
    fn foremost(&self, direction: DVec3) -> DVec3 {
        let own = self.at.orientation.inverse() * direction;
        self.at.point(self.hull.foremost(own))
    }

    /// The distance of its points' hull from another convex body, mm; `ahead` leads from that to this one.
    fn to(&self, other: impl Fn(DVec3) -> DVec3, ahead: DVec3, most: f64) -> f64 {
        distance(|d| self.foremost(d), other, ahead, most)
    }

    fn at_least_to(&self, bounds: &Bounds) -> f64 {
        let centre = Segment {
            a: self.centre,
            b: self.centre,
        };
        bounds.at_least_to(&centre) - self.reach
    }

    fn to_box(self, bounds: Bounds, most: f64) -> f64 {
        let least = self.at_least_to(&bounds);
        if least >= most {
            return least;
        }
        // sides may lie at infinity: beyond it they are of no account
        let far = DVec3::splat(self.reach + BEYOND);
        let low = bounds.low.max((self.centre - far).min(bounds.high));
        let high = bounds.high.min((self.centre + far).max(bounds.low));
        let foremost = |d: DVec3| DVec3::select(d.cmpgt(DVec3::ZERO), high, low);
        let ahead = self.centre - self.centre.clamp(low, high);
        self.to(foremost, ahead, most + self.hull.radius()) - self.hull.radius()
    }

    fn to_points(self, points: &[DVec3], most: f64) -> f64 {
        let Some(first) = points.first() else {
            return most;
        };
        let foremost = |d: DVec3| {
            let further = |best: DVec3, p: &DVec3| if p.dot(d) > best.dot(d) { *p } else { best };
            points.iter().fold(*first, further)
        };
        let ahead = self.centre - *first;
        self.to(foremost, ahead, most + self.hull.radius()) - self.hull.radius()
    }

    fn to_round(self, round: &Round, most: f64) -> f64 {
        let Segment { a, b } = round.line;
        let middle = a.midpoint(b);
        let aside = self.centre.distance(middle) - 0.5 * a.distance(b) - round.radius - self.reach;
        if aside >= most {
            return aside;
        }
        // flat ends are those of the body, round ones of its line
        let beyond = match round.ends {
            Ends::Round => round.radius,
            Ends::Flat => 0.0,
        };
        let radii = self.hull.radius() + beyond;
        let foremost = |d: DVec3| round.foremost(d);
        self.to(foremost, self.centre - middle, most + radii) - radii
    }
}
