//! The parameters of Disney's principled model.

use crate::bsdf::roughness::masking;
use crate::bsdf::{Argument, Arguments, Masking, Parameter, Preset};
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
    /// How facets hide one another.
    pub masking: Masking,
    /// How those of the clear coat do.
    pub clearcoat_masking: ClearcoatMasking,
    /// What tints are.
    pub tints: Tints,
}

/// What the hue of the surface is, that the dielectric and the sheen may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tints {
    /// Its colour with a largest channel of 1. F of what is tinted rises as Fresnel's does, and glass is not tinted.
    #[default]
    Brightest,
    /// Its colour with a luminance of 1 `[Burley12]`, of which saturated colours have channels far above 1. F of what is tinted is Schlick's,
    /// and glass takes tint and sheen too, as in Mitsuba.
    Luminance,
}

impl Tints {
    /// The hue of a colour; of black it is white.
    pub fn hue(self, colour: Spectrum) -> Spectrum {
        let one = match self {
            Self::Brightest => colour.max_component(),
            Self::Luminance => colour.luminance(),
        };
        if one > 0.0 { colour / one } else { Spectrum::ONE }
    }
}

/// What stands for the masking of the clear coat's facets, G of α = 0.25.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ClearcoatMasking {
    /// G / (4 |cos θ_o| |cos θ_i|) `[Burley12]`.
    #[default]
    OverCosines,
    /// G alone, as in Mitsuba: brighter by 4 at the normal, and darker at grazing angles.
    Shadows,
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
            masking: Masking::default(),
            clearcoat_masking: ClearcoatMasking::default(),
            tints: Tints::default(),
        }
    }
}

impl PrincipledSettings {
    /// What scene files may say of it.
    pub const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("base_color", "colour of the surface", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::number("metallic", "share of a metal", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::number("subsurface", "share of flat subsurface scattering", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::INDEX,
        Parameter::number("specular_tint", "hue of the dielectric's highlight", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::number("roughness", "perceptual roughness, √α, with α at least 10⁻⁴", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::number("anisotropic", "how far highlights are drawn out", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::number("sheen", "strength of the sheen of cloth", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::number("sheen_tint", "hue of the sheen", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::number("clearcoat", "strength of the clear coat", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::number("clearcoat_gloss", "gloss of the clear coat", 0.0, 1.0, Preset::Number(1.0)),
        Parameter::number("spec_trans", "share of glass; with any, `eta` may not vary", 0.0, 1.0, Preset::Number(0.0)),
        Parameter::MASKING,
        Parameter::choice(
            "clearcoat_masking",
            "shadowing of the clear coat over 4 cos cos, or alone",
            &["over_cosines", "shadows"],
        ),
        Parameter::choice(
            "tints",
            "hue by its largest channel, or by its luminance as published, which may give back far more than comes in",
            &["brightest", "luminance"],
        ),
    ];

    /// What these arguments of [`PARAMETERS`](Self::PARAMETERS) say.
    pub fn of(arguments: &Arguments) -> Self {
        let [base_color, numbers @ .., hiding, clearcoat_hiding, tints] = arguments.all::<15>();
        let [
            metallic,
            subsurface,
            eta,
            specular_tint,
            roughness,
            anisotropic,
            sheen,
            sheen_tint,
            clearcoat,
            clearcoat_gloss,
            spec_trans,
        ] = numbers.map(Argument::number);
        Self {
            base_color: base_color.colour(),
            metallic,
            subsurface,
            eta,
            specular_tint,
            roughness,
            anisotropic,
            sheen,
            sheen_tint,
            clearcoat,
            clearcoat_gloss,
            spec_trans,
            masking: masking(hiding),
            clearcoat_masking: [ClearcoatMasking::OverCosines, ClearcoatMasking::Shadows][clearcoat_hiding.choice()],
            tints: [Tints::Brightest, Tints::Luminance][tints.choice()],
        }
    }
}
