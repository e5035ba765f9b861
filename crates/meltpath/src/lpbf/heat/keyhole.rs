//! Whether vapour digs keyholes, which leave pores where they collapse: that what conducts melts through says nothing of them.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_thermal::pool::keyhole::{FULL_KEYHOLE, Mode};

use super::RecipeHeat;
use super::again::on_warm;
use super::boiling::{Boiling, by_law, raised, status};
use super::judge::dug;
use super::pace::Slow;
use super::settings::HeatSettings;

const REMEDY: &str = "less power, faster marks, a wider spot or a colder bed; or look for pores in sections of your own builds";

const AT_SPEED: &str = "light on a spot that runs at its speed: a run up to the lines (run_in of the recipe) and light off before they end, longer pieces, or power that follows the speed (power_down_to)";

/// How far the marks of a recipe are from keyholes: passes where all conduct or vapour only presses on the melt, where that was
/// measured; else it is to be looked at, and where a full keyhole lies outside of what was measured nothing can be said.
pub(in crate::lpbf) fn check(
    settings: &HeatSettings,
    number: usize,
    recipe: &str,
    heat: &RecipeHeat,
) -> Check {
    let id = format!("keyhole-{number}");
    let title = format!("{recipe}: keyhole number");
    let rank = |b: &&Boiling| (status(b), by_law(b));
    let worst = heat.boiling.iter().max_by(|a, b| {
        let (a, b) = (rank(a), rank(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let Some(worst) = worst else {
        let why = "the material's file has no boiling point: nothing is said of keyholes, nor of the pores that they leave";
        return Check::not_checked(&id, &title, why);
    };
    let value = Measure {
        sigma: None,
        ..Measure::exact(by_law(worst), "")
    };
    let check = Check {
        status: status(worst),
        value: Some(value),
        limit: Some(Limit::AtMost(FULL_KEYHOLE)),
        ..Check::not_checked(&id, &title, &reason(worst))
    };
    let [x, y] = worst.end;
    let place = Place {
        layer: worst.layer,
        ..Place::at([x, y, 0.0])
    };
    let check = check.at(place).remedy(REMEDY);
    let check = match heat.slowest.as_ref().filter(|slow| slow.is_off()) {
        Some(slow) if by_law(&slow.boiling) > by_law(worst) => as_run(check, slow),
        _ => check,
    };
    match &heat.warm {
        Some(warm) => on_warm(check, settings, &warm.hottest),
        None => check,
    }
}

/// The check, with what the spot does where it runs otherwise than its mark is commanded.
fn as_run(check: Check, slow: &Slow) -> Check {
    let [speed, commanded] = slow.speeds.map(|v| significant(v, 3));
    let number = by_law(&slow.boiling);
    let told = format!(
        "that is as commanded: as simulated the spot runs at {speed} mm/s of {commanded} mm/s over its own length or more: keyhole number {number:.1}, boiling number {:.1} there, by laws of steady marks",
        slow.boiling.number
    );
    let [x, y] = slow.boiling.end;
    let place = Place {
        layer: slow.boiling.layer,
        ..Place::at([x, y, 0.0])
    };
    raised(check, (slow.status(), number), &told, (place, AT_SPEED))
}

fn reason(boiling: &Boiling) -> String {
    let king = format!("boiling number {:.1}", boiling.number);
    match (status(boiling), &boiling.keyhole) {
        (Status::Pass, Ok(told)) if told.mode == Mode::Conduction => {
            format!("the laser conducts; {king}")
        }
        (Status::Warn, Ok(told)) if told.mode == Mode::Transition => format!(
            "by Gan et al. 2021 vapour presses on the melt, a full keyhole begins at the limit, by King et al. 2014 it digs one ({king}); {}",
            dug(boiling)
        ),
        (Status::Pass, Err(_)) => format!("the surface is far from boiling; {king}"),
        (Status::Pass, Ok(_)) => {
            format!(
                "vapour presses on the melt, a full keyhole begins at the limit; {}; {king}",
                dug(boiling)
            )
        }
        (Status::Warn, Ok(told)) if told.mode == Mode::Conduction => format!(
            "by Gan et al. 2021 the laser conducts, by King et al. 2014 it digs a keyhole ({king})"
        ),
        (Status::Warn, Ok(_)) => format!(
            "a full keyhole: the pores that it leaves where it collapses are not computed; {}; {king}",
            dug(boiling)
        ),
        (_, _) => format!(
            "pores of keyholes are not computed; {}; {king}",
            dug(boiling)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_thermal::material::file::{Readings, read};
    use meltpath_thermal::pool::keyhole::{Laser, keyhole};
    use meltpath_toolpath::Role;

    /// No keyhole is green: neither a full one, nor one beyond what was measured.
    #[test]
    fn keyholes_do_not_pass() {
        let text = meltpath_data::materials::IN625_LASER.text;
        let alloy = read(text, Readings::default()).unwrap();
        let judged = |number: f64, ambient: f64, laser: Laser| {
            let boiling = Boiling {
                kind: Role::Fill,
                number,
                keyhole: keyhole(&alloy, ambient, laser),
                end: [1.0, 2.0],
                layer: None,
            };
            (status(&boiling), reason(&boiling))
        };
        let laser = Laser {
            power: 80.0,
            speed: 800.0,
            spot: 0.1,
            flat: 0.28,
        };
        assert_eq!(judged(0.3, 293.15, laser).0, Status::Pass);
        let (status, words) = judged(1.3, 293.15, laser);
        assert!(status == Status::Warn && words.contains("King"), "{words}");
        let steep = Laser {
            power: 195.0,
            ..laser
        };
        assert_eq!(judged(0.9, 293.15, steep).0, Status::Pass);
        let full = Laser {
            flat: 0.99,
            ..steep
        };
        let (status, words) = judged(3.0, 293.15, full);
        assert!(
            status == Status::Warn && words.contains("a full keyhole"),
            "{words}"
        );
        // a bed just below the liquidus: chaotic, beyond what was measured
        let (status, words) = judged(9.0, alloy.liquidus - 50.0, full);
        assert!(
            status == Status::CannotSay && words.contains("is outside"),
            "{words}"
        );
        let narrow = Laser {
            power: 100.0,
            spot: 0.07,
            ..steep
        };
        assert_eq!(judged(0.9, 293.15, narrow).0, Status::Warn);
        assert_eq!(judged(0.4, 293.15, narrow).0, Status::Pass);
    }

    /// Where the spot runs slower than its mark, its own speed decides.
    #[test]
    fn a_spot_that_slows_down_into_a_keyhole_does_not_pass() {
        let text = meltpath_data::materials::IN625_LASER.text;
        let alloy = read(text, Readings::default()).unwrap();
        let slow = |speed: f64| {
            let laser = Laser {
                power: 230.0,
                speed,
                spot: 0.1,
                flat: 0.33,
            };
            Slow {
                boiling: Boiling {
                    kind: Role::Fill,
                    number: 0.9,
                    keyhole: keyhole(&alloy, 293.15, laser),
                    end: [1.0, 2.0],
                    layer: Some(3),
                },
                speeds: [speed, 1000.0],
            }
        };
        let passed = || Check::judge("k", "K", Measure::exact(3.0, ""), Limit::AtMost(6.0));
        let check = as_run(passed(), &slow(250.0));
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        assert!(check.value.as_ref().unwrap().value > 6.0);
        assert!(check.reason.contains("250 mm/s of 1000 mm/s"), "{check:?}");
        assert_eq!(check.place.unwrap().layer, Some(3));
        let check = as_run(passed(), &slow(800.0));
        assert_eq!(check.status, Status::Pass, "{check:?}");
        assert!(check.reason.contains("800 mm/s"), "{check:?}");
    }
}
