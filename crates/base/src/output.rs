//! Whole-or-nothing output: a folder or a file appears complete under its name, or not at all, and never over another.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Why output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The name is taken.
    #[error("{} exists already and is never overwritten: choose another name with --out, or remove it", .0.display())]
    Exists(PathBuf),
    /// The operating system refused.
    #[error("cannot write {}: {source}; check free space and permissions", .path.display())]
    Io {
        /// The path that was being written.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> OutputError {
    let path = path.to_path_buf();
    move |source| OutputError::Io { path, source }
}

/// A folder under construction beside its final name; dropped without [`OutputFolder::commit`], it vanishes.
#[derive(Debug)]
pub struct OutputFolder {
    partial: PathBuf,
    path: PathBuf,
    committed: bool,
    /// The parent, where it was made for this folder: it goes again with it.
    made_parent: Option<PathBuf>,
}

impl OutputFolder {
    /// Begins the folder that will be called `path`.
    ///
    /// # Errors
    /// [`OutputError::Exists`] when the name is taken, [`OutputError::Io`] when the system refuses.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let partial = partial_name(path)?;
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        let made_parent = parent.filter(|p| !p.exists()).map(Path::to_path_buf);
        if let Some(parent) = parent {
            fs::create_dir_all(parent).map_err(io_error(parent))?;
        }
        fs::create_dir(&partial).map_err(io_error(&partial))?;
        Ok(OutputFolder {
            partial,
            path: path.to_path_buf(),
            committed: false,
            made_parent,
        })
    }

    /// The next free numbered folder `parent/001`, `parent/002`, ….
    ///
    /// # Errors
    /// [`OutputError::Io`] when the system refuses.
    pub fn create_numbered(parent: &Path) -> Result<Self, OutputError> {
        let mut number = 1;
        loop {
            match Self::create(&parent.join(format!("{number:03}"))) {
                Err(OutputError::Exists(_)) => number += 1,
                other => return other,
            }
        }
    }

    /// Writes one file of the folder through `write`; `name` may contain `/` for sub-folders.
    ///
    /// # Errors
    /// [`OutputError::Io`], a full disk included: buffers are flushed here.
    pub fn write(
        &self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let path = self.partial.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(io_error(parent))?;
        }
        let file = fs::File::create(&path).map_err(io_error(&self.path.join(name)))?;
        let mut buffer = io::BufWriter::with_capacity(1 << 16, file);
        write(&mut buffer)
            .and_then(|()| buffer.flush())
            .map_err(io_error(&self.path.join(name)))
    }

    /// The name the folder will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the folder its name; the only way for it to stay.
    ///
    /// # Errors
    /// [`OutputError::Exists`] when the name was taken meanwhile, [`OutputError::Io`] when the system refuses.
    pub fn commit(mut self) -> Result<PathBuf, OutputError> {
        if self.path.exists() {
            return Err(OutputError::Exists(self.path.clone()));
        }
        fs::rename(&self.partial, &self.path).map_err(io_error(&self.path))?;
        self.committed = true;
        Ok(self.path.clone())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.committed {
            // nothing more can be done about a folder that the system refuses to remove
            let _ = fs::remove_dir_all(&self.partial);
            if let Some(parent) = &self.made_parent {
                // fails where something else was put there meanwhile, rightly
                let _ = fs::remove_dir(parent);
            }
        }
    }
}

/// The name under which something is built that will be called `path`; refused when that is taken.
fn partial_name(path: &Path) -> Result<PathBuf, OutputError> {
    if path.exists() {
        return Err(OutputError::Exists(path.to_path_buf()));
    }
    let name = path
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    Ok(path.with_file_name(format!(".{name}.partial-{}", std::process::id())))
}

/// Writes one new file, complete or not at all.
///
/// # Errors
/// [`OutputError::Exists`] when `path` is taken, [`OutputError::Io`] when the system refuses.
pub fn write_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    let partial = partial_name(path)?;
    let written = fs::File::create(&partial).and_then(|file| {
        let mut buffer = io::BufWriter::new(file);
        write(&mut buffer)?;
        buffer.flush()
    });
    let placed = written.and_then(|()| fs::rename(&partial, path));
    if placed.is_err() {
        let _ = fs::remove_file(&partial);
    }
    placed.map_err(io_error(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_appears_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("run");
        {
            let folder = OutputFolder::create(&path).unwrap();
            folder.write("a/b.txt", |w| w.write_all(b"half")).unwrap();
            assert!(!path.exists());
        }
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            0,
            "nothing is left of a dropped folder"
        );
        let folder = OutputFolder::create(&path).unwrap();
        folder.write("a/b.txt", |w| w.write_all(b"whole")).unwrap();
        folder.commit().unwrap();
        assert_eq!(fs::read_to_string(path.join("a/b.txt")).unwrap(), "whole");
        assert!(matches!(
            OutputFolder::create(&path),
            Err(OutputError::Exists(_))
        ));
    }

    #[test]
    fn numbers_go_on() {
        let dir = tempfile::tempdir().unwrap();
        for expected in ["001", "002"] {
            let folder = OutputFolder::create_numbered(&dir.path().join("job-runs")).unwrap();
            assert!(folder.commit().unwrap().ends_with(expected));
        }
    }

    #[test]
    fn a_failed_file_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("x.stl");
        let full = |_: &mut dyn Write| Err(io::Error::from(io::ErrorKind::StorageFull));
        assert!(matches!(
            write_file(&path, full),
            Err(OutputError::Io { .. })
        ));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        write_file(&path, |w| w.write_all(b"ok")).unwrap();
        assert!(matches!(
            write_file(&path, |_| Ok(())),
            Err(OutputError::Exists(_))
        ));
    }
}
