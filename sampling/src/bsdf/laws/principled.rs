//! Disney's principled model by its published equations.

use super::formulas::{above, dielectric, ggx_d, ggx_lambda, half, schlick};
use super::{IMPORTANCE, RADIANCE};
use crate::bsdf::principled::ClearcoatMasking;
use crate::bsdf::{BsdfModel, Lobes, Masking, Principled, PrincipledSettings, Tints};
use crate::math::Spectrum;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Settings, each in f64.
#[derive(Clone, Copy, Debug)]
struct Printed {
    given: PrincipledSettings,
    colour: f64,
    hue: f64,
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

impl Printed {
    fn new(given: PrincipledSettings, channel: usize) -> Self {
        let channels = given.base_color.to_array().map(f64::from);
        let one = match given.tints {
            Tints::Brightest => channels.into_iter().fold(0.0, f64::max),
            Tints::Luminance => f64::from(given.base_color.luminance()),
        };
        Self { given, colour: channels[channel], hue: if one > 0.0 { channels[channel] / one } else { 1.0 } }
    }

    /// A number of the settings.
    fn the(&self, of: impl Fn(&PrincipledSettings) -> f32) -> f64 {
        f64::from(of(&self.given))
    }

    /// (1 − m)(1 − t), and (1 − m) t.
    fn shares(&self) -> (f64, f64) {
        let (m, t) = (self.the(|s| s.metallic), self.the(|s| s.spec_trans));
        ((1.0 - m) * (1.0 - t), (1.0 - m) * t)
    }

    /// f_d, its flat form of subsurface scattering, and sheen [Burley12, section 5.3 and the appendix].
    fn diffuse(&self, o: DVec3, i: DVec3) -> f64 {
        let (cos_d, roughness) = (o.dot(half(o, i)), self.the(|s| s.roughness));
        let towards = |end: f64| mix(1.0, end, schlick(0.0, o.z)) * mix(1.0, end, schlick(0.0, i.z));
        let retro = towards(0.5 + 2.0 * roughness * cos_d * cos_d);
        let flat = 1.25 * (towards(roughness * cos_d * cos_d) * (1.0 / (o.z + i.z) - 0.5) + 0.5);
        let (diffuse, glass) = self.shares();
        let sheen_share = if self.given.tints == Tints::Brightest { diffuse } else { diffuse + glass };
        let sheen = self.the(|s| s.sheen) * mix(1.0, self.hue, self.the(|s| s.sheen_tint)) * schlick(0.0, cos_d);
        diffuse * self.colour / PI * mix(retro, flat, self.the(|s| s.subsurface)) + sheen_share * sheen
    }

    /// F of the specular lobe: Schlick's of the metal, Fresnel's of the rest, tinted or not.
    fn fresnel(&self, cos_d: f64) -> f64 {
        let (eta, tint) = (self.the(|s| s.eta), self.the(|s| s.specular_tint));
        let (f, f0) = (dielectric(cos_d, eta), ((eta - 1.0) / (eta + 1.0)).powi(2));
        let (diffuse, glass) = self.shares();
        let metal = self.the(|s| s.metallic) * schlick(self.colour, cos_d);
        match self.given.tints {
            Tints::Brightest => {
                let from = f0 * mix(1.0, self.hue, tint);
                metal + diffuse * mix(from, 1.0, (f - f0) / (1.0 - f0)) + glass * f
            }
            Tints::Luminance => {
                let refracted = 1.0 - (1.0 - cos_d * cos_d) / (eta * eta);
                let outside = if eta < 1.0 { refracted.max(0.0).sqrt() } else { cos_d };
                metal + (diffuse + glass) * mix(f, schlick(f0 * self.hue, outside), tint)
            }
        }
    }

    /// D F G / (4 cos cos) of the specular lobe, and the clear coat [Burley12, sections 5.4 and 5.6, and (4)].
    fn glossy(&self, o: DVec3, i: DVec3) -> f64 {
        let m = half(o, i);
        let aspect = (1.0 - 0.9 * self.the(|s| s.anisotropic)).sqrt();
        let alpha = self.the(|s| s.roughness).powi(2);
        let (ax, ay) = (alpha / aspect, alpha * aspect);
        let [to, from] = [o, i].map(|w| ggx_lambda(ax, ay, w));
        let g = match self.given.masking {
            Masking::Separable => 1.0 / ((1.0 + to) * (1.0 + from)),
            _ => 1.0 / (1.0 + to + from),
        };
        let specular = self.fresnel(o.dot(m)) * ggx_d(ax, ay, m) * g / (4.0 * o.z * i.z);
        let alpha2 = mix(0.1, 0.001, self.the(|s| s.clearcoat_gloss)).powi(2);
        let d = (alpha2 - 1.0) / (PI * alpha2.ln() * (1.0 + (alpha2 - 1.0) * m.z * m.z));
        let smith = |w: DVec3| 1.0 / (1.0 + ggx_lambda(0.25, 0.25, w));
        let over = if self.given.clearcoat_masking == ClearcoatMasking::OverCosines { 4.0 * o.z * i.z } else { 1.0 };
        let coat = 0.25 * self.the(|s| s.clearcoat) * schlick(0.04, o.dot(m)) * d * smith(o) * smith(i) / over;
        specular + coat
    }
}

/// Some of everything, and what has a branch of its own.
fn cases() -> [PrincipledSettings; 5] {
    let all = PrincipledSettings {
        base_color: Spectrum::new(0.7, 0.2, 0.4),
        metallic: 0.3,
        subsurface: 0.4,
        eta: 1.5,
        specular_tint: 0.6,
        roughness: 0.7,
        anisotropic: 0.5,
        sheen: 0.8,
        sheen_tint: 0.7,
        clearcoat: 0.6,
        clearcoat_gloss: 0.3,
        spec_trans: 0.25,
        ..Default::default()
    };
    let by_luminance = PrincipledSettings {
        tints: Tints::Luminance,
        masking: Masking::Separable,
        clearcoat_masking: ClearcoatMasking::Shadows,
        ..all
    };
    [
        all,
        by_luminance,
        PrincipledSettings { eta: 0.8, ..by_luminance },
        PrincipledSettings { spec_trans: 0.0, metallic: 0.6, subsurface: 0.9, eta: 2.2, ..all },
        PrincipledSettings { base_color: Spectrum::ZERO, spec_trans: 0.0, clearcoat_gloss: 0.0, ..all },
    ]
}

#[test]
fn reflection_is_the_sum_of_the_printed_lobes() {
    for given in cases() {
        let model = Principled::new(given);
        let sides = if given.spec_trans > 0.0 { &[1.0][..] } else { &[1.0, -1.0] };
        for (wo, wi) in above().into_iter().flat_map(|o| above().into_iter().map(move |i| (o, i))) {
            for channel in 0..3 {
                let printed = Printed::new(given, channel);
                let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
                let lobes = [
                    (Lobes::DIFFUSE_REFLECTION, printed.diffuse(o, i)),
                    (Lobes::GLOSSY_REFLECTION, printed.glossy(o, i)),
                    (Lobes::ALL, printed.diffuse(o, i) + printed.glossy(o, i)),
                ];
                for (side, (lobe, exact)) in sides.iter().flat_map(|side| lobes.map(|lobe| (side, lobe))) {
                    let on = |w: Vec3| w.with_z(w.z * side);
                    for mode in [RADIANCE, IMPORTANCE] {
                        let value = f64::from(model.eval(on(wo), on(wi), lobe, mode).to_array()[channel]);
                        let off = (value - exact).abs();
                        assert!(off < 3e-5 * exact.max(1e-3), "{value} for {exact}: {lobe:?} {given:?} {wo} {wi}");
                    }
                }
            }
        }
    }
}
