//! Bodies for parallel lines: where the lines may lie, and how they lie at the best angle, which layers of the same sections share.

use std::sync::OnceLock;

use meltpath_geometry::Region;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::offset::inset;

use crate::fill::direction::{best, turning};
use crate::fill::lines::{Rim, Span, spans};
use crate::fill::outline::{Room, turned};
use crate::fill::settings::{FillSettings, LineAngle};

/// Where parallel lines lie in bodies.
pub(crate) struct Lined {
    rim: Rim,
    /// Where links may run.
    links: Vec<Region>,
    /// Possible centres of beads, a region each, with its lines at the best angle once they are asked for.
    centres: Vec<(Region, OnceLock<Flat>)>,
}

/// Parallel lines along x.
pub(crate) struct Flat {
    /// How far the regions were turned back, rad.
    pub(crate) angle: f64,
    /// The possible centres of beads.
    pub(crate) centres: Vec<Region>,
    /// Where links may run.
    pub(crate) links: Room,
    /// Spans of each line, lines from below.
    pub(crate) lines: Vec<Vec<Span>>,
}

impl Lined {
    /// In `bodies`, with `rim` round them.
    pub(crate) fn new(
        bodies: &[Region],
        rim: Rim,
        settings: &FillSettings,
    ) -> Result<Self, PlanarError> {
        let centres = inset(bodies, 0.5 * settings.width, settings.join())?;
        let links = inset(bodies, 0.48 * settings.width, settings.join())?;
        Ok(Lined {
            rim,
            links,
            centres: centres
                .into_iter()
                .map(|centre| (centre, OnceLock::new()))
                .collect(),
        })
    }

    /// What `make` has of the lines of each region on a layer, in order.
    pub(crate) fn each<T>(
        &self,
        wanted: LineAngle,
        layer: u32,
        settings: &FillSettings,
        mut make: impl FnMut(&Flat) -> T,
    ) -> Vec<T> {
        let centres = self.centres.iter();
        centres
            .map(|(centre, at_best)| {
                let centre = std::slice::from_ref(centre);
                let flat = |angle| self.flat(centre, angle, settings);
                match wanted {
                    LineAngle::Best => make(at_best.get_or_init(|| flat(best(centre, settings)))),
                    LineAngle::Turning { first, step } => make(&flat(turning(first, step, layer))),
                }
            })
            .collect()
    }

    fn flat(&self, centre: &[Region], angle: f64, settings: &FillSettings) -> Flat {
        let centres = turned(centre, -angle);
        let lines = spans(&centres, self.rim, settings);
        Flat {
            angle,
            links: Room::new(&turned(&self.links, -angle)),
            lines,
            centres,
        }
    }
}
