//! New jobs: a folder with a commented job file and a part, that runs as it is.

use std::path::{Path, PathBuf};

use meltpath_base::Reporter;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::settings::peek;
use meltpath_data::{process_maps, wires};
use meltpath_deposition::consumable::Wire;
use meltpath_deposition::process_map::ProcessMap;
use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::shapes;

use crate::data::{DataFileError, DataText, known};
use crate::reference::{Subject, schema};

/// The commented job file of `meltpath new waam`.
pub const WAAM_TEMPLATE: &str = include_str!("start/waam.toml");

/// The commented job file of `meltpath new lpbf`.
pub const LPBF_TEMPLATE: &str = include_str!("start/lpbf.toml");

/// The commented job file of `meltpath new ebm`.
pub const EBM_TEMPLATE: &str = include_str!("start/ebm.toml");

/// Why a job could not be started.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// No part of that name can be generated.
    #[error("there is no generated part \"{name}\"; there are: {known}")]
    Shape {
        /// What was asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// The wire is not known.
    #[error(transparent)]
    Wire(#[from] DataFileError),
    /// No process map of a wire.
    #[error(
        "no process map is for the wire \"{wire}\": measure one, and put it into the folder `process-maps` of your data; wires with a map are {known}"
    )]
    Map {
        /// The wire.
        wire: String,
        /// The wires that have one.
        known: String,
    },
    /// Its process map cannot be used.
    #[error("the process map {name}: {message}")]
    MapContent {
        /// Which.
        name: String,
        /// What is wrong.
        message: String,
    },
    /// The folder could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

type Generator = fn() -> Mesh;

/// The parts that can be generated, at sizes that suit a wire-arc bead.
const SHAPES: &[(&str, Generator)] = &[
    ("ring", || {
        shapes::extrude(&[shapes::ring(50.0, 38.0, 180)], 25.0)
    }),
    ("plate", || {
        shapes::extrude(&[shapes::plate(100.0, 60.0)], 15.0)
    }),
    ("cross", || {
        shapes::extrude(&[shapes::cross(120.0, 25.0)], 20.0)
    }),
    ("tee", || {
        shapes::extrude(&[shapes::tee(110.0, 80.0, 20.0)], 20.0)
    }),
    ("ell", || {
        shapes::extrude(&[shapes::ell(110.0, 80.0, 20.0)], 20.0)
    }),
    ("star", || {
        shapes::extrude(&[shapes::star(6, 70.0, 35.0)], 15.0)
    }),
    ("gear", || {
        shapes::extrude(&[shapes::gear(12, 55.0, 75.0, 20.0)], 20.0)
    }),
    ("honeycomb", || {
        shapes::extrude(&[shapes::honeycomb(3, 3, 40.0, 3.0)], 20.0)
    }),
    ("spiral", || {
        shapes::extrude(&[shapes::spiral(25.0, 20.0, 3.0, 2.5)], 20.0)
    }),
    ("truss", || {
        shapes::extrude(&[shapes::truss(4, 60.0, 8.0)], 20.0)
    }),
    ("thin-wall", || shapes::thin_wall(120.0, 3.0, 40.0)),
    ("box-wall", || shapes::box_wall(100.0, 70.0, 3.0, 40.0)),
    ("cone", || shapes::cone(50.0, 35.0, 40.0)),
    ("vase", || shapes::vase(45.0, 6.0, 3.0, 60.0, 180, 60)),
    ("flange", || {
        shapes::flange((75.0, 15.0), (45.0, 35.0), 28.0, 6, 60.0, 7.0)
    }),
    ("impeller-blank", || {
        shapes::impeller_blank((25.0, 45.0), (70.0, 12.0), 12.0)
    }),
    ("boss-on-plate", || {
        shapes::boss_on_plate((100.0, 70.0, 12.0), 25.0, 10.0, 30.0)
    }),
    ("bracket", || {
        shapes::ribbed_bracket((120.0, 70.0, 12.0), 2, 10.0, 45.0)
    }),
];

/// The names of the parts that can be generated.
pub fn shape_names() -> Vec<&'static str> {
    SHAPES.iter().map(|(name, _)| *name).collect()
}

/// Makes the folder `path` with `job.toml` and the generated part `shape`, for `wire`, or for the wire of the template. Returns the job
/// file's path.
///
/// # Errors
/// [`StartError`] when the shape is unknown or the wire has no process map, the folder exists or cannot be written.
pub fn waam(path: &Path, shape: &str, wire: Option<&str>) -> Result<PathBuf, StartError> {
    let (name, generate) = SHAPES
        .iter()
        .find(|(name, _)| *name == shape)
        .ok_or_else(|| StartError::Shape {
            name: shape.to_owned(),
            known: shape_names().join(", "),
        })?;
    let job = match wire {
        Some(wire) => template_of(wire)?,
        None => WAAM_TEMPLATE.to_owned(),
    };
    let mesh = generate();
    let folder = OutputFolder::create(path)?;
    let file = format!("{name}.stl");
    folder.write(&file, |mut w| write_stl(&mesh, name, &mut w))?;
    write_job(folder, &job.replace("PART", &file))
}

/// The wire that a process map says it is for.
fn wire_of(map: &DataText) -> Option<String> {
    peek(&map.text, &["wire"]).ok().flatten()
}

/// The wires for which a process map is known, each once.
pub fn wires_with_maps() -> Vec<String> {
    let maps = known(process_maps::ALL, Path::new(""));
    let mut wires: Vec<String> = maps.iter().filter_map(wire_of).collect();
    wires.sort();
    wires.dedup();
    wires
}

/// The template for `wire`: gas and mode are those of its first process map, the bead is the one in the middle of that.
fn template_of(wire: &str) -> Result<String, StartError> {
    let here = Path::new("");
    let text = DataText::load("wire", wire, wires::ALL, here)?;
    let data = text.read(Wire::parse)?;
    let maps = known(process_maps::ALL, here);
    let of_wire = |map: &&DataText| wire_of(map).is_some_and(|id| id == *data.id);
    let Some(found) = maps.iter().find(of_wire) else {
        return Err(StartError::Map {
            wire: wire.to_owned(),
            known: wires_with_maps().join(", "),
        });
    };
    let map =
        ProcessMap::parse(&found.name, &found.text, &data, &Reporter::new()).map_err(|e| {
            StartError::MapContent {
                name: found.name.clone(),
                message: e.to_string(),
            }
        })?;
    let middle = |(low, high): (f64, f64)| format!("{:.2} m/min", 0.5 * (low + high));
    let mut values = vec![
        ("wire", wire.to_owned()),
        ("gas", map.gas.clone()),
        ("mode", map.mode.clone()),
        ("wire_feed", middle(map.validity.wire_feed)),
        ("travel_speed", middle(map.validity.travel_speed)),
    ];
    if found.name != format!("{}-{}-{}", map.wire, map.mode, map.gas) {
        values.push(("# map", found.name.clone()));
    }
    let line = |line: &str| {
        let set = values
            .iter()
            .find(|(key, _)| line.starts_with(&format!("{key} = \"")));
        let comment = line
            .split_once('#')
            .filter(|(before, _)| !before.is_empty());
        match set {
            Some((key, value)) => {
                let set = format!("{} = \"{value}\"", key.trim_start_matches("# "));
                let comment = comment.map_or(String::new(), |(_, text)| format!("#{text}"));
                format!("{set:<30}{comment}\n")
            }
            None => format!("{line}\n"),
        }
    };
    Ok(WAAM_TEMPLATE.lines().map(line).collect())
}

/// Writes a job and the schema that its first line names, with which editors check and complete it.
fn write_job(folder: OutputFolder, job: &str) -> Result<PathBuf, StartError> {
    folder.write("job.toml", |w| w.write_all(job.as_bytes()))?;
    folder.write("job.schema.json", |w| {
        writeln!(w, "{:#}", schema(Subject::Job))
    })?;
    Ok(folder.commit()?.join("job.toml"))
}

/// Makes the folder `path` with a `job.toml` of a laser scan head. Returns the job file's path.
///
/// # Errors
/// [`StartError::Output`] when the folder exists or cannot be written.
pub fn lpbf(path: &Path) -> Result<PathBuf, StartError> {
    write_job(OutputFolder::create(path)?, LPBF_TEMPLATE)
}

/// Makes the folder `path` with the job of an electron beam over powder: a region with a hole, hatched. Returns the job
/// file's path.
///
/// # Errors
/// [`StartError::Output`] when the folder exists or cannot be written.
pub fn ebm(path: &Path) -> Result<PathBuf, StartError> {
    write_job(OutputFolder::create(path)?, EBM_TEMPLATE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{Job, load, parse};

    /// The template reads as it is, and with every commented key written out.
    #[test]
    fn a_new_scan_head_job_reads_with_and_without_its_options() {
        let dir = tempfile::tempdir().unwrap();
        let job = lpbf(&dir.path().join("a")).unwrap();
        assert!(matches!(load(&job).unwrap().0, Job::Lpbf(_)));
        let written: String = LPBF_TEMPLATE
            .lines()
            .map(|l| {
                l.strip_prefix("# ")
                    .filter(|l| {
                        l.contains(" = ") || l.starts_with("[optimise") || l.starts_with("[output")
                    })
                    .unwrap_or(l)
            })
            .filter(|l| {
                !l.starts_with("extent")
                    && !l.starts_with("layers")
                    && !l.starts_with("range")
                    && !l.starts_with("origin")
            })
            .fold(String::new(), |all, l| all + l + "\n");
        let Job::Lpbf(job) = parse(&written).unwrap() else {
            panic!("a scan-head job")
        };
        assert!(job.optimise.is_some() && job.output.motion.is_some() && job.plate.side.is_some());
        assert!(matches!(
            lpbf(&dir.path().join("a")),
            Err(StartError::Output(_))
        ));
    }

    /// What the template says is what the job reads; with every optional line made active too.
    #[test]
    fn a_new_beam_job_reads_with_all_its_options() {
        let dir = tempfile::tempdir().unwrap();
        let file = ebm(&dir.path().join("beam")).unwrap();
        let (Job::Ebm(job), _) = load(&file).unwrap() else {
            panic!("an electron-beam job")
        };
        assert!(job.path.is_none() && job.hatch.is_some());
        let other = ["files =", "low =", "high =", "printed-as"];
        let all: String = EBM_TEMPLATE
            .lines()
            .map(|l| match l.strip_prefix("# ") {
                Some(option)
                    if (option.contains(" = ") || option.starts_with('['))
                        && !other.iter().any(|o| option.starts_with(o)) =>
                {
                    format!("{option}\n")
                }
                _ => format!("{l}\n"),
            })
            .collect();
        assert!(all.contains("\nlayers = 1"));
        let every = dir.path().join("every.toml");
        std::fs::write(&every, all).unwrap();
        load(&every).unwrap();
    }

    /// Every wire with a map has a template that says what the map is for, and nothing else but that differs.
    #[test]
    fn every_wire_with_a_map_has_a_template() {
        let wires = wires_with_maps();
        assert!(wires.len() >= 4, "{wires:?}");
        for wire in wires {
            let text = template_of(&wire).unwrap();
            assert!(text.contains(&format!("wire = \"{wire}\"")), "{text}");
            let differing = text
                .lines()
                .zip(WAAM_TEMPLATE.lines())
                .filter(|(a, b)| a != b);
            assert!(differing.count() <= 5);
            let Job::Waam(job) = parse(&text).unwrap() else {
                panic!("a wire-arc job")
            };
            assert_eq!(*job.waam.wire, wire);
        }
        let unmapped = template_of("g3si-1.2").unwrap_err().to_string();
        assert!(unmapped.contains("er4043-1.2"), "{unmapped}");
        assert!(matches!(template_of("lead"), Err(StartError::Wire(_))));
    }

    #[test]
    fn every_new_job_reads_and_its_part_is_closed() {
        let dir = tempfile::tempdir().unwrap();
        for name in shape_names() {
            let job = waam(&dir.path().join(name), name, None).unwrap();
            let (Job::Waam(job), _) = load(&job).unwrap() else {
                panic!("a wire-arc job")
            };
            assert_eq!(**job.part, format!("{name}.stl"));
        }
        for (name, generate) in SHAPES {
            let mesh = generate();
            assert!(mesh.volume() > 1000.0, "{name}: {}", mesh.volume());
        }
        assert!(matches!(
            waam(&dir.path().join("x"), "teapot", None),
            Err(StartError::Shape { .. })
        ));
        assert!(matches!(
            waam(&dir.path().join("ring"), "ring", None),
            Err(StartError::Output(_))
        ));
    }
}
