//! Layers on a body, from the surfaces through their middles to beads in space.

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::{Mesh, Plane, Region};
use meltpath_toolpath::Layer;
use rayon::prelude::*;

use super::error::OntoError;
use super::inner::inner;
use super::laid_out::{LaidOut, laid_out_in_a_plane};
use super::layers::{Growing, Middle};
use super::lift::{Lift, OntoBead, TopPlace};
use super::settings::OntoSettings;
use crate::fill::{Coverage, FillLayer, PassIds, plan_layers};
use crate::surface::Pace;

/// One layer as planned.
#[derive(Debug, Clone, PartialEq)]
pub struct OntoLayer {
    /// Its number, from 1.
    pub number: u32,
    /// Distance of its top from the body, mm; where it is not the same everywhere, its mean.
    pub top: f64,
    /// Area of the surface through its middle, mm².
    pub area: f64,
    /// Distances between beads over those that were asked for: the least and the greatest, each with its place.
    pub stretch: [(f64, DVec3); 2],
    /// How its pieces are covered; places of gaps are on the layer.
    pub coverage: Vec<Coverage>,
    /// Its rims, closed lines on the surface through its middle, mm.
    pub rims: Vec<Vec<DVec3>>,
    /// Places all over its top away from its rims, as even as a grid in the plane.
    pub inner: Vec<TopPlace>,
    /// Its beads as they lie in the plane.
    pub path: Layer,
}

/// Layers on a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OntoPlan {
    /// The levels between which the last one lies: distances from the body, mm, or shares of the way to the top.
    last: [f64; 2],
    /// Beads in the order in which they are laid.
    pub beads: Vec<OntoBead>,
    /// The layers.
    pub layers: Vec<OntoLayer>,
}

/// A part that grows out of a body: what its plans share.
pub struct Onto<'a> {
    growing: Growing<'a>,
    settings: OntoSettings<'a>,
}

impl<'a> Onto<'a> {
    /// Finds what grows out of `body` where `part` is to be. Both are closed, in the same coordinates; a body of several meshes is all of them
    /// together, which may reach into each other.
    ///
    /// Where the part reaches out of the body by less than half of `height`, the height of a layer, mm, nothing is laid.
    ///
    /// # Errors
    /// [`OntoError`].
    pub fn new(
        part: &Mesh,
        body: &[&Mesh],
        height: f64,
        settings: OntoSettings<'a>,
    ) -> Result<Self, OntoError> {
        for (name, value) in [
            ("the layer height", height),
            ("the chord error", settings.chord_error),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(OntoError::Setting { name, value });
            }
        }
        if let Some(to) = &settings.top {
            let [slowest, fastest] = to.known;
            let paces = to.paces;
            let speeds = [paces.nominal, paces.slowest, paces.fastest];
            let mut speeds = speeds.into_iter().chain([slowest, fastest]);
            if let Some(value) = speeds.find(|v| !(*v > 0.0 && v.is_finite())) {
                let name = "a travel speed";
                return Err(OntoError::Setting { name, value });
            }
        }
        settings.fill.check()?;
        Ok(Onto {
            growing: Growing::new(part, body, height, settings)?,
            settings,
        })
    }

    /// Plans layers that are as high as `heights` says, from the body on, mm; the last one repeats. Of layers from the body to the top that
    /// is how high each grows at the speeds of its fill: where it is thicker it is laid the slower. `first` is the number of the first one.
    ///
    /// # Errors
    /// [`OntoError`].
    pub fn plan(
        &self,
        (first, heights): (u32, &[f64]),
        reporter: &Reporter,
        observer: &dyn Observer,
    ) -> Result<OntoPlan, OntoError> {
        let middles = self.growing.middles(heights);
        let numbered: Vec<(u32, &Middle)> = (first..).zip(&middles).collect();
        let width = self.settings.fill.width;
        let laid_out = numbered
            .into_par_iter()
            .map(|(number, middle)| laid_out_in_a_plane(number, &middle.sheet, width))
            .collect::<Result<Vec<LaidOut>, OntoError>>()?;
        let plane = Plane::horizontal(0.0);
        let regions: Vec<Vec<Region>> = laid_out.iter().map(LaidOut::regions).collect();
        let wanted = laid_out.iter().zip(&regions);
        let wanted: Vec<FillLayer<'_>> = wanted
            .map(|(layer, regions)| FillLayer {
                number: layer.number,
                plane: &plane,
                regions,
            })
            .collect();
        let ids = PassIds { part: 0 };
        let filled = plan_layers(&wanted, self.settings.fill, ids, reporter, observer)?;
        let mut plan = OntoPlan {
            last: middles.last().map_or([0.0; 2], |m| m.levels),
            ..OntoPlan::default()
        };
        let laid = middles.iter().zip(&laid_out).zip(filled);
        for (i, ((middle, layer), filled)) in laid.enumerate() {
            let grown = heights.get(i).or(heights.last()).copied().unwrap_or(0.0);
            let lift = Lift {
                layer,
                field: &self.growing.field,
                levels: middle.levels,
                chord_error: self.settings.chord_error,
                pace: self.settings.top.map(|to| Pace {
                    grown,
                    power: 1.0,
                    paces: to.paces,
                    known: to.known,
                    shortest: 0.5 * width,
                }),
            };
            plan.beads
                .extend(filled.path.passes().filter_map(|p| lift.bead(p)));
            plan.layers.push(OntoLayer {
                number: layer.number,
                top: middle.top,
                area: layer.area,
                stretch: layer.stretch(),
                coverage: lift.coverage(filled.coverage),
                inner: inner(&lift, &regions[i], &self.settings)?,
                rims: layer.pieces.iter().flat_map(|p| p.flat.rims()).collect(),
                path: filled.path,
            });
        }
        if plan.beads.is_empty() {
            return Err(OntoError::Narrow {
                width: self.settings.fill.width,
            });
        }
        Ok(plan)
    }

    /// What a plan fills, as a closed mesh that begins within the body: what further parts grow out of.
    ///
    /// # Errors
    /// [`OntoError::Open`] where it does not close.
    pub fn built(&self, plan: &OntoPlan) -> Result<Mesh, OntoError> {
        self.growing.built(plan.last)
    }
}
