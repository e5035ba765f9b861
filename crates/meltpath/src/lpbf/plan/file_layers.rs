//! Layers that other software made, from their file: one in memory at a time, each time they are wanted.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};

use meltpath_base::number::significant;
use meltpath_base::{Place, Reporter};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_programs::toolpath_3mf::{Found, Kind};
use meltpath_programs::vectors::UnlitPower;
use meltpath_programs::{cli, toolpath_3mf, vectors};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::job::Planned;
use meltpath_toolpath::Layer;

use super::thickness;
use crate::job::lpbf::LayersTable;

/// The layers of a file that are executed.
#[derive(Debug, Clone, PartialEq)]
pub struct FileLayers {
    path: PathBuf,
    range: [u32; 2],
    /// The point of the file that lies at the centre of the field, mm.
    origin: DVec3,
    /// Layers of the file up to the last one that is executed.
    until: usize,
    /// The only one that is executed, as the head meets it.
    only: Option<Layer>,
    /// What shapes the marks of the file and is not followed.
    pub(in crate::lpbf) not_followed: Vec<String>,
    /// How many are executed, and how many the file has.
    pub(in crate::lpbf) counts: [usize; 2],
    /// The numbers of the first and the last one that are executed.
    pub(in crate::lpbf) numbers: [u32; 2],
    /// How thick those are that are executed, mm, by their numbers; `None` where the file does not tell it.
    pub(in crate::lpbf) thickness: BTreeMap<u32, Option<f64>>,
}

/// What to do about what is not followed of a file.
pub(in crate::lpbf) const LEFT_TO_THE_JOB: &str =
    "export the file without it, and say it in the recipe or the head's file";

type Read = Box<dyn Iterator<Item = Result<Layer, String>> + Send>;

/// What is not followed of a file.
enum NotFollowed {
    /// Of a 3MF toolpath.
    Toolpath(Found),
    /// Powers of vectors on which the laser is off.
    Unlit(UnlitPower),
}

/// The layers of a vector list; what is not followed of them goes on.
struct List(vectors::Reader<BufReader<File>>, Sender<NotFollowed>);

impl Iterator for List {
    type Item = Result<Layer, String>;

    fn next(&mut self) -> Option<Self::Item> {
        let layer = self.0.next();
        if layer.is_none() {
            // who does not listen has heard it before
            let _ = self.1.send(NotFollowed::Unlit(self.0.unlit_power()));
        }
        Some(layer?.map_err(|e| e.to_string()))
    }
}

/// The layers of a 3MF toolpath; what is not followed of them goes on.
struct Told(toolpath_3mf::Reader<BufReader<File>>, Sender<NotFollowed>);

impl Iterator for Told {
    type Item = Result<Layer, String>;

    fn next(&mut self) -> Option<Self::Item> {
        let layer = self.0.next()?;
        for found in self.0.found() {
            // who does not listen has heard it before
            let _ = self.1.send(NotFollowed::Toolpath(found));
        }
        Some(layer.map_err(|e| e.to_string()))
    }
}

/// The layers of a file, one after the other; what is wrong in words. What is not followed of them is `told`.
fn layers(path: &Path, told: Sender<NotFollowed>) -> Result<Read, String> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let from = File::open(path).map_err(|e| format!("cannot read the layers: {e}"))?;
    let from = BufReader::new(from);
    match extension.as_str() {
        "cli" => {
            let layers = cli::Reader::new(from).map_err(|e| e.to_string())?;
            Ok(Box::new(layers.map(|l| l.map_err(|e| e.to_string()))))
        }
        "csv" => {
            let layers = vectors::Reader::new(from).map_err(|e| e.to_string())?;
            Ok(Box::new(List(layers, told)))
        }
        "3mf" => {
            let layers = toolpath_3mf::Reader::new(from).map_err(|e| e.to_string())?;
            let planar = match layers.kind() {
                Kind::Planar => Ok(layers),
                other => Err(format!(
                    "the toolpath is {}: a scan head marks planar ones; `meltpath simulate` takes this one",
                    other.name()
                )),
            }?;
            Ok(Box::new(Told(planar, told)))
        }
        other => Err(format!(
            "it ends in \"{other}\": layers are read from .cli files, from vector lists (.csv) and from 3MF toolpaths (.3mf)"
        )),
    }
}

/// The heights of layers as they come.
#[derive(Debug, Default)]
struct Heights {
    /// The number and the height of the last one, mm.
    before: Option<(u32, f64)>,
}

impl Heights {
    /// Tells a layer that lies no higher than the one before it. Where nothing is said of heights they are all zero.
    fn take(&mut self, layer: &Layer, shown: &str, reporter: &Reporter) {
        let (number, height) = (layer.number, layer.height);
        let Some((last, before)) = self.before.replace((number, height)) else {
            return;
        };
        if height > before || (height == 0.0 && before == 0.0) {
            return;
        }
        let place = Place {
            file: Some(shown.to_owned()),
            ..Place::layer(number)
        };
        reporter.warn_at(
            "layers-out-of-order",
            format!(
                "layer {number}, at {} mm, lies no higher than layer {last} before it, at {} mm",
                significant(height, 4),
                significant(before, 4)
            ),
            place,
            "export the layers once each, from the lowest up",
        );
    }
}

/// Tells powers of vectors on which the laser is off.
fn tell_unlit(unlit: UnlitPower, shown: &str, reporter: &Reporter) {
    let UnlitPower { line, lines } = unlit;
    if lines == 0 {
        return;
    }
    let place = Place {
        file: Some(shown.to_owned()),
        line: u32::try_from(line).ok(),
        ..Place::default()
    };
    reporter.warn_at(
        "power-without-light",
        format!(
            "power_W of {lines} vectors that do not mark, the first on line {line}, is passed over: on a jump, a connection or a run the laser is off"
        ),
        place,
        "leave power_W blank there; where the laser is to be on, write a contour or a fill",
    );
}

impl FileLayers {
    /// The line of a vector list whose vector of a layer ends at a place of the field, mm; `None` in other files.
    pub(in crate::lpbf) fn line_of(&self, layer: u32, at: DVec3) -> Option<usize> {
        let extension = self.path.extension()?.to_string_lossy().to_lowercase();
        if extension != "csv" {
            return None;
        }
        let from = BufReader::new(File::open(&self.path).ok()?);
        vectors::line_of(from, layer, at + self.origin)
    }

    /// Looks through a layer file (`.cli`), vector list (`.csv`) or planar 3MF toolpath (`.3mf`) and chooses its layers. What is wrong comes back
    /// in words; what is not followed is a warning.
    ///
    /// # Errors
    /// A message that names the file, the place in it and what to write.
    pub fn choose(
        path: &Path,
        shown: &str,
        table: &LayersTable,
        reporter: &Reporter,
    ) -> Result<Self, String> {
        let named = |what: String| format!("\"{shown}\": {what}");
        let (tell, told) = channel();
        let (mut count, mut chosen, mut until, mut longest) = (0, 0, 0, 0.0);
        let mut all: Option<[u32; 2]> = None;
        let mut numbers = [0; 2];
        let mut only: Option<Layer> = None;
        let mut heights = Heights::default();
        let (mut stack, mut marking) = (Vec::new(), Vec::new());
        for layer in layers(path, tell).map_err(named)? {
            let layer = layer.map_err(named)?;
            let number = layer.number;
            heights.take(&layer, shown, reporter);
            count += 1;
            stack.push(layer.height);
            all = Some([
                all.map_or(number, |n| n[0].min(number)),
                all.map_or(number, |n| n[1].max(number)),
            ]);
            let marked = layer.deposited_length();
            let wanted = match *table.range {
                None => marked > longest,
                Some([first, last]) => marked > 0.0 && (first..=last).contains(&number),
            };
            longest = marked.max(longest);
            if wanted {
                // without a range the longest layer so far takes the place of the one before
                chosen = if table.range.is_some() { chosen + 1 } else { 1 };
                marking.truncate(chosen - 1);
                marking.push((number, count - 1));
                numbers = [if chosen == 1 { number } else { numbers[0] }, number];
                until = count;
                only = (chosen == 1).then_some(layer);
            }
        }
        let mut not_followed = Vec::new();
        for found in told {
            let found = match found {
                NotFollowed::Toolpath(found) => found,
                NotFollowed::Unlit(unlit) => {
                    tell_unlit(unlit, shown, reporter);
                    continue;
                }
            };
            let said = format!("profile {}: {}", found.profile, found.what);
            let place = Place {
                file: Some(format!("{shown}: {}", found.part)),
                line: Some(found.segment),
                ..Place::default()
            };
            reporter.warn_at(
                "toolpath-not-followed",
                said.clone(),
                place,
                LEFT_TO_THE_JOB,
            );
            if found.shapes {
                not_followed.push(said);
            }
        }
        if longest <= 0.0 {
            return Err(format!(
                "\"{shown}\" marks nothing in any of its {count} layers"
            ));
        }
        let [first, last] = table.range.unwrap_or_default();
        let [lowest, highest] = all.unwrap_or_default();
        if table.range.is_some() && (first < lowest || last > highest) {
            return Err(format!(
                "the layers {first} to {last} are not all in \"{shown}\": it holds the layers {lowest} to {highest}; write [layers] range within them"
            ));
        }
        if chosen == 0 {
            return Err(format!(
                "none of the layers {first} to {last} of \"{shown}\" marks anything; it holds the layers {lowest} to {highest}"
            ));
        }
        let origin = DVec2::from_array(table.origin.map(|l| l.0)).extend(0.0);
        if let Some(layer) = &mut only {
            layer.translate(-origin);
        }
        Ok(FileLayers {
            path: path.to_path_buf(),
            range: table.range.unwrap_or(numbers),
            origin,
            until,
            only,
            not_followed,
            counts: [chosen, count],
            numbers,
            thickness: marking
                .into_iter()
                .map(|(number, index)| (number, thickness::of(&stack, index)))
                .collect(),
        })
    }

    /// All layers of the file that mark, whether they are executed or not.
    ///
    /// # Errors
    /// [`HeadError::Layer`] of a file that cannot be read any more.
    pub(in crate::lpbf) fn all(&self) -> Result<Planned<'_>, HeadError> {
        let all = layers(&self.path, channel().0).map_err(HeadError::Layer)?;
        Ok(Box::new(all.filter_map(move |layer| match layer {
            Err(e) => Some(Err(HeadError::Layer(e))),
            Ok(mut layer) => (layer.deposited_length() > 0.0).then(|| {
                layer.translate(-self.origin);
                Ok(Cow::Owned(layer))
            }),
        })))
    }

    /// Those that are executed, one after the other.
    ///
    /// # Errors
    /// [`HeadError::Layer`] of a file that cannot be read any more.
    pub(in crate::lpbf) fn layers(&self) -> Result<Planned<'_>, HeadError> {
        if let Some(only) = &self.only {
            return Ok(Box::new(std::iter::once(Ok(Cow::Borrowed(only)))));
        }
        let all = layers(&self.path, channel().0).map_err(HeadError::Layer)?;
        let [first, last] = self.range;
        Ok(Box::new(all.take(self.until).filter_map(
            move |layer| match layer {
                Err(e) => Some(Err(HeadError::Layer(e))),
                Ok(mut layer) => {
                    let wanted = (first..=last).contains(&layer.number);
                    (wanted && layer.deposited_length() > 0.0).then(|| {
                        layer.translate(-self.origin);
                        Ok(Cow::Owned(layer))
                    })
                }
            },
        )))
    }
}
