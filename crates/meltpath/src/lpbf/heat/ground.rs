//! Ground that is still liquid where the spot comes: there marks are one pool. The engine sums their heat as if the metal were solid, and what a
//! melt that is heated again does (its flow, its vapour) is in none of its laws. So what is melted through is told without the heat that falls
//! there, too: the rest is drawn on solid ground, of which the engine was held against measured tracks.

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{Beam, BeamError, BeamPath, BeamPoint};
use meltpath_thermal::pool::fusion::FusionError;
use meltpath_thermal::pool::history::Memory;
use meltpath_thermal::pool::moving_source::MovingSource;

use super::settings::HeatSettings;

/// How far ahead of the spot its ground is looked at, in spot diameters: a moving spot's own heat hardly reaches so far ahead.
const AHEAD: f64 = 2.0;
/// Distance from look to look along the way, in spot diameters.
const STEP: f64 = 0.5;

/// What a path draws on liquid ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnLiquid {
    /// Length of the way on it, mm.
    pub length: f64,
    /// Where it is hottest, mm.
    pub place: [f64; 2],
    /// Share of the surface that is melted through without the heat that falls there.
    pub without: f64,
    /// Share that is melted, or would be were all that lies beside those ways melted, too.
    pub with: f64,
}

/// A path in two: what it draws on solid ground and what on liquid ground.
pub(super) struct Parted {
    pub(super) solid: BeamPath,
    pub(super) liquid: BeamPath,
    /// Length of the way on liquid ground, mm.
    pub(super) length: f64,
    /// Where it is hottest, mm.
    pub(super) place: [f64; 2],
}

/// A place of the lit way, so far along it.
#[derive(Clone, Copy)]
struct Vertex {
    time: f64,
    along: f64,
    place: [f64; 2],
}

/// A short piece of the lit way.
struct Piece {
    times: [f64; 2],
    length: f64,
    middle: [f64; 2],
    /// When its ground is looked at, s: while the spot is still far from it, or when the light comes on.
    asked: f64,
}

/// The path in two; `None` where all its ground is solid.
///
/// # Errors
/// Of the engine and of paths.
pub(super) fn parted(
    settings: &HeatSettings,
    path: &BeamPath,
    beam: Beam,
    observer: &dyn Observer,
) -> Result<Option<Parted>, GroundError> {
    let engine = MovingSource::new(settings.medium, path.clone(), beam, Memory::Folded);
    let mut engine = engine.map_err(FusionError::from)?;
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let (mut length, mut hottest) = (0.0, (settings.material.solidus, [0.0; 2]));
    for (n, piece) in pieces(path, STEP * settings.spot, AHEAD * settings.spot)
        .iter()
        .enumerate()
    {
        if n % 64 == 0 {
            observer.check().map_err(FusionError::Cancelled)?;
        }
        engine.advance(piece.asked).map_err(FusionError::from)?;
        let [x, y] = piece.middle;
        let kelvin = engine.temperature(DVec3::new(x, y, 0.0));
        if kelvin < settings.material.solidus {
            continue;
        }
        length += piece.length;
        if kelvin > hottest.0 {
            hottest = (kelvin, piece.middle);
        }
        match spans.last_mut() {
            Some(last) if last[1] >= piece.times[0] => last[1] = piece.times[1],
            _ => spans.push(piece.times),
        }
    }
    if spans.is_empty() {
        return Ok(None);
    }
    Ok(Some(Parted {
        solid: lit_only(path, &spans, false)?,
        liquid: lit_only(path, &spans, true)?,
        length,
        place: hottest.1,
    }))
}

meltpath_base::passes_on! {
    /// Why the ground could not be told.
    pub(super) enum GroundError {
        /// The path.
        Path(BeamError),
        /// The engine.
        Fusion(FusionError),
    }
}

/// The lit way in pieces of about `step` mm, in their order.
fn pieces(path: &BeamPath, step: f64, ahead: f64) -> Vec<Piece> {
    let mut found = Vec::new();
    let mut run: Vec<Vertex> = Vec::new();
    let vertex = |p: &BeamPoint, along: f64| Vertex {
        time: p.time,
        along,
        place: [p.x, p.y],
    };
    for pair in path.points().windows(2) {
        let [a, b] = [&pair[0], &pair[1]];
        if b.time <= a.time {
            // where one vector ends and the next begins, or a jump between two moments
            if (b.x, b.y) != (a.x, a.y) {
                cut(&mut found, &mut run, step, ahead);
            }
            continue;
        }
        if !a.is_on() {
            cut(&mut found, &mut run, step, ahead);
            continue;
        }
        if run.is_empty() {
            run.push(vertex(a, 0.0));
        }
        let along = run.last().map_or(0.0, |v| v.along) + (b.x - a.x).hypot(b.y - a.y);
        run.push(vertex(b, along));
    }
    cut(&mut found, &mut run, step, ahead);
    found
}

/// Cuts a way that was lit without a break into pieces, and begins the next one.
fn cut(found: &mut Vec<Piece>, run: &mut Vec<Vertex>, step: f64, ahead: f64) {
    let (Some(first), Some(last)) = (run.first().copied(), run.last().copied()) else {
        return;
    };
    let length = last.along;
    let at = |along: f64| -> Vertex {
        let k = run.partition_point(|v| v.along < along);
        let (Some(b), Some(a)) = (run.get(k), k.checked_sub(1).and_then(|k| run.get(k))) else {
            return if k == 0 { first } else { last };
        };
        let share = (along - a.along) / (b.along - a.along);
        let mix = |a: f64, b: f64| a + share * (b - a);
        Vertex {
            time: mix(a.time, b.time),
            along,
            place: [mix(a.place[0], b.place[0]), mix(a.place[1], b.place[1])],
        }
    };
    let count = (length / step).ceil() as usize;
    for k in 0..count {
        let [from, to] = [k, k + 1].map(|k| length * k as f64 / count as f64);
        let middle = 0.5 * (from + to);
        let end = if k + 1 == count {
            last.time
        } else {
            at(to).time
        };
        found.push(Piece {
            times: [at(from).time, end],
            length: to - from,
            middle: at(middle).place,
            asked: at((middle - ahead).max(0.0)).time,
        });
    }
    run.clear();
}

/// The path with light only within the spans of time, or only outside of them; spans in their order.
fn lit_only(path: &BeamPath, spans: &[[f64; 2]], within: bool) -> Result<BeamPath, BeamError> {
    let mut points: Vec<BeamPoint> = Vec::new();
    let mut next = 0;
    for pair in path.points().windows(2) {
        let [a, b] = [pair[0], pair[1]];
        while spans.get(next).is_some_and(|s| s[1] <= a.time) {
            next += 1;
        }
        let mut cuts = vec![a.time];
        let bounds = spans[next..].iter().take_while(|s| s[0] < b.time).flatten();
        cuts.extend(bounds.filter(|t| (a.time..b.time).contains(*t) && **t > a.time));
        for time in cuts {
            let share = (time - a.time) / (b.time - a.time).max(f64::MIN_POSITIVE);
            let inside = spans[next..].iter().any(|s| s[0] <= time && time < s[1]);
            points.push(BeamPoint {
                time,
                x: a.x + share * (b.x - a.x),
                y: a.y + share * (b.y - a.y),
                power: if inside == within { a.power } else { 0.0 },
                ..a
            });
        }
    }
    points.extend(path.points().last().copied());
    BeamPath::new(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines along x from 0 to 1 mm, 1 mm/s, one each 2 s, at heights `y`.
    fn lines(heights: &[f64]) -> BeamPath {
        let mut points = Vec::new();
        for (k, y) in heights.iter().enumerate() {
            let begin = 2.0 * k as f64;
            let point = |time, x, power| BeamPoint {
                time,
                x,
                y: *y,
                power,
                spot: 0.1,
            };
            points.extend([point(begin, 0.0, 50.0), point(begin + 1.0, 1.0, 0.0)]);
        }
        BeamPath::new(points).unwrap()
    }

    #[test]
    fn pieces_cover_the_lit_way_and_are_looked_at_before_the_spot_comes() {
        let pieces = pieces(&lines(&[0.0, 0.3]), 0.1, 0.2);
        assert_eq!(pieces.len(), 20);
        let whole: f64 = pieces.iter().map(|p| p.length).sum();
        assert!((whole - 2.0).abs() < 1e-9);
        assert!(pieces.iter().all(|p| p.asked <= p.times[0]));
        // none while the line before was lit, for the second one
        assert!((pieces[10].asked - 2.0).abs() < 1e-9);
        assert!((pieces[19].asked - 2.75).abs() < 1e-9 && pieces[19].middle == [0.95, 0.3]);
        assert!((pieces[19].times[1] - 3.0).abs() < 1e-9);
    }

    #[test]
    fn two_paths_share_the_light_of_one() {
        let path = lines(&[0.0, 0.3]);
        let spans = [[0.25, 0.5], [2.75, 3.0]];
        let [inside, outside] = [true, false].map(|w| lit_only(&path, &spans, w).unwrap());
        let lit = |path: &BeamPath| -> f64 {
            let ways = path.points().windows(2).filter(|w| w[0].is_on());
            ways.map(|w| w[1].time - w[0].time).sum()
        };
        assert!((lit(&inside) - 0.5).abs() < 1e-9 && (lit(&outside) - 1.5).abs() < 1e-9);
        for time in [0.3, 0.7, 2.4, 2.9] {
            let [a, b, c] = [&path, &inside, &outside].map(|p| p.at(time));
            assert!((a.x - b.x).abs() < 1e-9 && (a.x - c.x).abs() < 1e-9);
            assert!((a.power - b.power - c.power).abs() < 1e-9);
        }
    }
}
