//! The plan of a scan-head job: squares laid out, layers read or a part cut and hatched, from the resolved settings.

pub(in crate::lpbf) mod apart;
mod bare_spot;
mod cells;
pub(in crate::lpbf) mod enclosed;
pub mod file_layers;
pub mod section;
mod thickness;
pub mod work;

use std::path::Path;

use meltpath_base::number::significant;
use meltpath_base::settings::Problem;
use meltpath_base::{Check, Length, Observer, Origin, Place, Provenance, Reporter, Warning};
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::files::PlateTable;

use super::heat::HeatSettings;
use super::settings::Settings;
use crate::job::lpbf::{HeatTable, LpbfJob, PlateExtent, PlateTable as SquaresTable};
use crate::lpbf::plan::enclosed::Enclosure;
use crate::lpbf::plan::file_layers::FileLayers;
use crate::lpbf::plan::section::Section;
use crate::lpbf::plan::work::{LayerSet, Source, Work};

/// What is executed, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The values of the job.
    pub settings: Settings,
    /// What is run.
    pub work: Work,
    /// What was said of the part.
    pub warnings: Vec<Warning>,
    /// What the contours of a file's layers tell.
    pub enclosed: Enclosure,
    /// What is said of layers of a file that are not run.
    pub left_out: Option<Check>,
}

/// Plans what `settings` say of a job that lies in `folder`; `job` gives the places of problems.
///
/// # Errors
/// Layers that do not read, a part that cannot be cut or hatched.
pub fn plan(
    mut settings: Settings,
    job: &LpbfJob,
    folder: &Path,
    observer: &dyn Observer,
) -> Result<Plan, Problem> {
    let reporter = Reporter::new();
    let (stated, r) = (&settings.data.plate, &mut settings.provenance);
    let work = work(job, folder, stated, (&reporter, observer), r)?;
    if let (Some(table), Some(heat)) = (&*job.heat, &mut settings.heat)
        && let Work::Layers(set) = &work
        && let Source::File(file) = &set.source
    {
        depths(table, heat, file, (&reporter, r))?;
    }
    Ok(Plan {
        settings,
        work,
        warnings: reporter.warnings(),
        enclosed: Enclosure::default(),
        left_out: None,
    })
}

/// By how much the depth that a job says may differ from a layer's thickness before that is told.
const ALIKE: f64 = 0.01;

/// Takes the depth to be melted from the layers of a file, where the job does not say it; tells where it says another.
fn depths(
    table: &HeatTable,
    heat: &mut HeatSettings,
    file: &FileLayers,
    (reporter, r): (&Reporter, &mut Provenance),
) -> Result<(), Problem> {
    let told = || file.thickness.iter().filter_map(|(n, t)| Some((*n, (*t)?)));
    if let Some(written) = table.layer.map(|l| l.0) {
        let other = told().find(|(_, t)| (written - t).abs() > ALIKE * t);
        if let Some((layer, thick)) = other {
            reporter.warn_at(
                "heat-other-thickness",
                format!(
                    "heat.layer is {} µm, layer {layer} of the file is {} µm thick",
                    significant(1e3 * written, 3),
                    significant(1e3 * thick, 3)
                ),
                Place::layer(layer),
                "leave out heat.layer: the file tells how thick its layers are",
            );
        }
        return Ok(());
    }
    if let Some((layer, _)) = file.thickness.iter().find(|(_, t)| t.is_none()) {
        let message = format!(
            "the heights in the file of the layers do not tell how thick layer {layer} is: nothing says how deep it has to melt"
        );
        let help = "give heat.layer, the thickness of the layers; or heights that rise from layer to layer in the file";
        return Err(table.layer.problem(message).help(help));
    }
    let thickest = told().map(|(_, t)| t).fold(0.0, f64::max);
    let from = Origin::Computed("the thickest of the file's layers".to_owned());
    heat.layer = table.layer.or_from(r, Length(thickest), from).0;
    heat.depths = told().collect();
    Ok(())
}

/// What is executed; what the job says of other work is not recorded.
fn work(
    job: &LpbfJob,
    folder: &Path,
    stated: &PlateTable,
    (reporter, observer): (&Reporter, &dyn Observer),
    r: &mut Provenance,
) -> Result<Work, Problem> {
    let mut others = vec![
        "plate.",
        "layers.",
        "section.",
        "hatch.",
        "part_unit",
        "build_direction",
    ];
    let (file, layers) = (&*job.part, &*job.lpbf.layers);
    others.retain(|other| match *other {
        "plate." => file.is_some() || layers.is_some(),
        "layers." => layers.is_none(),
        _ => file.is_none(),
    });
    r.parameters
        .retain(|key, _| !others.iter().any(|other| key.starts_with(other)));
    if let Some(file) = file {
        let whole = (folder.join(&**file), stated.hatch.0);
        let section = Section::of(job, (&whole.0, whole.1), (reporter, observer), r)?;
        return Ok(Work::Layers(Box::new(LayerSet {
            file: file.to_string(),
            hatch: Some(section.spacing()),
            source: Source::Part(section),
        })));
    }
    let Some(file) = layers else {
        return Ok(Work::Plate(plate(&job.plate, stated, r)));
    };
    let found = FileLayers::choose(&folder.join(&**file), file, &job.layers, reporter)
        .map_err(|message| job.lpbf.layers.problem(message))?;
    job.layers.range.or_computed(r, found.numbers);
    Ok(Work::Layers(Box::new(LayerSet {
        file: file.to_string(),
        source: Source::File(found),
        hatch: job.layers.hatch.map(|h| h.0),
    })))
}

/// The squares that the job asks for, on the plate that the head's file states.
fn plate(table: &SquaresTable, stated: &PlateTable, r: &mut Provenance) -> SquarePlate {
    let block = match *table.extent {
        PlateExtent::Block => [2, 2],
        PlateExtent::Whole => [&stated.columns, &stated.rows].map(|n| n.0.round() as u32),
    };
    let [columns, rows] = table.block.or_computed(r, block);
    SquarePlate {
        columns,
        rows,
        column_pitch: stated.column_pitch.0,
        row_pitch: stated.row_pitch.0,
        side: table.side.or_computed(r, Length(stated.side.0)).0,
        contour_distance: stated.contour_distance.0,
        hatch: table.hatch.or_computed(r, Length(stated.hatch.0)).0,
        inset: stated.inset.0,
    }
}
