//! One layer of a toolpath, from its part of the package.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_toolpath::{Layer, PassId};

use super::profile::uuid;
use super::resource::Resource;
use super::segment::Segment;
use super::walk::{Element, Visitor};
use super::words::{Form, Kind, ROLES};
use super::xml::{Fault, Start, Words, broken, count};

/// Something that a package says and that is not followed, or that it does not say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The part of the package.
    pub part: String,
    /// Number of the segment in it, from 1.
    pub segment: u32,
    /// Name of the profile.
    pub profile: String,
    /// What is not followed.
    pub what: String,
    /// Whether it shapes, or may shape, what is laid or marked.
    pub shapes: bool,
}

/// What goes on from layer to layer.
#[derive(Debug, Default)]
pub(super) struct Progress {
    passes: u32,
    /// Numbers of parts, by their UUIDs.
    parts: BTreeMap<String, u32>,
    /// Profiles whose remarks were told, and other names that were.
    told: BTreeSet<String>,
    /// The laser that marks.
    pub(super) laser: Option<u32>,
    /// Points that may still be read.
    pub(super) room: usize,
    pub(super) found: Vec<Found>,
}

/// A layer while it is read.
pub(super) struct Reading<'a> {
    pub(super) resource: &'a Resource,
    pub(super) part: &'a str,
    pub(super) layer: Layer,
    pub(super) progress: &'a mut Progress,
    /// Numbers of parts, and indices of profiles, by what the layer calls them.
    parts: BTreeMap<u32, u32>,
    profiles: BTreeMap<u32, usize>,
    open: Option<Segment>,
    segments: u32,
    begun: bool,
}

impl<'a> Reading<'a> {
    pub(super) fn new(
        (resource, part): (&'a Resource, &'a str),
        layer: Layer,
        progress: &'a mut Progress,
    ) -> Self {
        Reading {
            resource,
            part,
            layer,
            progress,
            parts: BTreeMap::new(),
            profiles: BTreeMap::new(),
            open: None,
            segments: 0,
            begun: false,
        }
    }

    fn name(&mut self, element: Element, start: &Start<'_, '_>) -> Result<(), Fault> {
        let id = start.count("id", 1)?;
        let uuid = uuid(&start.required("uuid")?)?;
        let new = if element == Element::Part {
            let next = self.progress.parts.len() as u32 + 1;
            let number = *self.progress.parts.entry(uuid).or_insert(next);
            self.parts.insert(id, number).is_none()
        } else {
            let index = self.resource.by_uuid.get(&uuid).copied();
            let index = index
                .ok_or_else(|| broken(format!("the profile {uuid} is none of the toolpath's")))?;
            self.profiles.insert(id, index).is_none()
        };
        if new {
            Ok(())
        } else {
            Err(broken(format!("the identifier {id} is given twice")))
        }
    }

    fn segment(&mut self, start: &Start<'_, '_>) -> Result<(), Fault> {
        self.segments += 1;
        let kind = start.required("type")?;
        let Some((form, of)) = Form::of(&kind) else {
            return Err(broken(format!(
                "type=\"{kind}\" is no type of segment that is known here"
            )));
        };
        if of != self.resource.kind {
            return Err(broken(format!(
                "a segment of type {kind} in a toolpath that is {}",
                self.resource.kind.name()
            )));
        }
        let id = start.count("profileid", 1)?;
        let profile = *self.profiles.get(&id).ok_or_else(|| {
            broken(format!(
                "profileid=\"{id}\" is none of the profiles of this layer"
            ))
        })?;
        let id = start.count("partid", 1)?;
        let mut part = *self.parts.get(&id).ok_or_else(|| {
            broken(format!(
                "partid=\"{id}\" is none of the parts of this layer"
            ))
        })?;
        let (mut role, mut laser, mut others) = (None, None, Vec::new());
        start.each(|whose, name, text| {
            match (whose, name) {
                (Words::Own, "type" | "profileid" | "partid") => {}
                (Words::Own, "laserindex") => laser = Some(count(name, text, 0)?),
                (Words::Own, "lasersync") => self.synchronised(count(name, text, 1)?)?,
                (Words::Own, "timeprediction" | "jumpprediction" | "tag") => {
                    count(name, text, 0)?;
                }
                (Words::Own, _) => {
                    return Err(broken(format!("a segment has no attribute `{name}`")));
                }
                (Words::Ours, "part") => part = count(name, text, 0)?,
                (Words::Ours, "role") => {
                    let known = ROLES.iter().find(|(_, word)| *word == text);
                    role = known.map(|(r, _)| *r);
                    if role.is_none() {
                        others.push(format!("{name}=\"{text}\""));
                    }
                }
                _ => others.push(name.to_owned()),
            }
            Ok(())
        })?;
        self.marked_by(laser, profile)?;
        self.remark(profile);
        for other in others {
            self.unknown(profile, &other);
        }
        self.open = Some(Segment {
            form,
            profile,
            role,
            part,
            corners: Vec::new(),
        });
        Ok(())
    }

    fn synchronised(&self, group: u32) -> Result<(), Fault> {
        let known = self.resource.lasers.as_ref();
        if known.is_some_and(|l| l.groups.contains(&group)) {
            Ok(())
        } else {
            Err(broken(format!(
                "lasersync=\"{group}\" is no group of lasers of the toolpath"
            )))
        }
    }

    /// Refuses undeclared lasers, and more than one: they would mark at the same time.
    fn marked_by(&mut self, said: Option<u32>, profile: usize) -> Result<(), Fault> {
        let lasers = self.resource.lasers.as_ref();
        let of_profile = self.resource.profiles[profile].laser;
        let laser = said
            .or(of_profile)
            .or(lasers.and_then(|l| l.default))
            .unwrap_or(0);
        let told = said.is_some() || of_profile.is_some();
        if told && lasers.is_some_and(|l| !l.known.contains(&laser)) {
            return Err(broken(format!("the laser {laser} is not declared")));
        }
        let first = *self.progress.laser.get_or_insert(laser);
        if first == laser {
            return Ok(());
        }
        Err(Fault::Broken(
            format!(
                "segments of the lasers {first} and {laser}: lasers that mark at the same time are not followed"
            ),
            "export the segments of one laser",
        ))
    }

    /// Tells what is not followed of a profile, once.
    fn remark(&mut self, profile: usize) {
        let said = &self.resource.profiles[profile];
        if !self.progress.told.insert(format!("profile {}", said.uuid)) {
            return;
        }
        let all = match self.resource.kind {
            Kind::Planar => said.not_followed(),
            Kind::ThreeAxis | Kind::SixAxis => said.gaps(),
        };
        for (what, shapes) in all {
            self.tell(profile, what, shapes);
        }
    }

    /// Tells that nobody knows what a word does, once.
    fn unknown(&mut self, profile: usize, name: &str) {
        if self.progress.told.insert(format!("name {name}")) {
            self.tell(profile, format!("what {name} does is not known here"), true);
        }
    }

    fn tell(&mut self, profile: usize, what: String, shapes: bool) {
        self.progress.found.push(Found {
            part: self.part.to_owned(),
            segment: self.segments,
            profile: self.resource.profiles[profile].name.clone(),
            what,
            shapes,
        });
    }

    /// The passes of the segment that ends.
    fn end(&mut self) -> Result<(), Fault> {
        let Some(segment) = self.open.take() else {
            return Ok(());
        };
        let profile = &self.resource.profiles[segment.profile];
        let passes = &mut self.progress.passes;
        let of = segment.profile;
        let none = segment.write(&mut self.layer, profile, |mut head| {
            *passes += 1;
            head.id = PassId(*passes);
            head
        })?;
        for what in none {
            if self.progress.told.insert(what.clone()) {
                self.tell(of, what, false);
            }
        }
        Ok(())
    }
}

impl Visitor for Reading<'_> {
    fn open(&mut self, element: Element, start: &Start<'_, '_>) -> Result<(), Fault> {
        match element {
            Element::Model => return Err(broken("the part of a layer holds a model")),
            Element::Layer => {
                self.begun = true;
                if let Some(number) = start.said(Words::Ours, "number")? {
                    self.layer.number = count("number", &number, 0)?;
                }
            }
            Element::Part | Element::LocalProfile => self.name(element, start)?,
            Element::Segment => self.segment(start)?,
            Element::Point | Element::Point3 | Element::Point6 | Element::Hatch => {
                if self.progress.room < 2 {
                    return Err(Fault::Broken(
                        "more points than are taken into memory".to_owned(),
                        "cut the toolpath into several packages",
                    ));
                }
                self.progress.room -= 2;
                let unit = self.resource.unit;
                if let Some(segment) = &mut self.open {
                    let profile = segment.profile;
                    if let Some(other) = segment.point(element, start, unit)? {
                        self.unknown(profile, &other);
                    }
                }
            }
            Element::Sub => {
                return Err(broken(
                    "a `sub` where no profile varies anything between the ends of a line",
                ));
            }
            Element::Foreign => {
                if let Some(segment) = &self.open {
                    let (profile, name) = (segment.profile, start.name());
                    self.unknown(profile, &name);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self, element: Element) -> Result<(), Fault> {
        match element {
            Element::Segment => self.end(),
            Element::Document if !self.begun => Err(broken("the part holds no `layer`")),
            _ => Ok(()),
        }
    }
}
