//! Layers whose contours enclose much more than their lines fill: lines that a file lost are missed by no measure of what is drawn.

use meltpath_base::{Place, Reporter, Warning};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::{crosses, signed_area};
use meltpath_toolpath::{Layer, Role};

use crate::lpbf::plan::work::{Source, Work};

/// Share of what contours enclose that lines and contours may leave out before it is told.
const LEFT_OUT: f64 = 0.2;
/// Hatch distances up to which a ring lies beside the one round it all along: both are contours of one boundary.
const BESIDE: f64 = 1.6;
/// Rings end where they begin, mm.
const CLOSED: f64 = 1e-3;

/// Layers of which much is not filled.
#[derive(Debug, Default)]
struct Unfilled {
    /// So many, of those with contours and lines.
    layers: [usize; 2],
    /// The one of which the largest share is not filled: number, mm² enclosed, mm² of lines and contours.
    worst: Option<(u32, [f64; 2])>,
    /// Layers of contours alone, with what they enclose and what they cover.
    alone: Vec<(u32, [f64; 2])>,
}

impl Unfilled {
    /// Looks at a layer whose lines lie `hatch` mm apart.
    fn take(&mut self, layer: &Layer, hatch: f64) {
        let rings = rings(layer);
        let long = |role: Role| -> f64 {
            let of = layer.passes().filter(|p| p.head.role == role);
            of.flat_map(|p| p.points.windows(2))
                .map(|w| w[0].distance(w[1]))
                .sum()
        };
        let enclosed = enclosed(&rings, hatch);
        if enclosed <= 0.0 {
            return;
        }
        let [fills, contours] = [Role::Fill, Role::Contour].map(long);
        let areas = [enclosed, hatch * (fills + contours)];
        if fills > 0.0 {
            self.count(layer.number, areas);
        } else {
            self.alone.push((layer.number, areas));
        }
    }

    fn count(&mut self, number: u32, areas @ [enclosed, drawn]: [f64; 2]) {
        self.layers[1] += 1;
        if drawn >= (1.0 - LEFT_OUT) * enclosed {
            return;
        }
        self.layers[0] += 1;
        let share = |[enclosed, drawn]: [f64; 2]| drawn / enclosed;
        if self
            .worst
            .is_none_or(|(_, worst)| share(areas) < share(worst))
        {
            self.worst = Some((number, areas));
        }
    }

    /// Warns where there are any; a file of contours alone asks for no lines.
    fn tell(mut self, reporter: &Reporter) {
        if self.layers[1] > 0 {
            for (number, areas) in std::mem::take(&mut self.alone) {
                self.count(number, areas);
            }
        }
        let ([found, of], Some((number, [enclosed, drawn]))) = (self.layers, self.worst) else {
            return;
        };
        let layers = if of == 1 { "layer" } else { "layers" };
        reporter.warn_at(
            "contours-not-filled",
            format!(
                "in {found} of {of} {layers} contours enclose much more than lines fill: in layer {number} they enclose {enclosed:.1} mm², lines and contours cover {drawn:.1} mm² at most; the fill rate is of what lines fill"
            ),
            Place::layer(number),
            "are lines missing in the file? Where contours alone, or lines of other layers, fill the rest, nothing is wrong",
        );
    }
}

/// What is told of layers of a file whose contours enclose much more than their lines fill; `hatch` is the distance of their lines, mm,
/// where the job does not say it. Whatever cannot be read is told where it runs.
pub(in crate::lpbf) fn told(work: &Work, hatch: Option<f64>) -> Vec<Warning> {
    let reporter = Reporter::new();
    if let Work::Layers(set) = work
        && let Source::File(file) = &set.source
        && let Some(hatch) = set.hatch.or(hatch)
        && let Ok(layers) = file.layers()
    {
        let mut found = Unfilled::default();
        layers.flatten().for_each(|layer| found.take(&layer, hatch));
        found.tell(&reporter);
    }
    reporter.warnings()
}

/// The closed contours of a layer; what is drawn on from where the last contour ended goes on with it.
fn rings(layer: &Layer) -> Vec<Vec<DVec2>> {
    let (mut found, mut open) = (Vec::new(), Vec::<DVec2>::new());
    for pass in layer.passes().filter(|p| p.head.role == Role::Contour) {
        let mut points = pass.points.iter().map(|p| p.truncate());
        let (Some(first), ends) = (points.next(), open.last()) else {
            continue;
        };
        if ends.is_none_or(|end| end.distance(first) > CLOSED) {
            open = vec![first];
        }
        open.extend(points);
        let closes = open.len() > 3 && open[0].distance(open[open.len() - 1]) <= CLOSED;
        if closes {
            open.pop();
            found.push(std::mem::take(&mut open));
        }
    }
    found
}

/// A ring with its box and its signed area, and how deep it lies.
struct Nested<'a> {
    ring: &'a [DVec2],
    low: DVec2,
    high: DVec2,
    area: f64,
    /// Boundaries round it, itself included: what lies within an odd number of them is enclosed.
    depth: u32,
}

impl Nested<'_> {
    fn holds(&self, p: DVec2) -> bool {
        if p.cmplt(self.low).any() || p.cmpgt(self.high).any() {
            return false;
        }
        let ends = self.ring.iter().zip(self.ring.iter().cycle().skip(1));
        ends.filter(|(a, b)| crosses(**a, **b, p)).count() % 2 == 1
    }
}

/// What rings enclose, mm²: holes are not, whichever way they run, and of contours side by side the outermost counts.
fn enclosed(rings: &[Vec<DVec2>], hatch: f64) -> f64 {
    let mut all: Vec<Nested<'_>> = rings
        .iter()
        .map(|ring| Nested {
            low: ring.iter().copied().fold(DVec2::INFINITY, DVec2::min),
            high: ring.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max),
            area: signed_area(ring),
            ring,
            depth: 1,
        })
        .collect();
    all.sort_by(|a, b| b.area.abs().total_cmp(&a.area.abs()));
    let mut sum = 0.0;
    for n in 0..all.len() {
        let (before, rest) = all.split_at_mut(n);
        let own = &mut rest[0];
        // the smallest of the larger ones that hold it
        let Some(round) = before.iter().rev().find(|r| r.holds(own.ring[0])) else {
            sum += own.area.abs();
            continue;
        };
        let same_way = round.area.signum() == own.area.signum();
        if same_way && beside(own.ring, round.ring, BESIDE * hatch) {
            own.depth = round.depth;
            continue;
        }
        own.depth = round.depth + 1;
        let sign = if own.depth % 2 == 1 { 1.0 } else { -1.0 };
        sum += sign * own.area.abs();
    }
    sum
}

/// Whether every corner of a ring lies within a distance of another.
fn beside(ring: &[DVec2], round: &[DVec2], within: f64) -> bool {
    let near = |p: DVec2| {
        let ends = round.iter().zip(round.iter().cycle().skip(1));
        let mut sides = ends.map(|(a, b)| {
            let along = *b - *a;
            let share = (p - *a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
            p.distance(*a + share.clamp(0.0, 1.0) * along)
        });
        sides.any(|away| away <= within)
    };
    ring.iter().all(|p| near(*p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::PassHead;

    /// A layer of rectangles (x and y of two corners, which way round they run) and of lines along x, 0.1 mm apart, over others.
    fn layer(rings: &[([f64; 4], f64)], filled: &[[f64; 4]]) -> Layer {
        let mut layer = Layer::new(1, 0.0);
        let head = |role| PassHead {
            role,
            ..PassHead::default()
        };
        for ([x, y, u, v], way) in rings {
            let mut corners = vec![[*x, *y], [*u, *y], [*u, *v], [*x, *v], [*x, *y]];
            if *way < 0.0 {
                corners.reverse();
            }
            let points = corners.into_iter().map(|[x, y]| DVec3::new(x, y, 0.0));
            layer.polyline(head(Role::Contour), points);
        }
        for [x, y, u, v] in filled {
            for n in 0..((v - y) / 0.1).round() as u32 {
                let y = y + 0.1 * f64::from(n);
                layer.polyline(
                    head(Role::Fill),
                    [DVec3::new(*x, y, 0.0), DVec3::new(*u, y, 0.0)],
                );
            }
        }
        layer
    }

    fn said(layers: &[Layer]) -> Option<String> {
        let mut found = Unfilled::default();
        for layer in layers {
            found.take(layer, 0.1);
        }
        let reporter = Reporter::new();
        found.tell(&reporter);
        reporter.warnings().into_iter().next().map(|w| w.message)
    }

    const WHOLE: [f64; 4] = [0.0, 0.0, 6.0, 4.0];

    #[test]
    fn lines_that_are_missing_are_told() {
        let half = layer(&[(WHOLE, 1.0)], &[[0.0, 0.0, 6.0, 2.0]]);
        let full = layer(&[(WHOLE, 1.0)], &[WHOLE]);
        assert_eq!(said(std::slice::from_ref(&full)), None);
        let words = said(&[full.clone(), half]).unwrap();
        assert!(
            words.starts_with("in 1 of 2 layers") && words.contains("enclose 24.0 mm²"),
            "{words}"
        );
        // a layer that lost all its lines; a file of contours alone; one without contours
        let bare = layer(&[(WHOLE, 1.0)], &[]);
        assert!(said(&[full, bare.clone()]).is_some());
        assert_eq!(said(&[bare]), None);
        assert_eq!(said(&[layer(&[], &[[0.0, 0.0, 6.0, 2.0]])]), None);
    }

    /// Holes of either way round are not to be filled, islands in them are; contours side by side are one boundary.
    #[test]
    fn what_contours_enclose_is_theirs_without_holes() {
        let hole = [1.0, 0.5, 5.0, 3.5];
        let frame = [
            [0.0, 0.0, 6.0, 0.5],
            [0.0, 3.5, 6.0, 4.0],
            [0.0, 0.5, 1.0, 3.5],
            [5.0, 0.5, 6.0, 3.5],
        ];
        for way in [1.0, -1.0] {
            assert_eq!(said(&[layer(&[(WHOLE, 1.0), (hole, way)], &frame)]), None);
        }
        let inner = [0.1, 0.1, 5.9, 3.9];
        let half = [[0.0, 0.0, 6.0, 2.0]];
        assert!(said(&[layer(&[(inner, 1.0), (WHOLE, 1.0)], &half)]).is_some());
        let island = [2.0, 1.0, 4.0, 3.0];
        let rings = [(WHOLE, 1.0), (hole, -1.0), (island, 1.0)];
        let areas: f64 = 24.0 - 12.0 + 4.0;
        let found = super::rings(&layer(&rings, &[]));
        assert!((enclosed(&found, 0.1) - areas).abs() < 1e-9);
    }
}
