//! What `[optimise]` takes its temperatures from where a job does not say it, and what contradicts that.

use meltpath_base::settings::{Problem, broken};

use super::{
    Change, ChartPreview, EbmJob, HatchStrategy, JudgeSolver, OptimiseMethod, OptimiseSolver,
    OptimiseTable, WindowModel,
};

impl EbmJob {
    /// What `[optimise]` takes its temperatures from, as written or usual; `None` without the table.
    pub fn search(&self) -> Option<OptimiseSolver> {
        let table = self.optimise.as_ref()?;
        Some(table.solver.unwrap_or_else(|| self.usual_search(table)))
    }

    /// The same where the table does not say it.
    pub fn usual_search(&self, table: &OptimiseTable) -> OptimiseSolver {
        let online = matches!(
            *table.method,
            OptimiseMethod::Accelerate | OptimiseMethod::Pid
        );
        let placed = self.window.good.is_written()
            || self.window.body.is_written()
            || *self.window.model == Some(WindowModel::Solver);
        if online || !placed || *self.judge.solver == JudgeSolver::None {
            OptimiseSolver::Charts
        } else {
            OptimiseSolver::Judge
        }
    }

    /// Whether charts show the path, as written or usual: where the search is on the judge's solver nothing else needs them.
    pub fn preview(&self) -> ChartPreview {
        let usual = match self.search() {
            Some(OptimiseSolver::Judge) => ChartPreview::None,
            Some(OptimiseSolver::Charts | OptimiseSolver::Reference) | None => ChartPreview::Drawn,
        };
        self.charts.preview.unwrap_or(usual)
    }

    /// Values of `[optimise]` that contradict each other, or what it looks on.
    pub(super) fn check_optimise(&self, o: &OptimiseTable) -> Vec<Problem> {
        let online = matches!(*o.method, OptimiseMethod::Accelerate | OptimiseMethod::Pid);
        let solver = o.solver.unwrap_or_else(|| self.usual_search(o));
        let charts = solver == OptimiseSolver::Charts;
        let hatch = self.hatch.as_ref();
        let own = hatch.map(|h| *h.strategy);
        let mut drawn = o.strategies.iter().copied().chain(own);
        let [slowest, fastest] = *o.speeds;
        broken([
            (
                slowest.0 >= fastest.0,
                o.speeds
                    .problem("optimise.speeds leave nothing to change")
                    .help("write the least share first, such as [\"60 %\", \"300 %\"]"),
            ),
            (
                online && (!charts || *o.change != Change::Speed),
                o.method
                    .problem("optimise.method accelerate and pid change the speed, on charts")
                    .help("use learning or predictive for current and focus, and on a solver"),
            ),
            (
                matches!(*o.change, Change::Current | Change::Focus) && charts && !online,
                o.change
                    .problem("optimise.change current and focus need a solver, and the path is looked for on charts")
                    .help("write solver = \"judge\" under [optimise], or \"reference\" where [judge] is off: charts know only the settings they were made for"),
            ),
            (
                solver == OptimiseSolver::Judge && *self.judge.solver == JudgeSolver::None,
                o.solver
                    .problem("optimise.solver = \"judge\" draws on the solver of [judge], which is \"none\"")
                    .help("leave judge.solver out, or write solver = \"charts\" or \"reference\" under [optimise]"),
            ),
            (
                o.robust.is_some() && solver != OptimiseSolver::Judge,
                o.robust
                    .problem("optimise.robust draws on the judge's solver with less and with more power, and the path is looked for on another model")
                    .help("write solver = \"judge\" under [optimise], with a window that has its place there (window.body, window.good, or model = \"solver\"), or leave robust out"),
            ),
            (
                *o.change == Change::Dwell && own.is_some() && drawn.any(|s| s != HatchStrategy::Spots),
                o.change
                    .problem("optimise.change = \"dwell\" changes the time on spots, and [hatch] or optimise.strategies draw lines")
                    .help("write strategy = \"spots\" under [hatch] and no other under optimise.strategies, or change speed or current"),
            ),
            (
                !o.strategies.is_empty() && hatch.is_none(),
                o.strategies
                    .problem("optimise.strategies are those of [hatch], which is not there")
                    .help("let [hatch] draw the region, or try optimise.orders"),
            ),
        ])
        .into_iter()
        .chain(of_even_cells(o, solver))
        .collect()
    }
}

/// Cells, planes and step that only the even ones have, where these are not what is looked on.
fn of_even_cells(o: &OptimiseTable, solver: OptimiseSolver) -> Vec<Problem> {
    let other = solver == OptimiseSolver::Judge;
    let told = |what: &str| {
        format!(
            "optimise.{what} is of solver = \"reference\", and the path is looked for on the judge's solver"
        )
    };
    let help =
        |what: &str| format!("write judge.{what}, or solver = \"reference\" under [optimise]");
    let key =
        |written: bool, problem: Problem, what: &str| (other && written, problem.help(help(what)));
    broken([
        key(o.cell.is_written(), o.cell.problem(told("cell")), "cell"),
        key(
            o.planes.is_written(),
            o.planes.problem(told("planes")),
            "planes",
        ),
        key(o.step.is_written(), o.step.problem(told("step")), "step"),
    ])
}
