//! `[[groups]]` of scene files, and the shapes of type `instance`.

use glam::DAffine3;

use super::reader::{Table, Value};
use super::shapes::{Shapes, no_shapes};
use super::{tables, transform};
use crate::builder::{GroupId, SceneBuilder};
use crate::error::SceneError;
use crate::suggest::did_you_mean;

/// The groups of a scene file, by name.
#[derive(Default)]
pub(super) struct Groups<'a> {
    /// Those that have been read.
    known: Vec<(&'a str, GroupId)>,
    /// The name of the one that is being read, and those of all that follow.
    to_come: Vec<&'a str>,
}

/// Reads the groups: each has a `name` and shapes, `[[groups.shapes]]`, among them instances of groups that were named before.
pub(super) fn read<'a>(
    root: &Table<'a>,
    shapes: &mut Shapes<'a, '_>,
    builder: &mut SceneBuilder,
) -> Result<(), SceneError> {
    let groups = tables(root, "groups")?;
    let mut names: Vec<(&str, Value)> = Vec::with_capacity(groups.len());
    let mut taken = std::collections::BTreeSet::new();
    for table in &groups {
        let value = table.need("name", "\"tree\"")?;
        let name = value.text()?;
        if !taken.insert(name) {
            return Err(value.error("there is a group of this name already; give it another"));
        }
        names.push((name, value));
    }
    // The last comes first, so that the one that is read is taken from the end.
    shapes.groups.to_come = names.iter().rev().map(|(name, _)| *name).collect();
    for (table, (name, _)) in groups.iter().zip(&names) {
        table.allow_only(&["name", "shapes"])?;
        let members = tables(table, "shapes")?;
        if members.is_empty() {
            return Err(no_shapes(table, &format!("the group `{name}` is empty"), "[[groups.shapes]]"));
        }
        let group = builder.begin_group_at(name, Some(table.line()));
        shapes.read_list(&members, builder)?;
        builder.end_group();
        shapes.groups.to_come.pop();
        shapes.groups.known.push((name, group));
    }
    shapes.groups.known.sort_unstable();
    Ok(())
}

impl Groups<'_> {
    /// Reads `instance { group, transform }`.
    pub fn instance(&self, table: &Table, line: usize, builder: &mut SceneBuilder) -> Result<(), SceneError> {
        table.allow_only(&["type", "group", "transform"])?;
        let value = table.need("group", "\"tree\"")?;
        let group = self.named(&value)?;
        let transform = table.get("transform").map_or(Ok(DAffine3::IDENTITY), |value| transform::read(&value))?;
        builder.instance_at(group, transform, Some(line));
        Ok(())
    }

    fn named(&self, value: &Value) -> Result<GroupId, SceneError> {
        let name = value.text()?;
        // Once all are read they are sorted, and there may be many instances.
        let found = match self.to_come.is_empty() {
            true => self.known.binary_search_by_key(&name, |(known, _)| known).ok().map(|place| &self.known[place]),
            false => self.known.iter().find(|(known, _)| *known == name),
        };
        if let Some((_, group)) = found {
            return Ok(*group);
        }
        if self.to_come.last() == Some(&name) {
            return Err(value.error("a group cannot contain itself; take this instance out"));
        }
        if self.to_come.contains(&name) {
            return Err(value.error("a group may hold only groups that stand before it; move that one up"));
        }
        let names: Vec<&str> = self.known.iter().map(|(known, _)| *known).collect();
        if names.is_empty() {
            return Err(value.error(format!("there is no such group; add `[[groups]]` with `name = \"{name}\"`")));
        }
        Err(value.error(format!("there is no such group: {}", did_you_mean(name, &names))))
    }
}
