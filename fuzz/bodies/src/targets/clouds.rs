//! Clouds of points: PLY and lines; what is read is looked through for a plate and beads.

use meltpath_perception::beads::{Look, beads};
use meltpath_perception::cloud::{Cloud, Kind};
use meltpath_perception::plate::Plate;

use super::Target;
use crate::mutate::Form;

/// Most points that are looked through.
const POINTS: usize = 2_000;

fn looked_through(kind: Kind, bytes: &[u8]) {
    let Ok(mut cloud) = Cloud::parse(kind, bytes) else {
        return;
    };
    assert!(cloud.points.iter().all(|p| p.is_finite()));
    cloud.points.truncate(POINTS);
    let Some(plate) = Plate::of(&cloud.points, 0.2) else {
        return;
    };
    let look = Look {
        near: 0.2,
        every: 5.0,
    };
    for bead in beads(&cloud.points, &plate, look).beads {
        assert!(
            bead.sections
                .iter()
                .all(|s| s.width > 0.0 && s.height > 0.0)
        );
    }
}

/// Lines of a plate with a bead across it.
fn bead() -> String {
    let rows = (0..400).flat_map(|i| (0..5).map(move |j| [i / 20, 5 * (i % 20) / 4 + j, j]));
    let line = |[x, y, j]: [i32; 3]| {
        let z = (4 - (y - 12) * (y - 12)).max(0);
        format!("{} {y} {}\n", 2 * x, f64::from(z) + 0.01 * f64::from(j))
    };
    rows.map(line).collect()
}

/// PLY files.
pub(super) const PLY: Target = Target {
    name: "cloud_ply",
    form: Form::Binary,
    seeds: || {
        let head =
            "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
        let binary = format!("ply\nformat binary_little_endian 1.0\n{head}").into_bytes();
        vec![
            format!("ply\nformat ascii 1.0\n{head}1 2 3\n4 5 6\n").into_bytes(),
            [binary, vec![0; 24]].concat(),
        ]
    },
    body: |bytes| looked_through(Kind::Ply, bytes),
};

/// Lines of x, y, z.
pub(super) const LINES: Target = Target {
    name: "cloud_lines",
    form: Form::Text,
    seeds: || {
        vec![
            b"# scan\n1;2,5;-3\nnan;nan;nan\n".to_vec(),
            bead().into_bytes(),
        ]
    },
    body: |bytes| looked_through(Kind::Lines, bytes),
};
