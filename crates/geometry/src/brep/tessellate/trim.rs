//! The boundary of a face in the parameter plane of its surface.
//!
//! Each loop is followed point by point, every point taken in the copy of the periodic plane nearest
//! to the one before, so that a seam needs no curve of its own. A pole is a stretch of the plane
//! that is one point in space: the loop runs along it with the face to its left.

use super::chart::Chart;
use super::cut;
use super::edges::{Samples, distance_to_segment};
use super::error::FaceIssue;
use super::outline::{Inside, Kind, Node, Outline, Point, Segment, Track};
use super::tolerance::Tolerance;
use crate::brep::{Edge, Face, Loop, Pole, Sense, Solid};
use crate::math::{DVec2, DVec3};

/// One sample on the way round a loop, with the chord that leaves it.
#[derive(Debug, Clone, Copy)]
struct Stop {
    node: Node,
    point: DVec3,
    edge: u32,
    t: [f64; 2],
    /// Whether the chord lies on the same edge as the one before, run back.
    turns_back: bool,
}

/// Carries the boundary of a face into its parameter plane.
pub(super) fn outline(
    solid: &Solid,
    face: &Face,
    chart: &Chart<'_>,
    samples: &[Samples],
    tolerance: &Tolerance,
) -> Result<Outline, FaceIssue> {
    let mut tracks = Vec::new();
    for boundary in &face.loops {
        let Loop::Edges(uses) = boundary else {
            continue;
        };
        let stops = stops(solid, uses, samples);
        split_at_poles(solid, chart, uses, samples)?;
        let track = follow(solid, chart, &stops, chart.sense)?;
        // loops that run the wrong way round meet their poles on the wrong side
        let track = if track.winding == [0, 0] || chart.poles.is_empty() {
            track
        } else {
            let other = follow(solid, chart, &stops, chart.sense.then(Sense::Reversed))?;
            if other.winding == [0, 0] {
                other
            } else {
                track
            }
        };
        tracks.push(track);
    }
    straighten(solid, chart, &tracks, tolerance)?;
    if tracks.iter().any(|t| t.winding != [0, 0]) {
        return cut::open(solid, chart, tracks);
    }
    let outer = (0..tracks.len()).max_by(|&a, &b| {
        let (a, b) = (tracks[a].area().abs(), tracks[b].area().abs());
        a.total_cmp(&b)
    });
    let Some(outer) = outer else {
        return cut::open(solid, chart, tracks);
    };
    let inward = (tracks[outer].area() < 0.0) == (chart.sense == Sense::Forward);
    if inward && chart.is_compact() {
        return cut::open(solid, chart, tracks);
    }
    nest(chart, &mut tracks, outer);
    let mut outline = Outline {
        points: Vec::new(),
        segments: Vec::new(),
        banks: Vec::new(),
        own: Vec::new(),
        inside: Inside::Parity,
        // a boundary that contradicts the written sense is right: the reader has compared it with
        // the faces beside it
        sense: if inward {
            chart.sense.then(Sense::Reversed)
        } else {
            chart.sense
        },
    };
    for track in &tracks {
        let first = outline.points.len();
        let n = track.points.len();
        outline.points.extend_from_slice(&track.points);
        outline.segments.extend((0..n).map(|i| Segment {
            from: first + i,
            to: first + (i + 1) % n,
            kind: track.kinds[i],
        }));
    }
    Ok(outline)
}

/// Lists the samples of a loop in its direction.
fn stops(solid: &Solid, uses: &[crate::brep::EdgeUse], samples: &[Samples]) -> Vec<Stop> {
    let mut stops = Vec::new();
    for (k, used) in uses.iter().enumerate() {
        let edge = &solid.edges[used.edge as usize];
        let cut = &samples[used.edge as usize];
        let before = uses[(k + uses.len() - 1) % uses.len()];
        let last = cut.t.len() - 1;
        for i in 0..last {
            let (here, next) = match used.sense {
                Sense::Forward => (i, i + 1),
                Sense::Reversed => (last - i, last - i - 1),
            };
            let node = if here == 0 {
                Node::Vertex(edge.vertices[0])
            } else if here == last {
                Node::Vertex(edge.vertices[1])
            } else {
                Node::Sample {
                    edge: used.edge,
                    index: here as u32,
                }
            };
            stops.push(Stop {
                node,
                point: cut.points[here],
                edge: used.edge,
                t: [cut.t[here], cut.t[next]],
                turns_back: i == 0 && before.edge == used.edge && before.sense != used.sense,
            });
        }
    }
    stops
}

/// Asks for a sample where an edge runs through a pole.
fn split_at_poles(
    solid: &Solid,
    chart: &Chart<'_>,
    uses: &[crate::brep::EdgeUse],
    samples: &[Samples],
) -> Result<(), FaceIssue> {
    let mut splits = Vec::new();
    for pole in &chart.poles {
        for used in uses {
            let edge = &solid.edges[used.edge as usize];
            let cut = &samples[used.edge as usize];
            if cut
                .points
                .iter()
                .any(|p| p.distance(pole.point) <= chart.gap)
            {
                continue;
            }
            // only a chord that comes near can belong to an arc through the pole
            let near = cut
                .points
                .windows(2)
                .any(|w| distance_to_segment(pole.point, w[0], w[1]) <= 0.5 * w[0].distance(w[1]));
            if !near {
                continue;
            }
            let t = nearest_on_edge(edge, pole.point);
            if edge.derivatives(t)[0].distance(pole.point) <= chart.gap {
                splits.push((used.edge, t));
            }
        }
    }
    if splits.is_empty() {
        Ok(())
    } else {
        Err(FaceIssue::Split(splits))
    }
}

/// Parameter of the point of an edge nearest to `p`, inside its range.
fn nearest_on_edge(edge: &Edge, p: DVec3) -> f64 {
    let [from, to] = edge.range;
    let mut t = edge.curve.nearest(p);
    let (lo, hi) = (from.min(to), from.max(to));
    if let Some(period) = edge.period {
        t += period * ((lo - t) / period).ceil();
    }
    t.clamp(lo, hi)
}

/// Deepest halving of a chord whose ends lie far apart in the plane.
const TRACK_DEPTH: u32 = 8;

/// Parameters of the end of a chord whose start has parameters `from`.
fn carry(
    edge: &Edge,
    chart: &Chart<'_>,
    from: DVec2,
    [t0, t1]: [f64; 2],
    end: DVec3,
    depth: u32,
) -> DVec2 {
    let uv = chart.locate(end, Some(from));
    let moved = (uv - from).to_array();
    let far = (0..2).any(|d| chart.periods[d].is_some_and(|p| moved[d].abs() > 0.3 * p));
    if !far || depth == 0 {
        return uv;
    }
    let mid = 0.5 * (t0 + t1);
    let p = edge.derivatives(mid)[0];
    let between = carry(edge, chart, from, [t0, mid], p, depth - 1);
    carry(edge, chart, between, [mid, t1], end, depth - 1)
}

/// Follows a loop through the plane.
fn follow(
    solid: &Solid,
    chart: &Chart<'_>,
    stops: &[Stop],
    sense: Sense,
) -> Result<Track, FaceIssue> {
    let n = stops.len();
    let Some(first) = stops.iter().position(|s| chart.pole_at(s.point).is_none()) else {
        return Err(FaceIssue::Failed(
            "its boundary is a single point".to_owned(),
        ));
    };
    let mut track = Track {
        points: Vec::with_capacity(n + 4),
        kinds: Vec::with_capacity(n + 4),
        winding: [0, 0],
    };
    let boundary = |s: &Stop| Kind::Boundary {
        edge: s.edge,
        t: s.t,
    };
    let edge_of = |s: &Stop| &solid.edges[s.edge as usize];
    let start = chart.locate(stops[first].point, None);
    check_on_surface(chart, stops[first].point, start)?;
    let mut uv = start;
    let mut at = first;
    loop {
        let here = &stops[at];
        track.points.push(Point {
            uv,
            node: here.node,
        });
        track.kinds.push(boundary(here));
        let next = (at + 1) % n;
        let stop = &stops[next];
        if let Some(pole) = chart.pole_at(stop.point) {
            // where the chord comes in and where the next goes out, seen from close by
            let near_end = here.t[0] + 0.999 * (here.t[1] - here.t[0]);
            let p = edge_of(here).derivatives(near_end)[0];
            let into = carry(
                edge_of(here),
                chart,
                uv,
                [here.t[0], near_end],
                p,
                TRACK_DEPTH,
            );
            let near_start = stop.t[0] + 0.001 * (stop.t[1] - stop.t[0]);
            let p = edge_of(stop).derivatives(near_start)[0];
            let out = chart.locate(p, Some(into));
            let out = along_pole(chart, pole, into, out, sense, stop.turns_back);
            let on = |uv: DVec2| {
                let mut c = uv.to_array();
                c[pole.fixed] = if chart.periods[pole.fixed].is_some() {
                    chart.shifted(DVec2::splat(pole.at), into).to_array()[pole.fixed]
                } else {
                    pole.at
                };
                DVec2::from_array(c)
            };
            track.points.push(Point {
                uv: on(into),
                node: stop.node,
            });
            track.kinds.push(Kind::Pole);
            track.points.push(Point {
                uv: on(out),
                node: stop.node,
            });
            track.kinds.push(boundary(stop));
            let after = (next + 1) % n;
            if chart.pole_at(stops[after].point).is_some() {
                return Err(FaceIssue::Split(vec![(
                    stop.edge,
                    0.5 * (stop.t[0] + stop.t[1]),
                )]));
            }
            uv = carry(
                edge_of(stop),
                chart,
                out,
                [near_start, stop.t[1]],
                stops[after].point,
                TRACK_DEPTH,
            );
            at = after;
        } else {
            uv = carry(edge_of(here), chart, uv, here.t, stop.point, TRACK_DEPTH);
            at = next;
        }
        check_on_surface(chart, stops[at].point, uv)?;
        if at == first || track.points.len() > 2 * n + 4 {
            break;
        }
    }
    for d in 0..2 {
        if let Some(period) = chart.periods[d] {
            track.winding[d] = ((uv - start).to_array()[d] / period).round() as i32;
        }
    }
    Ok(track)
}

/// A boundary point must lie on the surface.
fn check_on_surface(chart: &Chart<'_>, p: DVec3, uv: DVec2) -> Result<(), FaceIssue> {
    let off = chart.point(uv).distance(p);
    // kernels write edges good to a few µm; a tenth of a millimetre is another surface
    if off <= 0.1 {
        return Ok(());
    }
    Err(FaceIssue::Failed(format!(
        "its edge lies {off:.3} mm off its surface at ({:.3}, {:.3}, {:.3})",
        p.x, p.y, p.z
    )))
}

/// The copy of `out` to which a loop gets along a pole that it reached at `into`.
fn along_pole(
    chart: &Chart<'_>,
    pole: &Pole,
    into: DVec2,
    out: DVec2,
    sense: Sense,
    turns_back: bool,
) -> DVec2 {
    let d = 1 - pole.fixed;
    let Some(period) = chart.periods[d] else {
        return out;
    };
    // the face lies on the side the loop came from; it is to the left of a forward face's loop
    let below = into.to_array()[pole.fixed] < pole.at;
    let mut rising = below == (pole.fixed == 0);
    if sense == Sense::Reversed {
        rising = !rising;
    }
    let mut by = (out - into).to_array()[d].rem_euclid(period);
    let full = turns_back || by < 1e-3 * period || by > (1.0 - 1e-3) * period;
    if !rising {
        by -= period;
    }
    if full {
        // to the copy of the same line one period on
        let exact = (out - into).to_array()[d];
        let near = exact - period * (exact / period).round();
        by = if rising { near + period } else { near - period };
    }
    let mut out = out.to_array();
    out[d] = into.to_array()[d] + by;
    DVec2::from_array(out)
}

/// Asks for samples where a chord in the plane leaves its edge by more than the chord error allows:
/// a straight edge may be a bent line in the plane.
fn straighten(
    solid: &Solid,
    chart: &Chart<'_>,
    tracks: &[Track],
    tolerance: &Tolerance,
) -> Result<(), FaceIssue> {
    if matches!(chart.surface, crate::brep::Surface::Plane(_)) {
        return Ok(());
    }
    let mut splits = Vec::new();
    for track in tracks {
        for (i, kind) in track.kinds.iter().enumerate() {
            let Kind::Boundary { edge, t } = *kind else {
                continue;
            };
            let (a, b) = (track.points[i].uv, track.uv(i + 1, chart));
            let curve = &solid.edges[edge as usize];
            let [p, q] = t.map(|t| curve.derivatives(t)[0]);
            let mid = 0.5 * (t[0] + t[1]);
            let off = distance_to_segment(chart.point(0.5 * (a + b)), p, q);
            if off > 2.0 * tolerance.chord && p.distance(q) > tolerance.chord {
                splits.push((edge, mid));
            }
        }
    }
    if splits.is_empty() {
        Ok(())
    } else {
        Err(FaceIssue::Split(splits))
    }
}

/// Moves loops by whole periods into the outer one.
fn nest(chart: &Chart<'_>, tracks: &mut [Track], outer: usize) {
    if chart.periods == [None, None] {
        return;
    }
    let frame = tracks[outer].clone();
    let [lo, hi] = frame.bounds();
    let centre = 0.5 * (lo + hi);
    for (i, track) in tracks.iter_mut().enumerate() {
        if i == outer {
            continue;
        }
        let [a, b] = track.bounds();
        let middle = 0.5 * (a + b);
        let near = chart.shifted(middle, centre) - middle;
        let steps =
            |d: usize| -> Vec<f64> { chart.periods[d].map_or(vec![0.0], |p| vec![0.0, p, -p]) };
        let inside = steps(0)
            .into_iter()
            .flat_map(|du| steps(1).into_iter().map(move |dv| DVec2::new(du, dv)))
            .map(|step| near + step)
            .find(|&by| {
                let within = track
                    .points
                    .iter()
                    .filter(|p| frame.encloses(p.uv + by))
                    .count();
                2 * within > track.points.len()
            });
        track.shift(inside.unwrap_or(near));
    }
}
