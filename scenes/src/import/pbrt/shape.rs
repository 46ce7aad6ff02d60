//! Shapes: what they become, with what they emit.

use std::f64::consts::PI;
use std::rc::Rc;

use glam::{DMat3, DMat4, DVec3};

use super::context::Context;
use super::material::{self, Material};
use super::parameters::Parameters;
use super::parser::Parameter;
use super::spectrum::{self, Quantity};
use super::texture::{self, Texture};
use super::transform::scale_of;
use super::triangles;
use crate::builder::MeshData;
use crate::error::SceneError;
use crate::import::mitsuba::mesh;
use crate::import::mitsuba::transform::{is_similarity, steps};
use crate::import::translation::{Lines, NoteKind, Place, number, numbers, quoted};
use crate::import::uv_map::UvMap;

/// A shape's form in its own frame.
pub enum Geometry {
    /// A file; its triangles where they are asked for, to know their area.
    Mesh { file: String, has_normals: bool, has_uvs: bool, triangles: Option<MeshData> },
    /// About the origin.
    Sphere { radius: f64 },
    /// Across the z axis.
    Disk { height: f64, radius: f64 },
    /// Around the z axis.
    Cylinder { low: f64, high: f64, radius: f64 },
}

/// A shape where it stands.
#[derive(Clone)]
pub struct Record {
    /// Its form.
    pub geometry: Rc<Geometry>,
    /// From its own frame to the world.
    pub transform: DMat4,
    /// Whether its front is turned over.
    pub reversed: bool,
    /// What it is made of.
    pub material: Material,
    /// Where it is not there.
    pub alpha: Option<Parameter>,
    /// What it emits.
    pub light: Option<Rc<Parameters>>,
    /// Its line.
    pub place: Place,
}

/// The form of a shape; `None`, and a note, where it has none.
pub fn read(parameters: &Parameters, keep: bool, context: &mut Context) -> Result<Option<Geometry>, SceneError> {
    let place = &parameters.place;
    let partial = |names: &[&str], whole: &dyn Fn(&str, f64) -> bool, context: &mut Context| {
        for name in names {
            if let Some(value) = parameters.float(name)?
                && !whole(name, value)
            {
                let text =
                    format!("a {} whose `{name}` is {value} is taken as whole", super::lexer::shown(&parameters.kind));
                context.approximate(parameters.place_of(name), text);
            }
        }
        Ok::<(), SceneError>(())
    };
    let geometry = match parameters.kind.as_str() {
        "sphere" => {
            let radius = parameters.positive("radius", 1.0)?;
            let whole = |name: &str, value: f64| match name {
                "zmin" => value <= -radius,
                "zmax" => value >= radius,
                _ => value >= 360.0,
            };
            partial(&["zmin", "zmax", "phimax"], &whole, context)?;
            Geometry::Sphere { radius }
        }
        "disk" => {
            let whole = |name: &str, value: f64| if name == "innerradius" { value <= 0.0 } else { value >= 360.0 };
            partial(&["innerradius", "phimax"], &whole, context)?;
            Geometry::Disk { height: parameters.float_or("height", 0.0)?, radius: parameters.positive("radius", 1.0)? }
        }
        "cylinder" => {
            partial(&["phimax"], &|_, value| value >= 360.0, context)?;
            let (low, high) = (parameters.float_or("zmin", -1.0)?, parameters.float_or("zmax", 1.0)?);
            if low >= high {
                return Err(place.error("a cylinder's `zmin` is not below its `zmax`", "give it some height"));
            }
            Geometry::Cylinder { low, high, radius: parameters.positive("radius", 1.0)? }
        }
        "trianglemesh" | "bilinearmesh" | "loopsubdiv" => {
            let data = triangles::read(parameters, context)?;
            if data.triangles.is_empty() {
                context.note(NoteKind::Ignored, place, "a mesh without triangles");
                return Ok(None);
            }
            let file = context.meshes.keep(mesh::obj(&data));
            let (has_normals, has_uvs) = (!data.normals.is_empty(), !data.uvs.is_empty());
            Geometry::Mesh { file, has_normals, has_uvs, triangles: keep.then_some(data) }
        }
        "plymesh" => triangles::ply(parameters, keep, context)?,
        kind => {
            let kind = super::lexer::shown(kind);
            context.approximate(place, format!("a shape `{kind}` is not known, and is left out"));
            return Ok(None);
        }
    };
    let what = match geometry {
        Geometry::Mesh { .. } => "`mesh`",
        Geometry::Sphere { .. } => "`sphere`",
        Geometry::Disk { .. } => "`disk`",
        Geometry::Cylinder { .. } => "`cylinder`",
    };
    context.mapped(parameters, what);
    parameters.skip(&["alpha", "shadowalpha"]);
    parameters.finish(context);
    Ok(Some(geometry))
}

/// The lines of a shape, the first of which is `header`.
pub fn written(record: &Record, header: &str, context: &mut Context) -> Result<Lines, SceneError> {
    let place = &record.place;
    let map = &record.transform;
    let opacity = match &record.alpha {
        Some(alpha) => Some(texture::read(alpha, Quantity::Reflectance, context)?),
        None => None,
    };
    let opacity = opacity.filter(|opacity| opacity.constant() != Some([1.0; 3]));
    let material = material::named(&record.material, opacity.as_ref(), place, context)?;
    let emission = match &record.light {
        Some(light) if record.material.is_interface(context) => {
            let text = "a shape of the material `interface` does not emit, as in pbrt-v4";
            context.note(NoteKind::Mapped, &light.place, text);
            None
        }
        Some(light) => emission(light, record, context)?,
        None => None,
    };
    let (kind, keys, transform) = form(record, context);
    let mirrored = DMat3::from_mat4(*map).determinant() < 0.0;
    // A mesh without normals has its front where its corners turn, after the transform.
    let other_side = mirrored && matches!(*record.geometry, Geometry::Mesh { has_normals: false, .. });
    let mut lines = Lines::default();
    lines.table(place, header);
    lines.key(place, "type", quoted(kind));
    for (key, value) in keys {
        lines.key(place, key, value);
    }
    lines.key(place, "material", quoted(&material));
    let is_mapped = context.mapped_materials.contains(&material)
        || emission.as_ref().is_some_and(|(emission, _)| emission.constant().is_none());
    if is_mapped && matches!(*record.geometry, Geometry::Mesh { has_uvs: false, .. }) {
        context.note(NoteKind::Mapped, place, "triangles without texture coordinates have pbrt's own");
        lines.key(place, "corner_uvs", "[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]");
    }
    if let (Some((emission, two_sided)), Some(light)) = (emission, &record.light) {
        lines.key(&light.place, "emission", emission.toml());
        if two_sided {
            lines.key(&light.place, "two_sided", "true");
        }
    }
    if record.reversed != other_side {
        lines.key(place, "flip", "true");
    }
    if let Some(steps) = steps(&[transform]) {
        lines.key(place, "transform", steps);
    }
    Ok(lines)
}

/// Type, keys and transform of a shape; what its transform stretches becomes a mesh.
fn form(record: &Record, context: &mut Context) -> (&'static str, Vec<(&'static str, String)>, DMat4) {
    let map = record.transform;
    let vector = |v: DVec3| numbers(&v.to_array());
    // The matrices of exporters have six digits.
    let (even, nearly) = (is_similarity(&map, 1e-9), is_similarity(&map, 1e-4));
    let round = |what: &str, context: &mut Context| match (even, nearly) {
        (true, _) => {}
        (false, true) => {
            context.approximate(
                &record.place,
                format!("a {what} is scaled evenly, where its transform differs by less than 0.0001"),
            );
        }
        (false, false) => {
            context.approximate(&record.place, format!("a {what} that its transform stretches becomes a mesh"));
        }
    };
    match *record.geometry {
        Geometry::Mesh { ref file, .. } => ("mesh", vec![("file", quoted(file))], map),
        Geometry::Disk { height, radius } => {
            let keys = [
                ("center", DVec3::new(0.0, 0.0, height)),
                ("edge_u", DVec3::new(radius, 0.0, 0.0)),
                ("edge_v", DVec3::new(0.0, radius, 0.0)),
            ];
            ("disk", keys.map(|(key, v)| (key, vector(v))).to_vec(), map)
        }
        Geometry::Sphere { radius } => {
            round("sphere", context);
            if even {
                return ("sphere", vec![("center", vector(DVec3::ZERO)), ("radius", number(radius))], map);
            }
            if nearly {
                let center = map.transform_point3(DVec3::ZERO);
                let radius = radius * scale_of(&map);
                return ("sphere", vec![("center", vector(center)), ("radius", number(radius))], DMat4::IDENTITY);
            }
            let file = context.meshes.keep(mesh::obj(&mesh::sphere(DVec3::ZERO, radius)));
            ("mesh", vec![("file", quoted(&file))], map)
        }
        Geometry::Cylinder { low, high, radius } => {
            round("cylinder", context);
            let (from, to) = (DVec3::new(0.0, 0.0, low), DVec3::new(0.0, 0.0, high));
            let keys = |from, to, radius| vec![("from", vector(from)), ("to", vector(to)), ("radius", number(radius))];
            if even {
                return ("cylinder", keys(from, to, radius), map);
            }
            if nearly {
                let ends = [from, to].map(|p| map.transform_point3(p));
                return ("cylinder", keys(ends[0], ends[1], radius * scale_of(&map)), DMat4::IDENTITY);
            }
            let file = context.meshes.keep(mesh::obj(&mesh::tube(from, to, radius)));
            ("mesh", vec![("file", quoted(&file))], map)
        }
    }
}

/// What a shape emits, and whether on both sides.
fn emission(light: &Parameters, record: &Record, context: &mut Context) -> Result<Option<(Texture, bool)>, SceneError> {
    if !matches!(light.kind.as_str(), "diffuse" | "area") {
        context.approximate(&light.place, format!("{} is not known, and is left out", light.title()));
        return Ok(None);
    }
    let two_sided = light.boolean("twosided")?.unwrap_or(false);
    let mut radiance = match light.text("filename")? {
        Some(name) => {
            let place = light.place_of("filename").clone();
            let file = context.file_name(name, &place);
            let scale = spectrum::scale(light, context)?;
            Texture::Image { file, encoding: None, wrap: "clamp", scale, map: UvMap::IDENTITY }
        }
        None => Texture::Constant(spectrum::light(light, "L", context)?),
    };
    if let Some(power) = light.float("power")?.filter(|power| *power > 0.0) {
        let area = area(&record.geometry, &record.transform);
        if matches!(radiance, Texture::Image { .. }) {
            context.approximate(&light.place, "the `power` of a light with an image is that of white");
        }
        let sides = if two_sided { 2.0 } else { 1.0 };
        if area > 0.0 {
            radiance = radiance.scaled([power / (sides * area * PI); 3]);
        }
    }
    light.skip(&["samples", "nsamples"]);
    light.finish(context);
    if radiance.constant() == Some([0.0; 3]) {
        context.note(NoteKind::Ignored, &light.place, "an emitter of radiance 0");
        return Ok(None);
    }
    context.mapped(light, "`emission`");
    Ok(Some((radiance, two_sided)))
}

/// The area of a shape in the world; of stretched spheres and cylinders about.
fn area(geometry: &Geometry, map: &DMat4) -> f64 {
    let scale = scale_of(map);
    match geometry {
        Geometry::Sphere { radius } => 4.0 * PI * (radius * scale).powi(2),
        Geometry::Cylinder { low, high, radius } => 2.0 * PI * radius * (high - low) * scale * scale,
        Geometry::Disk { radius, .. } => {
            let axes = DMat3::from_mat4(*map);
            PI * radius * radius * axes.x_axis.cross(axes.y_axis).length()
        }
        Geometry::Mesh { triangles, .. } => triangles.as_ref().map_or(0.0, |mesh| {
            let point = |i: u32| map.transform_point3(mesh.positions[i as usize]);
            let area = |t: &[u32; 3]| 0.5 * (point(t[1]) - point(t[0])).cross(point(t[2]) - point(t[0])).length();
            mesh.triangles.iter().map(area).sum()
        }),
    }
}
