//! What looks for better beam paths and judges them: levers on a path, orders of its lines, learning, correction, prediction,
//! control, judgement by the reference solver. Lengths mm, times s, temperatures K, powers W.

pub mod bed;
pub mod controller;
pub mod correction;
pub mod error;
pub mod interrupted;
pub mod judgement;
pub mod layer_heat;
pub mod learning;
pub mod lever;
pub mod order;
pub mod part;
pub mod peaks;
pub mod prediction;
pub mod speed;
