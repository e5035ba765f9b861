//! Laws that hold on random regions.

use super::*;

fn star(centre: DVec2, radii: &[f64]) -> Ring {
    let n = radii.len() as f64;
    (0..radii.len())
        .map(|i| centre + DVec2::from_angle(std::f64::consts::TAU * i as f64 / n) * radii[i])
        .collect()
}

fn region() -> impl Strategy<Value = Vec<Region>> {
    let outer = prop::collection::vec(15.0..60.0_f64, 4..24);
    let hole = (
        0.0..std::f64::consts::TAU,
        0.0..35.0_f64,
        prop::collection::vec(1.0..10.0_f64, 3..12),
    );
    (outer, prop::collection::vec(hole, 0..4)).prop_map(|(outer, holes)| {
        let cut: Vec<_> = holes
            .iter()
            .map(|(angle, r, radii)| solid(star(DVec2::from_angle(*angle) * *r, radii)))
            .collect();
        difference(&[solid(star(DVec2::ZERO, &outer))], &cut).unwrap()
    })
}

/// Area of the regions under discs of half a bead's width stamped along the passes, on a grid.
fn stamped(regions: &[Region], plan: &LayerPlan) -> (f64, f64) {
    const CELL: f64 = 0.5;
    let points = deposit_points(plan);
    let (mut total, mut under) = (0.0, 0.0);
    let reach = 0.5 * WIDTH;
    let mut cells = std::collections::HashMap::<(i64, i64), Vec<DVec2>>::new();
    let key = |p: DVec2| ((p.x / reach).floor() as i64, (p.y / reach).floor() as i64);
    // stamps closer together than the deposit points: scallops below a hundredth of a width
    for pass in plan.path.passes() {
        let (line, _) = pass.flatten(0.01);
        for s in line.windows(2) {
            let n = (s[0].distance(s[1]) / 0.4).ceil().max(1.0) as usize;
            for i in 0..=n {
                let p = s[0].lerp(s[1], i as f64 / n as f64).truncate();
                cells.entry(key(p)).or_default().push(p);
            }
        }
    }
    assert!(plan.path.is_empty() || !points.is_empty());
    for i in -130..130 {
        for j in -130..130 {
            let p = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) * CELL;
            if regions.iter().any(|r| clearance(r, p) > 0.0) {
                total += CELL * CELL;
                let (x, y) = key(p);
                let near = (-1..=1).flat_map(|a| (-1..=1).map(move |b| (x + a, y + b)));
                if near
                    .filter_map(|k| cells.get(&k))
                    .flatten()
                    .any(|q| q.distance(p) <= reach)
                {
                    under += CELL * CELL;
                }
            }
        }
    }
    (total, under)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn random_regions_are_filled_soundly(regions in region(), which in 0..ALL.len(), layer in 1..9_u32) {
        let plan = plan_on(layer, &regions, &settings(ALL[which]));
        assert_sound(&plan, &regions, &format!("{:?} on layer {layer}", ALL[which]));
    }

    #[test]
    fn islands_of_any_size_are_filled_or_told(
        sizes in prop::collection::vec((0.3..26.0_f64, 3..12_usize, 0.0..0.6_f64), 1..9),
        which in 0..ALL.len() + 1,
        starts in 0..3_usize,
        layer in 1..9_u32,
    ) {
        let regions: Vec<Region> = sizes
            .iter()
            .enumerate()
            .flat_map(|(i, &(size, n, hole))| {
                let at = DVec2::new(i as f64 % 3.0 - 1.0, (i / 3) as f64 - 1.0) * 60.0;
                let whole = solid(star(at, &vec![size; n]));
                difference(&[whole], &[solid(star(at, &[hole * size; 9]))]).unwrap()
            })
            .collect();
        let centre_out = Fill::Raster {
            angle: LineAngle::Turning { first: 0.3, step: 1.1 },
            order: LineOrder::CentreOut,
            direction: LineDirection::AlternatePerBead,
        };
        let s = FillSettings {
            starts: [StartPoints::Aligned, StartPoints::Spread, StartPoints::Random { seed: 7 }][starts],
            paces: Some(Paces::about(12.5, (0.0, 50.0))),
            ..settings(*ALL.get(which).unwrap_or(&centre_out))
        };
        let reporter = Reporter::new();
        let plane = Plane::horizontal(0.0);
        let l = FillLayer { number: layer, plane: &plane, regions: &regions };
        let plan = plan_layer(l, &s, PassIds { part: 0 }, &reporter).unwrap();
        assert_sound(&plan, &regions, &format!("{:?} on layer {layer}", s.strategy));
        // every region is told of: covered, or said to have no bead
        prop_assert_eq!(plan.coverage.len(), regions.len());
        let bare = |c: &&meltpath_planning::Coverage| plan.path.passes().all(|p| p.head.entity != c.region);
        let without = plan.coverage.iter().filter(bare).count();
        let told = reporter.warnings().iter().filter(|w| w.code == "region-without-bead").count();
        prop_assert_eq!(told, without);
        for c in &plan.coverage {
            prop_assert!(c.area.is_finite() && c.covered_area.is_finite() && c.fill_ratio.is_finite());
        }
        // a region that a bead and its length fit into has one
        for (region, c) in regions.iter().zip(&plan.coverage) {
            if region.holes.is_empty() && region.area() > 12.0 * WIDTH * WIDTH {
                prop_assert!(c.covered_area > 0.5 * c.area, "{c:?}");
            }
        }
        // no link from one region to another: a pass stays in its own
        for pass in plan.path.passes() {
            let own = &regions[pass.head.entity as usize];
            for p in pass.flatten(0.005).0 {
                prop_assert!(clearance(own, p.truncate()) > 0.0, "{p} left its region");
            }
        }
    }

    #[test]
    fn told_coverage_is_what_stamps_cover(regions in region(), which in 0..ALL.len()) {
        let plan = plan(&regions, ALL[which]);
        let told: f64 = plan.coverage.iter().map(|c| c.covered_area).sum();
        let (total, under) = stamped(&regions, &plan);
        prop_assert!((told - under).abs() < 0.02 * total + 10.0, "told {told}, stamped {under} of {total}");
        let area: f64 = plan.coverage.iter().map(|c| c.area).sum();
        let filled: f64 = plan.coverage.iter().map(|c| c.fill_ratio * c.area).sum();
        prop_assert!(filled < 1.8 * area, "bead length times stepover is {filled} for {area} mm²");
    }

    #[test]
    fn neighbours_are_mutual(regions in region()) {
        let plan = plan(&regions, RASTER);
        // what one bead sees on a side over more than two widths sees it too
        for pass in plan.path.passes() {
            for n in pass.neighbours() {
                if n.to - n.from > 2.0 * WIDTH && n.pass != pass.head.id {
                    let other = plan.path.passes().find(|p| p.head.id == n.pass).unwrap();
                    prop_assert!(other.neighbours().any(|m| m.pass == pass.head.id), "{n:?} is not returned");
                    let side = n.side == Side::Left;
                    let t = (pass.points[1] - pass.points[0]).truncate();
                    let v = (other.points[0] - pass.points[0]).truncate();
                    if pass.move_count() == 1 && other.move_count() == 1 {
                        prop_assert_eq!(t.perp_dot(v) > 0.0, side);
                    }
                }
            }
        }
    }
}
