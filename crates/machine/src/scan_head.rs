//! The laser scan head: where the laser *really* goes, and what can be tuned without the machine.
//!
//! Source: Rasoanarivo 2020 (NNT 2020UPASC005), chapter 2; its errata and our readings: docs/theory/sources.md. The chain, each
//! block usable alone:
//!
//! | block | module |
//! | --- | --- |
//! | job: vectors and recipes | [`job`], [`plate`] |
//! | time interpolation | [`interpolation`] |
//! | inverse transform | [`correction`], on [`geometry`] and [`focus`] |
//! | pre-filter | [`prefilter`] |
//! | angle control | [`servo_loop`] |
//! | galvanometer | [`galvanometer`], [`friction`], [`plant`] |
//! | one axis, streaming | [`axis`] |
//! | direct geometry, optics | [`geometry`], [`focus`], [`beam`] |
//! | laser gate | [`gate`] |
//! | the whole head, streaming | [`head`] |
//! | design of the angle control | [`servo`], [`servo_synthesis`], [`servo_hinf`], [`servo_robust`], [`servo_refine`], [`servo_compare`], [`servo_file`] |
//! | set-points shaped with the path ahead | [`servo_preview`] |
//! | motor from records | [`identification`], [`identification_modes`] |
//! | judgement | [`contour_error`], [`fill_rate`], [`delays`], [`km0`], [`km0_bench`] |
//! | the fastest recipe within bounds | [`recipe_search`] |
//! | heads and recipes as files | [`data`] |
//!
//! Lengths are mm, times s, angles rad (mechanical angles of the mirrors), currents A, voltages V; the motor is in SI units.

mod ahead;
pub mod as_motion;
pub mod axis;
pub mod beam;
pub mod contour_error;
pub mod correction;
pub mod data;
pub mod delays;
pub mod energy;
pub mod fill_rate;
pub mod focus;
pub mod friction;
pub mod galvanometer;
pub mod gate;
pub mod geometry;
pub mod head;
pub mod identification;
mod identification_channels;
pub mod identification_modes;
pub mod identification_ramps;
pub mod interpolation;
pub mod job;
pub mod km0;
pub mod km0_bench;
pub mod plant;
pub mod plate;
pub mod prefilter;
pub mod ray;
pub mod recipe_search;
pub mod servo;
pub mod servo_compare;
pub mod servo_file;
pub mod servo_hinf;
pub mod servo_loop;
pub mod servo_preview;
pub mod servo_refine;
pub mod servo_robust;
pub mod servo_synthesis;
