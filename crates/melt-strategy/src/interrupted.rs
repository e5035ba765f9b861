//! Layers that were drawn, kept until their run is done: one that was interrupted goes on from the last of them, to the same bits.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::layer_heat::LayerHeat;
use meltpath_thermal::levels::Ground;

/// Of the format of the files: other ones are not read.
const FORMAT: u32 = 1;

/// A folder of layers that were drawn.
///
/// Each drawing has a file, which holds its last layer but those drawn since a file was written last. A file serves the drawing alone from which
/// it is: same cells, laws, beam and paths; one that is damaged serves none. What cannot be written costs nothing but the way back: it is told by
/// [`Kept::trouble`].
#[derive(Debug)]
pub struct Kept {
    folder: PathBuf,
    every: Duration,
    begun: Instant,
    found: Mutex<Found>,
}

/// What the folder gave and took.
#[derive(Debug, Default)]
struct Found {
    layers: usize,
    /// When the file of a drawing was written last.
    written: BTreeMap<u64, Instant>,
    trouble: Option<String>,
}

/// Layers of a drawing, the lowest first, and what they leave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Layers {
    pub(crate) ground: Ground,
    pub(crate) layers: Vec<LayerHeat>,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    format: u32,
    version: String,
    drawing: u64,
    layers: Layers,
}

/// Tells drawings apart.
#[derive(Debug, Default, Clone)]
pub(crate) struct Drawing(DefaultHasher);

impl Drawing {
    /// With one more thing that decides about the layers.
    pub(crate) fn with(mut self, thing: &dyn fmt::Debug) -> Self {
        // hashing never fails
        let _ = write!(Feed(&mut self.0), "{thing:?};");
        self
    }

    fn number(&self) -> u64 {
        self.0.finish()
    }
}

struct Feed<'a>(&'a mut DefaultHasher);

impl fmt::Write for Feed<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

impl Kept {
    /// Kept in `folder`, which is made when the first layer is; a file is written where the one before is older than `every`.
    pub fn new(folder: &Path, every: Duration) -> Self {
        Kept {
            folder: folder.to_owned(),
            every,
            begun: Instant::now(),
            found: Mutex::default(),
        }
    }

    /// How many layers were not drawn again, of all drawings together.
    pub fn layers(&self) -> usize {
        self.found().layers
    }

    /// Why the last layer that could not be kept was not.
    pub fn trouble(&self) -> Option<String> {
        self.found().trouble.clone()
    }

    /// Whether a run could go on from what is kept.
    pub fn holds(&self) -> bool {
        self.folder.exists()
    }

    /// Forgets everything: the run is done.
    pub fn clear(&self) {
        // what is not there is forgotten; what stays is found again by a run of the same drawings only
        let _ = std::fs::remove_dir_all(&self.folder);
    }

    fn found(&self) -> MutexGuard<'_, Found> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn file(&self, drawing: &Drawing) -> PathBuf {
        self.folder
            .join(format!("{:016x}.layers", drawing.number()))
    }

    /// The layers of a drawing of at most `most`.
    pub(crate) fn last(&self, drawing: &Drawing, most: usize) -> Option<Layers> {
        let bytes = std::fs::read(self.file(drawing)).ok()?;
        let (body, sum) = bytes.split_last_chunk::<4>()?;
        if crc32fast::hash(body) != u32::from_le_bytes(*sum) {
            return None;
        }
        let saved: Saved = postcard::from_bytes(body).ok()?;
        let serves = saved.format == FORMAT
            && saved.version == env!("CARGO_PKG_VERSION")
            && saved.drawing == drawing.number()
            && saved.layers.layers.len() <= most;
        serves.then(|| {
            self.found().layers += saved.layers.layers.len();
            saved.layers
        })
    }

    /// Keeps the layers of a drawing in the place of those before, whole or not at all.
    pub(crate) fn keep(&self, drawing: &Drawing, layers: &Layers) {
        let number = drawing.number();
        let before = self.found().written.get(&number).copied();
        if before.unwrap_or(self.begun).elapsed() < self.every {
            return;
        }
        self.found().written.insert(number, Instant::now());
        if let Err(why) = self.write(drawing, layers) {
            self.found().trouble = Some(why);
        }
    }

    fn write(&self, drawing: &Drawing, layers: &Layers) -> Result<(), String> {
        let saved = Saved {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            drawing: drawing.number(),
            layers: layers.clone(),
        };
        let mut bytes = postcard::to_stdvec(&saved).map_err(|e| e.to_string())?;
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        let file = self.file(drawing);
        // another run of the same job may write the same file
        let part = file.with_extension(format!("part-{}", std::process::id()));
        std::fs::create_dir_all(&self.folder)
            .and_then(|()| std::fs::write(&part, bytes))
            .and_then(|()| std::fs::rename(&part, &file))
            .map_err(|e| format!("cannot write {}: {e}", file.display()))
    }
}
