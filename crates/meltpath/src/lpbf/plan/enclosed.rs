//! What closed contours of a file's layers enclose and no mark comes near, for lines that a file lost are missed by no measure of what is drawn;
//! and lines that lie where contours enclose nothing.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::measures::outline::{self, Boundaries, Contours, NEAR, boundaries};
use meltpath_toolpath::{Layer, Role};

use crate::lpbf::plan::bare_spot::{BareSpot, LOST};
use crate::lpbf::plan::cells::Cells;
use crate::lpbf::plan::work::{Source, Work};

/// Share of one enclosed area that may stay bare, %: a hatch that is drawn a little short of its contour.
const BARE: f64 = 2.0;

/// What the contours of a file's layers tell.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Enclosure {
    /// Of what they enclose, and of lines beside it.
    pub checks: Vec<Check>,
    /// Why what they enclose is not known.
    pub doubt: Option<Doubt>,
}

/// Why what contours enclose is not known.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    pub(super) reason: String,
    pub(super) place: Place,
    pub(super) remedy: &'static str,
}

impl Doubt {
    /// A check that hangs on what contours enclose: it promises nothing.
    pub(in crate::lpbf) fn leaves_open(&self, check: Check) -> Check {
        if check.status == Status::NotChecked {
            return check;
        }
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        check
            .because(&self.reason)
            .at(self.place.clone())
            .remedy(self.remedy)
    }

    /// Of the contours of a layer.
    fn of(layer: u32, contours: &Contours, bounds: &Boundaries) -> Option<Doubt> {
        let place = |at: DVec2| Place {
            layer: Some(layer),
            ..Place::at([at.x, at.y, 0.0])
        };
        if let Some(opening) = contours.openings.first() {
            return Some(Doubt {
                reason: format!(
                    "a contour ends {} mm from where it begins: what it would enclose is not known",
                    significant(opening.gap, 3)
                ),
                place: place(opening.at),
                remedy: "close the contour: its last point is its first one",
            });
        }
        let at = bounds.crossing?;
        Some(Doubt {
            reason: "contours that run unlike ways round cross here: whether one is a hole of the other is not known"
                .to_owned(),
            place: place(at),
            remedy: "unite the parts, or cut the hole out, before they are hatched",
        })
    }
}

/// An area of a layer that stays bare.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bare {
    layer: u32,
    /// Share of what its contours enclose.
    share: f64,
    /// mm².
    enclosed: f64,
    /// A bare place.
    at: DVec2,
}

/// Lines that lie beside what contours enclose.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Stray {
    /// The longest stretch, mm, and where it begins.
    longest: f64,
    layer: u32,
    from: DVec2,
    /// All of them, and all lines of layers with closed contours, mm.
    length: [f64; 2],
}

/// What was found in the layers of a file.
#[derive(Debug, Default)]
struct Found {
    /// Whether some layer of the file has lines.
    filled: bool,
    /// Areas looked at, and how many of them stay bare by more than they may.
    areas: [usize; 2],
    worst: Option<Bare>,
    widest: BareSpot,
    stray: Stray,
    doubt: Option<Doubt>,
}

impl Found {
    /// Looks at a layer whose lines lie `hatch` mm apart, for a spot of that diameter, mm.
    fn take(&mut self, layer: &Layer, hatch: f64, spot: f64) {
        self.filled |= is_filled(layer);
        let mut contours = contours(layer, spot);
        let bounds = boundaries(std::mem::take(&mut contours.rings), hatch);
        if self.doubt.is_none() {
            self.doubt = Doubt::of(layer.number, &contours, &bounds);
        }
        let Some(cells) = Cells::of(&bounds.all, hatch) else {
            return;
        };
        let enclosed = cells.enclosed(&bounds.all);
        let marked = cells.marked(layer, NEAR * hatch);
        self.bare(layer.number, (&cells, &enclosed), &marked);
        self.widest
            .take(layer.number, (&cells, &enclosed), (&marked, hatch));
        for line in fills(layer) {
            self.beside(layer.number, (&cells, &enclosed), line, beside(hatch, spot));
        }
    }

    /// Looks for areas that no mark comes near.
    fn bare(&mut self, layer: u32, (cells, enclosed): (&Cells, &[bool]), marked: &[bool]) {
        for area in cells.areas(enclosed) {
            let bare: Vec<usize> = area.iter().copied().filter(|c| !marked[*c]).collect();
            let share = bare.len() as f64 / area.len() as f64;
            self.areas[0] += 1;
            self.areas[1] += usize::from(100.0 * share > BARE);
            if self.worst.is_none_or(|w| share > w.share) {
                self.worst = Some(Bare {
                    layer,
                    share,
                    enclosed: area.len() as f64 * cells.edge * cells.edge,
                    at: cells.middle(bare.get(bare.len() / 2).copied().unwrap_or(area[0])),
                });
            }
        }
    }

    /// Looks how far a line goes where nothing within `reach` mm is enclosed.
    fn beside(
        &mut self,
        layer: u32,
        (cells, enclosed): (&Cells, &[bool]),
        [a, b]: [DVec2; 2],
        reach: f64,
    ) {
        let length = a.distance(b);
        self.stray.length[1] += length;
        let count = (length / cells.edge).ceil().max(1.0);
        let step = length / count;
        let mut stretch = 0.0;
        for k in 0..count as usize {
            let p = a.lerp(b, (k as f64 + 0.5) / count);
            if cells.any_within(enclosed, p, reach) {
                stretch = 0.0;
                continue;
            }
            stretch += step;
            self.stray.length[0] += step;
            if stretch > self.stray.longest {
                (self.stray.longest, self.stray.layer) = (stretch, layer);
                self.stray.from = p - (b - a).normalize_or_zero() * (stretch - 0.5 * step);
            }
        }
    }

    /// A file of contours alone asks for no lines.
    fn enclosure(self, hatch: f64, spot: f64) -> Enclosure {
        if !self.filled {
            return Enclosure::default();
        }
        let checks = [
            self.enclosed(),
            self.widest.check(hatch.max(spot)),
            self.strays(beside(hatch, spot)),
        ];
        let mut checks: Vec<Check> = checks.into_iter().flatten().collect();
        if let Some(doubt) = &self.doubt {
            if checks.is_empty() {
                checks.push(Check::not_checked(BARE_ID, BARE_TITLE, ""));
                checks[0].status = Status::CannotSay;
            }
            checks = checks.into_iter().map(|c| doubt.leaves_open(c)).collect();
        }
        Enclosure {
            checks,
            doubt: self.doubt,
        }
    }

    fn enclosed(&self) -> Option<Check> {
        let worst = self.worst?;
        let check = Check::judge(
            BARE_ID,
            BARE_TITLE,
            Measure::exact(100.0 * worst.share, "%"),
            Limit::AtMost(BARE),
        );
        let place = Place {
            layer: Some(worst.layer),
            ..Place::at([worst.at.x, worst.at.y, 0.0])
        };
        if check.status == Status::Pass {
            return Some(check);
        }
        let [of, bare] = self.areas;
        let reason = format!(
            "of {} mm² in one area; {bare} of {of} areas of the file's layers; whether that is meant the file does not say",
            significant(worst.enclosed, 3)
        );
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        Some(check.because(&reason).at(place).remedy(LOST))
    }

    fn strays(&self, most: f64) -> Option<Check> {
        let Stray {
            longest,
            layer,
            from,
            length: [beside, all],
        } = self.stray;
        self.worst?;
        let check = Check::judge(
            "beside-contours",
            "longest stretch of a line of a fill where closed contours enclose nothing",
            Measure::exact(longest, "mm"),
            Limit::AtMost(most),
        );
        if check.status == Status::Pass {
            return Some(check);
        }
        let reason = format!(
            "{} mm of {} mm of lines lie outside of all contours, or in their holes; whether that is meant the file does not say",
            significant(beside, 3),
            significant(all, 4)
        );
        let place = Place {
            layer: Some(layer),
            ..Place::at([from.x, from.y, 0.0])
        };
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        Some(check.because(&reason).at(place).remedy(
            "hatch the part anew; where lines without contours are meant, as of supports, judge them in a file of their own",
        ))
    }
}

pub(in crate::lpbf) const BARE_ID: &str = "enclosed";
const BARE_TITLE: &str = "largest share of an area within closed contours that no mark comes near";

/// How far from what is enclosed lines may lie, mm: a hatch distance, or the spot.
fn beside(hatch: f64, spot: f64) -> f64 {
    spot.max(NEAR * hatch)
}

/// Judges the layers of a file that have closed contours, for a spot of that diameter, mm; `hatch` is the distance of their lines, mm, where the
/// job does not say it; lines that tell none are taken as far apart as the spot is wide. Whatever cannot be read is told where it runs.
pub(in crate::lpbf) fn check(work: &Work, hatch: Option<f64>, spot: f64) -> Enclosure {
    let found = || {
        let Work::Layers(set) = work else {
            return None;
        };
        let Source::File(file) = &set.source else {
            return None;
        };
        let hatch = set.hatch.or(hatch).unwrap_or(spot);
        let mut found = Found::default();
        let layers = file.layers().ok()?.flatten();
        layers.for_each(|layer| found.take(&layer, hatch, spot));
        if !found.filled {
            found.filled = file.all().ok()?.flatten().any(|layer| is_filled(&layer));
        }
        Some(found.enclosure(hatch, spot))
    };
    found().unwrap_or_default()
}

/// The contours of a layer.
fn contours(layer: &Layer, spot: f64) -> Contours {
    let passes = layer.passes().filter(|p| p.head.role == Role::Contour);
    let lines = passes.flat_map(|p| p.points.windows(2).map(move |two| (p.head.part, two)));
    let flat = lines.map(|(part, two)| (part, [two[0].truncate(), two[1].truncate()]));
    outline::contours(flat, spot)
}

fn is_filled(layer: &Layer) -> bool {
    layer.passes().any(|p| p.head.role == Role::Fill)
}

/// The lines of its fills.
fn fills(layer: &Layer) -> impl Iterator<Item = [DVec2; 2]> {
    let passes = layer.passes().filter(|p| p.head.role == Role::Fill);
    let lines = passes.flat_map(|p| p.points.windows(2));
    lines.map(|two| [two[0].truncate(), two[1].truncate()])
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

    const SPOT: f64 = 0.08;

    fn told(layers: &[Layer]) -> Enclosure {
        let mut found = Found::default();
        for layer in layers {
            found.take(layer, 0.1, SPOT);
        }
        found.enclosure(0.1, SPOT)
    }

    fn said(layers: &[Layer]) -> Option<Check> {
        told(layers).checks.into_iter().find(|c| c.id == BARE_ID)
    }

    fn passes(layers: &[Layer]) -> bool {
        said(layers).unwrap().status == Status::Pass
    }

    const WHOLE: [f64; 4] = [0.0, 0.0, 6.0, 4.0];

    #[test]
    fn lines_that_are_missing_are_told() {
        let half = layer(&[(WHOLE, 1.0)], &[[0.0, 0.0, 6.0, 2.0]]);
        let full = layer(&[(WHOLE, 1.0)], &[WHOLE]);
        assert!(passes(std::slice::from_ref(&full)));
        let check = said(&[full.clone(), half]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        // two hatch distances of the half are near its last line and its contour
        assert!((check.value.unwrap().value - 45.0).abs() < 2.0);
        // a layer that lost all its lines; a file of contours alone; one without contours
        let bare = layer(&[(WHOLE, 1.0)], &[]);
        assert!(!passes(&[full, bare.clone()]));
        assert_eq!(said(&[bare]), None);
        assert_eq!(said(&[layer(&[], &[[0.0, 0.0, 6.0, 2.0]])]), None);
    }

    /// One line may miss, as hatches that begin anew leave it; three in the middle of a layer may not, nor all of a small body beside a large
    /// one, nor five of six all over.
    #[test]
    fn few_lines_and_small_bodies_count() {
        let without = |gap: f64| {
            layer(
                &[(WHOLE, 1.0)],
                &[[0.0, 0.0, 6.0, 2.0], [0.0, 2.0 + gap, 6.0, 4.0]],
            )
        };
        assert!(passes(&[without(0.1)]));
        assert!(!passes(&[without(0.3)]));
        let small = [8.0, 0.0, 9.0, 1.0];
        let shell = layer(&[(WHOLE, 1.0), (small, 1.0)], &[WHOLE]);
        let check = said(&[shell]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        assert!((check.value.unwrap().value - 64.0).abs() < 6.0);
        let mut thin = layer(&[(WHOLE, 1.0)], &[]);
        for n in 0..7 {
            let y = 0.6 * f64::from(n);
            let head = PassHead {
                role: Role::Fill,
                ..PassHead::default()
            };
            let ends = [DVec3::new(0.0, y, 0.0), DVec3::new(6.0, y, 0.0)];
            thin.polyline(head, ends);
        }
        assert!(!passes(&[thin]));
    }

    /// What is a small share of a large area may be an island that nobody marks.
    #[test]
    fn an_island_that_is_left_out_is_told() {
        let large = [0.0, 0.0, 20.0, 10.0];
        let around = [
            [0.0, 0.0, 20.0, 4.0],
            [0.0, 4.0, 9.0, 6.0],
            [10.5, 4.0, 20.0, 6.0],
            [0.0, 6.0, 20.0, 10.0],
        ];
        let island = layer(&[(large, 1.0)], &around);
        assert!(passes(std::slice::from_ref(&island)));
        let spot = |layers: &[Layer]| {
            let mut checks = told(layers).checks.into_iter();
            checks.find(|c| c.id == "bare-spot")
        };
        let check = spot(&[island]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        // 1.5 mm between the ends of the lines
        assert!((check.value.unwrap().value - 1.5).abs() < 0.15);
        let [x, y, _] = check.place.unwrap().position.unwrap();
        assert!((x - 9.75).abs() < 0.2 && (4.5..5.5).contains(&y));
        // three lines that miss side by side are narrower
        let lines = [[0.0, 0.0, 20.0, 4.0], [0.0, 4.3, 20.0, 10.0]];
        let band = layer(&[(large, 1.0)], &lines);
        assert_eq!(spot(&[band]), None);
        assert_eq!(spot(&[layer(&[(large, 1.0)], &[large])]), None);
    }

    /// A hatch that runs across, as one along: cells are looked for along each line alone.
    #[test]
    fn lines_across_fill_as_those_along() {
        let mut slant = layer(&[(WHOLE, 1.0)], &[]);
        for n in -60..100 {
            let x = 0.1 * 2.0_f64.sqrt() * f64::from(n);
            let head = PassHead {
                role: Role::Fill,
                ..PassHead::default()
            };
            let ends = [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 4.0, 4.0, 0.0)];
            slant.polyline(head, ends);
        }
        assert!(passes(&[slant]));
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
            assert!(passes(&[layer(&[(WHOLE, 1.0), (hole, way)], &frame)]));
        }
        let inner = [0.1, 0.1, 5.9, 3.9];
        let half = [[0.0, 0.0, 6.0, 2.0]];
        assert!(!passes(&[layer(&[(inner, 1.0), (WHOLE, 1.0)], &half)]));
        let island = [2.0, 1.0, 4.0, 3.0];
        let rings = [(WHOLE, 1.0), (hole, -1.0), (island, 1.0)];
        let areas: f64 = 24.0 - 12.0 + 4.0;
        let bounds = bounds_of(&layer(&rings, &[]));
        let cells = Cells::of(&bounds, 0.1).unwrap();
        let enclosed = cells.enclosed(&bounds);
        let count = enclosed.iter().filter(|c| **c).count() as f64;
        assert!((count * cells.edge * cells.edge - areas).abs() < 0.5);
        assert_eq!(cells.areas(&enclosed).len(), 2);
    }

    fn bounds_of(layer: &Layer) -> Vec<outline::Boundary> {
        boundaries(contours(layer, SPOT).rings, 0.1).all
    }

    /// A square of 4 mm that ends `gap` short of where it begins, half of it filled.
    fn open(gap: f64) -> Layer {
        let mut layer = layer(&[], &[[0.0, 0.0, 4.0, 2.0]]);
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, gap]];
        let head = PassHead {
            role: Role::Contour,
            ..PassHead::default()
        };
        let points = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
        layer.polyline(head, points);
        layer
    }

    /// A contour that ends within the spot of where it begins encloses what it encloses; of one that does not nobody knows, and the place of the
    /// opening is told. Lines that enclose nothing are no contours.
    #[test]
    fn contours_that_hardly_close_do_and_open_ones_are_told() {
        for gap in [0.002, 0.05] {
            let check = said(&[open(gap)]).unwrap();
            assert!((check.value.unwrap().value - 45.0).abs() < 3.0, "{gap}");
        }
        for gap in [0.2, 4.0] {
            let told = told(&[open(gap)]);
            let check = &told.checks[0];
            assert_eq!(check.status, Status::CannotSay, "{gap}");
            assert!(check.reason.contains("from where it begins"), "{check:?}");
            let at = check.place.as_ref().unwrap().position.unwrap();
            assert_eq!(at, [0.0, gap, 0.0]);
            let fill = Check::judge("f", "F", Measure::exact(99.0, "%"), Limit::AtLeast(90.0));
            let fill = told.doubt.unwrap().leaves_open(fill);
            assert_eq!(fill.status, Status::CannotSay);
        }
        let mut wall = layer(&[(WHOLE, 1.0)], &[WHOLE]);
        let head = PassHead {
            role: Role::Contour,
            ..PassHead::default()
        };
        let points = [[8.0, 0.0], [9.0, 0.0], [9.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        wall.polyline(head, points);
        assert!(
            told(&[wall])
                .checks
                .iter()
                .all(|c| c.status == Status::Pass)
        );
    }

    /// What two parts share is to be filled, whether they cross or one lies in the other; where one runs the other way round nobody knows.
    #[test]
    fn what_parts_share_is_no_hole() {
        let other = [4.0, 0.0, 10.0, 4.0];
        let apart = [[0.0, 0.0, 4.0, 4.0], [6.0, 0.0, 10.0, 4.0]];
        let check = said(&[layer(&[(WHOLE, 1.0), (other, 1.0)], &apart)]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        assert!((check.value.unwrap().value - 18.0).abs() < 2.0);
        let all = [[0.0, 0.0, 10.0, 4.0]];
        assert!(passes(&[layer(&[(WHOLE, 1.0), (other, 1.0)], &all)]));
        let unlike = told(&[layer(&[(WHOLE, 1.0), (other, -1.0)], &all)]);
        assert_eq!(unlike.checks[0].status, Status::CannotSay);
        assert!(unlike.checks[0].reason.contains("cross"), "{unlike:?}");
        // a body of its own in another one, which ends there
        let frame = [
            [0.0, 0.0, 6.0, 1.0],
            [0.0, 3.0, 6.0, 4.0],
            [0.0, 1.0, 2.0, 3.0],
            [4.0, 1.0, 6.0, 3.0],
        ];
        let mut within = layer(&[(WHOLE, 1.0)], &frame);
        assert!(!passes(std::slice::from_ref(&within)));
        let head = PassHead {
            part: 1,
            role: Role::Contour,
            ..PassHead::default()
        };
        let corners = [[2.0, 1.0], [4.0, 1.0], [4.0, 3.0], [2.0, 3.0], [2.0, 1.0]];
        let points = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
        within.polyline(head, points);
        assert!(!passes(&[within]));
        // a contour that comes twice
        let half = [[0.0, 0.0, 6.0, 2.0]];
        assert!(!passes(&[layer(&[(WHOLE, 1.0), (WHOLE, 1.0)], &half)]));
    }

    /// Lines across a hole, or beyond all contours.
    #[test]
    fn lines_where_nothing_is_enclosed_are_told() {
        let hole = [2.0, 1.0, 4.0, 3.0];
        let over = layer(&[(WHOLE, 1.0), (hole, -1.0)], &[WHOLE]);
        let beyond = layer(&[(WHOLE, 1.0)], &[[-1.0, 0.0, 7.0, 4.0]]);
        for (layer, longest, length, x) in [(over, 1.8, 32.0, 2.1), (beyond, 0.9, 72.0, -1.0)] {
            let told = told(&[layer]);
            let check = &told.checks[1];
            assert_eq!(check.status, Status::CannotSay);
            let value = check.value.as_ref().unwrap().value;
            assert!((value - longest).abs() < 0.11, "{value}");
            let at = check.place.as_ref().unwrap().position.unwrap();
            assert!((at[0] - x).abs() < 0.11, "{at:?}");
            let told: f64 = check.reason.split(' ').next().unwrap().parse().unwrap();
            assert!((told - length).abs() < 0.15 * length, "{}", check.reason);
        }
    }
}
