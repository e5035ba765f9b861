//! From a bench's file to a motor.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fmt::Write;
use std::fs;

use meltpath::identify::{IdentifyError, identify};
use meltpath_base::Reporter;
use meltpath_machine::scan_head::data;
use meltpath_machine::scan_head::friction::Friction;
use meltpath_machine::scan_head::galvanometer::Galvanometer;
use meltpath_machine::scan_head::plant::Plant;
use meltpath_perception::RecordError;

const MAPPING: &str = "time = { column = \"t\", unit = \"us\" }
[channels.voltage]
column = \"U\"
unit = \"V\"
[channels.current]
column = \"i\"
unit = \"mA\"
[channels.angle]
column = \"n\"
unit = \"deg\"
scale = 1e-5
offset = 1000000
";

#[test]
fn a_csv_of_counts_gives_the_motor_that_made_it() {
    let head = data::parse(include_str!("../../../data/scan-heads/two-axis-150.toml")).unwrap();
    let motor = Galvanometer {
        friction: Friction::None,
        ..head.head.mirrors[1].motor.clone()
    };
    let mut plant = Plant::<5>::new(&motor, &[50e-6], 0.0).unwrap();
    let mut text = String::from("t,U,i,n\n");
    let mut register = 0x1u32;
    for k in 0..90_000u32 {
        // a shift register of 16 stages
        let bit = (register ^ (register >> 1) ^ (register >> 3) ^ (register >> 12)) & 1;
        register = (register >> 1) | (bit << 15);
        let voltage = if register & 1 == 1 { 0.5 } else { -0.5 };
        let counts = 1e6 + (plant.angle().to_degrees() * 1e5).round();
        writeln!(
            text,
            "{},{voltage},{:.4},{counts}",
            50 * k,
            1e3 * plant.current()
        )
        .unwrap();
        plant.advance(0, voltage, 0.0);
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("bench.csv"), &text).unwrap();
    fs::write(at("map.toml"), MAPPING).unwrap();
    let found = identify(&at("bench.csv"), &at("map.toml"), &Reporter::new()).unwrap();
    let off = |a: f64, b: f64| (a / b - 1.0).abs();
    let got = &found.found.motor;
    assert!(off(got.resistance, motor.resistance) < 0.02, "{got:?}");
    assert!(off(got.inertia, motor.inertia) < 0.03, "{got:?}");
    assert!(
        off(got.torque_constant, motor.torque_constant) < 0.03,
        "{got:?}"
    );
    assert!(
        found.prediction.current.fit > 0.9,
        "{:?}",
        found.prediction.current
    );
    assert!(found.lines(&at("bench.csv"))[1].contains("Ω"));

    // angle and current exchanged: what comes out is no motor, or the record is noted as odd
    let swapped = MAPPING
        .replace("\"i\"", "\"x\"")
        .replace("\"n\"", "\"i\"")
        .replace("\"x\"", "\"n\"");
    fs::write(at("swapped.toml"), swapped).unwrap();
    let reporter = Reporter::new();
    let result = identify(&at("bench.csv"), &at("swapped.toml"), &reporter);
    let noted = reporter
        .warnings()
        .iter()
        .any(|w| w.code == "channels-exchanged");
    assert!(noted || result.is_err());
    let error = identify(&at("bench.csv"), &at("absent.toml"), &Reporter::new()).unwrap_err();
    assert!(matches!(
        error,
        IdentifyError::Record(RecordError::File { .. })
    ));
}
