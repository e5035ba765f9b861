//! Charts for the beam of a job: from files where they serve, between two of them where that holds, computed otherwise.

use std::collections::HashSet;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use meltpath_base::{Observer, Reporter};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::between::{WIDEST, between};
use meltpath_thermal::charts::build::warm_grounds;
use meltpath_thermal::charts::simulation::{self, ChartSimulation, ChartSimulationError, Memory};
use meltpath_thermal::charts::{ChartSet, ChartSettings};
use meltpath_thermal::charts::{build, file as chart_file};
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::enthalpy::Enthalpy;

use crate::ebm::error::EbmError;
use crate::ebm::settings::Settings;

/// Beam settings whose charts are read or computed, at most: each takes seconds.
const SETTINGS: usize = 64;
/// Sets of charts that a simulation tells apart.
const SETS: usize = 256;
/// Powers on one spot beyond which charts are computed for some and taken between them for the others.
const MANY: usize = 8;
/// Step of the power between such charts, as a share: the nearest then lies half a step away.
const STEP: f64 = 0.01;

/// Settings of the beam on paths, each once: power (W) and spot (mm).
pub(crate) fn beam_settings<'a>(paths: impl Iterator<Item = &'a BeamPath>) -> Vec<[f64; 2]> {
    let mut seen = HashSet::new();
    let on = paths.flat_map(BeamPath::points).filter(|p| p.is_on());
    on.map(|p| [p.power, p.spot])
        .filter(|setting| seen.insert(setting.map(f64::to_bits)))
        .collect()
}

/// Where the charts of a setting come from.
pub(in crate::ebm) enum Source {
    /// A file.
    File(PathBuf, Box<ChartSet>),
    /// Two files whose powers enclose it.
    Between([PathBuf; 2], Box<ChartSet>),
    /// They are computed.
    Computed(Box<ChartSettings>),
}

/// Where the charts of paths come from.
pub(in crate::ebm) struct Sources {
    /// Files and settings to compute.
    pub(in crate::ebm) own: Vec<Source>,
    /// What is taken between two of them, by their places there.
    steps: Vec<Step>,
    /// How far a power may lie from that of its charts, as a share.
    nearest: f64,
}

/// Charts between two others.
struct Step {
    between: [usize; 2],
    power: f64,
}

/// Charts for every beam setting of paths.
#[derive(Debug, Clone)]
pub(in crate::ebm) struct Charts {
    /// From files or computed.
    pub(in crate::ebm) own: Vec<ChartSet>,
    /// Between those, where a path has many powers.
    steps: Vec<ChartSet>,
    nearest: f64,
}

impl Charts {
    /// A simulation on voxels.
    ///
    /// # Errors
    /// [`ChartSimulationError`].
    pub(in crate::ebm) fn simulation(
        &self,
        grid: &Grid,
        settings: &Settings,
    ) -> Result<ChartSimulation, ChartSimulationError> {
        let how = simulation::Settings {
            nearest: self.nearest,
            ..settings.simulation
        };
        let sets = self.own.iter().chain(&self.steps).cloned().collect();
        ChartSimulation::new(grid, settings.material.clone(), sets, how)
    }

    /// Whether they serve a path.
    pub(in crate::ebm) fn serve(&self, path: &BeamPath) -> bool {
        let all = beam_settings(std::iter::once(path));
        all.into_iter().all(|[power, spot]| {
            self.own.iter().chain(&self.steps).any(|s| {
                let near = (s.settings.power / power).ln().abs() <= self.nearest;
                let there = if near { s.settings.power } else { power };
                s.settings.serves(there, spot)
            })
        })
    }
}

/// Powers for which charts are computed where a path has many, and those between them; in even steps of their logarithm.
struct Ladder {
    low: f64,
    high: f64,
    /// Pairs of computed charts.
    pairs: usize,
    /// Steps from one to the next.
    steps: usize,
}

impl Ladder {
    fn over(powers: &[f64]) -> Self {
        let low = powers.iter().copied().fold(f64::INFINITY, f64::min);
        let high = powers.iter().copied().fold(0.0, f64::max);
        let span = (high / low).ln();
        let pairs = (span / WIDEST.ln()).ceil().clamp(1.0, SETTINGS as f64);
        let steps = (span / pairs / STEP).ceil();
        // coarser steps where there would be too many sets
        let steps = steps.min((SETS as f64 - 16.0) / pairs).max(1.0);
        Ladder {
            low,
            high,
            pairs: pairs as usize,
            steps: steps as usize,
        }
    }

    /// The power of a rung, counted in steps.
    fn power(&self, rung: usize) -> f64 {
        let all = self.pairs * self.steps;
        match rung {
            0 => self.low,
            n if n == all => self.high,
            n => self.low * (self.high / self.low).powf(n as f64 / all as f64),
        }
    }

    /// The distance of two rungs, as a share.
    fn step(&self) -> f64 {
        (self.high / self.low).ln() / (self.pairs * self.steps) as f64
    }
}

/// What the charts of a setting must be.
pub(in crate::ebm) fn wanted(settings: &Settings, [power, spot]: [f64; 2]) -> ChartSettings {
    ChartSettings {
        efficiency: settings.beam.efficiency,
        depth: settings.beam.depth,
        layer: settings.job.ebm.layer.0,
        stop: settings.job.charts.stop.0,
        cooling_from: settings
            .job
            .charts
            .cooling_from
            .0
            .min(settings.job.charts.stop.0),
        cell: settings.job.charts.spacing.0,
        reach: 3.5 * settings.job.ebm.penetration.0,
        cold: {
            // the thesis' 800 °C over a bed at 750 °C
            let [start, solidus] = [settings.material.start, settings.material.solidus];
            (start + 50.0).min(0.5 * (start + solidus))
        },
        ..ChartSettings::for_beam(power, spot)
    }
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * a.abs().max(b.abs())
}

/// What charts were computed for that the job says otherwise: physics, which they cannot stand for.
fn other_physics(found: &ChartSettings, wanted: &ChartSettings) -> Option<String> {
    let values = [
        ("efficiency", found.efficiency, wanted.efficiency, 1.0, ""),
        ("layer", found.layer, wanted.layer, 1e3, " µm"),
        (
            "depth of the heated zone",
            found.reach,
            wanted.reach,
            1e3,
            " µm",
        ),
    ];
    let differs = values.iter().find(|(_, a, b, _, _)| !same(*a, *b));
    if let Some((what, a, b, factor, unit)) = differs {
        let told = [a, b].map(|v| (v * factor * 1e4).round() / 1e4);
        return Some(format!(
            "they were computed for a {what} of {}{unit}, the job has {}{unit}",
            told[0], told[1]
        ));
    }
    (found.depth != wanted.depth)
        .then(|| "they were computed for another penetration of the beam than the job's".to_owned())
}

/// How charts were computed otherwise than the job asks, which changes their accuracy.
fn other_accuracy(found: &ChartSettings, wanted: &ChartSettings) -> Option<String> {
    let celsius = |k: f64| format!("{:.0} °C", k - CELSIUS);
    let um = |mm: f64| format!("{:.1} µm", 1e3 * mm);
    let values = [
        (
            "stop",
            found.stop,
            wanted.stop,
            celsius as fn(f64) -> String,
        ),
        (
            "cooling_from",
            found.cooling_from,
            wanted.cooling_from,
            celsius,
        ),
        ("spacing", found.cell, wanted.cell, um),
    ];
    let differs: Vec<String> = values
        .iter()
        .filter(|(_, a, b, _)| !same(*a, *b))
        .map(|(what, a, b, told)| format!("{what} {} in place of {}", told(*a), told(*b)))
        .collect();
    (!differs.is_empty()).then(|| differs.join(", "))
}

/// Where the charts of each beam setting of `paths` come from; the files are read and checked, nothing is computed.
///
/// # Errors
/// [`EbmError`]: a file that cannot be used, too many settings.
pub(in crate::ebm) fn sources(
    settings: &Settings,
    paths: &[&BeamPath],
    reporter: &Reporter,
) -> Result<Sources, EbmError> {
    let material = Enthalpy::new(&settings.material)
        .map_err(meltpath_thermal::charts::simulation::ChartSimulationError::from)?;
    let mut known: Vec<(PathBuf, ChartSet)> = Vec::new();
    for file in &settings.chart_files {
        let shown = |message: String| EbmError::Charts {
            path: file.clone(),
            message,
        };
        let reader = File::open(file).map_err(|e| shown(e.to_string()))?;
        let set =
            chart_file::read(&mut BufReader::new(reader)).map_err(|e| shown(e.to_string()))?;
        if set.fingerprint != material.fingerprint() {
            return Err(shown(format!(
                "they were computed for {} with other laws than those of {}",
                set.material, settings.material.name
            )));
        }
        known.push((file.clone(), set));
    }
    let mut groups: Vec<(f64, Vec<f64>)> = Vec::new();
    for [power, spot] in beam_settings(paths.iter().copied()) {
        match groups.iter_mut().find(|(s, _)| *s == spot) {
            Some((_, powers)) => powers.push(power),
            None => groups.push((spot, vec![power])),
        }
    }
    let mut sources = Sources {
        own: Vec::new(),
        steps: Vec::new(),
        nearest: 0.0,
    };
    for (spot, powers) in groups {
        let mut one = |power: f64| source(settings, [power, spot], &known, reporter);
        if powers.len() <= MANY {
            for power in powers {
                sources.own.push(one(power)?);
            }
        } else {
            let ladder = Ladder::over(&powers);
            tell_ladder(&ladder, powers.len(), reporter);
            climb(&ladder, &mut sources, &mut one)?;
        }
    }
    let (own, all) = (sources.own.len(), sources.own.len() + sources.steps.len());
    if own > SETTINGS || all > SETS {
        return Err(EbmError::ManySettings {
            settings: own.max(all),
            most: if own > SETTINGS { SETTINGS } else { SETS },
        });
    }
    Ok(sources)
}

/// The charts of a ladder.
fn climb(
    ladder: &Ladder,
    sources: &mut Sources,
    one: &mut dyn FnMut(f64) -> Result<Source, EbmError>,
) -> Result<(), EbmError> {
    sources.own.push(one(ladder.low)?);
    for pair in 0..ladder.pairs {
        let from = pair * ladder.steps;
        sources.own.push(one(ladder.power(from + ladder.steps))?);
        let upper = sources.own.len() - 1;
        let between = [upper - 1, upper];
        let rungs = (from + 1..from + ladder.steps).map(|n| ladder.power(n));
        sources
            .steps
            .extend(rungs.map(|power| Step { between, power }));
    }
    sources.nearest = sources.nearest.max(0.5 * ladder.step() + 1e-6);
    Ok(())
}

fn tell_ladder(ladder: &Ladder, powers: usize, reporter: &Reporter) {
    reporter.warn(
        "charts-in-steps",
        format!(
            "the path has {powers} beam powers from {:.1} to {:.1} W: charts are made for {} of them, and taken between those in steps of {:.2} %",
            ladder.low,
            ladder.high,
            ladder.pairs + 1,
            100.0 * ladder.step()
        ),
        "highest temperatures then differ by some 10 K in the mean, in single voxels by up to 125 K",
    );
}

fn source(
    settings: &Settings,
    setting: [f64; 2],
    known: &[(PathBuf, ChartSet)],
    reporter: &Reporter,
) -> Result<Source, EbmError> {
    let wanted = wanted(settings, setting);
    let [power, spot] = setting;
    let usable = |(path, set): &(PathBuf, ChartSet)| match other_physics(&set.settings, &wanted) {
        Some(message) => Err(EbmError::Charts {
            path: path.clone(),
            message,
        }),
        None => Ok(()),
    };
    let tell = |path: &PathBuf, set: &ChartSet| {
        if let Some(how) = other_accuracy(&set.settings, &wanted) {
            reporter.warn(
                "charts-otherwise",
                format!(
                    "the charts {} were computed otherwise than the job says: {how}",
                    path.display()
                ),
                "leave them out of charts.files, and the run computes them",
            );
        }
    };
    let serving = known.iter().find(|(_, s)| s.settings.serves(power, spot));
    if let Some(found) = serving {
        usable(found)?;
        let (path, set) = found;
        tell(path, set);
        return Ok(Source::File(path.clone(), Box::new(set.clone())));
    }
    for (n, a) in known.iter().enumerate() {
        let beside = |(_, s): &&(PathBuf, ChartSet)| s.settings.serves(s.settings.power, spot);
        for b in known[n + 1..].iter().filter(beside) {
            let Some(set) = between(&a.1, &b.1, power).filter(|_| beside(&a)) else {
                continue;
            };
            usable(a)?;
            tell(&a.0, &a.1);
            reporter.warn(
                "charts-between",
                format!(
                    "charts for {:.1} W are taken between those for {:.1} and {:.1} W",
                    power,
                    a.1.settings.power,
                    b.1.settings.power
                ),
                "highest temperatures then differ by some 10 K in the mean, in single voxels by up to 125 K; leave one of the two out of charts.files, and the run computes them",
            );
            let files = [a.0.clone(), b.0.clone()];
            return Ok(Source::Between(files, Box::new(set)));
        }
    }
    Ok(Source::Computed(Box::new(wanted)))
}

/// Charts for every setting of `paths`.
///
/// # Errors
/// [`EbmError`].
pub(in crate::ebm) fn charts_of(
    settings: &Settings,
    paths: &[&BeamPath],
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Charts, EbmError> {
    let material = &settings.material;
    let remember = settings.simulation.memory != Memory::None;
    let sources = sources(settings, paths, reporter)?;
    let mut own: Vec<ChartSet> = Vec::new();
    for source in sources.own {
        let mut set = match source {
            Source::File(_, set) | Source::Between(_, set) => *set,
            Source::Computed(wanted) => build::compute(&wanted, material, observer)?,
        };
        if remember && set.warm.is_empty() {
            build::warm(&mut set, &warm_grounds(material), material, observer)?;
        }
        own.push(set);
    }
    let mut steps = Vec::new();
    for Step {
        between: [a, b],
        power,
    } in sources.steps
    {
        let set = between(&own[a], &own[b], power);
        steps.push(set.ok_or(EbmError::UnlikeCharts {
            powers: [a, b].map(|n| own[n].settings.power),
        })?);
    }
    Ok(Charts {
        own,
        steps,
        nearest: sources.nearest,
    })
}
