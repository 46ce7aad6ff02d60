//! What surfaces are made of.

use crate::subsurface::Body;
use crate::texture::Texture;
use sampling::Vec3;
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
    /// One model, of which some parameters vary over the surface.
    Varying(Box<Varying>),
    /// The boundary of a body that light goes through.
    Subsurface(Box<Body>),
}

/// A model of which some parameters vary over the surface.
#[derive(Clone, Debug)]
pub struct Varying {
    model: &'static ModelEntry,
    /// Those of the parameters that do not vary.
    arguments: Arguments,
    /// Places in the model's list of parameters, and what gives them.
    textures: Vec<(usize, Texture)>,
    /// Every lobe that it has on the surfaces seen so far.
    lobes: Lobes,
    anisotropic: bool,
}

impl Material {
    /// A Lambertian surface whose albedo varies.
    pub fn lambert(albedo: Texture) -> Self {
        let model = Bsdf::model("lambert").expect("it is in the list");
        Varying::new(model, Arguments::presets(model.parameters), vec![(0, albedo)]).into()
    }

    /// The BSDF at a point; textures are read here, once per hit.
    #[inline]
    pub fn bsdf_at(&self, p: Vec3) -> Bsdf {
        match self {
            Self::Constant(bsdf) => *bsdf,
            Self::Varying(varying) => varying.at(p),
            Self::Subsurface(body) => body.boundary(),
        }
    }

    /// The kinds of scattering it has.
    pub fn lobes(&self) -> Lobes {
        match self {
            Self::Constant(bsdf) => bsdf.lobes(),
            Self::Varying(varying) => varying.lobes,
            Self::Subsurface(body) => body.boundary().lobes() | Lobes::DIFFUSE_REFLECTION,
        }
    }

    /// True if reading it depends on the point.
    pub fn is_textured(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Subsurface(_) => false,
            Self::Varying(varying) => varying.textures.iter().any(|(_, texture)| !texture.is_constant()),
        }
    }

    /// True if it scatters as Lambert's law says, textured or not.
    pub fn is_lambertian(&self) -> bool {
        match self {
            Self::Constant(bsdf) => matches!(bsdf, Bsdf::Lambert(_)),
            Self::Varying(varying) => varying.model.name == "lambert",
            Self::Subsurface(_) => false,
        }
    }

    /// True if turning a surface of it about its normal changes something.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Self::Constant(bsdf) => bsdf.is_anisotropic(),
            Self::Varying(varying) => varying.anisotropic,
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
        Self { model, arguments, textures, lobes: Lobes::NONE, anisotropic: false }
    }

    /// The textures, each with the name and the domain of the parameter that it gives.
    pub fn textures(&self) -> impl Iterator<Item = (&'static str, Domain, &Texture)> {
        self.textures.iter().map(|(place, texture)| {
            let parameter = &self.model.parameters[*place];
            (parameter.name, parameter.domain, texture)
        })
    }

    /// The BSDF where textures have the values that `value` gives.
    ///
    /// # Errors
    ///
    /// Those of the model: arguments that don't go together.
    pub fn with(&self, value: impl Fn(&Texture) -> Spectrum) -> Result<Bsdf, Misfit> {
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
    pub(crate) fn include(&mut self, bsdf: &Bsdf) {
        self.lobes |= bsdf.lobes();
        // Where one width varies, the two differ somewhere, wherever it was looked at.
        let width = |(name, ..): (&str, Domain, &Texture)| matches!(name, "alpha_x" | "alpha_y" | "n_u" | "n_v");
        self.anisotropic |= bsdf.is_anisotropic() || self.textures().any(width);
    }

    /// The BSDF at a point. Arguments are tried when the scene is built, at vertices and extremes; should they not go together at a
    /// point between, it scatters what is not a number, so that it is counted and reported.
    fn at(&self, p: Vec3) -> Bsdf {
        let invalid = |_| Lambert { albedo: Spectrum::splat(f32::NAN) }.into();
        self.with(|texture| texture.at(p)).unwrap_or_else(invalid)
    }

    /// The same after the scene's coordinates have been shifted by `−shift`.
    pub(crate) fn recentred(mut self, shift: glam::DVec3) -> Self {
        self.textures.iter_mut().for_each(|(_, texture)| *texture = texture.recentred(shift));
        self
    }
}
