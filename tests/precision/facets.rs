//! Normals that are seen, and the densities of what they reflect.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, dvec2, vec2};
use sampling::Spectrum;
use sampling::bsdf::{Beckmann, BsdfModel, Ggx, Lobes, Masking, Microfacets, RoughConductor, TransportMode};
use statrs::function::erf::erfc;

use super::scattering::pair;
use super::{Dice, TRIES, Worst, moved, single};

const MODE: TransportMode = TransportMode::Radiance;

/// The slopes, over the widths, of the normal that is seen from `w` `[Dupuy23]`.
fn visible(w: DVec3, widths: DVec2, u: DVec2) -> DVec2 {
    let w = (w * widths.extend(1.0)).normalize();
    let z = (1.0 - u.y) * (1.0 + w.z) - w.z;
    let sin = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    (sin * DVec2::from_angle(TAU * u.x) + w.truncate()) / (z + w.z)
}

#[test]
fn visible_normals_of_ggx() {
    let mut dice = Dice::new(5);
    let mut worst = Worst::of("visible normals of GGX");
    for _ in 0..TRIES {
        let (ax, ay) = (dice.width(1e-8), dice.width(1e-8));
        let (w, u) = (dice.direction(), vec2(dice.number(), dice.number()));
        let m = Ggx::new(ax, ay).sample_visible(w, u).as_dvec3();
        let (widths, v) = (dvec2(f64::from(ax), f64::from(ay)), u.as_dvec2());
        let exact = visible(w.as_dvec3(), widths, v);
        // One step of the random numbers, away from their ends.
        let step = v.map(|u| if u > 0.5 { -2.0_f64.powi(-24) } else { 2.0_f64.powi(-24) });
        let by = |step: DVec2| (visible(w.as_dvec3(), widths, v + step) - exact).length();
        let unit = single(exact.length()) + by(dvec2(step.x, 0.0)) + by(dvec2(0.0, step.y));
        let off = (m.truncate() / (m.z * widths) - exact).length();
        worst.add_in(off, 0.0, unit, || format!("{w}, widths {ax:e} and {ay:e}, u {:e} and {:e}", u.x, 1.0 - u.y));
    }
    worst.finish(2.0);
}

/// Distributions of normals as they are published.
#[derive(Clone, Copy)]
pub(super) enum Published {
    Ggx,
    Beckmann,
}

impl Published {
    pub fn facets(self, ax: f32, ay: f32) -> Microfacets {
        match self {
            Self::Ggx => Ggx::new(ax, ay).into(),
            Self::Beckmann => Beckmann::new(ax, ay).into(),
        }
    }

    /// D(m) [Heitz14, section 5], for `m` of any length.
    pub fn d(self, widths: DVec2, m: DVec3) -> f64 {
        let m = m.normalize();
        let (slopes, cos4) = ((m.truncate() / (m.z * widths)).length_squared(), m.z.powi(4));
        let slopes = match self {
            Self::Ggx => (1.0 + slopes).powi(-2),
            Self::Beckmann => (-slopes).exp(),
        };
        slopes / (PI * widths.x * widths.y * cos4)
    }

    /// The projected area |cos θ| (1 + Λ) [Heitz14, section 5].
    pub fn area(self, widths: DVec2, w: DVec3) -> f64 {
        let (z, sin) = (w.z.abs(), (widths * w.truncate()).length());
        match self {
            Self::Ggx => 0.5 * (z + z.hypot(sin)),
            Self::Beckmann if sin == 0.0 => z,
            Self::Beckmann => {
                let a = z / sin;
                z + 0.5 * (sin * (-a * a).exp() / PI.sqrt() - z * erfc(a))
            }
        }
    }
}

/// Of samples, what is returned with their directions against what is so at these.
fn samples_of(kind: Published, names: [&'static str; 2], seed: u64, least: f64, most: [f64; 2]) {
    let mut dice = Dice::new(seed);
    let [mut density, mut weight] = names.map(Worst::of);
    for _ in 0..TRIES {
        let (ax, ay) = (dice.width(least), dice.width(least));
        let (wo, uc, u) = (dice.direction(), dice.number(), vec2(dice.number(), dice.number()));
        let metal = RoughConductor::with_facets(Spectrum::ZERO, Spectrum::ONE, kind.facets(ax, ay));
        let Some(sample) = metal.sample(wo, uc, u, MODE) else { continue };
        let (widths, o, i) = (dvec2(f64::from(ax), f64::from(ay)), wo.as_dvec3(), sample.wi.as_dvec3());
        let at = || format!("{wo} to {}, widths {ax:e} and {ay:e}, u {u}", sample.wi);
        let seen = kind.area(widths, o);
        // D(m) ⟨wo·m⟩ / σ(wo) by dm/dwi = 1 / (4 ⟨wo·m⟩) [Walter07, (14)].
        let exact = |i: DVec3| kind.d(widths, o + i) / (4.0 * seen);
        let unit = single(exact(i)) + moved(i, exact);
        // Where it is, a unit of the direction leaves no digit of some densities.
        if unit < exact(i) {
            density.add_in(f64::from(sample.pdf), exact(i), unit, at);
        }
        // G₂ / G₁ [Heitz14, (99)].
        let exact = |i: DVec3| i.z * seen / (o.z * kind.area(widths, i) + i.z * seen - o.z * i.z);
        let unit = single(exact(i)) + moved(i, exact);
        weight.add_in(f64::from(sample.weight.to_array()[0]), exact(i), unit, at);
    }
    density.finish(most[0]);
    weight.finish(most[1]);
}

#[test]
fn samples_of_ggx() {
    samples_of(Published::Ggx, ["density of a sample of GGX", "weight of a sample of GGX"], 6, 1e-4, [20.0, 6.0]);
}

#[test]
fn samples_of_beckmann() {
    let names = ["density of a sample of Beckmann", "weight of a sample of Beckmann"];
    samples_of(Published::Beckmann, names, 7, 2e-4, [20.0, 6.0]);
}

#[test]
fn projected_area_of_beckmann() {
    let mut dice = Dice::new(8);
    let mut worst = Worst::of("projected area of Beckmann");
    for _ in 0..TRIES {
        let alpha = dice.width(2e-4);
        let Some((wo, wi, _)) = pair(&mut dice, f64::from(alpha)) else { continue };
        let facets = Beckmann::new(alpha, alpha).into();
        // Where they hide apart, the value is D / (4 σ(wo) σ(wi)), and the density D / (4 σ(wo)).
        let metal = RoughConductor::with_facets(Spectrum::ZERO, Spectrum::ONE, facets).masked(Masking::Separable);
        let value = metal.eval(wo, wi, Lobes::ALL, MODE).to_array()[0];
        if value > f32::MIN_POSITIVE {
            let found = f64::from(metal.pdf(wo, wi, MODE)) / f64::from(value);
            let exact = Published::Beckmann.area(DVec2::splat(f64::from(alpha)), wi.as_dvec3());
            worst.add_in(found, exact, single(exact), || format!("{wi}, width {alpha}"));
        }
    }
    worst.finish(10.0);
}
