//! The reference heads over the range of their friction, which was written down before any job was run with it.

use meltpath_scan_head::files;

use super::controllers::{told, with_h_infinity, without_prefilter};
use super::reference::{recipes, three_axis_data, two_axis_data};

/// AC-44, table 3.1: one square of recipe 1 with the least friction of each head's file, its value and the most.
#[test]
fn lpbf_contour_shares_over_the_range_of_friction() {
    let three = meltpath_data::scan_heads::THREE_AXIS_350.text;
    let two = meltpath_data::scan_heads::TWO_AXIS_150.text;
    let mut wrong = Vec::new();
    for (text, data, recorded) in [
        (two, two_axis_data(), RECORDED[0]),
        (three, three_axis_data(), RECORDED[1]),
    ] {
        let known = files::parse_head(text).unwrap().drag;
        let end = |k: usize| known.each_ref().map(|drag| Some(drag.ends?[k]));
        let heads = [data.head.clone(), without_prefilter(with_h_infinity(&data))];
        for (head, recorded) in heads.into_iter().zip(recorded) {
            for (drags, recorded) in [end(0), [None; 3], end(1)].into_iter().zip(recorded) {
                let t = told(&head.clone().held_by(drags), &data.plate, &recipes()[0]);
                let found = [t.median[0], t.contour[0], t.contour[1], t.contour[2]];
                println!(
                    "{}: median of X {:.4} deg, below 10, 20, 30 µm {:.3?}, largest {:.1} µm",
                    head.name,
                    found[0],
                    &found[1..],
                    1e3 * t.largest
                );
                let both = found.iter().zip(recorded).map(|(f, r)| [*f, r]);
                wrong.extend(both.filter(|[found, recorded]| (found - recorded).abs() > 0.002));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// For two and for three axes, for the cascade and for H-infinity without pre-filter, with the least friction, its value and the
/// most: median tracking error of X, deg, and the shares of contour points below 10, 20 and 30 µm.
const RECORDED: [[[[f64; 4]; 3]; 2]; 2] = [
    [
        [
            [0.0202, 0.941, 0.950, 0.960],
            [0.0245, 0.122, 0.124, 0.124],
            [0.0341, 0.124, 0.124, 0.125],
        ],
        [
            [0.0007, 0.889, 0.911, 0.933],
            [0.0068, 0.615, 0.912, 0.949],
            [0.0226, 0.119, 0.119, 0.120],
        ],
    ],
    [
        [
            [0.0075, 0.606, 0.998, 1.000],
            [0.0077, 0.237, 0.238, 0.351],
            [0.0086, 0.122, 0.123, 0.123],
        ],
        [
            [0.0003, 0.973, 0.978, 0.980],
            [0.0012, 0.977, 0.982, 0.984],
            [0.0038, 0.990, 0.996, 1.000],
        ],
    ],
];
