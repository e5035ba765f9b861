//! Heads by their data sheet: what the whole chain makes of a corner against the closed form, and what is refused.

use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_scan_head::files::parse_head;
use meltpath_scan_head::head::prepared::alone;
use meltpath_scan_head::head::recipe::LaserDelays;
use meltpath_scan_head::head::vector::{ScanJob, Vector};
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_scan_head::measures::dark_way::LightReach;
use meltpath_toolpath::Role;

const HEAD: &str = r#"
[head]
name = "by its data sheet"
sampling = { value = "200 kHz", source = "test" }
field = { value = "200 mm", source = "test" }
[geometry]
kind = "f-theta"
focal_length = { value = "330 mm", source = "test" }
[beam]
waist = { value = "40 µm", source = "test" }
wavelength = { value = "1070 nm", source = "test" }
quality = { value = "1.1 1", source = "test" }
[servo]
tracking_delay = { value = "0.3 ms", source = "test" }
top_speed = { value = "12 m/s", source = "test" }
"#;

fn vector(kind: Role, end: DVec3, speed: f64) -> Vector {
    Vector {
        kind,
        end,
        speed,
        power: 100.0,
        wait: 0.0,
        block: 0,
    }
}

/// The spot of a corner at `speed` mm/s without wait, critically damped: one axis comes to rest by vτ e^(-ωt) + vt e^(-ωt), the
/// other starts as it lags by the same. It leaves the two lines by the smaller of the two.
fn farthest(speed: f64, delay: f64) -> f64 {
    let omega = 2.0 / delay;
    let short = |t: f64| speed * (delay + t) * (-omega * t).exp();
    let begun = |t: f64| speed * (t - delay) + short(t);
    (0..20_000)
        .map(|k| 1e-4 * delay * f64::from(k))
        .map(|t| short(t).min(begun(t)))
        .fold(0.0, f64::max)
}

#[test]
fn a_corner_is_cut_as_the_closed_form_tells() {
    let head = parse_head(HEAD).unwrap().head.ready().unwrap();
    let mut found = Vec::new();
    for speed in [400.0, 800.0, 1600.0] {
        let far = 40.0;
        let job = ScanJob {
            start: DVec3::new(-far, 0.0, 0.0),
            vectors: vec![
                vector(Role::Contour, DVec3::ZERO, speed),
                vector(Role::Contour, DVec3::new(0.0, far, 0.0), speed),
            ],
        };
        let delays = LaserDelays { on: 2e-3, off: 0.0 };
        let mut errors = PathErrors::new(1e-3, head.head().period, LightReach::of(0.065, 0.03));
        let samples = head.survey(alone(&job)).unwrap().samples;
        head.run_layers(alone(&job), (delays, samples), 1, &Silent, &mut errors)
            .unwrap();
        let wanted = farthest(speed, 0.3e-3);
        let cut = errors.contour.largest;
        println!("{speed} mm/s: {cut:.4} mm, by the closed form {wanted:.4} mm");
        assert!((cut / wanted - 1.0).abs() < 0.02, "{cut} {wanted}");
        assert!(errors.worst.length() < 1.0, "{}", errors.worst);
        found.push(cut);
    }
    // in proportion to the speed
    assert!((found[2] / found[0] - 4.0).abs() < 0.05);
}

#[test]
fn figures_that_contradict_one_another_are_refused_at_their_keys() {
    let told = |more: &str| {
        parse_head(&format!("{HEAD}{more}\n"))
            .unwrap_err()
            .to_string()
    };
    let of =
        |key: &str, value: &str| format!("{key} = {{ value = \"{value}\", source = \"test\" }}\n");
    let step = |time: &str| of("step_length", "20 mm") + &of("step_time", time);
    assert!(parse_head(&format!("{HEAD}{}", step("3 ms"))).is_ok());
    assert!(told(&step("0.5 ms")).contains("alone take"));
    assert!(told(&of("step_length", "20 mm")).contains("needs its time"));
    assert!(told(&of("step_time", "3 ms")).contains("needs its length"));
    let twice = step("3 ms") + &of("acceleration", "20000 m/s²");
    assert!(told(&twice).contains("told twice"));
    assert!(told("bits = 4").contains("bits"));
    let quick = HEAD.replace("0.3 ms", "0.015 ms");
    assert!(
        parse_head(&quick)
            .unwrap_err()
            .to_string()
            .contains("four sample periods")
    );
    // what is wrong with a figure of the axes is said, and not that they are missing
    let still = HEAD.replace("0.3 ms", "0 ms");
    let still = parse_head(&still).unwrap_err().to_string();
    assert!(
        still.contains("tracking_delay") && !still.contains("missing"),
        "{still}"
    );
    let wide = HEAD.replace("200 mm", "900 mm");
    let wide = parse_head(&wide).unwrap_err().to_string();
    assert!(wide.contains("optical angle of 78 deg"), "{wide}");
    let none = &HEAD[..HEAD.find("[servo]").unwrap()];
    assert!(
        parse_head(none)
            .unwrap_err()
            .to_string()
            .contains("[servo]")
    );
    let shipped = meltpath_data::scan_heads::TWO_AXIS_150.text;
    let both = format!("{shipped}\n{}", &HEAD[HEAD.find("[servo]").unwrap()..]);
    assert!(
        parse_head(&both)
            .unwrap_err()
            .to_string()
            .contains("leave out one")
    );
}

/// The acceleration of a step, in the field's own terms, whatever the objective.
#[test]
fn a_step_gives_the_same_spot_behind_any_objective() {
    let step = "step_length = { value = \"20 mm\", source = \"test\" }\nstep_time = { value = \"3 ms\", source = \"test\" }\n";
    let text = format!("{HEAD}{step}");
    let of = |text: &str| {
        let head = parse_head(text).unwrap().head;
        let axis = head.mirrors[0].start(head.period, 0.0, 1).unwrap();
        let lever = head
            .geometry
            .jacobian(meltpath_geometry::math::DVec2::ZERO)
            .x_axis
            .x;
        let set_points = vec![20.0 / lever; 800];
        let angles = axis.record(&set_points).unwrap().angle;
        angles.iter().map(|a| a * lever).collect::<Vec<_>>()
    };
    let (one, other) = (of(&text), of(&text.replace("330 mm", "165 mm")));
    // within a thousandth of the field after 3 ms, not before 2.5 ms
    assert!(one[602..].iter().all(|at| (at - 20.0).abs() <= 0.2));
    assert!(one[540..602].iter().any(|at| (at - 20.0).abs() > 0.2));
    assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-6));
}
