//! Records of a gun: what it was fed with from one instant on, row by row, as CSV.

use std::fmt::Write as _;
use std::io::BufRead;

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{MotionBlock, Times};

use crate::Gun;
use crate::focus::{FocusCalibration, FocusError};

/// The gun from one instant on: the beam moves in a straight line to the next row, with these settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// When, s.
    pub time: f64,
    /// Where, mm.
    pub x: f64,
    /// Where, mm.
    pub y: f64,
    /// Accelerating voltage, V.
    pub voltage: f64,
    /// Beam current, A.
    pub current: f64,
    /// Current of the focus coil, A.
    pub focus: f64,
    /// Whether the beam is on.
    pub on: bool,
}

/// Why a record was refused.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// Time runs backwards or a value is not finite.
    #[error("point {} of the beam path ({time} s): {what}", index + 1)]
    Row {
        /// Which, from 0.
        index: usize,
        /// Its time, s.
        time: f64,
        /// What is wrong.
        what: &'static str,
    },
    /// A line of a file that does not read.
    #[error("line {line} of the beam path: {what}; the columns are {}", COLUMNS)]
    Line {
        /// Which, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// A focus current that is not calibrated.
    #[error("at {time} s of the beam path: {source}")]
    Focus {
        /// When, s.
        time: f64,
        /// Why.
        source: FocusError,
    },
    /// The file cannot be read.
    #[error("the beam path cannot be read: {0}")]
    Read(#[from] std::io::Error),
}

/// Heads of the columns of a record; `on` is 0 or 1.
pub const COLUMNS: &str = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on";

/// What a gun was fed with, from its first row's time to its last.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    rows: Vec<Row>,
}

impl Record {
    /// A record of `rows`, times never decreasing; two rows at the same time are a jump.
    ///
    /// # Errors
    /// [`RecordError::Row`].
    pub fn new(rows: Vec<Row>) -> Result<Self, RecordError> {
        let mut before = f64::NEG_INFINITY;
        for (index, r) in rows.iter().enumerate() {
            let time = r.time;
            let fail = |what| Err(RecordError::Row { index, time, what });
            let values = [r.time, r.x, r.y, r.voltage, r.current, r.focus];
            if !values.iter().all(|v| v.is_finite()) {
                return fail("a value is not finite");
            }
            if r.time < before {
                return fail("time runs backwards");
            }
            if r.voltage * r.current < 0.0 {
                return fail("the power is negative");
            }
            before = r.time;
        }
        Ok(Record { rows })
    }

    /// What `gun` is fed with for a motion.
    ///
    /// # Errors
    /// [`RecordError::Row`] of a motion whose times or places are no numbers.
    pub fn of(motion: &MotionBlock, gun: &Gun) -> Result<Self, RecordError> {
        let column = |values: &[f64], n: usize| values.get(n).copied();
        let rows = motion.position.iter().enumerate().map(|(n, at)| {
            // what a sample says holds over the stretch that ends there, what a row says from there on
            let power = column(&motion.power, n + 1).unwrap_or_default();
            let spot = column(&motion.spot, n + 1).or_else(|| column(&motion.spot, n));
            Row {
                time: motion.time(n),
                x: at.x,
                y: at.y,
                voltage: gun.voltage,
                current: gun.current(power),
                focus: spot.map_or(gun.coil, |spot| gun.coil(spot)),
                on: power > 0.0,
            }
        });
        Self::new(rows.collect())
    }

    /// The motion of the beam on the build plane, with its power and its spot by `focus`.
    ///
    /// # Errors
    /// [`RecordError::Focus`] where the beam is on outside the calibration.
    pub fn motion(&self, focus: &FocusCalibration) -> Result<MotionBlock, RecordError> {
        let rows = &self.rows;
        let mut motion = MotionBlock {
            times: Times::Each(rows.iter().map(|r| r.time).collect()),
            position: rows.iter().map(|r| DVec3::new(r.x, r.y, 0.0)).collect(),
            ..MotionBlock::default()
        };
        let mut last = 0.0;
        for (n, row) in rows.iter().enumerate() {
            let before = rows[n.saturating_sub(1)];
            let lit = n > 0 && before.on;
            let power = if lit {
                before.voltage * before.current
            } else {
                0.0
            };
            motion.power.push(power);
            if lit || n == 0 {
                last = match focus.diameter(before.focus) {
                    Ok(spot) => spot,
                    // the coil may do what it will while the beam is off
                    Err(_) if !lit => last,
                    Err(source) => {
                        let time = row.time;
                        return Err(RecordError::Focus { time, source });
                    }
                };
            }
            motion.spot.push(last);
        }
        Ok(motion)
    }

    /// The gun at the settings of the first row that heats; `None` where none does.
    pub fn gun(&self, focus: &FocusCalibration) -> Option<Gun> {
        let first = self.heating().next()?;
        Some(Gun {
            voltage: first.voltage,
            focus: focus.clone(),
            coil: first.focus,
        })
    }

    /// How many of the rows that heat a gun would be fed otherwise for the same power and spot, and how many rows heat: a
    /// gun has one voltage and one branch of its focus calibration.
    pub fn fed_otherwise(&self, gun: &Gun) -> [usize; 2] {
        let other = |row: &Row| {
            let coil = gun.focus.diameter(row.focus).map(|spot| gun.coil(spot));
            row.voltage != gun.voltage || coil.is_ok_and(|coil| (coil - row.focus).abs() > 1e-8)
        };
        let rows: Vec<bool> = self.heating().map(other).collect();
        [rows.iter().filter(|other| **other).count(), rows.len()]
    }

    /// Rows that heat until the next one.
    fn heating(&self) -> impl Iterator<Item = &Row> {
        let lit =
            |w: &&[Row]| w[0].on && w[0].voltage * w[0].current > 0.0 && w[1].time > w[0].time;
        self.rows.windows(2).filter(lit).map(|w| &w[0])
    }

    /// The rows.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Reads a record from CSV with the columns of [`COLUMNS`] and that line at its head; lines that begin with `#` are comments.
    ///
    /// # Errors
    /// [`RecordError`] with the line.
    pub fn from_csv(reader: impl BufRead) -> Result<Self, RecordError> {
        let mut rows = Vec::new();
        let mut head = false;
        for (n, text) in reader.lines().enumerate() {
            let text = text?;
            // spreadsheets begin a file with a mark that nobody sees
            let text = text.trim_start_matches('\u{feff}').trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let fail = |what: String| RecordError::Line { line: n + 1, what };
            if !head {
                if text != COLUMNS {
                    return Err(fail(format!("the head is \"{text}\"")));
                }
                head = true;
                continue;
            }
            rows.push(row(text).map_err(fail)?);
        }
        Self::new(rows)
    }

    /// The record as CSV; reads back to the same bits.
    pub fn to_csv(&self) -> String {
        let mut out = format!("{COLUMNS}\n");
        for r in &self.rows {
            // writing to a String cannot fail
            let _ = writeln!(
                out,
                "{:?},{:?},{:?},{:?},{:?},{:?},{}",
                r.time,
                r.x,
                r.y,
                r.voltage,
                r.current,
                r.focus,
                u8::from(r.on)
            );
        }
        out
    }
}

/// A row from its line; the words of what is wrong with it.
fn row(text: &str) -> Result<Row, String> {
    let mut values = [0.0; 7];
    let mut cells = text.split(',');
    for value in &mut values {
        let cell = cells
            .next()
            .ok_or_else(|| "a column is missing".to_owned())?;
        *value = cell
            .trim()
            .parse()
            .map_err(|_| format!("\"{cell}\" is not a number"))?;
    }
    if cells.next().is_some() {
        return Err("there is a column too many".to_owned());
    }
    let [time, x, y, voltage, current, focus, on] = values;
    if on != 0.0 && on != 1.0 {
        return Err(format!("`on` is {on}: write 0 or 1"));
    }
    Ok(Row {
        time,
        x,
        y,
        voltage,
        current,
        focus,
        on: on == 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::focus::FocusPiece;
    use proptest::prelude::*;

    fn gun() -> Gun {
        let falling = FocusPiece {
            range: [-3e-3, 7.15e-3],
            intercept: 0.551_67,
            slope: -34.5,
        };
        Gun {
            voltage: 60e3,
            focus: FocusCalibration::new(vec![falling]).unwrap(),
            coil: 4e-3,
        }
    }

    #[test]
    fn time_stands_at_a_jump_and_never_runs_backwards() {
        let row = |time: f64, x: f64| Row {
            time,
            x,
            y: 0.0,
            voltage: 60e3,
            current: 5e-3,
            focus: 0.0,
            on: true,
        };
        assert!(Record::new(vec![row(0.0, 0.0), row(1.0, 1.0), row(1.0, 2.0)]).is_ok());
        let error = Record::new(vec![row(0.0, 0.0), row(1.0, 1.0), row(0.5, 2.0)]).unwrap_err();
        assert!(
            matches!(error, RecordError::Row { index: 2, .. }),
            "{error}"
        );
    }

    proptest! {
        #[test]
        fn records_come_back_from_csv(values in prop::collection::vec((0.0..1.0_f64, -9.0..9.0_f64, prop::bool::ANY), 0..20)) {
            let mut time = 0.0;
            let rows = values.iter().map(|&(dt, x, on)| {
                time += dt;
                Row { time, x, y: x * 0.3, voltage: 60e3, current: 5e-3 * dt, focus: 0.0, on }
            }).collect();
            let record = Record::new(rows).unwrap();
            let marked = format!("\u{feff}{}", record.to_csv());
            prop_assert_eq!(Record::from_csv(marked.as_bytes()).unwrap(), record.clone());
            prop_assert_eq!(Record::from_csv(record.to_csv().as_bytes()).unwrap(), record);
        }

        /// A record's motion, fed to the gun again, is the record, but for what no beam shows: rows that are off, and the last.
        #[test]
        fn a_motion_is_fed_as_it_was_recorded(values in prop::collection::vec((0.1..1.0_f64, -9.0..9.0_f64, -3..7_i32, 1..8_i32, prop::bool::ANY), 1..20)) {
            let mut time = 0.0;
            let rows: Vec<Row> = values.iter().map(|&(dt, x, coil, current, on)| {
                time += dt;
                Row { time, x, y: x * 0.3, voltage: 60e3, current: 1e-3 * f64::from(current), focus: 1e-3 * f64::from(coil), on }
            }).collect();
            let gun = gun();
            let motion = Record::new(rows.clone()).unwrap().motion(&gun.focus).unwrap();
            motion.sanity_check().unwrap();
            let again = Record::of(&motion, &gun).unwrap();
            prop_assert_eq!(again.rows().len(), rows.len());
            for (a, b) in again.rows().iter().zip(&rows[..rows.len() - 1]) {
                prop_assert_eq!((a.time, a.x, a.y, a.on), (b.time, b.x, b.y, b.on));
                if b.on {
                    prop_assert!((a.current - b.current).abs() < 1e-15 && (a.focus - b.focus).abs() < 1e-9, "{:?} {:?}", a, b);
                }
            }
            prop_assert!(!again.rows()[rows.len() - 1].on);
        }
    }

    /// A second voltage, and a focus on the rising branch, are written back otherwise; what is off does not count.
    #[test]
    fn rows_of_another_voltage_or_branch_are_counted() {
        let rising = FocusPiece {
            range: [7.15e-3, 30e-3],
            intercept: 0.132_15,
            slope: 24.21,
        };
        let falling = FocusPiece {
            range: [-3e-3, 7.15e-3],
            intercept: 0.551_67,
            slope: -34.5,
        };
        let focus = FocusCalibration::new(vec![falling, rising]).unwrap();
        let row = |time: f64, voltage: f64, focus: f64, on: bool| Row {
            time,
            x: 0.0,
            y: 0.0,
            voltage,
            current: 5e-3,
            focus,
            on,
        };
        let rows = vec![
            row(0.0, 30e3, 9e-3, false),
            row(1.0, 60e3, 4e-3, true),
            row(2.0, 60e3, 3e-3, true),
            row(3.0, 50e3, 4e-3, true),
            row(4.0, 60e3, 12e-3, true),
            row(5.0, 60e3, 4e-3, false),
        ];
        let record = Record::new(rows).unwrap();
        let gun = record.gun(&focus).unwrap();
        assert_eq!((gun.voltage, gun.coil), (60e3, 4e-3));
        assert_eq!(record.fed_otherwise(&gun), [2, 4]);
        assert!(
            Record::new(vec![row(0.0, 60e3, 0.0, false)])
                .unwrap()
                .gun(&focus)
                .is_none()
        );
    }

    #[test]
    fn a_bad_line_is_named() {
        let text = format!("{COLUMNS}\n0,0,0,60000,0.005,0,1\n0.1,zero,0,60000,0.005,0,1\n");
        let error = Record::from_csv(text.as_bytes()).unwrap_err().to_string();
        assert!(
            error.starts_with("line 3 of the beam path: \"zero\" is not a number"),
            "{error}"
        );
    }

    #[test]
    fn a_focus_outside_the_calibration_counts_where_the_beam_is_on() {
        let row = |time: f64, focus: f64, on: bool| Row {
            time,
            x: 0.0,
            y: 0.0,
            voltage: 60e3,
            current: 5e-3,
            focus,
            on,
        };
        let motion = |middle: bool| {
            let rows = vec![
                row(0.0, 4e-3, true),
                row(1.0, 9e-3, middle),
                row(2.0, 0.0, false),
            ];
            Record::new(rows).unwrap().motion(&gun().focus)
        };
        assert!(motion(false).is_ok());
        let refused = motion(true).unwrap_err().to_string();
        assert!(refused.contains("0.0090 A lies outside"), "{refused}");
    }
}
