//! What measured beads look like.

mod corner;

use meltpath_base::Provenance;
use meltpath_base::number::{significant, with_uncertainty};
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::Plot;
use meltpath_report::table::{Cell, Table};

use crate::measure::found::{Found, Measured};

/// Sections that are drawn.
const DRAWN: usize = 16;
/// Points of a section that are drawn.
const POINTS: usize = 600;

fn sizes(found: &Found) -> Table {
    Table::of(
        "Beads",
        found.beads.iter().enumerate().map(|(k, b)| {
            let kept = b.kept(0.0).map_or(f64::NAN, |kept| 100.0 * kept[0]);
            [
                ("bead", Cell::text(&format!("{}", k + 1))),
                ("length (mm)", Cell::Fixed(b.bead.length, 1)),
                ("sections", Cell::Number(b.bead.sections.len() as f64)),
                ("width (mm)", Cell::Fixed(b.width[0], 2)),
                ("± along it", Cell::Fixed(b.width[1], 2)),
                ("± of the mean", Cell::Fixed(b.width_sigma, 2)),
                ("height (mm)", Cell::Fixed(b.height[0], 2)),
                ("± along it", Cell::Fixed(b.height[1], 2)),
                ("area (mm²)", Cell::Fixed(b.area[0], 2)),
                ("± along it", Cell::Fixed(b.area[1], 2)),
                ("form (%)", Cell::Fixed(100.0 * b.form(), 1)),
                ("toe of the parabola (°)", Cell::Fixed(toe(b), 0)),
                ("contact angle at rest (°)", Cell::Fixed(contact(b), 0)),
                ("of the wire fed (%)", Cell::Fixed(kept, 1)),
                ("feed over travel", Cell::Fixed(ratio(b), 2)),
            ]
        }),
    )
    .noted("Over the middle 60 % of each bead: the width is told where its flanks meet the plate, the height on its top, the area under all points, whatever the form of its section; form is how far two thirds of width times height are from it. The contact angle at rest is that of still liquid of the bead's width and height: the bead's own where its points follow that form.")
}

/// Wire feed over travel speed, by the feed that was measured where one was.
fn ratio(bead: &Measured) -> f64 {
    bead.setting.map_or(f64::NAN, |s| s.feed() / s.travel_speed)
}

/// The angle at which the parabola meets the plate, degrees.
fn toe(bead: &Measured) -> f64 {
    (4.0 * bead.height[0] / bead.width[0]).atan().to_degrees()
}

/// The contact angle of liquid at rest, degrees.
fn contact(bead: &Measured) -> f64 {
    bead.at_rest
        .map_or(f64::NAN, |section| section.contact.to_degrees())
}

/// The section nearest the middle of a bead.
fn section(number: usize, bead: &Measured) -> Option<Plot> {
    let all = &bead.bead.sections;
    let section = all.get(all.len() / 2)?;
    let every = section.points.len().div_ceil(POINTS).max(1);
    let moved = |p: &DVec2| DVec2::new(p.x - section.centre, p.y);
    let points = section.points.iter().step_by(every).map(moved).collect();
    let parabola = |k: i32| {
        let share = f64::from(k) / 20.0;
        DVec2::new(
            0.5 * section.width * share,
            section.height * (1.0 - share * share),
        )
    };
    let plot = Plot::new(
        &format!("Bead {number}, {:.0} mm from its end", section.along),
        ["across", "mm"],
        ["height", "mm"],
    );
    let plot = plot.dots("scan", points);
    let plot = plot.line("parabola", (-20..=20).map(parabola).collect());
    let at_rest = bead.at_rest.map(|section| section.points(41));
    Some(match at_rest {
        Some(points) => plot.line(
            "liquid at rest",
            points.into_iter().map(DVec2::from_array).collect(),
        ),
        None => plot,
    })
}

fn plan(found: &Found) -> Plot {
    let mut plot = Plot::new(
        "Where they lie",
        ["x of the scan", "mm"],
        ["y of the scan", "mm"],
    )
    .caption("Bead 1 is the first across them from low x or y; beads in one line follow along it.");
    for (k, bead) in found.beads.iter().enumerate() {
        let line = bead.bead.ends.map(DVec3::truncate).to_vec();
        plot = plot.line(format!("bead {}", k + 1), line);
    }
    for (k, corner) in found.corners.iter().enumerate() {
        let [from, to] = corner.ends;
        let path = [from, corner.place, to].map(DVec3::truncate).to_vec();
        plot = plot.line(format!("corner {}", k + 1), path);
    }
    plot
}

/// The report.
pub fn report(file: &str, found: &Found, provenance: &Provenance) -> Report {
    let drawn = found.beads.iter().take(DRAWN).enumerate();
    let mut plots: Vec<Plot> = drawn.filter_map(|(k, b)| section(k + 1, b)).collect();
    plots.insert(0, plan(found));
    let left = found.beads.len().saturating_sub(DRAWN);
    let note = if left > 0 {
        format!(
            "Sections of the first {DRAWN} beads are drawn; those of the other {left} are in sections.csv."
        )
    } else {
        String::new()
    };
    let tables = if found.beads.is_empty() {
        Vec::new()
    } else {
        vec![sizes(found)]
    };
    let mut sections = vec![Section::new("Sizes", &note, plots, tables)];
    sections.extend(corner::section(found));
    Report {
        title: "Beads measured in a scan".to_owned(),
        subtitle: format!(
            "{file} · {} points · {} beads",
            found.points,
            found.beads.len() + found.corners.len()
        ),
        verdict: found.verdict.clone(),
        scene: None,
        sections,
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// What a terminal shows.
pub fn lines(found: &Found) -> Vec<String> {
    let beads = found.beads.iter().enumerate();
    let mut lines: Vec<String> = beads
        .map(|(k, b)| {
            let width = with_uncertainty(b.width[0], b.width_sigma);
            let [h, a] = [b.height, b.area].map(|[v, _]| significant(v, 4));
            let [dw, dh, da] = [b.width, b.height, b.area].map(|[_, s]| significant(s, 2));
            let kept = b.kept(0.0).map_or_else(String::new, |kept| {
                format!(", {:.0} % of the wire fed", 100.0 * kept[0])
            });
            format!(
                "bead {}: {width} mm wide, {h} mm high, {a} mm²{kept}; along it they scatter by {dw} mm, {dh} mm, {da} mm²",
                k + 1
            )
        })
        .collect();
    if found.map.is_some() {
        lines.push(
            "map.toml: a process map of these beads; name it in a job: [waam] map".to_owned(),
        );
    }
    lines.extend(corner::lines(found));
    lines
}

/// Writes sizes, sections and the map.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    folder.write("beads.csv", |w| {
        writeln!(
            w,
            "bead,x_mm,y_mm,z_mm,length_mm,sections,width_mm,width_scatter_mm,width_sigma_mm,height_mm,height_scatter_mm,area_mm2,area_scatter_mm2,toe_angle_deg,contact_angle_deg,wire_feed_mm_s,travel_speed_mm_s,feed_over_travel,fed_mm2"
        )?;
        for (k, b) in found.beads.iter().enumerate() {
            let m = b.bead.middle;
            let setting = b.setting.map_or([f64::NAN; 2], |s| [s.feed(), s.travel_speed]);
            writeln!(
                w,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                k + 1, m.x, m.y, m.z, b.bead.length, b.bead.sections.len(),
                b.width[0], b.width[1], b.width_sigma, b.height[0], b.height[1], b.area[0], b.area[1],
                toe(b), contact(b), setting[0], setting[1], ratio(b), b.fed.unwrap_or(f64::NAN)
            )?;
        }
        Ok(())
    })?;
    folder.write("sections.csv", |w| {
        writeln!(
            w,
            "bead,along_mm,across_mm,width_mm,height_mm,area_mm2,off_parabola_mm"
        )?;
        for (k, b) in found.beads.iter().enumerate() {
            for s in &b.bead.sections {
                writeln!(
                    w,
                    "{},{},{},{},{},{},{}",
                    k + 1,
                    s.along,
                    s.centre,
                    s.width,
                    s.height,
                    s.area,
                    s.off
                )?;
            }
        }
        Ok(())
    })?;
    corner::write_files(folder, found)?;
    match &found.map {
        Some(map) => folder.write("map.toml", |w| w.write_all(map.as_bytes())),
        None => Ok(()),
    }
}
