//! Toolpaths to and from the native container, layer by layer: a head with names, profiles and weaves, one container a layer with
//! points and values as columns, and an end that counts the layers. Lossless for all three processes.

use std::io::{self, Read, Write};

use meltpath_base::container::{Column as Stored, Container, ContainerError};
use meltpath_geometry::math::DVec3;
use serde::{Deserialize, Serialize};

use crate::column::Column;
use crate::layer::{Entry, Layer};
use crate::toolpath::{Profile, Toolpath};
use crate::vocabulary::{Channel, Event, Neighbour, PassHead, PassId, Role, Side, Weave};

/// Schema of the head of a stored toolpath.
pub const TOOLPATH_SCHEMA: &str = "meltpath-toolpath/2";
/// Schema of each of its layers.
const LAYER_SCHEMA: &str = "meltpath-toolpath-layer/2";
/// Schema of its end.
const END_SCHEMA: &str = "meltpath-toolpath-end/2";

#[derive(Serialize, Deserialize)]
struct HeadMeta {
    build: String,
    parts: Vec<(u32, String)>,
    profiles: Vec<Profile>,
    /// Left out where nothing weaves, as in files from before there were any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    weaves: Vec<Weave>,
}

#[derive(Serialize, Deserialize)]
struct LayerMeta {
    number: u32,
    /// Number of external axes.
    external: usize,
}

#[derive(Serialize, Deserialize)]
struct EndMeta {
    layers: u64,
}

const CHANNELS: [&str; Channel::ALL.len()] = ["speed", "wire_feed", "power", "spot", "dwell"];
/// The kind of event that [`Event::Weave`] is.
const WEAVE: u8 = 2;
const AXES: [&str; 3] = ["axis_x", "axis_y", "axis_z"];

/// Writes a toolpath layer by layer.
#[derive(Debug)]
pub struct Writer<W: Write> {
    to: W,
    layers: u64,
}

impl<W: Write> Writer<W> {
    /// Writes the head: build, parts, profiles and weaves of `head`; its layers are left out.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(mut to: W, head: &Toolpath) -> io::Result<Self> {
        let meta = HeadMeta {
            build: head.build.clone(),
            parts: head.parts.clone().into_iter().collect(),
            profiles: head.profiles.clone(),
            weaves: head.weaves.clone(),
        };
        container(TOOLPATH_SCHEMA, &meta)?.write(&mut to)?;
        Ok(Writer { to, layers: 0 })
    }

    /// Writes the next layer.
    ///
    /// # Errors
    /// What the writer says.
    pub fn layer(&mut self, layer: &Layer) -> io::Result<()> {
        self.layers += 1;
        stored(layer)?.write(&mut self.to)
    }

    /// Writes the end, without which no reader takes the toolpath for whole.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(mut self) -> io::Result<()> {
        let meta = EndMeta {
            layers: self.layers,
        };
        container(END_SCHEMA, &meta)?.write(&mut self.to)?;
        self.to.flush()
    }
}

/// Writes a whole toolpath.
///
/// # Errors
/// What the writer says.
pub fn write(toolpath: &Toolpath, to: &mut dyn Write) -> io::Result<()> {
    let mut writer = Writer::new(to, toolpath)?;
    for layer in &toolpath.layers {
        writer.layer(layer)?;
    }
    writer.finish()
}

/// Reads a toolpath layer by layer: an iterator over its layers, each sound in itself.
#[derive(Debug)]
pub struct Reader<R: Read> {
    from: R,
    /// Build, parts, profiles and weaves; no layers.
    pub head: Toolpath,
    read: u64,
    over: bool,
}

impl<R: Read> Reader<R> {
    /// Reads the head.
    ///
    /// # Errors
    /// [`ContainerError`] where this is no toolpath of this version.
    pub fn new(mut from: R) -> Result<Self, ContainerError> {
        let found = Container::read(&mut from)?;
        if found.schema != TOOLPATH_SCHEMA {
            return Err(ContainerError::Damaged(format!(
                "it holds `{}`, not `{TOOLPATH_SCHEMA}`",
                found.schema
            )));
        }
        let meta: HeadMeta = meta(found)?;
        Ok(Reader {
            from,
            head: Toolpath {
                build: meta.build,
                parts: meta.parts.into_iter().collect(),
                profiles: meta.profiles,
                weaves: meta.weaves,
                layers: Vec::new(),
            },
            read: 0,
            over: false,
        })
    }

    fn next_layer(&mut self) -> Result<Option<Layer>, ContainerError> {
        let found = Container::read(&mut self.from)?;
        if found.schema == END_SCHEMA {
            let end: EndMeta = meta(found)?;
            return if end.layers == self.read {
                Ok(None)
            } else {
                Err(ContainerError::Damaged(format!(
                    "it ends after {} of {} layers",
                    self.read, end.layers
                )))
            };
        }
        self.read += 1;
        let unsound = |what| ContainerError::Damaged(format!("its layer {}: {what}", self.read));
        if found.schema != LAYER_SCHEMA {
            return Err(unsound(format!("`{}` is no layer", found.schema)));
        }
        let layer = layer_of(&found)?;
        let sound = layer.sanity_check();
        sound
            .and_then(|()| self.head.check_references(&layer))
            .map_err(|e| unsound(e.to_string()))?;
        Ok(Some(layer))
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Layer, ContainerError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over {
            return None;
        }
        let next = self.next_layer().transpose();
        self.over = !matches!(next, Some(Ok(_)));
        next
    }
}

/// Reads a whole toolpath.
///
/// # Errors
/// [`ContainerError`] where it is of another schema, cut off or unsound.
pub fn read(from: &mut dyn Read) -> Result<Toolpath, ContainerError> {
    let mut reader = Reader::new(from)?;
    let layers = reader.by_ref().collect::<Result<_, _>>()?;
    Ok(Toolpath {
        layers,
        ..reader.head
    })
}

fn container(schema: &str, meta: &impl Serialize) -> io::Result<Container> {
    let mut container = Container::new(schema);
    container.meta = serde_json::to_value(meta)?;
    Ok(container)
}

fn meta<T: serde::de::DeserializeOwned>(container: Container) -> Result<T, ContainerError> {
    serde_json::from_value(container.meta)
        .map_err(|e| ContainerError::Damaged(format!("its toolpath index: {e}")))
}

fn flat(vectors: impl Iterator<Item = DVec3>) -> Stored {
    Stored::F64(vectors.flat_map(|v| v.to_array()).collect())
}

/// The moves, points or passes that the entries of a list belong to.
fn numbers_of<T>(list: &[(u32, T)]) -> Stored {
    Stored::U32(list.iter().map(|e| e.0).collect())
}

fn stored(layer: &Layer) -> io::Result<Container> {
    let meta = LayerMeta {
        number: layer.number,
        external: layer.external.len(),
    };
    let mut to = container(LAYER_SCHEMA, &meta)?;
    let mut put = |name: &str, column: Stored| {
        to.columns.insert(name.to_owned(), column);
    };
    let numbers = |of: fn(&Entry) -> u32| Stored::U32(layer.entries.iter().map(of).collect());
    put("height", Stored::F64(vec![layer.height]));
    put("id", numbers(|e| e.head.id.0));
    put("part", numbers(|e| e.head.part));
    put("entity", numbers(|e| e.head.entity));
    put("bead", numbers(|e| e.head.bead));
    put("profile", numbers(|e| u32::from(e.head.profile)));
    put("first_point", numbers(|e| e.first));
    let roles = layer.entries.iter().map(|e| e.head.role as u8);
    put("role", Stored::U8(roles.collect()));
    put("points", flat(layer.points.iter().copied()));
    put("arc_move", numbers_of(&layer.arcs));
    put("arc_via", flat(layer.arcs.iter().map(|a| a.1)));
    let times = layer.spots.iter().map(|s| s.1).collect();
    put("spot_move", numbers_of(&layer.spots));
    put("spot_time", Stored::F64(times));
    let mut values = |name: &str, column: &Column| {
        put(name, Stored::F64(column.values().to_vec()));
    };
    for (name, column) in CHANNELS.iter().zip(&layer.channels) {
        values(name, column);
    }
    for (name, column) in AXES.iter().zip(&layer.axes) {
        values(name, column);
    }
    values("turn", &layer.turns);
    for (k, column) in layer.external.iter().enumerate() {
        values(&format!("external_{k}"), column);
    }
    let events = &layer.events;
    let weaves = events.iter().map(|(_, Event::Weave(number))| *number);
    put("event_point", numbers_of(events));
    put("event_kind", Stored::U8(vec![WEAVE; events.len()]));
    put("event_value", Stored::U32(weaves.collect()));
    put_neighbours(&mut to, &layer.neighbours);
    Ok(to)
}

fn put_neighbours(to: &mut Container, neighbours: &[(u32, Neighbour)]) {
    let whole = |of: fn(&(u32, Neighbour)) -> u32| neighbours.iter().map(of).collect();
    let real = |of: fn(&Neighbour) -> f64| neighbours.iter().map(|n| of(&n.1)).collect();
    let sides = neighbours
        .iter()
        .map(|n| u8::from(n.1.side == Side::Right))
        .collect();
    for (name, column) in [
        ("neighbour_of", numbers_of(neighbours)),
        ("neighbour_pass", Stored::U32(whole(|n| n.1.pass.0))),
        ("neighbour_layer", Stored::U32(whole(|n| n.1.layer))),
        ("neighbour_side", Stored::U8(sides)),
        ("neighbour_from", Stored::F64(real(|n| n.from))),
        ("neighbour_to", Stored::F64(real(|n| n.to))),
        ("neighbour_distance", Stored::F64(real(|n| n.distance))),
    ] {
        to.columns.insert(name.to_owned(), column);
    }
}

fn event(code: (u8, u32)) -> Result<Event, ContainerError> {
    match code {
        (WEAVE, number) => Ok(Event::Weave(number)),
        (kind, _) => Err(unknown("event", kind)),
    }
}

fn unknown(what: &str, code: u8) -> ContainerError {
    ContainerError::Damaged(format!("{what} {code} is unknown"))
}

fn vectors(values: &[f64]) -> Vec<DVec3> {
    let all = values.as_chunks::<3>().0.iter();
    all.map(|&v| DVec3::from_array(v)).collect()
}

/// Both columns as one list, where they are equally long.
fn paired<A: Copy, B>(
    name: &str,
    a: &[A],
    b: impl IntoIterator<Item = B, IntoIter: ExactSizeIterator>,
) -> Result<Vec<(A, B)>, ContainerError> {
    let b = b.into_iter();
    if a.len() == b.len() {
        return Ok(a.iter().copied().zip(b).collect());
    }
    Err(ContainerError::Damaged(format!(
        "column `{name}` has {} entries for {}",
        a.len(),
        b.len()
    )))
}

fn layer_of(from: &Container) -> Result<Layer, ContainerError> {
    let values = |name: &str| {
        let stored = from.f64(name);
        stored.map(|v| Column::from_values(v.to_vec()))
    };
    let LayerMeta { number, external } = serde_json::from_value(from.meta.clone())
        .map_err(|e| ContainerError::Damaged(format!("its layer's index: {e}")))?;
    let height = from.f64("height")?.first().copied();
    let [mut channels, mut axes] = [const { Vec::new() }; 2];
    for name in CHANNELS {
        channels.push(values(name)?);
    }
    for name in AXES {
        axes.push(values(name)?);
    }
    let odd = |_| ContainerError::Damaged("a column of a layer is missing".to_owned());
    let coded = paired(
        "event_kind",
        from.u8("event_kind")?,
        from.u32("event_value")?.iter().copied(),
    )?;
    let events = coded
        .into_iter()
        .map(event)
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Layer {
        number,
        height: height.ok_or_else(|| ContainerError::Column("height".to_owned()))?,
        entries: entries_of(from)?,
        points: vectors(from.f64("points")?),
        arcs: paired(
            "arc_move",
            from.u32("arc_move")?,
            vectors(from.f64("arc_via")?),
        )?,
        spots: paired(
            "spot_move",
            from.u32("spot_move")?,
            from.f64("spot_time")?.iter().copied(),
        )?,
        channels: channels.try_into().map_err(odd)?,
        axes: axes.try_into().map_err(odd)?,
        turns: values("turn")?,
        external: (0..external)
            .map(|k| values(&format!("external_{k}")))
            .collect::<Result<_, _>>()?,
        events: paired("event_point", from.u32("event_point")?, events)?,
        neighbours: neighbours_of(from)?,
    })
}

/// Columns that tell of the same things have the same length.
fn alike(what: &str, length: usize, others: &[usize]) -> Result<(), ContainerError> {
    if others.iter().all(|n| *n == length) {
        return Ok(());
    }
    let message = format!("its {what}' columns differ in length");
    Err(ContainerError::Damaged(message))
}

fn entries_of(from: &Container) -> Result<Vec<Entry>, ContainerError> {
    let id = from.u32("id")?;
    let columns = ["part", "entity", "bead", "profile", "first_point"].map(|name| from.u32(name));
    let [part, entity, bead, profile, first] = columns;
    let (part, entity, bead, profile, first) = (part?, entity?, bead?, profile?, first?);
    let role = from.u8("role")?;
    let others = [&part, &entity, &bead, &profile, &first].map(|c| c.len());
    alike("passes", id.len(), &[&others[..], &[role.len()]].concat())?;
    let entry = |k: usize| {
        let role = Role::ALL.get(usize::from(role[k])).copied();
        Ok(Entry {
            head: PassHead {
                id: PassId(id[k]),
                part: part[k],
                entity: entity[k],
                bead: bead[k],
                profile: u16::try_from(profile[k]).map_err(|_| {
                    ContainerError::Damaged(format!("profile {} is unknown", profile[k]))
                })?,
                role: role.ok_or_else(|| unknown("role", from.u8("role").map_or(0, |r| r[k])))?,
            },
            first: first[k],
        })
    };
    (0..id.len()).map(entry).collect()
}

fn neighbours_of(from: &Container) -> Result<Vec<(u32, Neighbour)>, ContainerError> {
    let of = from.u32("neighbour_of")?;
    let (pass, layer) = (from.u32("neighbour_pass")?, from.u32("neighbour_layer")?);
    let (side, distance) = (from.u8("neighbour_side")?, from.f64("neighbour_distance")?);
    let (begin, end) = (from.f64("neighbour_from")?, from.f64("neighbour_to")?);
    let (whole, real) = ([&pass, &layer], [&distance, &begin, &end]);
    let (whole, real) = (whole.map(|c| c.len()), real.map(|c| c.len()));
    alike(
        "neighbours",
        of.len(),
        &[&whole[..], &real, &[side.len()]].concat(),
    )?;
    let neighbour = |k: usize| {
        let side = match side[k] {
            0 => Side::Left,
            1 => Side::Right,
            other => return Err(unknown("side", other)),
        };
        Ok((
            of[k],
            Neighbour {
                from: begin[k],
                to: end[k],
                side,
                pass: PassId(pass[k]),
                distance: distance[k],
                layer: layer[k],
            },
        ))
    };
    (0..of.len()).map(neighbour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vocabulary::{Move, WeaveShape};

    /// A woven bead on a leaning torch and a positioner, a laser's vectors, an electron beam's spots.
    fn three_processes() -> Toolpath {
        let head = |id: u32, role: Role, profile: u16| PassHead {
            id: PassId(id),
            part: id % 2,
            entity: 4,
            bead: id,
            profile,
            role,
        };
        let mut wire = Layer::new(1, 0.0);
        let mut bead = wire.begin(head(1, Role::Contour, 0), DVec3::ZERO);
        bead.axis(DVec3::Z).turn(0.25).external(0, 15.0);
        bead.event(Event::Weave(2));
        bead.line_to(DVec3::X / 3.0).set(Channel::WireFeed, 133.3);
        let via = DVec3::new(0.1, 0.7, 0.0);
        bead.go(Move::Arc { via }, DVec3::Y);
        bead.axis(DVec3::new(0.6, 0.0, 0.8)).event(Event::Weave(0));
        let beside = Neighbour {
            from: 0.1,
            to: 1.0 / 7.0,
            side: Side::Right,
            pass: PassId(9),
            distance: 4.6,
            layer: 2,
        };
        wire.set_neighbours(vec![(0, beside)]);
        let mut laser = Layer::new(2, 0.03);
        let roles = [
            Role::Jump,
            Role::Run,
            Role::Fill,
            Role::Run,
            Role::Connection,
        ];
        for (id, role) in roles.into_iter().enumerate() {
            let from = DVec3::X * id as f64;
            let mut vector = laser.begin(head(id as u32, role, 1), from);
            vector.line_to(from + DVec3::X).set(Channel::Speed, 1200.0);
            vector.set(Channel::Dwell, 1e-4 * id as f64);
        }
        let mut beam = Layer::new(2, 0.05);
        let mut spots = beam.begin(head(3, Role::Fill, 1), DVec3::ZERO);
        spots.go(Move::Spot { time: 0.25e-3 }, DVec3::ZERO);
        spots.go(Move::Spot { time: 0.5e-3 }, DVec3::X);
        spots.set(Channel::Power, 250.0).set(Channel::Spot, 0.31);
        let profile = |name: &str| Profile {
            name: name.to_owned(),
            speed: 12.5,
            spot: 0.4,
            ..Profile::default()
        };
        let weave = |shape| Weave {
            shape,
            frequency: 10.0 / 3.0,
            amplitude: 1.7,
            dwell: [0.1, 1.0 / 7.0],
        };
        Toolpath {
            build: "plate 12".to_owned(),
            parts: [(0, "bracket".to_owned()), (1, "lever".to_owned())].into(),
            profiles: vec![profile("bead"), profile("hatch")],
            weaves: vec![weave(WeaveShape::Sine), weave(WeaveShape::Triangle)],
            layers: vec![wire, laser, beam],
        }
    }

    fn bytes(toolpath: &Toolpath) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(toolpath, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn all_three_processes_survive_storage_to_the_bit() {
        let toolpath = three_processes();
        toolpath.sanity_check().unwrap();
        let stored = bytes(&toolpath);
        assert_eq!(read(&mut &stored[..]).unwrap(), toolpath);
        // files from before the path held its weaves
        let still = Toolpath {
            weaves: Vec::new(),
            layers: toolpath.layers[1..].to_vec(),
            ..three_processes()
        };
        assert!(!String::from_utf8_lossy(&bytes(&still)).contains("weaves"));
        assert_eq!(read(&mut &bytes(&still)[..]).unwrap(), still);
        // one layer after the other
        let mut reader = Reader::new(&stored[..]).unwrap();
        assert!(reader.head.layers.is_empty() && reader.head.parts.len() == 2);
        assert_eq!(reader.next().unwrap().unwrap(), toolpath.layers[0]);
        assert_eq!(reader.count(), 2);
    }

    #[test]
    fn a_toolpath_cut_off_anywhere_is_an_error() {
        let stored = bytes(&three_processes());
        for end in (0..stored.len()).step_by(97) {
            assert!(read(&mut &stored[..end]).is_err(), "{end}");
        }
        let mut short = Vec::new();
        let toolpath = three_processes();
        let mut writer = Writer::new(&mut short, &toolpath).unwrap();
        writer.layer(&toolpath.layers[0]).unwrap();
        assert!(read(&mut &short[..]).is_err(), "without its end");
    }

    #[test]
    fn broken_promises_of_a_toolpath_are_found() {
        let broken = |breaking: &dyn Fn(&mut Toolpath)| {
            let mut toolpath = three_processes();
            breaking(&mut toolpath);
            toolpath.sanity_check().unwrap_err().to_string()
        };
        assert!(broken(&|t| t.profiles[1].dwell = -1.0).contains("profile has a value"));
        assert!(broken(&|t| t.profiles[0].power = f64::INFINITY).contains("profile has a value"));
        assert!(broken(&|t| t.profiles.truncate(1)).contains("profile that is not there"));
        assert!(broken(&|t| t.weaves[1].dwell[0] = -0.1).contains("weave has a value"));
        assert!(broken(&|t| t.weaves[0].frequency = f64::NAN).contains("weave has a value"));
        assert!(broken(&|t| t.weaves.truncate(1)).contains("weave that is not there"));
        assert!(broken(&|t| t.layers[2].height = f64::NAN).contains("height"));
        assert_eq!(three_processes().pass_count(), 7);
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let refused = |change: &dyn Fn(&mut Toolpath)| {
            let mut toolpath = three_processes();
            change(&mut toolpath);
            read(&mut &bytes(&toolpath)[..]).unwrap_err().to_string()
        };
        let unsound = refused(&|t| t.layers[1].points[1].y = f64::NAN);
        assert!(
            unsound.contains("layer 2") && unsound.contains("finite"),
            "{unsound}"
        );
        assert!(refused(&|t| t.profiles.truncate(1)).contains("profile that is not there"));
        assert!(refused(&|t| t.weaves.truncate(1)).contains("weave that is not there"));
        let mut other = Vec::new();
        Container::new("meltpath-toolpath/1")
            .write(&mut other)
            .unwrap();
        let old = read(&mut &other[..]).unwrap_err().to_string();
        assert!(
            old.contains("meltpath-toolpath/1") && old.contains("make it again"),
            "{old}"
        );
    }
}
