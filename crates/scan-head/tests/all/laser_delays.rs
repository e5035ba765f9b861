//! What laser delays do, on paths whose lag is known.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_scan_head::head::gate::Darkness;
use meltpath_scan_head::head::prepared::alone;
use meltpath_scan_head::head::recipe::LaserDelays;
use meltpath_scan_head::head::vector::{ScanJob, Vector};
use meltpath_scan_head::measures::delays::DelayTuning;
use meltpath_toolpath::Role;

use super::near;

fn vector(kind: Role, x: f64, y: f64, speed: f64) -> Vector {
    Vector {
        kind,
        end: DVec3::new(x, y, 0.0),
        speed,
        power: 100.0,
        wait: 0.0,
        block: 0,
    }
}

/// Chains of 10, 2 and 10 samples of 0.1 ms with 5 samples of jump between.
fn three_chains() -> ScanJob {
    ScanJob {
        start: DVec3::ZERO,
        vectors: vec![
            vector(Role::Fill, 1.0, 0.0, 1000.0),
            vector(Role::Jump, 3.0, 0.0, 4000.0),
            vector(Role::Fill, 3.2, 0.0, 1000.0),
            vector(Role::Jump, 5.2, 0.0, 4000.0),
            vector(Role::Fill, 6.2, 0.0, 1000.0),
        ],
    }
}

/// A chain of 0.2 ms stays dark where the light would come 0.25 ms later than it goes; light that lasts over a jump of 0.5 ms bridges it.
#[test]
fn dark_and_bridged_chains_are_those_of_their_times() {
    let job = three_chains();
    let of = |on: f64, off: f64| Darkness::of(alone(&job), LaserDelays { on, off }, 1e-4).unwrap();
    let plain = of(0.0, 0.0);
    assert_eq!((plain.chains, plain.dark, plain.bridged), (3, 0, 0));
    near(plain.longest, 1e-3, 1e-12);
    near(plain.shortest, 2e-4, 1e-12);
    let late = of(3.5e-4, 1e-4);
    assert_eq!((late.dark, late.bridged), (1, 0));
    let (_, place) = late.first_dark.unwrap();
    assert!((place - DVec3::X * 3.0).length() < 1e-12, "{place}");
    assert_eq!(of(2.5e-4, 1e-4).dark, 0);
    assert_eq!(of(1e-4, 5.5e-4).bridged, 0);
    assert_eq!(of(1e-4, 6.5e-4).bridged, 2);
    assert_eq!(of(1.3e-3, 1e-4).dark, 3);
}

/// A spot that follows its command 0.3 ms late, at 1 m/s: light that comes 0.2 ms later than the spot leaves 0.2 mm less its radius
/// dark, light that comes 0.2 ms earlier draws as much before the mark, both at starts and at ends.
#[test]
fn a_pure_lag_asks_for_delays_of_its_own() {
    let (period, lag, radius, speed) = (1e-5, 30_usize, 0.035, 1000.0);
    // from the side, along the mark, and away to the side
    let job = ScanJob {
        start: DVec3::new(0.0, -4.0, 0.0),
        vectors: vec![
            vector(Role::Jump, 0.0, 0.0, speed),
            vector(Role::Fill, 5.0, 0.0, speed),
            vector(Role::Jump, 5.0, 4.0, speed),
        ],
    };
    let commanded = |k: usize| {
        let along = speed * period * k as f64;
        if along < 4.0 {
            DVec2::new(0.0, along - 4.0)
        } else if along < 9.0 {
            DVec2::new(along - 4.0, 0.0)
        } else {
            DVec2::new(5.0, (along - 9.0).min(4.0))
        }
    };
    let hits: Vec<DVec2> = (0..1400_usize)
        .map(|k| commanded(k.saturating_sub(lag)))
        .collect();
    let tuning = DelayTuning::new(&job, &hits, period, 8e-4, radius);
    let score = |on: f64, off: f64| tuning.score(LaserDelays { on, off });
    let own = score(3e-4, 3e-4);
    assert!(own.missing() < 1e-9 && own.spurious() < 1e-9, "{own:?}");
    let wrong = 0.2 - radius;
    // 5 µm between the points that are looked for, and a sample of 10 µm
    let late = score(5e-4, 5e-4);
    near(late.missing_start, wrong, 0.015);
    near(late.spurious_end, wrong, 0.015);
    assert!(
        late.missing_end < 1e-9 && late.spurious_start < 1e-9,
        "{late:?}"
    );
    let early = score(1e-4, 1e-4);
    near(early.missing_end, wrong, 0.015);
    near(early.spurious_start, wrong, 0.015);
    assert!(
        early.missing_start < 1e-9 && early.spurious_end < 1e-9,
        "{early:?}"
    );
    // the spot reaches a place by its radius early, and may leave it by its radius late
    let tuned = tuning.tune(5e-3).best.delays;
    near(tuned.on, 3e-4, 4e-5);
    near(tuned.off, 3e-4, 4e-5);
}
