//! One axis designed in every way asked for, and each way tried on the same signal and the same scattered motors.

use super::error::{StepError, TuneError, step};

use super::file::{Choice, ExportForm};
use super::refinement;
use super::settings::{AxisTask, Settings};
use super::trial::{Trial, errors_kept, short_signal, trial};
use meltpath_base::{Observer, Reporter};
use meltpath_control::export::Exported;
use meltpath_numerics::swarm::SwarmError;
use meltpath_perception::{Mapping, read};
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::{
    AngleUnit, CascadeGains, Controller, FeedForward, SampledController, SampledForm,
};
use meltpath_scan_head::servo::compare::{Draw, monte_carlo};
use meltpath_scan_head::servo::h_infinity::{
    Form, HInfinityServo, LoopQuality, design as synthesise, quality, sampled_quality, with_modes,
};
use meltpath_scan_head::servo::model::{Loop, LoopFigures, ServoModel};
use meltpath_scan_head::servo::refine::Refined;
use meltpath_scan_head::servo::robust::{RobustDesign, RobustError, Spread, search};
use meltpath_scan_head::servo::sampled::{Distance, Sampling, cascade};
use meltpath_scan_head::servo::synthesis::{Tuned, tune};
use rayon::prelude::*;

/// Factors on the modes for which the distance to the critical point is drawn.
const SWEEP: usize = 25;

/// A controller and what became of it.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) choice: Choice,
    pub(crate) name: &'static str,
    pub(crate) controller: Controller,
    /// Without the pre-filter, and with it where the head has one.
    pub(crate) bare: Trial,
    pub(crate) filtered: Option<Trial>,
    pub(crate) draws: Vec<Draw>,
    /// First amplitude of the signal, rad.
    pub(crate) amplitude: f64,
    /// The loop as it runs, for every motor of the spread.
    pub(crate) sweep: Vec<Swept>,
}

/// How far the loop of one motor stays from the critical point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Swept {
    /// Factor on the modes.
    pub(crate) shift: f64,
    /// Loop delay beyond the head's own, s.
    pub(crate) delay: f64,
    /// Distance to the critical point, 0 where unstable.
    pub(crate) distance: f64,
}

impl Candidate {
    /// The motor of the spread whose loop comes closest to the critical point.
    pub(crate) fn closest(&self) -> Option<Swept> {
        let closer = |a: Swept, b: Swept| if b.distance < a.distance { b } else { a };
        self.sweep.iter().copied().reduce(closer)
    }

    /// Scattered motors that ran away or ring.
    pub(crate) fn lost(&self) -> usize {
        self.draws.len() - self.errors_kept().len()
    }

    /// Root mean square and largest error (rad) of the others, in ascending order.
    pub(crate) fn errors_kept(&self) -> Vec<(f64, f64)> {
        errors_kept(&self.draws, self.amplitude)
    }
}

/// All that was designed for an axis.
#[derive(Debug, Clone)]
pub(crate) struct AxisResult {
    pub(crate) task: AxisTask,
    pub(crate) tuned: Tuned,
    /// The position loop after the synthesis.
    pub(crate) position: Option<LoopFigures>,
    pub(crate) refined: Option<Refined>,
    /// The gains that the comparison uses: refined where they were.
    pub(crate) gains: CascadeGains,
    pub(crate) h_infinity: HInfinityServo,
    /// Its loop on its own motor, continuous and sampled.
    pub(crate) quality: [LoopQuality; 2],
    pub(crate) robust: Option<RobustDesign>,
    /// Why no controller for motors that differ was found, where one was searched.
    pub(crate) robust_lacks: Option<String>,
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) choice: Choice,
    pub(crate) set_points: Vec<f64>,
    pub(crate) export: Option<Exported>,
    pub(crate) as_exported: Option<Trial>,
    /// The least distance to the critical point with the current regulator of the head's own cascade in place of the synthesis', where
    /// that is another one.
    pub(crate) with_own_current: Option<f64>,
}

impl AxisResult {
    /// The candidate that leaves.
    pub(crate) fn chosen(&self) -> &Candidate {
        let found = self.candidates.iter().find(|c| c.choice == self.choice);
        // the cascade is always first
        found.unwrap_or(&self.candidates[0])
    }

    /// The feed-forward of the H-infinity structure.
    pub(crate) fn feed_forward(&self) -> FeedForward {
        self.tuned.gains.feed_forward
    }
}

/// The record that gains are refined on: set-points and angles, rad.
pub(crate) fn record(
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Option<Vec<[f64; 2]>>, TuneError> {
    let Some([record, mapping]) = &settings.record else {
        return Ok(None);
    };
    let map = Mapping::load(mapping)?;
    let found = read(record, &map, reporter)?;
    let period = settings.data.head.period;
    if (found.period / period - 1.0).abs() > 1e-3 {
        return Err(TuneError::Sampling {
            found: 1e6 * found.period,
            wanted: 1e6 * period,
        });
    }
    let set_points = found.channel("set-point")?;
    let angles = found.channel("angle")?;
    Ok(Some(
        set_points
            .iter()
            .zip(angles)
            .map(|(&s, &a)| [s, a])
            .collect(),
    ))
}

/// Designs and compares.
pub(crate) fn design(
    task: &AxisTask,
    settings: &Settings,
    record: Option<&[[f64; 2]]>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<AxisResult, TuneError> {
    let letter = task.name.letter();
    let motor = &task.axis.motor;
    let period = settings.data.head.period;
    let filter = task.own.map_or(period, |g| g.feed_forward.filter);
    observer.stage("synthesis in frequency", 0);
    let tuned =
        tune(motor, &task.targets, filter).map_err(step(letter, "synthesis in frequency"))?;
    let position = ServoModel::new(motor, &tuned.gains).figures(Loop::Position);
    let refined = refinement::refined(task, settings, &tuned.gains, record, observer)?;
    let gains = match &refined {
        Some(found) => refinement::kept(task, settings, &tuned.gains, found, reporter, observer)?,
        None => tuned.gains,
    };
    observer.stage("H-infinity", 0);
    let current = tuned.gains.current;
    let unit = AngleUnit::Degree;
    let h_infinity =
        synthesise(motor, &current, unit, &task.h_infinity).map_err(step(letter, "H-infinity"))?;
    let loop_of = |form| {
        quality(
            motor,
            &current,
            unit,
            &h_infinity,
            form,
            1.0,
            task.axis.delay,
        )
    };
    let quality = [
        loop_of(Form::Continuous).map_err(step(letter, "H-infinity"))?,
        loop_of(Form::Sampled).map_err(step(letter, "H-infinity"))?,
    ];
    let (robust, robust_lacks) = robust(task, settings, &tuned, observer)?;
    let set_points = task
        .signal
        .samples(period)
        .map_err(step(letter, "comparison"))?;
    let every = (settings.period / period).round() as u32;
    let state_space = |servo: &HInfinityServo| {
        Controller::Sampled(SampledController {
            form: SampledForm::Designed(servo.sampled.clone()),
            unit,
            every,
            current,
            feed_forward: tuned.gains.feed_forward,
        })
    };
    let mut ways: Vec<(Choice, &'static str, Controller)> = vec![
        (Choice::Cascade, "cascade", Controller::Cascade(gains)),
        (Choice::HInfinity, "H-infinity", state_space(&h_infinity)),
    ];
    if let Some(found) = &robust {
        ways.push((Choice::Robust, "robust", state_space(&found.servo)));
    }
    let choice = choice(settings, robust.is_some());
    let mut with_own_current = None;
    let (mut candidates, mut export) = (Vec::new(), None);
    for (way, name, controller) in ways {
        let exported = if way == choice {
            exported(task, settings, &controller).map_err(step(letter, "export"))?
        } else {
            None
        };
        // what leaves is judged as it leaves
        let runs = exported.as_ref().map_or(&controller, |e| &e.1);
        let mut found = candidate(task, settings, &set_points, (&controller, runs), observer)?;
        found.choice = way;
        found.name = name;
        found.sweep = sweep(task, settings, runs).map_err(step(letter, "comparison"))?;
        if way == choice {
            with_own_current =
                through_own_current(task, settings, runs).map_err(step(letter, "comparison"))?;
        }
        candidates.push(found);
        export = export.or(exported);
    }
    let mut result = AxisResult {
        task: task.clone(),
        tuned,
        position,
        refined,
        gains,
        h_infinity,
        quality,
        robust,
        robust_lacks,
        candidates,
        choice,
        set_points,
        export: None,
        as_exported: None,
        with_own_current,
    };
    if let Some((export, controller)) = export {
        result.as_exported = Some(as_exported(&result, settings, controller)?);
        result.export = Some(export);
    }
    Ok(result)
}

/// The signal with the controller as exported.
fn as_exported(
    result: &AxisResult,
    settings: &Settings,
    controller: Controller,
) -> Result<Trial, TuneError> {
    let axis = Axis {
        controller,
        prefilter: None,
        ..result.task.axis.clone()
    };
    let failed = "export, simulated as exported";
    trial(&axis, &result.set_points, settings).map_err(step(result.task.name.letter(), failed))
}

/// Which controller leaves.
fn choice(settings: &Settings, has_robust: bool) -> Choice {
    match *settings.file.export.controller {
        Some(Choice::Robust) | None if has_robust => Choice::Robust,
        Some(Choice::Robust) | None => Choice::HInfinity,
        Some(wanted) => wanted,
    }
}

/// What the controller of an axis is called where it leaves.
pub(crate) fn name_of(task: &AxisTask) -> String {
    format!("controller_{}", task.name.letter())
}

/// A designed controller as it leaves, and as an axis runs it; none where gains leave.
fn exported(
    task: &AxisTask,
    settings: &Settings,
    controller: &Controller,
) -> Result<Option<(Exported, Controller)>, StepError> {
    let Controller::Sampled(designed) = controller else {
        return Ok(None);
    };
    let SampledForm::Designed(system) = &designed.form else {
        return Ok(None);
    };
    let limit = Some(settings.limit.unwrap_or(task.axis.limits.current));
    let name = name_of(task);
    let (word, anti_windup) = (settings.word, settings.anti_windup);
    let export = match *settings.file.export.form {
        ExportForm::Sections => Exported::sections(&name, system, word, limit, anti_windup),
        ExportForm::StateSpace => Exported::state_space(&name, system, word, limit, anti_windup),
    }?;
    let runs = Controller::Sampled(SampledController {
        form: SampledForm::Exported(export.clone()),
        ..designed.clone()
    });
    Ok(Some((export, runs)))
}

fn robust(
    task: &AxisTask,
    settings: &Settings,
    tuned: &Tuned,
    observer: &dyn Observer,
) -> Result<(Option<RobustDesign>, Option<String>), TuneError> {
    if settings.mode_shift().is_none() {
        return Ok((None, None));
    }
    let spread = &settings.spread;
    // what a motor's voltage is late by, the head's own lateness included
    let spread = Spread {
        delays: spread.delays.iter().map(|d| task.axis.delay + d).collect(),
        ..spread.clone()
    };
    let sampling = Sampling {
        period: settings.period,
        every: *settings.file.export.every,
    };
    let letter = task.name.letter();
    match search(
        &task.axis.motor,
        &tuned.gains.current,
        AngleUnit::Degree,
        &spread,
        task.h_infinity.crossover,
        settings.robust_changes,
        sampling,
        &settings.robust_swarm,
        observer,
    ) {
        Ok(found) => Ok((Some(found), None)),
        Err(e @ RobustError::OutOfReach { .. }) => Ok((None, Some(e.to_string()))),
        Err(RobustError::Swarm(SwarmError::NoFiniteCost)) => Ok((
            None,
            Some(format!(
                "no weights that were tried give a controller of {} states that runs",
                *settings.file.robust.order
            )),
        )),
        Err(e) => Err(step(letter, "search for a spread of motors")(e)),
    }
}

/// A controller tried on the signal as designed, and on scattered motors as it runs.
fn candidate(
    task: &AxisTask,
    settings: &Settings,
    set_points: &[f64],
    (controller, runs): (&Controller, &Controller),
    observer: &dyn Observer,
) -> Result<Candidate, TuneError> {
    let letter = task.name.letter();
    let bare = Axis {
        controller: controller.clone(),
        prefilter: None,
        ..task.axis.clone()
    };
    let with = task.axis.prefilter.map(|filter| Axis {
        prefilter: Some(filter),
        ..bare.clone()
    });
    let failed = "comparison on the multi-step";
    let (one, two) = rayon::join(
        || trial(&bare, set_points, settings),
        || {
            with.as_ref()
                .map(|axis| trial(axis, set_points, settings))
                .transpose()
        },
    );
    let draws = if *settings.file.compare.draws == 0 {
        Vec::new()
    } else {
        // what scatters is how the axis arrives
        let samples = short_signal(task, settings).map_err(step(letter, failed))?;
        let leaves = Axis {
            controller: runs.clone(),
            ..bare.clone()
        };
        monte_carlo(
            &leaves,
            &samples,
            settings.data.head.period,
            &settings.scatter,
            *settings.file.compare.draws,
            *settings.file.compare.seed,
            observer,
        )
        .map_err(step(letter, "scattered motors"))?
    };
    Ok(Candidate {
        choice: Choice::Cascade,
        name: "",
        controller: controller.clone(),
        bare: one.map_err(step(letter, failed))?,
        filtered: two.map_err(step(letter, failed))?,
        draws,
        amplitude: task.signal.amplitude,
        sweep: Vec::new(),
    })
}

/// Distance to the critical point over moved modes and loop delays: of the loop as it runs.
fn sweep(
    task: &AxisTask,
    settings: &Settings,
    controller: &Controller,
) -> Result<Vec<Swept>, StepError> {
    let (latest, shift) = (settings.latest(), settings.mode_shift());
    let delays: &[f64] = if latest > 0.0 {
        &[0.0, 0.5 * latest, latest]
    } else {
        &[0.0]
    };
    let shifts: Vec<f64> = match shift {
        None => vec![1.0],
        Some(shift) => (0..SWEEP)
            .map(|k| 1.0 + shift * (2.0 * k as f64 / (SWEEP - 1) as f64 - 1.0))
            .collect(),
    };
    let motors: Vec<(f64, f64)> = shifts
        .into_iter()
        .flat_map(|shift| delays.iter().map(move |&delay| (shift, delay)))
        .collect();
    motors
        .into_par_iter()
        .map(|(shift, delay)| {
            let found = distance(task, settings, controller, (shift, task.axis.delay + delay))?;
            Ok(Swept {
                shift,
                delay,
                distance: if found.stable { found.modulus } else { 0.0 },
            })
        })
        .collect()
}

/// The least distance of a controller that acts through the current regulator of the head's own cascade; nothing where it does anyway.
fn through_own_current(
    task: &AxisTask,
    settings: &Settings,
    controller: &Controller,
) -> Result<Option<f64>, StepError> {
    let (Controller::Sampled(law), Some(own)) = (controller, task.own) else {
        return Ok(None);
    };
    if law.current == own.current {
        return Ok(None);
    }
    let other = Controller::Sampled(SampledController {
        current: own.current,
        ..law.clone()
    });
    let swept = sweep(task, settings, &other)?;
    Ok(swept.into_iter().map(|s| s.distance).reduce(f64::min))
}

/// How far the loop of a controller stays from the critical point with the modes moved by a factor and voltages late, s.
fn distance(
    task: &AxisTask,
    settings: &Settings,
    controller: &Controller,
    (shift, delay): (f64, f64),
) -> Result<Distance, StepError> {
    let axis = &task.axis;
    let law = match controller {
        Controller::Cascade(gains) => {
            let moved = with_modes(&axis.motor, shift);
            let period = settings.data.head.period;
            return Ok(cascade(&moved, gains, axis.speed, period, delay)?);
        }
        Controller::Sampled(law) => law,
    };
    let held;
    let system = match &law.form {
        SampledForm::Designed(system) => system,
        SampledForm::Exported(export) => {
            held = export.held()?;
            &held
        }
    };
    let acts = (system, law.every);
    let found = sampled_quality(&axis.motor, &law.current, law.unit, acts, shift, delay)?;
    Ok(Distance {
        stable: found.stable,
        modulus: found.modulus_margin,
    })
}
