//! The data that ships: wires, gases, process maps, robots and their cells, scan heads, materials. Every file is TOML, with a source for
//! every number; this crate only carries the texts, so that every room's package builds from its own archive. Who reads a
//! file says what it means.
//!
//! ```
//! use meltpath_data::{find, materials};
//! assert!(find(materials::ALL, "in625-laser").unwrap().text.contains("liquidus"));
//! assert!(find(materials::ALL, "gold").is_none());
//! ```

/// One file that ships.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct File {
    /// Its folder, such as `materials`.
    pub kind: &'static str,
    /// Its name without `.toml`, by which jobs call for it.
    pub name: &'static str,
    /// Its content.
    pub text: &'static str,
}

/// The file `name` among `files`.
pub fn find(files: &'static [File], name: &str) -> Option<&'static File> {
    files.iter().find(|f| f.name == name)
}

/// The names of `files` as a message lists them: `"m14", "speed"`.
pub fn names(files: &[File]) -> String {
    let quoted: Vec<String> = files.iter().map(|f| format!("\"{}\"", f.name)).collect();
    quoted.join(", ")
}

/// Declares the files of one folder: each as a constant, and all in the order in which people read them.
macro_rules! folder {
    ($module:ident, $folder:literal, $doc:literal, $($constant:ident = $name:literal),+) => {
        #[doc = $doc]
        pub mod $module {
            use super::File;

            $(
                #[doc = concat!("`", $name, "`.")]
                pub const $constant: File = File {
                    kind: $folder,
                    name: $name,
                    text: include_str!(concat!("../", $folder, "/", $name, ".toml")),
                };
            )+

            /// All of them.
            pub const ALL: &[File] = &[$($constant),+];
        }
    };
}

folder!(
    cells,
    "cells",
    "Robot cells: how the controller interpolates, how its programs look.",
    ARCMATE_120IC = "arcmate-120ic"
);
folder!(
    energy,
    "energy",
    "Electric energy per volume of deposit.",
    ROUCHON_2022 = "rouchon-2022"
);
folder!(
    focus,
    "focus",
    "Beam diameter against the current of a focus coil.",
    A1_BERAUD_2016 = "a1-beraud-2016"
);
folder!(
    gases,
    "gases",
    "Shielding gases.",
    M14 = "m14",
    SPEED = "speed"
);
folder!(
    materials,
    "materials",
    "Laws of materials against temperature.",
    TI6AL4V_EBM = "ti6al4v-ebm",
    IN625_LASER = "in625-laser"
);
folder!(
    pools,
    "pools",
    "Weld pools measured by camera.",
    X90_IG_1_0_CMT_M14 = "x90-ig-1.0-cmt-m14"
);
folder!(
    process_maps,
    "process-maps",
    "Bead sizes against settings.",
    X90_IG_1_0_CMT_M14 = "x90-ig-1.0-cmt-m14"
);
folder!(
    recipes,
    "recipes",
    "Speeds, power, waits and delays of laser scan jobs.",
    INDUSTRIAL = "industrial",
    UNIFORM = "uniform",
    DOUBLED = "doubled"
);
folder!(
    robots,
    "robots",
    "Robots with what stands around them: lengths, limits, frames.",
    STAUBLI_RX60B = "staubli-rx60b",
    STAUBLI_RX60BL = "staubli-rx60bl",
    FANUC_ARCMATE_120IC = "fanuc-arcmate-120ic",
    KUKA_KR16_R2010_2 = "kuka-kr16-r2010-2",
    ABB_IRB2600_12_185 = "abb-irb2600-12-185",
    YASKAWA_AR2010 = "yaskawa-ar2010",
    UNIVERSAL_UR10E = "universal-ur10e"
);
folder!(
    scan_heads,
    "scan-heads",
    "Galvanometer heads: motors, controllers, optics, reference plate.",
    TWO_AXIS_150 = "two-axis-150",
    THREE_AXIS_350 = "three-axis-350"
);
folder!(
    wires,
    "wires",
    "Wires.",
    X90_IG_1_0 = "x90-ig-1.0",
    X90_IG_1_2 = "x90-ig-1.2",
    G3SI_1_2 = "g3si-1.2"
);

/// Every folder.
pub const FOLDERS: &[&[File]] = &[
    cells::ALL,
    energy::ALL,
    focus::ALL,
    gases::ALL,
    materials::ALL,
    pools::ALL,
    process_maps::ALL,
    recipes::ALL,
    robots::ALL,
    scan_heads::ALL,
    wires::ALL,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_every_folder_is_carried() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut found = Vec::new();
        for folder in std::fs::read_dir(root).unwrap() {
            let folder = folder.unwrap();
            if !folder.file_type().unwrap().is_dir() || folder.file_name() == "src" {
                continue;
            }
            for file in std::fs::read_dir(folder.path()).unwrap() {
                let path = file.unwrap().path();
                let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
                found.push((folder.file_name().into_string().unwrap(), name));
            }
        }
        let mut carried: Vec<_> = FOLDERS
            .iter()
            .flat_map(|files| files.iter())
            .map(|f| (f.kind.to_owned(), f.name.to_owned()))
            .collect();
        found.sort();
        carried.sort();
        assert_eq!(carried, found);
    }
}
