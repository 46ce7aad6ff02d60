//! What varies over a surface is looked at before anything is rendered: that it stays in its domain, that arguments go together, and
//! what kinds of scattering there are.

use super::MaterialName;
use super::check::check_domain;
use super::parts::{Parts, Placed};
use crate::error::SceneError;
use crate::material::{Material, Parameters, Scattering, Varying};
use crate::ray::SurfacePoint;
use crate::shape::{Analytic, Sphere, Triangle};
use crate::surface::{Attributes, Chart};
use crate::texture::{SurfaceCoordinates, Texture};
use sampling::bsdf::{Bsdf, Domain, Lobes};
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2};

/// Points looked at inside of a surface.
const POINTS: usize = 1024;

/// A surface, to be looked at.
pub(super) enum Looked<'a> {
    Analytic(&'a Analytic, &'a Chart),
    /// The attributes are those of all triangles.
    Mesh(&'a [Triangle], Option<&'a Attributes>),
}

impl<'a> Looked<'a> {
    /// The surface that has just been placed; `index` is the place of its attributes, if it has any.
    pub fn new(parts: &'a Parts, placed: &Placed, index: usize) -> Self {
        match placed {
            Placed::Analytic => {
                let last = parts.analytic.len() - 1;
                Self::Analytic(&parts.analytic[last], &parts.analytic_infos[last].chart)
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
            Self::Analytic(surface, _) => {
                let (low, high) = texture.range_around(surface.middle(), |axis| surface.reach(axis));
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
    fn points(&self) -> Box<dyn Iterator<Item = SurfaceCoordinates> + '_> {
        match *self {
            Self::Analytic(surface, chart) => {
                let at = move |at: SurfacePoint| chart.coordinates(at.p, at.ng);
                let poles = match surface {
                    Analytic::Sphere(sphere) => sphere_poles(sphere),
                    Analytic::Disk(_) | Analytic::Cylinder(_) => Vec::new(),
                };
                let spread = (0..POINTS).map(move |i| surface.sample(spread(i)));
                Box::new(poles.into_iter().chain(spread).map(at))
            }
            Self::Mesh(triangles, attributes) => {
                let point = move |index: usize, b: Vec2| {
                    let [v0, v1, v2] = triangles[index].0;
                    let p = v0 * (1.0 - b.x - b.y) + v1 * b.x + v2 * b.y;
                    let Some(attributes) = attributes else {
                        return SurfaceCoordinates { uv: b, ..SurfaceCoordinates::of(p) };
                    };
                    attributes.coordinates(p, attributes.first + index as u32, b)
                };
                let corners =
                    (0..triangles.len()).flat_map(move |i| [Vec2::ZERO, Vec2::X, Vec2::Y].map(|b| point(i, b)));
                let inside = (0..if triangles.is_empty() { 0 } else { POINTS }).map(move |i| {
                    let b = spread(i);
                    point(i % triangles.len(), if b.x + b.y > 1.0 { Vec2::ONE - b } else { b })
                });
                Box::new(corners.chain(inside))
            }
        }
    }
}

/// The ends of a sphere's axes and of a diagonal.
fn sphere_poles(sphere: &Sphere) -> Vec<SurfacePoint> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE.normalize()];
    let outwards = axes.into_iter().flat_map(|axis| [axis, -axis]);
    outwards.map(|outwards| sphere.project(sphere.center.as_dvec3(), outwards.as_dvec3(), 1.0)).collect()
}

/// The `i`-th of a sequence of points that spreads over the unit square: multiples of the reciprocals of the plastic number.
pub(super) fn spread(i: usize) -> Vec2 {
    let part = |step: f64| ((i as f64 + 0.5) * step).fract() as f32;
    vec2(part(0.754_877_666_246_692_8), part(0.569_840_290_998_053_3))
}

/// Says what is wrong with a material on a surface, if anything is; else gives BSDFs that each of its parts has there, among them one
/// for every kind of scattering.
pub(super) fn look(
    material: &Material,
    surface: &Looked,
    called: &MaterialName,
    shape: &str,
) -> Result<Vec<Vec<Bsdf>>, SceneError> {
    let look = |part: &Varying| {
        let seen = look_at(part, surface, &format!("{called} on {shape}"))?;
        match matches!(material, Material::Sided(_))
            && seen.iter().any(|bsdf| bsdf.lobes().intersects(Lobes::TRANSMISSION))
        {
            true => Err(SceneError::invalid(
                format!("light goes through a side of {called}"),
                "make its `front` and its `back` of what reflects alone",
            )),
            false => Ok(seen),
        }
    };
    material.parts().iter().map(look).collect::<Result<_, _>>().map_err(|error| called.place(error))
}

fn look_at(varying: &Varying, surface: &Looked, name: &str) -> Result<Vec<Bsdf>, SceneError> {
    check_coordinates(&varying.all_textures().collect::<Vec<_>>(), surface, name)?;
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
    let mut seen: Vec<Bsdf> = Vec::new();
    // One of a kind is enough: a large mesh has millions of points.
    let mut note = |bsdf: Bsdf| {
        let kind = |bsdf: &Bsdf| (bsdf.lobes(), bsdf.is_anisotropic());
        if seen.iter().all(|other| kind(other) != kind(&bsdf)) {
            seen.push(bsdf);
        }
    };
    for point in surface.points() {
        let bsdf = varying.with(|texture| texture.at(&point)).map_err(|misfit| {
            let message = format!("the `{}` of {name} doesn't go with its other parameters", misfit.parameter);
            SceneError::invalid(message, misfit.mend)
        })?;
        check_fixed(varying, &bsdf, name)?;
        note(bsdf);
    }
    let extremes = extremes(varying, surface);
    extremes.iter().try_for_each(|bsdf| check_fixed(varying, bsdf, name))?;
    extremes.into_iter().for_each(note);
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

/// What is read by texture coordinates or vertex colours needs a surface that has them.
pub(super) fn check_coordinates(textures: &[&Texture], surface: &Looked, name: &str) -> Result<(), SceneError> {
    let lacks = |what: &str| {
        let mend = format!("give a mesh {what}, or use something that does without");
        Err(SceneError::invalid(format!("{name} is read by {what}, which there are none of"), mend))
    };
    let coloured = textures.contains(&&Texture::VertexColour);
    let Looked::Mesh(_, attributes) = surface else {
        return if coloured { lacks("vertex colours") } else { Ok(()) };
    };
    if textures.iter().any(|texture| texture.needs_uv())
        && attributes.is_none_or(|attributes| attributes.uvs.is_empty())
    {
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
