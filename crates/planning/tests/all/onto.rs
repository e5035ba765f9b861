//! Layers that follow a body: on a plate they are flat layers, on a tube those of a tube.

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;
use meltpath_planning::onto::{Onto, OntoError, OntoPlan, OntoSettings};
use meltpath_planning::surface::SurfacePoint;
use meltpath_planning::{ContourOrder, FillSettings, LineAngle, Strategy};

const HEIGHT: f64 = 1.5;

/// A hybrid fill, beads 5.4 mm wide 4 mm apart.
fn fill() -> FillSettings {
    FillSettings {
        strategy: Strategy::Hybrid {
            contours: 1,
            order: ContourOrder::InsideOut,
            angle: LineAngle::Turning {
                first: 0.0,
                step: std::f64::consts::FRAC_PI_2,
            },
        },
        ..FillSettings::new(5.4, 4.0)
    }
}

fn with(part: &Mesh, body: &Mesh, side: f64, over: f64) -> Result<OntoPlan, OntoError> {
    let fill = fill();
    let settings = OntoSettings {
        fill: &fill,
        side,
        over,
        inside: 1.5 * fill.width,
        chord_error: 0.02,
        count: None,
    };
    let onto = Onto::new(part, body, HEIGHT, settings)?;
    onto.plan(&[HEIGHT], &Reporter::new(), &Silent)
}

fn planned(part: &Mesh, body: &Mesh) -> Result<OntoPlan, OntoError> {
    with(part, body, 0.0, 0.0)
}

fn box_of(low: [f64; 3], high: [f64; 3]) -> Mesh {
    shapes::cuboid(DVec3::from_array(low), DVec3::from_array(high))
}

fn plate() -> Mesh {
    box_of([0.0, 0.0, -10.0], [100.0, 60.0, 0.0])
}

/// A tube of 30 about z, 100 high.
fn tube() -> Mesh {
    shapes::cone(30.0, 30.0, 100.0)
}

fn length(plan: &OntoPlan, number: u32) -> f64 {
    let beads = plan.beads.iter().filter(|b| b.pass.number == number);
    beads.map(|b| b.pass.length()).sum()
}

fn points(plan: &OntoPlan) -> impl Iterator<Item = (u32, SurfacePoint)> {
    let passes = plan.beads.iter().map(|b| &b.pass);
    passes.flat_map(|p| p.points.iter().map(move |q| (p.number, *q)))
}

#[test]
fn on_a_plate_layers_are_flat_and_filled() {
    let part = box_of([20.0, 10.0, -10.0], [80.0, 50.0, 6.2]);
    let plan = planned(&part, &plate()).unwrap();
    assert_eq!(plan.layers.len(), 4);
    for layer in &plan.layers {
        assert!((layer.area - 2400.0).abs() < 3.0, "{}", layer.area);
        let bare: f64 = layer.coverage.iter().map(|c| c.lack_area).sum();
        assert!(bare < 0.01 * layer.area, "{bare}");
        assert!(
            layer.stretch.iter().all(|s| (s.0 - 1.0).abs() < 1e-6),
            "{:?}",
            layer.stretch
        );
        // lines and contours lie a stepover apart; outside of the contours 0.7 mm are no bead's
        let filled = length(&plan, layer.number) * 4.0;
        let wanted = (60.0 - 1.4) * (40.0 - 1.4);
        assert!((filled / wanted - 1.0).abs() < 0.1, "{filled} {wanted}");
    }
    for (number, p) in points(&plan) {
        let top = 1.5 * f64::from(number);
        assert!((p.position.z - top).abs() < 1e-9 && p.growth.distance(DVec3::Z) < 1e-9);
        assert!((p.from.unwrap().z - (top - 1.5)).abs() < 1e-9);
        let beside = [
            p.position.x - 20.0,
            80.0 - p.position.x,
            p.position.y - 10.0,
            50.0 - p.position.y,
        ];
        let rim = beside.into_iter().fold(f64::INFINITY, f64::min);
        assert!(rim > 2.65, "{p:?}");
    }
    // two beads a layer: a zigzag and its contour
    assert_eq!(plan.beads.len(), 8);
}

#[test]
fn on_a_tube_layers_are_round_and_lines_parallel_on_them() {
    let part = box_of([0.0, -15.0, 35.0], [36.0, 15.0, 65.0]);
    let plan = planned(&part, &tube()).unwrap();
    let axis = |p: DVec3| p.truncate().length();
    for (number, p) in points(&plan) {
        // the tube's own facets
        let off = axis(p.position) - 30.0 - 1.5 * f64::from(number);
        assert!(off.abs() < 0.05, "{off}");
        let radial = p.position.truncate().normalize();
        assert!(p.growth.truncate().distance(radial) < 0.03 && p.growth.z.abs() < 1e-6);
        assert!(p.normal.dot(p.growth).abs() < 1e-9);
    }
    let radius: f64 = 30.75;
    let area = 30.0 * 2.0 * radius * (15.0 / radius).asin();
    let first = &plan.layers[0];
    assert!(
        (first.area / area - 1.0).abs() < 0.005,
        "{} {area}",
        first.area
    );
    // the flat top cuts the last layers: where the tube is highest the part ends 6 mm above it, at its sides later
    assert!(plan.layers.len() >= 4, "{}", plan.layers.len());
}

#[test]
fn metal_beyond_the_part_is_laid_around_what_grows_alone() {
    // the part leaves most of the plate as it is
    let grown = box_of([20.0, 10.0, -10.0], [80.0, 50.0, 3.0]);
    let plan = with(&grown, &plate(), 2.0, 1.0).unwrap();
    // (3 + 1) / 1.5, and the round corners of what lies within 2 mm
    assert_eq!(plan.layers.len(), 3);
    let wanted = 64.0 * 44.0 - (16.0 - 4.0 * std::f64::consts::PI);
    assert!(
        (plan.layers[0].area / wanted - 1.0).abs() < 0.01,
        "{:?} {wanted}",
        plan.layers[0]
    );
}

#[test]
fn two_patches_are_two_pieces_of_one_layer() {
    let mut part = box_of([5.0, 10.0, -5.0], [35.0, 50.0, 1.6]);
    let other = box_of([60.0, 10.0, -5.0], [90.0, 50.0, 1.6]);
    let shift = part.vertices.len() as u32;
    part.vertices.extend(other.vertices);
    part.triangles
        .extend(other.triangles.iter().map(|t| t.map(|v| v + shift)));
    let plan = planned(&part, &plate()).unwrap();
    assert_eq!((plan.layers.len(), plan.beads.len()), (1, 4));
}

#[test]
fn what_cannot_be_laid_is_refused() {
    let of = |part: Mesh| planned(&part, &plate()).unwrap_err();
    let thin = of(box_of([20.0, 10.0, -10.0], [80.0, 50.0, 0.5]));
    assert!(
        matches!(thin, OntoError::Nothing { reach, .. } if (reach - 0.5).abs() < 1e-9),
        "{thin}"
    );
    let apart = of(box_of([20.0, 10.0, 3.0], [80.0, 50.0, 9.0]));
    assert!(
        matches!(apart, OntoError::Apart { gap, .. } if (gap - 3.0).abs() < 1e-9),
        "{apart}"
    );
    let narrow = of(box_of([20.0, 10.0, -10.0], [23.0, 50.0, 9.0]));
    assert!(matches!(narrow, OntoError::Narrow { .. }), "{narrow}");
}
