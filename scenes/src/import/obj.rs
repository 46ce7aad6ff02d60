//! Wavefront OBJ with its MTL libraries.
//!
//! The geometry is read by `tobj` from texts that have been checked and made plain first; faces may be any simple
//! polygons. `usemtl` and `g` divide it into groups, each of which becomes one shape, and one emitter if its material
//! has `Ke`; the front of a face, which emits, is where its corners run counter-clockwise, or where its normals point
//! if it has any. What becomes of a material is [`appearance`](super::appearance)'s rule.
//!
//! A library is looked for by the path after `mtllib`, from the OBJ's folder; then by its file name in that folder;
//! then each word of the line likewise. A library or a material that cannot be found gives a note, and a matte grey.
//!
//! An OBJ that is a whole scene gets a camera by [`viewpoint`]'s rule, and, if nothing in it emits, an environment of
//! radiance 1.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::appearance::{Appearance, Images};
use super::faces::{self, Faces};
use super::source::{self, Source};
use super::translation::{self, Lines, Note, NoteKind, Notes, Place, SCENE_HEADER, Translation};
use super::{mtl, solid, viewpoint};
use crate::builder::{MaterialName, MeshData, SceneBuilder, ShapeId};
use crate::error::SceneError;
use crate::material::MaterialId;

/// An OBJ file with its materials.
#[derive(Clone, Debug)]
pub struct Model {
    /// Triangles by group and material.
    pub groups: Vec<Group>,
    /// The materials by name.
    pub appearances: Vec<(String, Appearance)>,
    /// Whether the file has smoothing groups.
    pub has_smoothing: bool,
    /// What its materials became, what was approximated, and what was not found.
    pub notes: Notes,
}

/// The triangles of one group and material.
#[derive(Clone, Debug)]
pub struct Group {
    /// The name of the group.
    pub name: String,
    /// The triangles.
    pub mesh: MeshData,
    /// Index of the material in [`Model::appearances`].
    pub appearance: usize,
}

/// What a scene file says in place of a mesh file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Overrides {
    /// The material of all groups.
    pub material: Option<MaterialId>,
    /// The emission of the file's materials is left out.
    pub no_emission: bool,
}

impl Model {
    /// Reads a file and its libraries.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        Self::read(path, &contents(path)?)
    }

    /// The same for those who read neither smoothing groups nor libraries.
    pub fn open_unsmoothed(path: &Path) -> Result<Self, SceneError> {
        Self::read_with(path, &contents(path)?, false, false)
    }

    /// Reads the contents of the file at `path` for those who have a material for it: its libraries are not looked for.
    pub fn read_bare(path: &Path, bytes: &[u8]) -> Result<Self, SceneError> {
        Self::read_with(path, bytes, true, false)
    }

    /// Reads the contents of the file at `path`, and its libraries.
    pub fn read(path: &Path, bytes: &[u8]) -> Result<Self, SceneError> {
        Self::read_with(path, bytes, true, true)
    }

    fn read_with(path: &Path, bytes: &[u8], smooths: bool, has_materials: bool) -> Result<Self, SceneError> {
        let text = source::decode(path, bytes)?;
        let source = source::check(path, &text)?;
        if source.total.faces == 0 {
            return Err(SceneError::invalid("the file holds no faces", "add `f` lines").in_file(path));
        }
        let mut notes = Notes::default();
        for (keyword, (line, count)) in &source.ignored {
            let place = Place { file: path.into(), line: *line };
            notes.add(NoteKind::Approximated, &place, format!("`{keyword}` is not read ({count} of them)"));
        }
        if let Some(&line) = source.materials.get("").filter(|_| has_materials) {
            let place = Place { file: path.into(), line };
            notes.add(NoteKind::Mapped, &place, "`usemtl` without a name means the material without a name");
        }
        let mut appearances = if has_materials {
            read_libraries(path, &source, &mut notes)?
        } else {
            source.materials.keys().map(|name| (name.clone(), Appearance::missing())).collect()
        };
        let groups = read_groups(path, &source, smooths, &mut appearances, &mut notes)?;
        let mut model = Model { groups, appearances, has_smoothing: source.smooths(), notes };
        model.mend_glass(&Place { file: path.into(), line: 1 });
        Ok(model)
    }

    /// Adds all groups to a scene; returns the shapes.
    pub fn add_to(mut self, builder: &mut SceneBuilder, overrides: Overrides) -> Vec<ShapeId> {
        self.notes.tell(builder);
        let mut ids: HashMap<(usize, bool), MaterialId> = HashMap::new();
        let mut shapes = Vec::new();
        let groups = std::mem::take(&mut self.groups);
        for group in groups.into_iter().filter(|group| !group.mesh.triangles.is_empty()) {
            let (name, appearance) = &self.appearances[group.appearance];
            let has_uvs = !group.mesh.uvs.is_empty();
            let material = overrides.material.unwrap_or_else(|| {
                let mapped = has_uvs && appearance.is_mapped();
                let name = if name.is_empty() { "unnamed" } else { name };
                let named = MaterialName { name: name.to_owned(), line: None };
                let id = ids.entry((group.appearance, mapped));
                *id.or_insert_with(|| builder.named_material(appearance.material(mapped), named))
            });
            let shape = builder.mesh(group.mesh, material);
            if translation::can_be_label(&group.name) {
                builder.label(shape, &group.name);
            }
            if let Some(emission) = appearance.emitted(has_uvs).filter(|_| !overrides.no_emission) {
                builder.emit(shape, emission);
            }
            shapes.push(shape);
        }
        shapes
    }

    /// Whether any group emits.
    pub fn emits(&self) -> bool {
        let emits = |group: &Group| self.appearances[group.appearance].1.emitted(!group.mesh.uvs.is_empty()).is_some();
        self.groups.iter().any(emits)
    }

    /// Turns the faces of closed glass outwards, and takes its faces out that lie in opaque ones.
    fn mend_glass(&mut self, place: &Place) {
        let transmits: Vec<bool> = self.groups.iter().map(|g| self.appearances[g.appearance].1.transmits()).collect();
        for i in (0..self.groups.len()).filter(|&i| transmits[i]) {
            let mut mesh = std::mem::take(&mut self.groups[i].mesh);
            let found = solid::orient_outwards(&mut mesh);
            let opaque = (0..self.groups.len()).filter(|&j| !transmits[j]);
            let opaque: Vec<&MeshData> = opaque.map(|j| &self.groups[j].mesh).collect();
            let removed = solid::remove_contacts(&mut mesh, &opaque);
            self.groups[i].mesh = mesh;
            let name = &self.appearances[self.groups[i].appearance].0;
            let mut note = |what: &str| {
                self.notes.add(NoteKind::Approximated, place, format!("material `{name}`: {what}"));
            };
            if !found.closed {
                note("it is glass but not closed: the back of its faces counts as inside");
            }
            if found.turned > 0 {
                note(&format!("{} triangles of a closed body were turned to face outwards", found.turned));
            }
            if removed > 0 {
                note(&format!("{removed} triangles in the plane of an opaque surface are left out: optical contact"));
            }
        }
    }
}

/// The bytes of an OBJ file.
pub fn contents(path: &Path) -> Result<Vec<u8>, SceneError> {
    crate::file::read(path).map_err(|error| SceneError::unreadable(path, error, "give the path of an OBJ file"))
}

/// Opens an OBJ file as a whole scene, with what is to be told of it.
pub fn scene(path: &Path, name: &str, size: Option<(u32, u32)>) -> Result<(SceneBuilder, Vec<Note>), SceneError> {
    let mut model = Model::open(path)?;
    let mut builder = SceneBuilder::new(name);
    let meshes: Vec<&MeshData> = model.groups.iter().map(|group| &group.mesh).collect();
    let (emits, place) = (model.emits(), Place { file: path.into(), line: 1 });
    viewpoint::furnish(&mut builder, &meshes, emits, size, &mut model.notes, &place);
    let notes = model.notes.all().to_vec();
    model.add_to(&mut builder, Overrides::default());
    Ok((builder, notes))
}

/// The whole scene as the text of a scene file, whose paths start at the folder `base`.
pub fn translate(path: &Path, base: &Path) -> Result<Translation, SceneError> {
    let mut model = Model::open(path)?;
    let meshes: Vec<&MeshData> = model.groups.iter().map(|group| &group.mesh).collect();
    let camera = viewpoint::choose(&meshes, model.emits(), (256, 256));
    let place = Place { file: path.into(), line: 1 };
    viewpoint::tell(&camera, model.emits(), &mut model.notes, &place);
    let mut lines = Lines::default();
    lines.push(
        &place,
        format!("{SCENE_HEADER} {}.", path.file_name().unwrap_or_default().to_string_lossy().escape_default()),
    );
    lines.append(viewpoint::table(&camera, &place));
    lines.table(&place, "[[shapes]]");
    lines.key(&place, "type", translation::quoted("mesh"));
    lines.key(&place, "file", translation::quoted(&translation::named_from(path, base)));
    if !model.emits() {
        lines.append(viewpoint::light(&place));
    }
    Ok(Translation::new(lines, Vec::new(), model.notes))
}

/// Reads every library that can be found, and notes those that cannot.
fn read_libraries(path: &Path, source: &Source, notes: &mut Notes) -> Result<Vec<(String, Appearance)>, SceneError> {
    let mut appearances: Vec<(String, Appearance)> = Vec::new();
    let mut known = HashSet::new();
    for (line, stated) in &source.libraries {
        let files = find_library(path.parent().unwrap_or(Path::new("")), stated);
        if files.is_empty() {
            let place = Place { file: path.into(), line: *line };
            let text = format!("the material library `{stated}` was not found; put it beside the OBJ file");
            notes.add(NoteKind::Approximated, &place, text);
        }
        for file in files {
            let unreadable = |error| SceneError::unreadable(&file, error, "make the material library readable");
            let bytes = crate::file::read(&file).map_err(unreadable)?;
            let mut images = Images::within(file.parent().unwrap_or(Path::new("")));
            for statements in mtl::parse(&file, &source::decode(&file, &bytes)?)? {
                if !source.materials.contains_key(&statements.name) {
                    continue;
                }
                let place = Place { file: file.as_path().into(), line: statements.line };
                if !known.insert(statements.name.clone()) {
                    let text = format!("there is more than one material `{}`: the first holds", statements.name);
                    notes.add(NoteKind::Approximated, &place, text);
                    continue;
                }
                let appearance = Appearance::of(&statements, &mut images);
                let title = format!("material `{}`", statements.name);
                notes.add(NoteKind::Mapped, &place, format!("{title} becomes `{}`", appearance.bsdf.name()));
                for (kind, text) in &appearance.notes {
                    // What matters for no material is told once.
                    let all = if *kind == NoteKind::Ignored { text.clone() } else { format!("{title}: {text}") };
                    notes.add(*kind, &place, all);
                }
                appearances.push((statements.name, appearance));
            }
        }
    }
    for (name, line) in &source.materials {
        if !known.contains(name) {
            let place = Place { file: path.into(), line: *line };
            let text = format!("there is no material `{name}`: a matte grey stands for it");
            notes.add(NoteKind::Approximated, &place, text);
            appearances.push((name.clone(), Appearance::missing()));
        }
    }
    Ok(appearances)
}

/// The library files that an `mtllib` statement names.
fn find_library(folder: &Path, stated: &str) -> Vec<PathBuf> {
    let find = |name: &str| {
        let name = name.replace('\\', "/");
        let base = Path::new(&name).file_name().map(|base| folder.join(base));
        [Some(folder.join(&name)), base].into_iter().flatten().find(|file| file.is_file())
    };
    match find(stated) {
        Some(file) => vec![file],
        None => stated.split_whitespace().filter_map(find).collect(),
    }
}

/// Makes meshes of the faces.
fn read_groups(
    path: &Path,
    source: &Source,
    smooths: bool,
    appearances: &mut Vec<(String, Appearance)>,
    notes: &mut Notes,
) -> Result<Vec<Group>, SceneError> {
    let Faces { meshes, turned } = faces::read(source, smooths).map_err(|error| error.in_file(path))?;
    let (mut groups, mut grey) = (Vec::new(), None);
    for (run, mesh) in meshes.into_iter().filter(|(_, mesh)| !mesh.triangles.is_empty()) {
        let known = appearances.iter().position(|(name, _)| run.material == Some(name));
        // Of faces that have none.
        let appearance = known.unwrap_or_else(|| {
            *grey.get_or_insert_with(|| {
                appearances.push(("grey".to_owned(), Appearance::missing()));
                appearances.len() - 1
            })
        });
        let (name, made) = &appearances[appearance];
        if mesh.uvs.is_empty() && (made.is_mapped() || made.maps.emission.is_some()) {
            let place = Place { file: path.into(), line: source.materials.get(name).copied().unwrap_or(1) };
            let text = format!("the maps of material `{name}` are left out on faces without texture coordinates");
            notes.add(NoteKind::Approximated, &place, text);
        }
        groups.push(Group { name: run.name.to_owned(), mesh, appearance });
    }
    if turned > 0 {
        let place = Place { file: path.into(), line: 1 };
        notes.add(NoteKind::Mapped, &place, format!("{turned} triangles were turned to the side of their normals"));
    }
    if groups.is_empty() {
        let error = SceneError::invalid("every face of the file is without area", "add faces that span an area");
        return Err(error.in_file(path));
    }
    Ok(groups)
}
