//! The file that tells what a log of a dry run is of.

use std::path::{Path, PathBuf};

use meltpath_base::settings::{self, File, Problem};
use meltpath_base::{Length, Ratio, Speed, Time, choice, table};
use meltpath_data::{cells, robots};
use meltpath_perception::mapping::{ColumnName, TimeUnit};
use meltpath_robot::cell;
use meltpath_robot::identification::frame::Freedom;

use crate::data::{Cell, DataText};
use crate::job::{JobError, PartUnit, Problems, text_of};

table! {
    /// A log of the tool, written while a path was driven without arc, and that path.
    pub struct MotionLogFile {
        /// The log: `.csv`, `.parquet` or `.mat` (level 5), beside this file. Its places are those of the wire's tip, or its joints are told.
        log: File => required;
        /// The cell whose program was driven: a name in `data/cells`, or a TOML file of your own. Its `[motion]` is not needed.
        cell: String => none("needed for `program`");
        /// The program that was driven, of any dialect, beside this file; or a folder with one main program.
        program: File => none("the path is that of [[point]]");
        /// The robot, for logs by joints: a name in `data/robots`, or a TOML file of your own.
        robot: String => none("the log tells places");
        /// The unit of the log's places.
        unit: PartUnit => default("mm", "what most controllers write");
        /// The unit of the log's times.
        time_unit: TimeUnit => default("s", "seconds");
        /// The column of times: a heading, or a place from 1.
        time: ColumnName => default("time", "its usual heading");
        /// The columns of x, y and z.
        places: [ColumnName; 3] => default(["x", "y", "z"], "their usual headings");
        /// The columns of the six joints, in degrees as the controller shows them.
        joints: [ColumnName; 6] => none("the log tells places");
        /// The columns of external axes, the track first: degrees, of sliding axes mm.
        external: Vec<ColumnName> => default([], "they stand where the robot's file has them at rest");
        /// In which frame the log is.
        frame: LogFrame => default("fit", "it is found with the rest");
        /// Where the log begins to count.
        from: Time => none("at its begin");
        /// Where it ends to count.
        to: Time => none("at its end");
        /// The controller's interpolation period, of which filters are whole multiples.
        period: Time where within(0.0005, 0.05) => default("1 ms", "not known: filters are told to a millisecond");
        /// Distance of blending that is 100 % of smoothing, for paths that tell distances.
        blend: Length where within(0.01, 1000.0) => none("that of the cell (program.blend); else the greatest of the path");
        /// How far the model may miss the place of the tool at a corner, start or stop, root mean square.
        place_bound: Length where within(0.001, 10.0) => default("0.1 mm", "a fiftieth of a bead 5 mm wide");
        /// How far it may miss its speed there, of the programmed one, root mean square.
        speed_bound: Ratio where within(0.001, 1.0) => default("5 %", "as much metal too much or too little there");
        /// The path, point by point, the first where the tool stands at the beginning.
        points as "point": Vec<PathPoint> => default([], "the path is that of `program`");
    }

    /// A point of the path.
    pub struct PathPoint {
        /// X.
        x: Length where within(-1e5, 1e5) => required;
        /// Y.
        y: Length where within(-1e5, 1e5) => required;
        /// Z.
        z: Length where within(-1e5, 1e5) => default("0 mm", "a flat path");
        /// Programmed speed of the way to it.
        speed: Speed where positive => none("that of the point before; the second point needs it");
        /// Smoothing there, 0 to 100 %.
        smoothing: Ratio where within(0.0, 1.0) => none("the tool stops there, or `distance` is told");
        /// Distance before it at which the path is left.
        distance: Length where positive => none("the tool stops there, or `smoothing` is told");
        /// How long the program waits there.
        wait: Time where positive => none("it goes on at once");
    }
}

choice! {
    /// In which frame a log is.
    pub enum LogFrame {
        Fit "fit" => "In another one than the path: it is found, as a rigid motion.",
        Same "same" => "In the path's.",
    }
}

impl LogFrame {
    pub(super) fn freedom(self) -> Freedom {
        match self {
            LogFrame::Fit => Freedom::Rigid,
            LogFrame::Same => Freedom::Same,
        }
    }
}

/// The file, resolved.
#[derive(Debug)]
pub struct Told {
    /// As it is written.
    pub file: MotionLogFile,
    /// The cell.
    pub cell: Option<Cell>,
    /// The robot.
    pub robot: Option<cell::Cell>,
    /// The folder that names are relative to.
    pub folder: PathBuf,
}

/// What contradicts itself.
fn check(file: &MotionLogFile) -> Vec<Problem> {
    let both = |p: &PathPoint| p.smoothing.is_some() && p.distance.is_some();
    let program = file.program.is_some();
    let points = file.points.len();
    settings::broken([
        (
            !program && points < 3,
            file.points.problem("the path that was driven is not told").help(
                "write program = \"…\" with cell, or three [[point]] and more: the start, a corner, the end",
            ),
        ),
        (
            program && points > 0,
            file.points
                .problem("both program and [[point]] tell the path: leave one out"),
        ),
        (
            program && file.cell.is_none(),
            file.program
                .problem("a program is read with its cell: write cell = \"…\""),
        ),
        (
            file.points.iter().any(both),
            file.points
                .problem("a point has smoothing and distance: leave one out"),
        ),
        (
            points > 1 && file.points.value.get(1).is_some_and(|p| p.speed.is_none()),
            file.points
                .problem("the second point tells no speed")
                .help("write speed = \"12.5 mm/s\" for it; later points take it over"),
        ),
        (
            file.joints.is_some() && file.robot.is_none(),
            file.joints
                .problem("joints are followed with the robot's file: write robot = \"…\""),
        ),
        (
            file.from.zip(*file.to).is_some_and(|(from, to)| to.0 <= from.0),
            file.to.problem("the log ends to count before it begins: exchange from and to"),
        ),
    ])
}

/// Reads the file of a log.
///
/// # Errors
/// [`JobError`]: everything wrong, each with its place.
pub fn read(path: &Path) -> Result<Told, JobError> {
    let text = text_of(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    settings::parse(&text, check)
        .and_then(|file| resolve(file, folder))
        .map_err(|problems| JobError::in_file(path, &text, problems))
}

fn resolve(file: MotionLogFile, folder: &Path) -> Result<Told, Problems> {
    let cell = match &*file.cell {
        None => None,
        Some(name) => {
            let read = DataText::load("cell", name, cells::ALL, folder).and_then(|t| Cell::of(&t));
            Some(read.map_err(|e| e.at(&file.cell))?)
        }
    };
    let robot = match &*file.robot {
        None => None,
        Some(name) => {
            let read = DataText::load("robot", name, robots::ALL, folder).and_then(|t| t.robot());
            Some(read.map_err(|e| e.at(&file.robot))?)
        }
    };
    Ok(Told {
        file,
        cell,
        robot,
        folder: folder.to_path_buf(),
    })
}
