//! The laws of scattering, over every example of every model in the list.
//!
//! Deterministic laws are held to rounding: where a value depends on a direction more sharply than `f32` can say it (a
//! lobe of width 10⁻⁴), the bound is what moving the direction by one unit of rounding changes. Statistical laws state
//! their false-alarm rate, corrected for the number of tests by Šidák's formula. The seed is that of all tests.

mod by_chance;
mod delta;
mod parameters;
mod quadrature;

use crate::support;
pub use delta::delta_lobes;
use delta::distinct_delta_lobes;
use quadrature::Cells;
use sampling::bsdf::{Bsdf, BsdfSample, Ggx, Lobes, ModelEntry, TransportMode};
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind, StreamKey};
use sampling::warp::{cosine_hemisphere, uniform_sphere};
use sampling::{Spectrum, Vec2, Vec3, vec2, vec3};
use std::f32::consts::FRAC_PI_4;
use std::fmt;

const KINDS: [Lobes; 6] = [
    Lobes::DIFFUSE_REFLECTION,
    Lobes::GLOSSY_REFLECTION,
    Lobes::DELTA_REFLECTION,
    Lobes::DIFFUSE_TRANSMISSION,
    Lobes::GLOSSY_TRANSMISSION,
    Lobes::DELTA_TRANSMISSION,
];

/// The examples of all models; of one alone if `NEUMANN_BSDF` names it, for those who work on that one.
pub fn listed() -> Vec<(&'static str, Bsdf)> {
    let only = std::env::var("NEUMANN_BSDF").ok();
    let wanted = |entry: &&ModelEntry| only.as_ref().is_none_or(|only| only == entry.name);
    let named = |entry: &'static ModelEntry| (entry.examples)().into_iter().map(move |model| (entry.name, model));
    let all: Vec<_> = Bsdf::MODELS.iter().filter(wanted).flat_map(named).collect();
    assert!(!all.is_empty(), "no model is called {}", only.unwrap_or_default());
    all
}

/// Uniform numbers of a test: (uc, u) of draw `i` in case `case`.
struct Draws(Sampler);

impl Draws {
    fn new(law: &str) -> Self {
        Self(Sampler::new(
            SamplerKind::Independent,
            StreamKey::new(support::seed(), law, Role::Estimate, 0),
            1 << 24,
            (1, 1),
        ))
    }

    fn at(&mut self, case: usize, i: u32) -> (f32, Vec2) {
        self.0.start_sample(case as u64, i);
        (self.0.get_1d(Purpose::Lobe), self.0.get_2d(Purpose::Direction))
    }

    fn direction(&mut self, case: usize, i: u32) -> Vec3 {
        self.0.start_sample(case as u64, i);
        uniform_sphere(self.0.get_2d(Purpose::EmitterDirection))
    }
}

/// The direction at this cosine and azimuth.
fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    vec3(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Directions on both sides, from the normal to grazing.
fn test_directions() -> Vec<Vec3> {
    let cosines = [1.0, 0.99, 0.8, 0.5, 0.2, 0.05, 1e-2, 1e-4, 1e-7];
    cosines.into_iter().flat_map(|c| [direction(c, 0.4), direction(-c, 2.5)]).collect()
}

/// Numbers in the middle, at, and next to the borders of the unit interval.
const BORDERS: [f32; 5] = [0.0, 5.960_464_5e-8, 0.5, 0.73, 1.0_f32.next_down()];

/// Numbers by which a cosine-weighted direction lies opposite a direction, just above the horizon: [Shirley97]'s map, of the square to
/// the disk on which the hemisphere stands, backwards. Empty for the normal.
fn leading_to_the_opposite(w: Vec3) -> Vec<Vec2> {
    let (x, y) = (-w.x, -w.y);
    let of_radius = |r: f32| {
        let (a, b) = if x.abs() > y.abs() {
            let a = r.copysign(x);
            (a, a * (y / x).atan() / FRAC_PI_4)
        } else {
            let b = r.copysign(y);
            (b * (x / y).atan() / FRAC_PI_4, b)
        };
        let u = vec2(0.5 * (a + 1.0), 0.5 * (b + 1.0));
        let (there, length) = (cosine_hemisphere(u), x.hypot(y));
        assert!(
            (there.x - x / length).abs().max((there.y - y / length).abs()) < 2e-3,
            "{there:?} is not opposite {w:?}"
        );
        u
    };
    if x == 0.0 && y == 0.0 { Vec::new() } else { [1e-3, 1e-4, 1e-5, 1e-6].map(|inner| of_radius(1.0 - inner)).into() }
}

/// Directions on the same side whose components differ by a unit of rounding: of the component, or of a number near 1.
fn neighbours(w: Vec3, unit: fn(f32) -> f32) -> impl Iterator<Item = Vec3> {
    let steps = [Vec3::X * unit(w.x), Vec3::Y * unit(w.y), Vec3::Z * unit(w.z)];
    steps.into_iter().flat_map(move |step| [w + step, w - step]).filter(move |other| other.z * w.z > 0.0)
}

/// The rounding of results of arithmetic on a component.
const RELATIVE: fn(f32) -> f32 = |component| component.abs() * f32::EPSILON;
/// The rounding of components of computed unit vectors.
const ABSOLUTE: fn(f32) -> f32 = |_| f32::EPSILON;

/// How far `g(wo, wi)` moves when either direction is rounded.
fn rounding(wo: Vec3, wi: Vec3, unit: fn(f32) -> f32, g: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let value = g(wo, wi);
    let by_wo = neighbours(wo, unit).map(|wo| (g(wo, wi) - value).abs()).fold(0.0, f32::max);
    let by_wi = neighbours(wi, unit).map(|wi| (g(wo, wi) - value).abs()).fold(0.0, f32::max);
    by_wo + by_wi
}

/// Whether directions in `f32` are fine enough for the lobes that this direction sees: nine in ten of the densities of its samples
/// move by less than this part of themselves when the directions are rounded.
///
/// At roughness 10⁻⁴ and a cosine of 10⁻³ the lobe is narrower than what a direction can be told apart by, and a value at
/// a direction is a matter of luck. Samples and their weights are right even there.
fn is_resolved(model: &Bsdf, wo: Vec3, part: f32) -> bool {
    let mut draws = Draws::new("resolution");
    let mut errors: Vec<f32> = (0..99)
        .filter_map(|i| {
            let (uc, u) = draws.at(0, i);
            let wi = model.sample(wo, uc, u, TransportMode::Radiance)?.wi;
            let pdf = |wo, wi| model.pdf(wo, wi, TransportMode::Radiance);
            (pdf(wo, wi) > 0.0).then(|| rounding(wo, wi, ABSOLUTE, pdf) / pdf(wo, wi))
        })
        .collect();
    errors.sort_unstable_by(f32::total_cmp);
    let resolved = errors.get(errors.len() * 9 / 10).is_none_or(|error| *error < part);
    // The half vector moves by ε / (2 cos θ) with either direction, and the logarithm of a lobe of width α by 2 · 1.5 / α times as much
    // where the outermost tenth of its samples is: by 3 ε / (α cos θ) for both, with the narrowest lobe of all that are listed. By what
    // refracts that is 0.018 at any cosine, where the index is 1.5.
    let grazing = 3.0 * f32::EPSILON / (Ggx::MIN_ALPHA * part);
    assert!(resolved || wo.z.abs() < grazing, "not resolved at {wo:?}, which is not grazing: {model:?}");
    resolved
}

/// Pairs of directions to evaluate a model at: sampled ones, where its lobes are, and any.
fn pairs(model: &Bsdf, case: usize, draws: &mut Draws) -> Vec<(Vec3, Vec3)> {
    let mut pairs = Vec::new();
    for (i, wo) in test_directions().into_iter().enumerate() {
        for j in 0..48 {
            let (uc, u) = draws.at(case, (i * 48 + j) as u32);
            if let Some(sample) = model.sample(wo, uc, u, TransportMode::Radiance) {
                pairs.push((wo, sample.wi));
            }
            pairs.push((wo, draws.direction(case, (i * 48 + j) as u32)));
        }
        pairs.extend(test_directions().into_iter().map(|wi| (wo, wi)));
        pairs.extend([(wo, wo), (wo, -wo), (wo, Vec3::X), (Vec3::X, wo)]);
    }
    pairs
}

/// Everything a law looks at, with what a failure should name.
fn for_every_pair(law: &str, check: impl Fn(&Bsdf, Vec3, Vec3, fmt::Arguments)) {
    let mut draws = Draws::new(law);
    for (case, (name, model)) in listed().into_iter().enumerate() {
        for (wo, wi) in pairs(&model, case, &mut draws) {
            check(&model, wo, wi, format_args!("{name} {model:?}, wo {wo:?}, wi {wi:?}"));
        }
    }
}

/// Samples of every example from every test direction, in either mode.
fn for_every_sample(law: &str, check: impl Fn(&Bsdf, Vec3, TransportMode, BsdfSample, fmt::Arguments)) {
    let mut draws = Draws::new(law);
    for (case, (name, model)) in listed().into_iter().enumerate() {
        for (i, wo) in test_directions().into_iter().enumerate() {
            let at_random: Vec<_> = (0..200).map(|j| draws.at(case, (i * 200 + j) as u32)).collect();
            let at_borders = BORDERS
                .iter()
                .flat_map(|&uc| BORDERS.iter().flat_map(move |&x| BORDERS.iter().map(move |&y| (uc, vec2(x, y)))));
            let opposite = leading_to_the_opposite(wo).into_iter().flat_map(|u| BORDERS.map(|uc| (uc, u)));
            for (uc, u) in at_random.into_iter().chain(at_borders).chain(opposite) {
                for &mode in TransportMode::ALL {
                    if let Some(sample) = model.sample(wo, uc, u, mode) {
                        let what = format_args!("{name} {model:?}, wo {wo:?}, {mode:?}, {sample:?}");
                        check(&model, wo, mode, sample, what);
                    }
                }
            }
        }
    }
}

/// Whether two spectra agree to a relative error, or to an absolute one.
fn close(a: Spectrum, b: Spectrum, relative: f32, absolute: f32) -> bool {
    (a - b).abs().max_component() <= relative * a.max_component().max(b.max_component()) + absolute
}

fn is_transmission(wo: Vec3, wi: Vec3) -> bool {
    wo.z * wi.z < 0.0
}

#[test]
fn anisotropy_is_what_turning_shows() {
    // Turning both directions about the normal changes the value of an anisotropic model somewhere, of others nowhere.
    let turned = |w: Vec3| {
        let (sin, cos) = 0.9_f32.sin_cos();
        vec3(cos * w.x - sin * w.y, sin * w.x + cos * w.y, w.z)
    };
    let mut draws = Draws::new("anisotropy");
    for (case, (name, model)) in listed().into_iter().enumerate() {
        // At grazing angles the narrowest lobes are not resolved by directions in `f32`.
        let resolved = pairs(&model, case, &mut draws).into_iter().filter(|(wo, wi)| wo.z.abs().min(wi.z.abs()) > 0.01);
        let shown = { resolved }.find(|&(wo, wi)| {
            let value = |wo, wi| model.eval(wo, wi, Lobes::ALL, TransportMode::Radiance);
            let (here, there) = (value(wo, wi), value(turned(wo), turned(wi)));
            let slack = rounding(wo, wi, ABSOLUTE, |wo, wi| value(wo, wi).max_component());
            !close(here, there, 1e-2, 32.0 * slack)
        });
        assert_eq!(shown.is_some(), model.is_anisotropic(), "{name} {model:?}: {shown:?}");
    }
}

#[test]
fn values_and_densities_are_finite_and_not_negative() {
    for_every_pair("finite", |model, wo, wi, what| {
        for &mode in TransportMode::ALL {
            let f = model.eval(wo, wi, Lobes::ALL, mode);
            let pdf = model.pdf(wo, wi, mode);
            assert!(f.is_finite() && f.to_array().iter().all(|c| *c >= 0.0), "f = {f:?}: {what}");
            assert!(pdf.is_finite() && pdf >= 0.0, "pdf = {pdf}: {what}");
            assert!(pdf > 0.0 || f.is_zero(), "never sampled where f = {f:?}: {what}");
        }
    });
}

#[test]
fn values_by_lobe_sum_to_the_whole() {
    for_every_pair("lobes", |model, wo, wi, what| {
        for &mode in TransportMode::ALL {
            let whole = model.eval(wo, wi, Lobes::ALL, mode);
            let parts = KINDS.map(|kind| model.eval(wo, wi, kind, mode));
            assert!(close(whole, parts.into_iter().sum(), 1e-6, 0.0), "{whole:?} is not the sum of {parts:?}: {what}");
            assert!(model.eval(wo, wi, Lobes::NONE, mode).is_zero(), "{what}");
            for (kind, part) in KINDS.into_iter().zip(parts) {
                let allowed = model.lobes().contains(kind) && !kind.is_delta();
                let right_side = Lobes::TRANSMISSION.contains(kind) == is_transmission(wo, wi);
                assert!(part.is_zero() || (allowed && right_side), "{kind:?} has {part:?}: {what}");
            }
            assert_eq!(model.eval_pdf(wo, wi, mode), (whole, model.pdf(wo, wi, mode)), "{what}");
        }
    });
}

#[test]
fn densities_do_not_depend_on_the_mode() {
    for_every_pair("modes", |model, wo, wi, what| {
        let [radiance, importance] = [TransportMode::Radiance, TransportMode::Importance];
        assert_eq!(model.pdf(wo, wi, radiance), model.pdf(wo, wi, importance), "{what}");
    });
}

#[test]
fn scattering_is_reciprocal() {
    // f(wo, wi) = f*(wi, wo) by definition of the adjoint; for reflection also f = f*.
    for_every_pair("reciprocity", |model, wo, wi, what| {
        let value = |wo, wi, mode| model.eval(wo, wi, Lobes::ALL, mode);
        let forward = value(wo, wi, TransportMode::Radiance);
        let backward = value(wi, wo, TransportMode::Importance);
        let slack = rounding(wo, wi, RELATIVE, |wo, wi| value(wo, wi, TransportMode::Radiance).max_component());
        assert!(close(forward, backward, 2e-5, slack), "{forward:?} {backward:?} slack {slack}: {what}");
        if !is_transmission(wo, wi) {
            let adjoint = value(wo, wi, TransportMode::Importance);
            assert!(close(forward, adjoint, 1e-6, 0.0), "{forward:?} {adjoint:?}: {what}");
        }
    });
}

/// What a transmitted walk is scaled by [Veach97, section 5.2], for the relative index that it crosses.
fn scale(mode: TransportMode, eta: f32) -> f32 {
    match mode {
        TransportMode::Radiance => 1.0 / (eta * eta),
        TransportMode::Importance => 1.0,
    }
}

#[test]
fn radiance_is_scaled_by_the_square_of_the_index() {
    for_every_sample("index", |model, wo, mode, sample, what| {
        assert!(sample.eta > 0.0 && (sample.eta == 1.0 || Lobes::TRANSMISSION.contains(sample.lobe)), "{what}");
        let other = match mode {
            TransportMode::Radiance => TransportMode::Importance,
            TransportMode::Importance => TransportMode::Radiance,
        };
        let ratio = scale(other, sample.eta) / scale(mode, sample.eta);
        let value = |mode| model.eval(wo, sample.wi, sample.lobe, mode);
        assert!(close(value(mode) * ratio, value(other), 1e-5, 0.0), "{what}");
    });
}

#[test]
fn samples_are_what_they_say() {
    for_every_sample("samples", |model, wo, _, sample, what| {
        let BsdfSample { wi, weight, pdf, lobe, .. } = sample;
        assert!((wi.length() - 1.0).abs() < 1e-5, "not unit: {what}");
        assert!(weight.is_finite() && weight.to_array().iter().all(|c| *c >= 0.0), "bad weight: {what}");
        assert!(pdf.is_finite() && pdf > 0.0, "bad pdf: {what}");
        assert!(KINDS.contains(&lobe) && model.lobes().contains(lobe), "not a lobe of the model: {what}");
        assert!(wi.z != 0.0 && Lobes::TRANSMISSION.contains(lobe) == is_transmission(wo, wi), "wrong side: {what}");
    });
}

#[test]
fn weights_are_value_times_cosine_over_density() {
    for_every_sample("weights", |model, wo, mode, sample, what| {
        if sample.lobe.is_delta() {
            return;
        }
        let (f, pdf) = model.eval_pdf(wo, sample.wi, mode);
        let weight_of = |wi: Vec3, (f, pdf): (Spectrum, f32)| {
            if pdf > 0.0 { f * (wi.z.abs() / pdf) } else { Spectrum::ZERO }
        };
        let weight = weight_of(sample.wi, (f, pdf));
        let slack =
            rounding(wo, sample.wi, RELATIVE, |wo, wi| weight_of(wi, model.eval_pdf(wo, wi, mode)).max_component());
        assert!(close(weight, sample.weight, 1e-4, slack), "{weight:?} by eval, slack {slack}: {what}");
        let slack = rounding(wo, sample.wi, ABSOLUTE, |wo, wi| model.pdf(wo, wi, mode));
        let resolved = slack < 0.1 * pdf;
        assert!(!resolved || (pdf - sample.pdf).abs() <= 1e-4 * pdf + slack, "{pdf} by pdf, slack {slack}: {what}");
    });
}

#[test]
fn no_light_is_gained() {
    // ∫ f* |cos| dwi ≤ 1 at 64 angles, every day at a quarter of them, by quadrature over the sphere and, for delta lobes, over the choice.
    let mut draws = Draws::new("energy");
    let cosines = (0..60).map(|i| (i as f32 * 1.565 / 60.0).cos()).chain([1e-3, 1e-4, 1e-5, 1e-7]);
    let sides = [(1.0, 0.6), (-1.0, 3.9)].into_iter().cycle();
    let mut directions: Vec<Vec3> = cosines.zip(sides).map(|(cos, (side, phi))| direction(side * cos, phi)).collect();
    if !support::is_night() {
        // One of each side among eight, the first and the last too.
        directions =
            directions.into_iter().enumerate().filter(|(i, _)| i % 8 == 0 || i % 8 == 7).map(|(_, d)| d).collect();
    }
    let mut worst = Vec::new();
    for (case, (name, model)) in listed().into_iter().enumerate() {
        let mut largest = (0.0, Vec3::ZERO);
        for (i, &wo) in directions.iter().enumerate() {
            let albedo = albedo(&model, wo, |j| draws.at(case, (i << 12) as u32 + j));
            if albedo > largest.0 {
                largest = (albedo, wo);
            }
        }
        println!("{name:18} {:.6} at cos {:+.2e}  {model:?}", largest.0, largest.1.z);
        worst.push((largest, name, model));
    }
    for ((albedo, wo), name, model) in worst {
        let most = Bsdf::model(name).expect("a model of the list").max_albedo as f64;
        assert!(albedo <= most + 2e-4, "albedo {albedo} at {wo:?}: {name} {model:?}");
    }
}

/// Samples of a model for one direction.
const SAMPLES: u32 = 1 << 11;

/// What is scattered of the light from one direction, by the mean of samples that are all there were but for those of nothing: less
/// five standard errors, so that one in three million says too much by chance.
fn surely_scattered(samples: &[BsdfSample]) -> f64 {
    let n = f64::from(SAMPLES);
    let moment = |power: i32| samples.iter().map(|s| f64::from(s.weight.max_component()).powi(power)).sum::<f64>() / n;
    let mean = moment(1);
    mean - 5.0 * ((moment(2) - mean * mean).max(0.0) / n).sqrt()
}

/// The largest channel of the directional albedo for light that comes from `wo`.
fn albedo(model: &Bsdf, wo: Vec3, mut draw: impl FnMut(u32) -> (f32, Vec2)) -> f64 {
    // Those that shape the cells, which are cut until each holds one of them.
    let pilots = if support::is_night() { SAMPLES } else { SAMPLES / 8 };
    let mode = TransportMode::Importance;
    // Where azimuths matter by their difference alone, whatever its sign, half of them are the mirror image of the others.
    let is_symmetric = !model.is_anisotropic();
    let wo = if is_symmetric { vec3(wo.x.hypot(wo.y), 0.0, wo.z) } else { wo };
    let samples: Vec<BsdfSample> = (0..SAMPLES)
        .filter_map(|j| {
            let (uc, u) = draw(j);
            model.sample(wo, uc, u, mode)
        })
        .collect();
    let delta: Spectrum = distinct_delta_lobes(samples.iter().copied()).into_iter().map(|s| s.weight * s.pdf).sum();
    let delta = f64::from(delta.max_component());
    if model.lobes().is_delta() {
        return delta;
    }
    // Rounding moves the value at every node, and a narrow lobe has too few nodes for that to be lost in the mean: with 0.1 the sum was off
    // by up to 3·10⁻⁴. So what samples say has to do for widths of 10⁻⁴ below a cosine of some 0.1.
    if !is_resolved(model, wo, 0.03) {
        return surely_scattered(&samples);
    }
    let directions = samples.iter().take(pilots as usize).filter(|s| !s.lobe.is_delta()).map(|s| s.wi);
    let (cells, copies) = match is_symmetric {
        true => (Cells::half_by_samples(directions.map(|wi| vec3(wi.x, wi.y.abs(), wi.z)), 1), 2.0),
        false => (Cells::by_samples(directions, 2), 1.0),
    };
    let value = |wi: Vec3| [f64::from(model.eval(wo, wi, Lobes::ALL, mode).max_component() * wi.z.abs())];
    delta + copies * (0..cells.len()).map(|cell| cells.integrate(cell, 1e-5 / copies, value)[0]).sum::<f64>()
}
