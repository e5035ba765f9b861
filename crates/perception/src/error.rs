//! Why a record cannot be used.

use meltpath_base::settings::Problems;

/// Why a record cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file does not open or read.
    #[error("cannot read `{file}`: {message}")]
    File {
        /// Which file.
        file: String,
        /// What was said.
        message: String,
    },
    /// The mapping is wrong: each problem with its place and what to write.
    #[error(transparent)]
    Mapping(#[from] Problems),
    /// A kind of file that is not read.
    #[error("`{file}` is no record that can be read: write it as .csv, .parquet or .mat (level 5)")]
    Kind {
        /// Which file.
        file: String,
    },
    /// A column that is not there.
    #[error("`{file}` has no column {column}: it has {known}")]
    Column {
        /// Which file.
        file: String,
        /// What was looked for.
        column: String,
        /// What there is.
        known: String,
    },
    /// Rows asked for that are not there.
    #[error("`{file}` has {rows} rows, the mapping asks for rows {first} to {last}")]
    Rows {
        /// Which file.
        file: String,
        /// How many it has.
        rows: usize,
        /// First asked.
        first: usize,
        /// Last asked.
        last: usize,
    },
    /// A value that is none.
    #[error(
        "`{file}`, column {column}, row {row}: no number there; cut the record before it (rows = [{}, {}]) or repair the gap",
        cut[0], cut[1]
    )]
    NotFinite {
        /// Which file.
        file: String,
        /// Which column.
        column: String,
        /// Row from 1.
        row: usize,
        /// The longest run of rows without such a value in this column.
        cut: [usize; 2],
    },
    /// Samples are missing, or times run backwards.
    #[error(
        "`{file}`: {step:.6} s between rows {row} and {} where {usual:.6} s are usual: samples are missing or out of order; use the longest piece without a gap, rows = [{}, {}]",
        row + 1, cut[0], cut[1]
    )]
    Gap {
        /// Which file.
        file: String,
        /// Row before the gap, from 1.
        row: usize,
        /// The step there, s.
        step: f64,
        /// The usual step, s.
        usual: f64,
        /// The longest piece without a gap.
        cut: [usize; 2],
    },
    /// The times disagree with the stated sample time.
    #[error(
        "`{file}`: its column of times says {found:.9} s a sample, the mapping says {stated:.9} s: correct or remove sample_time"
    )]
    Sampling {
        /// Which file.
        file: String,
        /// What the column says, s.
        found: f64,
        /// What the mapping says, s.
        stated: f64,
    },
    /// A channel that a reader needs is missing.
    #[error(
        "the record has no channel \"{name}\": it has {known}; add [channels.{name}] to the mapping"
    )]
    Channel {
        /// What was looked for.
        name: String,
        /// What there is.
        known: String,
    },
}
