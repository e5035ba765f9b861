//! What machines are: robots and their cells, guns, motors, controllers of axes, tunings, histories of health.

use std::fmt::Write as _;
use std::path::Path;

use meltpath::data::Cell;
use meltpath::ebm::gun::focus;
use meltpath::health::history::{Entry, History};
use meltpath::job::Written;
use meltpath::tune::{file::TuneFile, settings as tuning};
use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::export::{AntiWindup, Exported, Word};
use meltpath_control::{StateSpace, TransferFunction};
use meltpath_data::{cells, focus as focus_data, guns, robots, scan_heads};
use meltpath_robot::cell::{self, from_urdf};
use meltpath_scan_head::axis::control::{AngleUnit, Controller};
use meltpath_scan_head::files::{parse_head, parse_motor};
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::health::rating::rate;
use meltpath_scan_head::servo::file::{AxisController, ControllerFile, SCHEMA, StoredLaw};

use super::{Target, files, in_file, shipped, text, with_text};

/// Cells as they look to a program's writer: the one that ships, those of the examples, one with words for every dialect.
pub(super) const CELL: Target = text(
    "cell",
    || {
        let mut seeds = shipped(cells::ALL);
        for example in ["torus-on-positioner", "torus-on-flange", "dome"] {
            let with = |bytes: &Vec<u8>| bytes.windows(9).any(|w| w == b"[program]");
            let all = files(&format!("examples/{example}"), &["toml"], 1 << 16);
            seeds.extend(all.into_iter().filter(with));
        }
        seeds.push(super::dialects::cell_text().into_bytes());
        seeds
    },
    |bytes| {
        in_file(bytes, ".toml", |path| {
            let _ = Cell::load(&path.to_string_lossy(), Path::new("."));
        });
    },
);

/// Robots with what stands around them: what is read has a place for everything, and finds the pose that it is in.
pub(super) const ROBOT: Target = text(
    "robot",
    || {
        let mut seeds = shipped(robots::ALL);
        let robot = |bytes: &Vec<u8>| bytes.windows(6).any(|w| w == b"[arm]\n");
        let flange = files("examples/torus-on-flange", &["toml"], 1 << 16);
        seeds.extend(flange.into_iter().filter(robot));
        let track = "\n[track]\nsource = \"fuzz\"\nposition = [\"0 mm\", \"0 mm\", \"0 mm\"]\naxis = [1, 0, 0]\n\
            low = \"-1 m\"\nhigh = \"4 m\"\nspeed = \"1 m/s\"\n";
        let arm = robots::ABB_IRB2600_12_185.text;
        seeds.push(format!("{arm}{track}").into_bytes());
        seeds
    },
    |bytes| {
        with_text(bytes, |text| {
            if let Ok(cell) = cell::read(text) {
                stands(&cell);
            }
        });
    },
);

/// The arm stands somewhere and, where that can be told backwards, is found there.
fn stands(cell: &cell::Cell) {
    let values = cell.at_rest();
    let frames = cell.frames(&values);
    let flange = cell.arm.forward(values.arm);
    let place = flange.position;
    assert!(place.is_finite(), "a flange that is nowhere");
    let _ = (cell.guesses(), cell.beyond(values.external()));
    let tip = frames.part_from_wire_tip();
    if let Ok(found) = cell.arm.inverse(cell.base_from_flange(tip, &values)) {
        for solution in &found.solutions {
            assert!(solution.angles.iter().all(|a| a.is_finite()));
        }
    }
}

/// A URDF of an arm in a row, by rows of place in m, angles in rad, axis.
fn urdf(rows: &[([f64; 3], [f64; 3], [f64; 3])]) -> Vec<u8> {
    let mut text =
        "<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n<link name=\"l0\"/>\n".to_owned();
    for (i, (xyz, rpy, axis)) in rows.iter().enumerate() {
        let three = |v: &[f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        let _ = writeln!(
            text,
            "<link name=\"l{n}\"/>\n<joint name=\"j{i}\" type=\"revolute\">\n<origin xyz=\"{}\" rpy=\"{}\"/>\n<parent link=\"l{i}\"/>\n\
            <child link=\"l{n}\"/>\n<axis xyz=\"{}\"/>\n<limit lower=\"-3\" upper=\"2.5\" velocity=\"3.5\" effort=\"0\"/>\n</joint>",
            three(xyz),
            three(rpy),
            three(axis),
            n = i + 1
        );
    }
    let end = "<joint name=\"flange\" type=\"fixed\">\n<origin xyz=\"0 0 0\" rpy=\"3.14159 -1.5708 0\"/>\n<parent link=\"l6\"/>\n\
        <child link=\"tool0\"/>\n</joint>\n<transmission name=\"t\"><joint name=\"j0\"><hardwareInterface/></joint></transmission>\n</robot>\n";
    (text + end).into_bytes()
}

/// Robots as ROS describes them: what is taken from them is a robot's file.
pub(super) const URDF: Target = text(
    "urdf",
    || {
        let quarter = std::f64::consts::FRAC_PI_2;
        let (x, y, z) = ([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let none = [0.0; 3];
        vec![
            urdf(&[
                ([0.0, 0.0, 0.525], none, z),
                ([0.15, 0.0, 0.0], none, y),
                ([0.0, 0.0, 0.79], none, [0.0, -1.0, 0.0]),
                ([0.0, 0.0, 0.25], none, x),
                ([0.835, 0.0, 0.0], none, [0.0, -1.0, 0.0]),
                ([0.1, 0.0, 0.0], none, x),
            ]),
            urdf(&[
                ([0.0, 0.0, 0.1807], none, z),
                (none, [quarter, 0.0, 0.0], z),
                ([-0.6127, 0.0, 0.0], none, z),
                ([-0.57155, 0.0, 0.17415], none, z),
                ([0.0, -0.11985, 0.0], [quarter, 0.0, 0.0], z),
                ([0.0, 0.11655, 0.0], [-quarter, 0.0, 0.0], z),
            ]),
        ]
    },
    |bytes| {
        with_text(bytes, |text| {
            let Ok(robot) = from_urdf(text) else {
                return;
            };
            match cell::read(&robot) {
                Ok(cell) => stands(&cell),
                // its values may be refused, its form may not
                Err(problems) => {
                    let form = |p: &meltpath_base::settings::Problem| p.message.contains("TOML");
                    assert!(!problems.0.iter().any(form), "{problems}\n{robot}");
                }
            }
        });
    },
);

/// Electron guns.
pub(super) const GUN: Target = text(
    "gun",
    || shipped(guns::ALL),
    |bytes| {
        with_text(bytes, |text| {
            if let Ok(gun) = meltpath_gun::machine::parse(text) {
                for power in [0.0, 60.0, 3000.0] {
                    assert!(gun.widening(power) > 0.0, "a spot without width");
                }
            }
        });
    },
);

/// Focus calibrations: every diameter is one, and is found again.
pub(super) const FOCUS: Target = text(
    "focus",
    || shipped(focus_data::ALL),
    |bytes| {
        in_file(bytes, ".toml", |path| {
            let read = focus::load(&path.to_string_lossy(), Path::new("."));
            if let Ok((calibration, _)) = read {
                for current in [-1.0, 0.0, 1e-3, 4e-3, 8e-3, 1e3] {
                    if let Ok(diameter) = calibration.diameter(current) {
                        assert!(diameter > 0.0, "a spot without width");
                    }
                }
            }
        });
    },
);

fn head() -> ScanHead {
    parse_head(scan_heads::TWO_AXIS_150.text).unwrap().head
}

/// Motors as an identification prints them: an axis with one runs, or says why not.
pub(super) const MOTOR: Target = text(
    "motor",
    || {
        vec![
            b"resistance = { value = \"2.31 ohm\", uncertainty = \"0.02 ohm\", source = \"identified\" }\n\
            inductance = { value = \"0.17 mH\", source = \"identified\" }\n\
            torque_constant = { value = \"9.4e-3 N*m/A\", source = \"identified\" }\n\
            back_emf = { value = \"9.4e-3 V*s/rad\", source = \"identified\" }\n\
            inertia = { value = \"1.6e-7 kg*m2\", source = \"identified\" }\n\
            viscous = { value = \"4e-6 N*m*s/rad\", source = \"identified\" }\n\
            coulomb = { value = \"1e-4 N*m\", source = \"identified\" }\nbias = { value = \"1e-5 N*m\", source = \"identified\" }\n\
            [[mode]]\nfrequency = { value = \"3000 Hz\", source = \"identified\" }\n\
            damping = { value = 0.01, source = \"identified\" }\ngain_ratio = { value = -0.4, source = \"identified\" }\n"
                .to_vec(),
        ]
    },
    |bytes| {
        with_text(bytes, |text| {
            let head = head();
            let mut axis = head.mirrors[0].motor().unwrap().clone();
            if let Ok(told) = parse_motor(text, &axis.motor) {
                axis.motor = told.motor;
                let _ = axis.check_stable(head.period);
            }
        });
    },
);

/// Tunings of axes, as far as nothing is computed.
pub(super) const TUNE: Target = text(
    "tune",
    || files("examples/scan-head-tune", &["toml"], 1 << 16),
    |bytes| {
        with_text(bytes, |text| {
            let read = Written::<TuneFile>::parse(text, TuneFile::check);
            let _ = read.map(|file| tuning::resolve(&file, Path::new("/nowhere")));
        });
    },
);

/// Controllers of two axes in the forms that a tuning writes.
fn controllers() -> Vec<Vec<u8>> {
    let head = head();
    let axis = head.mirrors[0].motor().unwrap();
    let Controller::Cascade(gains) = &axis.controller else {
        panic!("the head that ships has a cascade");
    };
    let lead = TransferFunction::new([2.0, 900.0, 4e4], [1.0, 3e3, 0.0]).unwrap();
    let system: StateSpace = lead.to_state_space().unwrap();
    let sampled = discretise(&system, head.period, Hold::First).unwrap();
    let follow = AntiWindup::Conditioned;
    let fixed = Word::Fixed {
        coefficient: 22,
        signal: 20,
    };
    let exported = |export: Exported| StoredLaw::Exported {
        export,
        unit: AngleUnit::Degree,
        current: gains.current,
        feed_forward: gains.feed_forward,
    };
    let sections = |word| Exported::sections("law", &sampled, word, Some(8.0), follow).unwrap();
    let state_space = Exported::state_space("law", &sampled, Word::Single, Some(8.0), follow);
    let laws = [
        [
            StoredLaw::Cascade { gains: *gains },
            exported(sections(Word::Double)),
        ],
        [exported(sections(fixed)), exported(state_space.unwrap())],
    ];
    let file = |laws: [StoredLaw; 2]| {
        let axes = ['x', 'y'].into_iter().zip(laws);
        let axes = axes.map(|(letter, law)| AxisController {
            axis: letter,
            design: "fuzz".to_owned(),
            motor: axis.motor.clone(),
            law,
        });
        let file = ControllerFile {
            schema: SCHEMA.to_owned(),
            head: "two-axis-150".to_owned(),
            axes: axes.collect(),
        };
        serde_json::to_vec_pretty(&file).unwrap()
    };
    laws.map(file).to_vec()
}

/// Controllers of a head's axes: with those that it takes it runs, or says why not.
pub(super) const CONTROLLERS: Target = text("controllers", controllers, |bytes| {
    let Ok(file) = serde_json::from_slice::<ControllerFile>(bytes) else {
        return;
    };
    let mut head = head();
    if file.apply(&mut head).is_err() {
        return;
    }
    let period = head.period;
    for axis in head.driven_mirrors() {
        let Ok(runs) = axis.start(period, 0.0, 1) else {
            continue;
        };
        let steps: Vec<f64> = (0..200).map(|k| f64::from(k % 50) * 1e-5).collect();
        let _ = runs.record(&steps);
    }
});

/// Histories of the health of an axis: a test is added to what is read, and then read too.
pub(super) const HEALTH_HISTORY: Target = text(
    "health_history",
    || {
        let line = |time: &str, accepted: bool, resistance: f64| {
            format!(
                "{{\"schema\":\"meltpath-km0/1\",\"accepted\":{accepted},\"rating\":\"good\",\"reasons\":[\"resistance +12.0 %\"],\
                \"record\":{{\"axis\":\"axis\",\"time\":\"{time}\",\"temperature\":null,\"resistance\":{resistance},\"inductance\":1.7e-4,\
                \"torque_constant\":0.0094,\"inertia\":1.6e-7,\"modes\":[3000.0,7000.5],\"fit_residual\":0.01,\"stage2\":{{\
                \"steps\":[{{\"amplitude_deg\":1.0,\"steady_from\":0.01,\"steady_deg\":0.999,\"start_delay\":2e-5,\"overshoot\":0.01,\
                \"response_time\":0.0004,\"static_error_deg\":0.001}}],\
                \"ramps\":[{{\"speed_deg\":100.0,\"steady_speed_deg\":99.9,\"amplitude_deg\":1.0,\"lag_deg\":0.02,\
                \"speed_response_time\":0.0003,\"current\":0.1,\"torque\":0.001}}],\
                \"friction\":{{\"viscous\":4e-6,\"bias\":1e-5,\"coulomb\":1e-4,\"residual\":1e-6,\"residual_viscous\":2e-5}}}}}}}}\n"
            )
        };
        let three = line("2026-01-05T08:00:00Z", true, 2.31)
            + &line("2026-02-02T08:00:00Z", false, 2.35)
            + &line("2026-03-02T08:00:00Z", false, 2.6);
        vec![three.into_bytes()]
    },
    |bytes| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("axis.jsonl"), bytes).unwrap();
        let Ok(mut history) = History::open(folder.path(), "axis") else {
            return;
        };
        let Some(last) = history.entries().last().map(|e| e.record.clone()) else {
            return;
        };
        let drifts = rate(history.reference().unwrap(), &last, &[]);
        let entry = Entry::new(last, false, drifts[0].rating, &drifts);
        history.add(entry).unwrap();
        let again = History::open(folder.path(), "axis").expect("what is added can be read");
        assert_eq!(again, history);
    },
);
