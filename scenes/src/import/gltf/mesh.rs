//! Meshes where they stand.

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DMat4, DVec3};

use super::accessor::Accessor;
use super::context::Context;
use super::document::Item;
use super::material::{self, Form, Tint};
use super::node::{Placed, flattens};
use super::primitive::{self, MOST_TRIANGLES, Part, Piece};
use super::schema::{Kind, Mesh, Primitive, Skin};
use crate::builder::MeshData;
use crate::error::SceneError;
use crate::import::mitsuba::transform::steps;
use crate::import::ply;
use crate::import::translation::{Lines, MEMBER, Place, SHAPE, quoted};

/// How many triangles are kept to choose a camera; beyond, the box around a mesh stands for it.
const MOST_KEPT: usize = 1 << 22;

/// The meshes of a scene as they are written.
pub struct Meshes {
    /// Where every node stands, by its number.
    worlds: Vec<Option<DMat4>>,
    /// How many nodes have a mesh, by its number.
    uses: HashMap<usize, usize>,
    /// Whether triangles are kept, to choose a camera.
    keep: bool,
    /// Those that are kept, where they stand.
    pub kept: Vec<MeshData>,
    /// How many triangles are kept.
    triangles_kept: usize,
    /// How many triangles there are so far, those of a mesh once.
    pub triangles: usize,
    /// Meshes that stand in several places.
    pub groups: Lines,
    /// What these are called, by the mesh's number.
    names: HashMap<usize, String>,
}

impl Meshes {
    /// Before any is written; `keep` where a camera is to be chosen.
    pub fn new(nodes: &[Placed], count: usize, keep: bool) -> Self {
        let mut worlds = vec![None; count];
        let mut uses = HashMap::new();
        for placed in nodes {
            worlds[placed.item.index()] = Some(placed.world);
            if let Some(mesh) = placed.node.mesh.filter(|_| placed.visible) {
                *uses.entry(mesh).or_default() += 1;
            }
        }
        Self {
            worlds,
            uses,
            keep,
            kept: Vec::new(),
            triangles_kept: 0,
            triangles: 0,
            groups: Lines::default(),
            names: HashMap::new(),
        }
    }

    /// Writes a mesh where its node stands: as a group where it stands in several places, otherwise as its shapes.
    pub fn write<'t>(
        &mut self,
        index: usize,
        placed: &Placed<'t>,
        context: &mut Context<'_, 't>,
    ) -> Result<(), SceneError> {
        let document = &context.asset.document;
        let place = document.place_of_item(&placed.item);
        let world = match placed.node.skin {
            Some(skin) => self.skinned(skin, placed, context)?,
            None => placed.world,
        };
        if flattens(&world) {
            context.approximate(&place, "a mesh that its transform flattens is left out");
            return Ok(());
        }
        let item = document.item(Kind::Mesh, index, &placed.item)?;
        let pieces = self.pieces(&item, &placed.node.weights, context)?;
        if pieces.is_empty() {
            return Ok(());
        }
        if self.keep {
            pieces.iter().filter_map(|piece| piece.mesh.as_ref()).for_each(|mesh| self.keep(mesh, &world));
        }
        context.emits |= pieces.iter().any(|piece| piece.emission.is_some());
        if self.uses[&index] == 1 {
            pieces.iter().for_each(|piece| context.shapes.append(shape(piece, SHAPE, &place, steps(&[world]))));
            return Ok(());
        }
        let name = match self.names.get(&index) {
            Some(name) => name.clone(),
            None => {
                let name = context.fresh_name(&item.name().unwrap_or_else(|| format!("mesh_{index}")));
                let place = document.place_of_item(&item);
                let mut members = Lines::default();
                pieces.iter().for_each(|piece| members.append(shape(piece, MEMBER, &place, None)));
                self.groups.group(&place, &name, members);
                self.names.insert(index, name.clone());
                name
            }
        };
        context.shapes.instance(&place, SHAPE, &name, steps(&[world]));
        Ok(())
    }

    /// The parts of a mesh, each written once.
    fn pieces<'t>(
        &mut self,
        item: &Item<'t>,
        weights: &[f64],
        context: &mut Context<'_, 't>,
    ) -> Result<Vec<Rc<Piece>>, SceneError> {
        let document = &context.asset.document;
        let note = |weights: &[f64], context: &mut Context| {
            if weights.iter().any(|&weight| weight != 0.0) {
                let place = context.asset.document.place_of_item(item);
                context.approximate(&place, "morph targets are left out, though they have weights");
            }
        };
        note(weights, context);
        if let Some(pieces) = context.pieces.get(&item.index()) {
            return Ok(pieces.clone());
        }
        let mesh: Mesh = document.parse(item)?;
        if weights.is_empty() {
            note(&mesh.weights, context);
        }
        let whole = item.title();
        let mut pieces = Vec::new();
        for (number, raw) in mesh.primitives.iter().enumerate() {
            let title = format!("{whole}, primitive {number},");
            let primitive: Primitive = document.parse_part(item, raw, &title)?;
            let part = Part { item, title, primitive: &primitive };
            if let Some(piece) = self.piece(&part, &document.place_of(raw), context)? {
                self.triangles += piece.triangles;
                pieces.push(Rc::new(piece));
            }
        }
        context.pieces.insert(item.index(), pieces.clone());
        Ok(pieces)
    }

    /// Keeps a mesh where it stands, or the box around it.
    fn keep(&mut self, mesh: &MeshData, world: &DMat4) {
        let at = |p: DVec3| world.transform_point3(p);
        self.triangles_kept += mesh.triangles.len();
        if self.triangles_kept <= MOST_KEPT {
            let positions = mesh.positions.iter().map(|&p| at(p)).collect();
            self.kept.push(MeshData { positions, triangles: mesh.triangles.clone(), ..MeshData::default() });
            return;
        }
        let low = mesh.positions.iter().fold(DVec3::INFINITY, |low, &p| low.min(p));
        let high = mesh.positions.iter().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
        let end = |i: usize, bit: usize| if i >> bit & 1 == 0 { low[bit] } else { high[bit] };
        let positions = (0..8).map(|i| at(DVec3::new(end(i, 0), end(i, 1), end(i, 2)))).collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        self.kept.push(MeshData { positions, triangles, ..MeshData::default() });
    }

    /// A part of a mesh, kept as a file; `None`, and a note, where there is nothing to see.
    fn piece<'t>(
        &self,
        part: &Part<'_, 't>,
        place: &Place,
        context: &mut Context<'_, 't>,
    ) -> Result<Option<Piece>, SceneError> {
        let (asset, primitive) = (context.asset, part.primitive);
        match primitive.mode {
            4..=6 => {}
            0..=3 => {
                context.ignore(place, "points and lines, which have no area");
                return Ok(None);
            }
            mode => {
                let error = asset.document.place_of_item(part.item);
                return Err(error.error(format!("{} has the mode {mode}", part.title), "give one from 0 to 6"));
            }
        }
        if primitive.extensions.contains_key("KHR_draco_mesh_compression") {
            let position = primitive.attributes.get("POSITION");
            let position = position.map(|&index| Accessor::open(asset, index, part.item)).transpose()?;
            if !position.is_some_and(|position| position.has_bytes()) {
                let message =
                    format!("{} is compressed by `KHR_draco_mesh_compression`, which is not read", part.title);
                return Err(place.error(message, "export the file without compression"));
            }
        }
        if !primitive.targets.is_empty() {
            context.ignore(place, "morph targets: the mesh is as it is without them");
        }
        self.attributes(primitive, place, context);
        let source = material::source(primitive.material, part.item, context)?;
        let left = MOST_TRIANGLES.saturating_sub(self.triangles);
        let Some(geometry) = part.read(asset, &source.plan, left)? else {
            context.ignore(place, "a part of a mesh without triangles of any area");
            return Ok(None);
        };
        if geometry.bad_uvs > 0 {
            let text = format!("{} texture coordinates that are no numbers are taken as 0", geometry.bad_uvs);
            context.approximate(place, text);
        }
        let mut mesh = geometry.mesh;
        let form = Form { has_uvs: !mesh.uvs.is_empty(), tint: geometry.tint };
        let written = material::written(primitive.material, source, form, context)?;
        let mut emission = written.emission.clone();
        if let (Some(factor), Tint::Varying) = (written.vertex_factor, geometry.tint) {
            mesh.colours = primitive::tinted(&geometry.colours, factor);
            let black = mesh.colours.iter().all(|colour| colour.is_zero());
            emission = emission.filter(|_| !black);
        }
        let file = context.attach("mesh", "ply", ply::write::write(&mesh));
        context.mapped(place, format!("{} becomes a `mesh`", part.title.trim_end_matches(',')));
        Ok(Some(Piece {
            file,
            material: written.name.clone(),
            emission,
            triangles: mesh.triangles.len(),
            mesh: self.keep.then_some(mesh),
        }))
    }

    /// Tells of attributes that are not read.
    fn attributes(&self, primitive: &Primitive, place: &Place, context: &mut Context) {
        for name in primitive.attributes.keys() {
            match name.as_str() {
                "POSITION" | "NORMAL" | "COLOR_0" => {}
                "TANGENT" => context.ignore(place, "`TANGENT`: tangents run along growing u"),
                name if name.starts_with("TEXCOORD_")
                    || name.starts_with("JOINTS_")
                    || name.starts_with("WEIGHTS_") => {}
                name => context.ignore(place, format!("the attribute `{}`", crate::suggest::shown(name))),
            }
        }
    }

    /// Where the first joint of a skin takes the mesh, as all do at rest.
    fn skinned<'t>(
        &self,
        skin: usize,
        placed: &Placed<'t>,
        context: &mut Context<'_, 't>,
    ) -> Result<DMat4, SceneError> {
        let document = &context.asset.document;
        let item: Item = document.item(Kind::Skin, skin, &placed.item)?;
        let skin: Skin = document.parse(&item)?;
        document.spend(&item, skin.joints.len().saturating_mul(64))?;
        let place = document.place_of_item(&item);
        let inverse = match skin.inverse_bind_matrices {
            Some(index) => Some(Accessor::open(context.asset, index, &item)?),
            None => None,
        };
        let joint = |number: usize, joint: usize| -> Option<DMat4> {
            let bind = match &inverse {
                Some(list) if number < list.count && list.components == 16 => {
                    DMat4::from_cols_array(&list.get::<16>(number))
                }
                _ => DMat4::IDENTITY,
            };
            let world = (*self.worlds.get(joint)?)? * bind;
            (world.is_finite() && world.row(3) == glam::DVec4::W).then_some(world)
        };
        let maps: Vec<Option<DMat4>> = skin.joints.iter().enumerate().map(|(n, &j)| joint(n, j)).collect();
        let Some(first) = maps.first().copied().flatten() else {
            context.approximate(&place, "a skin whose joints are nowhere is left out");
            return Ok(placed.world);
        };
        let size = first.to_cols_array().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        if maps.iter().any(|map| map.is_none_or(|map| !map.abs_diff_eq(first, 1e-3 * size))) {
            context
                .approximate(&place, "a skin is left out: its mesh stands as its first joint has it, without a pose");
        } else {
            context.ignore(&place, "a skin at rest: its mesh stands as its joints have it");
        }
        Ok(first)
    }
}

/// A part of a mesh as a shape of the scene or of a group.
fn shape(piece: &Piece, header: &str, place: &Place, steps: Option<String>) -> Lines {
    let mut lines = Lines::default();
    lines.table(place, header);
    lines.key(place, "type", quoted("mesh"));
    lines.key(place, "file", quoted(&piece.file));
    lines.key(place, "material", quoted(&piece.material));
    if let Some((emission, two_sided)) = &piece.emission {
        lines.key(place, "emission", emission);
        if *two_sided {
            lines.key(place, "two_sided", "true");
        }
    }
    if let Some(steps) = steps {
        lines.key(place, "transform", steps);
    }
    lines
}
