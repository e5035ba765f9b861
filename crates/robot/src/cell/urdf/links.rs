//! Reads the shapes of a URDF's links as they are written.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::error::{LinkFault, UrdfError};
use super::read::{Lines, MILLIMETRES, attribute, finite};

/// More shapes than these no robot has.
const MOST: usize = 10_000;

/// A shape of a link.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Where it begins.
    pub(super) line: usize,
    /// Whether it is made for collisions, not for the eye.
    pub(super) collides: bool,
    /// In the frame of the link, mm.
    pub(super) pose: Pose,
    pub(super) form: Option<Form>,
}

/// What a shape is, mm.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Form {
    /// A file, and by how much its numbers are scaled, m.
    Mesh { file: String, scale: DVec3 },
    /// A box around its origin.
    Box(DVec3),
    /// A cylinder around its origin, along z.
    Cylinder { radius: f64, length: f64 },
    /// A ball around its origin.
    Ball(f64),
}

/// The shapes of each link, by its name.
pub(super) fn pieces(text: &str) -> Result<BTreeMap<String, Vec<Piece>>, UrdfError> {
    let mut reader = Reader::from_str(text);
    let mut lines = Lines::of_text(text);
    let mut all: BTreeMap<String, Vec<Piece>> = BTreeMap::new();
    let mut link = None;
    let mut current: Option<Piece> = None;
    let mut count = 0;
    loop {
        let line = lines.of(reader.buffer_position());
        let event = reader.read_event();
        let event = event.map_err(|e| UrdfError::Broken(e.to_string()))?;
        match &event {
            Event::Eof => return Ok(all),
            Event::End(e) => match (e.name().as_ref(), &link) {
                ("link", _) => link = None,
                ("collision" | "visual", Some(link)) => {
                    let of = all.entry(String::clone(link)).or_default();
                    of.extend(current.take());
                }
                _ => {}
            },
            Event::Start(e) | Event::Empty(e) => match (e.name().as_ref(), &link) {
                // links of gazebo and the like lie in elements of their own, and have no name
                ("link", _) if matches!(event, Event::Start(_)) => link = attribute(e, "name"),
                (tag @ ("collision" | "visual"), Some(_)) => {
                    count += 1;
                    current = Some(Piece {
                        line,
                        collides: tag == "collision",
                        pose: Pose::IDENTITY,
                        form: None,
                    });
                }
                (tag, Some(link)) => {
                    if let Some(piece) = &mut current {
                        piece.take(tag, e, link)?;
                    }
                }
                _ => {}
            },
            _ => {}
        }
        if count > MOST {
            let many = format!("it has more than {MOST} shapes");
            return Err(UrdfError::Broken(many));
        }
    }
}

impl Piece {
    pub(super) fn wrong(&self, link: &str, fault: LinkFault) -> UrdfError {
        UrdfError::Link {
            link: link.to_owned(),
            line: self.line,
            fault,
        }
    }

    fn numbers<const N: usize>(
        &self,
        link: &str,
        what: &'static str,
        text: &str,
    ) -> Result<[f64; N], UrdfError> {
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(finite).collect();
        let found = numbers.and_then(|n| <[f64; N]>::try_from(n).ok());
        found.ok_or_else(|| {
            let text = text.to_owned();
            self.wrong(link, LinkFault::Number { what, text })
        })
    }

    /// A size, m, which is above zero.
    fn size(&self, e: &BytesStart<'_>, link: &str, what: &'static str) -> Result<f64, UrdfError> {
        let text = attribute(e, what).unwrap_or_default();
        let [size] = self.numbers(link, what, &text)?;
        if size > 0.0 {
            return Ok(size * MILLIMETRES);
        }
        Err(self.wrong(link, LinkFault::Number { what, text }))
    }

    /// Takes what stands within it.
    fn take(&mut self, tag: &str, e: &BytesStart<'_>, link: &str) -> Result<(), UrdfError> {
        match tag {
            "origin" => {
                let three = |what: &'static str| {
                    let text = attribute(e, what).unwrap_or_else(|| "0 0 0".to_owned());
                    self.numbers(link, what, &text).map(DVec3::from_array)
                };
                self.pose = Pose::from_wpr(three("xyz")? * MILLIMETRES, three("rpy")?);
            }
            "mesh" => {
                let file = attribute(e, "filename").unwrap_or_default();
                let scale = attribute(e, "scale").unwrap_or_else(|| "1 1 1".to_owned());
                let scale = DVec3::from_array(self.numbers(link, "scale", &scale)?);
                self.form = Some(Form::Mesh { file, scale });
            }
            "box" => {
                let text = attribute(e, "size").unwrap_or_default();
                let size = DVec3::from_array(self.numbers(link, "size", &text)?);
                if size.min_element() <= 0.0 {
                    return Err(self.wrong(link, LinkFault::Number { what: "size", text }));
                }
                self.form = Some(Form::Box(size * MILLIMETRES));
            }
            "cylinder" => {
                self.form = Some(Form::Cylinder {
                    radius: self.size(e, link, "radius")?,
                    length: self.size(e, link, "length")?,
                });
            }
            "sphere" => self.form = Some(Form::Ball(self.size(e, link, "radius")?)),
            _ => {}
        }
        Ok(())
    }
}
