//! The model of a package: which toolpath is built, its profiles, its layers.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;

use meltpath_geometry::io::threemf::{CORE, Limited, PRODUCTION, unit_in_mm};

use super::error::ToolpathFileError;
use super::profile::{SaidProfile, uuid};
use super::walk::{Element, Visitor, content, walk};
use super::words::{DRAFT, Kind, NAMESPACE, TOOLPATH};
use super::xml::{Fault, Start, Words, broken, count, positive};

/// Namespaces of extensions that may be required.
const KNOWN: [&str; 7] = [
    CORE,
    PRODUCTION,
    TOOLPATH,
    DRAFT,
    NAMESPACE,
    // they say nothing of a path
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
];

/// Names of extensions that are refused, by a word of their namespaces.
const REFUSED: [(&str, &str); 4] = [
    ("/binary/", "binary encoding"),
    ("/securecontent/", "secure content (encrypted)"),
    ("/slice/", "slice"),
    ("/beamlattice/", "beam lattice"),
];

/// Most toolpaths of a model, profiles of one, and layers.
const MOST_TOOLPATHS: usize = 1000;
const MOST_PROFILES: usize = u16::MAX as usize;
const MOST_LAYERS: usize = 1_000_000;

/// A toolpath of a model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Resource {
    id: u32,
    pub(super) kind: Kind,
    /// One device unit, mm.
    pub(super) unit: f64,
    pub(super) profiles: Vec<SaidProfile>,
    /// Their numbers by their UUIDs, and their names.
    pub(super) by_uuid: BTreeMap<String, usize>,
    names: BTreeSet<String>,
    pub(super) layers: Vec<LayerPath>,
    pub(super) lasers: Option<Lasers>,
}

/// Where a layer is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LayerPath {
    /// Its part, without the slash in front.
    pub(super) part: String,
    /// Its top, device units, where it is plane.
    pub(super) top: Option<u32>,
}

/// The lasers that there are.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Lasers {
    pub(super) default: Option<u32>,
    pub(super) known: BTreeSet<u32>,
    pub(super) groups: BTreeSet<u32>,
}

/// The model while it is read.
#[derive(Default)]
struct Model {
    unit: f64,
    all: Vec<Resource>,
    wanted: Option<u32>,
}

/// The toolpath that a model says is to be built.
pub(super) fn read_resource(
    source: Limited<impl Read>,
    part: &str,
) -> Result<Resource, ToolpathFileError> {
    let mut model = Model::default();
    walk(source, part, &mut model)?;
    let mut all = model.all;
    if let Some(id) = model.wanted {
        let found = all.into_iter().find(|r| r.id == id);
        return found.ok_or_else(|| {
            content(
                part,
                format!("the build names the toolpath {id}, which the model does not have"),
            )
        });
    }
    match all.len() {
        0 => Err(ToolpathFileError::None),
        1 => Ok(all.remove(0)),
        count => {
            let ids: Vec<String> = all.iter().map(|r| r.id.to_string()).collect();
            Err(ToolpathFileError::Several {
                count,
                ids: ids.join(", "),
            })
        }
    }
}

impl Model {
    fn last(&mut self) -> Result<&mut Resource, Fault> {
        let last = self.all.last_mut();
        last.ok_or_else(|| broken("a part of a toolpath outside of one"))
    }

    fn resource(&mut self, start: &Start<'_, '_>) -> Result<(), Fault> {
        let id = start.count("id", 1)?;
        if self.all.len() >= MOST_TOOLPATHS {
            return Err(broken(format!("more than {MOST_TOOLPATHS} toolpaths")));
        }
        if self.all.iter().any(|r| r.id == id) {
            return Err(broken(format!("the toolpath {id} is defined twice")));
        }
        uuid(&start.required("uuid")?)?;
        let factor = positive("unitfactor", &start.required("unitfactor")?, false)?;
        let said = start.text("toolpathtype")?;
        let kind = Kind::of(said.as_deref()).ok_or_else(|| {
            broken(format!(
                "toolpathtype=\"{}\" is none of planar, 3axis, 6axis",
                said.unwrap_or_default()
            ))
        })?;
        self.all.push(Resource {
            id,
            kind,
            unit: factor * self.unit,
            profiles: Vec::new(),
            by_uuid: BTreeMap::new(),
            names: BTreeSet::new(),
            layers: Vec::new(),
            lasers: None,
        });
        Ok(())
    }

    fn layer(&mut self, start: &Start<'_, '_>) -> Result<(), Fault> {
        let path = start.required("path")?;
        let Some(part) = path.strip_prefix('/') else {
            return Err(broken(format!(
                "path=\"{path}\" does not begin with a slash"
            )));
        };
        let top = start.text("ztop")?;
        let top = top.map(|t| count("ztop", &t, 0)).transpose()?;
        let resource = self.last()?;
        if resource.layers.len() >= MOST_LAYERS {
            return Err(broken(format!("more than {MOST_LAYERS} layers")));
        }
        let plane = resource.kind == Kind::Planar;
        if plane != top.is_some() {
            return Err(broken(format!(
                "a layer of a {} toolpath {}",
                resource.kind.name(),
                if plane { "lacks ztop" } else { "has no ztop" }
            )));
        }
        let before = resource.layers.last().and_then(|l| l.top);
        if top < before {
            return Err(broken(format!(
                "ztop=\"{}\" lies below the layer before",
                top.unwrap_or_default()
            )));
        }
        let part = part.to_owned();
        resource.layers.push(LayerPath { part, top });
        Ok(())
    }
}

impl Visitor for Model {
    fn open(&mut self, element: Element, start: &Start<'_, '_>) -> Result<(), Fault> {
        match element {
            Element::Model => {
                let unit = start.text("unit")?;
                self.unit = unit_in_mm(unit.as_deref()).ok_or_else(|| {
                    broken(format!(
                        "unit=\"{}\" is none of micron, millimeter, centimeter, inch, foot, meter",
                        unit.unwrap_or_default()
                    ))
                })?;
                required(start)?;
            }
            Element::Layer => return Err(broken("the model part holds a layer")),
            Element::Toolpath => self.resource(start)?,
            Element::Sources => {
                let default = start.text("default")?;
                let default = default.map(|t| count("default", &t, 0)).transpose()?;
                self.last()?.lasers = Some(Lasers {
                    default,
                    ..Lasers::default()
                });
            }
            Element::Source | Element::SyncGroup => {
                let index = match element {
                    Element::Source => start.count("index", 0)?,
                    _ => start.count("id", 1)?,
                };
                let lasers = self.last()?.lasers.get_or_insert_default();
                let new = match element {
                    Element::Source => lasers.known.insert(index),
                    _ => lasers.groups.insert(index),
                };
                if !new {
                    return Err(broken(format!(
                        "a laser or group {index} is declared twice"
                    )));
                }
            }
            Element::Profile => {
                let profile = SaidProfile::read(start)?;
                let toolpath = self.last()?;
                let number = toolpath.profiles.len();
                if number >= MOST_PROFILES {
                    return Err(broken(format!("more than {MOST_PROFILES} profiles")));
                }
                let known = toolpath.by_uuid.insert(profile.uuid.clone(), number);
                if known.is_some() || !toolpath.names.insert(profile.name.clone()) {
                    return Err(broken(format!(
                        "the profile \"{}\" is defined twice",
                        profile.name
                    )));
                }
                toolpath.profiles.push(profile);
            }
            Element::Modifier => {
                let resource = self.last()?;
                let kind = resource.kind;
                if let Some(profile) = resource.profiles.last_mut() {
                    profile.modify(start, kind)?;
                }
            }
            Element::LayerPath => self.layer(start)?,
            Element::Build => {
                let id = start.said(Words::Toolpath, "toolpathid")?;
                self.wanted = id.map(|t| count("toolpathid", &t, 1)).transpose()?;
            }
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self, element: Element) -> Result<(), Fault> {
        if element == Element::Sources {
            let lasers = self.last()?.lasers.as_ref();
            let default = lasers.and_then(|l| l.default.filter(|d| !l.known.contains(d)));
            if let Some(default) = default {
                return Err(broken(format!(
                    "the default laser {default} is not declared"
                )));
            }
        }
        Ok(())
    }
}

/// Refuses required extensions that are not known here, by name.
fn required(start: &Start<'_, '_>) -> Result<(), Fault> {
    let all = start.text("requiredextensions")?.unwrap_or_default();
    for prefix in all.split_ascii_whitespace() {
        let declared = format!("xmlns:{prefix}");
        let found = start.element.try_get_attribute(declared.as_str());
        let Some(namespace) = found.map_err(|e| broken(e.to_string()))? else {
            return Err(broken(format!(
                "the required extension prefix `{prefix}` is not declared"
            )));
        };
        let namespace = namespace.value.as_ref();
        if !KNOWN.contains(&namespace) {
            let known = REFUSED.iter().find(|(word, _)| namespace.contains(word));
            return Err(Fault::Extension(known.map_or_else(
                || format!("`{prefix}` ({namespace})"),
                |(_, name)| format!("`{name}`"),
            )));
        }
    }
    Ok(())
}
