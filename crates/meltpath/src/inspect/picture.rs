//! The reach of a robot as a picture: where the wire's tip comes straight down, in the upright plane through the first axis and at the height of the
//! table, by how far the joints are from their limits. Track and positioner stand at zero.

use std::f64::consts::TAU;

use meltpath_base::number::significant;
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_report::picture::{Image, text};
use meltpath_robot::cell::{Arrangement, Cell, Values};
use meltpath_robot::kinematics::Geometry;
use rayon::prelude::*;

/// Pixels of a view, of the room about it, and of the head.
const VIEW: usize = 540;
const ROOM: usize = 50;
const HEAD: usize = 76;
/// From one line of the grid to the next, mm.
const GRID: f64 = 500.0;

const PAPER: [u8; 3] = [255, 255, 255];
const SKY: [u8; 3] = [240, 243, 246];
const INK: [u8; 3] = [30, 36, 44];
const LINES: [u8; 3] = [206, 213, 220];
const ARM: [u8; 3] = [228, 120, 30];
const TABLE: [u8; 3] = [90, 100, 112];
/// From which distance of the nearest joint to its limit on, deg, a place has which colour.
const MARGINS: [(f64, [u8; 3], &str); 3] = [
    (15.0, [86, 150, 110], "15 deg and more to the nearest limit"),
    (5.0, [140, 190, 150], "5 to 15 deg"),
    (0.0, [222, 206, 130], "less than 5 deg"),
];

/// What a view shows: the two directions across and up, and the place in its middle.
struct View {
    across: DVec3,
    up: DVec3,
    middle: DVec3,
    title: String,
}

/// The reach of a cell.
pub(super) fn reach(cell: &Cell) -> Image {
    let frames = cell.frames(&Values::default());
    let reach = cell.arm.reach();
    let joints = cell.arm.chain.frames(&cell.arm.joints([0.0; 6]));
    let wrist = joints.get(4).copied().unwrap_or(Pose::IDENTITY);
    let wrist = frames.base.then(wrist).position;
    let end = match cell.arrangement {
        Arrangement::TorchOnRobot => frames.wire_tip,
        Arrangement::PartOnRobot => frames.flange,
    };
    let half = 1.05 * (reach.out[1] + end.position.distance(wrist)).max(1.0);
    let base = frames.base.position;
    let views = [
        View {
            across: DVec3::X,
            up: DVec3::Z,
            middle: base + DVec3::Z * 0.5 * (reach.up[0] + reach.up[1]),
            title: format!("from the side, y = {} mm", shown(base.y)),
        },
        View {
            across: DVec3::X,
            up: DVec3::Y,
            middle: base.with_z(frames.table.position.z),
            title: format!(
                "from above, z = {} mm, the table's",
                shown(frames.table.position.z)
            ),
        },
    ];
    let width = 2 * VIEW + 3 * ROOM;
    let mut image = Image::new([width, HEAD + VIEW + 2 * ROOM], PAPER);
    let what = match cell.arrangement {
        Arrangement::TorchOnRobot => "where the wire's tip comes straight down",
        Arrangement::PartOnRobot => "where the flange comes looking straight down",
    };
    let title = format!("{}: {what}, mm", cell.name);
    text::write(&mut image, &title, [ROOM, 16], 2, INK);
    let mut at = ROOM;
    for (_, colour, words) in MARGINS {
        fill(&mut image, [at, 50], [14, 14], colour);
        text::write(&mut image, words, [at + 22, 53], 1, INK);
        at += 60 + text::width(words, 1);
    }
    for (number, view) in views.iter().enumerate() {
        let corner = [ROOM + number * (VIEW + ROOM), HEAD + ROOM];
        draw(&mut image, cell, view, (corner, half));
    }
    image
}

fn shown(value: f64) -> String {
    significant((value * 10.0).round() / 10.0 + 0.0, 6)
}

fn fill(image: &mut Image, [x, y]: [usize; 2], [width, height]: [usize; 2], colour: [u8; 3]) {
    for row in y..y + height {
        for column in x..x + width {
            image.set([column, row], colour);
        }
    }
}

/// Draws a view of `half` mm to each side of its middle.
fn draw(image: &mut Image, cell: &Cell, view: &View, (corner, half): ([usize; 2], f64)) {
    // a search takes long: fewer places are asked for
    let (step, turns) = match cell.arm.geometry {
        Geometry::Other => (18, 4),
        Geometry::SphericalWrist(_) | Geometry::OffsetWrist(_) => (4, 12),
    };
    let scale = 2.0 * half / VIEW as f64;
    let cells = VIEW / step;
    let place = |pixel: [f64; 2]| {
        let across = pixel[0] * scale - half;
        let up = half - pixel[1] * scale;
        view.middle + view.across * across + view.up * up
    };
    fill(image, corner, [VIEW, VIEW], SKY);
    let margins: Vec<Option<f64>> = (0..cells * cells)
        .into_par_iter()
        .map(|n| {
            let [x, y] = [n % cells, n / cells].map(|i| (i * step) as f64 + 0.5 * step as f64);
            margin(cell, place([x, y]), turns)
        })
        .collect();
    for (n, margin) in margins.iter().enumerate() {
        let colour = margin.and_then(|m| MARGINS.iter().find(|(from, ..)| m >= *from));
        if let Some((_, colour, _)) = colour {
            let at = [corner[0] + n % cells * step, corner[1] + n / cells * step];
            fill(image, at, [step, step], *colour);
        }
    }
    let pixel = |point: DVec3| {
        let off = point - view.middle;
        [
            corner[0] as f64 + (off.dot(view.across) + half) / scale,
            corner[1] as f64 + (half - off.dot(view.up)) / scale,
        ]
    };
    grid(image, view, (corner, half), &pixel);
    let within = |[x, y]: [f64; 2]| {
        let inside = |v: f64, from: usize| v >= from as f64 && v < (from + VIEW) as f64;
        inside(x, corner[0]) && inside(y, corner[1])
    };
    let mut line = |from: DVec3, to: DVec3, colour| {
        let [a, b] = [from, to].map(pixel);
        let steps = (a[0] - b[0]).hypot(a[1] - b[1]).ceil().max(1.0);
        for i in 0..=steps as u32 {
            let share = f64::from(i) / steps;
            let at = [0, 1].map(|k| a[k] + (b[k] - a[k]) * share);
            if within(at) {
                fill(image, at.map(|v| v as usize), [3, 3], colour);
            }
        }
    };
    let frames = cell.frames(&Values::default());
    if let Some(table) = cell.shapes.as_ref().and_then(|s| s.table) {
        let [x, y] = table.size.map(|v| 0.5 * v);
        let at = |x: f64, y: f64| {
            frames.table.position + frames.table.orientation * DVec3::new(x, y, 0.0)
        };
        let corners = [at(-x, -y), at(x, -y), at(x, y), at(-x, y), at(-x, -y)];
        for pair in corners.windows(2) {
            line(pair[0], pair[1], TABLE);
        }
    }
    // the arm with all joints at zero
    let joints = cell.arm.chain.frames(&cell.arm.joints([0.0; 6]));
    let mut links = vec![frames.base.position];
    links.extend(joints.iter().map(|f| frames.base.then(*f).position));
    links.push(frames.flange.position);
    if cell.arrangement == Arrangement::TorchOnRobot {
        links.push(frames.wire_tip.position);
    }
    for pair in links.windows(2) {
        line(pair[0], pair[1], ARM);
    }
}

/// Lines of whole half metres with their numbers, and the title.
fn grid(
    image: &mut Image,
    view: &View,
    (corner, half): ([usize; 2], f64),
    pixel: &impl Fn(DVec3) -> [f64; 2],
) {
    text::write(image, &view.title, [corner[0], corner[1] - 22], 1, INK);
    for axis in [view.across, view.up] {
        let middle = view.middle.dot(axis);
        let first = ((middle - half) / GRID).ceil() as i32;
        let last = ((middle + half) / GRID).floor() as i32;
        for number in first..=last {
            let value = f64::from(number) * GRID;
            let on = view.middle + axis * (value - middle);
            let [x, y] = pixel(on).map(|v| v as usize);
            let words = shown(value);
            if axis == view.across {
                fill(image, [x, corner[1]], [1, VIEW], LINES);
                let half_width = text::width(&words, 1) / 2;
                text::write(
                    image,
                    &words,
                    [x.saturating_sub(half_width), corner[1] + VIEW + 6],
                    1,
                    INK,
                );
            } else {
                fill(image, [corner[0], y], [VIEW, 1], LINES);
                let left = corner[0].saturating_sub(text::width(&words, 1) + 4);
                text::write(image, &words, [left, y.saturating_sub(4)], 1, INK);
            }
        }
    }
}

/// How far the nearest joint is from its limit, deg, where the arm comes to a place of the world at its best; nothing where it does not.
fn margin(cell: &Cell, place: DVec3, turns: u32) -> Option<f64> {
    let frames = cell.frames(&Values::default());
    let flange_from_end = match cell.arrangement {
        Arrangement::TorchOnRobot => frames.flange.inverse().then(frames.wire_tip),
        Arrangement::PartOnRobot => Pose::IDENTITY,
    };
    let down = DQuat::from_rotation_x(0.5 * TAU);
    let best = (0..turns).filter_map(|turn| {
        let about = DQuat::from_rotation_z(TAU * f64::from(turn) / f64::from(turns));
        let end = Pose {
            position: place,
            orientation: about * down,
        };
        let flange = frames
            .base
            .inverse()
            .then(end)
            .then(flange_from_end.inverse());
        let ways = cell.arm.inverse(flange).ok()?;
        let margins = ways.solutions.iter().map(|s| cell.arm.margin(s.angles).0);
        margins.reduce(f64::max)
    });
    let best = best.reduce(f64::max)?.to_degrees();
    (best >= 0.0).then_some(best)
}

#[cfg(test)]
mod tests {
    use meltpath_data::{find, robots};
    use meltpath_robot::cell;

    use super::*;

    /// What is drawn as reached is held by the arm's own chain, and what lies beyond its lengths is not.
    #[test]
    fn places_are_told_as_the_arm_reaches_them() {
        for name in ["fanuc-arcmate-120ic", "universal-ur10e"] {
            let cell = cell::read(find(robots::ALL, name).unwrap().text).unwrap();
            let table = cell.frames(&Values::default()).table.position;
            assert!(margin(&cell, table, 12).is_some(), "{name}");
            assert!(margin(&cell, DVec3::new(5000.0, 0.0, 500.0), 12).is_none());
            let image = reach(&cell);
            let all = image.rows().flatten();
            let reached = all
                .filter(|p| MARGINS.iter().any(|(_, c, _)| c == *p))
                .count();
            assert!(reached > 5000, "{name}: {reached}");
        }
    }
}
