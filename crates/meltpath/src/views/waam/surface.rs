//! What people look at of a wall on a surface: passes, torch and metal in space, how evenly they lie, how the torch leans.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_deposition::workpiece::{Laid, Support};
use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_planning::surface::{SurfacePass, SurfacePoint, axes_along, distribution, torch_axes};
use meltpath_report::html::Section;
use meltpath_report::plot::Plot;
use meltpath_report::scene::{LineSet, Polyline, Scalar, Scene, Stroke, Surface, Visibility};
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::write_lines;

use super::{
    SHOWN_TRIANGLES, ctwd_plot, flatness_plot, height_plot, motion_series, speed_plot, write_passes,
};
use crate::views::write_csv;
use crate::waam::drive::lean;
use crate::waam::settings::Settings;
use crate::waam::surface::Asked;
use crate::waam::surface::ground::shown;
use crate::waam::surface::grow::outcomes;
use crate::waam::surface::wall::Wall;

/// Length of a torch's axis in the 3D view, mm.
const AXIS: f64 = 12.0;
/// Distance between the torch's axes that are shown along a pass, mm.
const BETWEEN: f64 = 4.0;

/// The passes, coloured by what they tell.
fn passes(wall: &Wall, stroke: Stroke) -> LineSet {
    let plan = &wall.plan;
    let mut set = LineSet {
        name: "passes".to_owned(),
        points: Vec::new(),
        polylines: Vec::new(),
        scalars: Vec::new(),
        stroke,
        visibility: Visibility::Shown,
    };
    let (mut spacing, mut tilt, mut layer) = (Vec::new(), Vec::new(), Vec::new());
    for pass in &plan.passes {
        set.polylines.push(Polyline {
            first: set.points.len(),
            layer: pass.number,
        });
        for (p, axis) in pass.points.iter().zip(torch_axes(pass, &plan.torch)) {
            set.points.push(p.position);
            spacing.push(p.spacing().unwrap_or(f64::NAN) as f32);
            tilt.push(axis.angle_between(plan.torch.up).to_degrees() as f32);
            layer.push(pass.number as f32);
        }
    }
    set.scalars = vec![
        Scalar::new("torch against up", "deg", tilt),
        Scalar::new("distance to the pass before", "mm", spacing),
        Scalar::new("layer", "", layer),
    ];
    set
}

/// The torch's axis at places along the passes.
fn axes(wall: &Wall) -> LineSet {
    let mut set = LineSet {
        name: "torch".to_owned(),
        points: Vec::new(),
        polylines: Vec::new(),
        scalars: Vec::new(),
        stroke: Stroke::Hairline,
        visibility: Visibility::Shown,
    };
    for pass in &wall.plan.passes {
        let mut last: Option<DVec3> = None;
        for (p, axis) in pass.points.iter().zip(torch_axes(pass, &wall.plan.torch)) {
            if last.is_some_and(|l| l.distance(p.position) < BETWEEN) {
                continue;
            }
            last = Some(p.position);
            set.polylines.push(Polyline {
                first: set.points.len(),
                layer: pass.number,
            });
            set.points.extend([p.position, p.position + AXIS * axis]);
        }
    }
    set
}

/// The way of the wire's tip without arc.
fn travels(wall: &Wall) -> LineSet {
    let layer_of = |command: u32| {
        let layers = &wall.commands.layer_of_command;
        layers.get(command as usize).copied().unwrap_or(0)
    };
    let mut set = LineSet {
        name: "travels".to_owned(),
        points: Vec::new(),
        polylines: Vec::new(),
        scalars: Vec::new(),
        stroke: Stroke::Hairline,
        visibility: Visibility::Hidden,
    };
    for run in wall.samples.chunk_by(|a, b| a.arc == b.arc) {
        if run[0].arc {
            continue;
        }
        set.polylines.push(Polyline {
            first: set.points.len(),
            layer: layer_of(run[0].command),
        });
        set.points.extend(run.iter().map(|s| s.position));
    }
    set
}

/// The beads as they lie: the surface that each left on its axis.
fn beads(laid: &Laid, layer_of_command: &[u32]) -> LineSet {
    let layer = |command: u32| {
        let found = layer_of_command.get(command as usize);
        found.copied().unwrap_or(0)
    };
    let mut set = LineSet {
        name: "beads".to_owned(),
        points: laid.path.iter().map(|p| p.crest).collect(),
        polylines: Vec::new(),
        scalars: Vec::new(),
        stroke: Stroke::Hairline,
        visibility: Visibility::Hidden,
    };
    let mut first = 0;
    for bead in laid.path.chunk_by(|a, b| a.bead == b.bead) {
        set.polylines.push(Polyline {
            first,
            layer: layer(bead[0].command),
        });
        first += bead.len();
    }
    let support = |s: Support| match s {
        Support::Metal => 0.0,
        Support::Partial => 1.0,
        Support::None => 2.0,
    };
    let path = &laid.path;
    set.scalars = vec![
        Scalar::new(
            "contact tube distance",
            "mm",
            path.iter().map(|p| p.ctwd as f32).collect(),
        ),
        Scalar::new(
            "thickness",
            "mm",
            path.iter().map(|p| p.thickness as f32).collect(),
        ),
        Scalar::new(
            "hangs (1 over its edge, 2 free)",
            "",
            path.iter().map(|p| support(p.support)).collect(),
        ),
    ];
    set
}

/// The metal as a mesh, in voxels that a page can show; none where there is none.
fn metal(wall: &Wall) -> Option<Surface> {
    let grown = wall.grown.as_ref().ok()?;
    let shown = |m: &Mesh| m.triangles.len() <= SHOWN_TRIANGLES;
    let mesh = Some(grown.fine.laid.voxels.to_mesh()).filter(shown);
    let mesh = mesh.or_else(|| Some(grown.coarse.laid.voxels.to_mesh()).filter(shown));
    Some(Surface {
        name: "predicted metal".to_owned(),
        mesh: mesh?,
        scalars: Vec::new(),
        opacity: 0.6,
        visibility: Visibility::Finished,
    })
}

/// The 3D scene: metal, surface, passes, torch, travels.
pub(crate) fn scene(wall: &Wall, settings: &Settings) -> Scene {
    let mesh = &wall.mesh;
    let part = (mesh.triangles.len() <= SHOWN_TRIANGLES).then(|| Surface {
        name: "surface".to_owned(),
        mesh: mesh.clone(),
        scalars: Vec::new(),
        opacity: 0.4,
        visibility: Visibility::Hidden,
    });
    // while a film shows a moment before the end there is no metal but the beads
    let body = shown(&wall.plan, &wall.standing.holders).map(|mesh| Surface {
        name: "what it stands on".to_owned(),
        mesh,
        scalars: Vec::new(),
        opacity: 0.6,
        visibility: Visibility::Shown,
    });
    let body = body.filter(|b| b.mesh.triangles.len() <= SHOWN_TRIANGLES);
    let bead = Stroke::Bead(0.7 * settings.bead.height.value);
    let mut lines = vec![passes(wall, bead), axes(wall), travels(wall)];
    if let Ok(grown) = &wall.grown {
        lines.push(beads(&grown.fine.laid, &wall.commands.layer_of_command));
    }
    Scene {
        lines,
        surfaces: metal(wall).into_iter().chain(body).chain(part).collect(),
        heights: None,
        machine: None,
    }
}

/// The passes that share each number.
fn numbered(wall: &Wall) -> impl Iterator<Item = &[SurfacePass]> {
    wall.plan.passes.chunk_by(|a, b| a.number == b.number)
}

/// Tilts of the torch along passes, deg: least, mean, greatest.
fn tilt_of(passes: &[SurfacePass], wall: &Wall) -> [f64; 3] {
    let torch = &wall.plan.torch;
    meltpath_planning::surface::tilts(passes, torch).map_or([f64::NAN; 3], |d| {
        [d.least.value, d.mean, d.greatest.value].map(f64::to_degrees)
    })
}

/// Distances of passes from those before, mm: least, mean, greatest.
fn spacing_of(passes: &[SurfacePass]) -> [f64; 3] {
    distribution(passes, |pass, i| pass.points[i].spacing())
        .map_or([f64::NAN; 3], |d| [d.least.value, d.mean, d.greatest.value])
}

/// The chapter of plots and tables.
pub(crate) fn sections(wall: &Wall, asked: &Asked, settings: &Settings) -> Vec<Section> {
    let by_pass = |f: &dyn Fn(&[SurfacePass]) -> f64| -> Vec<DVec2> {
        let point = |p: &[SurfacePass]| DVec2::new(f64::from(p[0].number), f(p));
        numbered(wall).map(point).collect()
    };
    let spacing = Plot::new("Distance between passes", ["pass", ""], ["distance", "mm"])
        .band(
            "least to greatest",
            by_pass(&|p| spacing_of(p)[0]),
            by_pass(&|p| spacing_of(p)[2]),
        )
        .line("mean of the pass", by_pass(&|p| spacing_of(p)[1]))
        .limit("as set", asked.spacing)
        .caption("From the point of the pass before that each point was laid from.");
    let ratio = Plot::new(
        "Thickness of each pass, widest over closest place",
        ["pass", ""],
        ["ratio", ""],
    )
    .line("ratio", by_pass(&|p| spacing_of(p)[2] / spacing_of(p)[0]));
    let mut tilt = Plot::new("Torch against up", ["pass", ""], ["angle", "deg"])
        .band(
            "least to greatest",
            by_pass(&|p| tilt_of(p, wall)[0]),
            by_pass(&|p| tilt_of(p, wall)[2]),
        )
        .line("mean of the pass", by_pass(&|p| tilt_of(p, wall)[1]));
    if let Some(limit) = lean::limit(settings) {
        tilt = tilt.limit("limit", limit.to_degrees());
    }
    let speed = speed_plot(&wall.samples);
    let part_turns = settings
        .robot
        .as_ref()
        .is_some_and(|r| r.arrangement == meltpath_robot::cell::Arrangement::PartOnRobot);
    let intro = if part_turns {
        "Angles are those between the torch and the build direction of the part: the robot turns the part, the torch stands."
    } else {
        "Angles are those between the torch and the vertical."
    };
    let mut sections = vec![Section::new(
        "Passes on the surface",
        intro.to_owned(),
        vec![spacing, ratio, tilt, speed],
        vec![table(wall)],
    )];
    sections.extend(growth_section(wall, settings));
    sections
}

/// How the wall grows, pass by pass.
fn growth_section(wall: &Wall, settings: &Settings) -> Option<Section> {
    let metal = &wall.grown.as_ref().ok()?.fine;
    let layers = outcomes(metal, &wall.commands, settings, &wall.plan);
    let growth = settings.growth_error(1.0);
    Some(Section::new(
        "How the wall grows",
        "Heights are those of the metal on the bead's axis over the base, along the torch; each pass is a layer. The band is one standard uncertainty.",
        vec![
            height_plot(&layers, &growth),
            ctwd_plot(&layers, &settings.limits),
            flatness_plot(&layers, &settings.limits),
        ],
        vec![],
    ))
}

fn table(wall: &Wall) -> Table {
    let fixed = |v: f64, digits| {
        if v.is_finite() {
            Cell::Fixed(v, digits)
        } else {
            Cell::Empty
        }
    };
    let row = |group: &[SurfacePass]| {
        let [least, mean, greatest] = spacing_of(group);
        let [low, _, high] = tilt_of(group, wall);
        [
            ("pass", Cell::Number(f64::from(group[0].number))),
            ("beads", Cell::Number(group.len() as f64)),
            (
                "length (mm)",
                Cell::Fixed(group.iter().map(SurfacePass::length).sum(), 0),
            ),
            ("distance least (mm)", fixed(least, 3)),
            ("mean (mm)", fixed(mean, 3)),
            ("greatest (mm)", fixed(greatest, 3)),
            ("torch least (deg)", fixed(low, 1)),
            ("greatest (deg)", fixed(high, 1)),
        ]
    };
    Table::of("Passes", numbered(wall).map(row))
}

/// Writes the as-built mesh, the ParaView fields and the series.
///
/// # Errors
/// [`OutputError`], a full disk included.
pub(crate) fn write_files(folder: &OutputFolder, wall: &Wall) -> Result<(), OutputError> {
    let lines = passes(wall, Stroke::Hairline);
    folder.write("fields/passes.vtp", |w| {
        write_lines(w, &lines).map_err(io::Error::other)
    })?;
    if let Ok(grown) = &wall.grown {
        let mesh = grown.fine.laid.voxels.to_mesh();
        folder.write("as-built.stl", |mut w| write_stl(&mesh, "as-built", &mut w))?;
        let lines = beads(&grown.fine.laid, &wall.commands.layer_of_command);
        folder.write("fields/beads.vtp", |w| {
            write_lines(w, &lines).map_err(io::Error::other)
        })?;
    }
    motion_series(folder, &wall.samples, &wall.commands.layer_of_command)?;
    write_passes(folder, &wall.plan.toolpath)?;
    let plan = &wall.plan;
    let axes = axes_along(&plan.passes, &plan.torch);
    let all: Vec<_> = plan
        .passes
        .iter()
        .zip(axes)
        .flat_map(|(pass, axes)| {
            pass.points
                .iter()
                .zip(axes)
                .map(|(p, a)| (pass.number, p, a))
        })
        .collect();
    let all =
        |f: &dyn Fn(&(u32, &SurfacePoint, DVec3)) -> f64| all.iter().map(f).collect::<Vec<f64>>();
    let columns = [
        ("pass", "", all(&|a| f64::from(a.0))),
        ("x", "mm", all(&|a| a.1.position.x)),
        ("y", "mm", all(&|a| a.1.position.y)),
        ("z", "mm", all(&|a| a.1.position.z)),
        ("axis_x", "", all(&|a| a.2.x)),
        ("axis_y", "", all(&|a| a.2.y)),
        ("axis_z", "", all(&|a| a.2.z)),
        ("spacing", "mm", all(&|a| a.1.spacing().unwrap_or(f64::NAN))),
        (
            "tilt",
            "deg",
            all(&|a| a.2.angle_between(plan.torch.up).to_degrees()),
        ),
    ];
    write_csv(folder, "series/surface.csv", &columns)
}
