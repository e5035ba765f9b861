//! Carries every file of every folder into the crate: a wire that is added to `wires/` ships, without a list in code.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

/// A name as Rust writes it.
fn identifier(name: &str) -> String {
    let name = name.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
    if name.starts_with(|c: char| c.is_ascii_digit()) {
        format!("n{name}")
    } else {
        name
    }
}

/// The names in a folder, in order; of files without `.toml`.
fn names(folder: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let toml = path.extension().is_some_and(|e| e == "toml");
        if path.is_dir() || (toml && folder != Path::new(".")) {
            let stem = path.file_stem().unwrap_or_default();
            names.push(stem.to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

fn main() -> Result<(), Box<dyn Error>> {
    // a new folder counts too
    println!("cargo::rerun-if-changed=.");
    let mut code = String::new();
    let mut folders = Vec::new();
    for folder in names(Path::new("."))? {
        if folder == "src" || folder == "target" {
            continue;
        }
        let module = identifier(&folder);
        writeln!(code, "/// The files of `{folder}`.\npub mod {module} {{")?;
        let mut all = Vec::new();
        for name in names(Path::new(&folder))? {
            let constant = identifier(&name).to_uppercase();
            writeln!(
                code,
                "/// `{name}`.\npub const {constant}: super::File = super::File {{ kind: \"{folder}\", name: \"{name}\", \
                 text: include_str!(concat!(env!(\"CARGO_MANIFEST_DIR\"), \"/{folder}/{name}.toml\")) }};"
            )?;
            all.push(constant);
        }
        let all = all.join(", ");
        writeln!(
            code,
            "/// All of them, by name.\npub const ALL: &[super::File] = &[{all}];\n}}"
        )?;
        folders.push(format!("{module}::ALL"));
    }
    let folders = folders.join(", ");
    writeln!(
        code,
        "/// Every folder.\npub const FOLDERS: &[&[File]] = &[{folders}];"
    )?;
    let out = std::env::var("OUT_DIR")?;
    std::fs::write(Path::new(&out).join("files.rs"), code)?;
    Ok(())
}
