//! Draws every strategy on a set of shapes as SVG: `cargo run -p meltpath-planning --example draw_fill -- FOLDER`.
//! Beads are drawn at their width, coloured by order from blue to red; starts are dots, gaps crosses.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::PathBuf;

use meltpath_base::Reporter;
use meltpath_geometry::boolean::{difference, union};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::stroke;
use meltpath_geometry::{Plane, Region, Ring};
use meltpath_planning::{
    ContourOrder, FillSettings, Layer, LayerPlan, LineAngle, LineDirection, LineOrder, PassIds,
    Strategy, plan_layer,
};
use meltpath_toolpath::Move;

fn circle(x: f64, y: f64, radius: f64, n: usize) -> Ring {
    (0..n)
        .map(|i| DVec2::new(x, y) + DVec2::from_angle(TAU * i as f64 / n as f64) * radius)
        .collect()
}

fn ring_of(points: &[(f64, f64)]) -> Ring {
    points.iter().map(|&p| DVec2::from(p)).collect()
}

fn solid(outer: Ring) -> Region {
    Region {
        outer,
        holes: Vec::new(),
    }
}

fn cut(outer: Ring, holes: Vec<Ring>) -> Vec<Region> {
    let holes: Vec<_> = holes.into_iter().map(solid).collect();
    difference(&[solid(outer)], &holes).unwrap_or_default()
}

fn rectangle(x: f64, y: f64) -> Ring {
    ring_of(&[(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)])
}

fn inner_rectangle(x: f64, y: f64, wall: f64) -> Ring {
    ring_of(&[
        (wall, wall),
        (x - wall, wall),
        (x - wall, y - wall),
        (wall, y - wall),
    ])
}

fn shapes() -> Vec<(&'static str, Vec<Region>)> {
    let bolts = (0..6).map(|i| {
        let p = DVec2::from_angle(TAU * f64::from(i) / 6.0) * 45.0;
        circle(p.x, p.y, 6.0, 48)
    });
    let star: Ring = (0..10)
        .map(|i| {
            DVec2::from_angle(TAU * f64::from(i) / 10.0) * if i % 2 == 0 { 60.0 } else { 26.0 }
        })
        .collect();
    let mut cells = Vec::new();
    for i in 0..5 {
        for j in 0..4 {
            let x = 22.0 * f64::from(i) + if j % 2 == 0 { 0.0 } else { 11.0 };
            cells.push(
                (0..6)
                    .map(|k| {
                        DVec2::new(x + 18.0, 19.0 * f64::from(j) + 18.0)
                            + DVec2::from_angle(TAU * (f64::from(k) + 0.5) / 6.0) * 8.8
                    })
                    .collect(),
            );
        }
    }
    let comb: Vec<(f64, f64)> = (0..6)
        .flat_map(|i| {
            let x = 20.0 * f64::from(i);
            [(x, 0.0), (x, 40.0), (x + 10.0, 40.0), (x + 10.0, 0.0)]
        })
        .collect();
    let mut comb = comb;
    comb.extend([(110.0, -12.0), (0.0, -12.0)]);
    comb.reverse();
    let truss: Vec<Vec<DVec2>> = (0..4)
        .flat_map(|i| {
            let x = 30.0 * f64::from(i);
            [
                ring_of(&[(x, 0.0), (x + 30.0, 0.0)]),
                ring_of(&[(x, 30.0), (x + 30.0, 30.0)]),
                ring_of(&[(x, 0.0), (x + 15.0, 30.0), (x + 30.0, 0.0)]),
            ]
        })
        .collect();
    vec![
        ("rectangle", vec![solid(rectangle(100.0, 40.0))]),
        (
            "raster-wall",
            vec![solid(rectangle(120.0, 5.0 * 4.62 + 6.5))],
        ),
        (
            "contour-wall",
            vec![solid(rectangle(150.0, 7.0 * 4.62 + 6.5))],
        ),
        ("thin-wall", vec![solid(rectangle(150.0, 7.0))]),
        (
            "ring",
            cut(
                circle(0.0, 0.0, 50.0, 180),
                vec![circle(0.0, 0.0, 30.0, 120)],
            ),
        ),
        (
            "thin-ring",
            cut(
                circle(0.0, 0.0, 40.0, 180),
                vec![circle(0.0, 0.0, 33.5, 120)],
            ),
        ),
        ("disc", vec![solid(circle(0.0, 0.0, 25.0, 120))]),
        (
            "flange",
            cut(
                circle(0.0, 0.0, 60.0, 200),
                bolts.chain([circle(0.0, 0.0, 25.0, 100)]).collect(),
            ),
        ),
        ("star", vec![solid(star)]),
        (
            "tee",
            vec![solid(ring_of(&[
                (0.0, 0.0),
                (24.0, 0.0),
                (24.0, 50.0),
                (60.0, 50.0),
                (60.0, 74.0),
                (-36.0, 74.0),
                (-36.0, 50.0),
                (0.0, 50.0),
            ]))],
        ),
        ("honeycomb", cut(rectangle(125.0, 93.0), cells)),
        (
            "thin-box",
            cut(
                rectangle(80.0, 50.0),
                vec![inner_rectangle(80.0, 50.0, 6.6)],
            ),
        ),
        ("comb", vec![solid(ring_of(&comb))]),
        ("truss", stroke(&truss, 3.4, 0.01).unwrap_or_default()),
        (
            "wedge",
            union(&[solid(ring_of(&[(0.0, 0.0), (120.0, 0.0), (0.0, 40.0)]))]).unwrap_or_default(),
        ),
        (
            "slot-plate",
            cut(
                rectangle(100.0, 60.0),
                vec![ring_of(&[
                    (30.0, 22.0),
                    (70.0, 22.0),
                    (70.0, 37.0),
                    (30.0, 37.0),
                ])],
            ),
        ),
    ]
}

fn strategies() -> Vec<(&'static str, Strategy)> {
    let angle = LineAngle::Best;
    vec![
        (
            "raster",
            Strategy::Raster {
                angle,
                order: LineOrder::Across,
                direction: LineDirection::AlternatePerBead,
            },
        ),
        ("zigzag", Strategy::Zigzag { angle }),
        (
            "contour",
            Strategy::Contour {
                order: ContourOrder::OutsideIn,
            },
        ),
        (
            "spiral",
            Strategy::Spiral {
                order: ContourOrder::OutsideIn,
            },
        ),
        (
            "hybrid",
            Strategy::Hybrid {
                contours: 1,
                order: ContourOrder::OutsideIn,
                angle,
            },
        ),
    ]
}

fn svg(regions: &[Region], plan: &LayerPlan, title: &str) -> String {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for p in regions.iter().flat_map(Region::rings).flatten() {
        (low, high) = (low.min(*p), high.max(*p));
    }
    let (low, size) = (low - 10.0, high - low + 20.0);
    let mut out = String::new();
    let mut line = |text: String| {
        out.push_str(&text);
        out.push('\n');
    };
    line(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {} {}\" width=\"{}\" height=\"{}\">",
        low.x,
        low.y,
        size.x,
        size.y + 8.0,
        7.0 * size.x,
        7.0 * (size.y + 8.0)
    ));
    line(format!(
        "<rect x=\"{}\" y=\"{}\" width=\"100%\" height=\"100%\" fill=\"white\"/>",
        low.x, low.y
    ));
    let mut outline = String::new();
    for ring in regions.iter().flat_map(Region::rings) {
        for (i, p) in ring.iter().enumerate() {
            let _ = write!(
                outline,
                "{}{:.3} {:.3} ",
                if i == 0 { "M" } else { "L" },
                p.x,
                p.y
            );
        }
        outline.push('Z');
    }
    line(format!(
        "<path d=\"{outline}\" fill=\"#ddd\" fill-rule=\"evenodd\" stroke=\"black\" stroke-width=\"0.3\"/>"
    ));
    let count = plan.path.len().max(2) as f64 - 1.0;
    for (i, pass) in plan.path.passes().enumerate() {
        let (points, _) = pass.flatten(0.01);
        let hue = 240.0 * (1.0 - i as f64 / count);
        let mut path = String::new();
        for (i, p) in points.iter().enumerate() {
            let _ = write!(
                path,
                "{}{:.3} {:.3} ",
                if i == 0 { "M" } else { "L" },
                p.x,
                p.y
            );
        }
        line(format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"hsl({hue:.0},80%,50%)\" stroke-opacity=\"0.25\" stroke-width=\"{}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/>",
            plan.settings.width
        ));
        line(format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"hsl({hue:.0},90%,35%)\" stroke-width=\"0.4\"/>"
        ));
        for p in pass.points {
            line(format!(
                "<circle cx=\"{:.3}\" cy=\"{:.3}\" r=\"0.45\" fill=\"hsl({hue:.0},90%,25%)\"/>",
                p.x, p.y
            ));
        }
        if let Some(p) = points.first() {
            line(format!(
                "<circle cx=\"{:.3}\" cy=\"{:.3}\" r=\"1.2\" fill=\"black\"/>",
                p.x, p.y
            ));
        }
    }
    for gap in plan.coverage.iter().flat_map(|c| &c.gaps) {
        line(format!(
            "<path d=\"M{x0:.2} {y0:.2}l2 2m-2 0l2 -2\" stroke=\"magenta\" stroke-width=\"0.5\"/>",
            x0 = gap.place.x - 1.0,
            y0 = gap.place.y - 1.0
        ));
    }
    let area: f64 = plan.coverage.iter().map(|c| c.area).sum();
    let covered: f64 = plan.coverage.iter().map(|c| c.covered_area).sum();
    let outside: f64 = plan.coverage.iter().map(|c| c.outside_area).sum();
    let arcs = plan
        .path
        .passes()
        .map(|p| p.moves().filter(|m| matches!(m, Move::Arc { .. })).count())
        .sum::<usize>();
    let moves: usize = plan.path.passes().map(|p| p.move_count()).sum();
    let fill = plan
        .coverage
        .iter()
        .map(|c| c.fill_ratio * c.area)
        .sum::<f64>()
        / area;
    line(format!(
        "<text x=\"{}\" y=\"{}\" font-size=\"3.5\">{title}: {} passes, {moves} moves ({arcs} arcs), covered {:.2} %, outside {:.2} %, fill {fill:.3}</text>",
        low.x + 2.0,
        low.y + size.y + 4.0,
        plan.path.len(),
        100.0 * covered / area,
        100.0 * outside / area
    ));
    line("</svg>".to_owned());
    out
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(
        std::env::args()
            .nth(1)
            .ok_or("name a folder for the drawings")?,
    );
    std::fs::create_dir_all(&folder)?;
    let plane = Plane::horizontal(0.0);
    for (shape, regions) in shapes() {
        for (name, strategy) in strategies() {
            let settings = FillSettings {
                strategy,
                ..FillSettings::new(6.5, 4.62)
            };
            let layer = Layer {
                number: 1,
                plane: &plane,
                regions: &regions,
            };
            let plan = plan_layer(layer, &settings, PassIds { part: 0 }, &Reporter::new())?;
            let title = format!("{shape}, {name}");
            std::fs::write(
                folder.join(format!("{shape}-{name}.svg")),
                svg(&regions, &plan, &title),
            )?;
        }
    }
    Ok(())
}
