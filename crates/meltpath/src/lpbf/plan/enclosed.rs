//! What closed contours of a file's layers enclose and no mark comes near, for lines that a file lost are missed by no measure of what is drawn;
//! and lines that lie where contours enclose nothing.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::measures::outline::{self, Boundaries, Contours, NEAR, boundaries};
use meltpath_toolpath::{Layer, Role};

use crate::lpbf::plan::bare_spot::{BareSpot, BareStrip, LOST};
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
    strip: BareStrip,
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
        let bare = |marked: &[bool]| -> Vec<bool> {
            let both = enclosed.iter().zip(marked);
            both.map(|(inside, marked)| *inside && !marked).collect()
        };
        let here = (layer.number, &cells);
        self.widest.take(here, &bare(&marked), hatch);
        let cover = cover(hatch, spot);
        if cover > NEAR * hatch {
            let covered = cells.marked(layer, cover);
            self.strip.take(here, &bare(&covered));
        } else {
            self.strip.take(here, &bare(&marked));
        }
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

    /// A file of contours alone asks for no lines, and one of lines alone does not say how far they are to reach: what is not known is named.
    fn enclosure(self, hatch: f64, spot: f64) -> Enclosure {
        let why = match (self.filled, self.worst) {
            (false, None) => return Enclosure::default(),
            (false, Some(_)) => Some(NO_LINES),
            (true, None) if self.doubt.is_none() => Some(NO_CONTOURS),
            (true, _) => None,
        };
        if let Some(why) = why {
            return Enclosure {
                checks: vec![Check::not_checked(BARE_ID, BARE_TITLE, why)],
                doubt: None,
            };
        }
        let checks = [
            self.enclosed(),
            self.worst.map(|_| self.widest.check(hatch.max(spot))),
            self.strip.check(cover(hatch, spot), hatch.max(spot)),
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
const NO_LINES: &str = "the file has contours and no lines of a fill: whether what they enclose is to be filled nobody says";
const NO_CONTOURS: &str = "the file has no closed contours: how far its lines are to reach, and whether some are missing, nobody says";
const BARE_TITLE: &str = "largest share of an area within closed contours that no mark comes near";

/// How far from a mark it covers a strip, mm: a hatch distance, as one line may miss, or what its spot covers.
fn cover(hatch: f64, spot: f64) -> f64 {
    (NEAR * hatch).max(0.5 * spot)
}

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
mod tests;
