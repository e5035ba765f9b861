//! The report: one HTML page that opens offline and stays whole when it is mailed, archived or printed.
//!
//! Everything is inside the page; its own content-security policy forbids any request and any script but its
//! own, whose digest it states.

use std::io::{self, Write};

use meltpath_base::{Provenance, Verdict};
use sha2::{Digest, Sha256};

use crate::escape::{escape, json_for_script};
use crate::packing::base64;
use crate::plot::Plot;
use crate::plot::svg::figure;
use crate::provenance_html;
use crate::scene::data::{self, SceneData};
use crate::scene::{Scene, SceneError};
use crate::sheet::OperatorSheet;
use crate::table::Table;
use crate::verdict_html::{self, Places};

const STYLE: &str = include_str!("../assets/report.css");
const PAGE_SCRIPT: &str = include_str!("../assets/page.js");
const VIEW_SCRIPT: &str = concat!(
    include_str!("../assets/view/columns.js"),
    include_str!("../assets/view/shaders.js"),
    include_str!("../assets/view/upload.js"),
    include_str!("../assets/view/camera.js"),
    include_str!("../assets/view/draw.js"),
    include_str!("../assets/view/controls.js"),
    include_str!("../assets/view/pointer.js"),
    include_str!("../assets/view/places.js"),
    include_str!("../assets/view/machine.js"),
    include_str!("../assets/view/start.js"),
);
const VIEW_CONTROLS: &str = include_str!("../assets/view.html");

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The scene makes no sense.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The system refused.
    #[error("cannot write the report: {0}")]
    Io(#[from] io::Error),
}

/// A chapter of plots and tables.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// Title.
    pub title: String,
    /// What it shows, in a sentence or two; empty for none.
    pub intro: String,
    /// Plots, two beside each other where there is room.
    pub plots: Vec<Plot>,
    /// Tables.
    pub tables: Vec<Table>,
}

impl Section {
    /// A chapter of these.
    pub fn new(
        title: impl Into<String>,
        intro: impl Into<String>,
        plots: Vec<Plot>,
        tables: Vec<Table>,
    ) -> Self {
        Section {
            title: title.into(),
            intro: intro.into(),
            plots,
            tables,
        }
    }
}

/// What a report holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// What was made, such as the job's name.
    pub title: String,
    /// Part, process, wire: one line.
    pub subtitle: String,
    /// Checks, facts and warnings.
    pub verdict: Verdict,
    /// The 3D view.
    pub scene: Option<Scene>,
    /// Plots and tables.
    pub sections: Vec<Section>,
    /// What the operator needs.
    pub sheet: Option<OperatorSheet>,
    /// Where everything comes from.
    pub provenance: Provenance,
}

/// Writes the page. The same report gives the same bytes.
///
/// # Errors
/// [`ReportError::Scene`] before anything is written; [`ReportError::Io`] when the system refuses.
pub fn write_html(out: &mut dyn Write, report: &Report) -> Result<(), ReportError> {
    let scene = report.scene.as_ref().map(data::pack).transpose()?;
    let script = [PAGE_SCRIPT, if scene.is_some() { VIEW_SCRIPT } else { "" }].concat();
    head(out, report, &script)?;
    write!(
        out,
        "<header class=\"page\"><div><h1>{}</h1><p>{}</p></div></header>",
        escape(&report.title),
        escape(&report.subtitle)
    )?;
    contents(out, report)?;
    out.write_all(b"<main>")?;
    verdict(out, report)?;
    if let Some(data) = &scene {
        view(out, data)?;
    }
    for (i, section) in report.sections.iter().enumerate() {
        chapter(out, i, section)?;
    }
    if let Some(sheet) = &report.sheet {
        write!(
            out,
            "<section id=\"sheet\" class=\"card\"><div class=\"bar\"><h2>Operator sheet</h2>\
             <button type=\"button\" id=\"print-sheet\">Print this sheet</button></div>\
             <p class=\"print-only\">{} · {}</p>{}</section>",
            escape(&report.title),
            escape(&report.subtitle),
            sheet.to_html()
        )?;
    }
    write!(
        out,
        "<section id=\"warnings\" class=\"card\"><h2>Warnings</h2>{}</section>",
        verdict_html::warnings(&report.verdict.warnings, places(report))
    )?;
    write!(
        out,
        "<section id=\"provenance\" class=\"card\"><h2>Provenance</h2>{}</section></main>",
        provenance_html::provenance(&report.provenance)
    )?;
    if let Some(data) = &scene {
        embed(out, data)?;
    }
    writeln!(out, "<script>{script}</script></body></html>")?;
    Ok(())
}

fn head(out: &mut dyn Write, report: &Report, script: &str) -> io::Result<()> {
    // the digest is of the text between the script tags
    let digest = base64(&Sha256::digest(script.as_bytes()));
    write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
         script-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <meta name=\"generator\" content=\"meltpath {}\">\
         <title>{} – {}</title><style>{STYLE}</style></head><body>",
        escape(&report.provenance.meltpath),
        escape(&report.title),
        report.verdict.status().words(),
    )
}

fn contents(out: &mut dyn Write, report: &Report) -> io::Result<()> {
    out.write_all(b"<nav aria-label=\"Contents\"><a href=\"#verdict\">Verdict</a>")?;
    if report.scene.is_some() {
        out.write_all(b"<a href=\"#view\">3D view</a>")?;
    }
    for (i, section) in report.sections.iter().enumerate() {
        write!(out, "<a href=\"#s{i}\">{}</a>", escape(&section.title))?;
    }
    if report.sheet.is_some() {
        out.write_all(b"<a href=\"#sheet\">Operator sheet</a>")?;
    }
    out.write_all(b"<a href=\"#warnings\">Warnings</a><a href=\"#provenance\">Provenance</a></nav>")
}

fn places(report: &Report) -> Places {
    match report.scene {
        Some(_) => Places::InView,
        None => Places::InWords,
    }
}

fn verdict(out: &mut dyn Write, report: &Report) -> io::Result<()> {
    write!(
        out,
        "<section class=\"card\" aria-label=\"Verdict\">{}",
        verdict_html::headline(&report.verdict)
    )?;
    write!(
        out,
        "{}{}</section>",
        verdict_html::checks(&report.verdict, places(report)),
        verdict_html::facts(&report.verdict.facts, places(report))
    )
}

fn view(out: &mut dyn Write, data: &SceneData) -> io::Result<()> {
    out.write_all(VIEW_CONTROLS.as_bytes())?;
    out.write_all(b"<p class=\"note\">")?;
    for note in &data.notes {
        write!(out, "{} ", escape(note))?;
    }
    out.write_all(b"</p></section>")
}

fn chapter(out: &mut dyn Write, number: usize, section: &Section) -> io::Result<()> {
    write!(
        out,
        "<section id=\"s{number}\" class=\"card\"><h2>{}</h2>",
        escape(&section.title)
    )?;
    if !section.intro.is_empty() {
        write!(out, "<p>{}</p>", escape(&section.intro))?;
    }
    if !section.plots.is_empty() {
        out.write_all(b"<div class=\"plots\">")?;
        for plot in &section.plots {
            out.write_all(figure(plot).as_bytes())?;
        }
        out.write_all(b"</div>")?;
    }
    for table in &section.tables {
        out.write_all(table.to_html().as_bytes())?;
    }
    out.write_all(b"</section>")
}

fn embed(out: &mut dyn Write, data: &SceneData) -> io::Result<()> {
    // elements of an unknown type are data: browsers neither run nor show them
    write!(
        out,
        "<script type=\"application/json\" id=\"scene\">{}</script>",
        json_for_script(&data.description)
    )?;
    for (i, column) in data.columns.iter().enumerate() {
        write!(
            out,
            "\n<script type=\"text/plain\" id=\"column-{i}\">{column}</script>"
        )?;
    }
    Ok(())
}
