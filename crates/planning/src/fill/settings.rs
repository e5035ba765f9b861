//! What a layer is filled with: strategy, bead width, spacing, starts and directions, as plain values.

use meltpath_geometry::cover::Band;
use meltpath_geometry::offset::Join;
use serde::{Deserialize, Serialize};

use crate::error::PlanError;

/// The direction of parallel lines.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum LineAngle {
    /// Per region, the direction with the fewest lines and cells.
    Best,
    /// `first` on the first layer and `step` more on each further one, rad from the plane's x axis.
    Turning {
        /// Angle on layer 1, rad.
        first: f64,
        /// Added per layer, rad.
        step: f64,
    },
}

/// In which order parallel lines are laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineOrder {
    /// From one side to the other.
    Across,
    /// From the middle line outwards, sides in turn.
    CentreOut,
}

/// In which direction the lines of a raster are travelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineDirection {
    /// All the same, on every layer.
    OneWay,
    /// Each bead against the one before.
    AlternatePerBead,
    /// All the same on one layer, all against it on the next.
    AlternatePerLayer,
}

/// In which order nested contours are laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContourOrder {
    /// The boundary first.
    OutsideIn,
    /// The boundary last.
    InsideOut,
}

/// How a region is filled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Strategy {
    /// Parallel beads, one arc start each.
    Raster {
        /// Direction of the lines.
        angle: LineAngle,
        /// Order of the lines.
        order: LineOrder,
        /// Directions of travel.
        direction: LineDirection,
    },
    /// Parallel beads joined at alternate ends along the boundary.
    Zigzag {
        /// Direction of the lines.
        angle: LineAngle,
    },
    /// Successive offsets of the boundary, joined in one corner.
    Contour {
        /// Order of the contours.
        order: ContourOrder,
    },
    /// One continuous curve from each offset to the next.
    Spiral {
        /// Order of the turns.
        order: ContourOrder,
    },
    /// Contours along the boundary and zigzag inside them.
    Hybrid {
        /// How many contours.
        contours: u32,
        /// Whether the contours come before the zigzag or after it.
        order: ContourOrder,
        /// Direction of the zigzag's lines.
        angle: LineAngle,
    },
    /// Contours along the boundary and, inside them, parallel beads from side to side that each begin anew.
    Rimmed {
        /// How many contours; they come first.
        contours: u32,
        /// Direction of the lines.
        angle: LineAngle,
        /// Directions of travel.
        direction: LineDirection,
    },
}

/// What happens where a width is no whole number of stepovers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spacing {
    /// The distance between beads is adjusted so that they fill the width exactly, as far as the geometry permits.
    Fill,
    /// The stepover is kept as given; what is left uncovered is told.
    Exact,
}

/// Where beads start from layer to layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum StartPoints {
    /// In the same corner on every layer.
    Aligned,
    /// Moved on by the golden section of the contour, or by a corner, on every layer.
    Spread,
    /// Anywhere, from a seed.
    Random {
        /// The seed; it belongs into the provenance.
        seed: u64,
    },
}

/// What happens to directions of travel from layer to layer. A raster has its own [`LineDirection`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LayerDirection {
    /// The same on every layer.
    Same,
    /// Turned round on every other layer, so that start and stop defects do not pile up.
    Alternate,
}

/// Which travel speeds a bead can take at its wire feed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Paces {
    /// The speed of the passes' profile, mm/s: it makes the bead of the settings' width.
    pub nominal: f64,
    /// Slowest speed that still makes a sound bead, as a share of the nominal one; at most 1.
    pub slowest: f64,
    /// Fastest one, as a share of the nominal one; at least 1.
    pub fastest: f64,
}

impl Paces {
    /// Slower by a fifth and up to twice as fast as `nominal`, within the speeds `known` of the bead's map, all mm/s.
    /// At constant wire feed these are beads of 0.7 to 1.1 times the width (width goes about with the root of metal per length), within the range in which bead sections keep their
    /// shape (Rouchon 2022, § 2.3.3: 0.2 to 1.5 m/min).
    pub fn about(nominal: f64, known: (f64, f64)) -> Self {
        Paces {
            nominal,
            slowest: (known.0 / nominal).clamp(0.8, 1.0),
            fastest: (known.1 / nominal).clamp(1.0, 2.0),
        }
    }
}

/// How layers are filled. Lengths in mm; the caller passes the region to cover, allowance included.
///
/// ```
/// let settings = meltpath_planning::FillSettings::new(6.5, 4.8);
/// assert!(settings.check().is_ok());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FillSettings {
    /// The strategy.
    pub strategy: Strategy,
    /// Width of a single bead on the plate, mm.
    pub width: f64,
    /// Wanted distance between neighbouring centre lines, mm.
    pub stepover: f64,
    /// What to do where it does not divide the width.
    pub spacing: Spacing,
    /// Where beads start.
    pub starts: StartPoints,
    /// Directions from layer to layer.
    pub layers: LayerDirection,
    /// Shortest bead that gets an arc of its own, mm.
    pub shortest_bead: f64,
    /// Narrowest section that gets a bead, as a share of the bead width.
    pub narrowest: f64,
    /// Longest way from one bead to the next without an arc stop, mm.
    pub longest_link: f64,
    /// Largest distance between the plan's exact curve and its lines and arcs, mm.
    pub tolerance: f64,
    /// Distance between a contour and the turning points of the zigzag inside it, stepovers.
    pub reversal: f64,
    /// Speeds that beads may take where they have more or less room than a stepover; `None` keeps one speed.
    pub paces: Option<Paces>,
}

/// Direction changes above this angle are corners of the path, rad (20°): no arc is fitted across them, and contours
/// prefer to start there.
pub(super) const CORNER: f64 = 0.349;

impl FillSettings {
    /// Least and greatest stepover, in bead widths: nearer beads pile up, farther ones leave gaps.
    pub const STEPOVERS: [f64; 2] = [0.2, 1.5];

    /// Reversal of a zigzag at one speed, stepovers: the overlap of beads equals what is missing to a flat surface (Nguyen).
    ///
    /// Over two lines of a zigzag, between the contour (x = 0) and a far x = X, the metal is half the contour's section A over 2
    /// stepovers d, two lines of length X − e and one link of length d: `d·A + 2(X − e)·A + d·A`; a surface of the mean height
    /// A/d takes `2·X·A`. Hence e = d, whatever the shape of the section, because deposited metal equals fed metal.
    pub const BALANCED_REVERSAL: f64 = 1.0;

    /// Reversal of a zigzag whose speeds are adapted, stepovers. The balance holds on the mean: between the links it leaves
    /// notches with little metal, which stack from layer to layer. Nearer turning points leave none, and speed takes away part of
    /// what is laid twice. A choice by simulation, not a measured value: piles are single places, and come and go with it.
    ///
    /// | thickest place of a layer above its mean, % | 1 | 0.8 | 0.65 | 0.5 | 0.42 | 0.35 | 0.28 | 0.2 |
    /// |---|---|---|---|---|---|---|---|---|
    /// | plate | 107 | 92 | 76 | 82 | 80 | 112 | 95 | 103 |
    /// | impeller blank | 489 | 164 | 181 | 154 | 162 | 163 | 95 | 93 |
    /// | flange | | | | 164 | 107 | 100 | 96 | 110 |
    /// | cone | | | | 61 | 61 | 105 | 90 | 88 |
    /// | gear | | | | 137 | 125 | 92 | 108 | 104 |
    pub const NEAR_REVERSAL: f64 = 0.28;

    /// Hybrid filling with the defaults for beads of `width` at `stepover`.
    pub fn new(width: f64, stepover: f64) -> Self {
        FillSettings {
            strategy: Strategy::Hybrid {
                contours: 1,
                order: ContourOrder::InsideOut,
                angle: LineAngle::Best,
            },
            width,
            stepover,
            spacing: Spacing::Fill,
            starts: StartPoints::Spread,
            layers: LayerDirection::Alternate,
            shortest_bead: width,
            narrowest: 0.6,
            longest_link: 2.0 * stepover,
            tolerance: 0.02,
            reversal: Self::BALANCED_REVERSAL,
            paces: None,
        }
    }

    /// Whether the values make sense together.
    ///
    /// # Errors
    /// [`PlanError::Setting`] naming the value, its range and the remedy.
    pub fn check(&self) -> Result<(), PlanError> {
        let within = |name, value: f64, low: f64, high: f64| {
            // a NaN lies in no range
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(PlanError::Setting {
                    name,
                    value,
                    low,
                    high,
                })
            }
        };
        within("bead width", self.width, 0.005, 1e3)?;
        within(
            "stepover",
            self.stepover,
            Self::STEPOVERS[0] * self.width,
            Self::STEPOVERS[1] * self.width,
        )?;
        within("shortest bead", self.shortest_bead, 0.0, 1e3 * self.width)?;
        within("narrowest section", self.narrowest, 0.2, 1.0)?;
        within("longest link", self.longest_link, 0.0, 1e3 * self.width)?;
        within("tolerance", self.tolerance, 1e-4, 0.2 * self.width)?;
        within("reversal", self.reversal, 0.0, 2.0)?;
        if let Some(paces) = self.paces {
            within("travel speed", paces.nominal, 1e-3, 1e5)?;
            within("slowest share of the travel speed", paces.slowest, 0.1, 1.0)?;
            within(
                "fastest share of the travel speed",
                paces.fastest,
                1.0,
                10.0,
            )?;
        }
        let angle = match self.strategy {
            Strategy::Raster { angle, .. }
            | Strategy::Zigzag { angle }
            | Strategy::Hybrid { angle, .. }
            | Strategy::Rimmed { angle, .. } => angle,
            Strategy::Contour { .. } | Strategy::Spiral { .. } => LineAngle::Best,
        };
        if let LineAngle::Turning { first, step } = angle {
            within("line angle", first, -1e3, 1e3)?;
            within("line angle per layer", step, -1e3, 1e3)?;
        }
        Ok(())
    }

    /// Sections narrower than twice this radius carry one bead on their centre line, wider ones at least two: half
    /// a width and a quarter of a stepover, where one and two beads miss the section's width equally.
    pub(crate) fn single_radius(&self) -> f64 {
        0.5 * self.width + 0.25 * self.stepover
    }

    /// Least share of a stepover that must lack metal for a bead to be laid there.
    pub(crate) fn least_share(&self) -> f64 {
        self.paces.map_or(0.7, |p| 1.0 / p.fastest)
    }

    /// Distance between a contour and the turning points of the zigzag inside it, mm.
    pub(crate) fn reversal_distance(&self) -> f64 {
        self.reversal * self.stepover
    }

    /// Chords this near to an arc, mm, are taken as its facets: a hundredth of a bead width, below what a robot
    /// repeats and a bead shows, and about the chord error of parts in files of triangles.
    pub(crate) fn facet(&self) -> f64 {
        (0.01 * self.width).max(self.tolerance)
    }

    /// The metal of beads: each as wide as a single one. The plan's own tolerance is no gap.
    pub(crate) fn metal(&self) -> Band {
        Band {
            reach: 0.5 * self.width + self.tolerance,
            arc_tolerance: 2e-3 * self.width,
        }
    }

    /// Arcs at a quarter of the tolerance, so that fitting has room.
    pub(crate) fn join(&self) -> Join {
        Join::Round {
            arc_tolerance: 0.25 * self.tolerance,
        }
    }

    /// The widest distance between beads that still melts together, mm: 0.8 of the width (the top of the range in
    /// practice, Rouchon 2022 §4.1), or the stepover asked for.
    pub(crate) fn widest_spacing(&self) -> f64 {
        (0.8 * self.width).max(1.02 * self.stepover)
    }
}

/// Distance between a contour and the free ends of lines that stop at it, mm: the same balance without the link gives
/// half a stepover.
pub(super) fn end_distance(stepover: f64) -> f64 {
    0.5 * stepover
}
