//! Plots drawn as SVG that stands inside a page: colours are the page's, text scales with the figure.

use std::fmt::Write as _;

use super::axes::axes;
use super::frame::{Frame, HEIGHT, WIDTH, straightened};
use super::line::{distinct, line_path, outline_path};
use super::{Axis, Film, Mark, Plot, Scale, map};
use crate::escape::escape;
use crate::number::significant;

/// Number of colours and dash patterns in the page's style sheet.
const STYLES: usize = 6;

/// The figure: title, legend, drawing, caption.
pub fn figure(plot: &Plot) -> String {
    let mut html = String::from("<figure class=\"plot\">");
    // writing to a String cannot fail, here and below
    let _ = write!(html, "<h3>{}</h3>", escape(&plot.title));
    html.push_str(&legend(plot));
    html.push_str(&svg(plot));
    for mark in &plot.marks {
        if let Mark::Film(film) = mark {
            html.push_str(&slider(film));
        }
    }
    if !plot.caption.is_empty() {
        let _ = write!(html, "<figcaption>{}</figcaption>", escape(&plot.caption));
    }
    html.push_str("</figure>");
    html
}

/// What moves a film; the page's script listens to it.
fn slider(film: &Film) -> String {
    let first = film.first();
    let label = film.shots.get(first).map_or("", |shot| &shot.label);
    format!(
        "<label class=\"film\">{} <input type=\"range\" class=\"film\" min=\"0\" max=\"{}\" value=\"{first}\"> <output>{}</output></label>",
        escape(&film.name),
        film.shots.len().saturating_sub(1),
        escape(label)
    )
}

/// Colour of each mark: lines, dots and bars take the next one, a band that of the line after it.
fn styles(marks: &[Mark]) -> Vec<usize> {
    let mut next = 0;
    marks
        .iter()
        .map(|mark| match mark {
            Mark::Line { .. } | Mark::Dots { .. } | Mark::Bars { .. } => {
                next += 1;
                (next - 1) % STYLES
            }
            Mark::Band { .. }
            | Mark::Area { .. }
            | Mark::Limit { .. }
            | Mark::Map(_)
            | Mark::Film(_) => next % STYLES,
        })
        .collect()
}

fn class(mark: &Mark, style: usize) -> String {
    match mark {
        Mark::Line { .. } => format!("line s{style}"),
        Mark::Dots { .. } => format!("dots s{style}"),
        Mark::Band { .. } => format!("band s{style}"),
        Mark::Bars { .. } => format!("bars s{style}"),
        Mark::Area { .. } => "area".to_owned(),
        Mark::Limit { .. } => "limit".to_owned(),
        Mark::Map(_) | Mark::Film(_) => "map".to_owned(),
    }
}

fn legend(plot: &Plot) -> String {
    let mut html = String::from("<ul class=\"legend\">");
    for (mark, style) in plot.marks.iter().zip(styles(&plot.marks)) {
        let map = match mark {
            Mark::Map(map) => Some(map),
            Mark::Film(film) => film.shots.first().map(|shot| &shot.map),
            _ => None,
        };
        if let Some(map) = map {
            html.push_str(&map::scale(map));
            continue;
        }
        let swatch = match mark {
            Mark::Line { .. } | Mark::Limit { .. } => "<path d=\"M0 6h26\"/>",
            Mark::Dots { .. } => "<circle cx=\"13\" cy=\"6\" r=\"3\"/>",
            _ => "<rect x=\"2\" y=\"1\" width=\"22\" height=\"10\"/>",
        };
        let _ = write!(
            html,
            "<li><svg class=\"swatch\" width=\"26\" height=\"12\" aria-hidden=\"true\"><g class=\"{}\">{swatch}</g></svg>{}</li>",
            class(mark, style),
            escape(mark.name()),
        );
    }
    html.push_str("</ul>");
    html
}

fn svg(plot: &Plot) -> String {
    let curved = plot.x.scale != Scale::Linear || plot.y.scale != Scale::Linear;
    if curved {
        drawing(&straightened(plot))
    } else {
        drawing(plot)
    }
}

fn drawing(plot: &Plot) -> String {
    let frame = Frame::of(plot);
    let mut out = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">",
        escape(&plot.title)
    );
    axes(&mut out, plot, &frame);
    let (w, h) = (frame.right - frame.left, frame.bottom - frame.top);
    // a nested svg clips what leaves the frame, without an id that could clash
    let _ = write!(
        out,
        "<svg x=\"{0}\" y=\"{1}\" width=\"{w}\" height=\"{h}\" viewBox=\"{0} {1} {w} {h}\">",
        frame.left, frame.top
    );
    let styles = styles(&plot.marks);
    for (n, (mark, style)) in plot.marks.iter().zip(styles).enumerate() {
        draw(&mut out, mark, style, &frame, &plot.y, &plot.marks[..n]);
    }
    out.push_str("</svg></svg>");
    out
}

/// `under` are the marks drawn before it.
fn draw(out: &mut String, mark: &Mark, style: usize, frame: &Frame, y_axis: &Axis, under: &[Mark]) {
    let on_map = under
        .iter()
        .any(|m| matches!(m, Mark::Map(_) | Mark::Film(_)));
    let class = class(mark, style);
    match mark {
        Mark::Line { points, .. } => {
            let d = line_path(points, frame);
            if on_map {
                let _ = write!(out, "<path class=\"halo\" d=\"{d}\"/>");
            }
            let _ = write!(out, "<path class=\"{class}\" d=\"{d}\"/>");
        }
        Mark::Dots { points, .. } => {
            let mut d = String::new();
            for p in distinct(points, frame) {
                // a dot is a line of no length with a round cap
                let _ = write!(d, "M{:.1} {:.1}h0", p.x, p.y);
            }
            let _ = write!(out, "<path class=\"{class}\" d=\"{d}\"/>");
        }
        Mark::Band { lower, upper, .. } => {
            let edge = lower.iter().chain(upper.iter().rev());
            let _ = write!(
                out,
                "<path class=\"{class}\" d=\"{}Z\"/>",
                outline_path(edge, frame)
            );
        }
        Mark::Area { outline, .. } => {
            let edge = outline_path(outline.iter(), frame);
            let _ = write!(out, "<path class=\"{class}\" d=\"{edge}Z\"/>");
        }
        Mark::Bars { bars, .. } => {
            let zero = frame.y(0.0_f64.clamp(frame.lo.y, frame.hi.y));
            let _ = write!(out, "<g class=\"{class}\">");
            for bar in bars.iter().filter(|b| b.value.is_finite()) {
                let (a, b) = (frame.x(bar.from), frame.x(bar.to));
                let y = frame.y(bar.value);
                let _ = write!(
                    out,
                    "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"><title>{} to {}: {} {}</title></rect>",
                    a + 0.5,
                    y.min(zero),
                    (b - a - 1.0).max(0.5),
                    (y - zero).abs(),
                    significant(bar.from, 4),
                    significant(bar.to, 4),
                    significant(bar.value, 4),
                    escape(&y_axis.unit),
                );
            }
            out.push_str("</g>");
        }
        Mark::Map(map) => map::cells(out, map, |p| frame.place(p)),
        Mark::Film(film) => {
            for (n, shot) in film.shots.iter().enumerate() {
                let hidden = if n == film.first() {
                    ""
                } else {
                    " style=\"display:none\""
                };
                let label = escape(&shot.label);
                let _ = write!(out, "<g class=\"shot\" data-label=\"{label}\"{hidden}>");
                map::cells(out, &shot.map, |p| frame.place(p));
                out.push_str("</g>");
            }
        }
        Mark::Limit { name, value } => {
            let y = frame.y(*value);
            let _ = write!(
                out,
                "<path class=\"{class}\" d=\"M{:.1} {y:.1}H{:.1}\"><title>{}: {} {}</title></path>",
                frame.left,
                frame.right,
                escape(name),
                significant(*value, 4),
                escape(&y_axis.unit),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec2;

    use super::*;
    use crate::colour::ColourMap;
    use crate::plot::{Aspect, Map, Shot};

    fn line(points: Vec<DVec2>) -> Plot {
        Plot::new("t", Axis::new("x", "mm"), Axis::new("y", "mm")).with(Mark::Line {
            name: "l".to_owned(),
            points,
        })
    }

    #[test]
    fn a_long_line_stays_small_and_keeps_its_peak() {
        let mut points: Vec<DVec2> = (0..1_000_000)
            .map(|i| DVec2::new(f64::from(i), (f64::from(i) * 0.01).sin()))
            .collect();
        points[500_001].y = 9.0;
        let plot = line(points);
        let text = svg(&plot);
        assert!(text.len() < 100_000, "{} bytes", text.len());
        let frame = Frame::of(&plot);
        let peak = format!(" {:.1}", frame.y(9.0));
        assert!(text.contains(&peak), "the peak at y = {peak} is drawn");
    }

    #[test]
    fn a_film_shows_one_picture_and_has_a_slider() {
        let shot = |n: u32| Shot {
            label: format!("{n} ms <"),
            map: Map {
                name: "temperature".to_owned(),
                unit: "°C".to_owned(),
                corners: [DVec2::ZERO, DVec2::new(2.0, 1.0)],
                columns: 2,
                values: vec![0.0, f64::from(n)],
                range: Some([0.0, 3.0]),
                colours: ColourMap::Sequential,
            },
        };
        let film = Film {
            name: "time".to_owned(),
            shots: (0..3).map(shot).collect(),
        };
        let plot =
            Plot::new("t", Axis::new("x", "mm"), Axis::new("z", "mm")).with(Mark::Film(film));
        let html = figure(&plot);
        assert_eq!(html.matches("class=\"shot\"").count(), 3);
        assert_eq!(html.matches("display:none").count(), 2);
        assert!(html.contains("max=\"2\" value=\"1\"") && html.contains("1 ms &lt;</output>"));
        assert_eq!(html.matches("temperature 0 <").count(), 1);
    }

    #[test]
    fn values_that_are_not_finite_leave_gaps_and_nothing_is_drawn_of_them() {
        let gap = DVec2::new(1.0, f64::NAN);
        let plot = line(vec![
            DVec2::ZERO,
            DVec2::new(0.5, 1.0),
            gap,
            DVec2::new(2.0, 1.0),
            DVec2::new(3.0, 0.0),
        ]);
        let text = svg(&plot);
        assert!(!text.contains("NaN") && !text.contains("inf"));
        assert_eq!(
            line_path(&[DVec2::ZERO, gap, DVec2::ONE], &Frame::of(&plot))
                .matches('M')
                .count(),
            2
        );
    }

    #[test]
    fn empty_and_constant_plots_still_have_axes() {
        for points in [
            vec![],
            vec![DVec2::ONE; 3],
            vec![DVec2::splat(1e300), DVec2::splat(-1e300)],
        ] {
            let text = svg(&line(points));
            assert!(text.contains("class=\"grid\""));
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
    }

    #[test]
    fn a_logarithmic_axis_gives_decades_equal_lengths_and_leaves_out_what_has_no_logarithm() {
        let mut plot = line(vec![
            DVec2::new(-1.0, 1.0),
            DVec2::new(0.0, 1.0),
            DVec2::new(1.0, 1.0),
            DVec2::new(100.0, 2.0),
            DVec2::new(1e4, 1.0),
        ]);
        plot.x = Axis::logarithmic("frequency", "Hz");
        let text = svg(&plot);
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        for label in [">1<", ">10<", ">100<", ">1000<", ">10000<"] {
            assert!(text.contains(label), "{label} in {text}");
        }
        let f = Frame::of(&straightened(&plot));
        assert!((f.x(2.0) - f.x(0.0) - (f.x(4.0) - f.x(2.0))).abs() < 1e-9);
        plot.x = plot.x.between(10.0, 20.0);
        assert!(svg(&plot).contains(">10<"));
    }

    #[test]
    fn equal_aspect_gives_both_axes_one_scale() {
        let mut plot = line(vec![DVec2::ZERO, DVec2::new(150.0, 30.0)]);
        plot.aspect = Aspect::Equal;
        let f = Frame::of(&plot);
        let scale = DVec2::new(f.x(1.0) - f.x(0.0), f.y(0.0) - f.y(1.0));
        assert!((scale.x - scale.y).abs() < 1e-9);
        assert!(f.x(150.0) <= f.right + 1e-9 && f.y(30.0) >= f.top - 1e-9);
    }

    #[test]
    fn a_small_plot_keeps_its_drawing() {
        let plot = Plot::new(
            "Height <after> each layer",
            Axis::new("layer", ""),
            Axis::new("height", "mm"),
        )
        .with(Mark::Band {
            name: "± 1 standard uncertainty".to_owned(),
            lower: vec![DVec2::new(1.0, 1.5), DVec2::new(3.0, 4.5)],
            upper: vec![DVec2::new(1.0, 1.8), DVec2::new(3.0, 5.4)],
        })
        .with(Mark::Line {
            name: "predicted".to_owned(),
            points: vec![DVec2::new(1.0, 1.65), DVec2::new(3.0, 4.95)],
        })
        .with(Mark::Limit {
            name: "asked".to_owned(),
            value: 4.0,
        })
        .with(Mark::Bars {
            name: "per layer".to_owned(),
            bars: vec![crate::plot::Bar {
                from: 1.0,
                to: 2.0,
                value: 1.65,
            }],
        })
        .caption("Grows by 1.65 mm a layer.");
        insta::assert_snapshot!(figure(&plot).replace("><", ">\n<"));
    }
}
