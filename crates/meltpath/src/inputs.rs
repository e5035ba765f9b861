//! A run's folder can be run again as it stands: the job in it names copies of its files, which lie beside it.

use std::collections::BTreeMap;
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::settings::Node;
use meltpath_data::robots;
use meltpath_robot::cell::Named;
use toml::de::{DeTable, DeValue};

use crate::data::{DataText, own_file};

/// Writes `job.toml`, the text of the job at `path`, into the folder of its run; what it names, to `inputs/`; data files of the user's
/// own that are found by their names, to `data/`: those it names, and `own`, which it need not name.
///
/// # Errors
/// What cannot be copied.
pub(crate) fn write(
    folder: &OutputFolder,
    path: &Path,
    text: &str,
    own: &[DataText],
) -> Result<(), OutputError> {
    let beside = path.parent().unwrap_or(Path::new(""));
    let mut strings = Vec::new();
    if let Ok(table) = DeTable::parse(text) {
        for value in table.get_ref().values() {
            strings_of(value, &mut strings);
        }
    }
    strings.sort_by_key(|(span, _)| span.start);
    let mut names = BTreeMap::<PathBuf, String>::new();
    let mut by_name = BTreeMap::<String, PathBuf>::new();
    let (mut job, mut done) = (String::new(), 0);
    for (span, string) in strings {
        let file = beside.join(&string);
        if file.is_file() {
            let new = copied(&string, &names);
            let name = names.entry(file).or_insert(new);
            job.push_str(&text[done..span.start]);
            job.extend(["\"", name.as_str(), "\""]);
            done = span.end;
        } else {
            by_name.extend(own_file(&string, beside));
        }
    }
    job.push_str(&text[done..]);
    for data in own {
        if let Some(file) = data
            .file
            .as_ref()
            .filter(|_| !crate::data::is_file(&data.name))
        {
            by_name.insert(format!("{}/{}.toml", data.kind, data.name), file.clone());
        }
    }
    let copy = |from: &Path, to: &str| {
        folder.write(to, |w| std::io::copy(&mut File::open(from)?, w).map(drop))
    };
    for (file, name) in &names {
        copy(file, name)?;
    }
    for (name, file) in &by_name {
        copy(file, &format!("data/{name}"))?;
    }
    folder.write("job.toml", |w| w.write_all(job.as_bytes()))
}

/// Writes what the robot's file names beside its copy.
///
/// # Errors
/// What cannot be copied.
pub(crate) fn write_beside(
    folder: &OutputFolder,
    own: &[DataText],
    files: &[Named],
) -> Result<(), OutputError> {
    let Some(robot) = own.iter().find(|data| data.kind == robots::ALL[0].kind) else {
        return Ok(());
    };
    let beside = if crate::data::is_file(&robot.name) {
        "inputs".to_owned()
    } else {
        format!("data/{}", robot.kind)
    };
    for Named { file, copy } in files {
        // what is named by its place on the machine is found there again
        if let Some(copy) = copy {
            let name = format!("{beside}/{}", copy.display());
            folder.write(&name, |w| {
                std::io::copy(&mut File::open(file)?, w).map(drop)
            })?;
        }
    }
    Ok(())
}

/// The name of a copy: that of the file, with a number before it where another copy has that name.
fn copied(string: &str, names: &BTreeMap<PathBuf, String>) -> String {
    let name = Path::new(string).file_name().unwrap_or_default();
    let name = name.to_string_lossy();
    let numbered = (2_u64..).map(|n| format!("inputs/{n}-{name}"));
    let mut free = [format!("inputs/{name}")].into_iter().chain(numbered);
    free.find(|new| !names.values().any(|n| n == new))
        .unwrap_or_default()
}

/// Every text of a value, with its place.
fn strings_of(value: &Node<'_>, found: &mut Vec<(Range<usize>, String)>) {
    match value.get_ref() {
        DeValue::String(text) => found.push((value.span(), text.to_string())),
        DeValue::Array(list) => list.iter().for_each(|v| strings_of(v, found)),
        DeValue::Table(table) => table.values().for_each(|v| strings_of(v, found)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_names_the_copies_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("shapes/data")).unwrap();
        std::fs::create_dir_all(at("jobs/data/wires")).unwrap();
        std::fs::write(at("shapes/part.stl"), "a part").unwrap();
        std::fs::write(at("shapes/data/part.stl"), "another").unwrap();
        std::fs::write(at("jobs/data/wires/mine.toml"), "a wire").unwrap();
        let text = "part = \"../shapes/part.stl\"  # kept\nmode = \"cmt\"\nwire = 'mine'\nlist = [ \"../shapes/data/part.stl\" ]\n[a]\nb = { c = \"../shapes/part.stl\" }\n";
        let out = OutputFolder::create(&at("out")).unwrap();
        write(&out, &at("jobs/job.toml"), text, &[]).unwrap();
        let out = out.commit().unwrap();
        let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
        assert_eq!(
            read("job.toml"),
            "part = \"inputs/part.stl\"  # kept\nmode = \"cmt\"\nwire = 'mine'\nlist = [ \"inputs/2-part.stl\" ]\n[a]\nb = { c = \"inputs/part.stl\" }\n"
        );
        assert_eq!(read("inputs/part.stl"), "a part");
        assert_eq!(read("inputs/2-part.stl"), "another");
        assert_eq!(read("data/wires/mine.toml"), "a wire");
    }
}
