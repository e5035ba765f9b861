//! Moves of beads that take less time at their speed than a controller takes to plan one: it drives slower there, and lays more metal.

use meltpath_base::{Place, Reporter};

use crate::cell::CellProgramming;
use crate::program::Dialect;

/// The interpolation cycle of a maker's present controllers, s: no move takes less. Of their interfaces for sensors, which run with it: KUKA RSI 12 ms (4 ms
/// where it runs fast), FANUC 8 ms (Rouchon 2022, p. 38, records a controller each 12 ms), ABB EGM 4 ms, Universal Robots RTDE 2 ms (e-Series), Yaskawa MotoPlus 4 ms, Stäubli VAL3 4 ms. From memory of their manuals: a guess for the controller
/// at hand, and a least bound, as a controller that looks ahead over few moves needs longer ones.
pub fn interpolation_cycle(dialect: Dialect) -> f64 {
    match dialect {
        Dialect::Krl => 12e-3,
        Dialect::FanucLs => 8e-3,
        Dialect::Rapid | Dialect::Inform | Dialect::Val3 => 4e-3,
        Dialect::UrScript => 2e-3,
    }
}

/// The shortest time of a move that the controller of a cell plans without slowing down, s: as its file tells, else the
/// [`interpolation_cycle`].
pub fn shortest_move(cell: &CellProgramming, dialect: Dialect) -> f64 {
    let told = cell.shortest_move.map(|t| t.0);
    told.unwrap_or_else(|| interpolation_cycle(dialect))
}

/// Counts moves of beads that are too short.
#[derive(Debug)]
pub struct Spacing {
    /// Least time of a move, s.
    least: f64,
    /// Nobody told it.
    guessed: bool,
    short: Option<Short>,
}

/// Those that are too short.
#[derive(Debug)]
struct Short {
    count: usize,
    /// Length of the shortest in time, mm, and its speed, mm/s.
    length: f64,
    speed: f64,
    place: Place,
}

impl Spacing {
    /// For the controller of a cell.
    pub fn new(cell: &CellProgramming, dialect: Dialect) -> Self {
        Spacing {
            least: shortest_move(cell, dialect),
            guessed: cell.shortest_move.is_none(),
            short: None,
        }
    }

    /// Looks at a move of a bead: its length, mm, its speed, mm/s, and where it is.
    pub fn count(&mut self, length: f64, speed: f64, place: impl FnOnce() -> Place) {
        let time = length / speed;
        // what has no length takes no time
        if !(length > 0.0 && time < self.least) {
            return;
        }
        match &mut self.short {
            Some(short) => {
                short.count += 1;
                if time < short.length / short.speed {
                    (short.length, short.speed, short.place) = (length, speed, place());
                }
            }
            None => {
                self.short = Some(Short {
                    count: 1,
                    length,
                    speed,
                    place: place(),
                });
            }
        }
    }

    /// Warns of those that are too short.
    pub fn tell(&self, reporter: &Reporter) {
        let Some(short) = &self.short else {
            return;
        };
        let (ms, least) = (1e3 * short.length / short.speed, 1e3 * self.least);
        let of = if self.guessed {
            "the interpolation cycle that this maker's controllers have, a guess (program.shortest_move is not written)"
        } else {
            "program.shortest_move of the cell file"
        };
        let moves = if short.count == 1 {
            "move of a bead takes"
        } else {
            "moves of beads take"
        };
        reporter.warn_at(
            "moves-too-short",
            format!(
                "{} {moves} less time than this controller plans one in, {least:.3} ms ({of}): the shortest is {:.3} mm at {:.1} mm/s, {ms:.1} ms; it slows down there, and lays more metal",
                short.count, short.length, short.speed
            ),
            short.place.clone(),
            format!(
                "points at least {:.2} mm apart at this speed: a coarser chord error of the part, or a lower travel speed; or write the controller's own time into program.shortest_move of the cell file",
                self.least * short.speed
            ),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_under_the_cycle_are_counted_and_the_shortest_is_told() {
        let cell = |written: Option<f64>| {
            let mut cell: CellProgramming = crate::cell::tests::arcmate();
            cell.shortest_move.value = written.map(meltpath_base::Time);
            cell
        };
        let told = |spacing: Spacing| {
            let reporter = Reporter::new();
            spacing.tell(&reporter);
            reporter.warnings()
        };
        let mut spacing = Spacing::new(&cell(None), Dialect::Krl);
        // 12 ms at 20 mm/s are 0.24 mm
        for (length, line) in [(0.25, 1), (0.2, 2), (0.1, 3), (0.2, 4), (0.0, 5)] {
            spacing.count(length, 20.0, || Place {
                line: Some(line),
                ..Place::default()
            });
        }
        let warnings = told(spacing);
        let [warning] = &warnings[..] else {
            panic!("{warnings:?}")
        };
        assert!(
            warning.message.starts_with("3 moves of beads take"),
            "{warning:?}"
        );
        assert!(
            warning.message.contains("0.100 mm at 20.0 mm/s, 5.0 ms"),
            "{warning:?}"
        );
        assert!(warning.message.contains("a guess"), "{warning:?}");
        assert_eq!(warning.place.as_ref().and_then(|p| p.line), Some(3));
        let remedy = warning.remedy.as_deref().unwrap_or_default();
        assert!(remedy.contains("0.24 mm apart"), "{remedy}");
        // 12 ms at 12.5 mm/s are 0.15 mm
        for (length, warns) in [(0.2, 0), (0.151, 0), (0.149, 1)] {
            let mut spacing = Spacing::new(&cell(None), Dialect::Krl);
            spacing.count(length, 12.5, Place::default);
            assert_eq!(told(spacing).len(), warns, "{length} mm");
        }
        let mut spacing = Spacing::new(&cell(Some(20e-3)), Dialect::Krl);
        spacing.count(0.2, 12.5, Place::default);
        let written = told(spacing);
        assert!(
            written[0]
                .message
                .contains("program.shortest_move of the cell file")
        );
        assert!(!written[0].message.contains("guess"), "{written:?}");
        for (written, dialect) in [(Some(4e-3), Dialect::Krl), (None, Dialect::UrScript)] {
            let mut spacing = Spacing::new(&cell(written), dialect);
            spacing.count(0.1, 20.0, Place::default);
            assert_eq!(told(spacing), []);
        }
    }
}
