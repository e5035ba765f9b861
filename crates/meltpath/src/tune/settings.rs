//! What a tuning file means: every value with its origin.

use std::path::{Path, PathBuf};

use meltpath_base::settings::{Problem, Setting, Value};
use meltpath_base::{Angle, Frequency, Origin, Provenance, Resolved, Time};
use meltpath_control::export::{AntiWindup, Word};
use meltpath_control::h_infinity::Template;
use meltpath_numerics::swarm::Swarm;
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::{AngleUnit, CascadeGains, Controller};
use meltpath_scan_head::files::{self, HeadData};
use meltpath_scan_head::servo::compare::{MultiStep, Scatter};
use meltpath_scan_head::servo::h_infinity::{Changes, HInfinityTargets, Weights};
use meltpath_scan_head::servo::model::{Loop, ServoModel};
use meltpath_scan_head::servo::robust::Spread;
use meltpath_scan_head::servo::synthesis::{Target, Targets};

use super::file::{AxisName, RobustTable, TemplateTable, TuneFile, Windup, WordName};
use crate::job::{Problems, Written};
use crate::lpbf::settings::head_data;

/// What is asked of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisTask {
    /// Which axis.
    pub name: AxisName,
    /// The axis as the head has it, with the motor that is tuned for.
    pub axis: Axis,
    /// What this motor leaves of the record that it was identified from, over the record's noise, where that is told.
    pub misfit: Option<f64>,
    /// Its own gains, where it has a cascade.
    pub own: Option<CascadeGains>,
    /// What the loops are to reach.
    pub targets: Targets,
    /// What the H-infinity controller is to reach.
    pub h_infinity: HInfinityTargets,
    /// The signal of the comparison.
    pub signal: MultiStep,
}

/// A resolved tuning file.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The file: values that need no resolving are read there.
    pub file: TuneFile,
    /// The head.
    pub data: HeadData,
    /// What is asked, one entry an axis.
    pub tasks: Vec<AxisTask>,
    /// The swarm of the refinement.
    pub refine_swarm: Swarm,
    /// Record and mapping.
    pub record: Option<[PathBuf; 2]>,
    /// The motors that the exported controller is to serve, and for which the robust one is searched where their modes differ.
    pub spread: Spread,
    /// How the robust controller is made smaller.
    pub robust_changes: Changes,
    /// The swarm of the search.
    pub robust_swarm: Swarm,
    /// Scatter of motors.
    pub scatter: Scatter,
    /// Word.
    pub word: Word,
    /// The cut, A.
    pub limit: Option<f64>,
    /// What the states do while cut.
    pub anti_windup: AntiWindup,
    /// Sample time of the controllers, s.
    pub period: f64,
    /// Every value with its origin.
    pub provenance: Provenance,
}

/// Resolves a tuning file that lies in `folder`.
///
/// # Errors
/// Everything wrong, with its place in the file.
pub fn resolve(file: &Written<TuneFile>, folder: &Path) -> Result<Settings, Problems> {
    let mut told = file.provenance.clone();
    told.model(
        "synthesis in frequency, weights, refinement, comparison",
        "Rasoanarivo 2020, § 2.2.2, § 2.2.3, chapter 3",
    );
    told.model(
        "search for a spread of motors, transfer of the weights to other motors",
        "this program",
    );
    let head = &file.head;
    let data = head_data(head, folder)?;
    let e = &file.export;
    let period = f64::from(*e.every) * data.head.period;
    let (mut tasks, mut problems) = (Vec::new(), Vec::new());
    for name in file.axes.iter() {
        match task(*name, file, &data, folder, period, &mut told) {
            Ok(task) => tasks.push(task),
            // what is said of a key that the axes share is said once
            Err(found) => {
                for problem in found.0 {
                    if !problems.contains(&problem) {
                        problems.push(problem);
                    }
                }
            }
        }
    }
    problems.extend(beside(file));
    if !problems.is_empty() {
        return Err(problems.into());
    }
    let refine = &file.cascade.refine;
    let record = match (&*refine.record, &*refine.mapping) {
        (Some(record), Some(mapping)) => Some([folder.join(&**record), folder.join(&**mapping)]),
        _ => None,
    };
    let half = 0.5 * data.head.period;
    let (spread, robust_changes, robust_swarm) = robust(&file.robust, half, &mut told);
    let c = &file.compare;
    let [coefficient, signal] = *e.bits;
    Ok(Settings {
        file: (**file).clone(),
        tasks,
        refine_swarm: Swarm {
            particles: *refine.particles,
            iterations: *refine.iterations,
            ..Swarm::default()
        },
        record,
        spread,
        robust_changes,
        robust_swarm,
        scatter: Scatter {
            resistance: c.resistance.0,
            inertia: c.inertia.0,
            modes: c.modes.0,
            delay: c.delay.or_computed(&mut told, Time(half)).0,
            noise: c.noise.0,
        },
        word: match *e.word {
            WordName::Double => Word::Double,
            WordName::Single => Word::Single,
            WordName::Fixed => Word::Fixed {
                coefficient,
                signal,
            },
        },
        limit: e.limit.map(|l| l.0),
        anti_windup: match *e.anti_windup {
            Windup::None => AntiWindup::None,
            Windup::Conditioned => AntiWindup::Conditioned,
        },
        period,
        provenance: told,
        data,
    })
}

impl Settings {
    /// How far modes may lie from those of the design, as a share; none where they stay.
    pub fn mode_shift(&self) -> Option<f64> {
        let shift = 1.0 - self.spread.mode_shifts.first().copied().unwrap_or(1.0);
        (shift > 0.0).then_some(shift)
    }

    /// The longest loop delay beyond the head's own, s.
    pub fn latest(&self) -> f64 {
        self.spread.delays.last().copied().unwrap_or(0.0)
    }
}

/// Motors of axes that are not tuned: what is written would do nothing.
fn beside(file: &TuneFile) -> Vec<Problem> {
    let motors = [
        (AxisName::X, &file.motor.x),
        (AxisName::Y, &file.motor.y),
        (AxisName::Z, &file.motor.z),
    ];
    let idle = motors
        .into_iter()
        .filter(|(name, motor)| motor.is_some() && !file.axes.contains(name));
    idle.map(|(name, motor)| {
        let letter = name.letter();
        motor
            .problem(format!(
                "motor.{letter} is given, and axes does not name {letter}: it is not tuned"
            ))
            .help(format!(
                "add \"{letter}\" to axes, or leave motor.{letter} out"
            ))
    })
    .collect()
}

fn robust(table: &RobustTable, half: f64, told: &mut Provenance) -> (Spread, Changes, Swarm) {
    let shift = table.mode_shift.0;
    let delay = table.delay.or_computed(told, Time(half)).0;
    let spread = Spread {
        mode_shifts: if shift > 0.0 {
            vec![
                1.0 - shift,
                1.0 - 0.5 * shift,
                1.0,
                1.0 + 0.5 * shift,
                1.0 + shift,
            ]
        } else {
            vec![1.0]
        },
        delays: if delay > 0.0 {
            vec![0.0, delay]
        } else {
            vec![0.0]
        },
        modulus_margin: *table.modulus_margin,
        resonance: *table.resonance,
    };
    let swarm = Swarm {
        particles: *table.particles,
        iterations: *table.iterations,
        ..Swarm::default()
    };
    let order = *table.order;
    (spread, Changes::Balanced { order }, swarm)
}

fn task(
    name: AxisName,
    file: &TuneFile,
    data: &HeadData,
    folder: &Path,
    period: f64,
    told: &mut Provenance,
) -> Result<AxisTask, Problems> {
    let letter = name.letter();
    let (found, written, place) = match name {
        AxisName::X => (Some(&data.head.mirrors[0]), &file.motor.x, 0),
        AxisName::Y => (Some(&data.head.mirrors[1]), &file.motor.y, 1),
        AxisName::Z => (data.head.focus.as_ref().map(|f| &f.0), &file.motor.z, 2),
    };
    let found = found.ok_or_else(|| {
        let head = &data.head.name;
        file.axes
            .problem(format!("the head \"{head}\" has no {letter} axis"))
    })?;
    let mut axis = found
        .motor()
        .map_err(|e| file.axes.problem(format!("{letter} axis: {e}")))?
        .clone();
    let mut misfit = data.misfits[place];
    if let Some(path) = &**written {
        // a file whatever its name
        let shown = folder.join(&**path).display().to_string();
        let text = std::fs::read_to_string(&shown)
            .map_err(|e| written.problem(format!("the motor {shown} cannot be read: {e}")))?;
        let told = files::parse_motor(&text, &axis.motor)
            .map_err(|problems| problems.of_file(&shown, &text))?;
        (axis.motor, misfit) = (told.motor, told.misfit);
    }
    let own = match &axis.controller {
        Controller::Cascade(gains) => Some(*gains),
        Controller::Sampled(_) => None,
    };
    let targets = loops(letter, file, data.tuning[place], &axis, own, told)?;
    let h = &file.h_infinity;
    let own_bandwidth = Frequency(targets.position.crossover);
    let bandwidth = h.bandwidth.or_computed(told, own_bandwidth);
    // axes differ: each has its own
    told.parameters.remove(&h.bandwidth.name);
    let origin = match &h.bandwidth.span {
        Some(_) => Origin::Job,
        None => Origin::Computed("that of the position loop".to_owned()),
    };
    let own_name = format!("{letter}.{}", h.bandwidth.name);
    told.parameter(&own_name, &Resolved::new(bandwidth, origin));
    let mut h_infinity =
        HInfinityTargets::for_motor(&axis.motor, AngleUnit::Degree, bandwidth.0, period)
            .map_err(|e| Problem::new(e.to_string()))?;
    h_infinity.every = *file.export.every;
    let template = |t: &TemplateTable, at: &Setting<Option<TemplateTable>>| {
        Template::new(*t.low, *t.high, t.crossover.0).map_err(|e| at.problem(e.to_string()))
    };
    if let (Some(s), Some(c), Some(d)) = (&*h.sensitivity, &*h.command, &*h.disturbance) {
        h_infinity.weights = Weights {
            sensitivity: template(s, &h.sensitivity)?,
            command: template(c, &h.command)?,
            disturbance: template(d, &h.disturbance)?,
        };
        h_infinity.command_unit = 1.0;
    }
    if let Some(pairs) = *h.pairs {
        h_infinity.changes = Changes::Pairs {
            pairs,
            closeness: 0.2,
        };
    }
    let c = &file.compare;
    let signal = MultiStep {
        amplitude: c.amplitude.or_computed(told, Angle(0.9 * axis.travel)).0,
        levels: *c.levels,
        slope: c.slope.0,
        hold: c.hold.0,
    };
    if signal.amplitude > axis.travel {
        return Err(c
            .amplitude
            .problem(format!(
                "compare.amplitude is {:.2} deg, the {letter} axis travels ±{:.2} deg",
                signal.amplitude.to_degrees(),
                axis.travel.to_degrees()
            ))
            .into());
    }
    Ok(AxisTask {
        name,
        axis,
        misfit,
        own,
        targets,
        h_infinity,
        signal,
    })
}

/// What the loops of an axis are to reach.
fn loops(
    letter: char,
    file: &TuneFile,
    shipped: Option<[f64; 3]>,
    axis: &Axis,
    own: Option<CascadeGains>,
    told: &mut Provenance,
) -> Result<Targets, Problem> {
    let first_maximum = &file.cascade.first_maximum;
    let written = first_maximum.map(|t| t.map(|t| t.0));
    let (times, origin) = match (written, shipped, own) {
        (Some(times), ..) => (times, Origin::Job),
        (None, Some(times), _) => (times, Origin::Data("the head's file".to_owned())),
        (None, None, Some(gains)) => {
            let model = ServoModel::new(&axis.motor, &gains);
            let time = |which| model.figures(which).map(|f| 3.0 / f.crossover.omega);
            match (time(Loop::Current), time(Loop::Speed), time(Loop::Position)) {
                (Some(i), Some(w), Some(p)) => (
                    [i, w, p],
                    Origin::Computed("as fast as the head's own loops".to_owned()),
                ),
                _ => {
                    return Err(first_maximum.problem(format!(
                        "the loops of the {letter} axis have no crossover: give cascade.first_maximum"
                    )));
                }
            }
        }
        (None, None, None) => {
            return Err(first_maximum.problem(format!(
                "the file of the head does not say how fast the {letter} axis is to be: give cascade.first_maximum, the times of current, speed and position"
            )));
        }
    };
    told.parameter(
        &format!("{letter}.cascade.first_maximum"),
        &Resolved::new(times.map(Time).json(), origin),
    );
    let margins = file.cascade.margin.map(|m| m.0.to_degrees());
    let target = |k: usize| Target::from_first_maximum(times[k], margins[k]);
    Ok(Targets {
        current: target(0),
        speed: target(1),
        position: target(2),
        ..Targets::default()
    })
}
