//! What a job asks of a head, found layer by layer before anything moves.

mod pace;

use crate::head::error::HeadError;
use crate::head::prepared::Layers;
use crate::head::ready::ReadyHead;
use crate::head::vector::ScanJob;
use crate::measures::hatch::HatchDistance;
use crate::measures::marks_again::{Again, DrawnMark, MarksAgain};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_toolpath::Role;

use pace::{Mark, too_fast, too_slow};
pub use pace::{OffPace, Paces};

/// A layer in figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerFigures {
    /// Its number.
    pub number: u32,
    /// Its height, mm.
    pub height: f64,
    /// Its vectors.
    pub vectors: u32,
    /// Length of its marks, mm.
    pub marked: f64,
}

/// A mark whose focus is commanded over or below the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raised {
    /// Number of its layer.
    pub layer: u32,
    /// The end of it that lies farther from the plane: x, y and the height of the focus, mm.
    pub at: DVec3,
}

/// What a job asks of a head.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// The first layer.
    pub first: ScanJob,
    /// All layers, first executed first.
    pub layers: Vec<LayerFigures>,
    /// Samples, the one at the start included, without run-out.
    pub samples: u64,
    /// Length of all contours, mm.
    pub contours: f64,
    /// Length of all lines of fills, mm.
    pub fills: f64,
    /// Marks that lie on others of their layer.
    pub again: Again,
    /// The mark whose focus is commanded farthest from the plane.
    pub raised: Option<Raised>,
    /// Marks that are shorter than a sample at their speed: each takes a whole one.
    pub short: u64,
    /// By how much they lengthen the job, s.
    pub lost: f64,
    /// Marks that run otherwise than commanded.
    pub paces: Paces,
    /// The longer side of the box round all marks, mm.
    pub extent: f64,
    /// The median distance of neighbouring parallel lines, mm; none with fewer than two.
    pub hatch: Option<f64>,
}

impl ReadyHead {
    /// Looks through a job, and refuses one that leaves the field.
    ///
    /// # Errors
    /// [`HeadError`].
    pub fn survey(&self, layers: Layers<'_>) -> Result<Survey, HeadError> {
        let period = self.head.period;
        let mut hatch = HatchDistance::default();
        let mut found = Survey {
            first: ScanJob::default(),
            layers: Vec::new(),
            samples: 1,
            contours: 0.0,
            fills: 0.0,
            again: Again::default(),
            raised: None,
            short: 0,
            lost: 0.0,
            paces: Paces::default(),
            extent: 0.0,
            hatch: None,
        };
        let mut around = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for layer in self.checked(layers) {
            let layer = layer?;
            let job = &layer.job;
            let mut marked = 0.0;
            let mut drawn = MarksAgain::new(2.0 * self.head.beam.waist);
            for (i, v) in job.vectors.iter().enumerate() {
                let begin = found.samples as f64 * period;
                let (moving, waiting) = job.samples_of(i, period);
                found.samples = found.samples.saturating_add(moving).saturating_add(waiting);
                let length = job.length_of(i);
                match v.kind {
                    Role::Contour => found.contours += length,
                    Role::Fill => found.fills += length,
                    _ => continue,
                }
                marked += length;
                let ends = [job.start_of(i), v.end];
                let flat = ends.map(DVec3::truncate);
                let speed = v.speed.min(length / (moving.max(1) as f64 * period));
                let mark = DrawnMark {
                    ends: flat,
                    begin,
                    speed,
                    power: v.power,
                };
                drawn.take(mark, |place| found.again.count(layer.number, length, place));
                for at in ends.into_iter().filter(|p| p.z != 0.0) {
                    if found.raised.is_none_or(|r| at.z.abs() > r.at.z.abs()) {
                        let layer = layer.number;
                        found.raised = Some(Raised { layer, at });
                    }
                }
                for end in flat {
                    around = [around[0].min(end), around[1].max(end)];
                }
                let mark = Mark {
                    layer: layer.number,
                    ends,
                    length,
                    speed: v.speed,
                };
                let slowed = match v.kind {
                    Role::Contour => &mut found.paces.slowed_contours,
                    _ => &mut found.paces.slowed_fills,
                };
                slowed.extend(too_slow(&mark, moving, period));
                found.paces.too_fast.extend(too_fast(&mark, self));
                let time = length / v.speed;
                if time > 0.0 && time < period {
                    found.short += 1;
                    found.lost += period - time;
                }
            }
            hatch.take(job);
            found.layers.push(LayerFigures {
                number: layer.number,
                height: layer.height,
                vectors: job.vectors.len() as u32,
                marked,
            });
            if found.layers.len() == 1 {
                found.first = layer.job;
            }
        }
        found.hatch = hatch.median();
        found.extent = (around[1] - around[0]).max_element().max(0.0);
        Ok(found)
    }
}
