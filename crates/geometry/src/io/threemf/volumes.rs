//! What PrusaSlicer and its kin (Slic3r, SuperSlicer; Bambu Studio, OrcaSlicer) keep beside a model: which of an object's triangles, or which of its
//! components, are the part, and which are volumes that only say how it is printed, or are cut out of it.

use std::collections::BTreeMap;
use std::io::{BufReader, Read, Seek};

use meltpath_base::Reporter;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{XmlVersion, reader::Reader};

use super::error::ThreeMfError;
use super::limited::unread;
use super::model::{Model, Object, Shape};
use super::package::Package;
use crate::Mesh;

/// Where PrusaSlicer says so: `volume`s of an object by their triangles.
const BY_TRIANGLES: &str = "Metadata/Slic3r_PE_model.config";
/// Where Bambu Studio and OrcaSlicer do: `part`s of an object by its components.
const BY_COMPONENTS: &str = "Metadata/model_settings.config";

/// What a volume does to the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    /// Is the part.
    Part,
    /// Is cut out of it.
    Cut,
    /// Changes how it is printed there.
    Hint,
}

impl Use {
    /// By the word of either file; of words that are not known, that of a hint: it is told.
    fn of(word: &str) -> Use {
        match word {
            "ModelPart" | "normal_part" => Use::Part,
            "NegativeVolume" | "negative_part" => Use::Cut,
            _ => Use::Hint,
        }
    }
}

/// Which elements of an object a volume is made of.
#[derive(Debug, Clone, Copy)]
enum Which {
    /// From the first to the last triangle.
    Triangles(usize, usize),
    /// The components of that object.
    Component(u32),
}

/// A volume of an object that is not the part.
#[derive(Debug)]
struct Volume {
    object: u32,
    which: Which,
    word: String,
}

/// Leaves out of a model what its slicer does not take for the part.
///
/// # Errors
/// [`ThreeMfError`] where a volume is cut out of the part, which is not done here.
pub(super) fn leave_out<R: Read + Seek>(
    package: &mut Package<R>,
    model: &mut Model,
    reporter: &Reporter,
) -> Result<(), ThreeMfError> {
    for file in [BY_TRIANGLES, BY_COMPONENTS] {
        let mut hints: BTreeMap<u32, Vec<Volume>> = BTreeMap::new();
        for volume in volumes(package, file)? {
            match Use::of(&volume.word) {
                Use::Part => {}
                Use::Hint => hints.entry(volume.object).or_default().push(volume),
                Use::Cut => {
                    let message = format!(
                        "object {} has a volume that the slicer cuts out of the part ({}), which is not done here: export the part with the cut made, \
                         for instance as STL",
                        volume.object, volume.word
                    );
                    return Err(ThreeMfError::Model {
                        part: file.to_owned(),
                        position: 0,
                        message,
                    });
                }
            }
        }
        for (id, volumes) in hints {
            let Some(object) = model.objects.get_mut(&id) else {
                continue;
            };
            without(object, &volumes);
            let mut words: Vec<&str> = volumes.iter().map(|v| v.word.as_str()).collect();
            words.dedup();
            reporter.warn(
                "3mf-modifier-skipped",
                format!(
                    "object {id} has volumes that only tell the slicer how to print ({}): they were left out",
                    words.join(", ")
                ),
                "",
            );
        }
    }
    Ok(())
}

/// The volumes that a file of the package names; none where it is not there.
fn volumes<R: Read + Seek>(
    package: &mut Package<R>,
    file: &str,
) -> Result<Vec<Volume>, ThreeMfError> {
    let part = match package.part(file, "") {
        Ok(part) => part,
        Err(ThreeMfError::MissingPart { .. }) => return Ok(Vec::new()),
        Err(e) => return Err(e),
    };
    let mut xml = Reader::from_reader(BufReader::new(part));
    let mut buffer = Vec::new();
    let mut found = Vec::new();
    let (mut object, mut which) = (None, None);
    loop {
        let event = match xml.read_event_into(&mut buffer) {
            Ok(event) => event,
            Err(e) => return Err(unread(&xml, file, &e)),
        };
        match event {
            Event::Start(e) | Event::Empty(e) => {
                let number = |name: &str| text(&e, name)?.parse::<u32>().ok();
                match e.local_name().as_ref() {
                    "object" => (object, which) = (number("id"), None),
                    "volume" => {
                        let ends = number("firstid").zip(number("lastid"));
                        which = ends.map(|(a, b)| Which::Triangles(a as usize, b as usize));
                    }
                    "part" => {
                        which = number("id").map(Which::Component);
                        found.extend(volume(object, which, text(&e, "subtype")));
                    }
                    "metadata" if text(&e, "key").as_deref() == Some("volume_type") => {
                        found.extend(volume(object, which, text(&e, "value")));
                    }
                    // an older way to say so
                    "metadata"
                        if text(&e, "key").as_deref() == Some("modifier")
                            && text(&e, "value").as_deref() == Some("1") =>
                    {
                        found.extend(volume(object, which, Some("modifier".to_owned())));
                    }
                    _ => {}
                }
            }
            Event::Eof => return Ok(found),
            _ => {}
        }
        buffer.clear();
    }
}

fn volume(object: Option<u32>, which: Option<Which>, word: Option<String>) -> Option<Volume> {
    Some(Volume {
        object: object?,
        which: which?,
        word: word?,
    })
}

fn text(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let attribute = element.try_get_attribute(name).ok().flatten()?;
    let value = attribute.normalized_value(XmlVersion::default()).ok()?;
    Some(value.into_owned())
}

/// Takes volumes out of an object.
fn without(object: &mut Object, volumes: &[Volume]) {
    match &mut object.shape {
        Shape::Mesh(mesh) => {
            let mut stays = vec![true; mesh.triangles.len()];
            for volume in volumes {
                if let Which::Triangles(first, last) = volume.which {
                    let past = last.saturating_add(1).min(stays.len());
                    stays[first.min(past)..past].fill(false);
                }
            }
            *mesh = kept(mesh, &stays);
        }
        Shape::Components(components) => components.retain(|c| {
            let is = |v: &Volume| matches!(v.which, Which::Component(id) if id == c.object);
            !volumes.iter().any(is)
        }),
    }
}

/// The triangles that stay, with their vertices.
fn kept(mesh: &Mesh, stays: &[bool]) -> Mesh {
    let mut of = vec![u32::MAX; mesh.vertices.len()];
    let mut made = Mesh::default();
    for (triangle, _) in mesh.triangles.iter().zip(stays).filter(|(_, s)| **s) {
        let corners = triangle.map(|v| {
            let v = v as usize;
            if of[v] == u32::MAX {
                of[v] = made.vertices.len() as u32;
                made.vertices.push(mesh.vertices[v]);
            }
            of[v]
        });
        made.triangles.push(corners);
    }
    made
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Write};

    use meltpath_base::Silent;

    use super::super::read_3mf;
    use super::*;
    use crate::mesh::NamedMesh;

    const RELATIONS: &str = r#"<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;

    /// Two tetrahedra in one mesh, 10 and 4 mm high, the second 20 mm aside.
    const MESH: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="10" y="0" z="0"/><vertex x="0" y="10" z="0"/><vertex x="0" y="0" z="10"/>
<vertex x="20" y="0" z="0"/><vertex x="24" y="0" z="0"/><vertex x="20" y="4" z="0"/><vertex x="20" y="0" z="4"/></vertices><triangles>
<triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/>
<triangle v1="4" v2="6" v3="5"/><triangle v1="4" v2="5" v3="7"/><triangle v1="5" v2="6" v3="7"/><triangle v1="4" v2="7" v3="6"/></triangles></mesh>"#;

    fn read(
        objects: &str,
        items: &str,
        config: (&str, &str),
    ) -> (Result<Vec<NamedMesh>, ThreeMfError>, Vec<String>) {
        let model = format!(
            r#"<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>{objects}</resources><build>{items}</build></model>"#
        );
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let plain = zip::write::SimpleFileOptions::default();
        for (name, text) in [
            ("_rels/.rels", RELATIONS),
            ("3D/3dmodel.model", &model),
            config,
        ] {
            zip.start_file(name, plain).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        let bytes = zip.finish().unwrap().into_inner();
        let reporter = Reporter::new();
        let read = read_3mf(Cursor::new(bytes), &reporter, &Silent);
        let warned = reporter.warnings().into_iter().map(|w| w.code);
        (read, warned.collect())
    }

    #[test]
    fn modifiers_by_triangles_are_no_metal_and_cuts_are_refused() {
        let object = format!(r#"<object id="3">{MESH}</object>"#);
        let told = |word: &str| {
            let config = format!(
                r#"<config><object id="3"><volume firstid="0" lastid="3"><metadata type="volume" key="volume_type" value="ModelPart"/></volume>
                <volume firstid="4" lastid="7"><metadata type="volume" key="volume_type" value="{word}"/></volume></object></config>"#
            );
            read(&object, r#"<item objectid="3"/>"#, (BY_TRIANGLES, &config))
        };
        let (meshes, warned) = told("ParameterModifier");
        let mesh = &meshes.unwrap()[0].mesh;
        assert_eq!((mesh.triangles.len(), mesh.vertices.len()), (4, 4));
        assert_eq!(warned, ["3mf-modifier-skipped"]);
        let (meshes, warned) = told("ModelPart");
        assert_eq!(meshes.unwrap()[0].mesh.triangles.len(), 8);
        assert!(warned.is_empty());
        let error = told("NegativeVolume").0.unwrap_err().to_string();
        assert!(
            error.contains("object 3") && error.contains("cuts out"),
            "{error}"
        );
    }

    #[test]
    fn modifiers_by_components_are_no_metal_either() {
        let objects = format!(
            r#"<object id="1">{MESH}</object><object id="2">{MESH}</object><object id="9"><components><component objectid="1"/><component objectid="2"/></components></object>"#
        );
        let told = |word: &str| {
            let config = format!(
                r#"<config><object id="9"><part id="1" subtype="normal_part"/><part id="2" subtype="{word}"/></object></config>"#
            );
            read(
                &objects,
                r#"<item objectid="9"/>"#,
                (BY_COMPONENTS, &config),
            )
        };
        let (meshes, warned) = told("modifier_part");
        assert_eq!(meshes.unwrap()[0].mesh.triangles.len(), 8);
        assert_eq!(warned, ["3mf-modifier-skipped"]);
        assert!(told("negative_part").0.is_err());
    }

    #[test]
    fn what_is_switched_off_is_left_out() {
        let object = format!(r#"<object id="1">{MESH}</object>"#);
        let items = r#"<item objectid="1"/><item objectid="1" printable="0"/>"#;
        let (meshes, warned) = read(&object, items, ("Metadata/none", ""));
        assert_eq!(
            (meshes.unwrap().len(), warned),
            (1, vec!["3mf-unprintable-skipped".to_owned()])
        );
    }
}
