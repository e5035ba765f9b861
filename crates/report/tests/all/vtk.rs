//! ParaView files: structure by golden, sizes and offsets by reading them back.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_report::scene::{Grid, LineSet, Polyline, Scalar, Stroke, Visibility};
use meltpath_report::vtk::{Field, Values, VtkError, write_height_image, write_lines};

/// The XML before the appended bytes, and those bytes.
fn split(file: &[u8]) -> (String, &[u8]) {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let at = file.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let tail = b"\n</AppendedData>\n</VTKFile>\n";
    assert!(file.ends_with(tail));
    let xml = String::from_utf8(file[..at].to_vec()).unwrap();
    (xml, &file[at..file.len() - tail.len()])
}

/// Each array's bytes, by the sizes that stand before them.
fn arrays(mut bytes: &[u8]) -> Vec<&[u8]> {
    let mut all = Vec::new();
    while let Some((size, rest)) = bytes.split_at_checked(8) {
        let size = u64::from_le_bytes(size.try_into().unwrap()) as usize;
        all.push(&rest[..size]);
        bytes = &rest[size..];
    }
    assert!(bytes.is_empty());
    all
}

fn int64(bytes: &[u8]) -> Vec<i64> {
    bytes
        .chunks(8)
        .map(|b| i64::from_le_bytes(b.try_into().unwrap()))
        .collect()
}

fn two_lines() -> LineSet {
    LineSet {
        name: "path".to_owned(),
        points: (0..5)
            .map(|i| DVec3::new(f64::from(i), 0.5, 1.65))
            .collect(),
        polylines: vec![
            Polyline { first: 0, layer: 1 },
            Polyline { first: 2, layer: 2 },
        ],
        scalars: vec![Scalar::new("speed <x>", "mm/s", vec![12.5; 5])],
        stroke: Stroke::Hairline,
        visibility: Visibility::Shown,
    }
}

#[test]
fn lines_keep_their_structure() {
    let mut out = Vec::new();
    write_lines(&mut out, &two_lines()).unwrap();
    let (xml, bytes) = split(&out);
    insta::assert_snapshot!(xml);
    let arrays = arrays(bytes);
    assert_eq!(arrays[0].len(), 20, "speed");
    assert_eq!(int64(arrays[1]), [1, 2], "layer of each line");
    assert_eq!(arrays[2].len(), 5 * 24, "points");
    assert_eq!(int64(arrays[3]), [0, 1, 2, 3, 4], "connectivity");
    assert_eq!(int64(arrays[4]), [2, 5], "ends");
}

#[test]
fn offsets_point_at_the_arrays() {
    let mut out = Vec::new();
    write_lines(&mut out, &crate::demo::lines(1.0)[0]).unwrap();
    let (xml, bytes) = split(&out);
    let mut expected = 0;
    let mut found = Vec::new();
    for array in arrays(bytes) {
        found.push(expected);
        expected += 8 + array.len();
    }
    let offsets: Vec<usize> = xml
        .split("offset=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap().parse().unwrap())
        .collect();
    assert_eq!(offsets, found);
}

#[test]
fn a_height_image_states_its_grid() {
    let grid = Grid {
        origin: DVec2::new(0.25, -3.0),
        cell: 0.5,
        nx: 3,
        ny: 2,
    };
    let heights = [0.0, 1.0, 2.0, 3.0, 4.0, f64::NAN];
    let field = Field {
        name: "height",
        unit: "mm",
        values: Values::Float64(&heights),
    };
    let mut out = Vec::new();
    write_height_image(&mut out, &grid, 0.0, &[field]).unwrap();
    let (xml, bytes) = split(&out);
    insta::assert_snapshot!(xml);
    assert_eq!(arrays(bytes)[0].len(), 48);
}

#[test]
fn what_does_not_fit_is_refused_before_a_byte_is_written() {
    let mut lines = two_lines();
    lines.scalars[0].values.pop();
    let grid = Grid {
        origin: DVec2::ZERO,
        cell: 0.5,
        nx: 3,
        ny: 2,
    };
    let short = Field {
        name: "height",
        unit: "mm",
        values: Values::Float64(&[0.0; 5]),
    };
    let mut out = Vec::new();
    let refused = [
        write_lines(&mut out, &lines),
        write_height_image(&mut out, &grid, 0.0, &[short]),
        write_height_image(
            &mut out,
            &Grid {
                cell: f64::NAN,
                ..grid
            },
            0.0,
            &[],
        ),
    ];
    for result in refused {
        assert!(matches!(result, Err(VtkError::Scene(_))));
    }
    assert!(out.is_empty());
}
