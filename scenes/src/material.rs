//! What surfaces are made of.

use crate::texture::Texture;
use sampling::Vec3;
use sampling::bsdf::{Bsdf, Lambert, Lobes};

/// Names a material of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// What a surface is made of: it gives the BSDF of each of its points.
#[derive(Clone, Copy, Debug)]
pub enum Material {
    /// The same BSDF everywhere.
    Constant(Bsdf),
    /// A Lambertian surface whose albedo varies.
    Lambert {
        /// The albedo, in \[0, 1\].
        albedo: Texture,
    },
}

impl Material {
    /// The BSDF at a point; textures are read here, once per hit.
    #[inline]
    pub fn bsdf_at(&self, p: Vec3) -> Bsdf {
        match self {
            Material::Constant(bsdf) => *bsdf,
            Material::Lambert { albedo } => Bsdf::Lambert(Lambert { albedo: albedo.at(p) }),
        }
    }

    /// The kinds of scattering it has.
    pub fn lobes(&self) -> Lobes {
        match self {
            Material::Constant(bsdf) => bsdf.lobes(),
            Material::Lambert { .. } => Lobes::DIFFUSE_REFLECTION,
        }
    }

    /// True if reading it depends on the point.
    pub fn is_textured(&self) -> bool {
        matches!(self, Material::Lambert { albedo: Texture::Ramp { .. } })
    }

    /// True if it scatters as Lambert's law says, textured or not.
    pub fn is_lambertian(&self) -> bool {
        matches!(self, Material::Constant(Bsdf::Lambert(_)) | Material::Lambert { .. })
    }
}

impl<T: Into<Bsdf>> From<T> for Material {
    fn from(bsdf: T) -> Self {
        Material::Constant(bsdf.into())
    }
}
