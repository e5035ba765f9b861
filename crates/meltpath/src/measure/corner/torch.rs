//! A record of the torch along a bead with a corner, brought into the frame of its path.

use std::path::Path;

use meltpath_geometry::math::DVec2;
use meltpath_perception::table::{self, Table};

/// Parts of each leg that show its direction: from its end to so much of it.
const STRAIGHT: f64 = 0.5;
/// How far the record's turn may be from the one told, rad.
const TURN: f64 = 0.035;

/// Reads a record: columns of time (s), x and y (mm), called so or the first three.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn read(path: &Path, turn: f64) -> Result<Vec<(f64, DVec2)>, String> {
    let table = table::read(path).map_err(|e| e.to_string())?;
    let samples = samples(&table)?;
    placed(&samples, turn)
}

fn samples(table: &Table) -> Result<Vec<(f64, DVec2)>, String> {
    let named = |name: &str, place: usize| {
        let is = |c: &&(String, Vec<f64>)| {
            let mut letters = c.0.trim().to_lowercase();
            if let Some(end) = letters.find(|l: char| !l.is_alphabetic()) {
                letters.truncate(end);
            }
            letters == name || (name == "time" && letters == "t")
        };
        let by_name = table.columns.iter().find(is);
        by_name.or(table.columns.get(place)).map(|c| &c.1)
    };
    let (Some(t), Some(x), Some(y)) = (named("time", 0), named("x", 1), named("y", 2)) else {
        return Err("a record of the torch has columns of time (s), x and y (mm)".to_owned());
    };
    let all: Vec<(f64, DVec2)> = t
        .iter()
        .zip(x.iter().zip(y))
        .map(|(t, (x, y))| (*t, DVec2::new(*x, *y)))
        .collect();
    if let Some(n) = all
        .iter()
        .position(|(t, p)| !(t.is_finite() && p.is_finite()))
    {
        return Err(format!("row {} of the record is no number", n + 1));
    }
    if let Some(n) = all.windows(2).position(|w| w[1].0 < w[0].0) {
        return Err(format!(
            "times of the record run backwards after row {}",
            n + 1
        ));
    }
    Ok(all)
}

/// Samples in the frame of the path: the corner is where its legs meet.
fn placed(samples: &[(f64, DVec2)], turn: f64) -> Result<Vec<(f64, DVec2)>, String> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err("the record of the torch is empty".to_owned());
    };
    let chord = (last.1 - first.1).try_normalize();
    let off = |p: DVec2| match chord {
        Some(chord) => chord.perp_dot(p - first.1).abs(),
        None => p.distance(first.1),
    };
    let at = samples.iter().max_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    let at = at.map_or(first.1, |s| s.1);
    // nearest samples to the middles of both legs, as the torch really went
    let near = |p: DVec2| {
        let all = samples.iter().map(|s| s.1);
        all.min_by(|a, b| a.distance(p).total_cmp(&b.distance(p)))
    };
    let line = |from: DVec2| {
        let middle = near(from + STRAIGHT * (at - from))?;
        Some((from, (middle - from).try_normalize()?))
    };
    let (Some(one), Some(two)) = (line(first.1), line(last.1)) else {
        return Err("the record of the torch shows no two legs".to_owned());
    };
    let (into, out) = (one.1, -two.1);
    let seen = into.angle_to(out);
    if (seen - turn).abs() > TURN {
        return Err(format!(
            "the torch of the record turns by {:.1}°, the bead by {:.1}°: left turns are positive, and the record holds this bead alone, from its start to its end",
            seen.to_degrees(),
            turn.to_degrees()
        ));
    }
    let share = (two.0 - one.0).perp_dot(two.1) / one.1.perp_dot(two.1);
    let corner = one.0 + share * one.1;
    let back = DVec2::from_angle(-into.to_angle());
    Ok(samples
        .iter()
        .map(|(t, p)| (*t, back.rotate(*p - corner)))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(turn: f64) -> Vec<(f64, DVec2)> {
        let place = |p: DVec2| DVec2::from_angle(0.7).rotate(p) + DVec2::new(300.0, -20.0);
        let leg = |k: i32| {
            let s = 0.5 * f64::from(k);
            let p = if s < 0.0 {
                DVec2::X * s
            } else {
                DVec2::from_angle(turn) * s
            };
            (0.1 * f64::from(k), place(p))
        };
        (-90..=80).map(leg).collect()
    }

    #[test]
    fn a_record_lies_along_its_path() {
        for degrees in [45.0, -90.0, 150.0] {
            let turn = f64::to_radians(degrees);
            let placed = placed(&record(turn), turn).unwrap();
            assert!(placed[0].1.distance(DVec2::X * -45.0) < 1e-6);
            let end = placed.last().unwrap().1;
            assert!(end.distance(DVec2::from_angle(turn) * 40.0) < 1e-6);
        }
        let wrong = placed(&record(1.0), -1.0).unwrap_err();
        assert!(wrong.contains("57.3"), "{wrong}");
        assert!(placed(&[], 1.0).is_err());
        assert!(placed(&[(0.0, DVec2::ONE); 5], 1.0).is_err());
    }

    #[test]
    fn columns_are_found_by_their_names() {
        let table = table::csv("time (s),z,y (mm),X\n0,9,2,1\n1,9,3,1.5\n").unwrap();
        assert_eq!(samples(&table).unwrap()[1], (1.0, DVec2::new(1.5, 3.0)));
        let back = table::csv("t,x,y\n1,0,0\n0,1,1\n").unwrap();
        assert!(samples(&back).unwrap_err().contains("backwards"));
        let few = table::csv("t,x\n1,0\n").unwrap();
        assert!(samples(&few).is_err());
    }
}
