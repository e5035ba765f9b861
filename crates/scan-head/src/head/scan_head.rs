//! A scan head: its optics and its axes.

use crate::axis::chain::Axis;
use crate::axis::friction::Drag;
use crate::axis::prefilter::Kernel;
use crate::head::head_axis::HeadAxis;
use crate::optics::beam::GaussianBeam;
use crate::optics::focus::Lenses;
use crate::optics::geometry::Geometry;

/// A scan head: its optics and its axes.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanHead {
    /// Name for people.
    pub name: String,
    /// Sample period, s.
    pub period: f64,
    /// Mirrors, windows and plane.
    pub geometry: Geometry,
    /// The X and Y axes.
    pub mirrors: [HeadAxis; 2],
    /// The axis of the dynamic focus with its lenses, where the head has one.
    pub focus: Option<(HeadAxis, Lenses)>,
    /// Half the side of the field, mm.
    pub half_field: f64,
    /// Points a side of the correction table; without a table the inverse is computed exactly.
    pub table: Option<usize>,
    /// The longest laser delay that its controller takes, s, where that is known.
    pub longest_delay: Option<f64>,
    /// Where the axes are known by their data sheet: one standard deviation of the spot's place that it leaves out, mm, if anybody
    /// says so.
    pub left_out: Option<Option<f64>>,
    /// The beam at the powder.
    pub beam: GaussianBeam,
}

/// The longest laser delay that is tuned where the head states none, s.
const LONGEST_DELAY: f64 = 1.2e-3;

/// The axes' letters.
pub(super) const LETTERS: [char; 3] = ['X', 'Y', 'Z'];

impl ScanHead {
    /// Up to which laser delays are tuned, s.
    pub fn delays_up_to(&self) -> f64 {
        self.longest_delay.unwrap_or(LONGEST_DELAY)
    }

    pub(super) fn axes(&self) -> impl Iterator<Item = &HeadAxis> {
        self.mirrors
            .iter()
            .chain(self.focus.as_ref().map(|(axis, _)| axis))
    }

    /// The mirrors' axes whose motors are known: both, or none.
    pub fn driven_mirrors(&mut self) -> impl Iterator<Item = &mut Axis> {
        self.mirrors.iter_mut().filter_map(HeadAxis::driven_mut)
    }

    /// The same head with other friction on X, Y and Z; an axis without an entry keeps its own, as does one without a motor.
    #[must_use]
    pub fn held_by(mut self, drags: [Option<Drag>; 3]) -> Self {
        let focus = self.focus.as_mut().map(|(axis, _)| axis);
        for (axis, drag) in self.mirrors.iter_mut().chain(focus).zip(drags) {
            if let (Some(axis), Some(Drag { dry, viscous })) = (axis.driven_mut(), drag) {
                (axis.motor.friction, axis.motor.viscous) = (dry, viscous);
            }
        }
        self
    }

    /// Gives both mirrors the averages of the one whose pre-filter lags more, so that set-points of straight lines stay straight;
    /// a mirror without a pre-filter stays without.
    pub fn filter_alike(&mut self) {
        let slower = self
            .mirrors
            .iter()
            .filter_map(|axis| axis.driven()?.prefilter)
            .max_by(|a, b| a.lag().total_cmp(&b.lag()));
        if let Some(slower) = slower {
            for axis in self.driven_mirrors() {
                if let Some(filter) = &mut axis.prefilter {
                    (filter.first, filter.second) = (slower.first, slower.second);
                }
            }
        }
    }

    /// Leaves out the second average of each mirror's pre-filter: the speed and the acceleration stay bounded, the jerk does not
    /// (Rasoanarivo 2020, fig. 2.27).
    pub fn filter_acceleration(&mut self) {
        let one = self.period;
        for axis in self.driven_mirrors() {
            if let Some(filter) = &mut axis.prefilter {
                // an average over one sample is none
                filter.second = Kernel::Box(one);
            }
        }
    }
}
