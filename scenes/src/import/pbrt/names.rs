//! What is called by a name. Before v4 a name may be given again, and holds from there on within its attributes; since then there may not be
//! two of it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::rc::Rc;

use super::parser::Statement;
use super::state::State;
use crate::error::SceneError;

/// What was named again, by its name, and what was so around the attributes that it was named in.
#[derive(Clone, Default)]
pub struct SecondNames {
    own: BTreeMap<String, String>,
    outer: Option<Rc<SecondNames>>,
}

impl SecondNames {
    /// What a name stands for, if it was named again.
    pub fn get(&self, name: &str) -> Option<&String> {
        let mut scope = Some(self);
        while let Some(names) = scope {
            if let Some(kept) = names.own.get(name) {
                return Some(kept);
            }
            scope = names.outer.as_deref();
        }
        None
    }

    /// From here on a name stands for this.
    fn insert(&mut self, name: String, kept: String) {
        self.own.insert(name, kept);
    }

    /// Those of attributes within others.
    pub fn within(outer: &Rc<Self>) -> Rc<Self> {
        Rc::new(Self { own: BTreeMap::new(), outer: Some(outer.clone()) })
    }
}

/// Names for what has one that is taken.
#[derive(Default)]
pub struct FreeNames(u64);

impl FreeNames {
    /// This name with a number behind it that makes it free.
    fn free(&mut self, name: &str, is_taken: impl Fn(&str) -> bool) -> String {
        loop {
            self.0 += 1;
            let other = format!("{name}_{}", self.0 + 1);
            if !is_taken(&other) {
                return other;
            }
        }
    }
}

impl State<'_> {
    /// `MakeNamedMaterial`.
    pub fn named_material(&mut self, statement: Statement) -> Result<(), SceneError> {
        let name = statement.texts[0].clone();
        let mut parameters = self.parameters("material", statement);
        let Some(kind) = parameters.text("type")?.map(str::to_string) else {
            return Err(parameters
                .place
                .error("a material has no `type`", "add one such as `\"string type\" \"diffuse\"`"));
        };
        parameters.kind = kind;
        let known = &mut self.context.named_materials;
        let kept = match known.contains_key(&name) {
            true => self.names.free(&name, |name| known.contains_key(name)),
            false => name.clone(),
        };
        known.insert(kept.clone(), Rc::new(parameters));
        Rc::make_mut(&mut self.graphics.materials).insert(name, kept);
        Ok(())
    }

    /// `Texture`.
    pub fn texture(&mut self, mut statement: Statement) -> Result<(), SceneError> {
        let kind = statement.texts.swap_remove(1);
        let name = statement.texts.swap_remove(0);
        let place = statement.place.clone();
        let parameters = Rc::new(self.parameters("texture", statement));
        let (textures, others) = match kind.as_str() {
            "float" => (&mut self.context.float_textures, &mut self.context.colour_textures),
            "spectrum" | "color" => (&mut self.context.colour_textures, &mut self.context.float_textures),
            _ => {
                let message = format!("a texture is of `{}`", super::lexer::shown(&kind));
                return Err(place.error(message, "write `float` or `spectrum`"));
            }
        };
        let before = self.graphics.textures.get(&name).unwrap_or(&name).clone();
        if let Entry::Vacant(free) = textures.entry(before.clone()) {
            free.insert(parameters);
            return Ok(());
        }
        // Numbers and colours may have one name, of which but one is named again.
        let kept = self.names.free(&name, |name| textures.contains_key(name) || others.contains_key(name));
        if let Some(other) = others.get(&before).cloned() {
            others.insert(kept.clone(), other);
        }
        textures.insert(kept.clone(), parameters);
        Rc::make_mut(&mut self.graphics.textures).insert(name, kept);
        Ok(())
    }
}
