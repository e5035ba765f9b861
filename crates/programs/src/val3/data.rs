//! The data of a project (`.dtx`): points, joints, movement descriptors, from text and to text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use quick_xml::escape::escape;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::words::Val3Words;
use crate::collected::indexed;
use crate::orientation::{self, wpr_of_xyz, xyz_of_wpr};
use crate::parsed::{ParseError, decoded};
use crate::program::{Axis, Coordinates, Termination};
use crate::scan::{finite, tidy};
use crate::written::{fixed, short};

/// The first words of a configuration, in order, where they say one.
const CONFIG: [(&str, [&str; 2]); 3] = [
    ("shoulder", ["lefty", "righty"]),
    ("elbow", ["epositive", "enegative"]),
    ("wrist", ["wpositive", "wnegative"]),
];
/// The torch that stands, a frame of the world, and the part that the robot holds, a tool in the flange.
pub(super) const TORCH: &str = "fTorch";
/// See [`TORCH`].
pub(super) const PART: &str = "tHeld";
/// A limit that limits nothing.
const NO_LIMIT: &str = "9999";

/// How a movement is driven.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Descriptor {
    /// Share of what joints can do, %.
    pub(super) share: f64,
    /// Speed along the path, mm/s.
    pub(super) speed: f64,
    /// How fast the tool turns at the most, °/s, where it says so.
    pub(super) turns: Option<f64>,
    /// Share of the usual acceleration and deceleration, the lesser, %.
    pub(super) acceleration: f64,
    pub(super) termination: Termination,
}

/// Frames that lie in each other which are followed.
const DEEPEST: usize = 8;

/// A name without the index of an array's first element.
pub(super) fn whole(name: &str) -> String {
    tidy(name.trim_end_matches("[0]"))
}

type Attributes = BTreeMap<String, String>;

/// The data of a project.
#[derive(Debug, Default)]
pub(super) struct Data {
    /// Kind of each name, and its values by their keys.
    all: BTreeMap<String, (String, BTreeMap<u32, Attributes>)>,
}

fn attributes(element: &BytesStart<'_>) -> Attributes {
    let read = element.attributes().flatten();
    read.map(|a| (a.key.as_ref().to_owned(), a.value.into_owned()))
        .collect()
}

/// Whether a project (`.pjx`) counts lengths in inches.
pub fn in_inches(project: &[u8]) -> bool {
    let text = decoded(project);
    let mut reader = Reader::from_str(&text);
    while let Ok(event) = reader.read_event() {
        match &event {
            Event::Eof => break,
            Event::Start(e) | Event::Empty(e) if e.name().as_ref() == "Parameters" => {
                let said = attributes(e);
                let unit = said.get("millimeterUnit");
                return unit.is_some_and(|u| matches!(u.trim(), "false" | "0"));
            }
            _ => {}
        }
    }
    false
}

impl Data {
    /// Reads as much as is well formed.
    ///
    /// # Errors
    /// [`ParseError::Repeated`] where a name, or a value of one, stands twice: which of them counts is the controller's.
    pub(super) fn read(text: &str) -> Result<Self, ParseError> {
        let mut data = Data::default();
        let mut reader = Reader::from_str(text);
        let mut open: Option<String> = None;
        let mut size = None;
        while let Ok(event) = reader.read_event() {
            match &event {
                Event::Eof => break,
                Event::Start(e) | Event::Empty(e) => {
                    let mut said = attributes(e);
                    let tag = e.name();
                    if tag.as_ref() == "Data" {
                        let name = said.remove("name").unwrap_or_default();
                        let kind = said.remove("type").unwrap_or_default();
                        size = said.remove("size").and_then(|s| s.trim().parse().ok());
                        let values = (kind, BTreeMap::new());
                        if data.all.insert(name.clone(), values).is_some() {
                            return Err(ParseError::Repeated(name));
                        }
                        open = Some(name);
                    } else if tag.as_ref() == "Value"
                        && let Some((_, values)) = open.as_ref().and_then(|n| data.all.get_mut(n))
                        && let Some(key) = said.remove("key").and_then(|k| k.parse().ok())
                        // the controller has no place for what lies beyond
                        && size.is_none_or(|size: u32| key < size)
                        && values.insert(key, said).is_some()
                    {
                        let name = open.unwrap_or_default();
                        return Err(ParseError::Repeated(format!("{name}[{key}]")));
                    }
                }
                _ => {}
            }
        }
        Ok(data)
    }

    /// The value that `name[key]` means; `name` alone is its first.
    fn value(&self, reference: &str, kind: &str) -> Option<&Attributes> {
        let (name, key) = match reference.split_once('[') {
            Some((name, rest)) => (name, rest.strip_suffix(']')?.trim().parse().ok()?),
            None => (reference, 0),
        };
        let (own, values) = self.all.get(name.trim())?;
        (own == kind).then(|| values.get(&key))?
    }

    /// Where a point lies, and the name of its frame.
    pub(super) fn point(&self, reference: &str) -> Option<(Coordinates, String)> {
        let said = self.value(reference, "pointRx")?;
        let [x, y, z, rx, ry, rz] = numbers(said, ["x", "y", "z", "rx", "ry", "rz"])?;
        let words = CONFIG.map(|(key, known)| {
            let word = said.get(key).map(String::as_str);
            word.filter(|w| known.contains(w))
        });
        let config = match words {
            [Some(a), Some(b), Some(c)] => format!("{a},{b},{c}"),
            _ => String::new(),
        };
        let frame = said.get("fatherId").cloned().unwrap_or_default();
        let place = Coordinates::Cartesian {
            config,
            xyz: [x, y, z],
            wpr_degrees: wpr_of_xyz([rx, ry, rz])?,
            external: Vec::new(),
        };
        Some((place, frame))
    }

    /// Where a frame lies in the world (kind `frame`), or a tool in the flange (`tool`), through those that it lies in; else in words what is not
    /// known of that.
    pub(super) fn frame(&self, reference: &str, kind: &'static str) -> Result<Pose, String> {
        let (mut pose, mut name) = (Pose::IDENTITY, reference.to_owned());
        let reference = whole(reference);
        for _ in 0..DEEPEST {
            if matches!(whole(&name).as_str(), "world" | "flange") {
                return Ok(pose);
            }
            let said = self.value(&name, kind);
            let said = said.ok_or_else(|| format!("{reference}: no {kind} {name} in its data"))?;
            let own = placed(said).ok_or_else(|| format!("{reference}: {kind} {name}"))?;
            pose = own.then(pose);
            let father = said.get("fatherId");
            name.clone_from(father.ok_or_else(|| format!("{reference}: {name} has no father"))?);
        }
        Err(format!(
            "{reference}: it lies in itself, or deeper than in {DEEPEST} others"
        ))
    }

    /// Where a tool lies in the part, of those that stand for its points while the robot holds it.
    pub(super) fn held(&self, reference: &str) -> Option<Coordinates> {
        let said = self.value(reference, "tool")?;
        let father = said.get("fatherId").map(|name| whole(name));
        father.filter(|name| name == PART)?;
        let [x, y, z, rx, ry, rz] = numbers(said, ["x", "y", "z", "rx", "ry", "rz"])?;
        Some(Coordinates::Cartesian {
            config: String::new(),
            xyz: [x, y, z],
            wpr_degrees: wpr_of_xyz([rx, ry, rz])?,
            external: Vec::new(),
        })
    }

    /// Where joints stand.
    pub(super) fn joints(&self, reference: &str) -> Option<Coordinates> {
        let said = self.value(reference, "jointRx")?;
        let all: [f64; 6] = numbers(said, ["j1", "j2", "j3", "j4", "j5", "j6"])?;
        Some(Coordinates::Joint(Axis::joints(all)))
    }

    /// How a movement is driven.
    pub(super) fn descriptor(&self, reference: &str) -> Option<Descriptor> {
        let said = self.value(reference, "mdesc")?;
        let number = |key: &str, default: f64| match said.get(key) {
            Some(text) => finite(text),
            None => Some(default),
        };
        let (leave, reach) = (number("leave", 50.0)?, number("reach", 50.0)?);
        let blend = said.get("blend").map_or("off", String::as_str);
        let termination = match blend.to_ascii_lowercase().as_str() {
            "off" => Termination::Fine,
            "cartesian" if leave == reach && leave > 0.0 => Termination::Blend(leave),
            other => Termination::Other(format!("blend {other}")),
        };
        Some(Descriptor {
            share: number("vel", 100.0)?,
            speed: number("tmax", 99_999.0)?,
            turns: match said.get("rmax") {
                Some(text) => Some(finite(text)?).filter(|limit| *limit > 0.0),
                None => None,
            },
            acceleration: number("accel", 100.0)?.min(number("decel", 100.0)?),
            termination,
        })
    }
}

/// Where a frame or a tool lies in its father.
fn placed(said: &Attributes) -> Option<Pose> {
    let [x, y, z, rx, ry, rz] = numbers(said, ["x", "y", "z", "rx", "ry", "rz"])?;
    let wpr = wpr_of_xyz([rx, ry, rz])?;
    Some(orientation::pose(DVec3::new(x, y, z), wpr))
}

/// Finite numbers; 0 where they are not written.
fn numbers<const N: usize>(said: &Attributes, keys: [&str; N]) -> Option<[f64; N]> {
    let read = keys.map(|key| match said.get(key) {
        Some(text) => finite(text),
        None => Some(0.0),
    });
    let all: Option<Vec<f64>> = read.into_iter().collect();
    all?.try_into().ok()
}

/// The data of a program while it is written: each value once.
#[derive(Debug, Default)]
pub(super) struct Written {
    pub(super) points: Vec<String>,
    pub(super) joints: Vec<String>,
    pub(super) descriptors: Vec<String>,
    /// The torch in the part, where that moves it: tools of the part.
    pub(super) tools: Vec<String>,
}

/// Six numbers of a place, mm and deg.
fn six(position: [f64; 3], wpr_degrees: [f64; 3]) -> String {
    let [x, y, z] = position.map(|v| fixed(v, 3));
    let [rx, ry, rz] = xyz_of_wpr(wpr_degrees).map(|v| short(v, 8));
    format!("x=\"{x}\" y=\"{y}\" z=\"{z}\" rx=\"{rx}\" ry=\"{ry}\" rz=\"{rz}\"")
}

/// How the arm stands, behind the numbers of a place.
fn standing(config: &str) -> String {
    let mut text = String::new();
    if !config.is_empty() {
        for ((key, _), word) in CONFIG.iter().zip(config.split(',')) {
            // writing to a String cannot fail
            let _ = write!(text, " {key}=\"{}\"", escape(word.trim()));
        }
    }
    text
}

impl Written {
    /// The tool by which the part is led to the torch, and the point that it is led to: the torch itself, or where the tool is while the torch
    /// is at `via` of the part. Nothing for a place that has no words.
    pub(super) fn held(
        &mut self,
        to: &Coordinates,
        via: Option<&Coordinates>,
    ) -> Option<(String, String)> {
        let pose = |place: &Coordinates| match place {
            Coordinates::Cartesian {
                config,
                xyz,
                wpr_degrees,
                external,
            } if external.is_empty() => Some((config.clone(), *xyz, *wpr_degrees)),
            _ => None,
        };
        let (mut config, xyz, wpr) = pose(to)?;
        let tool = six(xyz, wpr) + &format!(" fatherId=\"{PART}[0]\"");
        let mut point = Pose::IDENTITY;
        if let Some(via) = via {
            let (of_via, at, turned) = pose(via)?;
            config = of_via;
            let via = orientation::pose(DVec3::from_array(at), turned);
            let to = orientation::pose(DVec3::from_array(xyz), wpr);
            point = via.inverse().then(to);
        }
        let turned = point.wpr().to_array().map(f64::to_degrees);
        let point = six(point.position.to_array(), turned)
            + &standing(&config)
            + &format!(" fatherId=\"{TORCH}[0]\"");
        let names = [
            ("tPart", &mut self.tools, tool),
            ("pMove", &mut self.points, point),
        ];
        let [tool, point] = names.map(|(name, all, text)| {
            if all.last() != Some(&text) {
                all.push(text);
            }
            format!("{name}[{}]", all.len() - 1)
        });
        Some((point, tool))
    }

    /// The name of a place; nothing for one that has no words.
    pub(super) fn place(&mut self, coordinates: &Coordinates) -> Option<String> {
        match coordinates {
            Coordinates::Cartesian {
                config,
                xyz,
                wpr_degrees,
                external,
            } if external.is_empty() => {
                let text = six(*xyz, *wpr_degrees) + &standing(config) + " fatherId=\"fPart[0]\"";
                // neighbours at most: a plan does not come back to a point, and a search would take long
                if self.points.last() != Some(&text) {
                    self.points.push(text);
                }
                Some(format!("pMove[{}]", self.points.len() - 1))
            }
            Coordinates::Joint(axes) if axes.len() == 6 => {
                let all = axes.iter().enumerate();
                let all = all.map(|(i, a)| format!("j{}=\"{}\"", i + 1, short(a.value, 5)));
                let text = all.collect::<Vec<_>>().join(" ");
                Some(format!("jMove[{}]", indexed(&mut self.joints, text)))
            }
            _ => None,
        }
    }

    /// The name of a way to drive; nothing where there are no words for how it ends.
    pub(super) fn descriptor(&mut self, descriptor: &Descriptor) -> Option<String> {
        let (blend, distance) = match descriptor.termination {
            Termination::Fine => ("off", 0.0),
            Termination::Blend(distance) => ("Cartesian", distance),
            _ => return None,
        };
        let distance = short(distance, 3);
        let text = format!(
            "accel=\"100\" vel=\"{}\" decel=\"100\" tmax=\"{}\" rmax=\"{NO_LIMIT}\" blend=\"{blend}\" leave=\"{distance}\" reach=\"{distance}\"",
            short(descriptor.share, 2),
            short(descriptor.speed, 3)
        );
        Some(format!("mMove[{}]", indexed(&mut self.descriptors, text)))
    }

    /// The file; of a torch that stands, or of one that the robot holds.
    pub(super) fn file(&self, words: &Val3Words, stands: bool) -> String {
        let frame = |at: &[meltpath_base::Length; 3], turned: &[meltpath_base::Angle; 3]| {
            let [x, y, z] = at.map(|v| short(v.0, 3));
            let [rx, ry, rz] = turned.map(|v| short(v.0.to_degrees(), 4));
            format!("x=\"{x}\" y=\"{y}\" z=\"{z}\" rx=\"{rx}\" ry=\"{ry}\" rz=\"{rz}\"")
        };
        let part = frame(&words.part_position, &words.part_angles);
        let torch = frame(&words.tool_position, &words.tool_angles);
        let mut text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
            <Database xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xmlns=\"http://www.staubli.com/robotics/VAL3/Data/2\">\n  <Datas>\n"
            .to_owned();
        let mut data = |name: &str, kind: &str, values: &[String]| {
            if values.is_empty() {
                return;
            }
            let (name, size) = (escape(name), values.len());
            // writing to a String cannot fail
            let _ = writeln!(
                text,
                "    <Data name=\"{name}\" access=\"private\" xsi:type=\"array\" type=\"{kind}\" size=\"{size}\">"
            );
            for (key, value) in values.iter().enumerate() {
                let _ = writeln!(text, "      <Value key=\"{key}\" {value} />");
            }
            text += "    </Data>\n";
        };
        let [in_world, in_flange] = if stands {
            [(TORCH, torch), (PART, part)]
        } else {
            [("fPart", part), ("tTorch", torch)]
        };
        let in_father = |at: &str, father: &str| format!("{at} fatherId=\"{father}[0]\"");
        data(in_world.0, "frame", &[in_father(&in_world.1, "world")]);
        data(in_flange.0, "tool", &[in_father(&in_flange.1, "flange")]);
        data("tPart", "tool", &self.tools);
        for output in words.outputs.iter() {
            let value = match output.link.as_ref() {
                Some(link) => format!("link=\"{}\"", escape(link.as_str())),
                None => "value=\"0\"".to_owned(),
            };
            data(&output.name, (*output.kind).word(), &[value]);
        }
        data("mMove", "mdesc", &self.descriptors);
        data("jMove", "jointRx", &self.joints);
        data("pMove", "pointRx", &self.points);
        text + "  </Datas>\n</Database>\n"
    }
}
