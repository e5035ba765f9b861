//! What people look at: series, tables, fields in; offline HTML, ParaView files, CSV and Parquet out. Knows no physics.
//!
//! - [`html::write_html`] writes a [`html::Report`]: verdict, 3D view of a [`scene::Scene`], [`plot::Plot`]s,
//!   [`table::Table`]s, [`sheet::OperatorSheet`], warnings, provenance;
//! - [`picture`] draws still pictures of things in space and writes them as PNG;
//! - [`vtk`] writes lines, meshes and height maps for ParaView;
//! - [`series`] writes columns as CSV or Parquet, block by block.

pub mod colour;
pub mod escape;
pub mod html;
pub mod number;
pub mod packing;
pub mod picture;
pub mod plot;
mod provenance_html;
pub mod scene;
pub mod series;
pub mod sheet;
pub mod table;
pub mod verdict_html;
pub mod vtk;
