//! The solver for whole layers as judge of a beam path: how large a share of the metal meets the aim, and by how much that share
//! moves when cell, step, ground or power do.
//!
//! A share of voxels in a window of 60 K hangs on the tail of a distribution; one that moves by more than [`CONVERGED`] is told as
//! not converged, or not robust where the power moves it (docs/theory/sources.md). It is told on the cells as set. How much of it is owed to them, cells twice as large
//! show; all that moves it besides is looked for on those, where all runs together cost less than the one as set.

mod size;

use meltpath_base::Observer;

use crate::bed::{Body, Domain, EVEN, Reading, Resolution, extent, planes};
use crate::interrupted::{Drawing, Layers};
use crate::layer_heat::LayerHeat;
use crate::part::Rectangle;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::grid::Field;
use meltpath_thermal::levels::{BEND, Ground, Levels, LevelsError, Setup};
use meltpath_thermal::solver::Face;
use meltpath_thermal::solver::ledger::Ledger;
use meltpath_thermal::solver::watch::{Watch, Watched};

use size::coarser;
pub use size::{Bytes, KEPT, bytes};

/// Largest change of a share that is called converged.
pub const CONVERGED: f64 = 0.05;
/// One run of the judge and how it differs from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// As asked.
    Base,
    /// Cells twice as large in the plane.
    TwiceCell,
    /// On these, twice as many planes in a layer.
    MorePlanes,
    /// Half the step.
    HalfStep,
    /// The ground twice as deep.
    Deeper,
    /// And twice as far beside the path.
    Wider,
    /// So many per cent more power, or less where below zero.
    Power(i8),
}

impl Variant {
    /// All, the one as set first, then the one with which the others are compared.
    pub const ALL: [Variant; 12] = [
        Variant::Base,
        Variant::TwiceCell,
        Variant::MorePlanes,
        Variant::HalfStep,
        Variant::Deeper,
        Variant::Wider,
        Variant::Power(-5),
        Variant::Power(5),
        Variant::Power(-1),
        Variant::Power(1),
        Variant::Power(-3),
        Variant::Power(3),
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Variant::Base => "as set",
            Variant::TwiceCell => "twice the cell",
            Variant::MorePlanes => "twice the planes",
            Variant::HalfStep => "half the step",
            Variant::Deeper => "the ground twice as deep",
            Variant::Wider => "the ground twice as wide",
            Variant::Power(-5) => "5 % less power",
            Variant::Power(-3) => "3 % less power",
            Variant::Power(-1) => "1 % less power",
            Variant::Power(1) => "1 % more power",
            Variant::Power(3) => "3 % more power",
            Variant::Power(5) => "5 % more power",
            Variant::Power(_) => "another power",
        }
    }

    /// Whether it changes the power.
    pub fn is_of_power(self) -> bool {
        matches!(self, Variant::Power(_))
    }

    /// The power, as a multiple of that as set.
    pub fn power(self) -> f64 {
        match self {
            Variant::Power(percent) => 1.0 + 0.01 * f64::from(percent),
            _ => 1.0,
        }
    }

    /// Which of [`Variant::ALL`] it is compared with.
    pub fn compared(self) -> usize {
        match self {
            Variant::Base | Variant::TwiceCell => 0,
            _ => 1,
        }
    }
}

impl Resolution {
    /// The resolution of a variant of this one; `step` is the longest step that the one with cells twice as large really took, s.
    #[must_use]
    pub fn of(&self, variant: Variant, step: f64) -> Self {
        let Domain { below, beside } = self.domain;
        let domain = match variant {
            Variant::Deeper => Domain {
                below: 2.0 * below,
                beside,
            },
            Variant::Wider => Domain {
                below,
                beside: 2.0 * beside,
            },
            _ => self.domain,
        };
        let halved = variant == Variant::HalfStep;
        Resolution {
            cell: if variant == Variant::Base {
                self.cell
            } else {
                2.0 * self.cell
            },
            planes: if variant == Variant::MorePlanes {
                2 * self.planes
            } else {
                self.planes
            },
            step: if halved { 0.5 * step } else { self.step },
            domain,
            power: self.power * variant.power(),
        }
    }
}

/// What a run gave.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Highest temperatures of the last layer, K.
    pub highest: Field,
    /// The same where the layer meets the one below, K, in the top plane.
    pub foot: Field,
    /// The longest step of the finest cells, s.
    pub step: f64,
    /// Highest temperatures of the build plane itself, K, one plane.
    pub surface: Field,
    /// What the solver lost of the heat, as a share of what the beam brought.
    pub residual: f64,
    /// Where the heat of the last layer went, and what left as vapour.
    pub ledger: Ledger,
    /// Updates of cells.
    pub updates: u64,
    /// What was seen besides.
    pub watched: Watched,
    /// Every layer, the lowest first; the last one until its path ends.
    pub layers: Vec<LayerHeat>,
}

/// Draws `lower` layers and then `path` on `body`, each on a fresh layer: from the start temperature, or on what those before left
/// warm ([`Body::between`]).
///
/// # Errors
/// [`LevelsError`].
pub fn judge(
    body: &Body<'_>,
    lower: &[BeamPath],
    path: &BeamPath,
    resolution: &Resolution,
    observer: &dyn Observer,
) -> Result<Drawn, LevelsError> {
    let nothing = Watch {
        places: Vec::new(),
        every: f64::INFINITY,
    };
    watched(body, lower, path, resolution, (None, &nothing), observer)
}

/// The same, the finest cells in a rectangle alone where there is one, and with what `watch` asks for.
///
/// # Errors
/// [`LevelsError`].
pub fn watched(
    body: &Body<'_>,
    lower: &[BeamPath],
    path: &BeamPath,
    resolution: &Resolution,
    (focus, watch): (Option<&Rectangle>, &Watch),
    observer: &dyn Observer,
) -> Result<Drawn, LevelsError> {
    let [low, high] = extent(lower.iter().chain([path]));
    let hull = Rectangle { low, high };
    let last = setup(body, &hull, resolution, focus);
    let beam = Beam {
        efficiency: body.beam.efficiency * resolution.power,
        ..*body.beam
    };
    let bare = Layers {
        ground: Ground::from(last.ground(body.material, body.ground)),
        layers: Vec::new(),
    };
    let mut pile = Pile {
        body,
        hull: &hull,
        beam: &beam,
        drawn: bare,
    };
    let kept = body.kept.filter(|_| !lower.is_empty()).map(|kept| {
        let what = (&last, body.material, &beam, body.between);
        let drawing = Drawing::default().with(&what).with(&lower);
        (kept, drawing.with(&pile.drawn.ground))
    });
    let before = kept
        .as_ref()
        .and_then(|(kept, drawing)| kept.last(drawing, lower.len()));
    pile.drawn = before.unwrap_or(pile.drawn);
    let begun = pile.drawn.layers.len();
    for (path, above) in lower.iter().zip((1..=lower.len()).rev()).skip(begun) {
        pile = pile.with(below(&last, body, above), path, observer)?;
        if let Some((kept, drawing)) = &kept {
            kept.keep(drawing, &pile.drawn);
        }
    }
    // the levels count heights from the build plane, the job from that of the first layer
    let top = lower.len() as f64 * body.layer;
    let shifted = |[x, y, z]: [f64; 3], by: f64| [x, y, z + by];
    let watch = Watch {
        places: watch.places.iter().map(|p| shifted(*p, -top)).collect(),
        every: watch.every,
    };
    let before = pile.top();
    let Layers { ground, mut layers } = pile.drawn;
    let mut levels = Levels::on(last, body.material.clone(), ground, body.powder())?;
    let outside = levels.draw(path, &beam, &watch, observer)?;
    let kept = hull.grown(KEPT);
    let kept = [kept.low, kept.high];
    let mut highest = levels.highest_temperature(kept);
    highest.grid.origin.z += top;
    let mut surface = levels.highest_of_surface(kept);
    surface.grid.origin.z += top;
    let outside = outside.iter().map(|p| shifted(*p, top)).collect();
    let mut seen = levels.watched(kept, outside);
    for field in [
        &mut seen.freezing.above,
        &mut seen.freezing.fell,
        &mut seen.freezing.rate,
    ] {
        field.grid.origin.z += top;
    }
    for sample in &mut seen.samples {
        sample.place = shifted(sample.place, top);
    }
    let ledger = *levels.ledger();
    let residual = ledger.residual(levels.stored());
    layers.push(LayerHeat {
        before,
        surface: surface.largest().0,
        ledger,
        residual,
    });
    Ok(Drawn {
        layers,
        residual,
        ledger,
        surface,
        foot: highest.clone().at_depth(body.layer),
        highest: match body.reading {
            Reading::LayerMean => highest.over_layer(body.layer),
            Reading::Depth(depth) => highest.at_depth(depth),
        },
        step: levels.step(),
        updates: levels.updates(),
        watched: seen,
    })
}

/// Layers that are drawn one on the other.
struct Pile<'a> {
    body: &'a Body<'a>,
    hull: &'a Rectangle,
    beam: &'a Beam,
    drawn: Layers,
}

impl Pile<'_> {
    /// Mean and highest temperature of the top within the extent of the paths, K.
    fn top(&self) -> [f64; 2] {
        let middle = [0, 1].map(|a| 0.5 * (self.hull.low[a] + self.hull.high[a]));
        let inside = |point: [f64; 2]| self.hull.depth(point) >= 0.0;
        self.drawn
            .ground
            .top(self.body.material.start, middle, &inside)
    }

    /// Draws the next layer and lets it cool.
    fn with(
        self,
        setup: Setup,
        path: &BeamPath,
        observer: &dyn Observer,
    ) -> Result<Self, LevelsError> {
        let before = self.top();
        let material = self.body.material.clone();
        let mut levels = Levels::on(setup, material, self.drawn.ground, self.body.powder())?;
        let nothing = Watch {
            places: Vec::new(),
            every: f64::INFINITY,
        };
        levels.draw(path, self.beam, &nothing, observer)?;
        let kept = self.hull.grown(KEPT);
        let surface = levels.highest_of_surface([kept.low, kept.high]);
        let ((ledger, stored), ground) = if let Some(between) = self.body.between {
            let (left, cooled) = levels.leave(between.time, observer)?;
            ((cooled.ledger, cooled.stored), left)
        } else {
            let drawn = (*levels.ledger(), levels.stored());
            (drawn, Ground::from(levels.into_matter()))
        };
        let mut layers = self.drawn.layers;
        layers.push(LayerHeat {
            before,
            surface: surface.largest().0,
            ledger,
            residual: ledger.residual(stored),
        });
        let drawn = Layers { ground, layers };
        Ok(Pile { drawn, ..self })
    }
}

impl Body<'_> {
    /// Temperature of fresh powder, K.
    fn powder(&self) -> f64 {
        self.between
            .map_or(self.material.start, |between| between.powder)
    }
}

/// Cells for a layer with `above` more to come on it: a plate from which nothing flows is thinner by these.
fn below(last: &Setup, body: &Body<'_>, above: usize) -> Setup {
    if body.between.is_none() || body.beyond != Face::Insulated {
        return last.clone();
    }
    let depth: f64 = last.heights.iter().sum();
    let height = last.heights.last().copied().unwrap_or(body.layer);
    let depth = (depth - above as f64 * body.layer).max(body.layer);
    Setup {
        heights: planes(body.layer, height, depth),
        tracked: last.tracked.min(depth),
        ..last.clone()
    }
}

/// Cells for paths in `hull`.
fn setup(
    body: &Body<'_>,
    hull: &Rectangle,
    resolution: &Resolution,
    focus: Option<&Rectangle>,
) -> Setup {
    let Domain { below, beside } = resolution.domain;
    let covered = hull.grown(beside);
    let height = body.layer / f64::from(resolution.planes.max(1));
    let depth = ((below / body.layer - 1e-6).ceil() * body.layer).max(body.layer);
    Setup {
        covered: [covered.low, covered.high],
        cell: resolution.cell,
        coarser: coarser(resolution, body.between.is_some()),
        heights: planes(body.layer, height, depth),
        layer: body.layer,
        tracked: ((EVEN / body.layer).ceil() * body.layer).min(depth),
        top: body.surface,
        beyond: body.beyond,
        step: resolution.step,
        focus: focus.map(|f| [f.low, f.high]),
        bend: BEND,
    }
}

/// A share, or another figure, as set and with each change.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// The share as set.
    pub value: f64,
    /// Changes of it, in the order of the variants after the first.
    pub changes: Vec<(Variant, f64)>,
}

impl Share {
    /// The largest change, whichever way.
    pub fn spread(&self) -> f64 {
        self.changes
            .iter()
            .map(|(_, c)| c.abs())
            .fold(0.0, f64::max)
    }

    /// Whether nothing numerical moves it by more than [`CONVERGED`].
    pub fn converged(&self) -> bool {
        self.numerical().within(CONVERGED)
    }

    /// Whether no change of the power moves it by more than [`CONVERGED`].
    pub fn robust(&self) -> bool {
        self.of_power().within(CONVERGED)
    }

    /// What cell, step, planes and ground change: whether the model is solved.
    #[must_use]
    pub fn numerical(&self) -> Self {
        self.moved_by(|variant| !variant.is_of_power())
    }

    /// What the power changes: whether a machine that drifts still does as the model says.
    #[must_use]
    pub fn of_power(&self) -> Self {
        self.moved_by(Variant::is_of_power)
    }

    fn moved_by(&self, kept: impl Fn(Variant) -> bool) -> Self {
        let changes = self.changes.iter().copied();
        Share {
            value: self.value,
            changes: changes.filter(|(variant, _)| kept(*variant)).collect(),
        }
    }

    /// Whether there are changes and none moves it by more than `most`.
    pub fn within(&self, most: f64) -> bool {
        // a change that cannot be told is none that is small
        let small = |(_, change): &(Variant, f64)| change.abs() <= most * (1.0 + 1e-9);
        !self.changes.is_empty() && self.changes.iter().all(small)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variant_has_words_of_its_own() {
        let words: std::collections::BTreeSet<&str> = Variant::ALL.map(Variant::words).into();
        assert!(words.len() == Variant::ALL.len() && !words.contains(""));
    }

    #[test]
    fn a_share_that_moves_by_more_than_five_points_is_not_converged() {
        let share = |change: f64| Share {
            value: 0.5,
            changes: vec![(Variant::TwiceCell, 0.01), (Variant::Power(-5), -change)],
        };
        assert!(share(0.049).robust() && share(0.049).converged());
        // the power moves it, not what the model is solved with
        assert!(!share(0.051).robust() && share(0.051).converged());
        let coarse = Share {
            changes: vec![(Variant::TwiceCell, 0.051), (Variant::Power(-5), 0.01)],
            ..share(0.0)
        };
        assert!(coarse.robust() && !coarse.converged());
        assert!((share(0.3).spread() - 0.3).abs() < 1e-12);
        assert!(!share(f64::NAN).robust());
        // one run alone shows nothing
        let alone = Share {
            changes: Vec::new(),
            ..share(0.0)
        };
        assert!(!alone.converged());
    }

    #[test]
    fn variants_change_one_thing_each() {
        let base = Resolution {
            cell: 0.06,
            planes: 1,
            step: 4e-6,
            domain: Domain::NARROW,
            power: 1.0,
        };
        assert_eq!(base.of(Variant::Base, 3e-6), base);
        let twice = base.of(Variant::TwiceCell, 3e-6);
        assert_eq!((twice.cell, twice.planes), (0.12, 1));
        let more = base.of(Variant::MorePlanes, 3e-6);
        assert_eq!((more.cell, more.planes), (0.12, 2));
        let [deeper, wider] = [Variant::Deeper, Variant::Wider].map(|v| base.of(v, 3e-6).domain);
        assert_eq!((deeper.below, deeper.beside), (1.0, 0.5));
        assert_eq!((wider.below, wider.beside), (0.5, 1.0));
        // half of the step that was taken, which stability may have shortened
        assert_eq!(base.of(Variant::HalfStep, 3e-6).step, 1.5e-6);
        assert_eq!(base.of(Variant::Power(5), 3e-6).power, 1.05);
        // every one but the first differs from the one it is compared with
        for variant in &Variant::ALL[1..] {
            let other = base.of(Variant::ALL[variant.compared()], 3e-6);
            assert_ne!(base.of(*variant, 3e-6), other, "{variant:?}");
        }
    }
}
