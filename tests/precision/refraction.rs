//! What passes through an interface.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Vec2, vec2};
use sampling::bsdf::{BsdfModel, Dielectric, Ggx, Lobes, RoughDielectric, TransportMode};

use super::facets::Published;
use super::scattering::dielectric;
use super::{Dice, TRIES, Worst, moved, single};

/// An index as unlike 1 as any, or nearly 1.
fn index(dice: &mut Dice) -> f32 {
    let eta = match dice.unit() {
        kind if kind < 0.5 => dice.magnitude(0.1, 10.0),
        kind if kind < 0.75 => 1.0 + dice.magnitude(1e-5, 0.1),
        _ => 1.0 - dice.magnitude(1e-5, 0.1),
    };
    eta as f32
}

/// A cosine, most often within a hundredth of where nothing passes any more into an index below 1.
fn cosine(dice: &mut Dice, eta: f64) -> f64 {
    let critical = (1.0 - eta * eta).max(0.0);
    match dice.unit() {
        kind if kind < 0.6 => (critical + (1.0 - critical) * 0.01 * dice.magnitude(1e-5, 1.0)).sqrt(),
        _ => f64::from(dice.share()),
    }
}

/// Snell's law in vectors, through a facet of the normal `m`.
fn refracted(wo: DVec3, m: DVec3, eta: f64) -> Option<DVec3> {
    let (wo, m) = (wo.normalize(), m.normalize());
    let across = wo.dot(m) * m - wo;
    let left = 1.0 - across.length_squared() / (eta * eta);
    (left > 0.0).then(|| across / eta - left.sqrt() * m)
}

/// What the rounding of the cosine to the normal `m` leaves to be known of a refracted direction: it goes with the root of what is left
/// to the critical angle.
fn condition(wo: DVec3, m: DVec3, wi: DVec3, eta: f64) -> f64 {
    let cos2 = wo.dot(m).powi(2).max((eta * eta - 1.0).abs());
    f64::from(f32::EPSILON) * (1.0 + 1.0 / eta + cos2 / (eta * eta * wi.dot(m).abs()))
}

const MODE: TransportMode = TransportMode::Importance;

/// The choice of what passes, wherever anything does.
const PASSES: f32 = 1.0_f32.next_down();

#[test]
fn smooth_refraction() {
    let mut dice = Dice::new(9);
    let mut worst = Worst::of("smooth refraction, by condition");
    for i in 0..TRIES {
        let (index, is_outside) = (index(&mut dice), i % 4 != 0);
        // Seen from the inside, the index is the inverse in single precision.
        let (eta, side) = if is_outside { (index, 1.0) } else { (1.0 / index, -1.0) };
        let eta = f64::from(eta);
        let (cos, turn) = (cosine(&mut dice, eta), DVec2::from_angle(TAU * dice.unit()));
        let wo = (turn * (1.0 - cos * cos).sqrt()).extend(side * cos).as_vec3();
        let (o, normal) = (wo.as_dvec3(), side * DVec3::Z);
        let Some(exact) = refracted(o, normal, eta) else { continue };
        let Some(sample) = (Dielectric { eta: index }).sample(wo, PASSES, Vec2::ZERO, MODE) else { continue };
        if sample.lobe == Lobes::DELTA_TRANSMISSION {
            let unit = condition(o, normal, exact, eta);
            worst.add_in((sample.wi.as_dvec3() - exact).length(), 0.0, unit, || format!("{wo}, index {eta}"));
        }
    }
    worst.finish(3.0);
}

#[test]
fn refraction_by_facets() {
    let mut dice = Dice::new(10);
    let mut worst = Worst::of("refraction by a facet, by condition");
    for _ in 0..TRIES {
        let (eta, alpha) = (index(&mut dice), dice.width(1e-4));
        let (wo, u) = (dice.direction(), vec2(dice.number(), dice.number()));
        let Some(sample) = RoughDielectric::new(eta, alpha, alpha).sample(wo, PASSES, u, MODE) else { continue };
        let (o, m, n) = (wo.as_dvec3(), Ggx::new(alpha, alpha).sample_visible(wo, u).as_dvec3(), f64::from(eta));
        let Some(exact) = refracted(o, m, n) else { continue };
        if sample.lobe == Lobes::GLOSSY_TRANSMISSION {
            let unit = condition(o, m, exact, n);
            worst.add_in((sample.wi.as_dvec3() - exact).length(), 0.0, unit, || format!("{wo} by {m}, index {eta}"));
        }
    }
    worst.finish(3.0);
}

/// An interface of GGX's facets as it is published.
struct Interface {
    eta: f64,
    alpha: f64,
}

impl Interface {
    /// Value [Walter07, (21)] and density [Walter07, (17)] of a refraction, where the two sides hide apart.
    fn refraction(&self, o: DVec3, i: DVec3) -> (f64, f64) {
        let (eta, widths) = (self.eta, DVec2::splat(self.alpha));
        let h = -(o + eta * i);
        let m = h.normalize() * h.z.signum();
        let (o_m, i_m) = (o.dot(m), -i.dot(m));
        if o_m <= 0.0 || i_m <= 0.0 {
            return (0.0, 0.0);
        }
        // From the thinner side, where 1 − F keeps its digits.
        let (cos, index) = if eta > 1.0 { (o_m, eta) } else { (i_m, 1.0 / eta) };
        let transmitted = dielectric(cos, index).map_or(0.0, |(_, transmitted)| transmitted);
        let common = transmitted * Published::Ggx.d(widths, m) * o_m * i_m * (eta / (o_m - eta * i_m)).powi(2);
        let [seen_o, seen_i] = [o, i].map(|w| Published::Ggx.area(widths, w));
        (common / (seen_o * seen_i), common / seen_o)
    }
}

#[test]
fn rough_refraction() {
    let mut dice = Dice::new(11);
    let [mut value, mut density, mut sampled] =
        ["value of a rough refraction", "density of a rough refraction", "density of a refracted sample"]
            .map(Worst::of);
    for i in 0..TRIES {
        let (eta, alpha) = (index(&mut dice), dice.width(1e-4));
        let (wo, u) = (dice.direction(), vec2(dice.number(), dice.number()));
        let glass = RoughDielectric::new(eta, alpha, alpha);
        let Some(sample) = glass.sample(wo, PASSES, u, MODE) else { continue };
        // Directions do not resolve what spreads over less.
        if sample.lobe != Lobes::GLOSSY_TRANSMISSION || (eta - 1.0).abs() * alpha < 1e-6 {
            continue;
        }
        let published = Interface { eta: f64::from(eta), alpha: f64::from(alpha) };
        let wi = if i % 4 == 0 { -dice.direction() } else { sample.wi };
        let at = || format!("{wo} to {wi}, width {alpha}, index {eta}");
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let (exact, exact_pdf) = published.refraction(o, i);
        let bears = |pick: fn((f64, f64)) -> f64| {
            moved(i, |i| pick(published.refraction(o, i))) + moved(o, |o| pick(published.refraction(o, i)))
        };
        let (f, pdf) = glass.eval_pdf(wo, wi, MODE);
        value.add_in(f64::from(f.to_array()[0]), exact, single(exact) + bears(|(f, _)| f), at);
        let unit = single(exact_pdf) + bears(|(_, pdf)| pdf);
        density.add_in(f64::from(pdf), exact_pdf, unit, at);
        if wi == sample.wi {
            sampled.add_in(f64::from(sample.pdf), exact_pdf, unit, at);
        }
    }
    value.finish(3.0);
    density.finish(5.0);
    sampled.finish(12.0);
}
