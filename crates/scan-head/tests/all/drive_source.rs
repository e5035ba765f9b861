//! What leaves for a drive is what was judged: its C code, compiled, gives the bits of the axis' own law, feed-forward included.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::export::{AntiWindup, Beside, Exported, Word};
use meltpath_control::{StateSpace, TransferFunction};
use meltpath_scan_head::axis::control::{
    AngleUnit, Limits, Sampled, SampledController, SampledForm,
};

use super::reference_axis::synthesised;

const PERIOD: f64 = 50e-6;
const LIMITS: Limits = Limits {
    voltage: 48.0,
    current: 2.0,
};
const SAMPLES: usize = 2000;

/// A lead with an integrator, sampled every `every` samples.
fn law(every: u32) -> StateSpace {
    let law = TransferFunction::new([0.03, 60.0, 9000.0], [1.0, 9000.0, 0.0]).unwrap();
    let period = PERIOD * f64::from(every);
    discretise(&law.to_state_space().unwrap(), period, Hold::First).unwrap()
}

/// Set-point and measured angle of a sample, rad.
fn inputs(k: usize) -> [f64; 2] {
    let t = k as f64 * PERIOD;
    let set_point = 0.2 + 0.1 * (300.0 * t).sin() + if k > 900 { 0.02 } else { 0.0 };
    [
        set_point,
        set_point - 0.004 * (900.0 * t).sin() - 0.0003 * (5000.0 * t).cos(),
    ]
}

/// The current set-points of the judged law, A.
fn judged(export: &Exported, every: u32) -> Vec<f64> {
    let controller = SampledController {
        form: SampledForm::Exported(export.clone()),
        unit: AngleUnit::Degree,
        every,
        current: synthesised().current,
        feed_forward: synthesised().feed_forward,
    };
    let mut law = Sampled::new(&controller, LIMITS, PERIOD, inputs(0)[0]).unwrap();
    (0..SAMPLES)
        .map(|k| {
            let [set_point, angle] = inputs(k);
            law.current(set_point, angle)
        })
        .collect()
}

fn beside(every: u32) -> Beside {
    let forward = synthesised().feed_forward;
    Beside {
        gain: forward.acceleration_gain(),
        filter: forward.filter,
        period: PERIOD,
        every,
        per_unit: AngleUnit::Degree.per_radian(),
        limit: LIMITS.current,
    }
}

/// The C file compiled, and run on the same inputs, which it reads and writes as the bits of doubles.
fn compiled(export: &Exported, every: u32, folder: &Path) -> Vec<f64> {
    let mut code = export.to_c_beside(&beside(every));
    let name = &export.name;
    write!(
        code,
        "#include <stdio.h>\nint main(void) {{ {name}_drive_state s; double in[2], out; int first = 1;\n\
         while (fread(in, sizeof in, 1, stdin) == 1) {{ if (first) {name}_start(&s, in[0]); first = 0;\n\
         out = {name}_drive(&s, in[0], in[1]); fwrite(&out, sizeof out, 1, stdout); }} return 0; }}\n"
    )
    .unwrap();
    let (source, program, given) = (folder.join("k.c"), folder.join("k"), folder.join("in"));
    std::fs::write(&source, code).unwrap();
    let built = Command::new("cc")
        .args([
            "-std=c99",
            "-Wall",
            "-Werror",
            "-O2",
            "-ffp-contract=off",
            "-o",
        ])
        .args([&program, &source])
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{told}");
    let bytes: Vec<u8> = (0..SAMPLES)
        .flat_map(inputs)
        .flat_map(f64::to_ne_bytes)
        .collect();
    std::fs::write(&given, bytes).unwrap();
    let stdin = std::fs::File::open(&given).unwrap();
    let out = Command::new(&program).stdin(stdin).output().unwrap();
    let (numbers, []) = out.stdout.as_chunks::<8>() else {
        panic!("whole numbers")
    };
    numbers.iter().map(|b| f64::from_ne_bytes(*b)).collect()
}

#[test]
#[ignore = "needs a C compiler (cc)"]
fn the_c_code_of_a_drive_gives_the_bits_of_the_judged_law() {
    let folder = std::env::temp_dir().join(format!("meltpath-drive-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let fixed = Word::Fixed {
        coefficient: 22,
        signal: 22,
    };
    for word in [Word::Double, Word::Single, fixed] {
        for every in [1, 2] {
            let export =
                Exported::sections("k", &law(every), word, Some(1.5), AntiWindup::Conditioned)
                    .unwrap();
            let ours = judged(&export, every);
            let theirs = compiled(&export, every, &folder);
            assert_eq!(ours.len(), theirs.len());
            for (k, (a, b)) in ours.iter().zip(&theirs).enumerate() {
                assert!(a.to_bits() == b.to_bits(), "{word:?} {every} {k}: {a} {b}");
            }
            let cut = ours.iter().filter(|i| i.abs() == LIMITS.current).count();
            assert!(cut > 0 && cut < SAMPLES / 4, "{cut}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The feed-forward acts where the error is nought: a file without it gives no current there.
#[test]
fn the_judged_law_gives_current_without_error() {
    let export = Exported::sections("k", &law(1), Word::Double, None, AntiWindup::None).unwrap();
    let controller = SampledController {
        form: SampledForm::Exported(export),
        unit: AngleUnit::Degree,
        every: 1,
        current: synthesised().current,
        feed_forward: synthesised().feed_forward,
    };
    let mut law = Sampled::new(&controller, LIMITS, PERIOD, 0.0).unwrap();
    // 1000 rad/s²
    let mut last = 0.0;
    for k in 0..400 {
        let t = f64::from(k) * PERIOD;
        let angle = 500.0 * t * t;
        last = law.current(angle, angle);
    }
    let expected = 1000.0 * beside(1).gain;
    super::near(last, expected, 1e-6 * expected);
}
