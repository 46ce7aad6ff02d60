//! Values by their published equations, written out in f64.

use super::{IMPORTANCE, RADIANCE, direction};
use crate::bsdf::quadrature::integrate;
use crate::bsdf::{
    AshikhminShirley, Beckmann, BlinnPhong, BlinnTorrance, Bsdf, CookTorrance, DiffuseTransmission, DistributionBased,
    Ggx, HalfVectors, Lafortune, Lambert, Lobes, Masking, Merl, Mix, Phong, Plastic, RoughConductor, RoughDielectric,
    Tinted, Within,
};
use crate::bsdf::{BsdfModel, fresnel_conductor};
use crate::math::Spectrum;
use glam::{DVec3, Vec3, dvec3, vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// A value by equations, for directions above the surface, in the first channel.
type Printed = Box<dyn Fn(DVec3, DVec3) -> f64>;

/// The grey that the first channel has, and other channels.
fn colour(first: f32) -> Spectrum {
    Spectrum::new(first, 0.5 * first, 0.25 * first)
}

/// Directions above the surface.
pub fn above() -> Vec<Vec3> {
    [(1.0, 0.0), (0.95, 0.3), (0.8, 2.0), (0.6, 4.0), (0.4, 5.5), (0.25, 1.1), (0.1, 3.3)]
        .map(|(cos, phi)| direction(cos, phi))
        .to_vec()
}

pub fn half(o: DVec3, i: DVec3) -> DVec3 {
    (o + i).normalize()
}

/// Fresnel's equations of a dielectric by Snell's law.
pub fn dielectric(cos: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2).sqrt();
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = (eta * cos - cos_t) / (eta * cos + cos_t);
    0.5 * (s * s + p * p)
}

fn metal(cos: f64, eta: Spectrum, k: Spectrum) -> f64 {
    f64::from(fresnel_conductor(cos as f32, eta, k).to_array()[0])
}

pub fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

/// Trowbridge and Reitz's D with two roughnesses [Burley12, (13)].
pub fn ggx_d(ax: f64, ay: f64, m: DVec3) -> f64 {
    1.0 / (PI * ax * ay * ((m.x / ax).powi(2) + (m.y / ay).powi(2) + m.z * m.z).powi(2))
}

/// Smith's Λ of it [Heitz14, (86)].
pub fn ggx_lambda(ax: f64, ay: f64, w: DVec3) -> f64 {
    let a2 = ((w.x * ax).powi(2) + (w.y * ay).powi(2)) / (w.z * w.z);
    0.5 * ((1.0 + a2).sqrt() - 1.0)
}

fn beckmann_d(ax: f64, ay: f64, m: DVec3) -> f64 {
    (-((m.x / ax).powi(2) + (m.y / ay).powi(2)) / (m.z * m.z)).exp() / (PI * ax * ay * m.z.powi(4))
}

/// G of V-shaped grooves [Cook82, section 2].
fn grooves(o: DVec3, i: DVec3, m: DVec3) -> f64 {
    let to = 2.0 * m.z / o.dot(m);
    (to * o.z).min(to * i.z).min(1.0)
}

/// The models that reflect, each with its equations.
fn reflecting() -> Vec<(Bsdf, Printed)> {
    let (eta, k) = (Spectrum::new(0.27, 0.68, 1.32), Spectrum::new(3.61, 2.63, 2.29));
    let (kd, ks) = (0.3_f64, 0.6_f64);
    let (of_kd, of_ks) = (colour(kd as f32), colour(ks as f32));
    let mut all: Vec<(Bsdf, Printed)> = vec![(Lambert { albedo: of_kd }.into(), Box::new(move |_, _| kd / PI))];
    for (n_u, n_v) in [(20.0, 5.0), (3.0, 60.0), (8.0, 8.0)] {
        // [Ashikhmin00, (4) and (5)].
        let printed = move |o: DVec3, i: DVec3| {
            let h = half(o, i);
            let cos2_phi = if h.z < 1.0 { h.x * h.x / (h.x * h.x + h.y * h.y) } else { 0.0 };
            let lobe = h.z.powf(n_u * cos2_phi + n_v * (1.0 - cos2_phi)) / (o.dot(h) * o.z.max(i.z));
            let glossy = ((n_u + 1.0) * (n_v + 1.0)).sqrt() / (8.0 * PI) * lobe * schlick(ks, o.dot(h));
            let rising = |w: DVec3| 1.0 - (1.0 - 0.5 * w.z).powi(5);
            glossy + 28.0 * kd / (23.0 * PI) * (1.0 - ks) * rising(o) * rising(i)
        };
        all.push((AshikhminShirley::new(of_kd, of_ks, n_u as f32, n_v as f32).into(), Box::new(printed)));
    }
    for n in [1.0, 30.0] {
        // [Lafortune94], and [Blinn77] as the model says.
        let phong = move |o: DVec3, i: DVec3| {
            let cos = dvec3(-o.x, -o.y, o.z).dot(i).max(0.0);
            kd / PI + ks * (n + 2.0) / (2.0 * PI) * cos.powf(n)
        };
        all.push((Phong::new(of_kd, of_ks, n as f32).into(), Box::new(phong)));
        let d = move |m: DVec3| (n + 2.0) / (2.0 * PI) * m.z.powf(n);
        let c = (n + 4.0) / (4.0 * (n + 2.0_f64.powf(-0.5 * n)));
        let blinn = move |o: DVec3, i: DVec3| kd / PI + ks * c * d(half(o, i));
        all.push((BlinnPhong::new(of_kd, of_ks, n as f32).into(), Box::new(blinn)));
        // [Torrance67; Blinn77].
        let torrance = move |o: DVec3, i: DVec3| {
            let m = half(o, i);
            kd / PI + ks * metal(o.dot(m), eta, k) * d(m) * grooves(o, i, m) / (4.0 * o.z * i.z)
        };
        all.push((BlinnTorrance::new(of_kd, of_ks, eta, k, n as f32).into(), Box::new(torrance)));
    }
    // [Cook82, section 2], with Torrance's 4.
    let cook = move |o: DVec3, i: DVec3| {
        let m = half(o, i);
        kd / PI + ks * metal(o.dot(m), eta, k) * beckmann_d(0.4, 0.4, m) * grooves(o, i, m) / (4.0 * o.z * i.z)
    };
    all.push((CookTorrance::new(of_kd, of_ks, eta, k, 0.4).into(), Box::new(cook)));
    // [Lafortune97, (8)].
    let lobes = [(0.2, [-1.0, -0.8, 0.9], 6.0), (0.1, [0.7, 0.7, 0.6], 2.0)];
    let lafortune = move |o: DVec3, i: DVec3| {
        let lobe = |(ks, c, n): (f64, [f64; 3], f64)| ks * DVec3::from(c).dot(o * i).max(0.0).powf(n);
        kd / PI + lobes.into_iter().map(lobe).sum::<f64>()
    };
    let given = lobes.map(|(ks, c, n)| (colour(ks as f32), (DVec3::from(c).as_vec3(), n as f32)));
    all.push((Lafortune::new(of_kd, &given).into(), Box::new(lafortune)));
    for (masking, ax, ay) in [(Masking::Correlated, 0.3, 0.5), (Masking::Separable, 0.2, 0.2)] {
        // [Walter07, (20)] and [Heitz14, (99)].
        let walter = move |o: DVec3, i: DVec3| {
            let m = half(o, i);
            let [to, from] = [o, i].map(|w| ggx_lambda(ax, ay, w));
            let g = match masking {
                Masking::Separable => 1.0 / ((1.0 + to) * (1.0 + from)),
                _ => 1.0 / (1.0 + to + from),
            };
            metal(o.dot(m), eta, k) * ggx_d(ax, ay, m) * g / (4.0 * o.z * i.z)
        };
        let facets = Ggx::new(ax as f32, ay as f32).into();
        all.push((RoughConductor::with_facets(eta, k, facets).masked(masking).into(), Box::new(walter)));
    }
    // A smooth coat of index 1.4 [Ashikhmin00], with T̄ by quadrature.
    let inside = 1.4;
    let passed = integrate(0.0, 1.0, 200, |cos| 2.0 * cos * (1.0 - dielectric(cos, inside)));
    let leaving = passed / (inside * inside);
    for (within, reflected) in [(Within::default(), kd), (Within::as_if_white(None), 1.0)] {
        let plastic = move |o: DVec3, i: DVec3| {
            let through = (1.0 - dielectric(o.z, inside)) * (1.0 - dielectric(i.z, inside));
            through * kd / (PI * inside * inside * (1.0 - reflected * (1.0 - leaving)))
        };
        let model = Plastic::reflecting_within(of_kd, inside as f32, within).expect("a model");
        all.push((model.into(), Box::new(plastic)));
    }
    all
}

#[test]
fn reflection_is_that_of_the_printed_equations() {
    for (model, printed) in reflecting() {
        for (o, i) in above().into_iter().flat_map(|o| above().into_iter().map(move |i| (o, i))) {
            let exact = printed(o.as_dvec3(), i.as_dvec3());
            for (wo, wi) in [(o, i), (o.with_z(-o.z), i.with_z(-i.z))] {
                let value = f64::from(model.eval(wo, wi, Lobes::ALL, RADIANCE).to_array()[0]);
                assert!((value - exact).abs() < 3e-5 * exact.max(1e-3), "{value} for {exact}: {model:?} {wo} {wi}");
            }
            assert!(model.eval(o, -i, Lobes::ALL, RADIANCE).is_zero(), "{model:?} {o} {i}");
        }
    }
}

#[test]
fn refraction_is_that_of_the_printed_equation() {
    // [Walter07, (21)], for light that comes from `wi` and leaves to `wo`, times the square of the index that radiance takes.
    for (eta, ax, ay, masking) in [
        (1.5, 0.4, 0.4, Masking::Correlated),
        (1.0 / 1.33, 0.3, 0.6, Masking::Separable),
        (1.9, 0.5, 0.3, Masking::CorrelatedThroughout),
    ] {
        let model = RoughDielectric::new(eta as f32, ax as f32, ay as f32).masked(masking);
        let mut met = 0;
        for (wo, wi, eta) in above().into_iter().flat_map(|o| {
            let pair = move |i: Vec3| {
                [(o, i.with_z(-i.z), eta), (o, -i, eta), (o.with_z(-o.z), i, 1.0 / eta), (-o, i, 1.0 / eta)]
            };
            above().into_iter().flat_map(pair)
        }) {
            let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
            let m = -(o + eta * i).normalize() * (eta - 1.0).signum();
            let m = m * (m.z * o.z).signum();
            let (o_m, i_m) = (o.dot(m), i.dot(m));
            let [to, from] = [o, i].map(|w| ggx_lambda(ax, ay, w));
            let g = match masking {
                Masking::CorrelatedThroughout => 1.0 / (1.0 + to + from),
                _ => 1.0 / ((1.0 + to) * (1.0 + from)),
            };
            let is_met = o_m > 0.0 && i_m < 0.0;
            let passed = if is_met { 1.0 - dielectric(o_m, eta) } else { 0.0 };
            let exact = (o_m * i_m / (o.z * i.z)).abs() * eta * eta * passed * g * ggx_d(ax, ay, m.with_z(m.z.abs()))
                / (o_m + eta * i_m).powi(2);
            met += usize::from(exact > 0.01);
            for (mode, scale) in [(IMPORTANCE, 1.0), (RADIANCE, 1.0 / (eta * eta))] {
                let value = f64::from(model.eval(wo, wi, Lobes::ALL, mode).to_array()[0]);
                let exact = scale * exact;
                assert!((value - exact).abs() < 2e-4 * exact.max(1e-2), "{value} for {exact}: {model:?} {wo} {wi}");
            }
        }
        // Of 196 pairs, most of which are beyond the critical angle or far from the lobe.
        assert!(met > 24, "{met} of {model:?}");
    }
}

#[test]
fn drawn_densities_are_linear_between_their_nodes() {
    // [Ashikhmin07, (2)]: with ∫ p dm = 1 all but one factor is known, which brings the largest albedo to 1.
    let drawn = [1.0, 0.4, 0.7, 0.2, 0.0];
    let table = HalfVectors::read(&drawn).expect("a density");
    let model = DistributionBased::new(colour(0.4), table);
    let depth = |k: usize| 1.0 - (FRAC_PI_2 * k as f64 / 4.0).cos();
    let total: f64 = (0..4).map(|k| PI * f64::from(drawn[k] + drawn[k + 1]) * (depth(k + 1) - depth(k))).sum();
    let p = |m: DVec3| {
        let k = (0..4).rfind(|k| depth(*k) <= 1.0 - m.z).expect("a place");
        let t = (1.0 - m.z - depth(k)) / (depth(k + 1) - depth(k));
        (f64::from(drawn[k]) * (1.0 - t) + f64::from(drawn[k + 1]) * t) / total
    };
    let value = |o: DVec3, i: DVec3| p(half(o, i)) / (o.z + i.z - o.z * i.z);
    // The largest albedo, over angles.
    let albedo = |cos: f64| {
        let o = dvec3((1.0 - cos * cos).sqrt(), 0.0, cos);
        integrate(0.0, 1.0, 24, |z| {
            let around = |phi: f64| {
                let sin = (1.0 - z * z).sqrt();
                z * value(o, dvec3(sin * phi.cos(), sin * phi.sin(), z))
            };
            2.0 * integrate(0.0, PI, 24, around)
        })
    };
    let largest = (0..=40).map(|k| albedo((f64::from(k) / 40.0).powi(2).max(1e-6))).fold(0.0, f64::max);
    for (o, i) in above().into_iter().flat_map(|o| above().into_iter().map(move |i| (o, i))) {
        let f = f64::from(model.eval(o, i, Lobes::ALL, RADIANCE).to_array()[0]);
        let (o, i) = (o.as_dvec3(), i.as_dvec3());
        let exact = value(o, i) * schlick(f64::from(0.4_f32), o.dot(half(o, i))) / largest;
        assert!((f / exact - 1.0).abs() < 3e-3, "{f} for {exact}: {o} {i}");
    }
}

#[test]
fn wrong_densities_of_half_vectors_are_refused() {
    for wrong in [&[1.0][..], &[], &[0.0, 0.0], &[1.0, f32::NAN], &[1.0, f32::INFINITY]] {
        assert!(HalfVectors::read(wrong).is_err(), "{wrong:?}");
    }
    // Their scale means nothing, and what is far below the largest is nothing.
    let model = |numbers: &[f32]| DistributionBased::new(Spectrum::ONE, HalfVectors::read(numbers).expect("a density"));
    let value = |model: DistributionBased, i: Vec3| model.eval(Vec3::Z, i, Lobes::ALL, RADIANCE).max_component();
    let small = [1e-30, 2e-30, 5e-31];
    for i in above() {
        let (a, b) = (value(model(&small), i), value(model(&small.map(|x| x * 1e31)), i));
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }
    let steep = direction(0.0001_f32.cos(), 0.2);
    assert_eq!(value(model(&[1e-21, 1e-21, 1.0]), steep), 0.0);
    assert!(value(model(&[2e-20, 2e-20, 1.0]), steep) > 0.0);
}

#[test]
fn models_made_of_others_are_sums_of_theirs() {
    let red: &Bsdf = Bsdf::from(Lambert { albedo: Spectrum::new(0.6, 0.1, 0.05) }).kept();
    let glass: &Bsdf = Bsdf::from(RoughDielectric::new(1.5, 0.3, 0.3)).kept();
    let sheet: &Bsdf = Bsdf::from(DiffuseTransmission::new(Spectrum::splat(0.3), Spectrum::splat(0.6))).kept();
    let metal: &Bsdf = Bsdf::from(RoughConductor::from_reflectance(Spectrum::splat(0.9), 0.3, 0.2)).kept();
    let (green, blue) = (Spectrum::new(0.2, 1.0, 0.3), Spectrum::new(0.1, 0.0, 0.9));
    let inner: &Bsdf = Bsdf::from(Mix::new(sheet, glass, 0.25)).kept();
    let mixed = Mix::new(red, inner, 0.75);
    assert_eq!((mixed.kinds(), Mix::new(inner, inner, 0.5).kinds()), (3, 4));
    let tinted: Bsdf = Tinted::new(inner, green, blue).into();
    let mixed: Bsdf = mixed.into();
    let shares = [(red, 0.25), (sheet, 0.5625), (glass, 0.1875)];
    for (wo, wi) in above().into_iter().flat_map(|o| above().into_iter().flat_map(move |i| [(o, i), (-o, i), (o, -i)]))
    {
        for mode in [RADIANCE, IMPORTANCE] {
            for lobe in [Lobes::ALL, Lobes::DIFFUSE_REFLECTION, Lobes::GLOSSY_REFLECTION, Lobes::TRANSMISSION] {
                let sum: Spectrum =
                    shares.map(|(model, share)| model.eval(wo, wi, lobe, mode) * share).into_iter().sum();
                let error = (sum - mixed.eval(wo, wi, lobe, mode)).abs().max_component();
                assert!(error <= 1e-6 * sum.max_component(), "{wo} {wi} {lobe:?}");
                let factor = if wo.z * wi.z > 0.0 { green } else { blue };
                let sum = sheet.eval(wo, wi, lobe, mode) * 0.75 + glass.eval(wo, wi, lobe, mode) * factor * 0.25;
                let error = (sum - tinted.eval(wo, wi, lobe, mode)).abs().max_component();
                assert!(error <= 2e-6 * sum.max_component(), "{wo} {wi} {lobe:?}");
            }
            let pdf: f32 = shares.iter().map(|(model, share)| model.pdf(wo, wi, mode) * share).sum();
            assert!((pdf - mixed.pdf(wo, wi, mode)).abs() <= 1e-6 * pdf);
            assert_eq!(tinted.pdf(wo, wi, mode), inner.pdf(wo, wi, mode));
        }
        // f = share / π on either side.
        let share = if wo.z * wi.z > 0.0 { 0.3 } else { 0.6 };
        let f = sheet.eval(wo, wi, Lobes::ALL, RADIANCE).max_component();
        assert!((f64::from(f) * PI / share - 1.0).abs() < 1e-6, "{wo} {wi}");
    }
    assert!(
        Bsdf::from(Mix::new(metal, red, 0.5)).is_anisotropic()
            && Bsdf::from(Mix::new(red, metal, 0.5)).is_anisotropic()
    );
    assert_eq!((tinted.fixed(), tinted.lobes()), (inner.fixed(), inner.lobes()));
    assert_eq!(Bsdf::from(Tinted::new(glass, green, blue)).fixed(), glass.fixed());
    // Delta lobes of a mixture keep their weight, and have the probability of their model.
    let glass: &Bsdf = Bsdf::from(crate::bsdf::Dielectric { eta: 1.5 }).kept();
    let mixed: Bsdf = Mix::new(red, glass, 0.25).into();
    let (wo, u) = (direction(0.5, 1.0), glam::vec2(0.3, 0.6));
    for uc in [0.0, 0.04, 0.2, 0.9] {
        let alone = glass.sample(wo, uc, u, RADIANCE).expect("a sample");
        let among = mixed.sample(wo, 0.75 + 0.25 * uc + 1e-6, u, RADIANCE).expect("a sample");
        assert_eq!((among.wi, among.weight, among.lobe, among.eta), (alone.wi, alone.weight, alone.lobe, alone.eta));
        assert_eq!(among.pdf, 0.25 * alone.pdf);
    }
}

#[test]
fn a_measured_table_has_the_values_that_it_was_made_from() {
    // The examples are tables of closed forms; away from grazing angles interpolation is off by less than a hundredth.
    let [paint, velvet] = <[Merl; 2]>::try_from(Merl::examples()).expect("two examples");
    let metal = RoughConductor::from_reflectance(Spectrum::new(0.8, 0.5, 0.2), 0.25, 0.25);
    let wide = Beckmann::new(0.6, 0.6);
    assert!(!wide.is_anisotropic());
    for (wo, wi) in above().into_iter().take(5).flat_map(|o| above().into_iter().take(5).map(move |i| (o, i))) {
        let value = |model: Bsdf| model.eval(wo, wi, Lobes::ALL, RADIANCE).to_array();
        for (ours, exact) in value(paint.into()).into_iter().zip(value(metal.into())) {
            assert!((ours - exact).abs() < 0.01 * exact + 1e-4, "{ours} for {exact}: {wo} {wi}");
        }
        let back = (vec3(-wo.x, -wo.y, wo.z) + wi).normalize();
        let lobe = 0.3 * ggx_d(0.6, 0.6, back.as_dvec3());
        for (ours, albedo) in value(velvet.into()).into_iter().zip([0.1, 0.2, 0.5]) {
            let exact = albedo / PI + lobe;
            assert!((f64::from(ours) - exact).abs() < 0.01 * exact, "{ours} for {exact}: {wo} {wi}");
        }
    }
}
