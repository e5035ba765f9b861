//! Where a run's results come from: versions, inputs' hashes, every resolved parameter.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Read};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::resolved::Resolved;

/// Version of the JSON written for a [`Provenance`].
pub const PROVENANCE_SCHEMA: &str = "meltpath-provenance/1";

/// The record that makes a run repeatable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// [`PROVENANCE_SCHEMA`].
    pub schema: String,
    /// Version of meltpath.
    pub meltpath: String,
    /// Name of each input file and the SHA-256 of its bytes, in hexadecimal.
    pub inputs: BTreeMap<String, String>,
    /// Every resolved parameter by its dotted name, as JSON `{value, origin, sigma}`.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// Models used: name and source, in the order of the chain.
    pub models: Vec<(String, String)>,
}

impl Provenance {
    /// An empty record for this version of meltpath.
    pub fn new() -> Self {
        Provenance {
            schema: PROVENANCE_SCHEMA.to_owned(),
            meltpath: env!("CARGO_PKG_VERSION").to_owned(),
            inputs: BTreeMap::new(),
            parameters: BTreeMap::new(),
            models: Vec::new(),
        }
    }

    /// Records a resolved parameter.
    pub fn parameter<T: Serialize>(&mut self, name: &str, value: &Resolved<T>) {
        // a value that JSON cannot hold (none of ours) is recorded as null rather than lost silently
        let json = serde_json::to_value(value).unwrap_or(serde_json::Value::Null);
        self.parameters.insert(name.to_owned(), json);
    }

    /// Records a resolved parameter and hands its value over.
    pub fn value<T: Serialize>(&mut self, name: &str, resolved: Resolved<T>) -> T {
        self.parameter(name, &resolved);
        resolved.value
    }

    /// Records a model and its source.
    pub fn model(&mut self, name: &str, source: &str) {
        self.models.push((name.to_owned(), source.to_owned()));
    }
}

impl Default for Provenance {
    fn default() -> Self {
        Self::new()
    }
}

/// SHA-256 of everything in `reader`, in lower-case hexadecimal.
///
/// # Errors
/// What the reader says.
///
/// ```
/// let hash = meltpath_base::provenance::sha256(&mut &b"abc"[..]).unwrap();
/// assert!(hash.starts_with("ba7816bf8f01cfea"));
/// ```
pub fn sha256(reader: &mut dyn Read) -> io::Result<String> {
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let n = reader.read(&mut buffer)?;
        if n == 0 {
            break;
        }
        hasher.update(&buffer[..n]);
    }
    Ok(hasher
        .finalize()
        .iter()
        .fold(String::new(), |mut hex, byte| {
            // writing to a String cannot fail
            let _ = write!(hex, "{byte:02x}");
            hex
        }))
}
