//! What is known of the axes' friction, and what it does to a verdict: where the head's file states a range, every recipe is run
//! with the least and with the most of it, too, and a check holds only if it comes out alike.

use meltpath_base::number::significant;
use meltpath_base::{Check, Fact, Status};
use meltpath_scan_head::axis::friction::{Drag, Friction};
use meltpath_scan_head::files::HeadData;

use super::result::{AtEnd, RecipeResult};
use super::settings::Settings;
use super::strays;

/// What holds X, Y and Z, where it is another friction than the value of the head's file.
pub(super) type Drags = [Option<Drag>; 3];

/// The least and the most friction of a head: every range of its file at its end; `None` where it states none.
pub(super) fn ends(data: &HeadData) -> Option<[Drags; 2]> {
    let of = |k: usize| data.drag.each_ref().map(|known| Some(known.ends?[k]));
    let ranged = data.drag.iter().any(|known| known.ends.is_some());
    ranged.then(|| [of(0), of(1)])
}

/// The range in words.
pub(crate) fn fact(data: &HeadData) -> Option<Fact> {
    let torque = |drag: &Drag| match drag.dry {
        Friction::None => 0.0,
        Friction::Coulomb { coulomb, .. }
        | Friction::Karnopp { coulomb, .. }
        | Friction::LuGre { coulomb, .. } => coulomb,
    };
    let shown = |torque: f64| significant(1e6 * torque, 3);
    let axes = ['X', 'Y', 'Z'].into_iter().zip(&data.drag);
    let told: Vec<String> = axes
        .filter_map(|(letter, known)| {
            let [least, most] = known.ends.as_ref()?.each_ref().map(torque);
            Some(format!("{letter} {} to {} µN·m", shown(least), shown(most)))
        })
        .collect();
    let words = format!(
        "{} of Coulomb torque by the head's file; each check is made with its value, the least and the most",
        told.join(", ")
    );
    (!told.is_empty()).then(|| Fact::words("friction", "friction of the axes", &words))
}

/// A check that holds for whatever friction the head's file allows: where the ends of the range come out otherwise than the
/// value, it cannot be decided.
pub(super) fn over_the_range(
    check: Check,
    result: &RecipeResult<'_>,
    judge: impl Fn(&AtEnd) -> Option<Check>,
) -> Check {
    let Some([least, most]) = &result.ends else {
        return check;
    };
    let (Some(least), Some(most)) = (judge(least), judge(most)) else {
        return check;
    };
    merged(check, &least, &most)
}

fn merged(check: Check, least: &Check, most: &Check) -> Check {
    let told = |c: &Check| c.value.as_ref().map(ToString::to_string);
    let figures = told(least).zip(told(most));
    let words = figures.map(|(least, most)| {
        if least == most {
            format!("{least} with the least and with the most friction of the head's file")
        } else {
            format!("{least} with the least friction of the head's file, {most} with the most")
        }
    });
    let statuses = [check.status, least.status, most.status];
    let worst = statuses.into_iter().max().unwrap_or(check.status);
    let alike = statuses.iter().all(|s| *s == check.status);
    let status = match worst {
        Status::Fail if !alike => Status::CannotSay,
        worst => worst,
    };
    let remedies = [&check, least, most].map(|c| c.remedy.clone());
    let check = Check { status, ..check };
    let remedy = remedies.into_iter().flatten().next().unwrap_or_default();
    let words = words.unwrap_or_default();
    if status == Status::CannotSay && !alike {
        let reason = format!("the friction of the axes decides: {words}");
        check
            .because(&reason)
            .remedy(format!("{MEASURE}; or {remedy}"))
    } else if words.is_empty() {
        check.remedy(remedy)
    } else {
        check.because(&words).remedy(remedy)
    }
}

/// What narrows the range.
const MEASURE: &str = "measure the friction of the axes (`meltpath identify`) and write its range into the head's file";

/// A check on a head whose friction is a guess by its own file, and nobody says how far off: no promise.
pub(super) fn unless_guessed(check: Check, settings: &Settings) -> Check {
    let check = strays::unless_guessed(check, settings);
    let known = settings.data.drag.iter();
    let guesses: Vec<&str> = known
        .flat_map(|known| known.guesses.iter().map(String::as_str))
        .collect();
    if guesses.is_empty() || check.status == Status::NotChecked {
        return check;
    }
    let reason = format!(
        "by the head's own file a guess, without a range: {}",
        guesses.join(", ")
    );
    let status = check.status.max(Status::CannotSay);
    let check = Check { status, ..check }.because(&reason);
    match status {
        Status::Fail => check,
        _ => check.remedy(
            "measure the friction of the axes (`meltpath identify`), or write low and high of what is known of it",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::{Limit, Measure};

    fn judged(value: f64) -> Check {
        let limit = Limit::AtLeast(90.0);
        Check::judge("c", "C", Measure::exact(value, "%"), limit).remedy("slower")
    }

    #[test]
    fn a_check_holds_only_if_it_holds_over_the_range() {
        for (value, least, most, status) in [
            (95.0, 99.0, 91.0, Status::Pass),
            (95.0, 99.0, 80.0, Status::CannotSay),
            (80.0, 99.0, 70.0, Status::CannotSay),
            (80.0, 85.0, 70.0, Status::Fail),
        ] {
            let check = merged(judged(value), &judged(least), &judged(most));
            assert_eq!(check.status, status, "{value} {least} {most}");
            assert_eq!(check.value, Some(Measure::exact(value, "%")));
            for figure in [least, most] {
                assert!(
                    check.reason.contains(&format!("{figure} %")),
                    "{}",
                    check.reason
                );
            }
            assert_eq!(check.remedy.is_some(), status != Status::Pass);
        }
    }
}
