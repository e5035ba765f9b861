//! The judgement of what a recipe melts.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Reporter, Status};

use meltpath_thermal::pool::keyhole::Mode;

use super::boiling::{BOILING, Boiling};
use super::settings::HeatSettings;
use super::weakest::{Choice, NotTold};
use super::{OnLiquid, RecipeHeat};

/// Judges a recipe, and warns of what the model does not hold. Where the surface is near boiling, pools are deeper than the model
/// tells: what it does not melt through may be melted all the same, and nothing is said against it.
pub fn check(
    settings: &HeatSettings,
    number: usize,
    recipe: &str,
    heat: &RecipeHeat,
    reporter: &Reporter,
) -> Check {
    tell((settings, recipe), heat, reporter);
    // vapour excuses what it may have melted, and nothing else
    let excused = heat.bound >= settings.share;
    let worst = vapour(&heat.own);
    let excuse = worst.filter(|_| excused);
    let [asked, marked, less, more] = &heat.drawings;
    let id = format!("fusion-{number}");
    let choice = &heat.choice;
    let depth = 1e3 * choice.depth;
    if asked.area == 0.0 {
        let title = format!("{recipe}: melted through {depth:.0} µm");
        let reason = "the commanded path itself melts through nowhere";
        let none = Check::not_checked(&id, &title, reason);
        let check = match excuse {
            Some(worst) => unsaid(none, worst),
            None => Check {
                status: Status::Fail,
                ..unless_vapour(none, worst, heat)
            },
        };
        let check = among(check, choice).remedy("more power, slower marks or thinner layers");
        return match choice.layer {
            Some(layer) => check.at(Place::layer(layer)),
            None => check,
        };
    }
    let moved = [less, more].map(|other| (marked.share - other.share).abs());
    let sigma = 100.0 * moved[0].max(moved[1]);
    let value = Measure::new(100.0 * marked.share, sigma, "%");
    let remedy = if asked.share < settings.share {
        "the path is too thin as commanded: a closer hatch, more power, slower marks or thinner layers"
    } else {
        "the machine loses it: other laser delays, slower marks or a controller that lags less"
    };
    let check = Check::judge(
        &id,
        &format!("{recipe}: share of the surface melted through {depth:.0} µm"),
        value,
        Limit::AtLeast(100.0 * settings.share),
    )
    .remedy(remedy);
    let one_pool = heat
        .liquid
        .filter(|l| is_open(l, check.status, settings.share, sigma));
    let check = match (worst, check.status) {
        _ if one_pool.is_some() => check,
        (Some(worst), Status::Fail | Status::Warn) if excused => unsaid(check, worst),
        (_, Status::Fail) => unless_vapour(check, worst, heat),
        (_, Status::Pass | Status::Warn) if heat.cut => Check {
            status: Status::CannotSay,
            ..check
        }
        .because("only the first marks were followed by the heat engine")
        .remedy("raise heat.marks, so that all of the layer is drawn"),
        (Some(_), Status::Pass) => check.because(
            "by conduction alone, a lower bound: vapour deepens these pools, what keyholes leave is a check of its own",
        ),
        _ => check,
    };
    let check = stands_for(among(check, choice), choice);
    if choice.not_told.is_some() && check.status == Status::CannotSay {
        return check;
    }
    if let Some(liquid) = one_pool {
        return of_one_pool(check, &liquid, choice);
    }
    match heat.cold.iter().max_by(|a, b| a.share.total_cmp(&b.share)) {
        Some(worst) => check.at(Place {
            layer: choice.layer,
            ..Place::at([worst.place[0], worst.place[1], 0.0])
        }),
        None => check,
    }
}

/// The marks nearest to boiling, where these are near enough for vapour.
fn vapour(marks: &[Boiling]) -> Option<&Boiling> {
    let near = marks.iter().filter(|b| b.number > BOILING[0]);
    near.max_by(|a, b| a.number.total_cmp(&b.number))
}

/// Warns of what the model does not hold.
fn tell((settings, recipe): (&HeatSettings, &str), heat: &RecipeHeat, reporter: &Reporter) {
    if let Some(worst) = vapour(&heat.boiling) {
        let what = if worst.number > BOILING[1] {
            "the surface boils and vapour digs a keyhole"
        } else {
            "the surface is near boiling and vapour deepens the pool"
        };
        reporter.warn(
            "keyhole",
            format!(
                "{recipe}: {what} (boiling number {:.1}; a keyhole from 1 on); true pools are deeper than those told, and absorb more; {}",
                worst.number,
                dug(worst)
            ),
            "take the share melted through as a lower bound; against keyhole pores: less power, faster marks or a wider spot",
        );
    }
    if heat.cut {
        reporter.warn(
            "heat-cut",
            format!(
                "{recipe}: only the first {} mm of marks were followed by the heat engine",
                significant(settings.marks, 3)
            ),
            "raise heat.marks; a metre takes some ten seconds",
        );
    }
}

/// Whether the outcome hangs on what falls on liquid ground, of which the engine does not know what it melts: what passes has to pass without,
/// what does not has to stay too little were all melted beside it.
fn is_open(liquid: &OnLiquid, status: Status, share: f64, sigma: f64) -> bool {
    match status {
        Status::Pass => 100.0 * (liquid.without - share) <= sigma,
        Status::Warn | Status::Fail => liquid.with >= share,
        Status::CannotSay | Status::NotChecked => false,
    }
}

/// The check that hangs on what falls on liquid ground.
fn of_one_pool(check: Check, liquid: &OnLiquid, choice: &Choice) -> Check {
    let told = format!(
        "{} mm are drawn where the metal is still liquid before the spot comes: one pool, of which the engine does not know how deep it gets; without that heat {:.0} % are melted through, and {:.0} % if all beside it is",
        significant(liquid.length, 2),
        100.0 * liquid.without,
        100.0 * liquid.with
    );
    let place = Place {
        layer: choice.layer,
        ..Place::at([liquid.place[0], liquid.place[1], 0.0])
    };
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&told)
    .at(place)
    .remedy("draw each line once, lines farther apart, or let the place cool: other marks between, or a wait")
}

/// The check, with which of several layers it is of.
fn among(check: Check, choice: &Choice) -> Check {
    match choice.layer {
        Some(layer) if choice.of > 1 => check.because(&format!(
            "layer {layer} of the {} that are marked was drawn, which melts no better than those that it stands for",
            choice.of
        )),
        _ => check,
    }
}

/// The check of a layer that is not all: others may melt less.
fn stands_for(check: Check, choice: &Choice) -> Check {
    let Some(NotTold { first, layers }) = choice.not_told else {
        return check;
    };
    if check.status == Status::Fail {
        return check;
    }
    let more = match layers {
        1 => String::new(),
        n => format!(" and for {} more", n - 1),
    };
    let reason = format!(
        "it does not stand for layer {first}{more}: marks of other power or speed, lines further apart, or a thicker layer"
    );
    Check {
        status: check.status.max(Status::CannotSay),
        ..check
    }
    .because(&reason)
    .at(Place::layer(first))
    .remedy(format!(
        "run those by themselves, too: [layers] range = [{first}, {first}]"
    ))
}

/// The check where the model only bounds from below.
fn unsaid(check: Check, worst: &Boiling) -> Check {
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&format!(
        "by conduction alone, a lower bound here: vapour deepens these pools; {}",
        dug(worst)
    ))
}

/// The check that fails though vapour deepens some of the pools: those are too few.
fn unless_vapour(check: Check, worst: Option<&Boiling>, heat: &RecipeHeat) -> Check {
    if worst.is_none() {
        return check;
    }
    check.because(&format!(
        "vapour deepens some of the pools: were all melted beside the marks that bring it, it would be {:.0} %",
        100.0 * heat.bound
    ))
}

/// What is known of the keyhole.
pub(crate) fn dug(boiling: &Boiling) -> String {
    match &boiling.keyhole {
        Ok(told) if told.mode == Mode::Conduction => {
            format!(
                "no keyhole, and {:.0} % of the light absorbed, by scaling (keyhole number {:.1}, from 1.4 on; Gan et al. 2021)",
                100.0 * told.absorptivity,
                told.number
            )
        }
        Ok(told) => format!(
            "the keyhole alone is {:.0} ± {:.0} µm deep, and absorbs {:.0} % of the light, by scaling (keyhole number {:.1}, Gan et al. 2021)",
            1e3 * told.depth,
            1e3 * told.depth_sigma,
            100.0 * told.absorptivity,
            told.number
        ),
        Err(beyond) => {
            format!("how deep, and how much light is absorbed, cannot be said: {beyond}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_thermal::material::file::{Readings, read};
    use meltpath_thermal::pool::keyhole::{Laser, keyhole};
    use meltpath_toolpath::Role;

    #[test]
    fn a_keyhole_is_told_where_it_was_measured_and_nowhere_else() {
        let text = meltpath_data::materials::IN625_LASER.text;
        let alloy = read(text, Readings::default()).unwrap();
        let told = |power: f64, spot: f64| {
            let laser = Laser {
                power,
                speed: 800.0,
                spot,
                flat: 0.28,
            };
            dug(&Boiling {
                kind: Role::Fill,
                number: 0.9,
                keyhole: keyhole(&alloy, 293.15, laser),
                end: [0.0; 2],
                layer: None,
            })
        };
        for (power, spot, words) in [
            (195.0, 0.1, "53 ± 18 µm"),
            (195.0, 0.1, "absorbs 35 % of the light"),
            (80.0, 0.1, "no keyhole, and 28 % of the light absorbed"),
            (195.0, 0.07, "cannot be said: a spot of 70 µm is outside"),
            (195.0, 0.07, "88 to 140 µm"),
        ] {
            let told = told(power, spot);
            assert!(told.contains(words), "{told}");
        }
    }
}
