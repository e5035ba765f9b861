//! Products and assemblies (ISO 10303-41, -43, -44): which body stands where, under which name.
//!
//! Representations are joined by plain relationships (the same frame), by relationships with a
//! transformation (a component in its assembly) and by mapped items. The tree is walked from the
//! representations that are a component of none.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use meltpath_base::Reporter;

use super::StepError;
use super::entity::Entity;
use super::exchange::Exchange;
use super::placement::transform;
use super::solids;
use super::units::{self, Units};
use crate::brep::{BrepModel, PlacedSolid, Solid};
use crate::math::DAffine3;

/// Placed solids that one file may unfold into.
pub const MOST_SOLIDS: usize = 100_000;
/// Levels of one assembly.
const DEPTH: usize = 64;

/// A component in an assembly.
#[derive(Debug, Clone, Copy)]
struct Component {
    representation: u64,
    parent_from_component: DAffine3,
}

struct Walk<'a> {
    file: &'a Exchange<'a>,
    reporter: &'a Reporter,
    /// Representations in the same frame, both ways.
    equals: HashMap<u64, Vec<u64>>,
    components: HashMap<u64, Vec<Component>>,
    /// Product name of each representation that is the shape of a product.
    names: HashMap<u64, String>,
    units: HashMap<u64, Units>,
    solids: HashMap<(u64, u64), Arc<Solid>>,
    reached: HashSet<u64>,
    ignored: HashMap<String, usize>,
    /// Names of components that hold no body and no component.
    hollow: BTreeSet<String>,
    /// Groups placed so far, with or without bodies.
    visits: usize,
    model: BrepModel,
}

/// Reads every body of the file in its place.
pub(super) fn read(file: &Exchange<'_>, reporter: &Reporter) -> Result<BrepModel, StepError> {
    let mut walk = Walk {
        file,
        reporter,
        equals: HashMap::new(),
        components: HashMap::new(),
        names: HashMap::new(),
        units: HashMap::new(),
        solids: HashMap::new(),
        reached: HashSet::new(),
        ignored: HashMap::new(),
        hollow: BTreeSet::new(),
        visits: 0,
        model: BrepModel::default(),
    };
    walk.name_representations()?;
    let mut children: HashSet<u64> = walk.relate()?;
    let representations: Vec<Entity<'_>> = walk.entities().filter(is_representation).collect();
    for representation in &representations {
        for item in representation.references(1)? {
            if item.keyword() == "MAPPED_ITEM" {
                children.insert(item.reference(1)?.reference(1)?.id());
            }
        }
    }
    // an assembly's own frame joins representations: where one of them is a component, all are
    let mut seen: HashSet<u64> = HashSet::new();
    let mut strays = Vec::new();
    for representation in &representations {
        if seen.contains(&representation.id()) {
            continue;
        }
        let group = walk.group(representation.id());
        seen.extend(&group);
        if group.iter().any(|id| children.contains(id)) {
            continue;
        }
        if group.iter().any(|id| walk.names.contains_key(id)) {
            walk.place(&group, DAffine3::IDENTITY, &[], *representation, DEPTH)?;
        } else {
            strays.push((group, *representation));
        }
    }
    // what no product claims is mostly a list of a product's bodies, for a note or a property: it
    // counts only where it holds a body that has no other place
    for (group, representation) in strays {
        if walk.holds_new(&group)? {
            walk.place(&group, DAffine3::IDENTITY, &[], representation, DEPTH)?;
        }
    }
    walk.check_nothing_lost(&representations)?;
    Ok(walk.model)
}

/// A representation has a name, a list of items and a context with a coordinate space.
fn is_representation(entity: &Entity<'_>) -> bool {
    let keyword = entity.keyword();
    (keyword.ends_with("SHAPE_REPRESENTATION") || keyword == "REPRESENTATION")
        && !entity.is_complex()
        && !keyword.starts_with("CONSTRUCTIVE_")
        && entity.list(1).is_ok()
}

impl<'a> Walk<'a> {
    fn entities(&self) -> impl Iterator<Item = Entity<'a>> + use<'a> {
        let file = self.file;
        (0..file.instances.len()).filter_map(move |position| Entity::at(file, position))
    }

    fn entity(&self, id: u64) -> Option<Entity<'a>> {
        Entity::at(self.file, self.file.find(id)?)
    }

    /// Product names through SHAPE_DEFINITION_REPRESENTATION → definition → formation → product.
    fn name_representations(&mut self) -> Result<(), StepError> {
        for entity in self.entities() {
            if !entity.has("SHAPE_DEFINITION_REPRESENTATION") {
                continue;
            }
            let Ok(definition) = entity.reference(0)?.reference(2) else {
                continue;
            };
            let representation = entity.reference(1)?;
            if let Some(name) = product_name(definition) {
                self.names.insert(representation.id(), name);
            }
        }
        Ok(())
    }

    /// Collects the relationships between representations; returns the components.
    fn relate(&mut self) -> Result<HashSet<u64>, StepError> {
        let mut swapped = HashSet::new();
        let shapes = self.definition_representations();
        for entity in self.entities() {
            if !entity.has("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
                continue;
            }
            // the usage says which of the two is the component: some writers turn them round
            let relation = entity.reference(0)?;
            let usage = entity.reference(1)?.reference(2)?;
            if !usage.has("NEXT_ASSEMBLY_USAGE_OCCURRENCE") {
                continue;
            }
            let (parent, component) = (usage.reference(3)?.id(), usage.reference(4)?.id());
            let Some(pair) = relation.part("REPRESENTATION_RELATIONSHIP", 0) else {
                continue;
            };
            let first = pair.reference(2)?.id();
            let is = |definition: u64| shapes.get(&definition).is_some_and(|r| *r == first);
            if is(parent) && !is(component) {
                swapped.insert(relation.id());
            }
        }
        let mut children = HashSet::new();
        for entity in self.entities() {
            let related = entity.has("REPRESENTATION_RELATIONSHIP")
                || entity.has("SHAPE_REPRESENTATION_RELATIONSHIP");
            if !related {
                continue;
            }
            let Some(pair) = entity.part("REPRESENTATION_RELATIONSHIP", 0) else {
                continue;
            };
            let [first, second] = [pair.reference(2)?, pair.reference(3)?];
            if !is_representation(&first) || !is_representation(&second) {
                continue;
            }
            match entity.exact("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
                None => {
                    self.equals.entry(first.id()).or_default().push(second.id());
                    self.equals.entry(second.id()).or_default().push(first.id());
                }
                Some(with) => {
                    let attribute = if with.is_complex() { 0 } else { 4 };
                    let item = with.reference(attribute)?;
                    let turned = swapped.contains(&entity.id());
                    let (component, parent) = if turned {
                        (second, first)
                    } else {
                        (first, second)
                    };
                    let parent_from_component = if item.keyword() == "ITEM_DEFINED_TRANSFORMATION" {
                        let (a, b) = (item.reference(2)?, item.reference(3)?);
                        let (from, to) = if turned { (b, a) } else { (a, b) };
                        let (cu, pu) = (self.units(component)?, self.units(parent)?);
                        transform(to, &pu)? * transform(from, &cu)?.inverse()
                    } else {
                        transform(item, &self.units(parent)?)?
                    };
                    children.insert(component.id());
                    self.components
                        .entry(parent.id())
                        .or_default()
                        .push(Component {
                            representation: component.id(),
                            parent_from_component,
                        });
                }
            }
        }
        Ok(children)
    }

    /// Shape representation of each product definition.
    fn definition_representations(&self) -> HashMap<u64, u64> {
        self.entities()
            .filter(|e| e.has("SHAPE_DEFINITION_REPRESENTATION"))
            .filter_map(|e| {
                let definition = e.reference(0).ok()?.reference(2).ok()?;
                Some((definition.id(), e.reference(1).ok()?.id()))
            })
            .collect()
    }

    fn units(&mut self, representation: Entity<'a>) -> Result<Units, StepError> {
        let context = representation.reference(2)?;
        if let Some(known) = self.units.get(&context.id()) {
            return Ok(*known);
        }
        let units = units::read(context, self.reporter)?;
        self.units.insert(context.id(), units);
        Ok(units)
    }

    /// All representations that share a frame with this one, itself first.
    fn group(&self, id: u64) -> Vec<u64> {
        let mut group = vec![id];
        let mut next = 0;
        while let Some(&at) = group.get(next) {
            next += 1;
            for other in self.equals.get(&at).into_iter().flatten() {
                if !group.contains(other) {
                    group.push(*other);
                }
            }
        }
        group
    }

    /// Whether a group of representations holds a body or a component that has no place yet.
    fn holds_new(&self, group: &[u64]) -> Result<bool, StepError> {
        for &id in group {
            if self.components.contains_key(&id) {
                return Ok(true);
            }
            let Some(representation) = self.entity(id) else {
                continue;
            };
            for item in representation.references(1)? {
                let body = solids::is_body(item) && !self.reached.contains(&item.id());
                if body || !Self::known_shape(item) {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Whether an item is a body, or no shape at all.
    fn known_shape(item: Entity<'a>) -> bool {
        solids::is_body(item) || is_no_shape(&item.place().keyword)
    }

    /// Places the bodies of a group of representations and of all its components.
    fn place(
        &mut self,
        group: &[u64],
        part_from_group: DAffine3,
        path: &[String],
        from: Entity<'a>,
        depth: usize,
    ) -> Result<(), StepError> {
        if depth == 0 {
            return Err(from.cyclic());
        }
        self.visits += 1;
        if self.visits > 10 * MOST_SOLIDS {
            return Err(StepError::TooManySolids {
                entity: from.place(),
                limit: MOST_SOLIDS,
            });
        }
        let product = group.iter().find_map(|id| self.names.get(id)).cloned();
        let mut placed: HashSet<u64> = HashSet::new();
        let mut holds = false;
        let mut inner = path.to_vec();
        inner.extend(product.clone().filter(|n| !n.is_empty()));
        for &id in group {
            let Some(representation) = self.entity(id) else {
                continue;
            };
            let units = self.units(representation)?;
            for item in representation.references(1)? {
                if solids::is_body(item) {
                    holds = true;
                    // one body may be listed by several representations in one frame
                    if !placed.insert(item.id()) {
                        continue;
                    }
                    self.add(
                        item,
                        units,
                        part_from_group,
                        path,
                        product.as_deref(),
                        representation,
                    )?;
                } else if item.keyword() == "MAPPED_ITEM" {
                    holds = true;
                    let map = item.reference(1)?;
                    let mapped = map.reference(1)?;
                    let origin = transform(map.reference(0)?, &self.units(mapped)?)?;
                    let target = transform(item.reference(2)?, &units)?;
                    let group = self.group(mapped.id());
                    let pose = part_from_group * target * origin.inverse();
                    self.place(&group, pose, &inner, item, depth - 1)?;
                } else {
                    self.ignore(item)?;
                }
            }
            for component in self.components.get(&id).cloned().unwrap_or_default() {
                holds = true;
                let group = self.group(component.representation);
                let pose = part_from_group * component.parent_from_component;
                self.place(&group, pose, &inner, representation, depth - 1)?;
            }
        }
        if !holds && depth < DEPTH {
            let name = product.filter(|n| !n.is_empty());
            self.hollow
                .insert(name.unwrap_or_else(|| from.place().to_string()));
        }
        Ok(())
    }

    fn add(
        &mut self,
        item: Entity<'a>,
        units: Units,
        part_from_solid: DAffine3,
        path: &[String],
        product: Option<&str>,
        representation: Entity<'a>,
    ) -> Result<(), StepError> {
        if self.model.solids.len() >= MOST_SOLIDS {
            return Err(StepError::TooManySolids {
                entity: representation.place(),
                limit: MOST_SOLIDS,
            });
        }
        self.reached.insert(item.id());
        let key = (item.id(), units.length.to_bits());
        let solid = if let Some(known) = self.solids.get(&key) {
            Arc::clone(known)
        } else {
            let read = Arc::new(solids::solid(item, &units, self.reporter)?);
            self.solids.insert(key, Arc::clone(&read));
            read
        };
        let name = product
            .filter(|n| !n.is_empty())
            .map_or_else(|| item.text(0), str::to_owned);
        self.model.solids.push(PlacedSolid {
            name,
            path: path.to_vec(),
            solid,
            part_from_solid,
        });
        Ok(())
    }

    /// Items that are no bodies: frames carry no shape, wires and points are counted, what is a
    /// shape in a form that is not read is refused.
    fn ignore(&mut self, item: Entity<'a>) -> Result<(), StepError> {
        let keyword = item.place().keyword;
        if is_no_shape(&keyword) {
            return Ok(());
        }
        let unread = [
            "TESSELLATED_SOLID",
            "TESSELLATED_SHELL",
            "TRIANGULATED_FACE",
            "TRIANGULATED_SURFACE_SET",
            "CSG_SOLID",
            "BOOLEAN_RESULT",
            "EXTRUDED_AREA_SOLID",
            "REVOLVED_AREA_SOLID",
            "SWEPT_DISK_SOLID",
            "SOLID_REPLICA",
            "HALF_SPACE_SOLID",
            "BLOCK",
            "RIGHT_CIRCULAR_CYLINDER",
            "RIGHT_CIRCULAR_CONE",
        ];
        if unread.iter().any(|k| keyword.contains(k)) {
            return Err(item.unsupported(
                "the shape of a part",
                "export the part as a boundary representation (AP203, AP214 or AP242 with solids), or as STL or 3MF",
            ));
        }
        *self.ignored.entry(keyword).or_default() += 1;
        Ok(())
    }

    /// Says what was left out, and refuses a file in which nothing is left.
    fn check_nothing_lost(&mut self, representations: &[Entity<'a>]) -> Result<(), StepError> {
        let mut orphans = 0usize;
        let mut first = None;
        for entity in self.entities() {
            if solids::is_body(entity) && !self.reached.contains(&entity.id()) {
                orphans += 1;
                first = first.or_else(|| Some(entity.place()));
            }
        }
        let outside: BTreeSet<String> = self
            .entities()
            .filter(|e| {
                e.has("APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT") || e.has("DOCUMENT_FILE")
            })
            .map(|e| e.text(0))
            .collect();
        let mut hollow = std::mem::take(&mut self.hollow);
        hollow.extend(self.shapeless()?);
        let listed = |names: BTreeSet<String>| Vec::from_iter(names).join(", ");
        let mut ignored: Vec<String> = self
            .ignored
            .iter()
            .map(|(keyword, count)| format!("{count} {keyword}"))
            .collect();
        ignored.sort();
        if let Some(place) = first {
            if self.model.solids.is_empty() {
                return Err(StepError::NoShape {
                    holds: format!(
                        "{orphans} bodies that no part uses, the first {place}, in {} representations",
                        representations.len()
                    ),
                });
            }
            self.reporter.warn(
                "step-unused-body",
                format!("{orphans} bodies belong to no part and were left out, the first {place}"),
                "export again if a piece of the part is missing",
            );
        }
        if self.model.solids.is_empty() {
            return Err(StepError::NoShape {
                holds: if !outside.is_empty() {
                    format!(
                        "references to other files, which are not followed: {}",
                        listed(outside)
                    )
                } else if ignored.is_empty() {
                    "no shape items".to_owned()
                } else {
                    ignored.join(", ")
                },
            });
        }
        if !hollow.is_empty() && !outside.is_empty() {
            return Err(StepError::Elsewhere {
                components: listed(hollow),
                files: listed(outside),
            });
        }
        if !hollow.is_empty() {
            self.reporter.warn(
                "step-empty-component",
                format!("components without a body: {}", listed(hollow)),
                "export again if a piece of the part is missing",
            );
        }
        if !ignored.is_empty() {
            self.reporter.warn(
                "step-items-ignored",
                format!(
                    "items that bound no metal were left out: {}",
                    ignored.join(", ")
                ),
                "",
            );
        }
        Ok(())
    }
}

impl Walk<'_> {
    /// Products that an assembly uses, and of which the file tells neither a shape nor parts.
    fn shapeless(&self) -> Result<Vec<String>, StepError> {
        let shapes = self.definition_representations();
        let mut ends = Vec::new();
        let mut parents = HashSet::new();
        for usage in self.entities() {
            if usage.has("NEXT_ASSEMBLY_USAGE_OCCURRENCE") {
                parents.insert(usage.reference(3)?.id());
                ends.push(usage.reference(4)?);
            }
        }
        let shapeless =
            |e: &Entity<'_>| !shapes.contains_key(&e.id()) && !parents.contains(&e.id());
        let name = |e: Entity<'_>| product_name(e).unwrap_or_else(|| e.place().to_string());
        Ok(ends.into_iter().filter(shapeless).map(name).collect())
    }
}

/// Items that have a place or a value but no shape: frames, points, properties.
fn is_no_shape(keyword: &str) -> bool {
    keyword.starts_with("AXIS")
        || keyword.ends_with("REPRESENTATION_ITEM")
        || matches!(keyword, "PLANE" | "DIRECTION" | "CARTESIAN_POINT")
}

/// Name of the product of a product definition.
fn product_name(definition: Entity<'_>) -> Option<String> {
    if !definition.keyword().starts_with("PRODUCT_DEFINITION") {
        return None;
    }
    let product = definition.reference(2).ok()?.reference(2).ok()?;
    let name = product.text(1);
    Some(if name.trim().is_empty() {
        product.text(0)
    } else {
        name
    })
}
