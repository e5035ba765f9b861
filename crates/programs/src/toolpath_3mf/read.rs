//! Toolpaths of packages, layer by layer.

use std::collections::BTreeSet;
use std::io::{Read, Seek};

use meltpath_base::Ratio;
use meltpath_geometry::io::threemf::Package;
use meltpath_toolpath::{Layer, Profile, Toolpath};

use super::error::ToolpathFileError;
pub use super::layer::Found;
use super::layer::{Progress, Reading};
use super::resource::{Resource, read_resource};
use super::walk::{content, walk};
use super::words::{DRAFT_RELATION, Kind, LAYER_RELATION};

/// Most points that are taken into memory at once, of a layer of marks or of a whole path in space.
const MOST_POINTS: usize = 50_000_000;

/// A toolpath open for reading: an iterator over its layers, one in memory at a time.
///
/// Segments become passes that deposit: loops and polylines with the role of a contour, hatch lines and lines in space with that of a fill, where
/// the file does not say the role. The heights of plane layers are their tops, and their points lie at z = 0; points in space are where they
/// are. What profiles say is that of the passes, in [`Reader::profiles`] or, of a beam, as channels of each move.
#[derive(Debug)]
pub struct Reader<R> {
    package: Package<R>,
    resource: Resource,
    next: usize,
    over: bool,
    progress: Progress,
}

impl<R: Read + Seek> Reader<R> {
    /// Opens a package, and reads which toolpath is to be built.
    ///
    /// # Errors
    /// [`ToolpathFileError`].
    pub fn new(from: R) -> Result<Self, ToolpathFileError> {
        let mut package = Package::open(from)?;
        let model = package.start_part()?;
        let part = package.part(&model, "which the package names as a model")?;
        let resource = read_resource(part, &model)?;
        let relations = if resource.layers.is_empty() {
            Vec::new()
        } else {
            package.relations(&model)?
        };
        let layers = relations
            .into_iter()
            .filter(|r| [LAYER_RELATION, DRAFT_RELATION].contains(&r.kind.as_str()));
        let linked: BTreeSet<String> = layers.map(|r| r.target.to_ascii_lowercase()).collect();
        let unlinked = resource
            .layers
            .iter()
            .find(|l| !linked.contains(&l.part.to_ascii_lowercase()));
        if let Some(layer) = unlinked {
            let what = format!(
                "no relationship of the model leads to its layer `{}`",
                layer.part
            );
            return Err(content(&model, what));
        }
        Ok(Reader {
            package,
            resource,
            next: 0,
            over: false,
            progress: Progress::default(),
        })
    }

    /// What its points say.
    pub fn kind(&self) -> Kind {
        self.resource.kind
    }

    /// How many layers there are.
    pub fn layer_count(&self) -> usize {
        self.resource.layers.len()
    }

    /// The profiles that passes name; 0 where a package does not say a value.
    pub fn profiles(&self) -> Vec<Profile> {
        let said = self.resource.profiles.iter().map(|p| Profile {
            name: p.name.clone(),
            speed: p.deposition_speed.or(p.laser_speed).unwrap_or_default(),
            wire_feed: p.wire_feed.unwrap_or_default(),
            power: p.power.unwrap_or_default(),
            spot: 2.0 * p.spot_radius.unwrap_or_default(),
            dwell: 0.0,
            width: p.width.unwrap_or_default(),
            height: p.height.unwrap_or_default(),
        });
        said.collect()
    }

    /// How much corners of beads are smoothed, where the profiles say the same.
    fn smoothing(&self) -> Option<Ratio> {
        let mut said = self.resource.profiles.iter().map(|p| p.smoothing);
        let first = said.next()??;
        said.all(|s| s == Some(first)).then_some(Ratio(first))
    }

    /// What was not followed in the layers that were read since the last call.
    pub fn found(&mut self) -> Vec<Found> {
        std::mem::take(&mut self.progress.found)
    }

    fn layer(&mut self, index: usize) -> Result<Layer, ToolpathFileError> {
        let path = &self.resource.layers[index];
        let height = path.top.map_or(0.0, |top| {
            (f64::from(top) * self.resource.unit * 1e9).round() / 1e9
        });
        let layer = Layer::new(index as u32 + 1, height);
        let source = self
            .package
            .part(&path.part, "which the toolpath names as a layer")?;
        if self.resource.kind == Kind::Planar || index == 0 {
            self.progress.room = MOST_POINTS;
        }
        let before = index
            .checked_sub(1)
            .and_then(|i| self.resource.layers.get(i));
        if before.is_some_and(|before| before.top < path.top) {
            // lasers of different heights do not mark at the same time
            self.progress.laser = None;
        }
        let named = (&self.resource, path.part.as_str());
        let mut reading = Reading::new(named, layer, &mut self.progress);
        walk(source, &path.part, &mut reading)?;
        let mut layer = reading.layer;
        layer.shrink_to_fit();
        Ok(layer)
    }
}

impl<R: Read + Seek> Iterator for Reader<R> {
    type Item = Result<Layer, ToolpathFileError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over || self.next >= self.layer_count() {
            return None;
        }
        self.next += 1;
        let layer = self.layer(self.next - 1);
        self.over = layer.is_err();
        Some(layer)
    }
}

/// A path of a torch in space, with what it does not say or what is not followed of it.
#[derive(Debug, Clone, PartialEq)]
pub struct SpatialPath {
    /// The path. A profile that says no speed or no wire feed has 0 there.
    pub toolpath: Toolpath,
    /// How much corners within beads are smoothed, of what the controller can, where the file says it.
    pub smoothing: Option<Ratio>,
    /// What is not followed, each once.
    pub found: Vec<Found>,
}

/// Reads a path in space, of three or six axes.
///
/// # Errors
/// [`ToolpathFileError`].
pub fn read_spatial(from: impl Read + Seek) -> Result<SpatialPath, ToolpathFileError> {
    let mut reader = Reader::new(from)?;
    if reader.kind() == Kind::Planar {
        return Err(ToolpathFileError::Kind {
            found: Kind::Planar,
            wanted: "a torch follows one of 3 or 6 axes: name a planar one as the layers of a laser scan head (lpbf.layers)",
        });
    }
    let mut toolpath = Toolpath {
        profiles: reader.profiles(),
        ..Toolpath::default()
    };
    for layer in reader.by_ref() {
        toolpath.layers.push(layer?);
    }
    toolpath.layers.retain(|l| !l.is_empty());
    Ok(SpatialPath {
        smoothing: reader.smoothing(),
        found: reader.found(),
        toolpath,
    })
}
