//! The bodies on stable: a seeded corpus, some seconds a target (one, or what `MELTPATH_FUZZ_SECONDS` says).
//! A case that fails is written to `fuzz/bodies/findings/<target>/`, where every later run begins with it.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test that fails says so by panicking"
)]

use std::alloc::System;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use cap::Cap;
use meltpath_fuzz_bodies::mutate::{Random, mutate};
use meltpath_fuzz_bodies::{TARGETS, Target};

/// Bounds memory: what a damaged file announces must not be allocated.
#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, 3 << 30);

/// A case that takes longer is a finding: inputs are small.
const LONGEST: Duration = Duration::from_secs(20);
const ENDLESS: &str = "it takes more than 20 s";

fn findings(target: &Target) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("findings")
        .join(target.name)
}

/// Why a case fails, if it does. It runs in a thread of its own, which is left behind where it does not end.
fn failure(target: &Target, case: &[u8]) -> Option<String> {
    let (send, receive) = mpsc::channel();
    let (body, case) = (target.body, case.to_vec());
    thread::spawn(move || {
        let outcome = std::panic::catch_unwind(|| body(&case));
        let _ = send.send(outcome.map_err(|panic| {
            let text = panic.downcast_ref::<String>().cloned();
            text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
                .unwrap_or_default()
        }));
    });
    match receive.recv_timeout(LONGEST) {
        Ok(outcome) => outcome.err(),
        Err(_) => Some(ENDLESS.to_owned()),
    }
}

/// The case with whatever it can do without left out.
fn shortened(target: &Target, case: &[u8]) -> Vec<u8> {
    let mut case = case.to_vec();
    let until = Instant::now() + Duration::from_secs(10);
    let mut piece = case.len() / 2;
    while piece > 0 && Instant::now() < until {
        let mut at = 0;
        while at < case.len() && Instant::now() < until {
            let mut shorter = case.clone();
            shorter.drain(at..(at + piece).min(case.len()));
            if failure(target, &shorter).is_some() {
                case = shorter;
            } else {
                at += piece;
            }
        }
        piece /= 2;
    }
    case
}

fn hunt(target: &Target, time: Duration) {
    let seeds = (target.seeds)();
    for seed in &seeds {
        assert_eq!(failure(target, seed), None, "{}: a seed fails", target.name);
    }
    if let Ok(folder) = std::fs::read_dir(findings(target)) {
        for entry in folder {
            let path = entry.unwrap().path();
            let case = std::fs::read(&path).unwrap();
            assert_eq!(
                failure(target, &case),
                None,
                "{} fails again",
                path.display()
            );
        }
    }
    let mut random = Random::new(0x6d65_6c74);
    let begin = Instant::now();
    let mut cases = 0_u64;
    while begin.elapsed() < time {
        let case = mutate(&mut random, &seeds, target.form);
        cases += 1;
        if let Some(why) = failure(target, &case) {
            // what does not end would not end at every step of shortening either
            let short = if why == ENDLESS {
                case
            } else {
                shortened(target, &case)
            };
            let folder = findings(target);
            std::fs::create_dir_all(&folder).unwrap();
            let path = folder.join(format!("case-{cases}"));
            std::fs::write(&path, &short).unwrap();
            panic!(
                "{}: case {cases} fails: {why}\nit is kept as {}",
                target.name,
                path.display()
            );
        }
    }
    eprintln!(
        "{}: {cases} cases in {:.1} s",
        target.name,
        begin.elapsed().as_secs_f64()
    );
}

fn seconds() -> Duration {
    let written = std::env::var("MELTPATH_FUZZ_SECONDS").ok();
    Duration::from_secs_f64(written.and_then(|s| s.parse().ok()).unwrap_or(1.0))
}

/// Whether a fuzz target of the name stands in `fuzz/Cargo.toml`.
#[test]
fn every_body_has_its_fuzz_target() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz_targets");
    let mut there: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| {
            e.unwrap()
                .path()
                .file_stem()
                .unwrap()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    let mut wanted: Vec<String> = TARGETS.iter().map(|t| t.name.to_owned()).collect();
    there.sort();
    wanted.sort();
    assert_eq!(there, wanted);
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

    /// Lines that nearly are moves of FANUC.
    #[test]
    fn near_moves(lines in proptest::collection::vec("[JLCA]? ?P?R?\\[?[0-9:\"a]{0,4}\\]? ?[0-9.]{0,5}(mm/sec|cm/min|%|sec)? ?(FINE|CNT[0-9]{0,3})? ?(Arc Start\\[1\\]|Weld End\\[1,1\\]|ACC80|;|!|//|:)?", 0..12)) {
        let text = format!("/PROG A\n/MN\n{}\n/END\n", lines.join("\n"));
        (meltpath_fuzz_bodies::named("fanuc_ls").body)(text.as_bytes());
    }
}

macro_rules! bodies {
    ($($name:ident),+ $(,)?) => {
        $(
            #[test]
            fn $name() {
                hunt(meltpath_fuzz_bodies::named(stringify!($name)), seconds());
            }
        )+

        #[test]
        fn every_body_is_run() {
            let run = [$(stringify!($name)),+];
            assert_eq!(run.to_vec(), TARGETS.iter().map(|t| t.name).collect::<Vec<_>>());
        }
    };
}

bodies!(
    step,
    stl,
    threemf,
    threemf_model,
    fanuc_ls,
    krl,
    rapid,
    ur_script,
    inform,
    val3,
    cli_layers,
    cli_binary,
    vector_list,
    toolpath_3mf,
    beam_path,
    container,
    toolpath_index,
    charts,
    job,
    wire,
    gas,
    process_map,
    pool,
    energy,
    cell,
    robot,
    urdf,
    gun,
    focus,
    motor,
    tune,
    controllers,
    health_history,
    material,
    scan_head,
    recipe,
    mapping,
    measurements,
    scan_file,
    records_file,
    cloud_ply,
    cloud_lines,
    record_csv,
    record_mat,
    record_parquet,
    samples,
);
