//! Frames of a whole cell, and what is refused of its file.

use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_robot::cell::{self, Values};
use meltpath_robot::kinematics::numeric::distance;

fn near(a: DVec3, b: DVec3) {
    assert!(a.distance(b) < 1e-9, "{a} is not {b}");
}

const VALUES: Values = Values {
    arm: [0.1, 0.2, -0.3, 0.4, -0.9, 0.6],
    track: 250.0,
    positioner: [0.7, -1.1],
};

fn with(name: &str, tables: &str) -> String {
    let text = find(robots::ALL, name).unwrap().text;
    let (arm, _) = text.split_once("\n# Around the arm").unwrap();
    format!("{arm}\n{tables}")
}

const TORCH: &str = "[torch]\nposition = [\"10 mm\", \"20 mm\", \"300 mm\"]\nangles = [\"0 deg\", \"35 deg\", \"0 deg\"]\nwire = \"12 mm\"\n";

#[test]
fn a_positioner_carries_table_and_part() {
    let cell = cell::read(&with(
        "fanuc-arcmate-120ic",
        "[table]\nposition = [\"0 mm\", \"0 mm\", \"50 mm\"]\n",
    ))
    .unwrap();
    // upright the table lies at 1300 mm and 700 + 100 + 50 mm; tilted by a right angle it lies 150 mm in front of the axis
    let upright = cell.frames(&Values::default());
    near(upright.table.position, DVec3::new(1300.0, 0.0, 850.0));
    let quarter = std::f64::consts::FRAC_PI_2;
    let tilted = cell.frames(&Values {
        positioner: [quarter, quarter],
        ..Values::default()
    });
    near(tilted.table.position, DVec3::new(1450.0, 0.0, 700.0));
    near(tilted.part.orientation * DVec3::Z, DVec3::X);
    near(tilted.part.orientation * DVec3::X, DVec3::Y);
}

#[test]
fn a_track_carries_the_arm() {
    let track = "[track]\nsource = \"test\"\nposition = [\"0 mm\", \"5 mm\", \"0 mm\"]\naxis = [0, 2, 0]\nlow = \"0 mm\"\nhigh = \"3 m\"\n[base]\nposition = [\"0 mm\", \"0 mm\", \"400 mm\"]\n";
    let cell = cell::read(&with("abb-irb2600-12-185", track)).unwrap();
    let frames = cell.frames(&VALUES);
    near(frames.base.position, DVec3::new(0.0, 255.0, 400.0));
    let still = cell::read(&with("abb-irb2600-12-185", ""))
        .unwrap()
        .frames(&VALUES);
    near(
        frames.flange.position - still.flange.position,
        DVec3::new(0.0, 255.0, 400.0),
    );
}

/// Both arrangements: from the tip in the part to the flange, and back by the frames.
#[test]
fn the_flange_follows_from_the_tip_in_the_part() {
    let held = "[torch]\nposition = [\"700 mm\", \"0 mm\", \"900 mm\"]\nangles = [\"180 deg\", \"0 deg\", \"0 deg\"]\n[part]\nposition = [\"0 mm\", \"0 mm\", \"80 mm\"]\n";
    let part_on_robot =
        with("staubli-rx60bl", held).replacen("maker", "arrangement = \"part-on-robot\"\nmaker", 1);
    for text in [with("fanuc-arcmate-120ic", TORCH), part_on_robot] {
        let cell = cell::read(&text).unwrap();
        let frames = cell.frames(&VALUES);
        let flange = cell.base_from_flange(frames.part_from_wire_tip(), &VALUES);
        let [off, turned] = distance(flange, cell.arm.forward(VALUES.arm));
        assert!(off < 1e-9 && turned < 1e-12, "{off:e} {turned:e}");
        let found = cell.arm.inverse(flange).unwrap().solutions;
        for solution in found {
            let again = cell.frames(&Values {
                arm: solution.angles,
                ..VALUES
            });
            let [off, turned] = distance(again.part_from_wire_tip(), frames.part_from_wire_tip());
            assert!(off < 1e-8 && turned < 1e-11, "{off:e} {turned:e}");
        }
    }
}

#[test]
fn the_wire_goes_on_along_the_torch() {
    let cell = cell::read(&with("fanuc-arcmate-120ic", TORCH)).unwrap();
    let frames = cell.frames(&VALUES);
    let torch_from_tip = frames.torch.inverse().then(frames.wire_tip);
    near(torch_from_tip.position, DVec3::new(0.0, 0.0, 12.0));
    let flange_from_torch = frames.flange.inverse().then(frames.torch);
    assert!(
        distance(
            flange_from_torch,
            Pose::from_wpr(
                DVec3::new(10.0, 20.0, 300.0),
                DVec3::Y * 35.0_f64.to_radians()
            )
        )[0] < 1e-9
    );
}

/// Everything wrong is told at once, each with its place and what to do.
#[test]
fn wrong_cells_are_refused_with_places() {
    let wrong = |text: &str| -> Vec<String> {
        let problems = cell::read(text).unwrap_err().0;
        assert!(problems.iter().all(|p| p.span.is_some()), "{problems:?}");
        problems.iter().map(ToString::to_string).collect()
    };
    let rx = with("staubli-rx60b", "");
    let told = wrong(
        &rx.replace("\"-160 deg\"", "\"200 deg\"")
            .replace("[\"arm_aside\"]", "[\"arm_asid\"]"),
    );
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(
        told.iter()
            .any(|t| t.contains("joint 1 goes from 200 deg to 160 deg")),
        "{told:?}"
    );
    assert!(
        told.iter()
            .any(|t| t.contains("did you mean \"arm_aside\"")),
        "{told:?}"
    );
    let told = wrong(
        &rx.replace("upper_arm = \"290 mm\"\n", "")
            .replace("flange = \"65 mm\"\n", ""),
    );
    assert_eq!(told.len(), 2, "{told:?}");
    let told = wrong(&format!(
        "{rx}\n[base]\naxes = [[1, 0, 0], [0, -1, 0], [0, 0, 1]]\n"
    ));
    assert!(told[0].contains("left-handed"), "{told:?}");
    let told = wrong(&format!(
        "{rx}\n[base]\naxes = [[1, 0, 0.1], [0, 1, 0], [0, 0, 1]]\n"
    ));
    assert!(told[0].contains("no rigid frame"), "{told:?}");
    let told = wrong(&format!(
        "{rx}\n[track]\nsource = \"x\"\naxis = [0, 0, 0]\nlow = \"0 mm\"\nhigh = \"1 m\"\n"
    ));
    assert!(told[0].contains("no direction"), "{told:?}");
    let told = wrong(&rx.replace("[arm]\n", "[arm]\nkind = \"axes\"\n"));
    assert!(
        told.iter().any(|t| t.contains("an arm has six")),
        "{told:?}"
    );
}

/// Axes of a calibration, not quite square, make the nearest rigid frame.
#[test]
fn calibrated_axes_are_made_rigid() {
    let rx = with("staubli-rx60b", "");
    let cell = cell::read(&format!(
        "{rx}\n[base]\naxes = [[0.0002, 1, 0], [-1, 0, 0], [0, 0, 1]]\n"
    ))
    .unwrap();
    let base = cell.carrier_from_base.orientation;
    assert!((base.length() - 1.0).abs() < 1e-15);
    assert!((base * DVec3::X).distance(DVec3::Y) < 3e-4);
}

/// Points as the pendant shows them place table and base, whatever the arm stands on; and the frame that is told is the one that was touched.
#[test]
fn touched_points_place_a_frame() {
    let of = |tables: &str| cell::read(&with("staubli-rx60b", tables));
    let touched = "touched = [[\"500 mm\", \"100 mm\", \"50 mm\"], [\"500 mm\", \"400 mm\", \"50 mm\"], [\"300 mm\", \"100 mm\", \"50 mm\"]]";
    let base = "[base]\nposition = [\"10 mm\", \"20 mm\", \"400 mm\"]\nangles = [\"0 deg\", \"0 deg\", \"90 deg\"]";
    let cell = of(&format!("{base}\n[table]\nsource = \"touched\"\n{touched}")).unwrap();
    let table = cell.frames(&Values::default()).table;
    // the base turns x of the pendant into y of the world
    assert!(
        table.position.distance(DVec3::new(-90.0, 520.0, 450.0)) < 1e-9,
        "{table:?}"
    );
    // its x lies along the pendant's y, which is -x of the world
    assert!(
        (table.orientation * DVec3::X).distance(-DVec3::X) < 1e-9,
        "{table:?}"
    );
    assert_eq!(cell.touched.len(), 1);
    assert_eq!(
        (cell.touched[0].of, cell.touched[0].off_plane),
        ("table", None)
    );
    // the world as it lies in the base: the base in the world is the inverse
    let cell = of(&format!(
        "[base]\n{touched}\n[table]\nposition = [\"0 mm\", \"0 mm\", \"0 mm\"]"
    ))
    .unwrap();
    let frames = cell.frames(&Values::default());
    let seen = frames.base.inverse().then(frames.table);
    assert!(
        seen.position.distance(DVec3::new(500.0, 100.0, 50.0)) < 1e-9,
        "{seen:?}"
    );
    let told = |tables: &str| {
        let problems = of(tables).unwrap_err();
        problems.to_string()
    };
    let line = touched.replace("\"300 mm\", \"100 mm\"", "\"500 mm\", \"250 mm\"");
    let collinear = told(&format!("[table]\n{line}"));
    assert!(
        collinear.contains("table.touched") && collinear.contains("on a line"),
        "{collinear}"
    );
    let both = told(&format!(
        "[table]\nposition = [\"1 mm\", \"0 mm\", \"0 mm\"]\n{touched}"
    ));
    assert!(both.contains("one of them is enough"), "{both}");
}

/// Lengths, shapes and speeds that no machine has are refused, each in its place: most often the unit is wrong.
#[test]
fn what_no_machine_has_is_refused() {
    let around = "[torch]\nposition = [\"0 mm\", \"0 mm\", \"330 mm\"]\nwire = \"15 mm\"\n[table]\nposition = [\"900 mm\", \"0 mm\", \"0 mm\"]\n\
        [shapes]\nlinks = [\"150 mm\", \"110 mm\", \"100 mm\", \"80 mm\", \"70 mm\", \"55 mm\"]\ntorch = \"45 mm\"\nnozzle = [\"80 mm\", \"12 mm\"]\n\
        [track]\nsource = \"x\"\naxis = [0, 1, 0]\nlow = \"0 mm\"\nhigh = \"40 m\"\nspeed = \"2 m/s\"\n";
    let good = with("fanuc-arcmate-120ic", around);
    let good = good.replacen("speed = [\"195 deg/s\"", "speed = [\"200 deg/s\"", 1);
    assert!(
        good.contains("\"200 deg/s\"") && good.contains("flange = \"100 mm\""),
        "{good}"
    );
    cell::read(&good).unwrap_or_else(|e| panic!("{e}"));
    for (from, to, told) in [
        (
            "flange = \"100 mm\"",
            "flange = \"-100 mm\"",
            "arm.flange is -100 mm",
        ),
        ("\"200 deg/s\"", "\"1e9 deg/s\"", "joints.speed"),
        ("wire = \"15 mm\"", "wire = \"3 m\"", "torch.wire"),
        ("\"330 mm\"", "\"330 m\"", "torch.position"),
        ("\"900 mm\"", "\"900000 m\"", "table.position"),
        ("links = [\"150 mm\"", "links = [\"150 m\"", "shapes.links"),
        (
            "links = [\"150 mm\"",
            "links = [\"900 mm\"",
            "shapes.links has a radius of 900 mm",
        ),
        (
            "\"80 mm\", \"12",
            "\"800 mm\", \"12",
            "shapes.nozzle is 800 mm long",
        ),
        (
            "\"80 mm\", \"12",
            "\"12 mm\", \"80",
            "shapes.nozzle is 12 mm long, with a radius of 80 mm",
        ),
        ("torch = \"45 mm\"", "torch = \"45 m\"", "shapes.torch"),
        ("\"2 m/s\"", "\"2000 m/s\"", "track.speed"),
        ("\"40 m\"", "\"40000 m\"", "track.high"),
    ] {
        assert!(good.contains(from), "{from} is not in {good}");
        let problems = cell::read(&good.replacen(from, to, 1)).unwrap_err().0;
        assert_eq!(problems.len(), 1, "{to}: {problems:?}");
        assert!(problems[0].span.is_some(), "{problems:?}");
        let said = problems[0].to_string();
        assert!(said.contains(told), "{to}: {said}");
    }
}
