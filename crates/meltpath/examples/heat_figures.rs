//! Draws the figures of the book's page on heat: those of chapters 2.4, 3.2 and 3.3 of Béraud 2016 that can be compared.
//!
//! `cargo run --release -p meltpath-app --example heat_figures -- docs/theory/heat-figures.html`; some minutes of computing.

use std::error::Error;
use std::path::{Path, PathBuf};

use meltpath::ebm::gun::focus;
use meltpath::ebm::plan::path_file;
use meltpath_base::{Provenance, Silent, Verdict};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_planning::powder::modulation::Ramp;
use meltpath_report::html::{Report, Section, write_html};
use meltpath_report::plot::{Bar, Mark, Plot};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::calibration::coupon::{BeamGuess, BeamSetting, Bench, Charts, Coupon};
use meltpath_thermal::charts::build::compute;
use meltpath_thermal::charts::simulation::{ChartSimulation, Settings};
use meltpath_thermal::charts::{ChartSet, ChartSettings};
use meltpath_thermal::criteria::histogram;
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::enthalpy::Enthalpy;
use meltpath_thermal::material::file::{Readings, read};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::State;

fn line(name: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Mark {
    Mark::Line {
        name: name.to_owned(),
        points: points.into_iter().map(DVec2::from).collect(),
    }
}

fn dots(name: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Mark {
    Mark::Dots {
        name: name.to_owned(),
        points: points.into_iter().map(DVec2::from).collect(),
    }
}

fn titanium() -> Result<Material, Box<dyn Error>> {
    Ok(read(
        meltpath_data::materials::TI6AL4V_EBM.text,
        Readings::default(),
    )?)
}

/// Figure 2.4.5: the ramps of the modulation.
fn modulation() -> Vec<Plot> {
    let mut plots = Vec::new();
    let ramp = |least: f64| Ramp { least, length: 1.0 };
    let of = |r: Ramp| (0..=60).map(move |n| [0.025 * f64::from(n), r.at(0.025 * f64::from(n))]);
    let plot = Plot::new(
        "Ramps",
        ["distance to powder", "mm"],
        ["share of the energy", ""],
    )
    .with(line("in the plane", of(ramp(0.8))))
    .with(line("upwards", of(ramp(0.6))));
    plots.push(plot);
    plots
}

/// Temperature in time of a heating curve.
fn history(set: &ChartSet, curve: &Enthalpy, chart: usize, h: usize, r: usize) -> Vec<[f64; 2]> {
    let heating = set.heating(&set.charts[chart], h, r);
    (0..=128)
        .map(|n| {
            let g = f64::from(heating.end) * f64::from(n) / 128.0;
            [1e3 * heating.time(g), curve.temperature(g) - CELSIUS]
        })
        .collect()
}

/// Figures of section 3.2.2.2: what depth, distance, powder and the height of the fall do.
fn charts(material: &Material) -> Result<Vec<Plot>, Box<dyn Error>> {
    let mut plots = Vec::new();
    let set = compute(&ChartSettings::for_beam(120.0, 0.551_67), material, &Silent)?;
    let curve = Enthalpy::new(material)?;
    let axes = |title: &str| Plot::new(title, ["time", "ms"], ["temperature", "°C"]);
    let thin = set
        .charts
        .iter()
        .position(|c| c.powder_share > 0.05)
        .unwrap_or(0);
    let nearest = |grid: &[f64], wanted: f64| {
        (0..grid.len()).fold(0, |best, n| {
            if (grid[n] - wanted).abs() < (grid[best] - wanted).abs() {
                n
            } else {
                best
            }
        })
    };
    let mut depths = axes("Heating on the axis");
    for depth in [0.0125, 0.1125, 0.2125, 0.3125] {
        let h = nearest(&set.depths, depth);
        let name = format!("{:.0} µm deep", 1e3 * set.depths[h]);
        depths = depths.with(line(&name, history(&set, &curve, thin, h, 0)));
    }
    // the independent solver's table (docs/theory/sources.md)
    depths = depths.with(dots(
        "independent solver, 12.5 µm",
        [[0.25, 1631.0], [0.5, 1923.0], [1.0, 2400.0], [2.03, 2800.0]],
    ));
    plots.push(depths);
    let mut distances = axes("Heating near the surface");
    for distance in [0.0875, 0.1625, 0.2375, 0.3125] {
        let r = nearest(&set.distances, distance);
        let h = nearest(&set.depths, 0.0375);
        let name = format!("{:.0} µm beside", 1e3 * set.distances[r]);
        distances = distances.with(line(&name, history(&set, &curve, thin, h, r)));
    }
    distances = distances.with(dots(
        "independent solver, 87.5 µm",
        [[0.25, 1493.0], [0.5, 1632.0], [1.0, 2079.0], [2.03, 2495.0]],
    ));
    plots.push(distances);
    let mut powder = axes("Heating of the surface");
    for (n, chart) in set.charts.iter().enumerate() {
        let name = format!("{:.0} % powder", 100.0 * chart.powder_share);
        powder = powder.with(line(&name, history(&set, &curve, n, 0, 0)));
    }
    plots.push(powder);
    let mut cooling = axes("Cooling on the axis");
    for depth in [0.0125, 0.1125, 0.2125, 0.3125] {
        let h = nearest(&set.depths, depth);
        let fall = &set.charts[thin].cooling[h];
        let (from, to) = (f64::from(fall.from), f64::from(fall.to));
        let last = fall.times.len() - 1;
        let points = fall.times.iter().enumerate().step_by(8).map(|(n, time)| {
            let g = from + (to - from) * n as f64 / last as f64;
            [1e3 * f64::from(*time), curve.temperature(g) - CELSIUS]
        });
        cooling = cooling.with(line(&format!("{:.0} µm deep", 1e3 * set.depths[h]), points));
    }
    plots.push(cooling);
    Ok(plots)
}

/// Figures 3.2.14 and 3.3.1: walls against the beam diameter, struts against their first contour.
fn bodies(material: &Material) -> Result<Vec<Plot>, Box<dyn Error>> {
    let mut plots = Vec::new();
    let beam = |power: f64, spot: f64| BeamSetting { power, spot };
    let sure = BeamGuess {
        efficiency: 0.9,
        width: 1.0,
    };
    let mut walls = Vec::new();
    for micron in [300.0, 400.0, 500.0, 600.0, 700.0, 800.0] {
        let bench = Bench {
            material,
            layer: 0.05,
            layers: 5,
            spacing: 0.025,
        };
        let wall = Coupon::Wall {
            beam: beam(300.0, 1e-3 * micron),
            speed: 1400.0,
        };
        let size = wall.size(&bench, sure, &mut Charts::default(), &Silent)?;
        walls.push([micron, 1e3 * size]);
    }
    let plot = Plot::new("Walls", ["beam diameter", "µm"], ["thickness", "µm"])
        .with(line(
            "thesis, e = 0.60 φ + 120 µm",
            [[300.0, 300.0], [800.0, 600.0]],
        ))
        .with(dots("charts", walls.clone()));
    plots.push(plot);
    let spot = focus::load("a1-beraud-2016", Path::new("."))?
        .0
        .diameter(0.0)?;
    let bench = Bench {
        material,
        layer: 0.05,
        layers: 5,
        spacing: 0.025,
    };
    let mut known = Charts::default();
    let mut struts = Vec::new();
    for radius in [0.2, 0.25, 0.3, 0.35, 0.372, 0.4, 0.45] {
        let strut = Coupon::Strut {
            circles: vec![
                (radius, beam(120.0, spot)),
                (radius - 0.1, beam(144.0, spot)),
            ],
            speed: 470.0,
            overlap: 0.4,
        };
        struts.push([radius, strut.size(&bench, sure, &mut known, &Silent)?]);
    }
    let plot = Plot::new("Struts", ["first contour", "mm"], ["diameter", "mm"])
        .with(line("charts", struts))
        .with(dots("thesis, its charts", [[0.2, 0.718], [0.372, 1.0]]))
        .with(dots("thesis, built", [[0.2, 0.657], [0.372, 0.868]]));
    plots.push(plot);
    Ok(plots)
}

/// A path of the example on charts that go to `stop` °C.
fn highest(file: &Path, material: &Material) -> Result<Field, Box<dyn Error>> {
    let (focus, _) = focus::load("a1-beraud-2016", Path::new("."))?;
    let motion = path_file::read(file)?.motion(&focus)?;
    let path = BeamPath::of(&[motion])?;
    let settings = ChartSettings {
        stop: 3700.0 + CELSIUS,
        ..ChartSettings::for_beam(300.0, 0.413_67)
    };
    let set = compute(&settings, material, &Silent)?;
    let (mut low, mut high) = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    for p in path.points() {
        low = low.min(DVec3::new(p.x, p.y, 0.0));
        high = high.max(DVec3::new(p.x, p.y, 0.0));
    }
    let margin = DVec3::new(0.5, 0.5, 0.0);
    let grid = Grid::covering(
        low - margin - DVec3::new(0.0, 0.0, 0.35),
        high + margin,
        DVec3::new(0.057, 0.057, 0.05),
    )?;
    let mut simulation =
        ChartSimulation::new(&grid, material.clone(), vec![set], Settings::of(material))?;
    simulation.set_state(|c| {
        if c.z > -0.05 {
            State::Powder
        } else {
            State::Dense
        }
    });
    simulation.draw(&path, &[], &mut |_, _| (), &Silent)?;
    Ok(simulation.highest_temperature())
}

/// Mean of the top plane's cells within `radius` mm of a point; `None` where there is none.
fn mean_on_top(field: &Field, [x, y]: [f64; 2], radius: f64) -> Option<f64> {
    let (grid, top) = (&field.grid, field.grid.planes() - 1);
    let cells = (0..grid.cells[1]).flat_map(|j| (0..grid.cells[0]).map(move |i| (i, j)));
    let near = cells.filter(|(i, j)| {
        let c = grid.centre(*i, *j, top);
        (c.x - x).hypot(c.y - y) <= radius
    });
    let (sum, count) = near.fold((0.0, 0.0), |(sum, count), (i, j)| {
        (sum + field.at(i, j, top), count + 1.0)
    });
    (count > 0.0).then_some(sum / count)
}

/// Figures 3.3.10, 3.3.13 and 3.3.18: highest temperatures of rectangle and triangle.
fn prisms(material: &Material) -> Result<Vec<Plot>, Box<dyn Error>> {
    let mut plots = Vec::new();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/ebm-triangle");
    let rectangle = highest(&example.join("rectangle.csv"), material)?;
    let across = |field: &Field, y: f64| -> Vec<[f64; 2]> {
        let grid = &field.grid;
        (0..grid.cells[0])
            .filter_map(|i| {
                let x = grid.centre(i, 0, 0).x;
                // over three lines, so that what lies between them does not show
                let mean = mean_on_top(field, [x, y], 0.2)? - CELSIUS;
                (mean > 1700.0).then_some([x, mean])
            })
            .collect()
    };
    let grid = &rectangle.grid;
    let middle = grid.origin.y + 0.5 * grid.edge[1] * grid.cells[1] as f64;
    let plot = Plot::new("Rectangle", ["x", "mm"], ["highest temperature", "°C"])
        .with(line("through its middle", across(&rectangle, middle)))
        .with(dots(
            "thesis: ends and centre",
            [[-7.4, 2780.0], [0.0, 2730.0], [7.4, 2780.0]],
        ));
    plots.push(plot);
    let triangle = highest(&example.join("triangle.csv"), material)?;
    let top = triangle.grid.planes() - 1;
    let bars = histogram(&triangle, 20.0, |[_, _, k]| k == top)
        .into_iter()
        .filter(|b| b.0 > 1665.0 + CELSIUS)
        .map(|(from, count)| Bar {
            from: from - CELSIUS,
            to: from + 20.0 - CELSIUS,
            value: count as f64,
        })
        .collect();
    let plot = Plot::new(
        "Triangle",
        ["highest temperature", "°C"],
        ["molten voxels of the last layer", ""],
    )
    .bars("charts to 3700 °C", bars);
    plots.push(plot);
    let mut profile = Plot::new(
        "Triangle, along its lines",
        ["x", "mm"],
        ["highest temperature", "°C"],
    );
    for y in [0.7, 3.7, 6.5] {
        profile = profile.with(line(&format!("y = {y} mm"), across(&triangle, y)));
    }
    plots.push(profile);
    Ok(plots)
}

fn section(title: &str, intro: &str, plots: Vec<Plot>) -> Section {
    Section::new(title.to_owned(), intro.to_owned(), plots, vec![])
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = PathBuf::from(std::env::args().nth(1).ok_or("give the page to write")?);
    let material = titanium()?;
    let mut provenance = Provenance::new();
    provenance.model(
        "thesis",
        "N. Béraud, doctoral thesis, Université Grenoble Alpes, 2016",
    );
    provenance.model(
        "independent solver",
        "docs/theory/sources.md, an independent solver",
    );
    let report = Report {
        title: "Figures of heat".to_owned(),
        subtitle: "Béraud 2016, chapters 2.4, 3.2 and 3.3, drawn again with the thesis' numbers beside ours".to_owned(),
        verdict: Verdict::default(),
        scene: None,
        sections: vec![
            section(
                "Energy (2.4)",
                "How energy is taken off near powder; the thesis prints no ramps: ours are starting values.",
                modulation(),
            ),
            section(
                "Charts (3.2)",
                "Under a beam at rest of 2 mA, 60 kV, 552 µm on one layer of powder. Dots: an independent solver.",
                charts(&material)?,
            ),
            section(
                "Walls and struts (3.2, 3.3)",
                "Walls of 5 mA at 1400 mm/s, five layers, without stuck grains. The thesis' slope of 0.60 is not reproduced (erratum E18): a wide beam melts little. Struts of two circles, 470 mm/s.",
                bodies(&material)?,
            ),
            section(
                "Prisms (3.3)",
                "Lines every 0.125 mm at 980 mm/s, 5 mA, focus 4 mA; one layer, charts to 3700 °C. The thesis' scale ends at 2800 °C, where its charts stop (erratum E10); what compares is the rise towards the ends.",
                prisms(&material)?,
            ),
        ],
        sheet: None,
        provenance,
    };
    let mut page = Vec::new();
    write_html(&mut page, &report)?;
    std::fs::write(file, page)?;
    Ok(())
}
