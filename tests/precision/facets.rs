//! Facets: how many face where, which are seen, and what they reflect.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3, dvec2, vec2};
use sampling::Spectrum;
use sampling::bsdf::{Beckmann, BsdfModel, Ggx, Lobes, Masking, Microfacets, RoughConductor, TransportMode, Ward};
use statrs::function::erf::erfc;

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

    /// What facets of one width reflect where they hide together [Heitz14, (99)]: D / (4 (σ(wo) cos θi + σ(wi) cos θo − cos θo cos θi)).
    fn reflected(self, alpha: f64, [o, i]: [DVec3; 2], m: DVec3) -> f64 {
        let widths = DVec2::splat(alpha);
        self.d(widths, m) / (4.0 * (self.area(widths, o) * i.z + self.area(widths, i) * o.z - o.z * i.z))
    }
}

/// wo, wi and their half vector, of which wi is often that of a mirror but for a few widths of a narrow lobe.
fn pair(dice: &mut Dice, alpha: f64) -> Option<(Vec3, Vec3, DVec3)> {
    let wo = dice.direction();
    let off = alpha * dice.magnitude(1e-3, 4.0);
    let m = (DVec3::Z + off * dice.anywhere()).normalize();
    let o = wo.as_dvec3();
    let wi = (2.0 * o.dot(m) * m - o).as_vec3();
    if wi.z <= 1e-6 || wo.z <= 1e-6 {
        return None;
    }
    let h = o + wi.as_dvec3();
    (h.z > 0.0).then(|| (wo, wi, h.normalize()))
}

/// How far the value of a lobe moves, of itself, when a part in 2²⁴ of the half vector's components does: what any code has to
/// bear that rounds a half vector to single precision, in ulp.
fn condition(m: DVec3, alpha: f64) -> f64 {
    1.0 + (m.x * m.x + m.y * m.y) / (m.z * m.z * alpha * alpha)
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

#[test]
fn lobes_of_ggx() {
    let mut dice = Dice::new(3);
    let [mut density, mut area, mut value] =
        ["D of GGX", "projected area of GGX", "rough conductor of GGX, by condition"].map(Worst::of);
    for _ in 0..TRIES {
        let (ax, ay) = (dice.magnitude(1e-4, 1.0) as f32, dice.magnitude(1e-4, 1.0) as f32);
        let (x, y) = (f64::from(ax), f64::from(ay));
        let (ggx, w) = (Ggx::new(ax, ay), dice.direction());
        let v = w.as_dvec3();
        let at = || format!("{w}, widths {ax} and {ay}");
        // Of a vector that is no unit vector exactly, as it is evaluated.
        let q = (v.x / x).powi(2) + (v.y / y).powi(2) + v.z * v.z;
        density.add(ggx.d(w), 1.0 / (PI * x * y * q * q), at);
        area.add(ggx.area(w), Published::Ggx.area(dvec2(x, y), v), at);
        let Some((wo, wi, m)) = pair(&mut dice, x) else { continue };
        let exact = Published::Ggx.reflected(x, [wo, wi].map(|w| w.as_dvec3()), m);
        let metal = RoughConductor::from_reflectance(Spectrum::ONE, ax, ax);
        let found = metal.eval(wo, wi, Lobes::ALL, MODE).to_array()[0];
        value.add_in(f64::from(found), exact, single(exact) * condition(m, x), || format!("{wo} to {wi}, width {ax}"));
    }
    density.finish(12.0);
    area.finish(3.0);
    value.finish(15.0);
}

#[test]
fn lobes_of_beckmann() {
    let mut dice = Dice::new(4);
    let [mut value, mut ward] = ["rough conductor of Beckmann, by condition", "Ward, by condition"].map(Worst::of);
    for _ in 0..TRIES {
        let alpha = dice.magnitude(2e-4, 1.0) as f32;
        let a = f64::from(alpha);
        let Some((wo, wi, m)) = pair(&mut dice, a) else { continue };
        // What is fainter is nothing.
        if m.truncate().length() / m.z > 40.0_f64.sqrt() * a {
            continue;
        }
        let at = || format!("{wo} to {wi}, width {alpha}");
        let ends = [wo, wi].map(|w| w.as_dvec3());
        let exact = Published::Beckmann.reflected(a, ends, m);
        let metal = RoughConductor::with_facets(Spectrum::ZERO, Spectrum::ONE, Beckmann::new(alpha, alpha).into());
        let found = metal.eval(wo, wi, Lobes::ALL, MODE).to_array()[0];
        let bear = condition(m, a);
        value.add_in(f64::from(found), exact, single(exact) * bear, at);
        // The cosine at the facet, of which the product with `m` would know nothing where both graze: no unit vector is one exactly.
        let o_m = 0.5 * (ends[0] + ends[1]).length();
        let exact = Published::Beckmann.d(DVec2::splat(a), m) / (4.0 * o_m * o_m);
        let glossy = Ward::new(Spectrum::ZERO, Spectrum::ONE, alpha, alpha);
        let found = glossy.eval(wo, wi, Lobes::ALL, MODE).to_array()[0];
        ward.add_in(f64::from(found), exact, single(exact) * bear, at);
    }
    value.finish(15.0);
    ward.finish(15.0);
}
