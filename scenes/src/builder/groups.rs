//! Groups: shapes that are kept once and placed many times, and what becomes of them.

use super::check::similarity_scale;
use super::{SceneBuilder, Shape};
use crate::error::SceneError;
use crate::material::{Material, Varying};
use crate::shape::Geometry;
use crate::texture::Texture;
use glam::DAffine3;

/// How often groups may be placed, those within others counted with each of them.
pub(super) const MOST_INSTANCES: u64 = 5_000_000;
/// How many triangles and other surfaces may be copied because they cannot be kept once.
pub(super) const MOST_COPIED: u64 = 50_000_000;
/// How many groups may be within one another.
const MOST_NESTED: u32 = 64;

/// Names a group of a scene under construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroupId(pub u32);

/// Shapes that are kept once.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// What messages call it.
    pub name: String,
    /// Where its file speaks of it, counted from 1.
    line: Option<usize>,
    /// The groups that it holds.
    placements: Vec<Placement>,
}

/// A group, somewhere.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    pub group: GroupId,
    transform: DAffine3,
    /// Where its file speaks of it, counted from 1.
    line: Option<usize>,
}

impl Placement {
    fn error(&self, builder: &SceneBuilder, what: &str, mend: &str) -> SceneError {
        let name = builder.groups.get(self.group.0 as usize).map_or("", |group| &group.name);
        placed(SceneError::invalid(format!("an instance of group `{name}` {what}"), mend), self.line)
    }
}

/// An error at a line, if it is known.
fn placed(error: SceneError, line: Option<usize>) -> SceneError {
    match line {
        Some(line) => error.at_line(line),
        None => error,
    }
}

impl SceneBuilder {
    /// Begins a group: shapes and instances that are added belong to it from now on, until it is ended. It is seen only where an
    /// [`instance`](Self::instance) of it is.
    pub fn begin_group(&mut self, name: &str) -> GroupId {
        self.begin_group_at(name, None)
    }

    /// The same with the line, counted from 1, at which its file speaks of it.
    pub(crate) fn begin_group_at(&mut self, name: &str, line: Option<usize>) -> GroupId {
        let group = GroupId(self.groups.len() as u32);
        self.groups.push(Group { name: name.to_owned(), line, placements: Vec::new() });
        self.shelved = std::mem::replace(&mut self.members, 0);
        self.open = Some(group);
        group
    }

    /// Ends the group that was begun last.
    pub fn end_group(&mut self) {
        if self.open.take().is_some() {
            self.members = self.shelved;
        }
    }

    /// Places a group, which must have been ended: any affine map that can be undone takes its coordinates to those of the scene, or
    /// of the group that is open. Fronts become the images of fronts.
    ///
    /// What cannot be kept once is copied for each instance: shapes that emit, so that each is an emitter of its own, and those with
    /// a ramp over the scene's coordinates.
    pub fn instance(&mut self, group: GroupId, transform: DAffine3) {
        self.instance_at(group, transform, None);
    }

    /// The same with the line, counted from 1, at which its file speaks of it.
    pub(crate) fn instance_at(&mut self, group: GroupId, transform: DAffine3, line: Option<usize>) {
        let placement = Placement { group, transform, line };
        match self.open {
            Some(open) => self.groups[open.0 as usize].placements.push(placement),
            None => self.placements.push(placement),
        }
        self.members += 1;
    }

    /// Moves the instances that stand in no group.
    pub(super) fn place_by(&mut self, map: DAffine3) {
        self.placements.iter_mut().for_each(|placement| placement.transform = map * placement.transform);
    }

    /// Whether a shape must be copied for each instance of its group.
    fn is_copied(&self, shape: &Shape) -> bool {
        let ramp = |material: &Material| {
            material.parts().iter().flat_map(Varying::all_textures).any(|t| matches!(t, Texture::Ramp { .. }))
        };
        shape.emission.is_some() || self.materials.get(shape.material.0 as usize).is_some_and(ramp)
    }
}

/// What can be said to be wrong with groups before they are placed.
pub(super) fn check(builder: &SceneBuilder) -> Result<(), SceneError> {
    let mut filled = vec![false; builder.groups.len()];
    builder.shapes.iter().filter_map(|shape| shape.group).for_each(|group| filled[group.0 as usize] = true);
    for (index, group) in builder.groups.iter().enumerate() {
        if !filled[index] && group.placements.is_empty() {
            let error =
                SceneError::invalid(format!("the group `{}` is empty", group.name), "give it a shape, or remove it");
            return Err(placed(error, group.line));
        }
        for placement in &group.placements {
            if placement.group.0 as usize >= index {
                let what = format!("stands in the group `{}`, which comes before it ends", group.name);
                return Err(placement.error(builder, &what, "a group may hold only groups that come before it"));
            }
        }
    }
    let everywhere = builder.groups.iter().flat_map(|group| &group.placements).chain(&builder.placements);
    for placement in everywhere {
        if placement.group.0 as usize >= builder.groups.len() {
            let message =
                format!("there is an instance of group {}, but there are {}", placement.group.0, filled.len());
            return Err(SceneError::invalid(message, "begin the group first"));
        }
        if !can_be_undone(&placement.transform) {
            return Err(placement.error(builder, FLATTENED, "every direction must keep some length"));
        }
    }
    Ok(())
}

const FLATTENED: &str = "is flattened by its transform";

fn can_be_undone(map: &DAffine3) -> bool {
    map.is_finite() && map.inverse().is_finite()
}

/// The names of groups that are placed nowhere.
pub(super) fn unplaced(builder: &SceneBuilder) -> Vec<&str> {
    let mut seen = vec![false; builder.groups.len()];
    let everywhere = builder.groups.iter().flat_map(|group| &group.placements).chain(&builder.placements);
    everywhere.for_each(|placement| seen[placement.group.0 as usize] = true);
    builder.groups.iter().zip(seen).filter(|(_, seen)| !seen).map(|(group, _)| group.name.as_str()).collect()
}

/// All instances, none within another any more.
#[derive(Default)]
pub(super) struct Expansion {
    /// For each group that is placed and of which something is kept once: the places of its shapes in the builder's list.
    pub kept: Vec<Vec<usize>>,
    /// Where these are placed, by the order of `kept`.
    pub instances: Vec<Placed>,
    /// What is copied.
    pub copies: Vec<Shape>,
}

/// One of the groups that are kept, somewhere in the scene.
pub(super) struct Placed {
    pub kept: usize,
    pub transform: DAffine3,
    /// The outermost instance, which messages speak of: its place in the builder's list.
    outermost: usize,
}

impl Placed {
    /// The error that it is too much for numbers.
    pub fn too_distorted(&self, builder: &SceneBuilder) -> SceneError {
        let what = "is scaled or stretched beyond what numbers can hold";
        builder.placements[self.outermost].error(
            builder,
            what,
            "stretch it by less than a factor of a million, or give its shapes in another size",
        )
    }
}

/// What is in a group: the places of its shapes.
#[derive(Clone, Default)]
struct Members {
    kept: Vec<usize>,
    copied: Vec<usize>,
}

/// What placing a group once comes to.
#[derive(Clone, Copy, Default)]
struct Cost {
    instances: u64,
    copied: u64,
    nested: u32,
}

/// Works out where everything goes. Groups have been checked.
pub(super) fn expand(builder: &SceneBuilder) -> Result<Expansion, SceneError> {
    if builder.placements.is_empty() {
        return Ok(Expansion::default());
    }
    let mut members = vec![Members::default(); builder.groups.len()];
    for (index, shape) in builder.shapes.iter().enumerate() {
        let Some(group) = shape.group else { continue };
        let members = &mut members[group.0 as usize];
        if builder.is_copied(shape) { members.copied.push(index) } else { members.kept.push(index) }
    }
    check_costs(builder, &members)?;
    let mut expander =
        Expander { builder, members: &members, numbers: vec![None; members.len()], expansion: Expansion::default() };
    for (outermost, placement) in builder.placements.iter().enumerate() {
        expander.place(placement, &DAffine3::IDENTITY, outermost)?;
    }
    Ok(expander.expansion)
}

/// Groups of groups of groups may be more than there is memory for.
fn check_costs(builder: &SceneBuilder, members: &[Members]) -> Result<(), SceneError> {
    let size = |index: &usize| match &builder.shapes[*index].geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len() as u64,
        _ => 1,
    };
    let mut costs: Vec<Cost> = Vec::with_capacity(members.len());
    let sum = |start: Cost, placements: &[Placement], costs: &[Cost]| {
        placements.iter().try_fold(start, |sum, placement| {
            let inner = costs[placement.group.0 as usize];
            let instances = sum.instances.saturating_add(inner.instances);
            let copied = sum.copied.saturating_add(inner.copied);
            let nested = sum.nested.max(inner.nested + 1);
            let error = |what: String, mend| Err(placement.error(builder, &what, mend));
            if instances > MOST_INSTANCES {
                let what = format!("brings the instances, with those within others, to {instances}");
                return error(what, "place at most 5 million: put more into a group, or place fewer");
            }
            if copied > MOST_COPIED {
                let what =
                    format!("brings the surfaces that are copied, because they emit or have a ramp, to {copied}");
                return error(what, "let at most 50 million be copied: place fewer, or let a smaller part emit");
            }
            if nested > MOST_NESTED {
                let what = format!("is the outermost of more than {MOST_NESTED} groups within one another");
                return error(what, "nest them less");
            }
            Ok(Cost { instances, copied, nested })
        })
    };
    for (group, members) in builder.groups.iter().zip(members) {
        let instances = u64::from(!members.kept.is_empty());
        let own = Cost { instances, copied: members.copied.iter().map(size).sum(), nested: 0 };
        costs.push(sum(own, &group.placements, &costs)?);
    }
    sum(Cost::default(), &builder.placements, &costs).map(|_| ())
}

struct Expander<'a> {
    builder: &'a SceneBuilder,
    members: &'a [Members],
    /// The place in `kept` of each group that has one.
    numbers: Vec<Option<usize>>,
    expansion: Expansion,
}

impl Expander<'_> {
    fn place(&mut self, placement: &Placement, outer: &DAffine3, outermost: usize) -> Result<(), SceneError> {
        let group = placement.group.0 as usize;
        let transform = *outer * placement.transform;
        let members = &self.members[group];
        if !members.kept.is_empty() {
            let kept = *self.numbers[group].get_or_insert_with(|| {
                self.expansion.kept.push(members.kept.clone());
                self.expansion.kept.len() - 1
            });
            self.expansion.instances.push(Placed { kept, transform, outermost });
        }
        for &index in &members.copied {
            let shape = &self.builder.shapes[index];
            let copy = Shape { transform: transform * shape.transform, ..shape.clone() };
            check_copy(&copy, self.builder, &self.builder.placements[outermost])?;
            self.expansion.copies.push(copy);
        }
        let builder = self.builder;
        builder.groups[group].placements.iter().try_for_each(|inner| self.place(inner, &transform, outermost))
    }
}

/// What is copied must stay what it is.
fn check_copy(copy: &Shape, builder: &SceneBuilder, outermost: &Placement) -> Result<(), SceneError> {
    let round = match copy.geometry {
        Geometry::Sphere { .. } => "sphere",
        Geometry::Cylinder { .. } => "cylinder",
        Geometry::Quad { .. } | Geometry::Disk { .. } | Geometry::Mesh(_) => return Ok(()),
    };
    if similarity_scale(&copy.transform.matrix3).is_some() {
        return Ok(());
    }
    let why = if copy.emission.is_some() { "emits" } else { "has a ramp" };
    let what = format!("does not leave {} a {round}, which it must stay since it {why}", copy.name(&builder.groups));
    Err(outermost.error(builder, &what, "scale the instance by the same factor along all axes, or use a mesh"))
}
