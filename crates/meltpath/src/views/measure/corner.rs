//! What measured corners look like.

use meltpath_base::number::with_uncertainty;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::colour::ColourMap;
use meltpath_report::html::Section;
use meltpath_report::plot::{Aspect, Map, Mark, Plot};
use meltpath_report::table::{Cell, Table};

use crate::measure::found::{Found, MeasuredCorner};
use crate::measure::relief::Relief;

/// Corners that are drawn.
const DRAWN: usize = 8;
/// How far about a corner is drawn, mm.
const AROUND: f64 = 30.0;
/// Cells of a drawn map along its side.
const CELLS: usize = 150;
/// Distances beyond this take the end colours, of the bead's height.
const SHOWN: f64 = 0.4;

fn degrees(c: &MeasuredCorner) -> f64 {
    c.told.turn.to_degrees()
}

fn lengths(corners: &[MeasuredCorner]) -> Table {
    Table::of(
        "Pursuit lengths",
        corners.iter().enumerate().map(|(k, c)| {
            let of = |f: fn(&meltpath_deposition::pursuit::identify::Identified) -> f64| {
                c.pursuit.as_ref().map_or(f64::NAN, f)
            };
            [
                ("corner", Cell::text(&format!("{}", k + 1))),
                ("turn told (°)", Cell::Fixed(degrees(c), 1)),
                ("legs turn (°)", Cell::Fixed(c.seen.to_degrees(), 1)),
                ("pursuit length (mm)", Cell::Fixed(of(|p| p.length), 2)),
                ("± (mm)", Cell::Fixed(of(|p| p.sigma), 2)),
                ("crest off it, rms (mm)", Cell::Fixed(of(|p| p.off), 3)),
                ("off that of the other way (mm)", Cell::Fixed(c.other_way.unwrap_or(f64::NAN), 3)),
                ("at constant distance (mm)", Cell::Fixed(c.rigid.unwrap_or(f64::NAN), 2)),
                ("shown by the model's crest (mm)", Cell::Fixed(c.shown_by_model.unwrap_or(f64::NAN), 2)),
                ("width (mm)", Cell::Fixed(c.mean[0], 2)),
                ("height (mm)", Cell::Fixed(c.mean[1], 2)),
                ("area (mm²)", Cell::Fixed(c.mean[2], 2)),
            ]
        }),
    )
    .noted("The length whose pursuit curve lies nearest to the crest: of a follower that is never pushed back, as jobs follow it, and of one at a constant distance; up to 90° they are one. The deposit's model, laid with the length, shows another by its own crest: how far a job's bead will cut the corner. The uncertainty is that of the crest's scatter: place and direction of the path are found along with the length.")
}

fn volumes(corners: &[MeasuredCorner]) -> Table {
    Table::of(
        "Volumes within 20 mm of the corner (mm³)",
        corners.iter().enumerate().map(|(k, c)| {
            let b = &c.balance;
            let known = |v: Option<f64>| Cell::Fixed(v.unwrap_or(f64::NAN), 1);
            [
                ("corner", Cell::text(&format!("{}", k + 1))),
                ("measured", Cell::Fixed(b.measured, 1)),
                ("wire", known(b.wire)),
                ("section along the path", Cell::Fixed(b.nominal, 1)),
                ("along the torch's way", Cell::Fixed(b.path, 1)),
                ("laid twice", Cell::Fixed(b.fold.redundant, 2)),
                ("missing outside", Cell::Fixed(b.fold.lacunar, 2)),
                ("target", Cell::Fixed(b.target(), 1)),
                ("accumulation", Cell::Fixed(b.accumulation(), 1)),
                ("of it kinematic", Cell::Fixed(b.kinematic(), 1)),
                ("chord", Cell::Fixed(-b.chord(), 2)),
                ("geometric", Cell::Fixed(b.geometric(), 2)),
                ("slowing by the record", known(c.slowing)),
                ("losses", known(b.losses())),
            ]
        }),
    )
    .noted("As the source defines them: accumulation is what is measured beyond the target, and is kinematic, chord and geometric part together. Errors of scan and mean section end in the kinematic part. Without a record of the torch its way is the path, its speed steady, and the chord part 0.")
}

fn deviations(corners: &[MeasuredCorner]) -> Option<Table> {
    let rows = corners.iter().enumerate().filter_map(|(k, c)| {
        let d = c.deviation.as_ref()?;
        let [tops, model] = d.tops;
        Some(d.zones.iter().map(move |z| {
            [
                ("corner", Cell::text(&format!("{}", k + 1))),
                ("part", Cell::text(z.name)),
                ("mean (mm)", Cell::Fixed(z.mean, 3)),
                ("rms (mm)", Cell::Fixed(z.rms, 3)),
                ("cells", Cell::Number(z.cells as f64)),
                ("top over straight height, scan", Cell::Fixed(tops, 2)),
                ("and of the model", Cell::Fixed(model, 2)),
                (
                    "metal of the model beside the scan's (mm³)",
                    Cell::Fixed(d.stray, 2),
                ),
            ]
        }))
    });
    let rows: Vec<_> = rows.flatten().collect();
    (!rows.is_empty()).then(|| {
        Table::of("Scan less the deposit's model", rows).noted("Distance of each measured cell from the nearest place of the model's surface, positive where the scan is higher. The model is that of jobs, with the section of the straight parts, the pursuit length that was found, and the torch's record or its travel speed.")
    })
}

/// Values over a square about the corner, as a map.
fn map(name: &str, range: Option<[f64; 2]>, colours: ColourMap, of: impl Fn(DVec2) -> f64) -> Mark {
    let side = 2.0 * AROUND / CELLS as f64;
    let values = (0..CELLS * CELLS).map(|k| {
        let place = DVec2::new((k % CELLS) as f64 + 0.5, (k / CELLS) as f64 + 0.5);
        of(side * place - DVec2::splat(AROUND))
    });
    Mark::Map(Map {
        name: name.to_owned(),
        unit: "mm".to_owned(),
        corners: [DVec2::splat(-AROUND), DVec2::splat(AROUND)],
        columns: CELLS,
        values: values.collect(),
        range,
        colours,
    })
}

fn near(points: &[DVec2]) -> Vec<DVec2> {
    let inside = |p: &&DVec2| p.abs().max_element() <= AROUND;
    points.iter().filter(inside).copied().collect()
}

fn crest(number: usize, c: &MeasuredCorner) -> Plot {
    let along = |name: &str| meltpath_report::plot::Axis::new(name, "mm").between(-AROUND, AROUND);
    let mut plot = Plot::new(
        &format!("Corner {number}, {:.0}°: crest and pursuit curve", degrees(c)),
        along("along the first leg"),
        along("to its left"),
    )
    .caption("Heights of the scan. The torch comes from the left along the path; the bead's crest cuts the corner.")
    .with(map("height", None, ColourMap::Sequential, |p| c.relief.height(p)));
    plot.aspect = Aspect::Equal;
    let second = DVec2::from_angle(c.told.turn) * AROUND;
    plot = plot.line(
        "path of the torch",
        vec![
            DVec2::X * -AROUND,
            DVec2::ZERO,
            near(&[second]).first().copied().unwrap_or(0.99 * second),
        ],
    );
    plot = plot.dots("crest", near(&c.crest));
    match &c.pursuit {
        Ok(p) => plot.line(format!("pursuit curve, {:.2} mm", p.length), near(&p.curve)),
        Err(_) => plot,
    }
}

/// Places along a line with the way to each from the place nearest to the corner, mm.
fn ways(line: &[DVec2]) -> Vec<(f64, DVec2)> {
    let mut way = 0.0;
    let mut all = Vec::with_capacity(line.len());
    for (k, p) in line.iter().enumerate() {
        way += if k == 0 {
            0.0
        } else {
            line[k - 1].distance(*p)
        };
        all.push((way, *p));
    }
    let middle = all
        .iter()
        .min_by(|a, b| a.1.length().total_cmp(&b.1.length()));
    let middle = middle.map_or(0.0, |m| m.0);
    all.iter().map(|(s, p)| (s - middle, *p)).collect()
}

/// Points every half millimetre of a line.
fn evenly(line: &[DVec2]) -> Vec<DVec2> {
    let mut points = Vec::new();
    for w in line.windows(2) {
        let parts = (w[0].distance(w[1]) / 0.5).ceil().max(1.0);
        points.extend((0..parts as u32).map(|k| w[0].lerp(w[1], f64::from(k) / parts)));
    }
    points
}

fn heights(number: usize, c: &MeasuredCorner) -> Option<Plot> {
    let curve = evenly(&c.pursuit.as_ref().ok()?.curve);
    let line: Vec<DVec2> = ways(&curve)
        .into_iter()
        .filter(|(s, _)| s.abs() <= AROUND)
        .map(|(s, p)| DVec2::new(s, c.relief.height(p)))
        .collect();
    let plot = Plot::new(
        &format!("Corner {number}: height along the pursuit curve"),
        ["way from the corner", "mm"],
        ["height", "mm"],
    )
    .caption("A rise at the turn, and a fall of the height behind it (striction), are what the source sees at sharp corners.")
    .line("scan", line)
    .limit("mean of the straight parts", c.mean[1]);
    Some(plot)
}

/// Heights across the path at some ways from the corner.
fn across(number: usize, c: &MeasuredCorner) -> Option<Plot> {
    let curve = ways(&evenly(&c.pursuit.as_ref().ok()?.curve));
    let mut plot = Plot::new(
        &format!("Corner {number}: sections across the pursuit curve"),
        ["to the left of the curve", "mm"],
        ["height", "mm"],
    );
    for way in [-15.0, 0.0, 6.0, 15.0] {
        let at = curve.windows(2).find(|w| w[1].0 >= way)?;
        let left = (at[1].1 - at[0].1).try_normalize()?.perp();
        let reach = (c.mean[0] / 0.25).ceil() as i32;
        let points = (-reach..=reach).map(|k| {
            let v = 0.25 * f64::from(k);
            DVec2::new(v, c.relief.height(at[1].1 + v * left))
        });
        plot = plot.line(format!("{way:+.0} mm"), points.collect());
    }
    Some(plot)
}

fn deviation(number: usize, c: &MeasuredCorner) -> Option<Plot> {
    let d = c.deviation.as_ref()?;
    let Relief {
        origin,
        cell,
        columns,
        ..
    } = &c.relief;
    let mut by_cell = vec![f64::NAN; c.relief.z.len()];
    for one in &d.cells {
        let at = ((one.at - *origin) / *cell).round();
        by_cell[at.y as usize * columns + at.x as usize] = one.distance;
    }
    let end = SHOWN * c.mean[1];
    let of = |p: DVec2| {
        let at = ((p - *origin) / *cell).round();
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < *columns as f64;
        let value = inside.then(|| by_cell.get(at.y as usize * columns + at.x as usize));
        value.flatten().copied().unwrap_or(f64::NAN)
    };
    let along = |name: &str| meltpath_report::plot::Axis::new(name, "mm").between(-AROUND, AROUND);
    let mut plot = Plot::new(
        &format!("Corner {number}: scan less the deposit's model"),
        along("along the first leg"),
        along("to its left"),
    )
    .caption(
        "Positive: the scan is higher. Distances from the nearest place of the model's surface.",
    )
    .with(map("distance", Some([-end, end]), ColourMap::Diverging, of));
    plot.aspect = Aspect::Equal;
    Some(plot)
}

/// The chapter of corners; none without any.
pub(super) fn section(found: &Found) -> Option<Section> {
    if found.corners.is_empty() {
        return None;
    }
    let mut plots = Vec::new();
    for (k, c) in found.corners.iter().take(DRAWN).enumerate() {
        plots.push(crest(k + 1, c));
        plots.extend(deviation(k + 1, c));
        plots.extend(heights(k + 1, c));
        plots.extend(across(k + 1, c));
    }
    let mut tables = vec![lengths(&found.corners), volumes(&found.corners)];
    tables.extend(deviations(&found.corners));
    let left = found.corners.len().saturating_sub(DRAWN);
    let note = if left > 0 {
        format!("The first {DRAWN} corners are drawn; the other {left} are in the files.")
    } else {
        String::new()
    };
    Some(Section::new("Corners", &note, plots, tables))
}

/// What a terminal shows.
pub(super) fn lines(found: &Found) -> Vec<String> {
    let corners = found.corners.iter().enumerate();
    let mut lines: Vec<String> = corners
        .map(|(k, c)| {
            let length = match &c.pursuit {
                Ok(p) => format!(
                    "pursuit length {} mm, crest {:.2} mm off its curve",
                    with_uncertainty(p.length, p.sigma),
                    p.off
                ),
                Err(why) => why.to_string(),
            };
            let more = c.balance.accumulation();
            format!(
                "corner {}, {:.0}°: {length}; {:.0} mm³ within 20 mm, {:.1} mm³ {} than the target",
                k + 1,
                degrees(c),
                c.balance.measured,
                more.abs(),
                if more < 0.0 { "less" } else { "more" },
            )
        })
        .collect();
    if found.pursuit.is_some() {
        lines.push(
            "pursuit.toml: the pursuit lengths of these corners; name it in a job: [waam] pursuit"
                .to_owned(),
        );
    }
    lines
}

/// Writes lengths, volumes, crests, maps, and the file of pursuit lengths.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write_files(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    if found.corners.is_empty() {
        return Ok(());
    }
    folder.write("corners.csv", |w| {
        writeln!(
            w,
            "corner,x_mm,y_mm,z_mm,turn_deg,legs_turn_deg,pursuit_mm,pursuit_sigma_mm,crest_off_mm,pursuit_constant_distance_mm,pursuit_shown_by_model_mm,width_mm,height_mm,area_mm2,measured_mm3,wire_mm3,nominal_mm3,path_mm3,redundant_mm3,lacunar_mm3,redundant_parabola_mm3,lacunar_parabola_mm3,target_mm3,accumulation_mm3,kinematic_mm3,chord_mm3,geometric_mm3,slowing_mm3,losses_mm3,shown"
        )?;
        for (k, c) in found.corners.iter().enumerate() {
            let [length, sigma, off] = c
                .pursuit
                .as_ref()
                .map_or([f64::NAN; 3], |p| [p.length, p.sigma, p.off]);
            let b = &c.balance;
            let values = [
                c.place.x, c.place.y, c.place.z, degrees(c), c.seen.to_degrees(), length, sigma, off,
                c.rigid.unwrap_or(f64::NAN), c.shown_by_model.unwrap_or(f64::NAN), c.mean[0], c.mean[1], c.mean[2], b.measured,
                b.wire.unwrap_or(f64::NAN), b.nominal, b.path, b.fold.redundant, b.fold.lacunar,
                c.parabola.redundant, c.parabola.lacunar, b.target(), b.accumulation(), b.kinematic(),
                b.chord(), b.geometric(), c.slowing.unwrap_or(f64::NAN),
                b.losses().unwrap_or(f64::NAN), c.shown,
            ];
            let values: Vec<String> = values.iter().map(f64::to_string).collect();
            writeln!(w, "{},{}", k + 1, values.join(","))?;
        }
        Ok(())
    })?;
    folder.write("corner-crests.csv", |w| {
        writeln!(w, "corner,x_mm,y_mm,height_mm")?;
        for (k, c) in found.corners.iter().enumerate() {
            for p in &c.crest {
                writeln!(w, "{},{},{},{}", k + 1, p.x, p.y, c.relief.height(*p))?;
            }
        }
        Ok(())
    })?;
    folder.write("corner-deviations.csv", |w| {
        writeln!(
            w,
            "corner,x_mm,y_mm,measured_mm,simulated_mm,difference_mm,distance_mm"
        )?;
        for (k, c) in found.corners.iter().enumerate() {
            for one in c.deviation.iter().flat_map(|d| &d.cells) {
                writeln!(
                    w,
                    "{},{:.3},{:.3},{:.4},{:.4},{:.4},{:.4}",
                    k + 1,
                    one.at.x,
                    one.at.y,
                    one.measured,
                    one.simulated,
                    one.measured - one.simulated,
                    one.distance
                )?;
            }
        }
        Ok(())
    })?;
    match &found.pursuit {
        Some(law) => folder.write("pursuit.toml", |w| w.write_all(law.as_bytes())),
        None => Ok(()),
    }
}
