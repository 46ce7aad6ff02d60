//! The parameters of Disney's principled model.

use crate::math::Spectrum;

/// What [`Principled`](super::Principled) is made of; each a share in [0, 1] but `eta`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledSettings {
    /// The colour of the surface.
    pub base_color: Spectrum,
    /// Of a metal, m.
    pub metallic: f32,
    /// Of subsurface scattering, flat, in the diffuse lobe.
    pub subsurface: f32,
    /// The index of the inside relative to the outside, > 0; not 1 where there is glass.
    pub eta: f32,
    /// How far the dielectric's F₀ takes the hue of the surface.
    pub specular_tint: f32,
    /// Perceptual roughness, √α.
    pub roughness: f32,
    /// How far the highlight is drawn out along the tangent.
    pub anisotropic: f32,
    /// Of sheen.
    pub sheen: f32,
    /// How far the sheen takes the hue of the surface.
    pub sheen_tint: f32,
    /// Of a clear coat of index 1.5.
    pub clearcoat: f32,
    /// From satin to gloss.
    pub clearcoat_gloss: f32,
    /// Of glass, t.
    pub spec_trans: f32,
}

impl Default for PrincipledSettings {
    fn default() -> Self {
        Self {
            base_color: Spectrum::splat(0.5),
            metallic: 0.0,
            subsurface: 0.0,
            eta: 1.5,
            specular_tint: 0.0,
            roughness: 0.5,
            anisotropic: 0.0,
            sheen: 0.0,
            sheen_tint: 0.5,
            clearcoat: 0.0,
            clearcoat_gloss: 1.0,
            spec_trans: 0.0,
        }
    }
}
