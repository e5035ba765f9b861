//! The log: columns of times and places, or of joints that the robot's file makes places of.

use std::path::Path;

use meltpath_geometry::math::DVec3;
use meltpath_perception::mapping::ColumnName;
use meltpath_perception::table::{self, Table};
use meltpath_robot::cell::{Cell, Values};
use meltpath_robot::identification::{Log, LogError};

use super::error::MotionLogError;
use super::file::Told;
use crate::waam::program::by_joints;

/// Values of a column.
fn column<'t>(
    table: &'t Table,
    wanted: &ColumnName,
    file: &str,
) -> Result<&'t [f64], MotionLogError> {
    let bare = |name: &str| {
        let end = name.find(['(', '[', '/']).unwrap_or(name.len());
        name[..end].trim().to_lowercase()
    };
    let found = match wanted {
        ColumnName::Number(n) => n.checked_sub(1).and_then(|n| table.columns.get(n)),
        ColumnName::Name(name) => {
            let exact = table.columns.iter().find(|c| c.0.trim() == name.trim());
            exact.or_else(|| table.columns.iter().find(|c| bare(&c.0) == bare(name)))
        }
    };
    found
        .map(|c| &c.1[..])
        .ok_or_else(|| MotionLogError::Column {
            file: file.to_owned(),
            wanted: match wanted {
                ColumnName::Number(n) => format!("column {n}"),
                ColumnName::Name(name) => format!("column \"{name}\""),
            },
            there: {
                let names = table.columns.iter().map(|c| format!("\"{}\"", c.0));
                names.collect::<Vec<_>>().join(", ")
            },
        })
}

/// Reads the log that a file names: samples between `from` and `to`, in mm and s.
///
/// # Errors
/// [`MotionLogError`].
pub(super) fn read(told: &Told, path: &Path) -> Result<Log, MotionLogError> {
    let name = path.display().to_string();
    let table = table::read(path)?;
    let file = &told.file;
    let times = column(&table, &file.time, &name)?;
    // without headings the first line is the first row
    let bare = table.columns.iter().enumerate();
    let headed = bare.into_iter().any(|(i, c)| c.0 != (i + 1).to_string());
    let first = 1 + usize::from(headed);
    let places: Vec<DVec3> = if let (Some(joints), Some(robot)) = (&*file.joints, &told.robot) {
        by_arm(told, robot, joints, &table, &name)?
    } else {
        let mut all = Vec::with_capacity(3);
        for wanted in file.places.iter() {
            all.push(column(&table, wanted, &name)?);
        }
        let unit = file.unit.millimetres();
        (0..table.rows())
            .map(|i| DVec3::from_array([0, 1, 2].map(|c| all[c][i])) * unit)
            .collect()
    };
    let second = file.time_unit.seconds();
    let [from, to] = [
        file.from.map_or(f64::NEG_INFINITY, |t| t.0),
        file.to.map_or(f64::INFINITY, |t| t.0),
    ];
    let mut log = Log::default();
    for (i, (time, place)) in times.iter().zip(places).enumerate() {
        let time = time * second;
        // what is no number is told, wherever it stands
        if time < from || time > to {
            continue;
        }
        log.times.push(time);
        log.places.push(place);
        log.lines.push(first + i);
    }
    log.check().map_err(|why| MotionLogError::Log {
        file: name,
        why: match why {
            LogError::NoNumber { line, what } if file.joints.is_some() => LogError::NoNumber {
                line,
                what: format!("{what} (or a joint)"),
            },
            why => why,
        },
    })?;
    Ok(log)
}

/// Where the wire's tip is in the part, by joints.
fn by_arm(
    told: &Told,
    robot: &Cell,
    joints: &[ColumnName; 6],
    table: &Table,
    name: &str,
) -> Result<Vec<DVec3>, MotionLogError> {
    let mut shown = Vec::with_capacity(6);
    for wanted in joints {
        shown.push(column(table, wanted, name)?);
    }
    let mut others = Vec::new();
    for wanted in told.file.external.iter() {
        others.push(column(table, wanted, name)?);
    }
    let turning = by_joints::turning(robot);
    let turning = turning.get(&others.len());
    let mut places = Vec::with_capacity(table.rows());
    for i in 0..table.rows() {
        let angles: [f64; 6] = std::array::from_fn(|c| shown[c][i].to_radians());
        let external = if others.is_empty() {
            robot.at_rest().external()
        } else {
            let turns = |c: usize| turning.and_then(|t| t.get(c)).copied() == Some(true);
            let said = others.iter().enumerate();
            let said: Vec<f64> = said
                .map(|(c, v)| if turns(c) { v[i].to_radians() } else { v[i] })
                .collect();
            by_joints::external(robot, &said).ok_or_else(|| MotionLogError::External {
                told: others.len(),
                robot: robot.name.clone(),
            })?
        };
        let values = Values::of(robot.arm.joints(angles), external);
        places.push(robot.frames(&values).part_from_wire_tip().position);
    }
    Ok(places)
}
