//! Heat under a moving beam: materials, the reference solver with phase change, charts, the semi-analytic engine for moving
//! sources, and what calibrates them. Lengths mm, times s, temperatures K, powers W; theory: Béraud 2016, section 3.2, and the
//! sources named in each module.

pub mod beam;
pub mod calibration;
pub mod charts;
pub mod criteria;
pub mod grid;
pub mod levels;
pub mod material;
pub mod numeric;
pub mod pool;
pub mod solver;
