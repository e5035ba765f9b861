//! A head made ready: focus fitted, table computed, jobs checked against it.

use crate::axis::friction::Drag;
use crate::head::error::HeadError;
use crate::head::prepared::{Layers, Prepared};
use crate::head::scan_head::{LETTERS, ScanHead};
use crate::head::vector::ScanJobError;
use crate::optics::correction::{CorrectionError, CorrectionTable};
use crate::optics::focus::Focus;
use crate::optics::geometry::GeometryError;
use crate::servo::preview::Previews;
use meltpath_geometry::math::{DVec2, DVec3};
use std::collections::VecDeque;

/// A head made ready: focus fitted, table computed, everything checked.
#[derive(Debug, Clone)]
pub struct ReadyHead {
    pub(super) head: ScanHead,
    pub(super) focus: Option<Focus>,
    inverse: Inverse,
    pub(super) previews: Option<Previews>,
}

#[derive(Debug, Clone)]
enum Inverse {
    Table(CorrectionTable),
    Exact { travel: DVec2 },
}

impl ReadyHead {
    /// The head.
    pub fn head(&self) -> &ScanHead {
        &self.head
    }

    /// The fitted focus.
    pub fn focus(&self) -> Option<&Focus> {
        self.focus.as_ref()
    }

    /// Refuses a head of which an axis is unstable.
    ///
    /// # Errors
    /// [`HeadError::Axis`].
    pub fn check_stable(&self) -> Result<(), HeadError> {
        for (axis, letter) in self.head.axes().zip(LETTERS) {
            axis.check_stable(self.head.period)
                .map_err(|source| HeadError::Axis {
                    axis: letter,
                    source,
                })?;
        }
        Ok(())
    }

    /// The same head with the set-points of its mirrors shaped, the path ahead being known.
    #[must_use]
    pub fn with_previews(mut self, previews: Previews) -> Self {
        self.previews = Some(previews);
        self
    }

    /// The same head with other friction on X, Y and Z, as [`ScanHead::held_by`]; its controllers and previews know nothing of it.
    ///
    /// # Errors
    /// [`HeadError::Axis`] where a friction is unsound.
    pub fn held_by(mut self, drags: [Option<Drag>; 3]) -> Result<Self, HeadError> {
        self.head = self.head.held_by(drags);
        self.head.check_axes()?;
        Ok(self)
    }

    /// The largest changes of each mirror's speed, rad/s, that the commands of a job ask for within `window` s.
    ///
    /// # Errors
    /// [`HeadError`] of a layer that cannot be had.
    pub fn speed_changes(&self, layers: Layers<'_>, window: f64) -> Result<[f64; 2], HeadError> {
        let period = self.head.period;
        // speeds of the last `window`, each with the sample at which it ends
        let mut recent: VecDeque<(f64, DVec2)> = VecDeque::from([(0.0, DVec2::ZERO)]);
        let mut largest = DVec2::ZERO;
        let mut note = |begin: f64, end: f64, speed: DVec2| {
            while recent
                .front()
                .is_some_and(|r| r.0 + window / period < begin)
            {
                recent.pop_front();
            }
            for (_, before) in &recent {
                largest = largest.max((speed - before).abs());
            }
            recent.push_back((end, speed));
        };
        let mut at = 0.0;
        for layer in layers {
            let job = layer?.job;
            let mut from = self.angles(job.start).truncate();
            for (index, v) in job.vectors.iter().enumerate() {
                let to = self.angles(v.end).truncate();
                let (moving, waiting) = job.samples_of(index, period);
                let (moving, waiting) = (moving as f64, waiting as f64);
                if moving > 0.0 {
                    note(at, at + moving, (to - from) / (moving * period));
                }
                if waiting > 0.0 {
                    note(at + moving, at + moving + waiting, DVec2::ZERO);
                }
                at += moving + waiting;
                from = to;
            }
        }
        note(at, at, DVec2::ZERO);
        Ok(largest.to_array())
    }

    /// The same layers, each checked as it comes: a job ends where one leaves the field.
    pub(super) fn checked<'a>(&'a self, layers: Layers<'a>) -> Layers<'a> {
        let mut layers = layers.fuse();
        let mut checking = Some(Checking::default());
        Box::new(std::iter::from_fn(move || {
            let known = checking.as_mut()?;
            let found = match layers.next() {
                Some(layer) => layer.and_then(|l| known.layer(self, &l).map(|()| Some(l))),
                None => known.end().map(|()| None),
            };
            if !matches!(found, Ok(Some(_))) {
                checking = None;
            }
            found.transpose()
        }))
    }

    /// Refuses a place beyond the field.
    fn inside(&self, index: usize, p: DVec2) -> Result<(), HeadError> {
        let error = match &self.inverse {
            Inverse::Table(table) => table.require(p).err(),
            Inverse::Exact { travel } => {
                let half = self.head.half_field;
                let beyond = p.abs().max_element() > half;
                let outside = beyond.then_some(CorrectionError::Outside {
                    x: p.x,
                    y: p.y,
                    half,
                });
                outside.or_else(|| self.within(p, *travel).err().map(CorrectionError::from))
            }
        };
        error.map_or(Ok(()), |source| Err(HeadError::Field { index, source }))
    }

    /// Refuses a point whose angles, without a table, are beyond the travels of the mirrors or of the cam.
    fn within(&self, point: DVec2, travel: DVec2) -> Result<(), GeometryError> {
        let mirrors = self.head.geometry.inverse_within(point, travel)?;
        if let (Some(focus), Some((axis, _))) = (&self.focus, &self.head.focus) {
            let cam = focus.inverse(mirrors, 0.0);
            if cam.is_nan() || cam.abs() > axis.travel() {
                return Err(GeometryError::Travel {
                    axis: 'Z',
                    x: point.x,
                    y: point.y,
                    angle_deg: cam.to_degrees(),
                    travel_deg: axis.travel().to_degrees(),
                });
            }
        }
        Ok(())
    }

    /// The angle set-points (θx, θy, θz), rad, for a commanded point, mm.
    #[inline]
    pub fn angles(&self, point: DVec3) -> DVec3 {
        match &self.inverse {
            Inverse::Table(table) => {
                let angles = table.angles(point.truncate());
                match &self.focus {
                    Some(focus) if point.z != 0.0 => {
                        let mirrors = angles.truncate();
                        let moved = focus.inverse(mirrors, point.z) - focus.inverse(mirrors, 0.0);
                        angles + DVec3::Z * moved
                    }
                    _ => angles,
                }
            }
            Inverse::Exact { .. } => {
                // the job was checked: every point of it has an inverse
                let mirrors = self
                    .head
                    .geometry
                    .inverse(point.truncate())
                    .unwrap_or(DVec2::ZERO);
                let cam = self
                    .focus
                    .as_ref()
                    .map_or(0.0, |f| f.inverse(mirrors, point.z));
                mirrors.extend(cam)
            }
        }
    }
}

/// What is known of a job that is checked layer by layer.
#[derive(Debug, Clone, Copy, Default)]
struct Checking {
    /// Whether anything was marked.
    marks: bool,
}

impl Checking {
    fn layer(&mut self, head: &ReadyHead, layer: &Prepared) -> Result<(), HeadError> {
        let job = &layer.job;
        job.check_vectors(layer.first)?;
        if layer.first == 0 {
            head.inside(0, job.start.truncate())?;
        }
        for (i, v) in job.vectors.iter().enumerate() {
            head.inside(layer.first as usize + i, v.end.truncate())?;
            self.marks |= v.kind.deposits();
        }
        Ok(())
    }

    fn end(self) -> Result<(), HeadError> {
        if self.marks {
            Ok(())
        } else {
            Err(ScanJobError::Empty.into())
        }
    }
}

impl ScanHead {
    fn check_axes(&self) -> Result<(), HeadError> {
        for (axis, letter) in self.axes().zip(LETTERS) {
            axis.check().map_err(|source| HeadError::Axis {
                axis: letter,
                source,
            })?;
        }
        Ok(())
    }

    /// Checks the head, fits its focus and computes its table.
    ///
    /// # Errors
    /// [`HeadError`].
    pub fn ready(&self) -> Result<ReadyHead, HeadError> {
        self.geometry.check()?;
        self.check_axes()?;
        let focus = self
            .focus
            .as_ref()
            .map(|(_, lenses)| Focus::new(*lenses, self.geometry))
            .transpose()?;
        let travel = DVec2::new(self.mirrors[0].travel(), self.mirrors[1].travel());
        let inverse = match self.table {
            Some(points) => Inverse::Table(CorrectionTable::new(
                &self.geometry,
                focus.as_ref(),
                self.half_field,
                points,
                travel,
            )?),
            None => Inverse::Exact { travel },
        };
        if let (Inverse::Table(table), Some((axis, _))) = (&inverse, &self.focus) {
            table.require_cam(axis.travel())?;
        }
        Ok(ReadyHead {
            head: self.clone(),
            focus,
            inverse,
            previews: None,
        })
    }
}
