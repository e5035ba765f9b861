//! The judgement of what a recipe melts.

use meltpath_base::{Check, Limit, Measure, Place, Reporter, Status};

use super::{HeatSettings, RecipeHeat};

/// Boiling number from which vapour deepens the pool noticeably, and from which a keyhole forms.
const BOILING: [f64; 2] = [0.5, 1.0];

/// Judges a recipe, and warns of what the model does not hold. Where the surface is near boiling, pools are deeper than the model
/// tells: what it does not melt through may be melted all the same, and nothing is said against it.
pub fn check(
    settings: &HeatSettings,
    number: usize,
    recipe: &str,
    heat: &RecipeHeat,
    reporter: &Reporter,
) -> Check {
    let worst = heat
        .boiling
        .iter()
        .map(|b| b.number)
        .max_by(f64::total_cmp)
        .filter(|number| *number > BOILING[0]);
    if let Some(worst) = worst {
        let what = if worst > BOILING[1] {
            "the surface boils and vapour digs a keyhole"
        } else {
            "the surface is near boiling and vapour deepens the pool"
        };
        reporter.warn(
            "keyhole",
            format!(
                "{recipe}: {what} (boiling number {worst:.1}; a keyhole from 1 on); true pools are deeper than those told, and absorb more"
            ),
            "take the share melted through as a lower bound; against keyhole pores: less power, faster marks or a wider spot",
        );
    }
    if heat.cut {
        reporter.warn(
            "heat-cut",
            format!(
                "{recipe}: only the first {:.2} m of marks were followed by the heat engine",
                1e-3 * settings.marks
            ),
            "raise heat.marks; a metre takes some ten seconds",
        );
    }
    let [asked, marked, less] = &heat.drawings;
    let id = format!("fusion-{number}");
    let depth = 1e3 * settings.layer;
    if asked.area == 0.0 {
        let title = format!("{recipe}: melted through {depth:.0} µm");
        let reason = "the commanded path itself melts through nowhere";
        return match worst {
            Some(_) => unsaid(Check::not_checked(&id, &title, reason)),
            None => Check {
                status: Status::Fail,
                ..Check::not_checked(&id, &title, reason)
            },
        }
        .remedy("more power, slower marks or thinner layers");
    }
    let value = Measure::new(
        100.0 * marked.share,
        100.0 * (marked.share - less.share).abs(),
        "%",
    );
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
    let check = match (worst, check.status) {
        (Some(_), Status::Fail | Status::Warn) => unsaid(check),
        _ => check,
    };
    match heat.cold.iter().max_by(|a, b| a.share.total_cmp(&b.share)) {
        Some(worst) => check.at(Place::at([worst.place[0], worst.place[1], 0.0])),
        None => check,
    }
}

/// The check where the model only bounds from below.
fn unsaid(check: Check) -> Check {
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because("by conduction alone, a lower bound here: vapour deepens these pools")
}
