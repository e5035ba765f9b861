//! Exported controllers run as the controller they come from, in every word, and as their C code does.
use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::export::{AntiWindup, ExportError, Exported, Word};
use meltpath_control::simulate::Running;
use meltpath_control::{Complex64, Domain, Matrix, StateSpace, TransferFunction, ZeroPoleGain};

const PERIOD: f64 = 50e-6;
const FIXED: Word = Word::Fixed {
    coefficient: 24,
    signal: 24,
};

/// A servo controller like the scan head's: integrator, notch, roll-off.
fn controller() -> StateSpace {
    let c = Complex64::new;
    let continuous = ZeroPoleGain::new(
        vec![
            c(-9.0, 0.0),
            c(-1800.0, 0.0),
            c(-400.0, 25_000.0),
            c(-400.0, -25_000.0),
        ],
        vec![
            c(0.0, 0.0),
            c(-14_000.0, 0.0),
            c(-8600.0, 19_000.0),
            c(-8600.0, -19_000.0),
            c(-28_000.0, 0.0),
        ],
        3.0e5,
    );
    discretise(&continuous.to_state_space().unwrap(), PERIOD, Hold::First).unwrap()
}

fn input(k: usize) -> f64 {
    let t = k as f64 * PERIOD;
    0.05 * (t * 700.0).sin() + 0.02 * (t * 5100.0).cos() - 0.01
}

fn exports(word: Word, limit: Option<f64>, anti: AntiWindup) -> Vec<Exported> {
    vec![
        Exported::sections("k_sections", &controller(), word, limit, anti).unwrap(),
        Exported::state_space("k_states", &controller(), word, limit, anti).unwrap(),
    ]
}

#[test]
fn every_word_runs_the_controller() {
    for (word, within) in [(Word::Double, 1e-9), (Word::Single, 1e-3), (FIXED, 1e-3)] {
        for export in exports(word, None, AntiWindup::None) {
            let mut ideal = Running::new(&controller()).unwrap();
            let mut runs = export.running();
            let (mut worst, mut size) = (0.0f64, 0.0f64);
            let mut y = [0.0];
            for k in 0..4000 {
                ideal.step(&[input(k)], &mut y);
                worst = worst.max((runs.step(input(k)) - y[0]).abs());
                size = size.max(y[0].abs());
            }
            assert!(
                worst < within * size,
                "{word:?} {} {worst} of {size}",
                export.name
            );
        }
    }
}

#[test]
fn conditioned_states_come_back_at_once() {
    // an integrating controller held in saturation for long, then the error changes sign
    let pi = TransferFunction::new([2.0, 400.0], [1.0, 0.0]).unwrap();
    let pi = discretise(&pi.to_state_space().unwrap(), 1e-3, Hold::First).unwrap();
    let back = |export: Exported| {
        let mut runs = export.running();
        for _ in 0..1000 {
            assert!(runs.step(1.0).abs() <= 3.0);
        }
        (0..5000).position(|_| runs.step(-1.0) < 0.0).unwrap()
    };
    for form in [Exported::sections, Exported::state_space] {
        let export = |anti| form("pi", &pi, Word::Double, Some(3.0), anti).unwrap();
        assert!(back(export(AntiWindup::Conditioned)) <= 2);
        assert!(back(export(AntiWindup::None)) > 500);
    }
}

#[test]
fn refusals() {
    let k = controller();
    let sections =
        |name, word, limit| Exported::sections(name, &k, word, limit, AntiWindup::Conditioned);
    assert!(matches!(
        sections("2k", Word::Double, None),
        Err(ExportError::Name { .. })
    ));
    assert!(matches!(
        sections("k", Word::Double, Some(-1.0)),
        Err(ExportError::Limit { .. })
    ));
    let short = Word::Fixed {
        coefficient: 3,
        signal: 20,
    };
    // a slowly decaying rotation: three bits round it outwards
    let (c, d) = (0.995 * 0.3f64.cos(), 0.995 * 0.3f64.sin());
    let rotation = StateSpace::new(
        Matrix::from_rows([[c, d], [-d, c]]),
        Matrix::column([1.0, 0.0]),
        Matrix::row([1.0, 0.0]),
        Matrix::zeros(1, 1),
        Domain::Sampled { period: PERIOD },
    )
    .unwrap();
    let export = |word| Exported::state_space("k", &rotation, word, None, AntiWindup::None);
    assert!(matches!(export(short), Err(ExportError::Unstable { .. })));
    assert!(export(FIXED).is_ok());
    let long = Word::Fixed {
        coefficient: 30,
        signal: 24,
    };
    assert!(matches!(
        sections("k", long, None),
        Err(ExportError::Word { .. })
    ));
}

#[test]
fn mat_files_hold_what_runs() {
    let export = &exports(Word::Single, Some(5.0), AntiWindup::Conditioned)[0];
    let bytes = export.to_mat();
    let int = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    assert_eq!([int(0), int(4), int(8), int(12), int(16)], [0, 1, 1, 0, 3]);
    assert_eq!(&bytes[20..23], b"Ts\0");
    assert_eq!(number(23), PERIOD);
}

/// Whoever changes the C code sees it here, without a compiler; what it computes, [`c_code_gives_the_same_bits`] tells.
#[test]
fn c_code_is_as_it_was_reviewed() {
    // figures that no processor rounds
    let lag = StateSpace::new(
        Matrix::from_rows([[0.5]]),
        Matrix::column([1.0]),
        Matrix::row([0.25]),
        Matrix::from_rows([[2.0]]),
        Domain::Sampled { period: 1e-3 },
    )
    .unwrap();
    let mut code = String::new();
    for (word, limit) in [(Word::Double, None), (FIXED, Some(3.0))] {
        for form in [Exported::sections, Exported::state_space] {
            let export = form("lag", &lag, word, limit, AntiWindup::Conditioned).unwrap();
            code += &export.to_c();
        }
    }
    insta::assert_snapshot!(code);
}

/// The C code, compiled and run on the same input, gives the same bits.
#[test]
#[ignore = "needs a C compiler (cc)"]
fn c_code_gives_the_same_bits() {
    use std::fmt::Write as _;
    let folder = std::env::temp_dir().join(format!("meltpath-export-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for word in [Word::Double, Word::Single, FIXED] {
        for limit in [None, Some(0.9)] {
            for anti in [AntiWindup::None, AntiWindup::Conditioned] {
                for export in exports(word, limit, anti) {
                    let mut code = export.to_c();
                    let name = &export.name;
                    let (scale, kind) = match word {
                        Word::Fixed { signal, .. } => (f64::from(1u32 << signal), "int32_t"),
                        Word::Double => (1.0, "double"),
                        Word::Single => (1.0, "float"),
                    };
                    write!(
                        code,
                        "#include <stdio.h>\nint main(void) {{ {name}_state s; {name}_reset(&s); double u; \
                         while (scanf(\"%lf\", &u) == 1) {{ {kind} y = {name}_step(&s, ({kind})(u)); printf(\"%a\\n\", (double)y / {scale}); }} return 0; }}\n"
                    )
                    .unwrap();
                    let (source, program) = (folder.join("k.c"), folder.join("k"));
                    std::fs::write(&source, code).unwrap();
                    let built = std::process::Command::new("cc")
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
                    assert!(
                        built.status.success(),
                        "{}",
                        String::from_utf8_lossy(&built.stderr)
                    );
                    let lines: String = (0..2000).fold(String::new(), |mut all, k| {
                        let u = input(k);
                        let given = if scale > 1.0 { (u * scale).round() } else { u };
                        writeln!(all, "{given:e}").unwrap();
                        all
                    });
                    let records = folder.join("in.txt");
                    std::fs::write(&records, lines).unwrap();
                    let out = std::process::Command::new(&program)
                        .stdin(std::fs::File::open(&records).unwrap())
                        .output()
                        .unwrap();
                    let mut runs = export.running();
                    let text = String::from_utf8(out.stdout).unwrap();
                    assert_eq!(text.lines().count(), 2000);
                    for (k, line) in text.lines().enumerate() {
                        let ours = runs.step(input(k));
                        let theirs = hexadecimal(line);
                        assert!(
                            ours == theirs,
                            "{word:?} {limit:?} {anti:?} {name} {k}: {ours} {line}"
                        );
                    }
                }
            }
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A number as `printf("%a")` writes it.
fn hexadecimal(text: &str) -> f64 {
    let (sign, rest) = text.strip_prefix('-').map_or((1.0, text), |r| (-1.0, r));
    let (digits, power) = rest.strip_prefix("0x").unwrap().split_once('p').unwrap();
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let bits = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap();
    let power: i32 = power.parse().unwrap();
    sign * bits as f64 * 2f64.powi(power - 4 * i32::try_from(fraction.len()).unwrap())
}

/// An integrator that shares a section with another pole leaves the unit circle when coefficients are rounded.
#[test]
fn an_integrator_stays_on_the_circle_in_single_precision() {
    for k in 0..40 {
        let fast = 0.6 + 0.009 * f64::from(k);
        let c = Complex64::new;
        let controller = ZeroPoleGain {
            zeros: vec![c(0.93, 0.2), c(0.93, -0.2), c(0.99, 0.0), c(0.5, 0.0)],
            poles: vec![c(1.0 - 6e-16, 0.0), c(fast, 0.0), c(0.7, 0.1), c(0.7, -0.1)],
            gain: 2.0,
            delay: 0.0,
            domain: Domain::Sampled { period: 1e-5 },
        };
        let system = controller.to_state_space().unwrap();
        Exported::sections(
            "integrates",
            &system,
            Word::Single,
            Some(5.0),
            AntiWindup::Conditioned,
        )
        .unwrap_or_else(|e| panic!("with a pole at {fast}: {e}"));
    }
}
