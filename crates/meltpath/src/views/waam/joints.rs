//! The joints of the robot at every place of a program, as a table.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::series::csv::CsvWriter;
use meltpath_report::series::{Column, Kind, SeriesError, Values};
use meltpath_robot::cell::Cell;
use meltpath_robot::kinematics::JointKind;

use crate::waam::drive::film::Step;
use crate::waam::program::Commands;

/// Rows that are written together.
const BLOCK: usize = 4096;

/// One line a place: time, joints as the controller shows them, track and positioner, what is left to the limits, the wrist, and the
/// fastest axis on the way from the place before: joints from 1, then track and positioner as they are listed.
///
/// # Errors
/// [`OutputError`].
pub(crate) fn write<'a>(
    folder: &OutputFolder,
    cell: &Cell,
    steps: impl Iterator<Item = (f64, &'a Step)>,
    moves: &Commands,
) -> Result<(), OutputError> {
    let mut steps = steps;
    folder.write("series/joints.csv", |out| {
        let mut write = || -> Result<(), SeriesError> {
            let heads = heads(cell);
            let mut csv = CsvWriter::new(out, heads.clone())?;
            let mut rows = Rows {
                cell,
                moves,
                beside: beside(cell),
                before: None,
                layer: 0,
            };
            loop {
                let mut columns: Vec<Vec<f64>> = vec![Vec::new(); heads.len()];
                for (time, step) in steps.by_ref().take(BLOCK) {
                    let row = rows.row(time, step);
                    for (column, value) in columns.iter_mut().zip(row) {
                        column.push(value);
                    }
                }
                if columns.iter().all(Vec::is_empty) {
                    return csv.finish();
                }
                let block: Vec<Values<'_>> = columns.iter().map(|c| Values::Float(c)).collect();
                csv.block(&block)?;
            }
        };
        write().map_err(io::Error::other)
    })
}

/// The axes beside the arm's joints: name, unit, and what its values are told in.
fn beside(cell: &Cell) -> Vec<(usize, String, &'static str, f64)> {
    let named = |axis: usize| {
        let joint = cell.external_joint(axis)?;
        let name = match axis {
            0 => "track".to_owned(),
            _ => format!("positioner {axis}"),
        };
        Some(match joint.kind {
            JointKind::Revolute => (axis, name, "deg", 1.0_f64.to_degrees()),
            JointKind::Prismatic => (axis, name, "mm", 1.0),
        })
    };
    (0..3).filter_map(named).collect()
}

fn heads(cell: &Cell) -> Vec<Column> {
    let column = |name: &str, unit: &str| Column::new(name, unit, Kind::Float);
    let mut heads = ["command", "layer", "bead"].map(|n| column(n, "")).to_vec();
    heads.insert(0, column("time", "s"));
    heads.extend((1..=6).map(|j| column(&format!("joint {j}"), "deg")));
    heads.extend(
        beside(cell)
            .iter()
            .map(|(_, name, unit, _)| column(name, unit)),
    );
    heads.extend([
        column("limit margin", "deg"),
        column("limit joint", ""),
        column("wrist from singular", "deg"),
        column("fastest", "%"),
        column("fastest axis", ""),
    ]);
    heads
}

/// The table row by row.
struct Rows<'a> {
    cell: &'a Cell,
    moves: &'a Commands,
    beside: Vec<(usize, String, &'static str, f64)>,
    before: Option<(f64, &'a Step)>,
    layer: u32,
}

impl<'a> Rows<'a> {
    fn row(&mut self, time: f64, step: &'a Step) -> Vec<f64> {
        let (cell, moves) = (self.cell, self.moves);
        let at = step.command as usize;
        // travels belong to the layer before them
        let own = moves.layer_of_command.get(at).copied().unwrap_or(0);
        self.layer = self.layer.max(own);
        let bead = moves.bead_of_command.get(at).copied().flatten();
        let shown = cell.arm.shown(step.values.arm).map(f64::to_degrees);
        let external = step.values.external().0;
        let (margin, joint) = cell.arm.margin(step.values.arm);
        let wrist = cell
            .arm
            .nearness(step.values.arm)
            .map(|n| n.wrist.to_degrees());
        let fastest = self.before.replace((time, step));
        let fastest = fastest.and_then(|(then, from)| {
            let (share, axis) = from.slowest(step, cell)?;
            // moves of no recorded time say no speed
            (time > then).then(|| (100.0 * share / (time - then), axis))
        });
        let mut row = vec![time, f64::from(step.command), f64::from(self.layer)];
        row.push(bead.map_or(f64::NAN, f64::from));
        row.extend(shown);
        let beside = self.beside.iter();
        row.extend(beside.map(|(axis, _, _, factor)| external[*axis] * factor));
        row.extend([margin.to_degrees(), joint as f64 + 1.0]);
        row.push(wrist.unwrap_or(f64::NAN));
        let (share, axis) = fastest.map_or((f64::NAN, f64::NAN), |(s, a)| (s, a as f64 + 1.0));
        row.extend([share, axis]);
        row
    }
}
