//! Writing a 3MF package: one object and one build item per mesh, in millimetres; and any other package, part by part.

use std::fmt::Write as _;
use std::io::{self, Seek, Write};

use quick_xml::escape::escape;
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::element::CORE;
use super::error::ThreeMfError;
use super::package::MODEL_RELATION;
use crate::mesh::NamedMesh;

/// What stands around the content types of a package.
const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">"#;

/// Content types by the endings of part names: those of every 3MF package.
const CONTENT_TYPES: [(&str, &str); 2] = [
    (
        "rels",
        "application/vnd.openxmlformats-package.relationships+xml",
    ),
    (
        "model",
        "application/vnd.ms-package.3dmanufacturing-3dmodel+xml",
    ),
];

/// The part that the model of a package written here is.
pub const MODEL_PART: &str = "3D/3dmodel.model";

/// Writes a 3MF package part by part. The same parts give the same bytes.
pub struct PackageWriter<W: Write + Seek> {
    zip: ZipWriter<W>,
}

fn failed(error: zip::result::ZipError) -> ThreeMfError {
    ThreeMfError::Io(error.into())
}

impl<W: Write + Seek> PackageWriter<W> {
    /// Begins a package whose model is [`MODEL_PART`]; `types` are content types of further parts, by the endings of their names.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(to: W, types: &[(&str, &str)]) -> Result<Self, ThreeMfError> {
        let mut package = PackageWriter {
            zip: ZipWriter::new(to),
        };
        let mut text = TYPES.to_owned();
        for (ending, kind) in CONTENT_TYPES.iter().chain(types) {
            let _ = write!(
                text,
                r#"<Default Extension="{ending}" ContentType="{kind}"/>"#
            );
        }
        text.push_str("</Types>\n");
        package
            .part("[Content_Types].xml")?
            .write_all(text.as_bytes())?;
        package.relations("", &[(MODEL_RELATION, MODEL_PART)])?;
        Ok(package)
    }

    /// Begins a part, which ends where the next begins.
    ///
    /// # Errors
    /// Writing failed.
    pub fn part(&mut self, name: &str) -> Result<impl Write + use<'_, W>, ThreeMfError> {
        // a fixed date: files with the same content are the same
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(zip::DateTime::default())
            .large_file(true);
        self.zip.start_file(name, options).map_err(failed)?;
        Ok(&mut self.zip)
    }

    /// Writes what a part says of others, by relationship type; that of the package itself where `name` is empty.
    ///
    /// # Errors
    /// Writing failed.
    pub fn relations(&mut self, name: &str, to: &[(&str, &str)]) -> Result<(), ThreeMfError> {
        let (folder, file) = match name.rsplit_once('/') {
            Some((folder, file)) => (format!("{folder}/"), file),
            None => (String::new(), name),
        };
        let mut text = RELATIONS.to_owned();
        for (k, (kind, target)) in to.iter().enumerate() {
            let _ = write!(
                text,
                r#"<Relationship Target="/{}" Id="rel{k}" Type="{kind}"/>"#,
                escape(*target)
            );
        }
        text.push_str("</Relationships>\n");
        let mut part = self.part(&format!("{folder}_rels/{file}.rels"))?;
        Ok(part.write_all(text.as_bytes())?)
    }

    /// Ends the package.
    ///
    /// # Errors
    /// Writing failed.
    pub fn finish(self) -> Result<W, ThreeMfError> {
        self.zip.finish().map_err(failed)
    }
}

/// What stands around the relationships of a part.
const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">"#;

/// Writes one object of a model, mm; `further` are attributes beside id, type and name.
///
/// # Errors
/// Writing failed.
pub fn write_object(
    xml: &mut dyn Write,
    (id, kind, further): (usize, &str, &str),
    named: &NamedMesh,
) -> io::Result<()> {
    let name = named.name.replace(char::is_control, " ");
    let name = escape(name.as_str());
    writeln!(
        xml,
        r#"<object id="{id}" type="{kind}" name="{name}"{further}><mesh><vertices>"#
    )?;
    for p in &named.mesh.vertices {
        writeln!(xml, r#"<vertex x="{}" y="{}" z="{}"/>"#, p.x, p.y, p.z)?;
    }
    writeln!(xml, "</vertices><triangles>")?;
    for [a, b, c] in &named.mesh.triangles {
        writeln!(xml, r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#)?;
    }
    writeln!(xml, "</triangles></mesh></object>")
}

/// Writes meshes (mm) as a 3MF package, every digit of the coordinates kept. The same meshes give the same bytes.
///
/// # Errors
/// Writing failed.
pub fn write_3mf(meshes: &[NamedMesh], writer: impl Write + Seek) -> Result<(), ThreeMfError> {
    let mut package = PackageWriter::new(writer, &[])?;
    let mut xml = io::BufWriter::new(package.part(MODEL_PART)?);
    writeln!(
        xml,
        r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en" xmlns="{CORE}">
<resources>"#
    )?;
    for (k, named) in meshes.iter().enumerate() {
        write_object(&mut xml, (k + 1, "model", ""), named)?;
    }
    writeln!(xml, "</resources>\n<build>")?;
    for id in 1..=meshes.len() {
        writeln!(xml, r#"<item objectid="{id}"/>"#)?;
    }
    writeln!(xml, "</build>\n</model>")?;
    xml.flush()?;
    drop(xml);
    package.finish()?;
    Ok(())
}
