//! Errors that mostly pass on those of the rooms below.

/// Declares an error: first the variants that pass another error on, in its own words and by `?`, or in square brackets where `?`
/// shall not make it; then after a semicolon those with words of their own, written as `thiserror` reads them (it does not take
/// `#[error(transparent)]` there). The crate that declares it depends on `thiserror`.
///
/// ```
/// meltpath_base::passes_on! {
///     /// Why a file says nothing.
///     #[derive(PartialEq)]
///     pub enum ReadError {
///         /// A number.
///         Number(std::num::ParseFloatError),
///         /// A count.
///         Count(std::num::ParseIntError),
///         /// Another number, where that is to be told.
///         Other[std::num::ParseFloatError];
///
///         /// The file is empty.
///         #[error("the file is empty")]
///         Empty,
///     }
/// }
/// fn read(text: &str) -> Result<f64, ReadError> {
///     if text.is_empty() { Err(ReadError::Empty) } else { Ok(text.parse()?) }
/// }
/// assert_eq!(read("1.5"), Ok(1.5));
/// assert_eq!(read("x").unwrap_err().to_string(), "invalid float literal");
/// ```
#[macro_export]
macro_rules! passes_on {
    (
        $(#[$about:meta])*
        $vis:vis enum $name:ident {
            $( $(#[$doc:meta])* $variant:ident $( ($error:ty) )? $( [$held:ty] )? ),+ $(,)? $(; $($own:tt)*)?
        }
    ) => {
        #[derive(Debug, thiserror::Error)]
        $(#[$about])*
        $vis enum $name {
            $( $(#[$doc])* #[error(transparent)] $variant($(#[from] $error)? $($held)?), )+
            $($($own)*)?
        }
    };
}
