//! The native container between stages: a JSON index and little-endian columns, lossless and versioned.
//!
//! Layout: magic `MELTPATH`, u32 version, u32 reserved (0), u64 index length, the index (JSON), zero bytes up to a
//! multiple of 8, then the columns, each starting at a multiple of 8 from the start of the data. The index gives for
//! each column its type, length, offset and CRC-32, and the `meta` that the writer put in.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};

use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"MELTPATH";
/// Version of the layout that this module writes, and the only one it reads.
pub const CONTAINER_VERSION: u32 = 1;
/// Index larger than this is refused: no writer makes one.
const MAX_INDEX: u64 = 1 << 30;

/// A column of numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Double precision.
    F64(Vec<f64>),
    /// Single precision.
    F32(Vec<f32>),
    /// Unsigned integers.
    U32(Vec<u32>),
    /// Bytes and flags.
    U8(Vec<u8>),
}

impl Column {
    fn kind(&self) -> &'static str {
        match self {
            Column::F64(_) => "f64",
            Column::F32(_) => "f32",
            Column::U32(_) => "u32",
            Column::U8(_) => "u8",
        }
    }

    fn len(&self) -> usize {
        match self {
            Column::F64(v) => v.len(),
            Column::F32(v) => v.len(),
            Column::U32(v) => v.len(),
            Column::U8(v) => v.len(),
        }
    }

    fn to_bytes(&self) -> Vec<u8> {
        match self {
            Column::F64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Column::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Column::U32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Column::U8(v) => v.clone(),
        }
    }

    fn from_bytes(kind: &str, bytes: &[u8]) -> Option<Self> {
        fn numbers<const N: usize, T>(bytes: &[u8], from: impl Fn([u8; N]) -> T) -> Vec<T> {
            bytes.as_chunks::<N>().0.iter().map(|&c| from(c)).collect()
        }
        Some(match kind {
            "f64" => Column::F64(numbers(bytes, f64::from_le_bytes)),
            "f32" => Column::F32(numbers(bytes, f32::from_le_bytes)),
            "u32" => Column::U32(numbers(bytes, u32::from_le_bytes)),
            "u8" => Column::U8(bytes.to_vec()),
            _ => return None,
        })
    }
}

fn width(kind: &str) -> Option<u64> {
    match kind {
        "f64" => Some(8),
        "f32" | "u32" => Some(4),
        "u8" => Some(1),
        _ => None,
    }
}

#[derive(Serialize, Deserialize)]
struct ColumnIndex {
    kind: String,
    len: u64,
    offset: u64,
    crc32: u32,
}

#[derive(Serialize, Deserialize)]
struct Index {
    schema: String,
    meta: serde_json::Value,
    columns: BTreeMap<String, ColumnIndex>,
}

/// Why a container could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ContainerError {
    /// The system refused, or the file ends early.
    #[error("cannot read the container: {0}")]
    Io(#[from] io::Error),
    /// Not a container, or damaged.
    #[error("not a sound meltpath container: {0}; make it again with the command that wrote it")]
    Damaged(String),
    /// Written by another version.
    #[error(
        "container version {found}, but this meltpath reads version {CONTAINER_VERSION}: make it again with this version"
    )]
    Version {
        /// The version found.
        found: u32,
    },
    /// A column that the reader needs is absent or of another type.
    #[error("the container has no column `{0}` of the expected type")]
    Column(String),
}

/// Named columns with a `meta` value; `schema` says what they are together.
#[derive(Debug, Clone, PartialEq)]
pub struct Container {
    /// What the container holds, with its version, such as `meltpath-toolpath/1`.
    pub schema: String,
    /// Small structured data.
    pub meta: serde_json::Value,
    /// The columns by name.
    pub columns: BTreeMap<String, Column>,
}

impl Container {
    /// An empty container of a schema.
    pub fn new(schema: &str) -> Self {
        Container {
            schema: schema.to_owned(),
            meta: serde_json::Value::Null,
            columns: BTreeMap::new(),
        }
    }

    /// Writes the container.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        let mut columns = BTreeMap::new();
        let mut data = Vec::new();
        for (name, column) in &self.columns {
            let bytes = column.to_bytes();
            columns.insert(
                name.clone(),
                ColumnIndex {
                    kind: column.kind().to_owned(),
                    len: column.len() as u64,
                    offset: data.len() as u64,
                    crc32: crc32fast::hash(&bytes),
                },
            );
            data.extend_from_slice(&bytes);
            data.resize(data.len().next_multiple_of(8), 0);
        }
        let index = Index {
            schema: self.schema.clone(),
            meta: self.meta.clone(),
            columns,
        };
        let mut json = serde_json::to_vec(&index)?;
        json.resize(json.len().next_multiple_of(8), b' ');
        w.write_all(MAGIC)?;
        w.write_all(&CONTAINER_VERSION.to_le_bytes())?;
        w.write_all(&0_u32.to_le_bytes())?;
        w.write_all(&(json.len() as u64).to_le_bytes())?;
        w.write_all(&json)?;
        w.write_all(&data)
    }

    /// Reads a container and checks every column against its checksum.
    ///
    /// # Errors
    /// [`ContainerError`]; never a panic, whatever the bytes.
    pub fn read(r: &mut dyn Read) -> Result<Self, ContainerError> {
        let damaged = |what: &str| ContainerError::Damaged(what.to_owned());
        let mut head = [0; 24];
        r.read_exact(&mut head)?;
        let (magic, rest) = head.split_at(8);
        if magic != MAGIC {
            return Err(damaged("it does not start with MELTPATH"));
        }
        let number = |range: std::ops::Range<usize>| {
            rest[range]
                .iter()
                .rev()
                .fold(0_u64, |n, &b| n << 8 | u64::from(b))
        };
        let version = number(0..4) as u32;
        if version != CONTAINER_VERSION {
            return Err(ContainerError::Version { found: version });
        }
        let index_len = number(8..16);
        if index_len > MAX_INDEX {
            return Err(damaged("its index has an impossible length"));
        }
        let mut json = Vec::new();
        r.take(index_len).read_to_end(&mut json)?;
        let index: Index = serde_json::from_slice(&json)
            .map_err(|e| ContainerError::Damaged(format!("its index: {e}")))?;
        // as much as the columns need, so that containers may follow one another
        let ends = index.columns.values().map(|c| {
            let bytes = width(&c.kind)?.checked_mul(c.len)?;
            c.offset.checked_add(bytes)?.checked_next_multiple_of(8)
        });
        let end = ends.flatten().max().unwrap_or(0);
        let mut data = Vec::new();
        r.take(end).read_to_end(&mut data)?;
        let mut columns = BTreeMap::new();
        for (name, c) in index.columns {
            let bytes = width(&c.kind)
                .and_then(|w| c.len.checked_mul(w))
                .and_then(|len| c.offset.checked_add(len))
                .and_then(|end| data.get(c.offset as usize..end as usize))
                .ok_or_else(|| ContainerError::Damaged(format!("column `{name}` is cut off")))?;
            if crc32fast::hash(bytes) != c.crc32 {
                return Err(ContainerError::Damaged(format!(
                    "column `{name}` has a wrong checksum"
                )));
            }
            let column = Column::from_bytes(&c.kind, bytes).ok_or_else(|| {
                ContainerError::Damaged(format!("column `{name}` has an unknown type"))
            })?;
            columns.insert(name, column);
        }
        Ok(Container {
            schema: index.schema,
            meta: index.meta,
            columns,
        })
    }

    /// The column `name` of doubles.
    ///
    /// # Errors
    /// [`ContainerError::Column`].
    pub fn f64(&self, name: &str) -> Result<&[f64], ContainerError> {
        match self.columns.get(name) {
            Some(Column::F64(v)) => Ok(v),
            _ => Err(ContainerError::Column(name.to_owned())),
        }
    }

    /// The column `name` of unsigned integers.
    ///
    /// # Errors
    /// [`ContainerError::Column`].
    pub fn u32(&self, name: &str) -> Result<&[u32], ContainerError> {
        match self.columns.get(name) {
            Some(Column::U32(v)) => Ok(v),
            _ => Err(ContainerError::Column(name.to_owned())),
        }
    }

    /// The column `name` of bytes.
    ///
    /// # Errors
    /// [`ContainerError::Column`].
    pub fn u8(&self, name: &str) -> Result<&[u8], ContainerError> {
        match self.columns.get(name) {
            Some(Column::U8(v)) => Ok(v),
            _ => Err(ContainerError::Column(name.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample(f: Vec<f64>, b: Vec<u8>) -> Container {
        let mut c = Container::new("test/1");
        c.meta = serde_json::json!({"cell": 0.5});
        c.columns.insert("f".into(), Column::F64(f));
        c.columns.insert("b".into(), Column::U8(b));
        c
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(f in proptest::collection::vec(proptest::num::f64::NORMAL, 0..50), b in proptest::collection::vec(any::<u8>(), 0..50)) {
            let c = sample(f, b);
            let mut bytes = Vec::new();
            c.write(&mut bytes).unwrap();
            prop_assert_eq!(Container::read(&mut &bytes[..]).unwrap(), c);
        }

        #[test]
        fn damage_is_an_error_never_a_panic(at in 0_usize..200, bit in 0_u8..8, cut in 0_usize..200) {
            let mut bytes = Vec::new();
            sample(vec![1.0, 2.0], vec![1, 2, 3]).write(&mut bytes).unwrap();
            let cut = cut.min(bytes.len() - 1);
            prop_assert!(Container::read(&mut &bytes[..cut]).is_err() || cut + 8 > bytes.len());
            let at = at % bytes.len();
            bytes[at] ^= 1 << bit;
            let _ = Container::read(&mut &bytes[..]);
        }
    }
}
