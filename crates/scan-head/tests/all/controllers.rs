//! H-infinity in whole jobs: controller and pre-filter two by two on one square of each head.

use meltpath_base::Silent;
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::axis::control::{AngleUnit, Controller, SampledController, SampledForm};
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::measures::delays::{DelayTuning, HitRecord};
use meltpath_scan_head::measures::histogram::Histogram;
use meltpath_scan_head::servo::h_infinity::{HInfinityTargets, design};
use meltpath_scan_head::servo::preview::Previews;

use super::preview::ahead;
use super::reference::{HeadData, job_of, measured, recipes, three_axis_data, two_axis_data};

/// The head's mirrors under H-infinity: the thesis' weights at the bandwidth of its position loops.
pub(crate) fn with_h_infinity(data: &HeadData) -> ScanHead {
    let mut head = data.head.clone();
    for (axis, times) in head.driven_mirrors().zip(data.tuning) {
        let Controller::Cascade(gains) = axis.controller.clone() else {
            panic!("the heads ship with cascades")
        };
        let bandwidth = 3.0 / times.unwrap()[2];
        let unit = AngleUnit::Degree;
        let targets =
            HInfinityTargets::for_motor(&axis.motor, unit, bandwidth, data.head.period).unwrap();
        let servo = design(&axis.motor, &gains.current, unit, &targets).unwrap();
        axis.controller = Controller::Sampled(SampledController {
            form: SampledForm::Designed(servo.sampled),
            unit,
            every: 1,
            current: gains.current,
            feed_forward: gains.feed_forward,
        });
    }
    head
}

pub(crate) fn without_prefilter(mut head: ScanHead) -> ScanHead {
    for axis in head.driven_mirrors() {
        axis.prefilter = None;
    }
    if let Some(axis) = head.focus.as_mut().and_then(|f| f.0.driven_mut()) {
        axis.prefilter = None;
    }
    head
}

/// What a head does on one square.
#[derive(Debug, Clone)]
pub(crate) struct Told {
    /// Lower end of the 0.002° wide interval that holds most tracking errors on marks, X and Y, deg.
    majority: [f64; 2],
    /// Median on marks, X and Y, deg.
    pub(crate) median: [f64; 2],
    /// 99 % on marks, X, deg.
    p99: f64,
    /// Shares of contour points below 10, 20, 30, 100, 200, 300 µm.
    pub(crate) contour: [f64; 6],
    /// Largest contour error, mm.
    pub(crate) largest: f64,
    /// Fill rate, sampled and swept.
    fill: [f64; 2],
}

/// A recorded value, to a hundredth of it.
fn is(value: f64, recorded: f64) {
    assert!(
        (value - recorded).abs() <= 0.01 * recorded,
        "{value} was {recorded}"
    );
}

fn majority(h: &Histogram) -> f64 {
    let per = (0.002 / h.bin).round().max(1.0) as usize;
    let best = h
        .counts
        .chunks(per)
        .enumerate()
        .max_by_key(|(_, c)| c.iter().sum::<u64>());
    best.map_or(0.0, |(k, _)| k as f64 * per as f64 * h.bin)
}

pub(crate) fn told(head: &ScanHead, plate: &SquarePlate, recipe: &Recipe) -> Told {
    told_with(head, plate, recipe, |_, _| None)
}

/// The same with set-points shaped for each job.
fn told_with(
    head: &ScanHead,
    plate: &SquarePlate,
    recipe: &Recipe,
    shaped: impl Fn(&ScanHead, &ScanJob) -> Option<Previews>,
) -> Told {
    let plain = head.ready().unwrap();
    let ready = |job: &ScanJob| match shaped(head, job) {
        Some(previews) => plain.clone().with_previews(previews),
        None => plain.clone(),
    };
    let mut recipe = recipe.clone();
    let two = SquarePlate {
        columns: 2,
        rows: 1,
        ..*plate
    };
    let job = job_of(&two, &recipe);
    let mut record = HitRecord::default();
    ready(&job)
        .run(&job, recipe.delays, 1, &Silent, &mut record)
        .unwrap();
    recipe.delays = DelayTuning::new(&job, &record.hits, head.period, 800e-6, 0.035)
        .tune(f64::INFINITY)
        .best
        .delays;
    let one = SquarePlate {
        columns: 1,
        rows: 1,
        ..*plate
    };
    let job = job_of(&one, &recipe);
    let mut sinks = measured(&one, head.period);
    ready(&job)
        .run(&job, recipe.delays, 1, &Silent, &mut sinks)
        .unwrap();
    let (path, fill) = sinks;
    let fill = fill.finish();
    let h = &path.tracking;
    Told {
        majority: [majority(&h[0]), majority(&h[1])],
        median: [h[0].quantile(0.5), h[1].quantile(0.5)],
        p99: h[0].quantile(0.99),
        contour: [0.01, 0.02, 0.03, 0.1, 0.2, 0.3].map(|t| path.contour.share_below(t)),
        largest: path.contour.largest,
        fill: [0, 1].map(|m| fill[0].rates[m].share),
    }
}

/// Conventional and H-infinity, with pre-filter and without.
struct Square {
    conventional: [Told; 2],
    robust: [Told; 2],
}

fn square(data: &HeadData, recipe: &Recipe) -> Square {
    let robust = with_h_infinity(data);
    let run = |head: &ScanHead| told(head, &data.plate, recipe);
    let both = |head: ScanHead| [run(&head), run(&without_prefilter(head))];
    let found = Square {
        conventional: both(data.head.clone()),
        robust: both(robust),
    };
    for (name, t) in [
        ("conventional, pre-filter", &found.conventional[0]),
        ("conventional, none", &found.conventional[1]),
        ("H-infinity, pre-filter", &found.robust[0]),
        ("H-infinity, none", &found.robust[1]),
    ] {
        println!(
            "{}, {}: {name}: majority {:.4?} median {:.4?} p99 {:.4} contour {:.4?} largest {:.4} fill {:.4?}",
            data.head.name, recipe.name, t.majority, t.median, t.p99, t.contour, t.largest, t.fill
        );
    }
    found
}

/// AC-44, AC-45 (T, R), AC-48, AC-48b (T, R), two axes: the thesis compares the first of the conventional with the second of the
/// H-infinity runs.
#[test]
fn lpbf_ac44_ac45_ac48_h_infinity_on_two_axes() {
    let data = two_axis_data();
    let [one, two, _] = recipes();
    let first = square(&data, &one);
    let second = square(&data, &two);
    for axis in [0, 1] {
        // AC-44: 0.020 to 0.030 deg conventional with pre-filter, 0 to 0.010 deg H-infinity without, ± 0.005 deg
        is(first.conventional[0].median[axis], [0.0245, 0.0260][axis]);
        is(first.robust[1].median[axis], 0.0068);
    }
    // AC-45: 99 % of the errors below 0.04 deg; conventional clearly worse
    is(second.robust[1].p99, 0.0153);
    is(second.conventional[0].median[0], 0.0334);
    is(second.robust[1].median[0], 0.0071);
    // without the pre-filter the two are the same but for a few percent
    for (found, recorded) in [(&first, 1.01), (&second, 1.066)] {
        is(
            found.robust[1].median[0] / found.conventional[1].median[0],
            recorded,
        );
    }
    for found in [&first, &second] {
        // AC-48b: the pre-filter sets the tracking error, whatever the controller
        let over = |k: usize| found.robust[k].median[0] / found.conventional[k].median[0];
        is(over(0), 1.02);
        // and what H-infinity brings is the fine end of the contours
        is(found.robust[1].contour[0], 0.615);
        is(found.robust[1].contour[2], 0.949);
        is(found.conventional[0].contour[2], 0.124);
        // AC-48 is not reproduced with the reference friction: 99.9 % conventional below 100 µm against 97.7 %
        is(found.conventional[0].contour[3], 0.999);
        is(found.robust[1].contour[3], 0.977);
    }
}

/// AC-48 (T): the conventional share of contour points below 100 µm, 37.85 % in the thesis, hangs on how far friction leaves the
/// resting axis beside its set-point.
#[test]
fn lpbf_ac48_more_friction_takes_the_conventional_share() {
    let recipe = &recipes()[0];
    let mut shares = Vec::new();
    for factor in [1.0, 1.5, 2.0, 3.0] {
        let mut data = two_axis_data();
        for axis in data.head.driven_mirrors() {
            axis.motor.friction = scaled(axis.motor.friction, factor);
        }
        let conventional = told(&data.head, &data.plate, recipe);
        let robust = told(
            &without_prefilter(with_h_infinity(&data)),
            &data.plate,
            recipe,
        );
        println!(
            "friction × {factor}: below 100, 200, 300 µm conventional {:.3?}, H-infinity {:.3?}",
            &conventional.contour[3..],
            &robust.contour[3..]
        );
        shares.push((conventional.contour[3], robust.contour[3]));
    }
    // twice the reference friction: 37.9 %, the thesis 37.85
    for (found, recorded) in
        shares
            .into_iter()
            .zip([(0.999, 0.977), (0.622, 0.988), (0.379, 0.998), (0.127, 1.0)])
    {
        is(found.0, recorded.0);
        is(found.1, recorded.1);
    }
}

fn scaled(friction: Friction, factor: f64) -> Friction {
    match friction {
        Friction::Coulomb { coulomb, bias } => Friction::Coulomb {
            coulomb: factor * coulomb,
            bias: factor * bias,
        },
        other => other,
    }
}

/// AC-47, AC-49 (T), three axes.
#[test]
fn lpbf_ac47_ac49_h_infinity_on_three_axes() {
    let data = three_axis_data();
    let found: Vec<Square> = recipes().iter().map(|r| square(&data, r)).collect();
    // X, less than conventional without the pre-filter, over conventional with it
    for (f, [less, same]) in found
        .iter()
        .zip([[0.844, 1.10], [0.885, 1.07], [0.9375, 1.03]])
    {
        // AC-49: in the thesis' configuration H-infinity has more points below 10 µm and fills more, at every recipe
        assert!(f.robust[1].contour[0] > f.conventional[0].contour[0]);
        assert!(f.robust[1].fill[0] > f.conventional[0].fill[0]);
        // AC-47: the thesis tells a reduction of 25 to 50 %; here it is 80 % and more, and all of it is the pre-filter's
        is(
            1.0 - f.robust[1].median[0] / f.conventional[0].median[0],
            less,
        );
        is(f.robust[0].median[0] / f.conventional[0].median[0], same);
    }
    // AC-49, the third ordering: from recipe 1 to 3 H-infinity loses 3.5 points below 10 µm, the thesis 2; conventional gains 11.8
    // where the thesis' loses 5.93, friction keeping its share low at all speeds
    let lost = |of: fn(&Square) -> &Told| of(&found[0]).contour[0] - of(&found[2]).contour[0];
    let (robust, conventional) = (lost(|s| &s.robust[1]), lost(|s| &s.conventional[0]));
    assert!((robust - 0.0352).abs() < 0.002, "{robust}");
    assert!((conventional + 0.118).abs() < 0.002, "{conventional}");
}

/// AC-47 (T), three axes: were the first average of the pre-filter kept under H-infinity, its errors would be those of the thesis nearly:
/// a lag of 150 µs where the printed intervals are 134 to 144 µs.
#[test]
fn lpbf_ac47_the_first_average_alone_leaves_the_printed_lag() {
    let data = three_axis_data();
    let mut robust = with_h_infinity(&data);
    robust.filter_acceleration();
    // the upper ends of the printed intervals of X: 0.006, 0.008, 0.016 deg
    let recorded = [
        ([0.0063, 0.0062], [0.190, 0.276]),
        ([0.0088, 0.0089], [0.220, 0.300]),
        ([0.0164, 0.0168], [0.266, 0.330]),
    ];
    for (recipe, (medians, shares)) in recipes().iter().zip(recorded) {
        let conventional = told(&data.head, &data.plate, recipe).median;
        let kept = told(&robust, &data.plate, recipe).median;
        let less = [0, 1].map(|axis| 1.0 - kept[axis] / conventional[axis]);
        println!(
            "{}: conventional {conventional:.4?}, H-infinity with the first average {kept:.4?} deg: less by {less:.3?}",
            recipe.name
        );
        // asked are 25 to 50 %: Y keeps it, X at recipe 3 only
        for axis in [0, 1] {
            is(kept[axis], medians[axis]);
            assert!((less[axis] - shares[axis]).abs() < 0.005, "{less:?}");
        }
    }
}

/// AC-48 (T): sensor noise and unlike mirrors do not take the conventional share below 100 µm.
#[test]
fn lpbf_ac48_noise_and_unlike_mirrors_do_not_take_it() {
    let recipe = &recipes()[0];
    for (noise, unlike, recorded) in [(0.003_f64, false, 0.976), (0.003, true, 0.964)] {
        let mut data = two_axis_data();
        for axis in data.head.driven_mirrors() {
            axis.encoder.noise = noise.to_radians();
        }
        if unlike {
            let motor = &mut data.head.mirrors[1].driven_mut().unwrap().motor;
            motor.inertia *= 1.2;
            motor.modes[0].omega *= 0.9;
        }
        let conventional = told(&data.head, &data.plate, recipe).contour[3];
        let robust = told(
            &without_prefilter(with_h_infinity(&data)),
            &data.plate,
            recipe,
        )
        .contour[3];
        println!(
            "noise {noise} deg, unlike {unlike}: below 100 µm conventional {conventional:.3}, H-infinity {robust:.3}"
        );
        is(conventional, 1.0);
        is(robust, recorded);
    }
}

/// Table 3.1, contour shares of the conventional structure on three axes: 93.51, 98.3, 99.32 % below 10, 20, 30 µm. Which friction
/// and which integral time of the speed loop bring them?
#[test]
#[ignore = "a table for the book, half a minute"]
fn lpbf_table_3_1_contour_shares_over_friction_and_integral() {
    let recipe = &recipes()[0];
    for integral in [0.04, 0.02, 0.01, 0.005] {
        for factor in [0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
            let mut data = three_axis_data();
            for axis in data.head.driven_mirrors() {
                axis.motor.friction = scaled(axis.motor.friction, factor);
                if let Controller::Cascade(gains) = &mut axis.controller {
                    gains.speed_integral_time = integral;
                }
            }
            let t = told(&data.head, &data.plate, recipe);
            println!(
                "T_iω {integral} s, friction × {factor}: below 10, 20, 30 µm {:.2?} %, largest {:.1} µm",
                [0, 1, 2].map(|k| 100.0 * t.contour[k]),
                1e3 * t.largest
            );
            let recorded = match (integral, factor) {
                (0.04, 0.02) => [0.937, 0.9995, 0.9998],
                (0.04, 1.0) => [0.237, 0.238, 0.351],
                (0.005, 0.1) => [0.995, 1.0, 1.0],
                (0.005, 0.2) => [0.752, 0.998, 1.0],
                _ => continue,
            };
            for (share, recorded) in t.contour.iter().zip(recorded) {
                assert!(
                    (share - recorded).abs() < 0.002,
                    "{integral} {factor}: {share} {recorded}"
                );
            }
        }
    }
}

/// The three recipes' squares on three axes with the path ahead, behind each structure: contours and fill.
#[test]
fn lpbf_20_preview_on_the_recipes_squares() {
    let data = three_axis_data();
    // contour points below 10 µm and fill by sampled points, as commanded and with preview
    let recorded = [
        [
            [0.237, 0.858, 0.240, 0.917],
            [0.196, 0.864, 0.242, 0.922],
            [0.977, 0.877, 0.998, 0.906],
        ],
        [
            [0.239, 0.826, 0.236, 0.897],
            [0.198, 0.849, 0.241, 0.903],
            [0.976, 0.843, 0.998, 0.883],
        ],
        [
            [0.355, 0.662, 0.346, 0.815],
            [0.332, 0.699, 0.363, 0.829],
            [0.942, 0.730, 0.996, 0.808],
        ],
    ];
    for (recipe, recorded) in recipes().iter().zip(recorded) {
        for ((structure, head), recorded) in [
            ("conventional, pre-filter", data.head.clone()),
            ("conventional, none", without_prefilter(data.head.clone())),
            (
                "H-infinity, none",
                without_prefilter(with_h_infinity(&data)),
            ),
        ]
        .into_iter()
        .zip(recorded)
        {
            let plain = told(&head, &data.plate, recipe);
            let previewed = told_with(&head, &data.plate, recipe, |head, job| {
                Some(ahead(head, job).unwrap())
            });
            let found = [&plain, &previewed].map(|t| [t.contour[0], t.fill[0]]);
            for (value, recorded) in found.as_flattened().iter().zip(recorded) {
                assert!((value - recorded).abs() < 0.005, "{found:.3?} {recorded}");
            }
            for (name, t) in [("as commanded", plain), ("preview", previewed)] {
                println!(
                    "{}, {structure}, {name}: median {:.4?} deg, contour {:.3?} largest {:.4} mm fill {:.4?}",
                    recipe.name,
                    t.median,
                    &t.contour[..4],
                    t.largest,
                    t.fill
                );
            }
        }
    }
}
