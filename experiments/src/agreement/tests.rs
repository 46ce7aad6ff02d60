use super::*;
use integrators::method::Pixel;
use integrators::scratch::Scratch;
use integrators::{Contribution, Estimator, Methods, Orders, Render, RenderSettings, Request, Sink, Wants};
use sampling::rng::{Stream, mix2};
use sampling::sampler::{Sampler, SamplerKind};
use scenes::Scene;
use serde::{Deserialize, Serialize};
use serde_json::json;

fn sample(mean: f64, variance: f64, n: u32) -> Sample {
    Sample { mean, variance, n }
}

#[test]
fn welch_is_that_of_the_textbook() {
    // scipy.stats.ttest_ind_from_stats(20.6, 9.62**.5, 11, 22.1, 0.58**.5, 11, equal_var=False):
    // t = −1.5577, Satterthwaite's 11.2 degrees of freedom.
    let test = welch(sample(20.6, 9.62, 11), sample(22.1, 0.58, 11), 0.0);
    assert!((test.t - 1.5577).abs() < 1e-4, "{test:?}");
    assert!((test.freedom - 11.203).abs() < 1e-2, "{test:?}");
    assert!((test.p - 0.1470).abs() < 1e-3, "{test:?}");
}

#[test]
fn where_there_is_no_variance_equality_to_rounding_is_asked_for() {
    let rounding = rounding(3);
    let equal = welch(sample(1.0, 0.0, 4), sample(1.0 + 0.5 * rounding, 0.0, 4), rounding);
    assert!(equal.exact && equal.p == 1.0 && equal.t == 0.0);
    let different = welch(sample(1.0, 0.0, 4), sample(1.0 + 2.0 * rounding, 0.0, 4), rounding);
    assert!(different.exact && different.p == 0.0);
    let black = welch(sample(0.0, 0.0, 4), sample(0.0, 0.0, 4), rounding);
    assert!(black.exact && black.p == 1.0);
}

#[test]
fn adjusted_values_are_those_of_r() {
    // p.adjust(c(0.01, 0.04, 0.03, 0.005, 0.5), "BH")
    let adjusted = benjamini_hochberg(&[0.01, 0.04, 0.03, 0.005, 0.5]);
    for (x, expected) in adjusted.iter().zip([0.025, 0.05, 0.05, 0.025, 0.5]) {
        assert!((x - expected).abs() < 1e-12, "{adjusted:?}");
    }
    assert!(benjamini_hochberg(&[]).is_empty());
}

#[test]
fn p_values_are_uniform_where_means_are_equal_and_the_detectable_bias_is_found() {
    let mut stream = Stream::new(mix2(1, 2), 3);
    let mut values = |n: usize, mean: f64| -> Moments {
        let mut normal = || (0..12).map(|_| f64::from(stream.next_f32())).sum::<f64>() - 6.0;
        (0..n).map(|_| mean + normal()).collect()
    };
    const RUNS: usize = 2000;
    let (mut small, mut found) = (0, 0);
    for _ in 0..RUNS {
        let (a, b) = (values(8, 0.0), values(8, 0.0));
        small += usize::from(welch((&a).into(), (&b).into(), 0.0).p < 0.05);
        // The true standard error is ½: at 14 degrees of freedom a level of 0.01 asks for 2.98, a power of 0.9 for 1.35 more.
        let b = values(8, 0.5 * (2.977 + 1.345));
        found += usize::from(welch((&a).into(), (&b).into(), 0.0).p < 0.01);
    }
    // Six standard deviations of a binomial count: false alarms below 10⁻⁸.
    let near =
        |count: usize, p: f64| (count as f64 - RUNS as f64 * p).abs() < 6.0 * (RUNS as f64 * p * (1.0 - p)).sqrt();
    assert!(near(small, 0.05), "{small} of {RUNS} p-values below 0.05");
    assert!(near(found, 0.88), "{found} of {RUNS} biases found");
}

/// `path`, with the contributions of some pixels dimmed.
#[derive(Serialize, Deserialize, Default)]
struct Dimmed {
    factor: f32,
    columns: u32,
    path: integrators::path::Path,
}

struct Dimmer<'s, S> {
    of: &'s Dimmed,
    out: &'s mut S,
}

impl<S: Sink> Sink for Dimmer<'_, S> {
    const WANTS: Wants = S::WANTS;

    fn add(&mut self, mut contribution: Contribution) {
        if contribution.raster.x < self.of.columns as f32 {
            contribution.value *= self.of.factor;
        }
        self.out.add(contribution);
    }
}

impl Estimator for Dimmed {
    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        self.path.estimate(scene, request, pixel, sampler, scratch, &mut Dimmer { of: self, out });
    }
}

/// The Cornell box by `path`, and by `path` dimmed in so many of 32 columns.
fn results(factor: f32, columns: u32) -> [MethodResult; 2] {
    let methods = Methods::standard().with::<Dimmed>("dimmed", "path, dimmed");
    let options = scenes::LoadOptions { size: Some((32, 32)), ..Default::default() };
    let scene = scenes::load("cornell_box", &options).unwrap();
    let run = |name: &str, settings: serde_json::Value| {
        let method = methods.build(name, &settings).unwrap();
        let settings = RenderSettings {
            samples_per_replicate: 16,
            ..crate::subject::render_settings(&*method, Orders::up_to(1), false, 3, SamplerKind::Independent)
        };
        let mut render = Render::new(&scene, &*method, settings).unwrap();
        (0..8).for_each(|_| render.run_replicate(&|_| {}));
        MethodResult {
            scene: scene.name.clone(),
            method: name.to_owned(),
            label: name.to_owned(),
            entry: String::new(),
            sampler: SamplerKind::Independent,
            settings: method.settings(),
            setting: String::new(),
            measurement: render.finish(),
            convergence: Vec::new(),
            missing_light: Vec::new(),
            skipped: Vec::new(),
        }
    };
    [run("path", json!({})), run("dimmed", json!({"factor": factor, "columns": columns}))]
}

/// Verdicts of order 1 between the two.
fn verdict(factor: f32, columns: u32) -> AgreementRow {
    let results = results(factor, columns);
    compare(&[&results[0], &results[1]]).swap_remove(1)
}

#[test]
fn means_that_coincide_by_chance_are_not_exact() {
    let mut results = results(1.0, 0);
    let mean = results[0].measurement.replicate_means[0][1][0];
    for (result, mean) in results.iter_mut().zip([mean, 1.003 * mean]) {
        result.measurement.replicate_means.iter_mut().for_each(|means| means[1] = [mean; 3]);
    }
    let row = compare(&[&results[0], &results[1]]).swap_remove(1);
    assert!((row.mean_b / row.mean_a - 1.003).abs() < 1e-9 && row.verdict == Verdict::Agree, "{row:?}");
    assert!(row.t.abs() < 3.0 && row.detectable_bias > 0.005, "{row:?}");
}

#[test]
fn a_bias_is_found_over_the_image_and_in_a_part_of_it() {
    let same = verdict(1.0, 0);
    assert_eq!((same.verdict, same.rejected), (Verdict::Agree, 0), "{same:?}");
    assert!(same.detectable_bias < 0.03, "{same:?}");
    let everywhere = verdict(0.95, 32);
    assert_eq!(everywhere.verdict, Verdict::Differ, "{everywhere:?}");
    // A quarter less in an eighth of the image, at its dark edge, moves the mean by less than can be found there.
    let locally = verdict(0.75, 4);
    assert_eq!(locally.verdict, Verdict::Differ, "{locally:?}");
    assert!(locally.rejected > 0, "{locally:?}");
}
