//! A controller's cell in words: what it is, its programs, the schedules and axes that they name.

use meltpath_base::number::significant;
use meltpath_programs::Dialect;

use crate::data::Cell;

/// What a cell file holds, in lines.
pub(super) fn lines(cell: &Cell) -> Vec<String> {
    // a table has a name of its own: that of its key
    let (program, robot) = (&cell.program, &*cell.robot);
    let mut lines = vec![
        format!("controller of {}: {}", *robot.name, *robot.controller),
        format!("its programs: {}", program.dialect.name()),
        match &*cell.motion {
            Some(_) => "corners: by its [motion]".to_owned(),
            None => "corners: not known, no [motion]".to_owned(),
        },
        format!(
            "frame of the part {}, tool {}, contact tube {} mm from the part",
            *program.user_frame,
            *program.tool_frame,
            shown(program.contact_tube_distance.0)
        ),
    ];
    lines.extend(schedules(cell));
    lines.push(match &*program.track {
        Some(track) => match &*track.unit {
            Some(unit) => format!("track: {unit}"),
            None => "track: named".to_owned(),
        },
        None => "no track".to_owned(),
    });
    lines.extend(positioner(cell));
    lines.push(
        "lengths, limits and reach stand in a robot's file: see the how-to on robots".to_owned(),
    );
    lines
}

/// The weld schedules, or that there are none.
fn schedules(cell: &Cell) -> Vec<String> {
    let told = cell.program.schedules.iter().map(|s| {
        let speed = s.travel_speed.as_ref();
        let speed = speed.map_or_else(String::new, |v| {
            format!(", {} m/min travel", shown(0.06 * v.0))
        });
        format!(
            "schedule {}: {} m/min wire{speed}",
            *s.number,
            shown(0.06 * s.wire_feed.0)
        )
    });
    let told: Vec<String> = told.collect();
    if told.is_empty() {
        return vec!["no schedules".to_owned()];
    }
    told
}

/// The axes of the positioner, or that there is none.
fn positioner(cell: &Cell) -> Vec<String> {
    let Some(positioner) = &*cell.program.positioner else {
        return vec!["no positioner".to_owned()];
    };
    let unit = match (cell.program.dialect.value, &*positioner.unit) {
        (Dialect::Rapid, Some(unit)) => format!(", unit {unit}"),
        _ => String::new(),
    };
    let axes = positioner.axes.len();
    let mut lines = vec![format!("positioner: axes {axes}{unit}")];
    for (number, axis) in (1..).zip(positioner.axes.iter()) {
        let vector = |v: [f64; 3]| v.map(shown).join(", ");
        let origin = axis.origin.as_ref().map(|o| vector(o.map(|l| l.0)));
        let direction = axis.direction.as_ref().map(|d| vector(*d));
        lines.push(match (origin, direction) {
            (Some(origin), Some(direction)) => {
                format!(
                    "  axis {number}: through {origin} mm, along {direction}, in the user frame"
                )
            }
            _ => format!("  axis {number}: its place is not told"),
        });
    }
    lines
}

fn shown(value: f64) -> String {
    significant(value, 6)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::lines;
    use crate::data::Cell;

    #[test]
    fn a_controller_is_told_with_its_schedules_and_axes() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("cell.toml");
        let text = meltpath_data::cells::ARCMATE_120IC.text;
        let axes = "\n[[program.schedule]]\nnumber = 7\nwire_feed = \"8 m/min\"\n[program.track]\nsource = \"own\"\nuser_frame = \"stands\"\nunit = \"TRACK1\"\n\
            [program.positioner]\nsource = \"own\"\n[[program.positioner.axis]]\norigin = [\"1 mm\", \"2 mm\", \"3 mm\"]\ndirection = [0.0, 1.0, 0.0]\n";
        std::fs::write(&file, format!("{text}{axes}")).unwrap();
        let cell = Cell::load(&file.display().to_string(), Path::new("")).unwrap();
        let told = lines(&cell).join("\n");
        for part in [
            "controller of FANUC Arc Mate 120iC: R-30iB",
            "its programs: FANUC",
            "schedule 7: 8 m/min wire",
            "track: TRACK1",
            "positioner: axes 1",
            "axis 1: through 1, 2, 3 mm, along 0, 1, 0",
        ] {
            assert!(told.contains(part), "{part} is not in\n{told}");
        }
    }
}
