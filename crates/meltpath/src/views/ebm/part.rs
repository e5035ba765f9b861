//! The part in the report of an electron-beam job: which section is drawn, and what its faces will be like.

use meltpath_report::html::Section;
use meltpath_report::table::{Cell, Table};

use crate::ebm::plan::Plan;
use crate::ebm::plan::region::Below;
use crate::ebm::settings::Settings;

/// What is drawn and how rough it becomes; `None` where neither is known.
pub(super) fn section(plan: &Plan) -> Option<Section> {
    let tables: Vec<Table> = [drawn(plan), roughness(&plan.settings)]
        .into_iter()
        .flatten()
        .collect();
    (!tables.is_empty()).then(|| Section::new("What is built", "", vec![], tables))
}

fn drawn(plan: &Plan) -> Option<Table> {
    let part = plan.part.as_ref()?;
    let mut table = Table::new("The section", &["", ""]);
    let mut row = |name: &str, value: String| {
        table.rows.push(vec![Cell::text(name), Cell::text(&value)]);
    };
    let file = part.file.file_name().unwrap_or_default();
    row("part", file.to_string_lossy().into_owned());
    row("found", part.findings.join("; "));
    let [plane, along] = part.scaling;
    row(
        "drawn larger, since it shrinks on cooling",
        format!("{plane} in the plane, {along} along the build direction"),
    );
    let [number, of] = part.layer;
    row(
        "layer",
        format!(
            "{number} of {of}, {} µm each",
            1e3 * plan.settings.job.ebm.layer.0
        ),
    );
    let [islands, island] = part.islands;
    row(
        "area",
        format!("{:.1} mm², {island} of {islands} separate areas", part.area),
    );
    let lower = plan.lower.len();
    row("layers drawn below it", lower.to_string());
    row(
        "metal below the lowest drawn layer",
        match &plan.below {
            Below::Metal => "everywhere: the start plate".to_owned(),
            Below::Areas(_) => format!(
                "{:.1} % of the last layer's area, powder below the rest",
                100.0 * part.carried
            ),
        },
    );
    Some(table)
}

fn roughness(settings: &Settings) -> Option<Table> {
    let roughness = settings.material.roughness?;
    let mut table = Table::new(
        "Roughness to expect, Ra (µm)",
        &["faces", "mean", "least", "greatest"],
    );
    let mut row = |name: &str, mean: Option<f64>, ends: [f64; 2]| {
        table.rows.push(vec![
            Cell::text(name),
            mean.map_or_else(|| Cell::text(""), |m| Cell::Fixed(m, 1)),
            Cell::Fixed(ends[0], 1),
            Cell::Fixed(ends[1], 1),
        ]);
    };
    let [mean, least, greatest] = roughness.in_plane;
    row(
        "vertical, in the build plane",
        Some(mean),
        [least, greatest],
    );
    let [mean, least, greatest] = roughness.along_build;
    row("vertical, along the build", Some(mean), [least, greatest]);
    row("of any direction", None, roughness.any_face);
    Some(Table {
        note: "Measured on parts of this powder (Béraud 2016, annex A). Grains stick to the melt: no setting of the beam changes it, a finer powder does.".to_owned(),
        ..table
    })
}
