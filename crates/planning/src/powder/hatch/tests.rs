//! What is filled, by every pattern.

use meltpath_toolpath::{Move, Pass};

use super::*;

fn rectangle([width, height]: [f64; 2]) -> Region {
    let (x, y) = (0.5 * width, 0.5 * height);
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
    Region {
        outer: corners.map(DVec2::from_array).to_vec(),
        holes: Vec::new(),
    }
}

fn moved(mut region: Region, by: [f64; 2]) -> Region {
    for p in &mut region.outer {
        *p += DVec2::from_array(by);
    }
    region
}

/// Lines of the thesis: 300 W, 980 mm/s, 0.125 mm, layers of 50 µm, crossed.
fn hatch(pattern: Pattern) -> Hatch {
    Hatch {
        pattern,
        turns: Turns::Joined,
        spacing: 0.125,
        angles: [0.0, std::f64::consts::FRAC_PI_2],
        contours: 0,
        overrun: 0.0,
        island: 2.0,
        speed: 980.0,
        dwell: 0.125 / 980.0,
        power: 300.0,
        spot: 0.4,
        layer: 0.05,
        chord_error: 2e-3,
        modulation: None,
    }
}

fn modulated(pattern: Pattern, below: Option<Vec<Region>>) -> Hatch {
    let hatch = hatch(pattern);
    let law = Modulation {
        nominal: hatch.energy(),
        ..Modulation::STARTING
    };
    Hatch {
        modulation: Some(Modulated { law, below }),
        ..hatch
    }
}

fn drawn(hatch: &Hatch, regions: &[Region], number: u32) -> Toolpath {
    hatch.toolpath(regions, number, &Reporter::new()).unwrap()
}

fn energy(toolpath: &Toolpath) -> f64 {
    let profile = &toolpath.profiles[0];
    let of_pass = |pass: Pass<'_>| -> f64 {
        let time = |i: usize| match pass.move_at(i) {
            Move::Spot { time } => time,
            _ => pass.move_length(i) / pass.value(Channel::Speed, i).unwrap_or(profile.speed),
        };
        (0..pass.move_count()).map(time).sum::<f64>() * profile.power
    };
    toolpath.passes().map(of_pass).sum()
}

/// A plate that hangs over powder on its right: whatever the pattern, the energy is what the law asks for.
#[test]
fn every_pattern_follows_the_modulation() {
    let region = rectangle([6.0, 4.0]);
    let foot = moved(rectangle([4.0, 6.0]), [-2.0, 0.0]);
    // mean of F over a width of 6 and of 4 mm, half of it over powder
    let across = |w: f64| (w - 2.0 + 2.0 * 0.9) / w;
    let wanted = 48.98 * across(6.0) * across(4.0) * 0.5 * (1.0 + 0.6);
    for pattern in [
        Pattern::Modulated,
        Pattern::Lines,
        Pattern::OneWay,
        Pattern::Contours,
        Pattern::Spots,
    ] {
        let hatch = modulated(pattern, Some(vec![foot.clone()]));
        let toolpath = drawn(&hatch, std::slice::from_ref(&region), 1);
        let found = energy(&toolpath) / (region.area() * 0.05);
        assert!(
            (found / wanted - 1.0).abs() < 0.05,
            "{pattern:?}: {found} {wanted}"
        );
    }
}

/// A frame by a laser: contours first, then lines one against the other, each alone, all inside; what the contours take the
/// lines leave, whatever their angle.
#[test]
fn lines_apart_begin_anew_inside_their_contours() {
    let mut region = rectangle([9.0, 7.0]);
    let mut hole = rectangle([4.0, 3.0]).outer;
    hole.reverse();
    region.holes.push(hole);
    for (pattern, contours, angle) in [
        (Pattern::Lines, 2, 0.7),
        (Pattern::OneWay, 1, 0.0),
        (Pattern::Lines, 0, 0.3),
    ] {
        let hatch = Hatch {
            turns: Turns::Apart,
            contours,
            angles: [angle, 0.0],
            ..hatch(pattern)
        };
        let path = drawn(&hatch, std::slice::from_ref(&region), 1);
        let rings = path
            .passes()
            .take_while(meltpath_toolpath::Pass::is_closed)
            .count();
        assert_eq!(rings, 2 * contours as usize);
        let lines: Vec<Pass<'_>> = path.passes().skip(rings).collect();
        assert!(lines.iter().all(|p| p.move_count() == 1));
        let way = DVec2::from_angle(angle);
        let forth = |p: &Pass<'_>| (p.points[1] - p.points[0]).truncate().dot(way) > 0.0;
        let turned = lines.windows(2).filter(|w| forth(&w[0]) != forth(&w[1]));
        let turned = turned.count();
        assert_eq!(turned == 0, pattern == Pattern::OneWay, "{turned}");
        for p in path.passes().flat_map(|p| p.points.to_vec()) {
            assert!(region.contains(p.truncate()), "{p}");
        }
        // lines without contours end half a spacing before the boundary
        let rim = 2.0 * (9.0 + 7.0 + 4.0 + 3.0);
        let bare = if contours == 0 {
            0.5 * hatch.spacing * rim
        } else {
            0.0
        };
        let covered = (path.deposited_length() * hatch.spacing + bare) / region.area();
        assert!((covered - 1.0).abs() < 0.02, "{pattern:?} {covered}");
    }
}

/// A wall narrower than the spacing: one line along its middle, contours or not.
#[test]
fn a_wall_narrower_than_the_spacing_gets_one_line() {
    for contours in [0, 2] {
        let hatch = Hatch {
            turns: Turns::Apart,
            contours,
            ..hatch(Pattern::Lines)
        };
        let path = drawn(&hatch, &[rectangle([6.0, 0.08])], 1);
        assert_eq!(path.pass_count(), 1);
        assert!((path.deposited_length() - 5.9).abs() < 0.1);
    }
}

/// Passes lie farther apart near powder, and the path is shorter than at constant spacing.
#[test]
fn ebm_q10_the_modulated_path_is_shorter() {
    let region = [rectangle([8.0, 6.0])];
    let length = |h: &Hatch| drawn(h, &region, 1).deposited_length();
    let some = length(&modulated(Pattern::Modulated, None));
    let all = length(&hatch(Pattern::Contours));
    assert!(some < 0.97 * all, "{some} {all}");
}

/// A frame with a hole: every pattern brings the thesis' energy per volume to it and stays inside.
#[test]
fn every_pattern_fills_a_region_with_a_hole() {
    let mut region = rectangle([9.0, 7.0]);
    let mut hole = rectangle([4.0, 3.0]).outer;
    hole.reverse();
    region.holes.push(hole);
    // a thousandth of a millimetre more on all sides
    let room = outset(std::slice::from_ref(&region), 1e-3, CORNERS).unwrap();
    for pattern in [
        Pattern::Lines,
        Pattern::OneWay,
        Pattern::Contours,
        Pattern::Spiral,
        Pattern::Islands,
        Pattern::Spots,
    ] {
        for layer in 1..=2 {
            let toolpath = drawn(&hatch(pattern), std::slice::from_ref(&region), layer);
            let density = energy(&toolpath) / (region.area() * 0.05);
            // lines of islands end half a spacing before each border
            assert!(
                (density / 48.98 - 1.0).abs() < 0.08,
                "{pattern:?}, layer {layer}: {density} J/mm³"
            );
            for p in toolpath.passes().flat_map(|p| p.points) {
                let inside = room.iter().any(|r| r.contains(p.truncate()));
                assert!(inside, "{pattern:?} {p:?}");
            }
        }
    }
}

#[test]
fn spots_lie_apart_in_time() {
    let toolpath = drawn(&hatch(Pattern::Spots), &[rectangle([4.0, 4.0])], 1);
    let points = &toolpath.layers[0].pass(0).points[1..];
    assert_eq!(points.len(), 32 * 32);
    let near = points
        .windows(2)
        .filter(|w| w[0].distance(w[1]) < 0.4)
        .count();
    assert_eq!(near, 0);
}

#[test]
fn areas_are_drawn_one_after_the_other_and_slivers_left_out() {
    let square = |x: f64| moved(rectangle([2.0, 2.0]), [x + 1.0, 1.0]);
    let sliver = moved(rectangle([5.0, 0.01]), [11.5, 0.0]);
    let regions = [square(5.0), sliver.clone(), square(0.0)];
    let hatch = hatch(Pattern::OneWay);
    let reporter = Reporter::new();
    let toolpath = hatch.toolpath(&regions, 3, &reporter).unwrap();
    let points = toolpath.passes().flat_map(|p| p.points);
    let right: Vec<bool> = points.map(|p| p.x > 4.0).collect();
    assert!(right[0] && !right[right.len() - 1]);
    assert_eq!(right.windows(2).filter(|w| w[0] != w[1]).count(), 1);
    let told = reporter.warnings();
    let left_out = told.iter().filter(|w| w.code == "area-not-drawn");
    let words: Vec<&str> = left_out.map(|w| w.message.as_str()).collect();
    assert!(
        words.len() == 1 && words[0].starts_with("layer 3: 1 of its 3 areas"),
        "{told:?}"
    );
    let none = hatch.toolpath(&[sliver.clone(), sliver], 3, &reporter);
    assert!(matches!(none, Err(HatchError::Nothing { .. })));
}

#[test]
fn what_cannot_be_filled_is_refused() {
    let refused = |pattern: Pattern, size: [f64; 2]| {
        let refused = hatch(pattern).toolpath(&[rectangle(size)], 1, &Reporter::new());
        refused.unwrap_err().to_string()
    };
    let narrow = refused(Pattern::OneWay, [5.0, 0.01]);
    assert!(narrow.starts_with("no line fits"), "{narrow}");
    let wide = refused(Pattern::Spots, [5000.0, 5000.0]);
    assert!(wide.starts_with("spots of 0.125 mm"), "{wide}");
    let near = Hatch {
        spacing: 1e-6,
        ..hatch(Pattern::Lines)
    };
    let near = near.toolpath(&[rectangle([4.0, 2.0])], 1, &Reporter::new());
    let near = near.unwrap_err().to_string();
    assert!(
        near.starts_with("the distance between lines is 0.000001 mm"),
        "{near}"
    );
}

#[test]
fn layers_turn_from_the_first_angle_by_the_second() {
    let hatch = Hatch {
        angles: [0.3, 0.5],
        ..hatch(Pattern::Lines)
    };
    // of many turns the whole ones say nothing
    let far = (0.3 + 0.5 * 15_999.0_f64).rem_euclid(std::f64::consts::PI);
    for (number, angle) in [(1, 0.3), (2, 0.8), (4, 1.8), (16_000, far)] {
        let layer = hatch
            .passes(&rectangle([4.0, 3.0]), number, &Reporter::new())
            .unwrap();
        let along = layer.passes().map(|p| {
            let way = p.points[1] - p.points[0];
            way.truncate().to_angle().rem_euclid(std::f64::consts::PI)
        });
        for found in along.collect::<Vec<_>>() {
            assert!((found - angle).abs() < 1e-6, "{number}: {found}");
        }
    }
}

/// A side of a whole number of spacings has that many lines, wherever the part lies and however it is turned.
#[test]
fn whole_spacings_have_all_their_lines() {
    for (size, spacing) in [
        ([6.0, 4.0], 0.125),
        ([6.0, 4.0], 0.1),
        ([3.0, 2.0], 0.1),
        ([1.0, 1.0], 0.5),
    ] {
        for turned in [0.0, 90.0_f64] {
            for at in [DVec2::ZERO, DVec2::new(-17.31, 4.07)] {
                let mut region = rectangle(size);
                for p in &mut region.outer {
                    *p += at;
                }
                let hatch = Hatch {
                    turns: Turns::Apart,
                    spacing,
                    angles: [turned.to_radians(), 0.0],
                    ..hatch(Pattern::OneWay)
                };
                let across = if turned == 0.0 { size[1] } else { size[0] };
                let lines = drawn(&hatch, &[region], 1).pass_count();
                assert_eq!(
                    lines,
                    (across / spacing).round() as usize,
                    "{size:?} {spacing} {turned}"
                );
            }
        }
    }
}
