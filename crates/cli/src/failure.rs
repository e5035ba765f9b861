//! Why a command ended without a result, as far as a person is told differently.

use std::path::Path;
use std::sync::Arc;

use meltpath::cancel::Stop;
use meltpath::chain::RunError;
use meltpath::compare::CompareError;
use meltpath::data::DataFileError;
use meltpath::fit::FitCommandError;
use meltpath::focus::FocusCommandError;
use meltpath::health::HealthError;
use meltpath::identify::IdentifyError;
use meltpath::inspect::InspectError;
use meltpath::job::JobError;
use meltpath::measure::MeasureError;
use meltpath::motion_log::MotionLogError;
use meltpath::reach::ReachError;
use meltpath::records::RecordsError;
use meltpath::start::StartError;
use meltpath::tune::TuneError;
use meltpath::waam::WaamError;
use meltpath_base::Cancelled;
use miette::{LabeledSpan, MietteDiagnostic, NamedSource, Report};
use serde_json::json;

use crate::exit_code::{INPUT_WRONG, INTERRUPTED};
use crate::show::{line_to_stderr, tell};

/// Why a command ended without a result.
pub(crate) enum Failure {
    /// The person stopped it.
    Cancelled,
    /// A file that a person wrote, with the places of what is wrong in it.
    Written(JobError),
    /// Anything else, in words.
    Other(String),
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Failure::Cancelled
    }
}

impl From<JobError> for Failure {
    fn from(error: JobError) -> Self {
        Failure::Written(error)
    }
}

impl From<DataFileError> for Failure {
    fn from(error: DataFileError) -> Self {
        match error {
            // each problem brings its own file
            DataFileError::Content(problems) => {
                Failure::Written(JobError::in_file(Path::new(""), "", problems))
            }
            other => Failure::Other(other.to_string()),
        }
    }
}

/// One conversion per error: the variants named are told differently, the others in words.
macro_rules! failures {
    ($($error:ident: $($variant:ident)+;)+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                match error {
                    $($error::$variant(inner) => Failure::from(inner),)+
                    other => Failure::Other(other.to_string()),
                }
            }
        })+
    };
}
failures! {
    RunError: Cancelled Job;
    Stop: Cancelled Job;
    WaamError: Stop;
    CompareError: Stop;
    FitCommandError: Stop;
    FocusCommandError: Stop;
    MeasureError: Stop;
    MotionLogError: Stop;
    RecordsError: Stop;
    TuneError: Stop;
    InspectError: Cancelled Robot;
    ReachError: Cancelled Robot;
}

/// Errors that are told in words alone.
macro_rules! in_words {
    ($($error:ident)+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Failure::Other(error.to_string())
            }
        })+
    };
}
in_words!(HealthError IdentifyError StartError);

impl Failure {
    /// Shows it and returns the exit code.
    pub(crate) fn show(self) -> u8 {
        match self {
            Failure::Cancelled => {
                tell("errors", json!(["cancelled"]));
                line_to_stderr("cancelled: nothing was written");
                return INTERRUPTED;
            }
            Failure::Other(message) => {
                line_to_stderr(&format!("error: {message}"));
                tell("errors", json!([message]));
            }
            Failure::Written(error) => show_written(error),
        }
        INPUT_WRONG
    }
}

/// Errors of a file that a person wrote, each with its place marked in the text.
fn show_written(error: JobError) {
    let JobError::Text {
        path,
        text,
        problems,
    } = error
    else {
        line_to_stderr(&format!("error: {error}"));
        tell("errors", json!([error.to_string()]));
        return;
    };
    let told: Vec<String> = problems.iter().map(ToString::to_string).collect();
    tell("errors", json!(told));
    let written = Arc::new(NamedSource::new(path.display().to_string(), text));
    for problem in problems {
        // a mistake in a file that the job names is shown there
        let source = problem.file.map_or_else(
            || Arc::clone(&written),
            |file| Arc::new(NamedSource::new(&file.name, file.text.clone())),
        );
        let mut diagnostic = MietteDiagnostic::new(problem.message);
        if let Some(help) = problem.help {
            diagnostic = diagnostic.with_help(help);
        }
        if let Some(span) = problem.span {
            diagnostic = diagnostic.with_label(LabeledSpan::underline(span));
        }
        line_to_stderr(&format!(
            "{:?}",
            Report::new(diagnostic).with_source_code(source)
        ));
    }
}
