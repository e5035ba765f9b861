//! Columns and fields of all that a command writes are named in one style: words of lower case joined by `_`, the unit last.

use std::fs;
use std::path::Path;

/// Units and symbols, which keep their case.
const SYMBOLS: [&str; 10] = ["A", "C", "I", "J", "K", "N", "T", "U", "V", "W"];

fn is_in_style(name: &str) -> bool {
    let lower = |word: &str| {
        word.chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit())
    };
    let word = |word: &str| !word.is_empty() && (lower(word) || SYMBOLS.contains(&word));
    name.split('_').all(word) && !name.starts_with(|c: char| c.is_ascii_digit())
}

/// The names in a file: the head of a table, the arrays of a field.
fn names(file: &Path) -> Vec<String> {
    let bytes = fs::read(file).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    match file.extension().and_then(|e| e.to_str()) {
        Some("csv") => {
            let head = text
                .lines()
                .find(|l| !l.starts_with('#'))
                .unwrap_or_default();
            let all: Vec<String> = head
                .split(',')
                .map(|n| n.trim_matches('"').to_owned())
                .collect();
            // of recipes compared the columns are the recipes, as their owner names them
            let turned = all[0] == "quantity";
            all.into_iter()
                .take(if turned { 1 } else { usize::MAX })
                .collect()
        }
        Some("vti" | "vtp") => {
            let arrays = text.split("<DataArray").skip(1);
            let name = |a: &str| Some(a.split_once("Name=\"")?.1.split_once('"')?.0.to_owned());
            let vtk = ["Points", "connectivity", "offsets"];
            arrays
                .filter_map(name)
                .filter(|n| !vtk.contains(&n.as_str()))
                .collect()
        }
        _ => Vec::new(),
    }
}

/// Holds every table and field below a folder to the style; `inputs` are their owner's. How many names there are.
pub(crate) fn in_style(folder: &Path) -> usize {
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            count += if path.ends_with("inputs") {
                0
            } else {
                in_style(&path)
            };
            continue;
        }
        for name in names(&path) {
            assert!(is_in_style(&name), "{}: {name}", path.display());
            count += 1;
        }
    }
    count
}

#[test]
fn the_style_is_told_apart() {
    for good in [
        "x_mm",
        "I_f_A",
        "highest_temperature_C",
        "speed_m_min",
        "layer",
    ] {
        assert!(is_in_style(good), "{good}");
    }
    for bad in [
        "x [mm]",
        "Speed_mm_s",
        "laser-on_s",
        "a__b",
        "",
        "99_percent",
        "temperature_°C",
    ] {
        assert!(!is_in_style(bad), "{bad}");
    }
}
