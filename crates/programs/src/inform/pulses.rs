//! Pulses: how a job tells where base axis and station stand, and how far they go with each.

use crate::cell::CellProgramming;
use crate::program::Axis;

/// Pulses of the axes beside the arm, as the cell says them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pulses {
    /// Of the base axis, a mm.
    base: Option<f64>,
    /// Of each axis of the station, a degree; nothing where one of them is not known.
    station: Option<Vec<f64>>,
    /// Of each axis of the arm, a degree; nothing where they are not known.
    arm: Option<[f64; 6]>,
    /// Number of the station's group in programs here.
    pub(super) group: u32,
}

impl Pulses {
    /// Those of a cell.
    pub fn of(cell: &CellProgramming) -> Self {
        let known = |pulses: f64| (pulses != 0.0).then_some(pulses);
        let positioner = cell.positioner.as_ref();
        let station = positioner.and_then(|p| {
            let each = p
                .axes
                .iter()
                .map(|a| (*a.pulses_per_degree).and_then(known));
            each.collect::<Option<Vec<f64>>>()
        });
        let track = cell.track.as_ref();
        let arm = cell.inform.as_ref().and_then(|w| *w.pulses_per_degree);
        Pulses {
            arm: arm.filter(|all| all.iter().all(|n| n.is_finite() && *n != 0.0)),
            base: track.and_then(|t| (*t.pulses_per_millimetre).and_then(known)),
            station: station.filter(|axes| !axes.is_empty()),
            group: positioner.map_or(2, |p| *p.group),
        }
    }

    /// Of the base axis, a mm.
    pub(crate) fn of_base(&self) -> Option<f64> {
        self.base
    }

    /// Of each axis of the station, a degree.
    pub(crate) fn of_station(&self) -> Option<&[f64]> {
        self.station.as_deref()
    }

    /// The joints of the arm at so many pulses, deg; nothing where the cell does not say theirs.
    pub(super) fn arm(&self, values: &[f64]) -> Option<Vec<Axis>> {
        let scales = self.arm.as_ref()?;
        let pairs = only(values, scales.len())?.iter().zip(scales);
        Some(Axis::joints(pairs.map(|(pulses, scale)| pulses / scale)))
    }

    /// The pulses of the arm, whose joints stand there: in pulses already, or in degrees.
    pub(super) fn told_arm(&self, axes: &[Axis]) -> Option<Vec<f64>> {
        let all = |unit: &str| axes.iter().all(|a| a.unit == unit);
        if all("pulse") {
            return Some(axes.iter().map(|a| a.value).collect());
        }
        let scales = self.arm.as_ref().filter(|_| all("deg"))?;
        let told = axes.iter().zip(scales).map(|(a, scale)| a.value * scale);
        Some(told.collect())
    }

    /// The base axis at so many pulses, mm.
    pub(super) fn base(&self, values: &[f64]) -> Option<Vec<Axis>> {
        Some(base_at(only(values, 1)?.first()? / self.base?))
    }

    /// The station at so many pulses, deg.
    pub(super) fn station(&self, values: &[f64]) -> Option<Vec<Axis>> {
        let scales = self.station.as_ref()?;
        let pairs = only(values, scales.len())?.iter().zip(scales);
        Some(station_at(pairs.map(|(pulses, scale)| pulses / scale)))
    }

    /// The station at angles that a job tells in degrees.
    pub(super) fn station_in_degrees(&self, values: &[f64]) -> Option<Vec<Axis>> {
        let count = self.station.as_ref()?.len();
        Some(station_at(only(values, count)?.iter().copied()))
    }

    /// The pulses of the base axis, which stands at so many mm.
    pub(super) fn told_base(&self, axes: &[Axis]) -> Option<Vec<f64>> {
        match axes {
            [axis] if axis.unit == "mm" => Some(vec![axis.value * self.base?]),
            _ => None,
        }
    }

    /// The pulses of the station, which stands at these angles, deg.
    pub(super) fn told_station(&self, axes: &[Axis]) -> Option<Vec<f64>> {
        let scales = self.station.as_ref()?;
        let told = axes.iter().zip(scales).map(|(a, scale)| a.value * scale);
        (axes.len() == scales.len()).then(|| told.collect())
    }
}

/// The first `count` values, where there are no others but zeros: a group may have more axes than are used.
fn only(values: &[f64], count: usize) -> Option<&[f64]> {
    let (used, others) = values.split_at_checked(count)?;
    others.iter().all(|v| *v == 0.0).then_some(used)
}

/// A base axis that stands there, mm.
pub(super) fn base_at(value: f64) -> Vec<Axis> {
    vec![Axis {
        name: "E1".to_owned(),
        value,
        unit: "mm".to_owned(),
    }]
}

/// A station that stands there, deg.
fn station_at(angles: impl Iterator<Item = f64>) -> Vec<Axis> {
    Axis::joints(angles)
}
