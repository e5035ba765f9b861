//! That a person stopped a stage is no error of the stage: each command tells it apart.

/// `cancellable!(CommandError: StageError => Variant, pattern of its cancellation => what it holds; …)` makes the conversions of
/// stages' errors into a command's, which has a variant `Cancelled`.
macro_rules! cancellable {
    ($of:ident: $($error:ty => $variant:ident, $cancelled:pat => $inner:expr;)+) => {
        $(impl From<$error> for $of {
            fn from(error: $error) -> Self {
                match error {
                    $cancelled => $of::Cancelled($inner),
                    other => $of::$variant(other),
                }
            }
        })+
    };
}
pub(crate) use cancellable;
