//! What every room stands on: quantities with units, values with origin and uncertainty, structured warnings,
//! progress and cancellation, checks and verdicts, whole-or-nothing output, the native container,
//! parallel work with the same bits on any thread count, the declaration of settings. Imports no other room.

pub mod container;
mod error;
pub mod number;
pub mod observer;
pub mod output;
pub mod parallel;
mod place;
pub mod provenance;
pub mod quantity;
pub mod reporter;
pub mod resolved;
pub mod settings;
pub mod verdict;

pub use observer::{Cancelled, Observer, Quiet, Silent};
pub use place::Place;
pub use provenance::Provenance;
pub use quantity::{
    Angle, AngularAcceleration, AngularSpeed, BeadWidths, Current, Density, Frequency, Length,
    Pressure, Pure, QuantityError, Ratio, Speed, Temperature, TemperatureDifference, Time, Voltage,
};
pub use reporter::{Reporter, Warning};
pub use resolved::{Origin, Resolved};
pub use verdict::{Check, Fact, Limit, Measure, Status, Verdict};
