//! What surfaces are made of.

use crate::relief::Relief;
use crate::subsurface::Body;
use crate::texture::{SurfaceCoordinates, Texture};
use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, Lambert, Lobes, Misfit, ModelEntry};
use sampling::math::Spectrum;

/// Names a material of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// What a surface is made of: it gives the BSDF of each of its points.
#[derive(Clone, Debug)]
pub enum Material {
    /// The same BSDF everywhere.
    Constant(Bsdf),
    /// One model, of which something varies over the surface.
    Varying(Box<Varying>),
    /// The boundary of a body that light goes through.
    Subsurface(Box<Body>),
}

/// A model of which something varies over the surface.
#[derive(Clone, Debug)]
pub struct Varying {
    model: &'static ModelEntry,
    /// Those of the parameters that do not vary.
    arguments: Arguments,
    /// Places in the model's list of parameters, and what gives them.
    textures: Vec<(usize, Texture)>,
    /// The model, if no parameter varies.
    constant: Option<Bsdf>,
    /// What tilts its normals.
    pub relief: Option<Relief>,
    /// How much of what meets it is met, in [0, 1]; the rest passes as if nothing were there.
    pub opacity: Option<Texture>,
    /// What is known of it where it has been looked at.
    seen: Seen,
}

/// What is known of a material where it has been looked at: on the surfaces that have it, once the scene is built.
#[derive(Clone, Copy, Debug)]
struct Seen {
    lobes: Lobes,
    anisotropic: bool,
}

impl Material {
    /// A Lambertian surface whose albedo varies.
    pub fn lambert(albedo: Texture) -> Self {
        let model = Bsdf::model("lambert").expect("it is in the list");
        Varying::new(model, Arguments::presets(model.parameters), vec![(0, albedo)]).into()
    }

    /// What varies of it, if anything does.
    pub fn varying(&self) -> Option<&Varying> {
        match self {
            Self::Constant(_) | Self::Subsurface(_) => None,
            Self::Varying(varying) => Some(varying),
        }
    }

    /// The kinds of scattering it has.
    pub fn lobes(&self) -> Lobes {
        match self {
            Self::Constant(bsdf) => bsdf.lobes(),
            Self::Varying(varying) => varying.seen.lobes,
            Self::Subsurface(body) => body.boundary().lobes() | Lobes::DIFFUSE_REFLECTION,
        }
    }

    /// True if reading it depends on the point.
    pub fn is_textured(&self) -> bool {
        self.varying().is_some_and(|varying| varying.all_textures().any(|texture| !texture.is_constant()))
    }

    /// True if it is not met everywhere.
    pub fn is_masked(&self) -> bool {
        self.varying().is_some_and(|varying| varying.opacity.is_some())
    }

    /// True if it scatters as Lambert's law says, textured or not.
    pub fn is_lambertian(&self) -> bool {
        match self {
            Self::Constant(bsdf) => matches!(bsdf, Bsdf::Lambert(_)),
            Self::Varying(varying) => varying.model.name == "lambert" && varying.relief.is_none(),
            Self::Subsurface(_) => false,
        }
    }

    /// Notes what BSDFs it has on a surface.
    pub(crate) fn include(&mut self, seen: &[Bsdf]) {
        if let Self::Varying(varying) = self {
            seen.iter().for_each(|bsdf| varying.include(bsdf));
        }
    }

    /// True if surfaces of it need to know in which direction texture coordinates grow.
    pub fn needs_derivatives(&self) -> bool {
        match self {
            Self::Constant(bsdf) => bsdf.is_anisotropic(),
            Self::Varying(varying) => varying.seen.anisotropic || varying.relief.is_some(),
            Self::Subsurface(_) => false,
        }
    }
}

impl<T: Into<Bsdf>> From<T> for Material {
    fn from(bsdf: T) -> Self {
        Self::Constant(bsdf.into())
    }
}

impl From<Varying> for Material {
    fn from(varying: Varying) -> Self {
        Self::Varying(Box::new(varying))
    }
}

impl Varying {
    /// The model with these arguments, but for the parameters at these places of its list, which textures give.
    pub fn new(model: &'static ModelEntry, arguments: Arguments, textures: Vec<(usize, Texture)>) -> Self {
        let seen = Seen { lobes: Lobes::NONE, anisotropic: false };
        let constant = if textures.is_empty() { (model.from_arguments)(&arguments).ok() } else { None };
        Self { model, arguments, textures, constant, relief: None, opacity: None, seen }
    }

    /// A BSDF that is the same everywhere, to be given relief or an opacity.
    pub fn of(bsdf: Bsdf) -> Self {
        let model = Bsdf::model(bsdf.name()).expect("every model is in the list");
        let seen = Seen { lobes: Lobes::NONE, anisotropic: false };
        let arguments = Arguments::presets(model.parameters);
        Self { model, arguments, textures: Vec::new(), constant: Some(bsdf), relief: None, opacity: None, seen }
    }

    /// The name of its model.
    pub fn model(&self) -> &'static str {
        self.model.name
    }

    /// The textures of parameters, each with the name and the domain of the parameter that it gives.
    pub fn textures(&self) -> impl Iterator<Item = (&'static str, Domain, &Texture)> {
        self.textures.iter().map(|(place, texture)| {
            let parameter = &self.model.parameters[*place];
            (parameter.name, parameter.domain, texture)
        })
    }

    /// The textures of parameters, relief and opacity.
    pub fn all_textures(&self) -> impl Iterator<Item = &Texture> {
        let others = self.relief.as_ref().map(Relief::texture).into_iter().chain(&self.opacity);
        self.textures.iter().map(|(_, texture)| texture).chain(others)
    }

    /// The BSDF where textures have the values that `value` gives.
    ///
    /// # Errors
    ///
    /// Those of the model: arguments that don't go together.
    pub fn with(&self, value: impl Fn(&Texture) -> Spectrum) -> Result<Bsdf, Misfit> {
        if let Some(bsdf) = self.constant {
            return Ok(bsdf);
        }
        let mut arguments = self.arguments;
        for (place, texture) in &self.textures {
            // Rounding may leave a domain whose borders the texture touches.
            let argument = match self.model.parameters[*place].domain {
                Domain::Number(from, to) => Argument::Number(value(texture).mean().clamp(from, to)),
                Domain::Colour(from, to) => {
                    Argument::Colour(Spectrum::from(value(texture).to_array().map(|channel| channel.clamp(from, to))))
                }
                domain => unreachable!("no texture gives {domain}"),
            };
            arguments.set(*place, argument);
        }
        (self.model.from_arguments)(&arguments)
    }

    /// Notes the lobes of one of its BSDFs.
    fn include(&mut self, bsdf: &Bsdf) {
        self.seen.lobes |= bsdf.lobes();
        // Where one width varies, the two differ somewhere, wherever it was looked at.
        let width = |(name, ..): (&str, Domain, &Texture)| matches!(name, "alpha_x" | "alpha_y" | "n_u" | "n_v");
        self.seen.anisotropic |= bsdf.is_anisotropic() || self.textures().any(width);
    }

    /// The BSDF at a point; textures are read here, once per hit. Arguments are tried when the scene is built, at vertices and
    /// extremes; should they not go together at a point between, it scatters what is not a number, so that it is counted and
    /// reported.
    pub(crate) fn bsdf_at(&self, at: &SurfaceCoordinates) -> Bsdf {
        let invalid = |_| Lambert { albedo: Spectrum::splat(f32::NAN) }.into();
        self.with(|texture| texture.at(at)).unwrap_or_else(invalid)
    }

    /// The same after the scene's coordinates have been shifted by `−shift`.
    pub(crate) fn recentred(mut self, shift: glam::DVec3) -> Self {
        let textures = self.textures.iter_mut().map(|(_, texture)| texture);
        let relief = self.relief.as_mut().map(Relief::texture_mut);
        for texture in textures.chain(relief).chain(&mut self.opacity) {
            *texture = texture.clone().recentred(shift);
        }
        self
    }
}
