//! New jobs: a folder with a commented job file and a part, that runs as it is.

use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::shapes;

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

/// Makes the folder `path` with `job.toml` and the generated part `shape`. Returns the job file's path.
///
/// # Errors
/// [`StartError`] when the shape is unknown, the folder exists or cannot be written.
pub fn waam(path: &Path, shape: &str) -> Result<PathBuf, StartError> {
    let (name, generate) = SHAPES
        .iter()
        .find(|(name, _)| *name == shape)
        .ok_or_else(|| StartError::Shape {
            name: shape.to_owned(),
            known: shape_names().join(", "),
        })?;
    let mesh = generate();
    let folder = OutputFolder::create(path)?;
    let file = format!("{name}.stl");
    folder.write(&file, |mut w| write_stl(&mesh, name, &mut w))?;
    write_job(folder, &WAAM_TEMPLATE.replace("PART", &file))
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
                    if option.contains(" = ") && !other.iter().any(|o| option.starts_with(o)) =>
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

    #[test]
    fn every_new_job_reads_and_its_part_is_closed() {
        let dir = tempfile::tempdir().unwrap();
        for name in shape_names() {
            let job = waam(&dir.path().join(name), name).unwrap();
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
            waam(&dir.path().join("x"), "teapot"),
            Err(StartError::Shape { .. })
        ));
        assert!(matches!(
            waam(&dir.path().join("ring"), "ring"),
            Err(StartError::Output(_))
        ));
    }
}
