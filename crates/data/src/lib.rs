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

// one module a folder, made of what lies in it: see `build.rs`
include!(concat!(env!("OUT_DIR"), "/files.rs"));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_every_folder_is_carried() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut carried = 0;
        for file in FOLDERS.iter().copied().flatten() {
            let path = root.join(file.kind).join(format!("{}.toml", file.name));
            assert_eq!(std::fs::read_to_string(path).unwrap(), file.text);
            carried += 1;
        }
        let lying = FOLDERS
            .iter()
            .map(|files| std::fs::read_dir(root.join(files[0].kind)).unwrap().count());
        assert_eq!(carried, lying.sum::<usize>());
        assert_eq!(find(wires::ALL, "x90-ig-1.0"), Some(&wires::X90_IG_1_0));
    }
}
