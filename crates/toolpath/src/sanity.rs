//! What layers and toolpaths promise, checked: called by tests after each operation and by every reader of files.

use meltpath_geometry::math::DVec3;

use crate::column::Column;
use crate::error::PathError;
use crate::layer::{Entry, Layer};
use crate::toolpath::{Profile, Toolpath};
use crate::vocabulary::{Event, Weave};

fn bad(what: &'static str, index: usize) -> Result<(), PathError> {
    Err(PathError::Value { what, index })
}

/// Numbers of a list rise, strictly where `strict`, and stay below `end`.
fn numbered<T>(
    list: &[(u32, T)],
    end: usize,
    rise: fn(&u32, &u32) -> bool,
    what: &'static str,
) -> Result<(), PathError> {
    if let Some(k) = list.windows(2).position(|w| !rise(&w[0].0, &w[1].0)) {
        return bad(what, k + 1);
    }
    match list.last() {
        Some(last) if last.0 as usize >= end => bad(what, list.len() - 1),
        _ => Ok(()),
    }
}

/// A column is no longer than what it describes, and every number said is `sound`.
fn column(
    column: &Column,
    most: usize,
    what: &'static str,
    sound: impl Fn(f64) -> bool,
) -> Result<(), PathError> {
    let values = column.values();
    if values.len() > most {
        return Err(PathError::Length {
            what,
            found: values.len(),
            wanted: most,
        });
    }
    match values.iter().position(|v| !(v.is_nan() || sound(*v))) {
        Some(k) => bad(what, k),
        None => Ok(()),
    }
}

impl Layer {
    /// Checks what a layer promises: every pass has a point, all numbers are finite, arcs, spots and events belong to its moves
    /// and points, tool axes are unit vectors, values are not negative, neighbours lie along their passes.
    ///
    /// # Errors
    /// [`PathError`], at the first promise that does not hold.
    pub fn sanity_check(&self) -> Result<(), PathError> {
        if !self.height.is_finite() {
            return bad("the height is not finite", 0);
        }
        let starts = self.entries.iter().map(|e| e.first as usize);
        let ends = starts.clone().skip(1).chain([self.points.len()]);
        if let Some(k) = starts.clone().zip(ends).position(|(from, to)| from >= to) {
            return bad("a pass has no point", k);
        }
        if starts.clone().next().unwrap_or(self.points.len()) != 0 {
            return bad("points belong to no pass", 0);
        }
        if let Some(k) = self.points.iter().position(|p| !p.is_finite()) {
            return bad("a point is not finite", k);
        }
        let (points, moves) = (self.point_count(), self.move_count());
        numbered(&self.arcs, moves, u32::lt, "an arc belongs to no move")?;
        if let Some(k) = self.arcs.iter().position(|a| !a.1.is_finite()) {
            return bad("the via point of an arc is not finite", k);
        }
        numbered(&self.spots, moves, u32::lt, "a spot belongs to no move")?;
        let timed = |time: f64| time.is_finite() && time >= 0.0;
        if let Some(k) = self.spots.iter().position(|s| !timed(s.1)) {
            return bad("the time of a spot is not finite or negative", k);
        }
        let twice = |s: &(u32, f64)| self.arcs.binary_search_by_key(&s.0, |a| a.0).is_ok();
        if let Some(k) = self.spots.iter().position(twice) {
            return bad("a spot is an arc, too", k);
        }
        numbered(&self.events, points, u32::le, "an event has no point")?;
        let [speed, values @ ..] = &self.channels;
        let above = |v: f64| v > 0.0 && v.is_finite();
        column(speed, moves, "a speed is not above zero and finite", above)?;
        for values in values {
            column(values, moves, "a value is not finite or negative", timed)?;
        }
        for axis in &self.external {
            column(
                axis,
                points,
                "an external axis is not finite",
                f64::is_finite,
            )?;
        }
        column(&self.turns, points, "a turn is not finite", f64::is_finite)?;
        self.check_axes()?;
        self.check_neighbours()
    }

    fn check_axes(&self) -> Result<(), PathError> {
        let [x, y, z] = &self.axes;
        for axis in [x, y, z] {
            column(
                axis,
                self.point_count(),
                "a tool axis is not finite",
                f64::is_finite,
            )?;
        }
        for k in 0..x.values().len().max(y.values().len()).max(z.values().len()) {
            let unit = match (x.get(k), y.get(k), z.get(k)) {
                (None, None, None) => true,
                (Some(x), Some(y), Some(z)) => DVec3::new(x, y, z).is_normalized(),
                _ => false,
            };
            if !unit {
                return bad("a tool axis is no unit vector", k);
            }
        }
        Ok(())
    }

    fn check_neighbours(&self) -> Result<(), PathError> {
        let list = &self.neighbours;
        numbered(list, self.len(), u32::le, "a neighbour has no pass")?;
        for (k, pair) in list.chunk_by(|a, b| a.0 == b.0).enumerate() {
            let Some(pass) = self.get(pair[0].0 as usize) else {
                return bad("a neighbour has no pass", k);
            };
            let length = pass.length();
            let along = |from: f64, to: f64| 0.0 <= from && from <= to && to <= length + 1e-6;
            for (_, n) in pair {
                if !(along(n.from, n.to) && n.distance >= 0.0 && n.distance.is_finite()) {
                    return bad("a neighbour does not lie along its pass", k);
                }
            }
            if !pair.is_sorted_by(|a, b| a.1.from <= b.1.from) {
                return bad("neighbours do not follow one another", k);
            }
        }
        Ok(())
    }
}

impl Profile {
    fn is_sound(&self) -> bool {
        let values = [
            self.speed,
            self.wire_feed,
            self.power,
            self.spot,
            self.dwell,
            self.width,
            self.height,
        ];
        values.iter().all(|v| v.is_finite() && *v >= 0.0)
    }
}

impl Weave {
    fn is_sound(&self) -> bool {
        let [left, right] = self.dwell;
        let values = [self.frequency, self.amplitude, left, right];
        values.iter().all(|v| v.is_finite() && *v >= 0.0)
    }
}

impl Toolpath {
    /// Checks every layer, every profile and every weave, and that passes refer to those that are there.
    ///
    /// # Errors
    /// [`PathError`], at the first promise that does not hold.
    pub fn sanity_check(&self) -> Result<(), PathError> {
        if let Some(k) = self.profiles.iter().position(|p| !p.is_sound()) {
            return bad("a profile has a value that is not finite or negative", k);
        }
        if let Some(k) = self.weaves.iter().position(|w| !w.is_sound()) {
            return bad("a weave has a value that is not finite or negative", k);
        }
        for layer in &self.layers {
            layer.sanity_check()?;
            self.check_references(layer)?;
        }
        Ok(())
    }

    /// Checks that the passes of a layer refer to profiles and weaves that are there.
    pub(crate) fn check_references(&self, layer: &Layer) -> Result<(), PathError> {
        let unknown = |e: &Entry| usize::from(e.head.profile) >= self.profiles.len();
        if let Some(k) = layer.entries.iter().position(unknown) {
            return bad("a pass refers to a profile that is not there", k);
        }
        let unknown =
            |e: &(u32, Event)| matches!(e.1, Event::Weave(n) if n as usize > self.weaves.len());
        match layer.events.iter().position(unknown) {
            Some(k) => bad("an event refers to a weave that is not there", k),
            None => Ok(()),
        }
    }
}
