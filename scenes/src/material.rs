//! What surfaces are made of.

mod scattering;

pub use scattering::{Blend, Parameters, Scattering};

use crate::relief::Relief;
use crate::subsurface::Body;
use crate::texture::Texture;
use sampling::bsdf::{Arguments, Bsdf, Lobes};

/// Names a material of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// What a surface is made of: it gives the BSDF of each of its points.
#[derive(Clone, Debug)]
pub enum Material {
    /// The same BSDF everywhere.
    Constant(Bsdf),
    /// Something varies over the surface.
    Varying(Box<Varying>),
    /// The boundary of a body that light goes through.
    Subsurface(Box<Body>),
}

/// A surface of which something varies.
#[derive(Clone, Debug)]
pub struct Varying {
    /// What gives its BSDFs.
    pub scattering: Scattering,
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
        let arguments = Arguments::presets(model.parameters);
        Varying::of(Scattering::new(model, arguments, vec![(0, albedo)]).expect("an albedo alone")).into()
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
            Self::Varying(varying) => varying.scattering.is_lambertian() && varying.relief.is_none(),
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
    /// Without relief, and met everywhere.
    pub fn of(scattering: Scattering) -> Self {
        let seen = Seen { lobes: Lobes::NONE, anisotropic: false };
        Self { scattering, relief: None, opacity: None, seen }
    }

    /// The textures of parameters, relief and opacity.
    pub fn all_textures(&self) -> impl Iterator<Item = &Texture> {
        let others = self.relief.as_ref().map(Relief::texture).into_iter().chain(&self.opacity);
        self.scattering.textures().into_iter().chain(others)
    }

    /// Notes the lobes of one of its BSDFs.
    fn include(&mut self, bsdf: &Bsdf) {
        self.seen.lobes |= bsdf.lobes();
        self.seen.anisotropic |= bsdf.is_anisotropic() || self.scattering.may_be_anisotropic();
    }

    /// The same after the scene's coordinates have been shifted by `−shift`.
    pub(crate) fn recentred(mut self, shift: glam::DVec3) -> Self {
        let relief = self.relief.as_mut().map(Relief::texture_mut);
        for texture in self.scattering.textures_mut().into_iter().chain(relief).chain(&mut self.opacity) {
            *texture = texture.clone().recentred(shift);
        }
        self
    }
}
