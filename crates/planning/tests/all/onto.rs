//! Layers that follow a body: on a plate they are flat layers, on a tube those of a tube.

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;
use meltpath_planning::onto::{Onto, OntoError, OntoPlan, OntoSettings, ToTop, touches};
use meltpath_planning::surface::SurfacePoint;
use meltpath_planning::{ContourOrder, FillSettings, LineAngle, Paces, Strategy};

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

/// Travel of the beads, mm/s.
const SPEED: f64 = 12.0;

fn with(part: &Mesh, body: &Mesh, side: f64, over: f64) -> Result<OntoPlan, OntoError> {
    to(part, body, (side, over), None)
}

/// From the body to the top of the part, `sheet` or what is found.
fn to_top(
    part: &Mesh,
    body: &Mesh,
    allowances: (f64, f64),
    sheet: Option<&Mesh>,
) -> Result<OntoPlan, OntoError> {
    let top = ToTop {
        sheet,
        paces: Paces {
            nominal: SPEED,
            slowest: 0.4,
            fastest: 2.0,
        },
        known: [5.0, 24.0],
    };
    to(part, body, allowances, Some(top))
}

fn to(
    part: &Mesh,
    body: &Mesh,
    (side, over): (f64, f64),
    top: Option<ToTop<'_>>,
) -> Result<OntoPlan, OntoError> {
    let fill = fill();
    let settings = OntoSettings {
        over,
        top,
        ..settings(&fill, side)
    };
    let onto = Onto::new(part, &[body], HEIGHT, settings)?;
    onto.plan((1, &[HEIGHT]), &Reporter::new(), &Silent)
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

/// A block from the plate up, cut by a plane that rises along x.
fn wedge(low: f64, rise: f64) -> Mesh {
    let mut block = box_of([20.0, 10.0, -10.0], [80.0, 50.0, 1.0]);
    for p in block.vertices.iter_mut().filter(|p| p.z > 0.0) {
        p.z = low + rise * (p.x - 20.0);
    }
    block
}

/// Between planes that lean all layers cover the whole part, everywhere as many, and each is as thick as its share of the place.
#[test]
fn layers_of_a_wedge_go_from_the_plate_to_its_top() {
    let (low, rise) = (8.0, 0.1);
    let plan = to_top(&wedge(low, rise), &plate(), (0.0, 0.0), None).unwrap();
    // the root of 8 and 14, over 1.5
    let count = plan.layers.len();
    assert_eq!(count, 7);
    let height = |p: DVec3| low + rise * (p.x - 20.0);
    for (number, p) in points(&plan) {
        let (top, bottom) = (p.position, p.from.unwrap());
        let share = p.spacing().unwrap() * count as f64 / height(p.position);
        assert!((share - 1.0).abs() < 0.02, "{number} {share}");
        assert!(bottom.z > -1e-6 && top.z < height(top) + 1e-6);
        if number == 1 {
            assert!(bottom.z.abs() < 1e-6, "{bottom:?}");
        }
        if number == count as u32 {
            assert!((top.z - height(top)).abs() < 1e-6, "{top:?}");
        }
        // from upright on the plate to upright on the top
        let lean = p.growth.angle_between(DVec3::Z);
        let most = rise.atan();
        assert!(lean > 0.0 && lean < most, "{lean}");
    }
    let tops: Vec<f64> = plan.layers.iter().map(|l| l.top).collect();
    for ends in tops.windows(2) {
        assert!((ends[1] - ends[0] - tops[0]).abs() < 1e-3, "{tops:?}");
    }
    for layer in &plan.layers {
        assert!((layer.area / 2400.0 - 1.0).abs() < 0.006, "{}", layer.area);
    }
}

/// What a bead lays at its speeds is what the layer's thickness wants, bead by bead and place by place.
#[test]
fn speeds_follow_the_thickness() {
    let plan = to_top(&wedge(8.0, 0.1), &plate(), (0.0, 0.0), None).unwrap();
    let (mut wanted, mut laid, mut speeds) = (0.0, 0.0, Vec::new());
    for bead in &plan.beads {
        assert_eq!(bead.speeds.len() + 1, bead.pass.points.len());
        for (ends, speed) in bead.pass.points.windows(2).zip(&bead.speeds) {
            let length = ends[0].position.distance(ends[1].position);
            let thick = 0.5 * (ends[0].spacing().unwrap() + ends[1].spacing().unwrap());
            let grows = HEIGHT * SPEED / speed.unwrap();
            assert!((grows / thick - 1.0).abs() < 0.06, "{grows} {thick}");
            wanted += length * thick;
            laid += length * grows;
            speeds.push(speed.unwrap());
        }
    }
    assert!((laid / wanted - 1.0).abs() < 1e-3, "{laid} {wanted}");
    let least = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let most = speeds.iter().copied().fold(0.0, f64::max);
    assert!((1.5..1.8).contains(&(most / least)), "{least} {most}");
}

/// A sheet that is named, whichever side it shows, and the one that is found are the same top; what lies over it is every layer's.
#[test]
fn a_top_is_named_or_found() {
    let part = wedge(8.0, 0.1);
    let top = |turned: bool| Mesh {
        vertices: part.vertices.clone(),
        triangles: part
            .triangles
            .iter()
            .filter(|t| t.iter().all(|&v| part.vertices[v as usize].z > 0.0))
            .map(|&[a, b, c]| if turned { [a, c, b] } else { [a, b, c] })
            .collect(),
    };
    let of = |sheet: Option<&Mesh>| to_top(&part, &plate(), (2.0, 3.0), sheet).unwrap();
    let found = of(None);
    for turned in [false, true] {
        let named = of(Some(&top(turned)));
        assert_eq!(named.beads.len(), found.beads.len());
        for (a, b) in named.beads.iter().zip(&found.beads) {
            assert_eq!(a.pass.number, b.pass.number);
            // which points stay on a line hangs on rounding
            let share = a.pass.length() / b.pass.length();
            assert!((share - 1.0).abs() < 1e-4, "{share}");
        }
    }
    // (8 + 3) to (14 + 3) mm
    assert_eq!(found.layers.len(), 9);
    for layer in &found.layers {
        let wanted = 64.0 * 44.0 - (16.0 - 4.0 * std::f64::consts::PI);
        assert!((layer.area / wanted - 1.0).abs() < 0.02, "{}", layer.area);
    }
    let last = points(&found).filter(|p| p.0 == 9);
    for (_, p) in last {
        let plane = 8.0 + 0.1 * (p.position.x - 20.0) + 3.0 / 0.1_f64.atan().cos();
        assert!((p.position.z - plane).abs() < 1e-6, "{p:?}");
    }
}

/// A face that leans against a tube: as many layers where there is least between them as where there is most, and all of them whole.
#[test]
fn layers_go_from_a_tube_to_a_face_that_leans() {
    let mut part = box_of([0.0, -15.0, 35.0], [42.0, 15.0, 65.0]);
    let lean = 10.0_f64.to_radians().tan();
    for p in part.vertices.iter_mut().filter(|p| p.x > 1.0) {
        p.x += lean * (p.z - 50.0);
    }
    let plan = to_top(&part, &tube(), (0.0, 0.0), None).unwrap();
    // from 9.4 mm at the foot of the face to 17.1 mm at its upper corners
    let count = plan.layers.len();
    assert_eq!(count, 8);
    for (number, p) in points(&plan) {
        if number == count as u32 {
            let plane = 42.0 + lean * (p.position.z - 50.0);
            assert!((p.position.x - plane).abs() < 1e-6, "{p:?}");
        }
        if number == 1 {
            let radius = p.from.unwrap().truncate().length();
            assert!((radius - 30.0).abs() < 0.05, "{radius}");
        }
        assert!((0.9..2.2).contains(&p.spacing().unwrap()), "{p:?}");
    }
    let areas: Vec<f64> = plan.layers.iter().map(|l| l.area).collect();
    assert!(areas.iter().all(|a| *a > 850.0 && *a < 1000.0), "{areas:?}");
}

#[test]
fn tops_that_are_none_are_refused() {
    // a step: two faces look away from the plate
    let step = shapes::boss_on_plate((60.0, 40.0, 4.0), 10.0, 3.0, 8.0);
    let step = Mesh {
        vertices: step
            .vertices
            .iter()
            .map(|p| *p + DVec3::new(20.0, 10.0, 0.0))
            .collect(),
        ..step
    };
    let stepped = to_top(&step, &plate(), (0.0, 0.0), None).unwrap_err();
    assert!(
        matches!(stepped, OntoError::OverTop { by, .. } if by > 2.0),
        "{stepped}"
    );
    let inside = box_of([30.0, 20.0, -5.0], [60.0, 40.0, -2.0]);
    let none = to_top(&wedge(8.0, 0.1), &plate(), (0.0, 0.0), Some(&inside)).unwrap_err();
    assert!(matches!(none, OntoError::NoTop { .. }), "{none}");
}

/// A side wall that is named as the top: told as what it is, not as a surface without triangles.
#[test]
fn a_side_that_is_named_as_the_top_is_refused() {
    let part = wedge(8.0, 0.1);
    let (low, high) = part.bounds().unwrap();
    let side = sheet_at(low.x, [low.y, high.y], [2.0, 8.0]);
    let aside = to_top(&part, &plate(), (0.0, 0.0), Some(&side)).unwrap_err();
    assert!(
        matches!(aside, OntoError::TopAside { angle } if (angle.to_degrees() - 90.0).abs() < 5.0),
        "{aside}"
    );
    assert!(aside.to_string().contains("onto.top"), "{aside}");
}

/// Files in another unit than the job says make a part of some metres: its size is told, and the unit.
#[test]
fn a_part_in_another_unit_is_told_as_one() {
    let large = |mesh: Mesh| Mesh {
        vertices: mesh.vertices.iter().map(|p| 25.4 * *p).collect(),
        ..mesh
    };
    let (part, body) = (large(wedge(8.0, 0.1)), large(plate()));
    let error = to_top(&part, &body, (0.0, 0.0), None).unwrap_err();
    assert!(matches!(error, OntoError::TooLarge { .. }), "{error}");
    let told = error.to_string();
    assert!(
        told.contains("part_unit") && told.contains("mm finely"),
        "{told}"
    );
}

/// An upright sheet across x.
fn sheet_at(x: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> Mesh {
    Mesh {
        vertices: vec![
            DVec3::new(x, y0, z0),
            DVec3::new(x, y1, z0),
            DVec3::new(x, y1, z1),
            DVec3::new(x, y0, z1),
        ],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    }
}

fn settings(fill: &FillSettings, side: f64) -> OntoSettings<'_> {
    OntoSettings {
        fill,
        side,
        over: 0.0,
        inside: 1.5 * fill.width,
        chord_error: 0.02,
        count: None,
        top: None,
    }
}

/// What a pad's layers fill is a box: its sides with their allowance, as high as its layers, begun within the plate.
#[test]
fn what_layers_fill_is_a_closed_body() {
    let plate = box_of([0.0; 3], [90.0, 70.0, 10.0]);
    let pad = box_of([20.0, 15.0, 5.0], [60.0, 45.0, 18.0]);
    let fill = fill();
    let onto = Onto::new(&pad, &[&plate], HEIGHT, settings(&fill, 3.0)).unwrap();
    let plan = onto
        .plan((7, &[HEIGHT]), &Reporter::new(), &Silent)
        .unwrap();
    assert_eq!(plan.layers[0].number, 7);
    assert!(plan.beads.iter().all(|b| b.pass.number >= 7));
    let built = onto.built(&plan).unwrap();
    let high = HEIGHT * plan.layers.len() as f64;
    let (low, top) = built.bounds().unwrap();
    assert!((top.z - (10.0 + high)).abs() < 1e-6, "{top}");
    assert!((7.0..9.9).contains(&low.z), "{low}");
    for (found, wanted) in [(low.x, 17.0), (low.y, 12.0), (top.x, 63.0), (top.y, 48.0)] {
        assert!((found - wanted).abs() < 0.05, "{low} {top}");
    }
    // corners of the allowance are round, edges a cell of the grid
    let over = built.volume() - 46.0 * 36.0 * (10.0 - low.z);
    let wanted = (46.0 * 36.0 - (4.0 - std::f64::consts::PI) * 9.0) * high;
    assert!((over / wanted - 1.0).abs() < 0.01, "{over} {wanted}");
}

/// A block that leans out over where it begins is laid as it leans, with its allowance on both sides.
#[test]
fn layers_follow_a_part_that_leans() {
    let plate = box_of([0.0; 3], [120.0, 70.0, 10.0]);
    let mut block = box_of([20.0, 15.0, 10.0], [50.0, 45.0, 40.0]);
    for p in block.vertices.iter_mut().filter(|p| p.z > 20.0) {
        p.x += 20.0;
    }
    let plan = with(&block, &plate, 3.0, 0.0).unwrap();
    for layer in &plan.layers {
        let middle = layer.top - 0.5 * HEIGHT;
        let (low, high) = layer
            .rims
            .iter()
            .flatten()
            .fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), p| {
                (a.min(p.x), b.max(p.x))
            });
        // the way across a flank is longer than the allowance by its lean
        let aside = 3.0 / (30.0_f64 / 20.0).atan().sin();
        let wanted = [20.0, 50.0].map(|x| x + 20.0 * middle / 30.0);
        assert!(
            (low - (wanted[0] - aside)).abs() < 0.7,
            "{middle}: {low} {wanted:?}"
        );
        assert!(
            (high - (wanted[1] + aside)).abs() < 0.7,
            "{middle}: {high} {wanted:?}"
        );
    }
}

/// A part that stands on one body grows out of that alone, however near another is.
#[test]
fn a_part_touches_what_it_stands_on() {
    let plate = box_of([0.0; 3], [90.0, 70.0, 10.0]);
    let trunk = box_of([20.0, 15.0, 8.0], [50.0, 45.0, 60.0]);
    let boss = box_of([48.0, 20.0, 20.0], [70.0, 40.0, 40.0]);
    assert!(touches(&trunk, &plate, HEIGHT));
    assert!(touches(&boss, &trunk, HEIGHT));
    assert!(!touches(&boss, &plate, HEIGHT));
}
