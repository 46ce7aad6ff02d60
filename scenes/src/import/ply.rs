//! PLY polygon files, ASCII and binary of either byte order.
//!
//! Of the element `vertex` are read `x y z`; `nx ny nz`; texture coordinates, `u v`, `s t`, `texture_u texture_v` or `texture_s
//! texture_t`; and the colours `red green blue` or `r g b`, whole numbers as sRGB shares of the greatest, others linear. Of `face`
//! the list `vertex_indices` or `vertex_index`, any simple polygons; of `tristrips` the same, where −1 begins another strip.
//! Everything else is skipped; colours and texture coordinates of faces, and an alpha of vertices that is not full, are told of. As in OBJ files the front of a triangle is where its corners run counter-clockwise, or where its
//! normals point if it has any.
//!
//! Nothing is allocated by a count that the file is too short to hold.

mod body;
mod header;
pub mod write;

use std::ops::Range;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3};

use super::translation::{Note, NoteKind, Notes, Place};
use super::{polygon, viewpoint};
use crate::builder::{MeshData, SceneBuilder};
use crate::error::SceneError;
use crate::material::Material;
use crate::progress::{self, Activity};
use crate::texture::{Encoding, Texture};
use body::{Body, Fault};
use header::{Element, Header, Kind, Scalar};
use sampling::bsdf::Lambert;

/// The largest magnitude of a coordinate.
const MAX_COORDINATE: f64 = 1e15;

/// The names of what is read of a vertex, by their place among its values.
const SLOTS: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
    &["red", "r"],
    &["green", "g"],
    &["blue", "b"],
    &["alpha", "a"],
];

/// What a file holds.
#[derive(Debug)]
pub struct Model {
    /// The mesh.
    pub mesh: MeshData,
    /// What was changed or left out.
    pub notes: Vec<(NoteKind, String)>,
}

/// Reads a file.
///
/// # Errors
/// What is wrong with it, with the line of its header or the number of the element.
pub fn open(path: &Path) -> Result<Model, SceneError> {
    let unreadable = |error| SceneError::unreadable(path, error, "give the path of a PLY file");
    read(&crate::file::read(path).map_err(unreadable)?).map_err(|error| error.in_file(path))
}

/// Whether a file that begins with these bytes has normals, and texture coordinates of its vertices.
pub fn properties(start: &[u8]) -> [bool; 2] {
    let end = start.windows(10).position(|window| window == b"end_header").unwrap_or(start.len().min(65_536));
    let header = String::from_utf8_lossy(&start[..end]);
    let of_vertices = header.lines().map(str::trim).skip_while(|line| !line.starts_with("element vertex")).skip(1);
    let properties = of_vertices.take_while(|line| !line.starts_with("element"));
    let names: Vec<&str> = properties.filter_map(|line| line.split_whitespace().last()).collect();
    let has = |wanted: &[&str]| wanted.iter().all(|name| names.contains(name));
    [has(&["nx"]), [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]].iter().any(|pair| has(pair))]
}

/// Opens a file as a whole scene, with what is to be told of it: what has colours is matte of these colours, the rest a matte grey.
pub fn scene(path: &Path, name: &str, size: Option<(u32, u32)>) -> Result<(SceneBuilder, Vec<Note>), SceneError> {
    let Model { mesh, notes: changed } = open(path)?;
    let mut builder = SceneBuilder::new(name);
    let (mut notes, place) = (Notes::default(), Place { file: path.into(), line: 1 });
    changed.into_iter().for_each(|(kind, text)| notes.add(kind, &place, text));
    viewpoint::furnish(&mut builder, &[&mesh], false, size, &mut notes, &place);
    let reflects = |colour: &Spectrum| colour.max_component() <= 1.0;
    let coloured = !mesh.colours.is_empty() && mesh.colours.iter().all(reflects);
    if coloured {
        notes.add(NoteKind::Mapped, &place, "the vertices' colours become `vertex_colours` of a `lambert`");
    } else if !mesh.colours.is_empty() {
        let text = "the vertices' colours exceed 1, and are not taken for albedos";
        notes.add(NoteKind::Approximated, &place, text);
    }
    notes.tell(&mut builder);
    let grey = Lambert { albedo: Spectrum::splat(0.5) };
    let material = builder.material(if coloured { Material::lambert(Texture::VertexColour) } else { grey.into() });
    builder.mesh(mesh, material);
    Ok((builder, notes.all().to_vec()))
}

/// Reads the bytes of a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Model, SceneError> {
    let header = Header::read(bytes)?;
    let mut body = Body::behind(&header, bytes);
    let at = |left: usize| progress::report(Activity::Reading, 1.0 - left as f64 / bytes.len() as f64);
    let (mut mesh, mut notes) = (MeshData::default(), Vec::new());
    for element in &header.elements {
        body.check_size(element)?;
        match element.name.as_str() {
            "vertex" if mesh.positions.is_empty() => {
                let clear = read_vertices(element, &mut body, &mut mesh, at)?;
                if clear > 0 {
                    let text = format!("the alpha of vertices is left out, which is not full of {clear} of them");
                    notes.push((NoteKind::Approximated, text));
                }
            }
            "vertex" => return Err(element.error("a second list of vertices", "keep one")),
            "face" => {
                notes.extend(left_out(element));
                read_lists(element, &mut body, &mut mesh, at, add_polygon)?;
            }
            "tristrips" => read_lists(element, &mut body, &mut mesh, at, add_strips)?,
            _ => body.skip(element)?,
        }
    }
    if mesh.triangles.is_empty() {
        let message = match mesh.positions.len() {
            0 => "the file holds no faces".to_string(),
            points => format!("the file holds no faces: it is a cloud of {points} points, which has no surface"),
        };
        return Err(SceneError::invalid(message, "save it as a mesh of polygons or triangle strips"));
    }
    let turned = turn_to_normals(&mut mesh);
    if turned > 0 {
        notes.push((NoteKind::Mapped, format!("{turned} triangles were turned to the side of their normals")));
    }
    let behind = body.rest.trim_ascii().len();
    if behind > 0 {
        let text = format!("{behind} bytes behind the last element that the header counts are left out");
        notes.push((NoteKind::Approximated, text));
    }
    Ok(Model { mesh, notes })
}

/// What is told of the properties of faces that are not read and would be seen.
fn left_out(element: &Element) -> impl Iterator<Item = (NoteKind, String)> {
    let named = |names: &[&str]| element.properties.iter().any(|property| names.contains(&property.name.as_str()));
    let colours = named(&["red", "r"]).then_some("the colours of faces are left out: give them to vertices");
    let wedges = named(&["texcoord"])
        .then_some("the texture coordinates of faces, `texcoord`, are left out: give them to vertices, as `s` and `t`");
    [colours, wedges].into_iter().flatten().map(|text| (NoteKind::Approximated, text.to_string()))
}

/// Reads the vertices, and counts those whose alpha is not full.
fn read_vertices(
    element: &Element,
    body: &mut Body,
    mesh: &mut MeshData,
    at: impl Fn(usize),
) -> Result<usize, SceneError> {
    let place = |property: &header::Property| {
        let slot = SLOTS.iter().position(|names| names.contains(&property.name.as_str()))?;
        matches!(property.kind, Kind::Scalar(_)).then_some(slot)
    };
    let places: Vec<Option<usize>> = element.properties.iter().map(place).collect();
    let has = |slots: std::ops::Range<usize>| slots.into_iter().all(|slot| places.contains(&Some(slot)));
    if !has(0..3) {
        return Err(element.error("the vertices lack `x`, `y` or `z`", "add `property float x`, and so on"));
    }
    if element.count > u64::from(u32::MAX) {
        return Err(element.error("there are more than 2³² vertices", "divide the file"));
    }
    let (normals, uvs, colours) = (has(3..6), has(6..8), has(8..11));
    let layout = Layout { places, normals, uvs, colours };
    // That the file holds so many has been checked.
    let count = element.count as usize;
    mesh.positions.reserve_exact(count);
    mesh.normals.reserve_exact(if layout.normals { count } else { 0 });
    mesh.uvs.reserve_exact(if layout.uvs { count } else { 0 });
    mesh.colours.reserve_exact(if layout.colours { count } else { 0 });
    let read = |range, body| read_run(element, &layout, range, body);
    let mut clear = 0;
    let join = |(mut run, run_clear): (MeshData, usize)| {
        clear += run_clear;
        mesh.positions.append(&mut run.positions);
        mesh.normals.append(&mut run.normals);
        mesh.uvs.append(&mut run.uvs);
        mesh.colours.append(&mut run.colours);
    };
    body.read_runs(element, read, join, at)?;
    Ok(clear)
}

/// What there is of vertices.
struct Layout {
    /// Where each property goes among the values that are read.
    places: Vec<Option<usize>>,
    normals: bool,
    uvs: bool,
    colours: bool,
}

/// Some of the vertices, and how many of them have an alpha that is not full.
fn read_run(
    element: &Element,
    layout: &Layout,
    range: Range<u64>,
    mut body: Body,
) -> Result<(MeshData, usize), SceneError> {
    let (mut mesh, mut clear) = (MeshData::default(), 0);
    let mut values = [0.0f64; SLOTS.len()];
    // Without an alpha all is opaque.
    values[11] = 1.0;
    for index in range {
        let mut vertex = || -> Result<(), Fault> {
            for (property, place) in element.properties.iter().zip(&layout.places) {
                match (property.kind, place) {
                    (Kind::Scalar(scalar), Some(slot)) => {
                        values[*slot] = colour_share(scalar, *slot, body.scalar(scalar)?);
                    }
                    (kind, _) => body.skip_value(kind)?,
                }
            }
            let usable = |x: &f64| x.abs() <= MAX_COORDINATE;
            if !values[..3].iter().chain(&values[6..]).all(usable) {
                return Err(Fault::new("a number is not finite, or beyond 1e15", "give finite numbers"));
            }
            Ok(())
        };
        vertex().map_err(|fault| element.fault(index, &body, fault))?;
        let [x, y, z, nx, ny, nz, u, v, r, g, b, alpha] = values;
        clear += usize::from(alpha < 1.0);
        mesh.positions.push(DVec3::new(x, y, z));
        if layout.normals {
            // What is not a number stands for none.
            mesh.normals.push(DVec3::new(nx, ny, nz).normalize_or_zero().as_vec3());
        }
        if layout.uvs {
            mesh.uvs.push(Vec2::new(u as f32, v as f32));
        }
        if layout.colours {
            mesh.colours.push(Spectrum::new(r as f32, g as f32, b as f32));
        }
    }
    Ok((mesh, clear))
}

/// A value as it is; one of a colour that is a whole number is an sRGB share of the greatest of its kind.
fn colour_share(scalar: Scalar, slot: usize, value: f64) -> f64 {
    match scalar.greatest() {
        Some(greatest) if slot >= 8 => f64::from(Encoding::Srgb.decode((value / greatest).clamp(0.0, 1.0) as f32)),
        _ => value,
    }
}

/// Adds the triangles that a list of vertices is.
type Add = fn(&[i64], &[DVec3], &mut Vec<[u32; 3]>) -> Result<(), Fault>;

/// Reads the lists of vertices of an element, and what `add` makes of each.
fn read_lists(
    element: &Element,
    body: &mut Body,
    mesh: &mut MeshData,
    at: impl Fn(usize),
    add: Add,
) -> Result<(), SceneError> {
    if element.count > 0 && mesh.positions.is_empty() {
        return Err(element.error("there are no vertices before them", "put the element `vertex` first"));
    }
    let named = |name: &str| matches!(name, "vertex_indices" | "vertex_index");
    let list = |property: &header::Property| match property.kind {
        Kind::List { item, .. } => named(&property.name) && item.greatest().is_some(),
        Kind::Scalar(_) => false,
    };
    let Some(wanted) = element.properties.iter().position(list) else {
        return Err(element.error(
            "there is no list `vertex_indices` of whole numbers",
            "add `property list uchar int vertex_indices`",
        ));
    };
    let MeshData { positions, triangles, .. } = mesh;
    triangles.reserve(if element.name == "face" { element.count as usize } else { 0 });
    let read = |range: Range<u64>, mut body: Body| {
        let (mut corners, mut run) = (Vec::new(), Vec::new());
        for index in range {
            let mut face = || -> Result<(), Fault> {
                for (place, property) in element.properties.iter().enumerate() {
                    match property.kind {
                        Kind::List { count, item } if place == wanted => body.list(count, item, &mut corners)?,
                        kind => body.skip_value(kind)?,
                    }
                }
                add(&corners, positions, &mut run)
            };
            face().map_err(|fault| element.fault(index, &body, fault))?;
        }
        Ok(run)
    };
    body.read_runs(element, read, |mut run| triangles.append(&mut run), at)
}

/// The vertex of an index.
fn vertex(index: i64, vertices: usize) -> Result<u32, Fault> {
    if (0..vertices as i64).contains(&index) {
        return Ok(index as u32);
    }
    Err(Fault::new(format!("there is no vertex {index}"), format!("the file has {vertices}, counted from 0")))
}

fn add_polygon(corners: &[i64], positions: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Result<(), Fault> {
    let vertices = positions.len();
    if let &[a, b, c] = corners {
        triangles.push([vertex(a, vertices)?, vertex(b, vertices)?, vertex(c, vertices)?]);
        return Ok(());
    }
    if corners.len() < 3 {
        return Err(Fault::new(format!("it has {} corners", corners.len()), "a face has at least 3"));
    }
    let corners: Vec<u32> = corners.iter().map(|&corner| vertex(corner, vertices)).collect::<Result<_, _>>()?;
    let points: Vec<DVec3> = corners.iter().map(|&corner| positions[corner as usize]).collect();
    triangles.extend(polygon::triangulate(&points).map(|triangle| triangle.map(|i| corners[i])));
    Ok(())
}

/// Every other triangle of a strip is wound the other way; those with a vertex twice only turn it.
fn add_strips(corners: &[i64], positions: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Result<(), Fault> {
    let vertices = positions.len();
    for strip in corners.split(|&corner| corner == -1) {
        strip.iter().try_for_each(|&corner| vertex(corner, vertices).map(|_| ()))?;
        for (i, triple) in strip.windows(3).enumerate() {
            let [a, b, c] = [triple[0] as u32, triple[1] as u32, triple[2] as u32];
            if a != b && b != c && c != a {
                triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }
    Ok(())
}

/// Turns triangles over whose normals point to their back, and counts them.
fn turn_to_normals(mesh: &mut MeshData) -> usize {
    let MeshData { positions, triangles, normals, .. } = mesh;
    if normals.is_empty() {
        return 0;
    }
    let faces_back = |triangle: &&mut [u32; 3]| {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
        let normal: Vec3 = triangle.iter().map(|&corner| normals[corner as usize]).sum();
        (b - a).cross(c - a).dot(normal.as_dvec3()) < 0.0
    };
    triangles.par_iter_mut().filter(faces_back).map(|triangle| triangle.swap(1, 2)).count()
}

#[cfg(test)]
mod tests;
