//! Previews on charts: charts for the job's beam, a path drawn with them, pictures of it in time.

pub(crate) mod along;
pub(crate) mod charts;
pub mod drawn;
pub mod film;
