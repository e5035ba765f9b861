//! The cascade's gains refined: on a record of the real drive, or for the least error over motors and delays that differ.

use std::fmt::Write as _;

use meltpath_base::{Observer, Reporter};
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::{CascadeGains, Controller};
use meltpath_scan_head::servo::compare::{Draw, monte_carlo, scattered};
use meltpath_scan_head::servo::model::{Loop, ServoModel};
use meltpath_scan_head::servo::refine::{Bounds, Held, Refined, Signal, Trial, refine};

use super::error::{StepError, TuneError, step};
use super::file::RefineOn;
use super::settings::{AxisTask, Settings};
use super::trial::{errors_kept, is_lost, short_signal, trial};

/// Below this modulus margin refined gains are warned about.
const THIN: f64 = 0.4;

/// A motor of the scatter's corner with the longest delay: `side` is 1 for the heavier one with lower modes and a warm coil, −1 for
/// the lighter one.
fn corner(settings: &Settings, side: f64) -> Draw {
    let width = &settings.scatter;
    Draw {
        resistance: 1.0 + side * width.resistance,
        inertia: 1.0 + side * width.inertia,
        modes: 1.0 - side * width.modes,
        delay: width.delay,
        noise: 0.5 * width.noise,
        error: None,
    }
}

/// The runs that gains are refined on: the axis as it is, with the longest delay, and two late motors from the corners of the scatter.
fn trials(task: &AxisTask, settings: &Settings) -> Vec<Trial> {
    let bare = Axis {
        prefilter: None,
        ..task.axis.clone()
    };
    let named = |name: &str, axis: Axis| Trial {
        name: name.to_owned(),
        axis,
    };
    let late = Axis {
        delay: bare.delay + settings.scatter.delay,
        ..bare.clone()
    };
    let mut all = vec![
        named("as the head has it", bare.clone()),
        named(
            "heavier, modes lower, coil warm, late, noise",
            scattered(&bare, &corner(settings, 1.0)),
        ),
        named(
            "lighter, modes higher, coil cold, late, noise",
            scattered(&bare, &corner(settings, -1.0)),
        ),
    ];
    if settings.scatter.delay > 0.0 {
        all.insert(1, named("with the longest delay", late));
    }
    all
}

/// Refined gains; none where no refinement is asked for.
pub(crate) fn refined(
    task: &AxisTask,
    settings: &Settings,
    start: &CascadeGains,
    record: Option<&[[f64; 2]]>,
    observer: &dyn Observer,
) -> Result<Option<Refined>, TuneError> {
    let failed = "refinement";
    let letter = task.name.letter();
    let loops = Bounds::Loops {
        motor: &task.axis.motor,
        targets: &task.targets,
        loss: settings.file.cascade.refine.slower.0,
    };
    let (set_points, wanted, trials, bounds) = match *settings.file.cascade.refine.on {
        RefineOn::Nothing => return Ok(None),
        RefineOn::Record => {
            let rows = record.unwrap_or_default();
            let column = |k: usize| rows.iter().map(|r| r[k]).collect::<Vec<f64>>();
            let one = Trial {
                name: "the record".to_owned(),
                axis: task.axis.clone(),
            };
            (column(0), column(1), vec![one], Bounds::Reach)
        }
        RefineOn::Tracking => {
            let samples = short_signal(task, settings).map_err(step(letter, failed))?;
            (samples.clone(), samples, trials(task, settings), loops)
        }
    };
    let signal = Signal {
        set_points: &set_points,
        wanted: &wanted,
        period: settings.data.head.period,
    };
    refine(
        &trials,
        start,
        &signal,
        bounds,
        &settings.refine_swarm,
        observer,
    )
    .map(Some)
    .map_err(step(letter, failed))
}

/// How gains do on what a person compares: the whole signal, and the scattered motors.
struct Outcome {
    rms: f64,
    median: Option<f64>,
    lost: usize,
}

impl Outcome {
    fn of(
        task: &AxisTask,
        settings: &Settings,
        gains: &CascadeGains,
        observer: &dyn Observer,
    ) -> Result<Self, StepError> {
        let axis = Axis {
            controller: Controller::Cascade(*gains),
            prefilter: None,
            ..task.axis.clone()
        };
        let period = settings.data.head.period;
        let rms = trial(&axis, &task.signal.samples(period)?, settings)?
            .error
            .rms();
        let draws = if *settings.file.compare.draws == 0 {
            Vec::new()
        } else {
            let samples = short_signal(task, settings)?;
            let (scatter, seed) = (&settings.scatter, *settings.file.compare.seed);
            monte_carlo(
                &axis,
                &samples,
                period,
                scatter,
                *settings.file.compare.draws,
                seed,
                observer,
            )?
        };
        let kept = errors_kept(&draws, task.signal.amplitude);
        Ok(Outcome {
            rms,
            median: kept.get(kept.len() / 2).map(|e| e.0),
            lost: draws.len() - kept.len(),
        })
    }

    fn is_worse_than(&self, other: &Outcome) -> bool {
        let larger = |a: Option<f64>, b: Option<f64>| matches!((a, b), (Some(a), Some(b)) if a > b);
        self.rms > other.rms || self.lost > other.lost || larger(self.median, other.median)
    }
}

/// The gains that the tuning goes on with: the refined ones, unless their linear loop is unstable or, where they were refined for
/// tracking, they do worse than those of the synthesis on the whole signal or on scattered motors.
pub(crate) fn kept(
    task: &AxisTask,
    settings: &Settings,
    start: &CascadeGains,
    refined: &Refined,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<CascadeGains, TuneError> {
    let letter = task.name.letter();
    let upper = letter.to_ascii_uppercase();
    let failed = "refinement";
    let model = ServoModel::new(&task.axis.motor, &refined.gains);
    let stable = model
        .closed_loop()
        .and_then(|l| l.is_stable().map_err(Into::into))
        .map_err(step(letter, failed))?;
    if !stable {
        reporter.warn(
            "refined-unstable",
            format!("{upper}: the refined gains make an unstable linear loop; those of the synthesis are kept"),
            "refine with more particles, or on a signal with less noise",
        );
        return Ok(*start);
    }
    if !refined.gained {
        reporter.warn(
            "refined-nothing",
            format!("{upper}: the swarm found no gains that do better in every run; those of the start are kept"),
            "more particles or iterations, or cascade.refine.on = \"nothing\"",
        );
        return Ok(*start);
    }
    if *settings.file.cascade.refine.on == RefineOn::Tracking {
        let outcome = |g| Outcome::of(task, settings, g, observer).map_err(step(letter, failed));
        if outcome(&refined.gains)?.is_worse_than(&outcome(start)?) {
            reporter.warn(
                "refined-worse",
                format!("{upper}: the refined gains do better in the swarm's runs but worse on the whole signal or on scattered motors; those of the synthesis are kept"),
                "more iterations, or a scatter nearer to your motors",
            );
            return Ok(*start);
        }
    }
    let lost: Vec<&str> = refined
        .runs
        .iter()
        .filter(|r| {
            *settings.file.cascade.refine.on == RefineOn::Tracking
                && r.after
                    .as_ref()
                    .is_none_or(|e| is_lost(e.largest(), task.signal.amplitude))
        })
        .map(|r| r.name.as_str())
        .collect();
    if !lost.is_empty() {
        reporter.warn(
            "refined-lost",
            format!(
                "{upper}: with the refined gains the axis still rings or runs away in: {}",
                lost.join("; ")
            ),
            "slower loops (cascade.first_maximum), a larger cascade.refine.slower, a shorter delay, or export.controller = \"robust\"",
        );
    }
    let thin = [Loop::Current, Loop::Speed, Loop::Position]
        .into_iter()
        .filter_map(|l| model.figures(l))
        .map(|f| f.margins.modulus.value)
        .fold(f64::INFINITY, f64::min);
    if thin < THIN {
        reporter.warn(
            "refined-thin",
            format!(
                "{upper}: a loop of the refined gains comes within {thin:.2} of the critical point"
            ),
            "keep the gains of the synthesis where motors differ",
        );
    }
    Ok(refined.gains)
}

/// What the swarm did, for people: `kept` are the gains that the tuning went on with.
pub(crate) fn words(refined: &Refined, kept: &CascadeGains) -> String {
    let mut said = format!(
        "A swarm then changed all eight parameters ({} places tried): its runs are in a table below.",
        refined.search.evaluations
    );
    if *kept != refined.gains || !refined.gained {
        said.push_str(" The gains of the synthesis are kept: see the warnings.");
    }
    let rising: Vec<&str> = refined
        .runs
        .iter()
        .filter(|r| match (&r.before, &r.after) {
            (Some(before), Some(after)) => after.largest() > before.largest(),
            _ => false,
        })
        .map(|r| r.name.as_str())
        .collect();
    if !rising.is_empty() {
        let _ = write!(said, " The largest error rose in: {}.", rising.join("; "));
    }
    if !refined.held.is_empty() {
        let _ = write!(said, " {}", held(&refined.held));
    }
    said
}

/// What held the swarm back.
fn held(by: &[Held]) -> String {
    let words: Vec<String> = by
        .iter()
        .map(|h| match h {
            Held::Range { parameter, value } => {
                format!("{parameter} = {value:.3e} lies at an end of its range")
            }
            Held::Margin { which } => format!(
                "the {} loop stands at its margin",
                which.name().to_lowercase()
            ),
            Held::Bandwidth => "feedback alone has the least bandwidth allowed".to_owned(),
            Held::Disturbance => "the axis gives way to disturbances as far as allowed".to_owned(),
        })
        .collect();
    format!("Held by its bounds: {}.", words.join("; "))
}
