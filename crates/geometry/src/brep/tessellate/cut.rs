//! Faces that close on themselves: a cylinder between two circles without a seam, a whole sphere,
//! a torus with a hole. The plane is cut along lines of constant parameter into one rectangle.

use super::chart::Chart;
use super::error::FaceIssue;
use super::outline::{Inside, Kind, Node, Outline, Point, Segment, Track};
use crate::brep::{Pole, Sense, Solid};
use crate::math::{DVec2, DVec3};

fn failed<T>(reason: impl Into<String>) -> Result<T, FaceIssue> {
    Err(FaceIssue::Failed(reason.into()))
}

/// One side of the rectangle across the cut's direction.
#[derive(Debug, Clone, Copy)]
enum End {
    /// Bounded by a loop that winds round.
    Loop,
    /// Shrunk to a point.
    Pole(Pole),
    /// Another cut, at this value.
    Cut(f64),
}

/// Opens a face whose loops wind round its surface, or which has no outer loop.
pub(super) fn open(
    solid: &Solid,
    chart: &Chart<'_>,
    mut tracks: Vec<Track>,
) -> Result<Outline, FaceIssue> {
    let winds = |d: usize| tracks.iter().any(|t| t.winding[d] != 0);
    if winds(0) && winds(1) {
        return failed("its boundary winds round both ways of its surface");
    }
    // the direction that is cut open
    let first = winds(0) || (!winds(1) && chart.periods[0].is_some());
    let d = usize::from(!first);
    let Some(period) = chart.periods[d] else {
        return failed("it has no boundary and its surface does not close");
    };
    let ends = arrange(chart, &mut tracks, d)?;
    let at = choose(chart, &tracks, d, period);
    let mut splits = Vec::new();
    for track in &mut tracks {
        split_at(solid, chart, track, d, at, period, &mut splits);
    }
    let across = match ends[0] {
        End::Cut(value) => {
            let other = chart.periods[1 - d].unwrap_or(1.0);
            for track in &mut tracks {
                split_at(solid, chart, track, 1 - d, value, other, &mut splits);
            }
            Some((value, other))
        }
        _ => None,
    };
    if !splits.is_empty() {
        return Err(FaceIssue::Split(splits));
    }
    let mut builder = Builder {
        outline: Outline {
            points: Vec::new(),
            segments: Vec::new(),
            banks: Vec::new(),
            own: Vec::new(),
            inside: Inside::BesideBoundary,
            sense: chart.sense,
        },
    };
    let mut lines = vec![(d, at, period)];
    lines.extend(across.map(|(value, other)| (1 - d, value, other)));
    for track in &tracks {
        builder.strips(chart, track, &lines);
    }
    builder.frame(chart, d, at, period, ends, across);
    Ok(builder.outline)
}

/// Brings the loops into order across direction `d` and says what bounds the face on either side.
fn arrange(chart: &Chart<'_>, tracks: &mut [Track], d: usize) -> Result<[End; 2], FaceIssue> {
    let o = 1 - d;
    // +1: the face lies on the side of rising o
    let side = |t: &Track| {
        let left = if d == 0 { 1 } else { -1 };
        let forward = if chart.sense == Sense::Forward { 1 } else { -1 };
        t.winding[d].signum() * left * forward
    };
    let mean = |t: &Track| {
        t.points.iter().map(|p| p.uv.to_array()[o]).sum::<f64>() / t.points.len() as f64
    };
    let lower: Vec<usize> = (0..tracks.len())
        .filter(|&i| side(&tracks[i]) > 0)
        .collect();
    let upper: Vec<usize> = (0..tracks.len())
        .filter(|&i| side(&tracks[i]) < 0)
        .collect();
    if tracks.iter().any(|t| t.winding[d].abs() > 1) || lower.len() > 1 || upper.len() > 1 {
        return failed("its boundary winds round its surface more than once");
    }
    let along = |by: f64| {
        if o == 0 {
            DVec2::new(by, 0.0)
        } else {
            DVec2::new(0.0, by)
        }
    };
    if let Some(period) = chart.periods[o] {
        let low = match (lower.first(), upper.first()) {
            (Some(&a), Some(&b)) => {
                let (low, high) = (mean(&tracks[a]), mean(&tracks[b]));
                let wanted = low + (high - low).rem_euclid(period);
                tracks[b].shift(along(wanted - high));
                low
            }
            (None, None) => {
                // closed both ways and not bounded: cut across too
                let value = gap_between(tracks, o, period, chart.domain[o][0]);
                return Ok([End::Cut(value), End::Cut(value + period)]);
            }
            _ => return failed("only one side of it is bounded"),
        };
        for track in tracks.iter_mut().filter(|t| t.winding[d] == 0) {
            let middle = mean(track);
            track.shift(along(low + (middle - low).rem_euclid(period) - middle));
        }
        return Ok([End::Loop, End::Loop]);
    }
    let bounds = tracks
        .iter()
        .flat_map(|t| &t.points)
        .map(|p| p.uv.to_array()[o])
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| {
            [lo.min(x), hi.max(x)]
        });
    let poles = chart.poles.iter().filter(|p| p.fixed == o);
    let below = || {
        let limit = if bounds[0].is_finite() {
            bounds[0]
        } else {
            f64::INFINITY
        };
        let found = poles.clone().filter(|p| p.at < limit);
        if bounds[0].is_finite() {
            found.max_by(|a, b| a.at.total_cmp(&b.at)).copied()
        } else {
            found.min_by(|a, b| a.at.total_cmp(&b.at)).copied()
        }
    };
    let above = || {
        let limit = if bounds[1].is_finite() {
            bounds[1]
        } else {
            f64::NEG_INFINITY
        };
        let found = poles.clone().filter(|p| p.at > limit);
        if bounds[1].is_finite() {
            found.min_by(|a, b| a.at.total_cmp(&b.at)).copied()
        } else {
            found.max_by(|a, b| a.at.total_cmp(&b.at)).copied()
        }
    };
    let end = |bounded: bool, pole: Option<Pole>| match (bounded, pole) {
        (true, _) => Ok(End::Loop),
        (false, Some(pole)) => Ok(End::Pole(pole)),
        (false, None) => failed("only one side of it is bounded"),
    };
    Ok([
        end(!lower.is_empty(), below())?,
        end(!upper.is_empty(), above())?,
    ])
}

/// A value of coordinate `d` in the widest gap between the loops' points.
fn gap_between(tracks: &[Track], d: usize, period: f64, default: f64) -> f64 {
    let mut values: Vec<f64> = tracks
        .iter()
        .flat_map(|t| &t.points)
        .map(|p| p.uv.to_array()[d].rem_euclid(period))
        .collect();
    values.sort_by(f64::total_cmp);
    let Some(&first) = values.first() else {
        return default;
    };
    let mut best = (0.0, default);
    for (i, &a) in values.iter().enumerate() {
        let b = values.get(i + 1).copied().unwrap_or(first + period);
        if b - a > best.0 {
            best = (b - a, 0.5 * (a + b));
        }
    }
    best.1
}

/// Where to cut: at a point of a loop that winds, crossing the fewest other loops.
fn choose(chart: &Chart<'_>, tracks: &[Track], d: usize, period: f64) -> f64 {
    let winding = tracks.iter().filter(|t| t.winding[d] != 0);
    let mut candidates: Vec<f64> = Vec::new();
    for wanted in [true, false] {
        for point in winding.clone().flat_map(|t| &t.points) {
            if matches!(point.node, Node::Vertex(_)) == wanted {
                candidates.push(point.uv.to_array()[d]);
            }
        }
    }
    if candidates.is_empty() {
        return gap_between(tracks, d, period, chart.domain[d][0]);
    }
    let stride = candidates.len().div_ceil(64);
    let crossings = |at: f64| -> usize {
        tracks
            .iter()
            .filter(|t| t.winding[d] == 0)
            .map(|t| {
                (0..t.points.len())
                    .filter(|&i| {
                        let a = (t.points[i].uv.to_array()[d] - at) / period;
                        let b = (t.uv(i + 1, chart).to_array()[d] - at) / period;
                        a.floor() != b.floor()
                    })
                    .count()
            })
            .sum()
    };
    candidates
        .into_iter()
        .step_by(stride)
        .min_by_key(|&at| crossings(at))
        .unwrap_or(0.0)
}

/// Snaps the points of a loop to the cut, and asks for samples where a chord crosses it.
fn split_at(
    solid: &Solid,
    chart: &Chart<'_>,
    track: &mut Track,
    d: usize,
    at: f64,
    period: f64,
    splits: &mut Vec<(u32, f64)>,
) {
    let close = 1e-9 * period;
    for point in &mut track.points {
        let mut uv = point.uv.to_array();
        let copy = at + period * ((uv[d] - at) / period).round();
        if (uv[d] - copy).abs() <= close {
            uv[d] = copy;
        }
        point.uv = DVec2::from_array(uv);
    }
    for i in 0..track.points.len() {
        let (a, b) = (track.points[i].uv, track.uv(i + 1, chart));
        let (x, y) = (a.to_array()[d], b.to_array()[d]);
        let (lo, hi) = (x.min(y), x.max(y));
        let copy = at + period * ((lo - at) / period).floor() + period;
        if copy <= lo + close || copy >= hi - close {
            continue;
        }
        if let Kind::Boundary { edge, t } = track.kinds[i] {
            splits.push((edge, crossing(solid, chart, edge, t, [a, b], d, copy)));
        }
    }
}

/// Parameter at which an edge's chord crosses `value` of coordinate `d`.
fn crossing(
    solid: &Solid,
    chart: &Chart<'_>,
    edge: u32,
    t: [f64; 2],
    uv: [DVec2; 2],
    d: usize,
    value: f64,
) -> f64 {
    let edge = &solid.edges[edge as usize];
    let [mut lo, mut hi] = t;
    let [mut a, mut b] = uv;
    for _ in 0..60 {
        let mid = 0.5 * (lo + hi);
        let m = chart.locate(edge.derivatives(mid)[0], Some(0.5 * (a + b)));
        if (m.to_array()[d] < value) == (a.to_array()[d] < value) {
            (lo, a) = (mid, m);
        } else {
            (hi, b) = (mid, m);
        }
    }
    0.5 * (lo + hi)
}

struct Builder {
    outline: Outline,
}

impl Builder {
    fn point(&mut self, uv: DVec2, node: Node) -> usize {
        self.outline.points.push(Point { uv, node });
        self.outline.points.len() - 1
    }

    /// Adds the segments of a loop, each in the copy of the rectangle that holds it.
    fn strips(&mut self, chart: &Chart<'_>, track: &Track, lines: &[(usize, f64, f64)]) {
        let n = track.points.len();
        for i in 0..n {
            let (a, b) = (track.points[i], track.points[(i + 1) % n]);
            let (mut p, mut q) = (a.uv.to_array(), track.uv(i + 1, chart).to_array());
            for &(d, at, period) in lines {
                let by = period * ((0.5 * (p[d] + q[d]) - at) / period).floor();
                for x in [&mut p, &mut q] {
                    x[d] -= by;
                    // exact on the banks
                    for bank in [at, at + period] {
                        if (x[d] - bank).abs() <= 1e-8 * period {
                            x[d] = bank;
                        }
                    }
                }
            }
            let from = self.point(DVec2::from_array(p), a.node);
            let to = self.point(DVec2::from_array(q), b.node);
            self.outline.segments.push(Segment {
                from,
                to,
                kind: track.kinds[i],
            });
        }
    }

    /// Adds the rectangle's sides.
    fn frame(
        &mut self,
        chart: &Chart<'_>,
        d: usize,
        at: f64,
        period: f64,
        ends: [End; 2],
        across: Option<(f64, f64)>,
    ) {
        let o = 1 - d;
        let make = |x: f64, y: f64| {
            if d == 0 {
                DVec2::new(x, y)
            } else {
                DVec2::new(y, x)
            }
        };
        let own = |builder: &mut Self, p: DVec3| {
            builder.outline.own.push(p);
            Node::Own(builder.outline.own.len() as u32 - 1)
        };
        // points of the loops on a bank, by their place along it
        let on_line = |builder: &Self, d: usize, at: f64, period: f64| {
            let mut found: Vec<(f64, Node)> = builder
                .outline
                .points
                .iter()
                .filter(|p| {
                    let x = p.uv.to_array()[d];
                    x == at || x == at + period
                })
                .map(|p| (p.uv.to_array()[1 - d], p.node))
                .collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            found
        };
        let mut stops = on_line(self, d, at, period);
        let mut corner = None;
        for (end, bottom) in ends.into_iter().zip([true, false]) {
            let value = match end {
                End::Loop => continue,
                End::Pole(pole) => pole.at,
                End::Cut(value) => value,
            };
            let known = stops
                .iter()
                .find(|s| (s.0 - value).abs() < 1e-12)
                .map(|s| s.1);
            let node = known.unwrap_or_else(|| match (end, corner) {
                (End::Cut(_), Some(node)) => node,
                _ => own(self, chart.point(make(at, value))),
            });
            corner = Some(node);
            if known.is_none() {
                let place = if bottom { 0 } else { stops.len() };
                stops.insert(place, (value, node));
            }
            if let End::Pole(_) = end {
                let from = self.point(make(at, value), node);
                let to = self.point(make(at + period, value), node);
                self.outline.segments.push(Segment {
                    from,
                    to,
                    kind: Kind::Pole,
                });
            }
        }
        self.banks(&stops, at, period, &make);
        if let (Some((value, other)), Some(corner)) = (across, corner) {
            let mut stops = on_line(self, o, value, other);
            stops.retain(|s| s.0 > at && s.0 < at + period);
            stops.insert(0, (at, corner));
            stops.push((at + period, corner));
            self.banks(&stops, value, other, &|x, y| make(y, x));
        }
    }

    /// Adds both banks of a cut through `stops`.
    fn banks(
        &mut self,
        stops: &[(f64, Node)],
        at: f64,
        period: f64,
        make: &dyn Fn(f64, f64) -> DVec2,
    ) {
        for pair in stops.windows(2) {
            let ((a, from), (b, to)) = (pair[0], pair[1]);
            if a == b || from == to && (b - a).abs() < 1e-9 * period {
                continue;
            }
            let first = self.outline.segments.len();
            for bank in [at, at + period] {
                let from = self.point(make(bank, a), from);
                let to = self.point(make(bank, b), to);
                self.outline.segments.push(Segment {
                    from,
                    to,
                    kind: Kind::Cut,
                });
            }
            self.outline.banks.push([first, first + 1]);
        }
    }
}
