//! Acceptance cases of the scan head (specification *lpbf-scan-head*, § 17): each test bears its case.

mod geometry;
mod identification;
mod jobs;
mod km0;
mod models;
mod reference;
mod trajectory;
