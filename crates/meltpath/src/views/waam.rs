//! From results to what people look at: the 3D scene, plots, tables, series and field files.

pub(crate) mod cell;
pub(crate) mod joints;
mod machine;
mod pictures;
pub mod sheet;
pub(crate) mod surface;
mod thinned;

use std::collections::BTreeMap;
use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::{Crop, HeightMap};
use meltpath_report::html::Section;
use meltpath_report::plot::{Aspect, Axis, Plot, histogram};
use meltpath_report::scene::{Grid, LineSet, Polyline, Scalar, Scene, Stroke, Surface, Visibility};
use meltpath_report::series::csv::CsvWriter;
use meltpath_report::series::{Column, Kind, SeriesError, Values};
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::{Field, Values as FieldValues, write_height_image, write_lines};
use meltpath_toolpath::Toolpath;

use crate::stages::part::Part;
use crate::views::write_csv;
use crate::waam::deposit::simulate::Simulation;
use crate::waam::drive::record::Sample;
use crate::waam::judge::{GrowthError, LayerOutcome, Limits};

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
            let after = simulation.ctwd.partition_point(|p| p.at.time < s.time);
            simulation
                .ctwd
                .get(after)
                .or(simulation.ctwd.last())
                .map_or(f64::NAN, |p| p.at.distance)
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
        Section::new(
            "How the build grows",
            "Heights are those of the bead crests over the plate, starts and ends left out. The band is one standard uncertainty.",
            vec![
                height_plot(&simulation.layers, growth),
                ctwd_plot(&simulation.layers, limits),
                flatness_plot(&simulation.layers, limits),
                speed_plot(&simulation.samples),
            ],
            vec![layer_table(&simulation.layers)],
        ),
        Section::new(
            "Sections through the metal",
            "The predicted surface on lines through the middle of the build.",
            section_plots(&simulation.deposit.map),
            vec![],
        ),
    ]
}

fn height_plot(layers: &[LayerOutcome], growth: &GrowthError) -> Plot {
    let predicted = |l: &LayerOutcome| l.mean_top.unwrap_or(f64::NAN);
    Plot::new("Height after each layer", ["layer", ""], ["height", "mm"])
        .band(
            "± 1 σ",
            by_layer(layers, |l| growth.shifted(predicted(l), -1.0)),
            by_layer(layers, |l| growth.shifted(predicted(l), 1.0)),
        )
        .line("predicted", by_layer(layers, predicted))
        .line("planned", by_layer(layers, |l| l.planned_top))
}

fn ctwd_plot(layers: &[LayerOutcome], limits: &Limits) -> Plot {
    Plot::new(
        "Contact tube to work distance",
        ["layer", ""],
        ["distance", "mm"],
    )
    .band(
        "least to greatest",
        by_layer(layers, |l| l.ctwd_range.0),
        by_layer(layers, |l| l.ctwd_range.1),
    )
    .line("mean of the layer", by_layer(layers, |l| l.ctwd_mean))
    .limit("nearest allowed", limits.ctwd_min)
    .limit("farthest allowed", limits.ctwd_max)
    .caption("Falls where the build grows faster than it was planned, rises where it grows slower.")
}

fn flatness_plot(layers: &[LayerOutcome], limits: &Limits) -> Plot {
    Plot::new(
        "Flatness of each layer",
        ["layer", ""],
        ["5-95 % of heights", "mm"],
    )
    .line(
        "predicted",
        by_layer(layers, |l| l.flatness.unwrap_or(f64::NAN)),
    )
    .limit("limit", limits.flatness)
}

/// How fast beads are drawn.
fn speed_plot(samples: &[Sample]) -> Plot {
    let speeds: Vec<f64> = samples
        .iter()
        .filter(|s| s.arc)
        .map(|s| s.speed * PER_MINUTE)
        .collect();
    Plot::new("Travel speed with arc", ["speed", "m/min"], ["kept samples", ""])
        .bars("samples", histogram(&speeds, 40))
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
            ..Plot::new(&format!("Along {axis}"), Axis::new(axis, "mm"), ["z", "mm"])
        }
        .line("predicted surface", profile)
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
    let optional = |v: Option<f64>| v.map_or(Cell::Empty, |v| Cell::Fixed(v, 2));
    Table::of(
        "Layers",
        layers.iter().map(|l| {
            [
                ("layer", Cell::Number(f64::from(l.layer))),
                ("beads", Cell::Number(f64::from(l.beads))),
                ("length (mm)", Cell::Fixed(l.length, 0)),
                (
                    "planned top (mm)",
                    optional(l.planned_top.is_finite().then_some(l.planned_top)),
                ),
                ("predicted top (mm)", optional(l.mean_top)),
                ("flatness (mm)", optional(l.flatness)),
                ("CTWD mean (mm)", Cell::Fixed(l.ctwd_mean, 2)),
                ("CTWD least (mm)", Cell::Fixed(l.ctwd_range.0, 2)),
                ("wire (m)", Cell::Fixed(l.wire / 1000.0, 2)),
                ("arc time", Cell::Duration(l.arc_time)),
            ]
        }),
    )
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
    folder.write("fields/path.vtp", |w| {
        write_lines(w, &path).map_err(io::Error::other)
    })?;
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
        write_height_image(w, &grid, map.base, &[height]).map_err(io::Error::other)
    })?;
    motion_series(folder, &simulation.samples, layer_of_command)?;
    layer_series(folder, &simulation.layers)
}

pub(super) fn motion_series(
    folder: &OutputFolder,
    samples: &[Sample],
    layer_of_command: &[u32],
) -> Result<(), OutputError> {
    let layer = |s: &Sample| layer_of_command.get(s.command as usize).copied();
    let all = |f: &dyn Fn(&Sample) -> f64| samples.iter().map(f).collect::<Vec<f64>>();
    let columns = [
        ("time", "s", all(&|s| s.time)),
        ("x", "mm", all(&|s| s.position.x)),
        ("y", "mm", all(&|s| s.position.y)),
        ("z", "mm", all(&|s| s.position.z)),
        ("speed", "mm/s", all(&|s| s.speed)),
        ("arc", "", all(&|s| f64::from(u8::from(s.arc)))),
        ("command", "", all(&|s| f64::from(s.command))),
        ("layer", "", all(&|s| f64::from(layer(s).unwrap_or(0)))),
    ];
    write_csv(folder, "series/motion.csv", &columns)
}

fn layer_series(folder: &OutputFolder, layers: &[LayerOutcome]) -> Result<(), OutputError> {
    let all = |f: fn(&LayerOutcome) -> f64| layers.iter().map(f).collect::<Vec<f64>>();
    let columns = [
        ("layer", "", all(|l| f64::from(l.layer))),
        ("beads", "", all(|l| f64::from(l.beads))),
        ("planned_top", "mm", all(|l| l.planned_top)),
        (
            "predicted_top",
            "mm",
            all(|l| l.mean_top.unwrap_or(f64::NAN)),
        ),
        ("flatness", "mm", all(|l| l.flatness.unwrap_or(f64::NAN))),
        ("ctwd_mean", "mm", all(|l| l.ctwd_mean)),
        ("ctwd_least", "mm", all(|l| l.ctwd_range.0)),
        ("ctwd_greatest", "mm", all(|l| l.ctwd_range.1)),
        ("length", "mm", all(|l| l.length)),
        ("wire", "mm", all(|l| l.wire)),
        ("arc_time", "s", all(|l| l.arc_time)),
    ];
    write_csv(folder, "series/layers.csv", &columns)
}

/// One line per bead of the plan, numbered in the order in which they are laid, and within its layer as the verdict counts.
///
/// # Errors
/// [`OutputError`].
pub fn write_passes(folder: &OutputFolder, toolpath: &Toolpath) -> Result<(), OutputError> {
    let columns = [
        ("pass", "", Kind::Integer),
        ("layer", "", Kind::Integer),
        ("bead", "", Kind::Integer),
        ("role", "", Kind::Text),
        ("length", "mm", Kind::Float),
        ("moves", "", Kind::Integer),
        ("neighbours", "", Kind::Integer),
        ("start_x", "mm", Kind::Float),
        ("start_y", "mm", Kind::Float),
        ("start_z", "mm", Kind::Float),
    ]
    .map(|(name, unit, kind)| Column::new(name, unit, kind));
    let count = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
    folder.write("series/passes.csv", |out| {
        let mut write = || -> Result<(), SeriesError> {
            let mut csv = CsvWriter::new(out, columns.to_vec())?;
            let mut of_layer = BTreeMap::<u32, i64>::new();
            for (p, number) in toolpath.passes().zip(1..) {
                let start = p.points[0];
                let bead = of_layer.entry(p.layer).or_default();
                *bead += i64::from(p.head.role.deposits());
                csv.block(&[
                    Values::Integer(&[number]),
                    Values::Integer(&[i64::from(p.layer)]),
                    Values::Integer(&[*bead]),
                    Values::Text(&[format!("{:?}", p.head.role).to_lowercase()]),
                    Values::Float(&[p.length()]),
                    Values::Integer(&[count(p.move_count())]),
                    Values::Integer(&[count(p.neighbours().len())]),
                    Values::Float(&[start.x]),
                    Values::Float(&[start.y]),
                    Values::Float(&[start.z]),
                ])?;
            }
            csv.finish()
        };
        write().map_err(io::Error::other)
    })
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::{Layer, PassHead, PassId};

    use super::*;

    /// Whatever a plan calls its passes by, people count them from one.
    #[test]
    fn passes_and_beads_are_counted_from_one() {
        let layer = |number: u32, beads: u32| {
            let mut layer = Layer::new(number, 0.0);
            for i in 0..beads {
                let head = PassHead {
                    id: PassId(number << 14 | i),
                    ..PassHead::default()
                };
                layer.polyline(head, [DVec3::ZERO, DVec3::X]);
            }
            layer
        };
        let toolpath = Toolpath {
            layers: vec![layer(1, 2), layer(2, 2)],
            ..Toolpath::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let out = OutputFolder::create(&folder.path().join("run")).unwrap();
        write_passes(&out, &toolpath).unwrap();
        let out = out.commit().unwrap();
        let text = std::fs::read_to_string(out.join("series/passes.csv")).unwrap();
        let rows: Vec<String> = text
            .lines()
            .map(|row| row.split(',').take(3).collect::<Vec<_>>().join(","))
            .collect();
        assert_eq!(
            rows,
            ["pass,layer,bead", "1,1,1", "2,1,2", "3,2,1", "4,2,2"]
        );
    }
}
