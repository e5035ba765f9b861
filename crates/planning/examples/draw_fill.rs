//! Draws every strategy on a set of shapes as SVG: `cargo run -p meltpath-planning --example draw_fill -- FOLDER`.
//! Beads are drawn at their width, coloured by order from blue to red; starts are dots, gaps crosses.

use std::fmt::Write as _;
use std::path::PathBuf;

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::shapes as outlines;
use meltpath_geometry::{Plane, Region};
use meltpath_planning::{
    ContourOrder, FillSettings, Layer, LayerPlan, LineAngle, LineDirection, LineOrder, PassIds,
    Strategy, plan_layer,
};
use meltpath_toolpath::{Move, Pass};

fn shapes() -> Vec<(&'static str, Vec<Region>)> {
    vec![
        ("plate", vec![outlines::plate(100.0, 40.0)]),
        ("ring", vec![outlines::ring(50.0, 30.0, 180)]),
        ("cross", vec![outlines::cross(90.0, 24.0)]),
        ("tee", vec![outlines::tee(96.0, 74.0, 24.0)]),
        ("ell", vec![outlines::ell(90.0, 60.0, 18.0)]),
        ("star", vec![outlines::star(5, 60.0, 26.0)]),
        ("gear", vec![outlines::gear(12, 40.0, 52.0, 14.0)]),
        ("honeycomb", vec![outlines::honeycomb(5, 4, 9.0, 6.8)]),
        ("spiral", vec![outlines::spiral(15.0, 14.0, 6.6, 3.0)]),
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
        let hue = 240.0 * (1.0 - i as f64 / count);
        draw(&pass, hue, plan.settings.width, &mut line);
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

/// A bead at its width and its line, with its points; its start is a dot.
fn draw(pass: &Pass<'_>, hue: f64, width: f64, line: &mut impl FnMut(String)) {
    let (points, _) = pass.flatten(0.01);
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
        "<path d=\"{path}\" fill=\"none\" stroke=\"hsl({hue:.0},80%,50%)\" stroke-opacity=\"0.25\" stroke-width=\"{width}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/>"
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
