//! The laws of scattering, asked of a model's examples in a second or so: what the laws of `tests/bsdf_laws.rs` ask at length.
//!
//! For a few directions on both sides: samples are what they say, values obey reciprocity and add up by lobes, and the density is that
//! of the samples, bin by bin of a grid over the sphere. Numbers are those of a grid, so that nothing is left to chance.

mod cells;
mod formulas;
mod principled;

use super::{Bsdf, BsdfModel, BsdfSample, Lobes, TransportMode};
use crate::math::Spectrum;
use crate::warp::uniform_sphere;
use cells::Cells;
use glam::{Vec2, Vec3, vec2, vec3};

const KINDS: [Lobes; 6] = [
    Lobes::DIFFUSE_REFLECTION,
    Lobes::GLOSSY_REFLECTION,
    Lobes::DELTA_REFLECTION,
    Lobes::DIFFUSE_TRANSMISSION,
    Lobes::GLOSSY_TRANSMISSION,
    Lobes::DELTA_TRANSMISSION,
];
const RADIANCE: TransportMode = TransportMode::Radiance;
const IMPORTANCE: TransportMode = TransportMode::Importance;

/// The direction of this cosine and azimuth.
fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    vec3(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Directions on both sides, from the normal to near grazing.
fn views() -> [Vec3; 5] {
    [direction(1.0, 0.0), direction(0.9, 0.4), direction(-0.6, 2.5), direction(0.3, -1.9), direction(-0.12, 5.0)]
}

/// How many numbers there are along either side of the square.
const SIDE: usize = 112;

/// Numbers to sample by: for the direction a place in each cell of a grid, for the choice of a lobe multiples of the golden ratio, which
/// are even along any run of cells.
fn numbers(i: usize) -> (f32, Vec2) {
    let even = |i: usize, step: f64| ((i as f64 + 0.5) * step).fract() as f32;
    let (column, row) = (i % SIDE, i / SIDE % SIDE);
    let (right, up) = (even(row, 0.754_877_666_246_692_7), even(column, 0.569_840_290_998_053_2));
    (even(i, 0.618_033_988_749_894_9), vec2(column as f32 + right, row as f32 + up) / SIDE as f32)
}

/// Some of those numbers, far from one another.
fn scattered(count: usize) -> impl Iterator<Item = (f32, Vec2)> {
    (0..count).map(move |i| numbers(i * 7919 % (SIDE * SIDE)))
}

/// The length of a unit of rounding of a unit vector's components.
const UNIT: f32 = f32::EPSILON;

/// How far `g(wo, wi)` moves when a component of either direction is rounded.
fn rounding(wo: Vec3, wi: Vec3, g: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let value = g(wo, wi);
    let steps = || [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [UNIT * axis, -UNIT * axis]);
    let by_wo = steps().map(|step| (g(wo + step, wi) - value).abs()).fold(0.0, f32::max);
    let by_wi = steps().map(|step| (g(wo, wi + step) - value).abs()).fold(0.0, f32::max);
    by_wo + by_wi
}

/// Whether two spectra agree to a part of the larger, or to an absolute error.
fn close(a: Spectrum, b: Spectrum, relative: f32, absolute: f32) -> bool {
    (a - b).abs().max_component() <= relative * a.max_component().max(b.max_component()) + absolute
}

fn is_proper(x: Spectrum) -> bool {
    x.is_finite() && x.to_array().iter().all(|channel| *channel >= 0.0)
}

/// A model in a direction's light.
#[derive(Clone, Copy, Debug)]
struct Case {
    model: Bsdf,
    wo: Vec3,
}

impl Case {
    fn sample(&self, (uc, u): (f32, Vec2), mode: TransportMode) -> Option<BsdfSample> {
        self.model.sample(self.wo, uc, u, mode)
    }

    /// Directions that light goes on in.
    fn some(&self, count: usize) -> impl Iterator<Item = BsdfSample> {
        scattered(count).filter_map(|numbers| self.sample(numbers, RADIANCE))
    }

    /// Of samples that are not delta, where the lobe is wide enough to be resolved by directions in `f32`.
    fn density_is_resolved(&self) -> bool {
        let pdf = |wo, wi| self.model.pdf(wo, wi, RADIANCE);
        let narrow = self
            .some(32)
            .filter(|s| !s.lobe.is_delta())
            .filter(|s| rounding(self.wo, s.wi, pdf) > 2e-3 * s.pdf)
            .count();
        narrow < 4
    }
}

/// What a sample says of itself is what the model says of its direction.
fn a_sample_is_what_it_says(case: &Case, sample: &BsdfSample, mode: TransportMode) {
    let Case { model, wo } = case;
    let BsdfSample { wi, weight, pdf, lobe, eta } = *sample;
    let what = format_args!("{sample:?} {mode:?} of {case:?}").to_string();
    assert!((wi.length() - 1.0).abs() < 1e-5 && is_proper(weight), "{what}");
    assert!(pdf.is_finite() && pdf > 0.0 && eta > 0.0, "{what}");
    assert!(KINDS.contains(&lobe) && model.lobes().contains(lobe), "{what}");
    let passes = wi.z * wo.z < 0.0;
    assert!(wi.z != 0.0 && Lobes::TRANSMISSION.contains(lobe) == passes && (passes || eta == 1.0), "{what}");
    if lobe.is_delta() {
        // Reflection and Snell's law: what lies along the surface turns about the normal and is divided by the index.
        assert!(pdf <= 1.0 && (wi.truncate() * eta + wo.truncate()).length() < 1e-6, "{what}");
        return;
    }
    let (f, density) = model.eval_pdf(*wo, wi, mode);
    assert!(f == model.eval(*wo, wi, Lobes::ALL, mode) && density == model.pdf(*wo, wi, mode), "{what}");
    let slack = 2.0 * rounding(*wo, wi, |wo, wi| model.pdf(wo, wi, mode));
    assert!((density - pdf).abs() <= 1e-4 * pdf + slack, "{density}, to {slack}: {what}");
    let weight_of = |wo: Vec3, wi: Vec3| {
        let (f, pdf) = model.eval_pdf(wo, wi, mode);
        if pdf > 0.0 { f * (wi.z.abs() / pdf) } else { Spectrum::ZERO }
    };
    let by_value = weight_of(*wo, wi);
    let slack = 2.0 * rounding(*wo, wi, |wo, wi| weight_of(wo, wi).max_component());
    assert!(close(by_value, weight, 2e-4, slack), "{by_value:?}, to {slack}: {what}");
}

fn samples_are_what_they_say(case: &Case) {
    let [low, high] = [0.0, 1.0_f32.next_down()];
    let ends = [low, 0.5, high];
    let corners = ends.into_iter().flat_map(|uc| ends.into_iter().flat_map(move |x| ends.map(|y| (uc, vec2(x, y)))));
    for mode in [RADIANCE, IMPORTANCE] {
        for (uc, u) in corners.clone().chain(scattered(48)) {
            if let Some(sample) = case.sample((uc, u), mode) {
                a_sample_is_what_it_says(case, &sample, mode);
            }
        }
        let along = Case { wo: case.wo.with_z(0.0).normalize_or(Vec3::X), ..*case };
        assert_eq!(along.sample((0.3, vec2(0.4, 0.7)), mode), None, "{along:?}");
    }
}

/// Values at a pair of directions: by lobes, by mode and from either end.
fn values_are_consistent(case: &Case, wi: Vec3) {
    let Case { model, wo } = *case;
    let what = format_args!("{case:?} to {wi:?}").to_string();
    let value = |wo, wi, mode| model.eval(wo, wi, Lobes::ALL, mode);
    let whole = value(wo, wi, RADIANCE);
    let pdf = model.pdf(wo, wi, RADIANCE);
    assert!(is_proper(whole) && pdf.is_finite() && pdf >= 0.0, "{whole:?} {pdf}: {what}");
    assert!(pdf > 0.0 || whole.is_zero(), "never sampled: {what}");
    assert_eq!(pdf, model.pdf(wo, wi, IMPORTANCE), "{what}");
    let parts = KINDS.map(|kind| model.eval(wo, wi, kind, RADIANCE));
    assert!(close(whole, parts.into_iter().sum(), 1e-6, 0.0), "{parts:?}: {what}");
    assert!(model.eval(wo, wi, Lobes::NONE, RADIANCE).is_zero(), "{what}");
    let passes = wo.z * wi.z < 0.0;
    for (kind, part) in KINDS.into_iter().zip(parts) {
        let may_be = model.lobes().contains(kind) && !kind.is_delta() && Lobes::TRANSMISSION.contains(kind) == passes;
        assert!(part.is_zero() || may_be, "{kind:?} has {part:?}: {what}");
    }
    let slack = 2.0 * rounding(wo, wi, |wo, wi| value(wo, wi, RADIANCE).max_component());
    let (back, adjoint) = (value(wi, wo, IMPORTANCE), value(wo, wi, IMPORTANCE));
    assert!(close(whole, back, 2e-5, slack), "{whole:?} {back:?}: {what}");
    assert!(passes || close(whole, adjoint, 1e-6, 0.0), "{whole:?} {adjoint:?}: {what}");
}

/// How far the shares of samples and the integrals may be from one another.
const SLACK: f64 = 6e-3;

/// The density is that of the samples, and their weights add up to what is scattered, in every bin.
fn samples_are_distributed_as_said(case: &Case, max_albedo: f32) {
    const SAMPLES: usize = SIDE * SIDE;
    let Case { model, wo } = *case;
    let samples: Vec<BsdfSample> = (0..SAMPLES).filter_map(|i| case.sample(numbers(i), IMPORTANCE)).collect();
    // Each delta lobe with its count: they differ in kind, direction or probability.
    let mut deltas: Vec<(BsdfSample, usize)> = Vec::new();
    let mut spread = Vec::new();
    for sample in samples {
        if !sample.lobe.is_delta() {
            spread.push(sample);
        } else if let Some((_, count)) = deltas.iter_mut().find(|(other, _)| *other == sample) {
            *count += 1;
        } else {
            deltas.push((sample, 1));
        }
    }
    let share = |count: usize| count as f64 / SAMPLES as f64;
    for (delta, count) in &deltas {
        let seen = share(*count);
        assert!((seen - f64::from(delta.pdf)).abs() < SLACK, "{seen} of {delta:?}: {case:?}");
    }
    let of_deltas: f64 = deltas.iter().map(|(s, _)| f64::from(s.weight.max_component() * s.pdf)).sum();
    if spread.is_empty() || !case.density_is_resolved() {
        assert!(of_deltas < f64::from(max_albedo) + 1e-5, "{of_deltas}: {case:?}");
        return;
    }
    let pilots: Vec<Vec3> = spread.iter().step_by(spread.len().div_ceil(128)).map(|s| s.wi).collect();
    let cells = Cells::by(&pilots);
    let (mut shares, mut weights) = (vec![0.0; cells.bins()], vec![0.0; cells.bins()]);
    for sample in &spread {
        let bin = cells.bin(sample.wi);
        shares[bin] += share(1);
        weights[bin] += f64::from(sample.weight.mean()) * share(1);
    }
    let integrals = cells.integrals(|wi| {
        let (f, pdf) = model.eval_pdf(wo, wi, IMPORTANCE);
        [f64::from(pdf), f64::from(f.mean() * wi.z.abs())]
    });
    let scale = f64::from(spread.iter().map(|s| s.weight.mean()).fold(1.0, f32::max));
    for (bin, [mass, scattered]) in integrals.iter().enumerate() {
        let what = format_args!("bin {bin} of {} of {case:?}", integrals.len()).to_string();
        assert!((shares[bin] - mass).abs() < SLACK, "{} for {mass}: {what}", shares[bin]);
        assert!((weights[bin] - scattered).abs() < scale * SLACK, "{} for {scattered}: {what}", weights[bin]);
    }
    let sum = |k: usize| integrals.iter().map(|integral| integral[k]).sum::<f64>();
    let seen = share(spread.len());
    assert!((sum(0) - seen).abs() < SLACK, "{} for {seen}: {case:?}", sum(0));
    let albedo = sum(1) + deltas.iter().map(|(s, _)| f64::from(s.weight.mean() * s.pdf)).sum::<f64>();
    assert!(albedo < f64::from(max_albedo) + 2e-3, "{albedo}: {case:?}");
}

/// Turning both directions about the normal changes something of what is anisotropic alone.
fn anisotropy_is_what_turning_shows(model: &Bsdf) {
    let turn = |w: Vec3| {
        let (sin, cos) = 0.9_f32.sin_cos();
        vec3(cos * w.x - sin * w.y, sin * w.x + cos * w.y, w.z)
    };
    let changes = |wo: Vec3, wi: Vec3| {
        let value = |wo, wi| model.eval(wo, wi, Lobes::ALL, RADIANCE);
        let slack = 32.0 * rounding(wo, wi, |wo, wi| value(wo, wi).max_component());
        !close(value(wo, wi), value(turn(wo), turn(wi)), 1e-2, slack)
    };
    let found = views().into_iter().any(|wo| {
        let case = Case { model: *model, wo };
        case.some(64).any(|s| s.wi.z.abs() > 0.02 && changes(wo, s.wi))
    });
    assert_eq!(found, model.is_anisotropic(), "{model:?}");
}

/// Asks all laws of the examples of a model.
pub(super) fn hold_for<M: BsdfModel>()
where
    Bsdf: From<M>,
{
    let examples = M::examples();
    assert!(!examples.is_empty(), "{}", M::NAME);
    for model in examples.into_iter().map(Bsdf::from) {
        assert!(!model.lobes().is_empty() && model.survival() > 0.0 && model.survival() <= 1.0, "{model:?}");
        let scatters = views().into_iter().any(|wo| Case { model, wo }.some(24).count() > 0);
        assert!(scatters, "nothing is sampled: {model:?}");
        anisotropy_is_what_turning_shows(&model);
        for wo in views() {
            let case = Case { model, wo };
            samples_are_what_they_say(&case);
            let any = views().into_iter().flat_map(|w| [w, -w]).chain(scattered(12).map(|(_, u)| uniform_sphere(u)));
            case.some(24).map(|s| s.wi).chain(any).for_each(|wi| values_are_consistent(&case, wi));
            samples_are_distributed_as_said(&case, M::MAX_ALBEDO);
        }
    }
}
