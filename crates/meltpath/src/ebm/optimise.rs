//! Better paths: orders and strategies tried, speed, time on spots, power or spot changed along the path, on the judge's solver, on
//! charts or on even cells.

pub mod on_judge;
pub mod search;

use std::time::Duration;

use meltpath_base::{Length, Provenance};
use meltpath_gun::Gun;
use meltpath_gun::focus::FocusError;
use meltpath_melt_strategy::error::StrategyError;
use meltpath_melt_strategy::learning::Freedom;
use meltpath_melt_strategy::lever::Lever;
use meltpath_melt_strategy::order::{Order, reorder};
use meltpath_thermal::beam::BeamPath;

use crate::ebm::plan::hatch::{BeamHatch, pattern};
use crate::job::ebm::{
    Change, ControllerKind, HatchStrategy, OptimiseMethod, OptimiseSolver, OptimiseTable,
    OrderChoice,
};

/// How far beyond a piece its effect is looked at, mm: the hottest place follows the beam by half its width.
const AHEAD: f64 = 0.2;
/// Rounds of learning that a candidate gets before the best one is chosen.
const TRIAL_ROUNDS: u32 = 4;

/// How a better path is looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimise {
    /// How.
    pub method: OptimiseMethod,
    /// What is changed.
    pub change: Change,
    /// What temperatures are taken from.
    pub solver: OptimiseSolver,
    /// How often it can be changed.
    pub controller: ControllerKind,
    /// Strategies to try besides the hatch's own.
    pub strategies: Vec<HatchStrategy>,
    /// Orders to try.
    pub orders: Vec<OrderChoice>,
    /// Rounds of learning.
    pub rounds: u32,
    /// Drift of the power, a share, over which paths are worth the least that they do; `None` where they are worth what they do as set.
    pub robust: Option<f64>,
    /// Least and greatest factor.
    pub bounds: [f64; 2],
    /// Length of a piece of one factor, mm.
    pub piece: f64,
    /// Edge of a cell of the reference solver, mm.
    pub cell: f64,
    /// Planes of cells in a layer there.
    pub planes: u32,
    /// Its longest step, s.
    pub step: f64,
}

impl Optimise {
    /// From the job's table; `hatch` where one draws, and the solver where the table names none.
    pub fn resolve(
        table: &OptimiseTable,
        hatch: Option<&BeamHatch>,
        usual: OptimiseSolver,
        r: &mut Provenance,
    ) -> Self {
        let solver = table.solver.or_computed(r, usual);
        let rounds = match *table.method {
            OptimiseMethod::Predictive => 0,
            _ => 12,
        };
        let piece = match solver {
            OptimiseSolver::Reference => *table.cell,
            OptimiseSolver::Charts => Length(0.25),
            // as [correct] has it: a quarter of the usual spot
            OptimiseSolver::Judge => Length(0.1),
        };
        let own = hatch.map(|h| h.plan.pattern);
        let wanted = table.strategies.iter().copied();
        Optimise {
            method: *table.method,
            change: *table.change,
            solver,
            controller: *table.controller,
            strategies: wanted.filter(|s| Some(pattern(*s)) != own).collect(),
            orders: table.orders.value.clone(),
            rounds: table.rounds.or_computed(r, rounds),
            robust: table.robust.as_ref().map(|drift| drift.0),
            bounds: table.speeds.map(|s| s.0),
            piece: table.piece.or_computed(r, piece).0,
            cell: table.cell.0,
            planes: *table.planes,
            step: table.step.0,
        }
    }

    /// The given path, those of other strategies, and the orders to try.
    fn candidates(
        &self,
        given: &BeamPath,
        others: &[(String, BeamPath)],
    ) -> Result<Vec<(String, BeamPath)>, StrategyError> {
        let mut found = vec![("as given".to_owned(), given.clone())];
        found.extend_from_slice(others);
        for choice in &self.orders {
            let order = match choice {
                OrderChoice::AsGiven => continue,
                OrderChoice::EverySecond => Order::Every(2),
                OrderChoice::EveryThird => Order::Every(3),
                OrderChoice::EveryFourth => Order::Every(4),
                OrderChoice::FromTheMiddle => Order::FromTheMiddle,
                OrderChoice::Backwards => Order::Backwards,
            };
            // links between lines are shorter than two voxels
            let path = reorder(given, order, 0.15)?;
            found.push((choice.word().to_owned(), path));
        }
        Ok(found)
    }

    /// How often a path is drawn on the judge's solver, with `candidates` to choose from; what is drawn ahead not counted.
    pub fn drawings(&self, candidates: usize) -> u64 {
        let trials = match (candidates, self.method) {
            (1, OptimiseMethod::Predictive) => 1,
            (0 | 1, _) => 0,
            (some, _) => some as u64 * u64::from(TRIAL_ROUNDS + 1),
        };
        let powers = self.robust.map_or(1, |_| 3);
        powers * (trials + u64::from(self.rounds) + 1)
    }

    /// What is tried: the path as given, other strategies and orders.
    pub fn tried(&self) -> usize {
        let orders = self.orders.iter().filter(|o| **o != OrderChoice::AsGiven);
        1 + self.strategies.len() + orders.count()
    }

    /// What looking on the reference solver costs where one drawing takes `one`, in words.
    fn cost(&self, one: Duration) -> String {
        let tried = match self.tried() {
            1 => 0,
            some => some as u32 * (TRIAL_ROUNDS + 1),
        };
        let drawings = f64::from(tried + self.rounds + 1) + self.ahead();
        let one = one.as_secs_f64();
        format!(
            "as much as {drawings:.0} drawings of {one:.1} s in all, {:.1} min",
            drawings * one / 60.0
        )
    }

    /// How many drawings drawing ahead takes: each piece twice, a little further than it reaches, and then once.
    pub fn ahead(&self) -> f64 {
        match self.method {
            OptimiseMethod::Predictive => 1.0 + 2.0 * (1.0 + AHEAD / self.predicted_piece()),
            OptimiseMethod::Learning | OptimiseMethod::Accelerate | OptimiseMethod::Pid => 0.0,
        }
    }

    /// Length of the pieces that are predicted, mm.
    fn predicted_piece(&self) -> f64 {
        self.piece.max(0.125)
    }

    fn lever(&self, gun: &Gun) -> Result<Lever, FocusError> {
        Ok(match self.change {
            Change::Speed => Lever::Speed,
            Change::Dwell => Lever::Dwell,
            Change::Current => Lever::Power,
            Change::Focus => Lever::Spot(gun.spots()?),
        })
    }

    fn freedom(&self) -> Freedom {
        match self.controller {
            ControllerKind::Continuous => Freedom::Continuous,
            ControllerKind::PerLine => Freedom::PerLine,
        }
    }
}
