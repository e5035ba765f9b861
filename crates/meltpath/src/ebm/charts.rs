//! Charts for the beam of a job: from files where they serve, between two of them where that holds, computed otherwise.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use meltpath_base::{Observer, Reporter};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::chart::{ChartSet, ChartSettings};
use meltpath_thermal::chart_between::between;
use meltpath_thermal::chart_build::warm_grounds;
use meltpath_thermal::chart_simulation::Memory;
use meltpath_thermal::enthalpy::Enthalpy;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::{chart_build, chart_file};

use super::run::EbmError;
use super::settings::Settings;

/// Beam settings that a path may have: each needs charts of its own, which take seconds.
const SETTINGS: usize = 64;

/// Settings of the beam on paths, each once.
pub(crate) fn beam_settings<'a>(paths: impl Iterator<Item = &'a BeamPath>) -> Vec<[f64; 3]> {
    let mut found: Vec<[f64; 3]> = Vec::new();
    for p in paths.flat_map(BeamPath::points).filter(|p| p.on) {
        let setting = [p.voltage, p.current, p.focus];
        if !found.contains(&setting) {
            found.push(setting);
        }
    }
    found
}

/// Where the charts of a setting come from.
pub(super) enum Source {
    /// A file.
    File(PathBuf, Box<ChartSet>),
    /// Two files whose currents enclose it.
    Between([PathBuf; 2], Box<ChartSet>),
    /// They are computed.
    Computed(Box<ChartSettings>),
}

/// What the charts of a setting must be.
fn wanted(
    settings: &Settings,
    [voltage, current, focus]: [f64; 3],
) -> Result<ChartSettings, EbmError> {
    let diameter = settings.beam.focus.diameter(focus)?;
    Ok(ChartSettings {
        efficiency: settings.beam.efficiency,
        depth: settings.beam.depth,
        layer: settings.layer,
        stop: settings.chart_stop,
        cooling_from: settings.chart_cooling_from,
        cell: settings.chart_spacing,
        reach: 3.5 * settings.penetration,
        ..ChartSettings::of_thesis(voltage, current, focus, diameter)
    })
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * a.abs().max(b.abs())
}

/// What charts were computed for that the job says otherwise: physics, which they cannot stand for.
fn other_physics(found: &ChartSettings, wanted: &ChartSettings) -> Option<String> {
    let values = [
        ("efficiency", found.efficiency, wanted.efficiency, 1.0, ""),
        ("beam diameter", found.diameter, wanted.diameter, 1e3, " µm"),
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
/// [`EbmError`]: a file that cannot be used, a focus outside its calibration, too many settings.
pub(super) fn sources(
    settings: &Settings,
    paths: &[&BeamPath],
    reporter: &Reporter,
) -> Result<Vec<Source>, EbmError> {
    let material = Enthalpy::new(&settings.material)
        .map_err(meltpath_thermal::chart_simulation::ChartSimulationError::from)?;
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
    let all = beam_settings(paths.iter().copied());
    if all.len() > SETTINGS {
        return Err(EbmError::ManySettings {
            settings: all.len(),
            most: SETTINGS,
        });
    }
    let mut sources = Vec::new();
    for setting in all {
        sources.push(source(settings, setting, &known, reporter)?);
    }
    Ok(sources)
}

fn source(
    settings: &Settings,
    setting: [f64; 3],
    known: &[(PathBuf, ChartSet)],
    reporter: &Reporter,
) -> Result<Source, EbmError> {
    let wanted = wanted(settings, setting)?;
    let [voltage, current, focus] = setting;
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
    let serving = known
        .iter()
        .find(|(_, s)| s.settings.serves(voltage, current, focus));
    if let Some(found) = serving {
        usable(found)?;
        let (path, set) = found;
        tell(path, set);
        return Ok(Source::File(path.clone(), Box::new(set.clone())));
    }
    for (n, a) in known.iter().enumerate() {
        let beside =
            |(_, s): &&(PathBuf, ChartSet)| s.settings.serves(voltage, s.settings.current, focus);
        for b in known[n + 1..].iter().filter(beside) {
            let Some(set) = between(&a.1, &b.1, current).filter(|_| beside(&a)) else {
                continue;
            };
            usable(a)?;
            tell(&a.0, &a.1);
            reporter.warn(
                "charts-between",
                format!(
                    "charts for {:.3} mA are taken between those for {:.3} and {:.3} mA",
                    1e3 * current,
                    1e3 * a.1.settings.current,
                    1e3 * b.1.settings.current
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
pub(super) fn charts_of(
    settings: &Settings,
    paths: &[&BeamPath],
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<ChartSet>, EbmError> {
    let material = &settings.material;
    let remember = settings.simulation.memory != Memory::None;
    let mut sets: Vec<ChartSet> = Vec::new();
    for source in sources(settings, paths, reporter)? {
        let mut set = match source {
            Source::File(_, set) | Source::Between(_, set) => *set,
            Source::Computed(wanted) => chart_build::compute(&wanted, material, observer)?,
        };
        if remember && set.warm.is_empty() {
            chart_build::warm(&mut set, &warm_grounds(material), material, observer)?;
        }
        sets.push(set);
    }
    Ok(sets)
}
