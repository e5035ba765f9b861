//! Why nothing could be compared.

use std::path::PathBuf;

use super::samples::SamplesError;
use crate::cancel::{Stop, stops};
use crate::ebm::EbmError;
use crate::ebm::judge::VOXELS_REFERENCE;

meltpath_base::passes_on! {
    /// Why nothing could be compared.
    pub enum CompareError {
        /// What stops any command.
        Stop(Stop),
        /// The field of the run.
        Ebm[EbmError],
        /// A table.
        Samples(SamplesError);

        /// A folder that is no run of an electron beam.
        #[error(
            "{} is no run of an electron beam: {what}; give the folder that `meltpath run` wrote, or a table",
            .path.display()
        )]
        Run {
            /// The folder.
            path: PathBuf,
            /// What is missing.
            what: String,
        },
        /// A run without charts, which would draw its path again.
        #[error(
            "{} has no charts to draw its path again with (charts.preview = \"none\"): compare its tables, such as {}, with another table, or run its job with charts",
            .path.display(), .path.join(VOXELS_REFERENCE).display()
        )]
        NoCharts {
            /// The folder.
            path: PathBuf,
        },
        /// A run without a judge, and no table.
        #[error(
            "{} has nothing to compare its charts with: no {VOXELS_REFERENCE}; a run of an electron beam has it with [judge] solver = \"reference\" in its job; metal of wire-arc is compared by hand, its as-built.stl over a scan; or give a table",
            .path.display()
        )]
        NoJudge {
            /// The folder.
            path: PathBuf,
        },
        /// Two tables that tell different things.
        #[error("`{table}` tells the {ours}, `{against}` the {theirs}: nothing is told by both")]
        Apart {
            /// The table.
            table: String,
            /// What it tells.
            ours: String,
            /// The other one.
            against: String,
            /// What that tells.
            theirs: String,
        },
        /// No sample has a counterpart.
        #[error(
            "none of the {samples} samples of `{table}` can be compared: {places} lie {place_words}, {times} are {time_words}"
        )]
        Nothing {
            /// The table.
            table: String,
            /// Its samples.
            samples: usize,
            /// Without a counterpart in place.
            places: usize,
            /// What that means.
            place_words: &'static str,
            /// Without one in time.
            times: usize,
            /// What that means.
            time_words: &'static str,
        },
    }
}

stops!(CompareError);

impl From<EbmError> for CompareError {
    fn from(error: EbmError) -> Self {
        match error {
            EbmError::Stop(stop) => CompareError::Stop(stop),
            other => CompareError::Ebm(other),
        }
    }
}
