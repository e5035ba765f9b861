//! Marks that lie along others of their layer, told: how many on one place, and how soon after each other.

use meltpath_base::number::significant;
use meltpath_base::{Place, Reporter};
use meltpath_scan_head::head::survey::Survey;

use super::heat::HeatSettings;

/// Share of marks on others from which on they are told.
const SHARE: f64 = 0.01;
/// Marks on one place that are told however short they are: more than these.
const MARKS: usize = 2;

/// Tells marks that are drawn again: the energy on their way is that of all of them.
pub(super) fn tell(
    (number, recipe): (usize, &str),
    survey: &Survey,
    heat: Option<&HeatSettings>,
    reporter: &Reporter,
) {
    let again = &survey.again;
    let marked = survey.contours + survey.fills;
    let share = again.length / marked.max(f64::MIN_POSITIVE);
    if again.most < 2 || (share <= SHARE && again.most <= MARKS) {
        return;
    }
    let judged = match heat {
        Some(_) => format!("again-{number} tells how warm they leave the place"),
        None => "what that does is not judged without [heat]".to_owned(),
    };
    let place = Place {
        layer: Some(again.layer),
        ..Place::at([again.at.x, again.at.y, 0.0])
    };
    reporter.warn_at(
        "marked-twice",
        format!(
            "{recipe}: {} % of the length of all marks lie along other marks of their layer; up to {} marks on one place, one {} ms after another: there the energy is that of as many; {judged}",
            significant(100.0 * share, 2),
            again.most,
            significant(1e3 * again.soonest, 3),
        ),
        place,
        "where that is not meant, export each line once",
    );
}
