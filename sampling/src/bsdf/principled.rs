//! Disney's principled model.

mod lobes;
mod settings;

pub use settings::{ClearcoatMasking, PrincipledSettings, Tints};

use lobes::{gtr1, sample_gtr1};

use super::fresnel::schlick;
use super::half::Half;
use super::{
    Arguments, Bsdf, BsdfModel, BsdfSample, Ggx, Lobes, Masking, Misfit, Parameter, RoughDielectric, TransportMode,
    fresnel_dielectric, survival_of,
};
use crate::math::{Spectrum, reflect, same_hemisphere};
use crate::warp::{INV_PI, cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{Vec2, Vec3};

/// A sum of lobes [Burley12, section 5; Burley15, section 5]: diffuse with retro-reflection, flat subsurface and sheen;
/// specular, of a metal or of a dielectric; clearcoat; and the glass of 2015.
///
/// With m the metallic share, t the share of glass and g = (1 − m) t, from outside
///
/// f_s = (1 − m)(1 − t) (f_diffuse + f_dielectric) + m f_metal + g f_glass + ¼ clearcoat f_clearcoat,
///
/// and from inside g f_glass alone; without glass the model is two-sided. Glass is [`RoughDielectric`], its transmission
/// coloured by √base_color; refraction takes one colour at the way in and one at the way out.
///
/// Departures. The dielectric share of the specular lobe has Fresnel's equations for `eta`, not Schlick's approximation (of
/// the index, eta = 2 / (1 − √(0.08 specular)) − 1 is 2012's `specular`). Masking has the lobe's own α, not a remapped one, and is
/// of either kind ([`Masking`]). Tints are scaled to a largest channel of 1, unless [`Tints`] says otherwise. α is at least
/// [`Ggx::MIN_ALPHA`], whatever the roughness, 0 included.
///
/// The lobes are added, not layered, and retro-reflection and sheen are added energy: see [`MAX_ALBEDO`](BsdfModel::MAX_ALBEDO).
/// Left out: 2015's diffuse transmission of thin surfaces and its diffusion profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    base_color: Spectrum,
    /// The colour of sheen, times its strength and its share of the surface.
    sheen: Spectrum,
    /// F₀ of the tinted dielectric over F₀ of an untinted one.
    tint: Spectrum,
    /// The share of the dielectric that is tinted: all of it by [`Tints::Brightest`], whose tint says how far.
    tinted: f32,
    tints: Tints,
    metallic: f32,
    subsurface: f32,
    roughness: f32,
    /// A quarter of the strength of the clearcoat.
    clearcoat: f32,
    clearcoat_alpha: f32,
    /// F₀ of the dielectric.
    f0: f32,
    /// g.
    glass: f32,
    eta: f32,
    ggx: Ggx,
    masking: Masking,
    clearcoat_masking: ClearcoatMasking,
}

/// The values of a pair of directions, and the density.
#[derive(Clone, Copy, Default)]
struct Values {
    diffuse: Spectrum,
    glossy: Spectrum,
    transmitted: Spectrum,
    pdf: f32,
}

/// The probabilities of the lobes, for one direction.
#[derive(Clone, Copy)]
struct Choice {
    diffuse: f32,
    specular: f32,
    clearcoat: f32,
    glass: f32,
}

impl Principled {
    /// The model with these settings.
    pub fn new(settings: PrincipledSettings) -> Self {
        let PrincipledSettings { base_color, metallic, eta, specular_tint, roughness, sheen, sheen_tint, .. } =
            settings;
        let hue = settings.tints.hue(base_color);
        let tinted = |tint: f32| Spectrum::splat(1.0 - tint) + hue * tint;
        let diffuse = (1.0 - metallic) * (1.0 - settings.spec_trans);
        let (sheen_share, tint, share_tinted) = match settings.tints {
            Tints::Brightest => (diffuse, tinted(specular_tint), 1.0),
            Tints::Luminance => (1.0 - metallic, hue, specular_tint),
        };
        let aspect = (1.0 - 0.9 * settings.anisotropic).sqrt();
        let alpha = |scale: f32| (roughness * roughness * scale).max(Ggx::MIN_ALPHA);
        Self {
            base_color,
            sheen: tinted(sheen_tint) * (sheen * sheen_share),
            tint,
            tinted: share_tinted,
            tints: settings.tints,
            metallic,
            subsurface: settings.subsurface,
            roughness,
            clearcoat: 0.25 * settings.clearcoat,
            clearcoat_alpha: 0.1 + (0.001 - 0.1) * settings.clearcoat_gloss,
            f0: fresnel_dielectric(1.0, eta).reflected,
            glass: (1.0 - metallic) * settings.spec_trans,
            eta,
            ggx: Ggx::new(alpha(1.0 / aspect), alpha(aspect)),
            masking: settings.masking,
            clearcoat_masking: settings.clearcoat_masking,
        }
    }

    /// (1 − m)(1 − t).
    #[inline]
    fn diffuse(&self) -> f32 {
        1.0 - self.metallic - self.glass
    }

    /// The interface of the glass.
    #[inline]
    fn interface(&self) -> RoughDielectric {
        RoughDielectric::with_facets(self.eta, self.ggx.into()).masked(self.masking)
    }

    /// Whether light at `wo` is inside the glass.
    #[inline]
    fn is_inside(&self, wo: Vec3) -> bool {
        self.glass > 0.0 && wo.z < 0.0
    }

    /// The probabilities of the lobes for light at this cosine outside: about their shares of the albedo.
    #[inline]
    fn choice(&self, cos: f32) -> Choice {
        let fresnel = schlick(cos);
        let rising = |f0: f32| f0 + (1.0 - f0) * fresnel;
        let dielectric = self.f0.max(0.04);
        let f0 = dielectric + self.metallic * (self.base_color.max_component() - dielectric).max(0.0);
        let diffuse = self.diffuse() * self.base_color.max_component() + 0.2 * self.sheen.max_component();
        let specular = (1.0 - self.glass) * rising(f0);
        let clearcoat = self.clearcoat * rising(0.04);
        let sum = diffuse + specular + clearcoat + self.glass;
        let [diffuse, specular, clearcoat, glass] = [diffuse, specular, clearcoat, self.glass].map(|share| share / sum);
        Choice { diffuse, specular, clearcoat, glass }
    }

    /// f_diffuse [Burley12, section 5.3] and sheen, with their shares of the surface.
    #[inline]
    fn diffuse_value(&self, cos_o: f32, cos_i: f32, cos_d: f32) -> Spectrum {
        let (fresnel_o, fresnel_i) = (schlick(cos_o), schlick(cos_i));
        let lerp = |end: f32, x: f32| 1.0 + (end - 1.0) * x;
        let grazing_subsurface = cos_d * cos_d * self.roughness;
        let grazing = 0.5 + 2.0 * grazing_subsurface;
        let retro = lerp(grazing, fresnel_o) * lerp(grazing, fresnel_i);
        let flat = lerp(grazing_subsurface, fresnel_o) * lerp(grazing_subsurface, fresnel_i);
        let subsurface = 1.25 * (flat * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
        self.base_color * (INV_PI * self.diffuse() * (retro + self.subsurface * (subsurface - retro)))
            + self.sheen * schlick(cos_d)
    }

    /// F of the specular lobe, given F of an untinted dielectric.
    #[inline]
    fn specular_fresnel(&self, cos_d: f32, dielectric: f32) -> Spectrum {
        let rising = |f0: Spectrum, x: f32| f0 + (Spectrum::ONE - f0) * x;
        let metal = rising(self.base_color, schlick(cos_d)) * self.metallic;
        match self.tints {
            Tints::Brightest => {
                // How far F has risen from F₀ to 1; of a high index it first falls.
                let risen = (dielectric - self.f0) / (1.0 - self.f0);
                let tinted = rising(self.tint * self.f0, risen).max(Spectrum::ZERO);
                metal + tinted * self.diffuse() + Spectrum::splat(self.glass * dielectric)
            }
            Tints::Luminance => {
                let tinted = rising(self.tint * self.f0, schlick(cosine_outside(cos_d, self.eta)));
                let untinted = Spectrum::splat((1.0 - self.tinted) * dielectric);
                metal + (untinted + tinted * self.tinted) * (self.diffuse() + self.glass)
            }
        }
    }

    /// Whether it has a diffuse lobe, of which sheen is a part.
    #[inline]
    fn is_diffuse(&self) -> bool {
        self.diffuse() > 0.0 || self.sheen.max_component() > 0.0
    }

    /// Reflection outside, of directions above the surface with the half vector `m`.
    #[inline]
    fn reflection(&self, wo: Vec3, wi: Vec3, m: Vec3, o_m: f32) -> Values {
        let (area_o, area_i) = (self.ggx.area(wo), self.ggx.area(wi));
        let d = self.ggx.d(m);
        let facets = 0.25 * d / self.masking.joint_area(wo.z, area_o, wi.z, area_i);
        let visible = 0.25 * d / area_o;
        let cos_d = o_m.min(1.0);
        let dielectric = fresnel_dielectric(cos_d, self.eta).reflected;
        let choice = self.choice(wo.z);
        let mut glossy = self.specular_fresnel(cos_d, dielectric) * facets;
        let mut pdf = visible * (choice.specular + choice.glass * dielectric);
        if self.clearcoat > 0.0 {
            let d = gtr1(self.clearcoat_alpha, m);
            let masking = self.clearcoat_masking.value(wo, wi);
            glossy += Spectrum::splat(self.clearcoat * (0.04 + 0.96 * schlick(cos_d)) * d * masking);
            pdf += choice.clearcoat * d * m.z / (4.0 * o_m);
        }
        let mut diffuse = Spectrum::ZERO;
        if self.is_diffuse() {
            diffuse = self.diffuse_value(wo.z, wi.z, cos_d);
            pdf += choice.diffuse * cosine_hemisphere_pdf(wi.z);
        }
        Values { diffuse, glossy, transmitted: Spectrum::ZERO, pdf }
    }

    /// The glass alone: inside, and through the surface.
    #[inline]
    fn through_glass(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Values {
        let (f, pdf) = self.interface().eval_pdf(wo, wi, mode);
        let f = f * self.glass;
        if same_hemisphere(wo, wi) {
            return Values { glossy: f, pdf, ..Values::default() };
        }
        let pmf = if wo.z > 0.0 { self.choice(wo.z).glass } else { 1.0 };
        Values { transmitted: f * self.base_color.sqrt(), pdf: pmf * pdf, ..Values::default() }
    }

    #[inline]
    fn values(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Values {
        let same_side = same_hemisphere(wo, wi);
        if self.glass > 0.0 && (wo.z < 0.0 || !same_side) {
            return self.through_glass(wo, wi, mode);
        }
        if !same_side {
            return Values::default();
        }
        let Some(Half { m, cos }) = Half::of(wo, wi) else { return Values::default() };
        let above = |w: Vec3| w.with_z(w.z.abs());
        self.reflection(above(wo), above(wi), above(m), cos)
    }

    /// A refraction, or a reflection inside.
    fn sample_glass(&self, wo: Vec3, uc: f32, u: Vec2, pmf: f32, mode: TransportMode) -> Option<BsdfSample> {
        let sample = self.interface().sample(wo, uc, u, mode)?;
        let colour = match sample.lobe {
            Lobes::GLOSSY_TRANSMISSION => self.base_color.sqrt(),
            _ => Spectrum::ONE,
        };
        Some(BsdfSample { weight: sample.weight * colour * (self.glass / pmf), pdf: sample.pdf * pmf, ..sample })
    }
}

/// The cosine on the side of the lower index, 0 where all is reflected: what Schlick's approximation is of.
#[inline]
fn cosine_outside(cos: f32, eta: f32) -> f32 {
    if eta >= 1.0 { cos } else { (1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0).sqrt() }
}

impl BsdfModel for Principled {
    const NAME: &'static str = "principled";
    const ABOUT: &'static str =
        "Disney's principled model: plastic, metal, cloth, lacquer and glass by a dozen sliders";
    const PARAMETERS: &'static [Parameter] = PrincipledSettings::PARAMETERS;
    /// The largest over the parameters is 15.34, of a deep blue, 13.9 times as bright as its luminance, all whose highlight and sheen are
    /// tinted by [`Tints::Luminance`], in a medium of a hundredth of its index (`principled/tests.rs` measures it); with an index of 1.5 it
    /// is 3.42. By [`Tints::Brightest`] they are 2.69, at grazing angles of a white and sheeny surface of roughness 1 under clearcoat, and
    /// 1.79.
    const MAX_ALBEDO: f32 = 15.5;

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let settings = PrincipledSettings::of(arguments);
        if settings.eta == 1.0 && settings.spec_trans > 0.0 {
            return Err(Misfit::new(
                "eta",
                "give another index than 1, at which glass has no surface, or no `spec_trans`",
            ));
        }
        Ok(Self::new(settings).into())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        let Values { diffuse, glossy, transmitted, .. } = self.values(wo, wi, mode);
        let only = |lobe: Lobes, f: Spectrum| if lobes.contains(lobe) { f } else { Spectrum::ZERO };
        only(Lobes::DIFFUSE_REFLECTION, diffuse)
            + only(Lobes::GLOSSY_REFLECTION, glossy)
            + only(Lobes::GLOSSY_TRANSMISSION, transmitted)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.values(wo, wi, mode).pdf
    }

    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        let Values { diffuse, glossy, transmitted, pdf } = self.values(wo, wi, mode);
        (diffuse + glossy + transmitted, pdf)
    }

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        if self.is_inside(wo) {
            return self.sample_glass(wo, uc, u, 1.0, mode);
        }
        let above = wo.with_z(wo.z.abs());
        let choice = self.choice(above.z);
        let below_glass = choice.diffuse + choice.clearcoat + choice.specular;
        let (m, o_m, wi, lobe) = if uc < choice.diffuse {
            let wi = cosine_hemisphere(u);
            let Half { m, cos } = Half::of(above, wi)?;
            (m, cos, wi, Lobes::DIFFUSE_REFLECTION)
        } else if uc < choice.diffuse + choice.clearcoat {
            let m = sample_gtr1(self.clearcoat_alpha, u);
            (m, above.dot(m), reflect(above, m), Lobes::GLOSSY_REFLECTION)
        } else {
            let m = self.ggx.sample_visible(above, u);
            let o_m = above.dot(m);
            let dielectric = fresnel_dielectric(o_m.clamp(0.0, 1.0), self.eta);
            let refracts = uc >= below_glass + choice.glass * dielectric.reflected;
            // Rounding of the sum must not refract what cannot be.
            if refracts && choice.glass * dielectric.transmitted > 0.0 {
                // The same normal as here refracts.
                return self.sample_glass(wo, 1.0, u, choice.glass, mode);
            }
            (m, o_m, reflect(above, m), Lobes::GLOSSY_REFLECTION)
        };
        if wi.z <= 0.0 || o_m <= 0.0 {
            return None;
        }
        // With the sampled normal, not one recomputed from `wi`: D then cancels in the weight, however narrow it is.
        let Values { diffuse, glossy, pdf, .. } = self.reflection(above, wi, m, o_m);
        let weight = (diffuse + glossy) * (wi.z / pdf);
        Some(BsdfSample { wi: wi.with_z(wi.z.copysign(wo.z)), weight, pdf, lobe, eta: 1.0 })
    }

    fn fixed(&self) -> &'static [&'static str] {
        if self.glass > 0.0 { &["eta"] } else { &[] }
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        let mut lobes = Lobes::GLOSSY_REFLECTION;
        if self.is_diffuse() {
            lobes |= Lobes::DIFFUSE_REFLECTION;
        }
        if self.glass > 0.0 {
            lobes |= Lobes::GLOSSY_TRANSMISSION;
        }
        lobes
    }

    #[inline]
    fn survival(&self) -> f32 {
        if self.glass > 0.0 {
            return 1.0;
        }
        let dielectric = self.base_color + Spectrum::splat(self.f0) + self.sheen * 0.1;
        let whole = self.base_color * self.metallic + dielectric * (1.0 - self.metallic);
        survival_of(whole + Spectrum::splat(0.04 * self.clearcoat))
    }

    fn is_anisotropic(&self) -> bool {
        self.ggx.is_anisotropic()
    }

    fn examples() -> Vec<Self> {
        let usual = PrincipledSettings { base_color: Spectrum::new(0.63, 0.065, 0.05), ..Default::default() };
        let white = PrincipledSettings { base_color: Spectrum::ONE, ..Default::default() };
        let violet = Spectrum::new(0.3, 0.1, 0.5);
        vec![
            Self::new(PrincipledSettings { specular_tint: 0.5, roughness: 0.7, ..usual }),
            Self::new(PrincipledSettings { metallic: 1.0, roughness: 0.4, anisotropic: 0.8, clearcoat: 1.0, ..usual }),
            // The most that is given back.
            Self::new(PrincipledSettings {
                subsurface: 1.0,
                roughness: 1.0,
                sheen: 1.0,
                clearcoat: 1.0,
                clearcoat_gloss: 0.0,
                eta: 2.4,
                ..white
            }),
            Self::new(PrincipledSettings { roughness: 0.0, metallic: 1.0, ..white }),
            Self::new(PrincipledSettings { roughness: 0.0, ..usual }),
            Self::new(PrincipledSettings {
                base_color: violet,
                sheen: 1.0,
                sheen_tint: 1.0,
                metallic: 0.3,
                roughness: 0.8,
                ..white
            }),
            Self::new(PrincipledSettings { base_color: Spectrum::new(0.0, 0.9, 0.0), roughness: 1.0, ..white }),
            Self::new(PrincipledSettings {
                spec_trans: 0.5,
                roughness: 0.6,
                metallic: 0.2,
                clearcoat: 0.5,
                clearcoat_gloss: 0.0,
                ..usual
            }),
            Self::new(PrincipledSettings {
                metallic: 0.5,
                spec_trans: 1.0,
                clearcoat: 1.0,
                masking: Masking::Separable,
                clearcoat_masking: ClearcoatMasking::Shadows,
                ..white
            }),
            Self::new(PrincipledSettings {
                base_color: violet,
                specular_tint: 0.7,
                sheen: 0.3,
                spec_trans: 0.4,
                eta: 0.8,
                tints: Tints::Luminance,
                ..white
            }),
            // Of so high an index F falls from 0.67 to 0.48 before it rises.
            Self::new(PrincipledSettings { eta: 10.0, roughness: 0.5, ..usual }),
        ]
    }
}

#[cfg(test)]
mod tests;
