//! Layers of a file that a job does not run: how many there are, and what can be said of them without running them.

use meltpath_base::{Check, Fact, Status};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::gate::Darkness;
use meltpath_scan_head::head::job::prepare_layers;
use meltpath_scan_head::head::prepared::Layers;
use meltpath_scan_head::head::recipe::Recipe;

use super::plan::Plan;
use crate::job::lpbf::DelayChoice;
use crate::lpbf::plan::file_layers::FileLayers;
use crate::lpbf::plan::work::{Source, Work};

/// How many layers are judged, where there is more than one.
pub(crate) fn fact(work: &Work) -> Option<Fact> {
    let Work::Layers(set) = work else {
        return None;
    };
    let [judged, all] = set.counts();
    let told = Fact::words("layers", "layers judged", &format!("{judged} of {all}"));
    (all > 1).then_some(told)
}

/// The file of a job that leaves it to us which of its layers is run, and leaves some out.
fn chosen(plan: &Plan) -> Option<&FileLayers> {
    let Work::Layers(set) = &plan.work else {
        return None;
    };
    let [judged, all] = set.counts();
    match &set.source {
        Source::File(file) if judged < all && plan.settings.job.layers.range.is_none() => {
            Some(file)
        }
        Source::File(_) | Source::Part(_) => None,
    }
}

/// What is said of layers that the job leaves out without saying so: that they are not judged; and what of them cannot run at all.
pub(super) fn check(plan: &Plan) -> Option<Check> {
    let file = chosen(plan)?;
    let [judged, all] = file.counts;
    let [number, _] = file.numbers;
    let check = Check::not_checked(
        "layers-left-out",
        "layers of the file that were not run",
        &format!(
            "{judged} of {all} layers is judged, layer {number}, which marks most; the others lie in the field and are lit"
        ),
    );
    let range = "[layers] range with the numbers of all layers that are to be judged";
    let recipes = &plan.settings.recipes;
    let wrong = recipes.iter().find_map(|recipe| wrong(plan, file, recipe));
    Some(match wrong {
        None => Check {
            remedy: Some(range.to_owned()),
            ..check
        },
        Some(wrong) => Check {
            status: Status::Fail,
            reason: format!("{judged} of {all} layers is judged, layer {number}; {wrong}"),
            remedy: Some(format!("{range}, to see where; then mend them")),
            ..check
        },
    })
}

/// What of the layers of a file cannot run as its recipe says.
fn wrong(plan: &Plan, file: &FileLayers, recipe: &Recipe) -> Option<String> {
    let layers = || -> Result<Layers<'_>, HeadError> { Ok(prepare_layers(file.all()?, recipe)?) };
    let ready = plan.settings.data.head.ready();
    let surveyed = ready.and_then(|head| layers().and_then(|layers| head.survey(layers)));
    if let Err(e) = surveyed {
        return Some(format!("another one cannot run with {}: {e}", recipe.name));
    }
    if *plan.settings.job.lpbf.delays == DelayChoice::Tuned {
        return None;
    }
    let period = plan.settings.data.head.period;
    let darkness = layers().and_then(|layers| Darkness::of(layers, recipe.delays, period));
    let (layer, at) = darkness.ok()?.first_dark?;
    Some(format!(
        "layer {layer} has marks that stay dark with the delays of {}, the first at ({:.2}, {:.2}) mm",
        recipe.name, at.x, at.y
    ))
}
