//! Corners of beads that other programs round farther than the corner model of the cell reaches.

use meltpath_base::Reporter;
use meltpath_programs::{Dialect, Missing, dialect, read_toolpath};

use crate::dialects::cell;

/// Why a bead of a script round a corner is not simulated whole, whose corner turns by `turn` deg after 40 mm and is left `radius` mm before it.
fn whys(radius: f64, turn: f64, second: f64) -> Vec<Missing> {
    let (sin, cos) = turn.to_radians().sin_cos();
    let [x, y] = [0.04 + 1e-3 * second * cos, 1e-3 * second * sin];
    let script = format!(
        "def p():\n  movel(pose_trans(Part,p[0,0,0,0,3.14159265,0]),v=0.02)\n  set_job(1)\n  set_analog_out(0, 6)\n  set_digital_out(0, True)\n  movel(pose_trans(Part,p[0.04,0,0,0,3.14159265,0]),v=0.01,r={})\n  movel(pose_trans(Part,p[{x},{y},0,0,3.14159265,0]),v=0.01)\n  set_digital_out(0, False)\nend\n",
        radius / 1000.0
    );
    let cell = cell(&[100.0]);
    let parsed = dialect::read(Dialect::UrScript, script.as_bytes(), None, &cell).unwrap();
    let program = parsed.into_iter().next().unwrap().program;
    let settings = cell.execution(10.0);
    let reading = read_toolpath(&[program], &settings, 1000.0, &Reporter::new()).unwrap();
    reading.gaps.into_iter().map(|g| g.why).collect()
}

/// The cell's own distance is 4 mm, and half a millimetre is not seen: 20 mm leave a square corner by 7 mm.
#[test]
fn a_corner_that_is_rounded_farther_than_the_model_reaches_is_told() {
    for (radius, turn, second, told) in [
        (4.0, 90.0, 40.0, false),
        (5.0, 90.0, 40.0, false),
        (18.0, 90.0, 40.0, true),
        (18.0, 180.0, 40.0, true),
        // nothing is left on a straight way, and no more than the half of a short move
        (18.0, 0.0, 40.0, false),
        (18.0, 90.0, 9.0, false),
    ] {
        let whys = whys(radius, turn, second);
        let wanted: Vec<Missing> = told
            .then_some(Missing::Zone(radius, 4.0))
            .into_iter()
            .collect();
        assert_eq!(whys, wanted, "{radius} {turn} {second}");
    }
}
