//! The zip package around a 3MF model: parts by name, the start part, limits on unpacking (Open Packaging
//! Conventions, ISO/IEC 29500-2).

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
const MODEL_RELATION: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// First bytes of an encrypted office package (a compound file instead of a zip).
const COMPOUND_FILE: [u8; 4] = [0xD0, 0xCF, 0x11, 0xE0];

/// A 3MF package open for reading.
pub(super) struct Package<R> {
    zip: ZipArchive<R>,
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
    pub(super) fn open(mut reader: R) -> Result<Self, ThreeMfError> {
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
        Ok(Package { zip })
    }

    /// Opens a part, whatever the case of its name.
    fn part(
        &mut self,
        name: &str,
        why: &'static str,
    ) -> Result<Limited<impl Read + use<'_, R>>, ThreeMfError> {
        let found = self
            .zip
            .file_names()
            .filter_map(Result::ok)
            .find(|n| n.eq_ignore_ascii_case(name))
            .map(std::borrow::Cow::into_owned);
        let Some(found) = found else {
            return Err(ThreeMfError::MissingPart {
                part: name.to_owned(),
                why,
            });
        };
        let entry = self.zip.by_name(&found).map_err(package_error)?;
        let packed = entry.compressed_size();
        Ok(Limited::new(entry, packed))
    }

    /// The name of the model part that the package's relationships start from.
    pub(super) fn start_part(&mut self) -> Result<String, ThreeMfError> {
        let part = self.part(ROOT_RELATIONS, "where every package names its model")?;
        let mut xml = Reader::from_reader(BufReader::new(part));
        let mut buffer = Vec::new();
        let mut found: Option<String> = None;
        loop {
            let event = match xml.read_event_into(&mut buffer) {
                Ok(event) => event,
                Err(e) => return Err(unread(&xml, ROOT_RELATIONS, &e)),
            };
            match event {
                Event::Start(e) | Event::Empty(e) if e.local_name().as_ref() == "Relationship" => {
                    let value = |name: &str| {
                        let attribute = e.try_get_attribute(name).ok().flatten()?;
                        let value = attribute.normalized_value(XmlVersion::default()).ok()?;
                        Some(value.into_owned())
                    };
                    if value("Type").as_deref() == Some(MODEL_RELATION)
                        && let Some(target) = value("Target")
                    {
                        let target = target.trim_start_matches('/').to_owned();
                        if let Some(first) = found {
                            return Err(ThreeMfError::TwoModels {
                                first,
                                second: target,
                            });
                        }
                        found = Some(target);
                    }
                }
                Event::Eof => {
                    return found.ok_or_else(|| ThreeMfError::MissingPart {
                        part: "3D model".to_owned(),
                        why: "no relationship of the package leads to one",
                    });
                }
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
