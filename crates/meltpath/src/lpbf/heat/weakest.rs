//! Which layer is drawn: the one that melts the least, and which others it does not stand for.
//!
//! Layers of one recipe differ in their outlines alone, and one of them tells of all. Where a file gives layers of their own powers, speeds,
//! line distances or thicknesses, the one is drawn that melts no better than most others, mark for mark.

use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::prepared::Prepared;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::survey::Survey;
use meltpath_scan_head::head::vector::{ScanJob, ScanJobError};
use meltpath_scan_head::measures::hatch::HatchDistance;
use meltpath_toolpath::Role;

use super::again::{WarmPlaces, Warmest};
use super::boiling::{Boiling, Hottest, hottest};
use super::settings::HeatSettings;
use super::standing::{Standing, longest};
use crate::lpbf::plan::work::{Source, Work};

/// Marks of a layer are compared at so many equal shares of their length, kind by kind.
const SHARES: usize = 50;
/// By what share a layer may melt worse than the drawn one and yet be told by it: the check answers for a fifth of the heat.
const ALIKE: f64 = 0.05;

/// Layers that the drawn one does not stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotTold {
    /// The number of the first.
    pub first: u32,
    /// How many.
    pub layers: usize,
}

/// Which layer or square is drawn, of how many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Its number where layers are marked; `None` of squares, which are all alike.
    pub layer: Option<u32>,
    /// Layers that are marked.
    pub of: usize,
    /// Those that it does not stand for.
    pub not_told: Option<NotTold>,
    /// To what depth it has to be melted, mm.
    pub depth: f64,
}

/// What is looked at of a recipe: one layer or square, and the hottest marks of all.
#[derive(Debug, Clone)]
pub(in crate::lpbf) struct Looked {
    /// The layer or square that is drawn.
    pub(in crate::lpbf) job: ScanJob,
    /// The number of its first vector in the whole job.
    pub(in crate::lpbf) first: u32,
    /// Distance of its lines, mm, where the job does not say it.
    pub(in crate::lpbf) spacing: Option<f64>,
    pub(super) choice: Choice,
    /// Boiling numbers of its own marks.
    pub(super) own: Vec<Boiling>,
    /// Those of all marks.
    pub(super) all: Vec<Boiling>,
    /// Where the lit beam stands and heats the most, in all layers.
    pub(super) standing: Option<Standing>,
    /// Places that are marked again, in all layers.
    pub(super) warm: Option<WarmPlaces>,
}

impl Looked {
    /// The number of the last vector of what is drawn.
    pub(in crate::lpbf) fn last(&self) -> u32 {
        self.first + self.job.vectors.len().saturating_sub(1) as u32
    }
}

/// Looks through the layers of a recipe.
///
/// # Errors
/// [`HeadError`] of a file that cannot be read any more.
pub(in crate::lpbf) fn look(
    settings: &HeatSettings,
    work: &Work,
    recipe: &Recipe,
    survey: &Survey,
) -> Result<Looked, HeadError> {
    let law = recipe.power_law;
    let depth = |layer: u32| settings.depth_of(layer);
    let one = |job: ScanJob, layer: Option<u32>, of: usize| {
        let own = hottest(settings, (&job, layer));
        let mut warm = Warmest::new(settings);
        warm.take(&job, layer);
        Looked {
            warm: warm.found,
            first: 0,
            spacing: HatchDistance::of(&job),
            choice: Choice {
                layer,
                of,
                not_told: None,
                depth: layer.map_or(settings.layer, depth),
            },
            all: own.clone(),
            own,
            standing: longest(settings, (&job, layer), law),
            job,
        }
    };
    let set = match work {
        Work::Plate(_) => return Ok(one(work.shown(&survey.first), None, 1)),
        Work::Layers(set) => set,
    };
    let alike = matches!(set.source, Source::Part(_));
    if survey.layers.len() < 2 || alike {
        let number = survey.layers.first().map(|l| l.number);
        return Ok(one(survey.first.clone(), number, survey.layers.len()));
    }
    let (mut all, mut standing) = (Hottest::new(settings), None::<Standing>);
    let mut warm = Warmest::new(settings);
    let mut kinds: Vec<Kind> = Vec::new();
    let mut count = 0;
    for layer in work.layers(recipe)? {
        let layer = layer?;
        count += 1;
        all.take(&layer.job, Some(layer.number));
        warm.take(&layer.job, Some(layer.number));
        let here = longest(settings, (&layer.job, Some(layer.number)), law);
        standing = standing.into_iter().chain(here).max_by(Standing::hotter);
        let marks = Marks::of(&layer, depth(layer.number));
        match kinds.iter_mut().find(|kind| kind.marks.is_alike(&marks)) {
            Some(kind) => kind.layers += 1,
            None => kinds.push(Kind {
                marks,
                number: layer.number,
                layers: 1,
            }),
        }
    }
    let (drawn, not_told) = weakest(&kinds);
    let mut wanted = work.layers(recipe)?;
    let layer = wanted.find(|l| !matches!(l, Ok(l) if l.number != drawn));
    let layer = layer.ok_or(ScanJobError::Empty)??;
    let looked = one(layer.job, Some(drawn), count);
    Ok(Looked {
        first: layer.first,
        choice: Choice {
            not_told,
            ..looked.choice
        },
        all: all.found,
        standing,
        warm: warm.found,
        ..looked
    })
}

/// Layers that melt alike.
struct Kind {
    marks: Marks,
    /// The first of them.
    number: u32,
    layers: usize,
}

/// The layer that stands for most of all, and those for which it does not.
fn weakest(kinds: &[Kind]) -> (u32, Option<NotTold>) {
    let stands = |kind: &Kind| -> usize {
        let told = kinds.iter().filter(|k| kind.marks.tells(&k.marks));
        told.map(|k| k.layers).sum()
    };
    // of equals the first
    let drawn = kinds.iter().rev().max_by_key(|kind| stands(kind));
    let Some(drawn) = drawn else {
        return (0, None);
    };
    let others = kinds.iter().filter(|k| !drawn.marks.tells(&k.marks));
    let not_told = others.fold(None, |found: Option<NotTold>, kind| {
        Some(NotTold {
            first: found.map_or(kind.number, |f| f.first),
            layers: kind.layers + found.map_or(0, |f| f.layers),
        })
    });
    (drawn.number, not_told)
}

/// How the marks of a layer melt.
struct Marks {
    /// Of contours and of fills, from the weakest to the strongest: power over the root of the speed, by which a wide spot melts, and over
    /// the speed, by which a narrow one does.
    kinds: [Option<[[f64; SHARES]; 2]>; 2],
    /// Distance of its lines, mm.
    spacing: Option<f64>,
    /// How deep they have to melt, mm.
    depth: f64,
}

impl Marks {
    fn of(layer: &Prepared, depth: f64) -> Self {
        Marks {
            kinds: [Role::Contour, Role::Fill].map(|kind| strengths(&layer.job, kind)),
            spacing: HatchDistance::of(&layer.job),
            depth,
        }
    }

    /// Whether another layer melts as well as this one, or better.
    fn tells(&self, other: &Marks) -> bool {
        let wider = |own: Option<f64>, other: Option<f64>| match (own, other) {
            (_, None) => false,
            (None, Some(_)) => true,
            (Some(own), Some(other)) => other > own * (1.0 + ALIKE),
        };
        let mut kinds = self.kinds.iter().zip(&other.kinds);
        !wider(self.spacing, other.spacing)
            && !wider(Some(self.depth), Some(other.depth))
            && kinds.all(|(own, other)| match (own, other) {
                (_, None) => true,
                (None, Some(_)) => false,
                (Some(own), Some(other)) => {
                    let mut both = own.iter().flatten().zip(other.iter().flatten());
                    both.all(|(own, other)| *other >= own * (1.0 - ALIKE))
                }
            })
    }

    fn is_alike(&self, other: &Marks) -> bool {
        self.tells(other) && other.tells(self)
    }
}

/// Strengths of the marks of a kind at equal shares of their length; `None` where there are none.
fn strengths(job: &ScanJob, kind: Role) -> Option<[[f64; SHARES]; 2]> {
    let marks = job.vectors.iter().enumerate();
    let marks = marks.filter(|(_, v)| v.kind == kind && v.speed > 0.0);
    let marks: Vec<(f64, f64, f64)> = marks
        .map(|(i, v)| (v.power, v.speed, job.length_of(i)))
        .collect();
    let whole: f64 = marks.iter().map(|m| m.2).sum();
    if whole <= 0.0 {
        return None;
    }
    let sorted = |of: fn(f64, f64) -> f64| {
        let mut all: Vec<(f64, f64)> = marks.iter().map(|m| (of(m.0, m.1), m.2)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut next, mut passed) = (0, all[0].1);
        std::array::from_fn(|k| {
            let wanted = whole * (k as f64 + 0.5) / SHARES as f64;
            while passed < wanted && next + 1 < all.len() {
                next += 1;
                passed += all[next].1;
            }
            all[next].0
        })
    };
    Some([sorted(|p, v| p / v.sqrt()), sorted(|p, v| p / v)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_scan_head::head::vector::Vector;

    /// A layer of a contour of `around` mm and lines of 10 mm, `apart` mm, each with its power.
    fn layer(number: u32, (around, contour): (f64, f64), (apart, fill): (f64, f64)) -> Kind {
        let mark = |kind, x: f64, y: f64, power| Vector {
            kind,
            end: DVec3::new(x, y, 0.0),
            speed: 800.0,
            power,
            wait: 0.0,
            block: 0,
        };
        let mut vectors = vec![mark(Role::Contour, around, 0.0, contour)];
        for line in 0..6 {
            let y = apart * f64::from(line);
            vectors.push(mark(Role::Jump, 0.0, y, 0.0));
            vectors.push(mark(Role::Fill, 10.0, y, fill));
        }
        let prepared = Prepared {
            number,
            ..Prepared::of(ScanJob {
                start: DVec3::ZERO,
                vectors,
            })
        };
        Kind {
            marks: Marks::of(&prepared, 0.04),
            number,
            layers: 1,
        }
    }

    #[test]
    fn one_layer_stands_for_those_that_melt_no_worse() {
        let usual = || layer(1, (3.0, 120.0), (0.1, 200.0));
        // another outline of the same recipe, and one that is drawn harder
        let outline = layer(2, (40.0, 120.0), (0.1, 200.0));
        assert!(usual().marks.is_alike(&outline.marks));
        let harder = layer(3, (3.0, 120.0), (0.08, 260.0));
        assert_eq!(weakest(&[harder, usual()]), (1, None));
        let faint = layer(4, (3.0, 120.0), (0.1, 60.0));
        assert_eq!(weakest(&[usual(), outline, faint]), (4, None));
        // stronger lines, but further apart
        let wide = || layer(5, (3.0, 120.0), (0.14, 260.0));
        let not_told = Some(NotTold {
            first: 5,
            layers: 1,
        });
        assert_eq!(weakest(&[usual(), wide()]), (1, not_told));
        // a contour that the drawn one has not
        let weak = layer(6, (3.0, 70.0), (0.1, 230.0));
        assert_eq!(weakest(&[usual(), weak]).1.map(|n| n.layers), Some(1));
    }
}
