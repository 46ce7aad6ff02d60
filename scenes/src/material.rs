//! What surfaces are made of.

mod scattering;

pub use scattering::{Blend, Parameters, Scattering};

use crate::builder::Similarity;
use crate::relief::{Relief, ReliefMap};
use crate::subsurface::Body;
use crate::texture::Texture;
use sampling::Vec3;
use sampling::bsdf::{Bsdf, Lobes};
use sampling::math::Spectrum;

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
    /// Something else on its front than on its back.
    Sided(Box<Sided>),
}

/// A surface whose two sides are made of different things, neither of which light goes through.
///
/// Which side is met is decided by the geometric normal, which points out of the front. All that a vertex of a path scatters stays
/// on the side that was met, so that one BSDF is enough for it, from whichever end of the path it was found.
#[derive(Clone, Debug)]
pub struct Sided {
    /// The front and the back; of the same opacity.
    sides: [Varying; 2],
}

/// A side of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// Where the geometric normal points, or both where they are the same.
    Front,
    /// The other.
    Back,
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
        Varying::of(Scattering::lambert(albedo)).into()
    }

    /// What it is made of where that varies or depends on the side: nothing, one thing, or the front and the back.
    pub fn parts(&self) -> &[Varying] {
        match self {
            Self::Constant(_) | Self::Subsurface(_) => &[],
            Self::Varying(varying) => std::slice::from_ref(varying),
            Self::Sided(sided) => &sided.sides,
        }
    }

    /// The same, to be changed.
    pub(crate) fn parts_mut(&mut self) -> &mut [Varying] {
        match self {
            Self::Constant(_) | Self::Subsurface(_) => &mut [],
            Self::Varying(varying) => std::slice::from_mut(varying),
            Self::Sided(sided) => &mut sided.sides,
        }
    }

    /// How much of what meets it is met, if not all is. It is the same from both sides, for else light would pass it one way more
    /// easily than the other.
    #[inline]
    pub fn opacity(&self) -> Option<&Texture> {
        self.parts().first().and_then(|part| part.opacity.as_ref())
    }

    /// The kinds of scattering it has.
    pub fn lobes(&self) -> Lobes {
        match self {
            Self::Constant(bsdf) => bsdf.lobes(),
            Self::Varying(varying) => varying.seen.lobes,
            Self::Subsurface(body) => body.boundary().lobes() | Lobes::DIFFUSE_REFLECTION,
            Self::Sided(sided) => sided.sides[0].seen.lobes | sided.sides[1].seen.lobes,
        }
    }

    /// True if reading it depends on the point.
    pub fn is_textured(&self) -> bool {
        self.parts().iter().flat_map(Varying::all_textures).any(|texture| !texture.is_constant())
    }

    /// True if it is not met everywhere.
    pub fn is_masked(&self) -> bool {
        self.opacity().is_some()
    }

    /// True if it scatters as Lambert's law says, textured or not.
    pub fn is_lambertian(&self) -> bool {
        match self {
            Self::Constant(bsdf) => matches!(bsdf, Bsdf::Lambert(_)),
            Self::Varying(_) | Self::Sided(_) => self.parts().iter().all(Varying::is_lambertian),
            Self::Subsurface(_) => false,
        }
    }

    /// The largest albedo of a Lambertian surface; `None` for others, and where it follows the surface.
    pub fn lambertian_albedo(&self) -> Option<Spectrum> {
        match self {
            Self::Constant(Bsdf::Lambert(lambert)) => Some(lambert.albedo),
            Self::Varying(_) | Self::Sided(_) => {
                let largest = |most: Spectrum, part: &Varying| {
                    part.relief.is_none().then_some(())?;
                    Some(most.max(part.scattering.lambertian_albedo()?))
                };
                self.parts().iter().try_fold(Spectrum::ZERO, largest)
            }
            Self::Constant(_) | Self::Subsurface(_) => None,
        }
    }

    /// True if surfaces of it need to know in which direction texture coordinates grow.
    pub fn needs_derivatives(&self) -> bool {
        match self {
            Self::Constant(bsdf) => bsdf.is_anisotropic(),
            Self::Varying(_) | Self::Sided(_) => self.parts().iter().any(Varying::needs_derivatives),
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

impl From<Sided> for Material {
    fn from(sided: Sided) -> Self {
        Self::Sided(Box::new(sided))
    }
}

impl Sided {
    /// A surface with this front and this back, of which `opacity` is met, or all; an opacity of their own is lost. That no light
    /// goes through them is known once they have been looked at.
    pub fn new(sides: [Varying; 2], opacity: Option<Texture>) -> Self {
        Self { sides: sides.map(|side| Varying { opacity: opacity.clone(), ..side }) }
    }

    /// The side that a ray of direction `d` meets where the front's geometric normal is `ng`: what it is made of, and which it is.
    #[inline]
    pub(crate) fn met(&self, d: Vec3, ng: Vec3) -> (&Varying, Side) {
        let [front, back] = &self.sides;
        if d.dot(ng) < 0.0 { (front, Side::Front) } else { (back, Side::Back) }
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
        let others = self.relief.as_ref().map(|relief| relief.map.texture()).into_iter().chain(&self.opacity);
        self.scattering.textures().into_iter().chain(others)
    }

    /// Notes what BSDFs it has on a surface.
    pub(crate) fn include(&mut self, seen: &[Bsdf]) {
        for bsdf in seen {
            self.seen.lobes |= bsdf.lobes();
            self.seen.anisotropic |= bsdf.is_anisotropic() || self.scattering.may_be_anisotropic();
        }
    }

    fn is_lambertian(&self) -> bool {
        self.scattering.is_lambertian() && self.relief.is_none()
    }

    fn needs_derivatives(&self) -> bool {
        self.seen.anisotropic || self.relief.is_some()
    }

    /// Makes it what it is where the scene's coordinates are others.
    pub(crate) fn resemble(&mut self, similarity: &Similarity) {
        if let Some(relief) = &mut self.relief {
            let heights = matches!(relief.map, ReliefMap::Heights(_));
            let texture = relief.map.texture_mut();
            let placed = texture.clone().resembling(similarity);
            *texture = if heights { placed.times(similarity.scale as f32) } else { placed };
        }
        for texture in self.scattering.textures_mut().into_iter().chain(&mut self.opacity) {
            *texture = texture.clone().resembling(similarity);
        }
    }

    /// Makes it what it is once the scene's coordinates have been shifted by `−shift`.
    pub(crate) fn recentre(&mut self, shift: glam::DVec3) {
        let relief = self.relief.as_mut().map(|relief| relief.map.texture_mut());
        for texture in self.scattering.textures_mut().into_iter().chain(relief).chain(&mut self.opacity) {
            *texture = texture.clone().recentred(shift);
        }
    }
}
