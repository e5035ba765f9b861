//! A robot file that names its URDF: what is taken, what is written beside it, and what is refused with its place.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes::cuboid;
use meltpath_robot::cell::{self, Cell, Links};

use super::{ODD, SPHERICAL, TOOL, chained, everywhere, urdf};

/// A box from its low corner to its high one, mm.
fn bar(low: [f64; 3], high: [f64; 3]) -> Mesh {
    cuboid(DVec3::from_array(low), DVec3::from_array(high))
}

fn stl(path: &Path, mesh: &Mesh, scale: f64) {
    let mut mesh = mesh.clone();
    mesh.vertices.iter_mut().for_each(|v| *v *= scale);
    let mut file = fs::File::create(path).unwrap();
    write_stl(&mesh, "", &mut file).unwrap();
}

/// A folder with a package of an arm: meshes of links 1 and 3 (in m, and in mm), a cylinder on 2, and what is left boxes.
fn package(rows: &[super::Row]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir_all(at("arm/meshes")).unwrap();
    fs::create_dir_all(at("arm/urdf")).unwrap();
    stl(
        &at("arm/meshes/one.stl"),
        &bar([-80.0, -90.0, -100.0], [110.0, 70.0, 120.0]),
        0.001,
    );
    stl(
        &at("arm/meshes/three.STL"),
        &bar([-50.0, -40.0, -60.0], [300.0, 45.0, 150.0]),
        1.0,
    );
    let shape = |of: &str| format!("<collision><geometry>{of}</geometry></collision>");
    let mut text = urdf(rows);
    for (link, of) in [
        (
            0,
            "<visual><geometry><box size=\"0.4 0.4 0.1\"/></geometry></visual>".to_owned(),
        ),
        (
            1,
            shape("<mesh filename=\"package://arm/meshes/one.stl\"/>"),
        ),
        (
            2,
            "<visual><geometry><mesh filename=\"no.dae\"/></geometry></visual>".to_owned()
                + &shape("<cylinder radius=\"0.08\" length=\"0.7\"/>"),
        ),
        (
            3,
            shape("<mesh filename=\"../meshes/three.STL\" scale=\"0.001 0.001 0.001\"/>"),
        ),
        (4, shape("<box size=\"0.3 0.1 0.1\"/>")),
        (5, shape("<sphere radius=\"0.06\"/>")),
        (6, shape("<box size=\"0.02 0.1 0.1\"/>")),
    ] {
        let empty = format!("<link name=\"l{link}\"/>");
        assert!(text.contains(&empty));
        text = text.replace(&empty, &format!("<link name=\"l{link}\">{of}</link>"));
    }
    fs::write(at("arm/urdf/arm.urdf"), text).unwrap();
    dir
}

const FILE: &str = r#"urdf = "arm/urdf/arm.urdf"
[torch]
position = ["0 mm", "0 mm", "300 mm"]
[shapes]
source = "drawing"
torch = "30 mm"
nozzle = ["80 mm", "12 mm"]
table = ["800 mm", "800 mm"]
"#;

fn read(text: &str, dir: &tempfile::TempDir) -> Cell {
    cell::read_beside(text, dir.path()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str, dir: &tempfile::TempDir) -> String {
    cell::read_beside(text, dir.path()).unwrap_err().to_string()
}

fn change(dir: &tempfile::TempDir, from: &str, to: &str) {
    let path = dir.path().join("arm/urdf/arm.urdf");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} is not in {text}");
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

/// Whatever the joints: the bodies lie where the rows of the file put their links, of a closed form and of any other arm.
#[test]
fn bodies_go_with_the_links_of_the_file() {
    for rows in [[SPHERICAL, &[TOOL]].concat(), [ODD, &[TOOL]].concat()] {
        let dir = package(&rows);
        let cell = read(FILE, &dir);
        let Links::Hulls(hulls) = &cell.shapes.as_ref().unwrap().links else {
            panic!("{:?}", cell.shapes);
        };
        let links: Vec<u8> = hulls.iter().map(|h| h.link).collect();
        assert_eq!(links, [0, 1, 2, 3, 4, 5, 6]);
        let corners = [
            (1, [-80.0, -90.0, -100.0], [110.0, 70.0, 120.0]),
            (3, [-50.0, -40.0, -60.0], [300.0, 45.0, 150.0]),
            (4, [-150.0, -50.0, -50.0], [150.0, 50.0, 50.0]),
        ];
        for joints in everywhere() {
            let frames = cell.arm.chain.frames(&joints);
            for (link, low, high) in corners {
                let wanted = chained(&rows[..link], joints);
                let body = &hulls[link];
                assert_eq!(body.hull.points().len(), 8);
                let mut far = 0.0_f64;
                for p in body.hull.points() {
                    let p = wanted.inverse().point(frames[link - 1].point(*p));
                    let [low, high] = [low, high].map(DVec3::from_array);
                    // each is a corner of the box
                    let off = (p - low).abs().min((p - high).abs());
                    far = far.max(off.max_element());
                }
                assert!(far < 1e-3, "link {link}: {far}");
            }
        }
    }
}

/// The arm is that of the URDF, and what is written beside it counts, each with its source.
#[test]
fn a_file_adds_what_its_urdf_does_not_say() {
    let dir = package(&[SPHERICAL, &[TOOL]].concat());
    let cell = read(FILE, &dir);
    let printed =
        cell::from_urdf(&fs::read_to_string(dir.path().join("arm/urdf/arm.urdf")).unwrap());
    let alone = cell::read(&printed.unwrap()).unwrap();
    assert_eq!(cell.arm, alone.arm);
    assert_eq!((&*cell.name, cell.files.len()), ("arm", 3));
    assert_eq!(cell.guessed_shapes(), None);
    let text = format!(
        "{FILE}[joints]\nsource = \"page 4\"\nacceleration = [{}]\n[base]\nposition = [\"0 mm\", \"0 mm\", \"250 mm\"]\n",
        ["\"400 deg/s²\""; 6].join(", ")
    );
    let more = read(&text, &dir);
    let limits = more.arm.chain.joints[0].limits;
    assert!((limits.acceleration.unwrap() - 400.0 * PI / 180.0).abs() < 1e-9);
    assert_eq!(limits.low, cell.arm.chain.joints[0].limits.low);
    assert_eq!(more.carrier_from_base.position.z, 250.0);
    let joints = more.sources.iter().find(|s| s.of == "joints").unwrap();
    let says = joints.says.as_deref().unwrap();
    assert_eq!(says, "arm/urdf/arm.urdf; acceleration: page 4");
    // radii that are written are taken, and no mesh is looked for
    change(&dir, "one.stl", "none.stl");
    let radii = format!("{FILE}links = [{}]\n", ["\"90 mm\""; 6].join(", "));
    assert!(matches!(
        read(&radii, &dir).shapes.unwrap().links,
        Links::Bars(_)
    ));
}

/// What the URDF guesses is a guess until somebody says it.
#[test]
fn guesses_of_a_urdf_stay_guesses() {
    let dir = package(&[SPHERICAL, &[TOOL]].concat());
    change(&dir, "velocity=\"3.5\"", "");
    let guesses = |text: &str| read(text, &dir).guesses().concat();
    assert!(guesses(FILE).contains("joints (speed)"));
    let speeds = ["\"100 deg/s\""; 6].join(", ");
    let said = format!("{FILE}[joints]\nsource = \"page 4\"\nspeed = [{speeds}]\n");
    assert!(!guesses(&said).contains("joints"), "{}", guesses(&said));
    let other = format!("{FILE}[joints]\nsource = \"page 4\"\nguesses = [\"low\"]\n");
    assert!(guesses(&other).contains("joints (low, speed)"));
}

#[test]
fn what_contradicts_the_urdf_is_refused_at_its_place() {
    let dir = package(&[SPHERICAL, &[TOOL]].concat());
    let told = refused(&format!("{FILE}[arm]\nupper_arm = \"700 mm\"\n"), &dir);
    assert!(
        told.contains("arm.upper_arm is written, and arm/urdf/arm.urdf tells it"),
        "{told}"
    );
    let told = refused(&format!("{FILE}[joints]\nelbow_shows = \"level\"\n"), &dir);
    assert!(told.contains("joints.source is missing"), "{told}");
    let told = refused(&FILE.replace("arm.urdf", "none.urdf"), &dir);
    assert!(
        told.contains("none.urdf") && told.contains("is not there"),
        "{told}"
    );
    let alone = cell::read(FILE).unwrap_err().0;
    assert_eq!(alone[0].span, Some(7..26), "{alone:?}");
    // without a URDF the arm and its links are needed
    let told = refused(
        &FILE.replace("urdf = \"arm/urdf/arm.urdf\"", "name = \"x\""),
        &dir,
    );
    assert!(told.contains("arm is missing"), "{told}");
}

/// Each with the link, the line and what to do.
#[test]
fn shapes_that_cannot_be_taken_are_refused() {
    let good = || package(&[SPHERICAL, &[TOOL]].concat());
    for (from, to, wanted) in [
        (
            "one.stl",
            "none.stl",
            &["\"l1\"", "none.stl", "is not there", "links of [shapes]"][..],
        ),
        (
            "one.stl",
            "one.dae",
            &["\"l1\"", "one.dae", "is no STL", "convert"],
        ),
        ("one.stl", "one.obj", &["is no STL"]),
        (
            "scale=\"0.001 0.001 0.001\"",
            "",
            &["three.STL", "is it in millimetres?"],
        ),
        (
            "scale=\"0.001 0.001 0.001\"",
            "scale=\"1 1\"",
            &["\"l3\"", "scale is \"1 1\""],
        ),
        (
            "radius=\"0.08\"",
            "radius=\"-0.08\"",
            &["\"l2\"", "radius is \"-0.08\""],
        ),
        (
            "size=\"0.3 0.1 0.1\"",
            "size=\"0.3 0 0.1\"",
            &["\"l4\"", "above zero"],
        ),
    ] {
        let dir = good();
        change(&dir, from, to);
        let told = refused(FILE, &dir);
        for part in wanted {
            assert!(told.contains(part), "{part} is not in {told}");
        }
    }
    let dir = good();
    fs::write(dir.path().join("arm/meshes/one.stl"), [1, 2, 3]).unwrap();
    assert!(refused(FILE, &dir).contains("one.stl cannot be taken"));
    let dir = good();
    for link in 0..7 {
        let path = dir.path().join("arm/urdf/arm.urdf");
        let text = fs::read_to_string(&path).unwrap();
        let begin = text.find(&format!("<link name=\"l{link}\">")).unwrap();
        let end = begin + text[begin..].find("</link>").unwrap();
        let bare = format!("{}<link name=\"l{link}\">{}", &text[..begin], &text[end..]);
        fs::write(path, bare).unwrap();
        if link == 3 {
            let told = read(FILE, &dir).guessed_shapes().unwrap();
            assert!(told.contains("no shape of link 1, 2, 3"), "{told}");
        }
    }
    assert!(refused(FILE, &dir).contains("the URDF tells no shape of any link"));
}

/// A link of STL that is a fork, in three pieces; what its file lacks is refused.
#[test]
fn a_fork_of_a_file_is_taken_in_pieces() {
    let dir = package(&[SPHERICAL, &[TOOL]].concat());
    let mut fork = bar([-60.0, -60.0, 0.0], [60.0, 60.0, 40.0]);
    fork.add(&bar([-60.0, -60.0, 40.0], [-40.0, 60.0, 300.0]));
    fork.add(&bar([40.0, -60.0, 40.0], [60.0, 60.0, 300.0]));
    let file = dir.path().join("arm/meshes/one.stl");
    stl(&file, &fork, 0.001);
    let cell = read(FILE, &dir);
    let Links::Hulls(hulls) = &cell.shapes.as_ref().unwrap().links else {
        panic!("{:?}", cell.shapes);
    };
    let body = &hulls[1];
    let count = body.pieces.len();
    assert!((3..=4).contains(&count), "{count}");
    assert!(body.excess.most < 1.0, "{:?}", body.excess);
    // every corner of the file's lies in a hull, wherever the link's frame is
    for v in &body.mesh.vertices {
        let near = body
            .pieces
            .iter()
            .flat_map(meltpath_robot::hull::Hull::points);
        let near = near.map(|p| p.distance(*v)).fold(f64::INFINITY, f64::min);
        assert!(near < 1e-3, "{v} {near}");
    }
    let boxes = hulls.iter().filter(|h| h.link != 1);
    assert!(boxes.clone().all(|h| h.pieces.is_empty()));
    assert!(boxes.map(|h| h.excess.most).fold(0.0, f64::max) < 1.0);
    for text in [
        "solid\nendsolid\n",
        "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\n",
    ] {
        fs::write(&file, text).unwrap();
        let told = refused(FILE, &dir);
        assert!(
            told.contains("\"l1\"") && told.contains("one.stl"),
            "{told}"
        );
    }
}
