//! Controllers of a file put into a head: what they suit, and what is told where they do not.

use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::export::{AntiWindup, Exported, Word};
use meltpath_control::{StateSpace, TransferFunction};
use meltpath_scan_head::axis::control::{AngleUnit, Controller};
use meltpath_scan_head::servo::file::{
    AxisController, ControllerFile, ControllerFileError, SCHEMA, StoredLaw,
};

use super::near;
use super::reference::{three_axis, two_axis};
use super::reference_axis::{refined, synthesised};
use meltpath_scan_head::head::scan_head::ScanHead;

fn lag(period: f64) -> StateSpace {
    let lag = TransferFunction::new([10.0], [1.0, 100.0]).unwrap();
    discretise(&lag.to_state_space().unwrap(), period, Hold::Zero).unwrap()
}

fn exported(head: &ScanHead, axis: char, period: f64) -> AxisController {
    let law = StoredLaw::Exported {
        export: Exported::sections("lag", &lag(period), Word::Double, None, AntiWindup::None)
            .unwrap(),
        unit: AngleUnit::Degree,
        current: synthesised().current,
        feed_forward: synthesised().feed_forward,
    };
    stored(head, axis, law)
}

fn stored(head: &ScanHead, axis: char, law: StoredLaw) -> AxisController {
    let mirror = usize::from(axis == 'y');
    let motor = match (axis, &head.focus) {
        ('z', Some((focus, _))) => &focus.motor().unwrap().motor,
        _ => &head.mirrors[mirror].motor().unwrap().motor,
    };
    AxisController {
        axis,
        design: "by hand".to_owned(),
        motor: motor.clone(),
        law,
    }
}

fn file(axes: Vec<AxisController>) -> ControllerFile {
    ControllerFile {
        schema: SCHEMA.to_owned(),
        head: "demo".to_owned(),
        axes,
    }
}

/// A controller of 40 µs does not run on a head of 50 µs; one of 100 µs acts at every second sample.
#[test]
fn a_controller_runs_at_whole_fractions_of_the_heads_rate() {
    let head = two_axis();
    near(head.period, 50e-6, 1e-12);
    let refused = exported(&head, 'y', 40e-6).controller(head.period);
    let Err(ControllerFileError::Period {
        axis: 'y',
        found,
        wanted,
    }) = refused
    else {
        panic!("{refused:?}")
    };
    near(found, 40.0, 1e-9);
    near(wanted, 50.0, 1e-9);
    let Ok(Controller::Sampled(slow)) = exported(&head, 'x', 100e-6).controller(head.period) else {
        panic!("a sampled controller")
    };
    assert_eq!(slow.every, 2);
}

type Change = fn(&mut AxisController);

/// Each axis gets the law that bears its letter, and a motor that is another one is told.
#[test]
fn laws_go_to_their_axes_and_other_motors_are_told() {
    let mut head = three_axis();
    let cascade = |gains| StoredLaw::Cascade { gains };
    let mut axes = vec![
        stored(&head, 'y', cascade(refined())),
        stored(&head, 'x', cascade(synthesised())),
        stored(&head, 'z', cascade(refined())),
    ];
    let laws = |head: &ScanHead| {
        let [x, y] = [0, 1].map(|i| head.mirrors[i].motor().unwrap().controller.clone());
        let (z, _) = head.focus.as_ref().unwrap();
        [x, y, z.motor().unwrap().controller.clone()]
    };
    assert_eq!(file(axes.clone()).apply(&mut head), Ok(vec![]));
    let [one, two] = [synthesised(), refined()].map(Controller::Cascade);
    assert_eq!(laws(&head), [one, two.clone(), two]);
    // a thousandth is the same motor, two are another; so is a mode elsewhere
    axes[1].motor.inertia *= 1.0005;
    assert_eq!(file(axes.clone()).apply(&mut head), Ok(vec![]));
    let changes: [Change; 6] = [
        |a| a.motor.resistance *= 1.002,
        |a| a.motor.inductance *= 1.002,
        |a| a.motor.torque_constant *= 0.998,
        |a| a.motor.inertia *= 1.002,
        |a| a.motor.viscous *= 1.002,
        |a| a.motor.modes.truncate(0),
    ];
    for change in changes {
        let mut other = axes.clone();
        change(&mut other[0]);
        assert_eq!(file(other).apply(&mut head), Ok(vec!['y']));
    }
    for change in [0, 1] {
        let mut other = axes.clone();
        let mode = &mut other[2].motor.modes[0];
        if change == 0 {
            mode.omega *= 1.002;
        } else {
            mode.damping *= 1.002;
        }
        assert_eq!(file(other).apply(&mut head), Ok(vec!['z']));
    }
}

/// What a file lacks is told, and the head stays as it was.
#[test]
fn a_file_that_does_not_suit_leaves_the_head_alone() {
    let before = two_axis();
    let mut head = before.clone();
    let only = file(vec![exported(&head, 'x', head.period)]);
    let refused = only.apply(&mut head);
    assert_eq!(
        refused,
        Err(ControllerFileError::Missing {
            axis: 'y',
            known: "x".to_owned(),
        })
    );
    let older = ControllerFile {
        schema: "meltpath-axis-controllers/0".to_owned(),
        ..only
    };
    assert!(matches!(
        older.apply(&mut head),
        Err(ControllerFileError::Schema { found }) if found.ends_with("/0")
    ));
    let Err(nothing) = file(vec![]).apply(&mut head) else {
        panic!("no controllers at all")
    };
    assert!(nothing.to_string().contains("only for none"), "{nothing}");
    assert_eq!(head, before);
}
