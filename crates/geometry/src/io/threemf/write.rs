//! Writing a 3MF package: one object and one build item per mesh, in millimetres.

use std::io::{Seek, Write};

use quick_xml::escape::escape;
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::error::ThreeMfError;
use crate::mesh::NamedMesh;

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;

const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;

/// Writes meshes (mm) as a 3MF package, every digit of the coordinates kept. The same meshes give the same bytes.
///
/// # Errors
/// Writing failed.
pub fn write_3mf(meshes: &[NamedMesh], writer: impl Write + Seek) -> Result<(), ThreeMfError> {
    let failed = |e: zip::result::ZipError| ThreeMfError::Io(e.into());
    let mut zip = ZipWriter::new(writer);
    // a fixed date: files with the same content are the same
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default())
        .large_file(true);
    for (name, text) in [
        ("[Content_Types].xml", CONTENT_TYPES),
        ("_rels/.rels", RELATIONS),
    ] {
        zip.start_file(name, options).map_err(failed)?;
        zip.write_all(text.as_bytes())?;
    }
    zip.start_file("3D/3dmodel.model", options)
        .map_err(failed)?;
    let mut xml = std::io::BufWriter::new(&mut zip);
    writeln!(
        xml,
        r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources>"#
    )?;
    for (k, named) in meshes.iter().enumerate() {
        let name = named.name.replace(char::is_control, " ");
        let (id, name) = (k + 1, escape(name.as_str()));
        writeln!(
            xml,
            r#"<object id="{id}" type="model" name="{name}"><mesh><vertices>"#
        )?;
        for p in &named.mesh.vertices {
            writeln!(xml, r#"<vertex x="{}" y="{}" z="{}"/>"#, p.x, p.y, p.z)?;
        }
        writeln!(xml, "</vertices><triangles>")?;
        for [a, b, c] in &named.mesh.triangles {
            writeln!(xml, r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#)?;
        }
        writeln!(xml, "</triangles></mesh></object>")?;
    }
    writeln!(xml, "</resources>\n<build>")?;
    for id in 1..=meshes.len() {
        writeln!(xml, r#"<item objectid="{id}"/>"#)?;
    }
    writeln!(xml, "</build>\n</model>")?;
    xml.flush()?;
    drop(xml);
    zip.finish().map_err(failed)?;
    Ok(())
}
