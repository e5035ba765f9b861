//! The zip package around a 3MF model: parts by name, the start part, limits on unpacking (Open Packaging
//! Conventions, ISO/IEC 29500-2).

use std::collections::BTreeMap;
use std::io::{BufReader, Read, Seek, SeekFrom};

use meltpath_base::Observer;
use quick_xml::{XmlVersion, events::Event, reader::Reader};
use zip::{ZipArchive, result::ZipError};

use super::error::ThreeMfError;
use super::limited::{Limited, unread};
use super::model::{Model, read_model};

/// Where the package names its start part.
const ROOT_RELATIONS: &str = "_rels/.rels";
/// Relationship type of the start part.
pub(super) const MODEL_RELATION: &str =
    "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// First bytes of an encrypted office package (a compound file instead of a zip).
const COMPOUND_FILE: [u8; 4] = [0xD0, 0xCF, 0x11, 0xE0];

/// A 3MF package open for reading: its parts by name, each unpacked within the limits of this module.
#[derive(Debug)]
pub struct Package<R> {
    zip: ZipArchive<R>,
    /// Names of parts as they are, by their small letters.
    names: BTreeMap<String, String>,
}

/// What one part of a package says of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Relation {
    /// The relationship type, a URI.
    pub kind: String,
    /// The part that it leads to, without the slash in front.
    pub target: String,
}

fn package_error(error: ZipError) -> ThreeMfError {
    match error {
        ZipError::Io(e) => ThreeMfError::Io(e),
        other => {
            let message = other.to_string();
            if message.to_ascii_lowercase().contains("password") {
                ThreeMfError::Encrypted { what: message }
            } else {
                ThreeMfError::Package { message }
            }
        }
    }
}

impl<R: Read + Seek> Package<R> {
    /// Opens a package.
    ///
    /// # Errors
    /// [`ThreeMfError`] where it is empty, encrypted, damaged or no zip file.
    pub fn open(mut reader: R) -> Result<Self, ThreeMfError> {
        let mut head = Vec::new();
        reader.by_ref().take(4).read_to_end(&mut head)?;
        reader.seek(SeekFrom::Start(0))?;
        if head.is_empty() {
            return Err(ThreeMfError::Empty);
        }
        if head == COMPOUND_FILE {
            return Err(ThreeMfError::Encrypted {
                what: "a compound file instead of a zip".to_owned(),
            });
        }
        // the zip reader reports a truncated archive as an I/O error at its end: it is the package's fault
        let zip = ZipArchive::new(reader).map_err(|e| match e {
            ZipError::Io(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => ThreeMfError::Io(e),
            ZipError::Io(e) => ThreeMfError::Package {
                message: e.to_string(),
            },
            other => package_error(other),
        })?;
        let mut names = BTreeMap::new();
        for name in zip.file_names().filter_map(Result::ok) {
            names
                .entry(name.to_ascii_lowercase())
                .or_insert_with(|| name.into_owned());
        }
        Ok(Package { zip, names })
    }

    /// Opens a part, whatever the case of its name; `why` tells who needs it.
    ///
    /// # Errors
    /// [`ThreeMfError`] where it is not there or cannot be unpacked.
    pub fn part(
        &mut self,
        name: &str,
        why: &'static str,
    ) -> Result<Limited<impl Read + use<'_, R>>, ThreeMfError> {
        let found = match self.zip.index_for_name(name) {
            Some(_) => Some(name),
            None => self
                .names
                .get(&name.to_ascii_lowercase())
                .map(String::as_str),
        };
        let Some(found) = found else {
            return Err(ThreeMfError::MissingPart {
                part: name.to_owned(),
                why,
            });
        };
        let entry = self.zip.by_name(found).map_err(package_error)?;
        let packed = entry.compressed_size();
        Ok(Limited::new(entry, packed))
    }

    /// The name of the model part that the package's relationships start from.
    ///
    /// # Errors
    /// [`ThreeMfError`] where there is none, or more than one.
    pub fn start_part(&mut self) -> Result<String, ThreeMfError> {
        let why = "where every package names its model";
        let all = self.relations_in(ROOT_RELATIONS, why)?;
        let mut models = all.into_iter().filter(|r| r.kind == MODEL_RELATION);
        let Some(first) = models.next() else {
            return Err(ThreeMfError::MissingPart {
                part: "3D model".to_owned(),
                why: "no relationship of the package leads to one",
            });
        };
        match models.next() {
            Some(second) => Err(ThreeMfError::TwoModels {
                first: first.target,
                second: second.target,
            }),
            None => Ok(first.target),
        }
    }

    /// What the part `name` says of other parts, in the order of its relationships.
    ///
    /// # Errors
    /// [`ThreeMfError`] where it says nothing, or what it says cannot be read.
    pub fn relations(&mut self, name: &str) -> Result<Vec<Relation>, ThreeMfError> {
        let (folder, file) = name.rsplit_once('/').unwrap_or(("", name));
        let folder = match folder {
            "" => String::new(),
            folder => format!("{folder}/"),
        };
        let rels = format!("{folder}_rels/{file}.rels");
        let mut all = self.relations_in(&rels, "which names the parts of the model")?;
        for relation in &mut all {
            // a target without a slash in front counts from the part's own folder
            match relation.target.strip_prefix('/') {
                Some(whole) => relation.target = whole.to_owned(),
                None => relation.target = format!("{folder}{}", relation.target),
            }
        }
        Ok(all)
    }

    fn relations_in(
        &mut self,
        rels: &str,
        why: &'static str,
    ) -> Result<Vec<Relation>, ThreeMfError> {
        let part = self.part(rels, why)?;
        let mut xml = Reader::from_reader(BufReader::new(part));
        let mut buffer = Vec::new();
        let mut all = Vec::new();
        loop {
            let event = match xml.read_event_into(&mut buffer) {
                Ok(event) => event,
                Err(e) => return Err(unread(&xml, rels, &e)),
            };
            match event {
                Event::Start(e) | Event::Empty(e) if e.local_name().as_ref() == "Relationship" => {
                    let value = |name: &str| {
                        let attribute = e.try_get_attribute(name).ok().flatten()?;
                        let value = attribute.normalized_value(XmlVersion::default()).ok()?;
                        Some(value.into_owned())
                    };
                    if let (Some(kind), Some(target)) = (value("Type"), value("Target")) {
                        let whole = rels == ROOT_RELATIONS;
                        let target = match target.strip_prefix('/') {
                            Some(rest) if whole => rest.to_owned(),
                            _ => target,
                        };
                        all.push(Relation { kind, target });
                    }
                }
                Event::Eof => return Ok(all),
                _ => {}
            }
            buffer.clear();
        }
    }

    /// Reads a model part.
    pub(super) fn model(
        &mut self,
        name: &str,
        observer: &dyn Observer,
    ) -> Result<Model, ThreeMfError> {
        let part = self.part(name, "which the package names as a model")?;
        read_model(BufReader::new(part), name, observer)
    }
}
