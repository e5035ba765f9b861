//! Passes that go on from one another: one bead over several layers, whose arc is struck once, in every dialect.

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::Program;
use meltpath_programs::upkeep::Split;
use meltpath_programs::{
    BuildSettings, CellProgramming, Dialect, Pause, Restart, build, read_toolpath,
};
use meltpath_toolpath::{Layer, Role, Toolpath};

use crate::built::{head, settings, toolpath};
use crate::dialects::{OTHERS, held, read, written};

const FEED: f64 = 400.0 / 3.0;

fn corner(k: u32) -> DVec3 {
    let (x, y) = [(0.0, 0.0), (30.0, 0.0), (30.0, 20.0), (0.0, 20.0)][k as usize % 4];
    DVec3::new(x, y, 0.4 * f64::from(k))
}

/// Three turns about a block that rise.
fn winding() -> Toolpath {
    let turn = |n: u32| {
        let mut layer = Layer::new(n + 1, 0.0);
        let mut pass = layer.begin(head(7, Role::Contour), corner(4 * n));
        for k in 1..=4 {
            pass.line_to(corner(4 * n + k));
        }
        layer
    };
    toolpath(FEED, (0..3).map(turn).collect())
}

/// Layer, role and ends of each pass of the programs, from their text.
fn passes(
    toolpath: &Toolpath,
    cell: &CellProgramming,
    asked: &BuildSettings,
) -> Vec<(u32, Role, [DVec3; 2])> {
    let built = build(toolpath, cell, asked, &Reporter::new()).unwrap();
    let built = held(built, asked.dialect);
    let files = written(&built, cell).unwrap();
    let programs: Vec<Program> = files
        .iter()
        .map(|f| read(asked.dialect, f, cell).program)
        .collect();
    let known = cell.execution(12.5);
    let reading = read_toolpath(&programs, &known, 1e3, &Reporter::new()).unwrap();
    assert_eq!(reading.gaps, [], "{:?}", asked.dialect);
    let of = |p: meltpath_toolpath::Pass<'_>| {
        let ends = [p.points[0], p.points[p.points.len() - 1]];
        (p.layer, p.head.role, ends)
    };
    reading.toolpath.passes().map(of).collect()
}

fn asked(dialect: Dialect, from: Option<Restart>) -> BuildSettings {
    BuildSettings {
        dialect,
        from,
        ..settings(Pause::Wait(30.0))
    }
}

#[test]
fn a_bead_that_winds_up_has_one_arc() {
    for dialect in std::iter::once(Dialect::FanucLs).chain(OTHERS) {
        for split in [Split::Layer, Split::Limits] {
            let mut cell = crate::dialects::cell(&[FEED]);
            cell.split.value = split;
            let all = passes(&winding(), &cell, &asked(dialect, None));
            let laid = || all.iter().filter(|p| p.1.deposits());
            let layers: Vec<u32> = laid().map(|p| p.0).collect();
            assert_eq!(layers, [1, 2, 3], "{dialect:?}");
            let first = all.iter().position(|p| p.1.deposits()).unwrap();
            // nothing between them: no travel, no pause
            let run = &all[first..first + 3];
            assert!(run.iter().all(|p| p.1.deposits()), "{dialect:?}: {all:?}");
            for pair in run.windows(2) {
                assert_eq!(pair[0].2[1], pair[1].2[0], "{dialect:?}");
            }
            assert!(run[2].2[1].distance(corner(12)) < 2e-3, "{dialect:?}");
        }
    }
}

/// From its second turn on it is struck afresh, and winds on.
#[test]
fn the_rest_of_a_winding_bead_is_struck_once() {
    let cell = crate::dialects::cell(&[FEED]);
    let from = Some(Restart { layer: 2, bead: 1 });
    let all = passes(&winding(), &cell, &asked(Dialect::FanucLs, from));
    let laid: Vec<_> = all.iter().filter(|p| p.1.deposits()).collect();
    assert_eq!(laid.iter().map(|p| p.0).collect::<Vec<_>>(), [2, 3]);
    assert!(laid[0].2[0].distance(corner(4)) < 2e-3);
    assert_eq!(laid[0].2[1], laid[1].2[0]);
}

/// Two beads of one place but of their own are two beads.
#[test]
fn beads_of_their_own_stop_in_between() {
    let mut plan = winding();
    for (n, layer) in (20..).zip(&mut plan.layers) {
        layer.rename(layer.number, &[meltpath_toolpath::PassId(n)]);
    }
    let cell = crate::dialects::cell(&[FEED]);
    let all = passes(&plan, &cell, &asked(Dialect::FanucLs, None));
    let burns: Vec<bool> = all.iter().map(|p| p.1.deposits()).collect();
    let struck = burns.windows(2).filter(|w| !w[0] && w[1]).count();
    assert_eq!(struck + usize::from(burns[0]), 3, "{all:?}");
}
