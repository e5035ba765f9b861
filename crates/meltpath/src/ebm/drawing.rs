//! What the beam draws: a path from a file, a region of the job, or the section of a part.

use std::path::{Path, PathBuf};

use meltpath_base::settings::Problem;
use meltpath_base::{Observer, Provenance, Ratio, Reporter};
use meltpath_geometry::Region;
use meltpath_geometry::math::DVec3;
use meltpath_gun::Gun;
use meltpath_gun::focus::FocusCalibration;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::material::Material;

use super::hatch::{Hatch, HatchError, modulated};
use super::path_file::beam_path;
use super::region::{Below, Contour};
use crate::job::ebm::{EbmJob, Ground, HatchStrategy, Ring};
use crate::stages::part;
use crate::stages::section::{Cut, Sections, sections};

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

fn corners(ring: &Ring) -> Vec<[f64; 2]> {
    ring.iter().map(|c| c.map(|v| v.0)).collect()
}

impl Drawing {
    /// What a job draws.
    pub(super) fn of(
        job: &EbmJob,
        folder: &Path,
        (material, focus): (&Material, &FocusCalibration),
        (reporter, observer): (&Reporter, &dyn Observer),
        r: &mut Provenance,
    ) -> Result<Self, Problem> {
        let layers = *job.ebm.layers as usize;
        if let Some(file) = &*job.path {
            return Self::of_file(job, folder.join(&**file), focus, layers);
        }
        let hatched = |regions: &[Vec<Region>], below: Below, r: &mut Provenance| {
            let hatch = hatch(job, focus, &below, r)?;
            let paths = regions
                .iter()
                .zip(1..)
                .map(|(regions, number)| hatch.path(regions, number, reporter))
                .collect::<Result<Vec<_>, HatchError>>()
                .map_err(|e| job.hatch.problem(format!("[hatch]: {e}")))?;
            Ok((paths, hatch, below))
        };
        let Some(file) = job.part.as_ref().map(|file| folder.join(&**file)) else {
            let contour = contour(job);
            let regions = vec![vec![contour.region()]; layers];
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
        let cut = cut(job, material, r);
        // the part says it itself
        r.parameters.remove(&job.ebm.ground.name);
        let part = part::load(
            &file,
            *job.part_unit,
            DVec3::from_array(job.build_direction.0),
            // far below a voxel
            0.1 * job.ebm.layer.0,
            reporter,
            observer,
        )
        .map_err(|e| job.part.problem(e.to_string()))?;
        let found = sections(&part.mesh, &cut, reporter, observer).map_err(|e| {
            let at = &job.section;
            e.told([&at.height.span, &at.island.span, &job.part.span])
        })?;
        let below = found.below.as_ref().map_or(Below::Metal, |regions| {
            Below::Areas(regions.iter().map(Contour::of).collect())
        });
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
                file,
                findings: part.findings,
                layer: [number, of],
                islands: [islands, *job.section.island as usize],
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
        path_file: PathBuf,
        focus: &FocusCalibration,
        layers: usize,
    ) -> Result<Self, Problem> {
        let (path, gun) = beam_path(&path_file, &job.path, focus)?;
        let contour = if job.region.contour.is_some() {
            contour(job)
        } else {
            let on: Vec<[f64; 2]> = path.points().iter().map(|p| [p.x, p.y]).collect();
            Contour::hull(&on)
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
    let outer = region.contour.as_ref().map(corners).unwrap_or_default();
    Contour::new(outer).with_holes(region.holes.iter().map(corners).collect())
}

/// What the job says of what lies below.
fn ground(job: &EbmJob) -> Below {
    match (*job.ebm.ground, &*job.region.supported) {
        (Ground::Metal, _) => Below::Metal,
        (Ground::Powder, None) => Below::Areas(Vec::new()),
        (Ground::Powder, Some(supported)) => Below::Areas(vec![Contour::new(corners(supported))]),
    }
}

fn hatch(
    job: &EbmJob,
    focus: &FocusCalibration,
    below: &Below,
    r: &mut Provenance,
) -> Result<Hatch, Problem> {
    let table = job
        .hatch
        .as_ref()
        .ok_or_else(|| Problem::new("nothing draws the region: write [hatch]"))?;
    let mut hatch = Hatch::of(table, job.ebm.layer.0, focus, r)
        .map_err(|e| table.focus.problem(format!("hatch.focus: {e}")))?;
    let law = match *table.strategy {
        HatchStrategy::Modulated => job.modulation.clone().or_defaults(r),
        _ => job.modulation.value.clone(),
    };
    hatch.plan.modulation = law.map(|law| modulated(&law, hatch.plan.energy(), below));
    Ok(hatch)
}

fn cut(job: &EbmJob, material: &Material, r: &mut Provenance) -> Cut {
    let table = &job.section;
    let scaling = table.scaling.or_computed(r, material.scaling.map(Ratio));
    Cut {
        height: table.height.map(|h| h.0),
        island: Some(*table.island),
        scaling: scaling.map(|s| s.0),
        layer: job.ebm.layer.0,
        layers: *job.ebm.layers,
    }
}
