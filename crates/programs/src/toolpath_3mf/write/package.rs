//! What every package with a toolpath holds: its model, its layers, and how they lead to each other.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Seek, Write};

use meltpath_geometry::Mesh;
use meltpath_geometry::io::threemf::{CORE, MODEL_PART, PRODUCTION, PackageWriter, write_object};
use meltpath_geometry::mesh::NamedMesh;
use meltpath_toolpath::PassPlace;
use quick_xml::escape::escape;

use super::super::error::ToolpathFileWriteError;
use super::super::identity::uuid;
use super::super::words::{Kind, LAYER_RELATION, NAMESPACE, TOOLPATH};

/// Content type of the parts of layers; the specification leaves it open.
const LAYER_TYPE: (&str, &str) = ("xml", "application/xml");

/// A profile as it is written.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WrittenProfile {
    uuid: String,
    /// Attributes beside `uuid`, and the elements in it.
    attributes: String,
    elements: String,
}

impl WrittenProfile {
    /// Of a name that no other profile of the toolpath has.
    pub(super) fn new(name: &str, values: &str, elements: String) -> Self {
        let attributes = format!(r#" name="{}"{values}"#, escape(name));
        WrittenProfile {
            uuid: uuid(&format!("profile{attributes}{elements}")),
            attributes,
            elements,
        }
    }
}

/// A package while it is written.
pub(super) struct Package<W: Write + Seek> {
    to: PackageWriter<W>,
    kind: Kind,
    /// One device unit, mm.
    step: f64,
    /// Name of what is built, and the identifier of its item, which is made of it and the first layer.
    name: String,
    item: String,
    pub(super) profiles: Vec<WrittenProfile>,
    /// The parts of the layers, with their tops in device units.
    layers: Vec<(String, Option<i32>)>,
    /// What the layers hold, as one identifier.
    content: String,
}

impl<W: Write + Seek> Package<W> {
    pub(super) fn new(
        to: W,
        (kind, step): (Kind, f64),
        name: &str,
    ) -> Result<Self, ToolpathFileWriteError> {
        Ok(Package {
            to: PackageWriter::new(to, &[LAYER_TYPE])?,
            kind,
            step,
            name: name.to_owned(),
            item: String::new(),
            profiles: Vec::new(),
            layers: Vec::new(),
            content: String::new(),
        })
    }

    /// Writes a layer of these segments; nothing where it has none.
    pub(super) fn layer(
        &mut self,
        number: u32,
        top: Option<i32>,
        segments: &str,
    ) -> Result<(), ToolpathFileWriteError> {
        if segments.is_empty() {
            return Ok(());
        }
        if self.item.is_empty() {
            self.item = uuid(&format!("item {} {segments}", self.name));
        }
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<layer xmlns=\"{TOOLPATH}\" xmlns:mp=\"{NAMESPACE}\" mp:number=\"{number}\">\n\
             <parts><part id=\"1\" uuid=\"{}\"/></parts>\n<profiles>\n",
            self.item
        );
        for (k, profile) in self.profiles.iter().enumerate() {
            let _ = writeln!(text, r#"<profile id="{}" uuid="{}"/>"#, k + 1, profile.uuid);
        }
        text.push_str("</profiles>\n<segments>\n");
        text.push_str(segments);
        text.push_str("</segments>\n</layer>\n");
        let part = format!("Toolpath/Layers/layer{:05}.xml", self.layers.len() + 1);
        self.to.part(&part)?.write_all(text.as_bytes())?;
        self.content = uuid(&format!("{}{text}", self.content));
        self.layers.push((part, top));
        Ok(())
    }

    /// Writes the model, and what leads from it to its layers; `mesh` is what is built, mm.
    pub(super) fn finish(mut self, mesh: Mesh) -> Result<W, ToolpathFileWriteError> {
        if self.layers.is_empty() {
            return Err(ToolpathFileWriteError::Empty);
        }
        let links: Vec<(&str, &str)> = self
            .layers
            .iter()
            .map(|(part, _)| (LAYER_RELATION, part.as_str()))
            .collect();
        self.to.relations(MODEL_PART, &links)?;
        let mut xml = std::io::BufWriter::new(self.to.part(MODEL_PART)?);
        writeln!(
            xml,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en\" xmlns=\"{CORE}\" xmlns:p=\"{PRODUCTION}\" \
             xmlns:tp=\"{TOOLPATH}\" xmlns:mp=\"{NAMESPACE}\" requiredextensions=\"p tp\">\n\
             <metadata name=\"Application\">meltpath</metadata>\n<resources>"
        )?;
        writeln!(
            xml,
            r#"<tp:toolpathresource id="1" uuid="{}" unitfactor="{}" toolpathtype="{}">"#,
            uuid(&format!("toolpath {}{}", self.item, self.content)),
            self.step,
            self.kind.name()
        )?;
        writeln!(xml, "<tp:toolpathprofiles>")?;
        for p in &self.profiles {
            let begun = format!(r#"<tp:toolpathprofile uuid="{}"{}"#, p.uuid, p.attributes);
            if p.elements.is_empty() {
                writeln!(xml, "{begun}/>")?;
            } else {
                writeln!(xml, "{begun}>\n{}</tp:toolpathprofile>", p.elements)?;
            }
        }
        writeln!(xml, "</tp:toolpathprofiles>\n<tp:toolpathlayers>")?;
        for (part, top) in &self.layers {
            let top = top.map_or_else(String::new, |top| format!(r#" ztop="{top}""#));
            writeln!(xml, r#"<tp:toolpathlayer{top} path="/{part}"/>"#)?;
        }
        writeln!(xml, "</tp:toolpathlayers>\n</tp:toolpathresource>")?;
        let further = format!(r#" p:UUID="{}""#, uuid(&format!("object {}", self.item)));
        let part = NamedMesh {
            name: self.name,
            mesh,
        };
        let shape = if is_closed(&part.mesh) {
            "model"
        } else {
            "surface"
        };
        write_object(&mut xml, (2, shape, &further), &part)?;
        writeln!(
            xml,
            "</resources>\n<build p:UUID=\"{}\" tp:toolpathid=\"1\">\n<item objectid=\"2\" p:UUID=\"{}\"/>\n</build>\n</model>",
            uuid(&format!("build {}{}", self.item, self.content)),
            self.item
        )?;
        xml.flush()?;
        drop(xml);
        Ok(self.to.finish()?)
    }
}

/// Whether triangles enclose something: each edge is passed as often one way as the other.
fn is_closed(mesh: &Mesh) -> bool {
    let mut edges = BTreeMap::<(u32, u32), i32>::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let way = if from < to { 1 } else { -1 };
            *edges.entry((*from.min(to), *from.max(to))).or_default() += way;
        }
    }
    !edges.is_empty() && edges.values().all(|n| *n == 0)
}

/// Device units of `step` mm of a length, mm.
pub(super) fn device(
    pass: PassPlace,
    what: &'static str,
    (value, step): (f64, f64),
) -> Result<i32, ToolpathFileWriteError> {
    let units = (value / step).round();
    if units.abs() <= f64::from(i32::MAX) {
        return Ok(units as i32);
    }
    Err(ToolpathFileWriteError::Value {
        pass,
        what,
        value,
        wanted: "finite and within 200 m of the origin (mm)",
    })
}

/// A value that must be above zero.
pub(super) fn above_zero(
    pass: PassPlace,
    what: &'static str,
    value: f64,
) -> Result<f64, ToolpathFileWriteError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(ToolpathFileWriteError::Value {
        pass,
        what,
        value,
        wanted: "above zero and finite",
    })
}
