//! Vertical sections of the highest temperatures, and the volume of voxels for ParaView.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_report::colour::ColourMap;
use meltpath_report::html::Section;
use meltpath_report::plot::{Axis, Map, Mark, Plot};
use meltpath_report::vtk::{Field as Array, Values, Volume, write_volume};
use meltpath_thermal::criteria::{Class, Classes};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::CELSIUS;

use crate::ebm::preview::along::{Along, index};
use crate::ebm::settings::Settings;
use crate::ebm::simulate::Outcome;
use crate::views::ebm::film;

/// Highest temperatures to be cut.
struct Cut<'a> {
    solver: &'a str,
    highest: Cow<'a, Field>,
    classes: Classes,
}

/// The field on planes of one height, that of its top plane: the reference solver's planes grow with depth. Each new plane has the values
/// of the one in which its middle lies.
fn evenly(field: &Field) -> Cow<'_, Field> {
    let heights = &field.grid.heights;
    let top = heights.last().copied().unwrap_or_default();
    if heights.iter().all(|h| (h - top).abs() < 1e-6 * top) {
        return Cow::Borrowed(field);
    }
    let depth: f64 = heights.iter().sum();
    let count = (depth / top).round().max(1.0) as usize;
    let height = depth / count as f64;
    let ends: Vec<f64> = heights
        .iter()
        .scan(0.0, |sum, h| {
            *sum += h;
            Some(*sum)
        })
        .collect();
    let [nx, ny] = field.grid.cells;
    let values = (0..count)
        .flat_map(|k| {
            let middle = (k as f64 + 0.5) * height;
            let plane = ends.partition_point(|end| *end < middle);
            let plane = plane.min(heights.len() - 1) * nx * ny;
            field.values[plane..plane + nx * ny].iter().copied()
        })
        .collect();
    Cow::Owned(Field {
        grid: Grid {
            heights: vec![height; count],
            ..field.grid.clone()
        },
        values,
    })
}

/// The fields of the path that the run judges: on charts where they can draw it, on the reference solver where it did.
fn cuts(outcome: &Outcome) -> Vec<Cut<'_>> {
    let mut all = Vec::new();
    if let Some(preview) = &outcome.preview
        && (preview.better.is_some() || outcome.found.is_none())
    {
        all.push(Cut {
            solver: "charts",
            highest: evenly(&preview.shown().highest),
            classes: preview.classes,
        });
    }
    let found = outcome.found.as_ref().and_then(|f| f.reference.as_ref());
    let on_reference = match (&outcome.judged, found) {
        (Some(judged), _) => {
            let path = judged.better.as_ref().unwrap_or(&judged.given);
            Some((&path.highest, judged.classes))
        }
        (None, Some(found)) => Some((&found.better.0, found.classes)),
        (None, None) => None,
    };
    all.extend(on_reference.map(|(highest, classes)| Cut {
        solver: "reference solver",
        highest: evenly(highest),
        classes,
    }));
    all
}

/// Sections through the hottest place of each field and through the places that the job names.
pub(super) fn section(settings: &Settings, outcome: &Outcome) -> Section {
    let films = outcome.preview.iter().map(|p| &p.shown().film);
    let mut plots: Vec<Plot> = films.flat_map(film::plots).collect();
    let mut outside = String::new();
    let volume = match outcome.preview {
        Some(_) => "fields/voxels.vti",
        None => "fields/voxels-reference.vti",
    };
    for cut in cuts(outcome) {
        let grid = &cut.highest.grid;
        let top = grid.planes() - 1;
        let [nx, ny] = grid.cells;
        let hottest = (0..nx * ny)
            .map(|n| (n % nx, n / nx))
            .max_by(|a, b| {
                let at = |(i, j): (usize, usize)| cut.highest.at(i, j, top);
                at(*a).total_cmp(&at(*b))
            })
            .map(|(i, j)| grid.centre(i, j, top));
        let hottest = hottest.map(|c| ("the hottest place".to_owned(), [c.x, c.y]));
        let chosen = settings.job.simulation.sections.iter();
        let chosen = chosen
            .map(|place| place.map(|v| v.0))
            .map(|[x, y]| (format!("x {x} mm, y {y} mm"), [x, y]));
        for (name, place) in hottest.into_iter().chain(chosen) {
            let both = [Along::X, Along::Y].map(|along| plot(&cut, along, &name, place, settings));
            if both.iter().all(Option::is_none) {
                let _ = write!(outside, " {name} lies outside the voxels ({}).", cut.solver);
            }
            plots.extend(both.into_iter().flatten());
        }
    }
    Section::new(
        "Sections",
        format!(
            "Vertical planes through the last layer: temperatures in time, whose sliders move together, then highest temperatures; depths are drawn larger than widths. The whole volume lies in {volume}.{outside}"
        ),
        plots,
        vec![],
    )
}

fn plot(
    cut: &Cut<'_>,
    along: Along,
    name: &str,
    place: [f64; 2],
    settings: &Settings,
) -> Option<Plot> {
    let (grid, axis) = (&cut.highest.grid, along.axis());
    let across = along.other();
    index(grid, axis, place[axis])?;
    let row = index(grid, across.axis(), place[across.axis()])?;
    let columns = grid.cells[axis];
    let cell = |n: usize| along.cell(n, row);
    let values: Vec<f64> = (0..grid.planes())
        .flat_map(|k| (0..columns).map(move |n| (n, k)))
        .map(|(n, k)| {
            let (i, j) = cell(n);
            cut.highest.at(i, j, k) - CELSIUS
        })
        .collect();
    let low = grid.origin[axis];
    let ends = [low, low + columns as f64 * grid.edge[axis]];
    let bottom = grid.origin.z;
    let mut plot = Plot::new(
        &format!(
            "Section along {} through {name}, {}",
            along.name(),
            cut.solver
        ),
        Axis::new(along.name(), "mm").between(ends[0], ends[1]),
        Axis::new("z", "mm").between(bottom, grid.top()),
    )
    .with(Mark::Map(Map {
        name: "highest".to_owned(),
        unit: "°C".to_owned(),
        corners: [DVec2::new(ends[0], bottom), DVec2::new(ends[1], grid.top())],
        columns,
        values,
        range: None,
        colours: ColourMap::Sequential,
    }));
    for (name, kelvin) in [
        ("liquidus", settings.material.liquidus),
        ("window, from", cut.classes.window[0]),
        ("window, to", cut.classes.window[1]),
    ] {
        let points = (0..columns)
            .map(|n| {
                let (i, j) = cell(n);
                let x = low + (n as f64 + 0.5) * grid.edge[axis];
                DVec2::new(x, isotherm(&cut.highest, i, j, kelvin))
            })
            .collect();
        plot = plot.line(format!("{name} {:.0} °C", kelvin - CELSIUS), points);
    }
    let at = grid.centre(cell(0).0, cell(0).1, 0)[across.axis()];
    Some(plot.caption(&format!("At {} = {at:.2} mm.", across.name())))
}

/// Height down to which a column became hotter than `kelvin`, mm; not a number where its top did not.
fn isotherm(highest: &Field, i: usize, j: usize, kelvin: f64) -> f64 {
    let grid = &highest.grid;
    let top = grid.planes() - 1;
    if highest.at(i, j, top) < kelvin {
        return f64::NAN;
    }
    let height = |k: usize| grid.centre(i, j, k).z;
    let below = (0..top).rev().find(|k| highest.at(i, j, *k) < kelvin);
    below.map_or(grid.origin.z, |k| {
        let (cold, hot) = (highest.at(i, j, k), highest.at(i, j, k + 1));
        let share = (kelvin - cold) / (hot - cold);
        height(k) + share * (height(k + 1) - height(k))
    })
}

/// Writes the volume of each field: highest temperature, class, and on charts what is metal.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write_volumes(folder: &OutputFolder, outcome: &Outcome) -> Result<(), OutputError> {
    for cut in cuts(outcome) {
        let (field, grid) = (&cut.highest, &cut.highest.grid);
        let celsius: Vec<f32> = field.values.iter().map(|v| v - CELSIUS as f32).collect();
        let classes: Vec<u8> = field
            .values
            .iter()
            .map(|v| match cut.classes.of(f64::from(*v)) {
                Class::Unmelted => 0,
                Class::Porous => 1,
                Class::Good => 2,
                Class::Overheated => 3,
            })
            .collect();
        let volume = Volume {
            origin: grid.origin,
            spacing: DVec3::new(grid.edge[0], grid.edge[1], grid.heights[0]),
            cells: [grid.cells[0], grid.cells[1], grid.planes()],
        };
        let name = match cut.solver {
            "charts" => "fields/voxels.vti",
            _ => "fields/voxels-reference.vti",
        };
        folder.write(name, |w| {
            let fields = [
                Array::floats("highest temperature", "°C", &celsius),
                Array {
                    name: "class",
                    unit: "",
                    values: Values::UInt8(&classes),
                },
            ];
            write_volume(w, &volume, &fields).map_err(io::Error::other)
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::evenly;
    use meltpath_geometry::math::DVec3;
    use meltpath_thermal::grid::{Field, Grid};

    #[test]
    fn planes_that_grow_with_depth_become_even_ones() {
        let field = Field {
            grid: Grid {
                origin: DVec3::new(0.0, 0.0, -0.5),
                cells: [2, 1],
                edge: [0.1, 0.1],
                heights: vec![0.3, 0.1, 0.1],
            },
            values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        };
        let even = evenly(&field);
        assert_eq!(even.grid.heights.len(), 5);
        assert!((even.grid.top() - field.grid.top()).abs() < 1e-12);
        assert_eq!(
            even.values,
            [1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        );
        assert_eq!(evenly(&even).grid.heights.len(), 5);
    }
}
