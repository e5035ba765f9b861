//! A robot cell in words: its joints with their limits, its reach, where its frames lie, what of it is guessed.

use meltpath_base::number::significant;
use meltpath_geometry::Pose;
use meltpath_robot::cell::{Arrangement, Cell, LinkHull, Links, Source, Touched, Values};
use meltpath_robot::hull::Hull;
use meltpath_robot::kinematics::{Chain, Geometry, Joint, JointKind};

/// What a cell holds, in lines.
pub(super) fn lines(cell: &Cell) -> Vec<String> {
    let held = match cell.arrangement {
        Arrangement::TorchOnRobot => "the robot holds the torch",
        Arrangement::PartOnRobot => "the robot holds the part, the torch stands",
    };
    let ways = match cell.arm.geometry {
        Geometry::SphericalWrist(_) => {
            "spherical wrist: every way to hold a pose is known, eight at most"
        }
        Geometry::OffsetWrist(_) => {
            "offset wrist: every way to hold a pose is known, eight at most"
        }
        Geometry::Other => {
            "axes without a closed form: ways to hold a pose are searched, not all need be found"
        }
    };
    let mut lines = vec![format!("{}: {held}", cell.name), ways.to_owned()];
    lines.extend(cell.arm.chain.joints.iter().map(joint));
    if cell.arm.coupling != 0.0 {
        lines.push("J3 is shown to the level, limits too: it changes with J2".to_owned());
    }
    let reach = cell.arm.reach();
    lines.push(format!(
        "reach of the wrist's centre within limits: {} mm to {} mm from the first axis, {} mm to {} mm above the base",
        whole(reach.out[0]),
        whole(reach.out[1]),
        whole(reach.up[0]),
        whole(reach.up[1])
    ));
    let others = [("track", &cell.track), ("positioner", &cell.positioner)];
    for (name, chain) in others {
        match chain {
            Some(chain) => lines.extend(of_chain(name, chain)),
            None => lines.push(format!("no {name}")),
        }
    }
    let frames = cell.frames(&Values::default());
    for (name, pose) in [
        ("base", frames.base),
        ("flange", frames.flange),
        ("torch", frames.torch),
        ("wire tip", frames.wire_tip),
        ("table", frames.table),
        ("part", frames.part),
    ] {
        lines.push(format!("{name} with all joints at zero: {}", place(pose)));
    }
    lines.extend(links(cell));
    if let Some(table) = cell.shapes.as_ref().and_then(|s| s.table) {
        let [x, y] = table.size.map(whole);
        let deep = whole(table.thickness);
        lines.push(format!("table: {x} x {y} mm, {deep} mm deep"));
    }
    lines.extend(cell.touched.iter().map(touched));
    lines.extend(cell.sources.iter().map(source));
    lines
}

/// What the URDF tells of the links, and where from.
fn links(cell: &Cell) -> Vec<String> {
    let mut files = cell.files.iter().map(|f| f.file.display().to_string());
    let Some(urdf) = files.next() else {
        return Vec::new();
    };
    let mut lines = vec![format!("arm and joints from {urdf}")];
    let links = cell.shapes.as_ref().map(|s| &s.links);
    match links {
        None => lines.push(
            "its shapes are not used: collisions are checked with [shapes] (torch and nozzle, table)"
                .to_owned(),
        ),
        Some(Links::Bars(_)) => {
            lines.push("its shapes are not used: shapes.links tells the links".to_owned());
        }
        Some(Links::Hulls(hulls)) => {
            lines.push("links as convex hulls of pieces of its shapes, for collisions:".to_owned());
            lines.extend(hulls.iter().map(hull));
        }
    }
    lines
}

fn hull(body: &LinkHull) -> String {
    let link = match body.link {
        0 => "base".to_owned(),
        n => format!("link {n}"),
    };
    let beyond = match body.excess.most {
        most if most > 0.05 => format!(
            ", up to {} mm beyond it",
            whole((most * 10.0).ceil() / 10.0)
        ),
        _ => String::new(),
    };
    let points = |hulls: &[Hull]| -> usize { hulls.iter().map(|h| h.points().len()).sum() };
    let hulls = match body.pieces.len() {
        0 => format!("a hull of {} points", body.hull.points().len()),
        count => format!("{count} hulls of {} points together", points(&body.pieces)),
    };
    format!(
        "  {link}: {}, {} triangles, {hulls}{beyond}",
        body.of,
        body.mesh.triangles.len(),
    )
}

/// How well a frame was touched.
fn touched(frame: &Touched) -> String {
    let turned = significant(frame.turned_by_a_millimetre().to_degrees(), 2);
    let off = match frame.off_plane {
        Some(off) => format!(
            "the others lie up to {} mm off its plane",
            significant(off, 2)
        ),
        None => "three points do not tell how well they were touched: add a fourth in its plane"
            .to_owned(),
    };
    format!(
        "{}: touched, the second point {} mm along x, the third {} mm aside; a point that is wrong by 1 mm turns it by up to {turned} deg; {off}",
        frame.of,
        whole(frame.along),
        whole(frame.aside)
    )
}

fn of_chain(name: &str, chain: &Chain) -> Vec<String> {
    let mut lines = vec![format!("{name}:")];
    lines.extend(chain.joints.iter().map(joint));
    lines
}

fn joint(joint: &Joint) -> String {
    let (unit, scale) = match joint.kind {
        JointKind::Revolute => ("deg", 180.0 / std::f64::consts::PI),
        JointKind::Prismatic => ("mm", 1.0),
    };
    let show = |value: f64| significant(value * scale, 6);
    let limits = joint.limits;
    let least = format!(
        "  {}: {} to {} {unit}",
        joint.name,
        show(limits.low),
        show(limits.high)
    );
    let speed = match limits.speed {
        Some(speed) => format!(", {} {unit}/s", show(speed)),
        None => ", speed not known".to_owned(),
    };
    let acceleration = match limits.acceleration {
        Some(acceleration) => format!(", {} {unit}/s²", show(acceleration)),
        None => ", acceleration not known".to_owned(),
    };
    least + &speed + &acceleration
}

fn place(pose: Pose) -> String {
    let p = pose.position;
    let [w, pitch, r] = pose.wpr().to_array().map(|a| whole(a.to_degrees()));
    let [x, y, z] = p.to_array().map(whole);
    format!("x {x}, y {y}, z {z} mm, W {w}, P {pitch}, R {r} deg")
}

/// To a tenth at most.
fn whole(value: f64) -> String {
    // adding zero takes the sign from a zero
    significant((value * 10.0).round() / 10.0 + 0.0, 7)
}

fn source(source: &Source) -> String {
    let says = match &source.says {
        Some(says) => format!("{}: {says}", source.of),
        None => format!("{}: a guess, the file names no source", source.of),
    };
    if source.guesses.is_empty() {
        return says;
    }
    format!("{says}; GUESSED: {}", source.guesses.join(", "))
}

#[cfg(test)]
mod tests {
    use meltpath_data::{find, robots};
    use meltpath_geometry::math::DVec3;
    use meltpath_geometry::shapes::cuboid;
    use meltpath_robot::cell::{self, LinkHull};
    use meltpath_robot::hull::{Excess, Fineness, Pieces};

    use super::lines;

    #[test]
    fn a_cell_is_told_with_its_guesses() {
        let text = find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text;
        let told = lines(&cell::read(text).unwrap()).join("\n");
        for part in [
            "J1: −170 to 170 deg, 195 deg/s, acceleration not known",
            "J3 is shown to the level",
            "to 1811.6 mm from the first axis",
            "P1: −110 to 110 deg",
            "GUESSED: axes, low, high, speed",
            "no track",
            "flange with all joints at zero: x 1085, y 0, z 1565 mm",
        ] {
            assert!(told.contains(part), "{part} is not in\n{told}");
        }
    }

    /// A link in pieces, and one that is as it is.
    #[test]
    fn links_are_told_with_their_pieces() {
        let mut fork = cuboid(DVec3::ZERO, DVec3::new(100.0, 20.0, 20.0));
        fork.add(&cuboid(DVec3::ZERO, DVec3::new(20.0, 20.0, 90.0)));
        let taken = Pieces::of(&fork, Fineness::default()).unwrap();
        let mut body = LinkHull {
            link: 3,
            hull: taken.whole,
            pieces: taken.pieces,
            excess: Excess {
                most: 3.21,
                ..taken.excess
            },
            mesh: fork,
            of: "fork: fork.stl".to_owned(),
        };
        let told = super::hull(&body);
        for part in [
            "  link 3: fork: fork.stl, 24 triangles, 2 hulls of ",
            " points together, up to 3.3 mm beyond it",
        ] {
            assert!(told.contains(part), "{told}");
        }
        (body.pieces, body.excess) = (Vec::new(), Excess::default());
        let told = super::hull(&body);
        assert!(
            told.contains("24 triangles, a hull of ") && told.ends_with("points"),
            "{told}"
        );
    }
}
