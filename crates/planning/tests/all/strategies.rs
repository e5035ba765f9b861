//! Every strategy on a zoo of shapes: soundness, coverage, speeds, orders, starts, threads, bad input.

use super::*;

fn zoo() -> Vec<(&'static str, Vec<Region>)> {
    let comb: Vec<DVec2> = (0..6)
        .flat_map(|i| {
            let x = 20.0 * f64::from(i);
            [(x, 0.0), (x, 40.0), (x + 10.0, 40.0), (x + 10.0, 0.0)]
        })
        .chain([(110.0, -12.0), (0.0, -12.0)])
        .map(DVec2::from)
        .rev()
        .collect();
    vec![
        ("plate", vec![outlines::plate(100.0, 40.0)]),
        ("disc", vec![disc(25.0)]),
        ("ring", vec![outlines::ring(50.0, 30.0, 180)]),
        ("cross", vec![outlines::cross(90.0, 24.0)]),
        ("tee", vec![outlines::tee(96.0, 74.0, 24.0)]),
        ("ell", vec![outlines::ell(90.0, 60.0, 18.0)]),
        ("star", vec![outlines::star(5, 60.0, 26.0)]),
        ("gear", vec![outlines::gear(12, 40.0, 52.0, 14.0)]),
        ("honeycomb", vec![outlines::honeycomb(5, 4, 9.0, 6.8)]),
        ("spiral", vec![outlines::spiral(15.0, 14.0, 6.6, 3.0)]),
        ("truss", vec![outlines::truss(4, 30.0, 6.8)]),
        ("islands", outlines::islands(3, 2, 20.0, 9.0)),
        ("comb", vec![solid(comb)]),
        (
            "random star",
            vec![outlines::random_star(3, 14, 25.0, 60.0)],
        ),
    ]
}

#[test]
fn every_strategy_is_sound_on_every_shape() {
    for (name, regions) in zoo() {
        for strategy in ALL {
            for layer in [1, 2] {
                let plan = plan_on(layer, &regions, &settings(strategy));
                let what = format!("{name}, {strategy:?}, layer {layer}");
                assert!(!plan.path.is_empty(), "{what}");
                assert_sound(&plan, &regions, &what);
            }
        }
    }
}

#[test]
fn simple_shapes_are_covered() {
    let shapes = [
        ("plate", outlines::plate(100.0, 40.0)),
        ("tee", outlines::tee(96.0, 74.0, 24.0)),
        ("ell", outlines::ell(90.0, 60.0, 22.0)),
    ];
    for (name, region) in shapes {
        for strategy in [ZIGZAG, CONTOUR, INSIDE_OUT, SPIRAL, HYBRID] {
            let share = covered(&plan(std::slice::from_ref(&region), strategy));
            assert!(share > 0.99, "{name}, {strategy:?}: {share}");
        }
    }
    for region in [disc(25.0), outlines::ring(50.0, 30.0, 180)] {
        for strategy in [CONTOUR, SPIRAL, HYBRID] {
            let share = covered(&plan(std::slice::from_ref(&region), strategy));
            assert!(share > 0.99, "round, {strategy:?}: {share}");
        }
    }
}

/// Round plates, one with a hole, a rectangle with a round hole and an L.
fn rimmed_shapes() -> Vec<(&'static str, Vec<Region>)> {
    let hole = Region {
        outer: disc(20.0)
            .outer
            .iter()
            .map(|p| *p + DVec2::new(50.0, 40.0))
            .collect(),
        holes: Vec::new(),
    };
    vec![
        ("disc of 50", vec![disc(25.0)]),
        ("disc of 120", vec![disc(60.0)]),
        ("flange", vec![outlines::ring(82.0, 28.0, 240)]),
        (
            "plate with a hole",
            difference(&[outlines::plate(120.0, 80.0)], &[hole]).unwrap(),
        ),
        ("ell", vec![outlines::ell(90.0, 60.0, 30.0)]),
    ]
}

#[test]
fn rims_are_covered_by_lines_too() {
    for (name, regions) in rimmed_shapes() {
        for strategy in [HYBRID, ZIGZAG, RASTER] {
            for layer in [1, 2] {
                let plan = plan_on(layer, &regions, &settings(strategy));
                let what = format!("{name}, {strategy:?}, layer {layer}");
                assert!(covered(&plan) > 0.99, "{what}: {}", covered(&plan));
                assert_sound(&plan, &regions, &what);
            }
        }
    }
}

/// The speeds of a pass that says one for every move.
fn speeds<'a>(pass: &'a Pass<'_>) -> impl Iterator<Item = f64> + 'a {
    (0..pass.move_count()).map(|i| pass.value(Channel::Speed, i).unwrap())
}

/// Metal on every place farther than a width from the boundary, as laid within a width of it at the pass' speeds, over
/// the mean of all such places.
fn metal_inside(regions: &[Region], plan: &LayerPlan) -> Vec<f64> {
    const CELL: f64 = 1.0;
    let mut laid = std::collections::HashMap::<(i64, i64), f64>::new();
    for pass in plan.path.passes() {
        for i in 0..pass.move_count() {
            let speed = pass.value(Channel::Speed, i).unwrap_or(12.5);
            let arc = pass.arc(i);
            let n = (pass.move_length(i) / 0.3).ceil().max(1.0) as usize;
            for k in 0..n {
                let t = (k as f64 + 0.5) / n as f64;
                let p = arc.map_or_else(
                    || pass.points[i].lerp(pass.points[i + 1], t),
                    |arc| arc.at(t),
                ) / CELL;
                *laid
                    .entry((p.x.floor() as i64, p.y.floor() as i64))
                    .or_default() += pass.move_length(i) / n as f64 / speed;
            }
        }
    }
    let reach = (WIDTH / CELL).ceil() as i64;
    let mut metal = Vec::new();
    for x in -90..130_i64 {
        for y in -90..100_i64 {
            let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * CELL;
            if regions.iter().any(|r| clearance(r, p) > WIDTH) {
                let near = (-reach..=reach)
                    .flat_map(|i| (-reach..=reach).map(move |j| (i, j)))
                    .filter(|(i, j)| ((i * i + j * j) as f64) * CELL * CELL <= WIDTH * WIDTH);
                metal.push(
                    near.filter_map(|(i, j)| laid.get(&(x + i, y + j)))
                        .sum::<f64>(),
                );
            }
        }
    }
    let mean = metal.iter().sum::<f64>() / metal.len() as f64;
    metal.iter().map(|m| m / mean).collect()
}

#[test]
fn speeds_even_the_metal_out() {
    for (name, regions) in rimmed_shapes() {
        for strategy in [HYBRID, ZIGZAG, RASTER, CONTOUR, SPIRAL] {
            let spread = |paces| {
                let s = FillSettings {
                    paces,
                    ..settings(strategy)
                };
                let plan = plan_on(1, &regions, &s);
                assert_sound(&plan, &regions, name);
                let metal = metal_inside(&regions, &plan);
                let off = metal.iter().filter(|m| (*m - 1.0).abs() > 0.25).count();
                off as f64 / metal.len() as f64
            };
            let (one, adapted) = (spread(None), spread(Some(Paces::about(12.5, (0.0, 50.0)))));
            // where turns meet and links run, contours heap metal at one speed; a zigzag's turning points come nearer
            let most = match strategy {
                Fill::Contour { .. } | Fill::Spiral { .. } => 0.005 + 0.4 * one,
                _ => 0.04,
            };
            assert!(adapted < most, "{name}, {strategy:?}: {one} -> {adapted}");
        }
    }
}

#[test]
fn speeds_keep_to_their_range_and_the_mean() {
    for (name, regions) in zoo() {
        let s = FillSettings {
            paces: Some(Paces::about(12.5, (0.0, 50.0))),
            ..settings(CONTOUR)
        };
        let plan = plan_on(1, &regions, &s);
        let (mut long, mut nominal) = (0.0, 0.0);
        for pass in plan.path.passes() {
            if pass.says(Channel::Speed) {
                let speeds: Vec<_> = speeds(&pass).collect();
                assert!(
                    speeds.iter().all(|v| (9.99..=25.01).contains(v)),
                    "{name}: {speeds:?}"
                );
            }
            long += pass.length();
            nominal += nominal_length(&pass, 12.5);
        }
        assert!(
            (nominal / long - 1.0).abs() < 0.1,
            "{name}: {nominal} of {long}"
        );
    }
    // a wall one bead wide has no reason to change its speed but near its ends
    let s = FillSettings {
        paces: Some(Paces::about(12.5, (0.0, 50.0))),
        ..settings(RASTER)
    };
    let wall = plan_on(1, &[outlines::plate(150.0, 7.0)], &s);
    let pass = wall.path.pass(0);
    for (i, speed) in speeds(&pass).enumerate() {
        let (from, to) = (pass.points[i].x, pass.points[i + 1].x);
        if from.min(to) < 120.0 && from.max(to) > 30.0 {
            assert!((speed - 12.5).abs() < 1e-9, "{pass:?}");
        }
    }
    // spacing as given means speed as given
    let s = FillSettings {
        spacing: Spacing::Exact,
        ..s
    };
    let wall = plan_on(1, &[outlines::plate(100.0, 40.0)], &s);
    assert!(wall.path.passes().all(|p| !p.says(Channel::Speed)));
}

#[test]
fn centre_out_begins_in_the_middle() {
    let centre_out = Fill::Raster {
        angle: LineAngle::Best,
        order: LineOrder::CentreOut,
        direction: LineDirection::OneWay,
    };
    for lines in [6.0, 7.0] {
        let wall = [outlines::plate(120.0, lines * STEPOVER + WIDTH)];
        let plan = plan(&wall, centre_out);
        assert_eq!(plan.path.len(), lines as usize + 1);
        let mut all: Vec<f64> = plan.path.passes().map(|p| p.points[0].y).collect();
        let middle = all.iter().sum::<f64>() / all.len() as f64;
        let away: Vec<f64> = all.iter().map(|y| (y - middle).abs()).collect();
        assert!(away.windows(2).all(|a| a[1] > a[0] - 1e-6), "{away:?}");
        let sides: Vec<bool> = all.iter().map(|y| *y > middle + 1e-6).collect();
        assert!(
            sides[1..].windows(2).all(|s| s[0] != s[1]),
            "sides in turn: {all:?}"
        );
        all.sort_by(f64::total_cmp);
        all.dedup();
        assert_eq!(all.len(), plan.path.len());
    }
}

#[test]
fn starts_move_from_layer_to_layer_or_stay() {
    let ring = [outlines::ring(50.0, 30.0, 180)];
    let starts = |starts: StartPoints| -> Vec<DVec2> {
        let s = FillSettings {
            starts,
            layers: LayerDirection::Same,
            ..settings(CONTOUR)
        };
        (1..=4)
            .map(|layer| plan_on(layer, &ring, &s).path.pass(0).points[0].truncate())
            .collect()
    };
    let aligned = starts(StartPoints::Aligned);
    assert!(aligned.iter().all(|p| p.distance(aligned[0]) < 1e-9));
    for way in [StartPoints::Spread, StartPoints::Random { seed: 5 }] {
        let spread = starts(way);
        assert!(
            spread.windows(2).all(|p| p[0].distance(p[1]) > WIDTH),
            "{spread:?}"
        );
    }
}

/// Where nested contours part at the corner of a bent bar, too little room is left for an arc of its own: the bead beside
/// it goes there and back.
#[test]
fn the_corner_of_a_bent_bar_has_no_hole() {
    for arm in [18.0, 19.0, 20.0, 21.0, 22.0, 24.0] {
        let round = Join::Round {
            arc_tolerance: 0.02,
        };
        let bar = outset(&[outlines::ell(110.0, 80.0, arm)], 2.0, round).unwrap();
        let s = FillSettings {
            paces: Some(Paces::about(12.5, (0.0, 50.0))),
            width: 6.54,
            stepover: 4.82,
            ..settings(HYBRID)
        };
        let plan = plan_on(1, &bar, &s);
        let gaps = plan.coverage.iter().flat_map(|c| &c.gaps);
        // the four outer corners are for the allowance
        let inside =
            gaps.filter(|g| (0.0..100.0).contains(&g.place.x) && (5.0..70.0).contains(&g.place.y));
        let lack: f64 = inside.map(|g| g.area).sum();
        assert!(lack < 0.3, "arms of {arm} mm: {lack} mm²");
    }
}

#[test]
fn spaced_exactly_or_told() {
    // 40 mm are no whole number of stepovers: kept as asked for, or adjusted to fill
    let plate = [outlines::plate(100.0, 40.0)];
    let at = |spacing| -> Vec<f64> {
        let s = FillSettings {
            spacing,
            ..settings(RASTER)
        };
        let mut y: Vec<f64> = plan_on(1, &plate, &s)
            .path
            .passes()
            .map(|p| p.points[0].y)
            .collect();
        y.sort_by(f64::total_cmp);
        y
    };
    let exact = at(Spacing::Exact);
    assert!(
        exact
            .windows(2)
            .all(|p| (p[1] - p[0] - STEPOVER).abs() < 1e-6)
    );
    let filled = at(Spacing::Fill);
    assert!((filled[filled.len() - 1] - filled[0] - (40.0 - WIDTH)).abs() < 1e-2);
}

#[test]
fn regions_too_small_for_a_bead_are_told() {
    let tiny = [outlines::plate(3.0, 2.0), outlines::plate(60.0, 30.0)];
    let reporter = Reporter::new();
    let plane = Plane::horizontal(0.0);
    let layer = FillLayer {
        number: 1,
        plane: &plane,
        regions: &tiny,
    };
    let plan = plan_layer(layer, &settings(HYBRID), PassIds { part: 0 }, &reporter).unwrap();
    assert_eq!(reporter.warnings()[0].code, "region-without-bead");
    assert_eq!(plan.coverage[0].covered_area, 0.0);
    assert!((plan.coverage[0].lack_area - 6.0).abs() < 1e-6);
}

#[test]
fn nothing_to_fill_is_an_empty_plan_and_bad_input_an_error() {
    assert!(plan(&[], HYBRID).path.is_empty());
    assert!(plan(&[Region::default()], HYBRID).path.is_empty());
    let plane = Plane::horizontal(0.0);
    let bad = [solid(vec![
        DVec2::ZERO,
        DVec2::X * 50.0,
        DVec2::new(f64::NAN, 50.0),
    ])];
    let layer = FillLayer {
        number: 7,
        plane: &plane,
        regions: &bad,
    };
    let error = plan_layer(
        layer,
        &settings(HYBRID),
        PassIds { part: 0 },
        &Reporter::new(),
    )
    .unwrap_err();
    assert!(
        matches!(error, PlanError::Outline { layer: 7, .. }),
        "{error}"
    );
    let zero = FillSettings {
        stepover: 0.0,
        ..settings(HYBRID)
    };
    let layer = FillLayer {
        number: 1,
        plane: &plane,
        regions: &[],
    };
    let error = plan_layer(layer, &zero, PassIds { part: 0 }, &Reporter::new()).unwrap_err();
    assert!(error.to_string().contains("stepover"), "{error}");
}

/// The same to rounding, which hangs on the height where there are arcs.
fn assert_alike(plan: &LayerPlan, other: &LayerPlan, what: &str) {
    assert_eq!(plan.path.len(), other.path.len(), "{what}");
    for (a, b) in plan.path.passes().zip(other.path.passes()) {
        assert_eq!((a.layer, a.head), (b.layer, b.head), "{what}");
        assert_eq!(a.points.len(), b.points.len(), "{what}");
        for (i, (p, q)) in a.points.iter().zip(b.points).enumerate() {
            assert!(p.distance(*q) < 1e-9, "{what}: {p} {q}");
            if i > 0 {
                let speed = |pass: &Pass<'_>| pass.value(Channel::Speed, i - 1);
                assert_eq!(speed(&a), speed(&b), "{what}");
            }
        }
        for (m, n) in a.neighbours().zip(b.neighbours()) {
            assert_eq!(
                (m.pass, m.layer, m.side),
                (n.pass, n.layer, n.side),
                "{what}"
            );
            assert!((m.from - n.from).abs() < 1e-9 && (m.distance - n.distance).abs() < 1e-9);
        }
        assert_eq!(a.neighbours().len(), b.neighbours().len(), "{what}");
    }
    for (a, b) in plan.coverage.iter().zip(&other.coverage) {
        assert!((a.lack_area - b.lack_area).abs() < 1e-9, "{what}");
        assert!((a.fill_ratio - b.fill_ratio).abs() < 1e-9, "{what}");
        for (g, h) in a.gaps.iter().zip(&b.gaps) {
            assert!(
                g.place.distance(h.place) < 1e-9 && g.area == h.area,
                "{what}"
            );
        }
    }
}

/// Layers of the same sections share their plans: each must be what it is by itself, in number, names and height too.
#[test]
fn layers_alike_are_planned_as_each_by_itself() {
    for (name, regions) in zoo() {
        for strategy in ALL {
            let settings = FillSettings {
                layers: LayerDirection::Alternate,
                paces: Some(Paces {
                    nominal: 0.0125,
                    slowest: 0.8,
                    fastest: 2.0,
                }),
                ..settings(strategy)
            };
            let planes: Vec<Plane> = (0..5)
                .map(|k| Plane::horizontal(2.3 * f64::from(k)))
                .collect();
            let other = [outlines::plate(50.0, 30.0)];
            let layers: Vec<FillLayer<'_>> = planes
                .iter()
                .zip(1..)
                .map(|(plane, number)| FillLayer {
                    number,
                    plane,
                    regions: if number == 3 { &other } else { &regions },
                })
                .collect();
            let ids = PassIds { part: 2 };
            let together = plan_layers(&layers, &settings, ids, &Reporter::new(), &Silent).unwrap();
            for (layer, plan) in layers.into_iter().zip(together) {
                let alone = plan_layer(layer, &settings, ids, &Reporter::new()).unwrap();
                let what = format!("{name}, {strategy:?}, layer {}", layer.number);
                assert_alike(&plan, &alone, &what);
            }
        }
    }
}

#[test]
fn the_same_plan_on_any_number_of_threads() {
    let plane = Plane::horizontal(0.0);
    let zoo = zoo();
    let layers: Vec<FillLayer<'_>> = zoo
        .iter()
        .zip(1..)
        .map(|((_, regions), number)| FillLayer {
            number,
            plane: &plane,
            regions,
        })
        .collect();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            plan_layers(
                &layers,
                &settings(HYBRID),
                PassIds { part: 1 },
                &Reporter::new(),
                &Silent,
            )
            .unwrap()
        })
    };
    assert_eq!(on(1), on(4));
}
