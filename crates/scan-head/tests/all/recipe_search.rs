//! The search of the fastest recipe, on two small squares.

use meltpath_base::Silent;
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::head::interpolation::sample_count;
use meltpath_scan_head::head::prepared::alone;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::measures::fill_rate::{FillMode, FillRate};
use meltpath_scan_head::search::{Bounds, Candidate, Found, Problem, search};

use super::near;
use super::reference::{job_of, recipes, three_axis_data};

/// What was tried.
fn tell(found: &Found) {
    for c in &found.tried {
        println!(
            "{:.4} s, share {:.3}, fill {:.3}, unlit {:.4} of {:.4} mm, stray {:.4} of {:.4} mm, within {}",
            c.duration,
            c.contour_share,
            c.fill_rate,
            c.unlit,
            found.most_unlit,
            c.stray,
            c.most_stray,
            c.within
        );
    }
}

/// The first candidate is the recipe that was given: its rates are those of a run with the delays that were tuned, the fill rate the
/// that of the worse square. Of speeds that all keep the bounds the fastest is found.
#[test]
fn a_candidate_is_judged_as_a_run_with_its_delays() {
    let data = three_axis_data();
    let plate = SquarePlate {
        columns: 2,
        rows: 1,
        side: 1.5,
        ..data.plate
    };
    let recipe = recipes()[0].clone();
    let fill = || FillRate::of_rectangles(plate.fill_areas(), 0.07, &[FillMode::SweptSpot]);
    let problem = Problem {
        head: &data.head,
        recipe: &recipe,
        job: &|recipe: &Recipe| Ok(job_of(&plate, recipe)),
        fill: &|_| fill(),
        samples: &|recipe: &Recipe, period| sample_count(alone(&job_of(&plate, recipe)), period),
    };
    let bounds = Bounds {
        contour_speed: [recipe.contour_speed, 1.3 * recipe.contour_speed],
        fill_speed: [recipe.fill_speed, 1.3 * recipe.fill_speed],
        mark_waits: vec![recipe.mark_wait],
        jump_factors: vec![1.0],
        filter_factors: vec![1.0],
        contour_error: 10.0,
        contour_share: 0.9,
        fill_rate: 0.01,
    };
    let found = search(&problem, &bounds, &Silent).unwrap();
    let (start, best) = (&found.start, found.best.as_ref().unwrap());
    // nothing stands against the fastest
    near(best.recipe.contour_speed, bounds.contour_speed[1], 1e-9);
    near(best.recipe.fill_speed, bounds.fill_speed[1], 1e-9);
    assert!(best.duration < start.duration);
    // contours of which no light reaches more than a spot heals
    assert!(found.most_unlit == 10.0 && best.unlit <= 10.0, "{best:?}");
    let ready = data.head.ready().unwrap();
    let mut sink = fill();
    let job = job_of(&plate, &recipe);
    ready
        .run(&job, start.recipe.delays, 1, &Silent, &mut sink)
        .unwrap();
    let squares = sink.finish();
    let rates: Vec<f64> = squares.iter().map(|s| s.rates[0].share).collect();
    assert_eq!(rates.len(), 2);
    assert!(rates.iter().all(|r| *r > 0.5));
    near(start.fill_rate, rates[0].min(rates[1]), 1e-12);
    let period = data.head.period;
    near(
        start.duration,
        (sample_count(alone(&job), period).unwrap() - 1) as f64 * period,
        1e-12,
    );
    // what leaves more of a contour dark than a spot heals is not taken, however fast
    let hasty = Bounds {
        contour_speed: [recipe.contour_speed, 6.0 * recipe.contour_speed],
        contour_error: 0.03,
        contour_share: 0.01,
        ..bounds.clone()
    };
    let still = Recipe {
        jump_wait: 2e-3,
        ..recipe.clone()
    };
    let waiting = Problem {
        recipe: &still,
        ..problem
    };
    let found = search(&waiting, &hasty, &Silent).unwrap();
    tell(&found);
    let best = found.best.as_ref().unwrap();
    let dark = |c: &&Candidate| c.unlit > found.most_unlit && c.contour_share >= 0.01;
    let faster = found
        .tried
        .iter()
        .filter(dark)
        .any(|c| c.duration < best.duration);
    assert!(faster && best.unlit <= found.most_unlit, "{best:?}");
    // of a head that its data sheet alone tells, strays count as they do for the judge
    let share = |left_out: Option<f64>| {
        let mut head = data.head.clone();
        head.left_out = left_out.map(Some);
        let problem = Problem {
            head: &head,
            ..problem
        };
        let bounds = Bounds {
            contour_speed: [recipe.contour_speed; 2],
            fill_speed: [recipe.fill_speed; 2],
            contour_error: 0.03,
            ..bounds.clone()
        };
        search(&problem, &bounds, &Silent)
            .unwrap()
            .start
            .contour_share
    };
    let (known, straying) = (share(None), share(Some(0.03)));
    // a normal law of one deviation leaves no more than 68.3 % within it
    assert!(straying < known && straying < 0.69, "{known} {straying}");
}
