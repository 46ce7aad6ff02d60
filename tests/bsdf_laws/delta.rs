//! Laws of delta lobes, which samples alone find.

use super::{BORDERS, close, for_every_sample, scale};
use sampling::bsdf::{Bsdf, BsdfSample, Lobes, TransportMode};
use sampling::{Spectrum, Vec3, vec2};

/// The delta lobes seen from `wo`, of which mixtures may have several of a kind; all that are likelier than 1/32.
pub fn delta_lobes(model: &Bsdf, wo: Vec3, mode: TransportMode) -> Vec<BsdfSample> {
    let choices = (0..64).map(|i| (i as f32 + 0.5) / 64.0).chain(BORDERS);
    distinct_delta_lobes(choices.filter_map(|uc| model.sample(wo, uc, vec2(0.5, 0.5), mode)))
}

/// The delta lobes among samples from one direction, each once: all samples of one are alike to the bit.
///
/// Two lobes of a mixture that are alike in all are taken for one; its examples have none.
pub fn distinct_delta_lobes(samples: impl Iterator<Item = BsdfSample>) -> Vec<BsdfSample> {
    let mut lobes = Vec::new();
    for sample in samples.filter(|sample| sample.lobe.is_delta()) {
        if !lobes.contains(&sample) {
            lobes.push(sample);
        }
    }
    lobes
}

#[test]
fn delta_lobes_are_seen_by_samples_only() {
    for_every_sample("delta", |model, wo, mode, sample, what| {
        if model.lobes().is_delta() {
            assert_eq!(model.eval_pdf(wo, sample.wi, mode), (Spectrum::ZERO, 0.0), "{what}");
        }
        assert_eq!(model.lobes().intersects(Lobes::DELTA) && sample.lobe.is_delta(), sample.lobe.is_delta(), "{what}");
    });
}

#[test]
fn delta_lobes_have_the_same_pmf_from_both_ends() {
    for_every_sample("both ends", |model, wo, mode, sample, what| {
        if !sample.lobe.is_delta() {
            return;
        }
        let adjoint = match mode {
            TransportMode::Radiance => TransportMode::Importance,
            TransportMode::Importance => TransportMode::Radiance,
        };
        // Of several lobes of a kind, as mixtures have, the one that leads back with the nearest probability.
        let unlikeness = |back: &BsdfSample| (back.wi - wo).length() + (back.pdf - sample.pdf).abs();
        let back = delta_lobes(model, sample.wi, adjoint)
            .into_iter()
            .filter(|back| back.lobe == sample.lobe && (back.eta * sample.eta - 1.0).abs() < 1e-6)
            .min_by(|a, b| unlikeness(a).total_cmp(&unlikeness(b)));
        // A lobe rarer than the grid of uc need not turn up.
        let Some(back) = back else {
            assert!(sample.pdf < 0.1, "no way back: {what}");
            return;
        };
        // Next to the critical angle the rounding of a cosine near 1 moves a grazing cosine by its inverse.
        let grazing = wo.z.abs().min(sample.wi.z.abs());
        let slack = 1e-6 + (4e-6 / grazing).min(1e-2);
        assert!((back.pdf - sample.pdf).abs() <= slack, "back: {back:?}: {what}");
        assert!((back.wi - wo).length() <= slack, "back: {back:?}: {what}");
        // The same light carried, seen from either end: f(wo, wi) = f*(wi, wo).
        let share = |s: &BsdfSample, mode: TransportMode| s.weight * (s.pdf / scale(mode, s.eta));
        assert!(close(share(&back, adjoint), share(&sample, mode), 1e-5, slack), "back: {back:?}: {what}");
    });
}
