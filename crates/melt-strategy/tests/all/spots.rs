//! Spots on the reference solver: each gets its energy whatever the step, and their times or powers are learned and predicted.
use crate::support::{beam, on_metal, settings, titanium};
use meltpath_base::Silent;
use meltpath_melt_strategy::bed::Bed;
use meltpath_melt_strategy::bed::{Domain, Resolution};
use meltpath_melt_strategy::learning::{Freedom, Learned, Learning, learn};
use meltpath_melt_strategy::lever::Lever;
use meltpath_melt_strategy::peaks::with_reference;
use meltpath_melt_strategy::prediction::{Prediction, Reference, predict};
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::run::draw;

/// Distance between spots, mm, and spots along an edge of the square.
const SPACING: f64 = 0.125;
const COUNT: u32 = 10;
/// Temperature wanted, K.
const AIM: f64 = 3000.0 + CELSIUS;

/// A square of spots, every third column and row first; `dwell` s each.
fn square(dwell: f64) -> BeamPath {
    let mut points = Vec::new();
    let mut time = 0.0;
    for first in 0..9 {
        for j in (first / 3..COUNT).step_by(3) {
            for i in (first % 3..COUNT).step_by(3) {
                let spot = |time: f64| BeamPoint {
                    time,
                    x: SPACING * (f64::from(i) + 0.5),
                    y: SPACING * (f64::from(j) + 0.5),
                    ..settings(300.0, 0.413_67)
                };
                points.extend([spot(time), spot(time + dwell)]);
                time += dwell;
            }
        }
    }
    BeamPath::new(points).unwrap()
}

fn inside([x, y]: [f64; 2], depth: f64) -> bool {
    let edge = SPACING * f64::from(COUNT);
    [x, y].iter().all(|v| (depth..edge - depth).contains(v))
}

fn bed(path: &BeamPath, step: f64) -> Bed {
    let (material, beam) = (titanium(), beam());
    let resolution = Resolution {
        cell: 0.0625,
        planes: 1,
        step,
        domain: Domain::NARROW,
        power: 1.0,
    };
    let body = on_metal(&material, &beam);
    body.bed(&[path], &[], &resolution, &Silent).unwrap()
}

fn tally(field: &Field) -> Tally {
    let classes = Classes::calibrated(titanium().liquidus, AIM, 60.0);
    Tally::of(field, &classes, |[i, j, k]| {
        let c = field.grid.centre(i, j, k);
        k + 1 == field.grid.planes() && inside([c.x, c.y], 0.2)
    })
}

fn learned(bed: &Bed, path: &BeamPath, lever: Lever, first: Option<SpeedProfile>) -> Learned {
    let learning = Learning {
        aim: AIM,
        rounds: 6,
        gain: 0.5,
        bounds: [0.3, 3.0],
        length: 0.0625,
        lever,
        levels: Vec::new(),
        freedom: Freedom::Continuous,
    };
    learn(
        &mut with_reference(&bed.solver, &bed.beam, bed.step, 0.05),
        &titanium(),
        path,
        &learning,
        first,
        &|p| inside(p, 0.15),
        &|f| tally(f).share(Class::Good),
        &Silent,
    )
    .unwrap()
}

/// Dwells that are no whole number of steps: what the beam brings is their sum, and temperatures hardly depend on the step.
#[test]
fn a_spot_gets_its_energy_whatever_the_step() {
    let path = square(1.13e-4);
    let wanted = 0.9 * 300.0 * path.end();
    let middle = [8e-6, 2e-6].map(|step| {
        let mut bed = bed(&path, step);
        draw(
            &mut bed.solver,
            &path,
            &bed.beam,
            bed.step,
            &mut [],
            &Silent,
        )
        .unwrap();
        let ledger = bed.solver.ledger();
        let brought = ledger.absorbed + ledger.missed;
        assert!((brought / wanted - 1.0).abs() < 1e-6, "{ledger:?}");
        tally(&bed.solver.highest_temperature()).mean
    });
    println!("steps of 8 and 2 µs: {middle:.1?} K");
    assert!((middle[0] - middle[1]).abs() < 15.0, "{middle:?}");
}

/// Predicted spot by spot in one drawing, then learned: times and powers both bring most of the square into the window.
#[test]
fn spots_learn_their_time_and_their_power() {
    let path = square(1.3e-4);
    let bed = bed(&path, 8e-6);
    let given = learned(&bed, &path, Lever::Dwell, None);
    for lever in [Lever::Dwell, Lever::Power] {
        let prediction = Prediction {
            aim: AIM,
            bounds: [0.3, 3.0],
            length: 0.125,
            ahead: 1e-4,
            lever,
            levels: Vec::new(),
        };
        let mut engine = Reference {
            solver: bed.solver.clone(),
            beam: &bed.beam,
            step: bed.step,
        };
        let profile = predict(&mut engine, &titanium(), &path, &prediction, &Silent).unwrap();
        let predicted = tally(&engine.solver.highest_temperature());
        let found = learned(&bed, &path, lever, Some(profile));
        let after = tally(&found.highest);
        println!(
            "{lever:?}: as drawn {:.3}, learned {:.3?}; predicted {:.3} ± {:.0} K, then learned {:.3} ± {:.0} K",
            given.scores[0],
            given.scores.last(),
            predicted.share(Class::Good),
            predicted.deviation,
            after.share(Class::Good),
            after.deviation
        );
        assert!(after.share(Class::Good) > given.scores[0] + 0.3);
        assert!(after.share(Class::Good) >= predicted.share(Class::Good));
        assert!(predicted.deviation < 60.0, "{}", predicted.deviation);
        let kept = (found.path.end() - path.end()).abs() < 1e-9;
        assert_eq!(kept, lever == Lever::Power);
    }
}
