//! What varies over a surface is looked at before anything is rendered: that it stays in its domain, that arguments go together, and
//! what kinds of scattering there are.

use super::MaterialName;
use super::check::check_domain;
use super::parts::{Parts, Placed};
use crate::error::SceneError;
use crate::material::{Parameters, Scattering, Varying};
use crate::shape::{Sphere, Triangle};
use crate::surface::{Attributes, SphereInfo};
use crate::texture::{SurfaceCoordinates, Texture};
use sampling::bsdf::{Bsdf, Domain};
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2};

/// Points looked at inside of a surface.
const POINTS: usize = 1024;

/// A surface, to be looked at.
pub(super) enum Looked<'a> {
    Sphere(&'a Sphere, &'a SphereInfo),
    /// The attributes are those of all triangles.
    Mesh(&'a [Triangle], Option<&'a Attributes>),
}

impl<'a> Looked<'a> {
    /// The surface that has just been placed; `index` is the place of its attributes, if it has any.
    pub fn new(parts: &'a Parts, placed: &Placed, index: usize) -> Self {
        match placed {
            Placed::Sphere(_) => {
                let last = parts.spheres.len() - 1;
                Self::Sphere(&parts.spheres[last], &parts.sphere_infos[last])
            }
            Placed::Quad { range, .. } | Placed::Mesh(range) => {
                Self::Mesh(&parts.triangles[range.clone()], parts.attributes.get(index))
            }
        }
    }

    /// Values of a texture on the surface between which all others lie.
    pub fn ends(&self, texture: &Texture) -> Vec<Spectrum> {
        if let Some((low, high)) = texture.range() {
            return vec![low, high];
        }
        match self {
            Self::Sphere(sphere, _) => {
                let (low, high) = texture.range_in_ball(sphere.center, sphere.radius);
                vec![Spectrum::splat(low), Spectrum::splat(high)]
            }
            Self::Mesh(_, attributes) if *texture == Texture::VertexColour => {
                attributes.map(|attributes| attributes.colours.clone()).unwrap_or_default()
            }
            Self::Mesh(triangles, _) => {
                triangles.iter().flat_map(|t| t.0).map(|p| texture.at(&SurfaceCoordinates::of(p))).collect()
            }
        }
    }

    /// Vertices or poles, and points spread over the surface.
    fn points(&self) -> Vec<SurfaceCoordinates> {
        match self {
            Self::Sphere(sphere, info) => {
                let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE.normalize()];
                let poles = axes.into_iter().flat_map(|axis| [axis, -axis]);
                let spread = (0..POINTS).map(|i| sampling::warp::uniform_sphere(spread(i)));
                let point = |outwards: Vec3| {
                    let ng = if info.flipped { -outwards } else { outwards };
                    info.coordinates(sphere.center + outwards * sphere.radius, ng)
                };
                poles.chain(spread).map(point).collect()
            }
            Self::Mesh(triangles, attributes) => {
                let point = |index: usize, b: Vec2| {
                    let [v0, v1, v2] = triangles[index].0;
                    let p = v0 * (1.0 - b.x - b.y) + v1 * b.x + v2 * b.y;
                    let Some(attributes) = attributes else {
                        return SurfaceCoordinates { uv: b, ..SurfaceCoordinates::of(p) };
                    };
                    attributes.coordinates(p, attributes.first + index as u32, b)
                };
                let corners = (0..triangles.len()).flat_map(|i| [Vec2::ZERO, Vec2::X, Vec2::Y].map(|b| point(i, b)));
                let inside = (0..if triangles.is_empty() { 0 } else { POINTS }).map(|i| {
                    let b = spread(i);
                    point(i % triangles.len(), if b.x + b.y > 1.0 { Vec2::ONE - b } else { b })
                });
                corners.chain(inside).collect()
            }
        }
    }
}

/// The `i`-th of a sequence of points that spreads over the unit square: multiples of the reciprocals of the plastic number.
fn spread(i: usize) -> Vec2 {
    let part = |step: f64| ((i as f64 + 0.5) * step).fract() as f32;
    vec2(part(0.754_877_666_246_692_8), part(0.569_840_290_998_053_3))
}

/// Says what is wrong with a material on a surface, if anything is; else gives BSDFs that it has there, among them one for every
/// kind of scattering.
pub(super) fn look(
    varying: &Varying,
    surface: &Looked,
    material: &MaterialName,
    shape: &str,
) -> Result<Vec<Bsdf>, SceneError> {
    let name = &format!("{material} on {shape}");
    look_at(varying, surface, name).map_err(|error| material.place(error))
}

fn look_at(varying: &Varying, surface: &Looked, name: &str) -> Result<Vec<Bsdf>, SceneError> {
    check_coordinates(varying, surface, name)?;
    if let Some(opacity) = &varying.opacity {
        check_ends(("opacity", Domain::Number(0.0, 1.0), opacity), surface, name)?;
    }
    look_at_scattering(&varying.scattering, surface, name)
}

fn look_at_scattering(scattering: &Scattering, surface: &Looked, name: &str) -> Result<Vec<Bsdf>, SceneError> {
    match scattering {
        Scattering::Same(bsdf) => Ok(vec![*bsdf]),
        Scattering::Model(parameters) => look_at_parameters(parameters, surface, name),
        Scattering::Blend(blend) => {
            check_ends(("amount", Domain::Number(0.0, 1.0), &blend.amount), surface, name)?;
            let [first, second] = &blend.parts;
            let mut seen = look_at_scattering(first, surface, name)?;
            seen.extend(look_at_scattering(second, surface, name)?);
            Ok(seen)
        }
    }
}

fn look_at_parameters(varying: &Parameters, surface: &Looked, name: &str) -> Result<Vec<Bsdf>, SceneError> {
    varying.textures().try_for_each(|texture| check_ends(texture, surface, name))?;
    let mut seen = Vec::new();
    for point in surface.points() {
        let bsdf = varying.with(|texture| texture.at(&point)).map_err(|misfit| {
            let message = format!("the `{}` of {name} doesn't go with its other parameters", misfit.parameter);
            SceneError::invalid(message, misfit.mend)
        })?;
        check_fixed(varying, &bsdf, name)?;
        seen.push(bsdf);
    }
    let extremes = extremes(varying, surface);
    extremes.iter().try_for_each(|bsdf| check_fixed(varying, bsdf, name))?;
    seen.extend(extremes);
    Ok(seen)
}

fn check_ends(
    (parameter, domain, texture): (&str, Domain, &Texture),
    surface: &Looked,
    name: &str,
) -> Result<(), SceneError> {
    surface.ends(texture).into_iter().try_for_each(|value| check_domain(value, domain, parameter, name))
}

/// The BSDFs where textures are at their ends, one of them or all: a kind of scattering that only few points have is there.
fn extremes(varying: &Parameters, surface: &Looked) -> Vec<Bsdf> {
    let textures: Vec<(&Texture, Spectrum, Spectrum)> = varying
        .textures()
        .filter_map(|(.., texture)| {
            let by_mean = |a: &Spectrum, b: &Spectrum| a.mean().total_cmp(&b.mean());
            let ends = surface.ends(texture);
            Some((texture, ends.iter().copied().min_by(by_mean)?, ends.iter().copied().max_by(by_mean)?))
        })
        .collect();
    let mut found = Vec::new();
    for odd in 0..=textures.len() {
        for all_high in [false, true] {
            let value = |texture: &Texture| {
                let place = textures.iter().position(|(other, ..)| std::ptr::eq(*other, texture));
                place.map_or(Spectrum::ZERO, |place| {
                    let (_, low, high) = textures[place];
                    if all_high != (place == odd) { high } else { low }
                })
            };
            // Ends that don't occur together need not go together.
            found.extend(varying.with(value));
        }
    }
    found
}

/// A material that is read by texture coordinates or vertex colours needs a surface that has them.
fn check_coordinates(varying: &Varying, surface: &Looked, name: &str) -> Result<(), SceneError> {
    let lacks = |what: &str| {
        let mend = format!("give a mesh {what}, or the material something that does without");
        Err(SceneError::invalid(format!("{name} is read by {what}, which there are none of"), mend))
    };
    let coloured = varying.all_textures().any(|texture| *texture == Texture::VertexColour);
    let Looked::Mesh(_, attributes) = surface else {
        return if coloured { lacks("vertex colours") } else { Ok(()) };
    };
    if varying.all_textures().any(Texture::needs_uv) && attributes.is_none_or(|attributes| attributes.uvs.is_empty()) {
        return lacks("texture coordinates");
    }
    if coloured && attributes.is_none_or(|attributes| attributes.colours.is_empty()) {
        return lacks("vertex colours");
    }
    Ok(())
}

/// What a model has tables for, and the index of what light goes through, has one value all over a surface.
fn check_fixed(varying: &Parameters, bsdf: &Bsdf, name: &str) -> Result<(), SceneError> {
    let Some((parameter, ..)) = varying.textures().find(|(parameter, ..)| bsdf.fixed().contains(parameter)) else {
        return Ok(());
    };
    let mend = match parameter {
        "roughness" | "alpha" | "alpha_x" | "alpha_y" => {
            "give a number; it may vary with the distributions ggx and beckmann, without compensation"
        }
        _ => "give a number",
    };
    Err(SceneError::invalid(format!("the `{parameter}` of {name} varies, but must be the same all over it"), mend))
}
