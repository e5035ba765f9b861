//! From results to what people look at: the 3D scene, plots, tables, series and field files.

pub(crate) mod cell;
pub mod sheet;
pub(crate) mod surface;

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::{Crop, HeightMap};
use meltpath_report::html::Section;
use meltpath_report::plot::{Aspect, Axis, Mark, Plot, histogram};
use meltpath_report::scene::{Grid, LineSet, Polyline, Scalar, Scene, Stroke, Surface, Visibility};
use meltpath_report::series::csv::CsvWriter;
use meltpath_report::series::{Column, Kind, SeriesError, Values};
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::{
    Field, Values as FieldValues, VtkError, write_height_image, write_lines,
};
use meltpath_toolpath::{Pass, Toolpath};

use crate::stages::part::Part;
use crate::waam::judge::{GrowthError, LayerOutcome, Limits};
use crate::waam::record::Sample;
use crate::waam::simulate::Simulation;

/// m/min per mm/s.
const PER_MINUTE: f64 = 0.06;
/// A part of more triangles is left out of the 3D view: the page would be slow.
const SHOWN_TRIANGLES: usize = 400_000;
/// The predicted surface lets the paths inside it show.
const SEEN_THROUGH: f64 = 0.6;
/// Less metal than this over the plate is not shown in the as-built mesh, mm.
const BUILT: f64 = 0.01;
/// The plate's thickness in the as-built mesh where the job says none, mm.
const FLOOR: f64 = 20.0;

/// The simulated motion, split where the arc changes: beads or travels.
fn lines(name: &str, simulation: &Simulation, layer_of_command: &[u32], beads: Beads) -> LineSet {
    let wanted = |s: &Sample| s.arc == (beads == Beads::Deposited);
    let layer = |s: &Sample| {
        layer_of_command
            .get(s.command as usize)
            .copied()
            .unwrap_or(0)
    };
    let mut set = LineSet {
        name: name.to_owned(),
        points: Vec::new(),
        polylines: Vec::new(),
        scalars: Vec::new(),
        stroke: Stroke::Hairline,
        visibility: Visibility::Hidden,
    };
    let mut kept: Vec<&Sample> = Vec::new();
    let mut before: Option<&Sample> = None;
    for s in &simulation.samples {
        let joins = before.is_some_and(|b| wanted(b) && layer(b) == layer(s));
        if wanted(s) {
            if !joins {
                set.polylines.push(Polyline {
                    first: kept.len(),
                    layer: layer(s),
                });
            }
            kept.push(s);
        }
        before = Some(s);
    }
    set.points = kept.iter().map(|s| s.position).collect();
    let scalar = |name: &str, unit: &str, f: &dyn Fn(&Sample) -> f64| {
        Scalar::new(name, unit, kept.iter().map(|s| f(s) as f32).collect())
    };
    set.scalars = vec![
        scalar("speed", "m/min", &|s| s.speed * PER_MINUTE),
        scalar("time", "min", &|s| s.time / 60.0),
        scalar("layer", "", &|s| f64::from(layer(s))),
    ];
    if beads == Beads::Deposited {
        let ctwd = |s: &Sample| {
            let after = simulation.ctwd.partition_point(|(t, _)| *t < s.time);
            simulation
                .ctwd
                .get(after)
                .or(simulation.ctwd.last())
                .map_or(f64::NAN, |(_, d)| *d)
        };
        set.scalars
            .push(scalar("contact tube distance", "mm", &ctwd));
    }
    set
}

/// Which part of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beads {
    Deposited,
    Travels,
}

/// The 3D scene: the metal layer by layer, the simulated path, travels, the finished part.
pub fn scene(
    simulation: &Simulation,
    layer_of_command: &[u32],
    bead_diameter: f64,
    part: Option<&Part>,
) -> Scene {
    let beads = LineSet {
        stroke: Stroke::Bead(bead_diameter),
        visibility: Visibility::Shown,
        ..lines(
            "simulated beads",
            simulation,
            layer_of_command,
            Beads::Deposited,
        )
    };
    let travels = lines("travels", simulation, layer_of_command, Beads::Travels);
    let surfaces = part
        .filter(|p| p.mesh.triangles.len() <= SHOWN_TRIANGLES)
        .map(|p| Surface {
            name: "finished part".to_owned(),
            mesh: p.mesh.clone(),
            scalars: Vec::new(),
            opacity: 0.5,
            visibility: Visibility::Hidden,
        })
        .into_iter()
        .collect();
    let mut heights = simulation.heights.clone();
    heights.opacity = SEEN_THROUGH;
    Scene {
        lines: vec![beads, travels],
        surfaces,
        heights: Some(heights),
        machine: None,
    }
}

fn by_layer(layers: &[LayerOutcome], f: impl Fn(&LayerOutcome) -> f64) -> Vec<DVec2> {
    layers
        .iter()
        .map(|l| DVec2::new(f64::from(l.layer), f(l)))
        .collect()
}

/// The chapters of plots and tables.
pub fn sections(simulation: &Simulation, growth: &GrowthError, limits: &Limits) -> Vec<Section> {
    vec![
        Section {
            title: "How the build grows".to_owned(),
            intro: "Heights are those of the bead crests over the plate, starts and ends left out. The band is one standard uncertainty.".to_owned(),
            plots: vec![height_plot(&simulation.layers, growth), ctwd_plot(&simulation.layers, limits), flatness_plot(&simulation.layers, limits), speed_plot(simulation)],
            tables: vec![layer_table(&simulation.layers)],
        },
        Section {
            title: "Sections through the metal".to_owned(),
            intro: "The predicted surface on lines through the middle of the build.".to_owned(),
            plots: section_plots(&simulation.deposit.map),
            tables: Vec::new(),
        },
    ]
}

fn height_plot(layers: &[LayerOutcome], growth: &GrowthError) -> Plot {
    let predicted = |l: &LayerOutcome| l.mean_top.unwrap_or(f64::NAN);
    Plot::new(
        "Height after each layer",
        Axis::new("layer", ""),
        Axis::new("height", "mm"),
    )
    .with(Mark::Band {
        name: "± 1 σ".to_owned(),
        lower: by_layer(layers, |l| growth.shifted(predicted(l), -1.0)),
        upper: by_layer(layers, |l| growth.shifted(predicted(l), 1.0)),
    })
    .with(Mark::Line {
        name: "predicted".to_owned(),
        points: by_layer(layers, predicted),
    })
    .with(Mark::Line {
        name: "planned".to_owned(),
        points: by_layer(layers, |l| l.planned_top),
    })
}

fn ctwd_plot(layers: &[LayerOutcome], limits: &Limits) -> Plot {
    Plot::new(
        "Contact tube to work distance",
        Axis::new("layer", ""),
        Axis::new("distance", "mm"),
    )
    .with(Mark::Band {
        name: "least to greatest".to_owned(),
        lower: by_layer(layers, |l| l.ctwd_range.0),
        upper: by_layer(layers, |l| l.ctwd_range.1),
    })
    .with(Mark::Line {
        name: "mean of the layer".to_owned(),
        points: by_layer(layers, |l| l.ctwd_mean),
    })
    .with(Mark::Limit {
        name: "nearest allowed".to_owned(),
        value: limits.ctwd_min,
    })
    .with(Mark::Limit {
        name: "farthest allowed".to_owned(),
        value: limits.ctwd_max,
    })
    .caption("Falls where the build grows faster than it was planned, rises where it grows slower.")
}

fn flatness_plot(layers: &[LayerOutcome], limits: &Limits) -> Plot {
    Plot::new(
        "Flatness of each layer",
        Axis::new("layer", ""),
        Axis::new("5-95 % of heights", "mm"),
    )
    .with(Mark::Line {
        name: "predicted".to_owned(),
        points: by_layer(layers, |l| l.flatness.unwrap_or(f64::NAN)),
    })
    .with(Mark::Limit {
        name: "limit".to_owned(),
        value: limits.flatness,
    })
}

fn speed_plot(simulation: &Simulation) -> Plot {
    let speeds: Vec<f64> = simulation
        .samples
        .iter()
        .filter(|s| s.arc)
        .map(|s| s.speed * PER_MINUTE)
        .collect();
    Plot::new("Travel speed with arc", Axis::new("speed", "m/min"), Axis::new("kept samples", ""))
        .with(Mark::Bars { name: "samples".to_owned(), bars: histogram(&speeds, 40) })
        .caption("Samples below the programmed speed are starts, stops and corners: the wire keeps coming, so metal accumulates there.")
}

/// Sections along x and along y through the middle of the metal.
fn section_plots(map: &HeightMap) -> Vec<Plot> {
    let mut lo = DVec2::splat(f64::INFINITY);
    let mut hi = DVec2::splat(f64::NEG_INFINITY);
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            if map.z[map.index(ix, iy)] > map.base + 0.05 {
                let c = map.centre(ix, iy);
                lo = lo.min(c);
                hi = hi.max(c);
            }
        }
    }
    if !lo.is_finite() {
        return Vec::new();
    }
    let middle = 0.5 * (lo + hi);
    let margin = 5.0;
    let line = |from: DVec2, to: DVec2, axis: &str, start: f64| {
        let profile = map
            .section(&[from, to], 0.5 * map.cell)
            .into_iter()
            .map(|p| DVec2::new(start + p.x, p.y))
            .collect::<Vec<_>>();
        Plot {
            aspect: Aspect::Equal,
            ..Plot::new(
                &format!("Along {axis}"),
                Axis::new(axis, "mm"),
                Axis::new("z", "mm"),
            )
        }
        .with(Mark::Line {
            name: "predicted surface".to_owned(),
            points: profile,
        })
    };
    vec![
        line(
            DVec2::new(lo.x - margin, middle.y),
            DVec2::new(hi.x + margin, middle.y),
            "x",
            lo.x - margin,
        ),
        line(
            DVec2::new(middle.x, lo.y - margin),
            DVec2::new(middle.x, hi.y + margin),
            "y",
            lo.y - margin,
        ),
    ]
}

fn layer_table(layers: &[LayerOutcome]) -> Table {
    let mut table = Table::new(
        "Layers",
        &[
            "layer",
            "beads",
            "length (mm)",
            "planned top (mm)",
            "predicted top (mm)",
            "flatness (mm)",
            "CTWD mean (mm)",
            "CTWD least (mm)",
            "wire (m)",
            "arc time",
        ],
    );
    let optional = |v: Option<f64>| v.map_or(Cell::Empty, |v| Cell::Fixed(v, 2));
    table.rows = layers
        .iter()
        .map(|l| {
            vec![
                Cell::Number(f64::from(l.layer)),
                Cell::Number(f64::from(l.beads)),
                Cell::Fixed(l.length, 0),
                optional(l.planned_top.is_finite().then_some(l.planned_top)),
                optional(l.mean_top),
                optional(l.flatness),
                Cell::Fixed(l.ctwd_mean, 2),
                Cell::Fixed(l.ctwd_range.0, 2),
                Cell::Fixed(l.wire / 1000.0, 2),
                Cell::Duration(l.arc_time),
            ]
        })
        .collect();
    table
}

/// An error of a series or a field writer as one of the output's file.
fn as_io(error: impl std::error::Error + Send + Sync + 'static) -> io::Error {
    io::Error::other(error)
}

pub(super) fn write_series(
    folder: &OutputFolder,
    name: &str,
    columns: Vec<Column>,
    values: &[Values<'_>],
) -> Result<(), OutputError> {
    folder.write(name, |out| {
        let write = || -> Result<(), SeriesError> {
            let mut csv = CsvWriter::new(out, columns)?;
            csv.block(values)?;
            csv.finish()
        };
        write().map_err(as_io)
    })
}

/// Writes the as-built mesh, the ParaView fields and the series.
///
/// # Errors
/// [`OutputError`], a full disk included.
pub fn write_files(
    folder: &OutputFolder,
    simulation: &Simulation,
    layer_of_command: &[u32],
    thickness: Option<f64>,
) -> Result<(), OutputError> {
    let map = &simulation.deposit.map;
    let mesh = map.to_mesh(Crop::Built { threshold: BUILT }, thickness.unwrap_or(FLOOR));
    folder.write("as-built.stl", |mut w| write_stl(&mesh, "as-built", &mut w))?;
    let path = lines("path", simulation, layer_of_command, Beads::Deposited);
    folder.write("fields/path.vtp", |w| write_lines(w, &path).map_err(vtk_io))?;
    let grid = Grid {
        origin: map.origin,
        cell: map.cell,
        nx: map.nx,
        ny: map.ny,
    };
    let height = Field {
        name: "height",
        unit: "mm",
        values: FieldValues::Float64(&map.z),
    };
    folder.write("fields/surface.vti", |w| {
        write_height_image(w, &grid, map.base, &[height]).map_err(vtk_io)
    })?;
    motion_series(folder, &simulation.samples, layer_of_command)?;
    layer_series(folder, &simulation.layers)
}

pub(super) fn vtk_io(error: VtkError) -> io::Error {
    as_io(error)
}

pub(super) fn motion_series(
    folder: &OutputFolder,
    samples: &[Sample],
    layer_of_command: &[u32],
) -> Result<(), OutputError> {
    let float = |name: &str, unit: &str| Column::new(name, unit, Kind::Float);
    let integer = |name: &str| Column::new(name, "", Kind::Integer);
    let columns = vec![
        float("time", "s"),
        float("x", "mm"),
        float("y", "mm"),
        float("z", "mm"),
        float("speed", "mm/s"),
        integer("arc"),
        integer("command"),
        integer("layer"),
    ];
    let pick = |f: &dyn Fn(&Sample) -> f64| samples.iter().map(f).collect::<Vec<f64>>();
    let count = |f: &dyn Fn(&Sample) -> i64| samples.iter().map(f).collect::<Vec<i64>>();
    let (t, v) = (pick(&|s| s.time), pick(&|s| s.speed));
    let (x, y, z) = (
        pick(&|s| s.position.x),
        pick(&|s| s.position.y),
        pick(&|s| s.position.z),
    );
    let (arc, command) = (
        count(&|s| i64::from(s.arc)),
        count(&|s| i64::from(s.command)),
    );
    let layer = count(&|s| {
        layer_of_command
            .get(s.command as usize)
            .map_or(0, |l| i64::from(*l))
    });
    let values = [
        Values::Float(&t),
        Values::Float(&x),
        Values::Float(&y),
        Values::Float(&z),
        Values::Float(&v),
        Values::Integer(&arc),
        Values::Integer(&command),
        Values::Integer(&layer),
    ];
    write_series(folder, "series/motion.csv", columns, &values)
}

fn layer_series(folder: &OutputFolder, layers: &[LayerOutcome]) -> Result<(), OutputError> {
    type Pick = fn(&LayerOutcome) -> f64;
    let floats: [(&str, &str, Pick); 9] = [
        ("planned_top", "mm", |l| l.planned_top),
        ("predicted_top", "mm", |l| l.mean_top.unwrap_or(f64::NAN)),
        ("flatness", "mm", |l| l.flatness.unwrap_or(f64::NAN)),
        ("ctwd_mean", "mm", |l| l.ctwd_mean),
        ("ctwd_least", "mm", |l| l.ctwd_range.0),
        ("ctwd_greatest", "mm", |l| l.ctwd_range.1),
        ("length", "mm", |l| l.length),
        ("wire", "mm", |l| l.wire),
        ("arc_time", "s", |l| l.arc_time),
    ];
    let mut columns = vec![
        Column::new("layer", "", Kind::Integer),
        Column::new("beads", "", Kind::Integer),
    ];
    columns.extend(
        floats
            .iter()
            .map(|(name, unit, _)| Column::new(name, unit, Kind::Float)),
    );
    let number: Vec<i64> = layers.iter().map(|l| i64::from(l.layer)).collect();
    let beads: Vec<i64> = layers.iter().map(|l| i64::from(l.beads)).collect();
    let picked: Vec<Vec<f64>> = floats
        .iter()
        .map(|(_, _, f)| layers.iter().map(f).collect())
        .collect();
    let mut values = vec![Values::Integer(&number), Values::Integer(&beads)];
    values.extend(picked.iter().map(|p| Values::Float(p)));
    write_series(folder, "series/layers.csv", columns, &values)
}

/// One line per bead of the plan.
///
/// # Errors
/// [`OutputError`].
pub fn write_passes(folder: &OutputFolder, toolpath: &Toolpath) -> Result<(), OutputError> {
    let float = |name: &str, unit: &str| Column::new(name, unit, Kind::Float);
    let integer = |name: &str| Column::new(name, "", Kind::Integer);
    let columns = vec![
        integer("pass"),
        integer("layer"),
        Column::new("role", "", Kind::Text),
        float("length", "mm"),
        integer("moves"),
        integer("neighbours"),
        float("start_x", "mm"),
        float("start_y", "mm"),
        float("start_z", "mm"),
    ];
    let passes: Vec<Pass<'_>> = toolpath.passes().collect();
    let count = |f: &dyn Fn(&Pass<'_>) -> i64| passes.iter().map(f).collect::<Vec<i64>>();
    let pick = |f: &dyn Fn(&Pass<'_>) -> f64| passes.iter().map(f).collect::<Vec<f64>>();
    let (id, layer) = (
        count(&|p| i64::from(p.head.id.0)),
        count(&|p| i64::from(p.layer)),
    );
    let (moves, neighbours) = (
        count(&|p| i64::try_from(p.move_count()).unwrap_or(i64::MAX)),
        count(&|p| i64::try_from(p.neighbours().len()).unwrap_or(i64::MAX)),
    );
    let role: Vec<String> = passes
        .iter()
        .map(|p| format!("{:?}", p.head.role).to_lowercase())
        .collect();
    let length = pick(&|p| p.length());
    let [x, y, z] = [0, 1, 2].map(|axis| pick(&|p| p.points[0][axis]));
    let values = [
        Values::Integer(&id),
        Values::Integer(&layer),
        Values::Text(&role),
        Values::Float(&length),
        Values::Integer(&moves),
        Values::Integer(&neighbours),
        Values::Float(&x),
        Values::Float(&y),
        Values::Float(&z),
    ];
    write_series(folder, "series/passes.csv", columns, &values)
}
