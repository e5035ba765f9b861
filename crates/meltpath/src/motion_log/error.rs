//! Why nothing was found in a log.

use meltpath_perception::RecordError;
use meltpath_programs::ProgramError;
use meltpath_robot::MotionError;
use meltpath_robot::identification::LogError;
use meltpath_robot::identification::align::AlignError;
use meltpath_robot::identification::driven::PathError;
use meltpath_robot::identification::fit::IdentificationError;

use crate::cancel::{Stop, stops};
use crate::waam::program::ProgramStageError;

meltpath_base::passes_on! {
    /// Why nothing was found in a log.
    pub enum MotionLogError {
        /// What stops any command.
        Stop(Stop),
        /// The log's file.
        Record(RecordError),
        /// The program.
        Program(ProgramStageError),
        /// The program cannot be followed.
        Execute(ProgramError),
        /// The path.
        Path(PathError),
        /// Motion cannot be simulated.
        Motion(MotionError);

        /// A column that is not there.
        #[error("{file} has no {wanted}; it has {there}: name the columns (time, places or joints), by their headings or by their places from 1")]
        Column {
            /// The log.
            file: String,
            /// What was looked for.
            wanted: String,
            /// What is there.
            there: String,
        },
        /// The log.
        #[error("{file}: {why}")]
        Log {
            /// The log.
            file: String,
            /// What is wrong.
            why: LogError,
        },
        /// Log and path.
        #[error("{file}: {why}")]
        Align {
            /// The log.
            file: String,
            /// What is wrong.
            why: AlignError,
        },
        /// Axes that the robot does not have.
        #[error("external has {told} columns, and {robot} has other axes beside its arm: name a column for each, the track first")]
        External {
            /// Columns told.
            told: usize,
            /// The robot.
            robot: String,
        },
        /// Points twice.
        #[error("point {point} is where the point before it is: leave it out, or write wait there")]
        SamePoint {
            /// Which, from 1.
            point: usize,
        },
        /// No moves.
        #[error("the program moves nowhere along lines or arcs from a stop to a stop: nothing can be compared with the log")]
        NoMoves,
        /// Weaves.
        #[error("the program weaves, and a weave hides how corners are driven: drive it without weaving (a dry run does)")]
        Weaves,
        /// The least squares.
        #[error("{file}: {why}")]
        Fit {
            /// The log.
            file: String,
            /// What is wrong.
            why: IdentificationError,
        },
    }
}

stops!(MotionLogError);
