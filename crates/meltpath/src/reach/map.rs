//! The map of margins in words: where the part can be, the best place, and whether a run would take it.

use meltpath_base::number::significant;
use meltpath_base::settings;
use meltpath_robot::cell::{Arrangement, Cell};
use meltpath_robot::posture::Held;

use crate::job::waam::ChecksTable;

/// Places of the map along a side.
pub(super) const PLACES: u32 = 15;

/// Margins that differ by less are alike where the robot holds the part, rad: it is held nearer to the flange then.
const ALIKE: f64 = 0.02;

/// Where a part can be, in lines, and whether a run can take the best place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Map {
    /// The map, the best place, and what of it is a guess.
    pub lines: Vec<String>,
    /// Whether there is a place for a run.
    pub found: Found,
}

/// What a map found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// A place where the arm keeps from its limits what a run asks for by default.
    APlace,
    /// None.
    NoPlace,
}

/// What the arm keeps at a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Margin {
    /// From limits and from singularities, rad.
    pub(super) least: f64,
    /// From limits alone, rad.
    limit: f64,
    /// The joint that comes nearest to its limit, from 0.
    joint: usize,
}

impl Margin {
    pub(super) fn of(held: &Held) -> Self {
        let m = &held.margins;
        let all = [m.limit, m.wrist, m.elbow].into_iter().flatten();
        Margin {
            least: all.map(|l| l.value).fold(f64::INFINITY, f64::min),
            limit: m.limit.map_or(f64::INFINITY, |l| l.value),
            joint: m.limit.map_or(0, |l| l.joint),
        }
    }
}

/// A place of the part, on the table or in the flange.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// The part's origin, mm.
    pub(super) at: [f64; 3],
    /// What the arm keeps there; nothing where the part is out of reach.
    pub(super) margin: Option<Margin>,
    /// How far the part reaches over the table's edge, mm: 0 where it does not, or where nobody says how large the table is.
    pub(super) over: f64,
    /// How far beside the flange's axis the robot holds the middle of the part, mm; 0 on a table.
    pub(super) aside: f64,
}

/// What a run asks of a joint's distance from its limits unless the job says another, rad.
fn asked() -> f64 {
    let checks = settings::read::<ChecksTable>("").settings;
    checks.map_or(0.0, |c| c.joint_margin.0)
}

/// The map of a part's places, row by row from the greatest y.
pub(super) fn told(cell: &Cell, part: &str, places: &[Place]) -> Map {
    let (place, axes) = match cell.arrangement {
        Arrangement::TorchOnRobot => (
            "on the table",
            "x to the right, y up, as the table's; ' where the part reaches over the table's edge",
        ),
        Arrangement::PartOnRobot => (
            "in the flange",
            "x to the right, y up, as the flange's: its axis goes through the part everywhere on the map",
        ),
    };
    let mut lines = vec![
        format!("{part} {place} of {}", cell.name),
        "deg that the arm keeps from limits and singularities with the middle of the part at each place; . out of reach".to_owned(),
        axes.to_owned(),
    ];
    for row in places.chunks(PLACES as usize) {
        let cells = row.iter().map(|place| {
            let edge = if place.over > 0.0 { "'" } else { " " };
            match place.margin {
                Some(margin) => format!("{:4.0}{edge}", margin.least.to_degrees()),
                None => format!("{:>4} ", "."),
            }
        });
        lines.push(cells.collect::<String>().trim_end().to_owned());
    }
    let asked = asked();
    let best = best(places, asked);
    match best {
        Some((place, margin)) => {
            let at = place.at.map(|x| format!("\"{} mm\"", whole(x))).join(", ");
            lines.push(format!(
                "best: place = [{at}], {} deg{}",
                significant(margin.least.to_degrees(), 3),
                over(place.over)
            ));
            lines.extend(too_little(margin, asked, cell.arrangement));
        }
        None => lines.push(nowhere(cell.arrangement).to_owned()),
    }
    let guesses = cell.guesses();
    if !guesses.is_empty() {
        lines.push(format!(
            "GUESSED in the robot's file: {}",
            guesses.join(", ")
        ));
    }
    let found = match best {
        Some((_, margin)) if margin.limit >= asked => Found::APlace,
        _ => Found::NoPlace,
    };
    Map { lines, found }
}

fn nowhere(arrangement: Arrangement) -> &'static str {
    match arrangement {
        Arrangement::TorchOnRobot => "nowhere on the table: move the table, or take a longer arm",
        Arrangement::PartOnRobot => {
            "nowhere in the flange: move the torch, or take a longer arm; height and turn of the part in the flange are those of [part] in the robot's file"
        }
    }
}

/// That even the best place keeps less than a run asks for, and what to change.
fn too_little(margin: Margin, asked: f64, arrangement: Arrangement) -> Option<String> {
    if margin.limit >= asked {
        return None;
    }
    let move_it = match arrangement {
        Arrangement::TorchOnRobot => "the table or the arm ([table], [base])",
        Arrangement::PartOnRobot => "the torch or the arm ([torch], [base]), or the part's height",
    };
    Some(format!(
        "a run fails there: joint {} comes to {} deg from its limits, and a run asks for {} deg (checks.joint_margin); no place keeps that. Move {move_it}, bend the torch's neck, or take an arm whose joint goes farther",
        margin.joint + 1,
        significant(margin.limit.to_degrees(), 3),
        significant(asked.to_degrees(), 3),
    ))
}

/// Of the places that keep from limits what is asked, where there are any: those where the part lies on the table as a whole, else those where
/// the least of it hangs over; of these the one with the greatest margin, the first of several; in the flange, of those with about as much, the
/// one held nearest to its axis.
fn best(places: &[Place], asked: f64) -> Option<(&Place, Margin)> {
    let held = || places.iter().filter_map(|p| Some((p, p.margin?)));
    let enough = held().any(|(_, m)| m.limit >= asked);
    let fit = || held().filter(|(_, m)| !enough || m.limit >= asked);
    let least = fit().map(|(p, _)| p.over).fold(f64::INFINITY, f64::min);
    let on = || fit().filter(|(p, _)| p.over <= least);
    let greatest = on().map(|(_, m)| m.least).fold(f64::NEG_INFINITY, f64::max);
    let mut near = on().filter(|(p, m)| {
        let alike = if p.aside > 0.0 { ALIKE } else { 0.0 };
        m.least >= greatest - alike
    });
    let first = near.next()?;
    Some(near.fold(first, |best, new| {
        if new.0.aside < best.0.aside {
            new
        } else {
            best
        }
    }))
}

/// What is told of a part that hangs over the table's edge.
fn over(by: f64) -> String {
    if by <= 0.0 {
        return String::new();
    }
    format!(
        ": the part reaches {} mm over the table's edge, and nowhere that the arm holds it does it lie on the table as a whole; what holds it there is not looked at",
        significant(by, 2)
    )
}

/// A length to the millimetre.
fn whole(value: f64) -> String {
    // adding zero takes the sign from a zero
    format!("{}", value.round() + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(x: f64, degrees: Option<f64>, over: f64) -> Place {
        let margin = degrees.map(|d| Margin {
            least: d.to_radians(),
            limit: d.to_radians(),
            joint: 0,
        });
        Place {
            at: [x, 0.0, 0.0],
            margin,
            over,
            aside: 0.0,
        }
    }

    fn found(places: &[Place]) -> Option<f64> {
        best(places, asked()).map(|(place, _)| place.at[0])
    }

    /// A place where the part lies on the table as a whole comes before one with more room for the arm; else the one that hangs over least.
    #[test]
    fn places_wholly_on_the_table_come_first() {
        let hanging = [place(1.0, Some(50.0), 40.0), place(2.0, Some(45.0), 15.0)];
        let on = [
            place(3.0, Some(20.0), 0.0),
            place(4.0, Some(30.0), 0.0),
            place(5.0, Some(30.0), 0.0),
            place(6.0, None, 0.0),
        ];
        assert_eq!(found(&[&hanging[..], &on[..]].concat()), Some(4.0));
        assert_eq!(found(&hanging), Some(2.0));
        assert_eq!(found(&on[3..]), None);
        assert!(over(15.0).contains("15 mm over the table's edge") && over(0.0).is_empty());
    }

    /// What a run would refuse is no better for lying wholly on the table.
    #[test]
    fn places_that_keep_what_a_run_asks_come_first() {
        assert!((asked().to_degrees() - 2.0).abs() < 1e-12);
        let tight = place(1.0, Some(1.9), 0.0);
        assert_eq!(found(&[tight, place(2.0, Some(2.1), 15.0)]), Some(2.0));
        assert_eq!(found(&[tight, place(2.0, Some(0.5), 0.0)]), Some(1.0));
    }

    /// In the flange a hair more room is not worth a part held far aside.
    #[test]
    fn a_part_in_the_flange_is_held_near_its_axis() {
        let held = |x: f64, degrees: f64, aside: f64| Place {
            aside,
            ..place(x, Some(degrees), 0.0)
        };
        let (far, near) = (held(1.0, 25.4, 60.0), held(2.0, 25.0, 8.0));
        assert_eq!(found(&[far, near]), Some(2.0));
        assert_eq!(found(&[held(1.0, 35.4, 60.0), near]), Some(1.0));
    }
}
