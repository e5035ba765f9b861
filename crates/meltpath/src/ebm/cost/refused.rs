//! What no machine could do is refused before it begins, by `meltpath doctor` as by a run; what takes more than a day is told.

use meltpath_base::Reporter;
use meltpath_base::settings::Problem;
use meltpath_geometry::math::DVec3;
use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::part::{Rectangle, within};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::simulation::Memory;

use super::before_hatching::voxels;
use super::charts::cost;
use super::judged::{Fineness, Seconds, corrected, hull, judged, memory, searched};
use super::lever::{self, Lever, Need, of_room, of_time, refused, subject};
use super::words::time;
use super::{drawing, room, searching};
use crate::ebm::plan::Plan;
use crate::ebm::preview::charts::{beam_settings, wanted};
use crate::ebm::settings::Judge;
use crate::job::Problems;
use crate::job::ebm::{ChartPreview, EbmJob, JudgeGround, OptimiseSolver};
use crate::machine::Machine;

/// Bytes for each piece of a path that is changed by itself; measured on 44 million of them.
const PER_PIECE: f64 = 160.0;
/// Bytes of a cell of the solver that `[optimise]` draws on, and of the two copies that it starts from.
const PER_CELL: f64 = 66.0;
/// Steps of such cells in a second of one core.
const STEPPED: f64 = 1e8;
/// Seconds of a day.
const DAY: f64 = 86_400.0;

/// Refuses what could not be done on `machine`; warns of what takes it more than a day.
///
/// # Errors
/// Everything that asks for too much, each with the setting that does.
pub(in crate::ebm) fn check(
    plan: &Plan,
    machine: Machine,
    reporter: &Reporter,
) -> Result<(), Problems> {
    let job = &plan.settings.job;
    let asked = Asked { plan, job, machine };
    let mut found = Vec::new();
    if let Some(judge) = &plan.settings.judge {
        found.extend(asked.of_judge(judge, reporter));
        found.extend(asked.of_part(judge));
    }
    if plan.settings.preview == ChartPreview::Drawn {
        found.extend(asked.of_charts());
    }
    found.extend(asked.of_search());
    found.extend(asked.of_pieces());
    if found.is_empty() {
        Ok(())
    } else {
        Err(found.into())
    }
}

/// What is asked of a machine.
struct Asked<'a> {
    plan: &'a Plan,
    job: &'a EbmJob,
    machine: Machine,
}

impl Asked<'_> {
    fn memory(&self, bytes: f64) -> Need {
        Need::Memory([bytes, self.machine.bytes])
    }

    fn size(&self) -> [f64; 2] {
        let hull = hull(self.plan.drawn());
        [0, 1].map(|a| (hull.high[a] - hull.low[a]).max(0.0))
    }

    fn extent(&self) -> Lever {
        Lever::of_extent(subject(self.job), self.size())
    }

    /// Seconds of all paths, and of those with the beam on.
    fn seconds(&self) -> [f64; 2] {
        let Seconds { lit, dark } = Seconds::of(self.plan.drawn());
        [lit + dark, lit]
    }

    /// Memory and time of the judge.
    fn of_judge(&self, judge: &Judge, reporter: &Reporter) -> Vec<Problem> {
        let settings = &self.plan.settings;
        let hull = hull(self.plan.drawn());
        let lower = self.plan.lower.len();
        let bytes = |resolution: Resolution| {
            room::judge(
                settings,
                judge,
                (&hull, lower),
                &resolution,
                self.machine.cores,
            )
        };
        let needed = memory(self.plan, judge, self.machine.cores);
        let mut levers = of_room(self.job, judge);
        levers.push(self.extent());
        levers.extend(self.of_domain(judge, needed / bytes(judge.resolution)));
        let room = refused("the judge", self.memory(needed), levers);
        let rounds = settings.correct.as_ref();
        let rounds = rounds.map_or(0.0, |how| corrected(self.plan, judge, how));
        let search = searching(self.plan);
        let search = search.map_or(0.0, |how| searched(self.plan, judge, how));
        let seconds = judged(self.plan, judge) + rounds + search;
        let pace = refused("the judge", Need::Time(seconds), self.of_pace(judge));
        if room.is_none() && pace.is_none() {
            self.tell(seconds, reporter);
        }
        room.into_iter().chain(pace).collect()
    }

    /// A part to be judged that the beam does not enter.
    fn of_part(&self, judge: &Judge) -> Option<Problem> {
        let part = judge.part?;
        let entered = within(&self.plan.path, &part.grown(judge.beyond));
        // what is wrong with the path itself is told where it is read
        if entered.is_err() || entered.is_ok_and(|path| path.is_some()) {
            return None;
        }
        let Rectangle { low, high } = hull([&self.plan.path]);
        let message = format!(
            "judge.part: the beam is never on there; it draws from x {:.3}, y {:.3} to x {:.3}, y {:.3} mm",
            low[0], low[1], high[0], high[1]
        );
        let help = "move the part into the path, or leave it out to judge all of it";
        Some(self.job.judge.part.problem(message).help(help))
    }

    /// Warns of a run that takes days.
    fn tell(&self, seconds: f64, reporter: &Reporter) {
        let here = seconds / self.machine.cores as f64;
        if here > DAY {
            reporter.warn(
                "long-run",
                format!(
                    "the judge takes about {} of one core, {} on the {} of this machine",
                    time(seconds),
                    time(here),
                    self.machine.cores
                ),
                "larger cells (judge.cell), a part of the section (judge.part), or fewer layers show most of it sooner; a run that is stopped goes on from the layers it has drawn",
            );
        }
    }

    /// Paths that take so long that the ground which heat reaches is `times` as large as that of a short one.
    fn of_domain(&self, judge: &Judge, times: f64) -> Vec<Lever> {
        if judge.ground == JudgeGround::ThesisBox || times < 2.0 {
            return Vec::new();
        }
        let mut levers = of_time(&self.plan.settings, self.seconds());
        levers.retain(Lever::asks_more);
        let nearer =
            "; or judge.ground = \"thesis-box\", which ends half a millimetre from the path";
        for lever in &mut levers {
            lever.scale_to(times, nearer);
        }
        levers
    }

    /// What makes the judge slow.
    fn of_pace(&self, judge: &Judge) -> Vec<Lever> {
        let table = &self.job.judge;
        let layer = self.job.ebm.layer.0;
        let own = Fineness::of(judge, layer);
        let beside = |usual: Fineness| own.times() / usual.times();
        let mut levers = vec![
            Lever::of(
                &table.cell,
                beside(Fineness {
                    cell: 0.031_25,
                    ..own
                }),
                "a larger one: the time goes with its fourth power; left out it is 0.03125 mm",
            ),
            Lever::of(
                &table.step,
                beside(Fineness { step: 2e-5, ..own }),
                "a longer one; left out it is as long as is stable",
            ),
            Lever::of(
                &table.planes,
                beside(Fineness { planes: 1, ..own }),
                "fewer: the judge tells what twice as many change",
            ),
            lever::layer(&self.job.ebm.layer, beside(Fineness { layer: 0.05, ..own })),
            Lever::of(
                &table.between,
                table.between.0 / 10.0,
                "is it in s? a rake and a preheating take some 10 s",
            ),
            self.extent(),
        ];
        levers.extend(of_time(&self.plan.settings, self.seconds()));
        levers
    }

    /// Voxels and drawing of the charts, and the charts themselves.
    fn of_charts(&self) -> Vec<Problem> {
        let (settings, job) = (&self.plan.settings, self.job);
        let mut found = Vec::new();
        found.extend(voxels(
            settings,
            job,
            self.size(),
            (self.extent(), self.machine),
        ));
        let mut levers = of_time(settings, self.seconds());
        let table = &job.simulation;
        levers.extend([
            Lever::of(
                &table.step,
                2.5e-6 / table.step.0,
                "a longer one; left out it is 2.5 µs",
            ),
            lever::voxel(job),
            self.extent(),
        ]);
        let seconds = drawing(self.plan).seconds;
        found.extend(refused("drawing with charts", Need::Time(seconds), levers));
        if settings.chart_files.is_empty() {
            found.extend(self.of_computing());
        }
        found
    }

    /// Charts that no computing could give.
    fn of_computing(&self) -> Vec<Problem> {
        let (settings, job) = (&self.plan.settings, self.job);
        let grounds = match settings.simulation.memory {
            Memory::None => 1.0,
            Memory::Ground(_) => 4.0,
        };
        let wide = beam_settings(self.plan.drawn().into_iter())
            .into_iter()
            .max_by(|a, b| a[1].total_cmp(&b[1]));
        let Some(widest) = wide else {
            return Vec::new();
        };
        let charts = wanted(settings, widest);
        let needed = cost(&charts, grounds);
        let levers = || {
            let spot = widest[1] / 0.4;
            let width = Lever::of_some(&job.ebm.diameter, spot.powi(2), "is it in mm?");
            let both = [lever::spacing(&job.charts.spacing), lever::penetration(job)];
            both.into_iter().chain(width)
        };
        let bytes = refused("computing charts", self.memory(needed.bytes), levers());
        let seconds = || refused("computing charts", Need::Time(needed.seconds), levers());
        bytes.or_else(seconds).into_iter().collect()
    }

    /// The solver on which `[optimise]` looks for a better path.
    fn of_search(&self) -> Vec<Problem> {
        let Some((how, table)) = self
            .plan
            .settings
            .optimise
            .as_ref()
            .zip(self.job.optimise.as_ref())
        else {
            return Vec::new();
        };
        if how.solver != OptimiseSolver::Reference {
            return Vec::new();
        }
        let height = self.job.ebm.layer.0 / f64::from(how.planes);
        let columns: f64 = self
            .size()
            .map(|s| ((s + 1.0) / how.cell).ceil())
            .iter()
            .product();
        let cells = columns * (0.2 / height + 4.0);
        let levers = |power: i32| {
            [
                Lever::of(
                    &table.cell,
                    (0.0625 / how.cell).powi(power),
                    "a larger one; left out it is 0.0625 mm",
                ),
                Lever::of(&table.planes, f64::from(how.planes), "fewer"),
                Lever::of(
                    &table.step,
                    8e-6 / how.step,
                    "a longer one; left out it is 8 µs",
                ),
                lever::layer(&self.job.ebm.layer, 0.05 / self.job.ebm.layer.0),
                self.extent(),
            ]
        };
        let bytes = refused("[optimise]", self.memory(PER_CELL * cells), levers(2));
        // rows far from the beam sleep: those about it alone are stepped
        let awake = cells.min(16.0 / how.cell.powi(2) * (0.2 / height + 4.0));
        let [_, lit] = self.seconds();
        let seconds = awake * lit / how.step.min(8e-6) / STEPPED * f64::from(how.rounds + 1);
        let seconds = || refused("[optimise]", Need::Time(seconds), levers(4));
        bytes.or_else(seconds).into_iter().collect()
    }

    /// Pieces of the path that are changed each by itself.
    fn of_pieces(&self) -> Vec<Problem> {
        let long = length(&self.plan.path);
        let of = |what: &str, piece: f64, lever: Option<Lever>| {
            refused(what, self.memory(PER_PIECE * long / piece), lever)
        };
        let correct = self
            .plan
            .settings
            .correct
            .as_ref()
            .zip(self.job.correct.as_ref());
        let correct = correct.and_then(|(how, table)| {
            let help = "a longer one; left out it is 0.1 mm, a quarter of the usual spot";
            of(
                "[correct]",
                how.reach,
                Some(Lever::of(&table.reach, 1.0, help)),
            )
        });
        let optimise = self
            .plan
            .settings
            .optimise
            .as_ref()
            .zip(self.job.optimise.as_ref());
        let optimise = optimise.and_then(|(how, table)| {
            let help = "a longer one; left out it is four voxels or a cell";
            of(
                "[optimise]",
                how.piece,
                Lever::of_some(&table.piece, 1.0, help),
            )
        });
        correct.into_iter().chain(optimise).collect()
    }
}

/// Length of a path, mm.
fn length(path: &BeamPath) -> f64 {
    let at = |p: &meltpath_thermal::beam::BeamPoint| DVec3::new(p.x, p.y, 0.0);
    let pairs = path.points().windows(2);
    pairs.map(|w| at(&w[0]).distance(at(&w[1]))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ebm::plan::planned;
    use crate::job::{Job, parse};
    use meltpath_base::Silent;
    use std::path::Path;

    fn plan(hatch: &str) -> Plan {
        let text = format!(
            "[process]\nkind = \"ebm\"\n[charts]\npreview = \"none\"\n[judge]\nground = \"thesis-box\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"4 mm\", \"0 mm\"], [\"4 mm\", \"2 mm\"], [\"0 mm\", \"2 mm\"]]\n[hatch]\n{hatch}\n"
        );
        match parse(&text).unwrap() {
            Job::Ebm(job) => planned(&job, Path::new(""), &Silent).unwrap(),
            other => panic!("{other:?}"),
        }
    }

    /// The same job on one core, on as many that it takes no day, and on a machine that holds too little.
    #[test]
    fn what_is_told_follows_from_the_machine() {
        let slow = plan("spacing = \"0.2 mm\"\nspeed = \"0.01 mm/s\"");
        let asked = |bytes: f64, cores: usize| {
            let reporter = Reporter::new();
            let found = check(&slow, Machine { bytes, cores }, &reporter);
            let told: Vec<String> = reporter.warnings().into_iter().map(|w| w.code).collect();
            (found.map_err(|e| e.0[0].to_string()), told)
        };
        assert_eq!(asked(1e11, 1), (Ok(()), vec!["long-run".to_owned()]));
        assert_eq!(asked(1e11, 10_000), (Ok(()), Vec::new()));
        let (found, told) = asked(1e5, 1);
        let found = found.unwrap_err();
        assert!(found.contains("the judge would take") && found.contains("this machine has"));
        assert!(told.is_empty(), "{told:?}");
        // of a usual speed it is minutes
        let reporter = Reporter::new();
        let machine = Machine {
            bytes: 1e11,
            cores: 1,
        };
        check(&plan("spacing = \"0.2 mm\""), machine, &reporter).unwrap();
        assert!(reporter.warnings().is_empty());
    }
}
