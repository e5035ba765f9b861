//! The whole page: what it holds, what it must never hold, how large it is.

use meltpath_base::{Check, Fact, Place, Warning};
use meltpath_report::html::{Report, ReportError, Section, write_html};
use meltpath_report::plot::{Axis, Plot};
use meltpath_report::scene::SceneError;
use meltpath_report::table::{Cell, Table};

fn page(report: &Report) -> String {
    let mut out = Vec::new();
    write_html(&mut out, report).unwrap();
    String::from_utf8(out).unwrap()
}

#[test]
fn the_page_is_whole_and_asks_for_nothing() {
    let html = page(&crate::demo::report(0.5));
    for part in [
        "id=\"verdict\"",
        "id=\"view\"",
        "id=\"sheet\"",
        "id=\"provenance\"",
        "class=\"plot\"",
    ] {
        assert!(html.contains(part), "{part} is missing");
    }
    for word in ["pass", "warn", "fail", "cannot say", "not checked"] {
        assert!(
            html.contains(&format!("</svg>{word}</td>")),
            "no check says {word}"
        );
    }
    // nothing that a browser would load
    for call in [
        "src=",
        "href=\"http",
        "url(",
        "@import",
        "fetch(",
        "XMLHttpRequest",
        "import(",
    ] {
        assert!(!html.contains(call), "{call} would ask for another file");
    }
    assert!(html.contains("default-src 'none'"));
}

#[test]
fn the_same_report_gives_the_same_bytes_on_any_number_of_threads() {
    let report = crate::demo::report(0.5);
    let on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| page(&report))
    };
    assert_eq!(on(1), on(4));
}

#[test]
fn hostile_names_stay_text() {
    let evil = "</script><script>alert(1)</script><img src=x onerror=alert(1)>\" onload='x'";
    let mut report = crate::demo::report(5.0);
    report.title = evil.to_owned();
    report.subtitle = evil.to_owned();
    report.verdict.facts = vec![Fact::words(evil, evil, evil)];
    report
        .verdict
        .checks
        .push(Check::not_checked(evil, evil, evil).at(Place {
            file: Some(evil.to_owned()),
            ..Place::default()
        }));
    report.verdict.warnings.push(Warning {
        code: evil.to_owned(),
        message: evil.to_owned(),
        place: None,
        remedy: Some(evil.to_owned()),
    });
    let mut table = Table::new(evil, &[evil]);
    table.rows = vec![vec![Cell::text(evil)]];
    table.note = evil.to_owned();
    report.sections.push(Section::new(
        evil.to_owned(),
        evil.to_owned(),
        vec![
            Plot::new(evil, Axis::new(evil, evil), Axis::new(evil, evil))
                .limit(evil.to_owned(), 1.0)
                .caption(evil),
        ],
        vec![table],
    ));
    if let Some(scene) = &mut report.scene {
        scene.lines[0].name = evil.to_owned();
        scene.lines[0].scalars[0].name = evil.to_owned();
        scene.lines[0].scalars[0].unit = evil.to_owned();
    }
    if let Some(sheet) = &mut report.sheet {
        sheet.before.push(evil.to_owned());
        sheet.settings[0].remark = evil.to_owned();
    }
    report
        .provenance
        .inputs
        .insert(evil.to_owned(), evil.to_owned());
    let html = page(&report);
    assert!(
        !html.contains("<script>alert"),
        "a script element got through"
    );
    assert!(!html.contains("<img"), "an element got through");
    // in the scene's JSON the quote may stand: it is escaped there as JSON does
    let shown = html.split("<script").next().unwrap();
    assert!(!shown.contains("\" onload"), "an attribute got through");
    // the page's own: the scene, its columns, the script
    let columns = html.matches("<script type=\"text/plain\"").count();
    assert_eq!(html.matches("<script").count(), columns + 2);
}

#[test]
fn a_page_without_a_scene_carries_no_viewer() {
    let mut report = crate::demo::report(5.0);
    report.scene = None;
    let html = page(&report);
    assert!(!html.contains("webgl2") && !html.contains("id=\"view\""));
    assert!(html.len() < 120_000, "{} bytes", html.len());
}

#[test]
fn a_scene_that_makes_no_sense_writes_nothing() {
    let mut report = crate::demo::report(5.0);
    if let Some(scene) = &mut report.scene {
        scene.lines[0].points[7].z = f64::INFINITY;
    }
    let mut out = Vec::new();
    let error = write_html(&mut out, &report).unwrap_err();
    assert!(matches!(
        error,
        ReportError::Scene(SceneError::Point { index: 7, .. })
    ));
    assert!(out.is_empty());
}

#[test]
fn a_million_segments_make_a_small_page() {
    let report = crate::demo::report(0.00846);
    let segments = report.scene.as_ref().map_or(0, |s| s.lines[0].points.len());
    assert!(segments > 1_000_000);
    let size = page(&report).len();
    assert!(size < 2_000_000, "{size} bytes");
}
