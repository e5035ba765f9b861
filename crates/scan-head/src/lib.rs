//! The laser scan head: where the laser *really* goes, and what can be tuned without the machine.
//!
//! Source: Rasoanarivo 2020 (NNT 2020UPASC005), chapter 2; its errata and our readings: docs/theory/sources.md. The chain, each
//! block usable alone:
//!
//! | block | module |
//! | --- | --- |
//! | one axis: pre-filter, angle control, motor, friction | [`axis`] |
//! | mirrors, windows, focus, beam, correction table | [`optics`] |
//! | the whole head, streaming; vectors, time interpolation, laser gate | [`head`] |
//! | design of the angle control, and the path ahead | [`servo`] |
//! | motor from records | [`identification`] |
//! | contour errors, fill, energy, delays | [`measures`] |
//! | the fastest recipe within bounds | [`search`] |
//! | the health of an axis | [`health`] |
//! | heads and recipes as files | [`files`] |
//!
//! Lengths are mm, times s, angles rad (mechanical angles of the mirrors), currents A, voltages V; the motor is in SI units.

pub mod axis;
pub mod files;
pub mod head;
pub mod health;
pub mod identification;
pub mod measures;
pub mod optics;
pub mod search;
pub mod servo;
