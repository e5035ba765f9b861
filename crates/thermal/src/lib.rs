//! Heat under a moving beam: materials, the reference solver with phase change, the semi-analytic engine for moving
//! sources. Lengths mm, times s, temperatures K, powers W; theory: Béraud 2016, section 3.2, and the sources named in
//! each module.

pub mod as_built;
pub mod beam;
mod block;
pub mod chart;
pub mod chart_build;
pub mod chart_file;
pub mod chart_simulation;
pub mod closed_form;
pub mod criteria;
pub mod enthalpy;
mod fast_exp;
pub mod fit;
pub mod focus;
pub mod grid;
pub mod history;
mod implicit;
mod kernel;
pub mod law;
pub mod layering;
pub mod learning;
pub mod lever;
pub mod material;
pub mod material_file;
pub mod medium;
pub mod modulation;
pub mod moving_source;
pub mod neighbourhood;
pub mod nested;
pub mod order;
pub mod passes;
pub mod peaks;
pub mod pool;
pub mod prediction;
pub mod rates;
pub mod real;
pub mod run;
mod sheet;
pub mod solver;
pub mod source;
pub mod speed;
pub mod strategy;
pub mod surface;
pub mod vector;
