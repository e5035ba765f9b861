//! What the beam draws: a path from a file, a region of the job, or the section of a part.

use std::path::{Path, PathBuf};

use meltpath_base::{Observer, Provenance, Ratio, Reporter};
use meltpath_geometry::Region;
use meltpath_geometry::math::DVec3;
use meltpath_gun::Gun;
use meltpath_gun::focus::FocusCalibration;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::material::Material;

use super::hatch::{Hatch, HatchError, modulated};
use super::region::{Below, Contour};
use super::section::{Cut, SectionError, Sections, sections};
use super::settings::{at, beam_path};
use crate::job::ebm::{EbmJob, Ground, HatchStrategy, ModulationTable};
use crate::job::{PartUnit, TextError};
use crate::part;

/// The part of which a section is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnPart {
    /// Its file.
    pub file: PathBuf,
    /// What was found and repaired.
    pub findings: Vec<String>,
    /// Number of the layer that is drawn last, from 1 on the plate, and how many the part has.
    pub layer: [u32; 2],
    /// Separate areas of that layer, and the one that is drawn, from 1.
    pub islands: [usize; 2],
    /// Area of the drawn one, mm².
    pub area: f64,
    /// Share of it with metal below the lowest layer that is drawn.
    pub carried: f64,
    /// What the part is drawn larger by, in the plane and along the build direction.
    pub scaling: [f64; 2],
}

/// What the beam draws.
pub(super) struct Drawing {
    pub path_file: Option<PathBuf>,
    /// A path for each layer, the lowest first.
    pub paths: Vec<BeamPath>,
    /// What the last layer fills.
    pub contour: Contour,
    pub hatch: Option<Hatch>,
    /// The gun, at the settings of the hatch or of the file.
    pub gun: Gun,
    pub below: Below,
    pub part: Option<DrawnPart>,
}

fn plain(message: String) -> TextError {
    TextError {
        span: None,
        message,
        help: None,
    }
}

fn corners(ring: &[[meltpath_base::Length; 2]]) -> Vec<[f64; 2]> {
    ring.iter().map(|c| c.map(|v| v.0)).collect()
}

impl Drawing {
    /// What a job draws in `layers` layers `thickness` mm thick.
    pub(super) fn of(
        job: &EbmJob,
        folder: &Path,
        (material, focus): (&Material, &FocusCalibration),
        [layers, thickness]: [f64; 2],
        (reporter, observer): (&Reporter, &dyn Observer),
        r: &mut Provenance,
    ) -> Result<Self, TextError> {
        if let Some(file) = &job.path {
            return Self::of_file(job, folder, file, focus, layers as usize);
        }
        let hatched = |regions: &[Vec<Region>], below: Below, r: &mut Provenance| {
            let hatch = hatch(job, thickness, focus, &below, r)?;
            let paths = regions
                .iter()
                .zip(1..)
                .map(|(regions, number)| hatch.path(regions, number, reporter))
                .collect::<Result<Vec<_>, HatchError>>()
                .map_err(|e| plain(format!("[hatch]: {e}")))?;
            Ok((paths, hatch, below))
        };
        let Some(file) = &job.part else {
            let contour = contour(job);
            let regions = vec![vec![contour.region()]; layers as usize];
            let (paths, hatch, below) = hatched(&regions, ground(job), r)?;
            return Ok(Drawing {
                path_file: None,
                paths,
                contour,
                gun: hatch.gun.clone(),
                hatch: Some(hatch),
                below,
                part: None,
            });
        };
        let cut = cut(job, material, [layers, thickness], r);
        let up = r.written_or(
            "build_direction",
            job.build_direction,
            [0.0, 0.0, 1.0],
            "+Z of the part file",
        );
        let part = part::load(
            &folder.join(file.get_ref()),
            job.part_unit,
            DVec3::from_array(up),
            // far below a voxel
            0.1 * thickness,
            reporter,
            observer,
        )
        .map_err(|e| at(file.span(), &e))?;
        let found = sections(&part.mesh, &cut, reporter, observer).map_err(|e| refused(job, &e))?;
        let below = found.below.as_ref().map_or(Below::Metal, |regions| {
            Below::Areas(regions.iter().map(Contour::of).collect())
        });
        r.written_or("part", Some(part.name), String::new(), "");
        r.written_or(
            "part_unit",
            Some(job.part_unit),
            PartUnit::Millimetre,
            "of files that carry none",
        );
        let (paths, hatch, below) = hatched(&found.drawn, below, r)?;
        let Sections {
            drawn,
            number,
            of,
            islands,
            carried,
            ..
        } = found;
        let last = drawn.last().and_then(|regions| regions.first());
        let contour = last.map_or_else(|| Contour::new(Vec::new()), Contour::of);
        Ok(Drawing {
            path_file: None,
            paths,
            part: Some(DrawnPart {
                file: folder.join(file.get_ref()),
                findings: part.findings,
                layer: [number, of],
                islands: [islands, cut.island as usize],
                area: last.map_or(0.0, Region::area),
                carried,
                scaling: cut.scaling,
            }),
            contour,
            gun: hatch.gun.clone(),
            hatch: Some(hatch),
            below,
        })
    }

    fn of_file(
        job: &EbmJob,
        folder: &Path,
        file: &toml::Spanned<String>,
        focus: &FocusCalibration,
        layers: usize,
    ) -> Result<Self, TextError> {
        let (path_file, path, gun) = beam_path(folder, file, focus)?;
        let contour = if job.region.contour.is_empty() {
            let on: Vec<[f64; 2]> = path.points().iter().map(|p| [p.x, p.y]).collect();
            Contour::hull(&on)
        } else {
            contour(job)
        };
        Ok(Drawing {
            path_file: Some(path_file),
            paths: vec![path; layers],
            contour,
            hatch: None,
            gun,
            below: ground(job),
            part: None,
        })
    }
}

fn contour(job: &EbmJob) -> Contour {
    let region = &job.region;
    Contour::new(corners(&region.contour))
        .with_holes(region.holes.iter().map(|h| corners(h)).collect())
}

/// What the job says of what lies below.
fn ground(job: &EbmJob) -> Below {
    let supported = &job.region.supported;
    match job.ebm.ground {
        Ground::Metal => Below::Metal,
        Ground::Powder if supported.is_empty() => Below::Areas(Vec::new()),
        Ground::Powder => Below::Areas(vec![Contour::new(corners(supported))]),
    }
}

fn hatch(
    job: &EbmJob,
    thickness: f64,
    focus: &FocusCalibration,
    below: &Below,
    r: &mut Provenance,
) -> Result<Hatch, TextError> {
    let table = job.hatch.clone().unwrap_or_default();
    let mut hatch = Hatch::resolve(&table, thickness, focus, r)
        .map_err(|e| plain(format!("hatch.focus: {e}")))?;
    let follows = table.strategy == HatchStrategy::Modulated;
    let law = job.modulation.clone();
    if let Some(law) = law.or(follows.then(ModulationTable::default)) {
        hatch.plan.modulation = Some(modulated(&law, hatch.plan.energy(), below, r));
    }
    Ok(hatch)
}

fn cut(job: &EbmJob, material: &Material, [layers, layer]: [f64; 2], r: &mut Provenance) -> Cut {
    let table = &job.section;
    let height = table.height.as_ref().map(|h| h.get_ref().0);
    r.written_or(
        "section.height",
        height.map(|h| format!("{} mm", h.0)),
        "half the part's".to_owned(),
        "no layer is named",
    );
    let island = table.island.as_ref().map(|n| *n.get_ref());
    let scaling = table.scaling.map(|s| s.map(|s| s.0));
    Cut {
        height: height.map(|h| h.0),
        island: r.written_or("section.island", island, 1, "the largest"),
        scaling: r
            .written_or(
                "section.scaling",
                scaling,
                material.scaling.map(Ratio),
                "the material's: parts shrink on cooling",
            )
            .map(|s| s.0),
        layer,
        layers: layers as u32,
    }
}

/// The error at the place in the job where a value is to blame.
fn refused(job: &EbmJob, e: &SectionError) -> TextError {
    let table = &job.section;
    let height = table.height.as_ref().map(toml::Spanned::span);
    let span = match e {
        SectionError::Above { .. } | SectionError::Empty { .. } => height,
        SectionError::Island { .. } => table.island.as_ref().map(toml::Spanned::span),
        SectionError::Slice(_) | SectionError::Planar(_) | SectionError::Flat { .. } => None,
    };
    TextError {
        span: span.or_else(|| job.part.as_ref().map(toml::Spanned::span)),
        message: e.to_string(),
        help: None,
    }
}
