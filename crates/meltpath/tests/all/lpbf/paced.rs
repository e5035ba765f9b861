//! What nothing is promised of: marks that do not run as they are commanded, light where no mark is, layers that are left out.

use meltpath_base::Status;

use super::promised::{folder, job, recipe, verdict};
use crate::support::{check, write};

/// Light that lasts longer than the wait at the ends of marks goes along with jumps.
#[test]
fn light_where_no_mark_is_fails() {
    let dir = folder();
    let marks = "kind,x_mm,y_mm\nstart,0,0\nfill,5,0\njump,15,0\nfill,20,0\njump,20,9\nfill,25,9\n";
    write(dir.path(), "a.csv", marks);
    let told = verdict(dir.path(), &job("a.csv", ""));
    assert_eq!(check(&told, "stray-1").status, Status::Pass, "{told:?}");
    let long = recipe("320 µs").replace(
        "laser_off_delay = { value = \"320 µs\"",
        "laser_off_delay = { value = \"1200 µs\"",
    );
    write(dir.path(), "recipe.toml", long);
    let told = verdict(dir.path(), &job("a.csv", ""));
    let stray = check(&told, "stray-1");
    assert_eq!(stray.status, Status::Fail, "{stray:?}");
    // 1.2 ms after the command is at the end: 0.5 ms it waits, and 0.7 ms it jumps at 5 m/s, 0.32 ms late
    let longest = stray.value.as_ref().unwrap().value;
    assert!((1.0..2.5).contains(&longest), "{longest}");
    let at = stray.place.as_ref().unwrap().position.unwrap();
    let off = [[5.0, 0.0], [20.0, 0.0]].map(|[x, y]| (at[0] - x).hypot(at[1] - y));
    assert!(off[0].min(off[1]) < 0.15, "{at:?}");
}
