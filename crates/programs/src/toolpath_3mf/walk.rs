//! Through the elements of one part of a package, streaming.

use std::io::{BufReader, Read};

use meltpath_geometry::io::threemf::{Limited, ThreeMfError, unread};
use quick_xml::events::Event;
use quick_xml::reader::NsReader;

use super::error::ToolpathFileError;
use super::xml::{EXPORT, Fault, Start, Words, broken, words};

/// The elements that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Element {
    Document,
    Model,
    Resources,
    Toolpath,
    Sources,
    Source,
    SyncGroup,
    Profiles,
    Profile,
    Modifier,
    Layers,
    LayerPath,
    Data,
    Build,
    Item,
    Layer,
    Parts,
    Part,
    LocalProfiles,
    LocalProfile,
    Segments,
    Segment,
    Point,
    Point3,
    Point6,
    Hatch,
    Sub,
    /// Anything else, skipped with all it holds.
    Foreign,
}

impl Element {
    /// What an element of the extension is inside `self`; nothing where it has no place there.
    fn child(self, name: &str) -> Option<Element> {
        Some(match (self, name) {
            (Element::Resources, "toolpathresource") => Element::Toolpath,
            (Element::Toolpath, "lasersources") => Element::Sources,
            (Element::Toolpath, "toolpathprofiles") => Element::Profiles,
            (Element::Toolpath, "toolpathlayers") => Element::Layers,
            (Element::Toolpath, "toolpathdata") | (Element::Layer, "data") => Element::Data,
            (Element::Sources, "lasersource") => Element::Source,
            (Element::Sources, "syncgroup") => Element::SyncGroup,
            (Element::Profiles, "toolpathprofile") => Element::Profile,
            (Element::Profile, "modifier") => Element::Modifier,
            (Element::Layers, "toolpathlayer") => Element::LayerPath,
            (Element::Document, "layer") => Element::Layer,
            (Element::Layer, "parts") => Element::Parts,
            (Element::Parts, "part") => Element::Part,
            (Element::Layer, "profiles") => Element::LocalProfiles,
            (Element::LocalProfiles, "profile") => Element::LocalProfile,
            (Element::Layer, "segments") => Element::Segments,
            (Element::Segments, "segment") => Element::Segment,
            (Element::Segment, "point") => Element::Point,
            (Element::Segment, "point3d") => Element::Point3,
            (Element::Segment, "point6d") => Element::Point6,
            (Element::Segment, "hatch") => Element::Hatch,
            (Element::Point | Element::Point3 | Element::Point6 | Element::Hatch, "sub") => {
                Element::Sub
            }
            _ => return None,
        })
    }

    /// What an element is that begins inside `self`.
    fn opened(self, start: &Start<'_, '_>) -> Result<Element, Fault> {
        let (found, local) = start.resolver.resolve_element(start.element.name());
        let (whose, name) = (words(&found)?, local.as_ref());
        let element = match (self, whose, name) {
            (Element::Foreign | Element::Data, ..) => Element::Foreign,
            (Element::Document, Words::Core, "model") => Element::Model,
            (Element::Model, Words::Core, "resources") => Element::Resources,
            (Element::Model, Words::Core, "build") => Element::Build,
            (Element::Build, Words::Core, "item") => Element::Item,
            (Element::Document, Words::Core | Words::Own | Words::Other(_), _) => {
                return Err(broken(format!(
                    "the root element `{name}` is neither a `model` nor a `layer` of 3MF"
                )));
            }
            (parent, Words::Toolpath, name) => parent.child(name).ok_or_else(|| {
                Fault::Broken(
                    format!("the element `{name}` has no place here, or is not known"),
                    "export for version 1.0 of the 3MF toolpath extension",
                )
            })?,
            _ => Element::Foreign,
        };
        Ok(element)
    }
}

/// What takes in the elements of a part.
pub(super) trait Visitor {
    /// An element begins.
    fn open(&mut self, element: Element, start: &Start<'_, '_>) -> Result<(), Fault>;
    /// An element ends.
    fn close(&mut self, element: Element) -> Result<(), Fault>;
}

/// Goes through a part.
pub(super) fn walk(
    source: Limited<impl Read>,
    part: &str,
    visitor: &mut impl Visitor,
) -> Result<(), ToolpathFileError> {
    let mut xml = NsReader::from_reader(BufReader::new(source));
    let mut buffer = Vec::new();
    let mut stack = vec![Element::Document];
    loop {
        let event = match xml.read_event_into(&mut buffer) {
            Ok(event) => event,
            Err(e) => return Err(unread(&xml, part, &e).into()),
        };
        let at = |fault| told(fault, part, xml.buffer_position());
        match event {
            Event::Start(ref e) | Event::Empty(ref e) => {
                let start = Start {
                    element: e,
                    resolver: xml.resolver(),
                };
                let parent = *stack.last().unwrap_or(&Element::Document);
                let element = parent.opened(&start).map_err(at)?;
                visitor.open(element, &start).map_err(at)?;
                match event {
                    Event::Empty(_) => visitor.close(element).map_err(at)?,
                    _ => stack.push(element),
                }
            }
            Event::End(_) => {
                let closed = stack.pop().unwrap_or(Element::Document);
                visitor.close(closed).map_err(at)?;
            }
            Event::DocType(_) => {
                return Err(at(broken(
                    "a document type declaration is not allowed in 3MF",
                )));
            }
            Event::CData(_) if stack.contains(&Element::Data) => {
                return Err(at(broken(
                    "a CDATA section in metadata, which is not allowed there",
                )));
            }
            Event::Eof if stack.len() > 1 => {
                return Err(at(broken(
                    "the XML ends inside an element: the file is cut short",
                )));
            }
            Event::Eof => break,
            _ => {}
        }
        buffer.clear();
    }
    let end = xml.buffer_position();
    visitor
        .close(Element::Document)
        .map_err(|fault| told(fault, part, end))
}

fn told(fault: Fault, part: &str, position: u64) -> ToolpathFileError {
    let part = part.to_owned();
    match fault {
        Fault::Broken(what, remedy) => ToolpathFileError::Content {
            part,
            position,
            what,
            remedy,
        },
        Fault::Extension(name) => ThreeMfError::Extension { part, name }.into(),
    }
}

/// What is wrong with the end of a part.
pub(super) fn content(part: &str, what: String) -> ToolpathFileError {
    ToolpathFileError::Content {
        part: part.to_owned(),
        position: 0,
        what,
        remedy: EXPORT,
    }
}
