//! What stops every command alike: the person, its file, its output. That a person stopped a stage is no error of the stage: each
//! command tells it apart.

use meltpath_base::Cancelled;
use meltpath_base::output::OutputError;

use crate::job::JobError;

meltpath_base::passes_on! {
    /// What stops any command.
    pub enum Stop {
        /// The person.
        Cancelled(Cancelled),
        /// A file that cannot be read, or does not make sense.
        Job(JobError),
        /// Output that cannot be written.
        Output(OutputError),
    }
}

/// `stops!(CommandError)` takes what makes a [`Stop`] into a command's error, which has a variant of that name.
macro_rules! stops {
    ($of:ident) => {
        stops!($of: meltpath_base::Cancelled, crate::job::JobError, meltpath_base::output::OutputError);
    };
    ($of:ident: $($part:ty),+) => {
        $(impl From<$part> for $of {
            fn from(part: $part) -> Self {
                $of::Stop(part.into())
            }
        })+
    };
}
pub(crate) use stops;

/// `cancellable!(CommandError: StageError => Variant, pattern of its cancellation => what it holds; …)` makes the conversions of
/// stages' errors into a command's, which can be cancelled.
macro_rules! cancellable {
    ($of:ident: $($error:ty => $variant:ident, $cancelled:pat => $inner:expr;)+) => {
        $(impl From<$error> for $of {
            fn from(error: $error) -> Self {
                match error {
                    $cancelled => $inner.into(),
                    other => $of::$variant(other),
                }
            }
        })+
    };
}
pub(crate) use cancellable;
