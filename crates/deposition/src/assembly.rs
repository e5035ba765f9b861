//! Assembly of beads in a cross-section by polynomials of degree two: a fast second opinion on the deposit, and the growth
//! per layer that a stacking makes.
//!
//! Each bead is a parabola that keeps the area of the single bead on a plate. Beside other beads it passes through the two
//! points where the profile leaves the circle of half a bead width round its programmed place; as the first of a layer it
//! keeps the shape of the single bead; at a free edge it ends on the vertical over the edge of the first layer. Source:
//! Rouchon 2022, §4.2.4, §4.4, hypotheses of fig. 4.36, 4.37, 4.39. Closed form, guards and the treatment of a parabola that
//! would dip under the profile are ours.
//!
//! Validity: plane cross-sections of straight beads; no sagging edges (they are vertical), no feedback of the source. The
//! thesis itself sees it degenerate at the second-to-last bead of high walls: [`Guard`] detects it.

mod profile;

pub use profile::Profile;

use meltpath_numerics::halving;
use serde::{Deserialize, Serialize};

use crate::section::Section;

/// What the model starts from; mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AssemblyBead {
    /// Width of the single bead on a plate.
    pub width: f64,
    /// Its height.
    pub height: f64,
}

impl AssemblyBead {
    /// Its section, mm².
    pub fn area(&self) -> f64 {
        Section::Parabola.area(self.width, self.height)
    }

    fn curvature(&self) -> f64 {
        4.0 * self.height / (self.width * self.width)
    }
}

/// When a bead of the model is not one that can exist; a bead that is refused keeps the shape of the single bead instead.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Guard {
    /// Least distance of the two points it passes through, bead widths.
    pub least_span: f64,
    /// Greatest height over the layer below, bead heights.
    pub greatest_height: f64,
}

impl Default for Guard {
    fn default() -> Self {
        Guard {
            least_span: 0.3,
            greatest_height: 1.5,
        }
    }
}

/// Settings of an assembly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AssemblySettings {
    /// Width between the free edges over what the beads of the first layer span: 1 for walls of several beads, 0.9 for single
    /// ones (Rouchon 2022, fig. 4.39).
    pub wall_ratio: f64,
    /// When beads are refused; `None`: never, as in the thesis. Then a bead that degenerates no longer keeps its area.
    pub guard: Option<Guard>,
    /// Distance between the heights of the profile, mm.
    pub step: f64,
}

impl AssemblySettings {
    /// For walls of `beads` beads across.
    pub fn for_beads(beads: usize) -> Self {
        AssemblySettings {
            wall_ratio: if beads == 1 { 0.9 } else { 1.0 },
            guard: Some(Guard::default()),
            step: 0.005,
        }
    }
}

/// How one bead came to lie.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AssembledBead {
    /// Programmed abscissa, mm.
    pub centre: f64,
    /// Highest point of the bead, mm over the plate.
    pub apex: f64,
    /// The guard refused the bead of the model.
    pub degenerate: bool,
}

/// Why an assembly cannot start.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AssemblyError {
    /// A size that must be positive and finite is not.
    #[error("assembly of beads: {what} is {value}, it must be a positive finite number")]
    Size {
        /// Which size.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// No beads, or a place that is not finite.
    #[error("assembly of beads: a layer needs one bead or more, at finite places")]
    Beads,
}

/// A growing cross-section.
///
/// ```
/// use meltpath_deposition::assembly::{Assembly, AssemblyBead, AssemblySettings};
/// let bead = AssemblyBead { width: 7.0, height: 2.0 };
/// let mut wall = Assembly::new(bead, &[0.0], AssemblySettings::for_beads(1)).unwrap();
/// let first = wall.layer(&[0.0]);
/// let second = wall.layer(&[0.0]);
/// // a single-bead wall grows by A/(0.9 w)
/// assert!((second[0].apex - first[0].apex - bead.area() / 6.3).abs() < 1e-3);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Assembly {
    bead: AssemblyBead,
    settings: AssemblySettings,
    /// Leftmost and rightmost bead.
    extremes: (f64, f64),
    profile: Profile,
    below: Profile,
    layers: u32,
}

impl Assembly {
    /// An empty plate for beads at `centres` (mm, any order): the free edges stand half a bead outside the extreme ones.
    ///
    /// # Errors
    /// [`AssemblyError`] for sizes that are not positive, or no beads.
    pub fn new(
        bead: AssemblyBead,
        centres: &[f64],
        settings: AssemblySettings,
    ) -> Result<Self, AssemblyError> {
        let mut sizes = vec![
            ("the bead's width", bead.width),
            ("the bead's height", bead.height),
            ("the wall ratio", settings.wall_ratio),
            ("the step of the profile", settings.step),
        ];
        if let Some(guard) = settings.guard {
            sizes.push(("the guard's least span", guard.least_span));
            sizes.push(("the guard's greatest height", guard.greatest_height));
        }
        for (what, value) in sizes {
            if !(value.is_finite() && value > 0.0) {
                return Err(AssemblyError::Size { what, value });
            }
        }
        if centres.is_empty() || centres.iter().any(|c| !c.is_finite()) {
            return Err(AssemblyError::Beads);
        }
        let left = centres.iter().copied().fold(f64::MAX, f64::min);
        let right = centres.iter().copied().fold(f64::MIN, f64::max);
        let half = 0.5 * bead.width;
        let profile = Profile::flat(left - half, right + half, settings.step);
        Ok(Assembly {
            bead,
            settings,
            extremes: (left, right),
            below: profile.clone(),
            profile,
            layers: 0,
        })
    }

    /// The surface as it is now.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Lays one layer of beads in the order given; their places must lie among those the assembly was made for.
    pub fn layer(&mut self, order: &[f64]) -> Vec<AssembledBead> {
        self.below = self.profile.clone();
        self.layers += 1;
        let mut laid: Vec<AssembledBead> = Vec::with_capacity(order.len());
        for &place in order {
            let centre = place.clamp(self.extremes.0, self.extremes.1);
            let near = |other: f64| (other - centre).abs() <= self.bead.width;
            let left = laid.iter().any(|b| b.centre < centre && near(b.centre));
            let right = laid.iter().any(|b| b.centre > centre && near(b.centre));
            // on the plate there is no layer below to keep the shape of: the circle meets the plate at the bead's own feet
            let stacked = self.layers > 1 && !(left || right);
            let piece = if stacked { None } else { self.beside(centre) };
            let degenerate = piece.is_none() && !stacked;
            let piece = piece.unwrap_or_else(|| self.on_top(centre));
            let apex = self.put(&piece);
            laid.push(AssembledBead {
                centre,
                apex,
                degenerate,
            });
        }
        laid
    }

    /// First and last height between the free edges.
    fn edges(&self) -> (usize, usize) {
        let half = 0.5 * self.bead.width * self.settings.wall_ratio;
        let first = self.profile.index(self.extremes.0 - half);
        let last = self.profile.index(self.extremes.1 + half);
        (first, last)
    }

    /// Where the profile leaves the circle round the programmed place, walking from there by `way`; stops at the edge.
    fn exit(&self, centre: f64, way: isize) -> usize {
        let z0 = self.below.height(centre);
        let reach = 0.5 * self.bead.width;
        let mut i = self.profile.index(centre);
        while let Some(next) = i
            .checked_add_signed(way)
            .filter(|n| *n < self.profile.z.len())
        {
            let (x, z) = (self.profile.x(next), self.profile.z[next]);
            if (x - centre).hypot(z - z0) > reach * (1.0 + 1e-9) {
                break;
            }
            i = next;
        }
        i
    }

    /// A bead through two known points (juxtaposition; at a free edge, the last bead of a layer). `None` where the guard
    /// refuses it.
    fn beside(&self, centre: f64) -> Option<Piece> {
        let (left_edge, right_edge) = self.edges();
        let over_edge = self.layers > 1;
        let end = |bead: f64, edge: usize, way: isize| {
            if over_edge && centre == bead {
                (edge, self.below.height(centre))
            } else {
                let i = self.exit(centre, way);
                (i, self.profile.z[i])
            }
        };
        let (i1, y1) = end(self.extremes.0, left_edge, -1);
        let (i2, y2) = end(self.extremes.1, right_edge, 1);
        let (x1, x2) = (self.profile.x(i1), self.profile.x(i2));
        let span = x2 - x1;
        let least = self
            .settings
            .guard
            .map_or(0.0, |g| g.least_span * self.bead.width);
        if span <= least || i2 < i1 + 4 {
            return None;
        }
        let chord = |x: f64| y1 + (y2 - y1) * (x - x1) / span;
        let shape = |bulge: f64| {
            let z = (i1..=i2).map(|i| {
                let x = self.profile.x(i);
                chord(x) + bulge * (x - x1) * (x2 - x)
            });
            Piece {
                first: i1,
                z: z.collect(),
            }
        };
        let area = self.bead.area();
        let under = self.profile.area_between(i1, i2);
        // the area of chord and parabola is that of the bead and of what it lies on
        let closed = 6.0 * (area + under - 0.5 * (y1 + y2) * span) / span.powi(3);
        let mut piece = shape(closed);
        if !self.clears(&piece) {
            // it would dip under the profile: only what stands over it counts
            let least = -1.0 / self.bead.width - 10.0 * closed.abs();
            let most = closed.abs() + 6.0 * area / span.powi(3);
            piece = shape(self.balance((least, most), shape));
        }
        let too_high = |g: Guard| {
            let over = piece
                .z
                .iter()
                .enumerate()
                .map(|(j, z)| z - self.below.z[i1 + j]);
            over.fold(f64::MIN, f64::max) > g.greatest_height * self.bead.height
        };
        // over a free edge the layer below stands lower: there the limit holds from its height at the bead's place
        let at_edge = over_edge && (centre == self.extremes.0 || centre == self.extremes.1);
        let reference = self.below.height(centre);
        let refused = self.settings.guard.is_some_and(|g| {
            if at_edge {
                let top = piece.z.iter().copied().fold(f64::MIN, f64::max);
                top - reference > g.greatest_height * self.bead.height
            } else {
                too_high(g)
            }
        });
        (!refused).then_some(piece)
    }

    /// A bead of the shape of the single one, as high as its area asks, between the free edges (stacking).
    fn on_top(&self, centre: f64) -> Piece {
        let (left_edge, right_edge) = self.edges();
        let k = self.bead.curvature();
        let at = self.profile.index(centre);
        let free = (centre == self.extremes.0, centre == self.extremes.1);
        let cap = |top: f64, i: usize| top - k * (self.profile.x(i) - centre).powi(2);
        let shape = |top: f64| {
            let cap = |i: usize| cap(top, i);
            let stands = |i: usize| cap(i) > self.profile.z[i];
            let mut first = at;
            while first > left_edge && (free.0 || stands(first - 1)) {
                first -= 1;
            }
            let mut last = at;
            while last < right_edge && (free.1 || stands(last + 1)) {
                last += 1;
            }
            Piece {
                first,
                z: (first..=last).map(cap).collect(),
            }
        };
        // beside a steep slope the cap may stand lower than the ground at its own place
        let highest = self.profile.z.iter().copied().fold(f64::MIN, f64::max);
        let ground = self.profile.z[at];
        let most = highest + 4.0 * self.bead.height + self.bead.area() / self.settings.step;
        let bounds = (ground - 10.0 * self.bead.height, most);
        let piece = shape(self.balance(bounds, shape));
        if (self.added(&piece) / self.bead.area() - 1.0).abs() < 1e-6 {
            return piece;
        }
        // on a crest sharper than itself, or about to spill over one: then it takes what is low within its own width
        let half = 0.5 * self.bead.width;
        let first = self.profile.index(centre - half).max(left_edge);
        let last = self.profile.index(centre + half).min(right_edge);
        let own_width = |top: f64| Piece {
            first,
            z: (first..=last).map(|i| cap(top, i)).collect(),
        };
        own_width(self.balance(bounds, own_width))
    }

    /// Whether a piece stands on or over the profile everywhere.
    fn clears(&self, piece: &Piece) -> bool {
        let ground = &self.profile.z[piece.first..piece.first + piece.z.len()];
        piece.z.iter().zip(ground).all(|(z, g)| *z >= g - 1e-9)
    }

    /// The parameter at which a shape that rises with it adds the area of the bead over the profile.
    fn balance(&self, bounds: (f64, f64), shape: impl Fn(f64) -> Piece) -> f64 {
        let area = self.bead.area();
        halving::root(bounds.into(), 80, |x| self.added(&shape(x)) > area)
    }

    /// Area that a piece adds over the profile, mm².
    fn added(&self, piece: &Piece) -> f64 {
        let ground = &self.profile.z[piece.first..piece.first + piece.z.len()];
        let over: Vec<f64> = piece
            .z
            .iter()
            .zip(ground)
            .map(|(z, g)| (z - g).max(0.0))
            .collect();
        let ends = over.first().copied().unwrap_or(0.0) + over.last().copied().unwrap_or(0.0);
        self.profile.step * (over.iter().sum::<f64>() - 0.5 * ends)
    }

    /// Lays a piece; the profile keeps its upper envelope. Returns the highest point of the piece.
    fn put(&mut self, piece: &Piece) -> f64 {
        let mut apex = f64::MIN;
        let ground = &mut self.profile.z[piece.first..piece.first + piece.z.len()];
        for (g, z) in ground.iter_mut().zip(&piece.z) {
            *g = g.max(*z);
            apex = apex.max(*z);
        }
        apex
    }
}

/// A new bead: heights from height number `first` of the profile on.
struct Piece {
    first: usize,
    z: Vec<f64>,
}

/// What an assembly of equal layers grows to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Growth {
    /// Growth per layer inside, after the first layer, mm: what to program as the height of layers.
    pub layer: f64,
    /// How much lower the lower of the two edge beads lies than the middle after the last layer, mm.
    pub edge_lag: f64,
    /// First layer in which the guard refused a bead, counted from 1.
    pub degenerate: Option<u32>,
}

/// Growth of `layers` layers of `beads` beads `stepover` mm apart, laid from one side to the other.
///
/// ```
/// use meltpath_deposition::assembly::{AssemblyBead, growth};
/// let bead = AssemblyBead { width: 7.0, height: 2.0 };
/// let wall = growth(bead, 6, 4.62, 5).unwrap();
/// assert!((wall.layer - 2.02).abs() < 0.03 && wall.edge_lag > 1.0);
/// ```
///
/// # Errors
/// [`AssemblyError`] for sizes that are not positive, or no beads or layers.
pub fn growth(
    bead: AssemblyBead,
    beads: usize,
    stepover: f64,
    layers: u32,
) -> Result<Growth, AssemblyError> {
    if !(stepover.is_finite() && stepover > 0.0) {
        return Err(AssemblyError::Size {
            what: "the stepover",
            value: stepover,
        });
    }
    let half = 0.5 * (beads as f64 - 1.0);
    let centres: Vec<f64> = (0..beads).map(|i| stepover * (i as f64 - half)).collect();
    let mut wall = Assembly::new(bead, &centres, AssemblySettings::for_beads(beads))?;
    let mut degenerate = None;
    let mut first = 0.0;
    // mean height over one stepover in the middle, where the edges do not reach
    let middle = |p: &Profile| {
        let (from, to) = (p.index(-0.5 * stepover), p.index(0.5 * stepover));
        p.area_between(from, to) / (p.x(to) - p.x(from))
    };
    for n in 1..=layers {
        let laid = wall.layer(&centres);
        if degenerate.is_none() && laid.iter().any(|b| b.degenerate) {
            degenerate = Some(n);
        }
        if n == 1 {
            first = middle(wall.profile());
        }
    }
    let profile = wall.profile();
    let top = middle(profile);
    let edge = |c: Option<&f64>| c.map_or(top, |c| profile.height(*c));
    let lower = edge(centres.first()).min(edge(centres.last()));
    Ok(Growth {
        layer: (top - first) / f64::from(layers.saturating_sub(1).max(1)),
        edge_lag: top - lower,
        degenerate,
    })
}
