//! What jobs may name: data files of every kind, and the jobs that a new one begins with.

use std::path::Path;

use meltpath_base::choice;
use meltpath_base::settings::peek;
use meltpath_data::{
    File, cells, electric, energy, focus, gases, guns, materials, pools, process_maps, recipes,
    robots, scan_heads, wires,
};

use crate::data::{DataText, known};
use crate::start;

choice! {
    /// What may be listed.
    pub enum Listing {
        Wires "wires" => "Wires.",
        Gases "gases" => "Shielding gases.",
        Maps "maps" => "Process maps.",
        Pools "pools" => "Weld pools.",
        Energies "energies" => "Electric energies per volume.",
        Circuits "circuits" => "Circuits of source, stick-out and arc.",
        Cells "cells" => "Robot cells.",
        Robots "robots" => "Robots.",
        Materials "materials" => "Materials of heat.",
        Heads "heads" => "Scan heads.",
        Recipes "recipes" => "Recipes of laser scan jobs.",
        Guns "guns" => "Electron guns.",
        Focuses "focus" => "Focus calibrations of electron guns.",
        Examples "examples" => "Jobs that `meltpath new` makes.",
    }
}

/// An entry of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The name that jobs use; of an example what to write after `meltpath new`.
    pub name: String,
    /// What it is.
    pub what: String,
    /// Where it comes from: a file, or that it ships.
    pub from: String,
}

impl Listing {
    fn files(self) -> Option<&'static [File]> {
        match self {
            Listing::Wires => Some(wires::ALL),
            Listing::Gases => Some(gases::ALL),
            Listing::Maps => Some(process_maps::ALL),
            Listing::Pools => Some(pools::ALL),
            Listing::Energies => Some(energy::ALL),
            Listing::Circuits => Some(electric::ALL),
            Listing::Cells => Some(cells::ALL),
            Listing::Robots => Some(robots::ALL),
            Listing::Materials => Some(materials::ALL),
            Listing::Heads => Some(scan_heads::ALL),
            Listing::Recipes => Some(recipes::ALL),
            Listing::Guns => Some(guns::ALL),
            Listing::Focuses => Some(focus::ALL),
            Listing::Examples => None,
        }
    }

    /// What a job in `folder` may name, in order.
    pub fn entries(self, folder: &Path) -> Vec<Entry> {
        match self.files() {
            Some(shipped) => known(shipped, folder).iter().map(entry).collect(),
            None => examples(),
        }
    }
}

fn entry(data: &DataText) -> Entry {
    let text = |path: &[&str]| peek::<String>(&data.text, path).ok().flatten();
    let of_map = || {
        let parts = ["wire", "mode", "gas"].map(|key| text(&[key]));
        let known: Option<Vec<String>> = parts.into_iter().collect();
        known.map(|parts| parts.join(", "))
    };
    let comment = || {
        let lines = data.text.lines().map_while(|l| l.strip_prefix("# "));
        let whole = lines.collect::<Vec<_>>().join(" ");
        // a sentence ends before a capital letter, not in "pp. 16"
        let mut ends = whole.match_indices(". ").map(|(at, _)| at + 1);
        let end = ends.find(|end| whole[*end..].trim_start().starts_with(char::is_uppercase));
        Some(whole[..end.unwrap_or(whole.len())].to_owned()).filter(|s| !s.is_empty())
    };
    let what = text(&["name"]).or_else(|| text(&["robot", "name"]));
    Entry {
        name: data.name.clone(),
        what: what.or_else(of_map).or_else(comment).unwrap_or_default(),
        from: data.origin(),
    }
}

fn examples() -> Vec<Entry> {
    let waam = |option: String, what: String| Entry {
        name: format!("waam NAME {option}"),
        what,
        from: "made by meltpath new".to_owned(),
    };
    let shapes = start::shape_names().into_iter();
    let wires = start::wires_with_maps().into_iter();
    let shapes = shapes.map(|s| {
        waam(
            format!("--shape {s}"),
            "wire arc: a generated part".to_owned(),
        )
    });
    let wires = wires.map(|w| {
        waam(
            format!("--wire {w}"),
            "wire arc: a ring of this wire".to_owned(),
        )
    });
    let others = [
        ("ebm NAME", "electron beam over powder"),
        ("lpbf NAME", "recipes of a laser scan head"),
    ];
    let others = others.map(|(name, what)| Entry {
        name: name.to_owned(),
        what: what.to_owned(),
        from: "made by meltpath new".to_owned(),
    });
    shapes.chain(wires).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_list_names_what_a_job_may_name() {
        for listing in Listing::ALL {
            let entries = listing.entries(Path::new("nowhere"));
            assert!(!entries.is_empty(), "{listing:?}");
            assert!(entries.iter().all(|e| !e.what.is_empty()), "{entries:?}");
            // whole sentences, of files whose first line ends in the middle of one too
            let cut = |e: &&Entry| e.what.ends_with("the") || e.what.contains(". The ");
            assert!(!entries.iter().any(|e| cut(&e)), "{entries:?}");
        }
        let wires = Listing::Wires.entries(Path::new("nowhere"));
        assert!(wires.iter().any(|w| w.name == "er4043-1.2"));
    }

    /// A file beside the job wins over one that ships.
    #[test]
    fn files_beside_the_job_are_listed() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("data/wires");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("mine.toml"), "name = \"my wire\"\n").unwrap();
        std::fs::write(folder.join("g3si-1.2.toml"), "name = \"another\"\n").unwrap();
        let wires = Listing::Wires.entries(dir.path());
        let of = |name: &str| wires.iter().find(|w| w.name == name).unwrap();
        assert_eq!(of("mine").what, "my wire");
        assert_eq!(of("g3si-1.2").what, "another");
        assert!(of("mine").from.ends_with("mine.toml"));
        assert_eq!(of("x90-ig-1.0").from, "shipped with meltpath");
    }
}
