//! Contour error: how far the marked path lies from another path, whatever their timing.
//!
//! Source: Rasoanarivo 2020, § 2.5.3, fig. 2.69 (after Duong 2016): the point is projected on the segments next to the closest
//! point of the other path. The search is bounded in time, or else neighbouring hatch lines would match.

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::prepared::Prepared;
use crate::measures::dark_way::{ContourLight, Dark, DarkWay, LightReach};
use crate::measures::histogram::Histogram;
use crate::measures::segment::distance_to_segment;
use crate::measures::stray_light::StrayLight;
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Role;
use std::collections::VecDeque;

/// Width of a bin of contour errors, mm.
const CONTOUR_BIN: f64 = 5e-4;

/// Width of a bin of angle errors, deg.
const ANGLE_BIN: f64 = 1e-4;

/// How many times as fast as its mark a spot may run that draws it: one that comes back from beyond a mark's beginning is faster for a while.
const FASTEST: f64 = 4.0;

/// In a millimetre.
const NANOMETRES: f64 = 1e6;

/// A vector under consideration: where it starts and ends, and the last sample at which it is commanded.
#[derive(Debug, Clone)]
struct Candidate {
    vector: u32,
    a: DVec2,
    b: DVec2,
    kind: Role,
    speed: f64,
    until: u64,
    /// Of a contour, what of it is lit.
    contour: Option<ContourLight>,
}

impl Candidate {
    /// Whether a spot that goes so within a period may be drawing it.
    fn runs(&self, step: DVec2, period: f64) -> bool {
        step.dot(self.b - self.a) >= 0.0 && step.length() <= FASTEST * self.speed * period
    }
}

/// Judges a run against its job while it streams: contour errors of lit points, tracking errors of each axis on marks and on
/// jumps, focus errors of lit points, and the worst places.
#[derive(Debug, Clone)]
pub struct PathErrors {
    /// Vectors commanded in the last `window` samples, oldest first.
    near: VecDeque<Candidate>,
    window: u64,
    reach: LightReach,
    dark: DarkWay,
    /// The contour that the last point, if it was lit, lay nearest to, and how far along it, mm.
    foot: Option<(u32, f64)>,
    /// Contour errors of lit points on contours, mm.
    pub contour: Histogram,
    /// The same by the way that the spot goes between points, one a nanometre: where it stands, lit, at a corner, no more counts.
    pub contour_way: Histogram,
    /// Where the spot was at the last point, if it was lit, mm.
    last: Option<DVec2>,
    /// Contour errors of lit points on fills, mm.
    pub fill: Histogram,
    /// |set-point − angle| of X, Y, Z while marks are commanded, deg.
    pub tracking: [Histogram; 3],
    /// The same while jumps are commanded, deg.
    pub tracking_jumps: [Histogram; 3],
    /// |focus − commanded height| of lit points, mm.
    pub focus: Histogram,
    /// Light that draws no mark.
    pub stray: StrayLight,
    /// Where the largest contour error lies, mm.
    pub worst: DVec2,
    worst_error: f64,
}

impl PathErrors {
    /// Lit points are compared with marks commanded at most `window` s before; a contour is dark where no light reaches it.
    pub fn new(window: f64, period: f64, reach: LightReach) -> Self {
        let angles = || [(); 3].map(|()| Histogram::new(ANGLE_BIN, 20_000));
        PathErrors {
            near: VecDeque::new(),
            window: (window / period).ceil() as u64,
            reach,
            dark: DarkWay::default(),
            foot: None,
            contour: Histogram::new(CONTOUR_BIN, 2_000),
            contour_way: Histogram::new(CONTOUR_BIN, 2_000),
            last: None,
            fill: Histogram::new(CONTOUR_BIN, 2_000),
            tracking: angles(),
            tracking_jumps: angles(),
            focus: Histogram::new(1e-3, 5_000),
            stray: StrayLight::default(),
            worst: DVec2::ZERO,
            worst_error: 0.0,
        }
    }

    fn note(&mut self, vector: u32, (layer, i): (&Prepared, usize), sample: u64) {
        match self.near.back_mut() {
            Some(last) if last.vector == vector => last.until = sample,
            _ => {
                let v = &layer.job.vectors[i];
                let (a, b) = (layer.job.start_of(i).truncate(), v.end.truncate());
                let contour = ContourLight::new(vector, layer.number, [a, b]);
                self.near.push_back(Candidate {
                    vector,
                    a,
                    b,
                    kind: v.kind,
                    speed: v.speed,
                    until: sample,
                    contour: (v.kind == Role::Contour).then_some(contour),
                });
            }
        }
        while let Some(mut first) = self
            .near
            .pop_front_if(|first| first.until + self.window < sample)
        {
            if let Some(contour) = &mut first.contour {
                self.dark.close(contour);
            }
        }
    }

    /// Light on the contour of candidate `at` goes along a stroke: what it reaches is lit, and what it passes.
    fn light(&mut self, stroke: [DVec2; 2], at: usize) {
        let far = self.reach.aside + stroke[0].distance(stroke[1]);
        for candidate in &mut self.near {
            let distance = distance_to_segment(stroke[1], candidate.a, candidate.b);
            if let Some(contour) = candidate.contour.as_mut().filter(|_| distance <= far) {
                contour.light(stroke, self.reach.aside);
            }
        }
        let Candidate {
            vector,
            contour: Some(contour),
            ..
        } = &self.near[at]
        else {
            return;
        };
        let here = (*vector, contour.foot(stroke[1]));
        if let Some(last) = self.foot.replace(here) {
            self.pass(last, at, here);
        }
    }

    /// Light went on without a break from a place of one contour to a place of another one or of the same, candidate `at`: what of
    /// contours lies between is passed, if it is short and leads there.
    fn pass(&mut self, last: (u32, f64), at: usize, here: (u32, f64)) {
        let Some(begin) = here
            .0
            .checked_sub(last.0)
            .and_then(|back| at.checked_sub(back as usize))
        else {
            return;
        };
        let mut stretches = Vec::with_capacity(at - begin + 1);
        for (k, candidate) in self.near.range(begin..=at).enumerate() {
            let Some(contour) = &candidate.contour else {
                return;
            };
            let from = if k == 0 { last.1 } else { 0.0 };
            let to = if begin + k == at {
                here.1
            } else {
                contour.length()
            };
            stretches.push([from, to]);
        }
        let whole: f64 = stretches.iter().map(|[from, to]| to - from).sum();
        if !(0.0..=self.reach.past).contains(&whole) {
            return;
        }
        let passed = self.near.range_mut(begin..=at);
        for (contour, stretch) in passed.filter_map(|c| c.contour.as_mut()).zip(stretches) {
            contour.pass(stretch);
        }
    }

    /// Whether some mark that a stroke lies on is drawn by it: not one that it runs against, as a jump back over the last line does, nor one
    /// that it crosses as fast as a jump.
    fn is_drawn(&self, [from, to]: [DVec2; 2], period: f64) -> bool {
        let marks = self.near.iter().filter(|c| c.kind.deposits());
        let mut here = marks.filter(|c| distance_to_segment(to, c.a, c.b) <= self.reach.aside);
        here.any(|c| c.runs(to - from, period))
    }

    /// What of the contours stayed dark.
    pub fn dark(&self) -> Dark {
        let mut all = self.dark.clone();
        for contour in self.near.iter().filter_map(|c| c.contour.as_ref()) {
            all.close(&mut contour.clone());
        }
        all.found()
    }

    /// The way that the spot goes in light along contours, mm. Where corners are cut it is shorter than what is commanded.
    pub fn lit_way(&self) -> f64 {
        self.contour_way.total() as f64 / NANOMETRES
    }

    /// The share of the way along contours within `bound` mm of the commanded marks: of what is lit, and of what stays dark none.
    /// With `strays`, each point strays besides by so much, mm, one standard deviation.
    pub fn contour_share(&self, bound: f64, strays: Option<f64>) -> f64 {
        let way = &self.contour_way;
        let dark = NANOMETRES * self.dark().length;
        let lit = way.total() as f64;
        if lit + dark == 0.0 {
            return 1.0;
        }
        let within = match strays {
            Some(sigma) => way.share_with_strays(bound, sigma),
            None => way.share_below(bound),
        };
        within * lit / (lit + dark)
    }
}

impl HeadSink for PathErrors {
    fn block(&mut self, block: &HeadBlock) {
        for (k, &vector) in block.command.vector.iter().enumerate() {
            let Some((layer, i)) = block.vector(k) else {
                continue;
            };
            self.note(vector, (layer, i), block.command.first + k as u64);
            let kind = layer.job.vectors[i].kind;
            if block.command.moving[k] {
                let errors = if kind.deposits() {
                    &mut self.tracking
                } else {
                    &mut self.tracking_jumps
                };
                for ((histogram, axis), wanted) in
                    errors.iter_mut().zip(&block.axes).zip(&block.set_points)
                {
                    if let Some(angle) = axis.angle.get(k) {
                        histogram.add((wanted[k] - angle).abs().to_degrees());
                    }
                }
            }
            if block.lit[k] < 0.5 {
                self.last = None;
                self.foot = None;
                self.stray.ends();
                continue;
            }
            let p = block.hit[k];
            let from = self.last.replace(p).unwrap_or(p);
            let way = from.distance(p);
            let closest = self
                .near
                .iter()
                .enumerate()
                .filter(|(_, c)| c.kind.deposits())
                .map(|(at, c)| (distance_to_segment(p, c.a, c.b), c.kind, at))
                .min_by(|x, y| x.0.total_cmp(&y.0));
            self.stray.lit += way;
            let near = closest.is_some_and(|(error, ..)| error <= self.reach.aside);
            if !near {
                self.stray.goes([from, p], layer.number);
            } else if self.is_drawn([from, p], block.period) {
                self.stray.ends();
            } else {
                self.stray.jumps([from, p], layer.number);
            }
            if let Some((error, kind, at)) = closest {
                if kind == Role::Contour {
                    self.light([from, p], at);
                    self.contour.add(error);
                    self.contour_way
                        .add_many(error, (NANOMETRES * way).round() as u64);
                } else {
                    self.foot = None;
                    self.fill.add(error);
                }
                if error > self.worst_error {
                    self.worst_error = error;
                    self.worst = p;
                }
                self.focus
                    .add((block.focus[k] - block.command.position[k].z).abs());
            }
        }
    }
}
