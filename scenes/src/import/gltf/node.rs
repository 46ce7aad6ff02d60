//! Nodes: what stands where.

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};

use super::buffers::Asset;
use super::document::Item;
use super::schema::{Kind, Node, Scene};
use crate::error::SceneError;

/// A node of the scene.
pub struct Placed<'t> {
    /// Its object.
    pub item: Item<'t>,
    /// What it says.
    pub node: Node,
    /// From its frame to the world.
    pub world: DMat4,
    /// Whether it is seen, with all above it. What is hidden still places cameras and joints.
    pub visible: bool,
}

/// The scene's nodes with all below them, each after its parent; and how many scenes are left out.
pub fn placed<'t>(asset: &Asset<'t>) -> Result<(Vec<Placed<'t>>, usize), SceneError> {
    let document = &asset.document;
    let count = document.root.list(Kind::Node).len();
    let mut scenes = document.all(Kind::Scene);
    let number = document.root.scene.unwrap_or(0);
    let all = document.root.list(Kind::Scene).len();
    let mut waiting: Vec<(Item<'t>, DMat4, bool)> = Vec::new();
    match scenes.nth(number) {
        Some(scene) => {
            let nodes: Scene = document.parse(&scene)?;
            for &node in nodes.nodes.iter().rev() {
                waiting.push((document.item(Kind::Node, node, &scene)?, DMat4::IDENTITY, true));
            }
        }
        None if document.root.scene.is_some() => {
            let message = format!("`scene` is {number}, and the file has {all} scenes");
            return Err(document.place().error(message, "count from 0"));
        }
        // Without a scene, all that hangs from nothing.
        None => {
            let mut has_parent = vec![false; count];
            for item in document.all(Kind::Node) {
                let node: Node = document.parse(&item)?;
                node.children.iter().filter(|&&child| child < count).for_each(|&child| has_parent[child] = true);
            }
            let roots = document.all(Kind::Node).filter(|item| !has_parent[item.index()]);
            waiting.extend(roots.map(|item| (item, DMat4::IDENTITY, true)));
            waiting.reverse();
        }
    }
    let mut seen = vec![false; count];
    let mut placed = Vec::new();
    while let Some((item, above, seen_above)) = waiting.pop() {
        if std::mem::replace(&mut seen[item.index()], true) {
            let message = "stands in two places, or below itself";
            return Err(document.error(&item, message, "let every node be the child of one other"));
        }
        let node: Node = document.parse(&item)?;
        let world = above * local(&node).map_err(|(message, mend)| document.error(&item, message, mend))?;
        if !world.is_finite() {
            return Err(document.error(&item, "stands beyond all numbers", "let transforms stay finite"));
        }
        let own = node.extensions.visibility.as_ref().and_then(|visibility| visibility.visible);
        let visible = seen_above && own.unwrap_or(true);
        for &child in node.children.iter().rev() {
            waiting.push((document.item(Kind::Node, child, &item)?, world, visible));
        }
        placed.push(Placed { item, node, world, visible });
    }
    Ok((placed, all.saturating_sub(1)))
}

/// From a node's frame to its parent's: a matrix, column by column, or translation · rotation · scale.
fn local(node: &Node) -> Result<DMat4, (&'static str, &'static str)> {
    if let Some(matrix) = &node.matrix {
        let map = DMat4::from_cols_slice(matrix);
        if map.row(3) != DVec4::W {
            return Err(("has a matrix that is not affine", "let its last row be 0 0 0 1"));
        }
        return Ok(map);
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    if rotation.length() <= f64::MIN_POSITIVE || !rotation.length().is_finite() {
        return Err(("has a rotation without length", "give a unit quaternion"));
    }
    let scale = DVec3::from(node.scale.unwrap_or([1.0; 3]));
    let translation = DVec3::from(node.translation.unwrap_or_default());
    Ok(DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}

/// Whether a map leaves no volume of what it is applied to.
pub fn flattens(map: &DMat4) -> bool {
    let axes = DMat3::from_mat4(*map);
    let spread = axes.x_axis.length() * axes.y_axis.length() * axes.z_axis.length();
    !spread.is_finite() || !axes.inverse().is_finite() || axes.determinant().abs() <= 1e-9 * spread
}
