//! What a plant lacks is named, with the command, the measurement, the mode or the frequency.

use meltpath_control::h_infinity::{
    Assumption, GeneralizedPlant, Obstacle, SynthesisError, SynthesisOptions, synthesise,
};
use meltpath_control::{Matrix, StateSpace};

/// A plant of rows of A, of B (disturbances, then commands), of C (errors, then measurements) and of D.
fn plant(rows: [&[&[f64]]; 4], commands: usize, measurements: usize) -> GeneralizedPlant {
    let matrix = |rows: &[&[f64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]);
    let [a, b, c, d] = rows.map(matrix);
    GeneralizedPlant::new(
        StateSpace::continuous(a, b, c, d).unwrap(),
        commands,
        measurements,
    )
    .unwrap()
}

fn lack(plant: &GeneralizedPlant) -> Assumption {
    match synthesise(plant, &SynthesisOptions::default()) {
        Err(SynthesisError::Assumption(assumption)) => assumption,
        other => panic!("{other:?}"),
    }
}

/// An unstable state, a force and a noise; the state and the command are weighted.
const SOUND: [&[&[f64]]; 4] = [
    &[&[1.0]],
    &[&[1.0, 0.0, 1.0]],
    &[&[1.0], &[0.0], &[1.0]],
    &[&[0.0, 0.0, 0.0], &[0.0, 0.0, 1.0], &[0.0, 1.0, 0.0]],
];

#[test]
fn modes_out_of_reach_and_out_of_sight_are_named() {
    assert!(synthesise(&plant(SOUND, 1, 1), &SynthesisOptions::default()).is_ok());
    let [a, _, c, d] = SOUND;
    let Assumption::Stabilisable { mode } = lack(&plant([a, &[&[1.0, 0.0, 0.0]], c, d], 1, 1))
    else {
        panic!("no command reaches the state")
    };
    assert!((mode.re - 1.0).abs() < 1e-9 && mode.im == 0.0, "{mode}");
    let [a, b, _, d] = SOUND;
    let Assumption::Detectable { mode } = lack(&plant([a, b, &[&[1.0], &[0.0], &[0.0]], d], 1, 1))
    else {
        panic!("no measurement sees the state")
    };
    assert!((mode.re - 1.0).abs() < 1e-9 && mode.im == 0.0, "{mode}");
}

#[test]
fn the_command_without_cost_and_the_measurement_without_noise_are_named() {
    // two commands, the second free; one weighted
    let free = plant(
        [
            &[&[1.0]],
            &[&[1.0, 0.0, 1.0, 1.0]],
            &[&[1.0], &[0.0], &[1.0]],
            &[&[0.0; 4], &[0.0, 0.0, 1.0, 0.0], &[0.0, 1.0, 0.0, 0.0]],
        ],
        2,
        1,
    );
    assert_eq!(lack(&free), Assumption::CommandCost { command: 1 });
    // two measurements, the first without noise
    let clean = plant(
        [
            &[&[1.0]],
            &[&[1.0, 0.0, 1.0]],
            &[&[1.0], &[0.0], &[1.0], &[1.0]],
            &[&[0.0; 3], &[0.0, 0.0, 1.0], &[0.0; 3], &[0.0, 1.0, 0.0]],
        ],
        1,
        2,
    );
    assert_eq!(
        lack(&clean),
        Assumption::MeasurementNoise { measurement: 0 }
    );
}

/// A spring of 4 rad/s whose error is command + 9 places: a command of −9 places moves no error, and swings it at 5 rad/s. The same
/// with disturbances and measurements.
#[test]
fn frequencies_at_which_nothing_is_felt_are_named() {
    let spring: &[&[f64]] = &[&[0.0, 1.0], &[-16.0, 0.0]];
    let unweighted = plant(
        [
            spring,
            &[&[0.0, 0.0, 0.0], &[1.0, 0.0, 1.0]],
            &[&[9.0, 0.0], &[1.0, 0.0]],
            &[&[0.0, 0.0, 1.0], &[0.0, 1.0, 0.0]],
        ],
        1,
        1,
    );
    let Assumption::CommandZero { omega } = lack(&unweighted) else {
        panic!("{:?}", lack(&unweighted))
    };
    assert!((omega - 5.0).abs() < 1e-6, "{omega}");
    let undisturbed = plant(
        [
            spring,
            &[&[0.0, 0.0], &[9.0, 1.0]],
            &[&[1.0, 0.0], &[0.0, 0.0], &[1.0, 0.0]],
            &[&[0.0, 0.0], &[0.0, 1.0], &[1.0, 0.0]],
        ],
        1,
        1,
    );
    let Assumption::MeasurementZero { omega } = lack(&undisturbed) else {
        panic!("{:?}", lack(&undisturbed))
    };
    assert!((omega - 5.0).abs() < 1e-6, "{omega}");
}

/// A state that is cheap to move and hard to see, and one that is seen well and dear to move: what cannot be had names its side.
#[test]
fn a_level_out_of_reach_names_the_side_that_fails() {
    let obstacle = |cost: f64, noise: f64| {
        let plant = plant(
            [
                &[&[-1.0]],
                &[&[1.0, 0.0, 1.0]],
                &[&[1.0], &[0.0], &[1.0]],
                &[&[0.0; 3], &[0.0, 0.0, cost], &[0.0, noise, 0.0]],
            ],
            1,
            1,
        );
        let options = SynthesisOptions {
            ceiling: 0.3,
            ..SynthesisOptions::default()
        };
        match synthesise(&plant, &options) {
            Err(SynthesisError::Infeasible { obstacle, .. }) => obstacle,
            other => panic!("{other:?}"),
        }
    };
    let dear = obstacle(100.0, 0.01);
    assert!(matches!(dear, Obstacle::ControlRiccati { .. }), "{dear:?}");
    let noisy = obstacle(0.01, 100.0);
    assert!(
        matches!(noisy, Obstacle::EstimationRiccati { .. }),
        "{noisy:?}"
    );
}
