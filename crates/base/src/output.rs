//! Whole-or-nothing output: a folder or a file appears complete under its name, or not at all, and never over another.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use same_file::Handle;

/// Why output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The name is taken.
    #[error("{} exists already and is never overwritten: choose another name, or remove it", .0.display())]
    Exists(PathBuf),
    /// Another run builds it at this moment.
    #[error("{} is being written by another run: choose another name, or wait until that run ends", .0.display())]
    Busy(PathBuf),
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

/// The right to build what will be called by a name: a lock on a file beside it, which the system frees when the process ends, however
/// it ends. Whatever an ended process left half-built under that name is its successor's to remove.
#[derive(Debug)]
struct Claim {
    lock: PathBuf,
    partial: PathBuf,
    _held: fs::File,
}

impl Claim {
    /// Claims `path`, and removes what a killed run left of it.
    fn take(path: &Path) -> Result<Self, OutputError> {
        let name = path
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        let lock = path.with_file_name(format!(".{name}.lock"));
        let held = loop {
            let file = fs::OpenOptions::new()
                .create(true)
                .truncate(false)
                .write(true)
                .open(&lock)
                .map_err(io_error(&lock))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(fs::TryLockError::WouldBlock) => {
                    return Err(OutputError::Busy(path.to_path_buf()));
                }
                Err(fs::TryLockError::Error(e)) => return Err(io_error(&lock)(e)),
            }
            // a holder may have removed the file between its opening and its locking: then another file bears the name
            let ours = file.try_clone().and_then(Handle::from_file);
            match (ours, Handle::from_path(&lock)) {
                (Ok(ours), Ok(named)) if ours == named => break file,
                (Err(e), _) => return Err(io_error(&lock)(e)),
                _ => {}
            }
        };
        let claim = Claim {
            lock,
            partial: path.with_file_name(format!(".{name}.partial")),
            _held: held,
        };
        if path.exists() {
            return Err(OutputError::Exists(path.to_path_buf()));
        }
        claim.clear().map_err(io_error(&claim.partial))?;
        Ok(claim)
    }

    /// Removes what stands half-built.
    fn clear(&self) -> io::Result<()> {
        match fs::symlink_metadata(&self.partial) {
            Ok(found) if found.is_dir() => fs::remove_dir_all(&self.partial),
            Ok(_) => fs::remove_file(&self.partial),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(e) => Err(e),
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // nothing more can be done about what the system refuses to remove; the next run tries again
        let _ = self.clear();
        let _ = fs::remove_file(&self.lock);
    }
}

/// A folder under construction beside its final name; dropped without [`OutputFolder::commit`], it vanishes.
#[derive(Debug)]
pub struct OutputFolder {
    claim: Claim,
    path: PathBuf,
    /// The parent, where it was made for this folder: it goes again with it.
    _made_parent: Option<MadeParent>,
}

/// How often a parent that vanishes is made again.
const TRIES: usize = 100;

/// A folder that goes again when nothing was put into it.
#[derive(Debug)]
struct MadeParent(PathBuf);

impl Drop for MadeParent {
    fn drop(&mut self) {
        // fails where something stands in it, rightly
        let _ = fs::remove_dir(&self.0);
    }
}

impl OutputFolder {
    /// Begins the folder that will be called `path`.
    ///
    /// # Errors
    /// [`OutputError::Exists`] when the name is taken, [`OutputError::Busy`] while another run builds it, [`OutputError::Io`] when the
    /// system refuses.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        let made_parent = parent
            .filter(|p| !p.exists())
            .map(|p| MadeParent(p.to_path_buf()));
        let mut tries = 0;
        let claim = loop {
            if let Some(parent) = parent {
                fs::create_dir_all(parent).map_err(io_error(parent))?;
            }
            tries += 1;
            match Claim::take(path) {
                // another run that failed took the folder it had made away with it
                Err(OutputError::Io { source, .. })
                    if source.kind() == io::ErrorKind::NotFound && tries < TRIES => {}
                claim => break claim?,
            }
        };
        fs::create_dir(&claim.partial).map_err(io_error(&claim.partial))?;
        Ok(OutputFolder {
            claim,
            path: path.to_path_buf(),
            _made_parent: made_parent,
        })
    }

    /// The next free numbered folder `parent/001`, `parent/002`, …: runs that start together get a number each, and what killed runs
    /// left is removed.
    ///
    /// # Errors
    /// [`OutputError::Io`] when the system refuses.
    pub fn create_numbered(parent: &Path) -> Result<Self, OutputError> {
        let mut number = 1;
        loop {
            match Self::create(&parent.join(format!("{number:03}"))) {
                Err(OutputError::Exists(_) | OutputError::Busy(_)) => number += 1,
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
        let path = self.claim.partial.join(name);
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
    pub fn commit(self) -> Result<PathBuf, OutputError> {
        if self.path.exists() {
            return Err(OutputError::Exists(self.path.clone()));
        }
        fs::rename(&self.claim.partial, &self.path).map_err(io_error(&self.path))?;
        Ok(self.path.clone())
    }
}

/// Writes one new file, complete or not at all.
///
/// # Errors
/// [`OutputError::Exists`] when `path` is taken, [`OutputError::Busy`] while another run writes it, [`OutputError::Io`] when the
/// system refuses.
pub fn write_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    let claim = Claim::take(path)?;
    let partial = &claim.partial;
    let written = fs::File::create(partial).and_then(|file| {
        let mut buffer = io::BufWriter::new(file);
        write(&mut buffer)?;
        buffer.flush()
    });
    written
        .and_then(|()| fs::rename(partial, path))
        .map_err(io_error(path))
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
    fn runs_that_start_together_get_a_number_each_and_lose_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let runs = dir.path().join("job-runs");
        let one = |n: usize| {
            let folder = OutputFolder::create_numbered(&runs).unwrap();
            folder.write("who", |w| write!(w, "{n}")).unwrap();
            // every third one fails
            (!n.is_multiple_of(3)).then(|| folder.commit().unwrap())
        };
        let made: Vec<PathBuf> = std::thread::scope(|s| {
            let all: Vec<_> = (0..24).map(|n| s.spawn(move || one(n))).collect();
            all.into_iter().filter_map(|t| t.join().unwrap()).collect()
        });
        assert_eq!(made.len(), 16);
        let mut told: Vec<usize> = made
            .iter()
            .map(|p| fs::read_to_string(p.join("who")).unwrap().parse().unwrap())
            .collect();
        told.sort_unstable();
        assert_eq!(
            told,
            (0..24)
                .filter(|n: &usize| !n.is_multiple_of(3))
                .collect::<Vec<_>>()
        );
        assert_eq!(
            fs::read_dir(&runs).unwrap().count(),
            16,
            "runs alone are left"
        );
    }

    #[test]
    fn what_a_killed_run_left_is_removed_and_a_live_one_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let live = OutputFolder::create_numbered(dir.path()).unwrap();
        live.write("a", |w| w.write_all(b"live")).unwrap();
        // a killed process: its folder and the file of its lock stand, nobody holds it
        fs::create_dir(dir.path().join(".002.partial")).unwrap();
        fs::write(dir.path().join(".002.partial/a"), b"dead").unwrap();
        fs::write(dir.path().join(".002.lock"), b"").unwrap();
        assert!(matches!(
            OutputFolder::create(&dir.path().join("001")),
            Err(OutputError::Busy(_))
        ));
        let next = OutputFolder::create_numbered(dir.path()).unwrap();
        assert!(next.path().ends_with("002"));
        let next = next.commit().unwrap();
        assert_eq!(fs::read_dir(next).unwrap().count(), 0);
        let live = live.commit().unwrap();
        assert_eq!(fs::read_to_string(live.join("a")).unwrap(), "live");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
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
