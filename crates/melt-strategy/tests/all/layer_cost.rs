//! What layers cost, and how warm they find those below: the short runs of `examples/layer_cost.rs`, which asserts that heat is
//! accounted for.

#[path = "../../examples/layer_cost.rs"]
#[allow(dead_code, reason = "the command has runs of its own")]
mod command;

use command::{FINE, cost_of, cube, titanium};
use meltpath_thermal::material::CELSIUS;

#[test]
fn layers_of_a_centimetre_and_a_decimetre_of_path() {
    for side in [1.0, 3.2] {
        cost_of(side, FINE, 1);
    }
}

/// What a layer finds warm hardly depends on the cells that those below were drawn on.
#[test]
#[ignore = "a minute of computing"]
fn layers_of_a_cube_grow_warm() {
    let (coarse, fine) = (cube(2, 0.48), cube(3, 0.24));
    let start = titanium().start - CELSIUS;
    assert!((fine[0][0] - start).abs() < 1e-9);
    for (a, b) in coarse.iter().zip(&fine).skip(1) {
        assert!(b[0] > start + 5.0 && b[1] > b[0], "{b:?}");
        assert!((a[0] - b[0]).abs() < 1.0, "{a:?} {b:?}");
    }
    assert!(fine[2][0] > fine[1][0] + 1.0);
}
