//! The laser hatch of a job: layers of a part as a laser marks them, cut, hatched and laid into the field, one in memory at a time.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use meltpath_base::number::significant;
use meltpath_base::settings::Problem;
use meltpath_base::{Length, Observer, Provenance, Reporter};
use meltpath_geometry::Region;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, inset};
use meltpath_planning::powder::{Hatch, HatchError, Pattern, Turns};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::job::Planned;
use meltpath_scan_head::measures::outline::{Boundary, Outlines, Within};
use meltpath_toolpath::Layer;

use crate::job::lpbf::{HatchTable, LaserHatch, LpbfJob};
use crate::stages::part;
use crate::stages::section::{Cut, sections};

/// Greatest distance between an arc and the lines in its place, mm: below the encoder of any head.
const CHORD_ERROR: f64 = 5e-4;

/// Layers of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// What is filled in each layer, the lowest first, in the field.
    drawn: Vec<Vec<Region>>,
    hatch: Hatch,
    /// The number of the lowest, from 1 on the plate.
    lowest: u32,
    /// The only one, planned.
    only: Option<Layer>,
    /// How many are executed, and how many the part has.
    pub(in crate::lpbf) counts: [usize; 2],
    /// The numbers of the first and the last one.
    pub(in crate::lpbf) numbers: [u32; 2],
}

impl Section {
    /// Cuts and plans what a job asks of the part in `file`; `spacing` is the head's own hatch distance.
    ///
    /// # Errors
    /// [`Problem`] with the place in the job.
    pub(in crate::lpbf) fn of(
        job: &LpbfJob,
        (file, spacing): (&Path, f64),
        (reporter, observer): (&Reporter, &dyn Observer),
        r: &mut Provenance,
    ) -> Result<Self, Problem> {
        let table = &job.section;
        let cut = Cut {
            height: table.height.map(|h| h.0),
            island: *table.island,
            scaling: table.scaling.map(|s| s.0),
            layer: table.layer.0,
            layers: *table.layers,
        };
        let up = DVec3::from_array(job.build_direction.0);
        let chord = 0.1 * cut.layer;
        let part = part::load(file, *job.part_unit, up, chord, reporter, observer)
            .map_err(|e| job.part.problem(e.to_string()))?;
        let found = sections(&part.mesh, &cut, reporter, observer)
            .map_err(|e| e.told([&table.height.span, &table.island.span, &job.part.span]))?;
        let mut drawn = found.drawn;
        let middle = middle(drawn.last().map_or(&[][..], Vec::as_slice));
        let origin = table.origin.or_computed(r, middle.to_array().map(Length));
        let origin = DVec2::from_array(origin.map(|l| l.0));
        for region in drawn.iter_mut().flatten() {
            let rings = std::iter::once(&mut region.outer).chain(&mut region.holes);
            rings.flatten().for_each(|p| *p -= origin);
        }
        let number = found.number;
        let lowest = number + 1 - drawn.len() as u32;
        let mut section = Section {
            counts: [drawn.len(), found.of as usize],
            numbers: [lowest, number],
            lowest,
            hatch: hatch(&job.hatch, cut.layer, spacing, r),
            only: None,
            drawn,
        };
        // each is planned once, for what is to be said of it
        for k in 0..section.drawn.len() {
            observer
                .check()
                .map_err(|c| job.part.problem(c.to_string()))?;
            let layer = section.layer(k, reporter).map_err(|e| {
                let message = format!("layer {}: {e}", section.lowest + k as u32);
                let table = &job.hatch;
                let at = table.spacing.span.clone().or_else(|| table.span.clone());
                Problem::new(message)
                    .at(at.or_else(|| job.part.span.clone()))
                    .help("a smaller hatch.spacing, or another section.height")
            })?;
            section.only = (section.drawn.len() == 1).then_some(layer);
        }
        section.tell_of_contours(reporter);
        Ok(section)
    }

    /// Warns of areas that have no room for as many contours as are asked for: the innermost lies half a hatch distance, and a whole one
    /// for each before it, inside.
    fn tell_of_contours(&self, reporter: &Reporter) {
        let (count, spacing) = (self.hatch.contours, self.hatch.spacing);
        if count == 0 {
            return;
        }
        let deepest = spacing * (f64::from(count) - 0.5);
        let areas: Vec<&Region> = self.drawn.iter().flatten().collect();
        let round = Join::Round {
            arc_tolerance: CHORD_ERROR,
        };
        let lacks = |area: &&&Region| {
            let left = inset(std::slice::from_ref(**area), deepest, round);
            left.is_ok_and(|left| left.is_empty())
        };
        let lacking = areas.iter().filter(lacks).count();
        if lacking == 0 {
            return;
        }
        let contours = if count == 1 {
            "the contour of hatch.contours".to_owned()
        } else {
            format!("{count} contours (hatch.contours)")
        };
        reporter.warn(
            "contours-left-out",
            format!(
                "{lacking} of {} areas of all layers have no room for {contours}, the innermost {} mm inside: what has none is left out",
                areas.len(),
                significant(deepest, 3)
            ),
            "a smaller hatch.spacing, which is the distance of contours, too, or fewer contours",
        );
    }

    /// The outlines of what is filled, by the number of the layer.
    pub(in crate::lpbf) fn outlines(&self) -> Outlines {
        let bound = |ring: &Vec<DVec2>, within| Boundary {
            ring: ring.clone(),
            within,
        };
        let rings = |areas: &Vec<Region>| -> Vec<Boundary> {
            let outer = areas.iter().map(|a| bound(&a.outer, Within::Area));
            let holes = areas.iter().flat_map(|a| &a.holes);
            outer
                .chain(holes.map(|hole| bound(hole, Within::Hole)))
                .collect()
        };
        let layers = (self.lowest..).zip(&self.drawn);
        Outlines::Known(Arc::new(
            layers.map(|(n, areas)| (n, rings(areas))).collect(),
        ))
    }

    /// The hatch distance, mm.
    pub(in crate::lpbf) fn spacing(&self) -> f64 {
        self.hatch.spacing
    }

    fn layer(&self, k: usize, reporter: &Reporter) -> Result<Layer, HatchError> {
        let path = self
            .hatch
            .toolpath(&self.drawn[k], k as u32 + 1, reporter)?;
        let mut layer = path.layers.into_iter().next().unwrap_or_default();
        layer.number = self.lowest + k as u32;
        layer.height = f64::from(layer.number) * self.hatch.layer;
        Ok(layer)
    }

    /// The layers, the lowest first.
    pub(in crate::lpbf) fn layers(&self) -> Planned<'_> {
        if let Some(only) = &self.only {
            return Box::new(std::iter::once(Ok(Cow::Borrowed(only))));
        }
        Box::new((0..self.drawn.len()).map(|k| {
            let layer = self.layer(k, &Reporter::new());
            layer
                .map(Cow::Owned)
                .map_err(|e| HeadError::Layer(e.to_string()))
        }))
    }
}

/// The middle of the box round some areas, mm.
fn middle(regions: &[Region]) -> DVec2 {
    let mut points = regions.iter().flat_map(|r| &r.outer).copied();
    let first = points.next().unwrap_or_default();
    let (low, high) = points.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
    low.midpoint(high)
}

/// The hatch of a job's table for layers `layer` mm thick: speeds and powers are the recipe's.
fn hatch(table: &HatchTable, layer: f64, spacing: f64, r: &mut Provenance) -> Hatch {
    let contours = match *table.strategy {
        LaserHatch::Lines | LaserHatch::OneWay => 1,
        LaserHatch::Islands => 0,
    };
    Hatch {
        pattern: match *table.strategy {
            LaserHatch::Lines => Pattern::Lines,
            LaserHatch::OneWay => Pattern::OneWay,
            LaserHatch::Islands => Pattern::Islands,
        },
        turns: Turns::Apart,
        spacing: table.spacing.or_computed(r, Length(spacing)).0,
        angles: [table.angle.0, table.turn.0],
        contours: table.contours.or_computed(r, contours),
        overrun: 0.0,
        island: table.island.0,
        speed: 0.0,
        dwell: 0.0,
        power: 0.0,
        spot: 0.0,
        layer,
        chord_error: CHORD_ERROR,
        modulation: None,
    }
}
