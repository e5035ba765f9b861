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
const FORMAT: u32 = 2;
/// Endings of the files: of layers, and of layers that are being written.
const LAYERS: &str = "layers";
const PART: &str = "part-";

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
    /// Whether layers came from a file or went to one.
    used: bool,
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

/// Tells drawings apart, for one build of the program: neither the hash nor what [`fmt::Debug`] writes need be the same for another.
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

    /// Whether a run could go on from layers that this one took or kept.
    pub fn holds(&self) -> bool {
        self.found().used
    }

    /// Forgets all layers in the folder: the run is done. The folder goes with them where nothing else is in it; one without layers stays.
    pub fn clear(&self) {
        self.found().used = false;
        let Ok(entries) = std::fs::read_dir(&self.folder) else {
            return;
        };
        let files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        let (ours, others): (Vec<PathBuf>, Vec<PathBuf>) =
            files.into_iter().partition(|path| of_layers(path));
        // what cannot be removed is found again by a run of the same drawings only
        for file in &ours {
            let _ = std::fs::remove_file(file);
        }
        if others.is_empty() && !ours.is_empty() {
            let _ = std::fs::remove_dir(&self.folder);
        }
    }

    fn found(&self) -> MutexGuard<'_, Found> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn file(&self, drawing: &Drawing) -> PathBuf {
        self.folder
            .join(format!("{:016x}.{LAYERS}", drawing.number()))
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
            let mut found = self.found();
            found.layers += saved.layers.layers.len();
            found.used = true;
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
        let written = self.write(drawing, layers);
        let mut found = self.found();
        // also where it failed: a full disk is not asked again at every layer
        found.written.insert(number, Instant::now());
        match written {
            Ok(()) => found.used = true,
            Err(why) => found.trouble = Some(why),
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
        let part = file.with_extension(format!("{PART}{}", std::process::id()));
        std::fs::create_dir_all(&self.folder)
            .and_then(|()| std::fs::write(&part, bytes))
            .and_then(|()| std::fs::rename(&part, &file))
            .map_err(|e| {
                // a part of a file serves nobody
                let _ = std::fs::remove_file(&part);
                format!("cannot write {}: {e}", file.display())
            })
    }
}

/// Whether a file has a name of ours: the number of a drawing, and an ending.
fn of_layers(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.and_then(|name| name.split_once('.'))
        .is_some_and(|(number, ending)| {
            number.len() == 16
                && number.bytes().all(|b| b.is_ascii_hexdigit())
                && (ending == LAYERS || ending.starts_with(PART))
        })
}
