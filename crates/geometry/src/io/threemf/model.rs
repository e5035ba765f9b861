//! One model part of a 3MF package: XML to objects and build items (3MF core specification 1.3, chapters 3 and 4).

use std::{
    collections::BTreeMap,
    io::{BufReader, Read},
};

use meltpath_base::Observer;
use quick_xml::{
    events::{BytesStart, Event},
    name::{Namespace, NamespaceResolver, ResolveResult},
    reader::NsReader,
};

use super::element::{Attributes, CORE, Fault, Placed, broken, required_extensions, unit};
use super::error::ThreeMfError;
use super::limited::{Limited, unread};
use crate::Mesh;
use crate::math::DVec3;

/// Events between two looks at the observer.
const EVENTS_PER_CHECK: u64 = 1 << 16;

/// What an object is made of.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    Mesh(Mesh),
    Components(Vec<Placed>),
}

/// One object resource.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Object {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) shape: Shape,
    /// Whether it also carries ready-made slices, which are not read.
    pub(super) has_slices: bool,
    /// How many objects were defined before it: components may only use earlier ones.
    pub(super) order: usize,
}

/// What an object is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Part,
    Support,
    Other,
}

/// A model part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    /// One unit of the model in mm.
    pub(super) unit: f64,
    pub(super) objects: BTreeMap<u32, Object>,
    pub(super) items: Vec<Placed>,
}

impl Model {
    /// Other model parts that this one names.
    pub(super) fn paths(&self) -> impl Iterator<Item = String> {
        let components = self.objects.values().flat_map(|o| match &o.shape {
            Shape::Components(list) => list.as_slice(),
            Shape::Mesh(_) => &[],
        });
        components
            .chain(&self.items)
            .filter_map(|placed| placed.path.clone())
    }
}

/// The elements of the core specification that carry shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Element {
    Document,
    Model,
    Resources,
    Object,
    Mesh,
    Vertices,
    Vertex,
    Triangles,
    Triangle,
    Components,
    Component,
    Build,
    Item,
    /// Anything else, skipped with all it holds.
    Foreign,
}

impl Element {
    /// What a core element named `name` is inside `self`.
    fn child(self, name: &str) -> Element {
        match (self, name) {
            (Element::Document, "model") => Element::Model,
            (Element::Model, "resources") => Element::Resources,
            (Element::Model, "build") => Element::Build,
            (Element::Resources, "object") => Element::Object,
            (Element::Object, "mesh") => Element::Mesh,
            (Element::Object, "components") => Element::Components,
            (Element::Mesh, "vertices") => Element::Vertices,
            (Element::Mesh, "triangles") => Element::Triangles,
            (Element::Vertices, "vertex") => Element::Vertex,
            (Element::Triangles, "triangle") => Element::Triangle,
            (Element::Components, "component") => Element::Component,
            (Element::Build, "item") => Element::Item,
            _ => Element::Foreign,
        }
    }

    /// Refuses what adds metal to a mesh and is not read, whether the file requires it or not.
    fn adds(self, namespace: &ResolveResult<'_>, name: &str) -> Result<(), Fault> {
        match namespace {
            ResolveResult::Bound(Namespace(n))
                if self == Element::Mesh
                    && name == "beamlattice"
                    && n.contains("/beamlattice/") =>
            {
                Err(Fault::Extension("beam lattice".to_owned()))
            }
            _ => Ok(()),
        }
    }

    /// What an element that starts inside `self` is.
    fn opened(self, start: &BytesStart<'_>, resolver: &NamespaceResolver) -> Result<Self, Fault> {
        let (namespace, local) = resolver.resolve_element(start.name());
        let is_core = matches!(namespace, ResolveResult::Bound(Namespace(n)) if n == CORE);
        if let ResolveResult::Unknown(prefix) = &namespace {
            let prefix = String::from_utf8_lossy(prefix.as_bytes());
            return Err(broken(format!(
                "the namespace prefix `{prefix}` is not declared"
            )));
        }
        self.adds(&namespace, local.as_ref())?;
        let element = if is_core && self != Element::Foreign {
            self.child(local.as_ref())
        } else {
            Element::Foreign
        };
        if self == Element::Document && element != Element::Model {
            return Err(broken(
                "the root element is not `model` of the 3MF core namespace",
            ));
        }
        Ok(element)
    }
}

/// An object while its element is open.
#[derive(Debug)]
struct OpenObject {
    id: u32,
    name: String,
    kind: Kind,
    has_slices: bool,
    mesh: Option<Mesh>,
    components: Option<Vec<Placed>>,
}

/// The model while it is read.
#[derive(Debug)]
struct Reading {
    unit: Option<f64>,
    objects: BTreeMap<u32, Object>,
    items: Vec<Placed>,
    has_build: bool,
    open: Option<OpenObject>,
}

/// Reads one model part, streaming.
pub(super) fn read_model<R: Read>(
    reader: BufReader<Limited<R>>,
    part: &str,
    observer: &dyn Observer,
) -> Result<Model, ThreeMfError> {
    let mut xml = NsReader::from_reader(reader);
    let mut buffer = Vec::new();
    let mut stack = vec![Element::Document];
    let mut reading = Reading {
        unit: None,
        objects: BTreeMap::new(),
        items: Vec::new(),
        has_build: false,
        open: None,
    };
    let mut events: u64 = 0;
    loop {
        events += 1;
        if events.is_multiple_of(EVENTS_PER_CHECK) {
            observer.check()?;
        }
        let event = match xml.read_event_into(&mut buffer) {
            Ok(event) => event,
            Err(e) => return Err(unread(&xml, part, &e)),
        };
        let at = |message: Fault| match message {
            Fault::Broken(message) => ThreeMfError::Model {
                part: part.to_owned(),
                position: xml.buffer_position(),
                message,
            },
            Fault::Extension(name) => ThreeMfError::Extension {
                part: part.to_owned(),
                name,
            },
        };
        let (start, is_empty) = match event {
            Event::Start(e) => (e, false),
            Event::Empty(e) => (e, true),
            Event::End(_) => {
                let closed = stack.pop().unwrap_or(Element::Document);
                reading.close(closed).map_err(at)?;
                buffer.clear();
                continue;
            }
            Event::DocType(_) => {
                return Err(at(broken(
                    "a document type declaration is not allowed in 3MF",
                )));
            }
            Event::Eof => break,
            _ => {
                buffer.clear();
                continue;
            }
        };
        let parent = *stack.last().unwrap_or(&Element::Document);
        let resolver = xml.resolver();
        let element = parent.opened(&start, resolver).map_err(at)?;
        let attributes = Attributes {
            element: &start,
            resolver,
        };
        reading.open(element, &attributes).map_err(at)?;
        if is_empty {
            reading.close(element).map_err(at)?;
        } else {
            stack.push(element);
        }
        buffer.clear();
    }
    reading
        .finish(stack.len())
        .map_err(|message| ThreeMfError::Model {
            part: part.to_owned(),
            position: xml.buffer_position(),
            message: message.to_owned(),
        })
}

impl Reading {
    /// The model, after the last event; `depth` elements are open, the document among them.
    fn finish(self, depth: usize) -> Result<Model, &'static str> {
        if depth > 1 {
            return Err("the XML ends inside an element: the file is cut short");
        }
        let unit = self.unit.ok_or("the part holds no `model` element")?;
        if !self.has_build {
            return Err("the model has no `build` element");
        }
        Ok(Model {
            unit,
            objects: self.objects,
            items: self.items,
        })
    }

    fn open(&mut self, element: Element, attributes: &Attributes<'_, '_>) -> Result<(), Fault> {
        match element {
            Element::Model => {
                self.unit = Some(unit(attributes.text("unit")?.as_deref())?);
                required_extensions(attributes)?;
            }
            Element::Build => self.has_build = true,
            Element::Object => {
                let id = attributes.identifier("id")?;
                if self.objects.contains_key(&id) {
                    return Err(broken(format!("object {id} is defined twice")));
                }
                let kind = match attributes.text("type")?.as_deref() {
                    None | Some("model" | "surface") => Kind::Part,
                    Some("support" | "solidsupport") => Kind::Support,
                    Some("other") => Kind::Other,
                    Some(kind) => {
                        return Err(broken(format!("object {id} has the unknown type `{kind}`")));
                    }
                };
                self.open = Some(OpenObject {
                    id,
                    name: attributes.text("name")?.unwrap_or_default(),
                    kind,
                    has_slices: attributes.slices()?,
                    mesh: None,
                    components: None,
                });
            }
            Element::Item => self.items.push(attributes.placed()?),
            Element::Mesh | Element::Components => {
                let object = self.object()?;
                if object.mesh.is_some() || object.components.is_some() {
                    return Err(broken(format!(
                        "object {} has more than one mesh or list of components",
                        object.id
                    )));
                }
                if element == Element::Mesh {
                    object.mesh = Some(Mesh::default());
                } else {
                    object.components = Some(Vec::new());
                }
            }
            Element::Component => {
                let placed = attributes.placed()?;
                let object = self.object()?;
                if placed.object == object.id && placed.path.is_none() {
                    return Err(broken(format!("object {} contains itself", object.id)));
                }
                object.components.get_or_insert_default().push(placed);
            }
            Element::Vertex => {
                let xyz: [f64; 3] = attributes.several(["x", "y", "z"], "a number")?;
                let p = DVec3::from(xyz);
                if !p.is_finite() {
                    return Err(broken(format!("a vertex is not finite: {xyz:?}")));
                }
                let mesh = self.mesh()?;
                if mesh.vertices.len() >= u32::MAX as usize {
                    return Err(broken("more vertices than can be counted"));
                }
                mesh.vertices.push(p);
            }
            Element::Triangle => {
                let v: [u32; 3] = attributes.several(["v1", "v2", "v3"], "a vertex index")?;
                let mesh = self.mesh()?;
                if let Some(bad) = v.iter().find(|&&i| i as usize >= mesh.vertices.len()) {
                    return Err(broken(format!(
                        "triangle {} names vertex {bad}, but the mesh has {} vertices",
                        mesh.triangles.len(),
                        mesh.vertices.len()
                    )));
                }
                if v[0] == v[1] || v[1] == v[2] || v[2] == v[0] {
                    return Err(broken(format!(
                        "triangle {} names the same vertex twice: {v:?}",
                        mesh.triangles.len()
                    )));
                }
                mesh.triangles.push(v);
            }
            Element::Document
            | Element::Resources
            | Element::Vertices
            | Element::Triangles
            | Element::Foreign => {}
        }
        Ok(())
    }

    fn close(&mut self, element: Element) -> Result<(), Fault> {
        if element != Element::Object {
            return Ok(());
        }
        let Some(object) = self.open.take() else {
            return Ok(());
        };
        let shape = match (object.mesh, object.components) {
            (Some(mesh), _) => Shape::Mesh(mesh),
            (None, Some(components)) => Shape::Components(components),
            (None, None) => {
                return Err(broken(format!(
                    "object {} has neither mesh nor components",
                    object.id
                )));
            }
        };
        let order = self.objects.len();
        self.objects.insert(
            object.id,
            Object {
                name: object.name,
                kind: object.kind,
                shape,
                has_slices: object.has_slices,
                order,
            },
        );
        Ok(())
    }

    fn object(&mut self) -> Result<&mut OpenObject, Fault> {
        self.open
            .as_mut()
            .ok_or_else(|| broken("a shape outside an object"))
    }

    fn mesh(&mut self) -> Result<&mut Mesh, Fault> {
        self.object()?
            .mesh
            .as_mut()
            .ok_or_else(|| broken("vertices or triangles outside a mesh"))
    }
}
