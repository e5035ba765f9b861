//! One model part of a 3MF package: XML to objects and build items (3MF core specification 1.3, chapters 3 and 4).

use std::{
    collections::BTreeMap,
    io::{BufReader, Read},
};

use meltpath_base::Observer;
use quick_xml::{
    XmlVersion,
    events::{BytesStart, Event},
    name::{Namespace, NamespaceResolver, ResolveResult},
    reader::NsReader,
};

use super::{ThreeMfError, package::Limited};
use crate::{
    Mesh,
    math::{DAffine3, DMat3, DVec3},
};

const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
const SLICE: &str = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07";

/// Extensions that may be required without changing any shape, or whose effect is followed.
const HARMLESS: [&str; 4] = [
    CORE,
    PRODUCTION,
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
];

/// Names of extensions that are refused when required, by a word of their namespace.
const REFUSED: [(&str, &str); 7] = [
    ("/slice/", "slice"),
    ("/beamlattice/", "beam lattice"),
    ("/securecontent/", "secure content (encrypted)"),
    ("/volumetric/", "volumetric"),
    ("/implicit/", "implicit"),
    ("/displacement/", "displacement"),
    ("/booleanoperations/", "boolean operations"),
];

/// Events between two looks at the observer.
const EVENTS_PER_CHECK: u64 = 1 << 16;

/// What a build item or component places.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    /// Object identifier in its model part.
    pub(super) object: u32,
    /// Model part that holds it, if not the same.
    pub(super) path: Option<String>,
    /// From the object to its container.
    pub(super) transform: DAffine3,
}

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
            Err(e) => {
                let limited = xml.get_ref().get_ref();
                return Err(if limited.exceeded {
                    limited.bomb(part)
                } else {
                    ThreeMfError::Xml {
                        part: part.to_owned(),
                        position: xml.error_position(),
                        message: e.to_string(),
                    }
                });
            }
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
        let (namespace, local) = resolver.resolve_element(start.name());
        let is_core = matches!(namespace, ResolveResult::Bound(Namespace(n)) if n == CORE);
        if let ResolveResult::Unknown(prefix) = &namespace {
            let prefix = String::from_utf8_lossy(prefix.as_bytes());
            return Err(at(broken(format!(
                "the namespace prefix `{prefix}` is not declared"
            ))));
        }
        let element = if is_core && parent != Element::Foreign {
            parent.child(local.as_ref())
        } else {
            Element::Foreign
        };
        if parent == Element::Document && element != Element::Model {
            return Err(at(broken(
                "the root element is not `model` of the 3MF core namespace",
            )));
        }
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
    let fault = |message: &str| ThreeMfError::Model {
        part: part.to_owned(),
        position: xml.buffer_position(),
        message: message.to_owned(),
    };
    if stack.len() > 1 {
        return Err(fault(
            "the XML ends inside an element: the file is cut short",
        ));
    }
    let Some(unit) = reading.unit else {
        return Err(fault("the part holds no `model` element"));
    };
    if !reading.has_build {
        return Err(fault("the model has no `build` element"));
    }
    Ok(Model {
        unit,
        objects: reading.objects,
        items: reading.items,
    })
}

/// What is wrong with an element.
#[derive(Debug)]
enum Fault {
    Broken(String),
    Extension(String),
}

fn broken(message: impl Into<String>) -> Fault {
    Fault::Broken(message.into())
}

/// The attributes of one element.
struct Attributes<'e, 'x> {
    element: &'e BytesStart<'x>,
    resolver: &'e NamespaceResolver,
}

impl Attributes<'_, '_> {
    fn text(&self, name: &str) -> Result<Option<String>, Fault> {
        let found = self
            .element
            .try_get_attribute(name)
            .map_err(|e| broken(e.to_string()))?;
        found
            .map(|a| {
                a.normalized_value(XmlVersion::default())
                    .map(std::borrow::Cow::into_owned)
                    .map_err(|e| broken(e.to_string()))
            })
            .transpose()
    }

    fn required(&self, name: &str) -> Result<String, Fault> {
        self.text(name)?.ok_or_else(|| {
            let element = self.element.local_name();
            broken(format!(
                "`{}` lacks the attribute `{name}`",
                element.as_ref()
            ))
        })
    }

    fn number<T: std::str::FromStr>(&self, name: &str, what: &str) -> Result<T, Fault> {
        let text = self.required(name)?;
        text.trim().parse().map_err(|_| {
            let element = self.element.local_name();
            broken(format!(
                "`{}` {name}=\"{text}\" is not {what}",
                element.as_ref()
            ))
        })
    }

    /// A resource identifier: 1 to 2³¹−1.
    fn identifier(&self, name: &str) -> Result<u32, Fault> {
        let id: u32 = self.number(name, "a resource identifier")?;
        if id == 0 || id >= 1 << 31 {
            return Err(broken(format!(
                "{name}=\"{id}\" is not a resource identifier (1 to 2147483647)"
            )));
        }
        Ok(id)
    }

    /// Numbers of the attributes in `names`, in one walk over the element: the hot path of large meshes.
    fn several<T: std::str::FromStr + Copy, const N: usize>(
        &self,
        names: [&str; N],
        what: &str,
    ) -> Result<[T; N], Fault> {
        let mut found = [None; N];
        for attribute in self.element.attributes() {
            let attribute = attribute.map_err(|e| broken(e.to_string()))?;
            if let Some(k) = names.iter().position(|n| attribute.key.as_ref() == *n) {
                let text = attribute.value.as_ref();
                found[k] = Some(
                    text.trim()
                        .parse()
                        .map_err(|_| broken(format!("`{}`=\"{text}\" is not {what}", names[k])))?,
                );
            }
        }
        let missing = |k: usize| broken(format!("the attribute `{}` is missing", names[k]));
        let mut values = Vec::with_capacity(N);
        for (k, value) in found.into_iter().enumerate() {
            values.push(value.ok_or_else(|| missing(k))?);
        }
        values.try_into().map_err(|_| missing(0))
    }

    /// The value of an extension's attribute.
    fn extension(&self, namespace: &str, name: &str) -> Result<Option<String>, Fault> {
        let mut found = None;
        for attribute in self.element.attributes() {
            let attribute = attribute.map_err(|e| broken(e.to_string()))?;
            let (bound, local) = self.resolver.resolve_attribute(attribute.key);
            if local.as_ref() == name
                && matches!(bound, ResolveResult::Bound(Namespace(n)) if n == namespace)
            {
                found = Some(attribute.value.into_owned());
            }
        }
        Ok(found)
    }

    /// Whether the object carries ready-made slices.
    ///
    /// Where they replace its mesh (`meshresolution="lowres"`) the mesh is only a placeholder: refused.
    fn slices(&self) -> Result<bool, Fault> {
        if self.extension(SLICE, "meshresolution")?.as_deref() == Some("lowres") {
            return Err(Fault::Extension(
                "`slice` (its mesh is a placeholder)".to_owned(),
            ));
        }
        Ok(self.extension(SLICE, "slicestackid")?.is_some())
    }

    fn placed(&self) -> Result<Placed, Fault> {
        let path = self
            .extension(PRODUCTION, "path")?
            .map(|path| path.trim_start_matches('/').to_owned());
        let transform = match self.text("transform")? {
            None => DAffine3::IDENTITY,
            Some(text) => transform(&text)?,
        };
        Ok(Placed {
            object: self.identifier("objectid")?,
            path,
            transform,
        })
    }
}

/// Twelve numbers of a 4 x 3 matrix applied to row vectors.
fn transform(text: &str) -> Result<DAffine3, Fault> {
    let numbers: Option<Vec<f64>> = text
        .split_ascii_whitespace()
        .map(|w| w.parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    let numbers: Option<[f64; 12]> = numbers.and_then(|n| n.try_into().ok());
    let Some(m) = numbers else {
        return Err(broken(format!(
            "transform=\"{text}\" is not twelve finite numbers"
        )));
    };
    let row = |k: usize| DVec3::new(m[3 * k], m[3 * k + 1], m[3 * k + 2]);
    let matrix = DMat3::from_cols(row(0), row(1), row(2));
    if matrix.determinant() == 0.0 {
        return Err(broken(format!("transform=\"{text}\" flattens the object")));
    }
    Ok(DAffine3::from_mat3_translation(matrix, row(3)))
}

impl Reading {
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

/// One model unit in mm.
fn unit(name: Option<&str>) -> Result<f64, Fault> {
    Ok(match name {
        None | Some("millimeter") => 1.0,
        Some("micron") => 1e-3,
        Some("centimeter") => 10.0,
        Some("inch") => 25.4,
        Some("foot") => 304.8,
        Some("meter") => 1000.0,
        Some(other) => {
            return Err(broken(format!(
                "unit=\"{other}\" is none of micron, millimeter, centimeter, inch, foot, meter"
            )));
        }
    })
}

/// Refuses required extensions that would change shapes.
fn required_extensions(attributes: &Attributes<'_, '_>) -> Result<(), Fault> {
    let required = attributes.text("requiredextensions")?.unwrap_or_default();
    for prefix in required.split_ascii_whitespace() {
        let Some(namespace) = attributes.text(&format!("xmlns:{prefix}"))? else {
            return Err(broken(format!(
                "the required extension prefix `{prefix}` is not declared"
            )));
        };
        if !HARMLESS.contains(&namespace.as_str()) {
            let known = REFUSED.iter().find(|(word, _)| namespace.contains(word));
            return Err(Fault::Extension(
                known.map_or(namespace.clone(), |(_, name)| format!("`{name}`")),
            ));
        }
    }
    Ok(())
}
